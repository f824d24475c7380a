"""Watching a fleet: closed forms of the states, the feed and its schema, and both verbs on a store."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import norm

import stepgauge as sg
from stepgauge.cli import cli
from stepgauge.cli.fleet.watch import LIMITS
from stepgauge.figures.fleet import LABELS, NAMED, watch_figure
from stepgauge.fleet.crossed.drifting import State, Wandering, beyond, due_day, follow
from stepgauge.fleet.crossed.feed import Feed, feed_schema
from stepgauge.fleet.crossed.infer import infer
from stepgauge.fleet.crossed.watch import Watched, watch
from stepgauge.fleet.crossed.watching import LIMITS as WATCHED
from stepgauge.gauge.certified import Gauge
from tests.fleet.crossed_made import crossed, fleet
from tests.fleet.made import make_fleet


def test_a_level_that_does_not_walk_is_a_regression_with_priors() -> None:
    """The state after all values is the posterior of a line with normal priors of level and rate."""
    rng = np.random.default_rng(1)
    day = np.sort(rng.uniform(0.0, 700.0, 12))
    shares, variance = rng.normal(size=(12, 1)), rng.uniform(0.1, 0.5, 12)
    value = rng.normal(size=12)
    states, density = follow(day, value, variance, shares, Wandering(1.5, 0.7, 0.0, 1.0))
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
    state = State(1000.0, np.array([2.0]), np.array([rate]), np.diag([u**2, 0.0]))
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
    table = sg.watch_fleet(store, limits={"scale": 5.0}).to_frame().set_index(["owner", "quantity"])
    for one in feed.quantities:
        assert table.loc[(one.owner, one.quantity), "level"] == one.level
        if one.limit is not None:
            assert table.loc[(one.owner, one.quantity), "limit_outcome"] == one.limit.outcome
    done = run.invoke(cli, ["fleet", "watch", str(store), "--limit", "length=5", "-o", str(tmp_path)])
    assert done.exit_code == 2
    assert "one of scale" in done.output


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
