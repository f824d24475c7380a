"""Data of a calibration that only the laboratory has: the file ``certificate.toml``.

Its tables follow ISO/IEC 17025:2017, 7.8.2.1 and 7.8.4.1. What identifies the certificate, the laboratory, the
customer, the item and who signs must be stated to print it (:func:`check_filled`); of the rest it says "not stated".
A Digital Calibration Certificate demands its own keys and names those.
"""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from stepgauge.errors import InputError
from stepgauge.files.config import TomlTable, check_table, read_toml
from stepgauge.files.dates import check_past, moments, parse_moment
from stepgauge.files.text import read_text
from stepgauge.machine.file import Machine
from stepgauge.recording.simulated import is_simulated


def _printable(text: str) -> str:
    """Control characters belong into no certificate, and XML has no place for them."""
    wrong = [mark for mark in text if mark != "\n" and not mark.isprintable()]
    if wrong:
        raise ValueError(f"text without control characters, not {wrong[0]!r}")
    return text


def _filled(text: str) -> str:
    """The dots of the form are the place for what holds, and nothing that a laboratory says."""
    if not text.strip(".… "):
        raise ValueError("what holds instead of the dots of the form, or no such line")
    return text


Text = Annotated[
    str,
    StringConstraints(strip_whitespace=True, min_length=1),
    AfterValidator(_printable),
    AfterValidator(_filled),
]
Country = Annotated[str, StringConstraints(pattern="^[A-Z]{2}$")]
LEAST_HUMIDITY_PERCENT = 1.0
"""Air is never so dry: such a number is a share of one."""
ROOM_K = 10.0
"""A gauge that was measured is no farther from the air of its room: more is a slip in one of the two."""
LONGEST_STAY = datetime.timedelta(days=3 * 365)
"""From the receipt of an item to the end of its calibration; more is a slip in a year."""
Place = Literal["laboratory", "customer", "laboratoryBranch", "customerBranch", "other"]
DAYS = ("received", "performed_from", "performed_to", "issued")
"""Dates of a certificate, in their order."""
Interval = Annotated[tuple[float, float], Field(strict=False)]


class CertificateHead(TomlTable):
    """The ``[certificate]`` table: identity and dates."""

    number: Text | None = Field(None, description="unique number of the certificate")
    issued: datetime.date | None = Field(None, description="date of issue, e.g. 2026-05-04")
    received: datetime.date | None = Field(None, description="date of receipt of the item")
    performed_from: datetime.date | None = Field(None, description="first day of the calibration")
    performed_to: datetime.date | None = Field(None, description="last day of the calibration")
    place: Place | None = Field(None, description="laboratory, customer, laboratoryBranch, customerBranch or other")
    place_text: Text | None = Field(None, description="where the machine stands, in words")
    replaces: Text | None = Field(None, description="number of the certificate that this one replaces")
    mark: Text | None = Field(None, description="what stands in the place of the accreditation mark, e.g. its number")
    example: bool = Field(False, description="true: an example, no calibration; needed where readings were simulated")

    @model_validator(mode="after")
    def _check_order_of_days(self) -> CertificateHead:
        if self.number and self.number == self.replaces:
            raise ValueError("a number of its own, other than that of the certificate that it replaces")
        known = [(name, day) for name in DAYS if (day := getattr(self, name)) is not None]
        for (before, early), (after, late) in pairwise(known):
            if late < early:
                raise ValueError(f"certificate.{before} ({early}) not after certificate.{after} ({late})")
            if late - early > LONGEST_STAY:
                raise ValueError(
                    f"certificate.{before} ({early}) at most three years before certificate.{after} ({late})"
                )
        return self


