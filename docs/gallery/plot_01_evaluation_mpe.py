"""
Errors of a machine against its MPE
===================================

A recording of the step gauge along y becomes errors with their limits. Whether they conform is decided once the
uncertainty budget is there.
"""

import stepgauge as sg

# %%
# ``along-y.csv`` has three cycles on the shipped gauge of 420 mm, on a machine whose y scale is 6 um/m too long
# (``docs/recipes/data/make.py`` states the formula).

gauge = sg.read_gauge("step-gauge-420")
recording = sg.read_recording("../recipes/data/along-y.csv")
evaluation = sg.evaluate(recording, gauge, mpe="1.8 + L/350")
print(evaluation.summary())

# %%
# Forward and backward errors with bands of two standard deviations, and the maximum permissible error (um, with L in
# mm). The slope of the mean is the scale error.

table = evaluation.to_frame()
axes = evaluation.plot()
limit = 1.8 + table["position_mm"] / 350.0
for sign in (1, -1):
    axes.plot(table["position_mm"], sign * limit, color="black", ls="--", lw=1, label="MPE" if sign > 0 else None)
axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.06), ncols=3, fontsize="small", frameon=False)
