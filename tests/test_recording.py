"""The recording file: what survives writing and reading, and what is refused with its line."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.machine.file import read_machine
from stepgauge.recording import REQUIRED, Recording, join_recordings, read_recording, write_recording
from stepgauge.recording.columns import SCALE_TEMPERATURES
from stepgauge.recording.conventions import complete_by_machine

CSV = (
    "# machine: M: the first\n# no key here\n"
    "cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k,time_s,gauge_temperature_C,humidity\n"
    "1,1,98.0,0,0,1,0,0,1.5,20.1,45\n"
    "1,2,112.0,0,0,-1,0,0,3.5,20.1,46\n"
    "2,1,98.1,0,0,0.6,0.8,0,5.5,20.2,47\n"
)


def read(tmp_path: Path, text: str = CSV) -> Recording:
    path = tmp_path / "recording.csv"
    path.write_text(text)
    return read_recording(path)


def test_comments_defaults_and_further_columns_are_kept(tmp_path: Path) -> None:
    recording = read(tmp_path)
    assert recording.comments == {"machine": "M: the first"}
    assert recording.placements == [1]
    assert recording.frame["humidity"].tolist() == [45, 46, 47]
    np.testing.assert_allclose(recording.position_mm[:, 0], [98.0, 112.0, 98.1])
    np.testing.assert_allclose(recording.approach[2], [0.6, 0.8, 0.0])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("x_mm", "x_inch", [":3", "'x_mm' is missing"]),
        ("112.0", "", [":5", "x_mm", "finite number", "nothing"]),
        ("112.0", "nan", [":5", "x_mm", "found 'nan'"]),
        ("112.0", "", [":5", "x_mm", "found nothing"]),
        ("112.0", "inf", [":5", "x_mm"]),
        ("112.0", "11l2", [":5", "x_mm", "11l2"]),
        ("2,1,98.1", "2,1.5,98.1", [":6", "face", "1.5", "whole number"]),
        ("2,1,98.1", "0,1,98.1", [":6", "cycle"]),
        ("0.6,0.8,0", "0.6,0.6,0", [":6", "not a unit vector", "0.8485"]),
        ("20.2", "293.35", [":6", "gauge_temperature_C", "deg C (K or F?)"]),
        ("20.2", "68.4", [":6", "68.4"]),
        (",47", ",wet", [":6", "humidity", "wet"]),
        ("time_s", "speed_mm_s", []),
        (CSV, "", ["empty"]),
        (
            "1,1,98.0,0,0,1,0,0,1.5,20.1,45\n1,2,112.0,0,0,-1,0,0,3.5,20.1,46\n2,1,98.1,0,0,0.6,0.8,0,5.5,20.2,47\n",
            "",
            ["no rows"],
        ),
        ("3.5,20.1,46", "3.5,20.1,46,99", [":5", "wrong number of cells", "12", "11"]),
        ("y_mm", "x_mm", [":3", "'x_mm' is there twice"]),
        ("2,1,98.1", "2,1e30,98.1", [":6", "face", "whole number"]),
    ],
)
def test_files_that_are_no_recording_are_refused(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in CSV
    if not words:
        assert len(read(tmp_path, CSV.replace(old, new))) == 3
        return
    with pytest.raises(InputError) as caught:
        read(tmp_path, CSV.replace(old, new))
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize("between", ["", "   ", "# coffee", "  # coffee: 2", ",,,,,,,,,,", '"",""'])
def test_lines_that_say_nothing_are_read_over_and_counted(tmp_path: Path, between: str) -> None:
    """Blank lines and comments stand anywhere; the line that an error names is that of the file."""
    lines = CSV.splitlines()
    spaced = "\n".join(
        ["", *lines[:3], between, *(text for line in lines[3:] for text in (line, between)), between, ""]
    )
    pd.testing.assert_frame_equal(read(tmp_path, spaced).frame, read(tmp_path).frame)
    assert read(tmp_path, spaced).comments == {"machine": "M: the first"}
    for wrong, words in (("x8.1", "recording.csv:10: column x_mm is not a number"), ("98.1,7", r":10: .* found 12")):
        with pytest.raises(InputError, match=words):
            read(tmp_path, spaced.replace("98.1", wrong))


def with_temperatures(values: list[float], placement: list[int] | None = None) -> str:
    n = len(values)
    header = "placement,cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k,gauge_temperature_C"
    rows = [f"{p},1,{i + 1},0,0,0,1,0,0,{t}" for i, (t, p) in enumerate(zip(values, placement or [1] * n, strict=True))]
    return "\n".join([header, *rows]) + "\n"


@pytest.mark.parametrize(
    ("values", "placement", "words"),
    [
        ([0.0] * 4, None, ":2: column gauge_temperature_C .* exactly 0.* found 0 in 4 of 4 rows; expected .* without"),
        ([20.3, 20.3, 0.0, 0.0], None, ":4: .* exactly 0.* found 0 in 2 of 4 rows, the others 20.3 to 20.3"),
        ([0.0, 20.3, 20.3, 20.4], None, ":2: .* exactly 0"),
        ([20.3, 20.3, 0.0, 0.0], [1, 1, 2, 2], ":4: .* exactly 0"),
        ([20.3, 20.3, -5.0, -5.0], None, ":4: .* changes so fast; found -5 and 20.3 deg C"),
        ([50.0, 50.0, 20.3, 20.3], None, ":3: .* changes so fast; found 50 and 20.3 deg C"),
    ],
)
def test_what_a_thermometer_without_its_lead_shows_is_no_temperature(tmp_path: Path, values, placement, words) -> None:
    with pytest.raises(InputError, match=words):
        read(tmp_path, with_temperatures(values, placement))


@pytest.mark.parametrize(
    ("values", "placement"),
    [
        ([0.2, 0.1, 0.0, -0.1], None),  # a cold hall
        ([1.0, 1.0, 0.0, 0.0], None),  # and a display of whole kelvins
        ([6.0, 5.0, 4.0, 3.0], None),
        ([20.0, 20.0, 3.0, 3.0], [1, 1, 2, 2]),  # carried outside between two placements
        ([20.0, 27.0, 27.0, 27.0], None),
    ],
)
def test_a_cold_gauge_and_one_that_was_carried_are_believed(tmp_path: Path, values, placement) -> None:
    assert read(tmp_path, with_temperatures(values, placement)).frame["gauge_temperature_C"].tolist() == values


def test_a_column_without_a_header_is_not_dropped_in_silence(tmp_path: Path) -> None:
    """pandas only warns of it, and goes on without the last column; delimiters at the ends of rows are no column."""
    comments = [line for line in CSV.splitlines() if line.startswith("#")]
    header, *rows = [line for line in CSV.splitlines() if not line.startswith("#")]
    with pytest.raises(InputError, match="more cells than the header"):
        read(tmp_path, "\n".join([*comments, header, *(row + ",7" for row in rows)]) + "\n")
    assert len(read(tmp_path, "\n".join([*comments, header, *(row + "," for row in rows)]) + "\n")) == len(rows)


def test_missing_and_binary_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.csv: no such file"):
        read_recording(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01" * 50)
    with pytest.raises(InputError):
        read_recording(tmp_path / "binary.csv")


row = st.tuples(
    st.integers(1, 9), st.integers(1, 102), *[st.floats(-2000, 2000)] * 3, st.floats(-np.pi, np.pi), st.floats(0, 1e5)
)


@given(st.lists(row, min_size=1, max_size=20))
def test_writing_and_reading_gives_the_same_recording(tmp_path_factory, rows) -> None:
    cycle, face, x, y, z, angle, time_s = map(np.array, zip(*rows, strict=True))
    frame = pd.DataFrame(
        {
            "placement": 1,
            "cycle": cycle,
            "face": face,
            "x_mm": x,
            "y_mm": y,
            "z_mm": z,
            "approach_i": np.cos(angle),
            "approach_j": np.sin(angle),
            "approach_k": 0.0,
            "time_s": time_s,
            "note_count": 3.0,
        }
    )
    path = tmp_path_factory.mktemp("recording") / "r.csv"
    write_recording(path, Recording(frame, {"key": "value: with colon"}))
    back = read_recording(path)
    assert back.comments == {"key": "value: with colon"}
    assert list(back.frame.columns) == [*REQUIRED_ORDER, "time_s", "note_count"]
    np.testing.assert_allclose(back.position_mm, np.column_stack([x, y, z]), atol=0.51e-7)
    np.testing.assert_allclose(back.approach[:, 0], np.cos(angle), atol=0.51e-10)


REQUIRED_ORDER = ["placement", *REQUIRED]


def test_joined_recordings_number_their_placements_on(tmp_path: Path) -> None:
    one, two = read(tmp_path), read(tmp_path)
    joined = join_recordings([one, two])
    assert joined.placements == [1, 2]
    assert len(joined.select_placement(2)) == 3
    own = Recording(two.frame.assign(placement=5), two.comments)
    assert join_recordings([one, own]).placements == [1, 5]
    assert join_recordings([one, own, own]).placements == [1, 5, 6]


def test_a_small_table_is_read_as_a_large_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pandas and with it: the same columns, kinds of numbers and values."""
    path = tmp_path / "r.csv"
    path.write_text("cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k,stylus,air_C\n" + ROWS)
    plain = read_recording(path)
    monkeypatch.setattr("stepgauge.recording.read.PLAIN_BYTES", 0)
    whole = read_recording(path)
    assert {name: column.dtype.kind for name, column in plain.columns.items()} == {
        name: column.dtype.kind for name, column in whole.columns.items()
    }
    for name, column in whole.columns.items():
        np.testing.assert_allclose(plain.columns[name], column, rtol=1e-15)


