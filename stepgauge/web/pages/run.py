"""Run: the virtual CMM or a live I++ server; points as they come, the errors growing, pause and stop."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator
from dataclasses import replace
from functools import cache
from pathlib import Path

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response, StreamingResponse
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web import concealed
from stepgauge.web.fields import Field, verb_fields
from stepgauge.web.folder import existing, free_name, inside, listed, relative
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.measuring import MeasurementRequest, MeasuringRun
from stepgauge.web.render import address, render, site_of, words_of
from stepgauge.web.site import Site
from stepgauge.web.texts import Words

PROGRAMS = (".dmi", ".ipp")
SPEEDS = {"1": 1.0, "10": 10.0, "100": 100.0, "": None}
LOOK_S = 0.1
STILL_S = 15.0
"""After so long without a word a comment is sent, which finds out that a window is closed."""
FIRST_NAME = "recordings/run.csv"
MOST_SEEDS = 1_000_000


def show(request: Request) -> Response:
    """What runs, what was broken off, and the form for a new one; or one measurement."""
    site = site_of(request)
    if name := request.query_params.get("recording"):
        return _show_one(request, relative(site.folder, name))
    ready = site.has_project and Path(site.placement).exists()
    return render(
        request,
        "run.html.j2",
        ready=ready,
        programs=listed(site.folder, PROGRAMS),
        faults=concealed.names(words_of(request)) if ready else [],
        last_fault=concealed.last_fault(site.folder).get("kind", ""),
        chosen={key: request.query_params.get(key, "") for key in ("program", "placement")},
        placements=_placements(site) if ready else [],
        fields=_asked_fields(site, words_of(request)),
        running=[one.asked.output for one in site.runs.running()],
        unfinished=site.runs.unfinished(),
        name=relative(site.folder, str(_new_name(site))),
    )


def _asked_fields(site: Site, words: Words) -> dict[str, Field]:
    """The fields, with what holds where they are empty: of a program what it has, else what the project states."""
    stated = site.project().stated("plan") if site.has_project else {}
    found = {name: replace(one, default=str(stated.get(name, one.default))) for name, one in fields().items()}
    own = {"cycles": words("run.of_program", usual=found["cycles"].default), "seed": words("run.new_seed")}
    return {name: replace(one, default=own.get(name, one.default)) for name, one in found.items()}


def _placements(site: Site) -> list[str]:
    """Where the gauge may lie: the project's placement first."""
    files = listed(site.folder, [".toml"])
    found = [one for one in files if b"c1_mm" in (site.folder / one).read_bytes()[:10_000]]
    return sorted(found, key=lambda one: one != site.placement)


def _new_name(site: Site) -> Path:
    """One that no recording and no journal has."""
    for number in range(1, 1000):
        name = FIRST_NAME if number == 1 else FIRST_NAME.replace(".csv", f"-{number}.csv")
        if not (site.folder / name).exists() and not (site.folder / f"{name}.journal").exists():
            return site.folder / name
    return free_name(site.folder, FIRST_NAME)


def _show_one(request: Request, name: str) -> Response:
    site = site_of(request)
    run = site.runs.get(name)
    left = {output: (done, total) for output, done, total in site.runs.unfinished()}
    state = "done" if (site.folder / name).exists() else "stopped" if name in left else "unknown"
    done, total = left.get(name, (0, 0))
    error = ""
    if run is not None and state != "done":
        state, error = run.status["state"], run.status.get("error", "")
        done, total = run.status.get("done", done), run.status.get("total", total)
    asked = site.runs.asked(name) or (run.asked if run is not None else None)
    return render(
        request,
        "run_one.html.j2",
        name=name,
        state=state,
        done=done,
        total=total,
        live=run,
        error=error,
        server="" if asked is None else asked.server,
    )


def start(request: Request, form: Form) -> Response:
    """Begin a measurement, and lead to where it is seen."""
    site = site_of(request)
    run = site.runs.start(_asked(site, form))
    return render(request, "gone.html.j2", address=address("/run", recording=run.asked.output))


