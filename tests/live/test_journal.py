"""The journal: what is on the disk stays, what is half on it goes, and nothing else is taken for it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.files.checksum import add_checksum
from stepgauge.live.journal import FORMAT, Journal, fingerprint, look, resume, start
from tests.live.made import small_gauge, small_machine, small_program

HEAD = {"plan": "p", "machine": "m", "gauge": "g", "points": 4, "started": "2026-11-23T08:00:00.000+00:00"}
ROW = {"x_mm": 1.5, "y_mm": -2.0, "z_mm": 3.25, "time_s": 12.5}


def written(path: Path, points: int = 3) -> Journal:
    journal = start(path, HEAD)
    for point in range(1, points + 1):
        journal.add(point, {**ROW, "time_s": float(point)})
    journal.close()
    return journal


def test_a_journal_is_read_as_it_was_written(tmp_path: Path) -> None:
    first = written(tmp_path / "j")
    again = resume(tmp_path / "j", {**HEAD, "started": "later"})
    assert again.rows == first.rows
    assert again.began_s == first.began_s == 1795420800.0
    again.add(4, ROW)
    again.finish()
    again.close()
    lines = (tmp_path / "j").read_text().splitlines()
    assert [json.loads(line).get("point") for line in lines] == [None, 1, 2, 3, 4, None]


def test_every_point_is_on_the_disk_when_it_is_acknowledged(tmp_path: Path) -> None:
    journal = start(tmp_path / "j", HEAD)
    for point in (1, 2, 3):
        journal.add(point, ROW)
        assert f'"point": {point}' in (tmp_path / "j").read_text().splitlines()[-1]
    with pytest.raises(InputError, match="point 2 is there twice"):
        journal.add(2, ROW)
    journal.close()


@given(st.integers(0, 400))
def test_a_journal_that_is_cut_anywhere_keeps_its_whole_lines(
    tmp_path_factory: pytest.TempPathFactory, cut: int
) -> None:
    path = tmp_path_factory.mktemp("journal") / "j"
    written(path)
    whole = path.read_bytes()
    cut = min(cut, len(whole))
    path.write_bytes(whole[:cut])
    complete = max(whole[:cut].count(b"\n") - 1, 0)
    journal = resume(path, HEAD)
    assert sorted(journal.rows) == list(range(1, complete + 1))
    journal.add(complete + 1, ROW)
    journal.close()
    back = resume(path, HEAD)
    assert sorted(back.rows) == list(range(1, complete + 2))
    back.close()


def test_an_unfinished_measurement_is_not_overwritten_and_a_finished_one_is(tmp_path: Path) -> None:
    written(tmp_path / "j")
    with pytest.raises(InputError, match="an unfinished measurement is here; expected resume"):
        start(tmp_path / "j", HEAD)
    journal = resume(tmp_path / "j", HEAD)
    journal.finish()
    journal.close()
    start(tmp_path / "j", HEAD).close()
    assert len((tmp_path / "j").read_text().splitlines()) == 1


def test_one_that_was_refused_before_its_first_point_stands_in_nobodys_way(tmp_path: Path) -> None:
    written(tmp_path / "j", 0)
    written(tmp_path / "j", 2)
    assert len((tmp_path / "j").read_text().splitlines()) == 3


@pytest.mark.parametrize("text", ["my notes", "my notes\n", "x,y\n1,2\n"])
def test_a_file_that_is_no_journal_is_not_overwritten(tmp_path: Path, text: str) -> None:
    (tmp_path / "j").write_text(text)
    with pytest.raises(InputError, match="no journal of a measurement"):
        start(tmp_path / "j", HEAD)
    assert (tmp_path / "j").read_text() == text
    with pytest.raises(InputError, match="cannot write here"):
        start(tmp_path, HEAD)


@pytest.mark.skipif(os.name != "posix", reason="files are locked on POSIX")
def test_two_measurements_do_not_write_one_journal(tmp_path: Path) -> None:
    first = start(tmp_path / "j", HEAD)
    first.add(1, ROW)
    with pytest.raises(InputError, match="another process is writing this journal"):
        resume(tmp_path / "j", HEAD)
    first.add(2, ROW)
    first.close()
    again = resume(tmp_path / "j", HEAD)
    assert sorted(again.rows) == [1, 2]
    again.close()


@pytest.mark.parametrize("key", ["plan", "machine", "gauge", "points"])
def test_the_journal_of_something_else_is_refused(tmp_path: Path, key: str) -> None:
    written(tmp_path / "j")
    with pytest.raises(InputError, match=f"this is the journal of another {key}"):
        resume(tmp_path / "j", {**HEAD, key: "other"})


FIRST = {"format": FORMAT, **HEAD}
GOOD = {"x_mm": 1, "y_mm": 2, "z_mm": 3}


def lines_of(*rows: dict[str, Any]) -> bytes:
    """Lines whose checksums are right, whatever they say."""
    found, last = b"", ""
    for row in rows:
        whole = add_checksum(row, last)
        found, last = found + json.dumps(whole).encode() + b"\n", whole["checksum"]
    return found


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        (lines_of({"format": "x"}), "this is no journal"),
        (b'{"format": "x"}\n', "j:1: the journal is damaged"),
        (b"hello\n", "j:1: the journal is damaged"),
        (lines_of(FIRST, {"point": 0, **GOOD}), "j:2: the journal is damaged"),
        (lines_of(FIRST, {"point": 5, **GOOD}), "j:2: the journal is damaged"),
        (lines_of(FIRST, {"point": "1", **GOOD}), "j:2: the journal is damaged"),
        (lines_of(FIRST, {"point": 1, **GOOD}, {"point": 1, **GOOD}), "j:3: the journal is damaged"),
        (lines_of(FIRST, {"point": 1, "t": "a", **GOOD}), "j:2: the journal is damaged"),
        (lines_of(FIRST, {"point": 1, "x_mm": 1}), "j:2: the journal is damaged"),
        (lines_of(FIRST, {"end": 1}), "j:2: the journal is damaged"),
        (lines_of(FIRST) + lines_of({"point": 1, **GOOD}), "j:2: the journal is damaged"),
        (lines_of(FIRST) + b"[1]\n", "j:2: the journal is damaged"),
    ],
)
def test_damage_is_told_with_its_line(tmp_path: Path, text: bytes, wrong: str) -> None:
    (tmp_path / "j").write_bytes(text)
    with pytest.raises(InputError, match=wrong):
        resume(tmp_path / "j", HEAD)


def test_no_flipped_bit_gives_another_measurement(tmp_path: Path) -> None:
    path = tmp_path / "j"
    rows, whole = written(path).rows, path.read_bytes()
    for place in range(len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << (place * 5 + place // 8) % 8
        path.write_bytes(bytes(damaged))
        with pytest.raises(InputError, match=r"j:\d: the journal is damaged: this line is not as it was written"):
            resume(path, HEAD)
        assert path.read_bytes() == damaged, "what was refused is kept"
    path.write_bytes(whole)
    back = resume(path, HEAD)
    assert back.rows == rows
    back.close()


def test_a_line_that_is_gone_or_moved_is_seen_and_the_advice_holds(tmp_path: Path) -> None:
    path = tmp_path / "j"
    written(path)
    lines = path.read_bytes().splitlines(keepends=True)
    for changed in ([*lines[:2], lines[3]], [lines[0], lines[2], lines[1], lines[3]]):
        path.write_bytes(b"".join(changed))
        with pytest.raises(InputError, match=r"where it and all below are deleted, what they hold is done again"):
            resume(path, HEAD)
    path.write_bytes(b"".join(lines[:2]))
    back = resume(path, HEAD)
    assert sorted(back.rows) == [1]
    back.add(2, ROW)
    back.close()
    assert sorted(look(path).rows) == [1, 2]


def test_where_no_measurement_was_begun(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no journal to resume"):
        resume(tmp_path / "j", HEAD)


def test_a_plan_is_known_by_its_moves_and_settings() -> None:
    gauge, machine = small_gauge(), small_machine()
    one, two = small_program(gauge, machine, 1), small_program(gauge, machine, 2)
    assert fingerprint(one) == fingerprint(small_program(gauge, machine, 1))
    assert len({fingerprint(one), fingerprint(two), fingerprint(one, temperature=20.0)}) == 3
