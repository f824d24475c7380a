"""
Length measurement errors by ISO 10360-2
========================================

Five lengths in each position, three times, against the maximum permissible error. Here are three of the seven
positions, so the test is incomplete, and says so.
"""

import matplotlib.pyplot as plt

import stepgauge as sg

names = ["along-x", "along-y", "diagonal"]
test = sg.iso10360(
    [f"../recipes/data/{name}.csv" for name in names],
    "step-gauge-420",
    mpe="1.8 + L/350",
    mpe_repeatability_um=1.5,
    tip_diameter_mm=3.994,
)
print(test.summary())
table = test.to_frame()
print(table.head().to_string())

# %%
# The errors by length with their limits.

both = table[table["kind"] == "bidirectional"]
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for position, rows in both.groupby("position"):
    axes.plot(rows["nominal_mm"], rows["error_um"], ls="", marker="o", ms=4, label=names[position - 1])
for sign in (1, -1):
    axes.plot(both["nominal_mm"].unique(), sign * both["mpe_um"].unique(), color="black", ls="--", lw=1)
axes.set(xlabel="length (mm)", ylabel="error E₀ (µm)")
figure.legend(loc="outside upper center", ncols=3, frameon=False)
