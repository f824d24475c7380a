"""
Warm-up of a machine
====================

A sensor reads a standing spindle for two hours. Does it drift, how fast does it settle, and with which temperature?
"""

import matplotlib.pyplot as plt
import pandas as pd

import stepgauge as sg

table = pd.read_csv("../recipes/data/drift.csv")
recording = sg.import_recording(table, sensor="inductive").recording

# %%
# The diagnosis compares a drift with time, with the recorded temperature of the room, and no drift at all.

diagnosis = sg.diagnose(recording)
print(diagnosis.summary())
print(diagnosis.to_frame().to_string())

# %%
# Readings and what is left of them.

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
diagnosis.plot(axes)
