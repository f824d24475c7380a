"""Probe: pre-travel, deflection and trigger force over the directions of the surface, in 3D and round the stylus."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.folder import Stamp, existing, listed, relative, stamps
from stepgauge.web.forms import Form, asked_form, form_endpoint
from stepgauge.web.pages.machine import stated
from stepgauge.web.render import json_answer, render, run_verb, site_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.probes.directions_map import DirectionMap

QUANTITIES = {"pretravel_um": "µm", "deflection_um": "µm", "trigger_force_N": "N"}
HELD = {
    "file": None,
    "down": (0.0, 0.0, -1.0),
    "x_plus": (1.0, 0.0, 0.0),
    "x_minus": (-1.0, 0.0, 0.0),
    "y_plus": (0.0, 1.0, 0.0),
    "y_minus": (0.0, -1.0, 0.0),
}
"""Directions from the body of the probe to its tip, machine axes."""
STEPS_DEG = (2, 5, 10, 15)
OF_MACHINE = "machine"
MOST_FILES = 200


@dataclass(frozen=True)
class ProbeSelection:
    """Which probe or table, held how, on which grid, and what of it is shown."""

    probe: str
    held: str
    step_deg: int
    quantity: str

    @classmethod
    def of(cls, site: Site, form: Form) -> ProbeSelection:
        """:class:`InputError` for what the page does not offer."""
        probes = list(_probes(site))
        asked = form.text("probe") or probes[0]
        step = form.whole("step", STEPS_DEG[0], STEPS_DEG[-1], 5) or 5
        pairs = (("probe", asked, probes), ("held", form.text("held", "file"), list(HELD)))
        quantity = form.text("quantity", "pretravel_um")
        for name, value, known in (*pairs, ("quantity", quantity, list(QUANTITIES))):
            if value not in known:
                raise InputError(name, "not one of those that there are", found=value, expected=", ".join(known))
        return cls(asked, form.text("held", "file"), step, quantity)

    @property
    def grid(self) -> tuple[str, str]:
        """Polar angles and azimuths as ``probe map`` takes them."""
        return f"0:90:{self.step_deg}", f"0:360:{self.step_deg}"

    def query(self) -> str:
        """As an address has it."""
        return urlencode({"probe": self.probe, "held": self.held, "step": self.step_deg, "quantity": self.quantity})


def _probes(site: Site) -> Iterator[str]:
    """The machine's own probe, probe files and tables of the project, and the shipped probes."""
    from stepgauge.files.resources import shipped_names

    if site.has_project:
        yield OF_MACHINE
    yield from (name for name in listed(site.folder, [".toml"])[:MOST_FILES] if _is_probe(site.folder / name))
    yield from (name for name in listed(site.folder, [".csv"])[:MOST_FILES] if _is_map(site.folder / name))
    yield from shipped_names("probes")


def _is_probe(path: Path) -> bool:
    try:
        return set(tomllib.loads(path.read_text("utf-8-sig"))) == {"probe"}
    except (OSError, ValueError):
        return False


def _is_map(path: Path) -> bool:
    from stepgauge.probes.directions_map import COLUMNS

    try:
        with path.open(encoding="utf-8-sig") as file:
            return file.readline(200).strip() == ",".join(COLUMNS)
    except (OSError, ValueError):
        return False


def _map(site: Site, asked: ProbeSelection) -> DirectionMap:
    files = [site.stated("machine")] if asked.probe == OF_MACHINE else [_file(site, asked.probe)]
    return _mapped(asked.probe == OF_MACHINE, files[0], asked.held, asked.grid, stamps(*files))


def _file(site: Site, name: str) -> str:
    """A file of the project, or the name of a shipped probe."""
    if name.endswith((".toml", ".csv")):
        return relative(site.folder, str(existing(site.folder, name)))
    return name


