"""Calibration certificates: the order of ISO/IEC 17025, nothing made up, and errors for what cannot be."""

from __future__ import annotations

import datetime
import importlib.util
import io
import re
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pypdf import PdfReader

from stepgauge.cli import main
from stepgauge.conditions.decision import decide
from stepgauge.dcc.documents import read_errors
from stepgauge.dcc.elements import to_bytes
from stepgauge.dcc.read import read_document
from stepgauge.dcc.write import machine_certificate
from stepgauge.dcc.xml import parse_xml, read_xml, validate
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.files.notation import uncertain
from stepgauge.files.resources import folder
from stepgauge.gauge.certified import read_gauge
from stepgauge.reports.certificate import closing_sections, identity_sections, not_stated
from stepgauge.reports.certificate_file import check_days, check_item, check_room, read_laboratory
from stepgauge.reports.content import Sources, make_content
from stepgauge.reports.page import UserStatements
from stepgauge.reports.render import render_html, render_pdf, write_report
from stepgauge.reports.result_table import result_table
from stepgauge.reports.sources import read_sources
from stepgauge.standards.budget_files import StoredGap
from stepgauge.standards.conformity import conformity, limit_of
from stepgauge.standards.mpe import Mpe
from tests.conftest import ROOT
from tests.dcc.made import SAID, SCHEMA, evaluated, laboratory
from tests.measured import shipped
from tests.standards.made import made

DAY = datetime.date(2026, 5, 4)
EXAMPLE = ROOT / "examples" / "certificate"


def content(placements: int = 1, **changed: Any) -> dict[str, Any]:
    """Of a budget without gaps, for only that makes a certificate."""
    evaluation, budget = evaluated(placements)
    budget = budget.model_copy(update={"not_included": []})
    gauge, machine = shipped()
    sources = Sources(gauge, machine, (), budget, laboratory())
    return make_content(evaluation, UserStatements(DAY), replace(sources, **changed))


@cache
def whole(placements: int = 1) -> dict[str, Any]:
    """The content, its figures drawn once."""
    return content(placements)


@cache
def printed(placements: int = 1) -> list[str]:
    """The text of the pages."""
    return texts(render_pdf(whole(placements)).data)


def texts(pdf: bytes) -> list[str]:
    return [page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages]


def test_the_order_is_that_of_the_standard() -> None:
    """ISO/IEC 17025:2017, 7.8.2.1 a) to p) and 7.8.4.1 a) to e)."""
    text = "\n".join(printed())
    asked = (
        "Calibration certificate",
        "Example Calibration Laboratory",
        "Sample Works Ltd",
        "B700-0042",
        "EXAMPLE-2026-017",
        "2026-05-04 to 2026-05-05",
        "Largest mean error XM",
        "Measurand",
        "SG-420-001",
        "Errors by face, placement 1",
        "Uncertainty budget, placement 1",
        "Measurement uncertainty",
        "Conditions",
        "41.0 to 47.0 %",
        "Metrological traceability",
        "SG-420-001",
        "Adjustment or repair",
        "No statement of conformity is made.",
        "The results relate only to the item calibrated",
        "B. Signer, Head of the laboratory",
        "End of calibration certificate EXAMPLE-2026-017",
    )
    place = 0
    for words in asked:
        found = text.find(words, place)
        assert found >= 0, f"{words!r} is missing or too early"
        place = found


@pytest.mark.parametrize("placements", [1, 2])
def test_number_and_page_stand_on_every_page_and_the_end_on_the_last(placements: int) -> None:
    pages = printed(placements)
    for number, page in enumerate(pages, 1):
        assert "No. EXAMPLE-2026-017" in page
        assert f"page {number} of {len(pages)}" in page
    assert ["End of calibration certificate" in page for page in pages] == [False] * (len(pages) - 1) + [True]
    assert "name, date, signature" in pages[-1]
    caption = "u and U of XM along the gauge"  # of the budget's figure, which floats
    assert sum(caption in " ".join(page.split()) for page in pages) == placements
    assert caption not in " ".join(pages[-1].split()).partition("End of calibration certificate")[2]


