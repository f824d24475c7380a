"""Crossed inference: closed forms, and what a fleet must and must not settle."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pypdf import PdfReader
from scipy import sparse

import stepgauge as sg
from stepgauge.fleet.hierarchical.answer import FleetInference, owner_of, words_of
from stepgauge.fleet.hierarchical.background import Background, RandomEffect
from stepgauge.fleet.hierarchical.infer import infer
from stepgauge.fleet.hierarchical.priors import fleet_priors
from stepgauge.fleet.hierarchical.result import NamedCause, named
from stepgauge.fleet.hierarchical.single_effects import single_effect
from stepgauge.fleet.hierarchical.statistics import placement_statistics
from stepgauge.fleet.hierarchical.visits import Visit
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import read_machine
from stepgauge.recording import Recording
from stepgauge.reports.fleet import fleet_story
from stepgauge.reports.render import markdown
from tests.fleet.crossed_made import crossed, fleet, gauge, visit
from tests.fleet.made import make_recording


def test_the_common_error_of_a_day_shrinks_to_zero_as_its_visits_are_few() -> None:
    """The mean of n readings, times n s^2 / (n s^2 + e^2), in every visit of the day, and nothing elsewhere."""
    counts, sd, error = np.array([1, 2, 7]), 0.8, 0.5
    day = np.repeat(np.arange(3), counts)
    rows = np.arange(len(day))
    days = RandomEffect("days", sparse.csc_matrix((np.ones(len(day)), (rows, day)), (len(day) + 2, 3)), sd, known=True)
    value = np.random.default_rng(4).normal(0.0, 1.0, len(day) + 2)
    background = Background(np.full(len(value), error**2), [days], 0.0)
    means = np.bincount(day, value[: len(day)]) / counts
    expected = (means * counts * sd**2 / (counts * sd**2 + error**2))[day]
    np.testing.assert_allclose(background.expected(days, value), [*expected, 0.0, 0.0], atol=1e-12)


def test_balanced_two_way_design_gives_the_textbook_estimates() -> None:
    """Searle, Casella, McCulloch, Variance Components, 1992, section 7.4: contrasts shrink by g s^2 / (g s^2 + e^2)."""
    machines, gauges, sd, error = 7, 5, 1.3, 0.6
    rows = np.arange(machines * gauges)
    of_machine, of_gauge = rows // gauges, rows % gauges
    one = np.ones(len(rows))
    terms = [
        RandomEffect("machine", sparse.csc_matrix((one, (rows, of_machine))), sd, known=True),
        RandomEffect("gauge", sparse.csc_matrix((one, (rows, of_gauge))), 0.8, known=True),
    ]
    background = Background(np.full(len(rows), error**2), terms, 0.0)
    um = np.random.default_rng(1).normal(0.0, 1.0, len(rows))
    found = (background.inverse @ (background.weighted.T @ um))[:machines]
    mean = um.reshape(machines, gauges).mean(axis=1)
    shrink = gauges * sd**2 / (gauges * sd**2 + error**2)
    assert found - found.mean() == pytest.approx(shrink * (mean - mean.mean()), abs=1e-12)


def test_background_solves_powers_and_likelihood_are_those_of_the_dense_matrix() -> None:
    rng = np.random.default_rng(2)
    columns = sparse.csc_matrix(rng.normal(size=(30, 6)) * (rng.random((30, 6)) < 0.5))
    background = Background(rng.uniform(0.1, 1.0, 30), [RandomEffect("a", columns, 0.7)], 0.4)
    dense = np.diag(background.variance + 0.4**2) + 0.49 * (columns @ columns.T).toarray()
    um, tried = rng.normal(size=30), sparse.csc_matrix(rng.normal(size=(30, 3)))
    assert background.solve(um) == pytest.approx(np.linalg.solve(dense, um))
    assert background.power(tried) == pytest.approx(np.diag(tried.T @ np.linalg.solve(dense, tried.toarray())))
    density = -0.5 * (np.linalg.slogdet(dense)[1] + um @ np.linalg.solve(dense, um))
    assert background.log_likelihood(um) == pytest.approx(density)


class _Two:
    """Two candidates with one column each, and unit covariance."""

    def __init__(self, columns: np.ndarray) -> None:
        self.columns, self.owner = columns, np.arange(2)
        self.log_odds, self.usual = np.log([0.1, 0.05]), np.ones(2)
        self.power = (columns**2).sum(axis=0)

    def score(self, residual: np.ndarray) -> np.ndarray:
        return self.columns.T @ residual

    def fit(self, rows: np.ndarray, size: np.ndarray) -> np.ndarray:
        return self.columns[:, rows] @ size


def test_single_effect_is_the_exact_posterior_of_one_cause() -> None:
    """Candidates with equal columns keep their prior odds; evidence is that of the marginal normal density."""
    column = np.random.default_rng(3).normal(size=20)
    sizes = replace(fleet_priors().sizes.mixture(), steps=np.array([2.0]), log_weight=np.zeros(1))
    um = 0.5 * column
    effect = single_effect(um, _Two(np.column_stack([column, column])), sizes)
    assert effect.share == pytest.approx([2.0 / 3.0, 1.0 / 3.0])
    with_it = np.eye(20) + 4.0 * np.outer(column, column)
    gain = 0.5 * (um @ um - um @ np.linalg.solve(with_it, um) - np.linalg.slogdet(with_it)[1])
    assert effect.log_factor == pytest.approx(gain + np.log(0.15))


def test_one_reading_millimetres_off_moves_nothing() -> None:
    own, machine = gauge(), read_machine("bridge-cmm")
    recording = make_recording(own, seed=4)
    good = placement_statistics(recording, own, machine)[0]
    frame = pd.DataFrame(recording.frame)
    frame.loc[33, "x_mm"] += 5.0
    bad = placement_statistics(Recording(frame, recording.comments, "x"), own, machine)[0]
    off = bad.um - good.um
    assert np.abs(off - np.median(off)).max() < 0.5
    assert bad.sigma_um == pytest.approx(good.sigma_um, rel=0.05)
    assert good.sigma_um == pytest.approx(0.3, rel=0.15)


def _wrong(own: Gauge, name: str, machine: str, axis: str, day: float) -> np.ndarray:
    """M3 has a scale error of x, M5 is knocked, G2 has a block that is off, wherever they are."""
    metres = own.position_mm * 1e-3
    um = 8.0 * metres * (machine == "M3" and axis == "x") - 9.0 * metres * (
        machine == "M5" and axis == "y" and day > 20_200
    )
    block = (np.arange(own.n_faces) // 2 == 6) & (name == "G2")
    return np.asarray(um + 2.0 * block)


def _said(visits: list[Visit], gauges: dict[str, Gauge]) -> dict[tuple[str, str, str], NamedCause]:
    return {(one.owner, one.kind, one.where): one for one in infer(visits, gauges).causes}


def test_causes_have_their_owners_whatever_these_are_called() -> None:
    visits, gauges = fleet(5, crossed(10, 4, 4), _wrong)
    said = _said(visits, gauges)
    assert set(said) == {("M3", "scale", "x"), ("M5", "scale", "y"), ("G2", "block", "7")}
    assert said["M3", "scale", "x"].size == pytest.approx(8.0, abs=4.0 * said["M3", "scale", "x"].u)
    begin = said["M5", "scale", "y"].begin
    assert begin is not None
    assert begin[0] <= 20_200 <= begin[1]
    assert said["G2", "block", "7"].size == pytest.approx(2.0, abs=0.3)
    other = {f"M{m}": f"M{9 - m}" for m in range(10)} | {f"G{g}": f"G{3 - g}" for g in range(4)}
    renamed = [replace(one, machine=other[one.machine], gauge=other[one.gauge]) for one in reversed(visits)]
    again = _said(renamed, gauges)
    assert set(again) == {(other[owner], kind, where) for owner, kind, where in said}
    for (owner, kind, where), one in said.items():
        assert again[other[owner], kind, where].size == pytest.approx(one.size, rel=1e-3)


@pytest.mark.parametrize("seed", [6, 7])
def test_where_nothing_is_wrong_nothing_is_named(seed: int) -> None:
    found = infer(*fleet(seed, crossed(10, 4, 3)))
    assert found.causes == ()
    assert found.false_share == 0.0
    page = markdown(fleet_story(found.to_dict()))
    assert "0 causes named" in page
    assert "| machine | scale | 10 | 0 | 5 um/m |" in page


def _check_report(found: FleetInference, folder: Path) -> None:
    """The set is in every form of the report, with what settles it; the same answer gives the same page."""
    written = found.write(folder / "a.json") + found.write(folder / "a.html") + found.write(folder / "a.pdf")
    assert [path.name for path in written] == ["a.json", "a.md", "a.json", "a.html", "a.json", "a.pdf"]
    (one,) = json.loads((folder / "a.json").read_text())["causes"]
    pages = PdfReader(folder / "a.pdf").pages
    texts = [*(path.read_text() for path in written[1:4:2]), " ".join(page.extract_text() for page in pages)]
    for text in [" ".join(text.split()) for text in texts]:
        for words in (owner_of(one), words_of(one["instead"][0]), one["would_settle"], "66 visits"):
            assert words in text
        for kind in ("with", "without"):
            assert all(v["date"] in text for v in one["settled_by"][kind])
    assert texts[1].count("data:image/svg+xml") == 1
    for again in (found, folder / "a.json"):
        sg.report(again, folder / "b.html")
        assert (folder / "b.html").read_bytes() == (folder / "a.html").read_bytes()


def test_a_confounded_pair_stays_a_set_until_a_recording_crosses_it(tmp_path: Path) -> None:
    def wrong(own: Gauge, name: str, machine: str, axis: str, day: float) -> np.ndarray:
        return 9.0 * own.position_mm * 1e-3 * (machine == "M20" and axis == "x")

    pairs = [*crossed(8, 3, 2), ("M20", "G9"), ("M20", "G9"), *crossed(8, 3, 2)]
    visits, gauges = fleet(8, pairs, wrong)
    only_x = [one for one in visits if one.machine != "M20" or one.statistics.axis[0] == 1.0]
    found = infer(only_x, gauges)
    (one,) = found.causes
    owners = {(one.owner, one.kind)} | {(rival.owner, rival.kind) for rival in one.instead}
    assert owners == {("M20", "scale"), ("G9", "certificate_scale")}
    _check_report(found, tmp_path)
    crossing = visit(np.random.default_rng(9), "M20", "G1", "x", 20_300.0, wrong)
    (settled,) = infer([*only_x, crossing], gauges).causes
    assert (settled.owner, settled.kind, settled.where, settled.instead) == ("M20", "scale", "x", ())


def test_named_causes_keep_the_expected_share_of_false_ones() -> None:
    rng = np.random.default_rng(10)
    some = [
        NamedCause("machine", f"M{k}", "scale", "x", "always", None, 1.0, 0.1, p) for k, p in enumerate(rng.random(200))
    ]
    kept = named(some, fleet_priors())
    assert np.mean([1.0 - one.probability for one in kept]) <= fleet_priors().decision.false_share
    left = max(one.probability for one in some if one not in kept)
    assert left <= min(one.probability for one in kept)
