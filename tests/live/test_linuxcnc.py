"""LinuxCNC as a machine to measure on, with a stand-in for its module; tests/integration has the controller."""

from __future__ import annotations

import sys
import types
from typing import Any

import numpy as np
import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.connection import ConnectionLostError, StopAskedError
from stepgauge.live.controller import ControllerOptions
from stepgauge.live.linuxcnc import STATES, LinuxCnc
from stepgauge.motion.moves import ProbingSettings
from tests.live.made import lying, small_gauge, small_machine, small_program

SETTINGS = ProbingSettings(standoff_mm=3.0, search_mm=2.0, retract_mm=3.0, tip_radius_mm=2.0)


class Played(types.ModuleType):
    """The module ``linuxcnc``: its machine goes where a block says, and trips where x reaches 8 mm."""

    STATE_ON, STATE_ESTOP, INTERP_IDLE, EXEC_DONE, MODE_MDI, MODE_MANUAL, OPERATOR_ERROR, NML_ERROR = range(8)

    class error(Exception):  # noqa: N801, N818
        """As the module calls it."""

    def __init__(self) -> None:
        super().__init__("linuxcnc")
        self.blocks: list[str] = []
        self.messages: list[tuple[int, str]] = []
        self.aborted = 0
        self.now = types.SimpleNamespace(
            task_state=self.STATE_ON,
            interp_state=self.INTERP_IDLE,
            exec_state=self.EXEC_DONE,
            inpos=True,
            linear_units=1.0,
            homed=[1, 1, 1, 0],
            g5x_offset=[0.0] * 9,
            g92_offset=[0.0] * 9,
            tool_offset=[0.0] * 9,
            actual_position=[0.0] * 9,
            probed_position=[0.0] * 9,
            probe_tripped=False,
            poll=lambda: None,
            mode=lambda _: None,
            wait_complete=lambda _: None,
            mdi=self._mdi,
            abort=self._abort,
            home=lambda _: setattr(self.now, "homed", [1, 1, 1, 0]),
        )

    def _mdi(self, block: str) -> None:
        self.blocks.append(block)
        words = {word[0]: float(word[1:]) for word in block.split()[1:]}
        if "X" not in words:
            return
        if block.startswith("G38.2"):
            self.now.probe_tripped = words["X"] >= 8.0
            words["X"] = min(words["X"], 8.0)
            self.now.probed_position[:3] = [words["X"], words["Y"], words["Z"]]
        self.now.actual_position[:3] = [words["X"], words["Y"], words["Z"]]

    def _abort(self) -> None:
        self.aborted += 1

    def stat(self) -> Any:
        return self.now

    def command(self) -> Any:
        return self.now

    def error_channel(self) -> Any:
        return types.SimpleNamespace(poll=lambda: self.messages.pop(0) if self.messages else None)


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Played:
    module = Played()
    monkeypatch.setitem(sys.modules, "linuxcnc", module)
    return module


def test_a_point_is_a_way_a_search_and_a_way_back(played: Played) -> None:
    cnc = LinuxCnc(SETTINGS)
    cnc.prepare(ControllerOptions())
    found = cnc.probe(np.array([9.5, 1.0, 2.0]), np.array([1.0, 0.0, 0.0]), 1.0)
    assert found.position_mm == [8.0, 1.0, 2.0]
    assert found.radius_mm is None
    assert found.time_s is None
    assert played.blocks == [
        STATES,
        "G1 X4.500000 Y1.000000 Z2.000000 F3000.0000",
        "G38.2 X9.500000 Y1.000000 Z2.000000 F180.0000",
        "G1 X5.000000 Y1.000000 Z2.000000 F3000.0000",
    ]
    assert cnc.position_mm().tolist() == [5.0, 1.0, 2.0]


def test_a_search_in_vain(played: Played) -> None:
    cnc = LinuxCnc(SETTINGS)
    with pytest.raises(DmeError, match="1006"):
        cnc.probe(np.array([5.0, 1.0, 2.0]), np.array([1.0, 0.0, 0.0]), 1.0)


