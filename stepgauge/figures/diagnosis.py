"""Residuals before and after a diagnosis, and every effect with its law drawn through the data.

``residuals``: before (upper panels) and after (lower panels) against covariates, with two-sigma lines of the noise, and
their distribution beside that of the noise alone. ``effects``: one panel per effect with the residuals of all *other*
effects, so that the law is drawn through the data to which it was fitted.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import WAY
from stepgauge.diagnosis.result import Diagnosis, GaugeDiagnosis
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.figures.effect_panels import (
    COUNTED,
    MOST_MEANS,
    EffectPanel,
    Group,
    covariate_values,
    label_of,
    panels,
    sides,
)
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, draw_before_and_after, figure_style, new_figure
from stepgauge.files.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


OVERVIEW, RESIDUALS, EFFECTS = "overview", "residuals", "effects"
MOST_COLUMNS = 3
MOST_POINTS = 4000
"""Largest number of points of each kind; more would overlap and enlarge the file."""
ONE_LINE = 0.02
"""Part of the height of a panel within which the ends of lines are named together."""
FEWEST_IN_MEAN = 3
ROWS_IN_MEAN = 8
"""Rows in a mean of readings at different positions."""
TITLE_CHARACTERS = {1: 66, 2: 48}
"""Longest line of a title, by the number of panels side by side."""
GRAIN = 1e-3
"""Share of the axis within which positions count as the same."""


@dataclass(frozen=True)
class DrawnDiagnosis:
    """What the figures of a diagnosis are drawn from.

    ``against``: covariates with their values ``(n,)`` by the labels of their axes; ``before_um`` and ``rest_um``:
    residuals ``(n,)`` before and after; ``used (n,)``: rows that are no outliers; ``placement (n,)`` counts from 0;
    ``structure``: whether a part without a law is in what was found.
    """

    against: Mapping[str, Array]
    before_um: Array
    rest_um: Array
    used: NDArray[np.bool_]
    front: NDArray[np.bool_]
    placement: NDArray[np.intp]
    sigma_um: float
    structure: bool
    panels: tuple[EffectPanel, ...] = ()

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> DrawnDiagnosis:
        """From what :func:`stepgauge.files.arrays.read_arrays` gives."""
        made = [{**one, "groups": tuple(Group(**group) for group in one["groups"])} for one in said["panels"]]
        return cls(**{**said, "panels": tuple(EffectPanel(**one) for one in made)})

    def figures(self) -> dict[str, Figure]:
        """All figures by name: the overview, the residuals and, where there are any, the effects."""
        found = {OVERVIEW: overview_figure(self), RESIDUALS: residual_figure(self)}
        return found | ({EFFECTS: effect_figure(self)} if self.panels else {})


def drawn_of(diagnosis: GaugeDiagnosis) -> DrawnDiagnosis:
    """What the figures of a diagnosis are drawn from."""
    data = diagnosis.data
    return DrawnDiagnosis(
        {label_of(one): covariate_values(one, data) for one in _covariates_that_matter(diagnosis)},
        diagnosis.before_um,
        diagnosis.rest_um,
        np.isfinite(diagnosis.noise.by_row_um),
        data.side > 0,
        data.placement,
        float(diagnosis.noise.sigma_um),
        bool(diagnosis.forms),
        tuple(replace(one, seen=one.rows_seen(data)) for one in panels(diagnosis)),
    )


def overview_figure(drawn: DrawnDiagnosis) -> Figure:
    """Residuals before and after in one row of panels, low enough for a first page beside its words."""
    limit = _limit(drawn)
    with figure_style():
        figure = new_figure(180.0, 48.0, solved=False)
        row = figure.subplots(1, len(drawn.against), sharey=True, squeeze=False)[0]
        for axes, (label, x) in zip(row, drawn.against.items(), strict=True):
            for um, name in ((drawn.before_um, "before"), (drawn.rest_um, "after")):
                every = np.ones(len(x), dtype=bool)
                _scatter(axes, x, np.clip(um, -limit, limit), [Group(every, COLORS[name], "o", name)], 0.6)
            _noise_lines(axes, drawn.sigma_um)
            _ring_outliers(axes, x, np.clip(drawn.before_um, -limit, limit), drawn)
            _label_x(axes, label)
        row[0].set_ylim(-limit, limit)
        row[0].set_ylabel("residual (µm)")
        add_legend(figure, axes_entries(row[0]))
    return figure


def residual_figure(drawn: DrawnDiagnosis) -> Figure:
    """Residuals before and after against up to three covariates, and their distribution."""
    columns, limit = len(drawn.against), _limit(drawn)
    groups = sides(drawn.front)
    with figure_style():
        figure = new_figure(180.0, 105.0, solved=False)
        grid = figure.subplots(2, columns + 1, sharey=True, squeeze=False, width_ratios=[1.0] * columns + [0.55])
        grid[0][0].set_ylim(-limit, limit)
        told = "after,\nwithout the structure" if drawn.structure else "after"
        for axes, um, name in zip(grid, (drawn.before_um, drawn.rest_um), ("before", told), strict=True):
            for one, x in zip(axes, drawn.against.values(), strict=False):
                _scatter(one, x, um, groups)
                _noise_lines(one, drawn.sigma_um)
                _ring_outliers(one, x, np.clip(um, -limit, limit), drawn)
            _distribution(axes[-1], um[drawn.used], drawn.sigma_um)
            axes[0].set_ylabel(f"residual {name} (µm)")
        for one, label in zip(grid[1], drawn.against, strict=False):
            _label_x(one, label)
        grid[1][-1].set_xlabel("density")
        add_legend(figure, axes_entries(grid[0][0], grid[0][-1]))
    return figure


def draw_residuals(axes: Axes, diagnosis: GaugeDiagnosis) -> None:
    """Residuals before and after against the position along the gauge, um, on axes of somebody else."""
    covariate = _covariates_that_matter(diagnosis)[0]
    x = covariate_values(covariate, diagnosis.data)
    draw_before_and_after(axes, x, diagnosis.before_um, diagnosis.rest_um, diagnosis.verdict)
    _noise_lines(axes, diagnosis.noise.sigma_um)
    named = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    axes.legend(named.values(), named.keys())
    axes.set(xlabel=label_of(covariate), ylabel="residual (µm)")


def draw_probabilities(axes: Axes, stored: Diagnosis) -> None:
    """The probability of every effect of a diagnosis that was read back, on axes of somebody else."""
    effects = stored.contents["effects"]
    names = [textwrap.fill(name_of(str(one["label"])), 24) for one in effects] or ["no effect"]
    places = range(len(names))[::-1]  # a bar each, also of findings with the same name
    axes.barh(places, [one["probability"] for one in effects] or [0.0], color=COLORS["after"], height=0.6)
    axes.set_yticks(places, names)
    axes.set(xlabel="probability", ylabel="effect", xlim=(0.0, 1.0))
    axes.set_title(f"verdict: {stored.verdict}", loc="left")


def effect_figure(drawn: DrawnDiagnosis) -> Figure:
    """Every effect with its law through the residuals of the other effects."""
    found = drawn.panels
    rows = (len(found) + 1) // 2 if len(found) > 1 else 1
    with figure_style():
        across = min(len(found), 2)
        figure = new_figure(180.0 if across > 1 else 120.0, 62.0 * rows + 8.0, solved=False)
        grid = figure.subplots(rows, across, squeeze=False)
        for axes, panel in zip(grid.flat, found, strict=False):
            _effect_panel(axes, panel, drawn.rest_um + panel.share_um, drawn)
            axes.set_title(textwrap.fill(panel.title, TITLE_CHARACTERS[across]), loc="left")
        for axes in grid.flat[len(found) :]:
            axes.set_axis_off()
        add_legend(figure, axes_entries(*grid.flat[: len(found)]))
    return figure


def _covariates_that_matter(diagnosis: GaugeDiagnosis) -> list[str]:
    """Covariates of systematic residuals first, then position and time; sides and directions of travel have no axis."""
    found = [one.covariate for one in (*diagnosis.located, *diagnosis.unexplained)]
    located = [covariate for covariate in found if covariate not in ("side", WAY)]
    always = ["time" if diagnosis.data.has_time else "order"]
    if np.ptp(diagnosis.data.probings.certified_mm()) > 0.0:
        always.insert(0, "position")
    return list(dict.fromkeys(always + located))[:MOST_COLUMNS]


def _scatter(axes: Axes, x: Array, y: Array, groups: Sequence[Group], alpha: float = 0.55) -> None:
    for group in groups:
        some = _thinned(np.flatnonzero(group.rows))
        axes.plot(
            x[some],
            y[some],
            linestyle="none",
            marker=group.marker,
            color=group.colour,
            markersize=2.4,
            markeredgewidth=0,
            alpha=alpha,
            label=group.name,
            rasterized=True,
        )
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)


def _thinned(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Evenly chosen rows."""
    if len(rows) <= MOST_POINTS:
        return rows
    return rows[np.linspace(0, len(rows) - 1, MOST_POINTS).astype(int)]


