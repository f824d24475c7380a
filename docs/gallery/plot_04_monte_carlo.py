"""
Monte Carlo beside the budget
=============================

The budget (GUM) is linear; the Monte Carlo method (JCGM 101) draws every input quantity and evaluates again. Where both
agree, the budget may be used.
"""

import matplotlib.pyplot as plt

import stepgauge as sg

budget = sg.budget("../recipes/data/along-y.csv", "step-gauge-420", "bridge-cmm", u_gauge_temperature_K=0.1, runs=2000)

# %%
# ``same_terms_u_um`` is u of the contributions that both know. The two differ by the scatter of 2000 draws, about 2 %.

table = budget.to_frame()
xm = table[(table["quantity"] == "xm") & table["monte_carlo_u_um"].notna()]
ratio = (xm["monte_carlo_u_um"] / xm["same_terms_u_um"]).describe()
print(ratio[["mean", "min", "max"]])

# %%
# Standard uncertainty of XM along the gauge.

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.plot(xm["position_mm"], xm["same_terms_u_um"], label="budget (GUM)")
axes.plot(xm["position_mm"], xm["monte_carlo_u_um"], ls="", marker="o", ms=3, label="Monte Carlo, 2000 runs")
axes.set(xlabel="position along the gauge (mm)", ylabel="standard uncertainty of XM (µm)", ylim=(0, None))
axes.legend()