@pytest.mark.parametrize(
    ("changed", "wrong"),
    [
        ({"task_state": 99}, "not switched on"),
        ({"interp_state": 99}, "a program is running"),
        ({"linear_units": 1.0 / 25.4}, "does not count in millimetres"),
        ({"homed": [1, 1, 0]}, "the machine is not homed.*or homing"),
        ({"g5x_offset": [0.0, 3.0, 0.0]}, "there is a work offset or a tool length; found 3 mm"),
        ({"tool_offset": [0.0, 0.0, -50.0]}, "there is a work offset or a tool length; found 50 mm"),
    ],
)
def test_what_is_unsafe_is_refused_before_it_moves(played: Played, changed: dict[str, Any], wrong: str) -> None:
    for name, value in changed.items():
        setattr(played.now, name, value)
    with pytest.raises(InputError, match=wrong):
        LinuxCnc(SETTINGS).prepare(ControllerOptions())
    assert not [block for block in played.blocks if block.startswith("G1 ")]


def test_it_homes_where_it_may(played: Played) -> None:
    played.now.homed = [0, 0, 0]
    LinuxCnc(SETTINGS).prepare(ControllerOptions(home=True))
    assert played.now.homed[:3] == [1, 1, 1]


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("G38.2 move finished without making contact.", 1006),
        ("Probe tripped during non-probe move.", 1001),
        ("Probe is already tripped when starting G38.2 or G38.3 move", 1501),
        ("Linear move on line 0 would exceed Z's positive limit", 1008),
        ("joint 1 on limit switch error", 2500),
        ("something else", 1000),
    ],
)
def test_messages_are_the_errors_that_mean_the_same(played: Played, message: str, number: int) -> None:
    cnc = LinuxCnc(SETTINGS)
    played.messages = [(99, "only said"), (played.OPERATOR_ERROR, message)]
    with pytest.raises(DmeError, match=message) as found:
        cnc.go(np.zeros(3))
    assert found.value.number == number
    played.messages = [(played.NML_ERROR, "more of it")]
    cnc.clear()
    assert not played.messages


def test_emergency_stop_stop_and_silence(played: Played, monkeypatch: pytest.MonkeyPatch) -> None:
    played.now.task_state = played.STATE_ESTOP
    with pytest.raises(DmeError, match="0500"):
        LinuxCnc(SETTINGS).go(np.zeros(3))
    played.now.task_state = played.STATE_ON
    asked = iter([False, False, True])
    with pytest.raises(StopAskedError):
        LinuxCnc(SETTINGS, lambda: next(asked)).go(np.zeros(3))
    assert played.aborted == 1
    played.now.inpos = False
    monkeypatch.setattr("stepgauge.live.linuxcnc.PATIENCE_S", 0.05)
    with pytest.raises(ConnectionLostError, match="did not come to an end"):
        LinuxCnc(SETTINGS).go(np.zeros(3))


def test_where_no_linuxcnc_is(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    gauge, machine = small_gauge(), small_machine()
    assert small_program(gauge, machine).n_points == 8
    plan = sg.plan(lying(gauge), gauge, machine, cycles=1)
    more = {"server": "linuxcnc", "journal": tmp_path / "j"}
    monkeypatch.setitem(sys.modules, "linuxcnc", None)
    with pytest.raises(InputError, match="linuxcnc: its Python module is not here"):
        sg.measure(plan, machine, gauge, lying(gauge), **more)  # type: ignore[arg-type]
    module = Played()

    def dead() -> None:
        raise module.error("no NML")

    module.now.poll = dead
    monkeypatch.setitem(sys.modules, "linuxcnc", module)
    with pytest.raises(InputError, match="no LinuxCNC runs on this computer; found no NML"):
        sg.measure(plan, machine, gauge, lying(gauge), **more)  # type: ignore[arg-type]
