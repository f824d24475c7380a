"""What a file may ask of the reader: time, memory, depth; and how an error may look."""

from __future__ import annotations

import io
import time
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.dcc.xml import read_xml
from stepgauge.errors import LONGEST, InputError, one_line, reader
from stepgauge.files.config import read_toml
from stepgauge.files.numerals import Numerals, number
from stepgauge.files.text import read_bytes, read_text
from stepgauge.gauge.certified import read_gauge
from stepgauge.importing.formats import gist
from stepgauge.importing.logs import read_log, recognise_log
from stepgauge.motion.moves import ProbingSettings
from stepgauge.probes.files import read_points
from stepgauge.programs import DIALECTS, read_program
from stepgauge.programs.reading import Reader
from stepgauge.recording import read_recording
from tests.cli.conftest import Run, run  # noqa: F401 the fixture
from tests.conftest import ROOT

HEADER = "cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k\n"


# errors


@given(st.text(), st.text(), st.text(), st.text())
def test_every_message_is_one_short_line_that_a_terminal_can_show(
    where: str, what: str, found: str, expected: str
) -> None:
    said = str(InputError(where, what, found=found * 50, expected=expected * 9))
    assert len(said) <= LONGEST
    assert said.isprintable()


def test_a_message_that_is_too_long_keeps_what_matters() -> None:
    folder = "/a/very/long/way/to/" * 10
    error = InputError(f"{folder}points.csv:7", "column x_mm is not a number", found="9" * 5000, expected="a number")
    said = str(error)
    for words in ("points.csv:7: column x_mm is not a number; found 9999", "; expected a number"):
        assert words in said


def test_a_message_is_cut_between_words() -> None:
    text = " ".join(f"word{n}" for n in range(200))
    start, end = one_line(text, 100).split("...")
    assert text.startswith(start + " ")
    assert text.endswith(" " + end)
    assert len(start + end) > 80
    assert len(one_line("9" * 500, 100)) == 100


def test_escapes_of_a_terminal_do_not_reach_it() -> None:
    assert one_line("a\x1b[2J\x07b\nc\u202ed") == r"a\x1b[2J\x07b c\u202ed"


@pytest.mark.parametrize(
    "fault", [ValueError("no"), KeyError("k"), RecursionError(), OverflowError("big"), MemoryError(), UnicodeError("u")]
)
def test_whatever_fails_in_a_reader_is_an_error_of_its_file(fault: Exception) -> None:
    @reader("table")
    def read(path: str) -> None:
        raise fault

    with pytest.raises(InputError, match=r"^a\.csv: "):
        read("a.csv")


# limits


def test_devices_folders_and_other_kinds_are_no_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is no file; found a device"):
        read_bytes("/dev/zero")
    with pytest.raises(InputError, match="this is no file"):
        read_recording("/dev/zero")
    (tmp_path / "a").write_bytes(bytes(20))
    with pytest.raises(InputError, match="too large; found 0 MB"):
        read_bytes(tmp_path / "a", largest=10)
    for data, words in ((b"PK\x03\x04zip", "Excel"), (b"\xff\xfea\0", "UTF-16"), (b"\x89PNG\r\n", "a picture")):
        (tmp_path / "points.csv").write_bytes(data)
        with pytest.raises(InputError, match=f"not a UTF-8 text file; found .*{words}"):
            read_text(tmp_path / "points.csv")


@pytest.mark.parametrize(
    "text",
    [
        'faces = "\\u0000"\n',
        f"a = {'9' * 5000}\n",
        f"a = {'[' * 3000}\n",
        "a = nan\n",
        "diameter_mm = 1e-320\n",
        "size = 1e308\n",
        "[uncertainty]\nyaw_urad = [1.0, inf]\n",
    ],
)
def test_toml_that_no_person_writes(tmp_path: Path, text: str) -> None:
    path = tmp_path / "g.toml"
    shipped = (ROOT / "calibration_data/step-gauge-420.toml").read_text()
    path.write_text(shipped.replace('faces = "step-gauge-420.csv"\n', text) if text.startswith("faces") else text)
    with pytest.raises(InputError):
        read_gauge(path) if text.startswith("faces") else read_toml(path)


