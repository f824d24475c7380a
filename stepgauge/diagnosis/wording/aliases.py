"""Periods that evenly spaced places cannot tell apart, or cannot see (aliasing; Shannon, Proc. IRE 37 (1949) 10).

Where all places are whole steps ``d`` apart, waves whose frequencies differ by a whole number of 1/d agree at all of
them, and a wave whose period goes into d without remainder is a constant there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.effects.grids import FEWEST_ALONG, IN_STEP, LEADS_MM, common_step
from stepgauge.files.arrays import Array
from stepgauge.files.notation import significant

if TYPE_CHECKING:
    from stepgauge.diagnosis.residuals import Residuals
    from stepgauge.diagnosis.result import Finding

ALIKE = 0.1
"""Share of a step by which a whole number of leads may differ from it."""
SAME_PLACE = 1e-3
"""Share of the span within which readings are at one place."""
FEWEST_PLACES = 4
MOST_TOLD, IN_WORDS = 12, 6
MOST_TARGETS, FIRST_TARGETS = 60, 12
COVERAGE = 2.0
PART = 0.3
"""Of the spacing, by which targets depart from even ones (ISO 230-2, where no period is expected)."""
LEAST_ALONG = 0.2
"""Cosine to an axis from which on a gauge shows errors that repeat along it: it passes some pitches."""
SAME_BEATS = 0.1
"""Beats along the places below which two periods are one."""
WHOLE_BEAT = 0.99
"""Along the places, below which a wave may not come to its full amplitude at any of them."""
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class EvenSpacing:
    """Places in whole steps; in one unit of length or angle.

    ``spacing``: of neighbours; ``off``: rms departure of the places from it; ``places (n,)``: from low to high.
    """

    spacing: float
    off: float
    places: Array

    def alike(self, period: float, u: float = 0.0, unit_mm: float | None = None) -> list[float]:
        """Other periods that agree with one at all places: usual leads of screws first, then the longest first.

        ``u``: standard uncertainty of the period; ``unit_mm``: one unit in mm, None for angles, which have no leads.
        """
        most = int(max(IN_STEP * self.spacing / (2.0 * np.pi * max(self.off, 1e-12 * self.spacing)), 1.0))
        shortest = min(self.spacing / 10.0, LEADS_MM[0] / unit_mm if unit_mm else self.spacing / 10.0)
        k = np.arange(1.0, min(most, np.ceil(self.spacing / shortest)) + 1.0) / self.spacing
        frequency = np.abs(np.r_[k - 1.0 / period, k + 1.0 / period])
        span = float(np.ptp(self.places))
        frequency = np.sort(frequency[(frequency > FEWEST_ALONG / span)])
        other = (np.diff(frequency, prepend=-np.inf) * span > SAME_BEATS) & (
            np.abs(frequency - 1.0 / period) * span > SAME_BEATS
        )
        found = 1.0 / frequency[other]
        met = [bool(unit_mm) and is_lead(one * unit_mm, u * (one / period) ** 2 * unit_mm) for one in found]
        return [float(one) for one in found[np.argsort(np.logical_not(met), kind="stable")]][:MOST_TOLD]

    def beats(self, period: float) -> float:
        """How often along the places a wave beats against two readings in a period, or against none of it.

        Each place stands for a spacing, so that a circle counts whole. With less than a whole beat the readings may all
        lie near its zeros: they show a part of its amplitude.
        """
        in_halves = 2.0 * self.spacing / period
        return abs(in_halves - round(in_halves)) * (float(np.ptp(self.places)) / self.spacing + 1.0) / 2.0

    def aliases(self, period: float, u: float, unit: str, unit_mm: float | None) -> dict[str, Any]:
        """What a finding states besides its period, JSON types; empty where no other period is like it."""
        periods = self.alike(period, u, unit_mm)
        usual = [one for one in periods if unit_mm and is_lead(one * unit_mm, u * (one / period) ** 2 * unit_mm)]
        found = {f"spacing_{unit}": self.spacing, f"periods_{unit}": periods, f"usual_{unit}": usual}
        return {**found, "amplitude_is_least": self.beats(period) < WHOLE_BEAT} if periods else {}

    def uneven(self) -> list[float]:
        """The same places with irregular parts of the spacing, none of them a fraction of another; the ends stay."""
        part = (np.arange(1.0, len(self.places) - 1.0) * GOLDEN) % 1.0 * 2.0 - 1.0
        moved = self.places + PART * self.spacing * np.r_[0.0, part, 0.0]
        decimals = int(max(2 - np.floor(np.log10(self.spacing)), 0))
        return [float(one) for one in np.round(moved, decimals)]


def periods_of(aliases: Mapping[str, Any]) -> tuple[list[float], str]:
    """The periods that a finding states besides its own, and their unit."""
    name, periods = next((item for item in aliases.items() if item[0].startswith("periods_")), ("periods_", []))
    return list(periods), name.removeprefix("periods_")


def aliases_words(aliases: Mapping[str, Any], language: str = "en") -> str:
    """What such a finding means besides, in a sentence; empty without aliases."""
    periods, unit = periods_of(aliases)
    if not periods:
        return ""
    usual, step = aliases[f"usual_{unit}"], significant(aliases[f"spacing_{unit}"], 4)
    others = ", ".join([significant(one) for one in periods if one not in usual][: max(IN_WORDS - len(usual), 1)])
    leads = listed([significant(one) for one in usual], language=language)
    key = "usual_lead" if len(usual) < 2 else "usual_leads"
    first = say(key, language, leads=leads, unit=unit) if usual else ""
    least = say("amplitude_is_least", language) if aliases.get("amplitude_is_least") else ""
    return say("aliases", language, step=step, unit=unit, first=first, others=others) + least


def bounded(parameters: Mapping[str, Any], aliases: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a finding, its amplitude as the lower bound that it is where less than a beat shows."""
    least = bool(aliases.get("amplitude_is_least"))
    return {
        name: {**one, "bound": "least"} if least and name.startswith("amplitude") else one
        for name, one in parameters.items()
    }


