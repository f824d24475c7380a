"""ISO 230-3:2020: drift tests, of displacements and temperatures over time.

ETVE (environmental temperature variation error): the machine stands still, displacement sensors between spindle and
table record; the ETVE of a channel is the range of its displacement over the test. Linear axis (thermal distortion by
moving the axis): two target positions are measured again and again while the axis moves; d_60 is the range of the
displacement in the first 60 min, d_t the range over the whole time of moving, of each target and of their distance.
The text of the standard was not at hand: what is taken from secondary sources is marked as unconfirmed
(:data:`UNCONFIRMED`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from stepgauge import __version__
from stepgauge.conditions import NOTHING, Conditions
from stepgauge.conditions.series import channel_conditions
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.notation import percent
from stepgauge.files.tables import Rows, csv_text, read_rows, result_cell
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording
from stepgauge.recording.identity import check_recording
from stepgauge.recording.lines import table_comments
from stepgauge.standards.iso230_decision import NO_REQUIREMENT, Requirement
from stepgauge.standards.lengths import face_table, nearest_axis
from stepgauge.standards.rules import Rule

Kind = Literal["etve", "axis"]
STANDARD = "ISO 230-3:2020"
FIRST_S = 3600.0
"""The first 60 min, that of d_60."""
LATER, FEWEST_LATER, TIMES, LEAST_UM = 20, 3, 8.0, 2.0
"""Steps that the first one is held against, the fewest of them, how many times them it is, and at least so much, um."""
LONGEST_AXIS_MM = 2000.0
SETTLED_SHARE = 0.15
UNCONFIRMED = {
    "etve": ("a test of 24 h at least: unconfirmed", "a reading every 5 min at least: unconfirmed"),
    "axis": (
        "the end of the test where the last 60 min change less than 15 % of the first 60 min: unconfirmed",
        "d_60 and d_t as ranges of the displacement: unconfirmed",
    ),
}
NAMES = {
    "etve": "environmental temperature variation error (ETVE)",
    "axis": "thermal distortion by moving a linear axis",
}


@dataclass(frozen=True)
class Drift:
    """Displacements in um and temperatures in deg C over time in s: names to arrays of the same shape ``(n,)``."""

    path: str
    time_s: Array
    displacement_um: Mapping[str, Array]
    temperature_C: Mapping[str, Array]
    comments: Mapping[str, str] = field(default_factory=dict)
    span_mm: float | None = None
    conditions: Conditions = NOTHING


@dataclass(frozen=True)
class Channel:
    """What a displacement did: ranges over the whole test, the first and the last 60 min, and its change at the end,
    um.

    ``last_hour_um`` is None in a test of less than two hours.
    """

    name: str
    range_um: float
    first_hour_um: float
    end_um: float
    last_hour_um: float | None


@dataclass(frozen=True)
class DriftTest:
    """A drift test: the data and what follows from them, one channel per displacement; tolerances of their ranges."""

    kind: Kind
    drift: Drift
    channels: tuple[Channel, ...]
    requirement: Requirement = NO_REQUIREMENT

    @property
    def conditions(self) -> Conditions:
        """What was found of the readings."""
        return self.drift.conditions

    @property
    def values_um(self) -> dict[str, float]:
        """Range of every displacement over the test by name, um: the ETVE, or d_t."""
        return {one.name: one.range_um for one in self.channels}

    @property
    def duration_s(self) -> float:
        """From the first to the last reading."""
        return float(np.ptp(self.drift.time_s))

    @property
    def settled(self) -> float | None:
        """Largest range of the last 60 min over the largest of the first 60 min; None in less than two hours."""
        last = [one.last_hour_um for one in self.channels if one.last_hour_um is not None]
        first = max(one.first_hour_um for one in self.channels)
        return max(last) / first if last and first > 0.0 else None

    @property
    def temperature_ranges_K(self) -> dict[str, float]:
        """Range of every temperature over the test."""
        return {name: float(np.ptp(values)) for name, values in self.drift.temperature_C.items()}


def drift_test(drift: Drift, kind: Kind, requirement: Requirement = NO_REQUIREMENT) -> DriftTest:
    """Evaluate displacements over time; :class:`InputError` for fewer than three readings or times that do not rise."""
    time = drift.time_s
    if len(time) < 3:
        raise InputError(drift.path, "too few readings for a drift", found=len(time), expected="3 at least")
    wrong = np.flatnonzero(np.diff(time) <= 0.0)
    if len(wrong):
        found = f"{time[wrong[0] + 1]:g} s after {time[wrong[0]]:g} s"
        raise InputError(drift.path, "time_s does not rise", found=found, expected="readings in the order of time")
    channels = tuple(_channel(name, time - time[0], um) for name, um in drift.displacement_um.items())
    return DriftTest(
        kind, drift, channels, replace(requirement, conditions=drift.conditions.weighed(requirement.expanded_um))
    )


def beginning(um: Array) -> float:
    """Where a series in um begins: its first reading, or the second where the first stands out.

    It stands out where the first step is many times those that follow it, of which the largest tenth is left aside.
    """
    steps = np.abs(np.diff(um))
    later = steps[1 : 1 + LATER]
    bad = len(later) >= FEWEST_LATER and steps[0] > max(TIMES * float(np.quantile(later, 0.9)), LEAST_UM)
    return float(um[1] if bad else um[0])


def _channel(name: str, since_s: Array, um: Array) -> Channel:
    """Ranges of one displacement; ``since_s`` counts from the first reading."""
    first = float(np.ptp(um[since_s <= FIRST_S]))
    last = float(np.ptp(um[since_s >= since_s[-1] - FIRST_S])) if since_s[-1] >= 2.0 * FIRST_S else None
    return Channel(name, float(np.ptp(um)), first, float(um[-1]) - beginning(um), last)


def read_drift(path: str | Path) -> Drift:
    """A table with ``time_s``, displacements ``NAME_um`` and temperatures ``NAME_C``.

    :class:`InputError` where there is no displacement, a cell is no number, or a column is something else: it may be
    a displacement in another unit, which nobody would miss.
    """
    rows = read_rows(path, ("time_s",), plain={"length": "um", "temperature": "C"})
    unknown = [name for name in rows.header if name != "time_s" and not name.endswith(("_um", "_C"))]
    if unknown:
        expected = "time_s, displacements like x1_um and temperatures like room_C"
        raise InputError(path, "a column is neither displacement nor temperature", found=unknown[0], expected=expected)
    um, degrees = (_ending(rows, end) for end in ("_um", "_C"))
    if not um:
        found = ",".join(rows.header)
        raise InputError(path, "no displacement", found=found, expected="columns like x_um beside time_s")
    time_s = rows.numbers(["time_s"])[:, 0]
    return Drift(str(path), time_s, um, degrees, table_comments(path), conditions=channel_conditions(um, degrees))


def _ending(rows: Rows, end: str) -> dict[str, Array]:
    names = [name for name in rows.header if name.endswith(end)]
    values = rows.numbers(names) if names else np.empty((len(rows.cells), 0))
    return {name.removesuffix(end): values[:, i] for i, name in enumerate(names)}


def drift_of_recording(recording: Recording, gauge: Gauge) -> Drift:
    """Displacements of the axis at both ends of a step gauge, cycle by cycle: a linear-axis test with the gauge as
    reference.

    All is told along the machine axis that the gauge lies along, either way round. The complete blocks at the low and
    at the high end of it are the targets ``P1`` and ``P2``; of their faces one is approached in its positive and one in
    its negative direction: ``P1 +``, ``P1 -``, ``P2 +``, ``P2 -``, and ``P2 - P1`` is the change of their distance. A
    displacement is what the indicated position of a face has changed since the first cycle (:func:`beginning`);
    certified positions are brought to the recorded gauge temperature first, so that the gauge's own expansion is no
    drift of the machine.
    :class:`InputError` without times or with fewer than two blocks.
    """
    check_recording(recording, gauge)
    if len(recording.placements) > 1:
        found = f"placements {', '.join(map(str, recording.placements))}"
        raise InputError(recording.path, "a drift test is one placement of the gauge", found=found, expected="one")
    if "time_s" not in recording.frame:
        raise InputError(recording.path, "a drift needs times", found="no column time_s", expected="time_s")
    number = recording.placements[0]
    table, frame = face_table(recording, gauge, number), recording.select_placement(number).frame
    times = frame.groupby("cycle")["time_s"].mean().reindex(table.cycles).to_numpy(float)
    complete = np.isfinite(table.off_mm).all(axis=0)
    fronts = [int(f) for f in table.faces[complete] if f % 2 and f + 1 in table.faces[complete]]
    if len(fronts) < 2:
        raise InputError(recording.path, "too few complete blocks", found=len(fronts), expected="2, one at each end")
    along = float(np.sign(table.axis[nearest_axis(table.axis)[0]]))
    um = {
        name: along * _since_beginning(table.face_readings(face) * 1e3)
        for name, face in _ends(fronts[0], fronts[-1], along < 0.0).items()
    }
    um["P2 − P1"] = (um["P2 +"] + um["P2 −"] - um["P1 +"] - um["P1 −"]) / 2.0
    columns = [str(name) for name in frame if str(name).endswith("_temperature_C")]
    degrees = frame.groupby("cycle")[columns].mean().reindex(table.cycles)
    temperatures = {name.removesuffix("_temperature_C"): degrees[name].to_numpy(float) for name in columns}
    span = float(gauge.block_centre_mm[fronts[-1] // 2] - gauge.block_centre_mm[fronts[0] // 2])
    return Drift(recording.path, times, um, temperatures, recording.comments, span, _drop_drift(table.conditions))


def _drop_drift(conditions: Conditions) -> Conditions:
    """Those of the recording without the drift, which is what is measured here."""
    return Conditions(tuple(one for one in conditions if one.name != "drift"))


def _since_beginning(um: Array) -> Array:
    return um - beginning(um)


def _ends(first: int, last: int, against: bool) -> dict[str, int]:
    """Faces by target and direction of approach; fronts of a gauge ``against`` the axis are touched on the way down."""
    low, high = (last, first) if against else (first, last)
    up, down = (1, 0) if against else (0, 1)
    return {"P1 +": low + up, "P1 −": low + down, "P2 +": high + up, "P2 −": high + down}


ETVE_H = 24.0
LARGEST_STEP_S = 300.0


def rules_of(test: DriftTest) -> tuple[Rule, ...]:
    """Every rule of the kind of test."""
    return (_temperatures(test), *(_etve(test) if test.kind == "etve" else _axis(test)))


def _temperatures(test: DriftTest) -> Rule:
    names = list(test.drift.temperature_C)
    found = ", ".join(names) if names else "none in the table"
    return Rule(f"{STANDARD}, instrumentation", "temperatures recorded beside the displacements", found, bool(names))


def _etve(test: DriftTest) -> tuple[Rule, ...]:
    hours = test.duration_s / 3600.0
    step = float(np.diff(test.drift.time_s).max())
    source = f"{STANDARD}, ETVE test (unconfirmed)"
    return (
        Rule(source, f"a test of {ETVE_H:g} h at least", f"{hours:.1f} h", hours >= ETVE_H - 1e-6),
        Rule(source, f"a reading every {LARGEST_STEP_S:g} s at least", f"up to {step:.0f} s", step <= LARGEST_STEP_S),
    )


def _axis(test: DriftTest) -> tuple[Rule, ...]:
    source = f"{STANDARD}, test of linear axes"
    known = test.settled
    share = "less than two hours measured" if known is None else percent(known)
    settled = Rule(
        f"{source} (unconfirmed)",
        f"moved until the last 60 min change less than {percent(SETTLED_SHARE)} of the first 60 min",
        share,
        known is not None and known < SETTLED_SHARE,
    )
    span = test.drift.span_mm
    if span is None:
        return (settled,)
    asks = f"a representative length of {LONGEST_AXIS_MM:g} mm at most"
    return settled, Rule(f"{source}, clause 7", asks, f"{span:.1f} mm", span <= LONGEST_AXIS_MM)


COLUMNS = ("channel", "range_um", "first_hour_um", "end_um", "last_hour_um")


def drift_to_dict(test: DriftTest) -> dict[str, Any]:
    """Everything the test says, as JSON types."""
    rules, requirement = rules_of(test), test.requirement
    return {
        "format": "stepgauge test iso230-3 1",
        "stepgauge": __version__,
        "standard": STANDARD,
        "test": test.kind,
        "name": NAMES[test.kind],
        "recording": test.drift.path,
        "comments": dict(test.drift.comments),
        "duration_s": test.duration_s,
        "readings": len(test.drift.time_s),
        "span_mm": test.drift.span_mm,
        "channels": [_channel_row(one) for one in test.channels],
        "settled": test.settled,
        "temperature_ranges_K": test.temperature_ranges_K,
        "tolerances_um": dict(requirement.tolerance_um),
        "expanded_uncertainty_um": requirement.expanded_um,
        "outcomes": requirement.outcomes(test.values_um),
        "decision": requirement.decision([("", test.values_um)]).to_dict(),
        "conditions": test.conditions.to_dicts(),
        "complete": all(rule.met for rule in rules),
        "rules": [rule.to_dict() for rule in rules],
        "unconfirmed": list(UNCONFIRMED[test.kind]),
    }


def _channel_row(one: Channel) -> dict[str, Any]:
    return {
        "channel": one.name,
        "range_um": one.range_um,
        "first_hour_um": one.first_hour_um,
        "end_um": one.end_um,
        "last_hour_um": one.last_hour_um,
    }


def drift_csv(test: DriftTest) -> str:
    """A row per channel."""
    return csv_text(COLUMNS, [[result_cell(_channel_row(one)[name]) for name in COLUMNS] for one in test.channels])
