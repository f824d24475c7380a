"""A bar that was put on the table with block 1 at the other end, in some placements of several."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.result import GaugeDiagnosis
from tests.diagnosis.made import ALONG_X, ALONG_Y, by_hand, gauge, machine, side_of

UNEVEN = (0.0, 20.1, 50.0, 70.1, 100.0, 119.9, 150.05, 170.0)
SYMMETRIC = (0.0, 20.0, 120.0, 140.0)
SCALE_PPM = 60.0
AXES = (ALONG_X, ALONG_Y, (1.0, 1.0, 0.0))
Um = Callable[[pd.DataFrame], Any]


def told(faces: tuple[float, ...], turned: set[int], seed: int, u_um: float, noise_um: float, um: Um) -> GaugeDiagnosis:
    """Faces are where they are on the bar, not where the certificate has them: each turns with its own error."""
    position = np.array(faces)
    bar = replace(gauge(), position_mm=position, u_um=np.full(len(faces), u_um))
    off_um = np.random.default_rng(seed + 100).normal(0.0, u_um, len(faces))

    def along_um(rows: pd.DataFrame) -> Any:
        face, round_ = rows["face"].to_numpy() - 1, np.isin(rows["placement"], list(turned))
        straight = position * 1e3 + off_um
        laid = np.where(round_, (straight[-1] - straight[::-1])[face], straight[face])
        return (laid - position[face] * 1e3) * side_of(rows) + um(rows)

    recording = by_hand(bar, along_um, AXES, cycles=6, noise_um=noise_um, seed=seed)
    return diagnose(recording, bar, machine(noise_um=noise_um), separations=False)


def scale_x(rows: pd.DataFrame) -> Any:
    return (SCALE_PPM * 1e-3 * rows["x_mm"] * rows["approach_i"]).to_numpy()


def nothing(rows: pd.DataFrame) -> Any:
    return 0.0


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("turned", [{2}, {1, 3}], ids=str)
def test_a_bar_turned_in_some_placements_is_named_there_and_nothing_is_invented(turned: set[int], seed: int) -> None:
    """It was told as a periodic error with a probability above 0.99; the errors of its faces are turned with it."""
    found = told(UNEVEN, turned, seed, 1.0, 0.3, scale_x).findings
    reversed_ = {one.choices["placement"]: one for one in found if one.kind == "gauge_reversed"}
    assert set(reversed_) == turned
    for one in reversed_.values():
        assert one.probability > 0.95
        assert abs(one.parameters["share"].value - 1.0) < 3.0 * (one.parameters["share"].u or 0.0)
    (scale,) = [one for one in found if one.kind != "gauge_reversed"]
    assert scale.kind == "scale_error"
    assert abs(scale.parameters["ppm"].value - SCALE_PPM) < 3.0 * (scale.parameters["ppm"].u or 0.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("turned", [{2}, set()], ids=str)
def test_nothing_is_said_of_a_symmetric_bar_or_of_one_that_was_not_turned(turned: set[int], seed: int) -> None:
    """The blocks of a symmetric bar stand as certified either way; their errors are smaller than the scatter."""
    faces = SYMMETRIC if turned else UNEVEN
    assert not told(faces, turned, seed, 1.5, 3.0, nothing).findings
