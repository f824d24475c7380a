"""Residuals before and after a diagnosis, and every effect with its law drawn through the data.

``residuals``: above before, below after, against what they may depend on, with two-sigma lines of the noise, and their
distribution beside that of the noise alone. ``effects``: one panel per effect; what is left when all *other* effects
are taken out, so that the law is seen through the data that it was fitted to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.forms import REST, TOUCHES, TURNING, covariates, pause_of
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.result import Diagnosis, Finding
from stepgauge.diagnose.unknown_law import UnknownLaw, modelled, rest_um
from stepgauge.effects import Effect
from stepgauge.figures.style import COLORS, CYCLE, FORMATS, figure_style, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
RESIDUALS, EFFECTS = "residuals", "effects"
FRONT, BACK = (CYCLE[0], ">", "fronts"), (CYCLE[1], "<", "backs")
MOST_COLUMNS = 3
MOST_PANELS = 6
MOST_POINTS = 4000
"""Points drawn of each kind; more would hide each other and swell the file."""
MOST_MEANS = 24
FEWEST_IN_MEAN = 3
SEEN = 0.05
"""Share of an effect's largest displacement below which a placement does not show it."""
LABELS = {
    "position": "position along the gauge / mm",
    "machine x": "machine x / mm",
    "machine y": "machine y / mm",
    "machine z": "machine z / mm",
    "time": "time / min",
    "order": "order of probing",
    "cycle": "cycle",
    "speed": "speed / mm/s",
    TURNING: f"{TURNING} / mm",
    REST: f"{REST} / s",
    "azimuth": "azimuth of the approach / deg",
    "placement": "placement",
    "face": "face",
}
OF_COVARIATE = {"position": "position", "time": "time", "speed": "speed", "face": "face", "azimuth": "azimuth"}
TIME_MIN = 60.0


@dataclass(frozen=True)
class Panel:
    """An effect to be drawn: its name, what it is drawn against, and its displacement by row along the approach."""

    title: str
    label: str
    x: Array
    share_um: Array

    def along_gauge(self, side: Array) -> bool:
        """Whether fronts and backs follow one law along the gauge rather than along the approach."""
        return _coherence(self.x, self.share_um * side) > _coherence(self.x, self.share_um)


def figure_names(diagnosis: Diagnosis, laws: Sequence[UnknownLaw], suffix: str = "png") -> list[str]:
    """Names of the figures of a diagnosis; the second is there only where something is to be drawn in it."""
    names = [RESIDUALS, EFFECTS] if panels(diagnosis, laws) else [RESIDUALS]
    return [f"{name}.{suffix}" for name in names]


def draw_diagnosis(
    folder: str | Path, diagnosis: Diagnosis, laws: Sequence[UnknownLaw], suffix: str = "png"
) -> list[Path]:
    """Draw the figures of a diagnosis into a folder; those of an earlier one that no longer hold are removed."""
    target = Path(folder)
    found = panels(diagnosis, laws)
    figures = [residual_figure(diagnosis, laws)] + ([effect_figure(diagnosis, laws)] if found else [])
    paths = [target / name for name in figure_names(diagnosis, laws, suffix)]
    for figure, path in zip(figures, paths, strict=True):
        save_figure(figure, path)
    for stale in {target / f"{name}.{kind}" for name in (RESIDUALS, EFFECTS) for kind in FORMATS} - set(paths):
        stale.unlink(missing_ok=True)
    return paths


def residual_figure(diagnosis: Diagnosis, laws: Sequence[UnknownLaw] = ()) -> Figure:
    """Residuals before and after against up to three covariates, and their distribution."""
    data = diagnosis.data
    drawn = _covariates_that_matter(diagnosis)
    after = rest_um(diagnosis, laws)
    with figure_style():
        figure = new_figure(180.0, 105.0)
        grid = figure.subplots(2, len(drawn) + 1, sharey=True, squeeze=False, width_ratios=[1.0] * len(drawn) + [0.55])
        limit = _limit(diagnosis)
        grid[0][0].set_ylim(-limit, limit)
        for axes, um, name in zip(grid, (diagnosis.before_um, after), ("before", "after"), strict=True):
            for one, covariate in zip(axes, drawn, strict=False):
                _scatter(one, covariate_values(covariate, data), um, data)
                _noise_lines(one, diagnosis.noise.sigma_um)
                _ring_outliers(one, covariate_values(covariate, data), np.clip(um, -limit, limit), diagnosis)
            _distribution(axes[-1], um[np.isfinite(diagnosis.noise.by_row_um)], diagnosis.noise.sigma_um, name)
            axes[0].set_ylabel(f"residual {name} / µm")
        for one, covariate in zip(grid[1], drawn, strict=False):
            one.set_xlabel(LABELS.get(covariate, covariate))
        grid[1][-1].set_xlabel("density")
        _legend(figure, grid[0][0], grid[0][-1])
    return figure