def _noise_lines(axes: Axes, sigma_um: float) -> None:
    for sign in (-2.0, 2.0):
        axes.axhline(
            sign * sigma_um, color="black", linewidth=0.7, linestyle=(0, (4, 3)), label="± two sigma of the noise"
        )


def _ring_outliers(axes: Axes, x: Array, um: Array, drawn: DrawnDiagnosis) -> None:
    rows = ~drawn.used
    if rows.any():
        axes.plot(
            x[rows], um[rows], "o", color="black", markerfacecolor="none", markersize=6, label="outlier", clip_on=False
        )


def _limit(drawn: DrawnDiagnosis) -> float:
    """Limit of the axis for all but far outliers, whose rings are drawn at the edge."""
    before = np.abs(drawn.before_um[drawn.used])
    return 1.1 * max(float(before.max(initial=0.0)), 3.0 * drawn.sigma_um, 1e-3)


def _distribution(axes: Axes, um: Array, sigma_um: float) -> None:
    """Histogram lying on its side, with the noise alone as a line."""
    reach = max(float(np.abs(um).max(initial=0.0)), 3.0 * sigma_um, 1e-3)
    bins = np.linspace(-reach, reach, int(np.clip(2.0 * np.sqrt(len(um)), 11, 61)))
    axes.hist(um, bins.tolist(), density=True, orientation="horizontal", color=COLORS["grey"], alpha=0.6, linewidth=0)
    if sigma_um > 0.0:
        y = np.linspace(-reach, reach, 301)
        density = np.exp(-0.5 * (y / sigma_um) ** 2) / (sigma_um * np.sqrt(2.0 * np.pi))
        axes.plot(density, y, color="black", linewidth=1.0, label="noise of a probing")
    axes.set_title(f"rms {np.sqrt((um**2).mean()):.3g} µm", loc="left")
    axes.spines[["top", "right"]].set_visible(False)


