"""Directions that no column states: from the order of a travel, from times, from faces; else they are asked."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.importing.axis.travel import is_travel
from tests.build import make_gauge

TARGETS = np.arange(0.0, 501.0, 50.0)
THERE_AND_BACK = np.tile(np.r_[TARGETS, TARGETS[::-1]], 4)
SHUFFLED = np.random.default_rng(3).permutation(len(THERE_AND_BACK))


def table(target: np.ndarray = THERE_AND_BACK) -> pd.DataFrame:
    away_um = 8e-3 * target + np.random.default_rng(1).normal(0.0, 0.3, len(target))
    return pd.DataFrame(
        {"target_mm": target, "reading_mm": target + 1e-3 * away_um, "time_s": 5.0 * np.arange(len(target))}
    )


def test_rows_in_no_order_of_a_travel_are_asked_for_their_directions() -> None:
    found = sg.import_recording(table().iloc[SHUFFLED].drop(columns="time_s"), sensor="laser")
    (asked,) = found.questions
    answers = [(one.argument, one.value) for one in asked.choices]
    assert answers == [("columns", "way=HEADER"), ("constants", "direction=+"), ("accept", "order")]
    one_way = sg.import_recording(
        table().iloc[SHUFFLED].drop(columns="time_s"), sensor="laser", constants="direction=+"
    )
    assert (one_way.settled().frame["way"] == 1).all()


def test_targets_that_were_read_in_a_random_order_are_taken_on_request() -> None:
    target = np.concatenate([np.random.default_rng(n).permutation(TARGETS) for n in range(5)])
    plain = table(target).drop(columns="time_s")
    assert sg.import_recording(plain, sensor="laser").questions
    found = sg.import_recording(plain, sensor="laser", accept="order").settled()
    steps = np.diff(target)
    np.testing.assert_array_equal(
        found.frame["way"].to_numpy()[1:][np.abs(steps) == 50.0], np.sign(steps)[np.abs(steps) == 50.0]
    )


def test_rows_in_no_order_are_taken_by_their_times() -> None:
    rows = ["target", "time_s", "way", "cycle"]
    listed, mixed = (sg.import_recording(one, sensor="laser") for one in (table(), table().iloc[SHUFFLED]))
    assert "from the order of the targets in time\nreadings towards +: 44, towards −: 44" in mixed.summary()
    sorted_rows = mixed.settled().frame.sort_values("time_s")[rows]
    np.testing.assert_allclose(sorted_rows.to_numpy(float), listed.settled().frame[rows].to_numpy(float))


@pytest.mark.parametrize(
    "place",
    [
        np.tile(np.arange(6), 4),
        np.tile(np.r_[0:6, 5:-1:-1], 3),
        np.repeat(np.arange(6), 5),
        np.array([0, 1, 0, 1, 2, 1, 2, 3, 2, 3, 4, 3, 4, 5, 4, 5]),
        np.tile(np.r_[0:3, 4:9, 8:2:-1, 1:-1:-1], 3),
        np.tile(np.r_[3:9], 4),
        np.zeros(1, int),
    ],
    ids=["one way", "there and back", "each repeated", "pilgrim steps", "one missing", "a part", "one reading"],
)
def test_orders_of_travels(place: np.ndarray) -> None:
    assert is_travel(place)


@pytest.mark.parametrize("count", [6, 11, 21])
def test_shuffled_places_are_no_travel(count: int) -> None:
    for seed in range(20):
        assert not is_travel(np.random.default_rng(seed).permutation(np.repeat(np.arange(count), 6)))


@pytest.mark.parametrize("order", ["listed", "shuffled"])
def test_touched_faces_tell_the_direction(order: str) -> None:
    gauge = make_gauge(6)
    face = np.tile(np.arange(1, 13), 3)
    rows = pd.DataFrame(
        {"face": face, "reading_mm": gauge.position_mm[face - 1] + np.where(face % 2 == 1, -1e-3, 1e-3)}
    )
    rows = rows if order == "listed" else rows.sample(frac=1.0, random_state=1)
    found = sg.import_recording(rows, sensor="touch", gauge=gauge, columns={"target": "face"}, unit="mm")
    frame = found.settled().frame
    np.testing.assert_array_equal(frame["way"], np.where(rows["face"] % 2 == 1, 1, -1))
    assert "direction of the faces" in found.summary()
    assert ("order of the readings is not known" in found.summary()) == (order == "shuffled")
    assert frame["cycle"].value_counts().to_dict() == {1: 12, 2: 12, 3: 12}
