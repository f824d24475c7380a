"""Readings of an instrument at the targets of an axis as its errors: of a recording, or of a test by ISO 230-2.

The axis indicates its targets and the instrument reads where it is; of a probe that touches it is the other way round,
as :mod:`stepgauge.standards.positioning_axis` has it. The error is indicated minus actual position.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from stepgauge.axis.recording import AxisRecording, places_of
from stepgauge.axis.sensors import SENSORS
from stepgauge.compensation.readings import AxisReadings, check_placement
from stepgauge.conditions import Conditions, require_statement
from stepgauge.conditions.axis import setting_up_conditions
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.recording.conventions import instrument_words
from stepgauge.recording.simulated import SIMULATED_WARNING, is_simulated
from stepgauge.standards.positioning import AxisTest, PositioningTest
from stepgauge.standards.positioning_axis import Actual, actual_of

_SENSES = {"up": 1, "down": -1}


def recorded_readings(
    recording: AxisRecording,
    axis: str,
    actual: Actual | None = None,
    placement: int | None = None,
    offset_mm: float = 0.0,
    u_length_um_per_m: float = 0.0,
) -> AxisReadings:
    """Mean errors of an axis at the targets of a recording, by sense of travel; a single run is enough.

    Parameters
    ----------
    recording : one of an axis, by any instrument
    axis : x, y or z
    actual : whether the ``"reading"`` or the ``"target"`` is the actual position; default: :func:`.actual_of`
    placement : number of the setting up; default: the only one
    offset_mm : machine coordinate minus target
    u_length_um_per_m : standard uncertainty of the instrument's length, with that of the expansion it corrects for

    Raises
    ------
    InputError
        a spot or distances, a rotary axis, several settings up, a condition that prevents a statement
    """
    if recording.form != "axis":
        raise InputError(recording.path, "no readings along an axis", found=recording.form, expected="targets")
    _check_linear(recording.units.axis, recording.path)
    number = _chosen(sorted(map(int, recording.frame["placement"].unique())), placement, recording.path)
    rows = recording.frame[recording.frame["placement"] == number]
    known = actual or actual_of(recording)
    target = rows["target"].to_numpy(float) * recording.units.base_position
    reading = rows["reading"].to_numpy(float) * recording.units.base_position
    indicated, true = (target, reading) if known == "reading" else (reading, target)
    u_target = rows["u_target"] * recording.units.base_deviation if "u_target" in rows else 0.0
    table = pd.DataFrame(
        {
            "place": places_of(target),
            "sense": rows["way"].to_numpy(np.int64),
            "indicated_mm": indicated,
            "error_um": (indicated - true) * 1e3,
            "u_um": u_target,
        }
    )
    about = {
        **_about(recording.path, recording.comments, SENSORS[recording.sensor].words, known),
        "placement": number,
        "offset_mm": offset_mm,
    }
    conditions = setting_up_conditions(recording, rows)
    return _readings(table, recording.path, axis, about, conditions, recording.comments, u_length_um_per_m)


def iso230_readings(
    test: PositioningTest,
    axis: str,
    placement: int | None = None,
    offset_mm: float = 0.0,
    u_length_um_per_m: float = 0.0,
) -> AxisReadings:
    """Mean errors of an axis at the targets of a test by ISO 230-2 with an instrument; as :func:`recorded_readings`.

    :class:`InputError` also for a test with a step gauge, which a table is made of by its evaluation.
    """
    if test.gauge is not None:
        expected = "'stepgauge evaluate' of the recording, and its result: it keeps the faces"
        raise InputError(test.path, "a test with a step gauge keeps blocks, not faces", expected=expected)
    number = _chosen([one.placement for one in test.axes], placement, test.path)
    one = next(each for each in test.axes if each.placement == number)
    _check_linear("rotary" if one.units.position == "deg" else "linear", test.path)
    about = {
        **_about(test.path, test.comments, test.instrument["instrument"], test.instrument["actual"]),
        "placement": number,
        "offset_mm": offset_mm,
    }
    return _readings(_deviations(one), test.path, axis, about, one.conditions, test.comments, u_length_um_per_m)


def _deviations(one: AxisTest) -> pd.DataFrame:
    """A row per deviation, which is actual minus target position."""
    targets, parts = one.targets.machine_mm, list[pd.DataFrame]()
    for way, direction in one.parameters.directions.items():
        runs = direction.x_um.shape[1]
        place = np.repeat(np.arange(len(targets)), runs)
        columns = {"place": place, "indicated_mm": targets[place], "error_um": -direction.x_um.ravel(), "u_um": 0.0}
        parts.append(pd.DataFrame(columns).assign(sense=_SENSES[way]))
    return pd.concat(parts, ignore_index=True)


def _check_linear(axis: str, path: str) -> None:
    if axis != "linear":
        expected = "a linear axis; 'stepgauge test iso230' gives mean and reversal of a rotary one at every target"
        raise InputError(path, "no table for a controller is made of a rotary axis", expected=expected)


def _chosen(numbers: list[int], stated: int | None, path: str) -> int:
    if stated is None and len(numbers) > 1:
        found, expected = ", ".join(map(str, numbers)), naming("placement_number", words="one, with {}")
        raise InputError(path, "several settings up of the axis", found=found, expected=expected)
    if stated is None:
        return numbers[0]
    check_placement(stated, numbers, path)
    return stated


def _readings(
    table: pd.DataFrame,
    path: str,
    axis: str,
    about: dict[str, Any],
    conditions: Conditions,
    comments: Mapping[str, str],
    u_length_um_per_m: float,
) -> AxisReadings:
    """Means by place and sense of travel, at the mean coordinate of both senses."""
    require_statement(conditions, path)
    groups = table.groupby(["place", "sense"])
    means = groups["error_um"].mean()
    place, sense = (means.index.get_level_values(name).to_numpy() for name in ("place", "sense"))
    variance, unknown = _variance(table)
    made = (SIMULATED_WARNING,) if is_simulated(comments) else ()
    notes = _notes(comments, about, unknown, u_length_um_per_m)
    return AxisReadings(
        path,
        axis,
        table.groupby("place")["indicated_mm"].mean().loc[place].to_numpy() + about["offset_mm"],
        sense,
        np.zeros(len(means), bool),
        means.to_numpy(),
        variance + groups["u_um"].mean().to_numpy() ** 2,
        1.0,
        (0.0, 0.0),
        u_length_um_per_m * 1e-3,
        about,
        (*made, *conditions.notes, *notes),
    )


def _variance(table: pd.DataFrame) -> tuple[Array, bool]:
    """Variance of every mean, um^2, and whether nothing was read twice.

    The variance of single readings is that of all places together: from two to five runs that of each is known badly,
    and a place that was read once has none.
    """
    groups = table.groupby(["place", "sense"])["error_um"]
    count = groups.count().to_numpy()
    freedom = int((count - 1).sum())
    if freedom == 0:
        return np.zeros(len(count)), True
    squares = float((groups.var().fillna(0.0).to_numpy() * (count - 1)).sum())
    return squares / freedom / count, False


def _about(path: str, comments: Mapping[str, str], instrument: str, actual: str) -> dict[str, Any]:
    """Of two recordings of other ends, which is which stands in ``actual``."""
    return {
        "source": path.rpartition("/")[2] or "recording",
        "measured_with": instrument,
        "measured_at": comments.get("measured_at"),
        "machine": comments.get("machine"),
        "actual": actual,
    }


def _notes(comments: Mapping[str, str], about: Mapping[str, Any], unknown: bool, u_length: float) -> tuple[str, ...]:
    indicates = "target" if about["actual"] == "reading" else "reading"
    notes = [f"the {about['actual']} is the actual position, the {indicates} is what the axis indicates"]
    notes.append(instrument_words(comments))
    if unknown:
        notes.append("not in the stated uncertainty: repeatability (nothing was read twice)")
    if u_length == 0.0:
        notes.append(
            "not in the stated uncertainty: instrument and temperature of the material, of which none was stated"
        )
    return tuple(notes)
