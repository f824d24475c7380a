"""
A cause that the machine file does not state
============================================

A scale of the machine has an error that its file does not know. Simulate a recording with the error, diagnose it
against the file without, and look at what is left.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import stepgauge as sg

gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")

# %%
# The concealed truth is a copy of the machine file with one more table: the scale of y is too short by 6 ppm in a
# stretch of 60 mm.

text = Path(machine.path).read_text()
concealed = Path(tempfile.mkdtemp()) / "concealed.toml"
concealed.write_text(
    text + '\n[[effect]]\nkind = "local_scale_defect"\naxis = "y"\nat_mm = 450.0\nwidth_mm = 60.0\nheight_um = 3.0\n'
)
truth = sg.read_machine(concealed)

# %%
# Where the gauge lies comes from the 16 points of the demo; the recording from the virtual CMM.

place = Path(tempfile.mkdtemp()) / "gauge.dmi"
points = Path(machine.path).parents[2] / "examples/demo/points.csv"
placement = sg.locate(points, gauge, machine=machine)
sg.plan(placement, gauge, machine, cycles=5).write(place, dialect="dmis")
run = sg.simulate(place, truth, gauge, placement, seed=7)

# %%
# The evaluation shows the error of the machine along the gauge.

evaluation = sg.evaluate(run, gauge)
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
evaluation.plot(axes)

# %%
# The diagnosis knows the machine file without the defect. It names the cause, its place and its size.

diagnosis = sg.diagnose(run, gauge, machine)
print(diagnosis.summary())
diagnosis.to_frame()
