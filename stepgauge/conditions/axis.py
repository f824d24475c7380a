"""The conditions of readings of one axis at its targets."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.recording import AxisRecording, places_of
from stepgauge.axis.units import BASE
from stepgauge.conditions.condition import Condition, Conditions, State
from stepgauge.conditions.drift import SURE, drift_rate
from stepgauge.conditions.outliers import find_outliers
from stepgauge.conditions.resolution import step_of
from stepgauge.conditions.series import thermometer_conditions
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.recording.face_readings import FaceReadings

Columns = dict[tuple[int, int], pd.Series]
"""Deviations of every run and way, by place."""
SMALLEST, LARGE, LARGEST = 0.3e-6, 1e-3, 2e-2
"""Range of all deviations over the travel: below the first no axis and no instrument is; beyond the second it is
remarked, for only an axis that nobody ever adjusted is so wrong; beyond the third it is another unit."""
ORDINARY = (0.5, 20.0)
"""In um or arcsec: no range from the first on is too small for a long travel, none up to the second too large for a
short one: some axis, stage or mask has it."""
SAME_SLOPE = 0.02
"""Deviations in um that rise with the targets in mm by one to so much are the positions themselves."""
WILD_SHARE = 1e-3
"""A single reading so far from its repeats, over the travel, is a slip and no error of an axis."""
LEAST_COPIED, SURELY_COPIED, LEVELS = 5, 8, 20.0
"""Readings of a run from which it may be a copy, and surely is one; steps in the range of all, below which it is not
sure."""
TURNED = 0.3
"""A run whose sum with the others is so much of its difference has its sign turned."""
MOST_RUNS = 200
"""Runs that are compared with one another: more are no test of an axis by hand, and nobody copies them."""
MANY_RUNS = 50
"""Runs of a way from which each is compared with the middle of all, and not of the others."""
NOTABLE_UM = 0.1
_TEMPERATURE = re.compile(r"temp|°C|_C$", re.IGNORECASE)
"""Names of columns with a temperature."""


def recording_conditions(recording: AxisRecording, table_alone: bool = False) -> Conditions:
    """What was found of the readings of every setting up; nothing of a spot or distances, which have no targets.

    ``table_alone``: only what a table may have wrong as a table, units and copies, which thousands of runs may ask for.
    """
    if recording.form != "axis":
        return Conditions()
    settings = recording.frame.groupby("placement")
    return sum((setting_up_conditions(recording, rows, table_alone) for _, rows in settings), Conditions())


def setting_up_conditions(recording: AxisRecording, rows: pd.DataFrame, table_alone: bool = False) -> Conditions:
    """What was found of the readings of one setting up, whether they are used or not."""
    target = rows["target"].to_numpy(float) * recording.units.base_position
    reading = rows["reading"].to_numpy(float) * recording.units.base_position
    return axis_conditions(
        (reading - target) * BASE[recording.units.axis][1],
        target,
        places_of(target),
        rows["way"].to_numpy(np.int64),
        rows["cycle"].to_numpy(np.int64),
        {name: rows[name].to_numpy(float) for name in temperatures_of(recording)},
        "arcsec" if recording.units.axis == "rotary" else "um",
        table_alone,
    )


def temperatures_of(recording: AxisRecording) -> list[str]:
    """Names of the columns with a temperature."""
    return [one for one in recording.covariates if _TEMPERATURE.search(one)]


def axis_conditions(
    deviation_um: Array,
    target_mm: Array,
    place: NDArray[np.int64],
    way: NDArray[np.int64],
    run: NDArray[np.int64],
    temperatures_C: Mapping[str, Array],
    unit: str = "um",
    table_alone: bool = False,
) -> Conditions:
    """What was found of the readings of one setting up, each ``(n,)`` in the order in which they were taken.

    Parameters
    ----------
    deviation_um : reading minus target; of a rotary axis arcsec, with targets in deg
    target_mm : target positions
    place, way, run : number of the target along the axis, sense of travel, number of the run
    temperatures_C : recorded besides, by name
    unit : of the deviations, for sentences
    table_alone : only what a table may have wrong as a table
    """
    group = 2 * place + (way > 0) + 2
    found = [*_units(deviation_um, target_mm, unit), *_runs(deviation_um, group, way, run)]
    if table_alone:
        return Conditions(tuple(found))
    found += [
        *_single(deviation_um, target_mm, group, way, run, unit),
        *_resolution(deviation_um, unit),
        *_drift(deviation_um, group, unit),
        *thermometer_conditions(temperatures_C),
    ]
    return Conditions(tuple(found))


def is_unlikely(size: float, travel: float) -> bool:
    """Whether a range of deviations is that of no axis of such a travel, both in um or arcsec: a wrong unit."""
    too_small = size < min(ORDINARY[0], SMALLEST * travel)
    return travel > 0.0 and (too_small or size > max(ORDINARY[1], LARGEST * travel))


def _units(um: Array, target_mm: Array, unit: str) -> Iterator[Condition]:
    """The size of the deviations beside the travel; single slips do not count."""
    travel = float(np.ptp(target_mm)) * (1e3 if unit == "um" else 3600.0)
    low, high = (float(v) for v in np.quantile(um, (0.02, 0.98)))
    share = (high - low) / travel if travel > 0.0 else np.nan
    place = f"{np.ptp(target_mm):g} {'mm' if unit == 'um' else 'deg'}"
    found = f"deviations of {rounded(low, 3)} to {rounded(high, 3)} {unit} over {place}"
    slope = float(np.polyfit(target_mm, um, 1)[0]) if travel > 0.0 else 0.0
    if unit == "um" and abs(abs(slope) - 1.0) < SAME_SLOPE:
        words = f"the deviations rise like the targets themselves: positions under the name of deviations? {found}"
        yield Condition("units", "prevents", words, found, "reading minus target", high - low)
    elif is_unlikely(high - low, travel) and share < SMALLEST:
        words = f"no axis is so good: {found}; in a larger unit than stated?"
        yield Condition("units", "prevents", words, found, f"{SMALLEST * travel:.2g} {unit} or more")
    elif is_unlikely(high - low, travel):
        words = f"no axis is so wrong: {found}; in a smaller unit than stated?"
        yield Condition("units", "prevents", words, found, f"{LARGEST * travel:.3g} {unit} at most", high - low)
    elif share > LARGE:
        words = f"very large deviations: {found}; is the unit right?"
        yield Condition("units", "contribution", words, found, "", high - low)


def _runs(um: Array, group: NDArray[np.int64], way: NDArray[np.int64], run: NDArray[np.int64]) -> Iterator[Condition]:
    """Runs that are those of another run or way: copied, turned in sign, or stuck at one value; of very many the first
    :data:`MOST_RUNS`."""
    frame = pd.DataFrame({"place": group // 2, "way": way, "run": run, "um": um})
    table = frame[run < run.min(initial=1) + MOST_RUNS].pivot_table(
        index="place", columns=["run", "way"], values="um", aggfunc="first"
    )
    columns: Columns = {(int(key[0]), int(key[1])): table[key].dropna() for key in table.columns.to_list()}
    usual = float(np.median([np.ptp(one.to_numpy()) for one in columns.values()])) if columns else 0.0
    step = 1e3 * step_of(um * 1e-3)
    yield from _doubled(frame)
    yield from _copied(columns, fine=float(np.ptp(um)) >= LEVELS * step)
    for key, values in columns.items():
        if len(values) >= LEAST_COPIED and np.ptp(values.to_numpy()) == 0.0 and usual > 5.0 * step > 0.0:
            words = f"{_name(key)} reads the same everywhere: {rounded(float(values.iloc[0]), 3)}: frozen"
            yield Condition("channel", "prevents", words, _name(key), "a reading that changes")
    yield from _turned(columns, usual)


def _name(key: tuple[int, int]) -> str:
    return f"run {key[0]} {'up' if key[1] > 0 else 'down'}"


def _doubled(frame: pd.DataFrame) -> Iterator[Condition]:
    """Rows in order that stand there twice, with target, run, way and reading: a block was pasted again."""
    twin = frame.groupby(["place", "way", "run", "um"], sort=False).ngroup().to_numpy()
    first = np.unique(twin, return_index=True)[1]
    lag = np.arange(len(twin)) - first[twin]
    ends = np.flatnonzero(np.r_[np.diff(lag) != 0, True])
    lengths = np.where(lag[ends] > 0, np.diff(np.r_[-1, ends]), 0)
    longest, end = int(lengths.max(initial=0)), int(ends[lengths.argmax()])
    distinct = frame["um"].iloc[end + 1 - longest : end + 1].nunique()
    if longest >= SURELY_COPIED and distinct >= LEAST_COPIED:
        count = int((lag > 0).sum())
        words = f"{count} rows stand there twice, with the same target, run, way and reading: copied"
        yield Condition("duplicates", "prevents", words, f"{count} rows", "every reading once")


def _copied(columns: Columns, fine: bool) -> Iterator[Condition]:
    """Runs that have every reading of an earlier one; few readings, or those that are not ``fine`` but of coarse steps,
    may agree by chance."""
    seen: dict[bytes, tuple[int, int]] = {}
    found, sure = list[str](), False
    for key, values in columns.items():
        first = seen.setdefault(values.to_numpy().tobytes() + values.index.to_numpy().tobytes(), key)
        if first != key and len(values) >= LEAST_COPIED and np.ptp(values) > 0.0:
            found.append(f"{_name(key)} (those of {_name(first)})")
            sure = sure or (fine and (len(values) >= SURELY_COPIED or len(np.unique(values)) >= LEAST_COPIED))
    if found:
        shown = ", ".join(found[:5]) + (f" and {len(found) - 5} more" if len(found) > 5 else "")
        words = (
            f"every reading is that of another run: {shown}: copied{'' if fine else ', or the steps are too coarse'}"
        )
        yield Condition("duplicates", "prevents" if sure else "contribution", words, shown, "every run measured")


def _turned(columns: Columns, usual: float) -> Iterator[Condition]:
    """Runs that are the others of their way with the sign turned; among many, one alone moves the middle by nothing."""
    for way in sorted({key[1] for key in columns}):
        keys = [key for key in columns if key[1] == way]
        if len(keys) < 2:
            continue
        runs = pd.concat([columns[key] for key in keys], axis=1)
        every = range(len(keys))
        if len(keys) > MANY_RUNS:
            middle = np.repeat(runs.median(axis=1).to_numpy()[:, None], len(keys), axis=1)
        else:
            middle = np.column_stack([runs.iloc[:, [m for m in every if m != n]].median(axis=1) for n in every])
        own, rest = runs.to_numpy(), np.where(runs.notna(), middle, np.nan)
        own, rest = (one - pd.DataFrame(one).mean().to_numpy() for one in (own, rest))
        apart, together = _medians(np.abs(own - rest)), _medians(np.abs(own + rest))
        turned = (together < TURNED * apart) & (apart > 0.2 * usual) & (runs.count().to_numpy() >= LEAST_COPIED)
        for key in (key for key, one in zip(keys, turned, strict=True) if one):
            words = f"{_name(key)} is like the others with the sign turned"
            yield Condition("units", "prevents", words, _name(key), "one sign for all runs")


def _medians(table: Array) -> Array:
    """Of every column, without what is not there."""
    return np.median(table, axis=0) if np.isfinite(table).all() else pd.DataFrame(table).median().to_numpy()


def _single(
    um: Array, target_mm: Array, group: NDArray[np.int64], way: NDArray[np.int64], run: NDArray[np.int64], unit: str
) -> Iterator[Condition]:
    """Readings that their repeats contradict. A standard judges what was measured: they are used."""
    cycle = np.unique(np.column_stack([run, way]), axis=0, return_inverse=True)[1].ravel()
    found = find_outliers(FaceReadings.of(um * 1e-3, group), cycle, step_of(um * 1e-3))
    if not found.rows.size and not found.unclear:
        return
    shown = [
        f"target {target_mm[row]:g}, run {run[row]} {'up' if way[row] > 0 else 'down'}"
        f" ({rounded(float(off), 4, plus=True)} {unit})"
        for row, off in zip(found.rows[:5], found.off_um[:5], strict=True)
    ]
    shown += [f"target {target_mm[group == one][0]:g}" for one in found.unclear[:3]]
    size = float(np.abs(found.off_um).max(initial=0.0))
    travel = float(np.ptp(target_mm)) * (1e3 if unit == "um" else 3600.0)
    state: State = "prevents" if size > WILD_SHARE * travel else "contribution"
    words = f"far from their repeats, and used: {'; '.join(shown)}"
    yield Condition("outliers", state, words, "; ".join(shown), "readings without slips", size)


def _resolution(um: Array, unit: str) -> Iterator[Condition]:
    step = 1e3 * step_of(um * 1e-3)
    if step > NOTABLE_UM and step > 0.02 * float(np.ptp(um)):
        words = f"the readings have steps of {rounded(step, 3)} {unit}: each is rounded by up to half of it"
        yield Condition("resolution", "contribution", words, f"{rounded(step, 3)} {unit}", "", step / 2.0)


def _drift(um: Array, group: NDArray[np.int64], unit: str) -> Iterator[Condition]:
    """What all targets move alike while the test goes on, by the order of the readings."""
    order = np.arange(len(um), dtype=float)
    rate, u = drift_rate(um, group, order)
    size = abs(rate) * len(um) if np.isfinite(rate) else 0.0
    if size > NOTABLE_UM and abs(rate) > SURE * u:
        words = f"the readings drift by {rounded(rate * len(um), 3, plus=True)} {unit} in the course of the test"
        yield Condition("drift", "contribution", words, words, "no drift", size)