def test_the_end_mark_never_stands_alone(tmp_path: Path) -> None:
    """However much is not stated, the last page has the signature, too."""
    (tmp_path / "c.toml").write_text("")
    for budget in (evaluated(1)[1], None):
        pages = texts(render_pdf(content(laboratory=read_laboratory(tmp_path / "c.toml"), budget=budget)).data)
        assert "End of the " in pages[-1]
        assert "name, date, signature" in pages[-1]


def test_what_is_not_stated_says_so(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("[item]\nserial = 'X 1'\n")
    made = content(laboratory=read_laboratory(tmp_path / "c.toml"), budget=None)
    sections = made["identity"] + made["closing"]
    unsaid = {row["label"] for part in sections for row in part["rows"] if row["value"] is None}
    assert {"Name", "Address", "Number", "Issued", "Calibrated", "Procedure", "Manufacturer", "Expanded"} <= unsaid
    assert "Serial number" not in unsaid
    assert {"date of issue", "name of the laboratory", "condition of the item"} <= set(made["not_stated"])
    assert any(what.startswith("measurement uncertainty of XF") for what in made["not_stated"])
    pages = texts(render_pdf(made).data)
    assert all("no number stated" in page for page in pages)
    assert "not stated" in pages[0]
    assert "End of the report of measurement" in pages[-1]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[item]\nowner_number = 'A 1'\n[customer]\nemail = 'a@b.example'\n",
        "[certificate]\nreceived = 2026-05-01\n[conditions]\nhumidity_percent = [40.0, 45.0]\n[item]\nmodel = 'B 7'\n",
    ],
)
def test_every_line_without_a_statement_is_listed(tmp_path: Path, text: str) -> None:
    """As many entries as lines that say "not stated"; those of results and gauge are listed with their reason."""
    (tmp_path / "c.toml").write_text(text)
    evaluation, said = evaluated()[0], read_laboratory(tmp_path / "c.toml")
    sections = [*identity_sections(evaluation, said), *closing_sections(evaluation, said, None)]
    lines = [label for part in sections for label, value in part.rows if value is None]
    own = [label for label in lines if label != "Expanded" and not label.startswith("Gauge, placement")]
    assert len(not_stated(evaluation, said)) == len(own)
    assert ("relative humidity" in not_stated(evaluation, said)) == ("Relative humidity" in own)
    assert ("model of the item" in not_stated(evaluation, said)) == ("Model" in own)


def test_uncertainties_stand_beside_the_errors() -> None:
    evaluation, budget = evaluated()
    made = whole()
    faces, table = made["tables"]
    rows = {row[0]: row for row in faces["rows"]}
    line = budget.find("xm", 1, 9)
    assert line is not None
    assert [cell.strip() for cell in rows["9"][8:10]] == list(uncertain(line.value_um, line.expanded_um))
    assert rows["1"][6:8] == ["–", "–"]
    assert [column["name"] for column in table["columns"]][4:] == ["R_eff", "XF", "XB", "XM", "XR"]
    (total,) = table["ruled"]
    combined = next(row for row in table["rows"] if row[0] == "Combined u")[4:]
    squares = np.zeros(5)
    for source in table["rows"][:total]:
        squares += np.array([float(v) for v in source[4:]]) ** 2
    np.testing.assert_allclose(np.sqrt(squares), [float(v) for v in combined], atol=6e-3)  # two digits
    assert len(make_content(evaluation, UserStatements(DAY), Sources())["tables"]) == 1


def test_no_table_is_printed_twice_and_tables_come_before_the_signature() -> None:
    """No two tables have the same columns of the same faces; whoever signs has seen all of them."""
    made = whole(2)
    titles = [table["title"] for table in made["tables"]]
    assert len(set(titles)) == len(titles) == 4
    text = "\n".join(printed(2))
    assert max(text.rindex(title) for title in titles) < text.index("name, date, signature")


