"""Gauge: what its certificate says, typed, pasted or as a digital one (DCC), checked while it is typed."""

from __future__ import annotations

import re
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
from stepgauge.web.forms import Form, form_endpoint, private_file, read_upload
from stepgauge.web.render import address, render, site_of, words_of
from stepgauge.web.site import Site
from stepgauge.web.texts import Words

if TYPE_CHECKING:
    from stepgauge.dcc.face_table import FaceTable
    from stepgauge.dcc.gauge_read import GaugeImport
    from stepgauge.gauge.certified import Gauge

FOLDER = "gauge"
USUAL = {"reference_temperature_C": 20.0, "coverage_factor": 2.0}
"""What holds unless a certificate says otherwise (ISO 1, EA-4/02): filled in, to be changed."""
OF_STEEL = {"expansion_per_K": 11.5e-6, "expansion_uncertainty_per_K": 0.5e-6}
"""Shown beside an empty field, for every result is corrected by it."""
OF_GAUGE = (
    *("name", "serial", "material", "expansion_per_K", "expansion_uncertainty_per_K", "reference_temperature_C"),
    *("block_width_mm", "block_height_mm", "rail_width_mm", "rail_height_mm"),
)
OF_CERTIFICATE = (
    *("number", "laboratory", "date", "coverage_factor", "degrees_of_freedom", "correlation"),
    *("proportional_um_per_m", "drift_um_per_m_per_year", "recall", "example"),
)
SELDOM = {"rail_width_mm", "rail_height_mm", "degrees_of_freedom", "correlation", "proportional_um_per_m"}
DECIDES = {"drift_um_per_m_per_year"}
"""Without these a budget lacks something, and nothing is decided by it."""
UNIT_FIELDS = ("deviation_unit", "uncertainty_unit")
EXPANDED = ("U_um", "U_um_per_m")
STANDS_OUT = 6.0
"""A deviation so many times the usual distance from the line between its neighbours is shown to be looked at."""
LEAST_SHOWN_UM = 1.0
TABLE = "table"
"""How messages call what was pasted or uploaded."""


def fields() -> tuple[tuple[Field, ...], tuple[Field, ...]]:
    """The fields of gauge and certificate."""
    from stepgauge.gauge.certified import CertificateTable, GaugeTable

    of_certificate = fields_of(CertificateTable, OF_CERTIFICATE)
    return fields_of(GaugeTable, OF_GAUGE), tuple(replace(one, decides=one.name in DECIDES) for one in of_certificate)


def show(request: Request) -> Response:
    """The form, with what the project's gauge says."""
    site = site_of(request)
    gauge = _stated(site)
    values = _values(gauge)
    words = words_of(request)
    hints = {
        one.name: words("gauge.of_steel", value=one.shown(OF_STEEL[one.name]))
        for one in fields()[0]
        if one.name in OF_STEEL
    }
    groups = {
        key: [replace(one, default=hints.get(one.name, "")) for one in some]
        for key, some in zip(("gauge", "certificate"), fields(), strict=True)
    }
    return render(
        request,
        "gauge.html.j2",
        groups={key: [one for one in some if one.name not in SELDOM] for key, some in groups.items()},
        seldom=[one for some in groups.values() for one in some if one.name in SELDOM],
        values=values,
        table=words.decimal(_faces_text(gauge, words)),
        gauge=gauge,
        saved=request.query_params.get("saved", ""),
    )


def _stated(site: Site) -> Gauge | None:
    from stepgauge.gauge.certified import read_gauge

    try:
        return read_gauge(site.stated("gauge")) if site.has_project else None
    except InputError:
        return None


def _values(gauge: Gauge | None) -> dict[str, str]:
    tables = {} if gauge is None else {**gauge.table.model_dump(), **gauge.certificate.model_dump()}
    stated: Mapping[str, Any] = USUAL if gauge is None else tables
    return {one.name: one.shown(stated.get(one.name)) for some in fields() for one in some}


