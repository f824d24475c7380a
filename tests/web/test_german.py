"""Pages in German as a technician meets them, with what goes wrong: no English word is left over."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from stepgauge.evaluation.evaluate import evaluate
from stepgauge.recording import read_recording
from stepgauge.web.pages import certificate, gauge, history, importing, locate, machine, plan, project, result
from tests.conftest import ROOT
from tests.dcc.made import one_recording
from tests.measured import lay, shipped
from tests.web.conftest import Asked, make_project
from tests.web.gathered import english_words, visible

CERTIFICATE = "Fläche\tNennmaß mm\tAbweichung µm\tU µm\n" + "".join(
    f"{n + 1}\t{10 * n},000\t{0.1 * (n % 3):.2f}\t0,25\n".replace(".", ",") for n in range(6)
)
READINGS = "Zyklus;Flaeche;Nennmass;Messwert;Abweichung\n" + "".join(
    f"{cycle};{n + 1};{10 * n},0000;{10 * n + 1e-4 * cycle:.4f};{1e-4 * cycle:.4f}\n".replace(".", ",")
    for cycle in (1, 2)
    for n in range(6)
)
POINTS = (ROOT / "examples/demo/points.csv").read_text("utf-8")


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Asked:
    """A German page of a project with a placement, a recording and an evaluation."""
    folder = make_project(tmp_path / "Projekt")
    monkeypatch.chdir(folder)
    lay(shipped()[0]).write(folder / "placement.toml")
    one_recording().assign_comments(measured_at="2026-05-04").write(folder / "recordings/one.csv")
    measured = read_recording(folder / "recordings/one.csv")
    evaluate(measured, shipped()[0]).write(folder / "results/evaluation")
    return Asked(folder, "de")


def left_over(page: str) -> list[tuple[str, list[str]]]:
    """The texts of a page with English words."""
    named = re.compile(
        "|".join((*(one.table.name for one in shipped()), "bridge-cmm", "EXAMPLE", "Start", "bridge cmm"))
    )
    found = ((one, english_words(named.sub("", one), names=True)) for one in visible(page))
    return [(one, words) for one, words in found if words]


@pytest.mark.parametrize(
    "show",
    [
        *(project.show, project.status, gauge.show, machine.show, locate.show, plan.show, importing.show),
        *(result.show, result.errors, result.probings, history.show, history.part, certificate.show),
    ],
    ids=lambda one: f"{one.__module__.rpartition('.')[2]}.{one.__name__}",
)
def test_a_page_is_german(asked: Asked, show: Callable[..., Any]) -> None:
    query = {"evaluation": "results/evaluation"} if show in (result.errors, result.probings) else {}
    assert left_over(asked.get(show, **query)) == []


@pytest.mark.parametrize(
    ("before", "after"),
    [
        *(
            ("", ""),
            ("µm", "mm"),
            (" µm", ""),
            ("0,25", "x"),
            ("20,000", "a"),
            ("U µm", "Abweichung"),
            ("0,10", "0.10"),
        ),
        *(("20,000", "120,000"), ("3\t20", "5\t20"), ("Nennmaß", "Abweichung"), ("\t0,25", ""), ("0,20", "22,0")),
    ],
)
def test_what_is_wrong_with_a_certificate_is_german(asked: Asked, before: str, after: str) -> None:
    table = CERTIFICATE.replace(before, after) if before else CERTIFICATE
    assert left_over(asked.post(gauge.check, {"table": table})) == []


def wrong_points() -> Iterator[str]:
    rows = POINTS.splitlines()
    yield POINTS
    yield "\n".join(rows[:9])
    yield "\n".join([*rows[:3], rows[3].replace(",", ",9", 2), *rows[4:]])
    yield POINTS.replace("x_mm,y_mm", "y_mm,x_mm")
    yield "\n".join([rows[0], *(row.replace(".", "x", 1) for row in rows[1:])])


@pytest.mark.parametrize("points", list(wrong_points()))
def test_what_is_wrong_with_points_is_german(asked: Asked, points: str) -> None:
    assert left_over(asked.post(locate.locate, {"pasted": points})) == []


@pytest.mark.parametrize("sensor", ["gauge", "laser", "dial", "autocollimator"])
@pytest.mark.parametrize(
    ("before", "after"),
    [
        *(("", ""), ("30,0001", "3,0001"), ("30,0001", "30,0001x"), ("Messwert", "Ist / um"), ("Nennmass", "A")),
        *(("Abweichung", "Abw (um)"), ("1;3;20,0000;20,0001;0,0001\n", ""), (";Abweichung", ";Abweichung [arcsec]")),
    ],
)
def test_what_an_import_takes_and_asks_is_german(asked: Asked, sensor: str, before: str, after: str) -> None:
    table = READINGS.replace(before, after) if before else READINGS
    for answer in ("", "sensor=touch", "columns=reading=Messwert"):
        page = asked.post(importing.look, {"pasted": table, "sensor": sensor, "answer": answer})
        assert left_over(page) == [], answer


@pytest.mark.parametrize("figure", [locate.scene, result.errors_chart, result.probings_json, history.chart])
def test_a_figure_is_german(asked: Asked, figure: Callable[..., Any]) -> None:
    query = {} if figure in (locate.scene, history.chart) else {"evaluation": "results/evaluation"}
    said = [one for one in texts_of(json.loads(asked.get(figure, **query))) if not one.startswith("--")]
    assert said
    assert [one for one in said if english_words(one)] == []


def texts_of(part: Any) -> Iterator[str]:
    """Names, titles and texts of a figure."""
    if isinstance(part, dict):
        for key, value in part.items():
            if key in ("name", "text", "title", "hovertemplate") and isinstance(value, str):
                yield value
            yield from texts_of(value)
    elif isinstance(part, list):
        for one in part:
            yield from texts_of(one)
