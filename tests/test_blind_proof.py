"""The blind benchmark's harder half: scatters and ways that are not ideal, the ideal observer, reliability."""

from __future__ import annotations

import json
from math import erf, log, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.blind.bound import Signatures, bound, neighbours, signatures_of
from benchmarks.blind.bound import _log_weight as log_weight
from benchmarks.blind.catalogue import RECIPES, TRIPLES
from benchmarks.blind.cause import Cause, along, nuisances, size, strength_for
from benchmarks.blind.families import waves
from benchmarks.blind.figure import draw_reliability
from benchmarks.blind.generate import Case, list_cases, make_case, sample
from benchmarks.blind.identify import covariance_um2, leftovers, whitener
from benchmarks.blind.limit import PRIOR_ODDS, named_rightly
from benchmarks.blind.machine_causes import scale_error, squareness
from benchmarks.blind.run import main as run_main
from benchmarks.blind.run_causes import thermal_drift
from benchmarks.blind.scatter import IDEAL, NOT_IDEAL, SCATTERS
from benchmarks.blind.scene import Design, Scene, make_scene, recorded_um
from benchmarks.blind.score import rivals, score_case
from benchmarks.blind.statements import bin_of, reliability, statements
from benchmarks.blind.table import summarise, text
from benchmarks.blind.ways import WAYS
from benchmarks.blind.writers import write_case

Random = np.random.Generator


def rng(seed: int = 5) -> Random:
    return np.random.default_rng(seed)


def scene_of(kit: str, seed: int = 3, **settings: Any) -> Scene:
    return make_scene(Design(kit, **settings), rng(seed))


# --- scatter ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scatter", NOT_IDEAL, ids=lambda scatter: scatter.name)
def test_every_scatter_has_the_noise_that_is_stated(scatter: Any) -> None:
    scene, random = scene_of("x"), rng()
    rms = [np.sqrt(np.mean(scatter.noise_um(random, scene) ** 2)) for _ in range(200)]
    before_um = sqrt(scene.sigma_um**2 - scatter.step_um**2 / 12.0)
    assert np.sqrt(np.mean(np.square(rms))) == pytest.approx(before_um, rel=0.06)


def test_moments_are_those_of_the_laws() -> None:
    """Gamma of shape 3: skewness 2 / sqrt(3). Student's t of 4: its fourth moment does not exist, its quantiles do."""
    skewed = SCATTERS["skewed"].draw(rng(), 400_000)
    assert np.mean(skewed**3) == pytest.approx(2.0 / sqrt(3.0), rel=0.05)
    student = SCATTERS["student_t"].draw(rng(), 400_000)
    assert np.quantile(student, 0.975) == pytest.approx(2.776 / sqrt(2.0), rel=0.02)  # tables: t(0.975, 4) = 2.776


@pytest.mark.parametrize("name", ["ar1_0.6", "ar1_0.9", "flicker"])
def test_touches_are_correlated_as_stated(name: str) -> None:
    scatter, random, n = SCATTERS[name], rng(), 60
    white = np.linalg.cholesky(scatter.matrix(n)) @ random.standard_normal((n, 20_000))
    found = white @ white.T / 20_000
    assert found == pytest.approx(scatter.matrix(n), abs=0.05)
    assert scatter.matrix(n)[0, 1] == pytest.approx({"ar1_0.6": 0.6, "ar1_0.9": 0.9, "flicker": 0.65}[name], abs=0.05)


def test_flicker_has_as_much_in_every_octave() -> None:
    n = 512
    row = SCATTERS["flicker"].matrix(n)[0]
    at = np.arange(1 - n, n)
    power = [sum(row[np.abs(at)] * (1 - np.abs(at) / n) * np.cos(2 * np.pi * f / n * at)) for f in (8, 16, 32, 64)]
    assert [power[k] / power[k + 1] for k in range(3)] == pytest.approx([2.0, 2.0, 2.0], rel=0.1)


@pytest.mark.parametrize("step_um", [0.5, 1.0])
def test_a_display_shows_multiples_of_its_step(step_um: float) -> None:
    scene = scene_of("diagonal")
    at_um = 1e3 * np.einsum("ij,ij->i", scene.centre_mm, scene.approach)
    shown = (at_um + recorded_um(scene, rng().normal(0.0, 0.4, len(scene)), step_um)) / step_um
    assert shown == pytest.approx(np.round(shown), abs=1e-6)
    assert recorded_um(scene, np.ones(len(scene))) == pytest.approx(1.0)