def _asked(site: Site, form: Form) -> MeasurementRequest:
    def file(name: str) -> str:
        given = form.text(name)
        return str(existing(site.folder, given).relative_to(site.folder)) if given else ""

    output = relative(site.folder, form.text("output", FIRST_NAME))
    if Path(output).suffix != ".csv" or Path(output).parent == Path("."):
        raise InputError(output, "not the name of a recording", expected="recordings/NAME.csv")
    if form.text("speed", "10") not in SPEEDS and form.has("speed"):
        raise InputError("speed", "not a choice", found=form.text("speed"), expected="1, 10 or 100")
    live = form.text("machine", "virtual") == "live"
    server = form.text("server") if live else ""
    if live and not server:
        raise InputError("server", "it is not stated", expected="HOST:PORT of an I++ DME server")
    given = {name: one.read(form) for name, one in fields().items() if form.has(one.name)}
    return MeasurementRequest(
        output=output,
        gauge=site.stated("gauge"),
        machine=site.stated("machine"),
        placement=file("placement") or site.placement,
        program=file("program"),
        **{"seed": secrets.randbelow(MOST_SEEDS), **given},
        server=server,
        homing=form.has("homing") or not live,
        speed=SPEEDS[form.text("speed")] if not live else 1.0,
        faults=_faults(site, form, output) if not live else "",
    )


@cache
def fields() -> dict[str, Field]:
    """What the form asks of the plan and of the run, as their verbs define it."""
    planned = verb_fields("plan", only=("cycles", "blocks"))
    return {**planned, **verb_fields("simulate", only=("gauge_temperature_C", "seed"))}


def _faults(site: Site, form: Form, output: str) -> str:
    """The file of the fault that was chosen, beside the recording; empty for none."""
    from stepgauge.files.text import write_text

    effect = concealed.table(form)
    if effect is None:
        return ""
    text, place = concealed.text(effect), concealed.fault_file(inside(site.folder, output))
    with site.writing():
        place.parent.mkdir(parents=True, exist_ok=True)
        write_text(place, text)
    return relative(site.folder, str(place))


def show_fault(request: Request) -> Response:
    """The fields of a kind of fault."""
    kind, site = request.query_params.get("fault", ""), site_of(request)
    fault = concealed.fault(kind, _along(site), concealed.last_fault(site.folder)) if kind else None
    return render(request, "run_fault.html.j2", fault=fault)


def _along(site: Site) -> str:
    """The machine axis along which the gauge lies; x where no placement says it."""
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement

    if not Path(site.placement).exists():
        return "x"
    axis = read_placement(site.placement, read_gauge(site.stated("gauge"))).axis
    return "xyz"[int(abs(axis).argmax())]


def steer(request: Request, form: Form) -> Response:
    """Pause, go on, stop; or go on with one that was broken off."""
    site, word = site_of(request), request.path_params["word"]
    name = relative(site.folder, form.text("recording"))
    run = site.runs.get(name)
    if word == "discard":
        site.runs.discard(name)
        return RedirectResponse("/run", 303)
    if word == "resume":
        site.runs.go_on(name, form.text("server"))
    elif run is None:
        raise InputError(name, "is not measured by this server", expected="the window that began it")
    else:
        run.say(word)
    return RedirectResponse(address("/run", recording=name), 303)


def events(request: Request) -> Response:
    """What a measurement tells, as server-sent events; of each kind only the newest, so that nobody falls behind."""
    site = site_of(request)
    name = relative(site.folder, request.query_params.get("recording", ""))
    run = site.runs.get(name)
    if run is None:
        raise InputError(name, "is not measured by this server")
    return StreamingResponse(_told(request, run), media_type="text/event-stream")


async def _told(request: Request, run: MeasuringRun) -> AsyncIterator[str]:
    sent: dict[str, int] = {}
    still_s = 0.0
    site = site_of(request)
    while not (site.is_ending or await request.is_disconnected()):
        ended = not run.is_running
        for kind, (number, text) in run.newest():
            if sent.get(kind) != number:
                sent[kind], still_s = number, 0.0
                yield f"event: {kind}\ndata: {text}\n\n"
        if ended:
            return
        still_s += LOOK_S
        if still_s > STILL_S:
            still_s = 0.0
            yield ": still here\n\n"
        await asyncio.sleep(LOOK_S)


ROUTES = [
    Route("/run", show),
    Route("/run", form_endpoint(start), methods=["POST"]),
    Route("/run/events", events),
    Route("/run/fault", show_fault),
    Route("/run/{word:str}", form_endpoint(steer), methods=["POST"]),
]
