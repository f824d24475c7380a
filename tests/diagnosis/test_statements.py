"""What is said follows from probabilities: whatever they are, nothing is stated that they do not support."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.findings import _different
from stepgauge.diagnosis.gaussian_processes.random_function import SMOOTH, WAVE, RandomFunction
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis, Located
from stepgauge.diagnosis.statements import OPEN, UNDECIDED, conclude
from stepgauge.diagnosis.stating_rules import StatedTerm, spread_factor
from stepgauge.diagnosis.structure import _reduce_harmonics, _without_index
from stepgauge.diagnosis.wording.headline import headline, summary_line
from stepgauge.diagnosis.wording.phrases import number, worded
from stepgauge.effects import make_effects
from stepgauge.inference.neighbourhood import Mixture
from stepgauge.inference.noise_models import OUTLYING, NoiseModel
from stepgauge.inference.posterior import Posterior
from tests.diagnosis.made import ALONG_X, ALONG_Y, gauge, machine, made, record

Array = NDArray[np.float64]
DECISION = shipped_priors().decision
PLAIN = SimpleNamespace(is_plain=True, tails="normal", certificate=1.0)


def candidate(label: str, named: bool = True) -> Any:
    return SimpleNamespace(
        label=label, kind=label, named=named, combined=False, source=SimpleNamespace(covariate=label, label=label)
    )


def posterior(*parts: tuple[float, tuple[Any, ...], Any]) -> Any:
    """Probabilities over hypotheses: weight, candidates, noise."""
    every = [
        SimpleNamespace(
            candidates=c,
            labels=frozenset(one.label for one in c),
            mixture=Mixture(((cast(NoiseModel, noise), 0.0),)),
        )
        for _, c, noise in parts
    ]
    weights = np.array([weight for weight, _, _ in parts])
    fake = SimpleNamespace(hypotheses=every, weights=weights, probability_of_scatter=lambda _name: 0.0)
    fake.probability_of_nothing = partial(Posterior.probability_of_nothing, fake)
    return fake


def finding(kind: str, probability: float) -> Finding:
    return Finding(kind, kind, None, {}, {}, probability, np.ones(3), own=probability)


def located(covariate: str, probability: float) -> Located:
    return Located(covariate, "both", SMOOTH, f"a smooth function of {covariate}", 1.0, probability)


def test_nothing_is_stated_below_its_probability_and_adequate_only_with_it() -> None:
    """Adequate was said with a probability of 0.40 that there is nothing, laws with 0.31, forms with 0.05."""
    random, verdicts = np.random.default_rng(1), set()
    law, form = candidate("drift"), candidate("time", named=False)
    for _ in range(400):
        parts = ((), (law,), (form,), (law, form))
        weights = random.dirichlet(np.full(4, 0.4))
        answer = posterior(*((w, c, PLAIN) for w, c in zip(weights, parts, strict=True)))
        p_law, p_form = weights[1] + weights[3], weights[2] + weights[3]
        found = conclude(answer, [finding("drift", p_law)], [located("time", p_form)], DECISION)
        assert all(one.probability >= DECISION.stated for one in (*found.findings, *found.structure))
        undecided = [one for one in found.structure if one.form == UNDECIDED]
        assert (found.verdict == "unknown") == (p_form >= DECISION.stated or bool(undecided))
        excluded = 1.0 - weights[0] >= DECISION.excluded * weights[0]
        assert bool(undecided) == (max(p_law, p_form) < DECISION.stated and excluded)
        assert found.verdict != "effects" or p_law >= DECISION.stated
        if found.verdict == "adequate":
            assert found.table["adequate"] == pytest.approx(weights[0])
            assert weights[0] >= DECISION.stated
        assert found.table["explained"] == pytest.approx(weights[1] if found.findings else weights[0] + weights[1])
        verdicts.add(found.verdict)
    assert verdicts == {"unknown", "effects", "adequate", "insufficient"}


def test_what_two_laws_may_be_as_well_as_one_function_is_stated_with_the_odds_of_each() -> None:
    """It was insufficient, with nothing at all excluded, and the pair of laws was not among the statements."""
    form, x, y, squareness = candidate("machine x", False), candidate("scale x"), candidate("scale y"), candidate("xy")
    parts = ((0.42, (form,)), (0.315, (x, y)), (0.225, (x, squareness)), (0.04, ()))
    found = conclude(posterior(*((p, one, PLAIN) for p, one in parts)), [], [], DECISION)
    (one,) = found.structure
    assert (found.verdict, one.form, one.probability) == ("unknown", UNDECIDED, pytest.approx(0.96))
    assert [(law.laws, pytest.approx(law.odds)) for law in one.laws] == [
        (("scale x", "scale y"), 0.75),
        (("scale x", "xy"), pytest.approx(0.225 / 0.42)),
    ]


def test_structure_of_which_no_single_one_is_likely_is_told_with_what_it_may_depend_on() -> None:
    forms = [candidate(name, named=False) for name in ("time", "order", "cycle")]
    answer = posterior(*((p, (one,), PLAIN) for p, one in zip((0.4, 0.3, 0.2), forms, strict=True)), (0.1, (), PLAIN))
    found = conclude(answer, [], [located("time", 0.4)], DECISION)
    (one,) = found.structure
    assert (found.verdict, one.form, one.covariate) == ("unknown", OPEN, "time")
    assert one.probability == pytest.approx(0.9)
    assert "time, order or cycle" in one.where


def test_outliers_are_no_nothing_heavy_tails_are() -> None:
    heavy = SimpleNamespace(is_plain=True, tails="heavy", certificate=1.0)
    outlying = SimpleNamespace(is_plain=False, tails=OUTLYING, certificate=1.0)
    assert conclude(posterior((0.6, (), heavy), (0.4, (), outlying)), [], [], DECISION).verdict == "adequate"
    assert conclude(posterior((0.4, (), heavy), (0.6, (), outlying)), [], [], DECISION).verdict == "insufficient"


def said(**odds: Any) -> dict[str, Any]:
    _, found = made("scale")
    table = {**found.probabilities, **odds}
    return dict(replace(found, probabilities=table).contents)


def test_the_headline_says_what_the_probabilities_support() -> None:
    assert "known physics explains it: scale error x" in headline(said())
    weak = headline(said(explained=0.4))
    assert "known physics" not in weak
    assert "likelier than not, not all of them" in weak
    open_ = {**said(adequate=0.4, possible=[{"label": "vibration_x", "probability": 0.3}]), "verdict": "insufficient"}
    open_ |= {"effects": [], "unexplained": []}
    assert "sure enough to be stated: nothing at all 0.40, vibration x 0.30." in headline(open_)
    assert "vibration x 0.30" in summary_line(open_)


# -- structure ---------------------------------------------------------------------------------------------------------


def wave(far: dict[int, float]) -> tuple[StatedTerm, Any]:
    """A wave of period 4 mm with some harmonics, in standard deviations."""
    form = RandomFunction("position", "mm", WAVE, (), (4.0,), (), side="gauge")
    term = SimpleNamespace(candidate=SimpleNamespace(source=form))
    mean = np.array([far.get(k % 5 + 1, 0.0) * (k < 5) for k in range(10)])
    state = SimpleNamespace(index_of=lambda _term: 0, amplitudes=lambda _place: (mean, np.eye(10)))
    return SimpleNamespace(term=term), SimpleNamespace(state=state)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("far", "period"), [({1: 9.0}, 4.0), ({2: 9.0}, 2.0), ({2: 9.0, 4: 7.0}, 2.0), ({2: 9.0, 3: 9.0}, 4.0), ({}, 4.0)]
)
def test_a_period_is_that_of_its_harmonics_and_no_multiple_of_it(far: dict[int, float], period: float) -> None:
    """0.5 mm stood for 0.25 mm at a probability of 1.000."""
    term, model = wave(far)
    phrase = {"say": "wave", "covariate": "position", "period": number(4.0, "mm")}
    form = Located("position", "both", WAVE, [phrase], 1.0, 1.0, numbers=4.0)
    found = _reduce_harmonics(term, model, form)
    assert found.numbers == period
    assert f"period {period:g} mm" in found.where


def test_a_period_in_rows_is_never_told() -> None:
    phrases = [{"say": "wave", "covariate": "order", "period": number(10.0)}, {"say": "approach"}]
    form = Located("order", "both", WAVE, phrases, 1.0, 1.0)
    assert worded(_without_index(form)) == "repeats in the order of the readings, along the approach"
    assert "period 10" in worded(_without_index(replace(form, covariate="time")))


# -- one law by two names ----------------------------------------------------------------------------------------------


@lru_cache
def two_placements() -> GaugeDiagnosis:
    return made("scale")[1]


def test_a_law_by_another_name_is_named_once_and_another_cause_with_the_same_law_stays() -> None:
    """A roll was its own rival as the angular error about its own axis."""
    tables = {
        "roll": {"kind": "roll", "axis": "y", "urad_per_m": 7.0},
        "about itself": {"kind": "angular_error", "travel_axis": "y", "rotation_axis": "y", "urad_per_m": -2.0},
        "pitch": {"kind": "angular_error", "travel_axis": "y", "rotation_axis": "x", "urad_per_m": 5.0},
        "too long": {"kind": "scale_error", "axis": "x", "ppm": 5.0},
        "warm": {"kind": "scale_temperature", "axis": "x", "delta_K": 1.0},
    }
    numbers = {"roll": "urad_per_m", "about itself": "urad_per_m", "pitch": "urad_per_m", "too long": "ppm"}
    fits: Any = {
        name: SimpleNamespace(effect=make_effects([table], "test")[0], parameters={numbers.get(name, "delta_K"): 0.0})
        for name, table in tables.items()
    }
    laws: Any = [SimpleNamespace(candidate=candidate(name)) for name in tables]
    kept = [one.candidate.label for one in _different(laws, fits, two_placements().data)]
    assert kept == ["roll", "pitch", "too long", "warm"]


def test_two_scale_errors_seen_in_two_oblique_placements_are_named_with_their_odds_and_a_measurement() -> None:
    """The verdict was unknown, with 'do not adjust', and the pair of laws stood in a footnote."""
    on = machine(
        ({"kind": "scale_error", "axis": "x", "ppm": 9.0}, {"kind": "scale_error", "axis": "y", "ppm": -6.9}), 0.1
    )
    oblique = np.array([[np.sqrt(0.75), 0.5, 0.0], [-0.5, np.sqrt(0.75), 0.0]])
    found = diagnose(record(on, oblique.tolist(), cycles=3), gauge(), machine((), 0.1))
    text = headline(found.contents)
    named = {label for one in found.unexplained for law in one.laws for label in law.laws}
    named |= {one.label for one in found.findings}
    assert {"scale_error_x", "scale_error_y"} <= named or "scale_temperature_x" in named
    if found.verdict == "unknown":
        assert "which these readings do not exclude" in text
        assert found.unexplained[0].separate_by.startswith("the gauge along")
        assert len(found.placements) == 1
    else:
        assert found.verdict == "effects"


def test_faults_in_two_axes_of_a_mill_are_a_set_until_its_kind_is_stated() -> None:
    """That one may be stated is noted with what is unknown (tests/cli/test_diagnose.py)."""
    on = machine(
        ({"kind": "scale_error", "axis": "x", "ppm": 40.0}, {"kind": "scale_error", "axis": "y", "ppm": -30.0}), 0.1
    )
    oblique = np.array([[np.sqrt(0.75), 0.5, 0.0], [-0.5, np.sqrt(0.75), 0.0]])
    recording = record(on, oblique.tolist(), cycles=3)
    found = diagnose(recording, gauge(), machine((), 0.1))
    assert ("scale_error_x", "scale_error_y") in [tuple(sorted(one.laws)) for one in found.findings[0].several]
    assert diagnose(recording, gauge(), machine((), 0.1), kind="machine tool").findings[0].kind == "scale_error"


def test_a_machine_that_is_as_its_file_says_is_not_said_to_be_wrong_by_its_kind_alone() -> None:
    """The priors of a machine tool make something likelier than not before anything is read: it was `unknown`."""
    recording = record(machine((), 0.1), (ALONG_X, ALONG_Y), cycles=3)
    found = diagnose(recording, gauge(), machine((), 0.1), kind="machine tool")
    assert found.verdict in ("adequate", "insufficient")


def test_the_scatter_is_that_of_the_machine_file_in_an_ordinary_recording() -> None:
    recording = record(machine(), (ALONG_X, ALONG_Y))
    assert make_residuals(recording, gauge(), machine()).um.std() > 0.0
    assert all(one.kind != "repeatability" for one in made("null")[1].findings)


def test_the_uncertainty_of_a_told_size_covers_what_other_hypotheses_say() -> None:
    """27 um is told with u = 1.3 um; over all hypotheses it is 32 with a variance of 30 um2: u2 = 30 + (32 - 27)2."""
    term = SimpleNamespace(candidate=SimpleNamespace(label="reversal"))
    state: Any = SimpleNamespace(
        terms=[term], place_of=lambda _: 0, amplitudes=lambda index: (np.array([27.0]), np.array([[1.69]]))
    )
    answer: Any = SimpleNamespace(spread=lambda *_: (np.array([32.0]), np.array([[30.0]])))
    assert spread_factor(answer, state, "reversal", 0.05) * 1.3 == pytest.approx(math.sqrt(55.0))
    same: Any = SimpleNamespace(spread=lambda *_: (np.array([27.0]), np.array([[1.0]])))
    assert spread_factor(same, state, "reversal", 0.05) == 1.0
