"""
A table for the controller
==========================

An evaluation along an axis becomes the error table of that axis, for one of the controllers that are known.
"""

import matplotlib.pyplot as plt

import stepgauge as sg

evaluation = sg.evaluate("../recipes/data/defect.csv", "step-gauge-420")
table = sg.compensate(evaluation, axis="y", to="linuxcnc", tip_radius_mm=1.997)
print(table.summary())
print(table.to_frame().head().to_string())

# %%
# Errors in both directions of travel; the defect of the scale is where the machine is 3 µm off.

rows = table.to_frame()
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for way in ("positive", "negative"):
    axes.errorbar(rows["position_mm"], rows[f"{way}_um"], rows[f"u_{way}_um"], capsize=2, label=f"travel {way}")
axes.set(xlabel="y (mm)", ylabel="error (µm), with u")
axes.legend()