def effect_figure(diagnosis: Diagnosis, laws: Sequence[UnknownLaw] = ()) -> Figure:
    """Every effect with its law drawn through what the other effects leave."""
    found = panels(diagnosis, laws)
    rest = rest_um(diagnosis, laws)
    rows = (len(found) + 1) // 2 if len(found) > 1 else 1
    with figure_style():
        figure = new_figure(180.0 if len(found) > 1 else 120.0, 62.0 * rows + 8.0)
        grid = figure.subplots(rows, min(len(found), 2), squeeze=False)
        for axes, panel in zip(grid.flat, found, strict=False):
            _effect_panel(axes, panel, rest + panel.share_um, diagnosis)
        for axes in grid.flat[len(found) :]:
            axes.set_axis_off()
        _legend(figure, grid.flat[0])
    return figure


def panels(diagnosis: Diagnosis, laws: Sequence[UnknownLaw]) -> list[Panel]:
    """What can be drawn of the effects found: those that move readings, and those that widen their scatter do not."""
    data = diagnosis.data
    named = [_panel_of(finding, data) for finding in modelled(diagnosis, laws) if finding.share_um.any()]
    return [*named, *(_panel_of_law(law, data) for law in laws)][:MOST_PANELS]


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
    found = {one.name: one.values for one in covariates(data)}.get(covariate)
    values = data.probings.certified_mm() if found is None else found
    return values / TIME_MIN if covariate == "time" else values


def _covariates_that_matter(diagnosis: Diagnosis) -> list[str]:
    """Where the disagreement was located first, then position and time."""
    located = [one.covariate for one in (*diagnosis.located, *diagnosis.unexplained) if one.covariate != "side"]
    always = ["position", "time" if diagnosis.data.has_time else "order"]
    return list(dict.fromkeys(always + located))[:MOST_COLUMNS]


def _panel_of(finding: Finding, data: Residuals) -> Panel:
    assert finding.effect is not None
    title = finding.kind.replace("_", " ")
    chosen = [str(v) for v in finding.choices.values() if isinstance(v, str | int)]
    title = f"{title} ({', '.join(chosen)})" if chosen else title
    label, x = _against(finding.effect, data)
    return Panel(title, label, x, finding.share_um)


def _against(effect: Effect, data: Residuals) -> tuple[str, Array]:
    """What an effect is drawn against; one that repeats, against the place within its period."""
    values = {p.name: getattr(effect, p.name) for p in effect.parameters()}
    if "period_mm" in values:
        axis, period = values["axis"], values["period_mm"]
        return f"machine {axis} within the period of {period:.4g} mm / mm", data.probings.coordinate_mm(axis) % period
    if "period_s" in values:
        return f"time within the period of {values['period_s']:.4g} s / s", data.probings.time_s % values["period_s"]
    if "frequency_hz" in values:
        return f"phase at {values['frequency_hz']:.5g} Hz / periods", data.probings.time_s * values[
            "frequency_hz"
        ] % 1.0
    name = _covariate_of(effect, values)
    return LABELS.get(name, name), covariate_values(name, data)


def _covariate_of(effect: Effect, values: dict[str, object]) -> str:
    first = effect.covariates[0]
    if first == "coordinate":
        plane = values.get("plane")
        axis = plane[1] if isinstance(plane, str) else values.get("travel_axis") or values["axis"]
        return f"machine {axis}"
    if first == "order":
        return f"{TOUCHES} of {round(float(str(values['pause_s'])))} s"
    return OF_COVARIATE.get(first, "position")


def _panel_of_law(law: UnknownLaw, data: Residuals) -> Panel:
    name = law.located.covariate
    title = f"no known law: {law.located.form} in {name}"
    if law.period is not None:
        scaled = law.period / TIME_MIN if name == "time" else law.period
        return Panel(
            title, f"{LABELS.get(name, name)}, within its period", covariate_values(name, data) % scaled, law.share_um
        )
    covariate = "position" if name == "side" else name
    return Panel(title, LABELS.get(covariate, covariate), covariate_values(covariate, data), law.share_um)


def _sides(data: Residuals) -> list[tuple[NDArray[np.bool_], str, str, str]]:
    return [(data.side > 0, *FRONT), (data.side < 0, *BACK)]


def _scatter(axes: Axes, x: Array, um: Array, data: Residuals, alpha: float = 0.55) -> None:
    for rows, colour, marker, label in _sides(data):
        some = _thinned(np.flatnonzero(rows))
        axes.plot(
            x[some],
            um[some],
            linestyle="none",
            marker=marker,
            color=colour,
            markersize=2.4,
            markeredgewidth=0,
            alpha=alpha,
            label=label,
            rasterized=True,
        )
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)