def test_a_certificate_may_admit_half_of_its_uncertainty(tmp_path: Path) -> None:
    scene = scene_of("x")
    for name, stated in (("whole", 1.0), ("half", 0.5)):
        write_case(tmp_path / name, scene, scene.centre_mm, split=False, humidity=False, stated=stated)
    whole, half = (
        np.loadtxt(tmp_path / name / "gauge-faces.csv", delimiter=",", skiprows=1)[:, 3] for name in ("whole", "half")
    )
    assert half == pytest.approx(whole / 2.0, abs=6e-4)
    assert whole[1:].min() > 0.0


def test_the_noise_of_a_case_is_that_of_its_scatter(tmp_path: Path) -> None:
    for name in ("ar1_0.9", "rounded_1", "student_t"):
        truth = make_case(Case(f"scatter-null:{name}", 0.0, 11), tmp_path)
        assert truth["scatter"] == name
        assert truth["noise_rms_um"] == pytest.approx(truth["sigma_um"], rel=0.35)


# --- ways -------------------------------------------------------------------------------------------------------------


def way(name: str, seed: int) -> Scene:
    designs = WAYS[name]
    return make_scene(designs[seed % len(designs)], rng(seed))


@pytest.mark.parametrize("seed", range(6))
def test_the_gauge_lies_off_the_axes_and_stands_up_as_stated(seed: int) -> None:
    axis = way("off_axis", seed).axis[0]
    assert 0.2 < np.degrees(np.arctan2(abs(axis[1]), abs(axis[0]))) < 45.5  # half a degree, less 4 mrad of laying
    rise = np.degrees(np.arcsin(np.abs(way("tilted", seed).axis[:, 2])))
    assert rise.min() > 4.0
    assert rise.max() < 41.0


def test_times_and_places_are_as_each_way_says() -> None:
    rhythm, hour, years, long = way("rhythm", 1), way("hour", 1), way("years", 1), way("long", 1)
    beats = np.diff(rhythm.time_s) / 5.0
    assert beats == pytest.approx(np.round(beats), abs=0.0)
    assert np.median(beats) == 1.0
    assert set(hour.face) == {1}
    assert np.ptp(hour.time_s) == pytest.approx(3600.0, rel=0.01)
    months = np.array([years.time_s[years.cycle == cycle].mean() for cycle in range(1, 25)])
    assert np.diff(months).mean() / 86400.0 == pytest.approx(30.4, abs=0.5)
    assert len(long.gauge.nominal_mm) == 22
    assert long.gauge.length_mm > 2000.0
    far = way("far", 1)
    assert far.gauge.length_mm < 200.0
    assert np.abs(far.centre_mm[:, :2] - [560.0, 850.0]).max() < 120.0


def test_the_heater_is_off_for_five_minutes(tmp_path: Path) -> None:
    scene = way("hour", 2)
    cause = RECIPES["way-outside:hour:late_heater"].causes[0](scene, rng())
    moved = np.abs(along(scene, cause.displace(1.0)))
    cold = scene.time_s - scene.time_s[0] <= 300.0
    assert moved[cold].max() == 0.0
    assert (np.diff(moved[~cold]) >= 0.0).all()
    truth = make_case(Case("way-outside:hour:late_heater", 1.0, 2), tmp_path)
    assert truth["causes"][0]["kind"] == "thermal_drift"
    told = {"kind": "thermal_drift", "probability": 0.999, "parameters": {"start_s": {"value": 300.0}}}
    diagnosis = {"verdict": "effects", "effects": [told]}
    assert score_case(truth, diagnosis)["right"]
    assert [one["true"] for one in statements(truth, diagnosis)] == [True]
    wrong = {"verdict": "effects", "effects": [told | {"kind": "step_change"}]}
    assert not score_case(truth, wrong)["right"]
    assert truth["causes"][0]["size"] == pytest.approx(1.0, rel=2e-3)


def test_triples_are_three_causes_that_can_be_told_apart(tmp_path: Path) -> None:
    for recipe in TRIPLES:
        truth = make_case(Case(f"triple:{recipe.name}", 1.0, 4), tmp_path)
        assert len({cause["kind"] for cause in truth["causes"]}) == 3
        assert truth["bound"] > 0.85
        for cause in truth["causes"]:  # no other kind does as well beside the other two
            assert rivals(cause) <= {"scale_temperature", "gauge_temperature"}


