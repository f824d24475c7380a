"""Certificates as results: one that is to be written, one that was checked, a gauge that came with one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.dcc.elements import to_bytes
from stepgauge.dcc.gauge_read import GaugeImport, write_gauge
from stepgauge.dcc.read import ERROR, EXAMPLE, NOMINAL, Document, Quantity, parse_document
from stepgauge.dcc.units import LENGTH, NUMBER
from stepgauge.dcc.write import ERRORS, FACE, machine_certificate
from stepgauge.dcc.xml import Element, parse_xml, validate
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.display import Summarized, join_lines
from stepgauge.files.outputs import open_set
from stepgauge.files.text import read_bytes, replacing
from stepgauge.reports.content import Sources

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class WrittenCertificate:
    """The XML of a certificate, and the schema that it is validated against when it is written."""

    root: Any
    schema: str | Path | None = None

    def __repr__(self) -> str:
        return f"Digital Calibration Certificate; {self.summary()}"

    def summary(self) -> str:
        """Whether it is valid by a schema."""
        return f"valid by {self.schema}" if self.schema else "to be read back when it is written"

    def write(self, path: str | Path) -> None:
        """Write the certificate, NAME.xml, read back and validated before it counts."""
        check_certificate_name(path)
        write_certificate(path, self.root, self.schema)


@dataclass(frozen=True, repr=False)
class CheckedCertificate(Summarized):
    """A certificate that was read and checked."""

    document: Document
    schema: str | Path | None = None

    def summary(self) -> str:
        """Who states what of which item, the results, and whether units and uncertainties are complete."""
        found = self.document
        lines = [
            f"DCC {found.version}, number {found.number}, laboratory {found.laboratory}",
            f"item: {found.item}, {found.manufacturer} {found.model or ''}, serial number {found.serial}",
        ]
        if EXAMPLE in found.marks:
            lines.append("an example: the certificate says that it is no real calibration")
        own = bool(found.select_kind("stepgauge_effectiveRadius"))
        lines += _errors(found) if own else _quantities(found)
        results = [one for one in found.quantities if one.part == "results" and one.expanded is None]
        unsure = [one.name for one in results if not any(one.is_kind(kind) for kind in (FACE, NOMINAL))]
        values = f"units are complete; values without an uncertainty: {', '.join(unsure)}"
        complete = "units and uncertainties are complete" if own or not unsure else values
        return join_lines(*lines, complete + (f", valid by {self.schema}" if self.schema else ""))

    def to_frame(self) -> pd.DataFrame:
        """One row per value of the results: quantity, number, value and unit, expanded uncertainty if any."""
        import pandas as pd

        rows = [
            (one.name, i, value, one.unit_text, None if one.expanded is None else one.expanded[i])
            for one in self.document.quantities
            if one.part == "results"
            for i, value in enumerate(one.values)
        ]
        return pd.DataFrame(rows, columns=["quantity", "number", "value", "unit", "expanded"])


def _errors(document: Document) -> Iterator[str]:
    """What a certificate of ours states: effective radii, and each list of errors by its last face."""
    radii, lists = read_errors(document)
    for radius in radii:
        yield f"R_eff {radius.r_eff_mm:.5f} mm, U {radius.expanded_mm * 1e3:.2f} um (k = {radius.k:.2f})"
    for one in lists:
        if len(one.face):
            yield (
                f"{one.name.upper()}: {len(one.face)} faces; at face {one.face[-1]} ({one.position_mm[-1]:.3f} mm)"
                f" {one.value_um[-1]:.2f} um, U {one.expanded_um[-1]:.2f} um (k = {one.k[-1]:.2f})"
            )


def _quantities(document: Document) -> Iterator[str]:
    """The results of any other certificate."""
    for one in document.quantities:
        if one.part == "results" and FACE not in one.kinds:
            sure = "no uncertainty" if one.expanded is None else f"U up to {one.expanded.max():g}"
            yield f"{one.name}: {len(one.values)} values in {one.unit_text}, {sure}"


@dataclass(frozen=True, repr=False)
class GaugeFromCertificate:
    """What a gauge's certificate gives for its file, and where each value comes from."""

    found: GaugeImport

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Each value with its place in the certificate."""
        return join_lines(*self.found.report)

    def write(self, path: str | Path) -> tuple[Path, Path]:
        """Write ``NAME.toml`` and ``NAME.csv``, after the gauge reader has accepted both; returns the paths."""
        with open_set():
            write_gauge(path, self.found)
        return Path(path), Path(path).with_suffix(".csv")


@dataclass(frozen=True)
class ErrorList:
    """One kind of error (``xf``, ``xb``, ``xm``, ``xr``) of one placement; arrays have one entry per face."""

    name: str
    face: NDArray[np.int64]
    position_mm: Array
    value_um: Array
    expanded_um: Array
    k: Array
    group: str


@dataclass(frozen=True)
class Radius:
    """The effective radius of one placement, mm."""

    r_eff_mm: float
    expanded_mm: float
    k: float


def read_errors(document: Document) -> tuple[list[Radius], list[ErrorList]]:
    """Radii and lists of errors in the order of the certificate.

    :class:`InputError` where the certificate has none (it is of something else), or with a wrong unit.
    """
    radii = [_radius(one) for one in document.select_kind("stepgauge_effectiveRadius")]
    lists = []
    for name, (_, kind) in ERRORS.items():
        lists += [_list(document, name, one) for one in document.select_kind(kind)]
    if not radii and not lists:
        raise InputError(document.path, "not a certificate of a machine measured with a step gauge", expected=FACE)
    return radii, lists


def _radius(one: Quantity) -> Radius:
    value, expanded = one.scaled(LENGTH, 1e-3), one.expanded_scaled(LENGTH, 1e-3)
    assert one.k is not None
    return Radius(float(value[0]), float(expanded[0]), float(one.k[0]))


def _list(document: Document, name: str, one: Quantity) -> ErrorList:
    face, position = (_list_beside(document, one, kind) for kind in (FACE, "stepgauge_position"))
    if ERROR not in one.kinds:
        raise InputError(one.where, f"{one.name} is not marked as a result", expected=f"refType {ERROR}")
    value, expanded = one.scaled(LENGTH, 1e-6), one.expanded_scaled(LENGTH, 1e-6)
    assert one.k is not None
    faces = face.scaled(NUMBER, 1.0).astype(int)
    return ErrorList(name, faces, position.scaled(LENGTH, 1e-3), value, expanded, one.k, one.group)


def _list_beside(document: Document, one: Quantity, kind: str) -> Quantity:
    """The list of the same table that says where the values belong."""
    found = [other for other in document.select_kind(kind) if other.group == one.group]
    if len(found) != 1 or len(found[0].values) != len(one.values):
        size = len(found[0].values) if len(found) == 1 else 0
        expected = f"a list {kind} of {len(one.values)} values beside it"
        raise InputError(
            one.where, f"{one.name} cannot be assigned to faces", found=f"{size} values", expected=expected
        )
    return found[0]


def certificate_of(evaluation: dict[str, Any], sources: Sources) -> Element:
    """The certificate of a machine from an evaluation and what :func:`stepgauge.reports.sources.read_sources` gave.

    ValueError without gauge, budget or laboratory; :class:`InputError` names what else a DCC demands.
    """
    if sources.gauge is None or sources.budget is None or sources.laboratory is None:
        raise ValueError("a certificate needs a gauge, a budget and what the laboratory states")
    return machine_certificate(
        evaluation, sources.budget, sources.laboratory, sources.gauge, sources.machine, sources.mpe
    )


def write_certificate(path: str | Path, root: Element, schema: str | Path | None = None) -> None:
    """Write a certificate after it was read back and, with ``schema`` (dcc.xsd), validated; :class:`InputError`."""
    data = to_bytes(root)
    again = parse_xml(data, path)
    parse_document(again, path)
    if schema is not None:
        validate(again, schema, path)
    with replacing(path) as beside:
        beside.write_bytes(data)


def check_certificate_name(path: str | Path) -> None:
    """Before any work: a certificate is an .xml file."""
    if Path(path).suffix.lower() != ".xml":
        raise InputError(path, "not a certificate's name", expected="NAME.xml")


def read_pdf(path: str | Path) -> bytes:
    """The printed certificate, to be put into the digital one."""
    data = read_bytes(path)
    if not data.startswith(b"%PDF-"):
        raise InputError(path, "not a PDF file", expected="the printed certificate")
    return data
