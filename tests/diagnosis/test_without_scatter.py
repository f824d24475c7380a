"""Recordings that repeat as no reading does: cycles that were copied, and simulations without scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.conditions.duplicates import copied_cycles
from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.output.files import diagnosis_to_dict
from stepgauge.diagnosis.output.rows import row_table
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.diagnosis.wording.limits import without_scatter
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.inference.metric import RowMetric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.inference.problem import LEAST_SCATTER
from stepgauge.recording import Recording
from tests.axis.made import axis
from tests.diagnosis.made import ALONG_X, SCALE, Effects, by_hand, gauge, machine, record

STATED_UM = 0.3


Um = Callable[[pd.DataFrame], np.ndarray]


def scale(frame: pd.DataFrame) -> np.ndarray:
    return np.asarray(0.02 * frame["x_mm"] * frame["approach_i"])


def knock(frame: pd.DataFrame) -> np.ndarray:
    """A step in the middle of a cycle."""
    return np.asarray(4.0 * (frame["time_s"] > frame["time_s"].quantile(0.4)) * frame["approach_i"])


def residuals(recording: Recording) -> Residuals:
    return make_residuals(recording, gauge(), machine(noise_um=STATED_UM))


def told(recording: Recording) -> GaugeDiagnosis:
    return diagnose(recording, gauge(), machine(noise_um=STATED_UM))


def with_copies(recording: Recording, of: dict[int, int]) -> Recording:
    """With a cycle more for each of ``of``: the readings of a cycle that was measured, some time later."""
    frame = recording.frame
    later = frame["time_s"].max() - frame["time_s"].min() + 60.0
    parts = [
        frame[frame["cycle"] == old].assign(cycle=new, time_s=lambda f, i=i: f["time_s"] + i * later)
        for i, (new, old) in enumerate(of.items(), 1)
    ]
    return replace(recording, frame=pd.concat([frame, *parts], ignore_index=True))


def said(found: GaugeDiagnosis, recording: Recording) -> dict[str, object]:
    return diagnosis_to_dict(replace(found, recordings=(recording,)))


def test_a_copied_cycle_tells_nothing_and_the_reader_is_told_of_it() -> None:
    """A scale error from two cycles, and from these with five copies: the same value and the same uncertainty."""
    once = by_hand(gauge(), scale, cycles=2, noise_um=STATED_UM)
    many = with_copies(once, {3: 1, 4: 2, 5: 1, 6: 2, 7: 1})
    one, other = told(once), told(many)
    assert [f.label for f in one.findings] == [f.label for f in other.findings] == ["scale_error_x"]
    assert one.findings[0].parameters == other.findings[0].parameters
    assert (one.noise.sigma_um, one.noise.dof) == (other.noise.sigma_um, other.noise.dof)
    assert other.data.copied == ((1, 3), (1, 4), (1, 5), (1, 6), (1, 7))
    (warning,) = without_scatter(said(other, many))
    assert warning.startswith("Left out as copies: cycles 3, 4, 5, 6 and 7 of placement 1.")
    assert not list(without_scatter(said(one, once)))


def test_rows_are_told_with_their_numbers_in_the_file() -> None:
    """A copy between two cycles: rows after it keep the numbers that somebody counts in the file."""
    measured = by_hand(gauge(), scale, cycles=3, noise_um=STATED_UM)
    frame = measured.frame.copy()
    each = int((frame["cycle"] == 1).sum())
    second = frame["cycle"] == 2
    frame.loc[second, ["x_mm", "y_mm", "z_mm"]] = frame.loc[frame["cycle"] == 1, ["x_mm", "y_mm", "z_mm"]].to_numpy()
    frame.loc[2 * each + 4, "x_mm"] += 0.02
    found = told(replace(measured, frame=frame))
    table = row_table(found)
    assert found.data.copied == ((1, 2),)
    assert table["row"].tolist() == [*range(1, each + 1), *range(2 * each + 1, 3 * each + 1)]
    assert table.loc[table["used"] == 0, "row"].tolist() == [2 * each + 5]
    (outliers,) = (one for one in found.findings if one.kind == "outliers")
    assert outliers.choices["rows"] == (2 * each + 5,)


@pytest.mark.parametrize(("law", "name"), [(scale, "scale_error_x"), (knock, "step_change_x")])
def test_a_simulation_without_scatter_is_diagnosed(law: Um, name: str) -> None:
    """Of equal cycles the first one counts; what is left is less than the least that a reading can scatter by."""
    recording = by_hand(gauge(), law, cycles=4, noise_um=0.0)
    found = told(recording)
    assert found.verdict == "effects"
    assert [one.label for one in found.findings] == [name]
    assert all(check.passed for check in found.checks)
    assert len(list(without_scatter(said(found, recording)))) == 2


def test_nothing_is_found_in_a_simulation_without_scatter_and_without_effects() -> None:
    recording = by_hand(gauge(), lambda f: np.zeros(len(f)), cycles=4, noise_um=0.0)
    assert told(recording).verdict == "adequate"


@pytest.mark.parametrize(("effects", "names"), [((), []), (SCALE, ["scale_error_x"])])
def test_a_machine_that_repeats_perfectly_is_diagnosed(effects: Effects, names: list[str]) -> None:
    """A machine file with a repeatability of 0, and what the virtual CMM records with it: the usual one is taken."""
    perfect = machine((), noise_um=0.0)
    found = diagnose(record(machine(effects, noise_um=0.0), [ALONG_X]), gauge(), perfect)
    assert [one.label for one in found.findings] == names
    assert found.noise.sigma_um >= LEAST_SCATTER * shipped_priors().sizes.repeatability_um
    for one in found.findings:
        assert abs(one.parameters["ppm"].value - 8.0) < 2.0 * (one.parameters["ppm"].u or 0.0)


def test_many_laws_without_scatter_end_in_no_error() -> None:
    """Probabilities of the order of exp(-80000), and products of columns that are next to nothing."""

    def soaking(frame: pd.DataFrame) -> np.ndarray:
        hours = frame["time_s"] / 3600.0
        along = frame["x_mm"] - 200.0
        slow = 0.03 * np.exp(-hours / 0.05) + 0.02 * np.exp(-hours / 0.3) + 0.01 * np.sin(hours * 40.0) ** 3
        return np.asarray((along * slow + 3.0 * np.tanh(along / 60.0) * hours) * frame["approach_i"])

    found = told(by_hand(gauge(), soaking, cycles=4, noise_um=0.0, every_s=4.0))
    assert found.verdict in ("effects", "unknown")
    assert found.fit.rms_after_um < found.fit.rms_before_um


@pytest.mark.parametrize(
    ("faces", "law", "verdict"), [(6, None, "adequate"), (24, None, "adequate"), (24, scale, "effects")]
)
def test_equal_cycles_on_a_coarse_display(faces: int, law: Um | None, verdict: str) -> None:
    """A machine that repeats to less than the step of its display; short cycles do not count as copies."""
    recording = by_hand(gauge(), law or (lambda f: np.zeros(len(f))), cycles=4, noise_um=0.0)
    frame = recording.frame.assign(x_mm=recording.frame["x_mm"].round(3))
    assert told(replace(recording, frame=frame[frame["face"] <= faces].reset_index(drop=True))).verdict == verdict


def test_targets_at_equal_steps_are_no_steps_of_a_display() -> None:
    """Readings without scatter on whole millimetres: a scale error of 10 um over a metre is no resolution."""
    targets = np.arange(0.0, 1001.0, 50.0)
    found = diagnose_axis(axis(targets, lambda t, _: 0.01 * t, noise=0.0)).contents
    assert found["verdict"] == "effects"
    assert [one["kind"] for one in found["effects"]] == ["scale_error"]


@given(st.integers(0, 10**6), st.sampled_from([0.05, 0.1, 0.3, 1.0]), st.integers(8, 20), st.integers(2, 60))
def test_no_cycle_is_a_copy_by_chance(seed: int, step_um: float, faces: int, cycles: int) -> None:
    """Readings that scatter by 0.3 um, on the steps of a display."""
    random = np.random.default_rng(seed)
    cycle = np.repeat(np.arange(cycles), faces)
    position = [np.rint(random.normal(0.0, STATED_UM, len(cycle)) / step_um) for _ in range(3)]
    assert not copied_cycles(np.ones_like(cycle), cycle, position)


def test_an_evaluation_says_that_copies_do_not_show_how_the_machine_repeats() -> None:
    once = by_hand(gauge(), scale, cycles=3, noise_um=STATED_UM)
    assert not any("earlier cycle" in note for note in evaluate(once, gauge()).results[0].notes)
    notes = evaluate(with_copies(once, {4: 2, 5: 3}), gauge()).results[0].notes
    (note,) = (note for note in notes if "earlier cycle" in note)
    assert note.startswith("cycles 4 and 5: every reading is that of an earlier cycle")


def test_what_the_previous_reading_does_not_tell_is_no_less_than_the_least() -> None:
    """Of neighbours at even intervals with a correlation r the share that is not told is the root of 1 - r^2."""
    problem = bare_problem(residuals(by_hand(gauge(), scale, cycles=4, noise_um=STATED_UM)))
    scatters = NoiseModels(problem, shipped_priors().scatter)
    rows = RowMetric(problem, scatters.changed(scatters.plain(), correlation=0.9), scatters)
    n = len(problem)
    assert rows.innovation == pytest.approx(np.sqrt(1.0 - 0.81) ** ((n - 1) / n))
    flicker = RowMetric(problem, scatters.changed(scatters.plain(), flicker=1.0), scatters)
    told_by_inverse = np.linalg.inv(problem.flicker(1.0)).diagonal()
    assert flicker.innovation == pytest.approx(np.exp(np.log(told_by_inverse).mean()))
    assert problem.least_um == LEAST_SCATTER * STATED_UM
