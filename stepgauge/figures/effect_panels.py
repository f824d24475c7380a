"""Content of the panels of a diagnosis: each effect, and each form, as a quantity over its covariate."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

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
    runs_of,
)
from stepgauge.diagnosis.gaussian_processes.formula import EmpiricalLaw
from stepgauge.diagnosis.gaussian_processes.random_function import (
    BEAT,
    HARMONICS,
    HYSTERESIS,
    LAGGED,
    LENGTH,
    LEVELS,
    LOOP,
    RESTS,
    SAWTOOTH,
    SMOOTH,
    TREND,
    WANDERING,
    WAVE,
)
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.effects import Effect
from stepgauge.figures.style import CYCLE
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded

Drawn = Literal["line", "stairs", "marks"]
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
RUNS = "run along the gauge, cycle by cycle in each placement"
COUNTED = ("cycle", "placement", "face", RUNS)
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
STAIRS = (LEVELS,)
"""Forms that are fitted as levels with steps between them."""
MARKS = (HARMONICS,)
"""Forms with a value per direction of travel: there is nothing between the directions, and all are shown."""


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
    between the groups; ``drawn``: as a line, as steps or as marks; ``common``: whether all placements follow one law.
    """

    title: str
    label: str
    x: Array
    share_um: Array
    quantity: str
    weight: Array
    groups: tuple[Group, ...]
    split: bool = True
    drawn: Drawn = "line"
    common: bool = False

    def of(self, um: Array) -> Array:
        """Displacements along the approach as values of the quantity; NaN where they have too little information."""
        told = np.abs(self.weight) > FAINT * np.abs(self.weight).max()
        return np.divide(um, self.weight, out=np.full(len(um), np.nan), where=told)

    def seen(self, data: Residuals) -> NDArray[np.bool_]:
        """Rows of the placements in which the effect shows beside the origins; all, if the effect is one of origins."""
        if self.drawn in ("marks", "stairs"):
            return np.ones(len(data), bool)
        size = np.abs(data.without_origins(self.share_um))
        shows = size > SEEN * float(size.max())
        return np.isin(data.placement, data.placement[shows]) if shows.any() else np.ones(len(data), bool)


def panels(diagnosis: GaugeDiagnosis, laws: Sequence[EmpiricalLaw]) -> list[EffectPanel]:
    """Panels of the effects found that displace readings; effects on the scatter have none."""
    data = diagnosis.data
    named = [_panel_of(finding, data) for finding in diagnosis.findings if finding.share_um.any()]
    return [*named, *(_panel_of_law(law, data) for law in laws)][:MOST_PANELS]


def sides(data: Residuals) -> tuple[Group, ...]:
    """Fronts and backs."""
    return (
        Group(data.side > 0, CYCLE[0], ">", "fronts"),
        Group(data.side < 0, CYCLE[1], "<", "backs"),
    )


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
    along_gauge = bool(finding.effects) or _coherence(x, share * data.side) > _coherence(x, share)
    weight = mask(data, "gauge" if along_gauge else "approach")
    return EffectPanel(title, label, x, share, _along("gauge" if along_gauge else "approach"), weight, sides(data))


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


def _panel_of_law(law: EmpiricalLaw, data: Residuals) -> EffectPanel:
    form = law.located.form
    label, x = _law_against(law, data)
    weight = mask(data, law.side if law.side in ("gauge", *AXES) else "approach")
    quantity = _along(law.side if law.side in ("gauge", *AXES) else "approach")
    if form == LENGTH:
        weight = weight * length_mm(law.side, data) * 1e-3
        quantity = f"change {_length_words(law.side)} (µm/m)"
    groups, split = _law_groups(law, data)
    drawn: Drawn = "stairs" if form in STAIRS else "marks" if form in MARKS else "line"
    panel = EffectPanel(_title(law), label, x, law.share_um, quantity, weight, groups, split, drawn, not _apart(law))
    return panel if law.side not in ("gauge", *AXES) or form == LENGTH else _centred(panel, law, data)


def _apart(law: EmpiricalLaw) -> bool:
    """Whether placements are beside one another on the axis instead of overlapping."""
    return law.located.form == LEVELS or (law.located.covariate in WANDERING and law.period is None)


def _law_against(law: EmpiricalLaw, data: Residuals) -> tuple[str, Array]:
    """The covariate of the panel of a form."""
    form, name = law.located.form, law.located.covariate
    if form == LEVELS and name == "cycle" and len(np.unique(data.placement)) > 1:
        return RUNS, runs_of(data)[1].astype(float) + 1.0
    if name in ("side", WAY):
        name = "position"
    if form == RESTS:
        kept = round(law.located.numbers)
        return f"roots of the last {kept} rests, fading (s$^{{1/2}}$)", data.probings.rested(kept)
    x = covariate_values(name, data)
    if law.period is None:
        return label_of(name), x
    period = rounded(law.period, 4)
    if name == "time":
        return f"time within the period of {period} s (s)", np.asarray(data.probings.time_s % law.period, float)
    words, _, unit = label_of(name).removesuffix(")").partition(" (")
    of_period = f"{period} {unit}" if unit and unit != AS_RECORDED else period
    label = f"{words} within the period of {of_period}" + (f" ({unit})" if unit else "")
    return label, np.asarray(x % law.period, float)


def _law_groups(law: EmpiricalLaw, data: Residuals) -> tuple[tuple[Group, ...], bool]:
    """The groups of a form, and whether its law differs between them."""
    fronts, backs = sides(data)
    if law.located.covariate == WAY or law.located.form == HYSTERESIS:
        way = data.probings.way()
        there = Group(way > 0, CYCLE[2], ">", "on the way there", "-", "fitted law there")
        return (there, Group(way < 0, CYCLE[3], "<", "on the way back", "--", "fitted law back")), True
    if law.side in ("front", "back"):
        return (fronts if law.side == "front" else backs,), True
    return (fronts, backs), False


def _centred(panel: EffectPanel, law: EmpiricalLaw, data: Residuals) -> EffectPanel:
    """Without the constant that only shifts origins: one for all, or one for each separate placement."""
    group = data.placement if _apart(law) else np.zeros(len(data), int)
    value = panel.of(panel.share_um)
    told = np.isfinite(value)
    count = np.maximum(np.bincount(group[told], minlength=group.max() + 1), 1)
    middle = np.bincount(group[told], value[told], minlength=group.max() + 1) / count
    return replace(panel, share_um=panel.share_um - middle[group] * panel.weight)


def _title(law: EmpiricalLaw) -> str:
    covariate = covariate_words(law.located.covariate)
    if law.located.beside and law.located.form == SMOOTH:
        covariate += f" and {covariate_words(law.located.beside)}"
    form = TITLES.get(law.located.form, "structure with {covariate}, of a form that is not told")
    return f"no known law: {form.format(covariate=covariate)}"


def _along(side: str) -> str:
    return f"along {_direction(side)} (µm)"


def _length_words(side: str) -> str:
    return f"along {_direction(side)}" if side in AXES else "of length"


def _direction(side: str) -> str:
    return f"machine {side}" if side in AXES else f"the {side}"
