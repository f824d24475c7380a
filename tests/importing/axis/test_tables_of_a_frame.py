"""DataFrames as they come: runs and directions under names of their own, gaps, rows that stand there twice."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import make_placement
from tests.build import make_gauge

TARGETS = np.array([0.0, 31.0, 67.0, 90.0, 118.0, 155.0])


def frame(runs: int = 3) -> pd.DataFrame:
    rows = [(run, way, x) for run in range(1, runs + 1) for way in ("up", "down") for x in TARGETS]
    found = pd.DataFrame(rows, columns=["n", "Direction", "Target [mm]"])
    found["zeit"] = 10.0 * np.arange(len(found)) + 5.0
    found["Error [um]"] = np.random.default_rng(2).normal(size=len(found)).round(3)
    return found.sample(frac=1.0, random_state=4).reset_index(drop=True)


def choices(found: sg.Imported) -> list[list[tuple[str, str]]]:
    return [[(one.argument, one.value) for one in question.choices] for question in found.questions]


def read(table: pd.DataFrame, **options: object) -> sg.Imported:
    return sg.import_recording(table, **{"sensor": "laser", **options})  # type: ignore[arg-type]


def test_missing_readings_are_asked_with_all_else_and_their_rows_are_told() -> None:
    table = frame()
    table.loc[[4, 9], "Error [um]"] = np.nan
    found = read(table)
    assert [one[0] for one in choices(found)] == [("accept", "missing"), ("time_unit", "s")]
    assert found.questions[0].text == "readings are missing: 'Error [um]', rows 4, 9"
    assert found.questions[1].found == "5 to 355"
    taken = read(table, accept="missing", time_unit="s")
    assert any("rows 4, 9 of 'Error [um]'" in one for one in taken.rejected)
    assert len(taken.settled()) == len(table) - 2


@pytest.mark.parametrize(("up", "down"), [(True, False), ("A", "B"), (0, 1), (1, 2)])
def test_two_texts_for_the_directions_are_asked_for_and_told_by_hand(up: object, down: object) -> None:
    stated = frame().drop(columns="zeit")
    table = stated.assign(Direction=stated["Direction"].map({"up": up, "down": down}))
    (offered,) = choices(read(table))
    assert ("columns", f"way=Direction={up}") in offered
    found = read(table, columns={"way": f"Direction={up}"}).settled()
    pd.testing.assert_frame_equal(found.frame, read(stated).settled().frame)


def test_rows_without_a_direction_are_named() -> None:
    table = frame().drop(columns="zeit")
    table.loc[5, "Direction"] = np.nan
    (question,) = read(table).questions
    assert question.text == "column 'Direction' is no direction of travel: nothing, rows 5"


def test_a_number_that_every_target_has_each_of_counts_the_runs() -> None:
    table = frame().drop(columns="zeit")
    found = read(table)
    assert (found.settled().frame["cycle"].to_numpy() == table["n"].to_numpy()).all()
    again = read(pd.concat([table, table.iloc[[3]]], ignore_index=True))
    assert any("rows that stand there twice: 1," in line for line in again.report)
    level = table.assign(level=np.where(table["n"] > 2, 2, 1)).drop(columns="n")
    assert "level" in read(level).settled().covariates


def test_a_position_beside_numbered_runs_is_the_target() -> None:
    table = frame().pivot_table(index="Target [mm]", columns=["n", "Direction"], values="Error [um]")
    ways = {"up": "fwd", "down": "bwd"}
    table.columns = pd.Index([f"run{n} {ways[way]}" for n, way in table.columns])
    table = table.reset_index().rename(columns={"Target [mm]": "pos_mm"})
    assert [one[0][0] for one in choices(read(table))] == ["deviation_unit"]
    one_answer = read(table.rename(columns={"pos_mm": "stage [mm]"}))
    assert [one[0] for one in choices(one_answer)] == [("columns", "target=stage [mm]")]


def test_a_place_is_offered_as_the_target_and_not_as_the_reading() -> None:
    table = frame().rename(columns={"Target [mm]": "angle_deg", "Error [um]": "ac_arcsec"}).drop(columns="zeit")
    (offered,) = choices(read(table, sensor="autocollimator"))
    assert ("columns", "target=angle_deg") in offered
    assert ("columns", "reading=angle_deg") not in offered
    assert read(table, sensor="autocollimator", columns={"target": "angle_deg"}).settled().units.position == "deg"


def test_the_placements_of_a_gauge_are_no_cycles_of_one_axis() -> None:
    gauge = make_gauge(4)
    faces = pd.DataFrame({"face": range(1, 9), "measured_mm": gauge.position_mm[:8] + 1e-4})
    table = pd.concat([faces.assign(placement=name) for name in ("X", "Y")])
    (offered,) = choices(read(table, sensor="touch", gauge=gauge))
    assert offered[:3] == [("rows", "placement=X"), ("placement", ""), ("rows", "placement=*")]
    assert 'rows="placement=X"' in read(table, sensor="touch", gauge=gauge).summary()
    assert len(read(table, sensor="touch", gauge=gauge, rows="placement=X").settled()) == 8
    with pytest.raises(InputError, match="the nominal value will do"):
        placed_without_radius(gauge, faces)


def placed_without_radius(gauge: Gauge, faces: pd.DataFrame) -> None:
    placement = make_placement((0.0, 0.0, 0.0), (60.0, 0.0, 0.0), 1, 4)
    read(faces, sensor=None, gauge=gauge, placement=placement).settled()
