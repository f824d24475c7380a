"""The first placing of a gauge, from 16 points that a person measures and the server sends by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.executors.journal import open_steps
from stepgauge.investigation.running import Runner
from stepgauge.investigation.stations import Served
from stepgauge.live.controller import ControllerOptions
from tests.build import make_points, make_pose
from tests.investigation.made import small_case
from tests.live.made import events, make_state, serving

POSE = make_pose(0.5, 0.03, 0.0, (150.0, 150.0, 100.0))
WAYS = np.array([*[[1, 0, 0]] * 3, [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, -1], [-1, 0, 0]], float)
"""Approaches of the points of a block, in gauge coordinates."""


def measured(order: list[int]) -> list[dict[str, Any]]:
    """A person's probings, each from 3 mm before the contact to 1 mm beyond it."""
    case = small_case()
    centres = make_points(case.gauge, POSE, case.machine.probe.tip_radius_mm, (1, case.gauge.n_blocks))
    ways = np.vstack([WAYS, WAYS]) @ POSE.rotation
    table: dict[str, Any] = {"kind": "measured_by_hand", "after_points": 0}
    return [table | {"from_mm": tuple(centres[n] - 3.0 * ways[n]), "to_mm": tuple(centres[n] + ways[n])} for n in order]


def placed(folder: Path, port: int, told: list[str], again: bool = False) -> Any:
    case = small_case()
    steps = open_steps(folder, {}, again)
    try:
        station = Served(f"127.0.0.1:{port}", case.machine, ControllerOptions(home=True))
        return Runner(case, station, steps, lambda _: True).placed_by_hand(told.append)
    finally:
        steps.close()


def test_points_by_hand_place_the_gauge_and_are_asked_for_once(tmp_path: Path) -> None:
    """Exchanged points are refused with the reason; those measured anew place it within the pre-travel."""
    order = list(range(16))
    case, exchanged = small_case(), [*order[:10], 11, 10, *order[12:]]
    true = POSE.placement(case.gauge)
    state = make_state(None, events(*measured(exchanged)), case.machine, true)
    told: list[str] = []
    with serving(state) as port:
        with pytest.raises(InputError, match="point"):
            placed(tmp_path, port, told)
        state.cmm.faults.events += events(*measured(order)).events
        found = placed(tmp_path, port, told, again=True)
        assert not state.user_enabled
        again = placed(tmp_path, port, told, again=True)
    assert told.count("point 16 of 16") == 2
    assert np.allclose(again.c1_mm, found.c1_mm)
    assert np.abs(found.c1_mm - true.c1_mm).max() < 0.02
    assert np.abs(found.axis - true.axis).max() < 2e-4
