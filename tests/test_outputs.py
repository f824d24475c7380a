"""Files of a verb are one set; results know what they were made from; a disk that is full is said."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from stepgauge.cli.say import say, show
from stepgauge.errors import InputError, PartlyDoneError
from stepgauge.files import outputs
from stepgauge.files.outputs import READY, UNFINISHED
from stepgauge.files.text import one_set, read_json, read_result, read_text, replacing, write_json, write_text
from tests.conftest import ROOT


def test_files_of_a_set_appear_together_or_not_at_all(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "old")

    def fail() -> None:
        with one_set():
            write_text(tmp_path / "a.txt", "new")
            write_text(tmp_path / "deep/er/b.txt", "new")
            assert read_text(tmp_path / "a.txt") == "new", "a verb may read what it has written"
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"
    with one_set():
        write_text(tmp_path / "a.txt", "new")
        write_text(tmp_path / "deep/er/b.txt", "new")
        assert (tmp_path / "a.txt").read_text() == "old"
    assert sorted(path.name for path in tmp_path.rglob("*.*")) == ["a.txt", "b.txt"]
    assert (tmp_path / "a.txt").read_text() == "new"


def test_what_was_done_before_a_stop_is_kept(tmp_path: Path) -> None:
    def stop() -> None:
        with one_set():
            write_text(tmp_path / "a.txt", "until then")
            raise PartlyDoneError("p.dmi:7", "stopped")

    with pytest.raises(PartlyDoneError):
        stop()
    assert (tmp_path / "a.txt").read_text() == "until then"


def test_files_of_an_earlier_call_are_gone_and_those_of_people_are_not(tmp_path: Path) -> None:
    for name in ("evaluation-placement-2.png", "evaluation.png", "evaluation-mine.png", "notes.txt", "budget-1.png"):
        (tmp_path / name).write_text("old")
    with one_set():
        write_json(tmp_path / "evaluation.json", {"format": "stepgauge evaluation 1"})
        write_text(tmp_path / "evaluation.svg", "new")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"evaluation.json", "evaluation.svg", "evaluation-mine.png", "notes.txt", "budget-1.png"}


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/r.csv").write_text("old")
    (tmp_path / "link.csv").symlink_to(tmp_path / "elsewhere/r.csv")
    write_text(tmp_path / "link.csv", "new")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "elsewhere/r.csv").read_text() == "new"


def test_what_a_killed_run_left_is_cleared_or_finished(tmp_path: Path) -> None:
    """Process 4194304 and above cannot be: the largest number is one less."""
    for process, whole in (("4194304", False), ("4194305", True)):
        left = tmp_path / UNFINISHED / process
        left.mkdir(parents=True)
        (left / f"{process}.txt").write_text("left")
        if whole:
            (left / READY).touch()
    write_text(tmp_path / "a.txt", "next run")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["4194305.txt", "a.txt"]


def test_what_another_run_is_writing_now_is_left_alone(tmp_path: Path) -> None:
    other = tmp_path / UNFINISHED / str(os.getppid())
    other.mkdir(parents=True)
    (other / "half.csv").write_text("x_mm")
    write_text(tmp_path / "a.txt", "mine")
    assert (other / "half.csv").exists()


def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("old")
    with (
        pytest.raises(InputError, match=rf"r\.csv: cannot be written: {os.strerror(errno.ENOSPC)}"),
        replacing(tmp_path / "r.csv"),
    ):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert [path.name for path in tmp_path.iterdir()] == ["r.csv"]
    assert (tmp_path / "r.csv").read_text() == "old"


def test_a_file_in_place_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("point")
    with pytest.raises(InputError, match=r"cannot write here; found the file .*points\.csv; expected a folder"):
        write_text(tmp_path / "points.csv" / "evaluation.json", "{}")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no device that is full")
def test_a_full_device_names_itself() -> None:
    with pytest.raises(InputError, match="/dev/full: cannot be written: No space left on device"):
        write_text("/dev/full", "text")


def test_a_device_is_written_to_as_it_is() -> None:
    write_text("/dev/null", "gone")
    assert not Path("/dev/null").is_file()


def test_a_result_says_what_it_was_made_from(tmp_path: Path) -> None:
    write_text(tmp_path / "in/points.csv", "1,2,3\n")
    with one_set():
        read_text(tmp_path / "in/points.csv")
        write_json(tmp_path / "out/evaluation.json", {"format": "stepgauge evaluation 1", "value": 0.1})
    data = read_result(tmp_path / "out/evaluation.json", "evaluation")
    assert [one["file"] for one in data["inputs"]] == ["../in/points.csv"]
    write_text(tmp_path / "in/points.csv", "1,2,4\n")
    with pytest.raises(InputError, match=r"\.\./in/points\.csv has changed since this was made from it"):
        read_result(tmp_path / "out/evaluation.json", "evaluation")
    assert read_result(tmp_path / "out/evaluation.json", "evaluation", with_inputs=False)["value"] == 0.1


@pytest.mark.parametrize("layout", [None, 4])
def test_a_result_that_was_changed_is_refused_whatever_its_layout(tmp_path: Path, layout: int | None) -> None:
    path = tmp_path / "evaluation.json"
    write_json(path, {"format": "stepgauge evaluation 1", "position_mm": 410.0003, "name": "Lehre Größe 1"})
    data = json.loads(path.read_text())
    path.write_text(json.dumps(dict(reversed(data.items())), indent=layout))
    assert read_result(path, "evaluation")["position_mm"] == 410.0003
    path.write_text(json.dumps({**data, "position_mm": 0}, indent=layout))
    with pytest.raises(InputError, match="this evaluation was changed after it was written"):
        read_result(path, "evaluation")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"a": 1, "a": 2}', "key 'a' is there twice"),
        ('{"a": NaN}', "a number is not finite, or too large; found NaN"),
        ('{"a": 1e999}', "a number is not finite, or too large; found 1e999"),
        (f'{{"a": {10**400}}}', "a number is not finite, or too large; found 1000"),
        ('{"expansion_uncertainty_per_K": 1e308}', "too large; found 1e308"),
        ('{"a": ' + "9" * 5000 + "}", "a number is not finite, or too large; found 9999"),
        ("[" * 100_000, "not a JSON file: nested too deeply"),
    ],
)
def test_json_that_is_no_result_of_ours(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(InputError) as error:
        read_json(tmp_path / "x.json")
    assert words in str(error.value)


def test_no_set_is_open_after_all_this() -> None:
    assert outputs._current() is None


def test_what_is_said_of_files_is_said_when_they_are_in_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there: list[tuple[str, bool]] = []
    monkeypatch.setattr("click.echo", lambda text, err=False: there.append((text, (tmp_path / "a.txt").is_file())))
    with one_set():
        say("begun")
        write_text(tmp_path / "a.txt", "new")
        show("a table")
        say("wrote a.txt")

    def fail() -> None:
        with one_set():
            write_text(tmp_path / "b.txt", "new")
            say("wrote b.txt")
            raise InputError("b.txt", "wrong after all")

    with pytest.raises(InputError):
        fail()
    assert there == [("begun", False), ("a table", True), ("wrote a.txt", True)]


@pytest.mark.parametrize(
    "verb",
    [["list", "effects"], ["probe", "map", "omp40-2-50mm", "--polar", "90", "--azimuth", "0:360:90", "-o", "map.csv"]],
)
def test_a_reader_that_leaves_ends_no_verb_before_its_files(tmp_path: Path, verb: list[str]) -> None:
    """As ``| head -0``: the pipe is closed before anything is written to it."""
    near, far = os.pipe()
    os.close(near)
    command = [sys.executable, "-m", "stepgauge", *verb]
    code = subprocess.run(command, stdout=far, stderr=far, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)})
    os.close(far)
    assert code.returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == verb[-1:] * (verb[0] == "probe")


def test_a_set_replaces_nothing_that_it_has_read_but_what_it_wrote_itself(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("given")

    def write(text: str) -> None:
        with one_set():
            assert read_text(tmp_path / "a.txt") == "given"
            with one_set():
                write_text(tmp_path / "a.txt", text)

    with pytest.raises(InputError, match=r"a\.txt: this output would replace what the command reads"):
        write("new")
    assert (tmp_path / "a.txt").read_text() == "given"
    with one_set():
        write_text(tmp_path / "b.txt", "once")
        assert read_text(tmp_path / "b.txt") == "once"
        write_text(tmp_path / "b.txt", "twice")
    assert (tmp_path / "b.txt").read_text() == "twice"
