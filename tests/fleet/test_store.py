"""The store: what goes in comes out bit for bit, once, whatever dies."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.fleet.compacting import compact
from stepgauge.fleet.content import recording_key
from stepgauge.fleet.query import query
from stepgauge.fleet.results import Results
from stepgauge.fleet.schema import OWNERS
from stepgauge.fleet.store import Fleet
from stepgauge.gauge.certified import read_gauge
from stepgauge.recording import Recording
from tests.fleet.made import GAUGE, make_entry, make_fleet, make_recording


def test_what_is_read_is_what_was_added_to_the_last_bit(tmp_path: Path) -> None:
    fleet = make_fleet(tmp_path / "fleet")
    table = Fleet(tmp_path / "fleet").recordings()
    assert len(table) == 6
    assert table["measured_at"].is_monotonic_increasing
    assert set(table["machine"]) == {"M1", "M2", "M/3"}
    assert table["probe"].isna().all()
    asked = "SELECT machine, month, count(*) AS n FROM probings WHERE machine = 'M/3' GROUP BY ALL ORDER BY month"
    rows = [{"machine": "M/3", "month": month, "n": 126} for month in ("2025-03", "2025-06")]
    assert query(fleet, asked).to_pylist() == rows
    for number in range(6):
        given = make_entry(fleet, number).recording
        found = fleet.read(recording_key(given))
        assert found.frame.equals(given.frame)
        assert list(found.frame.columns) == list(given.frame.columns)
        assert found.comments == given.comments


def test_covariates_keep_their_names_order_and_types(tmp_path: Path) -> None:
    fleet = Fleet(tmp_path / "fleet", create=True)
    entry = make_entry(fleet, 0)
    frame = entry.recording.frame.assign(humidity=40.5, shift=3)
    frame = frame[["shift", *[name for name in frame if name != "shift"]]]
    odd = replace(entry, recording=Recording(frame, {"b": "2", "a": "1"}, "odd.csv"))
    fleet.add([odd, make_entry(fleet, 3)])
    found = fleet.read(recording_key(odd.recording))
    assert found.frame.equals(frame)
    assert list(found.frame.dtypes) == list(frame.dtypes)


def test_adding_again_changes_nothing_and_another_owner_is_refused(tmp_path: Path) -> None:
    fleet = make_fleet(tmp_path / "fleet")
    files = sorted(path for path in fleet.folder.rglob("*") if path.is_file())
    entry = make_entry(fleet, 1)
    assert fleet.add([entry, entry])[0] == []
    assert sorted(path for path in fleet.folder.rglob("*") if path.is_file()) == files
    with pytest.raises(InputError, match="another hall; found H7; expected H1"):
        fleet.add([replace(entry, owners={**entry.owners, "hall": "H7"})])


def test_the_key_is_of_the_content_and_not_of_its_order() -> None:
    one = make_recording(read_gauge(GAUGE), 1, b="2", a="1")
    other = Recording(one.frame[list(reversed(one.frame.columns))], dict(reversed(one.comments.items())), "else.csv")
    assert recording_key(one) == recording_key(other)
    moved = one.frame.assign(x_mm=one.frame["x_mm"] + 1e-7)
    assert recording_key(one) != recording_key(Recording(moved, one.comments))


def test_certificates_and_machine_files_are_kept_by_content(tmp_path: Path) -> None:
    fleet = make_fleet(tmp_path / "fleet")
    table = fleet.recordings()
    assert table["certificate"].nunique() == 1
    kept = fleet.gauge(table["certificate"][0])
    assert (kept.position_mm == read_gauge(GAUGE).position_mm).all()
    assert fleet.machine(table["machine_file"][0]).table.name == "Bridge CMM"
    assert set(OWNERS) <= set(table.columns)


def test_a_folder_that_is_no_store_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no fleet here"):
        Fleet(tmp_path)
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(InputError, match="this is no store"):
        Fleet(tmp_path, create=True)
    (tmp_path / "fleet.json").write_text('{"format": "stepgauge fleet", "version": 99}')
    with pytest.raises(InputError, match="not a store of this stepgauge"):
        Fleet(tmp_path)


def test_results_are_kept_once_for_each_recording_and_never_mixed(tmp_path: Path) -> None:
    fleet = make_fleet(tmp_path / "fleet", 2)
    keys = list(fleet.recordings()["recording"])
    table = Results(fleet, "evaluations", {"blocks": "all"})
    table.put([{"recording": key, "value": 1.5} for key in keys])
    table.put([{"recording": key, "value": 2.5} for key in keys])
    assert table.done() == set(keys)
    assert table.read()["value"].to_pylist() == [1.5, 1.5]
    other = Results(fleet, "evaluations", {"blocks": "1:3"})
    assert other.done() == set()
    other.put([{"recording": keys[0], "value": 3.5}])
    assert other.read()["value"].to_pylist() == [3.5]
    assert table.done() == set()


def test_packing_changes_no_answer_and_a_kill_between_its_steps_loses_nothing(tmp_path: Path) -> None:
    fleet = Fleet(tmp_path / "fleet", create=True)
    entries = [make_entry(fleet, number) for number in (0, 3, 12, 15, 1)]
    entries = [replace(entry, measured_at=entries[0].measured_at) for entry in entries]
    for entry in entries:
        fleet.add([entry])
        Results(fleet, "evaluations").put([{"recording": recording_key(entry.recording), "value": 1.0}])
    asked = "SELECT machine, count(*) AS n, sum(CAST(x_mm * 1e7 AS BIGINT)) AS x FROM probings GROUP BY ALL ORDER BY 1"
    before, table = query(fleet, asked), fleet.recordings()
    state = tmp_path / "state"
    shutil.copytree(fleet.folder, state)
    compact(fleet)
    assert len(list(fleet.folder.rglob("*.parquet"))) == 5  # two machines, an index, sources, evaluations
    for path in state.rglob("*.parquet"):  # as if it had been killed before anything was removed
        if not (fleet.folder / path.relative_to(state)).exists():
            shutil.copy2(path, fleet.folder / path.relative_to(state))
    for again in (Fleet(fleet.folder), Fleet(state)):
        assert query(again, asked).equals(before)
        same = again.recordings()
        assert same.drop(columns=["file", "first_row"]).equals(table.drop(columns=["file", "first_row"]))
        assert len(Results(again, "evaluations").read()) == 5
    again = Fleet(fleet.folder)
    compact(again)
    assert len(list(fleet.folder.rglob("*.parquet"))) == 5
    found = dict(again.read_many(list(table["recording"])))
    assert all(found[recording_key(one.recording)].frame.equals(one.recording.frame) for one in entries)
    assert again.add(entries)[0] == []


KILLED = """
import sys
from tests.fleet.made import make_entry
from stepgauge.fleet.store import Fleet
from stepgauge.fleet.compacting import compact
fleet = Fleet(sys.argv[1], create=True)
for number in range(int(sys.argv[2]), 400):
    fleet.add([make_entry(fleet, number % 30)])
    print(number, flush=True)
    if number % 3 == 0:
        compact(fleet)
