"""Headings of blocks, and columns that may be of several roles, as files of other people have them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import openpyxl
import pytest

import stepgauge as sg
from stepgauge.axis.recording import AxisRecording
from stepgauge.errors import InputError
from stepgauge.importing.result import Imported
from stepgauge.importing.tables.vocabulary import title_label
from tests.cli.conftest import Run

RULE = "--- | ---\n"
ROWS = [(0, 0.0012, -0.0012), (10, 10.0013, 9.9988), (20, 20.0012, 19.9987)]


def blocks(first: str, second: str, rule: str = RULE) -> str:
    """Two blocks of targets that rise, each below a line."""
    out = "".join(f"{target} | {up}\n" for target, up, _ in ROWS)
    back = "".join(f"{target} | {down}\n" for target, _, down in ROWS)
    head = f"\n\nTarget [mm] | Reading [mm]\n{rule}"
    return f"{first}{head}{out}\n{second}{head}{back}"


def imported(folder: Path, text: str, **given: object) -> Imported:
    path = folder / "table.md"
    path.write_text(text)
    return sg.import_recording(path, sensor="laser", **given)  # type: ignore[arg-type]


def read(folder: Path, text: str, **given: object) -> AxisRecording:
    found = imported(folder, text, **given).settled()
    assert isinstance(found, AxisRecording)
    return found


def asked(folder: Path, text: str, **given: object) -> list[str]:
    """The values that settle the first question."""
    return [one.value for one in imported(folder, text, **given).questions[0].choices]


@pytest.mark.parametrize("mark", ["", "# ", "## ", "// ", "% "])
@pytest.mark.parametrize("words", ["{} test sequence", "{}", "Data {} direction", "Run 1 {}", "ILD2300, {} direction"])
def test_a_comment_that_says_a_direction_is_the_heading_of_its_block(tmp_path: Path, mark: str, words: str) -> None:
    found = read(tmp_path, blocks(mark + words.format("Forward"), mark + words.format("Backward")))
    assert found.frame["way"].tolist() == [1, 1, 1, -1, -1, -1]
    assert found.frame["cycle"].unique().tolist() == [1]
    assert "direction stated" in found.comments["import"]
    assert "dropped" not in found.comments["import"]


def test_a_comment_in_a_workbook_is_a_heading(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    for title, place in (("# Forward", 1), ("# Backward", 2)):
        book.active.append([title])
        book.active.append(["Target [mm]", "Reading [mm]"])
        for row in ROWS:
            book.active.append([row[0], row[place]])
    book.save(tmp_path / "table.xlsx")
    found = sg.import_recording(tmp_path / "table.xlsx", sensor="laser").settled()
    assert found.frame["way"].tolist() == [1, 1, 1, -1, -1, -1]


def test_comments_that_say_no_run_stay_comments(tmp_path: Path) -> None:
    found = read(tmp_path, blocks("# Forward and backward deviations", "# Laser 2, warm"))
    assert "direction from the order of the targets" in found.comments["import"]
    assert title_label("Forward and backward").way == 0


@pytest.mark.parametrize("titles", [("# Run 1", "# Backward"), ("# Forward", "# Forward")])
def test_headings_that_contradict_the_order_or_one_another_are_asked(tmp_path: Path, titles: tuple[str, str]) -> None:
    text = blocks(*titles)
    if titles[0] == titles[1]:  # the way back falls, and is said to be forward
        head, back = text.rsplit("\n0 |", 1)
        text = head + "\n" + "".join(f"{row}\n" for row in reversed(f"0 |{back}".splitlines()))
    assert asked(tmp_path, text) == ["title=*", "ignore=title"]
    assert "direction from" in read(tmp_path, text, columns=["ignore=title"]).comments["import"]
    if titles[0] == titles[1]:
        assert set(read(tmp_path, text, rows=["title=*"]).frame["way"]) == {1}


@pytest.mark.parametrize("first", ["", "No,", "Sample,"])
def test_targets_that_name_the_columns_are_targets(tmp_path: Path, first: str) -> None:
    rows = ["2.67,29.24,58.55", "2.57,28.78,58.53", "2.67,29.16,58.43"]
    lines = [f"{n},{row}" if first else row for n, row in enumerate(rows, 1)]
    found = read(tmp_path, "\n".join([f"{first}2 cm,30cm,60 cm", *lines]))
    assert found.frame["target"].tolist() == [2, 30, 60] * 3
    assert found.frame["cycle"].tolist() == [1, 1, 1, 2, 2, 2, 3, 3, 3]


def test_targets_beside_another_column_are_no_cycles_of_one_spot(tmp_path: Path) -> None:
    found = imported(
        tmp_path, "Level,2 cm,30 cm,60 cm\n7.5,2.67,29.24,58.55\n7.1,2.57,28.78,58.53\n7.9,2.6,29.1,58.4\n"
    )
    assert found.questions


def test_two_columns_that_may_be_the_target_are_both_offered(tmp_path: Path) -> None:
    rows = "0,0.001,1\n10,10.001,1\n20,20.002,2\n"
    for name in ("Tgt_pos", "Stage"):
        text = f"{name} [mm],Reference [mm],dev (diff ref-tgt) [um]\n{rows}"
        assert set(asked(tmp_path, text)) == {f"target={name} [mm]", "target=Reference [mm]"}
        found = read(tmp_path, text, columns=[f"target={name} [mm]"])
        assert found.frame["target"].tolist() == [0, 10, 20]


RUNS = "Target [mm],m(1) [mm],m(2) [mm]\n0,0.001,0.002\n10,10.001,10.003\n20,20.002,20.001\n"


def test_a_role_that_is_given_twice_is_refused(tmp_path: Path) -> None:
    twice = ["reading=m(1) [mm]", "reading=m(2) [mm]"]
    with pytest.raises(InputError, match=re.escape("reading is given twice")):
        read(tmp_path, RUNS, columns=twice)
    found = read(tmp_path, RUNS, header="target_mm,run 1_mm,run 2_mm")
    assert found.frame["cycle"].max() == 2


def test_brackets_of_a_pattern_are_those_of_the_name(tmp_path: Path) -> None:
    assert len(read(tmp_path, RUNS, columns=["reading=m* [mm]"]).frame) == 6


COUNTS = """Target [cm],Obs 1 [cm],Obs 2 [cm],Repeat Count
2,2.05,2.04,2
2,2.05,2.06,4
5,5.05,5.06,4
5,5.04,5.05,3
10,10.0,10.1,4
10,10.01,10.02,4
"""


def test_a_count_of_repeats_is_asked_and_all_runs_are_offered(tmp_path: Path) -> None:
    every = [one.value for question in imported(tmp_path, COUNTS).questions for one in question.choices]
    assert {"ignore=Repeat Count", "reading=Obs * [cm]"} <= set(every)
    found = read(tmp_path, COUNTS, columns=["ignore=Repeat Count", "reading=Obs * [cm]"])
    assert sorted(found.frame["cycle"].unique()) == [1, 2]


SUMMARY = """## Sensor ILD2300, {} direction