# --- which names fit --------------------------------------------------------------------------------------------------


def test_a_running_product_gives_the_waves() -> None:
    at = rng().uniform(0.0, 6000.0, 50)
    frequency = 1.0 / 250.0 + np.arange(984) / 4000.0
    assert waves(1.0 / 4000.0, 984, 1.0 / 250.0, at) == pytest.approx(np.exp(2j * np.pi * frequency[:, None] * at))


@pytest.mark.parametrize("name", ["normal", "ar1_0.9"])
def test_whitening_makes_the_covariance_one(name: str) -> None:
    scene = scene_of("x")
    whiten = whitener(scene, SCATTERS[name])
    root = whiten(np.eye(len(scene)))
    covariance = covariance_um2(scene, SCATTERS[name])
    assert root.T @ covariance @ root == pytest.approx(np.eye(len(scene)), abs=1e-7)


def test_leftovers_beside_two_others_are_those_of_a_plain_fit() -> None:
    """The leftover of a one-column law against weighted least squares with all columns, done at once."""
    scene = scene_of("mirrored")
    causes = [scale_error(scene, rng(), 0), squareness(scene, rng(), "xy"), thermal_drift(scene, rng())]
    effects = [along(scene, cause.displace(strength_for(scene, cause, 1.0))) for cause in causes]
    column = scene.speed_mm_s
    inverse = np.linalg.inv(covariance_um2(scene, IDEAL))
    columns = np.column_stack([nuisances(scene, radius=False), effects[1], effects[2], column])
    fit = np.linalg.solve(columns.T @ inverse @ columns, columns.T @ inverse @ effects[0])
    off = effects[0] - columns @ fit
    found = leftovers(scene, effects[0], np.array(effects[1:]))
    assert found["trigger_delay"] == pytest.approx(off @ inverse @ off, rel=1e-6)
    assert found["scale_error:x"] < 0.1


def test_correlated_scatter_hides_what_is_slow_and_bares_what_is_quick() -> None:
    """AR(1) has (1 - r^2) / |1 - r exp(i w)|^2 of white noise's power at w radians per touch (Priestley 1981, 3.5)."""
    scene = way("hour", 4)
    touch = np.arange(len(scene))
    turns = 2.0 * np.pi * np.array([5.0, round(len(scene) / 2.2)]) / len(scene)
    causes = [
        Cause(f"wave{k}", lambda um, w=w: um * np.cos(w * touch)[:, None] * scene.approach) for k, w in enumerate(turns)
    ]
    white, red = (
        np.diag(signatures_of(scene, SCATTERS[name], causes, rng()).gram)[:2] for name in ("normal", "ar1_0.9")
    )
    power = (1.0 - 0.9**2) / np.abs(1.0 - 0.9 * np.exp(1j * turns)) ** 2
    assert red / white == pytest.approx(1.0 / power, rel=0.1)
    assert red[0] < 0.1 * white[0] < white[1] < 0.1 * red[1]


# --- the ideal observer -----------------------------------------------------------------------------------------------


def one_cause(key: str = "a", effect_size: float = 1.0, **leftover: float) -> dict[str, Any]:
    return {"kind": key, "where": "", "size": effect_size, "leftover_chi2": leftover, "strength": 1.0}


@pytest.mark.parametrize("chi2", [2.0, 6.0, 12.0])
def test_one_mechanism_against_nothing_in_closed_form(chi2: float) -> None:
    """The odds pass one where z^2 / (g + 1) > ln(1 + g); z is normal about g with variance g."""
    only = Signatures(["a"], np.array([[chi2]]), np.ones(1), [0])
    edge = sqrt((chi2 + 1.0) * log(1.0 + chi2))
    high, low = ((end * edge - chi2) / sqrt(2.0 * chi2) for end in (1.0, -1.0))
    right = 0.5 * (1.0 - erf(high)) + 0.5 * (1.0 + erf(low))
    found = np.mean([bound(only, [one_cause()], seed) for seed in range(30)])
    assert found == pytest.approx(right, abs=4.0 * sqrt(0.25 / 6000.0))


