"""Statements of a laboratory on a calibration (ISO/IEC 17025:2017, 7.8.2.1 and 7.8.4.1), and those missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from stepgauge.files.notation import clean, number
from stepgauge.reports.certificate_file import ContactDetails, Laboratory, ResponsiblePerson
from stepgauge.reports.sections import Section
from stepgauge.reports.statements import IN_FULL, ONLY_ITEMS, traceability, uncertainty_text
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.standards.conformity import Conformity

PLACES = {
    "laboratory": "in the laboratory",
    "customer": "at the customer's",
    "laboratoryBranch": "in a branch of the laboratory",
    "customerBranch": "at a branch of the customer",
    "other": "elsewhere",
}
Row = tuple[str, str | None]


def end_mark(said: Laboratory, title: str) -> str:
    """The end of the last page."""
    number_text = said.certificate.number
    return f"End of {title.lower()} {number_text}" if number_text else f"End of the {title.lower()}"


def not_stated(evaluation: dict[str, Any], said: Laboratory) -> list[str]:
    """What the certificate prints as not stated for want of it in ``certificate.toml``, one entry to a line.

    What a certificate has only where there is any (receipt, accreditation, adjustment, deviations) is none of it.
    """
    head, item = said.certificate, said.item
    asked = (
        ("number of the certificate", head.number),
        ("date of issue", head.issued),
        ("dates of the calibration", head.performed_from and head.performed_to),
        ("place of the calibration", head.place or head.place_text),
        ("name of the laboratory", said.laboratory.name),
        ("address of the laboratory", said.laboratory.address),
        ("name of the customer", said.customer.name),
        ("contact of the customer", said.customer.address or said.customer.email or said.customer.phone),
        ("item", item.name or evaluation["comments"].get("machine")),
        ("manufacturer of the item", item.manufacturer),
        ("model of the item", item.model),
        ("serial or inventory number of the item", item.serial or item.owner_number),
        ("condition of the item", item.condition),
        ("procedure of the laboratory", said.method.name),
        ("air temperature", said.conditions.temperature_C),
        ("relative humidity", said.conditions.humidity_percent),
        ("person who authorises the certificate", [one for one in said.persons if one.signs]),
    )
    return [what for what, value in asked if not value]


def _text(value: object) -> str | None:
    return clean(value) or None if value is not None else None


def _section(title: str, rows: Sequence[Row]) -> Section:
    return Section(title, [(label, _text(value)) for label, value in rows])


def _where_any(title: str, label: str, value: str | None) -> list[Section]:
    return [_section(title, [(label, value)])] if value else []


def identity_sections(evaluation: dict[str, Any], said: Laboratory) -> list[Section]:
    """Identification of laboratory, customer, item, dates, place and method: the head of page 1."""
    return [
        _section("Laboratory", _contact(said.laboratory, laboratory=True)),
        _section("Customer", _contact(said.customer)),
        _section("Item calibrated", _item(said, evaluation["comments"].get("machine"))),
        _section("Calibration", _calibration(said)),
    ]


def _calibration(said: Laboratory) -> list[Row]:
    """Number, dates, place and procedure; what a certificate has only now and then is left out without a value."""
    head = said.certificate
    place = ", ".join(part for part in (PLACES.get(head.place or ""), head.place_text) if part)
    days = [day.isoformat() if day else None for day in (head.performed_from, head.performed_to)]
    performed = " to ".join(dict.fromkeys(day for day in days if day)) or None
    identity: list[Row] = [("Number", head.number)]
    if head.replaces:
        identity.append(("Replaces certificate", head.replaces))
    if head.received:
        identity.append(("Item received", head.received.isoformat()))
    identity += [
        ("Calibrated", performed),
        ("Issued", head.issued.isoformat() if head.issued else None),
        ("Place", place or None),
        ("Procedure", said.method.name or None),
    ]
    if said.method.standards:
        identity.append(("Standards", ", ".join(said.method.standards)))
    return identity


def _item(said: Laboratory, machine: str | None) -> list[Row]:
    """What was calibrated: as the laboratory says, else the machine of the recording."""
    item = said.item
    described: list[Row] = [
        ("Item", item.name or machine),
        ("Manufacturer", item.manufacturer),
        ("Model", item.model),
        *_either(("Serial number", item.serial), ("Inventory number", item.owner_number)),
        ("Condition", item.condition),
    ]
    if item.software:
        described.append(("Software", item.software))
    return described


def _contact(contact: ContactDetails, laboratory: bool = False) -> list[Row]:
    ways = (("E-mail", contact.email), ("Telephone", contact.phone))
    if laboratory:
        reached = [("Address", contact.address), *(way for way in ways if way[1])]
        accredited = [("Accreditation", contact.accreditation)] if contact.accreditation else []
        return [("Name", contact.name), *reached, *accredited]
    return [("Name", contact.name), *_either(("Address", contact.address), *ways)]


def _either(*rows: Row) -> list[Row]:
    """Rows of which one is enough: those that are stated, else the first."""
    return [row for row in rows if row[1]] or [*rows[:1]]


def closing_sections(
    evaluation: dict[str, Any],
    said: Laboratory,
    budget: StoredBudget | None,
    judged: Conformity | None = None,
) -> list[Section]:
    """Uncertainty, conditions, traceability, adjustment, conformity, scope and persons: after the results."""
    told = said.statements
    conformity = "No statement of conformity is made." if judged is None else judged.text
    uncertainty = None if budget is None else uncertainty_text(budget, assumptions=False)
    sections = [
        _section("Measurement uncertainty", [("Expanded", uncertainty)]),
        _section("Conditions", _conditions(said)),
        _section("Metrological traceability", [("Traceable", traceability(said, evaluation))]),
        *_where_any("Adjustment or repair", "Before and after", told.adjustment),
        _section("Conformity", [("Statement", conformity)]),
        *_where_any("Additions, deviations, exclusions", "Of the method", said.method.deviations),
        _section("Scope", [("Validity", ONLY_ITEMS), ("Reproduction", IN_FULL)]),
        _section("Persons", _persons(said)),
    ]
    if told.external:
        sections.insert(-1, _section("External providers", [("Provided", told.external)]))
    if told.remarks:
        sections.insert(-1, _section("Remarks", [("Remarks", told.remarks)]))
    return sections


def _persons(said: Laboratory) -> list[Row]:
    """Who authorises the certificate, not stated where nobody does, and who took part."""
    rows = [_person(one) for one in said.persons]
    return rows if any(one.signs for one in said.persons) else [*rows, ("Authorised by", None)]


def _person(one: ResponsiblePerson) -> Row:
    name = f"{one.name}, {one.role}" if one.role else one.name
    return ("Authorised by" if one.signs else "Took part", name)


def _conditions(said: Laboratory) -> list[Row]:
    rows: list[Row] = []
    for label, pair, unit in (
        ("Air temperature", said.conditions.temperature_C, "°C"),
        ("Relative humidity", said.conditions.humidity_percent, "%"),
    ):
        rows.append((label, None if pair is None else f"{number(pair[0], 1)} to {number(pair[1], 1)} {unit}"))
    return rows
