"""The client against the server over a real socket: what is measured, what is refused, and what survives."""

from __future__ import annotations

import contextlib
import json
import random
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.importing.logs import import_log
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.connection import Address, Connection, ConnectionLostError, SessionLog, UnaskedError
from stepgauge.live.controller import Controller, ControllerOptions
from stepgauge.live.faults import NEVER_UNASKED, NUMBERS, Faults
from stepgauge.live.journal import journal_of, resume, start
from stepgauge.live.machine_state import MachineState
from stepgauge.live.measuring import (
    MEANING,
    RETREATS,
    MeasurementStoppedError,
    StoppedByPersonError,
    measure,
)
from stepgauge.live.measuring_job import Job, make_job
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from stepgauge.recording import POSITION, Recording, read_recording
from stepgauge.recording.identity import check_recording
from tests.build import heed_interrupts, make_pose
from tests.live.made import Raw, events, lying, make_state, serving, small_gauge, small_machine, small_program
from tests.live.test_server import files, serve  # noqa: F401

CYCLES = 3
KILLS = 1
"""Of client and of server; benchmarks/live.py kills a hundred times."""


def make(cycles: int = CYCLES, **job: Any) -> Job:
    gauge, machine = small_gauge(), small_machine()
    return make_job(small_program(gauge, machine, cycles), machine, gauge, lying(gauge), **job)


def run(job: Job, port: int, path: Path, again: bool = False, **more: Any) -> Recording:
    """One session of a measurement."""
    connection = Connection(
        Address("127.0.0.1", port), more.pop("spy", None), more.pop("stop", None), more.pop("silence_s", 5.0)
    )
    journal = (resume if again else start)(path, job.head())
    try:
        link = Controller(connection, job.program.settings, job.machine.longest_move_mm)
        return measure(job, link, journal, wishes=more.pop("wishes", ControllerOptions(home=True)), **more)
    finally:
        journal.close()
        connection.close()


def true_positions(cycles: int = CYCLES) -> np.ndarray:
    """What the machine indicates, computed at once."""
    gauge, machine = small_gauge(), small_machine()
    program = replace(small_program(gauge, machine, cycles), self_positioning=True)
    return run_program(program, machine, gauge, lying(gauge), seed=0).recording.position_mm


def check_whole(recording: Recording, cycles: int = CYCLES) -> None:
    """Every point once, where it truly is, in the order of the program, at rising times."""
    gauge = small_gauge()
    assert recording.frame["face"].tolist() == list(range(1, gauge.n_faces + 1)) * cycles
    assert recording.frame["cycle"].tolist() == np.repeat(range(1, cycles + 1), gauge.n_faces).tolist()
    assert recording.position_mm == pytest.approx(true_positions(cycles), abs=2e-6)
    assert (np.diff(recording.frame["time_s"]) > 0.0).all()
    check_recording(recording, gauge)


def test_a_program_is_measured_as_it_is_simulated(tmp_path: Path) -> None:
    done: list[tuple[int, int, float]] = []
    with serving(make_state(gauge_temperature_C=20.0)) as port:
        recording = run(make(), port, tmp_path / "j", progress=lambda *told: done.append(told))
    check_whole(recording)
    assert [one[0] for one in done] == list(range(1, 25))
    assert done[-1][1:] == (24, 0.0)
    assert done[0][2] > done[1][2] > 0.0
    assert recording.frame["speed_mm_s"].unique() == [3.0]
    assert recording.frame["scale_temperature_x_C"].unique() == [20.0]
    gauge = small_gauge()
    recording.write(tmp_path / "recording.csv")
    evaluation = evaluate(read_recording(tmp_path / "recording.csv"), gauge)
    assert evaluation.results[0].radius.r_eff_mm == pytest.approx(2.0 - 0.003, abs=1e-4)


def test_the_temperature_of_the_person_wins_and_the_placement_is_numbered(tmp_path: Path) -> None:
    with serving() as port:
        recording = run(make(1, gauge_temperature_C=21.5, placement_number=3), port, tmp_path / "j")
    assert recording.frame["gauge_temperature_C"].unique() == [21.5]
    assert recording.placements == [3]


