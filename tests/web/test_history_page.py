"""History on the page: a measurement counts once, and one date has no trend."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import stepgauge as sg
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.recording import Recording
from stepgauge.web.pages import history, locate, run
from tests.dcc.made import one_recording
from tests.measured import shipped
from tests.web.conftest import Asked, make_project


def measured(folder: Path, name: str, day: str, *results: str) -> None:
    said = {**one_recording().comments, "measured_at": f"{day}T10:00:00", "run": name}
    replace(one_recording(), comments=said).write(folder / f"recordings/{name}.csv")
    recording = sg.read_recording(folder / f"recordings/{name}.csv")
    for result in results:
        evaluate(recording, sg.read_gauge(folder / "gauge/step-gauge-420.toml")).write(folder / "results" / result)


def test_the_same_measurement_counts_once_and_two_dates_have_no_trend(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make_project(tmp_path / "project")
    monkeypatch.chdir(folder)
    measured(folder, "a", "2026-05-04", "evaluation", "evaluation-a")
    shown = Asked(folder).get(history.part)
    assert shown.count('<td class="date">2026-05-04</td>') == 1
    assert "One or two days are no trend yet" in shown
    assert "nothing drifts" not in shown
    assert "counted once" in shown
    measured(folder, "b", "2026-06-04", "evaluation-b")
    shown = Asked(folder).get(history.part)
    assert shown.count('<td class="date">') == 2
    assert "no trend yet" in shown
    measured(folder, "c", "2026-07-04", "evaluation-c")
    assert "no trend yet" not in Asked(folder).get(history.part)


def test_fields_show_what_holds_where_they_are_empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = make_project(tmp_path / "project")
    monkeypatch.chdir(folder)
    assert 'placeholder="1:21"' in Asked(folder).get(locate.show)
    (folder / "placement.toml").write_text("c1_mm = [0, 0, 0]")
    path = folder / "stepgauge.toml"
    path.write_text(path.read_text("utf-8") + "\n[plan]\ncycles = 3\n", "utf-8")
    assert "3; of a program: its own" in Asked(folder).get(run.show)


def test_what_is_left_out_is_told_with_its_reason_and_where_it_is_stated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One evaluation alone, of a warm gauge whose readings nobody said to be corrected, has a date, and no place."""
    folder = make_project(tmp_path / "project")
    monkeypatch.chdir(folder)
    recording = one_recording()
    comments = {key: text for key, text in recording.comments.items() if key != "temperature_convention"}
    warm = Recording(recording.frame.assign(gauge_temperature_C=24.0), {**comments, "measured_at": "2026-05-04"})
    evaluate(warm, shipped()[0]).write(folder / "results/warm")
    shown = Asked(folder, "de").get(history.show)
    assert "Ausgelassen (1)" in shown
    assert "das Stufenendmaß hatte 24,00 °C, und nirgends ist angegeben" in shown
    assert 'href="/machine"' in shown
    assert "braucht Auswertungen mit Datum" not in shown
    measured(folder, "a", "2026-05-05", "evaluation")
    assert Asked(folder, "de").get(history.part).count("nirgends ist angegeben") == 1
