"""A gauge certificate that arrives as a DCC, as a gauge file: what was found in it, and what only the user knows.

Laboratories lay out certificates differently. Positions are looked for by their kind (``refType`` of the good-practice
rules) and, where that says nothing, by their name; what is not found must be stated, and two candidates are an error.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.conditions import Conditions, require_statement
from stepgauge.conditions.certificate import table_conditions
from stepgauge.dcc.elements import one_line
from stepgauge.dcc.gauge_write import (
    CORRELATION,
    EXPANSION,
    FREEDOM,
    HEIGHT,
    PROPORTIONAL,
    RAIL_HEIGHT,
    RAIL_WIDTH,
    REFERENCE_TEMPERATURE,
    WIDTH,
)
from stepgauge.dcc.read import ERROR, EXAMPLE, MEASURED, NOMINAL, Document, Quantity, read_document
from stepgauge.dcc.units import CELSIUS_ZERO_K, LENGTH, NUMBER, TEMPERATURE
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.text import one_set, write_sealed, write_text
from stepgauge.gauge.certified import MAX_DEVIATION_MM, Gauge, read_gauge
from stepgauge.importing.tables.vocabulary import signs_of

SUBTRACTIONS = {1: "measured-nominal", -1: "nominal-measured"}
"""How deviations are subtracted, by the sign with which they are added to nominal positions."""
PER_TEMPERATURE = (0, -1, 0, 0)
_NOMINAL = re.compile(r"nominal|nenn", re.IGNORECASE)
_DEVIATION = re.compile(r"deviation|error|abweichung", re.IGNORECASE)
_EXPANSION = re.compile(r"expansion|ausdehnung", re.IGNORECASE)
_REFERENCE = re.compile(r"reference.{0,80}temperature|bezugstemperatur|referenztemperatur", re.IGNORECASE)
_WIDTH = re.compile(r"block.{0,80}width|width.{0,80}block", re.IGNORECASE)
_HEIGHT = re.compile(r"block.{0,80}height|height.{0,80}block", re.IGNORECASE)
_MATERIAL = re.compile(r"^(material|werkstoff)", re.IGNORECASE)


@dataclass(frozen=True)
class StatedGauge:
    """What the user states; None: look for it in the certificate. Units as in the gauge file."""

    name: str | None = None
    serial: str | None = None
    material: str | None = None
    expansion_per_K: float | None = None
    expansion_uncertainty_per_K: float | None = None
    reference_temperature_C: float | None = None
    block_width_mm: float | None = None
    block_height_mm: float | None = None
    positions: str | None = None
    nominal: str | None = None
    deviations: str | None = None


@dataclass
class GaugeImport:
    """The two files and, line by line, where their content comes from; ``made_from``: what that is, in words."""

    table: dict[str, Any] = field(default_factory=dict)
    certificate: dict[str, Any] = field(default_factory=dict)
    rows: list[tuple[int, float, float, float]] = field(default_factory=list)
    report: list[str] = field(default_factory=list)
    made_from: str = "a Digital Calibration Certificate"


def import_gauge(path: str | Path, wanted: StatedGauge | None = None) -> GaugeImport:
    """Read a gauge certificate.

    :class:`InputError` where the DCC is broken or unsafe, has no positions with uncertainties or several lists that
    could be them, has a wrong unit, or where something is neither in it nor stated (all of that at once, with options).
    """
    document, wanted = read_document(path), wanted or StatedGauge()
    if document.select_kind("stepgauge_effectiveRadius"):
        item = f"{document.item}, serial number {document.serial}"
        raise InputError(path, "this is the certificate of a machine", found=item, expected="that of a step gauge")
    found = GaugeImport()
    _faces(document, wanted, found)  # what has no positions is no gauge, whatever else it lacks
    _certificate(document, found)
    _table(document, wanted, found)
    _ours(document, found)
    return found


def write_gauge(path: str | Path, found: GaugeImport) -> Gauge:
    """Write ``NAME.toml`` and ``NAME.csv``, after the gauge reader has accepted both; returns the gauge.

    What stands out in it (a face unlike the others, an expansion that is not the material's) is put into the report.
    """
    target = Path(path)
    if target.suffix.lower() != ".toml":
        raise InputError(target, "not a gauge file", found=repr(target.suffix), expected="NAME.toml")
    csv_path = target.with_suffix(".csv")
    toml_text, csv_text = _format(found, csv_path.name)
    with one_set():
        write_text(csv_path, csv_text)
        write_sealed(target, toml_text)
        try:
            gauge = read_gauge(target)
        except InputError as error:
            what = f"the certificate gives no gauge: {error.what}"
            raise InputError(error.where, what, found=error.found, expected=error.parts[3]) from None
        conditions = Conditions(tuple(table_conditions(gauge)))
        require_statement(conditions, target)
    found.report += [f"note: {note}" for note in conditions.notes]
    return gauge


def _format(found: GaugeImport, csv_name: str) -> tuple[str, str]:
    import tomli_w

    tables = {"gauge": {**found.table, "faces": csv_name}, "certificate": found.certificate}
    said = "".join(f"# {one_line(line)}\n" for line in found.report)
    rows = [f"{face},{nominal:.12g},{position:.12g},{u:.9g}" for face, nominal, position, u in found.rows]
    csv_text = "\n".join(["face,nominal_mm,position_mm,uncertainty_um", *rows]) + "\n"
    return f"# Made from {found.made_from}.\n{said}{tomli_w.dumps(tables)}", csv_text


def _table(document: Document, wanted: StatedGauge, found: GaugeImport) -> None:
    expansion = _one(document, EXPANSION, _EXPANSION, lambda q: q.is_of(PER_TEMPERATURE))
    alpha = None if expansion is None else float(expansion.scaled(PER_TEMPERATURE, 1.0)[0])
    u_alpha = None
    if expansion is not None and expansion.expanded is not None and expansion.k is not None:
        u_alpha = float(expansion.expanded_scaled(PER_TEMPERATURE, 1.0)[0] / expansion.k[0])
    material = next((text for name, text in document.texts if _MATERIAL.search(name)), None)
    values = (
        ("name", wanted.name, document.item or document.model),
        ("serial", wanted.serial, document.serial),
        ("material", wanted.material, material),
        ("expansion_per_K", wanted.expansion_per_K, alpha),
        ("expansion_uncertainty_per_K", wanted.expansion_uncertainty_per_K, u_alpha),
        (
            "reference_temperature_C",
            wanted.reference_temperature_C,
            _temperature(document),
        ),
        ("block_width_mm", wanted.block_width_mm, _size(document, WIDTH, _WIDTH)),
        ("block_height_mm", wanted.block_height_mm, _size(document, HEIGHT, _HEIGHT)),
    )
    missing = [key for key, stated, read in values if stated is None and read is None]
    if missing:
        stated_as = {"expansion_uncertainty_per_K": "u_expansion_per_K"}  # of the key, as a verb takes it
        missing = [stated_as.get(key, key) for key in missing]
        expected = naming(*missing, words=", ".join(["{}"] * len(missing)))
        raise InputError(document.path, "the certificate does not say all of a gauge file", expected=expected)
    for key, stated, read in values:
        found.table[key] = read if stated is None else stated
        found.report.append(f"{key} = {found.table[key]}: {'from the certificate' if stated is None else 'as stated'}")
        if stated is not None and read is not None and stated != read:
            found.report[-1] += f" (the certificate says {read})"


def _one(document: Document, kind: str, name: re.Pattern[str], fits: Callable[[Quantity], bool]) -> Quantity | None:
    """The single value of a kind or else of a name; of the kind with a wrong unit it is an error."""
    marked = [one for one in document.select_kind(kind) if len(one.values) == 1]
    if marked:
        return marked[0]
    named = [one for one in document.quantities if len(one.values) == 1 and name.search(one.name) and fits(one)]
    return named[0] if named else None


def _temperature(document: Document) -> float | None:
    one = _one(document, REFERENCE_TEMPERATURE, _REFERENCE, lambda q: q.is_of(TEMPERATURE))
    return None if one is None else round(float(one.scaled(TEMPERATURE, 1.0)[0]) - CELSIUS_ZERO_K, 6)


def _size(document: Document, kind: str, name: re.Pattern[str]) -> float | None:
    one = _one(document, kind, name, lambda q: q.is_of(LENGTH))
    return None if one is None else float(one.scaled(LENGTH, 1e-3)[0])


def _certificate(document: Document, found: GaugeImport) -> None:
    stated = (("number", document.number), ("laboratory", document.laboratory), ("date", document.performed_to))
    missing = [name for name, value in stated if value is None]
    if missing:
        raise InputError(document.path, "the certificate lacks what every DCC has", expected=", ".join(missing))
    found.certificate.update(stated)
    if EXAMPLE in document.marks:
        found.certificate["example"] = True
        found.report.append("the certificate says that it is an example, not a real calibration")
    found.report.append(f"certificate {document.number} of {document.laboratory}, {document.performed_to}")


def _faces(document: Document, wanted: StatedGauge, found: GaugeImport) -> None:
    lists = [one for one in document.quantities if one.part == "results" and len(one.values) > 2]
    measured = _measured(document, lists, wanted.positions)
    nominal = _nominal(lists, measured, wanted.nominal)
    sign = _sign(measured, wanted.deviations)
    position_mm = measured.scaled(LENGTH, 1e-3)
    nominal_mm = None if nominal is None else nominal.scaled(LENGTH, 1e-3)
    if sign:
        if nominal_mm is None:
            what = f"{measured.name} are deviations without nominal positions beside them"
            raise InputError(
                measured.where, what, expected=naming("nominal", words="a list of them, or {} with its name")
            )
        position_mm = nominal_mm + sign * position_mm
        found.report.append(f"{measured.name!r} are deviations, {SUBTRACTIONS[sign].replace('-', ' minus ')}")
    expanded_um, k = measured.expanded_scaled(LENGTH, 1e-6), measured.k
    assert k is not None
    if not expanded_um.any():
        expected = "expanded uncertainties above 0, for no calibration is without"
        raise InputError(measured.where, "all uncertainties of the positions are zero", expected=expected)
    found.report.append(f"positions, uncertainties and k: {measured.name!r}, {_short(measured)}")
    if nominal_mm is None:
        nominal_mm = np.round(position_mm)
        _check_whole(position_mm, nominal_mm, measured)
        found.report.append("nominal positions: not found; the positions rounded to whole mm")
    elif nominal is not None:
        found.report.append(f"nominal positions: {nominal.name!r}, {_short(nominal)}")
    factor = float(k[0])
    if len(set(k)) > 1:
        found.report.append(f"coverage factors differ: uncertainties are given for k = {factor:g}")
    found.certificate["coverage_factor"] = factor
    columns = _count_from_face_1(nominal_mm, position_mm, expanded_um / k * factor, found)
    found.rows = [(face, *(float(v) for v in row)) for face, row in enumerate(zip(*columns, strict=True), 1)]  # type: ignore[misc]


def _sign(measured: Quantity, asked: str | None) -> int:
    """+1 for deviations that are measured minus nominal, -1 for the other order, 0 for positions.

    By the name (:mod:`stepgauge.importing.tables.vocabulary`); a kind of measurement error is measured minus nominal
    (VIM 2.16). :class:`InputError` where kind and name contradict each other.
    """
    if measured.is_kind(MEASURED) and asked is None:
        return 0
    error = measured.is_kind(ERROR)
    signs = signs_of(measured.name, bool(_DEVIATION.search(measured.name))) | ({1} if error else set())
    if asked is not None:
        signs = {sign for sign, name in SUBTRACTIONS.items() if name == asked}
    if len(signs) > 1:
        expected = naming("deviations", words=f"{{}} {' or '.join(SUBTRACTIONS.values())}")
        what = "kind and name of the deviations contradict each other" if error else "the name contradicts itself"
        raise InputError(measured.where, what, found=repr(measured.name), expected=expected)
    return next(iter(signs), 0)


def _ours(document: Document, found: GaugeImport) -> None:
    """What a gauge file may state and only certificates of ours have a place for."""
    known = (
        (RAIL_WIDTH, found.table, "rail_width_mm", LENGTH, 1e-3),
        (RAIL_HEIGHT, found.table, "rail_height_mm", LENGTH, 1e-3),
        (CORRELATION, found.certificate, "correlation", NUMBER, 1.0),
        (PROPORTIONAL, found.certificate, "proportional_um_per_m", NUMBER, 1e-6),
        (FREEDOM, found.certificate, "degrees_of_freedom", NUMBER, 1.0),
    )
    for kind, into, key, dimension, factor in known:
        for one in document.select_kind(kind)[:1]:
            value = round(float(one.scaled(dimension, factor)[0]), 9)
            into[key] = _within(value, found) if kind == PROPORTIONAL else value
            found.report.append(f"{key} = {into[key]:.9g}: from the certificate")


def _within(um_per_m: float, found: GaugeImport) -> float:
    """A part of U that is larger than U only by the digits that U is printed with is as large as U."""
    faces = [(position * 1e-3, u_um) for _, _, position, u_um in found.rows if position > 0.0]
    over = any(um_per_m * metres > u_um + 1e-6 for metres, u_um in faces)
    return um_per_m if over else min([um_per_m, *(u_um / metres for metres, u_um in faces)])


def _short(one: Quantity) -> str:
    """Line and XPath without the file: a gauge file does not tell where the certificate lay."""
    return f"line {one.where.removeprefix(one.path + ':')}"


def _check_whole(position_mm: Array, nominal_mm: Array, measured: Quantity) -> None:
    off = np.abs(position_mm - nominal_mm)
    if off.max() > MAX_DEVIATION_MM:
        found = f"{position_mm[off.argmax()]:.4f} mm"
        expected = naming("nominal", words="positions near whole mm, or {} with the list of nominal positions")
        raise InputError(measured.where, "no nominal positions were found", found=found, expected=expected)


def _measured(document: Document, lists: Sequence[Quantity], asked: str | None) -> Quantity:
    """The list of positions: the one asked for, or the only one of lengths with uncertainties."""
    if asked is not None:
        named = [one for one in lists if asked in (one.name, *one.kinds)]
        if len(named) == 1:
            return named[0]
        single = naming("positions", words=f"{{}}: no single list {asked!r}")
        raise InputError(document.path, single, expected=_names(lists))
    wrong = [one for one in lists if one.is_kind(MEASURED) and not one.is_of(LENGTH)]
    if wrong:
        wrong[0].scaled(LENGTH, 1e-3)  # raises, naming place and unit
    sure = [one for one in lists if one.is_of(LENGTH) and one.expanded is not None and not one.is_kind(NOMINAL)]
    marked = [one for one in sure if one.is_kind(MEASURED)] or sure
    if len(marked) != 1:
        what = "several lists could be the positions" if marked else "no list of lengths has uncertainties"
        several = naming("positions", words=f"{{}} with one of {_names(marked)}")
        hint: object = several if marked else "positions of the faces with si:expandedUnc"
        raise InputError(document.path, what, found=f"{len(marked)} of {len(lists)} lists", expected=hint)
    return marked[0]


def _nominal(lists: Sequence[Quantity], measured: Quantity, asked: str | None) -> Quantity | None:
    beside = [one for one in lists if one is not measured and len(one.values) == len(measured.values)]
    if asked is not None:
        named = [one for one in beside if asked in (one.name, *one.kinds)]
        if len(named) != 1:
            what = naming("nominal", words=f"{{}}: no single list {asked!r}")
            raise InputError(measured.where, what, expected=_names(beside))
        return named[0]
    marked = [one for one in beside if one.is_kind(NOMINAL)]
    return next(iter(marked or [one for one in beside if one.is_of(LENGTH) and _NOMINAL.search(one.name)]), None)


def _names(lists: Sequence[Quantity]) -> str:
    return ", ".join(sorted({repr(one.name) for one in lists})) or "none"


def _count_from_face_1(nominal: Array, position: Array, u_um: Array, found: GaugeImport) -> tuple[Array, Array, Array]:
    """Counted from face 1; where the certificate leaves face 1 out, it is the origin without uncertainty."""
    if len(position) % 2:
        found.report.append("face 1 is not in the list: it is taken as the origin, position 0 with uncertainty 0")
        return np.r_[0.0, nominal], np.r_[0.0, position], np.r_[0.0, u_um]
    if position[0] != 0.0 or nominal[0] != 0.0:
        found.report.append(f"positions refer to face 1: {position[0]:g} mm subtracted")
    return nominal - nominal[0], position - position[0], u_um
