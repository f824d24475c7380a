"""Faces of a gauge say their direction of travel, and every placement of it has an origin of its own."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.importing.result import Imported
from tests.build import make_gauge

GAUGE = make_gauge(6)
FACE = np.r_[1:13, 12:0:-1]
INTO = np.where(FACE % 2 == 1, 1, -1)
ORIGIN_MM = {1: 120.0, 2: 257.3}


def touched(front: str = "left", back: str = "right", **more: object) -> pd.DataFrame:
    away = 1e-3 * np.random.default_rng(1).normal(size=len(FACE))
    columns = {"cycle": np.repeat([1, 2], 12), "side": np.where(INTO > 0, front, back)}
    return pd.DataFrame({**columns, "measured_mm": GAUGE.position_mm[FACE - 1] + away, **more})


def read(frame: pd.DataFrame, **known: object) -> Imported:
    return sg.import_recording(frame, sensor="touch", gauge=GAUGE, **known)


def choices(found: Imported) -> list[str]:
    return [one.value for asked in found.questions for one in asked.choices]


@pytest.mark.parametrize(
    ("front", "back"),
    [("left", "right"), ("right", "left"), ("L", "R"), ("+x", "-x"), ("-x", "+x"), ("A", "B"), ("links", "rechts"),
     ("front", "back"), ("fwd", "bwd"), ("up", "down"), ("hin", "zurück")],
)  # fmt: skip
@pytest.mark.parametrize("header", ["side", "direction", "channel"])
def test_whatever_tells_fronts_from_backs_says_that_fronts_are_touched_towards_plus(
    front: str, back: str, header: str
) -> None:
    frame = touched(front, back).rename(columns={"side": header})
    np.testing.assert_array_equal(read(frame).settled().frame["way"], INTO)


@pytest.mark.parametrize(("front", "back"), [("fwd", "bwd"), ("up", "down"), ("front", "back"), ("+", "-")])
def test_a_direction_that_contradicts_the_faces_is_asked(front: str, back: str) -> None:
    asked = read(touched(back, front))
    assert asked.recording is None
    assert "ignore=side" in choices(asked)
    assert "contradict the faces" in asked.questions[0].text
    np.testing.assert_array_equal(read(touched(back, front), columns="ignore=side").settled().frame["way"], INTO)


def test_one_row_that_contradicts_its_face_is_asked() -> None:
    frame = touched("fwd", "bwd")
    frame.loc[3, "side"] = "fwd"
    assert "1 of 24 readings" in read(frame).questions[0].text


def test_a_word_that_may_be_a_side_is_asked_where_no_faces_are_known() -> None:
    frame = touched().assign(target_mm=GAUGE.position_mm[FACE - 1])
    asked = sg.import_recording(frame, sensor="touch")
    assert asked.recording is None
    assert {"way=side=left", "way=side=right"} <= set(choices(asked))
    settled = sg.import_recording(frame, sensor="touch", columns="way=side=left")
    np.testing.assert_array_equal(settled.settled().frame["way"], INTO)


def placed(**more: object) -> pd.DataFrame:
    frames = [touched(placement=number, **more) for number in ORIGIN_MM]
    moved = (one.assign(measured_mm=one["measured_mm"] + ORIGIN_MM[n]) for n, one in enumerate(frames, 1))
    return pd.concat(moved, ignore_index=True)


@pytest.mark.parametrize(
    "more", [{}, {"face": FACE}, {"face": FACE - 1}, {"certified_mm": GAUGE.position_mm[FACE - 1]}]
)
def test_every_placement_of_a_gauge_has_an_origin_of_its_own(more: dict[str, object]) -> None:
    frame = read(placed(**more), rows="placement=*").settled().frame
    np.testing.assert_allclose(frame["target"], np.tile(GAUGE.position_mm[FACE - 1], 2))
    away = frame["reading"] - frame["target"] - frame["placement"].map(ORIGIN_MM)
    assert np.abs(away).max() < 0.01


def test_an_origin_that_nothing_shows_is_no_guess() -> None:
    some = placed(face=FACE)[np.tile((FACE > 2) & (FACE < 9), 2)]
    assert sorted(set(read(some, rows="placement=*").settled().frame["target"])) == sorted(GAUGE.position_mm[2:8])
    with pytest.raises(InputError, match="from several origins"):
        read(some.drop(columns="face"), rows="placement=*")


def test_a_reading_far_from_its_target_is_named_whatever_the_origin() -> None:
    frame = placed()
    frame.loc[5, "measured_mm"] += 0.4 * np.diff(GAUGE.nominal_mm).min()
    with pytest.raises(InputError, match=f"belongs to no target; found {frame['measured_mm'][5]:g}"):
        read(frame, rows="placement=*")


def test_faces_of_points_that_count_from_0_count_from_1_in_the_recording() -> None:
    points = pd.DataFrame({"cycle": np.repeat([1, 2], 12), "x_mm": GAUGE.position_mm[FACE - 1] - 2.0 * INTO})
    points = points.assign(y_mm=0.0, z_mm=0.0, approach_i=INTO, approach_j=0, approach_k=0)
    zero, one = (
        sg.import_recording(points.assign(face=FACE - base), gauge=GAUGE, tip_radius_mm=2.0).settled().frame
        for base in (1, 0)
    )
    pd.testing.assert_frame_equal(zero, one)