def _thinned(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Evenly some of many rows."""
    if len(rows) <= MOST_POINTS:
        return rows
    return rows[np.linspace(0, len(rows) - 1, MOST_POINTS).astype(int)]


def _noise_lines(axes: Axes, sigma_um: float) -> None:
    for sign in (-2.0, 2.0):
        axes.axhline(
            sign * sigma_um, color="black", linewidth=0.7, linestyle=(0, (4, 3)), label="± two sigma of the noise"
        )


def _ring_outliers(axes: Axes, x: Array, um: Array, diagnosis: Diagnosis) -> None:
    rows = diagnosis.noise.outliers
    if rows.size:
        axes.plot(
            x[rows], um[rows], "o", color="black", markerfacecolor="none", markersize=6, label="outlier", clip_on=False
        )


def _limit(diagnosis: Diagnosis) -> float:
    """Room for everything but outliers far away, whose rings are drawn at the rim."""
    used = np.isfinite(diagnosis.noise.by_row_um)
    before = np.abs(diagnosis.before_um[used])
    return 1.1 * max(float(before.max(initial=0.0)), 3.0 * diagnosis.noise.sigma_um, 1e-3)


def _distribution(axes: Axes, um: Array, sigma_um: float, name: str) -> None:
    """Histogram lying on its side, with the noise alone as a line."""
    colour = COLORS[name]
    reach = max(float(np.abs(um).max(initial=0.0)), 3.0 * sigma_um, 1e-3)
    bins = np.linspace(-reach, reach, int(np.clip(2.0 * np.sqrt(len(um)), 11, 61)))
    axes.hist(um, bins.tolist(), density=True, orientation="horizontal", color=colour, alpha=0.6, linewidth=0)
    if sigma_um > 0.0:
        y = np.linspace(-reach, reach, 301)
        density = np.exp(-0.5 * (y / sigma_um) ** 2) / (sigma_um * np.sqrt(2.0 * np.pi))
        axes.plot(density, y, color="black", linewidth=1.0, label="noise of a probing")
    axes.set_title(f"rms {np.sqrt((um**2).mean()):.3g} µm", loc="left")
    axes.spines[["top", "right"]].set_visible(False)


def _effect_panel(axes: Axes, panel: Panel, um: Array, diagnosis: Diagnosis) -> None:
    """Placements in which the effect does not show are left out: they would only hide it."""
    data = diagnosis.data
    along_gauge = panel.along_gauge(data.side)
    sign = data.side if along_gauge else np.ones(len(data))
    seen = np.abs(panel.share_um) > SEEN * float(np.abs(panel.share_um).max())
    seen = np.isin(data.placement, data.placement[seen]) & np.isfinite(diagnosis.noise.by_row_um)
    _scatter(axes, panel.x, np.where(seen, um * sign, np.nan), data, 0.3)
    for rows, colour, marker, _ in _sides(data):
        for placement in np.unique(data.placement[seen]):
            group = rows & seen & (data.placement == placement)
            if group.any():
                _law_line(axes, panel.x[group], (panel.share_um * sign)[group])
                _means(axes, panel.x[group], (um * sign)[group], colour, marker, diagnosis.noise.sigma_um)
    axes.set_title(panel.title, loc="left")
    axes.set_xlabel(panel.label)
    axes.set_ylabel(f"along the {'gauge' if along_gauge else 'approach'} / µm")


def _coherence(x: Array, um: Array) -> float:
    """How much of a displacement is left in the means of neighbouring rows."""
    edges = np.quantile(np.unique(x), np.linspace(0, 1, MOST_MEANS + 1)[1:-1])
    index = np.searchsorted(edges, x, side="left")
    count = np.maximum(np.bincount(index), 1)
    return float((np.bincount(index, um) ** 2 / count).sum())


def _law_line(axes: Axes, x: Array, share: Array) -> None:
    """The law as a line where it depends on this covariate alone, else as dots."""
    order = np.argsort(x, kind="stable")
    x, share = x[order], share[order]
    steps = np.abs(np.diff(share)).sum()
    smooth = steps <= 6.0 * max(float(np.ptp(share)), 1e-12)
    style: dict[str, Any] = {"linestyle": "-"} if smooth else {"linestyle": "none", "marker": ".", "markersize": 2.0}
    some = _thinned(np.arange(len(x)))
    axes.plot(x[some], share[some], color="black", linewidth=1.1, zorder=5, label="fitted law", **style)


def _means(axes: Axes, x: Array, um: Array, colour: str, marker: str, sigma_um: float) -> None:
    """Means of neighbouring rows with twice their standard error by the noise: they show what hides in the scatter."""
    levels = np.unique(x)
    edges = np.quantile(levels, np.linspace(0, 1, min(MOST_MEANS, len(levels)) + 1)[1:-1])
    index = np.searchsorted(edges, x, side="left")
    count = np.bincount(index)
    keep = count >= FEWEST_IN_MEAN
    if not keep.any():
        return
    weight = np.maximum(count, 1)
    middle, mean = np.bincount(index, x) / weight, np.bincount(index, um) / weight
    axes.errorbar(
        middle[keep],
        mean[keep],
        2.0 * sigma_um / np.sqrt(count[keep]),
        linestyle="none",
        marker=marker,
        markersize=3.6,
        color=colour,
        markeredgecolor="white",
        markeredgewidth=0.4,
        elinewidth=0.9,
        zorder=6,
        label="means ± two standard errors",
    )


def _legend(figure: Figure, *panels: Axes) -> None:
    entries: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(list(entries.values()), list(entries), loc="outside upper center", ncols=5, frameon=False)
