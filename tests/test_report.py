"""The report says what the evaluation says, whatever text it is given, on every page that needs it."""

from __future__ import annotations

import base64
import datetime
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
import typst
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pypdf import PdfReader

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict, write_evaluation
from stepgauge.files.notation import clean, number, percent, quantity
from stepgauge.files.resources import folder
from stepgauge.files.text import write_json
from stepgauge.machine.uncertain import Uncertain
from stepgauge.reports.content import Sources, make_content
from stepgauge.reports.page import Page, PrintedTable, TableColumn, UserStatements
from stepgauge.reports.reading import check_gauge, check_machine, check_placements, read_checked_evaluation
from stepgauge.reports.render import Pages, render_html, render_pdf, set_in_print, write_report
from stepgauge.reports.sections import Section
from tests.conftest import ROOT
from tests.measured import ALONG_X, lay, one_placement, shipped, two_placements, with_gaps

DAY = datetime.date(2026, 5, 4)
STATED = UserStatements(DAY, "R-17", "Customer & Sons", "Hall 3", "A. Meyer", "First line\nsecond line")
NASTY = [
    "#panic()",
    "$x^2$",
    "*a* _b_ `c` <label> @ref",
    "\\ // /* ]",
    "<script>alert(1)</script>",
    "{{ 7*7 }}",
    '"; #',
]


def content(evaluation: Evaluation, stated: UserStatements = STATED, sources: Sources | None = None) -> dict[str, Any]:
    return make_content(evaluation_to_dict(evaluation), stated, sources or Sources())


def pages(pdf: bytes) -> list[str]:
    return [page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages]


@cache
def said_of(make: Callable[[], Evaluation]) -> dict[str, Any]:
    """The content of a report, its figures drawn once."""
    return content(make())


@cache
def pdf_of(make: Callable[[], Evaluation]) -> Pages:
    return render_pdf(said_of(make))


@cache
def printed(make: Callable[[], Evaluation]) -> list[str]:
    """The text of its pages."""
    return pages(pdf_of(make).data)


def rows(text: str) -> list[list[str]]:
    """Lines of the table of faces: they begin with a face, a block and a side."""
    return [line.split() for line in text.splitlines() if re.match(r"\d+\s+\d+\s+(front|back)\s", line)]