def _faces_text(gauge: Gauge | None, words: Words) -> str:
    """The faces as a table that can be edited."""
    if gauge is None:
        return ""
    expanded = gauge.u_um * gauge.certificate.coverage_factor
    rows = zip(gauge.nominal_mm, gauge.position_mm, expanded, strict=True)
    lines = [f"{face}\t{a:.10g}\t{b:.10g}\t{u:.6g}" for face, (a, b, u) in enumerate(rows, 1)]
    heads = [words("face_role.face"), *(f"{words(f'face_role.{one}')} mm" for one in ("nominal", "position")), "U µm"]
    return "\n".join(["\t".join(heads), *lines])


def check(request: Request, form: Form) -> Response:
    """What the table was taken for, and what is wrong with it; what the rest of the form lacks does not hide that."""
    from stepgauge.dcc.face_table import ROLES
    from stepgauge.importing.tables.read import DECIMALS

    table, rows, wrong = None, list[dict[str, Any]](), None
    try:
        found, table = _found(form, with_usual=True)
        rows = _rows(_gauge(found)) if table else []
    except InputError as error:
        table, wrong = table or _columns_alone(form), error
    asked = [
        one for question in getattr(wrong, "questions", ()) for one in question.choices if one.argument == "decimal"
    ]
    decimals = DECIMALS if asked or form.has("decimal") else ()
    content: dict[str, Any] = {"decimals": decimals, "decimal": form.text("decimal")}
    return render(request, "gauge_table.html.j2", error=wrong, table=table, rows=rows, roles=ROLES, **content)


def _rows(gauge: Gauge) -> list[dict[str, Any]]:
    """Faces with their deviation from nominal, and which of them stand out from their neighbours."""
    import numpy as np

    from stepgauge.physics.robust import mad_sigma

    off_um = 1e3 * (gauge.position_mm - gauge.nominal_mm)
    between = np.zeros_like(off_um)
    between[1:-1] = off_um[1:-1] - (off_um[:-2] + off_um[2:]) / 2.0
    limit = max(STANDS_OUT * mad_sigma(between), LEAST_SHOWN_UM)
    worst = np.abs(between)
    return [
        {
            "face": n + 1,
            "nominal_mm": gauge.nominal_mm[n],
            "position_mm": gauge.position_mm[n],
            "off_um": off_um[n],
            "expanded_um": gauge.u_um[n] * gauge.certificate.coverage_factor,
            "stands_out": bool(worst[n] > limit and worst[n] == worst[max(n - 1, 0) : n + 2].max()),
        }
        for n in range(gauge.n_faces)
    ]


def _columns_alone(form: Form) -> FaceTable | None:
    """The first table that was given, with its columns, where its numbers make no faces."""
    from stepgauge.dcc.face_table import preview

    data = form.files.get("file") or form.text("table").encode()
    try:
        return read_upload(data, TABLE, preview, _source(data), _roles(form)) if data else None
    except InputError:
        return None


def _source(data: bytes) -> Any:
    from stepgauge.importing.tables.source import Source

    return Source(TABLE, data)


def _expanded(form: Form) -> tuple[float, float] | None:
    """U = a + b L as it is stated beside the table, um and um/m."""
    a, b = (form.number(name, 0.0, 100.0) for name in EXPANDED)
    return None if a is None and b is None else (a or 0.0, b or 0.0)


def _roles(form: Form) -> dict[int, str]:
    found = {n: form.text(f"column_{n}") for n in range(30)}
    return {n: role for n, role in found.items() if role}


