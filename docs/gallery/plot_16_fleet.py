"""
A worn gauge and a knocked machine, told apart
==============================================

One gauge visits many machines, one machine sees many gauges. What goes with the gauge is the gauge, what stays with the
machine is the machine. Here six machines and three gauges are simulated; one gauge wears, one machine is knocked.
"""

import tempfile
from datetime import datetime, timedelta
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import stepgauge as sg

gauge = sg.read_gauge("step-gauge-420")
rng = np.random.default_rng(3)

# %%
# A recording along x or y: certified positions, tip radius 2 mm less 3 um of pre-travel, 0.3 um of scatter. Fronts of
# gauge G1 lose 2 um a year; from May 2025 on the scale of x of machine M2 is 8 um/m too long.


def recording(machine: int, number: int, axis: int, when: datetime) -> sg.Recording:
    face = np.tile(np.arange(1, gauge.n_faces + 1), 3)
    front = face % 2 == 1
    along = gauge.position_mm[face - 1] + np.where(front, -1.997, 1.997) + rng.normal(0.0, 3e-4, len(face))
    along += 2e-3 * (when - datetime(2025, 1, 1)).days / 365.25 * front * (number == 1)
    along *= 1.0 + 8e-6 * (machine == 2 and axis == 0 and when > datetime(2025, 5, 1))
    place = np.full((len(face), 3), 100.0) + along[:, None] * np.eye(3)[axis]
    approach = np.where(front, 1.0, -1.0)[:, None] * np.eye(3)[axis]
    names = ["x_mm", "y_mm", "z_mm", "approach_i", "approach_j", "approach_k"]
    columns = dict(zip(names, [*place.T, *approach.T], strict=True))
    cycle = np.repeat([1, 2, 3], gauge.n_faces)
    owners = {"machine_id": f"M{machine}", "machine_type": "T", "hall": "H", "probe_id": f"P{machine}"}
    said = {"tip_radius_mm": "2", "gauge_id": f"G{number}", "measured_at": f"{when:%Y-%m-%d}", **owners}
    return sg.Recording(pd.DataFrame({"placement": 1, "cycle": cycle, "face": face, **columns}), said)


# %%
# All of it goes into a store, with certificate and machine file; whose a recording is stands in its comments.

folder = Path(tempfile.mkdtemp())
paths = []
for visit in range(48):
    when, machine, number = datetime(2025, 1, 7) + timedelta(days=7 * visit), visit % 6, (visit + visit // 6) % 3
    for axis in (0, 1):
        paths.append(folder / f"{visit}-{'xy'[axis]}.csv")
        recording(machine, number, axis, when).write(paths[-1])
new, _ = sg.add_to_fleet(folder / "fleet", paths, "step-gauge-420", "bridge-cmm")
print(f"{len(new)} recordings")

# %%
# One recording leaves the gauge and the machine confounded. All of them do not.

found = sg.infer_fleet(folder / "fleet")
print(found.summary())

# %%
# The scales of x over the year, without what gauges and probes contribute, with the expanded uncertainty. The machine
# that was knocked leaves its limit; the worn gauge moved none of them.

figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
for one in sg.watch_fleet(folder / "fleet", limits={"scale": 5.0}).watched:
    if one.quantity == "scale x":
        days = np.array(one.days).astype("datetime64[D]")
        axes.errorbar(days, one.level, 2.0 * np.array(one.u), marker="o", ms=3, capsize=2, label=one.owner)
axes.axhline(5.0, color="black", ls="--", lw=0.8)
axes.set(xlabel="day", ylabel="scale error of x (µm/m)")
axes.tick_params("x", rotation=30)
axes.legend(ncols=3)
plt.show()
