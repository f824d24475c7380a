"""Answers that cannot be: the measurement stops at that point, draws back, loses nothing, and is resumed to its end."""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.attack.answers import LIES, OTHERS, SAME_MM, Bench, Liar, attack, bench
from stepgauge.cli import main as stepgauge
from stepgauge.errors import InputError
from stepgauge.importing.ippdme import read
from stepgauge.live.controller import Link, MeasuredPoint
from stepgauge.live.in_process import VirtualLink
from stepgauge.live.journal import Journal, resume, start
from stepgauge.live.linuxcnc import LinuxCnc
from stepgauge.live.machine_state import MachineState
from stepgauge.live.measuring import MeasurementStoppedError, measure
from stepgauge.live.measuring_job import Job, make_job
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from stepgauge.recording import read_recording
from stepgauge.verbs.inputs import moves_of_plan
from tests.live.made import make_state, write_files
from tests.live.test_linuxcnc import Played
from tests.live.test_measure import check_whole, make, true_positions


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("truth")) as made:
        yield made


@pytest.mark.parametrize("name", [*LIES, *OTHERS])
def test_a_false_answer_of_a_server(place: Bench, tmp_path: Path, name: str) -> None:
    """At the first point, at one in the middle, and where the same face is probed twice in a row."""
    pick = random.Random(name)
    point = pick.choice([1, 4, 7])
    assert attack(place, tmp_path, name, point, pick) == ""


