"""The store: what goes in comes out bit for bit, once, whatever dies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stepgauge.errors import InputError
from stepgauge.fleet.content import recording_key
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
