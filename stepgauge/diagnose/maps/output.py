"""Files of a map's diagnosis: JSON for programs, Markdown for people, the changed probe file, figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import tomli_w
from jinja2.sandbox import ImmutableSandboxedEnvironment

from stepgauge.diagnose.maps.candidates import GAUGE_KINDS
from stepgauge.diagnose.maps.model import build_probe
from stepgauge.diagnose.maps.result import MapDiagnosis, as_json
from stepgauge.diagnose.solve import Estimate
from stepgauge.files import read_text, write_text
from stepgauge.probes.directions_map import map_directions
from stepgauge.resources import folder as shipped_folder
from stepgauge.tables import write_table

COVERAGE = 2.0
PROBE_FILE = "probe.diagnosed.toml"
_PRETRAVEL_FILE = "probe.diagnosed.csv"
_OF_LAWS = ("constant_um", "lobe_azimuth_deg", "law_um", "pretravel_um", "amplitude_um", "phase_deg")


def write_map_diagnosis(found: MapDiagnosis, probe_path: str, folder: str | Path, suffix: str = "png") -> list[Path]:
    """Write all files into a folder, which is made if it is missing; returns their paths."""
    from stepgauge.figures.probe_diagnosis import draw_before_after

    target = Path(folder)
    said = as_json(found) | {"inputs": {"map": found.data.path, "probe": probe_path}}
    figure = target / f"before-after.{suffix}"
    write_text(target / "diagnosis.json", json.dumps(said, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    draw_before_after(found, figure)
    _write_probe(found, target)
    write_text(target / "diagnosis.md", report_text(said, figure.name))
    return [target / name for name in ("diagnosis.json", "diagnosis.md", PROBE_FILE)] + [figure]


def report_text(said: dict[str, Any], figure: str) -> str:
    """``diagnosis.md`` from the content of ``diagnosis.json``."""
    source = shipped_folder("templates") / "reports" / "probe-diagnosis.md.j2"
    environment = ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    environment.filters.update(sig=_significant, plus_minus=_plus_minus, words=lambda name: name.replace("_", " "))
    return environment.from_string(read_text(source)).render(d=said, figure=figure, coverage=COVERAGE)


def _significant(value: float | None, digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _plus_minus(parameter: dict[str, Any]) -> str:
    """Value and expanded uncertainty, with two digits of the uncertainty."""
    value, u, unit = parameter["value"], parameter["u"], parameter["unit"]
    unit = "" if unit == "1" else f" {unit}"
    if not u:
        return f"{value:.4g}{unit}"
    decimals = max(1 - int(np.floor(np.log10(COVERAGE * u))), 0)
    return f"{value:.{decimals}f} ± {COVERAGE * u:.{decimals}f}{unit}"


def _write_probe(found: MapDiagnosis, target: Path) -> None:
    table = _plain(found.table)
    if table["model"] == "triangular":
        table = _as_map(table, target)
    head = "# The probe with what its map says of it; see diagnosis.md.\n"
    for finding in found.findings:
        where = "the force gauge's, not in this file" if finding.kind in GAUGE_KINDS else "changed here"
        values = ", ".join(f"{name} = {_short(p)}" for name, p in finding.parameters.items())
        head += f"# {finding.label.replace('_', ' ')}: {values} ({where})\n"
    write_text(target / PROBE_FILE, head + tomli_w.dumps({"probe": table}))


def _short(parameter: Estimate) -> str:
    return f"{parameter.value:.4g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")


def _as_map(table: dict[str, Any], target: Path) -> dict[str, Any]:
    """A law that probe files do not have, as a map beside the file."""
    found = map_directions(build_probe(table, ""), np.arange(0.0, 181.0, 5.0), np.arange(0.0, 360.0, 3.0))
    polar, azimuth, _, _, pretravel = found.columns()
    rows = [
        [f"{cell:.6g}" for cell in row] for row in zip(polar.ravel(), azimuth.ravel(), pretravel.ravel(), strict=True)
    ]
    write_table(target / _PRETRAVEL_FILE, ("polar_deg", "azimuth_deg", "pretravel_um"), rows)
    kept = {key: value for key, value in table.items() if key not in _OF_LAWS}
    return {**kept, "model": "table", "map": _PRETRAVEL_FILE}


def _plain(value: Any) -> Any:
    """As TOML takes it, floats with eight significant digits."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items() if part is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return float(f"{value:.8g}") if isinstance(value, float) else value
