"""What Wozniak's compensation gains on a TP6 and a TP200, with the full mechanical model of each probe as the truth.

The paper claims that the systematic errors of a TP6 with 30 and 50 mm styli are more than halved, those of a TP200 more
than quartered. Here each probe's pre-travel is computed in every direction from its construction (trigger statics with
friction, stylus, contact). The compensation is given five points of a sphere, the two diameters and the mounting of the
probe (the azimuth of one lobe); nothing of it is fitted to what it is judged on.

    python reproduce.py [FOLDER]

writes errors.csv (ranges in um before and after), spread.csv (the gain where the numbers of the probe files that are
assumed, not taken from a paper, are drawn at random within what is plausible), errors.svg (the polar plots of the
paper's Fig 5) and, for each probe, PROBE-five.csv and PROBE-grid.csv: the points a machine would record of a 25 mm
sphere with a 4 mm tip, for the verbs ``stepgauge probe qualify`` and ``stepgauge probe compensate``.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stepgauge.figures.qualification import PolarSection, draw_sections
from stepgauge.files.tables import write_table
from stepgauge.physics import directions
from stepgauge.physics.error_reduction import Errors, Pretravel, errors_of_the_paper, errors_on_a_machine
from stepgauge.physics.wozniak import LobeModel, Transducer
from stepgauge.probes import KinematicProbe, PiezoProbe, Probe, read_probe
from stepgauge.probes.files import APPROACH, POSITION

Array = NDArray[np.float64]

PROBES: dict[str, tuple[str, Transducer]] = {
    "TP6, 50 mm stylus": ("tp6-50mm", "kinematic"),
    "TP6, 30 mm stylus": ("tp6-30mm", "kinematic"),
    "TP200, 50 mm stylus": ("tp200-50mm", "piezo"),
}
STEP_RAD = np.radians(3.0)
AROUND = np.arange(0.0, 2.0 * np.pi, STEP_RAD)
OVER = np.linspace(0.0, np.pi, 61)
JUDGED = {
    "XY": directions.unit_vectors(AROUND, 0.0),
    "XZ": directions.unit_vectors(0.0, OVER),
    "half sphere": directions.nine_degree_points(repeats=1),
}
DRAWS, QUANTILES = 300, (0.05, 0.5, 0.95)
SPHERE_MM, TIP_MM, CENTRE_MM = 25.0, 4.0, (400.0, 300.0, 250.0)
JUDGES = {"centre known": errors_of_the_paper, "centre fitted": errors_on_a_machine}


class Row(NamedTuple):
    """One line of the table."""

    probe: str
    judge: str
    where: str
    before_um: float
    after_um: float
    range_ratio: float
    rms_ratio: float
    largest_ratio: float


def main(folder: Path) -> list[Row]:
    """Judge all probes, write table, figure and points into ``folder``."""
    rows: list[Row] = []
    spreads: list[list[object]] = []
    sections: list[PolarSection] = []
    for name, (file, transducer) in PROBES.items():
        probe = read_probe(file)
        truth, model = full_model(probe, transducer)
        spreads.append([name, *spread_of_gain(probe, transducer)])
        for judge in JUDGES:
            rows += [_row(name, judge, where, _errors(judge, truth, model, where)) for where in JUDGED]
        sections += _sections(name, truth, model)
        for pattern, normals in (("five", directions.five_points()), ("grid", JUDGED["half sphere"])):
            _write_points(folder / f"{file}-{pattern}.csv", normals, truth(normals))
    write_table(folder / "errors.csv", Row._fields, [[*row[:3], *(f"{x:.3f}" for x in row[3:])] for row in rows])
    write_table(folder / "spread.csv", ["probe", *(f"quantile_{q:g}" for q in QUANTILES)], spreads)
    draw_sections(sections, folder / "errors.svg")
    return rows


def full_model(probe: Probe, transducer: Transducer) -> tuple[Pretravel, LobeModel]:
    """A probe's pre-travel in its own frame, and the shape of the compensation mounted like it.

    A lobe of least pre-travel lies along each arm of the tripod; the azimuth of the first arm is how the probe sits in
    its holder, which its mark shows.
    """
    arm_rad = probe.tripod.arm_azimuth_rad if isinstance(probe, KinematicProbe) else 0.0
    return lambda normal: probe.pretravel_um(probe.approaches(normal)), LobeModel(transducer, arm_rad)


def spread_of_gain(probe: Probe, transducer: Transducer) -> list[float]:
    """Quantiles of the gain over the half sphere for probes of this kind, their assumed numbers drawn anew."""
    rng = np.random.default_rng(20)
    gains = [
        _errors("centre known", *full_model(_another(probe, rng), transducer), "half sphere").range_ratio
        for _ in range(DRAWS)
    ]
    return [round(float(gain), 3) for gain in np.quantile(gains, QUANTILES)]


def _another(probe: Probe, rng: np.random.Generator) -> Probe:
    """A probe of the same kind and stylus with another seat, friction and sensor."""
    assert isinstance(probe, KinematicProbe | PiezoProbe)
    tripod = replace(
        probe.tripod,
        contact_radius_mm=probe.tripod.contact_radius_mm * rng.uniform(0.7, 1.3),
        contact_angle_rad=np.radians(rng.uniform(25.0, 50.0)),
        lever_mm=probe.tripod.lever_mm + rng.uniform(-4.0, 4.0),
    )
    other = replace(probe, tripod=tripod, tip_friction=rng.uniform(0.0, 0.2), seat_friction=rng.uniform(0.0, 0.1))
    if isinstance(other, PiezoProbe):
        lateral, axial = other.lateral_N * rng.uniform(0.7, 1.3), other.axial_N * rng.uniform(0.7, 1.3)
        return replace(other, lateral_N=lateral, axial_N=axial)
    return other


def _errors(judge: str, truth: Pretravel, model: LobeModel, where: str) -> Errors:
    return JUDGES[judge](truth, JUDGED[where], directions.five_points(), model)


def _row(name: str, judge: str, where: str, errors: Errors) -> Row:
    ranges = float(np.ptp(errors.before_um)), float(np.ptp(errors.after_um))
    return Row(name, judge, where, *ranges, errors.range_ratio, errors.rms_ratio, errors.largest_ratio)


def _sections(name: str, truth: Pretravel, model: LobeModel) -> list[PolarSection]:
    across, along = (_errors("centre known", truth, model, where) for where in ("XY", "XZ"))
    return [
        PolarSection(f"{name}, XY, error / \N{MICRO SIGN}m", AROUND, across.before_um, across.after_um),
        PolarSection(f"{name}, XZ, error / \N{MICRO SIGN}m", OVER, along.before_um, along.after_um),
    ]


def _write_points(path: Path, normals: Array, pretravel_um: Array) -> None:
    """Recorded tip centres and approaches, in the columns that the verbs read."""
    reach_mm = (SPHERE_MM + TIP_MM) / 2.0 - 1e-3 * pretravel_um
    table = np.hstack([CENTRE_MM + normals * reach_mm[:, None], -normals])
    write_table(path, [*POSITION, *APPROACH], table.round(7).tolist())


if __name__ == "__main__":
    for row in main(Path(sys.argv[1] if len(sys.argv) > 1 else ".")):
        print(
            f"{row.probe:20s} {row.judge:14s} {row.where:12s} {row.before_um:7.2f} -> {row.after_um:6.2f} um, "
            f"range / {row.range_ratio:.1f}, rms / {row.rms_ratio:.1f}, largest / {row.largest_ratio:.1f}"
        )
