"""``stepgauge report`` as a user runs it."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader

from stepgauge.cli import main
from stepgauge.errors import InputError
from stepgauge.evaluation.files import write_evaluation
from stepgauge.gauge.placement import write_placement
from stepgauge.verbs.report import report
from tests.dcc.made import evaluated
from tests.measured import lay, one_placement, shipped

DAY_TO_COME = datetime.date(2999, 1, 1)


@pytest.fixture
def result(tmp_path: Path) -> Path:
    """A folder as evaluate leaves it, with the placement beside it."""
    write_evaluation(tmp_path / "result", one_placement())
    write_placement(tmp_path / "placement.toml", lay(shipped()[0]))
    return tmp_path / "result"


def run(*arguments: object) -> int:
    """Exit code of the command line."""
    try:
        main(["report", *map(str, arguments)])
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def test_everything_stated(result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "new" / "report.pdf"
    code = run(
        result, "-g", "step-gauge-420", "-p", tmp_path / "placement.toml", "-m", "bridge-cmm", "--number", "N-1",
        "--operator", "Op", "--customer", "Cu", "--location", "Lo", "--remarks", "Re", "--date", "2026-03-04",
        "-o", target,
    )  # fmt: skip
    assert code == 0
    assert str(target) in capsys.readouterr().err
    text = "\n".join(page.extract_text() for page in PdfReader(target).pages)
    for word in ("N-1", "Op", "Cu", "Lo", "Re", "2026-03-04", "EXAMPLE-2026-0420", "Bridge CMM"):
        assert word in text


def test_the_budget_that_lies_there_is_in_the_report_and_decides(result: Path, tmp_path: Path) -> None:
    """As the tutorial's page "with an uncertainty" has it: nobody names the budget."""
    report(result, tmp_path / "before.pdf", mpe="30")
    evaluated(1)[1].write(result)
    report(result, tmp_path / "after.pdf", mpe="30")
    pages = [PdfReader(tmp_path / name).pages[0].extract_text() for name in ("before.pdf", "after.pdf")]
    assert ["Measurement uncertainty was not evaluated" in page for page in pages] == [True, False]
    assert ["Undecidable: MPE" in page for page in pages] == [True, True]
    assert "U lacks" in " ".join(pages[1].split())  # the budget of the tests states little


@pytest.mark.parametrize(
    ("day", "message"),
    [
        ("yesterday", "date: not a date; found 'yesterday'"),
        (datetime.datetime(2026, 3, 4, 5), "date: not a date"),
        (DAY_TO_COME, "lies in the future"),
    ],
)
def test_a_date_that_is_none_or_has_not_come(result: Path, tmp_path: Path, day: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        report(result, tmp_path / "r.pdf", date=day)
    assert not (tmp_path / "r.pdf").exists()
    if day == DAY_TO_COME:
        assert run(result, "--date", day, "-o", tmp_path / "r.pdf") == 2


def test_html_from_the_file_itself(result: Path, tmp_path: Path) -> None:
    assert run(result / "evaluation.json", "-o", tmp_path / "report.html") == 0
    assert (tmp_path / "report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_own_template_from_a_copy_of_the_shipped_one(result: Path, tmp_path: Path) -> None:
    from stepgauge.files.resources import folder

    shipped_text = (folder("templates") / "reports" / "report.typ").read_text(encoding="utf-8")
    own = tmp_path / "own.typ"
    own.write_text(shipped_text.replace("#report.result.title", "Our result"), encoding="utf-8")
    assert run(result, "--template", own, "-o", tmp_path / "report.pdf") == 0
    assert "Our result" in PdfReader(tmp_path / "report.pdf").pages[0].extract_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{result}", "-o", "{tmp}/report.docx"], [".docx", ".pdf or .html"]),
        (["{result}/nothing.json", "-o", "{tmp}/report.pdf"], ["nothing.json", "no such file"]),
        (
            ["{result}/evaluation.csv", "-o", "{tmp}/report.pdf"],
            ["evaluation.csv", "is no result", "a folder with evaluation.json"],
        ),
        (["{result}", "-g", "step-gauge-600", "-o", "{tmp}/report.pdf"], ["SG-600", "expected SG-420-001"]),
        (["{result}", "-m", "machining-centre", "-o", "{tmp}/report.pdf"], ["not the machine", "Bridge CMM"]),
        (["{result}", "-p", "{tmp}/placement.toml", "-o", "{tmp}/report.pdf"], ["expected --gauge"]),
        (
            ["{result}", "--date", "4.3.2026", "-o", "{tmp}/report.pdf"],
            ["--date: not a date; found '4.3.2026'"],
        ),
        (["{result}", "--template", "{tmp}/none.typ", "-o", "{tmp}/report.pdf"], ["none.typ", "no such file"]),
    ],
)
def test_wrong_input_is_exit_code_two_and_leaves_nothing(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: list[str]
) -> None:
    assert run(*(text.format(result=result, tmp=tmp_path) for text in arguments)) == 2
    message = capsys.readouterr().err
    assert "Traceback" not in message
    for word in words:
        assert word in message
    assert sorted(path.name for path in tmp_path.iterdir()) == ["placement.toml", "result"]
