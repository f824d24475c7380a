"""Content of the panels of a diagnosis: each effect, and each form, as a quantity over its covariate."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import (
    AXES,
    REST,
    TOUCHES,
    TURNING,
    WAY,
    covariates,
    length_mm,
    mask,
    pause_of,
)
from stepgauge.diagnosis.gaussian_processes.random_function import (
    BEAT,
    HARMONICS,
    HYSTERESIS,
    LAGGED,
    LENGTH,
    LEVELS,
    LOOP,
    PERIODIC,
    RESTS,
    SAWTOOTH,
    SMOOTH,
    TREND,
    WANDERING,
    WAVE,
)
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis, Located
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.effects import Effect
from stepgauge.figures.style import CYCLE
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded

MOST_PANELS = 6
MOST_MEANS = 24
FAINT = 0.3
"""Share of the largest weight below which a reading has too little information on the quantity to be drawn."""
SEEN = 0.05
"""Share of an effect's largest displacement below which a placement does not show it."""
TIME_MIN = 60.0
AS_RECORDED = "as recorded"
"""Text for the unit of a column without a stated unit."""
LABELS = {
    "position": "position along the gauge (mm)",
    "machine x": "machine x (mm)",
    "machine y": "machine y (mm)",
    "machine z": "machine z (mm)",
    "time": "time (min)",
    "order": "order of probing",
    "cycle": "cycle",
    "speed": "speed (mm/s)",
    TURNING: f"{TURNING} (mm)",
    REST: f"{REST} (s)",
    "azimuth": "azimuth of the approach (°)",
    "placement": "placement",
    "face": "face",
}
COUNTED = ("cycle", "placement", "face")
"""Labels of axes with whole numbers only."""
UNITS = {"C": "°C", "um": "µm", "percent": "%", "pct": "%", "deg": "°", "mm_s": "mm/s", "um_m": "µm/m"}
UNITS |= {unit: unit for unit in ("K", "mm", "m", "s", "min", "h", "N", "Pa", "hPa", "kPa", "bar", "V", "A", "W", "Hz")}
"""Units at the end of the name of a column, and their printed form."""
OF_COVARIATE = {"position": "position", "time": "time", "speed": "speed", "face": "face", "azimuth": "azimuth"}
TITLES = {
    TREND: "in proportion to {covariate}",
    SMOOTH: "a smooth function of {covariate}",
    LAGGED: "follows {covariate} with a lag",
    WAVE: "a periodic function of {covariate}",
    SAWTOOTH: "a sawtooth of {covariate}",
    LENGTH: "a length that changes with {covariate}",
    BEAT: "a wave along the gauge that changes with {covariate}",
    HYSTERESIS: "hysteresis of {covariate}",
    RESTS: "a memory of rests",
    LEVELS: "every {covariate} off by an amount of its own",
    LOOP: "another curve on the way back",
    HARMONICS: "depends on the direction of approach",
}


@dataclass(frozen=True)
class Group:
    """Rows with one style: colour, marker and name of the readings, ``line`` and ``law`` of their law."""

    rows: NDArray[np.bool_]
    colour: str
    marker: str
    name: str
    line: str = "-"
    law: str = "fitted law"


@dataclass(frozen=True)
class EffectPanel:
    """An effect as a quantity that is drawn over a covariate.

    ``x (n,)``: the covariate, named by ``label``; ``share_um (n,)``: displacement along the approach; ``weight (n,)``:
    displacement of each reading by one unit of ``quantity``, um along the approach; ``split``: whether the law differs
    between the groups; ``common``: whether all placements follow one law; ``seen (n,)``: :meth:`rows_seen`.
    """

    title: str
    label: str
    x: Array
    share_um: Array
    quantity: str
    weight: Array
    groups: tuple[Group, ...]
    split: bool = True
    common: bool = False
    seen: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))

    def of(self, um: Array) -> Array:
        """Displacements along the approach as values of the quantity; NaN where they have too little information."""
        told = np.abs(self.weight) > FAINT * np.abs(self.weight).max()
        return np.divide(um, self.weight, out=np.full(len(um), np.nan), where=told)

    def rows_seen(self, data: Residuals) -> NDArray[np.bool_]:
        """Rows of the placements in which the effect shows beside the origins; all, if the effect is one of origins."""
        if self.label in COUNTED:
            return np.ones(len(data), bool)
        size = np.abs(data.without_origins(self.share_um))
        shows = size > SEEN * float(size.max())
        return np.isin(data.placement, data.placement[shows]) if shows.any() else np.ones(len(data), bool)


