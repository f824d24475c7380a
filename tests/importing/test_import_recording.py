"""One function for paths, open files and DataFrames: what was taken, what was not, and what is open, as choices."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.errors import option_of
from stepgauge.importing.tables.questions import Question, QuestionAnswer
from tests.conftest import ROOT
from tests.shell import blocks_of

TARGETS = np.arange(0.0, 401.0, 50.0)
READINGS = TARGETS + 1e-3 * np.sin(TARGETS)
FRAME = pd.DataFrame({"Target [mm]": TARGETS, "Commanded [mm]": TARGETS + 0.5, "Measured": READINGS, "Note": "x"})


def answered(questions: tuple[Question, ...], **options: object) -> dict[str, object]:
    """The options with the first choice of every question: lists grow, a value that a person states is suggested."""
    for choice in (one.choices[0] for one in questions):
        value = choice.value or choice.suggestions[0]
        if choice.argument in ("columns", "rows", "accept"):
            options[choice.argument] = [*options.get(choice.argument, []), value]  # type: ignore[misc, attr-defined]
        else:
            options[choice.argument] = value
    return options


def test_the_page_on_import() -> None:
    """docs/import.md"""
    (block,) = [one for one in blocks_of(ROOT / "docs/import.md") if one.language == "python"]
    names: dict[str, object] = {}
    exec(compile(block.text, "import.md", "exec"), names)
    assert isinstance(names["found"], sg.Imported)
    assert names["found"].recording is not None


@pytest.mark.parametrize("kind", ["frame", "text", "bytes", "path"])
def test_questions_are_choices_that_settle(tmp_path: Path, kind: str) -> None:
    text = FRAME.to_csv(index=False)
    (tmp_path / "t.csv").write_text(text)
    given = {"frame": lambda: FRAME, "text": lambda: io.StringIO(text), "bytes": lambda: io.BytesIO(text.encode())}
    source = given.get(kind, lambda: tmp_path / "t.csv")
    found = sg.import_recording(source(), sensor="laser")
    assert found.recording is None
    assert [one.taken for one in found.columns] == ["target", "covariate", "reading", "dropped"]
    assert [float(one) for one in found.columns[0].cells[:2]] == [0.0, 50.0]
    (question,) = found.questions
    assert [one.value for one in question.choices] == ["target=Target [mm]", "target=Commanded [mm]"]
    with pytest.raises(sg.InputError, match="several columns may be the target"):
        found.settled()
    options = answered(found.questions)
    found = sg.import_recording(source(), sensor="laser", **options)  # type: ignore[arg-type]
    assert isinstance(found.settled(), sg.AxisRecording)
    np.testing.assert_allclose(found.settled().frame["reading"], READINGS, atol=1e-9)
    assert found.questions == ()
    assert "covariate" in found.to_frame()["taken for"].tolist()
    found.write(tmp_path / "axis.csv")
    assert len(sg.read_axis_recording(tmp_path / "axis.csv")) == 9


def test_a_table_without_x_y_z_asks_what_read_it() -> None:
    found = sg.import_recording(FRAME.drop(columns="Commanded [mm]"))
    assert found.recording is None
    assert found.columns
    choices = [choice for one in found.questions for choice in one.choices]
    assert {"columns", "sensor"} == {one.argument for one in choices}
    assert "laser" in next(one for one in choices if one.argument == "sensor").suggestions


def test_times_without_a_unit_are_asked_and_the_choice_counts() -> None:
    frame = pd.DataFrame({"Time": np.arange(30.0), "Reading [um]": np.sin(np.arange(30.0))})
    found = sg.import_recording(frame, sensor="inductive")
    (question,) = found.questions
    assert [one.value for one in question.choices][:4] == ["s", "ms", "min", "h"]
    for choice, last in zip(question.choices, (29.0, 0.029, 1740.0, 104400.0), strict=False):
        back = sg.import_recording(frame, sensor="inductive", time_unit=choice.value).settled()
        assert back.frame["time_s"].iloc[-1] == pytest.approx(last)
    without = sg.import_recording(frame, sensor="inductive", columns=[question.choices[4].value]).settled()
    assert "time_s" not in without.frame


def test_what_is_missing_may_be_accepted_as_a_choice() -> None:
    frame = FRAME.drop(columns="Commanded [mm]").assign(Measured=[*READINGS[:-1], np.nan])
    found = sg.import_recording(frame, sensor="laser")
    assert QuestionAnswer("accept", "missing") in [one for question in found.questions for one in question.choices]
    assert len(sg.import_recording(frame, sensor="laser", accept=["missing"]).settled()) == 8


def test_what_no_choice_settles_is_an_error() -> None:
    with pytest.raises(sg.InputError, match="empty"):
        sg.import_recording(io.StringIO(""), sensor="laser")


def test_the_options_of_choices_are_those_of_the_command() -> None:
    assert [option_of(one) for one in ("columns", "time_unit", "deviation_unit")] == [
        "--column",
        "--time-unit",
        "--deviation-unit",
    ]
