"""A recording of one axis as positioning by ISO 230-2: targets are target positions, cycles are runs.

Sign. The deviation of the standard is actual minus target position. An instrument beside the axis (laser, dial gauge)
reads the actual position. A probe that touches reads what the machine indicates, and the targets are the actual
positions: certified faces or gauge blocks.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pandas as pd

from stepgauge.axis.recording import AxisRecording, places_of, ways_doubt
from stepgauge.axis.sensors import SENSORS
from stepgauge.axis.units import BASE
from stepgauge.conditions import Conditions
from stepgauge.conditions.axis import setting_up_conditions, temperatures_of
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.standards.iso230 import AxisParameters, Direction, OneWay
from stepgauge.standards.iso230_decision import NO_REQUIREMENT, Requirement, parameters_um
from stepgauge.standards.iso230_rules import axis_rules
from stepgauge.standards.positioning import LINEAR, ROTARY, AxisTest, PositioningTest, TargetPositions
from stepgauge.standards.rules import Excluded

Actual = Literal["reading", "target"]
ACTUAL: tuple[Actual, ...] = ("reading", "target")
_NAMES = {1: "up", -1: "down"}
LEAST_EVALUATED = "2 targets in 2 runs at least, in every direction (ISO 230-2 asks 5 in 5)"
EACH_RUN = "ISO 230-2:2014 (each target in each run, in both directions)"


def actual_of(recording: AxisRecording) -> Actual:
    """What the actual position is where nobody states it: of a probe that touches the target, else the reading."""
    return "target" if SENSORS[recording.sensor].touches else "reading"


def axis_positioning_test(
    recording: AxisRecording, actual: Actual | None = None, requirement: Requirement = NO_REQUIREMENT
) -> PositioningTest:
    """Accuracy and repeatability of positioning from readings at the targets of a linear or rotary axis (ISO 230-2).

    Targets that were approached from one side give the parameters of that direction alone.

    Parameters
    ----------
    recording : every setting up (``placement``) is an axis of its own, every cycle a run
    actual : whether the ``"reading"`` or the ``"target"`` is the actual position; default: :func:`actual_of`
    requirement : tolerances of the parameters, and their expanded uncertainty

    Raises
    ------
    InputError
        a spot or distances, a target that was read twice in one run, fewer than two complete runs or targets, a
        tolerance of both directions where targets were approached from one side
    """
    if recording.form != "axis":
        raise InputError(recording.path, "no positioning of an axis", found=recording.form, expected="targets")
    known = actual or actual_of(recording)
    several = recording.frame["placement"].nunique() > 1
    axes = tuple(
        _axis_test(recording, rows, int(str(number)), known, several)
        for number, rows in recording.frame.groupby("placement")
    )
    for one in axes:
        _check_tolerances(requirement, one)
    conditions = sum((one.conditions for one in axes), Conditions())
    wanted = replace(
        requirement,
        unit=axes[0].units.deviation_symbol,
        decimals=axes[0].units.deviation_decimals,
        conditions=conditions.weighed(requirement.expanded_um),
    )
    return PositioningTest(None, None, None, axes, recording.path, recording.comments, wanted, _words(recording, known))


def _check_tolerances(requirement: Requirement, one: AxisTest) -> None:
    """Every parameter that has a tolerance must be known."""
    known = parameters_um(one.parameters)
    unknown = [name for name in requirement.tolerance_um if name not in known]
    if unknown:
        what = "this parameter needs approaches from both sides"
        raise InputError(naming("tolerances"), what, found=unknown[0], expected=", ".join(known))


def _words(recording: AxisRecording, actual: Actual) -> dict[str, str]:
    """What was read by what, and the sign."""
    difference = "reading minus target" if actual == "reading" else "target minus reading"
    return {
        "instrument": SENSORS[recording.sensor].words,
        "artefact": recording.comments.get("artefact", "none"),
        "actual": actual,
        "sign_convention": f"a deviation is the actual position minus the target position, here {difference}",
    }


def _axis_test(recording: AxisRecording, rows: pd.DataFrame, placement: int, actual: Actual, several: bool) -> AxisTest:
    table, target_mm = _table(recording, rows)
    complete, runs, excluded = _complete(table, target_mm, recording.path, _base(recording))
    sign = 1.0 if actual == "reading" else -1.0
    found = {
        _NAMES[way]: Direction(sign * table.xs(way, level="way").loc[complete, runs].to_numpy(float))
        for way in sorted(rows["way"].unique(), reverse=True)
    }
    at = target_mm[complete]
    name = recording.comments.get("axis", "axis")
    temperatures = temperatures_of(recording)
    rotary = recording.units.axis == "rotary"
    largest = max(float(np.abs(one.x_um).max()) for one in found.values())
    units = (ROTARY if rotary else LINEAR).fine_enough(float(np.ptp(at)), largest)
    return AxisTest(
        placement,
        name,
        name,
        0.0,
        False,
        TargetPositions(np.array(complete) + 1, at - at[0], at),
        tuple(runs),
        AxisParameters(**found) if len(found) > 1 else OneWay(*next(iter(found.items()))),
        None,
        None,
        axis_rules(at, len(runs), temperatures, rotary, list(found), ways_doubt(rows)),
        excluded,
        f"{name}, setting up {placement}" if several else name,
        units,
        setting_up_conditions(recording, rows),
    )


def _table(recording: AxisRecording, rows: pd.DataFrame) -> tuple[pd.DataFrame, Array]:
    """Reading minus target, um, by (place, way) and run; and the targets in mm, rising; of a turn arcsec and deg."""
    mm = recording.units.base_position
    target = rows["target"].to_numpy(float) * mm
    place = places_of(target)
    um = (rows["reading"].to_numpy(float) * mm - target) * BASE[recording.units.axis][1]
    frame = pd.DataFrame({"place": place, "way": rows["way"].to_numpy(), "run": rows["cycle"].to_numpy(), "um": um})
    double = frame.duplicated(["place", "way", "run"])
    if double.any():
        first = frame[double].iloc[0]
        found = f"target {target[int(double.to_numpy().argmax())]:g} {_base(recording)}, run {first['run']:g}"
        expected = "each target once in a run and direction: number the runs in a column cycle"
        raise InputError(recording.path, "a target was read twice", found=found, expected=expected)
    table = frame.pivot_table(index=["place", "way"], columns="run", values="um")
    return table, np.bincount(place, target) / np.bincount(place)


def _base(recording: AxisRecording) -> str:
    return "deg" if recording.units.axis == "rotary" else "mm"


def _complete_places(table: pd.DataFrame, runs: list[int]) -> list[int]:
    """Places with a reading in every direction and in every one of some runs."""
    full = table.index[table[runs].notna().all(axis=1)]
    ways = set(table.index.get_level_values("way"))
    return sorted(set.intersection(*({place for place, way in full if way == one} for one in ways)))


def _complete(
    table: pd.DataFrame, target_mm: Array, path: str, unit: str
) -> tuple[list[int], list[int], tuple[Excluded, ...]]:
    """Places with all directions in every run that is used, and these runs: what leaves the most readings.

    A missing reading costs its target or its run; runs with the most readings go before others.
    """
    counts = table.notna().sum().sort_values(ascending=False, kind="stable")
    every = [sorted(int(run) for run in counts.index[:number]) for number in range(len(counts), 0, -1)]
    kept = [(_complete_places(table, some), some) for some in every]
    complete, runs = max(kept, key=lambda one: (min(len(one[0]), len(one[1])) > 1, len(one[0]) * len(one[1])))
    if len(complete) < 2 or len(runs) < 2:
        found, expected = f"{len(complete)} targets, {len(runs)} runs", LEAST_EVALUATED
        raise InputError(path, "too few complete targets or runs", found=found, expected=expected)
    short = [str(run) for run in table.columns if int(run) not in runs]
    lone = [f"{target_mm[place]:g}" for place in range(len(target_mm)) if place not in complete]
    parts = [Excluded(f"runs {', '.join(short)}", "fewer readings than the other runs", EACH_RUN)] if short else []
    if lone:
        parts.append(Excluded(f"targets {', '.join(lone)} {unit}", "missing in a run or direction", EACH_RUN))
    return complete, runs, tuple(parts)
