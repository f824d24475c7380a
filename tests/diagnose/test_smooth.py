"""Random functions by their evidence, and laws that depart from themselves: against closed forms and by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from stepgauge.diagnose.departures import departure
from stepgauge.diagnose.explain import explain
from stepgauge.diagnose.noise import estimate_noise
from stepgauge.diagnose.search import Library
from stepgauge.diagnose.select import Selector, Term
from stepgauge.diagnose.smooth import SIZES, Forms, SmoothLook, matern_roots, smooth
from stepgauge.diagnose.whitening import Whitening, make_whitening, orthonormal

from stepgauge.diagnose.engine import diagnose
from stepgauge.diagnose.forms import make_form
from stepgauge.diagnose.library import effect_families
from stepgauge.diagnose.residuals import Residuals, make_residuals
from stepgauge.diagnose.unknown_law import model_unknown
from stepgauge.effects import Probings, Setting
from stepgauge.recording import Recording
from tests.diagnose.made import ALONG_X, ALONG_Y, gauge, machine, record
from tests.diagnose.test_selection import (
    NOISE_UM,
    Array,
    bent,
    clean,
    lies_on,
    names,
    side,
    there_and_back,
    told,
)

KNOTS = np.linspace(0.0, 1.0, 9)
LENGTHS = (0.6, 0.2)


@lru_cache
def data() -> Residuals:
    return make_residuals(clean(), gauge(), machine(noise_um=NOISE_UM))


@lru_cache
def whitening() -> Whitening:
    return make_whitening(data(), np.full(len(data()), NOISE_UM))


def over_time() -> Array:
    """Values at knots to values at rows: what a function of time moves the readings by along the approach."""
    t = data().probings.time_s
    return np.array([np.interp((t - t.min()) / np.ptp(t), KNOTS, one) for one in np.eye(len(KNOTS))])


@lru_cache
def forms() -> Forms:
    family = make_form("wander", "time", "approach", over_time()[None], data())
    return Forms([], [smooth(family, matern_roots(KNOTS, LENGTHS))], whitening())


def look(white: Array, model: Array | None = None) -> SmoothLook:
    model = np.zeros((len(white), 0)) if model is None else model
    (found,) = forms().looks(white, model, whitening().dof - model.shape[1])
    assert isinstance(found, SmoothLook)
    return found


@pytest.mark.parametrize("size_um", [0.0, 0.3, 2.0])
def test_evidence_is_the_ratio_of_two_normal_densities(size_um: float) -> None:
    """Against the dense covariance of the whitened residuals, at the size and the length that were chosen."""
    random = np.random.default_rng(4)
    values = matern_roots(KNOTS, LENGTHS)[0] @ random.normal(0.0, size_um, len(KNOTS))
    white = whitening()(values @ over_time() + random.normal(0.0, NOISE_UM, len(data())))
    found = look(white)
    length, size = divmod(found.atom, len(SIZES))
    columns = whitening()(over_time()).T @ matern_roots(KNOTS, LENGTHS)[length]
    variance = SIZES[size] / (columns**2).sum()
    covariance = np.eye(len(white)) + variance * columns @ columns.T
    likely = stats.multivariate_normal(np.zeros(len(white)), covariance).logpdf(white)
    wanted = likely - stats.norm.logpdf(white).sum()
    assert found.evidence == pytest.approx(wanted, rel=1e-6, abs=1e-6)


def test_what_a_model_takes_is_no_evidence_for_a_function() -> None:
    random = np.random.default_rng(5)
    noise = whitening()(random.normal(0.0, NOISE_UM, len(data())))
    model = orthonormal(whitening()(over_time()).T)
    moved = noise + model @ random.normal(0.0, 30.0, model.shape[1])
    assert look(moved).evidence > 100.0
    assert look(moved, model).evidence < 1.0


def test_chances_of_scatter_alone_are_not_understated() -> None:
    """Of 400 recordings of scatter at most so many fall below each chance as a binomial allows once in a thousand."""
    random = np.random.default_rng(6)
    chances = np.array([np.exp(look(whitening()(random.normal(0.0, NOISE_UM, len(data())))).log_p) for _ in range(400)])
    for p in (0.1, 0.02):
        assert (chances < p).sum() <= stats.binom.ppf(0.999, 400, p)


@settings(deadline=None, max_examples=20)
@given(factor=st.floats(0.2, 5.0))
def test_a_function_and_the_scatter_scaled_together_say_the_same(factor: float) -> None:
    """The chance is a matter of ratios: whatever the unit of the residual, and of the scatter that it is judged by."""
    random = np.random.default_rng(7)
    white = whitening()(np.sin(data().probings.time_s / 60.0) + random.normal(0.0, NOISE_UM, len(data())))
    assert look(white * factor).log_p == pytest.approx(look(white).log_p, rel=1e-9)


def test_covariances_are_those_of_matern() -> None:
    for rough, at in (
        (False, lambda r: (1.0 + np.sqrt(3.0) * r) * np.exp(-np.sqrt(3.0) * r)),
        (True, lambda r: np.exp(-r)),
    ):
        root = matern_roots(KNOTS, [0.25], rough)[0]
        apart = np.abs(KNOTS[:, None] - KNOTS) / 0.25
        np.testing.assert_allclose(root @ root.T, at(apart), atol=1e-7)


# Structure that no formula follows, in recordings.


def rising(recording: Recording) -> Array:
    t = recording.frame["time_s"].to_numpy()
    return (t - t.min()) / np.ptp(t)


def warming_scale(recording: Recording) -> Array:
    """A scale that grows while it is measured with, by 20 ppm, and back by 10."""
    grown = 1.0 - np.exp(-rising(recording) / 0.12) * (1.0 + 9.0 * rising(recording))
    return 0.03 * grown * (recording.frame["x_mm"].to_numpy() - 350.0) * side(recording) * lies_on(recording)


def longer_in_one_cycle(recording: Recording) -> Array:
    frame = recording.frame
    odd = (frame["cycle"] == 3) & (frame["placement"] == 1)
    return 0.02 * odd.to_numpy() * (frame["x_mm"].to_numpy() - 350.0) * side(recording)


def worn_out(recording: Recording) -> Array:
    """A pre-travel that wanders while the probe is used."""
    t = rising(recording)
    return 1.2 * np.sin(9.0 * t**2) + 0.8 * t


STRUCTURE = {
    "a scale that grows and shrinks": (warming_scale, {"time", "machine x", "position"}, "length"),
    "one cycle with a length of its own": (longer_in_one_cycle, {"cycle"}, "cycle 3 of placement 1"),
    "a pre-travel that wanders": (worn_out, {"time"}, "time"),
}


@pytest.mark.parametrize("name", STRUCTURE)
def test_structure_of_no_formula_is_told_where_it_lives_and_imitated(name: str) -> None:
    um, lives_in, word = STRUCTURE[name]
    found = told(bent(um))
    assert found.verdict == "unknown"
    assert lives_in & {one.covariate for one in found.located}
    assert any(word in one.where for one in (*found.located, *found.unexplained))
    left = found.after_um - sum(law.share_um for law in model_unknown(found))
    assert left.std() < 0.75 * found.before_um.std()


def test_what_follows_a_column_along_one_axis_only_is_told_so() -> None:
    """Two placements, one column that wanders: it moves the x axis and no other."""
    recording = clean()
    random = np.random.default_rng(8)
    damp = 50.0 + np.cumsum(random.normal(0.0, 0.4, len(recording.frame)))
    frame = recording.frame.assign(damp=damp)
    with_column = replace(recording, frame=frame)
    found = told(bent(lambda r: 2.0 * (damp > np.median(damp)) * r.frame["approach_i"].to_numpy(), with_column))
    assert found.verdict == "unknown"
    first = found.located[0]
    assert first.covariate == "damp"
    assert "along machine x" in first.where


def test_a_law_departs_from_itself_by_its_overtones_and_not_by_chance() -> None:
    """A sine has none; two sines and short peaks are no sine."""
    period = 217.0

    def departs(um: Array) -> str:
        scatter = np.random.default_rng(1).normal(0.0, 0.05, len(um))
        one = make_residuals(bent(lambda _: um + scatter), gauge(), machine(noise_um=NOISE_UM))
        white = make_whitening(one, estimate_noise(data()).by_row_um)
        (law,) = (family for family in effect_families(one) if family.label == "temperature_cycle_x")
        nearest = int(np.argmin([abs(atom["period_s"] - period) for atom in law.atoms]))
        odd = departure(Selector(Library([law], white), white, one), (Term(0, nearest),))
        return "" if odd is None else odd.words

    angle = 2.0 * np.pi * clean().frame["time_s"].to_numpy() / period
    along_x = clean().frame["approach_i"].to_numpy()
    assert departs(2.0 * np.sin(angle) * along_x) == ""
    assert "overtone of order 2" in departs((2.0 * np.sin(angle) + np.cos(2.0 * angle)) * along_x)
    assert "overtone of order 3" in departs(np.sign(np.sin(angle + 0.7)) * along_x)
    assert departs(np.where(np.sin(angle) > 0.6, 4.0, -0.6) * along_x) != ""


def test_growing_structure_is_no_growing_scatter() -> None:
    """Jumps between two levels that grow with time, too quick to be drift: a matter of the column that they follow."""
    recording = clean()
    random = np.random.default_rng(9)
    switch = np.where(random.random(len(recording.frame)) > 0.5, 1.0, 0.0)
    with_column = replace(recording, frame=recording.frame.assign(switch=switch))
    found = told(bent(lambda r: 3.0 * rising(r) * (switch - 0.5), with_column))
    assert found.verdict == "unknown"
    assert "noise_growth" not in names(found)
    assert "switch" in {one.covariate for one in found.located}


def test_scatter_whose_kind_is_no_candidate_is_told_by_its_form() -> None:
    random = np.random.default_rng(3)
    recording = bent(lambda r: random.normal(0.0, 1.0, len(r)) * rising(r) * 1.5)
    assert names(told(recording)) == ["noise_growth"]
    found = diagnose(recording, gauge(), machine(noise_um=NOISE_UM), without=["noise_growth"])
    assert found.verdict == "unknown"
    assert not found.findings
    assert [(one.covariate, one.form) for one in found.unexplained] == [("time", "growing scatter")]
    assert model_unknown(found) == []


def test_a_bow_is_no_period_of_many_times_the_travel() -> None:
    bow = bent(lambda r: 3.0 * ((r.frame["x_mm"].to_numpy() - 350.0) / 105.0) ** 2 * side(r) * lies_on(r))
    found = diagnose(bow, gauge(), machine(noise_um=NOISE_UM), without=["scale_curvature"])
    for one in found.findings:
        if one.kind == "periodic_scale_error":
            assert one.parameters["period_mm"].value < 210.0


def test_the_way_since_turning_is_counted_from_where_it_turned() -> None:
    recording = there_and_back(clean((ALONG_X,)))
    since = Probings(recording.frame, Setting.of(machine(), gauge())).since_turning_mm()
    position = gauge().position_mm[recording.frame["face"].to_numpy() - 1]
    gone, way = 0.0, 0.0
    for row in range(1, len(position)):
        step = position[row] - position[row - 1]
        gone = gone + abs(step) if np.sign(step) == way and step != 0.0 else abs(step)
        way = np.sign(step)
        assert since[row] == pytest.approx(gone, abs=1e-9)


def test_a_search_ends_the_same_way_whatever_the_order_of_its_rows() -> None:
    recording = bent(worn_out)
    order = np.random.default_rng(2).permutation(len(recording.frame))
    shuffled = replace(recording, frame=recording.frame.iloc[order].reset_index(drop=True))
    found = [told(one) for one in (recording, shuffled)]
    assert found[0].verdict == found[1].verdict
    assert [one.where for one in found[0].located] == [one.where for one in found[1].located]


def test_nothing_is_explained_where_there_is_nothing() -> None:
    quiet = make_residuals(record(machine(), [ALONG_X, ALONG_Y], seed=21), gauge(), machine())
    found = explain(quiet, estimate_noise(quiet), ())
    assert not found.terms
    assert not found.located
    assert not found.unexplained
