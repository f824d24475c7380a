"""What somebody else wrote ends within its budget, with one line, and reads nothing but what it is given."""

from __future__ import annotations

import os
import resource
import time
from pathlib import Path
from typing import Any

import pytest

from stepgauge.cli import cli, main
from stepgauge.errors import InputError
from stepgauge.files.resource_limits import ResourceLimits, within, work_within
from stepgauge.fleet.query import query
from stepgauge.reports.render import render_html, render_pdf
from tests.conftest import ROOT
from tests.fleet.made import make_fleet

CONTENT = {"title": "Report", "layout": "report"}
ENDLESS = "{{ report.title }}" + 2 * "{% for i in range(99999) %}" + "{% set k = i %}" + 2 * "{% endfor %}"
GREEDY = "{{ report.title }}{{ (report.title * 99999999)|length }}{{ ((report.title * 99999999) ~ 'x')|upper|length }}"


def shout(given: dict[str, Any]) -> bytes:
    """A function in a process of its own, that also prints."""
    print("noise")
    os.write(1, b"more noise")
    return str(given["text"]).upper().encode()


def fail(given: dict[str, Any]) -> bytes:
    raise InputError(given["where"], "it is wrong", found=1, expected="two")


def crash(given: dict[str, Any]) -> bytes:
    raise ZeroDivisionError(given["where"])


def write(given: dict[str, Any]) -> bytes:
    with open(given["path"], "w") as file:
        file.write("x")
    return b"written"


def grow(given: dict[str, Any]) -> bytes:
    return b"x" * int(given["bytes"])


def run_on(given: dict[str, Any]) -> bytes:
    while True:
        given["n"] = given.get("n", 0) + 1


SMALL = ResourceLimits(1.0, 300.0, "this work")


def test_what_a_function_gives_comes_back_and_what_it_prints_does_not() -> None:
    assert work_within(SMALL, shout, {"text": "grüße"}, "here") == "GRÜSSE".encode()


def test_errors_come_back_as_they_are_and_any_other_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^x\.csv: it is wrong; found 1; expected two$"):
        work_within(SMALL, fail, {"where": "x.csv"}, "here")
    with pytest.raises(InputError, match=r"^here: this work: ZeroDivisionError: x$"):
        work_within(SMALL, crash, {"where": "x"}, "here")
    with pytest.raises(InputError, match="this work: OSError"):
        work_within(SMALL, write, {"path": str(tmp_path / "a")}, "here")


@pytest.mark.parametrize(("function", "given"), [(run_on, {}), (grow, {"bytes": 10**9})])
def test_time_and_memory_end(function: Any, given: dict[str, Any]) -> None:
    expected = (
        r"^here: this work: it did not come to an end; expected at most 1 s of processor time and 300 MB of memory$"
    )
    with pytest.raises(InputError, match=expected):
        work_within(SMALL, function, given, "here")


@pytest.mark.parametrize("text", [ENDLESS, GREEDY])
def test_a_report_template_in_html_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setattr("stepgauge.reports.render.HTML_BUDGET", (0.5, 300.0))
    (tmp_path / "own.html.j2").write_text(text)
    with pytest.raises(InputError, match=r"own\.html\.j2.*(did not come to an end|too large|memory)"):
        render_html(CONTENT, tmp_path / "own.html.j2")


def test_a_report_template_in_html_that_is_well_gives_its_page(tmp_path: Path) -> None:
    (tmp_path / "own.html.j2").write_text("<p>{{ report.title }} {{ 'R_eff < 2'|symbols }}</p>")
    page = render_html({**CONTENT, "title": "A & B"}, tmp_path / "own.html.j2").data
    assert page == b"<p>A &amp; B R<sub>eff</sub> &lt; 2</p>"


def typst(place: Path, text: str) -> Path:
    """A template that uses what it is given, in a folder of its own."""
    place.mkdir(exist_ok=True)
    (place / "own.typ").write_text("#let report = json(bytes(sys.inputs.report))\n#report.title\n" + text)
    return place / "own.typ"


@pytest.mark.parametrize(
    "text",
    [
        "#let n = 0\n#while true { n = n + 1; if n < 0 { break } }",
        "#let f(n) = if n < 2 { 1 } else { f(n - 1) + f(n - 2) }\n#f(99)",
        '#let t = "x" * 4000000\n#let all = range(9999).map(n => t + str(n))\n#all.len()',
    ],
)
def test_a_report_template_of_typst_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setattr("stepgauge.reports.render.PDF_BUDGET", (1.0, 900.0))
    with pytest.raises(InputError, match=r"own\.typ: template: "):
        render_pdf(CONTENT, typst(tmp_path, text))


