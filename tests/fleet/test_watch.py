"""Watching a fleet: closed forms of the states, the feed and its schema, and both verbs on a store."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import norm

import stepgauge as sg
from stepgauge.cli import cli
from stepgauge.errors import InputError
from stepgauge.figures.fleet import LABELS, NAMED, watch_figure
from stepgauge.fleet.hierarchical.drifting import DriftPrior, DriftState, beyond, due_day, follow
from stepgauge.fleet.hierarchical.infer import infer
from stepgauge.fleet.hierarchical.watch import Watched, _expected, watch
from stepgauge.fleet.hierarchical.watching import LIMITS as WATCHED
from stepgauge.fleet.hierarchical.watching import Feed, FleetWatch, feed_schema, machine_drifts
from stepgauge.gauge.certified import Gauge
from stepgauge.history import judge, make_series
from stepgauge.verbs.fleet_work import LIMITS
from tests.fleet.crossed_made import crossed, fleet, gauge
from tests.fleet.made import make_fleet
from tests.test_history import noise


def test_a_level_that_does_not_walk_is_a_regression_with_priors() -> None:
    """The state after all values is the posterior of a line with normal priors of level and rate."""
    rng = np.random.default_rng(1)
    day = np.sort(rng.uniform(0.0, 700.0, 12))
    shares, variance = rng.normal(size=(12, 1)), rng.uniform(0.1, 0.5, 12)
    value = rng.normal(size=12)
    prior = DriftPrior(np.array([1.5]), np.array([0.7]), np.zeros(1), np.ones(1))
    states, density = follow(day, value, variance, shares, prior)
    years = (day - day[0]) / 365.25
    columns = shares * np.column_stack([np.ones(12), years])
    precision = columns.T @ (columns / variance[:, None]) + np.diag([1.5**-2, 0.7**-2])
    level, rate = np.linalg.solve(precision, columns.T @ (value / variance))
    last = states[-1]
    assert last.rate[0] == pytest.approx(rate)
    assert last.level[0] == pytest.approx(level + rate * years[-1])
    assert last.covariance[1, 1] == pytest.approx(np.linalg.inv(precision)[1, 1])
    dense = np.diag(variance) + columns @ np.diag([1.5**2, 0.7**2]) @ columns.T
    assert density == pytest.approx(-0.5 * (np.linalg.slogdet(dense)[1] + value @ np.linalg.solve(dense, value)))


def test_due_on_the_day_on_which_the_risk_is_reached() -> None:
    """A level of known rate and steady uncertainty u: due when limit - level - rate t = z u."""
    u, limit, rate, risk = 0.4, 5.0, 1.5, 0.05
    state = DriftState(1000.0, np.array([2.0]), np.array([rate]), np.diag([u**2, 0.0]))
    expected = (limit - 2.0 - norm.isf(risk) * u) / rate * 365.25
    due = due_day(state, 0, 0.0, limit, risk, 3000.0)
    assert due == pytest.approx(1000.0 + expected, abs=1.0)
    assert due_day(state, 0, 0.0, limit, risk, 100.0) is None
    assert beyond(np.array(0.0), np.array(1.0), 1.96) == pytest.approx(0.05, abs=1e-3)


def test_who_changed_drifts_or_leaves_its_peers_is_said() -> None:
    def wrong(own: Gauge, name: str, machine: str, axis: str, day: float) -> np.ndarray:
        years = (day - 20_000.0) / 365.25
        ppm = 10.0 * (machine == "M3" and axis == "x") - 9.0 * (machine == "M5" and axis == "y" and day > 20_200)
        worn = 1.5 * years * (name == "G2") * (np.arange(own.n_faces) % 2 == 0)
        return np.asarray(ppm * own.position_mm * 1e-3 + worn)

    found = infer(*fleet(11, crossed(10, 4, 4), wrong))
    watched = {(one.owner, one.quantity): one for one in watch(found, {"scale": 5.0})}
    moved, knocked, worn = watched["M3", "scale x"], watched["M5", "scale y"], watched["G2", "wear"]
    assert moved.leaves_peers
    assert moved.outcome == "does not conform"
    assert moved.out_now == pytest.approx(1.0, abs=0.01)
    assert knocked.changes
    assert knocked.changes[0][0] <= 20_200 <= knocked.changes[0][1]
    assert worn.drifts
    assert worn.rate > 0.5
    calm = [one for one in watched.values() if one.owner not in ("M3", "M5", "G2")]
    assert not [one for one in calm if one.changes or one.outcome == "does not conform"]
    assert sum(one.leaves_peers for one in calm) <= 1


def test_two_machines_measured_along_one_line_conform_to_nothing() -> None:
    """They do not determine how far machines differ, and nothing there shows a squareness.

    Each visit knows its scale to 0.3 um/m and the gauge its length to more than that. The likeliest spread is its least
    one: u was 0.1 um/m and 0.1 urad, and both "conformed".
    """

    def wrong(own: Gauge, name: str, machine: str, axis: str, day: float) -> np.ndarray:
        return np.random.default_rng(int(day)).normal(0.0, 1.0) * own.position_mm * 1e-3

    visits, gauges = fleet(7, [("M0", "G0"), ("M1", "G0")] * 2, wrong)
    line = np.array([0.998, 0.0632, 0.0])
    turned = [
        replace(one, statistics=replace(one.statistics, axis=line, at_mm=one.statistics.at_mm[0] + along))
        for one in visits
        if one.statistics.axis[0]
        for along in [gauge().position_mm[:, None] * line]
    ]
    said = watch(infer(turned, gauges), {"scale": 0.5, "squareness": 1.0, "reversal": 0.5})
    judged = [one for one in said if one.owner_kind == "machine"]
    assert {one.quantity for one in judged} >= {"scale x", "squareness xy", "reversal x"}
    assert [one.outcome for one in judged] == ["not decidable"] * len(judged)
    assert [one.due for one in judged] == [one.days[-1] for one in judged]
    assert all(one.u[-1] > 5.0 for one in judged if one.quantity == "squareness xy")


def test_the_levels_of_machines_that_differ_lie_about_them_as_far_as_u_says() -> None:
    """Of forty machines the spread is known: it narrows u, and the truth lies within it."""
    spread = 0.6
    own = {f"M{n}": np.random.default_rng(n).normal(0.0, spread) for n in range(40)}

    def wrong(steps: Gauge, name: str, machine: str, axis: str, day: float) -> np.ndarray:
        return own[machine] * (axis == "x") * steps.position_mm * 1e-3

    said = [one for one in watch(infer(*fleet(3, crossed(40, 6, 4), wrong))) if one.quantity == "scale x"]
    z = [(one.level[-1] - own[one.owner]) / one.u[-1] for one in said]
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.3)
    assert max(one.u[-1] for one in said) < 0.5 * spread


def test_a_spread_that_is_known_is_its_likeliest_and_one_that_is_not_is_its_prior() -> None:
    rng = np.random.default_rng(2)
    known = _expected(rng.normal(0.0, 2.0, 400), np.full(400, 0.01), 0.1, 5.0)
    assert known == pytest.approx(2.0, rel=0.1)
    unknown = _expected(np.zeros(2), np.full(2, 1e9), 0.1, 5.0)
    assert unknown == pytest.approx(5.0 * np.sqrt((3.0 - np.arctan(3.0)) / np.arctan(3.0)), rel=0.05)


def test_names_written_out_are_those_that_are_watched() -> None:
    assert set(LIMITS) == set(LABELS) == set(WATCHED)


def test_infer_and_watch_on_a_store(tmp_path: Path) -> None:
    store = tmp_path / "fleet"
    make_fleet(store, 12)
    run = CliRunner()
    answer = tmp_path / "answer.html"
    done = run.invoke(cli, ["fleet", "infer", str(store), "-o", str(answer), "--jobs", "1"])
    assert done.exit_code == 0, done.output
    assert "What is nothing wrong" in answer.read_text()
    said = json.loads(answer.with_suffix(".json").read_text())
    assert said["format"] == "stepgauge fleet inference 1"
    assert said["visits"] == 12
    assert said["expected_false_share"] <= 0.05
    assert said["looked_for"][0] == {
        "owner_kind": "gauge", "kind": "block", "owners": 2, "named": 0, "usual": 1.5, "unit": "um"
    }  # fmt: skip
    done = run.invoke(cli, ["fleet", "infer", str(store), "-o", str(tmp_path / "answer.docx")])
    assert "not a kind of report" in str(done.exception)
    done = run.invoke(cli, ["fleet", "watch", str(store), "--limit", "scale=5", "-o", str(tmp_path), "--jobs", "1"])
    assert done.exit_code == 0, done.output
    feed = Feed.model_validate_json((tmp_path / "watch.json").read_text())
    assert {one.owner for one in feed.quantities} >= {"M1", "M2", "M/3"}
    assert json.loads((tmp_path / "watch.schema.json").read_text()) == feed_schema()
    assert (tmp_path / "watch.png").stat().st_size > 10_000
    seen = sg.watch_fleet(store, limits={"scale": 5.0})
    assert not seen.simulated
    back = sg.read_result(tmp_path / "watch.json")
    assert (back.kind, back.summary()) == ("fleet watch", seen.summary())
    assert len(back.to_frame()) == len(seen.to_frame())
    table = seen.to_frame().set_index(["owner", "quantity"])
    for one in feed.quantities:
        assert table.loc[(one.owner, one.quantity), "level"] == one.level
        if one.limit is not None:
            assert table.loc[(one.owner, one.quantity), "limit_outcome"] == one.limit.outcome
    done = run.invoke(cli, ["fleet", "watch", str(store), "--limit", "length=5", "-o", str(tmp_path)])
    assert isinstance(done.exception, InputError)
    assert "one of scale" in str(done.exception)


@pytest.mark.parametrize("count", [2, NAMED + 4])
def test_the_figure_names_its_lines_and_shows_nothing_finer_than_their_uncertainty(count: int) -> None:
    """Levels of nanometres that are known to 0.1 um are no steps of a machine."""
    watched = [
        Watched("machine", f"M{n}", "scale x", "um/m", (100.0, 200.0), (0.0, 1e-4 * n), (0.1, 0.1), 0.0, 0.1, ())
        for n in range(count)
    ]
    (axes,) = watch_figure(watched).axes
    low, high = axes.get_ylim()
    assert high - low >= 0.4
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == (["M0 x", "M1 x"] if count == 2 else ["as before, as the peers"])


def test_watch_says_of_a_machine_what_its_history_says() -> None:
    """The same evaluations, the same code: a drift that one finds the other finds, with its rate."""
    entries = noise(np.random.default_rng(5), 6, step_u=5.0)
    (found,) = machine_drifts(entries)
    (alert,) = judge(make_series(entries), {})
    assert alert.kind == "drift"
    assert (found.machine, found.quantity, found.direction) == ("CMM", alert.quantity, alert.direction)
    said = FleetWatch((), {}, 0.05, (), (found,)).summary()
    assert f"machine CMM with gauge T-1: scale_ppm along x {alert.text}" in said
    assert not list(machine_drifts(noise(np.random.default_rng(6), 6)))
