"""Gauge, machine and recording files as DESIGN section 3 documents them, and the roster ``fleet.csv``."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from benchmarks.fleet import parts
from benchmarks.fleet.design import FIRST_DAY, Fleet, Recording
from benchmarks.fleet.parts import Array, Gauge, Machine

COVERAGE = 2.0
COLUMNS = {
    "placement": "%d",
    "cycle": "%d",
    "face": "%d",
    "x_mm": "%.5f",
    "y_mm": "%.5f",
    "z_mm": "%.5f",
    "approach_i": "%.9f",
    "approach_j": "%.9f",
    "approach_k": "%.9f",
    "time_s": "%.2f",
    "speed_mm_s": "%.1f",
    "gauge_temperature_C": "%.3f",
    "scale_temperature_x_C": "%.2f",
    "scale_temperature_y_C": "%.2f",
    "scale_temperature_z_C": "%.2f",
}
ROSTER = ("recording", "measured_at", "machine", "type", "hall", "gauge", "probe", "gauge_file", "machine_file")
SPEED_MM_S = 3.0


def write_gauge(folder: Path, gauge: Gauge) -> None:
    """``NAME.toml`` and ``NAME.csv`` with the certified positions and their expanded uncertainties."""
    folder.mkdir(parents=True, exist_ok=True)
    faces = np.arange(1, len(gauge.nominal_mm) + 1)
    table = np.column_stack([faces, gauge.nominal_mm, gauge.certified_mm, COVERAGE * gauge.u_um])
    with (folder / f"{gauge.name}.csv").open("w") as file:
        file.write("face,nominal_mm,position_mm,uncertainty_um\n")
        np.savetxt(file, table, fmt=["%d", "%.3f", "%.5f", "%.3f"], delimiter=",")
    (folder / f"{gauge.name}.toml").write_text(
        f"""[gauge]
name = "Step gauge {gauge.name}"
serial = "{gauge.name}"
material = "steel"
expansion_per_K = {parts.EXPANSION_PER_K!r}
expansion_uncertainty_per_K = {parts.U_EXPANSION_PER_K!r}
reference_temperature_C = 20.0
block_width_mm = 15.0
block_height_mm = 15.0
faces = "{gauge.name}.csv"

[certificate]
number = "FLEET-{gauge.name}"
laboratory = "nobody: made for the benchmark of fleets"
date = {FIRST_DAY.replace(month=9)}
coverage_factor = {COVERAGE}
example = true
"""
    )


def write_machine(folder: Path, machine: Machine) -> None:
    """The machine as its owner knows it: no effects, and what its probe and thermometers are good for."""
    folder.mkdir(parents=True, exist_ok=True)
    travel = ", ".join(f"{axis} = [0, {length:g}]" for axis, length in zip("xyz", machine.travel_mm, strict=True))
    u_um = float(np.hypot(parts.PROBE_UM, parts.QUALIFICATION_UM))
    (folder / f"{machine.name}.toml").write_text(
        f"""[machine]
name = "{machine.name}"
travel_mm = {{ {travel} }}
repeatability_um = {machine.repeatability_um!r}
measuring_speed_mm_s = {SPEED_MM_S}
travel_speed_mm_s = 60.0
temperature_C = 20.0

[probe]
model = "constant"
tip_radius_mm = {parts.TIP_RADIUS_MM!r}
pretravel_um = {{ value = {parts.PRETRAVEL_UM!r}, u = {u_um:.2f} }}

[uncertainty]
gauge_temperature_K = {parts.THERMOMETER_K!r}
"""
    )


def write_recording(folder: Path, name: str, machine: Machine, gauge: Gauge, columns: dict[str, Array]) -> None:
    """One recording of one placement."""
    rows = len(columns["face"])
    table = np.column_stack(
        [
            *(np.ones(rows), columns["cycle"], columns["face"]),
            *(columns["tip"], columns["approach"], columns["time_s"]),
            *(np.full(rows, SPEED_MM_S), columns["gauge_C"], columns["scale_C"]),
        ]
    )
    head = f"# machine: {machine.name}\n# gauge_serial: {gauge.name}\n# tip_radius_mm: {parts.TIP_RADIUS_MM}\n"
    line = ",".join(COLUMNS.values()) + "\n"
    text = "".join([line % tuple(row) for row in table.tolist()])
    (folder / f"{name}.csv").write_text(head + ",".join(COLUMNS) + "\n" + text)


def write_roster(path: Path, fleet: Fleet) -> None:
    """Who measured what and when; files relative to the roster."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(ROSTER)
    writer.writerows(_roster_row(fleet, recording) for recording in fleet.recordings)
    path.write_text(text.getvalue())


def _roster_row(fleet: Fleet, recording: Recording) -> list[str]:
    machine, gauge = fleet.machines[recording.machine], fleet.gauges[recording.gauge]
    return [
        *(
            f"recordings/{recording.name}.csv",
            recording.measured_at.isoformat(),
            machine.name,
            machine.line,
            machine.hall,
        ),
        *(gauge.name, recording.probe),
        *(f"gauges/{gauge.name}.toml", f"machines/{machine.name}.toml"),
    ]
