"""The OMP40-2 of a thesis, computed again: 63 trigger forces and deflections, and what was measured.

M. Rodrigues, An accurate on-machine surfaces measurement using FEA method, Concordia University 2021, Tables 2.2, 2.3
and 4.1-4.9. The latter stand in tests/data of this repository. Run from anywhere:

    python examples/omp40-2-thesis/reproduce.py results

writes directions.csv (every printed number beside the model's), measured.csv (Tables 2.2 and 2.3) and directions.svg.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.figures.style import COLORS, figure_style, new_figure, save_figure
from stepgauge.files.tables import read_rows, write_table
from stepgauge.physics.directions import unit_vectors
from stepgauge.physics.pretravel import Elasticity
from stepgauge.physics.stylus import StylusSection, bending_compliance_mm_per_N
from stepgauge.probes import KinematicProbe, read_probe
from stepgauge.probes.directions_map import normals_of

Array = NDArray[np.float64]

TABLES = Path(__file__).parents[2] / "tests" / "data" / "rodrigues_tables_4_1_to_4_9.csv"
COLUMNS = (
    "polar_deg",
    "azimuth_deg",
    "force_fea_N",
    "force_statics_N",
    "sensing_fea_mm",
    "sensing_statics_mm",
)
# Table 2.2 in N at 50 mm and Table 2.3 in um at 100 mm, polar 90 deg: quantity, least, most.
MEASURED = {"trigger force / N": (0.664, 1.294), "sensing distance / um": (15.875, 28.865)}


def existing_method(stylus_mm: float) -> KinematicProbe:
    """The thesis' existing method: no carrier in the lever, a uniform ceramic beam without shear."""
    probe = read_probe("omp40-2-50mm")
    assert isinstance(probe, KinematicProbe)
    beam = bending_compliance_mm_per_N([StylusSection(stylus_mm, 4.5, 413.0)])
    return replace(probe, tripod=replace(probe.tripod, lever_mm=stylus_mm), elasticity=Elasticity(beam))


def directions(table: Array, folder: Path) -> None:
    """Printed and computed, row by row."""
    normals = unit_vectors(np.radians(table[:, 1]), np.radians(90.0 - table[:, 0]))
    parts = [table[:, :2]]
    for probe, force, sensing in ((read_probe("omp40-2-50mm"), 2, 4), (existing_method(50.0), 3, 5)):
        approach = probe.approaches(normals)
        parts += [table[:, [force]], probe.trigger_force_N(approach)[:, None]]
        parts += [1e3 * table[:, [sensing]], probe.deflection_um(approach)[:, None]]
    header = [f"{what}_{by}" for by in ("fea", "statics") for what in ("force_N", "model_N", "sensing_um", "model_um")]
    rows = [[f"{cell:.4g}" for cell in row] for row in np.hstack(parts)]
    write_table(folder / "directions.csv", [*COLUMNS[:2], *header], rows)


def measured(folder: Path) -> None:
    """Tables 2.2 and 2.3 beside the existing method, the shipped probes, and a spring 0.9 mm off the axis."""
    around = unit_vectors(np.radians(np.arange(0.0, 360.0, 0.5)), 0.0)
    rows = []
    for (name, printed), length in zip(MEASURED.items(), (50, 100), strict=True):
        probe = read_probe(f"omp40-2-{length}mm")
        assert isinstance(probe, KinematicProbe)
        offset = (0.9 * np.cos(np.pi / 3), 0.9 * np.sin(np.pi / 3))
        eccentric = replace(probe, tripod=replace(probe.tripod, preload_offset_mm=offset))
        for label, model in (("existing", existing_method(length)), ("shipped", probe), ("0.9 mm off", eccentric)):
            approach = model.approaches(around)
            values = model.trigger_force_N(approach) if length == 50 else model.deflection_um(approach)
            ends = np.array([values.min(), values.max()])
            off = 100.0 * (ends / printed - 1.0)
            rows.append([name, label, *printed, *(f"{end:.3f}" for end in ends), *(f"{part:+.1f}" for part in off)])
    header = ["quantity", "model", "measured_least", "measured_most", "least", "most", "least_off_pct", "most_off_pct"]
    write_table(folder / "measured.csv", header, rows)


@figure_style()
def draw(table: Array, folder: Path) -> None:
    """Thesis as points, model as lines: force and deflection over the azimuth for three polar angles."""
    fig = new_figure(164.0, 84.0)
    azimuth = np.linspace(0.0, 60.0, 121)
    for axes, first, label in zip(
        fig.subplots(1, 2), (2, 4), ("trigger force / N", "sensing distance / \N{MICRO SIGN}m"), strict=True
    ):
        scale = 1.0 if first == 2 else 1e3
        looks = ((read_probe("omp40-2-50mm"), first, "after", "o"), (existing_method(50.0), first + 1, "before", "s"))
        for probe, column, color, marker in looks:
            for polar in (90.0, 40.0, 20.0):
                approach = probe.approaches(normals_of([polar], azimuth))[0]
                line = probe.trigger_force_N(approach) if first == 2 else probe.deflection_um(approach)
                axes.plot(azimuth, line, color=COLORS[color])
                chosen = table[:, 0] == polar
                axes.plot(table[chosen, 1], scale * table[chosen, column], marker, color=COLORS[color], mfc="white")
                # Blue curves are labelled at their left end, the others at their right end, where they do not meet.
                x, y, side = (-1.5, line[0], "right") if color == "after" else (61.5, line[-1], "left")
                text = f"{polar:g}\N{DEGREE SIGN}"
                axes.annotate(text, (x, y), ha=side, va="center", fontsize="small", color=COLORS[color])
        axes.set_xlabel("azimuth of the normal / deg")
        axes.set_ylabel(label)
        axes.set_xlim(-9.0, 69.0)
        axes.set_xticks(np.arange(0.0, 61.0, 10.0))
    handles = [fig.axes[0].lines[i] for i in (0, 1, 6, 7)]
    labels = ["tripod and stepped stylus", "FEA, printed", "tripod and uniform beam", "existing method, printed"]
    fig.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    save_figure(fig, folder / "directions.svg", simulated=False)


def main(folder: Path) -> None:
    table = read_rows(TABLES, COLUMNS).numbers(COLUMNS)
    directions(table, folder)
    measured(folder)
    draw(table, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
