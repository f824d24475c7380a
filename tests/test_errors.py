"""Errors as the technician reads them, wherever they were raised."""

from __future__ import annotations

import pickle
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import click
import pytest

from stepgauge.cli import main, run_command
from stepgauge.errors import LONGEST, InputError, ProgramStoppedError


def refuse() -> None:
    raise ProgramStoppedError("points.csv:7", "the tip is in the steel", found="-0.2 mm", expected="a clear path")


@pytest.mark.parametrize("kind", [InputError, ProgramStoppedError])
def test_an_error_stays_what_it_was_from_one_process_to_another(kind: type[InputError]) -> None:
    error = kind("points.csv:7", "no number", found="abc", expected="mm")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error) == "points.csv:7: no number; found abc; expected mm"
    assert (again.where, again.what, again.found, again.expected) == ("points.csv:7", "no number", "abc", "mm")


def test_an_error_of_a_worker_reaches_the_process_that_asked() -> None:
    with ProcessPoolExecutor(1) as pool, pytest.raises(ProgramStoppedError, match=r"found -0\.2 mm; expected a clear"):
        pool.submit(refuse).result()


@pytest.mark.parametrize("text", ["x" * 5000, "\x1b[2J" * 500, "a\tb" * 900, "é\u202e" * 700])
@pytest.mark.parametrize("place", ["cell", "option", "verb", "path"])
def test_a_long_value_does_not_fill_the_screen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], place: str, text: str
) -> None:
    """In a file, in an option, in place of a verb, as a name of a file: one line beside the name of the program."""
    points = tmp_path / "points.csv"
    points.write_text(f"point,x_mm,y_mm,z_mm\n1,{text if place == 'cell' else 0},0,0\n")
    words = ["locate", str(points), "-g", "step-gauge-420", "-o", str(tmp_path / "placement.toml")]
    others = {"option": [*words, "--tip-radius", text], "verb": [text], "path": ["locate", text, *words[2:]]}
    with pytest.raises(SystemExit) as stop:
        main(others.get(place, words))
    assert stop.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("stepgauge: error: ")
    assert len(line) <= LONGEST + len("stepgauge: error: ")
    assert line.isprintable()


@pytest.mark.parametrize("hidden", [False, True])
def test_an_interruption_is_one_line_also_in_the_middle_of_an_import(
    capsys: pytest.CaptureFixture[str], hidden: bool
) -> None:
    """Extensions that are loading turn Ctrl-C into an error of their own."""

    @click.command()
    def command() -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            if hidden:
                raise ImportError("numpy: initialization failed")  # noqa: B904 as the extensions do
            raise

    with pytest.raises(SystemExit) as stop:
        run_command(command, "stepgauge", [])
    assert stop.value.code == 130
    assert capsys.readouterr().err.strip() == "stepgauge: error: interrupted"
