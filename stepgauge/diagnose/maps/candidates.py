"""What of a probe's construction may differ from its file, as changes of the ``[probe]`` table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, log1p, radians, sin
from typing import Any

Table = dict[str, Any]
Change = Callable[[Table, Sequence[float]], None]

_STEEL = {"tip_modulus_GPa": 400.0, "tip_poisson": 0.27, "modulus_GPa": 210.0, "poisson": 0.30}
GAUGE_KINDS = ("force_gauge_scale", "force_gauge_offset")


@dataclass(frozen=True)
class Knob:
    """A parameter: name, unit, value without the change, bounds, the step that counts as large, other starts.

    ``typical`` is the departure that surprises nobody (one standard deviation): it scales the search, and it ranks
    candidates that a map cannot tell apart. It never decides whether anything is reported.
    """

    name: str
    unit: str
    none: float
    low: float
    high: float
    typical: float


@dataclass(frozen=True)
class Candidate:
    """A change of the construction, or of the force gauge, with its knobs and the values from which to search.

    Of candidates for the same ``place`` (laws that replace each other) a model holds one at most.
    """

    kind: str
    knobs: tuple[Knob, ...]
    starts: tuple[tuple[float, ...], ...]
    change: Change
    choice: str = ""
    place: str = ""

    @property
    def label(self) -> str:
        return f"{self.kind} {self.choice}".strip()

    def applied(self, table: Mapping[str, Any], values: Sequence[float]) -> Table:
        """A copy of the table with the change in it."""
        changed = deepcopy(dict(table))
        self.change(changed, [float(value) for value in values])
        return changed

    def surprise(self, values: Sequence[float]) -> float:
        """Logarithm of how implausible this departure is, 0 for none; heavy-tailed, so that it never excludes."""
        return sum(log1p(((v - k.none) / k.typical) ** 2) for v, k in zip(values, self.knobs, strict=True))


def candidates_for(table: Table, quantities: Sequence[str]) -> list[Candidate]:
    """All changes that make sense for a probe's model and for what was measured."""
    if table.get("model", "constant") in ("constant", "lobed"):
        return _of_laws(table)
    if "seat" not in table:
        return []
    found = [*_of_seat(table["seat"]), _compliance(), _tip_friction(table)]
    return [*found, *_of_gauge()] if "trigger_force_N" in quantities else found


def _seat_key(
    kind: str, key: str, name: str, unit: str, seat: Table, typical: float, low: float, high: float
) -> Candidate:
    """One number of the seat, changed by an amount."""
    nominal = float(seat.get(key, 0.0))

    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"][key] = nominal + values[0]

    return Candidate(kind, (Knob(name, unit, 0.0, low - nominal, high - nominal, typical),), ((0.0,),), change)


def _of_seat(seat: Table) -> list[Candidate]:
    radius, angle, preload = seat["contact_radius_mm"], seat["contact_angle_deg"], seat["preload_N"]
    return [
        _seat_key("lever_arm", "carrier_mm", "mm", "mm", seat, 10.0, -45.0, 195.0),
        _seat_key("preload", "preload_N", "N", "N", seat, 0.15 * preload, 0.02 * preload, min(8.0 * preload, 100.0)),
        _seat_key("contact_radius", "contact_radius_mm", "mm", "mm", seat, 0.05 * radius, 0.1 * radius, 6.0 * radius),
        _seat_key("contact_angle", "contact_angle_deg", "deg", "deg", seat, 3.0, 0.1 * angle, 85.0),
        _lobing_phase(float(seat.get("arm_azimuth_deg", 0.0))),
        _eccentricity(seat),
        _seat_friction(float(seat.get("friction", 0.0))),
    ]


def _lobing_phase(nominal_deg: float) -> Candidate:
    """Three arms repeat after 120 deg."""

    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"]["arm_azimuth_deg"] = (nominal_deg + values[0] + 60.0) % 120.0 - 60.0

    starts = tuple((value,) for value in (-50.0, -30.0, -10.0, 10.0, 30.0, 50.0))
    return Candidate("lobing_phase", (Knob("deg", "deg", 0.0, -90.0, 90.0, 20.0),), starts, change)


