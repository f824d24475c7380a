"""
A table that somebody else wrote
================================

A German protocol: semicolons, decimal commas, deviations as nominal minus actual. What each column was taken for is
stated, and what is ambiguous is asked.
"""

import io

import matplotlib.pyplot as plt

import stepgauge as sg

protocol = io.StringIO(
    "Soll [mm];Soll-Ist [µm];Richtung\n"
    + "".join(f"{x};{d:.1f};vor\n".replace(".", ",") for x, d in [(0, 0.1), (55, -0.6), (105, -1.4), (160, -2.1)])
    + "".join(f"{x};{d:.1f};zurück\n".replace(".", ",") for x, d in [(160, 0.2), (105, 0.9), (55, 1.6), (0, 2.2)])
)

# %%
# The order in the name "Soll-Ist" (nominal minus actual) turns the sign; ``vor`` and ``zurück`` are the directions.

imported = sg.import_recording(protocol, sensor="dial")
print("\n".join(imported.report))

# %%
# The recording, in the units that it states.

frame = imported.recording.frame
figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
for way, rows in frame.groupby("way"):
    deviation_um = (rows["reading"] - rows["target"]) * 1000.0
    axes.plot(rows["target"], deviation_um, marker="o", label="forward" if way > 0 else "backward")
axes.set(xlabel="target (mm)", ylabel="reading minus target (µm)")
axes.legend()
