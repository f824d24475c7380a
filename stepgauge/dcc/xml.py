"""XML of certificates read safely, and places in it named so that a person finds them.

A certificate comes from somebody else: entities, DTDs, the network and huge trees are never followed. A DOCTYPE is
refused as a whole, for a certificate needs none.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepgauge.errors import InputError
from stepgauge.files.text import read_bytes

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
NAMESPACES = {"dcc": DCC, "si": SI}
LARGEST_BYTES = 50_000_000
"""Certificates with pictures and a PDF inside have some megabytes."""
MOST_MARKS = 600_000
"""Tags; a tree takes about 100 bytes of memory for each, whatever the size of the file."""
Element = Any


def read_xml(path: str | Path) -> Element:
    """The root of an XML file.

    :class:`InputError` for files that are missing, too large, not well-formed (with the line), or have a DOCTYPE.
    """
    return parse_xml(_bytes(path), path)


def _bytes(path: str | Path) -> bytes:
    data = read_bytes(path, LARGEST_BYTES)
    marks = data.count(b"<")
    if marks > MOST_MARKS:
        found, expected = f"{marks} tags", f"at most {MOST_MARKS}"
        raise InputError(path, "too large for a certificate", found=found, expected=expected)
    return data


def parse_xml(data: bytes, path: str | Path) -> Element:
    """The root of XML text; ``path`` is for messages. Errors as :func:`read_xml`."""
    from lxml import etree

    if any("<!DOCTYPE".encode(code) in data for code in ("ascii", "utf-16-le", "utf-16-be")):
        raise InputError(path, "has a DOCTYPE: DTDs and entities are not read", expected="XML without a DOCTYPE")
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        dtd_validation=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        raise InputError(f"{path}:{error.lineno or 1}", f"not well-formed XML: {error.msg}") from None
    if root.getroottree().docinfo.doctype:
        raise InputError(path, "has a DOCTYPE: DTDs and entities are not read", expected="XML without a DOCTYPE")
    return root


def validate(root: Element, schema: str | Path, path: str | Path) -> None:
    """:class:`InputError` with line and reason where a tree does not fit an XSD (a file; its imports beside it)."""
    from lxml import etree

    parser = etree.XMLParser(no_network=True, resolve_entities=False, load_dtd=False)
    try:
        rules = etree.XMLSchema(etree.parse(str(schema), parser))
    except OSError:
        raise InputError(schema, "cannot be read as a schema", expected="dcc.xsd with its imports beside it") from None
    except (etree.XMLSchemaParseError, etree.XMLSyntaxError) as error:
        raise InputError(schema, f"not a schema: {error}") from None
    if not rules.validate(root):
        first = rules.error_log[0]
        raise InputError(f"{path}:{first.line}", f"does not fit the schema: {short(first.message)}")


def short(text: str) -> str:
    """A message without the namespaces that make it unreadable."""
    for prefix, space in NAMESPACES.items():
        text = text.replace(f"{{{space}}}", f"{prefix}:")
    return text


def place(element: Element, path: str | Path) -> str:
    """``file:line (XPath)`` of an element."""
    where = short(element.getroottree().getelementpath(element))
    return f"{path}:{element.sourceline} (/{_name(element.getroottree().getroot())}/{where})"


def _name(root: Element) -> str:
    return short(root.tag)


def find(element: Element, route: str) -> Element | None:
    """The first element on a route like ``dcc:coreData/dcc:uniqueIdentifier``; None without."""
    return element.find(route, NAMESPACES)


def find_all(element: Element, route: str) -> list[Element]:
    """All elements on a route."""
    return list(element.iterfind(route, NAMESPACES))


def text_of(element: Element | None, route: str = ".") -> str | None:
    """Text on a route, of its first ``content`` where it has languages (English first); None without or empty."""
    found = element if element is None or route == "." else find(element, route)
    if found is None:
        return None
    contents = find_all(found, "dcc:content")
    english = [one for one in contents if one.get("lang") == "en"]
    words = ((english or contents)[0].text if contents else found.text) or ""
    return " ".join(words.split()) or None
