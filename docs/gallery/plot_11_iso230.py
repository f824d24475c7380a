"""
Positioning of an axis by ISO 230-2
===================================

Five runs in both directions give accuracy A, repeatability R and reversal error B of an axis, and a decision.
"""

import matplotlib.pyplot as plt
import pandas as pd

import stepgauge as sg

axis = sg.import_recording(pd.read_csv("../recipes/data/laser.csv"), sensor="laser").recording
test = sg.iso230(axis, tolerances="A=8", expanded_uncertainty_um=0.6)
print(test.summary())

# %%
# Means of both directions with two standard deviations, by target.

frame = axis.frame.assign(deviation_um=(axis.frame["reading"] - axis.frame["target"]) * 1000.0)
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for way, rows in frame.groupby("way"):
    by_target = rows.groupby("target")["deviation_um"]
    mean, s = by_target.mean(), by_target.std()
    axes.errorbar(mean.index, mean, 2.0 * s, marker="o", ms=3, capsize=2, label="up" if way > 0 else "down")
axes.set(xlabel="target (mm)", ylabel="deviation (µm), mean and 2 s")
axes.legend()
