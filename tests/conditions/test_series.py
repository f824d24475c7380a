"""Readings of an axis, points on a sphere and channels of a drift test: the slips that their data show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from stepgauge.conditions import STATES, Conditions, State
from stepgauge.conditions.axis import axis_conditions
from stepgauge.conditions.series import channel_conditions, copied_block, plateau, spikes
from stepgauge.conditions.sphere import sphere_conditions
from stepgauge.physics.directions import evenly_spread_points

Array = np.ndarray
TARGETS = np.linspace(0.0, 500.0, 11)
Change = Callable[[Array], Array]


def axis(change: Change = lambda um: um, seed: int = 1, runs: int = 5, **more: object) -> Conditions:
    """Both ways over 500 mm, 10 um of error, 0.4 um of scatter; ``um``: (runs, 2, targets)."""
    random = np.random.default_rng(seed)
    um = 5.0 * np.sin(TARGETS / 90.0) + np.array([0.4, -0.4])[:, None] + random.normal(0.0, 0.4, (runs, 2, 11))
    um = change(np.round(um, 2))
    run, way, place = np.indices(um.shape)
    columns = [np.ravel(one) for one in (um, TARGETS[place], place, 1 - 2 * way, run + 1)]
    return axis_conditions(*columns, more)  # type: ignore[arg-type]


def put(place: tuple[object, ...], value: float) -> Change:
    def change(um: Array) -> Array:
        um[place] = value  # type: ignore[index]
        return um

    return change


def states(conditions: Conditions) -> dict[str, State]:
    """The worst of each name."""
    worst = sorted(conditions, key=lambda one: STATES.index(one.state))
    return {one.name: one.state for one in worst}


def test_a_good_axis_has_no_note() -> None:
    assert [axis(seed=seed).notes for seed in range(10)] == [()] * 10


@pytest.mark.parametrize(
    ("change", "name", "state"),
    [
        (lambda um: um * 1e-3, "units", "prevents"),
        (lambda um: um * 200.0, "units", "contribution"),
        (lambda um: um * 1e4, "units", "prevents"),
        (lambda um: um + TARGETS, "units", "prevents"),
        (lambda um: np.repeat(um[:1], 5, axis=0), "duplicates", "prevents"),
        (lambda um: np.repeat(um[:, :1], 2, axis=1), "duplicates", "prevents"),
        (lambda um: um * np.array([1, 1, -1, 1, 1])[:, None, None], "units", "prevents"),
        (put((2, 1, 4), -180000.0), "outliers", "prevents"),
        (put((2, 1, 4), 50.0), "outliers", "contribution"),
        (put((3, 0), 1.23), "channel", "prevents"),
        (lambda um: np.round(um / 5.0) * 5.0, "resolution", "contribution"),
        (lambda um: um + 2.0 * np.arange(5)[:, None, None], "drift", "contribution"),
    ],
)
def test_what_the_readings_of_an_axis_show(change: Change, name: str, state: State) -> None:
    assert states(axis(change)).get(name) == state


def test_the_reading_of_an_axis_that_stands_out_is_named() -> None:
    (one,) = axis(put((2, 1, 4), 50.0)).of("outliers")
    assert "target 200, run 3 down" in one.sentence


@pytest.mark.parametrize("value", [-273.15, 9999.0, 68.0, 0.0])
def test_temperatures_that_are_none_prevent_a_statement(value: float) -> None:
    room = np.full(110, 20.0) + np.linspace(0.0, 0.5, 110)
    assert axis(room_C=room).notes == ()
    room[60:70] = value
    assert states(axis(room_C=room))["temperature"] == "prevents"


def sphere(seed: int = 1, noise_um: float = 0.4) -> Array:
    every = evenly_spread_points(50)
    normals = every[np.argsort(every[:, 2])[25:]]
    radius = 15.5 + np.random.default_rng(seed).normal(0.0, noise_um, 25) * 1e-3
    return np.array([100.123, 50.456, 20.789]) + normals * radius[:, None]


def test_a_good_sphere_has_no_note() -> None:
    assert [sphere_conditions(sphere(seed), "s.csv").notes for seed in range(10)] == [()] * 10


@pytest.mark.parametrize(
    ("points", "name", "state"),
    [
        (sphere(noise_um=0.0), "sphere", "prevents"),
        (np.round(sphere(), 1), "resolution", "prevents"),
        (np.round(sphere(), 3), "resolution", "contribution"),
        (np.vstack([sphere()[:20], sphere()[:5]]), "duplicates", "prevents"),
        (sphere() + np.outer(np.eye(25)[9], [0.0, 0.0, 5.0]), "outliers", "prevents"),
        (sphere() + np.outer(np.eye(25)[9], [0.0, 0.0, 0.05]), "outliers", "contribution"),
    ],
)
def test_what_points_on_a_sphere_show(points: Array, name: str, state: State) -> None:
    found = sphere_conditions(points, "s.csv")
    assert states(found).get(name) == state
    assert name != "outliers" or "point 10 " in found.of("outliers")[0].sentence


TIME_H = np.arange(289) / 12.0


def channels(change: Change = lambda um: um, room: Change = lambda c: c, seed: int = 1) -> Conditions:
    random = np.random.default_rng(seed)
    um = np.round(3.0 * np.sin(TIME_H / 4.0) + random.normal(0.0, 0.05, 289), 3)
    y = np.round(2.0 * np.cos(TIME_H / 4.0) + random.normal(0.0, 0.05, 289), 3)
    warm = np.round(20.0 + np.sin(TIME_H / 4.0 - 1.0) + random.normal(0.0, 0.01, 289), 2)
    return channel_conditions({"x1": change(um.copy()), "y1": y}, {"room": room(warm)})


def test_a_good_drift_test_has_no_note() -> None:
    assert [channels(seed=seed).notes for seed in range(10)] == [()] * 10


@pytest.mark.parametrize(
    ("change", "name", "state"),
    [
        (lambda um: um * 1e-3, "units", "prevents"),
        (lambda um: um * 1e3, "units", "prevents"),
        (put((slice(30, None),), -0.0786), "channel", "prevents"),
        (lambda um: np.clip(um, -2.0, 2.0), "channel", "prevents"),
        (put((0,), 30.0), "outliers", "contribution"),
        (put((100,), 9999.0), "units", "prevents"),
        (lambda um: um * np.where(TIME_H > 6.0, -1.0, 1.0), "outliers", "contribution"),
    ],
)
def test_what_a_displacement_shows(change: Change, name: str, state: State) -> None:
    assert states(channels(change)).get(name) == state


def test_copies_in_a_drift_test() -> None:
    um, y = np.random.default_rng(2).normal(0.0, 1.0, (2, 100))
    assert states(channel_conditions({"x": um, "y": um}, {}))["duplicates"] == "prevents"
    assert not channel_conditions({"x": um, "y": y}, {}).of("duplicates")
    rows = np.column_stack([um, y])
    rows[60:75] = rows[20:35]
    assert copied_block(rows) == (60, 67, 20)
    assert states(channel_conditions({"x": rows[:, 0], "y": rows[:, 1]}, {}))["duplicates"] == "prevents"


@pytest.mark.parametrize(
    "room",
    [
        put((77,), -273.15),
        put((slice(100, 110),), 0.0),
        put((100,), 2.04),
        lambda c: np.where(TIME_H > 12.0, c * 1.8 + 32.0, c),
        put((100,), 9999.0),
    ],
)
def test_rooms_with_no_temperature(room: Change) -> None:
    assert states(channels(room=room))["temperature"] == "prevents"


def test_a_display_of_coarse_steps_is_not_stuck() -> None:
    slow = np.round(3.0 * np.sin(TIME_H / 4.0) + np.random.default_rng(3).normal(0.0, 0.2, 289))
    assert plateau(slow) is None
    assert spikes(slow)[0].size == 0


@pytest.mark.parametrize("row", [0, 1, 50, 98, 99])
def test_a_reading_that_stands_out_is_named_alone_at_the_ends_too(row: int) -> None:
    values = np.sin(np.arange(100) / 20.0) + np.random.default_rng(3).normal(0.0, 0.05, 100)
    values[row] += 40.0
    rows, off = spikes(values)
    assert rows.tolist() == [row]
    assert off[0] == pytest.approx(40.0, abs=1.0)


def test_a_drift_test_on_a_display_as_coarse_as_its_u_decides_nothing() -> None:
    """Steps of 1 um in a range of 5 um: the range is wrong by up to as much."""
    um = 2.5 * np.sin(np.arange(289) / 48.0) + np.random.default_rng(1).normal(0.0, 0.05, 289)
    for decimals, expected in ((3, ()), (0, ("resolution",))):
        found = channel_conditions({"x1": np.round(um, decimals)}, {})
        assert tuple(one.name for one in found if one.state != "met") == expected
        assert [one.name for one in found.weighed(0.5).preventing] == list(expected)