class Text(HTMLParser):
    """Text, tags and attributes of a page."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.images: list[str] = []
        self.words: list[str] = []
        self.feed(page.decode("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.images += [value or "" for name, value in attrs if tag == "img" and name == "src"]

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.mark.parametrize("make", [one_placement, two_placements, with_gaps, lambda: one_placement(cycles=1)])
def test_pdf_has_every_face_of_every_placement(make: Any) -> None:
    evaluation = make()
    found = rows("\n".join(printed(make)))
    wanted = [row for result in evaluation_to_dict(evaluation)["placements"] for row in result["faces"]]
    assert len(found) == len(wanted)
    for cells, row in zip(found, wanted, strict=True):
        plain = [cell.replace("*", "").replace("−", "-") for cell in cells if cell != "*"]
        assert plain[:3] == [str(row["face"]), str(row["block"]), row["side"]]
        assert float(plain[4]) == pytest.approx(row["position_mm"], abs=5e-6)
        for cell, name, scale in zip(
            plain[5:11], ("xf", "sf", "xb", "sb", "xm", "xr"), (1, 2, 1, 2, 1, 1), strict=True
        ):
            value = row[f"{name}_um"]
            if value is None:
                assert cell == "–"
            else:
                assert float(cell) == pytest.approx(scale * value, abs=0.00501)
        assert plain[11] == str(row["count"])


def test_interpolated_values_are_marked() -> None:
    (second, *_) = [row for row in rows("\n".join(printed(one_placement))) if row[0] == "2"]
    line = " ".join(second)
    # Face 2 is a back: its forward error and two-sigma are interpolated, its backward ones measured.
    assert line.count("*") == 2
    assert re.search(r"back 10\.000 10\.00041 −?\d\.\d\d ?\* \d\.\d\d ?\* 0\.00 \d\.\d\d ", line)


def test_pdf_has_number_certificate_radius_and_page_numbers() -> None:
    evaluation = one_placement()
    every = printed(one_placement)
    for i, text in enumerate(every, 1):
        assert f"page {i} of {len(every)}" in text
        assert "EXAMPLE CERTIFICATE" in text
        assert "R-17" in text
    first = every[0]
    assert evaluation.gauge.certificate.number in first
    assert f"{evaluation.results[0].radius.r_eff_mm:.5f} mm" in first
    assert f"{evaluation.results[0].band_um:.2f} µm" in first
    assert f"{evaluation.results[0].worst_two_sigma_um:.2f} µm" in first
    assert "zero by construction" in " ".join(first.split())
    text = "\n".join(every)
    assert "Measured by" in text
    assert "Approved by" in text
    assert "A. Meyer" in text


def test_a_real_certificate_is_not_called_an_example() -> None:
    evaluation = one_placement()
    real = replace(evaluation.gauge, certificate=evaluation.gauge.certificate.model_copy(update={"example": False}))
    said = content(replace(evaluation, gauge=real))
    assert "EXAMPLE CERTIFICATE" not in "".join(pages(render_pdf(said).data))
    assert b"EXAMPLE CERTIFICATE" not in render_html(said).data


def test_simulated_recordings_are_called_so() -> None:
    measured = replace(one_placement(), comments={"machine": "Bridge CMM"})
    assert "Simulated recording" in printed(one_placement)[0]
    assert "Simulated recording" not in pages(render_pdf(content(measured)).data)[0]


def test_what_is_missing_is_listed_and_what_is_given_is_not() -> None:
    bare = content(one_placement(), UserStatements(DAY))["not_stated"]
    for what in ("report number", "customer", "place of measurement", "operator"):
        assert what in bare
    for start in ("uncertainty of the certified", "machine and probe", "placement 1: block centres"):
        assert any(line.startswith(start) for line in bare), start
    # The recording has no date, and two sigma is no uncertainty: that much stays open.
    assert [line.split(" ")[0] for line in with_files()["not_stated"]] == ["date", "measurement"]


def test_page_1_says_that_nobody_recorded_the_temperature_of_the_gauge() -> None:
    told = "The temperature of the gauge was not recorded: lengths are not corrected for it."
    assert told not in content(one_placement())["warnings"]
    (result,) = one_placement().results
    silent = replace(one_placement(), results=(replace(result, gauge_temperature_C=None),))
    assert told in content(silent)["warnings"]
    assert told in " ".join(pages(render_pdf(content(silent)).data)[0].split())


@pytest.mark.parametrize(
    ("convention", "of", "asks"),
    [
        (None, "the machine as it is, at the temperature that it has", True),
        ("as_read", "the machine as it is, at the temperature that it has", True),
        ("corrected_to_20", "the machine with its own correction of the readings to 20 °C", False),
        ("nominal_expansion", "the machine with readings corrected to 20 °C for the nominal expansion", True),
    ],
)
def test_what_an_error_is_of_follows_from_the_recorded_correction(convention: str | None, of: str, asks: bool) -> None:
    """And the temperature of the gauge is missing only where the certified positions need it."""
    (result,) = one_placement().results
    stated = {} if convention is None else {"temperature_convention": convention}
    read = replace(one_placement(), comments={**one_placement().comments, **stated})
    assert f"position of {of}" in content(read)["statements"][0]
    silent = content(replace(read, results=(replace(result, gauge_temperature_C=None),)))
    assert any("was not recorded" in one for one in silent["warnings"]) is asks
    said = next(row["value"] for part in silent["sections"] for row in part["rows"] if row["label"] == "Convention")
    assert "recorded gauge temperature" not in said


def test_the_recorded_temperature_of_the_scales_goes_before_that_of_the_machine_file() -> None:
    """24 deg C recorded, 20.5 +- 0.1 stated: the first is printed, and page 1 says that the two contradict."""
    gauge, machine = shipped()
    stated = replace(machine, uncertain=(Uncertain("machine.temperature_C", 20.5, 0.1),))
    (result,) = one_placement().results
    for recorded_C, printed_C, doubted in ((24.0, "24.00 °C (mean, recorded)", True), (20.6, "20.60", False)):
        warm = replace(one_placement(), results=(replace(result, scale_temperature_C=recorded_C),))
        said = content(warm, STATED, Sources(gauge, stated))
        lines = {row["label"]: row["value"] for section in said["sections"] for row in section["rows"]}
        assert printed_C in lines["Scale temperature"]
        assert any("24.00 °C as recorded, and not at 20.50 °C" in one for one in said["warnings"]) == doubted


def test_an_undefined_uncertainty_of_the_radius_is_a_dash() -> None:
    said = content(one_placement(cycles=1))
    lines = {row["label"]: row["value"] for section in said["sections"] for row in section["rows"]}
    assert lines["R_eff"].endswith("mm (u = –)")
    assert said["summary"][0]["u_r_eff"] == "–"


DETAILS = {
    "angles": {"n1_to_axis_mrad": 0.613, "n2_to_axis_mrad": 1.2},
    "uncertainty": {"c1_um": [0.1, 0.2, 0.3], "c2_um": [0.1, 0.2, 0.3], "yaw_urad": 4.25, "pitch_urad": 5.5,
                    "n1_urad": 91.0, "n2_urad": 92.0},
    "notes": ["turned about its axis"],
}  # fmt: skip


@cache
def with_files() -> dict[str, Any]:
    """The content of a report that is also given gauge, machine and placement."""
    gauge, machine = shipped()
    return content(one_placement(), STATED, Sources(gauge, machine, [replace(lay(gauge), details=DETAILS)]))


def test_files_given_with_it_are_printed() -> None:
    said = with_files()
    lines = {row["label"]: row["value"] for section in said["sections"] for row in section["rows"]}
    assert lines["Uncertainty"] == "U = 0.10 to 0.35 µm (k = 2)"
    assert lines["Normal N1 to axis"] == "0.613 mrad (u = 91.0 µrad)"
    assert lines["Pitch, towards +z"] == "0.00000° (u = 5.5 µrad)"
    assert lines["Centre C1, block 1"].endswith("u = (0.10, 0.20, 0.30) µm")
    assert lines["Travel x, y, z (mm)"] == "0 to 700, 0 to 1200, 0 to 600"
    w_um = float(lines["Nominal radius − R_eff"].removesuffix(" µm"))
    assert w_um == pytest.approx((2.0 - one_placement().results[0].radius.r_eff_mm) * 1e3, abs=0.006)
    assert "turned about its axis" in {one["title"]: one["items"] for one in said["lists"]}["Notes"]


def test_notes_name_gaps_and_unequal_cycles() -> None:
    text = " ".join(printed(with_gaps)[0].split())
    assert "not measured: faces 4, 7" in text
    assert "unequal cycles: 1 to 3" in text


def test_several_placements_have_their_own_rows_and_figures() -> None:
    said = said_of(two_placements)
    assert [one["placement"] for one in said["summary"]] == ["1", "2"]
    assert [one["cycles"] for one in said["summary"]] == ["3", "2"]
    assert said["figures"][0]["svg"] != said["figures"][1]["svg"]
    text = "\n".join(printed(two_placements))
    assert "Errors by face, placement 2" in text


def test_the_same_content_gives_the_same_files() -> None:
    again = content(one_placement())
    for render in (render_pdf, render_html):
        assert render(again).data == render(said_of(one_placement)).data


def test_the_pdf_is_archival_and_carries_the_evaluation() -> None:
    evaluation = one_placement()
    rendered = pdf_of(one_placement)
    assert rendered.notes == ()
    assert re.search(rb"pdfaid:part>3<", rendered.data)
    (attached,) = PdfReader(io.BytesIO(rendered.data)).attachments["evaluation.json"]
    assert json.loads(attached) == evaluation_to_dict(evaluation)


def test_fonts_come_with_the_program() -> None:
    """Without one font of the system the pages are the same: Typst's own are embedded."""
    said = said_of(one_placement)
    source = folder("templates") / "reports" / "report.typ"
    alone = typst.compile(
        source, root=source.parent, sys_inputs={"report": json.dumps(set_in_print(said))}, pdf_standards=["a-3a"],
        ignore_system_fonts=True, format="pdf",
    )  # fmt: skip
    assert alone == pdf_of(one_placement).data