class ContactDetails(TomlTable):
    """The ``[laboratory]`` and ``[customer]`` tables."""

    name: Text | None = Field(None, description="name of the company")
    street: Text | None = Field(None, description="street")
    street_number: Text | None = Field(None, description="house number")
    post_code: Text | None = Field(None, description="postal code")
    city: Text | None = Field(None, description="town")
    country: Country | None = Field(None, description="two capital letters by ISO 3166, e.g. DE")
    email: Text | None = Field(None, description="e-mail address")
    phone: Text | None = Field(None, description="telephone number")
    accreditation: Text | None = Field(None, description="code of the accreditation, of a laboratory")

    @property
    def address(self) -> str | None:
        """Street, town and country in one line; None where nothing is stated."""
        street = " ".join(part for part in (self.street, self.street_number) if part)
        town = " ".join(part for part in (self.post_code, self.city) if part)
        return ", ".join(part for part in (street, town, self.country) if part) or None


class CalibratedItem(TomlTable):
    """The ``[item]`` table: what was calibrated."""

    name: Text | None = Field(None, description="what it is, e.g. Coordinate measuring machine")
    manufacturer: Text | None = Field(None, description="who made it")
    model: Text | None = Field(None, description="model")
    serial: Text | None = Field(None, description="serial number of the manufacturer")
    owner_number: Text | None = Field(None, description="inventory number of the owner")
    condition: Text | None = Field(None, description="condition when it was calibrated")
    software: Text | None = Field(None, description="software or firmware with its release")


class ResponsiblePerson(TomlTable):
    """A ``[[person]]`` table: who is responsible for the certificate."""

    name: Text = Field(description="name of the person")
    role: Text | None = Field(None, description="role, e.g. head of the laboratory")
    signs: bool = Field(False, description="whether this person authorises the certificate")


class Method(TomlTable):
    """The ``[method]`` table."""

    name: Text | None = Field(None, description="procedure of the laboratory")
    standards: list[Text] = Field(default_factory=list, description="standards that it follows")
    deviations: Text | None = Field(None, description="additions to, deviations and exclusions from the method")


class Ambient(TomlTable):
    """The ``[conditions]`` table: lowest and highest value during the calibration."""

    temperature_C: Interval | None = Field(None, description="[lowest, highest] air temperature, deg C")
    humidity_percent: Interval | None = Field(None, description="[lowest, highest] relative humidity, %")

    @model_validator(mode="after")
    def _rising(self) -> Ambient:
        for name, bounds in (("temperature_C", (-10, 60)), ("humidity_percent", (0, 100))):
            pair = getattr(self, name)
            if pair is not None and not bounds[0] <= pair[0] <= pair[1] <= bounds[1]:
                raise ValueError(f"{name} as [lowest, highest] between {bounds[0]} and {bounds[1]}")
        if self.humidity_percent is not None and self.humidity_percent[1] <= LEAST_HUMIDITY_PERCENT:
            raise ValueError("humidity_percent in percent, e.g. [40, 50], not as a share of one")
        return self


class Statements(TomlTable):
    """The ``[statements]`` table."""

    traceability: Text | None = Field(None, description="how the results are traceable, beside the gauge's certificate")
    adjustment: Text | None = Field(None, description="adjustment or repair, and results before it")
    mpe: Text | None = Field(None, description='maximum permissible error, "A + L/K": conformity is computed from it')
    external: Text | None = Field(None, description="results that others provided")
    remarks: Text | None = Field(None, description="anything else")

    @model_validator(mode="before")
    @classmethod
    def _no_words_of_conformity(cls, data: Any) -> Any:
        if isinstance(data, dict) and {"conformity", "decision_rule"} & data.keys():
            raise ValueError("mpe, from which conformity is computed by ISO 14253-1, and no words of one's own")
        return data