def test_a_report_template_of_typst_has_what_it_names_beside_it(tmp_path: Path) -> None:
    own = typst(tmp_path / "a", '#import "parts/head.typ": head\n#head\n#image("logo.svg", width: 1cm)')
    (tmp_path / "a/parts").mkdir()
    (tmp_path / "a/parts/head.typ").write_text('#let head = image("../logo.svg")\n')
    (tmp_path / "a/logo.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>')
    assert render_pdf(CONTENT, own).data.startswith(b"%PDF")


@pytest.mark.parametrize(
    "text",
    [
        '#read("secret.csv")',
        '#read("link.svg")',
        '#image("link.svg")',
        '#import "link.typ": secret\n#secret',
        '#read("../secret.csv")',
        '#read("deep/secret.svg")',
        '#read("li" + "nk.svg")',
        '#read("/etc/passwd")',
        '#import "@pre" + "view/cetz:0.3.0"',
        '#import "part.typ"',
    ],
)
def test_a_report_template_of_typst_reads_nothing_else(tmp_path: Path, text: str) -> None:
    own = typst(tmp_path / "a", text)
    for place in (tmp_path / "secret.csv", tmp_path / "a/secret.csv"):
        place.write_text("secret")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/secret.svg").write_text("<svg/>")
    (tmp_path / "a/part.typ").write_text('#import "@preview/cetz:0.3.0"\n')
    os.symlink(tmp_path / "secret.csv", tmp_path / "a/link.svg")
    os.symlink(tmp_path / "secret.csv", tmp_path / "a/link.typ")
    os.symlink(tmp_path / "elsewhere", tmp_path / "a/deep")
    with pytest.raises(InputError, match=r"own\.typ|part\.typ"):
        render_pdf(CONTENT, own)


@pytest.mark.parametrize(
    "sql",
    [
        "SELECT sum(range) FROM range(100000000000)",
        "SELECT range FROM range(100000000000)",
        "WITH RECURSIVE t(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM t) SELECT max(n) FROM t",
        "SELECT length(repeat('x', 2000000000) || 'y')",
    ],
)
def test_a_question_ends(fleet: Any, monkeypatch: pytest.MonkeyPatch, sql: str) -> None:
    monkeypatch.setattr("stepgauge.fleet.query.SECONDS", 1.0)
    monkeypatch.setattr("stepgauge.fleet.query.MEMORY_MB", 600.0)
    began = time.monotonic()
    with pytest.raises(InputError, match=r"^SQL: "):
        query(fleet, sql)
    assert time.monotonic() - began < 60.0


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return make_fleet(tmp_path_factory.mktemp("budget") / "fleet", 2, 1)


def test_the_reading_of_a_file_in_this_process_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """A verb's own process gets the budget; afterwards it is as it was."""
    limits = resource.getrlimit(resource.RLIMIT_CPU), resource.getrlimit(resource.RLIMIT_DATA)
    said = r"^a.csv: this file: it did not come to an end; expected at most 0 s"
    with pytest.raises(InputError, match=said), within(ResourceLimits(0.0, 10**6, "this file"), "a.csv"):
        run_on({})
    with (
        pytest.raises(InputError, match="did not come to an end"),
        within(ResourceLimits(60.0, 1.0, "this file"), "a.csv"),
    ):
        grow({"bytes": 10**9})
    assert (resource.getrlimit(resource.RLIMIT_CPU), resource.getrlimit(resource.RLIMIT_DATA)) == limits


@pytest.mark.parametrize("verb", ["import", "locate"])
def test_a_verb_that_reads_a_foreign_file_has_a_budget(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    monkeypatch.setattr("stepgauge.files.resource_limits.FILE_SECONDS", -1.0)
    monkeypatch.setattr("stepgauge.importing.recorded.import_asked", lambda *_, **__: run_on({}))
    monkeypatch.setattr("stepgauge.alignment.locate", lambda *_, **__: run_on({}))
    points = (ROOT / "examples/demo/points.csv").read_text()
    (tmp_path / "log.csv").write_text("a,b\n1,2\n" if verb == "import" else points)
    monkeypatch.setattr("sys.argv", ["stepgauge", verb, str(tmp_path / "log.csv"), "-g", "step-gauge-420", "-o", "x"])
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert (ended.value.code, len(said.splitlines())) == (2, 1)
    assert "log.csv: this file: it did not come to an end" in said


@pytest.mark.parametrize("place", ["header", "cell"])
def test_a_cell_that_is_too_long_for_the_reader_is_one_line(tmp_path: Path, place: str) -> None:
    long = "1" * 140_000
    text = f"time_s,{long}\n0,1\n1,2\n" if place == "header" else f"time_s,reading_mm\n0,{long}\n1,2\n"
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(InputError, match=r"log\.csv.*: "):
        stepgauge_import(tmp_path / "log.csv", "--sensor", "laser", "-o", tmp_path / "axis.csv")


def stepgauge_import(*words: object) -> None:
    cli.main(args=["import", *map(str, words)], prog_name="stepgauge", standalone_mode=False)