def test_a_character_without_a_font_is_said_and_does_not_stop_the_report(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(typst, "compile", partial(typst.compile, ignore_system_fonts=True))
    rendered = render_pdf(content(one_placement(), replace(STATED, remarks="한국")))
    assert len(rendered.notes) == 1
    assert "not for archives" in rendered.notes[0]
    assert len(pages(rendered.data)) >= 2


def test_html_is_one_file_with_tables_and_figures() -> None:
    evaluation = two_placements()
    page = Text(render_html(said_of(two_placements)).data)
    assert len(page.images) == 2
    for source in page.images:
        kind, _, coded = source.partition(",")
        assert kind == "data:image/svg+xml;base64"
        assert b"<svg" in base64.b64decode(coded)
    assert not {"script", "link", "iframe", "object"} & set(page.tags)
    faces = sum(len(result.face) for result in evaluation.results)
    # tables of faces with their headers, and the result: its header and five rows for each placement
    assert page.tags.count("tr") == faces + 2 + 1 + 2 * 5
    assert "EXAMPLE CERTIFICATE" in "".join(page.words)


@pytest.fixture(scope="module")
def said() -> dict[str, Any]:
    return said_of(one_placement)


def test_markup_in_text_is_printed_not_obeyed(said: dict[str, Any]) -> None:
    text = " ".join(NASTY)
    stated = replace(STATED, number=text, customer=text, remarks=text)
    changed = content(one_placement(), stated)
    printed = "".join("".join(pages(render_pdf(changed).data)).split())
    assert "".join(text.split()) in printed
    page = Text(render_html(changed).data)
    assert page.tags.count("p") == Text(render_html(said).data).tags.count("p") - 1  # two paragraphs became one
    assert "script" not in page.tags
    assert "".join(page.words).count(text) >= 3


@settings(max_examples=15)
@given(text=st.text(max_size=60))
@example(text="\ud800 lone surrogate")
@example(text="\x00\x1b[0m\u202e\ufeff")
@example(text="한국 😀")
def test_any_text_compiles(said: dict[str, Any], text: str) -> None:
    """Whatever a person types, in any field, both files come out with the same tags and count of tables."""
    changed = {**said, "remarks": clean(text) or None, "number": clean(text) or None}
    changed |= {
        "lists": [{"title": clean(text), "items": [clean(text)]}],
        "warnings": [clean(text)],
        "overall": clean(text),
    }
    changed["sections"] = [{"title": clean(text), "rows": [{"label": clean(text), "value": clean(text)}]}]
    assert len(PdfReader(io.BytesIO(render_pdf(changed).data)).pages) >= 2
    page = Text(render_html(changed).data)
    assert "script" not in page.tags
    assert page.tags.count("table") == 2


def test_a_section_with_nothing_in_it_is_left_out() -> None:
    """Of a recording that says nothing of itself: its heading had stood on the page alone."""
    empty, full = Section("Recording"), Section("Decision", [("Rule", "ISO 14253-1")])
    page = Page(
        "T", "t", (), PrintedTable("R", [TableColumn("A")], []), ("a.json", {"comments": {}}), sections=[empty, full]
    )
    assert [one["title"] for one in page.to_dict(UserStatements(datetime.date(2026, 5, 4)))["sections"]] == ["Decision"]


def test_numbers_are_not_broken_between_their_digits() -> None:
    assert clean(f"up to 2\u00a0000 mm\t, {percent(0.0087, 2)}") == "up to 2\u00a0000 mm , 0.87 %"


@given(text=st.text(st.characters(codec=None)))
def test_cleaned_text_is_encodable_and_stays_clean(text: str) -> None:
    cleaned = clean(text)
    cleaned.encode("utf-8")
    assert clean(cleaned) == cleaned
    assert all(mark in "\n\N{NO-BREAK SPACE}" or mark.isprintable() for mark in cleaned)


@given(st.floats(-1e6, 1e6), st.integers(0, 6))
def test_numbers_read_back_and_have_no_negative_zero(value: float, decimals: int) -> None:
    text = number(value, decimals)
    assert float(text.replace("−", "-")) == pytest.approx(value, abs=0.5001 * 10.0**-decimals)
    assert "-" not in text
    assert not re.fullmatch(r"−0\.?0*", text)


def test_undefined_numbers_are_a_dash_without_unit() -> None:
    assert quantity(None, 2, "µm") == quantity(float("nan"), 2, "µm") == "–"
    assert quantity(-1.5, 1, "°") == "−1.5°"


def test_own_templates(tmp_path: Path, said: dict[str, Any]) -> None:
    own = tmp_path / "own.html.j2"
    own.write_text("<p>{{ report.number }} {{ report.summary[0].band }}</p>")
    assert render_html(said, own).data.decode() == f"<p>R-17 {said['summary'][0]['band']}</p>"
    typ = tmp_path / "own.typ"
    typ.write_text("#let r = json(bytes(sys.inputs.report))\nNumber: #r.number")
    assert "Number: R-17" in pages(render_pdf(said, typ).data)[0]


@pytest.mark.parametrize(
    ("name", "text", "line", "what"),
    [
        ("own.html.j2", "a\n{{ report.nothing }}", ":2", "nothing"),
        ("own.html.j2", "{% if %}", ":1", "template"),
        ("own.html.j2", "{{ report.__class__.__mro__ }}", ":1", "unsafe|not safe|undefined|no attribute"),
        ("own.typ", "#let r = json(bytes(sys.inputs.report))\n#r.nothing", "line 2", "nothing"),
        ("own.typ", "#import \"@preview/cetz:0.3.0\"", "", "network"),
        ("own.typ", "#read(\"/etc/passwd\")", "line 1", "not found|denied|outside|escape"),
        ("own.typ", "#read(\"../secret\")", "line 1", "not found|denied|outside|escape"),
    ],
)  # fmt: skip
def test_faulty_templates_are_named_with_their_line(
    tmp_path: Path, said: dict[str, Any], name: str, text: str, line: str, what: str
) -> None:
    (tmp_path / "secret").write_text("secret")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / name).write_text(text)
    target = tmp_path / ("report.html" if "html" in name else "report.pdf")
    with pytest.raises(InputError, match=what) as caught:
        write_report(target, said, inner / name)
    assert name in str(caught.value)
    assert line in str(caught.value)
    assert not target.exists()


