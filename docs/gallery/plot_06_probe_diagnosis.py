"""
A probe that is not as its file says
====================================

A map of a probe was measured. Is the probe file right, and if not, which part of the construction is another one?
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import stepgauge as sg

# %%
# The "measured" map: a probe whose spring pushes with 10 % more force than the file says, each direction probed three
# times, with 0.3 % of noise.

chart = sg.probe_map("omp40-2-50mm", polar_deg="90,60,30", azimuth_deg="0:345:15")
measured = pd.concat([chart.to_frame()] * 3)
noise = np.random.default_rng(5).normal(0.0, 0.003, len(measured))
measured["trigger_force_N"] *= 1.1 * (1.0 + noise)
path = Path(tempfile.mkdtemp()) / "map.csv"
measured[["polar_deg", "azimuth_deg", "trigger_force_N"]].to_csv(path, index=False)

# %%
# The diagnosis compares it with the file.

diagnosis = sg.diagnose(path, probe="omp40-2-50mm")
print(diagnosis.summary())
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
diagnosis.plot(axes)