@lru_cache(8)
def _mapped(of_machine: bool, name: str, held: str, grid: tuple[str, str], _: tuple[Stamp, ...]) -> DirectionMap:
    import stepgauge as sg

    if name.endswith(".csv"):
        return sg.read_probe_map(name)
    if not of_machine:
        return sg.probe_map(name, polar_deg=grid[0], azimuth_deg=grid[1], stylus_direction=HELD[held])
    from stepgauge.probes.angles import direction_grid
    from stepgauge.probes.directions_map import map_directions
    from stepgauge.probes.read import make_probe

    machine = sg.read_machine(name)
    table = machine.probe
    if HELD[held] is not None:
        table = table.model_copy(update={"stylus_direction": HELD[held]})
    return map_directions(make_probe(table, machine.probe_path or machine.path), *direction_grid(*grid))


def show(request: Request) -> Response:
    """The controls; the body follows them."""
    site = site_of(request)
    asked = ProbeSelection.of(site, asked_form(request))
    return render(
        request,
        "probe.html.j2",
        probes=list(_probes(site)),
        of_machine=OF_MACHINE,
        asked=asked,
        held=list(HELD),
        steps=STEPS_DEG,
        quantities=QUANTITIES,
    )


def part(request: Request) -> Response:
    """Body, curves, and the numbers in words."""
    site = site_of(request)
    asked = ProbeSelection.of(site, asked_form(request))
    found = _map(site, asked)
    rows = [_row(found, name, unit) for name, unit in QUANTITIES.items()]
    known = bool(np.isfinite(getattr(found, asked.quantity)).any())
    machine = stated(site) if asked.probe == OF_MACHINE else None
    return render(
        request,
        "probe_part.html.j2",
        asked=asked,
        rows=rows,
        known=known,
        unstated=machine is not None and not machine.probe.states_radius,
        never=int(np.isinf(found.pretravel_um).sum()),
        total=found.pretravel_um.size,
        command=_command(asked),
    )


def _row(found: DirectionMap, name: str, unit: str) -> dict[str, Any]:
    values = getattr(found, name)
    values = values[np.isfinite(values)]
    ends = (float(values.min()), float(values.mean()), float(values.max())) if values.size else (None, None, None)
    return {"name": name, "unit": unit, "least": ends[0], "mean": ends[1], "most": ends[2]}


def _command(asked: ProbeSelection) -> list[str]:
    """``stepgauge probe map`` as it makes this table; empty for the machine's own probe and for a table."""
    if asked.probe == OF_MACHINE or asked.probe.endswith(".csv"):
        return []
    direction = HELD[asked.held]
    held = [] if direction is None else ["--stylus-direction", ",".join(f"{one:g}" for one in direction)]
    output = f"results/{Path(asked.probe).stem}-map.csv"
    return ["probe", "map", asked.probe, "--polar", asked.grid[0], "--azimuth", asked.grid[1], *held, "-o", output]


def chart(request: Request) -> Response:
    """The body, or with ``curves`` the same round the stylus."""
    from stepgauge.figures.probe_body import probe_body, probe_curves

    site = site_of(request)
    asked = ProbeSelection.of(site, asked_form(request))
    draw = probe_curves if "curves" in request.query_params else probe_body
    return json_answer(request, json.dumps(draw(_map(site, asked), asked.quantity)))


def write(request: Request, form: Form) -> Response:
    """``stepgauge probe map``: the table as a file of the project."""
    site = site_of(request)
    asked = ProbeSelection.of(site, form)
    command = _command(asked)
    if not command:
        raise InputError("probe", "this is no probe file", found=asked.probe, expected="a probe file or a shipped one")
    return run_verb(request, command, "/probe", probe=command[-1], quantity=asked.quantity)


ROUTES = [
    Route("/probe", show),
    Route("/probe/part", part),
    Route("/probe/chart.json", chart),
    Route("/probe/write", form_endpoint(write), methods=["POST"]),
]
