"""``stepgauge probe sphere`` and ``iso10360-5`` as a user runs them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pypdf import PdfReader

from stepgauge.conditions.decision import INCOMPLETE
from tests.cli.conftest import Run

SPHERE = ("--sphere-diameter", 25, "--tip-diameter", 5.991)
SURE = ("--sphere-form", 0.1, "--u-sphere-form", 0.03, "--u-sphere-diameter", 0.1)


@pytest.fixture
def points(run: Run, tmp_path: Path) -> Path:
    path = tmp_path / "sphere.csv"
    assert run("probe", "sphere", "omp40-2-50mm", "--sphere-diameter", 25, "-o", path).code == 0
    return path


def text_of(path: Path) -> str:
    return " ".join("\n".join(page.extract_text() for page in PdfReader(path).pages).split())


def test_one_stylus(run: Run, points: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    limits = ("--mpe-form", 12, "--mpe-size", 10, "--another-sphere")
    result = run("test", "iso10360-5", points, *SPHERE, *SURE, *limits, "--number", "N-5", "-o", out)
    assert result.code == 0, result.err
    data = json.loads((out / "iso10360-5.json").read_text())
    assert [one["outcome"] for one in data["values"]] == ["conforms", "conforms"]
    assert len((out / "iso10360-5.csv").read_text().splitlines()) == 26
    text = text_of(out / "iso10360-5.pdf")
    for words in (
        "N-5",
        "ISO 10360-5:2020",
        "The probing performance conforms",
        "Decision rule",
        "Simulated recording",
    ):
        assert words in text
    assert "P_Form" not in text  # set with an index
    assert text.index("Styli") < text.index("name, date, signature")


def test_no_conformity_is_stated_of_a_test_that_is_not_complete(run: Run, tmp_path: Path) -> None:
    """Five styli that all point the same way: small errors prove nothing of the multi-stylus test."""
    points = [tmp_path / f"{n}.csv" for n in range(5)]
    for n, path in enumerate(points):
        assert run("probe", "sphere", "omp40-2-50mm", "--sphere-diameter", 25, "--seed", n, "-o", path).code == 0
    limits = ("--mpe-form", 12, "--mpe-size", 10, "--mpe-location", 8, "--another-sphere")
    result = run("test", "iso10360-5", *points, *SPHERE, *SURE, *limits, "-o", tmp_path / "out")
    assert result.code == 0, result.err
    data = json.loads((tmp_path / "out" / "iso10360-5.json").read_text())
    assert [one["outcome"] for one in data["values"]] == ["conforms"] * 3
    assert data["decision"]["open"] == ["5 styli or ways of one stylus, square to each other"]
    for said in (result.err, data["decision"]["text"], text_of(tmp_path / "out" / "iso10360-5.pdf")):
        assert "performance conforms" not in said
        assert INCOMPLETE in said
        assert "Open: 5 styli or ways of one stylus, square to each other." in said


def test_the_range_of_the_points_is_that_of_the_probe(run: Run, tmp_path: Path) -> None:
    """Without scatter, P_Form of the virtual points is what qualify calls the form error."""
    points = tmp_path / "s.csv"
    run("probe", "sphere", "omp40-2-50mm", "--scatter", 0, "-o", points)
    run("test", "iso10360-5", points, *SPHERE, "-o", tmp_path / "out")
    run("probe", "qualify", points, "--sphere-diameter", 25, "--tip-diameter", 6, "-o", tmp_path / "q.json")
    run("probe", "compensate", points, "-q", tmp_path / "q.json", "-o", tmp_path / "c.csv")
    cells = (points.read_text() + (tmp_path / "c.csv").read_text()).replace("\n", ",").split(",")
    assert "-0.0" not in cells
    assert max(len(cell.partition(".")[2]) for cell in cells if cell.lstrip("-")[:1].isdigit()) <= 7
    form = json.loads((tmp_path / "out" / "iso10360-5.json").read_text())["values"][0]["value_um"]
    assert form == pytest.approx(json.loads((tmp_path / "q.json").read_text())["form_error_um"], abs=1e-3)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("{p}", "--sphere-diameter", 25, "--tip-diameter", 2.99, "-o", "{o}"), ["contradict", "15.49"]),
        (("{p}", "{p}", *SPHERE, "-o", "{o}"), ["the same points"]),
        (("{p}", "--sphere-diameter", 25, "-o", "{o}"), ["--tip-diameter"]),
        (("none.csv", *SPHERE, "-o", "{o}"), ["none.csv", "no such file"]),
    ],
)
def test_wrong_input(run: Run, points: Path, tmp_path: Path, line: tuple, words: list[str]) -> None:
    result = run("test", "iso10360-5", *(str(part).format(p=points, o=tmp_path / "out") for part in line))
    assert result.code == 2
    for word in words:
        assert word in result.err
    assert not (tmp_path / "out").exists()