@dataclass(frozen=True)
class Laboratory:
    """The content of ``certificate.toml``."""

    certificate: CertificateHead
    laboratory: ContactDetails
    customer: ContactDetails
    item: CalibratedItem
    persons: tuple[ResponsiblePerson, ...]
    method: Method
    conditions: Ambient
    statements: Statements
    path: str = ""

    @property
    def words(self) -> list[str]:
        """All that the laboratory wrote, but for the limit, which is numbers."""
        tables = [getattr(self, name) for name in TABLES]
        said = [pair for one in (*tables, *self.persons) for pair in one.model_dump().items()]
        return [text for name, text in said if isinstance(text, str) and name != "mpe"]


TABLES: dict[str, type[TomlTable]] = {
    "certificate": CertificateHead,
    "laboratory": ContactDetails,
    "customer": ContactDetails,
    "item": CalibratedItem,
    "method": Method,
    "conditions": Ambient,
    "statements": Statements,
}


def tables() -> dict[str, type[TomlTable]]:
    """The tables of the form by their names, without that of persons."""
    return dict(TABLES)


def read_laboratory(path: str | Path) -> Laboratory:
    """Read and check a ``certificate.toml``; :class:`InputError` names the key that is wrong."""
    data = read_toml(path)
    for key in data:
        if key not in TABLES and key != "person":
            expected = ", ".join(f"[{name}]" for name in TABLES) + " and [[person]]"
            raise InputError(path, f"table [{key}] is not known", expected=expected)
    _check_cut(path)
    persons = data.get("person", [])
    if not isinstance(persons, list):
        raise InputError(path, "persons are an array of tables", found="[person]", expected="[[person]]")
    tables = {name: check_table(model, data.get(name, {}), path, name) for name, model in TABLES.items()}
    _check_past(tables["certificate"], path)
    people = tuple(check_table(ResponsiblePerson, one, path, f"person[{i}]") for i, one in enumerate(persons, 1))
    return Laboratory(**tables, persons=people, path=str(path))  # type: ignore[arg-type]


def _check_cut(path: str | Path) -> None:
    """:class:`InputError` for a file that ends with the head of a table: what stood in it is lost."""
    last = read_text(path).rstrip().rpartition("\n")[2].strip()
    if last.startswith("[") and last.endswith("]"):
        what = "the file ends with the head of a table: it was cut"
        raise InputError(path, what, found=last, expected="the whole form; an empty table at its end is left out")


def _check_past(head: TomlTable, path: str | Path) -> None:
    """:class:`InputError` for a date of the certificate that has not come yet."""
    for name in DAYS:
        day = getattr(head, name)
        if day is not None:
            check_past(day, path, f"key certificate.{name}")


def check_days(said: Laboratory, evaluation: dict[str, Any]) -> None:
    """:class:`InputError` where a machine was calibrated before its gauge, or not when it was measured.

    ``evaluation``: the content of its JSON file. Without a calibration of the gauge before it, nothing is traceable
    (ISO/IEC 17025:2017, 6.5).
    """
    head, gauge = said.certificate, evaluation["gauge"]
    if head.performed_from is not None and head.performed_from.isoformat() < gauge["date"]:
        what = "key certificate.performed_from is before the calibration of the gauge: its results are not traceable"
        expected = f"{gauge['date']} (certificate {gauge['certificate']}) or later"
        raise InputError(said.path, what, found=head.performed_from, expected=expected)
    for text in moments(evaluation["comments"].get("measured_at") or evaluation.get("measured_at") or ""):
        day = parse_moment(text, said.path).date() if text else None
        first, last = head.performed_from or day, head.performed_to or day
        if day is not None and first is not None and last is not None and not first <= day <= last:
            what = "the evaluation was not measured on the days of [certificate] performed_from and performed_to"
            raise InputError(said.path, what, found=f"{first} to {last}", expected=f"measured_at {text}")


