"""The inference by itself: the page's examples, and problems that cannot be."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import special, stats

import stepgauge as sg
from tests.conftest import ROOT

PAGE = ROOT / "docs/inference.md"


def test_the_examples_of_the_page_find_what_they_hide() -> None:
    """docs/inference.md: a periodic error of 730 pixels with a trend; a step of phase on day 63 beside ageing."""
    first, second = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    names: dict[str, object] = {}
    exec(compile(first, str(PAGE), "exec"), names)
    posterior = names["posterior"]
    assert isinstance(posterior, sg.inference.Posterior)
    assert posterior.best.labels == {"periodic error", "trend"}
    assert posterior.probability(["periodic error"]) > 0.99
    period, u = posterior.shape("periodic error")
    assert abs(period - 730.0) < 3.0 * u
    exec(compile(second, str(PAGE), "exec"), names)
    posterior = names["posterior"]
    assert isinstance(posterior, sg.inference.Posterior)
    assert posterior.best.labels == {"ageing", "step of phase"}
    assert posterior.probability_of_scatter("correlation") > 0.9
    (step,) = (i for i, one in enumerate(posterior.best.terms) if one.candidate.label == "step of phase")
    mean, covariance = posterior.best.amplitudes(step)
    assert abs(mean[0] - 12.0) < 4.0 * np.sqrt(covariance[0, 0])


def test_a_problem_whose_rows_do_not_match_says_which() -> None:
    prior = sg.inference.amplitude_prior(0.1, 1.0)
    law = sg.inference.make_law("slope", np.arange(5.0), prior)
    with pytest.raises(ValueError, match="slope has 5 rows, expected 6"):
        sg.inference.make_problem(np.zeros(6), 1.0, [law])
    with pytest.raises(ValueError, match="time has 4 rows, expected 5"):
        sg.inference.make_problem(np.zeros(5), 1.0, [law], time=np.arange(4.0))
    with pytest.raises(ValueError, match="same label"):
        sg.inference.make_problem(np.zeros(5), 1.0, [law, law])
    with pytest.raises(ValueError, match="4 dimensions"):
        sg.inference.make_law("too deep", np.zeros((1, 1, 1, 5)), prior)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_problem_may_have_no_nuisance(slope: float) -> None:
    """Readings whose zero is known: a line through zero is found, or nothing is."""
    t = np.linspace(-5.0, 5.0, 60)
    y = np.random.default_rng(1).normal(0.0, 0.3, 60) + slope * t
    law = sg.inference.make_law("slope", t[None, None], sg.inference.amplitude_prior(0.01, 10.0))
    found = sg.inference.infer(sg.inference.make_problem(y, 0.3, [law], nuisance=np.zeros((0, 60))))
    assert [term.candidate.label for term in found.best.terms] == (["slope"] if slope else [])


def test_a_posterior_says_itself_and_knows_its_labels() -> None:
    """A label that nobody tested had the probability 0, and a word was taken letter by letter."""
    t = np.linspace(-5.0, 5.0, 60)
    y = np.random.default_rng(1).normal(0.0, 0.3, 60) + 0.3 * t
    prior = sg.inference.amplitude_prior(0.01, 10.0)
    laws = [sg.inference.make_law("slope", t, prior), sg.inference.make_law("bend", t**2, prior)]
    found = sg.inference.infer(sg.inference.make_problem(y, 0.3, laws))
    assert found.probability("slope") == found.probability(["slope"]) > 0.99
    with pytest.raises(ValueError, match="no candidate has the label 'slop'; expected slope"):
        found.probability(["slop"])
    frame = found.to_frame()
    assert list(frame["label"]) == ["slope", "bend"]
    assert frame["in_best"].tolist() == [True, False]
    assert found.summary().startswith("slope ")
    assert max(len(repr(found)), len(repr(found.sets))) < 200
    y[7] = np.nan
    with pytest.raises(ValueError, match="residual 8 of 60 is no finite number"):
        sg.inference.make_problem(y, 0.3, laws)


def test_a_table_has_the_amplitude_and_the_shape_of_every_term_with_its_uncertainty() -> None:
    """Beside least squares: a wave of unknown period, in two coefficients, on a line."""
    t, random = np.linspace(0.0, 60.0, 200), np.random.default_rng(8)
    y = 0.05 * t + 1.2 * np.sin(2.0 * np.pi * t / 17.0 + 0.4) + random.normal(0.0, 0.2, 200)
    periods = np.linspace(12.0, 24.0, 121)
    waves = np.array([[np.sin(2.0 * np.pi * t / one), np.cos(2.0 * np.pi * t / one)] for one in periods])
    prior = sg.inference.amplitude_prior(0.01, 10.0)
    laws = [sg.inference.make_law("line", t, prior), sg.inference.make_law("wave", waves, prior, values=periods)]
    found = sg.inference.infer(sg.inference.make_problem(y, 0.2, laws)).to_frame().set_index("label")
    columns = np.array([t, np.sin(2.0 * np.pi * t / 17.0), np.cos(2.0 * np.pi * t / 17.0), np.ones(200)])
    fitted = np.linalg.lstsq(columns.T, y, rcond=None)[0]
    assert found.loc["line", "amplitude"] == pytest.approx(fitted[0], abs=2e-3)
    assert found.loc["line", "u_amplitude"] == pytest.approx(0.2 / np.sqrt(200 * t.var()), rel=0.3)
    assert np.isnan(found.loc["line", "shape"])
    wave = found.loc["wave"]
    assert abs(wave["amplitude"] - 1.2) < 3.0 * wave["u_amplitude"] < 0.15
    assert abs(wave["shape"] - 17.0) < 3.0 * wave["u_shape"] < 0.5


def test_the_log_posterior_is_that_of_conjugate_normals() -> None:
    """A slope with a normal amplitude in noise of known size: the Bayes factor in closed form, times the prior odds.

    Of ``y = a x + e`` with ``a ~ N(0, s^2)``, the factor is that of the density of the one sum ``x'y / x'x``. A log
    evidence has no prior: the two differ by the logarithm of the odds.
    """
    random, sd, noise, odds = np.random.default_rng(3), 0.7, 0.4, 0.2
    x = np.linspace(-1.0, 1.0, 40)
    y = 0.3 * x + random.normal(0.0, noise, 40)
    slope = sg.inference.make_law("slope", x, sg.inference.amplitude_prior(sd, sd, 1), odds)
    rare = dict.fromkeys(("outliers", "heavy", "growth", "correlation", "flicker", "burst", "certificate"), 1e-12)
    known = sg.inference.NoisePriors.model_validate({"sigma_factor": 1.0001, **rare})
    found = sg.inference.infer(sg.inference.make_problem(y, noise, [slope]), known)
    estimate, u = float(x @ y / (x @ x)), noise / float(np.sqrt(x @ x))
    bayes = stats.norm(0.0, np.hypot(sd, u)).logpdf(estimate) - stats.norm(0.0, u).logpdf(estimate)
    log = found.log_posterior
    assert log[frozenset({"slope"})] - log[frozenset()] == pytest.approx(bayes + np.log(odds), abs=1e-3)
    assert found.probability("slope") == pytest.approx(special.expit(bayes + np.log(odds)), abs=1e-3)


def test_a_range_and_a_standard_deviation_that_are_none_are_refused() -> None:
    for smallest, largest in ((-1.0, 2.0), (5.0, 2.0), (0.0, 1.0), (1.0, float("nan"))):
        with pytest.raises(ValueError, match="expected 0 < smallest <= largest"):
            sg.inference.amplitude_prior(smallest, largest)
    law = sg.inference.make_law("ramp", np.arange(5.0), sg.inference.amplitude_prior(0.1, 1.0))
    for sd in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="expected a positive number"):
            sg.inference.make_problem(np.zeros(5), sd, [law])


def test_a_candidate_that_is_not_there_makes_no_other_probable() -> None:
    """The shapes of a warm-up were summed one by one where it stood alone, and not beside a step: 0.63 for 0.04."""
    t = np.linspace(0.0, 24.0, 200)
    um = np.random.default_rng(7).normal(0.0, 0.5, 200) + 4.0 * np.exp(-t / 3.0) + 1.5 * np.sin(2.0 * np.pi * t / 6.0)
    size, make = sg.inference.amplitude_prior(0.2, 10.0), sg.inference.make_law
    laws = [
        make("warm-up", [[np.exp(-t / k)] for k in np.geomspace(0.5, 10.0, 30)], size),
        make(
            "cycle",
            [[np.sin(2.0 * np.pi * t / k), np.cos(2.0 * np.pi * t / k)] for k in np.geomspace(1.5, 12.0, 80)],
            size,
        ),
        make("step", [[1.0 * (t >= k)] for k in t[5:-5:4]], size),
    ]
    smooth = sg.inference.make_gaussian_process("smooth", t, [2.0, 6.0], size)
    alone, beside = (sg.inference.infer(sg.inference.make_problem(um, 0.5, some)) for some in (laws, [*laws, smooth]))
    assert beside.probability("smooth") < 0.1
    assert beside.probability("step") == pytest.approx(alone.probability("step"), abs=0.02)


def test_a_shape_has_a_standard_uncertainty_and_the_posterior_a_table_and_a_figure(tmp_path: Path) -> None:
    """Against the Cramer-Rao bound of a frequency: u(f) = sqrt(6) s / (pi A T sqrt(n)); a coarser grid has the same."""
    n, truth, amplitude, sd = 200, 23.0, 3.0, 0.5
    x = np.arange(float(n))
    y = amplitude * np.sin(2.0 * np.pi * x / truth + 0.4) + np.random.default_rng(5).normal(0.0, sd, n)
    bound = truth**2 * np.sqrt(6.0) * sd / (np.pi * amplitude * n * np.sqrt(n))
    size = sg.inference.amplitude_prior(0.3, 10.0)
    found = []
    for step in (0.005, 0.25):
        periods = np.arange(20.0, 26.0 + step / 2.0, step)
        waves = [[np.sin(2.0 * np.pi * x / one), np.cos(2.0 * np.pi * x / one)] for one in periods]
        laws = [sg.inference.make_law("wave", waves, size, values=periods), sg.inference.make_law("slope", x, size)]
        found.append(sg.inference.infer(sg.inference.make_problem(y, sd, laws)))
    (fine, u_fine), (coarse, u_coarse) = (one.shape("wave") for one in found)
    assert [u_fine, u_coarse] == pytest.approx([bound, bound], rel=0.25)
    assert abs(fine - truth) < 3.0 * u_fine
    assert coarse == pytest.approx(fine, abs=0.1 * u_fine)
    with pytest.raises(ValueError, match="'slope' has no shape here"):
        found[0].shape("slope")
    found[0].write(tmp_path / "posterior.csv")
    columns = "label,probability,in_best,amplitude,u_amplitude,shape,u_shape"
    assert (tmp_path / "posterior.csv").read_text().startswith(f"{columns}\nwave,")
    assert len(found[0].plot().lines) == 2


def test_a_gaussian_process_has_a_length_and_a_curve_against_its_covariate() -> None:
    """A sine of radian wavelength 70 is of the longer lengths; readings in any order give a curve."""
    random = np.random.default_rng(4)
    x = random.permutation(np.linspace(0.0, 300.0, 60))
    y = 3.0 * np.sin(x / 70.0) + random.normal(0.0, 0.5, 60)
    lengths, size = [10.0, 50.0, 100.0, 200.0], sg.inference.amplitude_prior(0.3, 10.0)
    smooth = sg.inference.make_gaussian_process("smooth", x, lengths, size)
    found = sg.inference.infer(sg.inference.make_problem(y, 0.5, [smooth]))
    length, u = found.shape("smooth")
    assert 80.0 < length <= 200.0
    assert 0.0 < u < 100.0
    points, curve = found.plot().lines
    assert list(points.get_xdata()) == list(x)
    assert (np.diff(curve.get_xdata()) > 0.0).all()
    assert np.abs(curve.get_ydata() - 3.0 * np.sin(curve.get_xdata() / 70.0)).max() < 1.0
    assert str(curve.get_label()) == f"smooth ({length:.4g})"
    assert found.plot(x=pd.Series(x, name="position (mm)")).get_xlabel() == "position (mm)"
    with pytest.raises(ValueError, match="x has the shape"):
        found.plot(x=x[1:])


def test_what_is_probable_and_not_in_the_best_hypothesis_is_in_the_summary() -> None:
    """A slope of 1.5 standard uncertainties, which leaves both possible."""
    x = np.linspace(-1.0, 1.0, 60)
    law = sg.inference.make_law("slope", x, sg.inference.amplitude_prior(0.1, 1.0), odds=0.5)
    y = np.random.default_rng(3).normal(0.0, 1.0, 60)
    y += (0.33 - np.polyfit(x, y, 1)[0]) * x
    found = sg.inference.infer(sg.inference.make_problem(y, 1.0, [law]))
    assert found.best.labels == set()
    assert 0.05 < found.probability("slope") < 0.5
    assert re.search(r"^not in the best: slope 0\.\d+$", found.summary(), re.M)


X = np.linspace(0.0, 1.0, 20)
PRIOR = sg.inference.amplitude_prior(0.1, 10.0)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: sg.inference.amplitude_prior("1", 2.0), "smallest: no numbers: '1'"),
        (lambda: sg.inference.make_law("bend", "abc", PRIOR), "shapes of bend: no numbers: 'abc'"),
        (
            lambda: sg.inference.make_law("bend", X, "wide"),
            "prior of bend is 'wide', expected what amplitude_prior made",
        ),
        (lambda: sg.inference.make_law("bend", X, PRIOR, 0.0), "odds of bend are 0.0, expected a positive number"),
        (lambda: sg.inference.make_gaussian_process("g", X, "0.1", PRIOR), "lengths of g: no numbers: '0.1'"),
        (lambda: sg.inference.make_gaussian_process("g", 0.0 * X, [0.1], PRIOR), "covariate of g .* that it varies"),
        (lambda: sg.inference.make_problem(X, "0.3", []), "sd: no numbers: '0.3'"),
        (lambda: sg.inference.make_problem(X, 0.3, "bend"), "candidates: 'b' is none"),
        (lambda: sg.inference.make_problem(X, 0.3, [], time=["noon"] * 20), "time: no numbers"),
        (
            lambda: sg.inference.make_problem(X, 0.3, [], nuisance=[X, np.nan * X]),
            "nuisance 2 of 2, 1 of 20 is no finite",
        ),
    ],
)
def test_what_is_no_number_or_no_candidate_is_named(made: Callable[[], object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        made()


def test_two_steps_are_two_candidates() -> None:
    rows, onsets = np.arange(120), np.arange(5, 115)
    shapes = (rows >= onsets[:, None]).astype(float)[:, None]
    y = np.random.default_rng(0).normal(0.0, 0.3, 120) + 3.0 * (rows >= 40) - 2.0 * (rows >= 80)
    laws = [sg.inference.make_law(label, shapes, PRIOR, values=onsets) for label in ("step", "another step")]
    found = sg.inference.infer(sg.inference.make_problem(y, 0.3, laws)).to_frame()
    assert sorted(found["shape"]) == pytest.approx([40.0, 80.0], abs=0.5)
    assert sorted(found["amplitude"]) == pytest.approx([-2.0, 3.0], abs=0.25)
