"""Possible differences of the construction of a probe from its file, as changes of the ``[probe]`` table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, radians, sin
from typing import Any, Literal

from stepgauge.physics import stylus
from stepgauge.probes.schema import SectionTable

Table = dict[str, Any]
Change = Callable[[Table, Sequence[float]], None]
Told = Callable[[Sequence[float]], dict[str, tuple[float, str]]]
Shape = Literal["line", "plane", "linear", "lobes"]

_STEEL = {"tip_modulus_GPa": 400.0, "tip_poisson": 0.27, "modulus_GPa": 210.0, "poisson": 0.30}
GAUGE_KINDS = ("force_gauge_scale", "force_gauge_offset")
FORCE_GAUGE = "force_gauge"
"""Key of the errors of the force gauge beside those of a ``[probe]`` table; no probe file has it."""
SHORTEST_STEM_MM, LONGEST_STEM_MM = 2.0, 500.0


@dataclass(frozen=True)
class ProbeParameter:
    """A parameter: name, unit, value without the change, bounds."""

    name: str
    unit: str
    none: float
    low: float
    high: float


@dataclass(frozen=True)
class ProbeChange:
    """A change of the construction, of the force gauge, or of the map only, with its parameters (knobs).

    ``shape``: dependence on the knobs: on one (``line``), on two as the components of a vector (``plane``), linear
    (``linear``), linear in the first and by the phase of the lobes (``lobes``). ``prior``: its key among the priors;
    ``nominal``: the usual size is a share of this. ``told``: from the values of the knobs to the parameters in terms of
    the field, each with its unit; without it the knobs themselves.
    """

    kind: str
    knobs: tuple[ProbeParameter, ...]
    change: Change
    choice: str = ""
    shape: Shape = "line"
    prior: str = ""
    nominal: float = 1.0
    told: Told | None = None

    @property
    def label(self) -> str:
        return f"{self.kind} {self.choice}".strip()

    @property
    def none(self) -> tuple[float, ...]:
        """Values of the knobs without the change."""
        return tuple(knob.none for knob in self.knobs)

    def parameters(self, values: Sequence[float]) -> dict[str, tuple[float, str]]:
        """What is told of it, by name: value and unit."""
        if self.told is not None:
            return self.told(values)
        return {knob.name: (value, knob.unit) for knob, value in zip(self.knobs, values, strict=True)}

    def applied(self, table: Mapping[str, Any], values: Sequence[float]) -> Table:
        """A copy of the table with the change in it."""
        changed = deepcopy(dict(table))
        self.change(changed, [float(value) for value in values])
        return changed


def candidates_for(table: Table, quantities: Sequence[str]) -> list[ProbeChange]:
    """All changes that are possible for the model of a probe and for the measured quantities."""
    if table.get("model", "constant") in ("constant", "lobed"):
        return _pretravel_changes(table)
    if "seat" not in table:
        return []
    found = [
        *_seat_changes(table["seat"]),
        _stylus_length(table["stylus"]),
        _compliance(table["stylus"]),
        _tip_friction(table),
    ]
    return [*found, *_force_gauge_changes()] if "trigger_force_N" in quantities else found


def _seat_changes(seat: Table) -> list[ProbeChange]:
    radius, angle, preload = seat["contact_radius_mm"], seat["contact_angle_deg"], seat["preload_N"]
    return [
        _seat_key("lever_arm", "carrier_mm", "mm", seat, -45.0, 195.0),
        _seat_key("preload", "preload_N", "N", seat, 0.02 * preload, min(8.0 * preload, 100.0), preload),
        _seat_key("contact_radius", "contact_radius_mm", "mm", seat, 0.1 * radius, 6.0 * radius, radius),
        _seat_key("contact_angle", "contact_angle_deg", "deg", seat, 0.1 * angle, 85.0),
        _lobing_phase(float(seat.get("arm_azimuth_deg", 0.0))),
        _eccentricity(seat),
        _seat_friction(float(seat.get("friction", 0.0))),
    ]


def _seat_key(
    kind: str, key: str, unit: str, seat: Table, low: float, high: float, nominal: float = 1.0
) -> ProbeChange:
    """One number of the seat, changed by an amount."""
    before = float(seat.get(key, 0.0))

    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"][key] = before + values[0]

    knobs = (ProbeParameter(unit, unit, 0.0, low - before, high - before),)
    return ProbeChange(
        kind, knobs, change, nominal=nominal, told=lambda v: {unit: (v[0], unit), key: (before + v[0], unit)}
    )


def _lobing_phase(before_deg: float) -> ProbeChange:
    """Three arms repeat after 120 deg."""

    def turned(deg: float) -> float:
        return (before_deg + deg + 60.0) % 120.0 - 60.0

    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"]["arm_azimuth_deg"] = turned(values[0])

    def told(values: Sequence[float]) -> dict[str, tuple[float, str]]:
        return {"deg": (values[0], "deg"), "arm_azimuth_deg": (turned(values[0]), "deg")}

    return ProbeChange("lobing_phase", (ProbeParameter("deg", "deg", 0.0, -90.0, 90.0),), change, told=told)


def _eccentricity(seat: Table) -> ProbeChange:
    """Of the spring's line of action, in the probe's x and y."""
    x, y = seat.get("preload_offset_mm", (0.0, 0.0))
    reach = 0.45 * float(seat["contact_radius_mm"])

    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"]["preload_offset_mm"] = [x + values[0], y + values[1]]

    knobs = tuple(ProbeParameter(name, "mm", 0.0, -reach, reach) for name in ("x_mm", "y_mm"))
    return ProbeChange(
        "eccentricity",
        knobs,
        change,
        shape="plane",
        told=lambda v: {"mm": (hypot(*v), "mm"), "azimuth_deg": (degrees(atan2(v[1], v[0])), "deg")},
    )


def _seat_friction(before: float) -> ProbeChange:
    def change(table: Table, values: Sequence[float]) -> None:
        table["seat"]["friction"] = values[0]

    return ProbeChange(
        "friction", (ProbeParameter("seat", "1", before, 0.0, 0.45),), change, "of the seats", prior="seat_friction"
    )


def _tip_friction(probe: Table) -> ProbeChange:
    before = float((probe.get("surface") or {}).get("friction", 0.0))

    def change(table: Table, values: Sequence[float]) -> None:
        table["surface"] = {**_rigid_or(table.get("surface")), "friction": values[0]}

    return ProbeChange(
        "friction", (ProbeParameter("tip", "1", before, 0.0, 0.9),), change, "of the tip", prior="tip_friction"
    )


def _rigid_or(surface: Table | None) -> Table:
    """The surface of the file; without one, ruby on steel without indentation."""
    return dict(surface) if surface is not None else {**_STEEL, "indentation": "left out"}


def _stylus_length(sections: Sequence[Table]) -> ProbeChange:
    """Another stylus of the same kind than the file's: its stem, the longest section, is longer or shorter."""
    stem = max(range(len(sections)), key=lambda place: float(sections[place]["length_mm"]))
    before = float(sections[stem]["length_mm"])

    def change(table: Table, values: Sequence[float]) -> None:
        table["stylus"][stem]["length_mm"] = before + values[0]
        table.pop("stylus_length_mm", None)  # follows from the sections

    whole = sum(float(one["length_mm"]) for one in sections)
    knobs = (ProbeParameter("mm", "mm", 0.0, SHORTEST_STEM_MM - before, LONGEST_STEM_MM - before),)
    return ProbeChange(
        "stylus_length", knobs, change, told=lambda v: {"mm": (v[0], "mm"), "stylus_length_mm": (whole + v[0], "mm")}
    )


