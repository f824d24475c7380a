"""The machine's DCC validates, comes back with the numbers that went in, and does not validate when it lies."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.cli import main
from stepgauge.dcc.documents import read_errors
from stepgauge.dcc.elements import QuantityValues, quantity, to_bytes
from stepgauge.dcc.read import Document, parse_document
from stepgauge.dcc.units import LENGTH, MICROMETRE
from stepgauge.dcc.write import machine_certificate, uncertain
from stepgauge.dcc.xml import parse_xml, validate
from stepgauge.errors import InputError
from stepgauge.files.text import write_json
from stepgauge.recording import write_recording
from tests.dcc.made import SAID, SCHEMA, evaluated, laboratory, machine_xml, measured, needs_schema
from tests.measured import shipped


def read(text: str) -> Document:
    return parse_document(parse_xml(text.encode(), "c.xml"), "c.xml")


def schematron(text: str) -> list[str]:
    """Errors of the rules that dcclib ships; a report of an error counts as much as a failed assertion."""
    from dcclib.validation import SchematronValidator

    result = SchematronValidator.for_dcc().validate_str(text)
    return [one.text for one in result.failed_assertions + result.successful_reports if one.role == "error"]


@needs_schema
@pytest.mark.parametrize("placements", [1, 2])
def test_it_validates_against_schema_and_schematron(placements: int) -> None:
    from dcclib.validation import XsdValidator

    text = machine_xml(placements)
    validate(parse_xml(text.encode(), "c.xml"), SCHEMA, "c.xml")
    assert XsdValidator.from_file(str(SCHEMA)).validate_str(text).is_valid
    assert schematron(text) == []


@pytest.mark.parametrize("placements", [1, 2])
def test_round_trip_to_the_printed_digits(placements: int) -> None:
    _, budget = evaluated(placements)
    radii, lists = read_errors(read(machine_xml(placements)))
    assert len(radii) == placements
    assert radii[0].r_eff_mm == pytest.approx(budget.find("r_eff", 1, None).value_um * 1e-3, abs=1e-7)  # type: ignore[union-attr]
    assert len(lists) == 4 * placements
    for number, name in [(p, n) for n in ("xf", "xb", "xm", "xr") for p in range(1, placements + 1)]:
        found = lists[("xf", "xb", "xm", "xr").index(name) * placements + number - 1]
        wanted = [q for q in budget.quantities if (q.quantity, q.placement) == (name, number) and uncertain(q)]
        assert found.name == name
        assert found.face.tolist() == [q.face for q in wanted]
        np.testing.assert_allclose(found.value_um, [q.value_um for q in wanted], atol=0.5e-4)
        np.testing.assert_allclose(found.expanded_um, [q.expanded_um for q in wanted], atol=0.5e-4)
        np.testing.assert_allclose(found.k, [q.k for q in wanted], atol=0.5e-3)
        np.testing.assert_allclose(found.position_mm, [q.position_mm or 0.0 for q in wanted], atol=0.5e-5)


def test_reference_and_radius_block_are_left_out_as_zero_by_construction() -> None:
    _, lists = read_errors(read(machine_xml()))
    faces = {one.name: one.face.tolist() for one in lists}
    assert 1 not in faces["xf"]
    assert 2 not in faces["xb"]
    assert 3 in faces["xf"]


def test_it_says_who_what_and_when() -> None:
    document = read(machine_xml())
    assert document.number == "EXAMPLE-2026-017"
    assert document.laboratory == "Example Calibration Laboratory"
    assert document.customer == "Sample Works Ltd"
    assert (document.item, document.serial) == ("Coordinate measuring machine", "B700-0042")
    assert str(document.performed_to) == "2026-05-05"
    text = " ".join(machine_xml().split())
    for words in (
        "The results relate only to the item calibrated",
        "traceable through Step gauge 420, serial number SG-420-001, certificate EXAMPLE-2026-0420",
        "Simulated recording: no machine was measured",
        "is an example: this is not a real calibration",
        "Contributions not evaluated: temperature of the scales",
        "The machine was not adjusted",
    ):
        assert words in text


def test_temperatures_are_those_of_the_recording() -> None:
    """Of the scales, too, where it has them: what the machine file states is then another statement."""
    for kind in ("gauge", "scale"):
        within = machine_xml().split(f'influenceCondition refType="stepgauge_{kind}Temperature"')[1]
        assert "Mean of the recording" in within.split("</dcc:influenceCondition>")[0]


XM_UNIT = r"(stepgauge_meanError.*?<si:unitXMLList>)\\micro\\metre"


@pytest.mark.parametrize(
    ("pattern", "new", "message"),
    [
        (
            XM_UNIT,
            r"\1um",
            r"c.xml:\d+ \(/dcc:digital.*unitXMLList\): Mean error XM has a wrong unit: 'um' is not written",
        ),
        (XM_UNIT, r"\1\\micron", "Mean error XM has a wrong unit: .*not known"),
        (
            XM_UNIT,
            r"\1\\kelvin",
            r"Mean error XM has a wrong unit; found unit \\kelvin \(a temperature\); expected a length",
        ),
        (XM_UNIT, r"\1\\micro\\metre \\milli\\metre", "Mean error XM has several units"),
        (XM_UNIT, r"\1", "Mean error XM has no unit"),
        (
            r"(stepgauge_meanError.*?)<si:expandedUncXMLList>.*?</si:expandedUncXMLList>",
            r"\1",
            r"c.xml:\d+ \(.*realListXMLList\): Mean error XM is a result without an uncertainty",
        ),
        (
            r"(stepgauge_effectiveRadius.*?)<si:expandedUnc>.*?</si:expandedUnc>",
            r"\1",
            "Effective radius R_eff is a result without an uncertainty",
        ),
        (
            r"(stepgauge_meanError.*?<si:coverageFactorXMLList>)[^<]*",
            r"\g<1>0.5",
            "the uncertainty of Mean error XM is impossible",
        ),
        (
            r"(stepgauge_meanError.*?<si:uncertaintyXMLList>)\S+ ",
            r"\1",
            "Mean error XM has lists of unequal length",
        ),
        (r"(stepgauge_meanError.*?<si:valueXMLList>)\S+ ", r"\1nan ", "Mean error XM is not a number; found 'nan'"),
    ],
)
def test_a_wrong_unit_or_a_missing_uncertainty_does_not_pass(pattern: str, new: str, message: str) -> None:
    """The schema lets most of these through (units are free text, uncertainties optional): reading does not."""
    text, count = re.subn(pattern, new, machine_xml(), count=1, flags=re.DOTALL)
    assert count == 1
    with pytest.raises(InputError, match=message):
        read_errors(read(text))


@needs_schema
@pytest.mark.parametrize(
    ("pattern", "new", "by"),
    [
        (r"<si:unitXMLList>[^<]*</si:unitXMLList>", "", "schema"),
        (r"(<si:coverageFactorXMLList>)[^<]*", r"\g<1>0.5", "schema"),
        (r"<si:uncertaintyXMLList>[^<]*</si:uncertaintyXMLList>", "", "schema"),
        (r"<dcc:uniqueIdentifier>[^<]*</dcc:uniqueIdentifier>", "", "schema"),
        (r"(<si:unitXMLList>\\micro\\metre)", r"\1 \\milli\\metre", "schematron"),
        (r"(<dcc:endPerformanceDate>)[^<]*", r"\g<1>2020-01-01", "schematron"),
    ],
)
def test_what_schema_and_schematron_refuse(pattern: str, new: str, by: str) -> None:
    text, count = re.subn(pattern, new, machine_xml(), count=1, flags=re.DOTALL)
    assert count == 1
    if by == "schema":
        with pytest.raises(InputError, match=r"c\.xml:\d+: does not fit the schema"):
            validate(parse_xml(text.encode(), "c.xml"), SCHEMA, "c.xml")
    else:
        assert schematron(text)


@settings(max_examples=40)
@given(
    values=st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=8),
    u=st.floats(1e-4, 100.0),
    k=st.floats(1.0, 14.0),
)
def test_quantities_come_back_to_the_printed_digits(values: list[float], u: float, k: float) -> None:
    numbers = QuantityValues(values, MICROMETRE, 4, [u] * len(values), [k] * len(values))
    text = machine_xml()
    new = to_bytes(quantity("Value", "test_value", numbers)).decode().split("?>", 1)[1]
    text = text.replace("<dcc:list", "<dcc:list><dcc:quantity_/></dcc:list><dcc:list", 1)
    text = text.replace("<dcc:list><dcc:quantity_/></dcc:list>", f"<dcc:list>{new}</dcc:list>")
    found = read(text).select_kind("test_value")[0]
    np.testing.assert_allclose(found.scaled(LENGTH, 1e-6), values, atol=0.51e-4)
    np.testing.assert_allclose(found.expanded_scaled(LENGTH, 1e-6), u, atol=0.51e-4)
    assert found.k is not None
    np.testing.assert_allclose(found.k, k, atol=0.51e-3)


def test_everything_that_is_missing_is_named_at_once() -> None:
    evaluation, budget = evaluated()
    said = laboratory()
    head = said.certificate.model_copy(update={"number": None, "place": None})
    bare = replace(said, certificate=head, persons=())
    with pytest.raises(
        InputError, match=r"demands more; expected certificate\.number, certificate\.place, \[\[person\]\] with name"
    ):
        machine_certificate(evaluation, budget, bare, *shipped())


def call(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    try:
        main([str(word) for word in words])
        code = 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    said = capsys.readouterr()
    return code, said.out + said.err


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_recording(tmp_path / "r.csv", measured())
    result, out = tmp_path / "result", tmp_path / "c.xml"
    common: list[Any] = ["-g", "step-gauge-420"]
    assert call(capsys, "evaluate", tmp_path / "r.csv", *common, "-o", result)[0] == 0
    write = ["dcc", "write", result, "-c", SAID, *common, "-m", "bridge-cmm"]
    code, said = call(capsys, *write, "-o", out)
    assert (code, out.exists()) == (2, False)
    assert "budget.json: no such file: a certificate needs uncertainties; expected stepgauge budget" in said
    assert call(capsys, "budget", tmp_path / "r.csv", *common, "-m", "bridge-cmm", "-o", result, "--runs", 0)[0] == 0
    assert call(capsys, *write, "-o", out)[0] == 0
    code, said = call(capsys, "dcc", "check", out)
    assert code == 0
    assert re.search(r"XM: 10 faces; at face 11 \(100\.\d+ mm\) -?\d\.\d\d um, U \d\.\d\d um \(k = 2\.\d\d\)", said)
    (tmp_path / "report.pdf").write_bytes(b"%PDF-1.7 something")
    assert call(capsys, *write, "-o", out, "--attach", tmp_path / "report.pdf")[0] == 0
    assert "application/pdf" in out.read_text()
    before = out.read_text()
    for more, message in (
        (["--attach", tmp_path / "r.csv"], "not a PDF file"),
        (["--schema", tmp_path / "r.csv"], "not a schema"),
        (["--schema", tmp_path / "none.xsd"], "cannot be read as a schema"),
    ):
        code, said = call(capsys, *write, "-o", out, *more)
        assert (code, message in said) == (2, True), said
    assert out.read_text() == before
    code, said = call(capsys, *write, "-o", tmp_path / "c.pdf")
    assert (code, "expected NAME.xml" in said) == (2, True)
    other = json.loads((result / "budget.json").read_text())
    other["quantities"][-1]["value_um"] += 1.0
    write_json(result / "budget.json", other)
    code, said = call(capsys, *write, "-o", out)
    assert (code, "budget of another evaluation: xr of placement 1, face 11" in said) == (2, True), said


@needs_schema
def test_command_line_with_the_schema(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "c.xml").write_text(machine_xml())
    assert call(capsys, "dcc", "check", tmp_path / "c.xml", "--schema", SCHEMA)[0] == 0
    wrong = machine_xml().replace("<dcc:performanceLocation>customer", "<dcc:performanceLocation>moon")
    (tmp_path / "c.xml").write_text(wrong)
    code, said = call(capsys, "dcc", "check", tmp_path / "c.xml", "--schema", SCHEMA)
    assert (code, "does not fit the schema" in said and "moon" in said) == (2, True)


@needs_schema
def test_a_certificate_of_somebody_else_is_read() -> None:
    """PTB's good-practice example: temperatures with errors and their uncertainties, several languages."""
    path = SCHEMA.parent / "good-practice-temperature-3.2.0.xml"
    document = parse_document(parse_xml(path.read_bytes(), path), path)
    assert document.serial == "string-manufacturer-item"
    error = document.select_kind("basic_measurementError")[0]
    np.testing.assert_allclose(error.values, [0.072, 0.089, 0.107, -0.009, -0.084])
    np.testing.assert_allclose(error.expanded, 0.061)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="not a certificate of a machine measured with a step gauge"):
        read_errors(document)


def test_a_reversal_common_to_all_blocks_is_said_to_be_in_the_radius() -> None:
    """As the printed certificate has it among its notes, and what the measurand is and how it may be copied."""
    text = machine_xml()
    assert "backlash that is the same at all blocks counts as tip radius" in text
    assert "not to be reproduced except in full" in text
    assert "Measurand: the error of indicated position of the machine" in text
