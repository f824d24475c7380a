"""Further styli of a machine, each described by a machine file that differs from its own in the stylus only."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.files.numerals import number
from stepgauge.machine.file import TIP_TOLERANCE_MM, Machine
from stepgauge.recording import Recording
from stepgauge.recording.columns import STYLUS
from stepgauge.recording.identity import radius_comment

OF_THE_STYLUS = ("travel_mm", "chain.head_mm", "chain.stylus_mm")
"""Keys of ``[machine]`` that may differ: where the tip is, and so the limits of the tip."""


def add_styli(machine: Machine, others: Iterable[Machine]) -> Machine:
    """The machine with further styli, numbered from 2 in their order; its own is stylus 1.

    :class:`InputError` where a file is of another machine, or describes a stylus that is there already.
    """
    told = [machine]
    for other in others:
        _check_same_machine(machine, other)
        for one in told:
            if other.probe == one.probe and other.table == one.table:
                found, expected = "the same probe and tip", "another [probe] or chain.stylus_mm"
                raise InputError(other.path, f"no other stylus than that of {one.path}", found=found, expected=expected)
        told.append(other)
    return replace(machine, styli=tuple(told[1:])) if len(told) > 1 else machine


def stylus_name(machine: Machine) -> str:
    """What the stylus of a machine file is called: its ``tool`` or its ``name``, else nothing."""
    return machine.probe.tool or machine.probe.name


def stylus_comment(machine: Machine) -> dict[str, str]:
    """The comment of a recording that says which stylus it was made with, where that has a name."""
    return {STYLUS: name} if (name := stylus_name(machine)) else {}


def assign_stylus(recording: Recording, stylus: int, machine: Machine) -> Recording:
    """The recording with the number of its stylus, and in the comments which that is; nothing more if there is one."""
    if not machine.styli:
        return recording
    comments = {key: value for key, value in recording.comments.items() if key not in ("tip_radius_mm", STYLUS)}
    comments[radius_comment(stylus)] = f"{machine.select_stylus(stylus).probe.tip_radius_mm:g}"
    comments[f"{STYLUS}_{stylus}"] = stylus_words(machine, stylus)
    return replace(recording, frame=recording.frame.assign(**{STYLUS: stylus}), comments=comments)


def numbered(recording: Recording, machine: Machine) -> Recording:
    """The recording with the number of its stylus, by its comment ``stylus`` where it has no such column.

    :class:`InputError` where it names none of the machine's styli, where another tip than that of stylus 1 is all that
    it says, or where it states another tip radius than the machine file of its stylus.
    """
    if not machine.styli or STYLUS in recording.frame:
        _check_tips(recording, machine)
        return recording
    if STYLUS not in recording.comments and not _is_of_another_tip(recording, machine, 1):
        return assign_stylus(recording, 1, machine)
    names = [stylus_name(one) for one in (machine, *machine.styli)]
    name = recording.comments.get(STYLUS, "")
    if not name or names.count(name) != 1:
        found = name or f"tip_radius_mm {recording.comments['tip_radius_mm']}"
        known = ", ".join(filter(None, names)) or "their names"
        expected = f"a column {STYLUS}, or a comment '# {STYLUS}: ' with one of {known}"
        raise InputError(recording.path, "it is not told which stylus this was", found=found, expected=expected)
    return assign_stylus(recording, names.index(name) + 1, machine)


def _check_tips(recording: Recording, machine: Machine) -> None:
    """Another tip than that of the file would be found as an effective radius or a reversal error of millimetres."""
    used = set(recording.columns.get(STYLUS, [1]))
    for stylus, own in enumerate((machine, *machine.styli), 1):
        if stylus in used and _is_of_another_tip(recording, machine, stylus):
            key = radius_comment(stylus)
            raise InputError(
                recording.path,
                f"the recording was made with another tip than that of {own.path}",
                found=f"# {key}: {recording.comments[key]}",
                expected=naming(
                    "machine",
                    "further_styli",
                    words=f"{own.probe.tip_radius_mm:g}, or the file of this tip by {{}} or {{}}",
                ),
            )


def _is_of_another_tip(recording: Recording, machine: Machine, stylus: int) -> bool:
    """By its comment; one that was recorded with the effective radius is smaller by the pre-travel."""
    stated_mm = number(recording.comments.get(radius_comment(stylus), ""))
    return abs(stated_mm - machine.select_stylus(stylus).probe.tip_radius_mm) > TIP_TOLERANCE_MM


def stylus_words(machine: Machine, number: int) -> str:
    """A stylus in words: ``stylus 2 (long, tip radius 2 mm, 200 mm long)``."""
    own = machine.select_stylus(number)
    name = stylus_name(own) or Path(own.path).stem
    told = [name] if name else []
    told += [f"tip radius {own.probe.tip_radius_mm:g} mm", f"{own.probe.shank_length_mm:g} mm long"]
    return f"stylus {number} ({', '.join(told)})"


def _check_same_machine(machine: Machine, other: Machine) -> None:
    """All but the stylus is the same: the table of the machine, and what it is known to do wrong."""
    own, found = _flat(machine.table.model_dump()), _flat(other.table.model_dump())
    for key in (key for key in {**own, **found} if not key.startswith(OF_THE_STYLUS)):
        if own.get(key) != found.get(key):
            what = f"a further stylus is of the same machine, but [machine] {key} differs"
            raise InputError(other.path, what, found=found.get(key), expected=f"{own.get(key)}, as in {machine.path}")
    if machine.effects != other.effects:
        kinds = ", ".join(str(one.get("kind")) for one in other.effects) or "none"
        what = "a further stylus is of the same machine, but its effects differ"
        raise InputError(other.path, what, found=kinds, expected=f"the [[effect]] tables of {machine.path}")


def _flat(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Values by their keys, ``chain.stylus_mm``."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        flat |= _flat(value, f"{before}{key}.") if isinstance(value, Mapping) else {before + key: value}
    return flat