def _effect_panel(axes: Axes, panel: EffectPanel, um: Array, drawn: DrawnDiagnosis) -> None:
    """EffectPanel of an effect, without placements in which it does not show."""
    value, law = panel.of(um), panel.of(panel.share_um)
    told = drawn.used & np.isfinite(value)
    seen = panel.seen & told
    seen = seen if seen.any() else told  # what shows nowhere beyond an origin is still drawn as it was fitted
    _scatter(axes, panel.x, np.where(seen, value, np.nan), panel.groups, 0.3)
    if not panel.common:
        _name_lines(axes, panel, law, np.where(seen, drawn.placement, -1))
    for placement in [None] if panel.common else np.unique(drawn.placement[seen]):
        here = seen if placement is None else seen & (drawn.placement == placement)
        for group in panel.groups:
            rows = here & group.rows
            if rows.any():
                _means(axes, panel, um, rows, group, drawn.sigma_um)
                if panel.split:
                    _law_line(axes, panel.x[rows], law[rows], group.line, group.law)
        if not panel.split:
            _law_line(axes, panel.x[here], law[here])
    _label_x(axes, panel.label)
    axes.set_ylabel(panel.quantity)


def _name_lines(axes: Axes, panel: EffectPanel, law: Array, placement: NDArray[np.intp]) -> None:
    """At the left end of each line the placements that it belongs to, where there are several; -1: not shown."""
    ends: dict[tuple[float, float], set[int]] = {}
    for number in np.unique(placement[placement >= 0]):
        for own in [group.rows for group in panel.groups] if panel.split else [placement == number]:
            rows = np.flatnonzero((placement == number) & own)
            if rows.size:
                first = rows[panel.x[rows].argmin()]
                end = panel.x[first], law[first]
                far = ONE_LINE * np.ptp([panel.x, law], axis=1) * (10.0, 1.0)  # names are wide and not high
                near = next((one for one in ends if (np.abs(np.subtract(one, end)) <= far).all()), end)
                ends.setdefault(near, set()).add(int(number) + 1)
    for end, numbers in ends.items() if len({*map(frozenset, ends.values())}) > 1 else ():
        name = f"placement {', '.join(map(str, sorted(numbers)))}"
        behind = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.5}  # where another line crosses it
        axes.annotate(name, end, (2, 5), textcoords="offset points", fontsize="small", bbox=behind, zorder=8)


