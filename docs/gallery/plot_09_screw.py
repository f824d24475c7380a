"""
The pitch error of a screw
==========================

An axis read by a laser at uneven targets: backlash, a scale error and a periodic error of the screw, each with its
size.
"""

import matplotlib.pyplot as plt
import pandas as pd

import stepgauge as sg

table = pd.read_csv("../recipes/data/laser.csv")
axis = sg.import_recording(table, sensor="laser").recording
diagnosis = sg.diagnose(axis)
print(diagnosis.summary())
print(diagnosis.to_frame()[["kind", "parameter", "value", "u", "unit"]].to_string())

# %%
# The period is that of the screw, 5 mm. Targets at every 5 mm would have hidden it.

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
diagnosis.plot(axes)
