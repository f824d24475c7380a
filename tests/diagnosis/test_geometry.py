"""A machine that was never compensated: all its geometric errors at once, made by other shapes than the diagnosis has.

The errors of each axis are Legendre polynomials to the third order over its travel, the rotations act with the arms of
a moving bridge. None of this is the vocabulary's: see :func:`uncompensated_um`.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial.legendre import legval

from stepgauge.diagnosis.engine import diagnose, diagnose_with_search
from stepgauge.diagnosis.further_runs import extended
from stepgauge.diagnosis.hypotheses import Predicting, hypotheses
from stepgauge.diagnosis.laws.geometry import KIND, PARTS, Geometry, integrated_sizes
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import make_problem
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.result import GaugeDiagnosis, rms
from stepgauge.effects import along_approach_um, make_effects
from stepgauge.errors import InputError
from stepgauge.gauge.placement import make_placement
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.inference.problem import Law
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.recording import APPROACH, POSITION, Recording, join_recordings
from tests.diagnosis.made import gauge, machine
from tests.diagnosis.test_further_laws import Axis, bent, measured, moved, told, turned

LINES = (turned(3.0), turned(88.0), turned(44.0), turned(-46.0), turned(20.0, 35.0), turned(70.0, -35.0))
TRAVEL_MM = 1000.0


def uncompensated_um(recording: Recording, size_um: float, seed: int) -> np.ndarray:
    """Displacement along the approach of a bridge whose motions err by ``size_um``, and 3 urad per um."""
    random = np.random.default_rng(seed)
    at_mm = recording.frame[POSITION].to_numpy(float)
    approach = recording.frame[APPROACH].to_numpy(float)
    along = 2.0 * at_mm / TRAVEL_MM - 1.0

    def motion(axis: int, size: float) -> np.ndarray:
        coefficients = random.normal(size=3) * size / np.arange(1, 4)
        return np.asarray(legval(along[:, axis], [0.0, *coefficients]))

    displaced = np.array([[motion(axis, size_um) for _ in range(3)] for axis in range(3)]).sum(axis=0).T
    for axis, arm in ((1, np.array([1.0, 0.0, 1.0])), (0, np.array([0.0, 0.0, 1.0]))):
        turn = np.array([motion(axis, 3e-3 * size_um) for _ in range(3)]).T  # mrad
        displaced += np.cross(turn, at_mm * arm)
    lean = random.normal(size=3) * 5e-3 * size_um
    displaced += np.c_[lean[0] * at_mm[:, 1] + lean[1] * at_mm[:, 2], lean[2] * at_mm[:, 2], np.zeros(len(at_mm))]
    return np.asarray((displaced * approach).sum(axis=1))


def uncompensated(size_um: float, seed: int) -> Recording:
    recording = measured(LINES, 100 + seed)
    return moved(recording, uncompensated_um(recording, size_um, seed))


@pytest.fixture(scope="module")
def found() -> GaugeDiagnosis:
    return told(uncompensated(5.0, 11))


def test_all_errors_at_once_are_named_and_simulated_down_to_the_scatter(found: GaugeDiagnosis) -> None:
    """Before, the nearest three to eight laws stood for them, or a smooth form did."""
    assert found.verdict == "effects", [one.where for one in found.unexplained]
    assert KIND in {one.kind for one in found.findings}
    assert found.fit.rms_before_um > 3.5 * found.noise.sigma_um
    assert found.fit.rms_after_um < 1.1 * found.noise.sigma_um
    for _, after in found.fit.holdout.values():
        assert after < 1.5 * found.noise.sigma_um


def test_of_single_errors_no_more_is_said_than_six_lines_tell(found: GaugeDiagnosis) -> None:
    """Six lines do not determine 42 errors, and the uncertainties say so."""
    finding = next(one for one in found.findings if one.kind == KIND)
    assert len(finding.parameters) == len(finding.effects) > 30
    sure = [one for one in finding.parameters.values() if one.u is not None and abs(one.value) > 2.0 * one.u]
    assert len(sure) < 6


def test_the_uncertainties_of_all_errors_hold_where_each_is_drawn_from_its_prior() -> None:
    """Of many errors two thirds within u, 95 % within 2 u: also of those of which the lines tell nothing."""
    empty = measured(LINES, 21)
    law = next(
        one
        for one in make_problem(make_residuals(empty, gauge(), machine()), shipped_priors()).candidates
        if one.kind == KIND
    )
    geometry: Geometry = law.source
    drawn = np.random.default_rng(22).normal(0.0, 5.0, len(geometry.families))
    true = dict(zip([one.label for one in geometry.families], (geometry.usual * drawn).tolist(), strict=True))
    every = geometry.made(geometry.usual * drawn)
    seen = make_residuals(empty, gauge(), machine()).probings
    found = told(moved(empty, np.sum([along_approach_um(one, seen) for one in every], axis=0)))
    finding = next(one for one in found.findings if one.kind == KIND)
    off = np.array([(one.value - true[name]) / (one.u or 1.0) for name, one in finding.parameters.items()])
    assert 0.6 < rms(off) < 1.3
    assert (np.abs(off) < 2.0).mean() > 0.9


def test_the_diagnosed_machine_has_the_errors(found: GaugeDiagnosis, tmp_path: Path) -> None:
    recording = uncompensated(5.0, 11)
    found.write(tmp_path / "out")
    table = tomllib.loads((tmp_path / "out" / "machine.diagnosed.toml").read_text())
    effects = make_effects(table["effect"], "machine.diagnosed.toml")
    kinds = {effect.kind for effect in effects}
    assert kinds >= PARTS
    seen = make_residuals(recording, gauge(), machine())
    simulated = np.sum([along_approach_um(effect, seen.probings) for effect in effects], axis=0)
    left = seen.without_origins(seen.um - simulated)
    assert rms(left) < 1.1 * found.noise.sigma_um
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    finding = next(one for one in said["effects"] if one["kind"] == KIND)
    assert finding["parameters"]["scale_error_x"]["unit"] == "um/m"
    assert "not compensated" in finding["meaning"]
    first_page = (tmp_path / "out" / "diagnosis.md").read_text().split("## Evidence")[0]
    assert "straightness" not in first_page.split("Scales, straightness")[0], "numbers that are not determined"


def test_what_is_no_geometry_is_named_beside_it() -> None:
    recording = uncompensated(5.0, 12)
    backlash = (np.abs(recording.frame[APPROACH].to_numpy(float)) * [2.0, 0.0, 0.0]).sum(axis=1)
    found = told(moved(recording, -backlash))
    finding = next(one for one in found.findings if one.kind == "reversal_error" and one.choices["axis"] == "x")
    value = finding.parameters["um"]
    assert value.u is not None
    assert value.value == pytest.approx(-4.0, abs=2.5 * value.u)  # 2 um each way
    assert value.u < 1.0
    assert KIND in {one.kind for one in found.findings}
    assert found.fit.rms_after_um < 1.2 * found.noise.sigma_um


@pytest.mark.parametrize(
    "table",
    [
        {"kind": "scale_error", "axis": "x", "ppm": 6.0},
        {"kind": "squareness", "plane": "xy", "urad": 12.0},
        {"kind": "angular_error", "travel_axis": "x", "rotation_axis": "z", "urad_per_m": 20.0},
    ],
)
def test_one_geometric_error_is_named_by_itself(table: dict[str, object]) -> None:
    recording = measured(LINES, 7)
    seen = make_residuals(recording, gauge(), machine()).probings
    (effect,) = make_effects([dict(table)], "test")
    found = told(moved(recording, along_approach_um(effect, seen)))
    assert [one.kind for one in found.findings] == [table["kind"]]
    assert KIND not in found.findings[0].confounded_with


SEVERAL: tuple[dict[str, object], ...] = (
    {"kind": "scale_error", "axis": "x", "ppm": -22.0},
    {"kind": "scale_error", "axis": "y", "ppm": 22.0},
    {"kind": "squareness", "plane": "xy", "urad": 35.0},
    {"kind": "reversal_error", "axis": "x", "um": 8.0},
    {"kind": "effective_radius", "um": -1.3},
)


@pytest.mark.parametrize("seed", [4, 5])
def test_three_geometric_errors_beside_two_others_are_told_one_by_one(seed: int) -> None:
    """All at once are one term for three, so that the search has to go from there to each of them."""
    found = told(bent(measured(LINES[:5], seed), *SEVERAL))
    said = {name for one in found.findings for name in (one.label, *one.confounded_with)}
    assert {"reversal_error_x", "effective_radius"} <= said
    alone = {"scale_error_x", "scale_error_y", "squareness_xy"} <= said
    assert alone or {KIND, "scale_error + scale_error + squareness"} <= said
    assert found.fit.rms_after_um < 1.1 * found.noise.sigma_um


@pytest.mark.parametrize("lines", [LINES[:3], [turned(30.0)] * 4])
def test_three_lines_or_one_do_not_show_a_geometry(lines: Sequence[Axis]) -> None:
    data = make_residuals(measured(lines, 3), gauge(), machine())
    assert all(one.kind != KIND for one in make_problem(data, shipped_priors()).candidates)


def test_a_geometry_is_the_sum_of_its_laws_and_as_uncertain_as_its_prior_where_nothing_shows() -> None:
    data = make_residuals(measured(LINES[:4], 4), gauge(), machine())
    law = next(one for one in make_problem(data, shipped_priors()).candidates if one.kind == KIND)
    assert isinstance(law, Law)
    assert isinstance(law.source, Geometry)
    geometry: Geometry = law.source
    mean = np.random.default_rng(5).normal(size=law.dimension)
    every = geometry.made(geometry.usual * (geometry.turn @ mean))
    moved_um = np.sum([along_approach_um(one, data.probings) for one in every], axis=0)
    left = data.without_origins(moved_um - mean @ law.columns(0))
    assert rms(left) < 1e-3 * rms(data.without_origins(moved_um))
    nothing = np.zeros((len(geometry.families), len(geometry.families)))
    mean, covariance = integrated_sizes(nothing, nothing[0], np.zeros(len(nothing), int), 2.0)
    assert rms(mean) == 0.0
    assert 2.0 < np.sqrt(covariance[0, 0]) < 20.0  # of a factor of three there are larger ones, not smaller ones


def test_a_machine_tool_brings_what_is_usual_of_it() -> None:
    """Beside the faults of a mill in both axes all errors at once took the sizes; it needed a file of priors."""
    truth: tuple[dict[str, Any], ...] = (
        {"kind": "scale_error", "axis": "x", "ppm": 1200.0},
        {"kind": "scale_error", "axis": "y", "ppm": -500.0},
        {"kind": "reversal_error", "axis": "x", "um": 80.0},
        {"kind": "squareness", "plane": "xy", "urad": -400.0},
    )
    places = np.array([0.0, 20.001, 120.004, 140.003])
    bar = replace(gauge(), nominal_mm=places, position_mm=places, u_um=np.full(4, 1.5))
    mill, runs = machine((), 3.0), []
    for number, axis in enumerate(((1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0)), 1):
        half = np.array([*axis, 0.0]) / np.hypot(*axis) * 60.0
        placement = make_placement(np.array([350.0, 500.0, 250.0]) - half, np.array([350.0, 500.0, 250.0]) + half, 1, 2)
        program = make_program(placement, bar, PlanOptions(1, 2, cycles=6, order="up-down"), ProbingSettings(5.0))
        true = machine(({"kind": "effective_radius", "um": 40.0}, *truth), 3.0)
        runs.append(run_program(program, true, bar, placement, number, RunConditions(20.0, number, 0.0)).recording)
    recording = join_recordings(runs)
    mill = replace(mill, table=mill.table.model_copy(update={"kind": "machine tool"}))
    found = diagnose(recording, bar, mill, separations=False)
    assert {(one.kind, one.choices.get("axis") or one.choices.get("plane")) for one in found.findings} == {
        ("effective_radius", None),
        *((str(one["kind"]), one.get("axis") or one.get("plane")) for one in truth),
    }
    sizes = {one.label: next(iter(one.parameters.values())) for one in found.findings}
    for label, true in (("scale_error_x", 1200.0), ("scale_error_y", -500.0), ("squareness_xy", -400.0)):
        u = sizes[label].u
        assert u is not None
        assert u < 40.0
        assert abs(sizes[label].value - true) < 3.0 * u


def test_without_leaves_it_out() -> None:
    found = diagnose(uncompensated(5.0, 11), gauge(), machine(), without=[KIND])
    assert all(one.kind != KIND for one in found.findings)
    with pytest.raises(InputError, match="geometric_errors"):
        diagnose(uncompensated(5.0, 11), gauge(), machine(), without=["geometric_error"])


def test_a_next_run_is_predicted_with_all_errors_at_once() -> None:
    """It agrees with what was measured, and with the truth of the new run within the uncertainty that it has."""
    recording = uncompensated(5.0, 11)
    data = make_residuals(recording, gauge(), machine())
    found = diagnose_with_search(data, separations=False)[1]
    assert found is not None
    likely = [one for one in hypotheses(found) if any(part.candidate.kind == KIND for part in one.parts)]
    assert likely
    more = extended(data, found.model.state.sigma_um)[0]
    prediction = Predicting(found, likely[:1], shipped_priors())(more)[0]
    old = np.arange(len(more.data)) < len(data)
    left = data.without_origins(data.um - prediction.mean_um[old])
    assert rms(left) < 1.2 * 0.3
    free = more.data.without_origins
    truth_um = uncompensated_um(replace(recording, frame=more.data.frame), 5.0, 11)
    off_um = free(truth_um - prediction.mean_um)[~old]
    columns = free(prediction.columns)
    known = columns[:, old] @ columns[:, old].T / 0.3**2 + np.diag(prediction.precision)
    variance = np.einsum("kn,kn->n", columns[:, ~old], np.linalg.solve(known, columns[:, ~old]))
    assert rms(off_um) < 2.0 * np.sqrt(variance.mean() + 0.1**2)  # and the gauge is known to 0.1 um
    assert rms(off_um) < 0.5 * rms(free(truth_um)[~old])


@pytest.mark.parametrize("by_kind", [True, False])
def test_values_hold_on_machines_whose_errors_have_other_ratios_than_is_usual(by_kind: bool) -> None:
    """Each kind of error, or each error, three times larger or smaller than usual, one sigma: within 2 u.

    One factor for all kinds, or a fixed spread of those of a kind, is too sure of the small ones.
    """
    data, priors = make_residuals(measured(LINES, 21), gauge(), machine()), shipped_priors()
    problem = make_problem(data, priors)
    geometry: Geometry = next(one for one in problem.candidates if one.kind == KIND).source
    scatters = NoiseModels(problem, priors.scatter)
    metric = Metric(problem, scatters.plain(), scatters, problem.within_um)
    kinds, labels = ([getattr(one, name) for one in geometry.families] for name in ("kind", "label"))
    columns = np.concatenate([one.signature(0) for one in geometry.families])
    random, within = np.random.default_rng(23), []
    for _ in range(12):
        factor = {kind: random.lognormal(0.0, np.log(3.0)) for kind in sorted(set(kinds if by_kind else labels))}
        true = (
            geometry.usual
            * 5.0
            * np.array([factor[one] for one in (kinds if by_kind else labels)])
            * random.normal(size=len(kinds))
        )
        sizes, covariance = geometry.posterior(metric, data.um + true @ columns, 5.0)
        within.append(np.abs(sizes - true) < 2.0 * np.sqrt(np.diag(covariance)))
    assert np.mean(within) > 0.93