def _eccentricity(seat: Table) -> Candidate:
    """Of the spring's line of action, in the probe's x and y."""
    x, y = seat.get("preload_offset_mm", (0.0, 0.0))
    reach = 0.45 * float(seat["contact_radius_mm"])

    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"]["preload_offset_mm"] = [x + values[0], y + values[1]]

    knobs = tuple(Knob(name, "mm", 0.0, -reach, reach, 0.5) for name in ("x_mm", "y_mm"))
    return Candidate("eccentricity", knobs, ((0.0, 0.0),), change)


def _seat_friction(nominal: float) -> Candidate:
    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"]["friction"] = values[0]

    return Candidate(
        "friction", (Knob("seat", "1", nominal, 0.0, 0.45, 0.1),), ((0.03,), (0.15,)), change, "of the seats"
    )


def _tip_friction(probe: Table) -> Candidate:
    nominal = float((probe.get("surface") or {}).get("friction", 0.0))

    def change(table: Table, values: Sequence[float]) -> None:
        table["surface"] = {**_rigid_or(table.get("surface")), "friction": values[0]}

    return Candidate("friction", (Knob("tip", "1", nominal, 0.0, 0.9, 0.15),), ((0.03,), (0.2,)), change, "of the tip")


def _rigid_or(surface: Table | None) -> Table:
    """The surface of the file; without one, ruby on steel whose indentation stays left out, as before."""
    return dict(surface) if surface is not None else {**_STEEL, "indentation": "left out"}


def _compliance() -> Candidate:
    """The stylus gives way by a factor, the same for all sections and both ways."""

    def change(table: Table, values: Sequence[float]) -> None:
        for section in table["stylus"]:
            section["modulus_GPa"] = section["modulus_GPa"] / values[0]

    return Candidate("compliance", (Knob("factor", "1", 1.0, 0.25, 20.0, 0.15),), ((1.0,),), change)


def _of_gauge() -> list[Candidate]:
    """What the force gauge does to every force; the probe itself is not changed."""

    def unchanged(table: Table, values: Sequence[float]) -> None:
        del table, values

    scale = Knob("factor", "1", 1.0, 0.1, 10.0, 0.05)
    offset = Knob("N", "N", 0.0, -10.0, 10.0, 0.05)
    return [
        Candidate("force_gauge_scale", (scale,), ((1.0,),), unchanged),
        Candidate("force_gauge_offset", (offset,), ((0.0,),), unchanged),
    ]


def _of_laws(table: Table) -> list[Candidate]:
    """Of a probe that is a law of its pre-travel: another mean, and lobes of either shape."""
    nominal = float(table.get("pretravel_um", 0.0))
    lobes, phase_rad = float(table.get("amplitude_um", 0.0)), radians(3.0 * float(table.get("phase_deg", 0.0)))

    def mean(table: Table, values: Sequence[float]) -> None:
        table["pretravel_um"] = nominal + values[0]

    def cosine(table: Table, values: Sequence[float]) -> None:
        phase = degrees(atan2(values[1], values[0])) / 3.0
        table |= {"model": "lobed", "amplitude_um": hypot(*values), "phase_deg": phase}

    def triangle(table: Table, values: Sequence[float]) -> None:
        table |= {"model": "triangular", "constant_um": values[0], "lobe_azimuth_deg": values[1], "law_um": nominal}

    known = {"cos_um": lobes * cos(phase_rad), "sin_um": lobes * sin(phase_rad)}
    amplitudes = tuple(Knob(name, "um", value, -500.0, 500.0, 3.0) for name, value in known.items())
    shape = (Knob("constant_um", "um", nominal, 0.0, 1000.0, 10.0), Knob("phase_deg", "deg", 0.0, -90.0, 90.0, 60.0))
    starts = tuple((max(nominal, 1.0), float(angle)) for angle in range(-58, 60, 4))
    return [
        Candidate("effective_radius", (Knob("um", "um", 0.0, -nominal, 1000.0, 3.0),), ((0.0,),), mean),
        Candidate("probe_lobing", amplitudes, ((0.1, 0.1),), cosine, "cosine", "lobes"),
        Candidate("probe_lobing", shape, starts, triangle, "triangular", "lobes"),
    ]