def test_an_incomplete_budget_stands_on_page_1_and_is_no_certificate() -> None:
    """Of the same result with and without one contribution: the title, and the missing one beside the number."""
    budget = evaluated()[1]
    gap = StoredGap(what="temperature of the gauge", state_by="--u-gauge-temperature")
    open_budget = budget.model_copy(update={"not_included": [gap]})
    part, none = (texts(render_pdf(content(budget=one)).data) for one in (open_budget, None))
    assert "Calibration certificate" in printed()[0]
    assert "not evaluated" not in printed()[0]
    for pages, words in (
        (part, "not in U: temperature of the gauge"),
        (none, "Measurement uncertainty was not evaluated"),
    ):
        assert words in " ".join(pages[0].split())
        assert "Calibration certificate" not in "\n".join(pages)
        assert "Report of measurement" in pages[0]
    assert "--u-gauge-temperature" not in "\n".join(part)  # options are for the laboratory, not for its customer


def test_page_1_states_measurand_result_and_expanded_uncertainty() -> None:
    evaluation, budget = evaluated()
    first = " ".join(printed()[0].split())
    rows = [row for row in evaluation["placements"][0]["faces"] if row["xm_um"] is not None]
    worst = max(rows, key=lambda row: abs(row["xm_um"]))
    line = budget.find("xm", 1, worst["face"])
    assert line is not None
    value, expanded = uncertain(worst["xm_um"], line.expanded_um)
    assert f"{value} µm {expanded} µm {line.k:.2f}" in first
    assert "Measurand: the error of indicated position" in first


@given(value=st.floats(-50, 50), expanded=st.floats(1e-4, 50))
def test_rounding_never_takes_more_than_a_twentieth_off_an_uncertainty(value: float, expanded: float) -> None:
    printed, sure = uncertain(value, expanded)
    assert float(sure) >= 0.95 * expanded
    assert len(sure.replace(".", "").lstrip("0").rstrip("0")) <= 2
    assert len(printed.partition(".")[2]) == len(sure.partition(".")[2])


def test_an_unfilled_form_is_refused(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    form = folder("templates") / "reports" / "certificate.toml"
    code, said = call(capsys, "report", results / "result", "-c", form, "-o", tmp_path / "c.pdf")
    assert code == 2
    for keys in (
        "[certificate] number, issued, performed_from, performed_to;",
        "[laboratory] name, street, city or country; [customer] name;",
        "[item] manufacturer, serial or owner_number; [method] name; [[person]] signs = true",
    ):
        assert keys in said
    assert "certificate.toml" in said
    assert not (tmp_path / "c.pdf").exists()


def test_html_has_the_same_sections() -> None:
    page = render_html(whole()).data.decode()
    for words in (
        "<h1>Calibration certificate</h1>",
        "Metrological traceability",
        "Uncertainty budget, placement 1",
        "Errors by face, placement 1",
        "End of calibration certificate EXAMPLE-2026-017",
    ):
        assert words in page
    assert page.count("<table") == page.count("</table>") == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[certificat]\n", r"table \[certificat\] is not known"),
        ("[certificate]\nnummer = '1'\n", "key certificate.nummer is not known; expected number?"),
        ("[certificate]\nplace = 'moon'\n", "key certificate.place is wrong"),
        (
            "[certificate]\nperformed_from = 2026-05-05\nperformed_to = 2026-05-04\n",
            r"performed_from \(2026-05-05\) not after certificate.performed_to \(2026-05-04\)",
        ),
        ("[laboratory]\ncountry = 'Germany'\n", "key laboratory.country is wrong"),
        ("[statements]\nconformity = 'pass'\n", "mpe, from which conformity is computed"),
        ("[conditions]\nhumidity_percent = [0.41, 0.47]\n", "not as a share of one"),
        ("[certificate]\nreceived = 1926-05-04\nissued = 2026-05-06\n", r"received \(1926-05-04\) at most three years"),
        ("[conditions]\nhumidity_percent = [60, 40]\n", "humidity_percent as"),
        ("[person]\nname = 'A'\n", r"found \[person\]; expected \[\[person\]\]"),
        ("[[person]]\nrole = 'A'\n", r"key person\[1\].name is missing"),
        ("[customer]\nname = ' '\n", "key customer.name is wrong"),
        ('[customer]\nname = "a\\u0007"\n', "key customer.name is wrong.*control characters"),
        ("[customer]\nname = '...'\n", r"key customer.name is wrong; found '\.\.\.'; expected what holds instead"),
        ("[method]\nstandards = ['…']\n", "key method.standards.0 is wrong.*expected what holds instead"),
        ("[certificate]\nissued = 2999-01-01\n", "key certificate.issued lies in the future; found 2999-01-01"),
        ("[certificate]\nperformed_to = 2999-01-01\n", "key certificate.performed_to lies in the future"),
    ],
)
def test_wrong_files_are_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        read_laboratory(tmp_path / "c.toml")


