"""Files of the diagnosis of a map: JSON for programs, Markdown to read, the changed probe file, figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS
from stepgauge.diagnosis.maps.model import build_probe
from stepgauge.diagnosis.maps.result import OUTLIERS, MapDiagnosis
from stepgauge.diagnosis.maps.rows import map_row_table
from stepgauge.diagnosis.maps.to_json import map_diagnosis_json
from stepgauge.diagnosis.output.rows import ROWS_FILE, rows_csv
from stepgauge.files.tables import csv_text
from stepgauge.files.text import write_json, write_sealed
from stepgauge.probes.directions_map import map_directions

PROBE_FILE = "probe.diagnosed.toml"
_PRETRAVEL_FILE = "probe.diagnosed.csv"
_OF_LAWS = ("constant_um", "lobe_azimuth_deg", "more_um", "pretravel_um", "amplitude_um", "phase_deg")


def write_map_diagnosis(found: MapDiagnosis, probe_path: str, folder: str | Path, suffix: str = "png") -> list[Path]:
    """Write all files into a folder, which is made if it is missing; returns their paths, the JSON first.

    Nothing is written before all is computed, and every file appears only when complete.
    """
    from stepgauge.figures.probe_diagnosis import draw_map_diagnosis, figure_names
    from stepgauge.reports.diagnosis import diagnosis_story
    from stepgauge.reports.render import markdown

    target = Path(folder)
    said = map_diagnosis_json(found, probe_path, target)
    texts = {
        "diagnosis.md": markdown(diagnosis_story(said, figure_names(found, suffix))),
        ROWS_FILE: rows_csv(map_row_table(found)),
        **_probe_files(found),
    }
    write_json(target / "diagnosis.json", said)
    for name, text in texts.items():
        write_sealed(target / name, text)
    return [target / "diagnosis.json", *(target / name for name in texts), *draw_map_diagnosis(target, found, suffix)]


def _probe_files(found: MapDiagnosis) -> dict[str, str]:
    """The changed probe file, and a map file if it needs one, by name."""
    table, beside = _plain(found.table), {}
    if table.get("model") == "triangular":
        table, beside[_PRETRAVEL_FILE] = _map_table(table)
    return {PROBE_FILE: _head(found) + tomli_w.dumps({"probe": table}), **beside}


def _head(found: MapDiagnosis) -> str:
    lines = ["# The probe with what its map says of it; see diagnosis.md."]
    for finding in found.findings:
        values = ", ".join(f"{name} = {_short(p)}" for name, p in finding.parameters.items())
        if finding.kind == OUTLIERS:
            lines.append(f"# rows of the map left out as outliers: {int((~found.kept).sum())}")
            continue
        where = "the force gauge's, not in this file" if finding.kind in GAUGE_KINDS else "changed here"
        lines.append(f"# {finding.label.replace('_', ' ')}: {values} ({where})")
    lines += [f"# without a law, and not in this file: {form.where}" for form in found.forms]
    return "\n".join(lines) + "\n"


def _short(parameter: Estimate) -> str:
    return f"{parameter.value:.4g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")


def _map_table(table: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """A law that probe files do not have, as a map file; empirical laws stay formulas."""
    named = {key: value for key, value in table.items() if key != "empirical"}
    found = map_directions(build_probe(named, ""), np.arange(0.0, 181.0, 5.0), np.arange(0.0, 360.0, 3.0))
    polar, azimuth, _, _, pretravel = found.columns()
    rows = [
        [f"{cell:.6g}" for cell in row] for row in zip(polar.ravel(), azimuth.ravel(), pretravel.ravel(), strict=True)
    ]
    kept = {key: value for key, value in table.items() if key not in _OF_LAWS}
    text = csv_text(("polar_deg", "azimuth_deg", "pretravel_um"), rows)
    return {**kept, "model": "table", "map": _PRETRAVEL_FILE}, text


def _plain(value: Any) -> Any:
    """Plain TOML types, floats with nine significant digits."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items() if part is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value