"""


def test_writers_killed_at_any_moment_leave_whole_recordings(tmp_path: Path) -> None:
    """Two processes add and pack the same recordings at once and are killed; what is there is whole, and once."""
    folder, random = tmp_path / "fleet", np.random.default_rng(3)
    Fleet(folder, create=True)
    run = [sys.executable, "-c", KILLED, str(folder)]
    writers = [subprocess.Popen([*run, str(first)], stdout=subprocess.PIPE) for first in (0, 7)]
    for writer in writers:
        assert writer.stdout is not None
        for _ in range(4):
            assert writer.stdout.readline()
        time.sleep(float(random.uniform(0.0, 0.1)))
        writer.kill()
    for writer in writers:
        writer.communicate()
    fleet = Fleet(folder)
    table = fleet.recordings()
    assert len(table) > 3
    assert table["recording"].is_unique
    assert {row.key: len(row.columns["face"]) for row in fleet.stored(table["recording"])} == dict(
        zip(table["recording"], table["rows"], strict=True)
    )
    entries = [make_entry(fleet, number) for number in range(30)]
    new, known = fleet.add(entries)
    assert set(known) == set(table["recording"])
    compact(fleet)
    assert not list(folder.rglob("*.tmp"))
    assert query(fleet, "SELECT count(*) AS n FROM probings")["n"].to_pylist() == [sum(fleet.recordings()["rows"])]
    assert len(new) + len(known) == 30
    assert query(fleet, "SELECT count(DISTINCT recording) AS n FROM probings")["n"].to_pylist() == [30]
