"""What the axes of a machine have together: play and errors of scales are rarely those of one axis alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import make_placement
from stepgauge.inference.evidence import Evidence
from stepgauge.inference.problem import Term, company_log_prior
from stepgauge.inference.screening import Screening
from stepgauge.machine.file import Machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program, middle_standoff_mm
from stepgauge.recording import Recording, join_recordings
from tests.build import make_gauge, make_machine
from tests.diagnosis.made import ALONG_X, ALONG_Y, gauge, machine, record
from tests.inference.made import coordinate, law, noise, problem, turns

DIAGONAL, ACROSS = (1.0, 1.0, 0.0), (1.0, -1.0, 0.0)


def plays() -> tuple[Any, Any, Any]:
    """Two laws of a kind that comes together, and one that does not."""
    one, other = (
        replace(law(label, um[None, None]), kind="play", again=2.0)
        for label, um in (("play x", coordinate()), ("play y", np.sin(9.0 * turns())))
    )
    return one, other, law("alone", np.cos(7.0 * turns())[None, None])


def named(effects: tuple[dict[str, Any], ...], axes: tuple[tuple[float, ...], ...]) -> set[str]:
    found = diagnose(record(machine(effects), axes, seed=3), gauge(), machine())
    assert found.verdict == "effects"
    return {one.label for one in found.findings}


def test_the_prior_of_terms_rises_for_every_further_one_of_a_kind() -> None:
    one, other, alone = plays()
    terms = [Term(c, 0, c.columns(0), 1.0, -3.0) for c in (one, other, alone)]
    assert company_log_prior([]) == company_log_prior(terms[:1]) == company_log_prior([terms[0], terms[2]]) == 0.0
    assert company_log_prior(terms[:2]) == company_log_prior(terms) == company_log_prior(terms[::-1]) == 2.0


def test_a_look_knows_what_is_there_of_its_kind() -> None:
    """The look of a second one, and of both as a pair, is near the number that is computed with it."""
    one, other, alone = plays()
    known = problem(noise() + 0.4 * coordinate() + 0.2 * np.sin(9.0 * turns()), (one, other, alone))
    evidence = Evidence(known, shipped_priors().scatter)
    start = evidence((), evidence.noise_models.plain())
    first = next(look for look in Screening(known)(start, evidence.noise_models) if look.candidate is one)
    state = evidence((first.term(),), start.noise)
    for look in Screening(known)(state, evidence.noise_models):
        if look.candidate is one:
            continue
        assert look.log_odds == look.candidate.log_odds + (2.0 if look.candidate is other else 0.0)
        added = evidence((first.term(), look.term()), start.noise)
        assert look.gain == pytest.approx(added.log_posterior - state.log_posterior, abs=0.3)
    apart = replace(known, candidates=tuple(replace(one, again=0.0) for one in known.candidates))
    ((first, second), *_), ((without, _), *_) = (
        Screening(one).pairs(start, evidence.noise_models, 1, frozenset()) for one in (known, apart)
    )
    assert {first.candidate, second.candidate} == {one, other}
    assert first.gain == pytest.approx(without.gain + 2.0)


def test_play_on_two_axes_is_told_as_that_or_as_the_tripod_that_cannot_be_told_from_it() -> None:
    """From four directions, two opposite to two, three lobes of any size and phase are what two reversals are."""
    play = tuple({"kind": "reversal_error", "axis": axis, "um": um} for axis, um in (("x", 2.4), ("y", 1.2)))
    found = diagnose(record(machine(play), (ALONG_X, ALONG_Y), seed=3), gauge(), machine())
    assert found.verdict == "effects"
    several = {replaced.laws for one in found.findings for replaced in one.several}
    stated = tuple(one.label for one in found.findings)
    assert {("reversal_error_x", "reversal_error_y")} & {stated, *several}


def test_two_scales_and_a_squareness_are_not_all_errors_of_the_geometry() -> None:
    scales = tuple({"kind": "scale_error", "axis": axis, "ppm": ppm} for axis, ppm in (("x", 17.0), ("y", -12.0)))
    square = {"kind": "squareness", "plane": "xy", "urad": 15.0}
    axes = (ALONG_X, ALONG_Y, DIAGONAL, ACROSS)
    assert named((*scales, square), axes) == {"scale_error_x", "scale_error_y", "squareness_xy"}


@pytest.mark.parametrize(("um", "seed"), [(0.06, 2), (0.06, 6), (0.14, 4)])
def test_play_of_one_axis_makes_nothing_unknown_on_another(um: float, seed: int) -> None:
    """What is expected there and hardly shows has no size: it is no finding, and no structure without a cause."""
    play = tuple({"kind": "reversal_error", "axis": axis, "um": size} for axis, size in (("x", 2.5), ("y", um)))
    recording = record(machine(play), (ALONG_X, ALONG_Y, DIAGONAL), seed=seed, cycles=3)
    found = diagnose(recording, gauge(), machine())
    assert found.verdict == "effects"
    assert [one.label for one in found.findings] == ["reversal_error_x"]


def test_a_mill_with_all_faults_is_told_though_a_tripod_might_explain_a_part() -> None:
    """One hypothesis in thirty has a tripod besides, which leaves the tip 4 um of the other sign: it told `unknown`."""
    nominal_mm = np.array([0.0, 12.0, 40.0, 52.0, 85.0, 97.0, 140.0, 152.0, 200.0, 212.0])
    position_mm = nominal_mm + 0.002 * np.arange(10)
    bar = replace(make_gauge(u_um=2.0), nominal_mm=nominal_mm, position_mm=position_mm)
    shipped = make_machine(tip_radius_mm=1.0, pretravel_um=20.0, stylus_length_mm=40.0, stylus_diameter_mm=1.0)
    known = {"kind": "machine tool", "repeatability_um": 2.0}
    mill = replace(shipped, table=shipped.table.model_copy(update=known))
    true = replace(mill, probe=mill.probe.model_copy(update={"pretravel_um": 55.0}), effects=FAULTS)
    found = diagnose(record_bar(true, bar, 50), bar, mill)
    assert found.verdict == "effects"
    values = {one.label: next(v for v in one.parameters.values() if v.u) for one in found.findings}
    truth = {"scale_error_x": 400.0, "scale_error_y": -800.0, "reversal_error_x": -45.0, "reversal_error_y": 90.0}
    truth |= {"squareness_xy": -250.0, "effective_radius": 35.0}
    assert {name: abs(value.value - truth[name]) < 3.0 * value.u for name, value in values.items()} == dict.fromkeys(
        truth, True
    )


FAULTS: tuple[dict[str, Any], ...] = (
    {"kind": "scale_error", "axis": "x", "ppm": 400.0},
    {"kind": "scale_error", "axis": "y", "ppm": -800.0},
    {"kind": "reversal_error", "axis": "x", "um": -45.0},
    {"kind": "reversal_error", "axis": "y", "um": 90.0},
    {"kind": "squareness", "plane": "xy", "urad": -250.0},
)


def record_bar(on: Machine, bar: Gauge, seed: int) -> Recording:
    """A bar along x, y and both diagonals, six cycles each."""
    runs = []
    for number, axis in enumerate((ALONG_X, ALONG_Y, DIAGONAL, ACROSS), 1):
        half = 100.0 * np.asarray(axis) / np.linalg.norm(axis)
        placement = make_placement(np.array([250.0, 200.0, -80.0]) - half, np.array([250.0, 200.0, -80.0]) + half, 1, 5)
        settings = ProbingSettings(standoff_mm=middle_standoff_mm(bar, 1.0))
        program = make_program(placement, bar, PlanOptions(1, 5, cycles=6, order="up-down"), settings)
        runs.append(run_program(program, on, bar, placement, seed + number, RunConditions(20.0, number)).recording)
    return join_recordings(runs)