def test_a_file_that_is_no_evaluation(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text('{"format": "other"}')
    with pytest.raises(InputError, match="not an evaluation"):
        read_checked_evaluation(tmp_path / "x.json")
    with pytest.raises(InputError, match="no such file"):
        read_checked_evaluation(tmp_path)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (lambda d: d.pop("gauge"), "gauge"),
        (lambda d: d["placements"][0]["faces"][3].pop("xf_um"), "placements.0.faces.3.xf_um"),
        (lambda d: d["placements"][0].update(axis=[1.0, 0.0]), "placements.0.axis"),
        (lambda d: d["placements"][0].update(span_mm="410"), "placements.0.span_mm"),
        (lambda d: d.update(placements=[]), "placements"),
    ],
)
def test_a_damaged_evaluation_is_named_by_its_key(tmp_path: Path, change: Any, key: str) -> None:
    data = evaluation_to_dict(one_placement())
    change(data)
    write_json(tmp_path / "evaluation.json", data)
    with pytest.raises(InputError, match=re.escape(f"key {key} ")):
        read_checked_evaluation(tmp_path)


def test_written_evaluations_are_read_by_folder_and_by_file(tmp_path: Path) -> None:
    write_evaluation(tmp_path, with_gaps())
    assert read_checked_evaluation(tmp_path) == read_checked_evaluation(tmp_path / "evaluation.json")