@pytest.mark.parametrize("odds", PRIOR_ODDS[:3])
def test_what_is_likelier_beforehand_is_named_more_often_in_closed_form(odds: int) -> None:
    """The odds pass one where z^2 / (g + 1) > ln(1 + g) - 2 ln(odds): always, if that is negative."""
    chi2, only = 6.0, Signatures(["a"], np.array([[6.0]]), np.ones(1), [0])
    edge = sqrt((chi2 + 1.0) * max(log(1.0 + chi2) - 2.0 * log(odds), 0.0))
    high, low = ((end * edge - chi2) / sqrt(2.0 * chi2) for end in (1.0, -1.0))
    right = 0.5 * (1.0 - erf(high)) + 0.5 * (1.0 + erf(low))
    found = np.mean([named_rightly(only, [one_cause()], seed)[PRIOR_ODDS.index(odds)] for seed in range(30)])
    assert found == pytest.approx(right, abs=4.0 * sqrt(0.25 / 6000.0))


def test_nothing_is_found_in_nothing_but_as_often_as_the_prior_allows() -> None:
    none = Signatures(list("abcdefgh"), 300.0 * np.eye(8), np.ones(8), [])
    assert np.mean([bound(none, [], seed) for seed in range(10)]) > 0.97


@pytest.mark.parametrize(("leftover", "right"), [({"b": 0.0}, True), ({}, False)])
def test_a_name_that_is_the_same_is_right_where_it_may_be_mentioned(leftover: dict[str, float], right: bool) -> None:
    gram = 300.0 * np.array([[1.0, 1.0], [1.0, 1.0]])
    same = Signatures(["a", "b"], gram, np.ones(2), [0])
    assert (bound(same, [one_cause(**leftover)], 1) > 0.95) is right
    assert bound(same, [one_cause(**leftover)], 1) > 0.95 or not right


def test_what_would_have_to_be_out_of_all_measure_is_not_believed() -> None:
    """Two mechanisms look the same, but one must displace the machine twentyfold: the usual one is told alone."""
    gram = 300.0 * np.array([[1.0, 1.0], [1.0, 1.0]])
    unusual = Signatures(["a", "b"], gram, np.array([1.0, 0.05]), [0])
    assert bound(unusual, [one_cause()], 1) > 0.95


def test_the_weights_are_marginal_likelihoods() -> None:
    """Against the density of all readings, the strengths' variance added to their covariance, origins nearly free."""
    scene, random = scene_of("x_y"), rng(8)
    causes = [scale_error(scene, random, 0), thermal_drift(scene, random)]
    signatures = signatures_of(scene, IDEAL, causes, random)
    unit = [along(scene, cause.displace(strength_for(scene, cause, 1.0))) for cause in causes]
    free = covariance_um2(scene, IDEAL)
    for origin in nuisances(scene, radius=False).T:
        free = free + 1e8 * np.outer(origin, origin)
    reading = np.linalg.cholesky(covariance_um2(scene, IDEAL)) @ random.standard_normal(len(scene)) + 0.3 * unit[0]

    def density(columns: list[np.ndarray]) -> float:
        covariance = free + sum((np.outer(column, column) for column in columns), np.zeros_like(free))
        return float(-0.5 * (reading @ np.linalg.solve(covariance, reading) + np.linalg.slogdet(covariance)[1]))

    whiten = whitener(scene, IDEAL)
    base = np.linalg.qr(whiten(nuisances(scene, radius=False).T).T)[0]
    white = whiten(np.array([*unit, reading]))
    white -= (white @ base) @ base.T
    seen = (white[:2] @ white[2])[None]
    two = Signatures(signatures.keys[:2], white[:2] @ white[:2].T, np.ones(2), [0])
    assert signatures.gram[:2, :2] == pytest.approx(two.gram, rel=5e-3)
    single, both = log_weight(two, [(0,), (1,)], seen)[0], log_weight(two, [(0, 1)], seen)[0, 0]
    nothing = density([])
    assert single + log(2.0) == pytest.approx([density([unit[0]]) - nothing, density([unit[1]]) - nothing], abs=0.02)
    prior = log(0.25) + log(2.0) - 2.0 * log(2.0)  # a further cause, two orders, two kinds each
    assert both - prior == pytest.approx(density(unit) - nothing, abs=0.02)


def test_the_sets_weighed_are_all_parts_with_one_more() -> None:
    assert neighbours([0], 3) == sorted([(), (0,), (1,), (2,), (0, 1), (0, 2)])
    assert {(0, 1), (0, 2), (1, 2), (0, 1, 2), (0, 1, 3), (2,)} <= set(neighbours([0, 1], 4))
    assert (2, 3) not in neighbours([0, 1], 4)


