"""Machine: its kind with sensible values, its travel, speeds and probe, and what its maker permits as an error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError, naming
from stepgauge.web.fields import Field, fields_of, read_fields
from stepgauge.web.folder import free_name, relative
from stepgauge.web.forms import Form, asked_form, form_endpoint
from stepgauge.web.render import address, render, site_of, words_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.machine.file import Machine
    from stepgauge.web.texts import Words

FOLDER = "machine"
KINDS: Mapping[str, Mapping[str, Any]] = {
    "bridge": {
        "travel": ((0, 700), (0, 1000), (0, 600)),
        "repeatability_um": 0.3,
        "measuring_speed_mm_s": 3.0,
        "travel_speed_mm_s": 50.0,
        "tip_radius_mm": 2.0,
        "pretravel_um": 3.0,
        "stylus_length_mm": 50.0,
        "stylus_diameter_mm": 2.5,
    },
    "gantry": {
        "travel": ((0, 3000), (0, 5000), (0, 2000)),
        "repeatability_um": 1.0,
        "measuring_speed_mm_s": 4.0,
        "travel_speed_mm_s": 150.0,
        "tip_radius_mm": 4.0,
        "pretravel_um": 6.0,
        "stylus_length_mm": 100.0,
        "stylus_diameter_mm": 5.0,
    },
    "machine_tool": {
        "travel": ((-400, 400), (-250, 250), (0, 500)),
        "repeatability_um": 0.8,
        "measuring_speed_mm_s": 1.0,
        "travel_speed_mm_s": 80.0,
        "tip_radius_mm": 3.0,
        "pretravel_um": 9.0,
        "stylus_length_mm": 50.0,
        "stylus_diameter_mm": 4.0,
    },
    "small_mill": {
        "travel": ((0, 300), (0, 300), (-80, 0)),
        "repeatability_um": 5.0,
        "measuring_speed_mm_s": 1.0,
        "travel_speed_mm_s": 20.0,
        "tip_radius_mm": 1.0,
        "pretravel_um": 10.0,
        "stylus_length_mm": 30.0,
        "stylus_diameter_mm": 1.2,
    },
}
"""Kinds of machines with values as such machines have them, each shown and to be changed; none has a limit: what the
maker of a machine permits is not that of its kind, and pass or fail would rest on it."""
OF_MACHINE = ("name", "serial", "repeatability_um", "measuring_speed_mm_s", "travel_speed_mm_s")
THERMAL = ("temperature_C", "scale_expansion_per_K", "temperature_convention")
OF_PROBE = ("tip_radius_mm", "pretravel_um", "stylus_length_mm", "stylus_diameter_mm")
OF_LIMIT = (
    Field("mpe_constant", "number", "µm", 0.0, 1e4, decides=True),
    Field("mpe_divisor", "number", "", 1e-3, 1e9),
)
OF_UNCERTAINTY = (
    Field("u_gauge_temperature_K", "number", "K", 0.0, 5.0, decides=True),
    Field("u_scale_temperature_K", "number", "K", 0.0, 5.0),
    Field("u_scale_expansion_per_K", "number", "10⁻⁶/K", 0.0, 10e-6, factor=1e-6),
    Field("u_probing_um", "number", "µm", 0.0, 100.0, decides=True),
    Field("resolution_um", "number", "µm", 0.0, 100.0, decides=True),
)
TYPICAL = {
    "bridge": (0.1, 0.1, 0.5e-6, 0.3, 0.1),
    "gantry": (0.3, 0.3, 0.5e-6, 0.8, 0.1),
    "machine_tool": (0.5, 0.5, 1e-6, 0.5, 1.0),
    "small_mill": (1.0, 1.0, 1e-6, 3.0, 2.5),
}
"""Values of :data:`OF_UNCERTAINTY` as such machines often have them: shown beside an empty field, never filled in, for
a decision would rest on them."""
UNCERTAIN = {"u_scale_temperature_K": "temperature_C", "u_scale_expansion_per_K": "scale_expansion_per_K"}
"""Keys of ``[machine]`` that may have a standard uncertainty beside their value."""


def groups() -> dict[str, tuple[Field, ...]]:
    """The fields by the part of the form."""
    from stepgauge.machine.file import MachineTable
    from stepgauge.probes.schema import ConstantTable

    return {
        "machine": fields_of(MachineTable, OF_MACHINE),
        "travel": tuple(
            Field(f"{axis}_{end}", "number", "mm", required=True) for axis in "xyz" for end in ("low", "high")
        ),
        "probe": fields_of(ConstantTable, OF_PROBE),
        "limit": OF_LIMIT,
        "thermal": tuple(
            replace(one, decides=one.name == "temperature_convention") for one in fields_of(MachineTable, THERMAL)
        ),
        "uncertainty": OF_UNCERTAINTY,
    }


def show(request: Request) -> Response:
    """The form, with what the project's machine file says, or as machines of a kind usually are."""
    site, kind = site_of(request), asked_form(request).text("kind")
    machine = None if kind in KINDS else stated(site)
    fields = groups()
    usual = kind if kind in KINDS else "bridge"
    own = values_of_kind(usual, fields) if machine is None else values_of(machine)
    if machine is not None and not _is_constant(machine):
        fields = {key: some for key, some in fields.items() if key != "probe"}
    return render(
        request,
        "machine.html.j2",
        groups=fields | {"uncertainty": _typical_uncertainties(usual, words_of(request))},
        values=own,
        kinds=tuple(KINDS),
        kind=usual if machine is None else "",
        machine=machine,
        saved=request.query_params.get("saved", ""),
    )


