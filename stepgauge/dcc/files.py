"""Certificates as files: checked as a reader would before they are written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepgauge.dcc.elements import to_bytes
from stepgauge.dcc.read import parse_document
from stepgauge.dcc.write import machine_certificate
from stepgauge.dcc.xml import Element, parse_xml, validate
from stepgauge.errors import InputError
from stepgauge.files.text import read_bytes, replacing
from stepgauge.reports.content import Sources


def certificate_of(evaluation: dict[str, Any], sources: Sources) -> Element:
    """The certificate of a machine from an evaluation and what :func:`stepgauge.reports.sources.read_sources` gave.

    ValueError without gauge, budget or laboratory; :class:`InputError` names what else a DCC demands.
    """
    if sources.gauge is None or sources.budget is None or sources.laboratory is None:
        raise ValueError("a certificate needs a gauge, a budget and what the laboratory states")
    return machine_certificate(
        evaluation, sources.budget, sources.laboratory, sources.gauge, sources.machine, sources.mpe
    )


def write_certificate(path: str | Path, root: Element, schema: str | Path | None = None) -> None:
    """Write a certificate after it was read back and, with ``schema`` (dcc.xsd), validated; :class:`InputError`."""
    data = to_bytes(root)
    again = parse_xml(data, path)
    parse_document(again, path)
    if schema is not None:
        validate(again, schema, path)
    with replacing(path) as beside:
        beside.write_bytes(data)


def check_certificate_name(path: str | Path) -> None:
    """Before any work: a certificate is an .xml file."""
    if Path(path).suffix.lower() != ".xml":
        raise InputError(path, "not a certificate's name", expected="NAME.xml")


def read_pdf(path: str | Path) -> bytes:
    """The printed certificate, to be put into the digital one."""
    data = read_bytes(path)
    if not data.startswith(b"%PDF-"):
        raise InputError(path, "not a PDF file", expected="the printed certificate")
    return data
