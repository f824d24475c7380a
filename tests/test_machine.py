"""The virtual CMM: closed forms of the whole loop, and everything that stops a program."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.effects import effect_kinds, make_effects
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.files.resources import shipped_names
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import Run, RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from tests.build import angles, gauges, make_gauge, make_machine, make_pose, positions


def through_text(program: Program, dialect: str) -> Program:
    return DIALECTS[dialect].read(render(program, DIALECTS[dialect]), "program.txt", program.settings)


def plan(gauge: Gauge, pose, machine: Machine, **options) -> Program:
    choice = PlanOptions(1, gauge.n_blocks, **{"cycles": 1, **options})
    setting = ProbingSettings(tip_radius_mm=machine.probe.tip_radius_mm)
    return make_program(pose.placement(gauge), gauge, choice, setting)


@given(gauges(), angles, st.floats(-0.03, 0.03), positions, st.floats(0.0, 20.0), st.sampled_from(list(DIALECTS)))
@settings(max_examples=60)
def test_a_machine_without_errors_shows_none(gauge, yaw, pitch, origin, pretravel_um, dialect) -> None:
    """XF = XB = 0 within 1 nm and R_eff = r - w, through the text of every dialect."""
    machine, pose = make_machine(pretravel_um=pretravel_um), make_pose(yaw, pitch, origin=origin)
    program = through_text(plan(gauge, pose, machine, cycles=2), dialect)
    run = run_program(program, machine, gauge, pose.placement(gauge), seed=0)
    assert run.stop is None
    result = evaluate(run.recording, gauge, placements=[pose.placement(gauge)]).results[0]
    assert result.radius.r_eff_mm == pytest.approx(2.0 - pretravel_um * 1e-3, abs=1e-6)
    for errors_um in (result.xf_um, result.xb_um):
        assert np.nanmax(np.abs(errors_um)) < 1e-3
    without_placement = evaluate(run.recording, gauge).results[0]
    assert np.nanmax(np.abs(without_placement.xm_um)) < 1e-3


@given(st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3), positions)
@settings(max_examples=30)
def test_a_gauge_that_lies_askew_to_the_plan_shows_the_cosine_error(yaw_off, pitch_off, shift) -> None:
    """Readings projected on the planned axis are short by theta^2 / 2, whatever the shift of the gauge."""
    gauge, machine = make_gauge(6), make_machine()
    planned = make_pose(0.4, 0.0)
    move = np.array(shift) * 1e-3  # half a millimetre: well within the search
    true = make_pose(0.4 + yaw_off, pitch_off, origin=tuple(move))
    run = run_program(plan(gauge, planned, machine), machine, gauge, true.placement(gauge), seed=0)
    result = evaluate(run.recording, gauge).results[0]
    cosine = planned.rotation[0] @ true.rotation[0]
    # a search along the planned axis meets the faces, tilted by theta, at their distance over cos theta
    expected_um = gauge.position_mm[-2] * (1.0 / cosine - 1.0) * 1e3
    assert result.xf_um[-2] == pytest.approx(expected_um, abs=1e-3)


def test_positions_come_from_contact_minus_radius_plus_pretravel() -> None:
    """DESIGN section 2: centre = contact - r p + w p, on a gauge along +x with its first face at x = 100."""
    gauge, machine = make_gauge(2), make_machine(pretravel_um=5.0)
    pose = make_pose(0.0, 0.0, origin=(100.0, 0.0, 0.0))
    frame = run_program(plan(gauge, pose, machine), machine, gauge, pose.placement(gauge), seed=0).recording.frame
    np.testing.assert_allclose(frame["x_mm"], [98.005, 111.995, 118.005, 131.995], atol=1e-9)
    assert frame["face"].tolist() == [1, 2, 3, 4]
    np.testing.assert_allclose(frame["approach_i"], [1, -1, 1, -1])


def test_times_follow_from_the_speeds() -> None:
    """A stand-off of 3 mm at 3 mm/s less the pre-travel, and the ways between at 50 mm/s."""
    gauge, machine = make_gauge(2), make_machine(pretravel_um=0.0)
    pose = make_pose(0.0, 0.0)
    program = plan(gauge, pose, machine)
    start = RunConditions(start_s=100.0)
    time_s = run_program(program, machine, gauge, pose.placement(gauge), 0, start).recording.frame["time_s"]
    way = np.linalg.norm(np.diff(program.position_mm[:6], axis=0), axis=1)
    assert time_s[0] == pytest.approx(100.0 + way[:4].sum() / 50.0 + 1.0, abs=1e-9)
    # next face: 3 mm back, out, along and in again, 3 mm of search
    between = 3.0 / 50.0 + 2 * 17.0 / 50.0 + 20.0 / 50.0 + 1.0
    assert time_s[1] - time_s[0] == pytest.approx(between, abs=1e-9)


def test_repeatability_has_the_stated_size_and_lies_along_the_approach() -> None:
    gauge, pose = make_gauge(6), make_pose(0.5, 0.01)
    quiet = make_machine()
    noisy = replace(quiet, table=quiet.table.model_copy(update={"repeatability_um": 0.7}))
    program = plan(gauge, pose, quiet, cycles=100)
    runs = [run_program(program, m, gauge, pose.placement(gauge), 5).recording for m in (quiet, noisy)]
    difference_um = (runs[1].position_mm - runs[0].position_mm) * 1e3
    along = (difference_um * runs[0].approach).sum(axis=1)
    assert np.std(along) == pytest.approx(0.7, rel=0.06)
    np.testing.assert_allclose(difference_um, along[:, None] * runs[0].approach, atol=1e-9)
    again = run_program(program, noisy, gauge, pose.placement(gauge), 5).recording
    assert np.array_equal(again.position_mm, runs[1].position_mm)
    other = run_program(program, noisy, gauge, pose.placement(gauge), 6).recording
    assert not np.array_equal(other.position_mm, runs[1].position_mm)


def test_a_warm_gauge_is_longer_and_evaluation_takes_it_off() -> None:
    gauge, machine, pose = make_gauge(6), make_machine(), make_pose(0.0, 0.0)
    run = run_program(plan(gauge, pose, machine), machine, gauge, pose.placement(gauge), 0, RunConditions(22.0))
    x = run.recording.frame["x_mm"].to_numpy()
    assert (x[-2] - x[0] - gauge.position_mm[-2]) * 1e3 == pytest.approx(2 * 11.5e-3 * gauge.position_mm[-2], abs=1e-6)
    assert np.nanmax(np.abs(evaluate(run.recording, gauge).results[0].xm_um)) < 1e-3


def test_cycles_are_counted_by_visits() -> None:
    gauge, machine, pose = make_gauge(3), make_machine(), make_pose(0.0, 0.0)
    program = plan(gauge, pose, machine, order="up-down", cycles=3)
    frame = run_program(program, machine, gauge, pose.placement(gauge), 0).recording.frame
    assert frame["face"].tolist() == [1, 2, 3, 4, 5, 6, 6, 5, 4, 3, 2, 1, 1, 2, 3, 4, 5, 6]
    assert frame["cycle"].tolist() == [1] * 6 + [2] * 6 + [3] * 6


def stopped(program: Program, machine: Machine, gauge: Gauge, pose) -> tuple[Run, str]:
    run = run_program(program, machine, gauge, pose.placement(gauge), 0)
    assert run.stop is not None
    assert run.recording.comments["stopped"] == str(run.stop)
    return run, str(run.stop)


def test_a_missed_face_stops_the_program_with_its_line() -> None:
    """The gauge really lies 2.5 mm farther than believed; the search of 2 mm ends before the face."""
    gauge, machine = make_gauge(3), make_machine()
    program = through_text(plan(gauge, make_pose(0.0, 0.0), machine), "linuxcnc")
    run, message = stopped(program, machine, gauge, make_pose(0.0, 0.0, origin=(2.5, 0.0, 0.0)))
    first = int(program.line[program.is_measure][0])
    assert message.startswith(f"program.txt:{first}: the face was not found")
    assert "2 mm beyond" in message
    assert len(run.recording) == 0


def test_what_was_recorded_before_a_stop_is_kept() -> None:
    """Block 3 stands 3 mm farther than the program believes: blocks 1 and 2 are recorded as if nothing happened."""
    believed, machine, pose = make_gauge(4), make_machine(), make_pose(0.0, 0.0)
    off_um = np.array([0, 0, 0, 0, 3e3, 3e3, 3e3, 3e3])
    program = through_text(plan(believed, pose, machine), "dmis")
    run, message = stopped(program, machine, make_gauge(4, deviation_um=off_um), pose)
    assert run.recording.frame["face"].tolist() == [1, 2, 3, 4]
    whole = run_program(program, machine, believed, pose.placement(believed), 0).recording
    assert np.array_equal(run.recording.position_mm, whole.position_mm[:4])
    assert "not found" in message


def test_collisions_stop_the_program() -> None:
    gauge, machine = make_gauge(3), make_machine()
    program = plan(gauge, make_pose(0.0, 0.0), machine)
    low = make_pose(0.0, 0.0, origin=(0.0, -7.0, 0.0))  # the side that the path clears is 7 mm nearer
    _, message = stopped(program, machine, gauge, low)
    assert "tip ball hits block" in message
    assert "overlap" in message
    high = plan(gauge, make_pose(0.0, 0.0), make_machine(), route="over", clearance_mm=3.0)
    _, message = stopped(high, machine, gauge, make_pose(0.0, 0.0, origin=(0.0, 0.0, 5.0)))
    assert "hits block 1" in message
    fat = make_machine(stylus_length_mm=5.0, body_diameter_mm=60.0)
    _, message = stopped(program, fat, gauge, make_pose(0.0, 0.0))
    assert "probe body hits" in message


def test_a_search_that_meets_an_edge_records_nothing() -> None:
    gauge, machine = make_gauge(3), make_machine()
    program = plan(gauge, make_pose(0.0, 0.0), machine, route="over", clearance_mm=15.0)
    _, message = stopped(program, machine, gauge, make_pose(0.0, 0.0, origin=(0.0, 0.0, -8.5)))
    assert "meets no face; found an edge or side of block 1" in message


def test_the_limit_of_the_travel_stops_the_program() -> None:
    gauge, machine, pose = make_gauge(3), make_machine(), make_pose(0.0, 0.0)
    travel = machine.table.travel_mm.model_copy(update={"x": (-100.0, 40.0)})
    narrow = replace(machine, table=machine.table.model_copy(update={"travel_mm": travel}))
    run, message = stopped(plan(gauge, pose, machine), narrow, gauge, pose)
    assert "leaves the travel of Test machine; found x = 55.000 mm; expected -100 to 40 mm" in message
    assert run.recording.frame["face"].tolist() == [1, 2, 3, 4, 5]


def test_effects_displace_what_is_read() -> None:
    """10 ppm of x over the gauge's length, seen by the evaluation; reversal as XB - XF along +x."""
    gauge, machine, pose = make_gauge(6), make_machine(), make_pose(0.0, 0.0, origin=(50.0, 0.0, 0.0))
    program = plan(gauge, pose, machine)
    bent = replace(machine, effects=({"kind": "scale_error", "axis": "x", "ppm": 10.0},))
    result = evaluate(run_program(program, bent, gauge, pose.placement(gauge), 0).recording, gauge).results[0]
    assert result.xf_um[-2] == pytest.approx(10e-3 * gauge.position_mm[-2], abs=1e-3)
    loose = replace(machine, effects=({"kind": "reversal_error", "axis": "x", "um": 4.0},))
    result = evaluate(run_program(program, loose, gauge, pose.placement(gauge), 0).recording, gauge).results[0]
    assert result.radius.r_eff_mm == pytest.approx(2.0 - 0.003 - 0.002, abs=1e-6)  # backlash passes for pre-travel