@pytest.mark.parametrize(
    "text",
    [
        "[certificate]\nperformed_from = 2026-05-05\nperformed_to = 2026-05-04\n",
        "[customer]\nname = ''\n",
        "[laboratory]\ncountry = 'Germany'\n",
        "[certificate]\nnumber = 2026-05-03\n",
        "[conditions]\ntemperature_C = [1, 2, 3]\n",
        "[[person]]\nname = 'A'\nsigns = 'yes'\n",
    ],
)
def test_wrong_files_are_told_in_words(tmp_path: Path, text: str) -> None:
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(InputError) as refused:
        read_laboratory(tmp_path / "c.toml")
    assert not re.search(r"\{'|datetime|should have|valid (string|boolean|list)|[Tt]uple", str(refused.value))


@pytest.mark.parametrize(
    ("first", "last", "measured_at", "message"),
    [
        (
            "2026-03-01",
            "2026-05-05",
            None,
            r"before the calibration of the gauge.*found 2026-03-01; expected 2026-03-02",
        ),
        ("2026-05-04", "2026-05-05", "2024-01-01", "was not measured on the days.*expected measured_at 2024-01-01"),
        ("2026-05-04", "2026-05-05", "2026-05-05T14:30; 2026-05-06", "expected measured_at 2026-05-06"),
        ("2026-05-04", "2026-05-05", "2026-05-05T23:59; 2026-05-04", None),
    ],
)
def test_a_calibration_is_after_that_of_its_gauge_and_when_it_was_measured(
    first: str, last: str, measured_at: str | None, message: str | None
) -> None:
    days = {
        "performed_from": datetime.date.fromisoformat(first),
        "performed_to": datetime.date.fromisoformat(last),
        "received": None,
    }
    said = replace(laboratory(), certificate=laboratory().certificate.model_copy(update=days))
    evaluation = evaluated()[0]
    comments = {**evaluation["comments"], **({"measured_at": measured_at} if measured_at else {})}
    with nullcontext() if message is None else pytest.raises(InputError, match=message):
        check_days(said, {**evaluation, "comments": comments})


def test_the_shipped_form_is_empty_and_every_key_of_it_is_known(tmp_path: Path) -> None:
    form = folder("templates") / "reports" / "certificate.toml"
    empty = read_laboratory(form)
    assert empty.certificate.number is None
    assert empty.persons == ()
    filled = re.sub(r"^# (?=[\w\[]+(?: =|\]))", "", form.read_text(), flags=re.MULTILINE).replace('"..."', '"said"')
    (tmp_path / "filled.toml").write_text(filled)
    said = read_laboratory(tmp_path / "filled.toml")
    assert said.certificate.number == "2026-017"
    assert said.persons[0].signs
    for table in (said.certificate, said.laboratory, said.item, said.method, said.conditions, said.statements):
        unset = [name for name, value in table.model_dump().items() if value in (None, [])]
        assert unset == [], f"the form does not show {unset}"


