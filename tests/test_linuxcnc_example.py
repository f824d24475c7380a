"""The gauge in HAL and the comparison of examples/linuxcnc, without LinuxCNC."""

from __future__ import annotations

import fcntl
import json
import os
import re
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.motion.collision import RAIL_OVERHANG_MM
from stepgauge.recording import Recording
from tests.build import angles, gauges, make_gauge, make_machine, make_pose, positions
from tests.conftest import ROOT
from tests.importing.test_linuxcnc import log_of, make_setup

EXAMPLE = ROOT / "examples" / "linuxcnc"
sys.path.append(str(EXAMPLE))
import comparison  # noqa: E402
import controller  # noqa: E402
import hal_gauge  # noqa: E402

Array = np.ndarray


class Hal:
    """Executes the gauge's part of a HAL file: one pass over its functions in their order, as a servo period does."""

    def __init__(self, text: str) -> None:
        self.constant = {pin: float(value) for pin, value in re.findall(r"^setp (\S+) (\S+)$", text, re.M)}
        self.signal: dict[str, str] = {}
        for name, pins in re.findall(r"^net (\S+) (.*)$", text, re.M):
            self.signal.update(dict.fromkeys(pins.replace("=>", "").split(), name))
        kinds = {
            name: kind
            for kind, names in re.findall(r"^loadrt (\S+) names=(\S+)", text, re.M)
            for name in names.split(",")
        }
        order = re.findall(r"^addf (\S+) servo-thread$", text, re.M)
        assert order[0] == "motion-command-handler"
        assert order[-1] == "motion-controller"
        self.functions = [(name, kinds[name]) for name in order[1:-1]]
        assert len(self.functions) == len(kinds) == len({name for name, _ in self.functions})

    def probe(self, xyz: Array) -> bool:
        """The probe input with the axes at a place."""
        value: dict[str, float | bool] = dict(zip("xyz", xyz.tolist(), strict=True))

        def pin(name: str, default: float = float("nan")) -> float | bool:
            return value[self.signal[name]] if name in self.signal else self.constant.get(name, default)

        for name, kind in self.functions:
            if kind == "sum2":
                gains = [self.constant.get(f"{name}.gain{i}", 1.0) for i in (0, 1)]
                out = pin(f"{name}.in0") * gains[0] + pin(f"{name}.in1") * gains[1] + pin(f"{name}.offset", 0.0)
            elif kind == "wcomp":
                out = pin(f"{name}.min") < pin(f"{name}.in") < pin(f"{name}.max")
            elif kind == "or2":
                out = pin(f"{name}.in0") or pin(f"{name}.in1")
            else:
                assert kind == "logic"
                out = all(pin(f"{name}.in-{i:02d}") for i in range(3))
            value[self.signal[f"{name}.{'and' if kind == 'logic' else 'out'}"]] = out
        return bool(value[self.signal["motion.probe-input"]])


@given(
    gauge=gauges(),
    yaw=angles,
    pitch=st.floats(-1.5, 1.5),
    roll=angles,
    origin=positions,
    radius=st.floats(0.3, 3.0),
    data=st.data(),
)
def test_the_gauge_in_hal_is_touched_where_the_gauge_is(gauge: Gauge, yaw, pitch, roll, origin, radius, data):
    """Against the definition of the gauge in words, with axes from a pose that the product did not make."""
    pose = make_pose(yaw, pitch, roll, origin)
    deviation = np.array(data.draw(st.lists(st.floats(-20, 20), min_size=gauge.n_faces, max_size=gauge.n_faces)))
    hal = Hal(hal_gauge.render_hal(gauge, pose.placement(gauge), deviation, radius))
    width, height = gauge.table.block_width_mm / 2 + radius, gauge.table.block_height_mm / 2 + radius
    face = gauge.position_mm + deviation * 1e-3
    k = data.draw(st.integers(0, gauge.n_faces - 1))
    outward = -1.0 if k % 2 == 0 else 1.0
    for off_um, touched in ((0.01, False), (-0.01, True)):
        a = face[k] + outward * (radius + off_um * 1e-3)
        inside = [a, 0.9 * width, 0.9 * (height - 2 * radius)]
        assert hal.probe(pose.place(np.array(inside))) is touched
        assert not hal.probe(pose.place(np.array([a, 1.01 * width, 0.0])))
        assert not hal.probe(pose.place(np.array([a, 0.0, 1.01 * height])))
    rail_top, rail_end = -gauge.table.block_height_mm / 2 + radius, face[-1] - deviation[-1] * 1e-3 + RAIL_OVERHANG_MM
    gap = (face[1] + face[2]) / 2
    for a, up, touched in (
        (gap, -1e-3, True),
        (rail_end + radius - 1e-3, -1.0, True),
        (rail_end + radius + 1e-3, -1.0, False),
    ):
        assert hal.probe(pose.place(np.array([a, 0.0, rail_top + up]))) is touched


