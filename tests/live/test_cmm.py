"""The virtual CMM move by move: the same physics as program by program, and what stops it."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.effects import make_effects, probings
from stepgauge.errors import InputError
from stepgauge.ippdme.codes import DmeError
from stepgauge.live import cmm as live_cmm
from stepgauge.live.clock import MachineClock
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.faults import read_faults
from stepgauge.live.obstacles import Surroundings
from stepgauge.machine.virtual import run_program
from stepgauge.motion.collision import make_obstacles, make_tool
from stepgauge.motion.moves import Program
from tests.conftest import ROOT
from tests.live.made import events, lying, make_state, small_gauge, small_machine, small_program, with_effects

MAPS = ("error_map", "axis_compensation")
"""These read a table of their own."""
EVERY = tomllib.loads((ROOT / "benchmarks/every-effect.toml").read_text())["effect"]
EVERY = [table for table in EVERY if table["kind"] not in MAPS]
KINDS = [table["kind"] for table in EVERY]


def measured(cmm: LiveCmm, program: Program) -> np.ndarray:
    """Indicated positions and times of a program, shape ``(n, 4)``, without the server."""
    rows, settings = [], program.settings
    cmm.position_mm = program.position_mm[0]
    for target, approach in zip(program.position_mm, program.approach, strict=True):
        if np.isnan(approach[0]):
            _go(cmm, target, settings.travel_speed_mm_s)
            continue
        start = target - settings.standoff_mm * approach
        _go(cmm, start, settings.travel_speed_mm_s)
        leg, touch = cmm.search(start, target + settings.search_mm * approach, settings.measuring_speed_mm_s)
        assert touch is not None, leg
        cmm.arrive(leg)
        rows.append([*cmm.indicate(touch), touch.time_s])
        _go(cmm, touch.trigger_mm - settings.retract_mm * approach, settings.travel_speed_mm_s)
    return np.array(rows)


def _go(cmm: LiveCmm, target: np.ndarray, speed_mm_s: float) -> None:
    leg = cmm.leg(target, speed_mm_s)
    assert leg.error is None, leg
    cmm.arrive(leg)


@pytest.mark.parametrize("table", EVERY, ids=KINDS)
def test_every_effect_acts_as_in_a_program_that_is_computed_at_once(table: dict[str, Any]) -> None:
    """Effects that remember earlier probings too; rows are numbered alike."""
    gauge = small_gauge()
    machine = small_machine(0.2, (table,))
    program = small_program(gauge, machine, cycles=3)
    cmm = make_state(machine=machine, seed=7).cmm
    live = measured(cmm, program)
    whole = run_program(replace(program, self_positioning=True), machine, gauge, lying(gauge), seed=7).recording
    assert live[:, :3] == pytest.approx(whole.position_mm, abs=2e-7)
    assert live[:, 3] == pytest.approx(whole.frame["time_s"].to_numpy(), abs=2e-4)


def test_all_that_depends_on_earlier_touches_makes_the_machine_remember_them() -> None:
    """What a block of rows takes from the whole recording, a machine asked touch by touch takes from all so far."""
    of_blocks, remembered = (
        {name for name, made in vars(one).items() if callable(made) and not name.startswith("_")} - {"column"}
        for one in (probings._Slice, live_cmm._Remembering)
    )
    assert remembered == of_blocks


def test_concealed_effects_act_like_those_of_the_machine_file() -> None:
    table = {"kind": "scale_error", "axis": "x", "ppm": 30.0}
    program = small_program(small_gauge(), small_machine())
    known = measured(make_state(machine=small_machine(0.0, (table,))).cmm, program)
    concealed = measured(make_state(faults=with_effects(table)).cmm, program)
    assert concealed == pytest.approx(known, abs=1e-12)
    assert np.abs(concealed - measured(make_state().cmm, program))[:, 0].max() > 3e-3


def test_drift_goes_on_while_nothing_moves() -> None:
    """The effects act at the time of the machine's clock."""
    table = {"kind": "thermal_drift", "direction": "x", "rate_um_per_h": 3600.0}
    now = [0.0]
    clock = MachineClock(10.0, real=lambda: now[0])
    gauge, machine = small_gauge(), small_machine()
    cmm = LiveCmm(machine, gauge, lying(gauge), clock, with_effects(table))
    clock.start()
    now[0] = 50.0
    program = small_program(gauge, machine)
    late = measured(cmm, program)
    assert late[0, 3] > 500.0
    shift_um = (late - measured(make_state().cmm, program))[:, 0] * 1e3
    assert shift_um == pytest.approx(late[:, 3], abs=1e-6)  # 1 um/s


@pytest.fixture
def around() -> Surroundings:
    gauge = small_gauge()
    return Surroundings(make_obstacles(gauge, lying(gauge)), make_tool(small_machine().probe))


places = st.tuples(st.floats(-20.0, 90.0), st.floats(-18.0, 18.0), st.floats(-14.0, 40.0))


