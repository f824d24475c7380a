"""
A machine over two years
========================

Eight calibrations of one machine. Is a trend more than the measurement itself makes?
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import stepgauge as sg

gauge, folder = sg.read_gauge("step-gauge-420"), Path(tempfile.mkdtemp())

# %%
# The scale of y grows by 3 um/m a year: each recording is one of the first with its readings stretched.

first = sg.read_recording("../recipes/data/along-y.csv")
rng = np.random.default_rng(8)
for visit in range(8):
    frame = first.frame.copy()
    years = visit / 4.0
    frame["y_mm"] += (3e-6 * years) * (frame["y_mm"] - 150.0) + rng.normal(0.0, 2e-4, len(frame))
    recording = sg.Recording(frame, {**first.comments, "machine": "Bridge CMM"})
    day = f"{2025 + visit // 4}-{1 + 3 * (visit % 4):02d}-15"
    sg.evaluate(recording, gauge, measured_at=day).write(folder / day)

# %%
# The trend of the scale, with its uncertainty and the limit.

found = sg.machine_history(folder, limits={"scale_ppm": 8.0})
print(found.summary())
table = found.to_frame()
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.plot(table["measured_at"], table["scale_ppm"], marker="o")
axes.axhline(8.0, color="black", ls="--", lw=1)
axes.set(xlabel="day", ylabel="scale error of y (µm/m)")
