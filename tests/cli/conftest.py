"""The command line as a user runs it, and a folder with the files of a small measurement."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from click.testing import Result as Done

from stepgauge.cli import main
from stepgauge.cli.build import make_command
from stepgauge.errors import InputError, for_command
from stepgauge.verbs.catalogue import find_verb
from tests.conftest import ROOT


@dataclass(frozen=True)
class Result:
    """What a command left: exit code and what it said."""

    code: int
    out: str
    err: str


Run = Callable[..., Result]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command line in this process."""

    def call(*arguments: object) -> Result:
        try:
            main([str(argument) for argument in arguments])
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
        captured = capsys.readouterr()
        err = re.sub(r"^searching; up to now: .*\n", "", captured.err, flags=re.M)  # on a slow machine
        return Result(code, captured.out, err)

    return call


def again(run: Run, files: Path) -> Path:
    """The program of ``files`` run once more: the same placing of the gauge, other readings."""
    path = files / "again.csv"
    common = ("-g", "step-gauge-420", "-m", files / "machine.toml", "-p", files / "placement.toml")
    result = run("simulate", files / "program.dmi", *common, "--seed", 5, "-o", path)
    assert result.code == 0, result.err
    return path


@pytest.fixture
def files(tmp_path: Path, made_files: Path) -> Path:
    """A folder with points, machine, placement, program and recording of the demo's gauge, blocks 1 to 4."""
    shutil.copytree(made_files, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture(scope="session")
def made_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, made once."""
    tmp_path = tmp_path_factory.mktemp("files")
    for name in ("points.csv", "machine.toml"):
        (tmp_path / name).write_text((ROOT / "examples/demo" / name).read_text())
    (tmp_path / "narrow.toml").write_text(
        (tmp_path / "machine.toml").read_text().replace("x = [0, 700]", "x = [0, 340]")
    )
    points = (tmp_path / "points.csv").read_text()
    (tmp_path / "slip.csv").write_text(points.replace("345.5350,311.0655", "345.5350,302.0655"))
    common = ("-g", "step-gauge-420", "-m", tmp_path / "machine.toml")
    placement, program = tmp_path / "placement.toml", tmp_path / "program.dmi"
    for line in (
        ("locate", tmp_path / "points.csv", *common, "-o", placement),
        ("plan", placement, *common, "-d", "dmis", "--blocks", "1:4", "--cycles", 2, "-o", program),
        ("simulate", program, *common, "-p", placement, "-o", tmp_path / "recording.csv"),
    ):
        main([str(word) for word in line])
    return tmp_path


def command_of(words: str) -> click.Command:
    """The command of a verb from its definition."""
    return make_command(words.rpartition(" ")[2], find_verb(words))


def invoke(words: str, *arguments: object) -> Done:
    """A verb by click's own runner; wrong input ends with exit code 2, as it does for a user."""
    done = CliRunner().invoke(command_of(words), [str(one) for one in arguments])
    if isinstance(done.exception, InputError):
        with for_command():
            done.exit_code, done.exception = 2, InputError("", done.exception.cli_text())
    return done
