"""Machine: its kind with sensible values, its travel, speeds and probe, and what its maker permits as an error."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
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
CHOSEN: Mapping[str, Mapping[str, Any]] = {
    "bridge": {"travel": ((0, 700), (0, 1000), (0, 600)), "measuring_speed_mm_s": 3.0, "travel_speed_mm_s": 50.0},
    "gantry": {"travel": ((0, 3000), (0, 5000), (0, 2000)), "measuring_speed_mm_s": 4.0, "travel_speed_mm_s": 150.0},
    "machine_tool": {
        "travel": ((-400, 400), (-250, 250), (0, 500)),
        "measuring_speed_mm_s": 1.0,
        "travel_speed_mm_s": 80.0,
    },
    "small_mill": {"travel": ((0, 300), (0, 300), (-80, 0)), "measuring_speed_mm_s": 1.0, "travel_speed_mm_s": 20.0},
}
"""What a program may do, by the kind of the machine: filled in, for it holds because it was chosen."""
MEASURED = (
    *("repeatability_um", "tip_radius_mm", "pretravel_um", "stylus_length_mm", "stylus_diameter_mm"),
    *("u_gauge_temperature_K", "u_scale_temperature_K", "u_scale_expansion_per_K", "u_probing_um", "resolution_um"),
)
TYPICAL: Mapping[str, tuple[float, ...]] = {
    "bridge": (0.3, 2.0, 3.0, 50.0, 2.5, 0.1, 0.1, 0.5e-6, 0.3, 0.1),
    "gantry": (1.0, 4.0, 6.0, 100.0, 5.0, 0.3, 0.3, 0.5e-6, 0.8, 0.1),
    "machine_tool": (0.8, 3.0, 9.0, 50.0, 4.0, 0.5, 0.5, 1e-6, 0.5, 1.0),
    "small_mill": (5.0, 1.0, 10.0, 30.0, 1.2, 1.0, 1.0, 1e-6, 3.0, 2.5),
}
"""Values of :data:`MEASURED` as such machines often have them: shown beside an empty field, never filled in, for what
nobody stated would be decided by, or found wrong, as if somebody had."""
PRIOR_KIND = {"bridge": "cmm", "gantry": "cmm", "machine_tool": "machine tool", "small_mill": "machine tool"}
"""The ``kind`` of a machine file by the kind that is chosen here; of several the travel tells which."""
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
_PER_K = re.compile(r"^\s*L\s*/\s*", re.IGNORECASE)
UNCERTAIN = {"u_scale_temperature_K": "temperature_C", "u_scale_expansion_per_K": "scale_expansion_per_K"}
"""Keys of ``[machine]`` that may have a standard uncertainty beside their value."""


def groups(machine: Machine | None = None) -> dict[str, tuple[Field, ...]]:
    """The fields by the part of the form."""
    from stepgauge.machine.file import MachineTable
    from stepgauge.probes.schema import ConstantTable

    own = _kind(machine)
    kind = Field("kind", "choice", choices=(*CHOSEN, *({own} - {*CHOSEN, ""})), default=own)
    return {
        "machine": (kind, *fields_of(MachineTable, OF_MACHINE)),
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


def _kind(machine: Machine | None) -> str:
    """Which of :data:`CHOSEN` a machine is: of those of its kind the one whose longest travel is nearest to its own.

    The ``kind`` of its file where it is none of them, empty where the file states none.
    """
    if machine is None:
        return next(iter(CHOSEN))
    longest_mm = np.ptp(machine.travel_mm, axis=1).max()
    off = {
        name: abs(np.log(np.ptp(CHOSEN[name]["travel"], axis=1).max() / longest_mm))
        for name, kind in PRIOR_KIND.items()
        if kind == machine.table.kind
    }
    return min(off, key=off.__getitem__, default=machine.table.kind or "")


def show(request: Request) -> Response:
    """The form, with what the project's machine file says, or as machines of a kind usually are."""
    machine = stated(site_of(request))
    fields = groups(machine)
    asked = asked_form(request).text("kind")
    kind = asked if asked in CHOSEN else _kind(machine)
    usual = kind if kind in CHOSEN else next(iter(CHOSEN))
    own = _chosen_values(usual) if machine is None else values_of(machine)
    if machine is not None and not _is_constant(machine):
        fields = {key: some for key, some in fields.items() if key != "probe"}
    return render(
        request,
        "machine.html.j2",
        groups={key: [_hinted(one, usual, words_of(request)) for one in some] for key, some in fields.items()},
        values={**own, "kind": kind},
        saved=request.query_params.get("saved", ""),
    )