def panels(diagnosis: GaugeDiagnosis) -> list[EffectPanel]:
    """Panels of what was found to displace readings, named or not; effects on the scatter have none."""
    data = diagnosis.data
    named = [_panel_of(finding, data) for finding in diagnosis.findings if finding.share_um.any()]
    return [*named, *(_panel_of_form(form, data) for form in diagnosis.forms)][:MOST_PANELS]


def sides(front: NDArray[np.bool_]) -> tuple[Group, ...]:
    """Fronts and backs."""
    return Group(front, CYCLE[0], ">", "fronts"), Group(~front, CYCLE[1], "<", "backs")


def label_of(covariate: str) -> str:
    """The label of an axis for a covariate, with its known unit or that at the end of its name."""
    if covariate in LABELS or covariate.startswith(TOUCHES):
        return LABELS.get(covariate, covariate)
    for suffix, unit in sorted(UNITS.items(), key=lambda one: -len(one[0])):
        if covariate.endswith(f"_{suffix}"):
            return f"{covariate_words(covariate)} ({unit})"
    return f"{covariate_words(covariate)} ({AS_RECORDED})"


def covariate_words(covariate: str) -> str:
    """A covariate in words: a column without underscores and unit."""
    ends = "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True))
    return re.sub(f"_({ends})$", "", covariate).replace("_", " ")


def covariate_values(covariate: str, data: Residuals) -> Array:
    """Values of a covariate by its name, in the unit of its label."""
    if covariate == "azimuth":
        cosine, sine = data.probings.lateral_share()
        return np.degrees(np.arctan2(sine, cosine))
    if covariate in ("placement", "face", "cycle"):
        return data.frame[covariate].to_numpy(float)
    if covariate.startswith("machine "):
        return data.probings.coordinate_mm(covariate[-1])
    if covariate == "position":
        return data.probings.certified_mm()
    if covariate == "order":
        order = np.empty(len(data))
        order[data.order] = np.arange(len(data))
        return order
    if covariate.startswith(TOUCHES):
        return data.probings.touches_since_pause(pause_of(covariate))
    if covariate == "time":
        return data.probings.time_s / TIME_MIN
    return next(one.values for one in covariates(data) if one.name == covariate)


def _panel_of(finding: Finding, data: Residuals) -> EffectPanel:
    title = name_of(finding.kind)
    chosen = [str(v) for v in finding.choices.values() if isinstance(v, str | int)]
    title = f"{title} ({', '.join(chosen)})" if chosen else title
    label, x = _against(finding.effect, data)
    share = finding.share_um
    side = "gauge" if finding.effects else _along_what(x, share, data)
    return EffectPanel(title, label, x, share, _along(side), mask(data, side), sides(data.side > 0))


def _along_what(x: Array, um: Array, data: Residuals) -> str:
    """Whether a displacement is the more even along the gauge or along the approach."""
    return "gauge" if _coherence(x, um * data.side) > _coherence(x, um) else "approach"


def _coherence(x: Array, um: Array) -> float:
    """Share of a displacement that remains in the means of neighbouring rows."""
    edges = np.quantile(np.unique(x), np.linspace(0, 1, MOST_MEANS + 1)[1:-1])
    index = np.searchsorted(edges, x, side="left")
    count = np.maximum(np.bincount(index), 1)
    return float((np.bincount(index, um) ** 2 / count).sum())