def test_an_effect_that_cannot_act_is_named_with_its_machine_file() -> None:
    gauge, machine, pose = make_gauge(6), make_machine(), make_pose(0.0, 0.0, origin=(50.0, 0.0, 0.0))
    program = plan(gauge, pose, machine)
    wrong = replace(machine, path="mine.toml", effects=({"kind": "block_defect", "face": 99, "um": 1.0},))
    said = r'mine.toml: \[\[effect\]\] kind = "block_defect": no such face; found 99; expected 1 to 12'
    with pytest.raises(InputError, match=said):
        run_program(program, wrong, gauge, pose.placement(gauge), 0)
    beyond = replace(machine, path="mine.toml", effects=({"kind": "outliers", "rows": [2, 10_000], "um": 5.0},))
    run = run_program(program, beyond, gauge, pose.placement(gauge), 0)
    assert run.notes == (f"mine.toml: effect outliers: rows 10000 do nothing, the recording has {len(run.recording)}",)
    assert run_program(program, machine, gauge, pose.placement(gauge), 0).notes == ()


def test_unknown_effects_and_parameters_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"effect\[2\]\.kind is not a known effect; found 'gremlins'; expected .*angular_error"
    ):
        make_effects([{"kind": "scale_error", "axis": "x", "ppm": 1.0}, {"kind": "gremlins"}], "m.toml")
    with pytest.raises(InputError, match=r"effect\[1\]\.ppb is not known"):
        make_effects([{"kind": "scale_error", "axis": "x", "ppm": 1.0, "ppb": 1.0}], "m.toml")
    with pytest.raises(InputError, match=r"effect\[1\]\.axis is wrong; found 'w'"):
        make_effects([{"kind": "scale_error", "axis": "w", "ppm": 1.0}], "m.toml")
    assert {"scale_error", "reversal_error"} <= set(effect_kinds())