def test_the_verb_says_it_in_one_line_with_exit_code_2_and_resumes(
    place: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = write_files(tmp_path, place.machine, place.gauge, place.placement)
    job = make_job(moves_of_plan(place.plan), place.machine, place.gauge, place.placement)
    (tmp_path / "gauge.ipp").write_text(render(job.program, DIALECTS["ippdme"]))
    files = [word for pair in words.items() for word in pair]
    command = ["measure", str(tmp_path / "gauge.ipp"), *files, "--homing", "-o", str(tmp_path / "r.csv")]
    with Liar(place.port, "Z + 50 mm", 4, random.Random(1)).listening() as port, pytest.raises(SystemExit) as ended:
        stepgauge([*command, "--server", f"127.0.0.1:{port}"])
    told = capsys.readouterr().err
    assert ended.value.code == 2
    (line,) = [one for one in told.splitlines() if "error" in one]
    assert "cycle 1, face 4: the answer is not on the line of its search; found (" in line
    assert "3 of 12 points measured" in line
    assert line.endswith("; drawn back, --resume goes on")
    assert not (tmp_path / "r.csv").exists()
    stepgauge([*command, "--server", f"127.0.0.1:{place.port}", "--resume"])
    assert "12 points measured" in capsys.readouterr().err
    assert read_recording(tmp_path / "r.csv").position_mm == pytest.approx(place.truth.position_mm, abs=SAME_MM)


class Lying(VirtualLink):
    """The virtual CMM of this process, that tells something false at one point."""

    def __init__(
        self, state: MachineState, job: Job, point: int, lie: Callable[[Lying, MeasuredPoint], MeasuredPoint]
    ) -> None:
        super().__init__(state.cmm, job.program.settings)
        self.point, self.lie, self.off_mm, self.degrees = point, lie, np.zeros(3), 0.0
        self.before, self.asked = MeasuredPoint([0.0, 0.0, 0.0]), 1

    def probe(self, surface_mm: np.ndarray, approach: np.ndarray, takes_s: float) -> MeasuredPoint:
        found = super().probe(surface_mm, approach, takes_s)
        self.point -= 1
        told = self.lie(self, found) if self.point == 0 else found
        self.before = found
        return told

    def touched_mm(self, approach: np.ndarray) -> np.ndarray:
        off, self.off_mm = self.off_mm, np.zeros(3)
        return super().touched_mm(approach) + off

    def temperatures_C(self) -> dict[str, float]:
        return {name: value + self.degrees for name, value in super().temperatures_C().items()}


def moved(by_mm: float, axis: int = 0) -> Callable[[Lying, MeasuredPoint], MeasuredPoint]:
    def lie(link: Lying, found: MeasuredPoint) -> MeasuredPoint:
        position = list(found.position_mm)
        position[axis] += by_mm
        return found._replace(position_mm=position)

    return lie


def shifted(link: Lying, found: MeasuredPoint) -> MeasuredPoint:
    """The whole machine: answer and position are off by the same, along the gauge."""
    job_axis = np.asarray(make(1).placement.axis)
    link.off_mm = 0.8 * job_axis
    return found._replace(position_mm=(np.array(found.position_mm) + link.off_mm).tolist())


LIES_OF_LINKS: dict[str, tuple[Callable[[Lying, MeasuredPoint], MeasuredPoint], str]] = {
    "0.6 mm": (moved(0.6), "the answer is not on the line of its search"),
    "50 mm": (moved(50.0, 2), "the answer is not on the line of its search"),
    "no number": (moved(float("nan")), "the answer is not on the line of its search"),
    "infinite": (moved(float("inf")), "the answer is not on the line of its search"),
    "the point before": (lambda link, _: link.before, "this is the answer of cycle 1, face 4 again"),
    "another tip": (lambda _, found: found._replace(radius_mm=1.0), "the server's tool has another tip"),
    "before the search": (
        lambda link, found: found._replace(time_s=link.before.time_s),
        "the answer was made before the search",
    ),
    "the whole machine": (shifted, "the face is not where the certificate and the points before have it"),
}


def in_process(job: Job, path: Path, link: Link, again: bool = False) -> Any:
    journal: Journal = (resume if again else start)(path, job.head())
    try:
        return measure(job, link, journal)
    finally:
        journal.close()


@pytest.mark.parametrize("name", LIES_OF_LINKS)
def test_a_false_answer_of_the_machine_in_this_process(tmp_path: Path, name: str) -> None:
    lie, wrong = LIES_OF_LINKS[name]
    job, state = make(1), make_state()
    with pytest.raises(MeasurementStoppedError) as stopped:
        in_process(job, tmp_path / "j", Lying(state, job, 5, lie))
    assert f"cycle 1, face 5: {wrong}" in str(stopped.value)
    assert "4 of 8 points measured" in str(stopped.value)
    assert "; drawn back, resume goes on" in str(stopped.value)
    assert state.cmm.position_mm[2] > 290.0
    check_whole(in_process(job, tmp_path / "j", VirtualLink(state.cmm, job.program.settings), again=True), 1)


def test_a_tip_that_no_answer_tells_and_that_is_another(tmp_path: Path) -> None:
    """The machine has a ball 1.4 mm larger than its file says: the first back is too far from the first front."""
    job, state = make(1), make_state()

    def larger(link: Lying, found: MeasuredPoint) -> MeasuredPoint:
        link.point, into = 1, 1.0 if link.asked % 2 else -1.0
        link.asked += 1
        link.off_mm = -0.7 * into * np.asarray(job.placement.axis)
        return found._replace(position_mm=(np.array(found.position_mm) + link.off_mm).tolist(), radius_mm=None)

    link = Lying(state, job, 1, larger)
    with pytest.raises(MeasurementStoppedError, match=r"cycle 1, face 2: the face is not where a tip of 2 mm has it"):
        in_process(job, tmp_path / "j", link)


@pytest.mark.parametrize("size_mm", [0.6, -0.6, 1.5])
@pytest.mark.parametrize("point", [1, 2, 8])
def test_an_answer_along_the_search_that_the_machine_does_not_stand_at(
    tmp_path: Path, size_mm: float, point: int
) -> None:
    """Within the search distance, also of the first point, which no other contradicts."""
    job, state = make(1), make_state()

    def lie(link: Lying, found: MeasuredPoint) -> MeasuredPoint:
        return found._replace(position_mm=(np.array(found.position_mm) + size_mm * job.placement.axis).tolist())

    with pytest.raises(MeasurementStoppedError, match=r"does not stand where its answer says|the face is not where"):
        in_process(job, tmp_path / "j", Lying(state, job, point, lie))
    check_whole(in_process(job, tmp_path / "j", VirtualLink(state.cmm, job.program.settings), again=True), 1)


@pytest.mark.parametrize(("degrees", "wrong"), [(273.15, "looks like K"), (-20.0, "exactly 0"), (200.0, "in deg C")])
def test_temperatures_that_no_thermometer_shows(tmp_path: Path, degrees: float, wrong: str) -> None:
    job, state = make(1), make_state(gauge_temperature_C=20.0)
    link = Lying(state, job, 3, lambda one, found: setattr(one, "degrees", degrees) or found)  # type: ignore[func-returns-value]
    with pytest.raises(MeasurementStoppedError, match=r"cycle 1, face 4: .*_C is no temp.*3 of 8 points") as stopped:
        in_process(job, tmp_path / "j", link)
    assert wrong in str(stopped.value)
    check_whole(in_process(job, tmp_path / "j", VirtualLink(state.cmm, job.program.settings), again=True), 1)


def test_a_position_in_doubt_moves_nothing(tmp_path: Path) -> None:
    """The machine says that it stands 30 mm off its path: no way back starts from there."""
    job, state = make(1), make_state()
    link = Lying(state, job, 5, moved(5.0))
    link.position_mm = lambda: state.cmm.position_mm + np.array([30.0, 0.0, 0.0])  # type: ignore[method-assign]
    begin = VirtualLink(state.cmm, job.program.settings)
    begin.prepare(None)  # type: ignore[arg-type]
    link_position, entered = link.position_mm, []

    def honest_at_first() -> np.ndarray:
        entered.append(1)
        return state.cmm.position_mm if len(entered) == 1 else link_position()

    link.position_mm = honest_at_first  # type: ignore[method-assign]
    with pytest.raises(MeasurementStoppedError, match=r"; not drawn back, resume goes on"):
        in_process(job, tmp_path / "j", link)
    assert state.cmm.position_mm[2] < 200.0, "where it was"


class PlayedGauge(Played):
    """LinuxCNC's module on a machine with the gauge; ``latch_mm`` is added to what it latches."""

    def __init__(self, state: MachineState) -> None:
        super().__init__()
        self.cmm, self.latch_mm = state.cmm, np.zeros(3)
        self.cmm.homed = True
        self.now.actual_position[:3] = self.cmm.position_mm.tolist()

    def _mdi(self, block: str) -> None:
        words = {word[0]: float(word[1:]) for word in block.split()[1:]}
        if "X" not in words:
            return
        target = np.array([words[axis] for axis in "XYZ"])
        if block.startswith("G38.2"):
            leg, touch = self.cmm.search(self.cmm.position_mm, target, words["F"] / 60.0)
            self.cmm.arrive(leg)
            self.now.probe_tripped = touch is not None
            assert touch is not None
            self.now.probed_position[:3] = (np.array(self.cmm.indicate(touch)) + self.latch_mm).tolist()
        else:
            self.cmm.arrive(self.cmm.leg(target, words["F"] / 60.0))
        self.now.actual_position[:3] = self.cmm.position_mm.tolist()


def test_a_latch_of_linuxcnc_that_cannot_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The register still holds another value, or the machine did not stop there: nothing false is in the journal."""
    monkeypatch.setattr("stepgauge.live.linuxcnc.POLL_S", 1e-4)
    job, state = make(1), make_state()
    played = PlayedGauge(state)
    monkeypatch.setitem(sys.modules, "linuxcnc", played)

    def spoil(done: int, *_: float) -> None:
        played.latch_mm = 0.7 * np.asarray(job.placement.axis) * (done == 3)

    journal = start(tmp_path / "j", job.head())
    with pytest.raises(MeasurementStoppedError, match=r"linuxcnc: cycle 1, face 4: .*3 of 8 points.*; drawn back"):
        measure(job, LinuxCnc(job.program.settings), journal, progress=spoil)
    journal.close()
    played.latch_mm = np.zeros(3)
    recording = in_process(job, tmp_path / "j", LinuxCnc(job.program.settings), again=True)
    assert recording.position_mm == pytest.approx(true_positions(1), abs=3e-6)


LOG = """00010 PtMeas(X(1), Y(2), Z(3), IJK(-1, 0, 0))
00010 &
00010 # X(1.5), Y(2), Z(3)
00010 %
00020 EndSession()
"""


@pytest.mark.parametrize(
    ("instead", "line"),
    [
        ("00010 # X(1.5), Y(2), Z(3), X(1.6)", 3),
        ("00010 # X(1.5), Y(2), Z(3)\n00010 # X(1.7), Y(2), Z(3)", 4),
        ("00010 # X(1.5), Y(2), Z(3)\n00010 # X(1.5), Y(2), Z(3)", 4),
    ],
)
def test_import_judges_doubled_words_of_a_log_alike(instead: str, line: int) -> None:
    assert len(read(LOG, "log")) == 1
    with pytest.raises(InputError, match=rf"log:{line}: X\(\.\.\) is there twice"):
        read(LOG.replace("00010 # X(1.5), Y(2), Z(3)", instead), "log")


def test_import_judges_doubled_words_of_a_command_alike() -> None:
    with pytest.raises(InputError, match=r"log:1: IJK\(\.\.\) is there twice"):
        read(LOG.replace("IJK(-1, 0, 0)", "IJK(-1, 0, 0), IJK(1, 0, 0)"), "log")
