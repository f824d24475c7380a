"""The figure of the story: residuals before and after, the candidates, and truth beside answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from stepgauge.demonstration.answer import RevealedFault
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, figure_style, new_figure
from stepgauge.files.notation import printed_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLACED = {1: "gauge along y", 2: "gauge along x"}


@figure_style()
def story_figure(answer: RevealedFault, fault: str, residuals: pd.DataFrame, fit: Mapping[str, Any]) -> Figure:
    """Residuals before and after against the position along the gauge (above), candidates and numbers (below).

    Parameters
    ----------
    answer : the comparison
    fault : what was concealed, in words
    residuals : rows of ``residuals.csv``, um
    fit : of ``diagnosis.json``
    """
    figure = new_figure(180.0, 112.0)
    (before, after), (candidates, numbers) = figure.subplots(2, 2, height_ratios=(1.3, 1.0))
    after.sharey(before)
    figure.get_layout_engine().set(rect=(0.0, 0.025, 1.0, 0.975))  # type: ignore[union-attr, call-arg]
    figure.suptitle(f"Concealed: {fault}", fontweight="bold")
    _residuals(before, residuals, "before", f"machine file as it was, rms {fit['rms_before_um']:.2f} µm")
    _residuals(after, residuals, "after", f"with what was found, rms {fit['rms_after_um']:.2f} µm")
    before.set_ylabel("residual (µm)")
    add_legend(figure, axes_entries(before), "lower center")
    _candidates(candidates, answer)
    _numbers(numbers, answer)
    return figure


def _residuals(axes: Axes, residuals: pd.DataFrame, when: str, title: str) -> None:
    for number, placed in PLACED.items():
        rows = residuals[residuals["placement"] == number]
        color, marker = (COLORS["before"], "o") if number == 1 else (COLORS["after"], "s")
        axes.plot(
            rows["position_mm"],
            rows[f"{when}_um"],
            marker,
            color=color,
            ms=2.2,
            alpha=0.7,
            label=placed,
        )
    axes.set_title(title)
    axes.set_xlabel("position along the gauge (mm)")


def _candidates(axes: Axes, answer: RevealedFault) -> None:
    shown = answer.members[:5]
    height = np.arange(len(shown))[::-1]
    colors = [COLORS["measured"] if one.is_truth else COLORS["grey"] for one in shown]
    axes.barh(height, [one.probability for one in shown], color=colors, height=0.6)
    for at, one in zip(height, shown, strict=True):
        axes.text(one.probability + 0.02, at, f"{one.probability:.2f}", va="center", fontsize=7.0)
    axes.set_yticks(height, [one.label for one in shown])
    axes.set_xlim(0.0, 1.18)
    _centred(axes, len(shown))
    axes.set_title("candidates (green: concealed)" if answer.place else "candidates (none was concealed)")
    axes.set_xlabel("probability")
    axes.grid(axis="y", visible=False)


def _numbers(axes: Axes, answer: RevealedFault) -> None:
    height = np.arange(len(answer.numbers))[::-1]
    deviations = [one.deviation for one in answer.numbers]
    axes.axvline(0.0, color=COLORS["measured"], lw=1.2)
    axes.errorbar(deviations, height, xerr=2.0, fmt="o", color=COLORS["after"], capsize=2.0)
    names = [f"{one.name}\n{one.truth:g} | {one.found:.4g} {printed_unit(one.unit)}" for one in answer.numbers]
    axes.set_yticks(height, names)
    reach = max([4.0, *(abs(one) + 2.5 for one in deviations)])
    axes.set_xlim(-reach, reach)
    _centred(axes, len(height))
    axes.set_title("concealed | found, with ± 2u")
    axes.set_xlabel("(found − concealed) / u")
    axes.grid(axis="y", visible=False)


def _centred(axes: Axes, count: int) -> None:
    """Room for three, what there is in the middle."""
    room = max(count, 3) / 2.0
    axes.set_ylim((count - 1) / 2.0 - room, (count - 1) / 2.0 + room)