def _compliance(stem: Sequence[Table]) -> ProbeChange:
    """A factor on the compliance of the stylus, the same for all sections and both directions."""
    sections = [stylus.StylusSection(**SectionTable.model_validate(one).model_dump()) for one in stem]
    lateral = 1e3 * stylus.lateral_compliance_mm_per_N(sections)

    def change(table: Table, values: Sequence[float]) -> None:
        for section in table["stylus"]:
            section["modulus_GPa"] = section["modulus_GPa"] / values[0]

    def told(values: Sequence[float]) -> dict[str, tuple[float, str]]:
        return {"factor": (values[0], "1"), "lateral_um_per_N": (lateral * values[0], "um/N")}

    return ProbeChange("compliance", (ProbeParameter("factor", "1", 1.0, 0.25, 20.0),), change, told=told)


def _force_gauge_changes() -> list[ProbeChange]:
    """Errors of the force gauge; the probe itself is not changed."""
    knobs = ProbeParameter("factor", "1", 1.0, 0.1, 10.0), ProbeParameter("N", "N", 0.0, -10.0, 10.0)

    def change_of(knob: ProbeParameter) -> Change:
        def change(table: Table, values: Sequence[float]) -> None:
            table[FORCE_GAUGE] = {**table.get(FORCE_GAUGE, {}), knob.name: values[0]}

        return change

    pairs = zip(GAUGE_KINDS, knobs, strict=True)
    return [ProbeChange(kind, (knob,), change_of(knob), shape="linear") for kind, knob in pairs]


def _pretravel_changes(table: Table) -> list[ProbeChange]:
    """Changes of a probe with a pre-travel function: another mean, and lobes of either shape."""
    nominal = float(table.get("pretravel_um", 0.0))
    lobes, phase_rad = float(table.get("amplitude_um", 0.0)), radians(3.0 * float(table.get("phase_deg", 0.0)))

    def mean(table: Table, values: Sequence[float]) -> None:
        table["pretravel_um"] = nominal + values[0]

    def lobed(values: Sequence[float]) -> dict[str, tuple[float, str]]:
        return {
            "amplitude_um": (hypot(*values), "um"),
            "phase_deg": (degrees(atan2(values[1], values[0])) / 3.0, "deg"),
        }

    def cosine(table: Table, values: Sequence[float]) -> None:
        table |= {"model": "lobed", **{name: value for name, (value, _) in lobed(values).items()}}

    def triangle(table: Table, values: Sequence[float]) -> None:
        table |= {"model": "triangular", "constant_um": values[0], "lobe_azimuth_deg": values[1], "more_um": values[2]}

    def wozniak(values: Sequence[float]) -> dict[str, tuple[float, str]]:
        constant, phase, more = values  # the offset beside triangular lobes: 0 for Wozniak's law alone
        return {"constant_um": (constant, "um"), "phase_deg": (phase, "deg"), "offset_um": (nominal + more, "um")}

    known = {"cos_um": lobes * cos(phase_rad), "sin_um": lobes * sin(phase_rad)}
    amplitudes = tuple(ProbeParameter(name, "um", value, -500.0, 500.0) for name, value in known.items())
    shape = (
        ProbeParameter("constant_um", "um", 0.0, 0.0, 1000.0),
        ProbeParameter("phase_deg", "deg", 0.0, -90.0, 90.0),
        ProbeParameter("more_um", "um", 0.0, -1000.0, 1000.0),
    )
    return [
        ProbeChange("effective_radius", (ProbeParameter("um", "um", 0.0, -nominal, 1000.0),), mean, shape="linear"),
        ProbeChange("probe_lobing", amplitudes, cosine, "cosine", "linear", told=lobed),
        ProbeChange("probe_lobing", shape, triangle, "triangular", "lobes", told=wozniak),
    ]
