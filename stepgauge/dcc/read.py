"""A Digital Calibration Certificate as plain data: who, what, when, and its quantities with units and uncertainties.

The schema leaves units as free text and uncertainties as optional; both are checked here, with line and XPath.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepgauge.dcc.units import CELSIUS_ZERO_K, TEMPERATURE, Dimension, SiUnit, describe, parse_unit
from stepgauge.dcc.xml import DCC, SI, Element, find, find_all, place, read_xml, short, text_of
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array

MEASURED, ERROR = "basic_measuredValue", "basic_measurementError"
EXAMPLE = "stepgauge_example"
"""Kind of the statement that a certificate is invented for demonstration."""
NOMINAL, REFERENCE = "basic_nominalValue", "basic_referenceValue"
WRAPPER = "measurementUncertaintyUnivariate"
FORMS = (
    ("expandedUnc", "uncertainty", False, True),
    ("expandedMU", "valueExpandedMU", True, True),
    ("coverageInterval", "standardUnc", False, False),
    ("standardMU", "valueStandardMU", True, False),
    ("coverageIntervalMU", "valueStandardMU", True, False),
)
"""How D-SI states an uncertainty, until 2.1 and (wrapped) since 2.2: tag, tag of the value, wrapped, expanded."""
QUANTITIES = ("quantity", "itemQuantity", "measuringEquipmentQuantity")


@dataclass(frozen=True)
class Quantity:
    """Numbers with a unit; ``expanded`` and ``k`` have one entry per value, None where nothing is stated.

    ``part`` is where it stands: results, influenceConditions, items, measuringEquipments or another part.
    """

    name: str
    kinds: tuple[str, ...]
    part: str
    values: Array
    unit_text: str
    unit: SiUnit
    expanded: Array | None
    k: Array | None
    probability: Array | None
    path: str
    where: str
    group: str

    def is_kind(self, kind: str) -> bool:
        """Whether this is of a kind or of one derived from it (``basic_measurementError_error``)."""
        return any(one == kind or one.startswith(f"{kind}_") for one in self.kinds)

    def is_of(self, dimension: Dimension) -> bool:
        """Whether the values have a unit of this dimension."""
        return self.unit.dimension == dimension

    def scaled(self, dimension: Dimension, factor: float) -> Array:
        """The values in a unit of ``factor`` SI units; :class:`InputError` for another dimension."""
        self._check(dimension)
        offset = CELSIUS_ZERO_K if self.unit.celsius and dimension == TEMPERATURE else 0.0
        return (self.values * self.unit.factor + offset) / factor

    def expanded_scaled(self, dimension: Dimension, factor: float) -> Array:
        """The expanded uncertainties in such a unit; :class:`InputError` where they are missing."""
        self._check(dimension)
        if self.expanded is None:
            raise InputError(self.where, f"{self.name} has no uncertainty", expected="si:expandedUnc")
        return self.expanded * self.unit.factor / factor

    def _check(self, dimension: Dimension) -> None:
        if self.unit.dimension != dimension:
            found = f"unit {self.unit_text} ({describe(self.unit.dimension)})"
            raise InputError(self.where, f"{self.name} has a wrong unit", found=found, expected=describe(dimension))


@dataclass(frozen=True)
class Document:
    """What a certificate says; None where it does not. ``marks``: kinds of its statements."""

    path: str
    version: str
    number: str | None
    performed_to: datetime.date | None
    laboratory: str | None
    customer: str | None
    item: str | None
    manufacturer: str | None
    model: str | None
    serial: str | None
    quantities: tuple[Quantity, ...]
    texts: tuple[tuple[str, str], ...]
    marks: frozenset[str]

    def select_kind(self, kind: str) -> list[Quantity]:
        """Quantities of this ``refType`` or one derived from it."""
        return [one for one in self.quantities if one.is_kind(kind)]


def read_document(path: str | Path) -> Document:
    """Read and check a DCC.

    :class:`InputError` for unsafe or broken XML, another root, units that are not D-SI, lists of unequal length,
    uncertainties that are negative, coverage factors below 1, and results without an uncertainty.
    """
    return parse_document(read_xml(path), path)


def _check_performed(core: Element | None, path: str | Path) -> None:
    """:class:`InputError` for a calibration that ends before it begins."""
    begin, end = (_date(core, f"dcc:{name}PerformanceDate", path) for name in ("begin", "end"))
    if begin is not None and end is not None and end < begin:
        what = "the calibration ends before it begins"
        raise InputError(path, what, found=f"endPerformanceDate {end}", expected=f"{begin} or later")


def parse_document(root: Element, path: str | Path) -> Document:
    """As :func:`read_document`, from the root of a tree."""
    if root.tag != f"{{{DCC}}}digitalCalibrationCertificate":
        expected = "a Digital Calibration Certificate (dcc:digitalCalibrationCertificate)"
        raise InputError(path, "another kind of XML", found=short(root.tag), expected=expected)
    version = root.get("schemaVersion", "")
    if not version.startswith("3."):
        raise InputError(path, "schemaVersion is not known", found=repr(version), expected="3.x")
    quantities = _quantities(root, path)
    _check_results(quantities)
    core, data = find(root, "dcc:administrativeData/dcc:coreData"), find(root, "dcc:administrativeData")
    _check_performed(core, path)
    item = find(root, "dcc:administrativeData/dcc:items/dcc:item")
    statements = find_all(root, "dcc:administrativeData/dcc:statements/dcc:statement")
    return Document(
        str(path),
        version,
        text_of(core, "dcc:uniqueIdentifier"),
        _date(core, "dcc:endPerformanceDate", path),
        text_of(data, "dcc:calibrationLaboratory/dcc:contact/dcc:name"),
        text_of(data, "dcc:customer/dcc:name"),
        text_of(item, "dcc:name"),
        text_of(item, "dcc:manufacturer/dcc:name"),
        text_of(item, "dcc:model"),
        _serial(item),
        tuple(quantities),
        tuple(_texts(root)),
        frozenset(kind for one in statements for kind in (one.get("refType") or "").split()),
    )


def _date(core: Element | None, route: str, path: str | Path) -> datetime.date | None:
    text = text_of(core, route)
    if text is None:
        return None
    try:
        return datetime.date.fromisoformat(text[:10])
    except ValueError:
        raise InputError(path, f"{route.removeprefix('dcc:')} is not a date", found=repr(text)) from None


def _serial(item: Element | None) -> str | None:
    """The number that the manufacturer gave, or else the first one."""
    if item is None:
        return None
    known = find_all(item, "dcc:identifications/dcc:identification")
    made = [one for one in known if text_of(one, "dcc:issuer") == "manufacturer"]
    return text_of((made or known)[0], "dcc:value") if known else None


def _texts(root: Element) -> list[tuple[str, str]]:
    """Named texts among the quantities, e.g. the material of an item."""
    found = []
    for tag in QUANTITIES:
        for one in root.iter(f"{{{DCC}}}{tag}"):
            name, text = text_of(one, "dcc:name"), text_of(one, "dcc:noQuantity")
            if name and text:
                found.append((name, text))
    return found


def _quantities(root: Element, path: str | Path) -> list[Quantity]:
    found = []
    for element in root.iter(*(f"{{{DCC}}}{tag}" for tag in QUANTITIES)):
        numbers = [one for one in _numbers(element) if one is not None]
        if numbers:
            found.append(_quantity(element, numbers[0], path))
    return found


def _numbers(element: Element) -> list[Element | None]:
    """The numbers of a quantity; of a hybrid all its forms, which say the same in several units."""
    direct = [find(element, "si:real"), find(element, "si:realListXMLList")]
    hybrid = find(element, "si:hybrid")
    return (
        direct if hybrid is None else [*direct, *find_all(hybrid, "si:real"), *find_all(hybrid, "si:realListXMLList")]
    )


def _check_results(quantities: list[Quantity]) -> None:
    """Results have an uncertainty (ISO/IEC 17025:2017, 7.8.4.1 a): every error, or else what was measured beside it."""
    results = [one for one in quantities if one.part == "results"]
    sure = {one.group for one in results if one.expanded is not None}
    for one in results:
        measured = one.is_kind(MEASURED) and one.group not in sure
        if one.expanded is None and (one.is_kind(ERROR) or measured):
            expected = "si:expandedUnc with its coverage factor"
            raise InputError(one.where, f"{one.name} is a result without an uncertainty", expected=expected)


def _quantity(element: Element, numbers: Element, path: str | Path) -> Quantity:
    single = numbers.tag == f"{{{SI}}}real"
    where = place(numbers, path)
    name = text_of(element, "dcc:name") or element.get("refType") or "a quantity"
    values = _floats(numbers, "value" if single else "valueXMLList", name, path)
    if values is None or not values.size:
        raise InputError(where, f"{name} has no value", expected="si:value")
    unit_text, unit = _unit(numbers, "unit" if single else "unitXMLList", name, path)
    expanded, k, probability = _uncertainty(numbers, single, name, len(values), path)
    kinds = tuple((element.get("refType") or "").split())
    part = _part(element)
    group = element.getroottree().getpath(element.getparent())
    return Quantity(name, kinds, part, values, unit_text, unit, expanded, k, probability, str(path), where, group)


def _unit(numbers: Element, tag: str, name: str, path: str | Path) -> tuple[str, SiUnit]:
    element = find(numbers, f"si:{tag}")
    texts = ((element.text or "") if element is not None else "").split()
    if not texts:
        raise InputError(place(numbers, path), f"{name} has no unit", expected=f"si:{tag}")
    if len(set(texts)) > 1:
        raise InputError(place(element, path), f"{name} has several units", found=" ".join(texts[:3]), expected="one")
    try:
        return texts[0], parse_unit(texts[0])
    except ValueError as error:
        raise InputError(place(element, path), f"{name} has a wrong unit: {error}", expected="a D-SI unit") from None


def _uncertainty(
    numbers: Element, single: bool, name: str, count: int, path: str | Path
) -> tuple[Array | None, Array | None, Array | None]:
    """Uncertainty, k and coverage probability by value; a standard uncertainty has k = 1."""
    tail = "" if single else "XMLList"
    form = _form(numbers, tail)
    if form is None:
        return None, None, None
    found, value_tag, is_expanded = form
    where, u = place(found, path), _floats(found, value_tag + tail, name, path)
    k = _floats(found, f"coverageFactor{tail}", name, path) if is_expanded else np.ones(1)
    p = _floats(found, f"coverageProbability{tail}", name, path) if is_expanded else None
    if u is None or k is None or not u.size or not k.size:
        raise InputError(where, f"the uncertainty of {name} is not complete", expected="uncertainty and coverageFactor")
    if (u < 0).any() or (k < 1).any():
        raise InputError(where, f"the uncertainty of {name} is impossible", found=f"U {u.min():g}, k {k.min():g}")
    probability = None if p is None else _spread(p, count, name, where)
    return _spread(u, count, name, where), _spread(k, count, name, where), probability


def _form(numbers: Element, tail: str) -> tuple[Element, str, bool] | None:
    """The element of the uncertainty, the tag of its value and whether it is an expanded one; None without."""
    for tag, value_tag, wrapped, is_expanded in FORMS:
        found = find(numbers, f"si:{WRAPPER}{tail}/si:{tag}{tail}" if wrapped else f"si:{tag}{tail}")
        if found is not None:
            return found, value_tag, is_expanded
    return None


def _spread(values: Array, count: int, name: str, where: str) -> Array:
    """One value for all, or as many as there are."""
    if len(values) not in (1, count):
        found, expected = f"{len(values)} uncertainties or coverage factors", f"1 or {count}"
        raise InputError(where, f"{name} has lists of unequal length", found=found, expected=expected)
    return np.broadcast_to(values, count).copy()


def _floats(element: Element, tag: str, name: str, path: str | Path) -> Array | None:
    found = find(element, f"si:{tag}")
    if found is None:
        return None
    values = []
    for word in (found.text or "").split():
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(place(found, path), f"{name} is not a number", found=repr(word))
        values.append(value)
    return np.array(values, float)


def _part(element: Element) -> str:
    """The part of the certificate that a quantity stands in; metadata of a result are not results."""
    parts = ("measurementMetaData", "results", "influenceConditions", "items", "measuringEquipments", "statements")
    for parent in element.iterancestors():
        name = short(parent.tag).removeprefix("dcc:")
        if name in parts:
            return name
    return "other"
