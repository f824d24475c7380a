"""The pieces of a DCC as XML elements: texts, contacts, quantities, and the administrative data of a laboratory.

Numbers are printed once, here: errors and uncertainties to 0.0001 um, lengths to 0.0000001 mm.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from lxml import etree
from lxml.builder import ElementMaker

from stepgauge import __version__
from stepgauge.dcc.xml import DCC, NAMESPACES, SI
from stepgauge.errors import InputError
from stepgauge.reports.certificate_file import ContactDetails, Laboratory

Element = Any
LANGUAGE = "en"
D = ElementMaker(namespace=DCC, nsmap=NAMESPACES)
S = ElementMaker(namespace=SI, nsmap=NAMESPACES)
SCHEMA_VERSION = "3.2.0"


@dataclass(frozen=True)
class QuantityValues:
    """Values of one unit, printed with so many decimals; ``expanded``, ``k``: one per value or None.

    ``finer``: decimals more of the uncertainties.
    """

    values: Sequence[float]
    unit: str
    decimals: int
    expanded: Sequence[float] | None = None
    k: Sequence[float] | None = None
    percent: float = 95.45
    finer: int = 0


def words(tag: str, text: str, **attributes: str) -> Element:
    """An element with a text in the language of the certificate."""
    return getattr(D, tag)(D.content(one_line(text), lang=LANGUAGE), **attributes)


def one_line(text: str) -> str:
    """Text that XML can hold: control characters and line breaks are spaces."""
    return " ".join("".join(mark if mark.isprintable() else " " for mark in text).split())


def plain_name(text: str) -> Element:
    """A name that is the same in every language."""
    return D.name(D.content(one_line(text)))


def quantity(name: str, kind: str, numbers: QuantityValues, tag: str = "quantity") -> Element:
    """A quantity: ``si:real`` of a single value, ``si:realListXMLList`` of several."""
    single = len(numbers.values) == 1
    return getattr(D, tag)(words("name", name), _real(numbers) if single else _list(numbers), refType=kind)


def _real(numbers: QuantityValues) -> Element:
    real = S.real(S.value(_number(numbers.values[0], numbers.decimals)), S.unit(numbers.unit))
    if numbers.expanded is not None and numbers.k is not None:
        real.append(
            S.expandedUnc(
                S.uncertainty(_number(numbers.expanded[0], numbers.decimals + numbers.finer)),
                S.coverageFactor(_number(numbers.k[0], 3)),
                S.coverageProbability(_number(numbers.percent / 100.0, 4)),
            )
        )
    return real


def _list(numbers: QuantityValues) -> Element:
    found = S.realListXMLList(S.valueXMLList(_row(numbers.values, numbers.decimals)), S.unitXMLList(numbers.unit))
    if numbers.expanded is not None and numbers.k is not None:
        found.append(
            S.expandedUncXMLList(
                S.uncertaintyXMLList(_row(numbers.expanded, numbers.decimals + numbers.finer)),
                S.coverageFactorXMLList(_row(numbers.k, 3)),
                S.coverageProbabilityXMLList(_number(numbers.percent / 100.0, 4)),
            )
        )
    return found


def _row(values: Iterable[float], decimals: int) -> str:
    return " ".join(_number(value, decimals) for value in values)


def _number(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def condition(
    name: str, kind: str, numbers: Sequence[tuple[str, str, QuantityValues]], said: str | None = None
) -> Element:
    """An influence condition with its quantities (name, refType, numbers), or with words where nothing was measured."""
    data = D.data(*(quantity(*one) for one in numbers))
    if said is not None:
        data.append(words("text", said))
    return D.influenceCondition(words("name", name), data, refType=kind)


def identifications(known: Sequence[tuple[str, str, str | None]]) -> Element:
    """Issuer, name and value of every number that is known."""
    given = [(issuer, name, one_line(value)) for issuer, name, value in known if value]
    return D.identifications(
        *(D.identification(D.issuer(issuer), D.value(value), words("name", name)) for issuer, name, value in given)
    )


def software() -> Element:
    """This program; releases are a letter and up to four numbers."""
    release = re.match(r"\d{1,3}(\.\d{1,3}){0,3}", __version__)
    return D.software(plain_name("stepgauge"), D.release(f"v {release[0] if release else 0}"), D.type("application"))


def statement(text: str, kind: str | None = None, reference: str | None = None) -> Element:
    """A declaration, with the clause of ISO/IEC 17025:2017 that asks for it."""
    found = D.statement(**({"refType": kind} if kind else {}))
    if reference:
        found.extend([D.norm("ISO/IEC 17025:2017"), D.reference(reference)])
    found.append(words("declaration", text))
    return found


def administrative(said: Laboratory, item: Element, statements: Sequence[Element]) -> Element:
    """The administrative data of a certificate."""
    check_demanded(said)
    laboratory = D.calibrationLaboratory()
    if said.laboratory.accreditation:
        laboratory.append(D.calibrationLaboratoryCode(said.laboratory.accreditation))
    laboratory.append(_contact("contact", said.laboratory))
    return D.administrativeData(
        D.dccSoftware(software()),
        _core(said),
        D.items(item),
        laboratory,
        _persons(said),
        _contact("customer", said.customer),
        D.statements(*statements),
    )


def _core(said: Laboratory) -> Element:
    """Number, languages, dates and place, in the order of the schema."""
    head = said.certificate
    core = D.coreData(
        D.countryCodeISO3166_1(said.laboratory.country),
        D.usedLangCodeISO639_1(LANGUAGE),
        D.mandatoryLangCodeISO639_1(LANGUAGE),
        D.uniqueIdentifier(head.number),
    )
    if head.received:
        core.append(D.receiptDate(head.received.isoformat()))
    assert head.performed_from is not None
    assert head.performed_to is not None
    core.append(D.beginPerformanceDate(head.performed_from.isoformat()))
    core.append(D.endPerformanceDate(head.performed_to.isoformat()))
    core.append(D.performanceLocation(head.place))
    if head.issued:
        core.append(D.issueDate(head.issued.isoformat()))
    return core


def check_demanded(said: Laboratory) -> None:
    """:class:`InputError` with all keys that a DCC demands and the file lacks."""
    head, item = said.certificate, said.item
    demanded = (
        ("certificate.number", head.number),
        ("certificate.performed_from", head.performed_from),
        ("certificate.performed_to", head.performed_to),
        ("certificate.place", head.place),
        ("laboratory.name", said.laboratory.name),
        ("laboratory.country", said.laboratory.country),
        ("customer.name", said.customer.name),
        ("customer.city or customer.country", said.customer.city or said.customer.country),
        ("item.manufacturer", item.manufacturer),
        ("item.serial or item.owner_number", item.serial or item.owner_number),
        ("[[person]] with name", said.persons),
    )
    missing = [key for key, value in demanded if not value]
    if missing:
        raise InputError(said.path, "a Digital Calibration Certificate demands more", expected=", ".join(missing))


def _contact(tag: str, contact: ContactDetails) -> Element:
    assert contact.name is not None
    found = getattr(D, tag)(plain_name(contact.name))
    if contact.email:
        found.append(D.eMail(contact.email))
    if contact.phone:
        found.append(D.phone(contact.phone))
    address = (
        ("city", contact.city),
        ("countryCode", contact.country),
        ("postCode", contact.post_code),
        ("street", contact.street),
        ("streetNo", contact.street_number),
    )
    found.append(D.location(*(getattr(D, name)(value) for name, value in address if value)))
    return found


def _persons(said: Laboratory) -> Element:
    persons = D.respPersons()
    for one in said.persons:
        person = D.respPerson(D.person(plain_name(one.name)))
        if one.role:
            person.append(D.role(one.role))
        person.append(D.mainSigner("true" if one.signs else "false"))
        persons.append(person)
    return persons


def machine_item(said: Laboratory, name: str) -> Element:
    """The item that was calibrated, with what the laboratory says of it; ``name`` stands where it does not."""
    check_demanded(said)
    item = D.item(words("name", said.item.name or name))
    known = (("Condition", said.item.condition), ("Software", said.item.software))
    described = ". ".join(f"{label}: {text}" for label, text in known if text)
    if described:
        item.append(words("description", described))
    assert said.item.manufacturer is not None
    item.append(D.manufacturer(plain_name(said.item.manufacturer)))
    if said.item.model:
        item.append(D.model(said.item.model))
    numbers = (
        ("manufacturer", "Serial number", said.item.serial),
        ("owner", "Inventory number", said.item.owner_number),
    )
    item.append(identifications(numbers))
    return item


def certificate(administrative_data: Element, results: Sequence[Element]) -> Element:
    """The root of a certificate."""
    root = D.digitalCalibrationCertificate(schemaVersion=SCHEMA_VERSION)
    root.append(administrative_data)
    root.append(D.measurementResults(*results))
    return root


def attach(root: Element, name: str, kind: str, data: bytes) -> None:
    """Put a file, e.g. the printed certificate, into a certificate."""
    import base64

    content = base64.b64encode(data).decode("ascii")
    root.append(D.document(D.fileName(name), D.mimeType(kind), D.dataBase64(content)))


def to_bytes(root: Element) -> bytes:
    """The file: UTF-8, indented."""
    etree.cleanup_namespaces(root, keep_ns_prefixes=list(NAMESPACES))
    etree.indent(root, space="  ")
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))
