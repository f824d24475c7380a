"""A line-spacing calibration of the National Bureau of Standards as a stepgauge gauge, machine and recording.

    python convert.py spacings.csv folder [placements]

``spacings.csv`` has the values of Worksheet A of NBS Technical Note 1164 (C. Croarkin, R. Varner: Measurement assurance
for dimensional measurements on integrated circuit photomasks): certified and observed spacing in um, 4 runs over 10
spacings. Writes gauge.toml, gauge.csv, machine.toml and
recording.csv into the folder.

A spacing is the distance between two lines, so it becomes that of a front face at zero and a back face: an instrument
that sets every line a little too far out reads all spacings too long by the same amount, as a step gauge's blocks look
too wide to a probe whose effective radius is wrong. Coincident lines read zero by definition: one row per run says so.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.tables import read_numbers, write_table
from stepgauge.files.text import write_text

Array = NDArray[np.float64]

RUNS, SPACINGS = 4, 10
# A block is a line here; this much narrower than the least step between spacings, so that no two overlap.
LINE_UM = 0.7
EDGE_RADIUS_MM = 0.0005

GAUGE = """\
# Photomask of NBS Technical Note 1164: ten certified line spacings, as the back faces of a step gauge 10.77 um long.
# The front faces of all blocks but the first are fill-ins that were not measured.
[gauge]
name = "NBS photomask line spacings"
serial = "NBS-TN-1164"
material = "glass"
expansion_per_K = 0.0             # 10 um of glass move by 5 pm per kelvin
expansion_uncertainty_per_K = 0.0
reference_temperature_C = 20.0
block_width_mm = 1.0
block_height_mm = 1.0
faces = "gauge.csv"

[certificate]
number = "NBS TN 1164, Worksheet A"
laboratory = "National Bureau of Standards"
date = 1982-08-01
coverage_factor = 2.0
"""
MACHINE = """\
# The optical instrument as it would be if it were right: no scale error, edges set where they are.
[machine]
name = "optical line-spacing instrument"
travel_mm = { x = [-1, 1], y = [-1, 1], z = [-1, 1] }
repeatability_um = 0.05
measuring_speed_mm_s = 0.001
travel_speed_mm_s = 1.0
scale_expansion_per_K = 0.0       # for the same reason

[probe]
model = "constant"
tip_radius_mm = 0.0005
"""


def read_spacings(path: str | Path) -> Array:
    """Certified and observed spacings in um, (runs, spacings, 2)."""
    table = read_numbers(path, ("run", "certified_um", "observed_um"))
    runs = np.column_stack([table["certified_um"], table["observed_um"]])
    if len(runs) != RUNS * SPACINGS or not np.array_equal(table["run"], np.repeat(np.arange(1, RUNS + 1), SPACINGS)):
        raise InputError(path, "not four runs in order", found=f"{len(runs)} rows", expected=RUNS * SPACINGS)
    return runs.reshape(RUNS, SPACINGS, 2)


def faces_um(spacings: Array) -> Array:
    """Positions of all faces: the first block at zero, then a block that ends at every certified spacing."""
    ends = np.concatenate([[LINE_UM], np.sort(spacings)])
    return np.column_stack([np.concatenate([[0.0], ends[1:] - LINE_UM]), ends]).ravel()


def recording_rows(runs: Array, placements: bool = False) -> list[list[object]]:
    """A row for the zero of every run, then its spacings in the order in which they were observed."""
    order = np.sort(runs[0, :, 0])
    rows: list[list[object]] = []
    for number, run in enumerate(runs, 1):
        counts = [number, 1] if placements else [1, number]
        if not placements:
            rows.append([*counts, 1, f"{-EDGE_RADIUS_MM:.7f}", 0, 0, 1, 0, 0])
        for certified, observed in run:
            face = 2 * int(np.searchsorted(order, certified)) + 4
            rows.append([*counts, face, f"{1e-3 * observed + EDGE_RADIUS_MM:.7f}", 0, 0, -1, 0, 0])
    return rows


def main(spacings: str | Path, folder: str | Path, placements: bool = False) -> None:
    runs, target = read_spacings(spacings), Path(folder)
    faces = 1e-3 * faces_um(runs[0, :, 0])
    rows = [[k, f"{x:.6f}", f"{x:.6f}", "0.01"] for k, x in enumerate(faces, 1)]
    write_text(target / "gauge.toml", GAUGE)
    write_table(target / "gauge.csv", ("face", "nominal_mm", "position_mm", "uncertainty_um"), rows)
    write_text(target / "machine.toml", MACHINE)
    header = ("placement", "cycle", "face", "x_mm", "y_mm", "z_mm", "approach_i", "approach_j", "approach_k")
    write_table(target / "recording.csv", header, recording_rows(runs, placements))


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4) or sys.argv[3:] not in ([], ["placements"]):
        sys.exit(__doc__)
    try:
        main(sys.argv[1], sys.argv[2], placements=len(sys.argv) == 4)
    except InputError as error:
        sys.exit(str(error))