def _hinted(one: Field, kind: str, words: Words) -> Field:
    """A field with what it typically is, for a person who has to find out what it is here."""
    typical = dict(zip(MEASURED, TYPICAL[kind], strict=True)) | {
        "temperature_C": 20.0,
        "scale_expansion_per_K": 11.5e-6,
    }
    return (
        replace(one, default=words("machine.typical", value=one.shown(typical[one.name])))
        if one.name in typical
        else one
    )


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


def _chosen_values(kind: str) -> dict[str, str]:
    """The fields before anybody stated anything: what a program may do on such a machine."""
    travel, *speeds = CHOSEN[kind].values()
    return _shown({**dict(zip(("measuring_speed_mm_s", "travel_speed_mm_s"), speeds, strict=True)), **_ends(travel)})


def _ends(travel: Any) -> dict[str, float]:
    """The travel by the fields of its ends."""
    return {
        f"{axis}_{end}": value
        for axis, pair in zip("xyz", travel, strict=True)
        for end, value in zip(("low", "high"), pair, strict=True)
    }


def _shown(known: Mapping[str, Any]) -> dict[str, str]:
    return {one.name: one.shown(known.get(one.name)) for some in groups().values() for one in some}


def values_of(machine: Machine) -> dict[str, str]:
    """The fields as a machine file says."""
    from stepgauge.standards.mpe import Mpe

    limit = Mpe.parse(machine.table.mpe) if machine.table.mpe else None
    u = {one.key.removeprefix("machine."): one.u for one in machine.uncertain}
    stated_u = machine.stated
    known = {
        **machine.probe.model_dump(exclude_unset=True),
        **machine.table.model_dump(exclude_unset=True),
        **_ends(machine.travel_mm.tolist()),
        "mpe_constant": limit.constant_um if limit else None,
        "mpe_divisor": limit.divisor if limit and limit.um_per_mm else None,
        "u_gauge_temperature_K": stated_u.gauge_temperature_K.u if stated_u.gauge_temperature_K else None,
        "u_probing_um": stated_u.probing_um.u if stated_u.probing_um else None,
        "resolution_um": stated_u.resolution_um,
        **{name: u.get(key) for name, key in UNCERTAIN.items()},
    }
    capped = {"mpe_constant": str(limit), "mpe_divisor": ""} if limit and np.isfinite(limit.cap_um) else {}
    return _shown(known) | capped


def save(request: Request, form: Form) -> Response:
    """Write the machine file, or what has changed in it, and state it in the project."""
    from stepgauge.files.text import write_text
    from stepgauge.machine.file import read_machine
    from stepgauge.web.site import changed, state

    site = site_of(request)
    machine = stated(site)
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
    fields = groups(machine)
    own = {one.name: one.read(form) for key in ("machine", "thermal") for one in fields[key]}
    ends = read_fields(form, fields["travel"])
    for axis in "xyz":
        if ends[f"{axis}_low"] >= ends[f"{axis}_high"]:
            found, expected = f"{ends[f'{axis}_high']:g}", f"more than {ends[f'{axis}_low']:g}"
            raise InputError(naming(f"{axis}_high"), naming("not_in_range"), found=found, expected=expected)
    own["travel_mm"] = {axis: [ends[f"{axis}_low"], ends[f"{axis}_high"]] for axis in "xyz"}
    own |= {"mpe": _limit(form), "kind": PRIOR_KIND.get(own["kind"], own["kind"])}
    u = read_fields(form, OF_UNCERTAINTY)
    for name, key in UNCERTAIN.items():
        if name in u and own.get(key) is None:
            raise InputError(naming(key), naming("not_filled_in"))
        if name in u:
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
    """``A + L/K`` from its two fields; K may be typed as ``L/K``, and the whole formula stand in the first."""
    from stepgauge.standards.mpe import Mpe

    formula = form.text("mpe_constant")
    if "/" in formula and not form.has("mpe_divisor"):
        return str(Mpe.parse(formula))
    typed = {**form.texts, "mpe_divisor": _PER_K.sub("", form.text("mpe_divisor"))}
    constant, divisor = (one.read(Form({key: text for key, text in typed.items() if text}, {})) for one in OF_LIMIT)
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
