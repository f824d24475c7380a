"""Concealed faults of the virtual CMM: effects, and events that stop it, in a file that the client never sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from pydantic import Field, model_validator

from stepgauge.effects import Effect, make_effects
from stepgauge.errors import InputError
from stepgauge.files.config import TomlTable, Vector3, check_table, read_toml

EventKind = Literal[
    "air_pressure",
    "collision",
    "connection_lost",
    "emergency_stop",
    "illegal_touch",
    "key_press",
    "limit_switch",
    "measured_by_hand",
    "missed_face",
    "moved_by_hand",
    "probe_not_armed",
]
NUMBERS: dict[str, int] = {
    "air_pressure": 1009,
    "collision": 2504,
    "connection_lost": 503,
    "emergency_stop": 500,
    "illegal_touch": 1001,
    "limit_switch": 2500,
    "missed_face": 1006,
    "probe_not_armed": 1501,
}
"""The standard's error of each event."""
BY_A_PERSON = ("key_press", "measured_by_hand", "moved_by_hand")
"""Events that are no errors, and that no command asks for."""
assert {*NUMBERS, *BY_A_PERSON} == set(get_args(EventKind))
NEVER_UNASKED = ("connection_lost", "missed_face")
IN_SEARCH = ("missed_face", "probe_not_armed")
"""Events of a probing; the others happen in any move."""


class EventTable(TomlTable):
    """The keys of an ``[[event]]``: something that stops the machine, once."""

    kind: EventKind = Field(description=", ".join(get_args(EventKind)))
    time_s: float | None = Field(None, ge=0, description="when it happens, s of the machine's clock")
    after_points: int | None = Field(None, ge=0, description="or after how many measured points")
    unasked: bool = Field(False, description="the server says it by itself, not as the error of a move")
    from_mm: Vector3 | None = Field(None, description="measured_by_hand: where the tip is brought first, mm")
    to_mm: Vector3 | None = Field(None, description="measured_by_hand: what it is moved towards, until it triggers, mm")

    @model_validator(mode="after")
    def _once(self) -> EventTable:
        if (self.time_s is None) == (self.after_points is None):
            raise ValueError("either time_s or after_points")
        if self.unasked and self.kind in NEVER_UNASKED:
            raise ValueError(f"{self.kind} is never unasked")
        if (self.kind == "measured_by_hand") != (self.from_mm is not None and self.to_mm is not None):
            raise ValueError("from_mm and to_mm are those of measured_by_hand, which needs both")
        return self

    @property
    def is_own(self) -> bool:
        """Whether the server says it by itself (tag E0000)."""
        return self.unasked or self.kind in BY_A_PERSON


@dataclass
class Faults:
    """Effects that are not in the machine file, and events that are still to come."""

    effects: Sequence[Effect] = ()
    events: list[EventTable] = field(default_factory=list)

    def take(self, points: int, begin_s: float, end_s: float, searching: bool) -> tuple[EventTable, float] | None:
        """The event that happens in a move, and at what share of its time; it does not happen again."""
        for event in self.events:
            share = self._share(event, points, begin_s, end_s)
            if share is not None and not event.is_own and (searching or event.kind not in IN_SEARCH):
                self.events.remove(event)
                return event, share
        return None

    def take_own(self, points: int, now_s: float, moving: bool, enabled: bool = False) -> EventTable | None:
        """An event that the server says by itself now.

        A person moves the machine while it stands, and measures where the client has ``enabled`` it.
        """
        for event in self._own(moving, enabled):
            if now_s >= event.time_s if event.time_s is not None else points >= (event.after_points or 0):
                self.events.remove(event)
                return event
        return None

    def next_own_s(self, moving: bool, enabled: bool = False) -> float | None:
        """When by the machine's clock the next of them comes."""
        return min((event.time_s for event in self._own(moving, enabled) if event.time_s is not None), default=None)

    def _own(self, moving: bool, enabled: bool) -> list[EventTable]:
        never = ["moved_by_hand"] if moving else []
        never += [] if enabled and not moving else ["measured_by_hand"]
        return [event for event in self.events if event.is_own and event.kind not in never]

    def _share(self, event: EventTable, points: int, begin_s: float, end_s: float) -> float | None:
        if event.time_s is None:
            return 0.5 if event.after_points is not None and points >= event.after_points else None
        if event.time_s > end_s:
            return None
        return max(0.0, event.time_s - begin_s) / (end_s - begin_s) if end_s > begin_s else 0.0


def read_faults(path: str | Path) -> Faults:
    """Read a file of ``[[effect]]`` tables, as a machine file has them, and ``[[event]]`` tables.

    :class:`InputError` names the key that is wrong.
    """
    data = read_toml(path)
    for key in data:
        if key not in ("effect", "event"):
            raise InputError(path, f"table [{key}] is not known", expected="[[effect]] and [[event]]")
        if not isinstance(data[key], list):
            raise InputError(path, f"[{key}] is an array of tables", expected=f"[[{key}]]")
    events = [check_table(EventTable, one, path, f"event[{n}]") for n, one in enumerate(data.get("event", []), 1)]
    return Faults(make_effects(data.get("effect", []), path), events)