def test_larger_causes_are_found_more_often(tmp_path: Path) -> None:
    found = [make_case(Case("single:thermal_drift", wanted, 3), tmp_path)["bound"] for wanted in (1.0, 0.3, 0.1)]
    assert found[0] > 0.9
    assert found[0] > found[1] > found[2]


# --- choosing cases ---------------------------------------------------------------------------------------------------


def test_families_are_chosen_by_what_they_begin_with() -> None:
    ways = list_cases([1], families=["way"], nulls=500)
    assert {RECIPES[case.recipe].family for case in ways} == {"way-null", "way-single", "way-pair", "way-outside"}
    assert {case.size for case in ways} == {0.0, 1.0, 10.0}
    nulls = [case for case in ways if case.recipe == "way-null:long"]
    assert len(nulls) == 50
    assert {case.size for case in list_cases([1], families=["triple"])} == {1.0, 0.5}
    assert {case.size for case in list_cases([1], families=["triple"], sizes=[2.0])} == {2.0}


def test_a_sample_has_so_many_of_every_family_and_size_and_is_always_the_same() -> None:
    cases = list_cases(range(1, 5), families=["pair", "null"], nulls=40)
    drawn = sample(cases, 6, 3)
    assert sample(cases, 6, 3) == drawn
    assert sample(cases, 6, 4) != drawn
    assert len(drawn) == 6 * 5
    assert set(drawn) <= set(cases)


# --- rules ------------------------------------------------------------------------------------------------------------


def cause_of(kind: str, where: str = "", **leftover: float) -> dict[str, Any]:
    left = {key.replace("__", ":"): chi2 for key, chi2 in leftover.items()}
    true = {f"{kind}:{where}" if where else kind: 0.0}
    words = ["time", "order"] if "drift" in kind or "step" in kind or "late" in kind else ["machine"]
    return {"kind": kind, "where": where, "size": 1.0, "parameters": {}, "leftover_chi2": true | left,
            "own_form_chi2": 0.0, "best_known": None, "lives_in": words, "rows": []}  # fmt: skip


def truth_of(family: str, *causes: dict[str, Any], **settings: Any) -> dict[str, Any]:
    covariates = sorted({word for cause in causes for word in cause["lives_in"]})
    return {"case": "c", "family": family, "name": "n", "size": 1.0, "seed": 1, "rows": 300, "bound": 0.9,
            "noise_rms_um": 0.5, "causes": list(causes), "whole_set": [], "forgiven": [], "covariates": covariates,
            "scatter": "normal", "together_chi2": {}, **settings}  # fmt: skip


def effect(kind: str, *others: Any, probability: float = 0.97, **parameters: Any) -> dict[str, Any]:
    return {"kind": kind, "parameters": parameters, "confounded_with": list(others), "probability": probability}


def answer(word: str, *effects: Any, located: tuple[str, ...] = (), **more: Any) -> dict[str, Any]:
    return {"verdict": word, "effects": list(effects), "located": [{"covariate": c} for c in located], **more}


DRIFT, SQUARE = cause_of("thermal_drift"), cause_of("squareness", "xy")


@pytest.mark.parametrize(
    ("scatter", "diagnosis", "right", "alarm"),
    [
        ("ar1_0.9", answer("adequate"), True, False),
        ("ar1_0.9", answer("unknown", located=("order",)), True, False),
        ("flicker", answer("unknown", located=("time_s", "cycle")), True, False),
        ("ar1_0.9", answer("unknown", located=("order", "position")), False, True),
        ("ar1_0.9", answer("unknown"), False, True),
        ("ar1_0.9", answer("effects", effect("vibration"), located=("order",)), False, True),
        ("student_t", answer("unknown", located=("order",)), False, True),
        ("student_t", answer("adequate", effect("outliers", rows={"value": [3, 9]})), False, True),
        ("student_t", answer("insufficient"), False, False),
    ],
)
def test_a_scatter_may_be_told_but_not_as_a_law(scatter: str, diagnosis: Any, right: bool, alarm: bool) -> None:
    result = score_case(truth_of("scatter-null", scatter=scatter), diagnosis)
    assert (result["right"], result["false_alarm"]) == (right, alarm)