def _found(form: Form, with_usual: bool = False) -> tuple[GaugeImport, FaceTable | None]:
    """What the form says: a DCC, or a table with its fields; ``with_usual``: where these are not filled in."""
    from stepgauge.dcc.face_table import NOTES, read_face_table
    from stepgauge.dcc.gauge_read import GaugeImport

    data = form.files.get("file") or form.text("table").encode()
    if data.lstrip()[:1] == b"<":
        return _read_certificate(data, form), None
    if not data:
        raise InputError(naming("table"), naming("empty"))
    units = {name.removesuffix("_unit"): form.text(name) for name in UNIT_FIELDS}
    said = {**units, "sign": form.text("deviations")}
    more = _roles(form), said, _expanded(form), form.text("decimal")
    table = read_upload(data, TABLE, read_face_table, _source(data), *more)
    of_gauge, of_certificate = ({one.name: one for one in some} for some in fields())
    stated = _stated_fields(form, of_gauge, with_usual), _stated_fields(form, of_certificate, with_usual)
    rows = [(int(face), a, b, u) for face, a, b, u in table.values.tolist()]
    notes = [NOTES[one] for one in table.notes]
    return GaugeImport(*stated, rows, notes, "the table of a certificate"), table


PLACEHOLDERS: Mapping[str, Any] = {"block_width_mm": 20.0, "block_height_mm": 15.0, **OF_STEEL, **USUAL}


def _stated_fields(form: Form, some: Mapping[str, Field], with_usual: bool) -> dict[str, Any]:
    import datetime

    if not with_usual:
        return read_fields(form, some.values())
    values: dict[str, Any] = {}
    for name, one in some.items():
        usual = PLACEHOLDERS.get(name, datetime.date(2000, 1, 1) if one.kind == "date" else "–")
        try:
            value = one.read(form)
        except InputError:
            value = usual if one.required else None
        values |= {} if value is None else {name: value}
    return values


def _read_certificate(data: bytes, form: Form) -> GaugeImport:
    """A Digital Calibration Certificate; the fields of the form fill in what it lacks."""
    from stepgauge.dcc.gauge_read import StatedGauge, import_gauge

    stated = {
        one.name: one.read(form)
        for one in fields()[0]
        if form.has(one.name) and one.name in StatedGauge.__annotations__
    }
    # a field that has what it had when the page was opened states nothing
    own = StatedGauge(**{key: value for key, value in stated.items() if USUAL.get(key) != value})
    with private_file("certificate.xml") as path:
        path.write_bytes(data)
        return read_upload(data, TABLE, import_gauge, path, own)


def _gauge(found: GaugeImport) -> Gauge:
    """The gauge that the reader makes of it."""
    from stepgauge.dcc.gauge_read import write_gauge

    try:
        with private_file("table.toml") as path:
            return write_gauge(path, found)
    except InputError as error:
        raise error.at(re.sub(r"^table\.(csv|toml)", TABLE, error.where)) from None


def save(request: Request, form: Form) -> Response:
    """Write the gauge into the project, and state it there."""
    from stepgauge.dcc.gauge_read import write_gauge
    from stepgauge.web.site import state

    site = site_of(request)
    found, _ = _found(form)
    _gauge(found)
    place = _place(site, found)
    with site.writing():
        place.parent.mkdir(exist_ok=True)
        write_gauge(place, found)
    state(site, {"gauge": relative(site.folder, str(place))})
    return render(request, "gone.html.j2", address=address("/gauge", saved=relative(site.folder, str(place))))


def _place(site: Site, found: GaugeImport) -> Path:
    """The file of this gauge: that which the project has of the same number, else a new one."""
    stated = _stated(site)
    if stated is not None and stated.table.serial == found.table["serial"]:
        place = Path(stated.path).resolve()
        if place.is_relative_to(site.folder):
            return place
    words = "".join(one if one.isalnum() else "-" for one in str(found.table["serial"])).strip("-")
    return free_name(site.folder, f"{FOLDER}/{words or 'gauge'}.toml")


ROUTES = [
    Route("/gauge", show),
    Route("/gauge/check", form_endpoint(check), methods=["POST"]),
    Route("/gauge", form_endpoint(save), methods=["POST"]),
]
