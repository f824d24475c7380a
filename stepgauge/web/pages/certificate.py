"""Certificate: what only the laboratory knows, as a form; the file of it is that of the reports and of the DCC."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import LONGEST, InputError, naming
from stepgauge.web.evaluations import read_evaluation, report_words
from stepgauge.web.fields import Field, fields_of, read_fields
from stepgauge.web.folder import existing, relative
from stepgauge.web.forms import Form, form_endpoint, private_file
from stepgauge.web.render import render, run_verb, site_of, words_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.files.config import TomlTable
    from stepgauge.reports.certificate_file import Laboratory

FILE = "certificate.toml"
KEYS: Mapping[str, tuple[str, ...]] = {
    "certificate": (
        "number",
        "issued",
        "received",
        "performed_from",
        "performed_to",
        "place",
        "mark",
        "replaces",
        "example",
    ),
    "item": ("name", "manufacturer", "model", "serial", "owner_number", "condition"),
    "laboratory": ("name", "street", "street_number", "post_code", "city", "country", "accreditation"),
    "customer": ("name", "city", "country"),
    "method": ("name", "deviations"),
    "person": ("name", "role"),
    "statements": ("traceability", "adjustment", "mpe", "remarks"),
}
"""Keys of the tables, in the order of the form."""
REQUIRED = {
    *("certificate.number", "certificate.issued", "certificate.performed_from", "certificate.performed_to"),
    *("laboratory.name", "laboratory.city", "customer.name", "item.manufacturer", "method.name", "person.name"),
}
"""Without these nothing may be signed (ISO/IEC 17025:2017, 7.8.2.1)."""
DAYS = ("certificate.performed_from", "certificate.performed_to")
LIMIT = "statements.mpe"
AIR = {"temperature_C": "°C", "humidity_percent": "%"}
ENDS = ("low", "high")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")


class EmptyFieldsError(InputError):
    """Fields that must be filled in and are not: all of them in one message."""

    longest: ClassVar[int] = 4 * LONGEST


@cache
def groups() -> dict[str, tuple[Field, ...]]:
    """The fields by table."""
    from stepgauge.reports.certificate_file import ResponsiblePerson, tables

    models: dict[str, type[TomlTable]] = {**tables(), "person": ResponsiblePerson}
    found = {
        name: tuple(replace(one, required=one.name in REQUIRED) for one in fields_of(models[name], keys, name))
        for name, keys in KEYS.items()
    }
    air = [
        Field(f"conditions.{key}_{end}", "number", unit, label=f"{key}_{end}")
        for key, unit in AIR.items()
        for end in ENDS
    ]
    return {**found, "conditions": tuple(air)}


def show(request: Request) -> Response:
    """The form, as the file says."""
    site, words = site_of(request), words_of(request)
    said = _read(site)
    values = _dated(_values(site, said), site, request.query_params.get("result", ""))
    return render(
        request,
        "certificate.html.j2",
        groups=groups(),
        values=values | {LIMIT: words.decimal(values[LIMIT])},
        result=request.query_params.get("result", ""),
    )


def _dated(values: dict[str, str], site: Site, result: str) -> dict[str, str]:
    """With the day of the measurement where no day of the calibration is stated."""
    if not result or not (site.folder / result / "evaluation.json").is_file():
        return values
    day = str(read_evaluation(site, relative(site.folder, result), with_inputs=False).get("measured_at") or "")[:10]
    return {key: value or (day if key in DAYS else "") for key, value in values.items()}


def _read(site: Site) -> Laboratory | None:
    from stepgauge.reports.certificate_file import read_laboratory

    path = site.folder / FILE
    return read_laboratory(path) if path.is_file() else None


def _values(site: Site, said: Laboratory | None) -> dict[str, str]:
    """What the file says by field; of the item what the machine file says, as long as nothing else is stated."""
    known: dict[str, Any] = {}
    if said is not None:
        tables = {name: getattr(said, name).model_dump() for name in KEYS if name != "person"}
        tables["person"] = said.persons[0].model_dump() if said.persons else {}
        known = {f"{name}.{key}": value for name, table in tables.items() for key, value in table.items()}
        for key in AIR:
            pair = getattr(said.conditions, key) or ("", "")
            known |= {f"conditions.{key}_{end}": value for end, value in zip(ENDS, pair, strict=True)}
    machine = _machine_values(site)
    known = machine | known
    if machine.get("statements.mpe"):  # one limit for page and certificate: that of the machine as it is stated now
        known["statements.mpe"] = machine["statements.mpe"]
    if site.has_project:
        known["person.name"] = known.get("person.name") or site.project().common.get("operator", "")
    return {one.name: one.shown(known.get(one.name)) for some in groups().values() for one in some}


def _machine_values(site: Site) -> dict[str, Any]:
    from stepgauge.web.pages.machine import stated

    machine = stated(site)
    if machine is None:
        return {}
    return {"item.name": machine.table.name, "item.serial": machine.table.serial, "statements.mpe": machine.table.mpe}


def make(request: Request, form: Form) -> Response:
    """Write the file, and the certificate of an evaluation as a PDF."""
    from stepgauge.files.text import write_text
    from stepgauge.reports.certificate_file import check_filled
    from stepgauge.web.site import changed

    site = site_of(request)
    result = relative(site.folder, str(existing(site.folder, form.text("result"))))
    _check_all(form)
    text = changed(site.folder / FILE, _tables(form))
    said = _checked(text)
    with site.writing():
        write_text(site.folder / FILE, text)
    check_filled(said)
    number = re.sub(r"[^\w.-]+", "-", said.certificate.number or "")
    target = f"results/certificate-{number}.pdf"
    arguments = [
        *("report", result, "--certificate", FILE, "--language", words_of(request).language),
        *(*report_words(site, result), "-o", relative(site.folder, target)),
    ]
    return run_verb(request, arguments, "/report", result=result, paper=target)


def _checked(text: str) -> Laboratory:
    """The file as it is going to be; :class:`InputError` of what is wrong on the page, not in a file."""
    from stepgauge.files.text import write_text
    from stepgauge.reports.certificate_file import read_laboratory

    try:
        with private_file(FILE) as path:
            write_text(path, text)
            return read_laboratory(path)
    except InputError as error:
        _, what, found, expected = error.parts
        if what == "table certificate is wrong":  # its entries are right each by itself
            what = "these entries do not fit together"
        raise InputError("", what, found=found, expected=expected) from None


def _check_all(form: Form) -> None:
    """:class:`InputError` that names every field that must be filled in and is not."""
    empty = [one for some in groups().values() for one in some if one.required and not form.has(one.name)]
    if empty:
        every = naming(*(one.name for one in empty), words=", ".join("{}" for _ in empty))
        raise EmptyFieldsError(every, naming("not_filled_in"))


def _tables(form: Form) -> dict[str, Any]:
    """The tables of the file; a key that was emptied goes."""
    found: dict[str, Any] = {}
    for name, some in groups().items():
        if name in KEYS:
            found[name] = {one.label: one.read(form) for one in some}
    if limit := found["statements"]["mpe"]:
        found["statements"]["mpe"] = _DECIMAL_COMMA.sub(".", limit)
    air = read_fields(form, groups()["conditions"])
    pairs = {key: [air.get(f"conditions.{key}_{end}") for end in ENDS] for key in AIR}
    for key, (low, high) in pairs.items():
        if low is not None and high is not None and low > high:
            where = naming(f"conditions.{key}_high")
            raise InputError(where, naming("not_in_range"), found=f"{high:g}", expected=f"more than {low:g}")
    found["conditions"] = {key: pair if None not in pair else None for key, pair in pairs.items()}
    person = {key: value for key, value in found.pop("person").items() if value is not None}
    found[""] = {"person": [{**person, "signs": True}] if person else None}
    return found


ROUTES = [
    Route("/certificate", show),
    Route("/certificate", form_endpoint(make), methods=["POST"]),
]
