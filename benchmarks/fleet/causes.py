"""A hidden cause: whose it is, what it does to the readings, and what the truth says of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any

import numpy as np

from benchmarks.fleet.design import FIRST_DAY, Fleet, Recording
from benchmarks.fleet.parts import TIP_RADIUS_MM, Array, Gauge
from benchmarks.fleet.physics import Errors

CLEAR: dict[str, tuple[float, str]] = {
    "scale": (6.0, "ppm"),
    "squareness": (12.0, "urad"),
    "reversal": (2.0, "um"),
    "periodic": (1.2, "um"),
    "local_scale": (2.0, "um"),
    "certificate_scale": (6.0, "ppm"),
    "gauge_expansion": (6.0, "1e-6/K"),
    "block": (2.0, "um"),
    "wear": (1.5, "um/yr"),
    "temperature": (0.6, "K"),
    "radius": (2.0, "um"),
}
"""Strength 1, by kind, with its unit: rms of about 1 um on the readings of a 600 mm gauge, which is the noise of a poor
machine, and ten times and more of what is usual."""
SPREAD = 0.25
"""Sizes are drawn within this share of the above; machines of a line scatter by as much (one sigma, two at most)."""


@dataclass(frozen=True)
class Cause:
    """``start`` is a day, None where it was there from the first. ``details`` has what the kind needs beyond its size.

    ``rivals`` are (owner kind, owner, kind) that single recordings cannot tell it from; ``determined`` whether the
    crossing can; ``leftover_chi2`` what the best rival leaves of it.
    """

    owner_kind: str
    owner: str
    kind: str
    where: str
    size: float
    start: int | None = None
    details: dict[str, Any] = field(default_factory=dict)
    rivals: tuple[tuple[str, str, str], ...] = ()
    determined: bool = True
    leftover_chi2: float | None = None

    def acts(self, fleet: Fleet, recording: Recording) -> bool:
        """Whether its owner takes part in a recording at a time when it is there."""
        machine = fleet.machines[recording.machine]
        owner = {
            "machine": machine.name,
            "type": machine.line,
            "hall": machine.hall,
            "gauge": fleet.gauges[recording.gauge].name,
            "probe": recording.probe,
        }[self.owner_kind]
        return owner == self.owner and recording.day >= (self.start or 0)


def act(cause: Cause, errors: Errors, fleet: Fleet, recording: Recording) -> None:
    """Add what a cause does to the errors of a recording in which it acts."""
    axis = {"x": 0, "y": 1}.get(cause.where, 0)
    machine, gauge = fleet.machines[recording.machine], fleet.gauges[recording.gauge]
    own = cause.details.get("of_machine", {}).get(machine.name, cause.size)
    if cause.kind == "scale":
        errors.scale_ppm[axis] += own
    elif cause.kind == "reversal":
        errors.reversal_um[axis] += cause.size
    elif cause.kind == "periodic":
        phase = cause.details["phase_rad_of_machine"][machine.name]
        errors.waves.append((axis, cause.details["period_mm"], own, phase))
    elif cause.kind == "local_scale":
        errors.bumps.append((axis, cause.details["at_mm"], cause.details["sd_mm"], cause.size))
    elif cause.kind in ("block", "wear"):
        errors.face_um = errors.face_um + faces_um(cause, gauge, recording.day)
    else:
        _add_number(cause, errors, recording)


def _add_number(cause: Cause, errors: Errors, recording: Recording) -> None:
    """Kinds that are one number of the recording."""
    if cause.kind == "squareness":
        errors.squareness_urad += cause.size
    elif cause.kind == "certificate_scale":
        errors.certificate_ppm += cause.size
    elif cause.kind == "gauge_expansion":
        errors.expansion_per_K += cause.size * 1e-6
    elif cause.kind == "temperature":
        errors.gauge_K += cause.details["kelvin_of_day"][recording.day]
    elif cause.kind == "radius":
        errors.radius_um += cause.size
    else:
        raise ValueError(f"nothing is known of {cause.kind}")


def faces_um(cause: Cause, gauge: Gauge, day: int) -> Array:
    """Shift of every face along the gauge: a block moves as a whole, a worn face recedes into its block."""
    front = np.arange(2 * gauge.blocks) % 2 == 0
    block = np.arange(2 * gauge.blocks) // 2 + 1
    if cause.kind == "block":
        return np.where(block == int(cause.where), cause.size, 0.0)
    lost_um = cause.size * (day + 1.0) / 365.25
    if cause.where == "fronts":
        return np.where(front, lost_um, 0.0)
    return np.where(block <= cause.details["blocks"], np.where(front, lost_um, -lost_um), 0.0)


def bump_sd_mm(gauge: Gauge) -> float:
    """Standard deviation of a bump of the scale that reaches both touches of a block and hardly the next ones."""
    return 0.55 * (gauge.width_mm + 2.0 * TIP_RADIUS_MM)


def bump_on_faces_um(cause: Cause, recording: Recording, gauge: Gauge) -> Array:
    """What a local error of the scale does to the touches of each face, along the gauge."""
    axis = {"x": 0, "y": 1}[cause.where]
    tip_mm = gauge.nominal_mm - np.resize([TIP_RADIUS_MM, -TIP_RADIUS_MM], len(gauge.nominal_mm))
    place_mm = recording.middle_mm[axis] + (tip_mm - gauge.length_mm / 2.0) * recording.axis[axis]
    bump = np.exp(-0.5 * ((place_mm - cause.details["at_mm"]) / cause.details["sd_mm"]) ** 2)
    return np.asarray(cause.size * recording.axis[axis] * bump)


def truth_of(cause: Cause, fleet: Fleet, strength: float) -> dict[str, Any]:
    """What the sealed truth says of a cause."""
    return {
        "owner_kind": cause.owner_kind,
        "owner": cause.owner,
        "kind": cause.kind,
        "where": cause.where or None,
        "size": cause.size,
        "unit": CLEAR[cause.kind][1],
        "strength": strength,
        "start": None if cause.start is None else _iso(cause.start),
        "start_between": None if cause.start is None else _around(cause, fleet),
        "members": [machine.name for machine in fleet.machines if machine.line == cause.owner],
        "confounded_alone": bool(cause.rivals),
        "determined": cause.determined,
        "leftover_chi2": cause.leftover_chi2,
        "rivals": [_rival(rival, cause, fleet) for rival in cause.rivals],
        "settled_by": _settled_by(cause, fleet) if cause.determined else [],
        "details": cause.details,
    }


def _iso(day: int) -> str:
    return (FIRST_DAY + timedelta(days=int(day))).isoformat()


def _around(cause: Cause, fleet: Fleet) -> list[str]:
    """Last recording of the owner before the start, first one from it on."""
    days = fleet.day_of[fleet.owned(cause.owner_kind, cause.owner)]
    assert cause.start is not None
    return [_iso(days[days < cause.start].max()), _iso(days[days >= cause.start].min())]


def _rival(rival: tuple[str, str, str], cause: Cause, fleet: Fleet) -> dict[str, Any]:
    """Who it is, and what share of the recordings of both have both."""
    own, other = fleet.owned(cause.owner_kind, cause.owner), fleet.owned(*rival[:2])
    words = dict(zip(("owner_kind", "owner", "kind"), rival, strict=True))
    return {**words, "overlap": round(float(np.sum(own & other) / np.sum(own | other)), 4)}


def _settled_by(cause: Cause, fleet: Fleet, most: int = 20) -> list[dict[str, Any]]:
    """For the rivals that share most recordings: some with the owner and without the rival, and the reverse."""
    own, settled = fleet.owned(cause.owner_kind, cause.owner), []
    shared = {rival: int(np.sum(own & fleet.owned(*rival[:2]))) for rival in cause.rivals}
    for rival in sorted(cause.rivals, key=lambda rival: -shared[rival])[:3]:
        other = fleet.owned(*rival[:2])
        without, elsewhere = np.flatnonzero(own & ~other), np.flatnonzero(other & ~own)
        settled.append(
            {
                "rival": rival[1],
                "together": shared[rival],
                "owner_without_rival": [fleet.recordings[k].name for k in without[:most]],
                "rival_without_owner": [fleet.recordings[k].name for k in elsewhere[:most]],
            }
        )
    return settled