def _typical_uncertainties(kind: str, words: Words) -> tuple[Field, ...]:
    """The uncertainties with what they typically are, for a person who has to find out what they are here."""
    typical = zip(OF_UNCERTAINTY, TYPICAL[kind], strict=True)
    return tuple(replace(one, default=words("machine.typical", value=one.shown(value))) for one, value in typical)


def stated(site: Site) -> Machine | None:
    """The machine of the project; None where it has none that can be read."""
    from stepgauge.machine.file import read_machine

    try:
        return read_machine(site.stated("machine")) if site.has_project else None
    except InputError:
        return None


def _is_constant(machine: Machine) -> bool:
    """Whether the probe has the same pre-travel in all directions, in the machine file itself: the form has that."""
    return machine.probe.model == "constant" and machine.probe_path == machine.path


def values_of_kind(kind: str, fields: Mapping[str, tuple[Field, ...]]) -> dict[str, str]:
    """The fields as machines of a kind usually are."""
    usual = dict(KINDS[kind])
    low_high = {
        f"{axis}_{end}": value
        for axis, pair in zip("xyz", usual["travel"], strict=True)
        for end, value in zip(("low", "high"), pair, strict=True)
    }
    known = {**usual, **low_high, "temperature_C": 20.0, "scale_expansion_per_K": 11.5e-6}
    return {one.name: one.shown(known.get(one.name)) for some in fields.values() for one in some}


def values_of(machine: Machine) -> dict[str, str]:
    """The fields as a machine file says."""
    from stepgauge.standards.mpe import Mpe

    limit = Mpe.parse(machine.table.mpe) if machine.table.mpe else None
    ends = {
        f"{axis}_{end}": value
        for axis, pair in zip("xyz", machine.travel_mm.tolist(), strict=True)
        for end, value in zip(("low", "high"), pair, strict=True)
    }
    u = {one.key.removeprefix("machine."): one.u for one in machine.uncertain}
    stated_u = machine.stated
    known = {
        **machine.table.model_dump(),
        **machine.probe.model_dump(),
        "name": machine.table.name,
        **ends,
        "mpe_constant": limit.constant_um if limit else None,
        "mpe_divisor": limit.divisor if limit and limit.um_per_mm else None,
        "u_gauge_temperature_K": stated_u.gauge_temperature_K.u if stated_u.gauge_temperature_K else None,
        "u_probing_um": stated_u.probing_um.u if stated_u.probing_um else None,
        "resolution_um": stated_u.resolution_um,
        **{name: u.get(key) for name, key in UNCERTAIN.items()},
    }
    return {one.name: one.shown(known.get(one.name)) for some in groups().values() for one in some}


