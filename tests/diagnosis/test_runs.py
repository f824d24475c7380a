"""Further measurements that a diagnosis proposes: the technician has to be able to plan them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import stepgauge as sg
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.further_runs import FurtherRun, can_be_planned, further_runs
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.errors import InputError
from stepgauge.gauge.placement import make_placement
from tests.diagnosis.made import ALONG_X, ALONG_Y, BLOCKS, SCALE, gauge, machine, record


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


def test_on_a_small_mill_the_gauge_can_be_turned_where_it_lies(tmp_path: Path) -> None:
    """With the bar and the mill of the recipe: only a diagonal tells a backlash of both axes from another tip."""
    page = (Path(sg.__file__).parents[1] / "docs/recipes/small-machines.md").read_text(encoding="utf-8")
    for name, text in re.findall(r"`([a-z.]+)`:\n\n```(?:toml|text)\n(.*?)```", page, re.S):
        (tmp_path / name).write_text(text, encoding="utf-8")
    bar, mill = sg.read_gauge(tmp_path / "bar.toml"), sg.read_machine(tmp_path / "router.toml")
    lies = make_placement(np.array([-210.0, -100.0, -60.0]), np.array([-90.0, -100.0, -60.0]), 1, 2)
    sg.plan(lies, bar, mill, cycles=4).write(tmp_path / "x.gcode", dialect="grblHAL")
    data = make_residuals(sg.simulate(tmp_path / "x.gcode", mill, bar, lies).recording, bar, mill)
    planned = [run.words.partition(", about")[0] for run in further_runs(data) if can_be_planned(run, data)]
    for words in ("the diagonal of x and y", "the diagonal of x and -y"):
        assert f"the gauge along {words}" in planned


def test_a_gauge_that_is_laid_as_it_lay_before_lies_where_it_was_recorded() -> None:
    """Within 10 mm of a placement that was recorded that one is proposed, and no other is called so."""
    alone = make_residuals(record(machine(), (ALONG_X,), cycles=1), gauge(), machine())
    there = next(run.placement for run in further_runs(alone) if "machine y" in run.words)
    centre = (there.c1_mm + there.axis * np.ptp(gauge().block_centre_mm[:BLOCKS]) / 2.0).tolist()
    for off_mm, known in ((6.0, True), (14.0, False)):
        centres = ((350.0, 600.0, 250.0), (centre[0] + off_mm, *centre[1:]))
        data = make_residuals(record(machine(), cycles=1, centres=centres), gauge(), machine())
        (run,) = (one for one in further_runs(data) if "machine y" in one.words)
        assert run.words.endswith("as it lay before") is known
        assert np.allclose(run.placement.c1_mm - there.c1_mm, [off_mm * known, 0.0, 0.0], atol=0.05)