@given(places, places, st.booleans())
def test_what_is_found_quickly_is_what_is_found_exactly(
    start: tuple[float, ...], end: tuple[float, ...], straight: bool
) -> None:
    """``straight``: along the gauge, as searches are."""
    gauge = small_gauge()
    lies = lying(gauge)
    around = Surroundings(make_obstacles(gauge, lies), make_tool(small_machine().probe))
    last = (end[0], start[1], start[2]) if straight else end
    a, b = lies.to_machine(gauge, start), lies.to_machine(gauge, last)
    quick, exact = around.contact(a, b), around._exact_contact(a, b)
    assert (quick is None) == (exact is None)
    if quick is not None and exact is not None:
        assert quick[0] == pytest.approx(exact[0], abs=1e-7)
    for part in around.tool.parts:
        if not around._may_hit(part, around._to_gauge(a), around._to_gauge(b)):
            assert around._gaps(part, a, b).min() >= -2e-6


def test_a_move_stops_where_the_ball_touches(around: Surroundings) -> None:
    cmm = make_state().cmm
    lies = around.obstacles.placement
    cmm.position_mm = lies.to_machine(around.obstacles.gauge, [-10.0, 0.0, 0.0])
    leg = cmm.leg(lies.to_machine(around.obstacles.gauge, [10.0, 0.0, 0.0]), 50.0)
    assert isinstance(leg.error, DmeError)
    assert leg.error.number == 1001
    assert lies.to_gauge(around.obstacles.gauge, leg.end_mm)[0] == pytest.approx(-2.0, abs=1e-5)
    cmm.arrive(leg)
    assert cmm.leg(leg.start_mm, 50.0).error is None, "it can go back"


def test_the_body_of_the_probe_collides(around: Surroundings) -> None:
    """The tip passes beside the rail, deeper than the stylus is long."""
    cmm = make_state().cmm
    gauge, lies = around.obstacles.gauge, around.obstacles.placement
    cmm.position_mm = lies.to_machine(gauge, [30.0, 60.0, -55.0])
    leg = cmm.leg(lies.to_machine(gauge, [30.0, 22.0, -55.0]), 50.0)
    assert leg.error is not None
    assert leg.error.number == 2504


def test_a_search_that_leaves_the_travel_ends_at_its_limit() -> None:
    cmm = make_state().cmm
    cmm.position_mm = np.array([300.0, 50.0, 5.0])
    leg, touch = cmm.search(cmm.position_mm, np.array([300.0, 50.0, -5.0]), 3.0)
    assert touch is None
    assert leg.error is not None
    assert leg.error.number == 2500
    assert leg.end_mm[2] == pytest.approx(0.0, abs=1e-9)


def test_an_event_by_time_cuts_the_move_at_that_time() -> None:
    cmm = make_state(faults=events({"kind": "emergency_stop", "time_s": 2.0})).cmm
    cmm.position_mm = np.array([0.0, 0.0, 300.0])
    leg = cmm.leg(np.array([200.0, 0.0, 300.0]), 50.0)
    assert leg.error is not None
    assert leg.error.number == 500
    assert leg.end_mm == pytest.approx([100.0, 0.0, 300.0])
    assert leg.end_s == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ('[[event]]\nkind = "earthquake"\ntime_s = 1\n', "key event\\[1\\].kind"),
        ('[[event]]\nkind = "collision"\n', "either time_s or after_points"),
        ('[[event]]\nkind = "collision"\ntime_s = 1\nafter_points = 1\n', "either time_s or after_points"),
        ('[[effect]]\nkind = "sorcery"\n', "effect\\[1\\].kind"),
        ('[[event]]\nkind = "missed_face"\ntime_s = 1\nunasked = true\n', "missed_face is never unasked"),
        ("[machine]\n", "\\[\\[effect\\]\\] and \\[\\[event\\]\\]"),
        ("[event]\n", "array of tables"),
    ],
)
def test_files_of_faults_that_are_wrong_say_how(tmp_path: Any, text: str, wrong: str) -> None:
    (tmp_path / "faults.toml").write_text(text)
    with pytest.raises(InputError, match=wrong):
        read_faults(tmp_path / "faults.toml")


def test_the_events_of_a_file_wait_for_their_time(tmp_path: Any) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(
        '[[event]]\nkind = "missed_face"\nafter_points = 3\n[[effect]]\nkind = "effective_radius"\num = 1.0\n'
    )
    faults = read_faults(path)
    assert len(make_effects([{"kind": "effective_radius", "um": 1.0}], path)) == len(faults.effects) == 1
    assert faults.take(2, 0.0, 1.0, searching=True) is None
    assert faults.take(3, 0.0, 1.0, searching=False) is None
    assert faults.take(3, 0.0, 1.0, searching=True) is not None
    assert faults.take(4, 0.0, 1.0, searching=True) is None