def save(request: Request, form: Form) -> Response:
    """Write the machine file, or what has changed in it, and state it in the project."""
    from stepgauge.files.text import write_text
    from stepgauge.machine.file import read_machine
    from stepgauge.web.project_file import changed, state

    site = site_of(request)
    machine = None if form.has("new") else stated(site)
    tables = _tables(form, machine)
    place = _place(site, machine, tables["machine"]["name"])
    text = changed(place, tables)
    with site.writing():
        place.parent.mkdir(exist_ok=True)
        write_text(place, text)
        read_machine(place)
    state(site, {"machine": relative(site.folder, str(place))})
    return render(request, "gone.html.j2", address=address("/machine", saved=relative(site.folder, str(place))))


def _place(site: Site, machine: Machine | None, name: str) -> Path:
    """The file of this machine, where it lies in the project; else a new one with its name."""
    if machine is not None and Path(machine.path).resolve().is_relative_to(site.folder):
        return Path(machine.path).resolve()
    words = "-".join("".join(one if one.isalnum() else " " for one in name.lower()).split())
    return free_name(site.folder, f"{FOLDER}/{words or 'machine'}.toml")


def _tables(form: Form, machine: Machine | None) -> dict[str, dict[str, Any]]:
    """What the form states, by the tables of the file; None for a key that is empty now."""
    fields = groups()
    own = {one.name: one.read(form) for key in ("machine", "thermal") for one in fields[key]}
    ends = read_fields(form, fields["travel"])
    own["travel_mm"] = {axis: [ends[f"{axis}_low"], ends[f"{axis}_high"]] for axis in "xyz"}
    own["mpe"] = _limit(form)
    u = read_fields(form, OF_UNCERTAINTY)
    for name, key in UNCERTAIN.items():
        if name in u and own.get(key) is not None:
            own[key] = {"value": own[key], "u": u[name]}
    tables = {"machine": own, "uncertainty": _uncertainty(u, machine)}
    if machine is None or _is_constant(machine):
        tables["probe"] = {"model": "constant", **{one.name: one.read(form) for one in fields["probe"]}}
    return {name: table for name, table in tables.items() if name != "uncertainty" or any(table.values()) or machine}


def _uncertainty(u: Mapping[str, float], machine: Machine | None) -> dict[str, Any]:
    """``[uncertainty]``; a value that is as it was keeps its degrees of freedom."""
    named = {"gauge_temperature_K": u.get("u_gauge_temperature_K"), "probing_um": u.get("u_probing_um")}
    found: dict[str, Any] = {"resolution_um": u.get("resolution_um") or None}
    for key, value in named.items():
        before = getattr(machine.stated, key) if machine is not None else None
        kept = before.dof if before is not None and before.u == value else None
        found[key] = value if kept is None else {"u": value, "dof": kept}
    return found


def _limit(form: Form) -> str | None:
    """``A + L/K`` from its two fields."""
    from stepgauge.standards.mpe import Mpe

    constant, divisor = (one.read(form) for one in OF_LIMIT)
    if constant is None and divisor is None:
        return None
    if constant is None:
        raise InputError(naming("mpe_constant"), naming("not_filled_in"), expected="0 or more")
    text = f"{constant:g}" + (f" + L/{divisor:g}" if divisor else "")
    Mpe.parse(text)
    return text


ROUTES = [
    Route("/machine", show),
    Route("/machine", form_endpoint(save), methods=["POST"]),
]