@pytest.mark.parametrize("name", shipped_names("machines"))
def test_the_shipped_machines_measure(name: str) -> None:
    machine, gauge = read_machine(name), make_gauge(4)
    pose = make_pose(0.0, 0.0, origin=(100.0, 100.0, 100.0))
    program = plan(gauge, pose, machine)
    slim = replace(program, settings=replace(program.settings, standoff_mm=1.5))
    run = run_program(slim, machine, gauge, pose.placement(gauge), 0)
    assert run.stop is None
    assert len(run.recording) == 8


MACHINE = """
[machine]
name = "M"
travel_mm = { x = [0, 700], y = [0, 1000], z = [0, 600] }
repeatability_um = 0.3
measuring_speed_mm_s = 3.0
travel_speed_mm_s = 50.0
[probe]
tip_radius_mm = 2.0
pretravel_um = 3.0
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("y = [0, 1000]", "y = [1000, 0]", ["travel_mm", "lowest < highest on y"]),
        ("y = [0, 1000], ", "", ["machine.travel_mm.y", "missing"]),
        ("repeatability_um = 0.3", "repeatability_mm = 0.3", ["repeatability_um"]),
        ("pretravel_um = 3.0", "pretravel_um = -3.0", ["probe.pretravel_um", "-3.0"]),
        ("pretravel_um = 3.0", "stylus_diameter_mm = 5", ["smaller than the tip ball"]),
        ("pretravel_um = 3.0", "stylus_direction = [0, 0, 2]", ["unit vector"]),
        ("[probe]", "[sensor]", ["[sensor] is not known"]),
        ("measuring_speed_mm_s = 3.0", "measuring_speed_mm_s = true", ["machine.measuring_speed_mm_s", "true"]),
    ],
)
def test_wrong_machine_files_are_refused(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in MACHINE
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_machine(path)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def with_probe(tmp_path: Path, lines: str) -> Machine:
    path = tmp_path / "machine.toml"
    roomy = re.sub(r"\[0, \d+\]", "[-500, 900]", MACHINE.split("[probe]")[0])
    path.write_text(f"{roomy}[probe]\n{lines}")
    return read_machine(path)


@pytest.mark.parametrize("name", shipped_names("probes"))
def test_a_machine_file_may_name_a_probe_and_the_simulator_uses_it(tmp_path: Path, name: str) -> None:
    """R_eff along +x is r less the probe's own pre-travel, the mean of the two opposite approaches."""
    machine = with_probe(
        tmp_path, f'file = "{name}"\ntip_radius_mm = 2.0\nstylus_diameter_mm = 2.0\nbody_diameter_mm = 3.0\n'
    )
    quiet = replace(machine, table=machine.table.model_copy(update={"repeatability_um": 0.0}))
    gauge, pose = make_gauge(4), make_pose(0.0, 0.0)
    run = run_program(plan(gauge, pose, machine, clearance_mm=2.0), quiet, gauge, pose.placement(gauge), 0)
    assert run.stop is None
    there, back = quiet.sensor.pretravel_um(np.array([[1.0, 0, 0], [-1.0, 0, 0]]))
    result = evaluate(run.recording, gauge).results[0]
    assert result.radius.r_eff_mm == pytest.approx(2.0 - (there + back) / 2e3, abs=1e-6)