@pytest.mark.parametrize("live", [False, True])
def test_a_virtual_machine_that_corrects_to_20_does_so(tmp_path: Path, live: bool) -> None:
    """A gauge at 24 deg C: the certified distances are read, and no expansion; the errors are the same."""
    gauge, readings = small_gauge(), {}
    for convention in ("as_read", "corrected_to_20"):
        machine = small_machine()
        machine = replace(machine, table=machine.table.model_copy(update={"temperature_convention": convention}))
        program, conditions = small_program(gauge, machine, 1), RunConditions(gauge_temperature_C=24.0)
        if live:
            job = make_job(program, machine, gauge, lying(gauge))
            with serving(make_state(gauge_temperature_C=24.0)) as port:
                recording = run(job, port, tmp_path / convention)
        else:
            recording = run_program(program, machine, gauge, lying(gauge), 1, conditions).recording
        assert recording.comments["temperature_convention"] == convention
        readings[convention] = recording
    as_read, corrected = (readings[one] for one in ("as_read", "corrected_to_20"))
    along = (as_read.position_mm - as_read.position_mm[0]) @ lying(gauge).axis
    shrunk = along - (corrected.position_mm - corrected.position_mm[0]) @ lying(gauge).axis
    np.testing.assert_allclose(shrunk, along * gauge.table.expansion_per_K * 4.0, rtol=1e-3, atol=1e-6)
    errors = [evaluate(one, gauge).results[0].xf_um for one in (as_read, corrected)]
    np.testing.assert_allclose(*errors, atol=0.01)


def test_times_are_those_of_the_machine(tmp_path: Path) -> None:
    """A drift that acts by the clock of the machine is found at the recorded times."""
    table = {"kind": "thermal_drift", "direction": "x", "rate_um_per_h": 3600.0}
    from tests.live.made import with_effects

    with serving(make_state(faults=with_effects(table))) as port:
        recording = run(make(1), port, tmp_path / "j")
    shift_um = (recording.position_mm - true_positions(1))[:, 0] * 1e3
    assert shift_um == pytest.approx(recording.frame["time_s"].to_numpy(), abs=2e-3)


STOPS = [kind for kind in NUMBERS if kind != "connection_lost"]


@pytest.mark.parametrize("kind", STOPS)
def test_an_error_of_the_machine_ends_in_one_line_and_is_resumed(tmp_path: Path, kind: str) -> None:
    """Emergency stop, collision, missed face, probe not free, limit switch: nothing is lost, nothing measured twice."""
    state = make_state(faults=events({"kind": kind, "after_points": 7}))
    with serving(state) as port:
        with pytest.raises(MeasurementStoppedError) as stopped:
            run(make(), port, tmp_path / "j")
        line = str(stopped.value)
        assert f"error {NUMBERS[kind]:04d}" in line
        assert "cycle 1, face 8, 7 of 24 points measured" in line
        assert "the same command with resume" in line
        assert len((tmp_path / "j").read_text().splitlines()) == 8
        drawn_back = state.cmm.position_mm[2] > 290.0
        assert drawn_back == (NUMBERS[kind] in RETREATS), "only where nothing is wrong with it"
        assert state.cmm.completed == 7
        check_whole(run(make(), port, tmp_path / "j", again=True))
        assert state.cmm.completed == 24


def test_a_connection_that_is_lost_is_resumed(tmp_path: Path) -> None:
    state = make_state(faults=events({"kind": "connection_lost", "after_points": 11}))
    with serving(state) as port:
        with pytest.raises(MeasurementStoppedError, match=r"connection was lost.*11 of 24 points measured"):
            run(make(), port, tmp_path / "j")
        time.sleep(0.2)
        check_whole(run(make(), port, tmp_path / "j", again=True))
    assert state.cmm.completed == 24


def test_a_real_collision_ends_in_one_line(tmp_path: Path) -> None:
    """The gauge lies 8 mm off its placement: the path leads into a block."""
    gauge = small_gauge()
    off = make_pose(0.5, 0.03, 0.01, (157.0, 153.8, 100.2)).placement(gauge)
    with serving(make_state(placement=off)) as port, pytest.raises(MeasurementStoppedError) as stopped:
        run(make(), port, tmp_path / "j")
    assert re.search(r"the probe touched something on its way|collision|no face where", str(stopped.value))