@pytest.mark.parametrize("cell", ["9" * 140_000, "9" * 400, "A" * 140_000, '"' + "1" * 140_000, "١٢٣"])
def test_cells_that_are_no_numbers(tmp_path: Path, cell: str) -> None:
    (tmp_path / "r.csv").write_text(HEADER + f"1,1,{cell},2,3,1,0,0\n" * 3)
    for read in (read_recording, read_points):
        with pytest.raises(InputError):
            read(tmp_path / "r.csv")


def test_digits_of_other_scripts_are_no_numbers() -> None:
    assert np.isnan(number("٣"))
    assert np.isnan(Numerals(",").number("1٣,5"))
    assert np.isnan(number("1e999"))


@pytest.mark.parametrize("kind", ["blank lines", "digits", "spaces in a header", "letters in a log"])
def test_twice_the_input_takes_about_twice_the_time(tmp_path: Path, kind: str) -> None:
    """50,000 blank lines took 69 s, 20,000 digits and a letter 47 s: the square of the size. Operations, not a bar."""

    def work(size: int) -> float:
        text = {
            "blank lines": "x;y;z\n" + "\n" * size + "1;2;3\n",
            "digits": f"x;y;z\n{'1' * size}a;2;3\n1;2;3\n1;2;3\n",
            "spaces in a header": f"x;y;z;(a{' ' * size}b\n1;2;3;4\n1;2;3;4\n",
            "letters in a log": f"00001 PtMeas(X(1))\n00001 # {'A' * size}\n",
        }[kind]
        path = tmp_path / f"{size}.txt"
        path.write_text(text)
        begun = time.process_time()
        with suppress(InputError):
            read_log(path, recognise_log(path))
        return time.process_time() - begun

    assert work(400_000) < 100.0 * max(work(20_000), 0.01)  # the square would be 400 times


@pytest.mark.parametrize("dialect", [name for name, one in DIALECTS.items() if not one.family])
@pytest.mark.parametrize("filling", [" ", "A", "(", "X(", "X(1),", "MV ", "9", "block "])
def test_a_program_is_read_in_linear_time(dialect: str, filling: str) -> None:
    """The dialects' own beginning, then lines full of what made regular expressions go back and forth."""
    head = {
        "ippdme": "00001 StartSession()\n00002 GoTo(X(1), Y(2), Z",
        "dmis": "DMISMN/'A',05.2\nGOTO/",
        "linuxcnc": "G21 G90\nG38.2 X1 ",
        "jinyoung": "MV 1 2 3 ;\nMV ",
        "fanuc": "#1=1\nG31 X1 ",
        "siemens": "G710\nMEAS=1 G1 X=1 ",
        "heidenhain": "BEGIN PGM A MM\nTCH PROBE 4.2 IX",
        "grbl": "G21\nG10 L2 P6 X0 Y0 Z0\nG38.2 X",
        "rrf": "G21\nif {move.axes[0].userPosition\nG38.2 X",
    }[dialect]

    def work(size: int) -> float:
        text = head + (filling * size)[: size // 2] + "\n" + filling * (size // 2 // len(filling)) + "x\n"
        begun = time.process_time()
        with suppress(InputError):
            DIALECTS[dialect].recognises(text)
            DIALECTS[dialect].execute(text, Reader("p", ProbingSettings()))
        return time.process_time() - begun

    assert work(400_000) < 100.0 * max(work(20_000), 0.01)


def test_a_line_no_controller_writes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.ipp"
    path.write_text("00001 StartSession()\n00002 GoTo(X(1), Y(2), Z" + " " * 20_000 + "(3))\n")
    with pytest.raises(InputError, match=r"p\.ipp:2: the line is too long for a controller"):
        read_program(path, ProbingSettings())


def test_a_gist_is_what_a_format_is_known_by() -> None:
    assert gist("\n\n  \nFA(C1F1)=FEAT/POINT\n" + "x" * 9000) == "FA(C1F1)=FEAT/POINT\n" + "x" * 500


def bomb(path: Path, change: bytes) -> Path:
    """A workbook of which one sheet unpacks to something else."""
    book = openpyxl.Workbook()
    book.active.append(["x", "y", "z"])
    plain = io.BytesIO()
    book.save(plain)
    with zipfile.ZipFile(plain) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data.replace(b"</sheetData>", change + b"</sheetData>") if "sheet1" in name else data)
    return path


