"""A gauge laid by hand is found to a micrometre, or refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.gauge.placement import Placement
from stepgauge.investigation.locating import (
    AGREE_MM,
    LAID_MM,
    NotAsAskedError,
    check_agreement,
    check_end_for_end,
    fitted,
    locate,
    locating_settings,
    targets,
)
from stepgauge.investigation.stations import nearly
from stepgauge.live.clock import MachineClock
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.in_process import VirtualLink
from stepgauge.machine.virtual import run_program
from stepgauge.recording import APPROACH, POSITION, Recording
from tests.build import make_gauge, make_pose
from tests.live.made import lying, small_gauge, small_machine, small_program, with_effects

GAUGE, MACHINE = small_gauge(), small_machine()
ASKED = lying(GAUGE)


def located(true: Placement, gauge: object = GAUGE) -> tuple[Placement, VirtualLink]:
    cmm = LiveCmm(MACHINE, gauge, true, MachineClock(None))  # type: ignore[arg-type]
    link = VirtualLink(cmm, locating_settings(MACHINE))
    return locate(link, ASKED, GAUGE, MACHINE)[0], link


@pytest.mark.parametrize("seed", range(4))
def test_a_gauge_laid_nearly_as_asked_is_found(seed: int) -> None:
    true = nearly(ASKED, np.random.default_rng(seed))
    assert np.linalg.norm(true.c1_mm - ASKED.c1_mm) > 0.1
    found, link = located(true)
    assert np.abs(found.c1_mm - true.c1_mm).max() < 2e-3
    assert np.abs(found.axis - true.axis).max() < 5e-5
    assert link.position_mm()[2] > ASKED.c1_mm[2] + 100.0  # out of the way


def test_a_warm_gauge_moves_its_faces_and_not_its_tops() -> None:
    cmm = LiveCmm(
        MACHINE, GAUGE, ASKED, MachineClock(None), with_effects({"kind": "gauge_temperature", "delta_K": 1.0})
    )
    found, _ = locate(VirtualLink(cmm, locating_settings(MACHINE)), ASKED, GAUGE, MACHINE)
    assert np.abs(found.c1_mm - ASKED.c1_mm).max() < 3e-3


def test_a_gauge_that_is_not_there_is_asked_for_again() -> None:
    away = replace(ASKED, c1_mm=ASKED.c1_mm + 60.0, c2_mm=ASKED.c2_mm + 60.0)
    with pytest.raises(NotAsAskedError, match="the gauge was not found: the top of block 1 is not there"):
        located(away)


def test_another_gauge_is_refused_by_its_length() -> None:
    with pytest.raises(NotAsAskedError, match="the probings do not fit this gauge"):
        located(ASKED, make_gauge(4, size=10.4, gap=10.0))


def test_probings_that_agree_within_the_limit_are_accepted() -> None:
    every = targets(GAUGE)
    check_agreement(every, np.full(7, 0.99 * AGREE_MM), "here")
    with pytest.raises(InputError, match=r"the left side of block 1 is -0\.110 mm off the others"):
        check_agreement(every, np.r_[np.zeros(6), -1.1 * AGREE_MM], "here")


def test_before_the_sides_are_probed_what_they_tell_is_as_asked() -> None:
    """From the two tops: height and rise; nothing else is moved."""
    true = make_pose(0.5, 0.04, 0.01, (150.0, 150.0, 101.0)).placement(GAUGE)
    every = targets(GAUGE)[:2]
    radius = MACHINE.probe.tip_radius_mm - 0.003
    points = [(true.to_machine(GAUGE, one.surface_mm) + radius * true.up).tolist() for one in every]
    found, off = fitted(ASKED, GAUGE, MACHINE, every, points)
    assert np.abs(off).max() < 1e-3
    assert found.axis[2] == pytest.approx(true.axis[2], abs=1e-4)
    assert np.abs((found.axis - ASKED.axis)[:2]).max() < LAID_MM / 1000.0


def test_a_gauge_that_lies_end_for_end_is_told_by_its_certificate() -> None:
    """A gauge whose blocks look alike, turned round: faces are called by the wrong numbers."""
    run = run_program(small_program(GAUGE, MACHINE, 2, ASKED), MACHINE, GAUGE, ASKED, seed=1)
    check_end_for_end(run.recording, GAUGE, 0.2)
    frame = run.recording.frame.copy()
    frame["face"] = GAUGE.n_faces + 1 - frame["face"]
    frame[POSITION] = -frame[POSITION]
    frame[APPROACH] = -frame[APPROACH]
    with pytest.raises(NotAsAskedError, match="lies end for end"):
        check_end_for_end(Recording(frame, {}, "run-2.csv"), GAUGE, 0.2)