def test_a_gauge_that_is_not_there_is_a_missed_face(tmp_path: Path) -> None:
    gauge = small_gauge()
    off = make_pose(0.5, 0.03, 0.01, (150.0, 150.0, 60.0)).placement(gauge)
    state = make_state(placement=off)
    with (
        serving(state) as port,
        pytest.raises(MeasurementStoppedError, match=r"no face where.*cycle 1, face 1, 0 of 24"),
    ):
        run(make(), port, tmp_path / "j")
    assert state.cmm.position_mm[2] > 290.0, "out along the stylus"


def test_a_person_stops_and_goes_on(tmp_path: Path) -> None:
    state = make_state()
    with serving(state) as port:
        journal = tmp_path / "j"  # what the client has, not what the server has done: its answer may be on the way

        def five() -> bool:
            return journal.exists() and journal.read_bytes().count(b'{"point": ') >= 5

        with pytest.raises(StoppedByPersonError, match=r"5 of 24 points measured"):
            run(make(), port, journal, stop=five)
        assert state.cmm.position_mm[2] > 290.0
        check_whole(run(make(), port, tmp_path / "j", again=True))
    assert state.cmm.completed == 24


def test_a_stop_before_the_first_move_moves_nothing(tmp_path: Path) -> None:
    state = make_state()
    state.cmm.homed = True
    gauge = small_gauge()
    state.cmm.position_mm = here = lying(gauge).to_machine(gauge, [-40.0, 0.0, 60.0])
    with serving(state) as port, pytest.raises(StoppedByPersonError, match="0 of 24 points measured"):
        run(make(), port, tmp_path / "j", stop=lambda: True)
    assert (state.cmm.position_mm == here).all()


def test_an_interrupt_of_python_stops_the_machine_too(tmp_path: Path) -> None:
    """As the stop button of a notebook does, in the middle of whatever runs."""
    state = make_state(speed=30.0)

    def stop() -> bool:
        if state.cmm.completed >= 3:
            raise KeyboardInterrupt
        return False

    with serving(state) as port:
        with pytest.raises(KeyboardInterrupt, match=r"3 of 24 points measured"):
            run(make(), port, tmp_path / "j", stop=stop)
        assert state.cmm.position_mm[2] > 290.0
        check_whole(run(make(), port, tmp_path / "j", again=True))


def test_the_public_function_measures_a_plan_and_resumes_it(tmp_path: Path) -> None:
    gauge, machine = small_gauge(), small_machine()
    plan = sg.plan(lying(gauge), gauge, machine, cycles=CYCLES)
    with serving() as port:
        more: dict[str, Any] = {"server": f"127.0.0.1:{port}", "journal": tmp_path / "j", "homing": True}
        check_whole(sg.measure(plan, machine, gauge, lying(gauge), **more, spy=tmp_path / "spy.log"))
    check_whole(sg.measure(plan, machine, gauge, lying(gauge), **more, resume=True))
    with pytest.raises(InputError, match="neither a file nor what is read from one"):
        sg.measure(3, machine, gauge, lying(gauge), **more)  # type: ignore[arg-type]


def test_a_stop_in_a_move_aborts_it_and_draws_back(tmp_path: Path) -> None:
    state = make_state(speed=30.0)
    began = time.monotonic()
    with serving(state) as port:
        with pytest.raises(StoppedByPersonError):
            run(make(), port, tmp_path / "j", stop=lambda: time.monotonic() > began + 1.5)
        assert state.cmm.position_mm[2] > 290.0
        measured = state.cmm.completed
        assert 0 <= measured < 24
        check_whole(run(make(), port, tmp_path / "j", again=True))
    assert state.cmm.completed == 24


REFUSED: dict[str, tuple[Callable[[MachineState], object], ControllerOptions, str]] = {
    "not homed": (lambda _: None, ControllerOptions(), "the machine is not homed.*or homing"),
    "slower": (
        lambda state: _limit(state, "PtMeasPar", 2.0),
        ControllerOptions(home=True),
        "does not take Tool.PtMeasPar.Speed",
    ),
    "slow way": (
        lambda state: _limit(state, "GoToPar", 10.0),
        ControllerOptions(home=True),
        "does not take Tool.GoToPar.Speed",
    ),
}


