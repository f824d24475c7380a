"""Files that attack the reader: each ends in one clear error, quickly, and nothing is fetched or expanded."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.dcc.read import parse_document, read_document
from stepgauge.dcc.xml import parse_xml, read_xml
from stepgauge.errors import InputError
from tests.dcc.made import machine_xml

LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
BILLION = f'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY l0 "lol">{LAUGHS}]><a>&l9;</a>'


def external(secret: Path) -> str:
    return f'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY x SYSTEM "{secret.as_uri()}">]><a>&x;</a>'


@pytest.mark.parametrize(
    "text",
    [
        BILLION,
        '<!DOCTYPE a SYSTEM "http://127.0.0.1:9/evil.dtd"><a/>',
        '<!DOCTYPE a [<!ENTITY % p SYSTEM "http://127.0.0.1:9/x"> %p;]><a/>',
        "<!DOCTYPE html><html/>",
    ],
    ids=["billion laughs", "external DTD", "parameter entity", "plain DOCTYPE"],
)
@pytest.mark.parametrize("code", ["utf-8", "utf-16"])
def test_a_doctype_is_refused(tmp_path: Path, text: str, code: str) -> None:
    path = tmp_path / "evil.xml"
    path.write_bytes(text.replace('<?xml version="1.0"?>', "").encode(code))
    began = time.process_time()
    with pytest.raises(InputError, match="has a DOCTYPE: DTDs and entities are not read"):
        read_document(path)
    assert time.process_time() - began < 1.0


def test_no_file_is_read_through_an_entity(tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("the secret")
    (tmp_path / "evil.xml").write_text(external(secret))
    with pytest.raises(InputError) as caught:
        read_document(tmp_path / "evil.xml")
    assert "the secret" not in str(caught.value)


def test_an_include_is_not_followed(tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("the secret")
    text = machine_xml().replace(
        "<dcc:uniqueIdentifier>EXAMPLE-2026-017",
        '<dcc:uniqueIdentifier><xi:include xmlns:xi="http://www.w3.org/2001/XInclude" parse="text"'
        ' href="secret.txt"/>X',
    )
    assert "xi:include" in text
    (tmp_path / "include.xml").write_text(text)
    assert "secret" not in str(read_document(tmp_path / "include.xml"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a><b></a>", "a.xml:1: not well-formed XML"),
        ("", "a.xml:1: not well-formed XML"),
        ("<a/>", "another kind of XML; found a; expected a Digital Calibration Certificate"),
        ("<a>" * 300 + "</a>" * 300, "a.xml:1: not well-formed XML: Excessive depth"),
        (
            '<digitalCalibrationCertificate xmlns="https://ptb.de/dcc" schemaVersion="2.4.0"/>',
            "schemaVersion is not known; found '2.4.0'; expected 3.x",
        ),
    ],
)
def test_other_files_are_named(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_document(parse_xml(text.encode(), "a.xml"), "a.xml")


def test_missing_and_large_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_xml(tmp_path / "none.xml")
    monkeypatch.setattr("stepgauge.dcc.xml.LARGEST_BYTES", 100)
    (tmp_path / "large.xml").write_text(machine_xml())
    with pytest.raises(InputError, match="the file is too large"):
        read_xml(tmp_path / "large.xml")


@given(cut=st.integers(0, 10**6))
def test_a_truncated_certificate_is_an_error(cut: int) -> None:
    text = machine_xml().strip().encode()
    with pytest.raises(InputError, match="not well-formed XML"):
        parse_xml(text[: cut % len(text)], "cut.xml")