@pytest.mark.parametrize(
    ("diagnosis", "right", "honest"),
    [
        (answer("effects", effect("thermal_drift"), effect("squareness", plane="xy")), True, True),
        (answer("unknown", effect("squareness", plane="xy"), located=("time",)), False, True),
        (answer("unknown", located=("time", "machine_x")), False, True),
        (answer("unknown", located=("time",)), False, False),  # nothing of the squareness
        (answer("unknown", effect("scale_error", axis="x"), located=("time", "machine_x")), False, False),
        (answer("adequate"), False, False),
        (None, False, False),
    ],
)
def test_honest_is_what_names_or_locates_all_and_says_nothing_wrong(diagnosis: Any, right: bool, honest: bool) -> None:
    result = score_case(truth_of("way-pair", DRIFT, SQUARE), diagnosis)
    assert (result["right"], result["honest"]) == (right, honest)


def test_a_cause_under_correlated_scatter_may_come_with_the_scatter_located() -> None:
    said = answer("unknown", effect("squareness", plane="xy"), located=("order",))
    assert score_case(truth_of("scatter-single", SQUARE, scatter="ar1_0.9"), said)["right"]
    assert not score_case(truth_of("scatter-single", SQUARE, scatter="skewed"), said)["right"]


def test_an_axis_along_which_nothing_moves_is_the_wrong_one() -> None:
    """A gauge 3 deg off x: a period of y fits as well, of twenty times the size."""
    period = cause_of("periodic_scale_error", "x", periodic_scale_error__y=0.1)
    period["axis_share"] = {"x": 0.9986, "y": 0.0523, "z": 0.004}
    truth, wrong = truth_of("way-single", period), effect("periodic_scale_error", axis="y", probability=1.0)
    result = score_case(truth, answer("effects", wrong))
    assert (result["right"], result["wrong_and_sure"]) == (False, 1)
    assert score_case(truth, answer("effects", effect("periodic_scale_error", axis="x")))["right"]
    period["axis_share"] = {"x": 0.8, "y": 0.6, "z": 0.004}
    assert score_case(truth, answer("effects", wrong))["right"]


def test_one_name_for_two_causes_is_right_only_with_both_in_its_set() -> None:
    scale, square = cause_of("scale_error", "x"), cause_of("squareness", "xy")
    truth = truth_of("way-pair", scale, square, together_chi2={"angular_error:x/z": 0.4})
    abbe = {"travel": "x", "rotation": "z"}
    assert score_case(truth, answer("effects", effect("angular_error", "scale_error + squareness", **abbe)))["right"]
    assert not score_case(truth, answer("effects", effect("angular_error", **abbe)))["right"]
    truth["together_chi2"] = {"angular_error:x/z": 20.0}
    assert not score_case(truth, answer("effects", effect("angular_error", "scale_error + squareness", **abbe)))[
        "right"
    ]


@pytest.mark.parametrize(
    ("diagnosis", "right"),
    [
        (answer("unknown", located=("time",)), True),
        (answer("unknown", located=("speed",)), False),
        (answer("effects", effect("thermal_drift")), True),
        (answer("effects", effect("step_change")), False),
        (answer("effects", effect("thermal_drift"), effect("step_change")), False),
        (answer("adequate"), False),
    ],
)
def test_a_mechanism_without_a_name_is_unknown_or_what_fits_it(diagnosis: Any, right: bool) -> None:
    other = cause_of("ageing_scale", thermal_drift=20.0, step_change=80.0) | {"lives_in": ["time"]}
    assert score_case(truth_of("way-outside", other), diagnosis)["right"] is right


def test_good_readings_that_are_condemned_are_counted() -> None:
    dust = cause_of("outliers") | {"rows": [7, 40]}
    said = answer("effects", effect("outliers", rows={"value": [7, 40, 41]}))
    assert score_case(truth_of("single", dust), said)["good_rows_condemned"] == 1
    assert score_case(truth_of("null"), said)["good_rows_condemned"] == 3


def test_intervals_are_counted_apart_where_a_partner_stands_in_a_set() -> None:
    scale = cause_of("scale_error", "x", gauge_temperature=0.2) | {"parameters": {"ppm": 5.0}}
    turned = SQUARE | {"parameters": {"urad": 10.0}}
    urad = {"value": 10.5, "u": 0.2}
    said = answer(
        "effects", effect("scale_error", "gauge_temperature", axis="x"), effect("squareness", plane="xy", urad=urad)
    )
    result = score_case(truth_of("pair", scale, turned), said)
    assert (result["right"], result["beside_a_set"], result["intervals"]) == (True, True, [False])
    summary = summarise([result | {"seconds": 0.1, "error": "", "statements": []}])
    assert (summary["coverage_beside_a_set"]["hits"], summary["coverage_beside_a_set"]["of"]) == (0, 1)