def _limit(state: MachineState, block: str, most: float) -> None:
    state.active.blocks[block]["Speed"].high = most


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_unsafe_is_refused_before_the_machine_moves(tmp_path: Path, case: str) -> None:
    prepare, wishes, wrong = REFUSED[case]
    state = make_state()
    prepare(state)
    home = state.cmm.position_mm.copy()
    with serving(state) as port, pytest.raises(InputError, match=wrong):
        run(make(), port, tmp_path / "j", wishes=wishes)
    assert (state.cmm.position_mm == home).all()


def test_a_tool_that_the_server_does_not_know(tmp_path: Path) -> None:
    with serving() as port, pytest.raises(MeasurementStoppedError, match=r"does not know the tool.*1502"):
        run(make(), port, tmp_path / "j", wishes=ControllerOptions("Chair", home=True))


def test_a_tip_that_is_another_one_is_refused_after_the_first_point(tmp_path: Path) -> None:
    other = small_machine()
    other = replace(other, probe=other.probe.model_copy(update={"tip_radius_mm": 2.5}))
    with serving(make_state(machine=other)) as port, pytest.raises(InputError, match=r"another tip.*2.5 mm"):
        run(make(), port, tmp_path / "j")


def test_there_is_no_way_out_of_the_gauge(tmp_path: Path) -> None:
    """The server says that the tip is inside a block: its coordinates are not those of the placement."""
    state = make_state()
    state.cmm.homed = True
    gauge = small_gauge()
    state.cmm.position_mm = lying(gauge).to_machine(gauge, [5.0, 0.0, 0.0])
    here = state.cmm.position_mm.copy()
    with serving(state) as port, pytest.raises(InputError, match=r"no safe way from where it stands"):
        run(make(), port, tmp_path / "j")
    assert (state.cmm.position_mm == here).all()


@pytest.mark.parametrize("place", [(15.0, 0.0, 0.0), (17.99, 0.0, 0.0), (15.0, 14.0, 0.0), (-40.0, 0.0, 60.0)])
def test_a_safe_way_leads_from_wherever_the_machine_stands(tmp_path: Path, place: tuple[float, ...]) -> None:
    """Between two blocks, at a face, beside the gauge, before it."""
    state = make_state()
    state.cmm.homed = True
    gauge = small_gauge()
    state.cmm.position_mm = lying(gauge).to_machine(gauge, place)
    with serving(state) as port:
        recording = run(make(), port, tmp_path / "j")
    check_whole(recording)
    assert len(recording) == CYCLES * gauge.n_faces


def test_speeds_and_travel_are_checked_again() -> None:
    gauge, machine = small_gauge(), small_machine()
    program = small_program(gauge, machine)
    fast = replace(program, settings=replace(program.settings, measuring_speed_mm_s=90.0))
    with pytest.raises(InputError, match=r"the measuring speed is beyond the limit of Small CMM"):
        make_job(fast, machine, gauge, lying(gauge))
    with pytest.raises(InputError, match=r"comes too close|does not meet its own face|does not stand before face"):
        make_job(program, machine, gauge, make_pose(0.5, 0.03, 0.01, (151.5, 150.0, 105.0)).placement(gauge))
    with pytest.raises(InputError, match=r"do not all start at one distance"):
        make_job(replace(program, settings=replace(program.settings, standoff_mm=1.0)), machine, gauge, lying(gauge))
    with pytest.raises(InputError, match=r"another tip"):
        make_job(replace(program, settings=replace(program.settings, tip_radius_mm=1.0)), machine, gauge, lying(gauge))


