"""The page of a diagnosis: what to do first, the findings with their rivals, evidence and appendix, in every format."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader

import stepgauge as sg
from stepgauge.diagnosis.output.files import diagnosis_to_dict
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.diagnosis.wording.notation import probability
from stepgauge.errors import InputError
from stepgauge.files.text import write_json
from stepgauge.reports.diagnosis import diagnosis_story, first_of
from stepgauge.reports.first_steps import MOST_RIVALS, MOST_ROWS
from stepgauge.reports.render import markdown, render_html, render_pdf
from tests.cli.conftest import Run as Command
from tests.cli.conftest import run  # noqa: F401
from tests.diagnosis.made import as_file, made, made_insufficient, made_unknown
from tests.measured import one_placement
from tests.test_report import NASTY, Text

CASES = ("null", "scale", "scale, one placement", "pair", "outliers", "unknown", "insufficient")


def case(name: str) -> GaugeDiagnosis:
    recording, found = {"unknown": made_unknown, "insufficient": made_insufficient}.get(name, lambda: made(name))()
    return replace(found, recordings=(recording,))


def said(name: str) -> dict[str, Any]:
    found = case(name)
    return diagnosis_to_dict(found)


def pages(pdf: bytes) -> list[str]:
    return [page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages]


@pytest.mark.parametrize("name", CASES)
def test_the_first_page_has_what_to_do_and_what_was_found(name: str, tmp_path: Path) -> None:
    """Headline, steps, findings and a figure on one page; the evidence begins the next one."""
    sg.report(case(name), tmp_path / "story.pdf")
    first, second, *_ = pages((tmp_path / "story.pdf").read_bytes())
    for title in ("Verdict:", "What to do first", "What was found", "Residuals before and after"):
        assert title in first
    assert "Evidence" not in first
    assert second.split("not a real calibration", 1)[-1].lstrip().startswith("Evidence")


@pytest.mark.parametrize("name", ["scale, one placement", "pair"])
def test_every_format_says_the_same_in_the_same_order(name: str) -> None:
    content = diagnosis_story(said(name))
    order = ("What to do first", "Check", "Repair", "Measure again", "What was found", "Evidence", "Appendix")
    html = " ".join(Text(render_html(content).data).words)
    for text in (markdown(content), "\n".join(pages(render_pdf(content).data)), html):
        places = [text.index(word) for word in order]
        assert places == sorted(places)
    for effect in said(name)["effects"]:
        for one in effect["set"] or [effect]:
            assert one["meaning"] in markdown(content)


def test_rivals_have_their_own_probability_and_add_up() -> None:
    (effect,) = said("scale, one placement")["effects"]
    whole = markdown(diagnosis_story(said("scale, one placement")))
    first = whole.split("## Evidence")[0]
    rows = [line.split(" | ") for line in first.splitlines() if re.match(r"\| (\d+|or) \|", line)]
    shown = effect["set"][: 1 + MOST_RIVALS]
    assert [row[4] for row in rows] == [
        probability(one["conditional_probability"] * effect["probability"]) for one in shown
    ]
    assert (f"Further rivals, in the appendix: {len(effect['set']) - len(shown)}." in first) is (effect["set"] != shown)
    assert sum(one["conditional_probability"] for one in effect["set"]) == pytest.approx(1.0)
    first_of_it = probability(effect["set"][0]["conditional_probability"] * effect["probability"])
    assert f"that it is one of the set, {first_of_it} that it is the first of it" in whole
    assert len({row[2] for row in rows}) == len(rows)


def test_what_two_laws_may_do_together_has_the_rest_of_the_probability() -> None:
    found = case("scale")
    (one,) = found.findings
    alone = replace(one, probability=0.98, own=0.69, members=(), confounded_with=("squareness + reversal_error",))
    text = markdown(diagnosis_story(diagnosis_to_dict(replace(found, findings=(alone,)))))
    first = text.split("## Evidence")[0]
    rows = [line.split(" | ") for line in first.splitlines() if line.startswith(("| 1 |", "| or |"))]
    assert [row[1] for row in rows] == ["scale error x", "others"]
    assert rows[1][5].startswith("reversal error + squareness: in place of this finding")
    assert [row[4] for row in rows] == ["0.69", "0.29"]
    assert "0.98 that it is one of the set, 0.69 that it is the first of it" in text


def test_nothing_is_repaired_while_a_finding_has_rivals() -> None:
    steps = first_of(said("scale, one placement"))
    assert [line for line in steps if line.startswith("repair: ")] == [
        "repair: 1: Nothing yet: the checks tell first which of the causes of a finding it is."
    ]
    assert steps[-1].startswith("stepgauge plan ")
    sure = first_of(said("outliers"))
    assert "repair: 1: Measure these points again." in sure


def test_a_structure_without_a_law_is_not_adjusted() -> None:
    data = said("unknown")
    data["unexplained"] = [{**data["unexplained"][0], "covariate": "time", "form": "smooth", "beside": "position"}]
    steps = first_of(data)
    assert "check: 1: Look for what changes with time and position." in steps
    assert any(line.startswith("repair: 1: Nothing: do not adjust") for line in steps)


@pytest.mark.parametrize("form", ["wave", "sawtooth"])
def test_of_what_is_periodic_without_a_law_the_period_is_to_be_looked_for(form: str) -> None:
    data = said("unknown")
    data["unexplained"] = [{**data["unexplained"][0], "covariate": "time", "form": form}]
    (check,) = (line for line in first_of(data) if line.startswith("check: "))
    assert "repeats with time in this period" in check
    assert "thermostat" in check


def test_an_insufficient_recording_says_what_to_measure_and_an_adequate_one_to_stop() -> None:
    assert first_of(said("insufficient")) == [
        "measure again: more cycles: too few repeats to separate noise from structure"
    ]
    (line,) = first_of(said("null"))
    assert line.startswith("good enough: Stop. What may remain (k = 2): tip correction ± 0.")


def test_the_table_stays_short_and_names_what_it_leaves_out() -> None:
    data = said("scale, one placement")
    (effect,) = data["effects"]
    data["effects"] = [effect] * 5
    first = markdown(diagnosis_story(data)).split("## Evidence")[0]
    rows = [line for line in first.splitlines() if re.match(r"\| (\d+|or) \|", line)]
    assert len(rows) <= MOST_ROWS + 2
    assert f"Further rivals, in the appendix: {5 * (len(effect['set']) - 1) - (len(rows) - 5)}." in first


def test_every_structure_without_a_law_has_a_number_of_its_own() -> None:
    data = said("unknown")
    first = {**data["unexplained"][0], "form": "smooth"}
    data["unexplained"] = [{**first, "covariate": name} for name in ("pair", "temperature")]
    numbered = len(data["effects"]) + 1
    steps = [line for line in first_of(data) if "Look for what changes with" in line or "Nothing: do not" in line]
    assert [line.split(": ")[1] for line in steps] == [f"{numbered}", f"{numbered + 1}", f"{numbered}, {numbered + 1}"]
    page = markdown(diagnosis_story(data))
    for number, name in enumerate(("pair", "temperature"), numbered):
        assert f"| {number} | structure without a known law: {name} |" in page


def test_page_1_warns_where_named_effects_make_the_residuals_no_smaller() -> None:
    data = said("scale")
    assert diagnosis_story(data)["warnings"] == ["Simulated recording: no machine was measured."]
    data["fit"] |= {"rms_before_um": 0.674, "rms_after_um": 0.759}
    first = markdown(diagnosis_story(data)).split("## Evidence")[0]
    assert "0.759 um rms of 0.674 um: do not enter their values" in first
    repairs = [line for line in first_of(data) if line.startswith("repair: ")]
    assert repairs == [
        "repair: 1: Nothing: alone, without what has no known law, the named effects do not explain the readings."
    ]


def test_a_page_is_set_in_print_and_what_is_copied_from_it_is_not() -> None:
    data = said("scale")
    page = render_html(diagnosis_story(data)).data.decode()
    size = data["effects"][0]["parameters"]["ppm"]["value"]
    assert f"{size:.1f} µm/m".replace("-", "−") in page
    assert not re.search(r"\d um\b", re.sub(r"<(pre|script)\b.*?</\1>", "", page, flags=re.S))


def test_names_are_text_in_every_format() -> None:
    text = " ".join(NASTY)
    data = said("scale")
    data["inputs"]["machine"]["name"] = text
    data["effects"][0]["meaning"] = text
    content = diagnosis_story(data)
    html = render_html(content).data
    assert "script" not in Text(html).tags
    assert text in " ".join(Text(html).words)
    squeezed = re.sub(r"\s", "", "".join(pages(render_pdf(content).data)))
    assert re.sub(r"\s", "", text) in squeezed


def test_a_folder_is_reported_with_its_figures(run: Command, tmp_path: Path) -> None:  # noqa: F811
    found = case("scale")
    as_file(tmp_path, found.recordings[0])
    for figure in ("png", "svg"):
        found.write(tmp_path / figure, figure)
        done = run("report", tmp_path / figure, "-o", tmp_path / f"{figure}.html")
        assert done.code == 0, done.err
        page = Text((tmp_path / f"{figure}.html").read_bytes())
        assert len(page.images) == 3
        assert all(one.startswith("data:image/svg+xml;base64,") for one in page.images)
    done = run("report", tmp_path / "png" / "diagnosis.json", "-o", tmp_path / "story.pdf")
    assert done.code == 0, done.err
    pdf = PdfReader(tmp_path / "story.pdf")
    assert json.loads(pdf.attachments["diagnosis.json"][0])["verdict"] == "effects"


def test_what_is_no_diagnosis_or_was_changed_is_refused(run: Command, tmp_path: Path) -> None:  # noqa: F811
    case("null").write(tmp_path / "d")
    path, out = tmp_path / "d" / "diagnosis.json", tmp_path / "x.pdf"
    path.write_text(path.read_text("utf-8").replace('"verdict": "adequate"', '"verdict": "unknown"'), "utf-8")
    done = run("report", tmp_path / "d", "-o", out)
    assert done.code == 2
    assert "was changed after it was written" in done.err
    one_placement().write(tmp_path / "both")
    case("null").write(tmp_path / "both")
    done = run("report", tmp_path / "both", "-o", out)
    assert done.code == 2
    assert "holds an evaluation and a diagnosis" in done.err
    done = run("report", tmp_path, "-o", out)
    assert done.code == 2
    assert "holds no result" in done.err
    assert not out.exists()


def test_what_only_a_signed_report_prints_is_refused_for_a_diagnosis(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="number"):
        sg.report(case("null"), tmp_path / "x.pdf", number="N-1")
    write_json(tmp_path / "diagnosis.json", said("null"))
    sg.report(tmp_path, tmp_path / "x.pdf")
    assert (tmp_path / "x.pdf").stat().st_size > 5000