def uneven_targets(even: EvenSpacing, unit: str) -> str:
    """The measurement that tells the aliases of a period apart."""
    every = [f"{one:.12g}" for one in even.uneven()]
    places = ", ".join(every if len(every) <= MOST_TARGETS else [*every[:FIRST_TARGETS], "..", every[-1]])
    return (
        "measure at targets whose spacing is changed by irregular parts, by up to 30 % of it as ISO 230-2 asks, and"
        f" diagnose that recording: for example at {places} {unit}."
    )


def aliases_of(finding: Finding, data: Residuals) -> dict[str, Any]:
    """Periods along the axis of a finding that evenly spaced faces cannot tell from its own; else none."""
    period = finding.parameters.get("period_mm")
    steps = None if period is None else even(data.probings.coordinate_mm(str(finding.choices["axis"])))
    return {} if steps is None or period is None else steps.aliases(period.value, period.u or 0.0, "mm", 1.0)


def even_steps_mm(data: Residuals) -> dict[str, float]:
    """The step by machine axis, mm, in which all fronts were probed, and all backs, whatever lies between the two.

    Only where usual leads of screws go into it: an error with such a period is one shift of all fronts, and another
    one of all backs.
    """
    found, placements = {}, np.unique(data.frame["placement"])
    axes = np.abs([data.probings.setting.axis[int(one)] for one in placements])
    for number, axis in enumerate("xyz"):
        at, along = data.probings.coordinate_mm(axis), axes[data.placement, number] > LEAST_ALONG
        steps = [even(at[along & (data.side == side)]) for side in (1.0, -1.0)]
        spacing = [one.spacing for one in steps if one is not None]
        if len(spacing) == 2 and np.ptp(spacing) < SAME_PLACE * spacing[0] and leads_into_mm(spacing[0]):
            found[axis] = spacing[0]
    return found


def is_lead(period_mm: float, u_mm: float) -> bool:
    """Whether a period is a usual lead of a screw within its expanded uncertainty."""
    return any(abs(period_mm - lead) <= COVERAGE * u_mm for lead in LEADS_MM)


def leads_into_mm(*steps_mm: float) -> list[float]:
    """Usual leads of screws of which each step has a whole number, mm."""
    turns = np.array(steps_mm)[:, None] / LEADS_MM
    alike = (turns > 0.5) & (np.abs(turns - np.round(turns)) < ALIKE)
    return [LEADS_MM[int(place)] for place in np.flatnonzero(alike.all(axis=0))]


def even(readings_at: ArrayLike) -> EvenSpacing | None:
    """The common step of the places of readings (:func:`.common_step`), or None where they have none."""
    values = np.sort(np.asarray(readings_at, float))
    if len(values) < FEWEST_PLACES:
        return None
    apart = np.diff(values) > SAME_PLACE * max(float(np.ptp(values)), 1e-12)
    place = np.r_[0, np.cumsum(apart)]
    places = np.bincount(place, values) / np.bincount(place)
    if len(places) < FEWEST_PLACES:
        return None
    found = common_step(places)
    return None if found is None else EvenSpacing(*found, places)
