"""The one reader of tables: what is open is asked in one message, and what the message advises settles it."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from stepgauge.axis.recording import places_of
from stepgauge.errors import InputError
from stepgauge.importing.axis import AxisOptions, import_axis
from stepgauge.importing.axis.targets import parse_targets
from stepgauge.importing.points import read_points
from stepgauge.importing.result import Imported
from stepgauge.importing.tables.columns import parse_columns
from stepgauge.importing.tables.questions import OpenQuestionsError
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.source import Given

TARGETS = np.arange(0.0, 401.0, 50.0)
READINGS = TARGETS + 1e-3 * np.sin(TARGETS)


def rows(*columns: object, header: str = "", delimiter: str = ",") -> str:
    """A table with a header; each column is a sequence of cells."""
    lines = [delimiter.join(map(str, row)) for row in zip(*columns, strict=True)]  # type: ignore[call-overload]
    return "\n".join([header, *lines, ""])


def read(text: str | bytes, options: AxisOptions | None = None, **layout: object) -> Imported:
    data = text.encode() if isinstance(text, str) else text
    return import_axis(io.BytesIO(data), options or AxisOptions("laser"), TableLayout(**layout))  # type: ignore[arg-type]


def asked(text: str, options: AxisOptions | None = None, **layout: object) -> InputError:
    with pytest.raises(InputError) as error:
        read(text, options, **layout)
    return error.value


def settled(text: str) -> Imported:
    """What comes of following every advice of every message, as typed: the first that each option is given."""
    columns, layout, unit, deviation = list[str](), dict[str, object](), None, None
    for _ in range(3):
        try:
            return read(text, AxisOptions("laser", unit, deviation), columns=parse_columns(columns), **layout)
        except InputError as error:
            said = error.cli_text()
            columns += re.findall(r"--column (\w+=\"[^\"]+\")", said)[:1] if "--column" in said else []
            columns = [one.replace('"', "") for one in columns]
            if rows_of := re.search(r"--rows \"([^\"]+)\"", said):
                layout["rows"] = (rows_of[1],)
            if table := re.search(r"--table (\d)", said):
                layout["table"] = int(table[1])
            unit = match[1] if (match := re.search(r"--unit (\w+)", said)) else unit
            deviation = match[1] if (match := re.search(r"--deviation-unit (\w+)", said)) else deviation
    raise AssertionError(f"three messages did not settle it: {said}")


OPEN = {
    "several targets": rows(TARGETS, TARGETS + 0.5, READINGS, header="Target [mm],Commanded [mm],Measured [mm]"),
    "several readings": rows(TARGETS, READINGS, READINGS + 0.1, header="Target [mm],Laser [mm],Encoder [mm]"),
    "several deviations": rows(TARGETS, TARGETS * 1e-2, TARGETS * 2e-2, header="Target [mm],Error A [um],Error B [um]"),
    "a deviation that is not reading minus target": rows(
        TARGETS, READINGS, 7.0 + TARGETS * 0.0, header="Target [mm],Measured [mm],Deviation [um]"
    ),
    "a deviation of the other sign": rows(
        TARGETS, READINGS, (TARGETS - READINGS) * 1e3, header="Target [mm],Measured [mm],Deviation [um]"
    ),
    "targets and readings exchanged": rows(READINGS, TARGETS, header="Target [mm],Measured [mm]"),
    "a place that nothing names": rows(TARGETS, TARGETS * 1e-2, header="Foo [mm],Deviation [um]"),
    "readings and deviations, and no target": rows(TARGETS, TARGETS * 1e-2, header="Value [mm],Nominal - Actual (um)"),
    "deviations in an unlikely unit": rows(TARGETS, TARGETS * 0.03, header="Target [mm],Deviation [mm]"),
    "two units": rows(TARGETS, TARGETS * 1e-2, header="Target,Deviation"),
    "axes in a column": rows(
        np.r_[TARGETS, TARGETS],
        np.r_[READINGS, READINGS + 5.0],
        ["X"] * 9 + ["Y"] * 9,
        header="Nominal [mm],Actual [mm],AX",
    ),
    "features by number": rows(
        np.r_[TARGETS, TARGETS],
        np.r_[READINGS, READINGS + 5.0],
        [1] * 9 + [2] * 9,
        header="Nominal [mm],Actual [mm],Axis",
    ),
    "a block for every machine": "Target [mm],Actual [mm]\nMachine A\n"
    + rows(TARGETS, READINGS)
    + "Machine B\n"
    + rows(TARGETS, READINGS + 5.0),
    "two tables": rows(TARGETS, READINGS, header="Target [mm],Actual [mm]")
    + "\n"
    + rows(TARGETS, READINGS * 1e-3, TARGETS, header="Target [m],Actual [m],Humidity [%]"),
}


@pytest.mark.parametrize("name", OPEN)
def test_what_is_open_is_asked_and_the_advice_settles_it(name: str) -> None:
    assert "expected" in asked(OPEN[name]).cli_text()
    found = settled(OPEN[name]).recording
    assert found.form == "axis"
    assert len(found) == 9


def test_all_questions_are_in_one_message_that_names_their_options() -> None:
    error = asked(rows(TARGETS, TARGETS + 0.5, TARGETS * 1e-2, header="Target,Commanded,Deviation"))
    assert isinstance(error, OpenQuestionsError)
    said = error.cli_text()
    assert said.isprintable()
    for words in (
        "3 questions",
        '--column target="Target" or --column target="Commanded"',
        "--unit",
        "--deviation-unit",
    ):
        assert words in said, said


@pytest.mark.parametrize("role", ["reading", "deviation"])
def test_a_choice_removes_its_rivals(role: str) -> None:
    """It does not add a candidate to those that the names suggest."""
    text = rows(TARGETS, READINGS, TARGETS * 1e-2, header="Target [mm],Measured [mm],Error [um]")
    header = {"reading": "Measured [mm]", "deviation": "Error [um]"}[role]
    found = read(text, columns={role: header}).recording
    wanted = (READINGS - TARGETS) * 1e3 if role == "reading" else TARGETS * 1e-2
    np.testing.assert_allclose(found.deviation, wanted, atol=1e-9)


@pytest.mark.parametrize("name", ["Hin [um]", "Hin 2 [um]"])
def test_a_column_too_much_is_no_further_run(name: str) -> None:
    """Runs there and back have as many columns each; a copy of one of them, with other numbers, is asked about."""
    there, back = TARGETS * 1e-2, TARGETS * 1e-2 + 1.0
    text = rows(TARGETS, there, back, there + 0.5, header=f"Target [mm],Hin [um],Rück [um],{name}")
    said = asked(text).cli_text()
    assert "no whole runs" in said
    place = "#4" if name == "Hin [um]" else name
    assert f'--column ignore="{place}"' in said
    assert len(read(text, columns={"ignore": place}).recording) == 18
    assert len(read(text, AxisOptions("laser", missing=True)).recording) == 27


def test_a_place_is_no_target_by_its_name_alone() -> None:
    """Minutes that are called a position: readings neither follow it nor come again at it."""
    spot = 12.5 + 1e-3 * np.sin(TARGETS)
    for numbers in (np.arange(5, 14), np.full(9, 20)):
        text = rows(numbers, spot, header="Position,Reading [mm]")
        if np.ptp(numbers):
            assert '--column target="Position"' in asked(text).cli_text()
        assert read(text, columns={"ignore": "Position"}).recording.form == "spot"
    assert read(rows(TARGETS, READINGS, header="Position,Reading [mm]")).recording.form == "axis"


def test_a_place_beside_numbers_without_a_name_is_no_reading() -> None:
    said = asked(rows(TARGETS, TARGETS * 1e-2, header="Winkel [°],Data")).cli_text()
    assert "no column is named as the reading" in said
    assert '"Data"' in said


def test_hours_without_their_minutes_are_no_time() -> None:
    hours, spot = np.array([20, 20, 20, 21, 21, 21, 22, 22, 22]), 12.5 + 1e-3 * np.sin(TARGETS)
    found = read(rows(hours, spot, header="Hour,Reading [mm]"))
    assert "time_s" not in found.recording.frame
    assert "'Hour' as the time (several rows have the same" in found.rejected[0]


def test_a_plate_of_three_pairs_needs_one_column_and_the_unit() -> None:
    """The nominal value is the one whose name goes with that of the reading."""
    text = rows(READINGS, READINGS + 5.0, TARGETS, TARGETS + 5.0, header="Meas X,Meas Y,Nom X,Nom Y")
    error = asked(text)
    assert "the target" not in str(error.cli_text()).split("2)")[0]
    for axis, shift in (("X", 0.0), ("Y", 5.0)):
        found = read(text, AxisOptions("touch", "mm"), columns={"reading": f"Meas {axis}"}).recording
        np.testing.assert_allclose(found.frame["target"], TARGETS + shift)


def test_a_file_an_open_file_and_a_frame_are_read_alike(tmp_path: Path) -> None:
    """Also points of a gauge, by the same function."""
    frame = pd.DataFrame({"Target [mm]": TARGETS, "Measured [mm]": READINGS})
    path = tmp_path / "t.csv"
    frame.to_csv(path, index=False)
    given: list[Given] = [path, str(path), io.BytesIO(path.read_bytes()), io.StringIO(path.read_text()), frame]
    found = [import_axis(one, AxisOptions("laser")).recording.frame for one in given]
    for one in found[1:]:
        pd.testing.assert_frame_equal(one, found[0])
    xyz = pd.DataFrame({"X [inch]": TARGETS, "Y [mm]": READINGS, "Z [mm]": 7.0})
    np.testing.assert_allclose(read_points(xyz, "csv", TableLayout()).position_mm[:, 0], TARGETS * 25.4)


def test_a_long_table_is_read_as_a_short_one_and_a_slip_in_its_middle_is_named() -> None:
    """The middle is read as columns, the ends cell by cell."""
    target = np.tile(np.arange(0.0, 100.0, 0.5), 150)
    lines = [f"{n * 0.1:.1f};{t:.1f};{t + 1e-3 * n / 1e3:.6f}".replace(".", ",") for n, t in enumerate(target)]
    head = "Zeit [s];Soll [mm];Ist [mm]"
    found = read("\n".join([head, *lines])).recording.frame
    assert len(found) == 30_000
    np.testing.assert_allclose(found["target"], target)
    np.testing.assert_allclose(found["reading"], target + np.arange(30_000) * 1e-6, atol=1e-9)
    np.testing.assert_allclose(found["time_s"], np.arange(30_000) * 0.1)
    assert found["cycle"].max() == 150
    lines[15_000] = lines[15_000].rpartition(";")[0] + ";bad"
    assert "file:15002: column 'Ist [mm]' is not a number; found 'bad'" in str(asked("\n".join([head, *lines])))


def test_a_dense_scan_has_as_many_places_as_positions() -> None:
    assert places_of(np.arange(1201) * 0.5).max() == 1200
    seen = np.tile(TARGETS, 6) + 1e-3 * np.random.default_rng(1).normal(size=54)
    assert places_of(seen).max() == 8
    uneven = np.cumsum(np.random.default_rng(2).uniform(0.4, 0.6, 1201))
    assert places_of(uneven).max() == 1200


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (["2021/06/13-20:05:00", "2021/06/13-20:05:30"], 30.0),
        (["13-Jun-2021 20:05:00", "13-Jun-2021 20:05:30"], 30.0),
        (["Sun Jun 13 20:05:00 2021", "Sun Jun 13 20:05:30 2021"], 30.0),
        (["13. März 2021 20:05:00", "13. März 2021 20:05:30"], 30.0),
        (["20210613T200500Z", "20210613T200530Z"], 30.0),
        (["20:05:00,250 13.06.2021", "20:05:30,250 13.06.2021"], 30.0),
        (["8:05:00 PM", "8:05:30 PM"], 30.0),
        (["1623614700", "1623614730"], 30.0),
        (["1623614700123", "1623614730123"], 30.0),
        (["132680811000000000", "132680811300000000"], 30.0),
    ],
)
def test_times_in_every_usual_spelling(cells: list[str], seconds: float) -> None:
    frame = read(rows(cells, [1.0, 1.1], header="Time;Reading [um]", delimiter=";")).recording.frame
    assert np.ptp(frame["time_s"]) == pytest.approx(seconds, abs=1e-4)


def test_hours_minutes_and_seconds_in_columns_of_their_own() -> None:
    text = rows([23, 23, 0], [58, 59, 1], [1.0, 1.1, 1.2], header="Hour,Minute,Reading [um]")
    assert read(text).recording.frame["time_s"].tolist() == [0.0, 60.0, 180.0]


@pytest.mark.parametrize(
    ("header", "name", "value"),
    [("Material [degC]", "Material_C", 20.5), ("T air (K)", "T_air_C", 20.5), ("[°C]", "temperature_C", 20.5)],
)
def test_a_temperature_has_a_name_that_the_laws_know(header: str, name: str, value: float) -> None:
    cells = [293.65 if "K" in header else 20.5] * 9
    frame = read(rows(TARGETS, READINGS, cells, header=f"Target [mm],Measured [mm],{header}")).recording.frame
    assert frame[name].tolist() == [value] * 9


STATED = ["Runs: 3", "Number of targets: 10", "Number of readings: 8", "Test type: bidirectional", "# count: 8"]


@pytest.mark.parametrize("line", STATED)
def test_what_a_file_states_of_itself_is_compared(line: str) -> None:
    text = rows(TARGETS, READINGS, header=f"{line}\nTarget [mm],Measured [mm]")
    error = str(asked(text))
    assert f"the file says {line.lstrip('# ').partition(':')[0].casefold()}" in error
    right = {"Runs: 3": "Runs: 1", "Number of targets: 10": "Number of targets: 9", "# count: 8": "# count: 9"}
    right |= {"Number of readings: 8": "Readings: 9", "Test type: bidirectional": "Test type: unidirectional"}
    assert len(read(text.replace(line, right[line])).recording) == 9


def test_the_unit_that_a_file_states_once_holds_for_its_lengths() -> None:
    text = rows(TARGETS, READINGS, header="UNITS=IN\nTarget,Measured")
    assert read(text).recording.units.position == "inch"


def test_tabs_with_empty_cells_keep_their_columns() -> None:
    text = "Target [mm]\tRemark\tNote\tReading [mm]\n" + rows(
        TARGETS, [""] * 8 + ["x"], [""] * 9, READINGS, delimiter="\t"
    )
    found = read(text)
    assert len(found.recording) == 9
    assert any("Remark" in line for line in found.report if line.startswith("dropped"))


def test_fixed_width_with_empty_cells_markdown_and_a_target_in_merged_cells() -> None:
    fixed = "Target [mm]   Remark   Reading [mm]\n" + "".join(
        f"{t:11.1f}   {'late' if n == 3 else '':6}   {r:12.5f}\n"
        for n, (t, r) in enumerate(zip(TARGETS, READINGS, strict=True))
    )
    marks = "| Target [mm] | Reading [mm] |\n|---:|:---:|\n" + "".join(
        f"| {t} | {r} |\n" for t, r in zip(TARGETS, READINGS, strict=True)
    )
    merged = rows(
        [t if n % 2 == 0 else "" for t in TARGETS for n in (0, 1)],
        np.repeat(READINGS, 2) + np.tile([0.0, 1e-3], 9),
        header="Target [mm];Reading [mm]",
        delimiter=";",
    )
    for text, count in ((fixed, 9), (marks, 9), (merged, 18)):
        frame = read(text).recording.frame
        np.testing.assert_allclose(np.unique(frame["target"]), TARGETS)
        assert len(frame) == count
    assert "is not a number" in str(asked(merged.replace("50.0;", ";")))  # not as in merged cells


def test_a_copy_of_a_column_is_one_column() -> None:
    text = rows(TARGETS, READINGS, READINGS, header="Target [mm],Measured [mm],Measured [mm]")
    assert len(read(text).recording) == 9


def test_columns_of_a_wide_table_have_units_of_their_own() -> None:
    text = rows(TARGETS, TARGETS * 1e-2, TARGETS * 2e-5, header="Target [mm],x1 up [um],x1 down [mm]")
    frame = read(text).recording
    up = frame.deviation[frame.frame["way"] == 1]
    down = frame.deviation[frame.frame["way"] == -1]
    np.testing.assert_allclose(up, TARGETS * 1e-2, atol=1e-9)
    np.testing.assert_allclose(down[::-1], TARGETS * 2e-2, atol=1e-9)


def test_readings_of_one_spot_are_told() -> None:
    found = read(rows([0.1, 0.3, 0.2], header="Reading [um]"))
    assert found.recording.form == "spot"
    assert "mean 0.2 um, standard deviation 0.1 um, range 0.2 um" in found.report


def test_a_log_of_a_control_without_a_header() -> None:
    lines = "".join(f"LAB:POS 2021-06-13 20:05:{n:02d}.123456 12.{n:02d}\n" for n in range(9))
    frame = read(lines, AxisOptions("inductive", "mm")).recording.frame
    np.testing.assert_allclose(frame["reading"], 12.0 + np.arange(9) / 100.0)
    np.testing.assert_allclose(frame["time_s"], np.arange(9.0))
    two = "".join(f"{line}\nLAB:AIR 2021-06-13 20:05:{n:02d}.5 20.1\n" for n, line in enumerate(lines.split("\n")[:-1]))
    assert '--rows "LAB:AIR"' in asked(two, AxisOptions("inductive", "mm")).cli_text()
    only = read(two, AxisOptions("inductive", "mm"), rows=("LAB:POS",)).recording.frame
    pd.testing.assert_frame_equal(only[["reading"]], frame[["reading"]])


def test_points_without_a_header_and_positions_of_faces() -> None:
    text = "".join(f"{t}   {r}   7.0\n" for t, r in zip(TARGETS, READINGS, strict=True))
    with pytest.raises(InputError, match='header "x_mm,y_mm,z_mm"'):
        read_points(io.StringIO(text), "csv", TableLayout())
    found = read_points(io.StringIO(text), "csv", TableLayout(header="x_mm,y_mm,z_mm"))
    np.testing.assert_allclose(found.position_mm[:, 0], TARGETS)
    faces = rows(np.arange(1, 10), TARGETS, READINGS, header="Face,Nominal,Measured")
    with pytest.raises(InputError, match='sensor="touch" with the gauge, for one axis'):
        read_points(io.StringIO(faces), "csv", TableLayout())


REPORT = "DIM LOC{0}= LOCATION OF POINT PNT{0}  UNITS=MM\nAX    NOMINAL    MEAS\nX   {1}.0   {1}.002\nY   5.0   5.03\n"


def test_a_report_of_a_coordinate_measuring_machine() -> None:
    """One option, for the unit stands in the line above every block."""
    text = "".join(REPORT.format(n, 10 * n) for n in range(1, 6))
    error = asked(text, AxisOptions("touch")).cli_text()
    assert '--rows "X"' in error
    assert "--unit" not in error
    found = read(text, AxisOptions("touch"), rows=("X",)).recording
    np.testing.assert_allclose(found.deviation, 2.0, atol=1e-6)
    mixed = AxisOptions("touch", ordered=True)  # two axes in turn are in the order of no travel
    assert len(read(text, mixed, rows=("AX=*", "title=*")).recording) == 10


def test_lines_of_two_kinds_as_frequent_as_one_another_are_no_recording() -> None:
    """As where a log of blocks is cut: neither kind of line is the table."""
    lines = [f"{name} VALUE : {10.0 * n:.4f}" for n in range(2) for name in ("NOMINAL", "ACTUAL")]
    assert "rows are of several kinds" in str(asked("\n".join([*lines, "NOMINAL VALUE : 20.0"])))
    whole = [f"{name} : {10.0 * n + d}" for n in range(4) for name, d in (("NOMINAL", 0.0), ("ACTUAL", 0.002))]
    assert read("\n".join(whole), AxisOptions("touch", "mm")).recording.form == "axis"
    assert "a block of the log is not whole" in str(asked("\n".join([*whole[:4], *whole[5:]])))


def test_columns_beyond_the_header_are_refused() -> None:
    text = rows(TARGETS, READINGS + 3.0, READINGS, header="Target [mm],Reading [mm]")
    assert "the row has more cells than the header" in str(asked(text))
    assert "the row has more cells" in str(asked("Target [mm],Reading [mm]\n" + rows(TARGETS, READINGS) + "1,2,3\n"))


def test_a_target_that_nothing_names_beside_readings_near_it_is_asked_for() -> None:
    text = rows([50.0] * 10, 50.0 + 1e-3 * np.arange(10), header="Foo [mm],Reading [mm]")
    assert 'target="Foo [mm]"' in asked(text).cli_text()
    assert read(text, columns={"target": "Foo [mm]"}).recording.form == "axis"


HEAD = "Target [mm],Reading [mm]\n"
NO_ROWS = "lines that are no rows of the table, the first in line"


@pytest.mark.parametrize(
    ("above", "below", "told"),
    [
        (HEAD, "Mean,0.0012\nOperator: N. N.\n", f"2 {NO_ROWS} 5: 'Mean 0.0012'"),
        (f"Machine A\n{HEAD}", "", f"1 {NO_ROWS} 1: 'Machine A'"),
        (HEAD, "# 200.0,200.004\n# checked\n", "1 comments that hold a row of numbers, the first: '200.0 200.004'"),
        (f"{HEAD}-50.0,-49.999\na pause\n", "", f"1 {NO_ROWS} 3: 'a pause'"),
    ],
)
def test_what_is_no_row_of_a_table_is_told_with_its_first_line(above: str, below: str, told: str) -> None:
    rows = "".join(f"{target:.1f},{target + 0.001:.3f}\n" for target in (0.0, 50.0, 100.0))
    assert f"dropped: {told}" in read(f"{above}{rows}{below}").report


def test_a_page_is_no_run_and_a_run_is_one() -> None:
    rows = ["\n".join(f"{t:.1f},{t + 0.001 * n:.3f}" for t in (0.0, 50.0, 100.0)) for n in range(4)]
    for title, cycles in {"Page": 4, "Seite": 4, "Run": 4, "Messung": 4}.items():
        blocks = [f"{title} {n + 3}\nTarget [mm],Reading [mm]\n{block}" for n, block in enumerate(rows)]
        frame = read("\n".join(blocks)).recording.frame
        assert frame["cycle"].nunique() == cycles
        assert frame["cycle"].min() == (1 if title in ("Page", "Seite") else 3)
    other = "\n".join(f"Hole {n + 3}\nTarget [mm],Reading [mm]\n{block}" for n, block in enumerate(rows))
    assert '--rows title="*"' in asked(other).cli_text()


def test_a_column_of_values_beside_those_of_runs_may_be_the_target() -> None:
    """A target whose name says another thing was read as the only reading, and the runs were gone."""
    rows = "".join(f"{n};{50.0 * n};{0.3 * n:.1f};{0.4 * n:.1f}\n" for n in range(1, 6))
    text = "i;Value [mm];x1 up [um];x1 down [um]\n" + rows
    assert 'columns={"target": "Value [mm]"}' in str(asked(text))
    frame = read(text, columns={"target": "Value [mm]"}).recording.frame
    assert sorted(set(frame["target"])) == [50.0, 100.0, 150.0, 200.0, 250.0]
    assert len(frame) == 10


def test_numbers_of_targets_are_no_positions() -> None:
    rows = "".join(f"{run};{n};{0.3 * n + run:.1f}\n" for run in (1, 2) for n in range(1, 6))
    text = f"Run;Target no;Deviation [um]\n{rows}"
    assert "--targets" in asked(text).cli_text()
    frame = read(text, AxisOptions("laser", "mm", targets=parse_targets("0:400:100"))).recording.frame
    assert sorted(set(frame["target"])) == [0.0, 100.0, 200.0, 300.0, 400.0]


def test_a_run_may_say_its_direction() -> None:
    rows = "".join(f"{run}{way},{t},{t + 0.001}\n" for run in (1, 2) for way in "fb" for t in (0.0, 50.0, 100.0))
    frame = read(f"Sweep,Target mm,Reading mm\n{rows}").recording.frame
    assert frame["way"].tolist() == [1, 1, 1, -1, -1, -1] * 2
    assert frame["cycle"].tolist() == [1] * 6 + [2] * 6


def test_a_name_that_is_missing_above_a_row_of_units_is_no_shift_of_all_others() -> None:
    rows = "".join(f"{t + 0.5}|{t}|{0.01 * t}|fwd\n" for t in (0.0, 50.0, 100.0))
    assert "more cells than the header" in str(asked(f"Target|Deviation|Direction\nmm raw|mm|um|\n{rows}"))