def _label_x(axes: Axes, label: str) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set_xlabel(label)
    if label in COUNTED:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def _law_line(axes: Axes, x: Array, law: Array, line: str = "-", label: str = "fitted law") -> None:
    """The law as it is drawn, with dots where it depends on more than this covariate."""
    if not len(x):
        return
    order = np.argsort(x, kind="stable")
    x, law = x[order], law[order]
    some = _thinned(np.arange(len(x)))
    style: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 2.0}
    if np.abs(np.diff(law)).sum() <= 6.0 * max(float(np.ptp(law)), 1e-12):
        style = {"linestyle": line}
    axes.plot(x[some], law[some], color="black", linewidth=1.1, zorder=5, label=label, **style)


def _means(axes: Axes, panel: EffectPanel, um: Array, rows: NDArray[np.bool_], group: Group, sigma_um: float) -> None:
    """Means of neighbouring rows with twice their standard error by the noise: they show structure below the scatter.

    Each reading is weighted by its information on the quantity.
    """
    x, weight = panel.x[rows], panel.weight[rows]
    place = np.round(x / max(GRAIN * float(np.ptp(panel.x)), 1e-12))
    levels = np.unique(place)
    most = len(levels) if len(levels) * FEWEST_IN_MEAN <= len(x) else max(len(x) // ROWS_IN_MEAN, 1)
    edges = np.quantile(levels, np.linspace(0, 1, min(MOST_MEANS, most) + 1)[1:-1])
    index = np.searchsorted(edges, place, side="left")
    keep = np.bincount(index) >= FEWEST_IN_MEAN
    if not keep.any():
        return
    total = np.maximum(np.bincount(index, weight**2), 1e-300)
    middle = np.bincount(index, x * weight**2) / total
    mean = np.bincount(index, um[rows] * weight) / total
    axes.errorbar(
        middle[keep],
        mean[keep],
        2.0 * sigma_um / np.sqrt(total[keep]),
        linestyle="none",
        marker=group.marker,
        markersize=3.6,
        color=group.colour,
        markeredgecolor="white",
        markeredgewidth=0.4,
        elinewidth=0.9,
        zorder=6,
        label="means ± two standard errors",
    )
