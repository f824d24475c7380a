"""Further measurements that a diagnosis proposes: the technician has to be able to plan them."""

from __future__ import annotations

import numpy as np

import stepgauge as sg
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.further_runs import FurtherRun, can_be_planned, further_runs
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.errors import InputError
from tests.diagnosis.made import ALONG_X, ALONG_Y, SCALE, gauge, machine, record


def is_planned(run: FurtherRun) -> bool:
    """Whether ``plan`` accepts the run, with the options that its command has."""
    try:
        sg.plan(run.placement, gauge(), machine(), cycles=run.cycles, measuring_speed_mm_s=run.speed_mm_s)
    except InputError:
        return False
    return True


def test_what_can_be_planned_is_what_plan_accepts() -> None:
    """A vertical stylus of 50 mm does not reach between the blocks of an inclined gauge."""
    data = make_residuals(record(machine(), (ALONG_X,), cycles=1), gauge(), machine())
    runs = list(further_runs(data))
    said = [can_be_planned(run, data) for run in runs]
    assert said == [is_planned(run) for run in runs]
    inclined = [abs(run.placement.axis[2]) > 0.1 for run in runs]
    assert any(inclined)
    assert not np.any(np.array(said)[inclined])
    assert np.all(np.array(said)[~np.array(inclined)])


def test_every_run_that_is_proposed_can_be_planned() -> None:
    """A scale error y on a gauge along x and y: an incline would tell it best from a rotation."""
    scale = ({**SCALE[0], "axis": "y"},)
    found = diagnose(record(machine(scale), (ALONG_X, ALONG_Y), cycles=3), gauge(), machine())
    assert found.placements
    for text in found.placements.values():
        axis = np.array(text.split("axis = [")[1].split("]")[0].split(","), float)
        assert abs(axis[2]) < 0.1