def check_room(said: Laboratory, evaluation: dict[str, Any]) -> None:
    """:class:`InputError` where the air of the room and the gauge in it contradict each other."""
    air = said.conditions.temperature_C
    for placed in evaluation["placements"]:
        gauge_C = placed["gauge_temperature_C"]
        if air is not None and gauge_C is not None and not air[0] - ROOM_K <= gauge_C <= air[1] + ROOM_K:
            what = "key conditions.temperature_C contradicts the recorded temperature of the gauge"
            expected = f"air near the {gauge_C:.2f} deg C of the gauge, to {ROOM_K:g} K"
            raise InputError(said.path, what, found=f"{air[0]:g} to {air[1]:g} deg C", expected=expected)


def check_item(said: Laboratory, evaluation: dict[str, Any], machine: Machine | None) -> None:
    """:class:`InputError` where the form and the machine file, or the recording, are of different machines.

    A name says the same machine if ``[item]`` has one of its words, and all of them that hold a digit (``CMM 3``); a
    serial number if it is that of the manufacturer or of the owner. A form that names its item by nothing but a maker
    is filled by the name of the machine.
    """
    item, comments = said.item, evaluation["comments"]
    stated = {key: getattr(item, key) for key in ("name", "manufacturer", "model", "serial", "owner_number")}
    stated = {key: text for key, text in stated.items() if text}
    names = {"the recording": comments.get("machine"), "the machine file": machine.table.name if machine else None}
    found = ", ".join(f"{key} {text!r}" for key, text in stated.items())
    for where, name in names.items():
        if name and (item.name or item.model) and not _names(" ".join(stated.values()), name):
            what = "table [item] names another machine than the one that was measured"
            expected = f"the words of {name!r} ({where}), e.g. as item.name"
            raise InputError(said.path, what, found=found, expected=expected)
    serial = machine.table.serial if machine else None
    numbers = [text.casefold() for text in (item.serial, item.owner_number) if text]
    if serial and numbers and serial.casefold() not in numbers:
        what = "table [item] has another serial number than the machine file"
        raise InputError(said.path, what, found=found, expected=f"serial {serial!r} ({machine and machine.path})")


def _names(text: str, name: str) -> bool:
    """Whether a text speaks of the machine of a name."""
    there, words = (set(re.findall(r"\w+", one.casefold())) for one in (text, name))
    marked = {word for word in words if any(map(str.isdigit, word))}
    return marked <= there and bool(words & there or not words)


def check_simulated(said: Laboratory, evaluation: dict[str, Any]) -> None:
    """:class:`InputError` for a certificate on readings of the virtual CMM that is not an example by its name."""
    if is_simulated(evaluation["comments"]) and not is_example(said, evaluation):
        what = "the recording was simulated: no machine was measured, and nothing was calibrated"
        raise InputError(said.path, what, expected="a measured recording; or example = true in [certificate]")


def is_example(said: Laboratory | None, evaluation: dict[str, Any]) -> bool:
    """Whether a certificate says of itself, or by that of its gauge, that it is an example."""
    return bool(evaluation["gauge"]["example"]) or (said is not None and said.certificate.example)


def check_filled(said: Laboratory) -> None:
    """:class:`InputError` that names the keys without which nothing may be signed (ISO/IEC 17025:2017, 7.8.2.1)."""
    head, item = said.certificate, said.item
    asked: dict[str, dict[str, object]] = {
        "[certificate]": {
            "number": head.number,
            "issued": head.issued,
            "performed_from": head.performed_from,
            "performed_to": head.performed_to,
        },
        "[laboratory]": {"name": said.laboratory.name, "street, city or country": said.laboratory.address},
        "[customer]": {"name": said.customer.name},
        "[item]": {"manufacturer": item.manufacturer, "serial or owner_number": item.serial or item.owner_number},
        "[method]": {"name": said.method.name},
        "[[person]]": {"signs = true": any(one.signs for one in said.persons)},
    }
    missing = {table: [key for key, value in keys.items() if not value] for table, keys in asked.items()}
    if any(missing.values()):
        expected = "; ".join(f"{table} {', '.join(keys)}" for table, keys in missing.items() if keys)
        raise InputError(said.path, "the form is not filled in", expected=expected)
