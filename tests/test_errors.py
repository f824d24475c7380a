"""Errors as the technician reads them, wherever they were raised."""

from __future__ import annotations

import ast
import pickle
import re
from concurrent.futures import ProcessPoolExecutor
from inspect import signature
from pathlib import Path

import click
import pytest

import stepgauge
from stepgauge.cli import main, run_command
from stepgauge.errors import LONGEST, InputError, ProgramStoppedError, naming
from stepgauge.files.config import parse_toml
from stepgauge.files.text import read_json
from stepgauge.gauge.certified import read_gauge
from stepgauge.recording import read_recording
from stepgauge.verbs.catalogue import all_verbs


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


def test_arguments_in_python_are_options_at_the_command_line() -> None:
    """A message keeps what it names from one process to another, and when its place is told better."""
    expected = naming("tip_radius_mm", "machine", words="{}, {} or key tip_radius_mm; not {}")
    error = InputError(naming("home_mm"), naming("blocks", words="{} in {braces}"), found="{}", expected=expected)
    told = "home_mm: blocks in {braces}; found {}; expected tip_radius_mm, machine or key tip_radius_mm; not {}"
    typed = "--home: --blocks in {braces}; found {}; expected --tip-radius, --machine or key tip_radius_mm; not {}"
    for one in (error, pickle.loads(pickle.dumps(error))):
        assert str(one) == told
        assert one.cli_text() == typed
        assert one.at("a.csv").cli_text() == typed.replace("--home", "a.csv", 1)


def test_options_in_a_text_are_arguments_in_python() -> None:
    """One text: an option at the command line, an argument with its unit in Python; a command stays one."""
    assert signature(stepgauge.budget)  # the verbs whose arguments these are
    assert signature(stepgauge.simulate)
    assert signature(stepgauge.compensate_points)
    assert signature(stepgauge.import_recording)
    assert str(naming("accept", words="a number, or {} missing")) == 'a number, or accept="missing"'
    pair = naming("columns", words='or {} target="Soll x", if so')
    assert str(pair) == 'or columns={"target": "Soll x"}, if so'
    advice = "--u-gauge-temperature, or --method mean; 'stepgauge plan --order up-down' measures both ways"
    error = InputError("a.csv", "of whom? --gauge-temperature", expected=advice)
    said = 'u_gauge_temperature_K, or method="mean"; plan(.., order="up-down") measures both ways'
    assert error.expected == said
    assert str(error) == f"a.csv: of whom? gauge_temperature_C; expected {said}"
    assert error.cli_text() == f"a.csv: of whom? --gauge-temperature; expected {advice}"
    assert isinstance(InputError("a", "b", expected=naming("gauge")).expected, str)


def test_what_has_no_place_and_what_has_no_name(tmp_path: Path) -> None:
    assert str(InputError("", "this is another gauge", found=1)) == "this is another gauge; found 1"
    for read in (read_recording, read_gauge, read_json):
        with pytest.raises(InputError, match="this names no file; found an empty name; expected the name of a file"):
            read("")


def test_every_argument_that_a_message_names_is_one_of_a_verb() -> None:
    """By its name in Python, as an option of a text by one name; what Python calls writes no option into errors."""
    arguments = {one.name for _, verb in all_verbs() for one in verb.parameters}
    named = {name for path in SOURCES if "web" not in path.parts for name in _named(path)}  # a page has its own words
    assert len(named) > 30
    assert named - arguments == set()
    by_option: dict[str, set[str]] = {}
    for _, verb in all_verbs():
        for parameter in verb.parameters:
            by_option.setdefault(parameter.key, set()).add(parameter.name)
    ambiguous = {option for option, names in by_option.items() if len(names) > 1}
    for path in SOURCES:
        texts = [
            str(one.value) for one in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(one, ast.Constant)
        ]
        said = {option for text in texts for option in re.findall(r"(?<!\{p\} )[(;,] ?--([a-z-]+)|^--([a-z-]+) ", text)}
        assert {one for pair in said for one in pair} & ambiguous == set(), path
    for path in SOURCES:
        if path.relative_to(PACKAGE).parts[0] not in COMMAND_LINE_ONLY:
            assert [text for text in _raised(path) if re.search(r"(?<![\w-])--[a-z]", text)] == [], path


PACKAGE = Path(stepgauge.__file__).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))
COMMAND_LINE_ONLY = ("cli", "compensation", "dcc", "exporting", "history", "importing", "live", "standards")
"""Rooms whose functions only verbs call, but for `measure` and the budget, whose messages still name options."""


def _calls(path: Path, function: str) -> list[ast.Call]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [one for one in nodes if isinstance(one, ast.Call) and getattr(one.func, "id", "") == function]


def _named(path: Path) -> list[str]:
    """Literal arguments of ``naming``."""
    return [str(arg.value) for call in _calls(path, "naming") for arg in call.args if isinstance(arg, ast.Constant)]


def _raised(path: Path) -> list[str]:
    """Texts inside of errors."""
    inside = [node for call in _calls(path, "InputError") for node in ast.walk(call)]
    return [str(node.value) for node in inside if isinstance(node, ast.Constant)]


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


@pytest.mark.parametrize("text", ["[gauge]\nwidth_mm = 12,5\n", "[placement]\nc1_mm = [1,5 2,0 3,0]\n"])
def test_a_decimal_comma_in_a_file_of_settings_is_named(text: str) -> None:
    """They were told as an unclosed array, or a statement that goes on."""
    with pytest.raises(InputError, match=r"not valid TOML.*a decimal comma\?"):
        parse_toml(text, "a.toml")