def test_the_shipped_truth_belongs_to_the_shipped_gauge():
    gauge = read_gauge("step-gauge-420")
    deviation = hal_gauge.read_truth(EXAMPLE / "truth.csv", gauge)
    assert deviation.shape == (42,)
    assert 2.0 < np.ptp(deviation) < 50.0
    assert np.ptp(deviation) > 10 * controller.latch_bound_um(3.0)
    read_placement(EXAMPLE / "placement.toml", gauge)


def test_truth_of_another_gauge_is_refused(tmp_path: Path):
    path = tmp_path / "truth.csv"
    path.write_text("face,deviation_um\n1,0\n2,1\n")
    with pytest.raises(InputError, match="one row per face, in order; found 2 rows; expected 1 to 42"):
        hal_gauge.read_truth(path, read_gauge("step-gauge-420"))


def test_the_latch_bound_is_speed_times_servo_period():
    assert controller.latch_bound_um(3.0) == pytest.approx(0.3)
    assert controller.SERVO_PERIOD_NS == 100_000


def simulated_comparison(late_um: Array, deviation_um: Array, told_um: Array) -> comparison.Comparison:
    """A run whose readings are ``late_um`` late on a gauge with ``deviation_um``, judged against ``told_um``."""
    setup = make_setup(make_gauge(4))
    face = np.tile(np.arange(1, 9), 2)
    beyond_um = late_um + deviation_um[face - 1] * np.where(face % 2 == 1, 1.0, -1.0)
    recording: Recording = setup.read(log_of(setup.readings(beyond_um * 1e-3), "log")).recording
    evaluation = evaluation_to_dict(evaluate(recording, setup.gauge))
    return comparison.compare(recording, evaluation, setup.gauge, setup.placement, told_um, 2.0, 0.3)


late = st.lists(st.floats(0.0, 0.3), min_size=16, max_size=16).map(np.array)
deviations = st.lists(st.floats(-20.0, 20.0), min_size=8, max_size=8).map(np.array)


@given(late_um=late, deviation_um=deviations)
def test_no_late_reading_within_a_period_breaks_the_bound(late_um: Array, deviation_um: Array):
    """The bound that the example states, for any lateness of any reading."""
    found = simulated_comparison(late_um, deviation_um, deviation_um)
    assert found.agrees
    np.testing.assert_allclose(found.late_um, late_um, atol=1e-3)


@given(late_um=late, deviation_um=deviations, face=st.integers(0, 7), off_um=st.sampled_from([-0.62, 0.62]))
def test_a_single_wrong_face_breaks_the_verdict(late_um: Array, deviation_um: Array, face: int, off_um: float):
    told = deviation_um.copy()
    told[face] += off_um
    assert not simulated_comparison(late_um, deviation_um, told).agrees


def test_a_second_simulation_waits_and_gives_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(controller, "LOCK", tmp_path / "lock")
    monkeypatch.setattr(controller, "LOCK_WAIT_S", 0.1)
    handle = os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT)
    fcntl.flock(handle, fcntl.LOCK_EX)
    with pytest.raises(InputError, match=r"another simulation has held this lock for 0\.1 s"), controller._turn():
        pass
    os.close(handle)


