"""Plan: the path and its choices, played back in 3D, what would collide and where, and the program in any dialect."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.evaluations import placement_axes
from stepgauge.web.fields import Field, keywords, options, verb_fields
from stepgauge.web.folder import Stamp, existing, free_name, listed, relative, stamps
from stepgauge.web.forms import Form, asked_form, form_endpoint
from stepgauge.web.render import json_answer, render, run_verb, site_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.motion.moves import Program
    from stepgauge.planning.check import Conflict

FIRST = ("route", "around", "order", "cycles", "blocks", "clearance_mm", "margin_mm")
"""Parameters of ``plan`` that are always seen; the others unfold."""
OF_POINTS = ("points_on", "tip_radius_mm", "teach")
"""Parameters of a plan without a placement."""
USUAL_DIALECT = "dmis"
SHOWN_CYCLES = 2
"""Of the path and the program on the page: further cycles repeat them."""


@cache
def fields() -> dict[str, Field]:
    """What the form asks: the parameters of ``plan``."""
    return verb_fields("plan", OF_POINTS)


@dataclass(frozen=True)
class PlanSettings:
    """What the form says, by its fields; those that are empty are as usual."""

    texts: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, site: Site, form: Form) -> PlanSettings:
        """The form on top of what the project file states for the verb."""
        stated = site.project().table(("plan",)) if site.has_project else {}
        own = {key.replace("-", "_"): str(value) for key, value in stated.items()}
        usual = {one.name: one.default for one in fields().values()} | {"dialect": USUAL_DIALECT}
        values = {name: form.text(name) or own.get(name, "") or default for name, default in usual.items()}
        return cls(tuple(values.items()))

    @property
    def values(self) -> dict[str, str]:
        """By field, with a decimal point in numbers."""
        numbers = {one.name for one in fields().values() if one.kind == "number"}
        return {name: text.replace(",", ".") if name in numbers else text for name, text in self.texts}

    def keywords(self) -> dict[str, Any]:
        """For :func:`stepgauge.plan` (:class:`InputError` for what is no number)."""
        return keywords(fields(), self.values)

    def arguments(self, placement: str, output: str) -> list[str]:
        """The command line that writes the program: what is not as usual, and the language."""
        said = [*options(fields(), self.values), "--dialect", self.values["dialect"]]
        return ["plan", placement, *said, "-o", output]


@dataclass(frozen=True)
class PlanDraft:
    """A path, refused or not: ``error`` says why; ``program`` has :data:`SHOWN_CYCLES` cycles at most."""

    program: Program
    conflicts: tuple[Conflict, ...]
    error: InputError | None
    cycles: int

    @property
    def points(self) -> int:
        """Probings of all cycles."""
        return self.program.n_points // min(self.cycles, SHOWN_CYCLES) * self.cycles

    @property
    def duration(self) -> str:
        """At full speed, without accelerations; further cycles are as long as the last one that is shown."""
        import numpy as np

        from stepgauge.planning.program import duration_words, durations_s

        seconds, touches = durations_s(self.program), np.flatnonzero(self.program.is_measure)
        further, size = max(self.cycles - SHOWN_CYCLES, 0), len(touches) // SHOWN_CYCLES
        last = seconds[touches[-1 - size] + 1 : touches[-1] + 1].sum() if further and size else 0.0
        return duration_words(float(seconds.sum() + further * last))


@lru_cache(8)
def _drafted(asked: PlanSettings, placement: str, gauge: str, machine: str, made_from: tuple[Stamp, ...]) -> PlanDraft:
    """The plan (:class:`InputError` where there is no path at all)."""
    import stepgauge as sg
    from stepgauge.planning.check import PathError

    wanted = asked.keywords()
    cycles = wanted.get("cycles", 5)
    try:
        plan = sg.plan(placement, gauge, machine, **wanted | {"cycles": min(cycles, SHOWN_CYCLES)})
        return PlanDraft(plan.program, (), None, cycles)
    except PathError as error:
        if error.program is None:
            raise
        return PlanDraft(error.program, tuple(_once(error.program, error.conflicts)), error, cycles)


def _once(program: Program, conflicts: Sequence[Conflict]) -> Iterator[Conflict]:
    """Without those that a further cycle repeats."""
    from stepgauge.motion.moves import trace

    path, seen = trace(program), set()
    for one in conflicts:
        places = path.start_mm[one.piece].round(6).tolist(), path.end_mm[one.piece].round(6).tolist()
        if (key := (str(places), one.what)) not in seen:
            seen.add(key)
            yield one


def _draft(site: Site, asked: PlanSettings) -> PlanDraft:
    files = site.placement, site.stated("gauge"), site.stated("machine")
    if not Path(files[0]).exists():
        raise InputError(files[0], "there is no placement yet", expected="the 16 points located first")
    return _drafted(asked, *files, stamps(*files))


def _asked(request: Request) -> PlanSettings:
    return PlanSettings.of(site_of(request), asked_form(request))


def _program_name(site: Site, asked: PlanSettings) -> str:
    """A name of its own: a program that was written may be at the machine, and its readings are compared with it."""
    from stepgauge.programs import find_dialect

    return relative(site.folder, str(free_name(site.folder, f"program{find_dialect(asked.values['dialect']).suffix}")))


def show(request: Request) -> Response:
    """The controls; the path follows them."""
    from stepgauge.programs import DIALECTS

    asked, site = _asked(request), site_of(request)
    written = request.query_params.get("written", "")
    suffixes = sorted({one.suffix for one in DIALECTS.values()})
    return render(
        request,
        "plan.html.j2",
        values=asked.values,
        fields=fields(),
        first=FIRST,
        dialects={name: one.title for name, one in DIALECTS.items()},
        query=urlencode(asked.texts),
        programs=listed(site.folder, suffixes, deep=1),
        written=written if written and (site.folder / relative(site.folder, written)).is_file() else "",
    )


def part(request: Request) -> Response:
    """What the choices lead to: numbers, conflicts."""
    asked, site = _asked(request), site_of(request)
    drafted = _draft(site, asked)
    _program_name(site, asked)
    return render(
        request,
        "plan_part.html.j2",
        drafted=drafted,
        values=asked.values,
        query=urlencode(asked.texts),
        fewer=drafted.cycles > SHOWN_CYCLES,
        shown_cycles=SHOWN_CYCLES,
        placement=relative(site.folder, site.placement),
        placements=placement_axes(site),
    )


def scene(request: Request) -> Response:
    """The path, the tool and the conflicts for the player."""
    from stepgauge.figures.path_player import path_player
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.machine.file import read_machine
    from stepgauge.motion.collision import make_tool

    site = site_of(request)
    drafted = _draft(site, _asked(request))
    gauge, machine = read_gauge(site.stated("gauge")), read_machine(site.stated("machine"))
    pieces = [one.piece for one in drafted.conflicts]
    lies, tool = read_placement(site.placement, gauge), make_tool(machine.probe)
    return json_answer(request, json.dumps(path_player(drafted.program, gauge, lies, tool, machine.travel_mm, pieces)))


def program(request: Request) -> Response:
    """The program as text, of the cycles that are shown."""
    from stepgauge.planning.planned import Plan

    asked = _asked(request)
    drafted = _draft(site_of(request), asked)
    text = Plan(drafted.program, True).text(asked.values["dialect"])
    return render(request, "plan_program.html.j2", text=str(text), note=text.note)


def write(request: Request, form: Form) -> Response:
    """``stepgauge plan``: the whole program, into the folder of the project."""
    site = site_of(request)
    asked = PlanSettings.of(site, form)
    name = _program_name(site, asked)
    query: Mapping[str, str] = dict(asked.texts) | {"written": name}
    return run_verb(request, asked.arguments(relative(site.folder, site.placement), name), "/plan", **query)


def file(request: Request) -> Response:
    """A program of the project, to take to the machine."""
    from stepgauge.programs import DIALECTS

    place = existing(site_of(request).folder, request.query_params.get("name", ""))
    if place.suffix not in {one.suffix for one in DIALECTS.values()} or not place.is_file():
        raise InputError(place.name, "not a program", expected="one that was planned here")
    return FileResponse(place, media_type="application/octet-stream", filename=place.name)


ROUTES = [
    Route("/plan", show),
    Route("/plan/part", part),
    Route("/plan/scene.json", scene),
    Route("/plan/program", program),
    Route("/plan/write", form_endpoint(write), methods=["POST"]),
    Route("/plan/file", file),
]
