"""
What the uncertainty is made of
===============================

The budget by the GUM gives every error its standard uncertainty, contribution by contribution.
"""

import matplotlib.pyplot as plt

import stepgauge as sg

# %%
# What no recording shows is stated: here the thermometer on the gauge, and a contribution of one's own.

budget = sg.budget(
    "../recipes/data/along-y.csv",
    "step-gauge-420",
    "bridge-cmm",
    contributions="probing=0.1",
    u_gauge_temperature_K=0.1,
    runs=0,
)
print(budget.summary())

# %%
# Variances of XM along the gauge, stacked: they add up to the square of u. Near the first face repeatability counts,
# far from it the temperature of the gauge.

table = budget.to_frame()
xm = table[(table["quantity"] == "xm") & table["u_um"].notna()]
sources = [name for name in xm.columns if name.startswith("u: ")]
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.stackplot(
    xm["position_mm"], [xm[one] ** 2 for one in sources], labels=[one.removeprefix("u: ") for one in sources]
)
axes.plot(xm["position_mm"], xm["u_um"] ** 2, color="black", lw=1, label="u²")
axes.set(xlabel="position along the gauge (mm)", ylabel="variance of XM (µm²)")
axes.legend(loc="upper left")