ROWS = "1,1,1.25,-2.5e1,3,1,0,0,1,20.125\n1,2,0.1,0.2,0.3,-1,0,0,2,19.5\n"


def test_reading_and_writing_a_recording_loads_no_pandas(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k,stylus,air_C\n" + ROWS)
    code = (
        "import sys; from stepgauge.recording import read_recording, write_recording;"
        f"r = read_recording({str(path)!r}); write_recording({str(path)!r} + '.again.csv', r);"
        "print({'pandas', 'scipy', 'jinja2'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_the_log_of_a_controller_is_to_be_imported_first(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"this is no recording: .* import_recording makes of the log"):
        read(tmp_path, "Grbl 1.1h\nok\n[PRB:-221.165,-99.950,-60.000:1]\nok\n")


@pytest.mark.parametrize("as_columns", [True, False])
def test_a_change_of_the_frame_is_a_change_of_the_recording(as_columns: bool) -> None:
    """Wherever the recording came from, and whatever was asked of it before; no change is lost without a word."""
    given = {"cycle": np.ones(2), "face": np.array([1.0, 2.0]), "placement": np.ones(2), "x_mm": np.zeros(2)}
    recording = Recording(given if as_columns else pd.DataFrame(given))
    assert recording.columns["x_mm"].tolist() == [0.0, 0.0]
    recording.frame["x_mm"] = [3.0, 4.0]
    assert recording.columns["x_mm"].tolist() == [3.0, 4.0]
    recording.frame.loc[0, "x_mm"] = 5.0
    assert recording.columns["x_mm"].tolist() == [5.0, 4.0]
    assert given["x_mm"].tolist() == [0.0, 0.0] or not as_columns


def test_a_temperature_that_only_some_recordings_state_is_a_question(tmp_path: Path) -> None:
    """Nobody knows how warm the others were; joined, their temperature would be no number."""
    frame = read(tmp_path).frame
    without = Recording(frame.drop(columns="gauge_temperature_C", errors="ignore"), {}, "without.csv")
    with_it = Recording(frame.assign(gauge_temperature_C=20.4), {}, "with.csv")
    with pytest.raises(
        InputError, match=r"without.csv: the temperature of the gauge is not recorded, in the others it is"
    ):
        join_recordings([with_it, without])
    assert len(join_recordings([with_it, with_it])) == 2 * len(without)


def test_scales_whose_temperature_one_recording_lacks_are_as_warm_as_the_machine_file_says(tmp_path: Path) -> None:
    """Of one recording the scales were read, of the other they are stated; without either nobody knows them."""
    machine = read_machine("bridge-cmm").table
    bare, named = read(tmp_path), replace(read(tmp_path), path="bare.csv")
    measured = bare.assign_columns(**dict.fromkeys(SCALE_TEMPERATURES, 22.5))
    with pytest.raises(InputError, match=r"bare.csv: the temperature of its scales is neither recorded nor stated"):
        join_recordings([measured, named])
    both = [complete_by_machine(one, machine) for one in (measured, bare)]
    joined = join_recordings(both)
    for name in SCALE_TEMPERATURES:
        assert joined.columns[name].tolist() == [22.5] * 3 + [machine.temperature_C] * 3
    assert both[1].comments["machine"] == bare.comments["machine"]  # what it says itself stays


def test_a_recording_of_no_machine_is_of_the_one_of_the_machine_file(tmp_path: Path) -> None:
    machine = read_machine("bridge-cmm").table
    nameless = Recording(read(tmp_path).frame, {})
    assert complete_by_machine(nameless, machine).comments["machine"] == machine.name
