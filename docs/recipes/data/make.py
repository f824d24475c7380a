"""The data of the recipes, by formulas with known errors: ``python make.py`` writes the same digits each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

import stepgauge as sg

HERE = Path(__file__).parent


def laser() -> pd.DataFrame:
    """A stage of 300 mm: 12 um/m of scale, 1.5 um per turn of a screw of 5 mm, 3 um of backlash, 0.15 um of noise."""
    rng = np.random.default_rng(11)
    steps = 15.0 + rng.uniform(-4.5, 4.5, 20)
    target = np.r_[0.0, np.cumsum(steps) * 300.0 / steps.sum()].round(2)
    rows = []
    for cycle in range(1, 6):
        for way in (1, -1):
            for place in target[::way]:
                um = 12e-3 * place + 1.5 * np.sin(2.0 * np.pi * place / 5.0 + 0.6) + 3.0 * (way < 0)
                reading = place + (um + rng.normal(0.0, 0.15)) / 1000.0
                rows.append((cycle, "+" if way > 0 else "-", place, round(reading, 5)))
    return pd.DataFrame(rows, columns=["cycle", "direction", "target [mm]", "reading [mm]"])


def telescope() -> pd.DataFrame:
    """A mount that follows a star, five turns of its worm (2.5 deg each): 12 arcsec once, 3 arcsec twice per turn."""
    rng = np.random.default_rng(12)
    angle = np.arange(0.0, 12.5, 0.0836)
    turn = 2.0 * np.pi * angle / 2.5
    arcsec = 12.0 * np.sin(turn + 1.0) + 3.0 * np.sin(2.0 * turn) + 0.8 * angle + rng.normal(0.0, 0.7, len(angle))
    return pd.DataFrame({"target [deg]": angle.round(4), "deviation [arcsec]": arcsec.round(2)})


def printer() -> pd.DataFrame:
    """The x axis of a printer against a dial gauge: 6 mm/m of scale, 0.11 mm of backlash, 0.01 mm of noise."""
    rng = np.random.default_rng(13)
    rows = []
    for cycle in range(1, 4):
        for way in (1, -1):
            for place in np.array([0.0, 7.0, 19.0, 28.0, 41.0, 50.0])[::way]:
                mm = 6e-3 * place + 0.11 * (way < 0) + rng.normal(0.0, 0.01)
                rows.append((cycle, "+" if way > 0 else "-", place, round(place + mm, 2)))
    return pd.DataFrame(rows, columns=["cycle", "direction", "target [mm]", "reading [mm]"])


def drift() -> pd.DataFrame:
    """A sensor against a standing spindle: 14 um that settle with 25 min, 0.15 um of noise, the room within 0.1 K."""
    rng = np.random.default_rng(14)
    time_s = np.arange(0.0, 7200.0, 120.0)
    um = 14.0 * (1.0 - np.exp(-time_s / 1500.0)) + rng.normal(0.0, 0.15, len(time_s))
    room_C = 20.0 + rng.uniform(-0.1, 0.1, len(time_s))
    return pd.DataFrame({"time [s]": time_s, "reading [um]": um.round(2), "room [degC]": room_C.round(2)})


def gauge_recording(
    direction: tuple[float, float, float], seed: int, *, scale_ppm: float = 0.0, bump_um: float = 0.0, cycles: int = 3
) -> sg.Recording:
    """Tip centres on the shipped gauge of 420 mm, from (100, 150, 100) mm; tip radius 2 mm less 3 um of pre-travel.

    ``scale_ppm``: of the readings along the gauge; ``bump_um``: a bell 60 mm wide at 250 mm; scatter 0.3 um.
    """
    gauge, rng = sg.read_gauge("step-gauge-420"), np.random.default_rng(seed)
    face = np.tile(np.arange(1, gauge.n_faces + 1), cycles)
    way = np.where(face % 2 == 1, 1.0, -1.0)
    along = gauge.position_mm[face - 1] - 1.997 * way
    um = scale_ppm * 1e-3 * along + bump_um * np.exp(-(((along - 250.0) / 60.0) ** 2)) + rng.normal(0.0, 0.3, len(face))
    place = np.array([100.0, 150.0, 100.0]) + (along + um / 1000.0)[:, None] * np.array(direction)
    names = ["x_mm", "y_mm", "z_mm", "approach_i", "approach_j", "approach_k"]
    columns = dict(zip(names, [*place.T.round(6), *(way[:, None] * np.array(direction) + 0.0).T], strict=True))
    cycle = np.repeat(np.arange(1, cycles + 1), gauge.n_faces)
    further = {"time_s": 4.0 * np.arange(len(face)), "gauge_temperature_C": 20.0}
    frame = pd.DataFrame({"placement": 1, "cycle": cycle, "face": face, **columns, **further})
    stated = {"gauge_serial": gauge.table.serial, "tip_radius_mm": "2", "temperature_convention": "as_read"}
    return sg.Recording(frame, {**stated, "simulated": "by a formula, no machine was measured"})


RECORDINGS = {
    "along-x": gauge_recording((1.0, 0.0, 0.0), 21, scale_ppm=1.0),
    "along-y": gauge_recording((0.0, 1.0, 0.0), 22, scale_ppm=6.0),
    "diagonal": gauge_recording((0.6, 0.8, 0.0), 23, scale_ppm=4.0),
    "defect": gauge_recording((0.0, 1.0, 0.0), 24, bump_um=3.0),
    "repaired": gauge_recording((0.0, 1.0, 0.0), 25, bump_um=0.4),
}

if __name__ == "__main__":
    for make in (laser, telescope, printer, drift):
        make().to_csv(HERE / f"{make.__name__}.csv", index=False)
    for name, one in RECORDINGS.items():
        one.write(HERE / f"{name}.csv")