def test_everything_stated_still_validates(tmp_path: Path) -> None:
    """The form with every key in use, printed and digital."""
    form = (folder("templates") / "reports" / "certificate.toml").read_text()
    filled = re.sub(r"^# (?=[\w\[]+(?: =|\]))", "", form, flags=re.MULTILINE).replace('"..."', '"Some <words> & more"')
    (tmp_path / "filled.toml").write_text(filled)
    said = read_laboratory(tmp_path / "filled.toml")
    evaluation, budget = evaluated()
    limit = Mpe.parse(str(said.statements.mpe))
    text = to_bytes(machine_certificate(evaluation, budget, said, *shipped(), limit)).decode()
    for words in ("7.8.8", "7.8.2.1 p)", "Decision rule: ISO 14253-1", "Place of the calibration: Measuring room 2"):
        assert words in text
    assert all("No. 2026-017" in page for page in texts(render_pdf(content(laboratory=said)).data))
    if SCHEMA.is_file():
        validate(parse_xml(text.encode(), "c.xml"), SCHEMA, "c.xml")


@pytest.mark.parametrize(
    ("mpe", "gaps", "said", "outcome"),
    [
        ("30", [], "Pass: MPE = ± 30 µm", "conforms"),
        ("0.01", [], "Fail: MPE = ± 0.01 µm", "does not conform"),
        ("30", ["probing"], "Undecidable: MPE = ± 30 µm", "not decidable"),
        ("0.01", ["probing"], "Undecidable", "not decidable"),
    ],
)
def test_conformity_is_computed_from_a_limit(mpe: str, gaps: list[str], said: str, outcome: str) -> None:
    """By ISO 14253-1 with the complete U only, on page 1, by face and on the certificate, printed and digital."""
    evaluation, budget = evaluated(1)
    sure = [q.model_copy(update={"u_um": q.u_um / 9, "expanded_um": q.expanded_um / 9}) for q in budget.quantities]
    left = [StoredGap(what=gap, state_by="-") for gap in gaps]
    budget = budget.model_copy(update={"not_included": left, "quantities": sure})
    judged = conformity(evaluation, budget, Mpe.parse(mpe))
    assert judged.text.startswith(said)
    assert judged.outcome == outcome
    assert "Decision rule: ISO 14253-1" in judged.text
    assert ("U lacks probing" in judged.text) is bool(gaps)
    for one in judged.faces:
        row = evaluation["placements"][0]["faces"][one.face - 1]
        line = budget.find("xf" if one.face % 2 else "xb", 1, one.face)
        assert line is not None
        assert one.error_um == row["xf_um" if one.face % 2 else "xb_um"]
        assert one.outcome == decide(one.error_um, float(mpe), line.expanded_um, gaps)
        assert (one.probability is None) is bool(gaps)


def test_a_certificate_prints_what_was_computed_and_no_words_of_its_own() -> None:
    said = laboratory()
    limited = content(laboratory=said, mpe=Mpe.parse("30"))
    assert limited["overall"].startswith("Pass")
    (table,) = [one for one in limited["tables"] if one["title"].startswith("Errors by face")]
    assert [column["name"] for column in table["columns"]][-2:] == ["MPE", "Decision"]
    assert {row[-1] for row in table["rows"]} == {"–", "pass"}
    text = " ".join("\n".join(texts(render_pdf(limited).data)).split())
    assert text.count("Pass: MPE = ± 30 µm") == 2
    assert "not to be reproduced except in full" in text
    assert "accreditation mark" not in text  # no place for what was not given
    evaluation, budget = evaluated(1)
    gauge, machine = shipped()
    root = machine_certificate(evaluation, budget, said, gauge, machine, Mpe.parse("30"))
    assert "basic_conformity" in to_bytes(root).decode()
    with pytest.raises(ValueError, match="no words of one's own"):
        type(said.statements)(conformity="XM is within 1 um: conforms", decision_rule="none")


