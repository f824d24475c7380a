"""The journal of an investigation: what is done stays done, what is not whole is done again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from stepgauge.errors import InputError
from stepgauge.executors.journal import open_steps
from stepgauge.files.checksum import add_checksum


def sealed(line: dict[str, Any]) -> bytes:
    return json.dumps(add_checksum(line)).encode() + b"\n"


NAME = "investigation.journal"
HEAD = {"gauge": "T-1", "odds": 20.0}


def test_a_step_is_done_once(tmp_path: Path) -> None:
    made: list[int] = []
    steps = open_steps(tmp_path, HEAD, False)
    assert [steps.once("a", lambda: made.append(1) or {"x": [1.5, None]}) for _ in range(2)] == [{"x": [1.5, None]}] * 2
    steps.close()
    again = open_steps(tmp_path, HEAD, True)
    assert again.once("a", lambda: made.append(2)) == {"x": [1.5, None]}
    assert made == [1]
    again.close()


def test_a_line_that_was_cut_is_done_again(tmp_path: Path) -> None:
    steps = open_steps(tmp_path, HEAD, False)
    steps.once("a", lambda: 1)
    steps.once("b", lambda: 2)
    steps.close()
    whole = (tmp_path / NAME).read_bytes()
    for cut in range(len(whole)):
        (tmp_path / NAME).write_bytes(whole[:cut])
        again = open_steps(tmp_path, HEAD, True)
        lines = whole[:cut].count(b"\n")
        assert [again.once("a", lambda: 3), again.once("b", lambda: 4)] == [1 if lines > 1 else 3, 4]
        again.close()


def test_a_step_that_fails_is_not_done(tmp_path: Path) -> None:
    steps = open_steps(tmp_path, HEAD, False)
    with pytest.raises(ZeroDivisionError):
        steps.once("a", lambda: 1 // 0)
    assert steps.once("a", lambda: 1) == 1
    steps.close()


def test_what_is_not_this_investigation_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no journal to resume"):
        open_steps(tmp_path, HEAD, True)
    steps = open_steps(tmp_path, HEAD, False)
    with pytest.raises(InputError, match="resume to go on with it"):
        open_steps(tmp_path, HEAD, False)
    with pytest.raises(InputError, match="another process is writing"):
        open_steps(tmp_path, HEAD, True)
    steps.close()
    with pytest.raises(InputError, match=r"another odds; found 20\.0; expected 10\.0"):
        open_steps(tmp_path, {**HEAD, "odds": 10.0}, True)
    path = tmp_path / NAME
    for text, message in (
        (sealed({"step": "head", "value": {"format": "x"}}), "no journal of an investigation"),
        (path.read_bytes() + b"not json\n", "the journal is damaged"),
        (path.read_bytes() + b'{"step": "head", "value": 1}\n', "the journal is damaged"),
    ):
        path.write_bytes(text)
        with pytest.raises(InputError, match=message):
            open_steps(tmp_path, HEAD, True)