def test_no_simulation_is_started_beside_a_running_linuxcnc(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(controller, "_INSTANCE", (controller._stat(os.getpid())[0],))
    with pytest.raises(InputError, match="a LinuxCNC is already running here"):
        controller._refuse_other_instances()


@pytest.mark.parametrize("sign", ["interp_error: Queue is not empty after probing", "the controller did not come up"])
@pytest.mark.parametrize(("spoiled", "runs", "agrees"), [(0, 1, True), (1, 2, True), (2, 3, True), (3, 3, False)])
def test_a_run_that_linuxcnc_spoiled_is_repeated(tmp_path: Path, monkeypatch, capfd, spoiled, runs, agrees, sign):
    """Its own fault is printed in output.txt; what the driver heard of it is a touch that was missed."""
    missed = {"error": "G38.2 move finished without making contact.", "line": 7, "seconds": 1.0}
    well = {"error": None, "line": 9, "seconds": 2.0}
    started = []

    def run(folder: Path, *_: object) -> None:
        started.append(folder)
        bad = len(started) <= spoiled
        (folder / "output.txt").write_text(f"{sign}\n" if bad else "")
        (folder / "outcome.json").write_text(json.dumps(missed if bad else well))

    monkeypatch.setattr(controller, "LOCK", tmp_path / "lock")
    monkeypatch.setattr(controller, "_INSTANCE", ())
    monkeypatch.setattr(controller, "require_linuxcnc", lambda: None)
    monkeypatch.setattr(controller, "_run", run)
    setup = make_setup(make_gauge(4))
    outcome = controller.run_program("M2\n", setup.program, make_machine(), "", tmp_path / "kept")
    assert len(set(started)) == runs
    assert (outcome.error is None) is agrees
    assert capfd.readouterr().err.count("the run is repeated") == runs - 1


@pytest.mark.parametrize(("spoiled", "comes_up"), [(0, True), (2, True), (3, False)])
def test_a_controller_that_does_not_come_up_is_started_again(tmp_path: Path, monkeypatch, capfd, spoiled, comes_up):
    """Where it is to be moved from outside: by a driver that says that it gave up, as the real one does."""
    starts: list[Path] = []
    for name in ("simulation.hal", "simulation.ini"):
        (tmp_path / name).touch()

    @contextmanager
    def started(folder: Path, *_: object):
        starts.append(folder)
        bad = len(starts) <= spoiled
        (folder / "output.txt").write_text("the controller did not come up\n" if bad else "")
        if not bad:
            (folder / "ready").touch()
        with subprocess.Popen(["true"]) as ended:
            ended.wait()
            yield ended

    monkeypatch.setattr(controller, "_started", started)
    with suppress(InputError), controller._ready(tmp_path, {}, {}, tmp_path / "kept"):
        assert comes_up
        assert len(starts) == spoiled + 1
    assert len(starts) == min(spoiled + 1, 3)
    assert capfd.readouterr().err.count("the run is repeated") == min(spoiled, 2)


def test_a_touch_that_is_missed_is_not_repeated(tmp_path: Path, monkeypatch):
    started = []

    def run(folder: Path, *_: object) -> None:
        started.append(folder)
        (folder / "output.txt").write_text("G38.2 move finished without making contact.\n")
        (folder / "outcome.json").write_text(json.dumps({"error": "missed", "line": 7, "seconds": 1.0}))

    monkeypatch.setattr(controller, "LOCK", tmp_path / "lock")
    monkeypatch.setattr(controller, "_INSTANCE", ())
    monkeypatch.setattr(controller, "require_linuxcnc", lambda: None)
    monkeypatch.setattr(controller, "_run", run)
    setup = make_setup(make_gauge(4))
    assert controller.run_program("M2\n", setup.program, make_machine(), "", tmp_path / "kept").error == "missed"
    assert len(started) == 1


def test_without_linuxcnc_one_line_says_what_to_install(tmp_path: Path):
    result = subprocess.run(
        [sys.executable, EXAMPLE / "run.py", "-o", tmp_path / "out"],
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert result.returncode == 2
    assert (
        result.stderr
        == "run.py: error: linuxcnc: LinuxCNC is not installed; expected the Debian package linuxcnc-uspace\n"
    )
    assert not (tmp_path / "out").exists()
