"""History: the evaluations of the project by date, with trends, control limits, and what to look at."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.files.notation import printed_unit
from stepgauge.web.forms import Form, asked_form, form_endpoint
from stepgauge.web.pages.machine import stated
from stepgauge.web.render import json_answer, render, run_verb, site_of, words_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.history import Refreshed
    from stepgauge.history.entries import HistoryEntry
    from stepgauge.history.series import Series

OUTPUT = "results/history"
LARGEST_LIMIT = 1e6
FEWEST_DATES = 3
"""Through fewer there is no trend: through two points there is always a line."""


@cache
def _store(folder: Path) -> Path:
    """A store that goes with the server: looking at the history writes nothing into the project."""
    place = tempfile.TemporaryDirectory(prefix="stepgauge-")
    _kept.append(place)
    return Path(place.name) / "history.sqlite"


_kept: list[tempfile.TemporaryDirectory[str]] = []


@dataclass(frozen=True)
class HistorySelection:
    """Which machine and gauge, the limits by quantity, and whether dates of files count."""

    machine: str
    gauge: str
    limits: Mapping[str, float]
    file_date: bool

    @classmethod
    def of(cls, form: Form) -> HistorySelection:
        """:class:`InputError` for a limit that is no positive number."""
        from stepgauge.history import QUANTITIES

        limits = {name: form.number(name, 0.0, LARGEST_LIMIT) for name in QUANTITIES}
        given = {name: value for name, value in limits.items() if value}
        return cls(form.text("machine"), form.text("gauge"), given, form.has("file_date"))

    def query(self) -> str:
        """As an address has it."""
        pairs = {"machine": self.machine, "gauge": self.gauge, "file_date": "1" if self.file_date else ""}
        return urlencode({**{key: value for key, value in pairs.items() if value}, **self.limits})

    def arguments(self) -> list[str]:
        """The command line that writes this history."""
        said = ["--machine-name", self.machine] if self.machine else []
        said += ["--gauge-serial", self.gauge] if self.gauge else []
        said += ["--date-from", "file"] if self.file_date else []
        limits = [word for name, value in self.limits.items() for word in ("--limit", f"{name}={value:g}")]
        return ["history", ".", *said, *limits, "-o", OUTPUT]


def _found(site: Site, asked: HistorySelection) -> Refreshed:
    from stepgauge.history import refresh_store

    return refresh_store(_store(site.folder), site.folder, "file" if asked.file_date else "record")


def _entries(site: Site, found: Refreshed, asked: HistorySelection) -> list[HistoryEntry]:
    from stepgauge.history import select_machine

    return select_machine(found.entries, site.folder.name, asked.machine or None, asked.gauge or None)


def _series(request: Request) -> tuple[HistorySelection, list[HistoryEntry], list[Series]]:
    from stepgauge.history import make_series

    site, asked = site_of(request), HistorySelection.of(asked_form(request))
    entries = _entries(site, _found(site, asked), asked)
    return asked, entries, make_series(entries)


def show(request: Request) -> Response:
    """The controls; what they lead to follows."""
    from stepgauge.history import QUANTITIES
    from stepgauge.history.entries import UNNAMED

    site, form = site_of(request), asked_form(request)
    asked = HistorySelection.of(form)
    found: tuple[HistoryEntry, ...] = ()
    remarks: tuple[str, ...] = ()
    with suppress(InputError):  # there is no evaluation at all
        refreshed = _found(site, asked)
        found, remarks = refreshed.entries, refreshed.remarks
    machines, gauges = ({getattr(one, name) for one in found} for name in ("machine", "gauge_serial"))
    machine = stated(site)
    own = machine.table.name if machine else ""
    return render(
        request,
        "history.html.j2",
        machines=sorted(machines, key=lambda one: (one != own, one == UNNAMED, one)),
        unnamed=UNNAMED,
        gauges=sorted(gauges),
        asked=asked,
        remarks=remarks,
        units={name: printed_unit(one.unit) for name, one in QUANTITIES.items()},
    )


def part(request: Request) -> Response:
    """Chart, warnings, and all evaluations by date."""
    from stepgauge.history import judge, make_series

    site, asked = site_of(request), HistorySelection.of(asked_form(request))
    found = _found(site, asked)
    entries = _entries(site, found, asked)
    series = make_series(entries)
    alerts = [{**vars(one), "folder": str(PurePosixPath(one.path).parent)} for one in judge(series, asked.limits)]
    rows = [_row(one) for one in sorted(entries, key=lambda one: one.measured_at, reverse=True)]
    return render(
        request,
        "history_part.html.j2",
        asked=asked,
        alerts=alerts,
        rows=rows,
        remarks=found.remarks,
        output=OUTPUT,
        few_dates=len({one["date"] for one in rows}) < FEWEST_DATES,
    )


def _row(entry: HistoryEntry) -> dict[str, Any]:
    return {
        **{name: value for name, value in vars(entry).items() if not isinstance(value, float) or math.isfinite(value)},
        "date": entry.measured_at.date().isoformat(),
        "folder": str(PurePosixPath(entry.path).parent),
    }


def chart(request: Request) -> Response:
    """The chart of :func:`part`."""
    from stepgauge.figures.history_chart import history_chart
    from stepgauge.history import QUANTITIES

    asked, _, series = _series(request)
    words = words_of(request)
    titles = {name: words(f"quantity.{name}") for name in QUANTITIES}

    def along(direction: str) -> str:
        return words("history.along_axis", axis=words.direction(direction))

    return json_answer(request, json.dumps(history_chart(series, asked.limits, titles, along)))


def write(request: Request, form: Form) -> Response:
    """``stepgauge history``: its table, figure and store into the folder of results."""
    asked = HistorySelection.of(form)
    return run_verb(request, asked.arguments(), f"/history?{asked.query()}")


ROUTES = [
    Route("/history", show),
    Route("/history/part", part),
    Route("/history/chart.json", chart),
    Route("/history/write", form_endpoint(write), methods=["POST"]),
]
