"""The history of a machine as a chart to click in a browser; colours as in :mod:`stepgauge.figures.error_chart`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from stepgauge.figures.error_chart import LINES, SYMBOLS, numbers
from stepgauge.files.dates import YEAR_DAYS
from stepgauge.files.notation import printed_unit
from stepgauge.history.entries import QUANTITIES
from stepgauge.history.series import Series

GAP = 0.05
"""Between two panels, for the title of the lower one, in shares of the height."""
DAY_MS = 86_400_000
FEW_DAYS = 10
"""So many days have a mark each; of more plotly chooses."""


def history_chart(
    series: Sequence[Series],
    limits: Mapping[str, float],
    titles: Mapping[str, str],
    along: Callable[[str], str] = "along {}".format,
) -> dict[str, Any]:
    """One panel per quantity, a colour per direction: values with 2 u, trends, control limits, limits.

    ``titles``: of the quantities, ``along``: of a direction, in the language of the page. A point carries the folder of
    its evaluation.
    """
    directions = sorted({one.direction for one in series})
    data: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    layout: dict[str, Any] = {}
    heads: list[dict[str, Any]] = []
    for number, name in enumerate(QUANTITIES, 1):
        axis = f"y{number if number > 1 else ''}"
        for one in series:
            if one.quantity == name:
                place = directions.index(one.direction)
                look = LINES[place % len(LINES)], SYMBOLS[place % len(SYMBOLS)]
                data += _traces(one, axis, along(one.direction), *look, number == 1)
        shapes += _limits(axis, limits.get(name), QUANTITIES[name].signed)
        layout[axis.replace("y", "yaxis")] = panel = _panel(number, QUANTITIES[name].unit)
        heads.append(_head(titles[name], panel["domain"][1]))
    layout |= {
        "xaxis": {"type": "date", "tickformat": "%Y-%m-%d", "anchor": f"y{len(QUANTITIES)}", **_days_shown(series)},
        "shapes": shapes,
        "annotations": heads,
        "margin": {"l": 70, "r": 10, "t": 10, "b": 40},
        "legend": {"orientation": "h", "y": 1.01, "yanchor": "bottom"},
        "hovermode": "closest",
    }
    return {"data": data, "layout": layout}


def _days_shown(series: Sequence[Series]) -> dict[str, Any]:
    """The axis of time of few days, each of which plotly would mark several times, or show a millisecond of."""
    days = sorted({entry.measured_at.date() for one in series for entry in one.entries})
    if not days or (days[-1] - days[0]).days > FEW_DAYS:
        return {}
    aside = timedelta(days=30 if len(days) == 1 else 1)
    ticks = {} if len(days) == 1 else {"tick0": days[0].isoformat(), "dtick": DAY_MS}
    return {"range": [(days[0] - aside).isoformat(), (days[-1] + 2 * aside).isoformat()], **ticks}


def _panel(number: int, unit: str) -> dict[str, Any]:
    height = 1.0 / len(QUANTITIES)
    top = 1.0 - (number - 1) * height
    title = {"text": printed_unit(unit), "font": {"size": 12}}
    return {"title": title, "domain": [max(top - height, 0.0), top - GAP], "zeroline": True, "nticks": 5}


def _head(title: str, top: float) -> dict[str, Any]:
    """The title of a panel above it: beside its axis long ones ran into each other."""
    where = {"xref": "paper", "yref": "paper", "x": 0.0, "y": top, "xanchor": "left", "yanchor": "bottom"}
    return {**where, "text": title, "showarrow": False, "font": {"size": 12}}


def _traces(one: Series, axis: str, label: str, color: str, symbol: str, named: bool) -> list[dict[str, Any]]:
    dates = [entry.measured_at.isoformat() for entry in one.entries]
    ring = ["--red" if beyond else color for beyond in one.beyond]
    common = {"type": "scatter", "yaxis": axis, "legendgroup": label}
    points = {
        **common,
        "x": dates,
        "y": numbers(one.value),
        "error_y": {"array": numbers(2.0 * one.u), "color": color, "thickness": 1, "width": 3},
        "customdata": [str(PurePosixPath(entry.path).parent) for entry in one.entries],
        "mode": "markers",
        "name": label,
        "showlegend": named,
        "marker": {"color": color, "symbol": symbol, "size": 8, "line": {"color": ring, "width": 2}},
        "hovertemplate": "%{x|%Y-%m-%d}: %{y:.3f}<br>%{customdata}<extra>" + label + "</extra>",
    }
    return [*_chart(one, common, dates, color), *_trend(one, common, color), points]


def _chart(one: Series, common: Mapping[str, Any], dates: list[str], color: str) -> list[dict[str, Any]]:
    """The control limits as a band."""
    if not one.charted:
        return []
    edge = np.concatenate([one.high, one.low[::-1]])
    look = {"fill": "toself", "fillcolor": f"{color}/26", "line": {"width": 0}, "mode": "lines", "hoverinfo": "skip"}
    return [{**common, **look, "x": [*dates, *dates[::-1]], "y": numbers(edge), "showlegend": False}]


def _trend(one: Series, common: Mapping[str, Any], color: str) -> list[dict[str, Any]]:
    trend = one.trend
    if trend is None:
        return []
    ends = [one.entries[0].measured_at, one.entries[-1].measured_at]
    along = [trend.value + trend.per_year * _years(end - trend.middle) for end in ends]
    line = {"color": color, "width": 1.5, "dash": "solid" if trend.significant else "dash"}
    x = [datetime.isoformat(end) for end in ends]
    return [
        {**common, "x": x, "y": numbers(along), "mode": "lines", "line": line, "hoverinfo": "skip", "showlegend": False}
    ]


def _years(span: timedelta) -> float:
    return span.total_seconds() / 86400.0 / YEAR_DAYS


def _limits(axis: str, limit: float | None, signed: bool) -> list[dict[str, Any]]:
    if limit is None:
        return []
    line = {"color": "--red", "width": 1.5, "dash": "dot"}
    return [
        {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": axis, "y0": value, "y1": value, "line": line}
        for value in ((limit, -limit) if signed else (limit,))
    ]