def _against(effect: Effect | None, data: Residuals) -> tuple[str, Array]:
    """The covariate of a panel; for a periodic effect, the position within its period, for many at once that at all."""
    if effect is None:
        return label_of("position"), covariate_values("position", data)
    values = {p.name: getattr(effect, p.name) for p in effect.parameters()}
    if "period_mm" in values:
        axis, period = values["axis"], values["period_mm"]
        return f"machine {axis} within the period of {period:.4g} mm (mm)", data.probings.coordinate_mm(axis) % period
    if "period_s" in values:
        period = values["period_s"]
        return f"time within the period of {rounded(period, 4)} s (s)", data.probings.time_s % period
    if "frequency_hz" in values:
        phase = data.probings.time_s * values["frequency_hz"] % 1.0
        return f"phase at {values['frequency_hz']:.5g} Hz (periods)", phase
    name = _covariate_of(effect, values)
    if name == "speed" and all(one.name != name for one in covariates(data)):
        name = "position"
    return label_of(name), covariate_values(name, data)


def _covariate_of(effect: Effect, values: dict[str, object]) -> str:
    first = effect.covariates[0]
    if first == "coordinate":
        plane = values.get("plane")
        axis = plane[1] if isinstance(plane, str) else values.get("travel_axis") or values["axis"]
        return "position" if axis == "all" else f"machine {axis}"
    if first == "order":
        return f"{TOUCHES} of {round(float(str(values['pause_s'])))} s"
    return OF_COVARIATE.get(first, "position")


def _panel_of_form(form: Located, data: Residuals) -> EffectPanel:
    label, x = _form_against(form, data)
    groups, split = _form_groups(form, data)
    along_approach = {"say": "approach"} in form.phrases
    side = form.side if form.side in AXES else "approach" if along_approach else "gauge"
    weight, quantity = mask(data, side), _along(side)
    if form.form == LENGTH:
        weight = weight * length_mm(side, data) * 1e-3
        quantity = f"change {_along_words(side) if side in AXES else 'of length'} (µm/m)"
    apart = form.form == LEVELS or (form.covariate in WANDERING and _period(form) is None)
    return EffectPanel(_title(form), label, x, form.share_um, quantity, weight, groups, split, not apart)


def _period(form: Located) -> float | None:
    return float(np.atleast_1d(form.numbers)[0]) if form.form in PERIODIC else None


def _form_against(form: Located, data: Residuals) -> tuple[str, Array]:
    """The covariate of the panel of a form; of a periodic one, the part of its period."""
    name, period = "position" if form.covariate == WAY else form.covariate, _period(form)
    label, x = label_of(name), covariate_values(name, data)
    if period is None:
        return label, x
    if name == "time":
        return f"time within the period of {rounded(period, 4)} s (s)", np.asarray(data.probings.time_s % period)
    words, _, unit = label.removesuffix(")").partition(" (")
    known = f" {unit}" * (unit not in ("", AS_RECORDED))
    return f"{words} within the period of {rounded(period, 4)}{known} ({unit or '1'})", np.asarray(x % period)


def _form_groups(form: Located, data: Residuals) -> tuple[tuple[Group, ...], bool]:
    """The groups of a form, and whether its law differs between them."""
    if form.covariate == WAY or form.form == HYSTERESIS:
        way = data.probings.way()
        there = Group(way > 0, CYCLE[2], ">", "on the way there", "-", "fitted law there")
        return (there, Group(way < 0, CYCLE[3], "<", "on the way back", "--", "fitted law back")), True
    return sides(data.side > 0), False


def _title(form: Located) -> str:
    covariate = covariate_words(form.covariate)
    if form.beside and form.form == SMOOTH:
        covariate += f" and {covariate_words(form.beside)}"
    words = TITLES.get(form.form, "structure with {covariate}, of a form that is not told")
    return f"no known law: {words.format(covariate=covariate)}"


def _along(side: str) -> str:
    return f"{_along_words(side)} (µm)"


def _along_words(side: str) -> str:
    return f"along {f'machine {side}' if side in AXES else f'the {side}'}"
