"""The plan of the seven positions as JSON, and a machine file for each way that the stylus points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.files.text import write_json, write_sealed
from stepgauge.gauge.placement import format_placement
from stepgauge.machine.file import Machine
from stepgauge.planning.program import program_text
from stepgauge.probes.schema import ProbeTable
from stepgauge.standards.iso10360_plan import PlannedPosition
from stepgauge.standards.measuring_line import POSITIONS_SOURCE


def write_plan(
    folder: str | Path,
    positions: list[PlannedPosition],
    machine: Machine,
    dialect: str,
    template: str | Path | None = None,
    options: Mapping[str, str] | None = None,
) -> list[str]:
    """Write placement, program and machine file of every planned position and ``plan.json``; returns notes.

    All programs are rendered and read back before the first file is written.
    """
    rendered = {
        one.orientation.number: program_text(one.program, dialect, template, options=options)
        for one in positions
        if one.program
    }
    for one in positions:
        if one.orientation.number not in rendered or one.placement is None or one.probe is None:
            continue
        text, name = rendered[one.orientation.number], Path(folder) / f"position-{one.orientation.number}"
        write_sealed(f"{name}.toml", placement_text(one))
        text.write(f"{name}{text.dialect.suffix}")
        write_sealed(f"{name}-machine.toml", machine_with_probe(machine, one.probe))
    write_json(Path(folder) / "plan.json", plan_to_dict(positions, machine))
    return list(dict.fromkeys(text.note for text in rendered.values()))


def plan_to_dict(positions: list[PlannedPosition], machine: Machine) -> dict[str, Any]:
    """The plan as JSON types."""
    return {
        "format": "stepgauge iso10360 plan 1",
        "stepgauge": __version__,
        "source": POSITIONS_SOURCE,
        "machine": machine.table.name,
        "positions": [_position(one) for one in positions],
    }


def _position(one: PlannedPosition) -> dict[str, Any]:
    planned = one.placement is not None and one.probe is not None
    return {
        "position": one.orientation.number,
        "orientation": one.orientation.name,
        "line_mm": one.line_mm,
        "longest_mm": one.longest_mm if planned else None,
        "share": one.share if planned else None,
        "blocks": list(one.blocks),
        "stylus_direction": list(one.probe.stylus_direction) if one.probe else None,
        "stylus_from_vertical_deg": _tilt_deg(one.probe) if one.probe else None,
        "tip_off_ram_mm": one.tip_off_ram_mm() if one.probe else None,
        "problem": one.problem,
    }


def _tilt_deg(probe: ProbeTable) -> float:
    """Angle between the stylus and a vertical ram."""
    return float(np.degrees(np.arccos(np.clip(-probe.stylus_direction[2], -1.0, 1.0))))


def placement_text(one: PlannedPosition) -> str:
    """The placement file of a planned position; ValueError for one that could not be planned."""
    if one.placement is None:
        raise ValueError(f"position {one.orientation.number} has no placement: {one.problem}")
    body = format_placement(one.placement).split("\n", 1)[1]
    number, name = one.orientation.number, one.orientation.name
    return f"# Where the gauge is meant to lie: position {number} of ISO 10360-2, {name}. Lengths mm.\n{body}"


def machine_with_probe(machine: Machine, probe: ProbeTable) -> str:
    """The text of the machine file with the stylus turned as in ``probe``; files that it names are named in full."""
    import tomli_w

    data = replace(machine, probe=probe).to_dict()
    return f"# {machine.table.name}, with the stylus as planned by stepgauge test plan.\n" + tomli_w.dumps(data)