def test_the_log_of_the_spy_is_imported_as_the_recording(tmp_path: Path) -> None:
    gauge, machine = small_gauge(), small_machine()
    with serving() as port:
        spy = SessionLog(tmp_path / "spy.log", {"server": "here"})
        recording = run(make(), port, tmp_path / "j", spy=spy)
        spy.close()
    text = render(small_program(gauge, machine, CYCLES), DIALECTS["ippdme"])
    program = DIALECTS["ippdme"].read(text, "gauge.ipp", small_program(gauge, machine).settings)
    imported = import_log(tmp_path / "spy.log", "ippdme", gauge, lying(gauge), program).recording
    for name in [*POSITION, "time_s", "cycle", "face", "gauge_temperature_C"]:
        assert imported.frame[name].to_numpy() == pytest.approx(recording.frame[name].to_numpy(), abs=1e-6)


def test_a_read_program_is_measured_like_the_plan(tmp_path: Path) -> None:
    gauge, machine = small_gauge(), small_machine()
    planned = small_program(gauge, machine, CYCLES)
    for dialect in ("dmis", "ippdme"):
        program = DIALECTS[dialect].read(render(planned, DIALECTS[dialect]), "program", planned.settings)
        with serving() as port:
            recording = run(make_job(program, machine, gauge, lying(gauge)), port, tmp_path / dialect)
        assert recording.position_mm == pytest.approx(true_positions(), abs=3e-6)


