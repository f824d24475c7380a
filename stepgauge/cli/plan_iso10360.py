"""``stepgauge plan --iso10360``: the seven positions of ISO 10360-2 as placements and programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import say
from stepgauge.cli.plan_choices import plan_options, probing_choice, stated_controls

if TYPE_CHECKING:
    from stepgauge.errors import InputError
    from stepgauge.machine.file import Machine
    from stepgauge.standards.iso10360_plan import PlannedPosition


def plan_seven(
    source: str | None, gauge: str, output: str, dialect: str, template: str | None, options: dict[str, Any]
) -> None:
    """Plan, check and write the seven positions into a folder."""
    from stepgauge.files.text import check_folder
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.machine.file import read_machine
    from stepgauge.planning.program import check_tool, make_settings
    from stepgauge.standards.iso10360_plan import plan_positions
    from stepgauge.standards.iso10360_plan_files import write_plan

    _check_options(source, options)
    check_folder(output)
    steps, machine = read_gauge(gauge), read_machine(options["machine"])
    settings = make_settings(steps, machine, machine.probe.tip_radius_mm, probing_choice(options))
    check_tool(options["tool"], dialect)
    positions = [
        _named(one, options["tool"])
        for one in plan_positions(steps, machine, plan_options(options, steps), settings, options["stylus"])
    ]
    for one in positions:
        say(f"position {one.orientation.number}, {one.orientation.name}: {_told(one, machine)}")
    problems = [one for one in positions if one.problem]
    if problems and not options["allow_short"]:
        raise _too_short(problems, machine)
    notes = write_plan(output, positions, machine, dialect, template, stated_controls(options))
    _tell(positions, machine, notes)
    say(f"wrote {output}: placements, programs, machine files with the stylus as planned, plan.json")


def _too_short(problems: Sequence[PlannedPosition], machine: Machine) -> InputError:
    """The error that names the positions along which the gauge is too short, or does not fit."""
    from stepgauge.errors import InputError
    from stepgauge.files.notation import in_percent
    from stepgauge.standards.measuring_line import LONGEST_SHARE

    return InputError(
        machine.path,
        "ISO 10360-2 asks for more than this gauge gives in this machine"
        f" (positions {', '.join(str(one.orientation.number) for one in problems)}; nothing was written,"
        " --allow-short writes what can be measured)",
        found=f"position {problems[0].orientation.number}: {problems[0].problem}",
        expected=f"lengths of {in_percent(LONGEST_SHARE)} of the travel along each line",
    )


def _named(one: PlannedPosition, tool: str) -> PlannedPosition:
    """The position with a program that says which tool it takes, and which way its stylus stands."""
    from dataclasses import replace

    if one.program is None or one.probe is None:
        return one
    return replace(one, program=replace(one.program, tool=tool, stylus=one.probe.stylus_direction))


def _check_options(source: str | None, options: dict[str, Any]) -> None:
    if source is not None:
        raise click.UsageError("--iso10360 makes the placements itself: leave PLACEMENT|POINTS out.")
    if not options["machine"]:
        raise click.UsageError("--iso10360 needs --machine: the positions follow from its travel.")
    for name in ("blocks", "points_on", "home", "tip_radius", "unchecked"):
        if options[name]:
            raise click.UsageError(f"--{name.replace('_', '-')} has no place with --iso10360.")


def _told(one: PlannedPosition, machine: Machine) -> str:
    from stepgauge.files.notation import in_percent

    if one.program is None or one.probe is None:
        return str(one.problem)
    blocks = ", ".join(map(str, one.blocks))
    told = f"blocks {blocks}; longest {one.longest_mm:.1f} mm, {in_percent(one.share)} of the travel"
    if one.turned(machine):
        told += "; stylus square to the gauge, (" + ", ".join(f"{v:.4f}" for v in one.probe.stylus_direction) + ")"
    return f"{told}; {one.problem}" if one.problem else told


def _tell(positions: list[PlannedPosition], machine: Machine, notes: list[str]) -> None:
    turned = [one for one in positions if one.turned(machine)]
    if turned:
        off_mm = max(one.tip_off_ram_mm() for one in turned)
        say(
            "ISO 10360-2 tests E0 with the stylus tip on the axis of the ram. Where the stylus is turned it lies off"
            f" it, here by up to {off_mm:.0f} mm with stylus and probe body: agree on it, or test with a stylus that is"
            " thin enough to stay upright (--stylus machine)"
        )
    for note in notes:
        say(note)
    say(
        f"path of {sum(one.program is not None for one in positions)} programs checked: gauge, rail, travel of the tip"
        " centre. Locate the gauge as it really lies, and plan it again with --blocks as above: a program moves to"
        " where its placement says"
    )