def test_a_workbook_is_bounded_before_it_is_unpacked(tmp_path: Path) -> None:
    large = bomb(tmp_path / "large.xlsx", b"<row><c><v>1</v></c></row>" * 2_500_000)
    assert large.stat().st_size < 1_000_000
    with pytest.raises(InputError, match="the workbook is too large; found 65 MB unpacked"):
        read_log(large, "xlsx")
    corner = bomb(tmp_path / "corner.xlsx", b'<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>')
    with pytest.raises(InputError):
        read_log(corner, "xlsx")
    blank = bomb(tmp_path / "blank.xlsx", b"<row></row>" * 60_000 + b"<row><c><v>1</v></c></row>")
    with pytest.raises(InputError, match="has rows without an end; found 50001 blank"):
        read_log(blank, "xlsx")


def test_a_certificate_of_too_many_tags_is_not_parsed(tmp_path: Path) -> None:
    (tmp_path / "c.xml").write_text("<a>" + "<b/>" * 700_000 + "</a>")
    with pytest.raises(InputError, match="too large for a certificate; found 700002 tags"):
        read_xml(tmp_path / "c.xml")


# names and values


def test_a_key_that_is_misspelt_is_named_before_the_one_that_is_missing(tmp_path: Path) -> None:
    shipped = (ROOT / "calibration_data/step-gauge-420.toml").read_text()
    (tmp_path / "g.toml").write_text(shipped.replace("serial =", "serail ="))
    with pytest.raises(InputError, match=r"key gauge\.serail is not known .*expected serial\?"):
        read_gauge(tmp_path / "g.toml")


def test_a_single_uncertainty_in_mm_is_refused(tmp_path: Path) -> None:
    for name in ("step-gauge-420.toml", "step-gauge-420.csv"):
        (tmp_path / name).write_text((ROOT / "calibration_data" / name).read_text())
    rows = (tmp_path / "step-gauge-420.csv").read_text().splitlines()
    line = next(i for i, row in enumerate(rows) if row.startswith("7,"))
    rows[line] = rows[line].rpartition(",")[0] + ",0.0001"
    (tmp_path / "step-gauge-420.csv").write_text("\n".join(rows))
    with pytest.raises(
        InputError, match=rf"step-gauge-420\.csv:{line + 1}: uncertainty_um looks like mm; found 0.0001"
    ):
        read_gauge(tmp_path / "step-gauge-420.toml")


def test_limits_of_options(
    run: Run,  # noqa: F811
    tmp_path: Path,
) -> None:
    common = ("-g", "step-gauge-420", "-m", "bridge-cmm", "-o", tmp_path / "out")
    wide = run("budget", "r.csv", *common, "--u-gauge-temperature", 50)
    assert (wide.code, "out of range; found 50.0; expected 0 to 5 K" in wide.err) == (2, True)
    fine = ("--polar", "0:90:0.001", "--azimuth", "0:360:0.001")
    many = run("probe", "map", "omp40-2-50mm", *fine, "-o", tmp_path / "map.csv")
    assert (many.code, "too many" in many.err) == (2, True)


def test_a_recording_that_excel_has_saved_with_semicolons_is_read(tmp_path: Path) -> None:
    rows = "".join(f"{cycle};1;{cycle},5;3,25;4;1;0;0\n" for cycle in (1, 2, 3))
    (tmp_path / "r.csv").write_text(HEADER.replace(",", ";") + rows)
    assert read_recording(tmp_path / "r.csv").frame["x_mm"].tolist() == [1.5, 2.5, 3.5]
