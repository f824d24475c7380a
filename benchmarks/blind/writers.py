"""Recording, gauge and machine files as DESIGN section 3 documents them, written by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.scene import Chain, Gauge, Scene

Array = NDArray[np.float64]
_COLUMNS: dict[str, str] = {
    "placement": "%d",
    "cycle": "%d",
    "face": "%d",
    "x_mm": "%.6f",
    "y_mm": "%.6f",
    "z_mm": "%.6f",
    "approach_i": "%.9f",
    "approach_j": "%.9f",
    "approach_k": "%.9f",
    "time_s": "%.3f",
    "speed_mm_s": "%.3f",
    "gauge_temperature_C": "%.2f",
    "scale_temperature_x_C": "%.2f",
    "scale_temperature_y_C": "%.2f",
    "scale_temperature_z_C": "%.2f",
    "humidity_pct": "%.2f",
}


def write_case(
    folder: Path, scene: Scene, indicated_mm: Array, *, split: bool, humidity: bool, stated: float = 1.0
) -> None:
    """``recording*.csv``, ``gauge.toml`` with ``gauge-faces.csv``, ``machine.toml``; ``split`` by placings.

    ``stated`` is the share of the certificate's true uncertainty that the certificate admits.
    """
    folder.mkdir(parents=True, exist_ok=True)
    columns = [
        *(scene.placement, scene.cycle, scene.face),
        *indicated_mm.T,
        *scene.approach.T,
        *(scene.time_s, scene.speed_mm_s, scene.gauge_temperature_C),
        *scene.scale_temperature_C.T,
        scene.humidity_pct,
    ]
    names = list(_COLUMNS)[: None if humidity else -1]
    table = np.column_stack([*columns[: len(names)], *(sensor.at(scene.time_s) for sensor in scene.sensors)])
    names += [sensor.column for sensor in scene.sensors]
    groups = [scene.placement == place for place in np.unique(scene.placement)] if split else [slice(None)]
    for number, rows in enumerate(groups, 1):
        name = f"recording-{number}.csv" if split else "recording.csv"
        _write_table(folder / name, names, table[rows])
    _write_gauge(folder, scene.gauge, stated)
    (folder / "machine.toml").write_text(_machine_text(scene))


def _write_table(path: Path, names: list[str], table: Array) -> None:
    with path.open("w") as file:
        file.write("# machine: Bridge CMM\n" + ",".join(names) + "\n")
        np.savetxt(file, table, fmt=[_COLUMNS.get(name, "%.3f") for name in names], delimiter=",")


def _write_gauge(folder: Path, gauge: Gauge, stated: float) -> None:
    coverage = 2.0  # the certificate states expanded uncertainties, k = 2
    faces = np.arange(1, len(gauge.nominal_mm) + 1)
    table = np.column_stack([faces, gauge.nominal_mm, gauge.certified_mm, coverage * stated * gauge.u_um])
    with (folder / "gauge-faces.csv").open("w") as file:
        file.write("face,nominal_mm,position_mm,uncertainty_um\n")
        np.savetxt(file, table, fmt=["%d", "%.3f", "%.5f", "%.3f"], delimiter=",")
    (folder / "gauge.toml").write_text(
        f"""[gauge]
name = "Step gauge {gauge.length_mm:.0f}"
serial = "BLIND"
material = "steel"
expansion_per_K = {gauge.expansion_per_K!r}
expansion_uncertainty_per_K = {gauge.u_expansion_per_K!r}
reference_temperature_C = 20.0
block_width_mm = 20.0
block_height_mm = 15.0
faces = "gauge-faces.csv"

[certificate]
number = "BLIND-1"
laboratory = "nobody: made for the blind benchmark"
date = 2025-01-15
coverage_factor = {coverage}
example = true
"""
    )


def _chain_text(chain: Chain) -> str:
    table, probe = ([*axes] for axes in (chain.table, chain.probe))
    return f"""
[machine.chain]
table = {json.dumps(table)}
probe = {json.dumps(probe)}
stylus_mm = {list(chain.stylus_mm)!r}
"""


def _machine_text(scene: Scene) -> str:
    travel = ", ".join(
        f"{axis} = [{low:g}, {high:g}]" for axis, (low, high) in zip("xyz", scene.travel_mm, strict=True)
    )
    stylus = "" if scene.stylus_mm is None else f"stylus_length_mm = {scene.stylus_mm!r}\n"
    if scene.stylus_direction != (0.0, 0.0, -1.0):
        stylus += f"stylus_direction = {list(scene.stylus_direction)!r}\n"
    chain = "" if scene.chain is None else _chain_text(scene.chain)
    return f"""[machine]
name = "Bridge CMM"
travel_mm = {{ {travel} }}
repeatability_um = {scene.sigma_um!r}
measuring_speed_mm_s = {float(scene.speed_mm_s.min())!r}
travel_speed_mm_s = 60.0
temperature_C = 20.0
{chain}
[probe]
model = "constant"
tip_radius_mm = {scene.tip_radius_mm!r}
pretravel_um = {scene.pretravel_um!r}
{stylus}"""
