"""
Pre-travel of a probe in all directions
=======================================

A touch-trigger probe needs more force in some directions than in others: its pre-travel has three lobes.
"""

import matplotlib.pyplot as plt
import numpy as np

import stepgauge as sg

# %%
# The map follows from the construction of the probe: spring, contacts, stylus.

chart = sg.probe_map("omp40-2-50mm", polar_deg="90,75,60", azimuth_deg="0:360:5")
table = chart.to_frame()
print(table.groupby("polar_deg")["pretravel_um"].describe()[["min", "mean", "max"]])

# %%
# Pre-travel by azimuth, one curve for each angle from the axis of the stylus.

figure, axes = plt.subplots(subplot_kw={"projection": "polar"}, figsize=(5.5, 5), layout="constrained")
for polar, rows in table.groupby("polar_deg"):
    closed = rows.iloc[[*range(len(rows)), 0]]
    axes.plot(np.radians(closed["azimuth_deg"]), closed["pretravel_um"], label=f"{polar:.0f}° from the stylus")
axes.set_title("Pre-travel (µm) by azimuth")
figure.legend(loc="outside lower center", ncols=3, frameon=False)