def test_a_lobed_probe_and_a_table_trigger_as_they_say(tmp_path: Path) -> None:
    lobed = with_probe(tmp_path, 'model = "lobed"\ntip_radius_mm = 2.0\npretravel_um = 5.0\namplitude_um = 1.0\n')
    (tmp_path / "map.csv").write_text(
        "polar_deg,azimuth_deg,pretravel_um\n90,0,3\n90,90,3\n90,180,7\n90,270,7\n0,0,1\n0,90,1\n0,180,1\n0,270,1\n"
    )
    table = with_probe(tmp_path, 'model = "table"\ntip_radius_mm = 2.0\nmap = "map.csv"\n')
    gauge, pose = make_gauge(3), make_pose(0.0, 0.0)
    for machine, (front_um, back_um) in ((lobed, (6.0, 4.0)), (table, (7.0, 3.0))):
        still = replace(machine, table=machine.table.model_copy(update={"repeatability_um": 0.0}))
        frame = run_program(plan(gauge, pose, machine), still, gauge, pose.placement(gauge), 0).recording.frame
        x = frame["x_mm"].to_numpy()
        assert x[0] == pytest.approx(-2.0 + front_um * 1e-3, abs=1e-9)
        assert x[1] == pytest.approx(12.0 - back_um * 1e-3, abs=1e-9)


def test_a_probe_that_never_triggers_stops_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = with_probe(tmp_path, 'file = "omp40-2-50mm"\n')
    monkeypatch.setattr(type(machine.sensor), "pretravel_um", lambda self, approach: np.full(len(approach), np.inf))
    gauge, pose = make_gauge(3, gap=14.0), make_pose(0.0, 0.0)
    _, message = stopped(plan(gauge, pose, machine), machine, gauge, pose)
    assert "the probe does not trigger in this direction" in message
