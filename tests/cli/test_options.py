"""What holds for the options of all verbs together: one meaning for a name, and a help that teaches."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from stepgauge.cli import TASKS, cli
from stepgauge.cli.build import VerbOption
from stepgauge.machine import file as machine_file
from stepgauge.verbs.evaluate import FIGURES
from stepgauge.verbs.shared import DIALECT, DIALECTS, LARGEST_U_K
from tests.cli.conftest import Run


def verbs(group: click.Group, before: str = "") -> Iterator[tuple[str, click.Command]]:
    context = click.Context(group, info_name=before.strip() or None, parent=click.Context(cli) if before else None)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from verbs(command, f"{name} ")
        else:
            yield f"{before}{name}", command


OPTIONS = [
    (verb, option) for verb, command in verbs(cli) for option in command.params if isinstance(option, click.Option)
]


@pytest.mark.parametrize(("verb", "option"), OPTIONS, ids=[f"{verb} {option.opts[0]}" for verb, option in OPTIONS])
def test_every_option_says_what_it_is_and_what_holds_without_it(verb: str, option: click.Option) -> None:
    assert option.help
    if isinstance(option, VerbOption):
        return  # tests/test_verbs.py
    number = isinstance(option.type, click.FloatRange | click.IntRange)
    known = (
        option.required or option.show_default or "default" in option.help.lower() or "without" in option.help.lower()
    )
    if number and option.metavar in ("MM", "UM", "K", "C", "DEG", "MRAD", "S"):
        unit = {"DEG": "deg", "C": "deg C", "S": "s"}.get(option.metavar, option.metavar)
        # k is a factor without a unit; K also abbreviates kelvin
        assert option.name == "coverage_factor" or unit.lower() in option.help.lower(), option.help
    limits = {"mpe_repeatability", "u_tip_diameter", "tip_diameter"}  # nothing holds without them
    if number and option.name not in limits | {"block_width_mm", "block_height_mm", "placement_number"}:
        assert known or verb == "dcc import-gauge", option.help


def test_a_name_means_the_same_everywhere() -> None:
    """The same long name takes the same kind of thing, and the same short name belongs to one long name."""
    kinds: dict[str, set[tuple[str, bool]]] = {}
    short: dict[str, set[str]] = {}
    for _, option in OPTIONS:
        if not isinstance(option, VerbOption):
            continue
        long = next(name for name in option.opts if name.startswith("--"))
        kinds.setdefault(long, set()).add((option.type.name, option.is_flag))
        for name in option.opts:
            if not name.startswith("--"):
                short.setdefault(name, set()).add(long)
    assert {name: found for name, found in kinds.items() if len(found) > 1} == {}
    assert {name: found for name, found in short.items() if len(found) > 1} == {}


def test_what_is_written_out_for_a_quick_help_is_what_there_is() -> None:
    from stepgauge.figures.measurement import KINDS as DRAWN
    from stepgauge.programs import DIALECTS as READ

    assert tuple(READ) == DIALECTS
    assert tuple(DRAWN) == FIGURES


def test_the_help_lists_the_verbs_by_task(run: Run) -> None:
    text = run("--help").out
    places = [text.index(f"{heading}:") for heading in TASKS]
    assert places == sorted(places)
    for (heading, own), start, end in zip(TASKS.items(), places, [*places[1:], len(text)], strict=True):
        assert all(f"\n  {verb} " in text[start:end] for verb in own), heading


def test_the_uncertainty_of_a_temperature_has_one_bound(run: Run, files: Path) -> None:
    """On the command line of every verb that takes it, and in the machine file."""
    assert LARGEST_U_K == machine_file.LARGEST_U_K
    g, recording = ("-g", "step-gauge-420"), files / "recording.csv"
    out, machine = ("-o", files / "out"), files / "machine.toml"
    for words in (
        ("test", "iso10360", recording, *g, "--mpe", "1.8 + L/350", *out),
        ("budget", recording, *g, "-m", machine, *out),
        ("budget", recording, *g, "-m", machine, "--method", "monte-carlo", *out),
    ):
        result = run(*words, "--u-gauge-temperature", 50)
        assert result.code == 2
        assert "50" in result.err
        assert "5" in result.err.partition("50")[2]
    stated = files / "stated.toml"
    for value in ("50", "{ u = 50.0, dof = 8 }"):
        stated.write_text(machine.read_text() + f"\n[uncertainty]\ngauge_temperature_K = {value}\n")
        result = run("budget", recording, *g, "-m", stated, *out)
        assert result.code == 2
        assert "key uncertainty.gauge_temperature_K is wrong" in result.err
        assert "at most 5" in result.err
    assert not (files / "out").exists()


@pytest.mark.parametrize("name", ["grbl", "grblHAL", "FluidNC", "GRBLHAL"])
def test_a_controller_is_known_by_the_names_that_people_call_it(name: str, run: Run) -> None:
    assert run("list", "dialects", name).out == run("list", "dialects", "grbl").out
    assert DIALECT.read("dialect", name) == DIALECT.taken("dialect", name) == "grbl"


def test_an_unknown_controller_is_answered_with_the_nearest_and_all(run: Run) -> None:
    every = ", ".join(DIALECTS)
    assert run("list", "dialects", "grlb").err.endswith(f"not a dialect; found 'grlb'; expected grbl? All: {every}\n")
    error = run("plan", "p.toml", "-g", "step-gauge-420", "-d", "TNC 64", "-o", "a.h").err
    assert error.endswith(f"--dialect: not a choice; found 'TNC 64'; expected heidenhain? All: {every}\n")
    assert run("list", "dialects", "xyzzy").err.endswith(f"expected {every}\n")
