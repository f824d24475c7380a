"""
Pre-travel of a touch-trigger probe
===================================

A kinematic probe rests on three pairs of balls, and the stylus bends until the force lifts it off one of them. So the
probe triggers late by an amount that has three lobes about the axis of the stylus. A longer stylus makes the lobes
larger.
"""

import matplotlib.pyplot as plt
import numpy as np

from stepgauge.probes import read_probe

# %%
# Approaches square to the axis of the stylus, which points up: the components are those of the direction in which the
# tip travels.

azimuth = np.radians(np.arange(0, 361, 3))
approach = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)])

figure, axes = plt.subplots(subplot_kw={"projection": "polar"}, figsize=(5.5, 5), layout="constrained")
for name in ("omp40-2-50mm", "omp40-2-100mm"):
    probe = read_probe(name)
    axes.plot(azimuth, probe.pretravel_um(approach), label=name)
axes.set_title("Pre-travel (µm) by azimuth of the approach")
axes.legend(loc="lower right")

# %%
# The mean of the pre-travel over the directions belongs to the effective tip radius, which a qualification on a sphere
# finds; what is left is the direction-dependent error of the probe.
