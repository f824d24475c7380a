"""What stepgauge wrote and reads back: no flipped bit becomes a number, and a person may still change a text."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stepgauge.diagnosis.result import Diagnosis
from stepgauge.errors import InputError
from stepgauge.files.checksum import add_checksum, checksum, seal_text
from stepgauge.files.config import read_toml
from stepgauge.files.text import format_of, read_result, read_text, write_json, write_sealed
from stepgauge.gauge.placement import read_placement, write_placement
from tests.build import make_gauge, make_pose

GAUGE = make_gauge(4)
TEXT = '# A machine.\n[machine]\nname = "Bridge"\ntravel_mm = [0, 700]\n\n[[effect]]\nppm = 2.5  # found\n'


def unseen_changes(path: Path, read: Callable[[Path], Any]) -> tuple[int, list[str]]:
    """Bits of a file, one after the other, that were refused; and where what is read is not as it was."""
    whole, known, refused, silent = path.read_bytes(), read(path), 0, list[str]()
    for place in range(len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        path.write_bytes(bytes(damaged))
        try:
            if read(path) != known:
                silent.append(f"{place}: {bytes(damaged[place - 10 : place + 10])!r}")
        except InputError:
            refused += 1
    path.write_bytes(whole)
    return refused, silent


def test_a_text_that_stepgauge_wrote(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    write_sealed(path, TEXT)
    assert read_text(path) == TEXT
    refused, silent = unseen_changes(path, read_toml)
    assert not silent
    assert refused > len(TEXT)


def test_a_person_may_change_it_and_is_told_how(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    write_sealed(path, TEXT)
    path.write_text(path.read_text().replace("2.5", "3.5"))
    with pytest.raises(InputError, match=r"changed after stepgauge wrote it.*take the line '# checksum' away"):
        read_toml(path)
    path.write_text("".join(line for line in path.read_text().splitlines(True) if not line.startswith("# checksum")))
    assert read_toml(path)["effect"] == [{"ppm": 3.5}]


def test_other_ends_of_lines_are_no_change(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_bytes(b"\xef\xbb\xbf" + seal_text(TEXT).replace("\n", "\r\n").encode())
    assert read_text(path) == TEXT


@pytest.mark.parametrize("more", ["ppm = 9\n", "\n", "# a remark\n"])
def test_nothing_may_stand_below_the_checksum(tmp_path: Path, more: str) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(seal_text(TEXT) + more)
    with pytest.raises(InputError, match="changed after stepgauge wrote it"):
        read_toml(path)


def test_a_placement(tmp_path: Path) -> None:
    path = tmp_path / "placement.toml"
    write_placement(path, make_pose(0.2, 0.0).placement(GAUGE))
    refused, silent = unseen_changes(path, lambda one: repr(read_placement(one, GAUGE)))
    assert (refused > 100, silent) == (True, [])


def test_a_result_and_a_diagnosis(tmp_path: Path) -> None:
    said = {"verdict": "adequate", "effects": [{"value": 2.5}], "unexplained": None, "fit": {}, "inputs": {}}
    path = tmp_path / "diagnosis.json"
    write_json(path, {"format": format_of("diagnosis"), **said})
    for read in (lambda one: Diagnosis.read(one).contents, lambda one: read_result(one, "diagnosis")):
        refused, silent = unseen_changes(path, read)
        assert (refused > 100, silent) == (True, [])
    path.write_text(json.dumps({"format": format_of("diagnosis"), **said}))
    with pytest.raises(InputError, match="this diagnosis has no checksum; expected the file as stepgauge wrote it"):
        Diagnosis.read(path)
    path.write_text(json.dumps({"format": "stepgauge diagnosis 1", **said}))
    with pytest.raises(InputError, match="of another version of stepgauge; found stepgauge diagnosis 1; expected"):
        Diagnosis.read(path)


def test_a_checksum_counts_what_stands_before_it() -> None:
    line = {"point": 1, "x_mm": 2.0}
    assert checksum(line) == checksum(dict(reversed(line.items())))
    assert len({checksum(line), checksum(line, "a"), checksum({**line, "x_mm": 2.1})}) == 3
    assert add_checksum(add_checksum(line)) == add_checksum(line)