def test_air_and_gauge_that_contradict_each_other_are_refused() -> None:
    said, (evaluation, _) = laboratory(), evaluated(1)
    cold = replace(said, conditions=said.conditions.model_copy(update={"temperature_C": (2.0, 2.4)}))
    at_20 = {**evaluation, "placements": [{**evaluation["placements"][0], "gauge_temperature_C": 20.4}]}
    with pytest.raises(InputError, match=r"conditions.temperature_C contradicts.*found 2 to 2.4 deg C"):
        check_room(cold, at_20)
    check_room(said, at_20)


def test_a_form_that_was_cut_is_refused(tmp_path: Path) -> None:
    text = SAID.read_text(encoding="utf-8")
    cut = text[: text.index("[statements]") + len("[statements]") + 1]
    (tmp_path / "c.toml").write_text(cut, encoding="utf-8")
    with pytest.raises(InputError, match=r"it was cut; found \[statements\]"):
        read_laboratory(tmp_path / "c.toml")


def test_the_range_names_the_faces_that_have_a_mean_error() -> None:
    """XM is not defined at the first and the last face."""
    evaluation, _ = evaluated(1)
    row = next(row for row in result_table(evaluation, None).rows if row[0] == "Range of the mean error XM")
    known = [one["face"] for one in evaluation["placements"][0]["faces"] if one["xm_um"] is not None]
    assert row[1].startswith(f"faces {known[0]} to {known[-1]}, of 90.0 mm")
    assert known[0] > 1