@contextmanager
def fake(*answers: bytes | None) -> Iterator[int]:
    """A server that answers the first line with these bytes and then says nothing; None: it hangs up."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def answer() -> None:
            client, _ = listener.accept()
            with client, contextlib.suppress(OSError):
                client.settimeout(10.0)
                client.recv(100)
                for one in answers:
                    if one is None:
                        return
                    client.sendall(one)
                client.recv(100)

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        yield int(listener.getsockname()[1])
        thread.join(12.0)


@pytest.mark.parametrize(
    ("answers", "wrong"),
    [
        ((None,), "the server closed the connection"),
        ((), "the server was silent for"),
        ((b"HTTP/1.1 400 Bad Request\r\n",), "this is no answer of I.. DME; found 'HTTP/1.1 400"),
        ((b"\xff" * 200_000,), "this is no answer of I.. DME"),
        ((b"00001 &\r\n00001 ", None), "the server closed the connection"),
        ((b"00077 &\r\n00077 %\r\n",), "the server answers a command that was not sent; found '00077 &"),
        ((b"00001 &\r\n00002 &\r\n",), "the server answers a command that was not sent; found '00002 &"),
        ((b"00001 # X(1)\r\n00001 &\r\n",), "an answer out of its order; found '00001 # X"),
        ((b"00001 %\r\n",), "an answer out of its order; found '00001 %"),
        ((b"00001 &\r\n00001 &\r\n",), "an answer out of its order; found '00001 &"),
    ],
)
def test_servers_that_speak_nothing_or_another_language(tmp_path: Path, answers: Any, wrong: str) -> None:
    with fake(*answers) as port, pytest.raises(MeasurementStoppedError, match=wrong):
        run(make(), port, tmp_path / "j", silence_s=0.5)


def test_an_error_that_nobody_asked_for_explains_an_abort() -> None:
    lines = (
        b'00001 &\r\nE0000 ! Error(3, 0500, "", "Emergency stop")\r\n00001 ! Error(2, 0006, "GoTo", "x")\r\n00001 %\r\n'
    )
    with fake(lines) as port:
        connection = Connection(Address("127.0.0.1", port), silence_s=1.0)
        with pytest.raises(DmeError, match=r"0500 Emergency stop"):
            connection.ask("GoTo(X(1))")
        connection.close()


OWN = [kind for kind in NUMBERS if kind not in NEVER_UNASKED]


@pytest.mark.parametrize("kind", OWN)
def test_an_error_that_the_machine_says_between_commands_ends_in_one_line(tmp_path: Path, kind: str) -> None:
    """It comes after the fifth point is complete: that point counts, and nothing moves any more."""
    state, job = make_state(faults=events({"kind": kind, "after_points": 5, "unasked": True})), make(1)
    with serving(state) as port:
        with pytest.raises(MeasurementStoppedError) as stopped:
            run(job, port, tmp_path / "j")
        assert re.search(rf"{MEANING[NUMBERS[kind]]}.*error {NUMBERS[kind]:04d} .*face 6, 5 of 8", str(stopped.value))
        assert state.cmm.position_mm[2] < 200.0, "where it was"
        check_whole(run(job, port, tmp_path / "j", again=True), 1)
        assert state.cmm.completed == 8


def test_a_machine_that_is_moved_by_hand_stops_there_and_goes_on_by_a_safe_way(tmp_path: Path) -> None:
    table = {"after_points": 4}
    state = make_state(faults=events({"kind": "key_press", **table}, {"kind": "moved_by_hand", **table}))
    spy = SessionLog(tmp_path / "spy.log", {})
    with serving(state) as port:
        with pytest.raises(MeasurementStoppedError, match=r"moved the machine by hand.*error 9001 .*4 of 8"):
            run(make(1), port, tmp_path / "j", spy=spy)
        said = (tmp_path / "spy.log").read_text()
        assert 'E0000 # KeyPress("DONE")' in said
        assert "E0000 # GoTo(X(" in said
        check_whole(run(make(1), port, tmp_path / "j", again=True), 1)
    spy.close()
    assert state.cmm.completed == 8


def test_an_emergency_stop_before_the_first_move(tmp_path: Path) -> None:
    state = make_state(speed=40.0, faults=events({"kind": "emergency_stop", "time_s": 0.0, "unasked": True}))
    with serving(state) as port, pytest.raises(MeasurementStoppedError, match=r"emergency stop: .*error 0500"):
        run(make(1), port, tmp_path / "j")
    assert (state.cmm.position_mm == state.cmm.home_mm).all()


def test_an_emergency_stop_in_a_move(tmp_path: Path) -> None:
    """By the clock, one second after a point: the machine stands at once."""
    state = make_state(speed=30.0)

    def press(done: int, *_: float) -> None:
        if done == 3:
            table = {"kind": "emergency_stop", "time_s": state.cmm.clock.now_s + 1.0, "unasked": True}
            state.cmm.faults.events.extend(events(table).events)

    with serving(state) as port:
        with pytest.raises(MeasurementStoppedError, match=r"emergency stop: .*error 0500 .*3 of 8 points"):
            run(make(1), port, tmp_path / "j", progress=press)
        here = state.cmm.position_mm.copy()
        time.sleep(0.1)
        assert (state.cmm.position_mm == here).all()
        check_whole(run(make(1), port, tmp_path / "j", again=True), 1)
    assert state.cmm.completed == 8


@pytest.mark.parametrize(
    ("said", "number"),
    [
        (b'E0000 ! Error(3, 1009, "", "Air pressure out of range")\r\n', 1009),
        (b"E0000 # PtMeas(X(1), Y(2), Z(3), IJK(0, 0, 1))\r\n", 9001),
        (b'E0000 ! Error(1, 0504, "", "x")\r\nE0000 # KeyPress("F1")\r\n', None),
    ],
)
@pytest.mark.parametrize("when", ["in", "after", "before it hangs up"])
def test_what_a_machine_says_by_itself(said: bytes, number: int | None, when: str) -> None:
    """In a command that it completes all the same, between two, and before the connection breaks."""
    answers = {
        "in": (b"00001 &\r\n" + said + b"00001 %\r\n" + (b"E0001 &\r\nE0001 %\r\n" if number else b""),),
        "after": (b"00001 &\r\n00001 %\r\n" + said,),
        "before it hangs up": (b"00001 &\r\n" + said, None),
    }[when]
    with fake(*answers) as port:
        connection = Connection(Address("127.0.0.1", port), silence_s=0.3)
        with pytest.raises(UnaskedError if number else ConnectionLostError) as raised:
            [connection.ask(f"GoTo(X({x}))") for x in (1, 2)]
        connection.close()
    assert number is None or getattr(raised.value, "number", None) == number
    assert [one.number for one in connection.warnings] == ([] if number else [504])


def test_a_server_that_is_occupied_says_so(tmp_path: Path) -> None:
    with serving() as port:
        other = Raw(port)
        other.ask("StartSession()")
        with pytest.raises(MeasurementStoppedError, match=r"error 8000 Another client is connected: 127.0.0.1:\d+ at"):
            run(make(1), port, tmp_path / "j")
        other.close()
        check_whole(run(make(1), port, tmp_path / "j", again=True), 1)


def test_a_client_that_was_let_go_is_told_why() -> None:
    with serving(client_idle_s=0.2) as port:
        connection = Connection(Address("127.0.0.1", port))
        connection.ask("StartSession()")
        time.sleep(0.4)
        with pytest.raises(UnaskedError, match=r"8001 Idle for 0.2 s: the session is ended"):
            connection.ask("Home()")
        connection.close()


def test_where_no_server_is() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(InputError, match=rf"127.0.0.1:{port}: no I.. DME server answers here"):
        Connection(Address("127.0.0.1", port))


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("cmm", Address("cmm")),
        ("cmm:5000", Address("cmm", 5000)),
        ("[::1]:1294", Address("::1")),
        ("::1", None),
        ("a:0", None),
        ("a b", None),
        ("", None),
    ],
)
def test_addresses(text: str, address: Address | None) -> None:
    if address is None:
        with pytest.raises(InputError, match=r"no address"):
            Address.parse(text)
    else:
        assert Address.parse(text) == address
        assert Address.parse(str(address)) == address


def words(files: dict[str, str]) -> list[str]:  # noqa: F811
    return [word for pair in files.items() for word in pair]


@pytest.fixture
def program(files: dict[str, str], tmp_path: Path) -> Path:  # noqa: F811
    """A program in I++ DME of the small gauge."""
    gauge, machine = small_gauge(), small_machine()
    path = tmp_path / "gauge.ipp"
    DIALECTS["ippdme"].read(
        render(small_program(gauge, machine, CYCLES), DIALECTS["ippdme"]), path, small_program(gauge, machine).settings
    )
    path.write_text(render(small_program(gauge, machine, CYCLES), DIALECTS["ippdme"]))
    return path


class Verb:
    """``stepgauge measure`` in a process of its own."""

    def __init__(self, files: dict[str, str], program: Path, port: int, *more: str) -> None:  # noqa: F811
        self.output = program.parent / "recording.csv"
        command = [sys.executable, "-m", "stepgauge", "measure", str(program), *words(files), "--homing"]
        self.command = [*command, "--server", f"127.0.0.1:{port}", "-o", str(self.output), *more]

    def start(self, *more: str) -> subprocess.Popen[str]:
        return subprocess.Popen([*self.command, *more], stderr=subprocess.PIPE, text=True, preexec_fn=heed_interrupts)

    def points(self) -> int:
        """How many points the journal has."""
        path = journal_of(self.output)
        return path.read_bytes().count(b'{"point"') if path.exists() else 0

    def wait_for(self, points: int) -> None:
        until = time.monotonic() + 60.0
        while self.points() < points:
            assert time.monotonic() < until
            time.sleep(0.005)


def test_ctrl_c_stops_draws_back_and_says_how_to_go_on(files: dict[str, str], program: Path) -> None:  # noqa: F811
    server, said = serve(files, "--speed", "15", "--seed", "1")
    verb = Verb(files, program, int(said.strip().rpartition(":")[2]))
    process = verb.start()
    verb.wait_for(4)
    process.send_signal(2)
    _, told = process.communicate(timeout=30.0)
    assert process.returncode == 130
    assert re.search(r"stopped: \d+ of 24 points measured; the same command with --resume goes on", told)
    assert not verb.output.exists()
    before = verb.points()
    done = subprocess.run(verb.command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert "an unfinished measurement is here" in done.stderr
    done = subprocess.run([*verb.command, "--resume"], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert 4 <= before < 24
    check_whole(read_recording(verb.output))
    server.terminate()
    server.communicate(timeout=10.0)


def test_a_client_that_is_killed_loses_no_point_and_measures_none_twice(files: dict[str, str], program: Path) -> None:  # noqa: F811
    server, said = serve(files, "--speed", "40")
    verb = Verb(files, program, int(said.strip().rpartition(":")[2]))
    rng = random.Random(4)
    acknowledged = 0
    for kill in range(KILLS):
        process = verb.start(*["--resume"] * (kill > 0))
        verb.wait_for(acknowledged + 3)
        time.sleep(rng.random() * 0.1)
        process.kill()
        process.communicate(timeout=10.0)
        assert verb.points() >= acknowledged + 3
        acknowledged = verb.points()
    done = subprocess.run([*verb.command, "--resume"], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in journal_of(verb.output).read_text().splitlines()]
    assert [row["point"] for row in rows if "point" in row] == list(range(1, 25))
    check_whole(read_recording(verb.output))
    server.terminate()
    server.communicate(timeout=10.0)


def test_a_server_that_is_killed_loses_no_point_and_measures_none_twice(files: dict[str, str], program: Path) -> None:  # noqa: F811
    acknowledged = 0
    for kill in range(KILLS + 1):
        server, said = serve(files, "--speed", "40")
        verb = Verb(files, program, int(said.strip().rpartition(":")[2]))
        process = verb.start(*["--resume"] * (kill > 0))
        if kill < KILLS:
            verb.wait_for(acknowledged + 3)
            server.kill()
            _, told = process.communicate(timeout=30.0)
            assert process.returncode == 2
            assert "the connection was lost" in told
            assert told.count("\n") <= 3, told
            acknowledged = verb.points()
        else:
            process.communicate(timeout=60.0)
            assert process.returncode == 0
            server.terminate()
        server.communicate(timeout=10.0)
    check_whole(read_recording(verb.output))


def test_a_journal_that_is_complete_needs_no_server(files: dict[str, str], program: Path) -> None:  # noqa: F811
    server, said = serve(files, "--speed", "max", "--seed", "1")
    verb = Verb(files, program, int(said.strip().rpartition(":")[2]), "--spy", str(program.parent / "spy.log"))
    done = subprocess.run(verb.command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    server.terminate()
    server.communicate(timeout=10.0)
    first = verb.output.read_bytes()
    verb.output.unlink()
    done = subprocess.run([*verb.command, "--resume"], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "24 points measured" in done.stderr
    assert verb.output.read_bytes() == first
    assert "EndSession()" in (program.parent / "spy.log").read_text()


def test_without_a_program_the_path_is_planned_with_the_options_of_plan(
    files: dict[str, str],  # noqa: F811
    tmp_path: Path,
) -> None:
    """As the program that plan writes with them; resumed only with the same ones, and never beside a program."""
    from click.testing import CliRunner

    from stepgauge.cli.build import make_command
    from stepgauge.verbs.catalogue import find_verb

    command = make_command("measure", find_verb("measure"))

    path = ["--cycles", "2", "--blocks", "2:3", "--order", "up-down", "--measuring-speed", "2"]
    with serving() as port:
        common = [*words(files), "--server", f"127.0.0.1:{port}", "--homing", "-o", str(tmp_path / "r.csv")]
        done = CliRunner().invoke(command, [*common, *path], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    recording = read_recording(tmp_path / "r.csv")
    assert recording.frame["face"].tolist() == [3, 4, 5, 6, 6, 5, 4, 3]
    assert recording.frame["speed_mm_s"].unique() == [2.0]
    with pytest.raises(InputError, match="program"):
        CliRunner().invoke(command, [*common, *path, "--cycles", "3", "--resume"], catch_exceptions=False)
    for more, wrong in (
        (["gauge.ipp", "--cycles", "3"], "cycles: without a program"),
        (["-d", "dmis"], "dialect: is the"),
    ):
        with pytest.raises(InputError, match=wrong):
            CliRunner().invoke(command, [*common, *more], catch_exceptions=False)


def test_rows_of_all_sessions_make_one_frame(tmp_path: Path) -> None:
    """A server that tells no temperatures in its second session: the column goes, the rows stay."""
    job = make(1)
    journal = start(tmp_path / "j", job.head())
    for point in range(1, 9):
        row = {"x_mm": 1.0, "y_mm": 2.0, "z_mm": 3.0, "time_s": float(point)}
        journal.add(point, {**row, "gauge_temperature_C": 20.0} if point < 5 else row)
    journal.close()
    frame = job.recording(journal, {}).frame
    assert isinstance(frame, pd.DataFrame)
    assert len(frame) == 8
    assert "gauge_temperature_C" not in frame
    assert Faults().take(0, 0.0, 1.0, searching=True) is None
