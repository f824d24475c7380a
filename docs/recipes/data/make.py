"""The data of the recipes, by formulas with known errors: ``python make.py`` writes the same digits each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

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
                um = 12e-3 * place + 1.5 * np.sin(2.0 * np.pi * place / 5.0 + 0.6) - 3.0 * (way < 0)
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
                mm = 6e-3 * place - 0.11 * (way < 0) + rng.normal(0.0, 0.01)
                rows.append((cycle, "+" if way > 0 else "-", place, round(place + mm, 2)))
    return pd.DataFrame(rows, columns=["cycle", "direction", "target [mm]", "reading [mm]"])


if __name__ == "__main__":
    for make in (laser, telescope, printer):
        make().to_csv(HERE / f"{make.__name__}.csv", index=False)