def test_files_of_something_else_are_refused() -> None:
    gauge, machine = shipped()
    data = evaluation_to_dict(one_placement())
    check_gauge(data, gauge)
    check_machine(data, machine)
    check_placements(data, [lay(gauge)], ["p.toml"])
    serial = replace(gauge, table=gauge.table.model_copy(update={"serial": "other"}))
    with pytest.raises(InputError, match=r"serial number; found other; expected SG-420-001"):
        check_gauge(data, serial)
    with pytest.raises(InputError, match="position of face 2"):
        check_gauge(data, replace(gauge, position_mm=gauge.position_mm * (1 + 1e-6)))
    with pytest.raises(InputError, match="not the machine"):
        check_machine(data, replace(machine, table=machine.table.model_copy(update={"name": "Other"})))
    with pytest.raises(InputError, match="another axis"):
        check_placements(data, [lay(gauge, ALONG_X)], ["p.toml"])
    with pytest.raises(InputError, match="one placement file per placement"):
        check_placements(data, [lay(gauge)] * 2, ["p.toml"] * 2)
    wrong = replace(lay(gauge), details={"angles": {"n1_to_axis_mrad": "small"}})
    with pytest.raises(InputError, match=r"angles\.n1_to_axis_mrad"):
        check_placements(data, [wrong], ["p.toml"])


@pytest.mark.parametrize("name", ["report.html.j2", "story.html.j2"])
def test_a_class_of_a_page_has_one_look(name: str) -> None:
    """The star of an interpolated value and the place of an accreditation mark were one: a box in each row of faces."""
    styles = (ROOT / "templates/reports" / name).read_text(encoding="utf-8")
    rules = re.findall(r"^\.(\w+) {", styles, re.M)
    assert rules
    assert len(rules) == len(set(rules))