Measured at positions offset by 5 mm.

Test | Setpoint [mm] | Resolver [mm] | Diff [mm] | ILD2300 [mm] | Diff [mm]
--- | --- | --- | --- | --- | --- |
1 | 5.0000 | 5.0003 | 0.0003 | Out of range | NaN
2 | 10.0000 | 10.0003 | 0.0003 | 10.0017 | 0.0017
3 | 15.0000 | 15.0004 | 0.0004 | 14.9989 | -0.0011
Accuracy |-|-| 0.0004 | - | 0.0017

Accuracy (Resolver): 0.0004

"""


def test_a_summary_is_left_out_and_told(tmp_path: Path) -> None:
    text = SUMMARY.format("positive") + SUMMARY.format("negative")
    assert set(asked(tmp_path, text)) == {"deviation=#4", "deviation=#6"}
    found = read(tmp_path, text, columns=["reading=Resolver [mm]"])
    assert found.frame["way"].tolist() == [1, 1, 1, -1, -1, -1]
    assert found.frame["cycle"].unique().tolist() == [1]
    assert "left out: line 10, a summary: 'Accuracy - - 0.0004 - 0.0017'" in found.comments["import"]


def test_a_slip_in_a_row_of_numbers_is_refused_as_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not a number"):
        read(tmp_path, "Target [mm];Reading [mm];Level [mm]\n0;0.1;1\n1O;10.1;2\n20;20.1;3\n30;30.1;3\n")


@pytest.mark.parametrize("rule", ["| -- | -- |\n", "|:-:|--:|\n", "|-|-|\n", "-- | --\n"])
def test_the_rule_of_a_table_is_no_part_of_the_names(tmp_path: Path, rule: str) -> None:
    found = read(tmp_path, f"| Target [mm] | Reading [mm] |\n{rule}| 0 | 0.001 |\n| 10 | 10.002 |\n")
    assert "mapped: Target [mm] -> target, Reading [mm] -> reading" in found.comments["import"]


def test_readings_against_their_targets_are_turned_by_hand(tmp_path: Path, run: Run) -> None:
    text = "Target [arcsec],Reading [arcsec]\n50,515.45\n100,464.53\n151,413.22\n200,363.30\n"
    assert asked(tmp_path, text) == ["reading=-Reading [arcsec]"]
    found = read(tmp_path, text, columns=["reading=-Reading [arcsec]"])
    assert np.allclose(found.frame["reading"], [-515.45, -464.53, -413.22, -363.30])
    assert found.comments["turned"] == "readings of Reading [arcsec], by hand"
    command = ["import", tmp_path / "table.md", "--sensor", "autocollimator", "-o", tmp_path / "out.csv"]
    run(*command, "--column", "reading=-Reading [arcsec]")
    assert (tmp_path / "out.csv").exists()


def test_a_heading_is_one_cell_also_where_blanks_divide_the_columns(tmp_path: Path) -> None:
    text = "Target Reading Level\n# Forward test sequence\n0 0.001 7\n10 10.001 7\n20 20.001 7\n"
    text += "# Backward, test sequence\n20 19.999 7\n10 9.999 7\n0 -0.001 7\n"
    found = read(tmp_path, text, unit="mm")
    assert found.frame["way"].tolist() == [1, 1, 1, -1, -1, -1]


def test_a_constant_that_is_given_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="direction is given twice"):
        read(tmp_path, RUNS, constants=["direction=+", "direction=-"])
