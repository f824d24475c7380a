"""Certificates as results: one that is to be written, one that was checked, a gauge that came with one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.dcc.files import check_certificate_name, write_certificate
from stepgauge.dcc.gauge_read import GaugeImport, write_gauge
from stepgauge.dcc.read import EXAMPLE, NOMINAL, Document
from stepgauge.dcc.results import read_errors
from stepgauge.dcc.write import FACE
from stepgauge.files.display import Summarized, join_lines
from stepgauge.files.outputs import open_set

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
