"""A calibration certificate in the order of ISO/IEC 17025:2017, 7.8.2.1 and 7.8.4.1; what is not stated says so."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from stepgauge.certificate_file import Contact, Laboratory, Person
from stepgauge.gauge import Gauge
from stepgauge.report.numbers import clean, number
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.statements import ONLY_ITEMS, traceability, uncertainty_text

PLACES = {
    "laboratory": "in the laboratory",
    "customer": "at the customer's",
    "laboratoryBranch": "in a branch of the laboratory",
    "customerBranch": "at a branch of the customer",
    "other": "elsewhere",
}
Row = tuple[str, str | None]


def certificate_content(
    evaluation: dict[str, Any], said: Laboratory, gauge: Gauge | None, budget: StoredBudget | None
) -> dict[str, Any]:
    """Sections before and after the results, each with its clause; None where a value is not stated."""
    number_text = said.certificate.number
    end = f"End of calibration certificate {number_text}" if number_text else "End of the calibration certificate"
    return {
        "number": _text(number_text),
        "issued": said.certificate.issued.isoformat() if said.certificate.issued else None,
        "before": _before(evaluation, said),
        "after": _after(evaluation, said, gauge, budget),
        "end": end,
    }


def not_stated(said: Laboratory) -> list[str]:
    """What ISO/IEC 17025 asks for and ``certificate.toml`` does not state."""
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
        ("manufacturer of the item", item.manufacturer),
        ("serial or inventory number of the item", item.serial or item.owner_number),
        ("condition of the item", item.condition),
        ("procedure of the laboratory", said.method.name),
        ("air temperature", said.conditions.temperature_C),
        ("adjustment or repair", said.statements.adjustment),
        ("additions to, deviations from and exclusions from the method", said.method.deviations),
        ("person who authorises the certificate", [one for one in said.persons if one.signs]),
    )
    return [what for what, value in asked if not value]


def _text(value: object) -> str | None:
    return clean(value) or None if value is not None else None


def _section(title: str, clause: str, rows: Sequence[Row]) -> dict[str, Any]:
    return {
        "title": title,
        "clause": clause,
        "rows": [{"label": label, "value": _text(value)} for label, value in rows],
    }


def _before(evaluation: dict[str, Any], said: Laboratory) -> list[dict[str, Any]]:
    head, item = said.certificate, said.item
    place = ", ".join(part for part in (PLACES.get(head.place or ""), head.place_text) if part)
    days = [day.isoformat() if day else None for day in (head.performed_from, head.performed_to)]
    performed = " to ".join(dict.fromkeys(day for day in days if day)) or None
    identity: list[Row] = [("Number", head.number)]
    if head.replaces:
        identity.append(("Replaces certificate", head.replaces))
    dates: list[Row] = [
        ("Item received", head.received.isoformat() if head.received else None),
        ("Calibrated", performed),
        ("Issued", head.issued.isoformat() if head.issued else None),
    ]
    machine = evaluation["comments"].get("machine")
    described: list[Row] = [
        ("Item", item.name or machine),
        ("Manufacturer", item.manufacturer),
        ("Model", item.model),
        ("Serial number", item.serial),
        ("Inventory number", item.owner_number),
        ("Condition", item.condition),
    ]
    if item.software:
        described.append(("Software", item.software))
    method: list[Row] = [("Procedure", said.method.name or None)]
    if said.method.standards:
        method.append(("Standards", ", ".join(said.method.standards)))
    method.append(("Principle", "Step gauge, touch-trigger probing of both sides of every block; see the results"))
    return [
        _section("Laboratory", "7.8.2.1 b", _contact(said.laboratory, laboratory=True)),
        _section("Place of the calibration", "7.8.2.1 c", [("Performed", place or None)]),
        _section("Certificate", "7.8.2.1 d", identity),
        _section("Customer", "7.8.2.1 e", _contact(said.customer)),
        _section("Method", "7.8.2.1 f", method),
        _section("Item calibrated", "7.8.2.1 g", described),
        _section("Dates", "7.8.2.1 h, i, j", dates),
    ]


def _contact(contact: Contact, laboratory: bool = False) -> list[Row]:
    rows: list[Row] = [("Name", contact.name), ("Address", contact.address)]
    rows += [(label, value) for label, value in (("E-mail", contact.email), ("Telephone", contact.phone)) if value]
    return [*rows, ("Accreditation", contact.accreditation)] if laboratory else rows


def _after(
    evaluation: dict[str, Any], said: Laboratory, gauge: Gauge | None, budget: StoredBudget | None
) -> list[dict[str, Any]]:
    told, own = said.statements, evaluation["gauge"]
    traced = None if gauge is None else traceability(said, gauge)
    if traced is None:
        known = f"Step gauge serial number {own['serial']}, certificate {own['certificate']} of {own['laboratory']}."
        traced = f"{known} {told.traceability}" if told.traceability else known
    uncertainty = None if budget is None else uncertainty_text(budget, assumptions=False)
    conformity = "No statement of conformity is made."
    sections = [
        _section("Measurement uncertainty", "7.8.4.1 a", [("Expanded", uncertainty)]),
        _section("Conditions", "7.8.4.1 b", _conditions(evaluation, said)),
        _section("Metrological traceability", "7.8.4.1 c", [("Traceable", traced)]),
        _section("Adjustment or repair", "7.8.4.1 d", [("Before and after", told.adjustment)]),
        _section(
            "Conformity",
            "7.8.4.1 e, 7.8.6",
            [("Statement", told.conformity), ("Decision rule", told.decision_rule)]
            if told.conformity
            else [("Statement", conformity)],
        ),
        _section("Additions, deviations, exclusions", "7.8.2.1 n", [("Of the method", said.method.deviations)]),
        _section("Scope", "7.8.2.1 l", [("Validity", ONLY_ITEMS)]),
        _section("Persons", "7.8.2.1 o", [_person(one) for one in said.persons] or [("Authorised by", None)]),
    ]
    if told.external:
        sections.insert(-1, _section("External providers", "7.8.2.1 p", [("Provided", told.external)]))
    if told.remarks:
        sections.insert(-1, _section("Remarks", "", [("Remarks", told.remarks)]))
    return sections


def _person(one: Person) -> Row:
    name = f"{one.name}, {one.role}" if one.role else one.name
    return ("Authorised by" if one.signs else "Took part", name)


def _conditions(evaluation: dict[str, Any], said: Laboratory) -> list[Row]:
    rows: list[Row] = []
    for label, pair, unit in (
        ("Air temperature", said.conditions.temperature_C, "°C"),
        ("Relative humidity", said.conditions.humidity_percent, "%"),
    ):
        rows.append((label, None if pair is None else f"{number(pair[0], 1)} to {number(pair[1], 1)} {unit}"))
    for result in evaluation["placements"]:
        warm = result["gauge_temperature_C"]
        label = f"Gauge, placement {result['placement']}"
        rows.append((label, None if warm is None else f"{number(warm, 2)} °C (mean)"))
    return rows
