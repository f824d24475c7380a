"""
Before and after a repair
=========================

Two evaluations of one gauge, laid over each other: which difference is more than the measurement itself makes?
"""

import matplotlib.pyplot as plt

import stepgauge as sg

gauge = sg.read_gauge("step-gauge-420")
before = sg.evaluate("../recipes/data/defect.csv", gauge)
after = sg.evaluate("../recipes/data/repaired.csv", gauge)

# %%
# The scale had a defect at 250 mm: 3 um before the repair, 0.4 um after. The band of the difference is its expanded
# uncertainty (k = 2); the certificate of the gauge is common to both and cancels.

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
after.plot(axes, before=before)
