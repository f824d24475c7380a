"""LinuxCNC's probe log into a recording: every reading at its face and cycle, and no log that is not the program's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stepgauge.correspondence.faces import cycles_of, probed_faces
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, write_placement
from stepgauge.importing.build import ImportOptions, build_recording
from stepgauge.importing.formats import FORMATS
from stepgauge.importing.logs import read_log
from stepgauge.importing.result import Imported
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.plan import ORDERS, ROUTES, PlanOptions, faces_in_order, make_program
from stepgauge.programs import DIALECTS, read_program
from stepgauge.programs.render import render
from stepgauge.recording import read_recording
from tests.build import angles, gauges, inclinations, make_gauge, make_pose, positions
from tests.cli.conftest import command_of

FORMS = ("log", "probeopen")
forms = pytest.mark.parametrize("form", FORMS)
Array = np.ndarray


@dataclass(frozen=True)
class Setup:
    """A planned program as a controller reads it, and what it was planned for."""

    gauge: Gauge
    placement: Placement
    program: Program
    text: str
    options: PlanOptions

    def readings(self, beyond_mm: Array | float) -> Array:
        """Tip centres at triggers so far beyond the nominal contact."""
        measure = self.program.is_measure
        beyond = np.broadcast_to(beyond_mm, self.program.n_points)
        return self.program.position_mm[measure] + beyond[:, None] * self.program.approach[measure]

    def read(self, text: str) -> Imported:
        log = FORMATS["linuxcnc"].read(text, "log.txt")
        return build_recording(log, self.gauge, self.placement, self.program, ImportOptions())


def make_setup(
    gauge: Gauge | None = None, yaw: float = 0.4, pitch: float = 0.05, roll: float = 0.02, **options: object
) -> Setup:
    gauge = gauge or make_gauge(4)
    placement = make_pose(yaw, pitch, roll, (120.0, -40.0, 80.0)).placement(gauge)
    choice = PlanOptions(1, gauge.n_blocks, **{"cycles": 2, **options})  # type: ignore[arg-type]
    text = render(make_program(placement, gauge, choice, ProbingSettings(standoff_mm=1.0)), DIALECTS["linuxcnc"])
    program = DIALECTS["linuxcnc"].read(text, "program.ngc", ProbingSettings())
    return Setup(gauge, placement, program, text, choice)


def rows_of(position_mm: Array, form: str) -> list[str]:
    """The rows that LinuxCNC writes for readings, in either form (the second leaves out repeated readings)."""
    if form == "log":
        return [f"{n} {x:.7f} {y:.7f} {z:.7f} 1" for n, (x, y, z) in enumerate(position_mm, 1)]
    rows = [" ".join(f"{value:.6f}" for value in (*xyz, 0, 0, 0, 0, 0, 0)) for xyz in position_mm]
    return [row for before, row in zip(["", *rows], rows, strict=False) if row != before]


def log_of(position_mm: Array, form: str) -> str:
    return "\n".join(rows_of(position_mm, form)) + "\n"


def digits(form: str) -> float:
    """Half of the last digit a form prints, mm."""
    return 0.51e-7 if form == "log" else 0.51e-6


@forms
@settings(max_examples=25)
@given(
    gauge=gauges(),
    yaw=angles,
    pitch=inclinations,
    roll=angles,
    order=st.sampled_from(ORDERS),
    route=st.sampled_from(ROUTES),
    cycles=st.integers(1, 3),
    data=st.data(),
)
def test_every_reading_gets_its_face_cycle_and_approach(form, gauge, yaw, pitch, roll, order, route, cycles, data):
    setup = make_setup(gauge, yaw, pitch, roll, order=order, route=route, cycles=cycles)
    beyond = np.array(data.draw(st.lists(st.floats(-0.9, 1.9), min_size=setup.program.n_points, max_size=500)))
    readings = setup.readings(beyond[: setup.program.n_points])
    if form == "probeopen" and order == "up-down":
        assume(len(rows_of(readings, form)) == len(readings))  # equal neighbours have a test of their own
    frame = setup.read(log_of(readings, form)).recording.frame
    expected = list(faces_in_order(setup.options))
    assert list(zip(frame["cycle"], frame["face"], strict=True)) == expected
    assert np.abs(frame[["x_mm", "y_mm", "z_mm"]].to_numpy() - readings).max() <= digits(form)
    along = frame[["approach_i", "approach_j", "approach_k"]].to_numpy() @ setup.placement.axis
    np.testing.assert_allclose(along, np.where(frame["face"] % 2 == 1, 1.0, -1.0), atol=1e-9)


@settings(max_examples=30)
@given(gauge=gauges(), radius=st.floats(0.3, 3.5), yaw=angles, pitch=inclinations, origin=positions)
def test_faces_do_not_depend_on_the_tip_radius_nor_on_where_the_gauge_lies(gauge, radius, yaw, pitch, origin):
    placement = make_pose(yaw, pitch, 0.1, origin).placement(gauge)
    options = PlanOptions(1, gauge.n_blocks, cycles=2)
    program = make_program(placement, gauge, options, ProbingSettings(tip_radius_mm=radius))
    face = probed_faces(program, gauge, placement)
    assert list(zip(cycles_of(face), face, strict=True)) == list(faces_in_order(options))


@settings(max_examples=30)
@given(step_s=st.lists(st.floats(0.01, 100.0), min_size=16, max_size=16))
def test_the_seconds_of_a_clock_become_the_time_of_the_points(step_s: list[float]):
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), "log")
    time_s = np.cumsum(step_s)
    clocked = "\n".join(f"{row} {t:.4f}" for row, t in zip(rows, time_s, strict=True))
    frame = setup.read(clocked).recording.frame
    assert np.abs(frame["time_s"] - time_s).max() <= 0.51e-4
    assert "time_s" not in setup.read("\n".join(rows)).recording.frame


@pytest.mark.parametrize(("at", "line"), [(0.0, 2), (-3.0, 2)])
def test_a_clock_that_does_not_go_on_is_refused_with_its_line(at: float, line: int):
    rows = rows_of(make_setup().readings(0.1), "log")
    text = "\n".join(f"{row} {at * n:.4f}" for n, row in enumerate(rows))
    with pytest.raises(InputError, match=rf"log.txt:{line}: the clock does not go on; found -?[03]; expected a clock"):
        make_setup().read(text)


@forms
@settings(max_examples=30)
@given(keep=st.integers(1, 15))
def test_a_truncated_log_names_the_first_point_that_is_not_there(form, keep):
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), form)
    with pytest.raises(InputError, match=rf"log.txt:{keep}: the log ends before point {keep + 1} .*expected 16"):
        setup.read("\n".join(rows[:keep]))


@forms
@settings(max_examples=30)
@given(row=st.integers(0, 15), data=st.data())
def test_a_row_that_is_cut_is_named(form, row, data):
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), form)
    cells = rows[row].split()
    rows[row] = " ".join(cells[: data.draw(st.integers(1, len(cells) - 1))])
    text = "\n".join(rows)
    if row == 0 and not FORMATS["linuxcnc"].recognises(text):
        return  # refused as a foreign file before any row is read
    with pytest.raises(InputError, match=r"log.txt:\d+: the row is (cut short|too long)"):
        setup.read(text)


@settings(max_examples=30)
@given(order=st.permutations(range(16)))
def test_shuffled_numbered_rows_are_refused(order):
    assume(list(order) != sorted(order))
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), "log")
    first = next(i for i, n in enumerate(order) if i != n)
    with pytest.raises(InputError, match=rf"log.txt:{first + 1}: .*found point {order[first] + 1}; expected point"):
        setup.read("\n".join(rows[i] for i in order))


@settings(max_examples=30)
@given(order=st.permutations(range(8)))
def test_shuffled_rows_without_numbers_are_refused(order):
    assume(list(order) != sorted(order))
    setup = make_setup(cycles=1)
    rows = rows_of(setup.readings(0.1), "probeopen")
    first = next(i for i, n in enumerate(order) if i != n)
    with pytest.raises(InputError, match=rf"log.txt:{first + 1}: this is not point {first + 1} of the program"):
        setup.read("\n".join(rows[i] for i in order))


@forms
@settings(max_examples=30)
@given(row=st.integers(0, 15))
def test_a_repeated_or_a_missing_row_is_named(form, row):
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), form)
    with pytest.raises(InputError, match=rf"log.txt:{row + 2}: "):
        setup.read("\n".join([*rows[: row + 1], *rows[row:]]))
    with pytest.raises(InputError, match=rf"log.txt:{row + 1 if row < 15 else 15}: "):
        setup.read("\n".join([*rows[:row], *rows[row + 1 :]]))


def test_what_is_off_with_the_numbers_is_said_in_words():
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), "log")
    for text, message in (
        ([*rows[:3], *rows[4:]], "log.txt:4: point 4 is missing; found point 5; expected point 4"),
        ([*rows[:3], rows[2], *rows[3:]], "log.txt:4: point 3 is repeated; found point 3; expected point 4"),
        ([*rows[:3], rows[4], rows[3], *rows[5:]], "log.txt:4: point 4 is out of order; found point 5; expected"),
        ([*rows, rows[0].replace("1 ", "17 ", 1)], "log.txt:17: the program has no such point; found point 17"),
    ):
        with pytest.raises(InputError) as error:
            setup.read("\n".join(text))
        assert str(error.value).startswith(message)


@forms
@settings(max_examples=30)
@given(point=st.integers(0, 15))
def test_a_search_that_went_to_its_end_is_a_missed_point(form, point):
    setup = make_setup()
    beyond = np.full(16, 0.1)
    beyond[point] = setup.program.settings.search_mm
    line = setup.program.line[setup.program.is_measure][point]
    with pytest.raises(InputError, match=rf"log.txt:{point + 1}: point {point + 1} \(program line {line}\) was missed"):
        setup.read(log_of(setup.readings(beyond), form))


def test_a_point_without_contact_is_refused():
    setup = make_setup()
    rows = rows_of(setup.readings(0.1), "log")
    rows[6] = rows[6][:-1] + "0"
    with pytest.raises(InputError, match=r"log.txt:7: the probe did not trigger .*found success flag 0; expected 1"):
        setup.read("\n".join(rows))


@forms
@settings(max_examples=30)
@given(
    point=st.integers(0, 15),
    beyond=st.one_of(st.floats(2.2, 50.0), st.floats(-50.0, -2.2)),
    beside=st.one_of(st.just(0.0), st.floats(0.11, 50.0)),
)
def test_a_point_off_its_search_is_refused(form, point, beyond, beside):
    setup = make_setup()
    readings = setup.readings(0.1)
    readings[point] += beyond * setup.placement.axis * (1 if beside == 0.0 else 0) + beside * setup.placement.side
    with pytest.raises(InputError, match=rf"log.txt:{point + 1}: this is not point {point + 1} of the program"):
        setup.read(log_of(readings, form))


@forms
def test_the_log_of_another_program_is_refused(form):
    setup = make_setup()
    for other in (make_setup(yaw=0.41), make_setup(order="fronts-backs"), make_setup(pitch=0.06)):
        with pytest.raises(InputError, match=r"log.txt:\d+: this is not point \d+ of the program"):
            setup.read(log_of(other.readings(0.1), form))
    with pytest.raises(InputError, match=r"the log goes on after the last point|no such point"):
        setup.read(log_of(make_setup(cycles=3).readings(0.1), form))


def test_probeopen_leaves_out_an_identical_reading_and_it_is_put_back():
    """Cycle 2 of an up-down program starts with the face that cycle 1 ended with."""
    setup = make_setup(order="up-down")
    rows = rows_of(setup.readings(0.1), "probeopen")
    assert len(rows) == 15
    imported = setup.read("\n".join(rows))
    frame = imported.recording.frame
    assert list(zip(frame["cycle"], frame["face"], strict=True)) == list(faces_in_order(setup.options))
    np.testing.assert_allclose(imported.recording.position_mm, setup.readings(0.1), atol=1e-6)
    assert "put back: 1 of the readings" in "\n".join(imported.report)


def test_probeopen_rows_that_cannot_be_told_apart_are_refused():
    """Face 1 three times in a row: with two rows, the second or the third reading may be the one left out."""
    setup = make_setup()
    lines = setup.text.splitlines()
    probe = next(i for i, line in enumerate(lines) if line.startswith("G38.2"))
    lines[probe + 1 : probe + 1] = 2 * lines[probe - 1 : probe + 1]
    program = DIALECTS["linuxcnc"].read("\n".join(lines), "program.ngc", ProbingSettings())
    thrice = Setup(setup.gauge, setup.placement, program, "", setup.options)
    beyond = np.full(18, 0.1)
    assert len(thrice.read(log_of(thrice.readings(beyond), "probeopen")).recording) == 18
    beyond[2] = 0.2
    with pytest.raises(InputError, match=r"log.txt:1: .*probed 3 times in a row.*found 2 rows; expected 3"):
        thrice.read(log_of(thrice.readings(beyond), "probeopen"))
    beyond[1] = 0.3
    read = thrice.read(log_of(thrice.readings(beyond), "probeopen")).recording
    np.testing.assert_allclose(read.position_mm, thrice.readings(beyond), atol=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "this is not a LinuxCNC probe log; found an empty file"),
        ("\n\n# nothing\n", "log.txt:3: this is not a LinuxCNC probe log"),
        ("G21 G90\nG1 X1\n", "log.txt:1: this is not a LinuxCNC probe log; found 'G21 G90'"),
        ("cycle,face,x_mm\n1,1,2.0\n", "log.txt:1: this is not a LinuxCNC probe log"),
        ("1 2.0 3.0\n", "log.txt:1: this is not a LinuxCNC probe log; found '1 2.0 3.0'"),
        ("1 1.0 2.0 3.0 1\n2 nan 2.0 3.0 1\n", "log.txt:2: not a number; found 'nan'"),
        ("1 1.0 2.0 3.0 1\n2 1,0 2.0 3.0 1\n", "log.txt:2: not a number; found '1,0'"),
        ("1 1.0 2.0 3.0 2\n", "log.txt:1: the success flag is wrong; found 2"),
        ("0 1.0 2.0 3.0 1\n", "log.txt:1: the point's number is wrong; found 0"),
        ("1.0 2.0 3.0 0.5 0 0 0 0 0\n", "log.txt:1: an axis other than x, y, z was moved"),
    ],
)
def test_foreign_files_are_named_for_what_they_are(tmp_path: Path, text: str, message: str):
    path = tmp_path / "log.txt"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_log(path, "linuxcnc")
    assert message in str(error.value)


def test_a_placement_that_the_program_was_not_planned_for_is_refused():
    setup = make_setup()
    for pose, message in (
        (make_pose(0.4 + 0.3, 0.05, 0.02, (120.0, -40.0, 80.0)), "is not along the gauge as placed"),
        (make_pose(0.4, 0.05, 0.02, (120.0, -40.0, 90.0)), "is aimed beside the blocks"),
        (make_pose(0.4, 0.05, 0.02, (0.0, -40.0, 80.0)), "meets no front face|is aimed beside the blocks"),
    ):
        with pytest.raises(InputError, match=message) as error:
            probed_faces(setup.program, setup.gauge, pose.placement(setup.gauge))
        assert str(error.value).startswith("program.ngc:")
    longer = make_gauge(4, size=11.0)
    with pytest.raises(InputError, match=r"does not stand before face \d+ as the others do"):
        probed_faces(setup.program, longer, make_pose(0.4, 0.05, 0.02, (120.0, -40.0, 80.0)).placement(longer))


def test_beyond_the_last_front_and_before_the_first_back_there_is_nothing_to_meet():
    setup = make_setup()
    for shift, side in ((-80.0, "front"), (80.0, "back")):
        pose = make_pose(0.4, 0.05, 0.02)
        origin = np.array([120.0, -40.0, 80.0]) + shift * pose.rotation[0]
        moved = make_pose(0.4, 0.05, 0.02, tuple(origin)).placement(setup.gauge)
        with pytest.raises(InputError, match=f"meets no {side} face of the gauge as placed"):
            probed_faces(setup.program, setup.gauge, moved)


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    """A program, its log and a placement of the shipped gauge on disk, as arguments of the verb."""
    gauge = read_gauge("step-gauge-420")
    setup = make_setup(gauge)
    (tmp_path / "program.ngc").write_text(setup.text)
    (tmp_path / "log.txt").write_text("# from the machine\n\n" + log_of(setup.readings(0.0123), "log"))
    write_placement(tmp_path / "placement.toml", setup.placement)
    names = {name: str(tmp_path / name) for name in ("log.txt", "program.ngc", "placement.toml", "recording.csv")}
    return [
        *(names["log.txt"], "--format", "linuxcnc", "--program", names["program.ngc"], "--gauge", "step-gauge-420"),
        *("--placement", names["placement.toml"], "-o", names["recording.csv"]),
    ]


def test_the_verb_writes_a_recording_and_says_what_it_mapped(files: list[str]):
    arguments = [*files, "--placement-number", "3", "--gauge-temperature", "20.4"]
    result = CliRunner().invoke(command_of("import"), arguments, catch_exceptions=False)
    assert result.exit_code == 0
    for words in ("84 rows, 84 points", "faces 1 to 42 (42 of them), cycles per face: 2", "dropped: 2 lines"):
        assert words in result.stderr
    recording = read_recording(files[-1])
    program = read_program(files[4], ProbingSettings())
    assert recording.placements == [3]
    assert set(recording.frame["gauge_temperature_C"]) == {20.4}
    assert set(recording.frame["speed_mm_s"]) == {3.0}
    assert set(recording.comments) == {"program", "log", "gauge", "gauge_serial", "import"}
    assert recording.comments["gauge_serial"] == "SG-420-001"
    beyond = ((recording.position_mm - program.position_mm[program.is_measure]) * recording.approach).sum(axis=1)
    np.testing.assert_allclose(beyond, 0.0123, atol=2e-7)


def test_the_verb_writes_nothing_when_the_log_does_not_fit(files: list[str]):
    log = Path(files[0])
    log.write_text("\n".join(log.read_text().splitlines()[:40]))
    with pytest.raises(InputError, match="the log ends before point 39"):
        CliRunner().invoke(command_of("import"), files, catch_exceptions=False)
    assert sorted(path.name for path in log.parent.iterdir()) == ["log.txt", "placement.toml", "program.ngc"]


def test_a_number_of_a_point_beyond_all_counting_is_refused() -> None:
    text = "1 1.0 2.0 3.0 1\n" + "9" * 30 + " 1.0 2.0 3.0 1\n"
    with pytest.raises(InputError, match=r"log:2: the point's number is wrong"):
        FORMATS["linuxcnc"].read(text, "log")