# --- what is said with a probability ----------------------------------------------------------------------------------


def said_by(truth: dict[str, Any], diagnosis: Any) -> list[tuple[str, float, bool]]:
    return [(s["what"], s["probability"], s["true"]) for s in statements(truth, diagnosis)]


def test_effects_and_forms_of_a_plain_answer_are_statements() -> None:
    said = answer("unknown", effect("thermal_drift", probability=0.9), effect("step_change", probability=0.6))
    said["located"] = [
        {"covariate": "time_s", "probability": 0.99},
        {"covariate": "speed", "p": 0.7},
        {"covariate": "x"},
    ]
    assert said_by(truth_of("single", DRIFT), said) == [
        ("set", 0.9, True),
        ("set", 0.6, False),
        ("form", 0.99, True),
        ("form", 0.7, False),
    ]
    assert statements(truth_of("single", DRIFT), None) == []


def test_odds_are_statements_once() -> None:
    """What a listed effect says with its set is not counted again; a kind alone is another statement."""
    said = answer("effects", effect("squareness", "angular_error", plane="xy", probability=0.95))
    said["probabilities"] = {
        "adequate": 0.001,
        "statements": [
            {"kind": "squareness", "parameters": {"plane": "xy"}, "probability": 0.95, "includes_set": True},
            {"kind": "squareness", "parameters": {"plane": "xy"}, "probability": 0.7, "includes_set": False},
            {"kind": "scale_error", "parameters": {"axis": "x"}, "probability": 0.3, "includes_set": False},
            {"form": "wave", "covariate": "time", "probability": 0.02},
        ],
    }
    square = cause_of("squareness", "xy", angular_error__x__x=0.1, scale_error__x=80.0)
    assert said_by(truth_of("single", square), said) == [
        ("set", 0.95, True),
        ("name", 0.7, True),
        ("name", 0.3, False),
        ("adequate", 0.001, False),
        ("form", 0.02, False),
    ]


def test_of_a_weak_cause_a_name_alone_must_take_most() -> None:
    """At 0.2 of the noise 300 readings hold 12 in all: a name that leaves 10 of it is not the cause."""
    weak = cause_of("thermal_drift", step_change=10.0) | {"size": 0.2}
    said = answer(
        "adequate", probabilities={"adequate": 0.2, "statements": [{"kind": "step_change", "probability": 0.6}]}
    )
    assert said_by(truth_of("single", weak), said)[0] == ("name", 0.6, False)


def test_correlated_scatter_makes_a_form_in_the_order_true() -> None:
    said = answer("unknown")
    said["located"] = [{"covariate": "order", "probability": 0.97}]
    assert said_by(truth_of("scatter-null", scatter="flicker"), said) == [("form", 0.97, True)]
    assert said_by(truth_of("scatter-null", scatter="skewed"), said) == [("form", 0.97, False)]


@pytest.mark.parametrize(
    ("said", "number"), [(0.49, None), (0.5, 0), (0.8, 1), (0.9499, 1), (0.95, 2), (0.99, 3), (1.0, 3)]
)
def test_bins(said: float, number: int | None) -> None:
    assert bin_of(said) == number


def results_of(count: int, true: int, family: str, said: float) -> list[dict[str, Any]]:
    results = []
    for k in range(count):
        diagnosis = answer("effects", effect("thermal_drift" if k < true else "step_change", probability=said))
        truth = truth_of(family, DRIFT, name="hour:thermal_drift", seed=k)
        result = score_case(truth, diagnosis) | {"statements": statements(truth, diagnosis)}
        results.append(result | {"seconds": 0.1, "error": ""})
    return results


