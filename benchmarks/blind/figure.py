"""The reliability diagram: what was said against what was true."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.blind.statements import BINS, GROUPS

Row = Mapping[str, Any]
TITLES = {
    "recordings": "ordinary recordings",
    "scatters": "scatter not ideal",
    "ways": "way of measuring not ideal",
    "further": "later kinds",
    "all": "all",
}
INK, BLUE, GREY = "#1a1a1a", "#0b5394", "#8a8a8a"


def draw_reliability(rows: Sequence[Row], path: Path) -> None:
    """One panel for each group and one for all: share true with its 95 % interval, by what was said. PNG or SVG.

    A dotted line is what was said, a cross its mean, a grey bar the share asked for.
    """
    from matplotlib.figure import Figure

    groups = [group for group in (*GROUPS, "all") if any(row["group"] == group for row in rows)] or ["all"]
    figure = Figure(figsize=(2.6 * len(groups) + 0.6, 3.4), layout="constrained")
    panels = figure.subplots(1, len(groups), sharey=True, squeeze=False)[0]
    for panel, group in zip(panels, groups, strict=True):
        _panel(panel, [row for row in rows if row["group"] == group], TITLES[group])
    panels[0].set_ylabel("share that is true")
    figure.supxlabel("probability that was said", fontsize=9)
    figure.savefig(path, dpi=200, metadata={"Date": None} if path.suffix == ".svg" else None)


def _panel(panel: Any, rows: Sequence[Row], title: str) -> None:
    for number, (low, high, bar) in enumerate(BINS):
        panel.plot([number - 0.35, number + 0.35], [low, high], color=GREY, linewidth=0.8, linestyle=":")
        if bar is not None:
            panel.plot([number - 0.35, number + 0.35], [bar, bar], color=GREY, linewidth=2.5, solid_capstyle="butt")
    for row in rows:
        number = next(k for k, part in enumerate(BINS) if part[0] == row["from"])
        share, (low, high) = row["true"] / row["of"], row["interval"]
        # rounding may put an end of the interval a hair inside the share
        ends = [[max(share - low, 0.0)], [max(high - share, 0.0)]]
        panel.errorbar([number], [share], ends, fmt="o", color=BLUE, markersize=5, capsize=3, linewidth=1.2)
        panel.plot([number + 0.15], [row["said"]], marker="x", color=INK, markersize=4)
        panel.annotate(f"{row['true']}/{row['of']}", (number, 0.02), ha="center", fontsize=6, color=INK)
    panel.set(title=title, ylim=(0.0, 1.03), xlim=(-0.6, len(BINS) - 0.4))
    panel.set_xticks(range(len(BINS)), [f"{low:g}\N{EN DASH}{high:g}" for low, high, _ in BINS], fontsize=7)
    panel.title.set_size(9)
    panel.tick_params(axis="y", labelsize=8)
    panel.spines[["top", "right"]].set_visible(False)
