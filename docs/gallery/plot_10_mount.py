"""
The worm of a telescope mount
=============================

A mount follows a star for five turns of its worm. The period that is found is that of the worm; a second harmonic stays
without a name.
"""

import matplotlib.pyplot as plt
import pandas as pd

import stepgauge as sg

table = pd.read_csv("../recipes/data/telescope.csv")
mount = sg.import_recording(table, sensor="optical", unit="deg").recording
diagnosis = sg.diagnose(mount)
print(diagnosis.summary())

# %%
# Folded by the period that was found, 2.5 deg, the five turns lie on each other.

angle, error = table["target [deg]"], table["deviation [arcsec]"]
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
points = axes.scatter(angle % 2.5, error - 0.8 * angle, c=angle // 2.5, s=12, cmap="viridis")
figure.colorbar(points, label="turn of the worm", ticks=range(5))
axes.set(xlabel="angle within a turn (deg)", ylabel="error (arcsec)")