def call(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    try:
        main([str(word) for word in words])
        code = 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    return code, capsys.readouterr().err


def run_example(results: Path) -> None:
    spec = importlib.util.spec_from_file_location("certificate_example", EXAMPLE / "reproduce.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(results)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("certificate")
    run_example(path)
    return path


def test_the_example_is_current(results: Path) -> None:
    """What is published in expected/ is what the commands write."""
    for name in ("certificate.xml", "gauge-certificate.xml"):
        found, published = (read_document(where / name) for where in (results, EXAMPLE / "expected"))
        assert (found.number, found.serial, found.laboratory) == (
            published.number,
            published.serial,
            published.laboratory,
        )
        assert len(found.quantities) == len(published.quantities)
        for one, other in zip(found.quantities, published.quantities, strict=True):
            assert (one.name, one.kinds, one.unit_text) == (other.name, other.kinds, other.unit_text)
            np.testing.assert_allclose(one.values, other.values, atol=2e-4)
    pages, published_pages = (
        texts((where / "certificate.pdf").read_bytes()) for where in (results, EXAMPLE / "expected")
    )
    assert len(pages) == len(published_pages)
    assert all("EXAMPLE CERTIFICATE" in page for page in pages)
    if SCHEMA.is_file():
        validate(read_xml(results / "certificate.xml"), SCHEMA, "certificate.xml")


def test_the_printed_and_the_digital_certificate_say_the_same(results: Path) -> None:
    radii, lists = read_errors(read_document(results / "certificate.xml"))
    text = "\n".join(texts((results / "certificate.pdf").read_bytes()))
    assert f"{radii[0].r_eff_mm:.5f} mm" in text
    xm = next(one for one in lists if one.name == "xm")
    table = text[text.index("Errors by face") :]
    row = next(line.split() for line in table.splitlines() if line.startswith("41 21 front"))
    assert tuple(cell for cell in row if cell != "*")[8:10] == uncertain(xm.value_um[-1], xm.expanded_um[-1])
    assert read_gauge(results / "gauge.toml").certificate.laboratory == "Example Gauge Laboratory"


def test_command_line_refuses_what_does_not_belong_together(
    results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = ["report", results / "result", "-o", tmp_path / "c.pdf"]
    for more, message in (
        (["-c", SAID, "--number", "7"], "states number, date, customer"),
        (["-c", tmp_path / "none.toml"], "no such file"),
        (["--budget", results / "result" / "evaluation.json"], "not a budget"),
    ):
        code, said = call(capsys, *report, *more)
        assert (code, message in said) == (2, True), said
    assert not (tmp_path / "c.pdf").exists()
    assert call(capsys, *report, "--budget", results / "result", "-c", SAID)[0] == 0
    text = "\n".join(texts((tmp_path / "c.pdf").read_bytes()))
    assert "Issued\n2026-05-06" in text or "Issued 2026-05-06" in text


@pytest.mark.parametrize(
    ("name", "serial", "item", "expected"),
    [
        (
            "Bridge CMM",
            None,
            {"name": "Horizontal arm", "model": "H 7"},
            r"found name 'Horizontal arm'.*'Bridge CMM' \(",
        ),
        ("CMM 3", None, {"name": "CMM 4", "model": None}, "names another machine.*'CMM 3'"),
        (
            "Bridge CMM",
            None,
            {"name": None, "model": "Gantry"},
            "found manufacturer 'Example Machines', model 'Gantry'",
        ),
        ("Bridge 700", None, {"name": "Measuring machine", "model": "BRIDGE 700"}, None),
        ("Bridge CMM", "B700-0043", {}, "another serial number.*'B700-0042'.*expected serial 'B700-0043'"),
        ("Bridge CMM", "inv-1138", {}, None),
        ("Bridge CMM", "B700-0042", {}, None),
        ("Bridge CMM", None, {"name": None, "model": None}, None),
    ],
)
@pytest.mark.parametrize("recorded", [True, False])
def test_form_machine_file_and_recording_are_of_one_machine(
    recorded: bool, name: str, serial: str | None, item: dict[str, str | None], expected: str | None
) -> None:
    said, (evaluation, _), (_, machine) = laboratory(), evaluated(1), shipped()
    said = replace(said, item=said.item.model_copy(update=item))
    machine = replace(machine, table=machine.table.model_copy(update={"name": name, "serial": serial}))
    evaluation = {**evaluation, "comments": {"machine": name} if recorded else {}}
    with nullcontext() if expected is None else pytest.raises(InputError, match=expected):
        check_item(said, evaluation, None if recorded and serial is None else machine)


def test_no_certificate_of_readings_off_the_stated_axis(tmp_path: Path) -> None:
    """5 mrad, which nobody stated: 5 um of cosine error at 410 mm."""
    gauge = shipped()[0]
    recording = made(gauge, lambda cycle, face: 0.1 * np.sin(7.0 * cycle * face))
    for mrad, refused in ((0.1, False), (5.0, True)):
        tilted = recording.frame.copy()
        tilted["y_mm"] += mrad * 1e-3 * (tilted["x_mm"] - tilted["x_mm"].iloc[0])
        found = evaluation_to_dict(evaluate(replace(recording, frame=tilted), gauge))
        with pytest.raises(InputError, match=r"5\.00 mrad off the axis") if refused else nullcontext():
            assert read_sources(found, gauge, laboratory=SAID).laboratory is not None


# the limit


def test_one_limit_for_whoever_judges() -> None:
    """That of now, of the evaluation, of the machine file; a certificate that differs: refused.

    A certificate file is used again: with the machine's limit changed it certified the old one as passed.
    """
    machine = shipped()[1]
    machine = replace(machine, table=machine.table.model_copy(update={"mpe": "4 + L/100"}))
    texts = {"asked": "min(1 + L/350, 3)", "certified": "2 + L/300", "stored": "3 + L/200"}
    assert limit_of({}, machine, stored=texts["stored"]) == Mpe.parse("3 + L/200")
    assert limit_of({}, None, certified=texts["certified"]) == Mpe.parse("2 + L/300")
    for stored in (None, texts["stored"]):
        with pytest.raises(InputError, match="certificate states another limit"):
            limit_of({}, machine, certified=texts["certified"], stored=stored)
    assert limit_of({}, machine, asked=texts["asked"], stored=texts["stored"]) == Mpe.parse("min(1 + L/350, 3)")
    assert limit_of({}, machine, asked="2 + L/300 um", certified=texts["certified"]) == Mpe.parse("2 + L/300")
    with pytest.raises(InputError, match=r"certificate states another limit; found 1 \+ L/350; expected 2 \+ L/300"):
        limit_of({}, machine, asked="1 + L/350", certified=texts["certified"])
    assert limit_of({}, machine) == Mpe.parse("4 + L/100")
    assert limit_of({}, None) is None


def test_a_report_judges_by_the_limit_of_the_evaluation() -> None:
    """An evaluation that says ``fail`` beside a report that passes by another limit is two answers."""
    evaluation, _ = evaluated(1)
    sources = read_sources({**evaluation, "mpe": "0.01"})
    assert sources.mpe == Mpe.parse("0.01")
    assert "MPE = ± 0.01 µm" in make_content(evaluation, UserStatements(DAY), sources)["overall"]


@pytest.mark.parametrize("suffix", [".pdf", ".html"])
def test_a_certificate_that_was_issued_is_never_written_over(tmp_path: Path, suffix: str) -> None:
    """ISO/IEC 17025:2017, 7.8.8: what is amended has a number of its own and names what it replaces."""
    said = laboratory()
    path, other = tmp_path / f"first{suffix}", tmp_path / f"second{suffix}"

    def write(where: Path, **head: str) -> None:
        numbered = replace(said, certificate=said.certificate.model_copy(update=head))
        write_report(where, content(laboratory=numbered))

    write(path)
    issued = path.read_bytes()
    write(path)  # the same again is no loss
    for where in (path, other):
        with pytest.raises(InputError, match="is there already, and one that was issued is kept") as refused:
            write(where, place_text="Elsewhere")
    with pytest.raises(InputError, match=rf"certificate {said.certificate.number} is there already"):
        write(path, number="A-2")
    assert path.read_bytes() == issued
    assert f"'{said.certificate.number}' stated as the certificate that it replaces" in str(refused.value)
    write(other, number="A-2", replaces=said.certificate.number)
    assert path.read_bytes() == issued
    table = identity_sections(
        evaluated(1)[0], replace(said, certificate=said.certificate.model_copy(update={"replaces": "A-1"}))
    )[-1].rows
    assert ("Replaces certificate", "A-1") in table
    with pytest.raises(ValueError, match="a number of its own"):
        type(said.certificate)(number="A-1", replaces="A-1")


@pytest.mark.parametrize("language", ["en", "de"])
def test_no_text_runs_into_another(language: str) -> None:
    """Also with names that are longer than their columns: no letter covers half of another one."""
    pdfium = pytest.importorskip("pypdfium2")
    said = laboratory()
    email = "calibration@laboratoryfordimensionalmetrologyandengineering.example"
    said = replace(said, laboratory=said.laboratory.model_copy(update={"email": email}))
    evaluation, budget = evaluated()
    given = Sources(*shipped(), (), budget.model_copy(update={"not_included": []}), said)
    made_of = make_content(evaluation, UserStatements(DAY, language=language), given)
    for page in pdfium.PdfDocument(render_pdf({**made_of, "example": False}).data):
        text = page.get_textpage()
        letters = [i for i in range(text.count_chars()) if text.get_text_range(i, 1).strip()]
        boxes = np.array([text.get_charbox(i) for i in letters])
        left, foot, right, head = boxes.T[:, :, None]
        across = np.minimum(right, right.T) - np.maximum(left, left.T)
        up = np.minimum(head, head.T) - np.maximum(foot, foot.T)
        met = (across > 0.5 * (right - left)) & (across > 1.0) & (up > 0.5 * (head - foot)) & (up > 1.0)
        pairs = np.argwhere(np.triu(met | met.T, 3))  # the letters of a ligature share their box
        assert not [[text.get_text_range(max(letters[i] - 9, 0), 18) for i in pair] for pair in pairs]
