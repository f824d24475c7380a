"""The order of the readings: rows that go as a machine does show it, sorted rows and columns do not."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.order import drift_columns, goes_as_machine, is_order_known
from stepgauge.axis.recording import AxisRecording, read_axis_recording

BACK_UM, DRIFT_UM = -4.0, 1.5
TARGETS = np.array([0.0, 31.0, 67.0, 90.0, 118.0, 155.0, 181.0, 213.0, 240.0])
NAMES = {"target": "Target [mm]", "run": "Run", "way": "Direction", "um": "Error [um]"}


def readings(drift_um: float = DRIFT_UM, noise_um: float = 0.1, runs: int = 3, seed: int = 1) -> pd.DataFrame:
    """Forward, then back, in every run, with a drift that is even in time over the whole test."""
    rows = [(x, run, way) for run in range(1, runs + 1) for way in (1, -1) for x in TARGETS[::way]]
    frame = pd.DataFrame(rows, columns=["target", "run", "way"])
    time = np.linspace(0.0, 1.0, len(frame))
    noise = noise_um * np.random.default_rng(seed).normal(size=len(frame))
    frame["um"] = np.where(frame["way"] < 0, BACK_UM, 0.0) + drift_um * time + noise
    return frame


def long(frame: pd.DataFrame) -> pd.DataFrame:
    ways = {1: "fwd", -1: "bwd"}
    return frame.assign(way=frame["way"].map(ways)).rename(columns=NAMES)


def wide(frame: pd.DataFrame, ways: tuple[str, ...] = ("bwd", "fwd")) -> pd.DataFrame:
    """A column for every run and direction, as ``pivot_table`` sorts them or forward first."""
    table = long(frame).pivot_table(index="Target [mm]", columns=["Run", "Direction"], values="Error [um]")
    table = table[[(run, way) for run in sorted(frame["run"].unique()) for way in ways]]
    table.columns = pd.Index([f"run{run} {way} [um]" for run, way in table.columns])
    return table.reset_index()


def recording(table: pd.DataFrame, **options: str) -> AxisRecording:
    found = sg.import_recording(table, sensor="laser", **options)
    assert isinstance(found.recording, AxisRecording), found.summary()
    told = any("order of the readings is not known" in line for line in found.report)
    assert told == (not is_order_known(found.recording))
    return found.recording


@pytest.mark.parametrize("by", [["target", "way", "run"], ["target", "run", "way"], ["run", "target"], ["run", "way"]])
def test_a_sorted_table_shows_no_order(by: list[str]) -> None:
    taken = readings()
    assert is_order_known(recording(long(taken)))
    by_target = taken.sort_values("target", kind="stable").sort_values(by, kind="stable")
    assert not is_order_known(recording(long(by_target)))
    timed = long(by_target).assign(**{"Time [s]": by_target.index.to_numpy(float)})
    assert is_order_known(recording(timed))
    assert is_order_known(recording(long(by_target), accept="order"))


def test_columns_show_an_order_where_no_way_back_stands_before_its_way_there() -> None:
    taken = readings()
    assert is_order_known(recording(wide(taken, ("fwd", "bwd"))))
    assert not is_order_known(recording(wide(taken)))
    stated = recording(wide(taken), accept="order")
    assert is_order_known(stated)
    assert stated.frame["way"].iloc[0] == -1
    assert stated.frame["target"].iloc[0] == TARGETS[-1]


def test_a_stated_order_is_kept_in_the_file(tmp_path: object) -> None:
    path = f"{tmp_path}/axis.csv"
    recording(wide(readings()), accept="order").write(path)
    assert is_order_known(read_axis_recording(path))
    recording(wide(readings())).write(path)
    assert not is_order_known(read_axis_recording(path))


def test_a_run_that_broke_off_and_targets_that_scatter_are_in_order() -> None:
    broken = recording(long(readings().drop(index=[3, 20, 21])))
    assert goes_as_machine(broken.frame)
    scanned = pd.DataFrame({"placement": 1, "cycle": 1, "way": 1, "target": np.arange(50.0)})
    scanned.loc[10, "target"] += 1.5
    assert goes_as_machine(scanned)


@pytest.mark.parametrize("runs", [1, 3])
def test_what_a_drift_may_make_of_a_reversal_is_what_it_makes(runs: int) -> None:
    """An even drift changes the mean of forward minus back by as much as a pass drifts, in either order."""
    found = recording(wide(readings(noise_um=0.0, runs=runs)))
    away = found.deviation
    way = found.frame["way"].to_numpy()
    made = abs(float(away[way > 0].mean() - away[way < 0].mean()) + BACK_UM)
    along, between = drift_columns(found, away)
    assert between[way > 0].mean() - between[way < 0].mean() == pytest.approx(made, rel=0.15)
    assert np.ptp(along[way > 0]) == pytest.approx(made, rel=0.15)


def test_a_reversal_of_sorted_columns_is_told_with_what_the_order_leaves_open() -> None:
    found = sg.diagnose(recording(wide(readings())))
    table = found.to_frame()
    row = table[table["kind"] == "reversal_error"].iloc[0]
    assert abs(row["value"] + BACK_UM) < 2.0 * row["u"]
    assert row["u"] > DRIFT_UM / 12.0
    assert "either direction may have been the first" in str(found.contents["limits"])