def test_reliability_counts_by_group_and_by_what_was_said(tmp_path: Path) -> None:
    results = [*results_of(20, 19, "single", 0.97), *results_of(10, 4, "way-single", 0.999)]
    rows = {(row["group"], row["from"]): row for row in reliability(results)}
    assert (rows["recordings", 0.95]["true"], rows["recordings", 0.95]["of"]) == (19, 20)
    assert (rows["ways", 0.99]["true"], rows["ways", 0.99]["of"]) == (4, 10)
    assert rows["all", 0.99]["interval"] == pytest.approx((0.168, 0.687), abs=2e-3)  # Wilson, 4 of 10
    for name in ("reliability.png", "reliability.svg"):
        draw_reliability(list(rows.values()), tmp_path / name)
    assert (tmp_path / "reliability.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "reliability.svg").read_text().count("<!-- 19/20 -->") == 2  # its group, and all


def test_the_table_holds_results_against_the_bound_and_the_bars() -> None:
    summary = summarise([*results_of(20, 18, "single", 0.97), *results_of(10, 4, "way-single", 0.999)])
    row = next(row for row in summary["classes"] if row["family"] == "single")
    assert (row["right_pct"], row["bound_pct"], row["bar_pct"]) == pytest.approx((90.0, 90.0, 99.0))
    assert row["of_bound"] == pytest.approx(1.0)
    way_row = summary["ways"][0]
    assert (way_row["under"], way_row["right"], way_row["wrong_and_sure"]) == ("hour", 4, 6)
    lines = text(summary).splitlines()
    assert any(line.split()[:5] == ["hour,", "single,", "size", "1", "10"] for line in lines)
    assert any(line.split()[:2] == ["recordings", "0.95-0.99"] for line in lines)


# --- runner -----------------------------------------------------------------------------------------------------------

COUNTING = '''
"""Answers, and notes beside itself that it was asked."""
import json
from pathlib import Path

def main(argv):
    out = Path(argv[argv.index("-o") + 1])
    with open(Path(__file__).with_suffix(".asked"), "a") as file:
        file.write(out.name + "\\n")
    out.mkdir(parents=True, exist_ok=True)
    said = {"verdict": "adequate", "effects": [], "probabilities": {"adequate": 0.99}}
    (out / "diagnosis.json").write_text(json.dumps(said))
'''


def test_a_run_that_was_stopped_goes_on_with_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tool, results, asked = tmp_path / "counting.py", tmp_path / "results.json", tmp_path / "counting.asked"
    tool.write_text(COUNTING)
    asked.touch()
    asked.chmod(0o666)
    tmp_path.chmod(0o755)
    template = f"{tool} {{recordings}} --gauge {{gauge}} --machine {{machine}} -o {{out}}"
    selection = ["--families", "null", "--nulls", "6", "--seeds", "1", "--tool", template, "-o", str(results)]
    run_main(selection)
    content = json.loads(results.read_text())
    assert content["complete"]
    half = content["cases"][:2]
    results.write_text(json.dumps({**content, "complete": False, "cases": half}))
    asked.write_text("")
    figure = tmp_path / "figure.svg"
    run_main([*selection, "--resume", "--figure", str(figure)])
    again = json.loads(results.read_text())
    assert {case["case"] for case in again["cases"]} == {case["case"] for case in content["cases"]}
    assert set(asked.read_text().split()) == {case["case"] for case in again["cases"]} - {case["case"] for case in half}
    assert all(case["right"] and case["statements"][0]["true"] for case in again["cases"])
    assert "6/6" in figure.read_text()
    assert figure.with_suffix(".png").exists()
    assert "recordings" in capsys.readouterr().out


def test_results_so_far_are_written_while_cases_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tool, results = tmp_path / "counting.py", tmp_path / "results.json"
    tool.write_text(COUNTING.replace('with open(Path(__file__).with_suffix(".asked"), "a") as file:', "if False:"))
    monkeypatch.setattr("benchmarks.blind.run.REPORT_S", 0.0)
    monkeypatch.setattr("benchmarks.blind.run.BATCH", 2)
    monkeypatch.setattr("benchmarks.blind.run.seal", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    template = f"{tool} {{recordings}} --gauge {{gauge}} --machine {{machine}} -o {{out}}"
    with pytest.raises(KeyboardInterrupt):
        run_main(["--families", "null", "--nulls", "4", "--seeds", "1", "--tool", template, "-o", str(results)])
    content = json.loads(results.read_text())
    assert not content["complete"]
    assert len(content["cases"]) == 4


def test_sizes_are_over_the_noise_of_what_is_recorded() -> None:
    """A display of 1 um adds its own scatter, so the same size is a larger cause."""
    scene = scene_of("x")
    cause = scale_error(scene, rng(), 0)
    assert size(scene, cause, strength_for(scene, cause, 1.0)) == pytest.approx(1.0, rel=2e-3)
    assert SCATTERS["rounded_1"].sigma_um(0.2) == pytest.approx(sqrt(0.04 + 1.0 / 12.0))
