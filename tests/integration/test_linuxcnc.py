"""The measuring loop on LinuxCNC itself, run as a user runs it. Needs the Debian package linuxcnc-uspace."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepgauge.evaluation.evaluate import evaluate
from stepgauge.files.tables import read_numbers
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement, write_placement
from stepgauge.motion.moves import ProbingSettings
from stepgauge.programs import DIALECTS, read_program
from stepgauge.programs.render import render
from stepgauge.recording import read_recording
from tests.build import heed_interrupts
from tests.conftest import ROOT
from tests.importing.test_linuxcnc import make_setup

EXAMPLE = ROOT / "examples" / "linuxcnc"
LATCH_UM = 0.3
"""3 mm/s for the 100 us between two looks at the probe."""
TIMEOUT_S = 900.0
"""Long enough to wait ten minutes for another checkout's simulation to end on the same machine, and then to run."""

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed (apt-get install linuxcnc-uspace)"
    ),
]


def command(output: Path, *arguments: object) -> list[str]:
    return [sys.executable, str(EXAMPLE / "run.py"), "-o", str(output), *map(str, arguments)]


def run(output: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(output, *arguments), capture_output=True, text=True, timeout=TIMEOUT_S, check=False)


def processes(orphaned: bool = False) -> set[str]:
    """Names of the processes of a LinuxCNC that is up; ``orphaned``: only those whose private folder is gone.

    A run that ends removes its folder: what then still runs in it was left behind. Another run on the same machine is
    none of our business.
    """
    names = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = stat.read_text().partition("(")[2].rpartition(")")
            folder = str(stat.with_name("cwd").readlink())
        except OSError:
            continue
        if rest.split()[0] != "Z" and (not orphaned or folder.endswith(" (deleted)")):
            names.add(name)
    return names & {"linuxcncsvr", "milltask", "rtapi_app", "io"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """The one command as the README has it, with a program template that also opens the other form of log."""
    folder = tmp_path_factory.mktemp("linuxcnc")
    template = (ROOT / "templates" / "programs" / "linuxcnc.j2").read_text()
    both = template.replace("(LOGOPEN,", "(PROBEOPEN probeopen.txt)\n(LOGOPEN,").replace("M2", "(PROBECLOSE)\nM2")
    (folder / "both.j2").write_text(both)
    return folder / "out", run(folder / "out", "--template", folder / "both.j2")


def test_the_command_says_that_everything_is_recovered(whole):
    folder, result = whole
    assert result.returncode == 0, result.stderr + (folder / "output.txt").read_text()
    assert "verdict: the deviations of the gauge in HAL are recovered within the latch error" in result.stdout
    assert "60 rows, 60 points of the program" in result.stderr
    assert not processes(orphaned=True)


def test_the_deviations_of_the_gauge_in_hal_are_recovered_within_the_latch_error(whole):
    """From the files alone: differences of fronts to the first front, of backs to the first back, and block sizes."""
    folder, _ = whole
    result = evaluate(read_recording(folder / "recording.csv"), read_gauge("step-gauge-420")).results[0]
    truth = read_numbers(EXAMPLE / "truth.csv", ("face", "deviation_um"))["deviation_um"][:30]
    assert np.array_equal(result.face, np.arange(1, 31))
    assert (result.count == 2).all()
    front, back = truth[0::2], truth[1::2]
    assert np.abs(result.xf_um[0::2] - (front - front[0])).max() < LATCH_UM
    assert np.abs(result.xb_um[1::2] - (back - back[0])).max() < LATCH_UM
    assert np.abs(result.xf_um[0::2]).max() > 10 * LATCH_UM
    smaller_um = 2000.0 + (back[0] - front[0]) / 2.0 - result.radius.r_eff_mm * 1e3
    assert 0.0 <= smaller_um <= LATCH_UM


def test_every_point_was_read_behind_the_contact_and_within_one_period(whole):
    """The geometry written out again, in plain vectors from the placement file."""
    folder, _ = whole
    gauge = read_gauge("step-gauge-420")
    placement = read_placement(EXAMPLE / "placement.toml", gauge)
    truth = read_numbers(EXAMPLE / "truth.csv", ("face", "deviation_um"))["deviation_um"]
    recording = read_recording(folder / "recording.csv")
    face = recording.frame["face"].to_numpy()
    along = (recording.position_mm - placement.c1_mm) @ placement.axis + gauge.position_mm[:2].mean()
    sign = np.where(face % 2 == 1, 1.0, -1.0)
    late_um = (along + 2.0 * sign - gauge.position_mm[face - 1]) * sign * 1e3 - truth[face - 1] * sign
    assert late_um.min() > -2e-3
    assert late_um.max() < LATCH_UM + 2e-3
    assert np.ptp(late_um) > 0.1, "readings that are all equally late would not have met the latch"


def test_both_forms_of_the_log_give_the_same_recording(whole, tmp_path: Path):
    folder, _ = whole
    arguments = ["--format", "linuxcnc", "--program", folder / "program.ngc", "--gauge", "step-gauge-420"]
    arguments += ["--placement", EXAMPLE / "placement.toml", "-o", tmp_path / "recording.csv"]
    subprocess.run(
        [sys.executable, "-m", "stepgauge", "import", folder / "probeopen.txt", *arguments], check=True, timeout=60
    )
    one, other = (read_recording(path) for path in (folder / "recording.csv", tmp_path / "recording.csv"))
    assert one.frame["face"].tolist() == other.frame["face"].tolist()
    assert one.frame["cycle"].tolist() == other.frame["cycle"].tolist()
    assert np.abs(one.position_mm - other.position_mm).max() < 0.6e-6


def moved(tmp_path: Path, along_a: float = 0.0, along_s: float = 0.0, along_up: float = 0.0) -> Path:
    """A placement file with the gauge moved in its own directions, mm."""
    placement = read_placement(EXAMPLE / "placement.toml", read_gauge("step-gauge-420"))
    shift = np.array([along_a, along_s, along_up]) @ placement.rotation
    write_placement(
        tmp_path / "moved.toml",
        replace(placement, c1_mm=placement.c1_mm + shift, c2_mm=placement.c2_mm + shift),
    )
    return tmp_path / "moved.toml"


@pytest.mark.parametrize(
    ("shift", "complaint", "at"),
    [
        ({"along_up": -25.0}, "G38.2 move finished without making contact.", "G38.2"),
        ({"along_s": 8.0}, "Probe tripped during non-probe move.", "G1"),
    ],
    ids=["missed face", "collision beside the blocks"],
)
def test_the_controller_stops_where_the_gauge_was_not_expected(tmp_path: Path, shift, complaint: str, at: str):
    result = run(tmp_path / "out", "--blocks", "1:2", "--cycles", 1, "--true-placement", moved(tmp_path, **shift))
    assert result.returncode == 1
    stopped = re.search(rf"^LinuxCNC stopped at line (\d+): {re.escape(complaint)}$", result.stderr, re.M)
    assert stopped, result.stderr
    program = (tmp_path / "out" / "program.ngc").read_text().splitlines()
    assert program[int(stopped[1]) - 1].startswith(at + " ")
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "out" / "recording.csv").exists()
    assert not processes(orphaned=True)


def test_an_interrupted_run_leaves_no_process_behind(tmp_path: Path):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command(tmp_path / "out"), **pipes, text=True, preexec_fn=heed_interrupts)
    while not {"milltask", "rtapi_app"} <= processes() and process.poll() is None:
        time.sleep(0.1)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "run.py: error: interrupted"
    assert not processes(orphaned=True)


@pytest.mark.parametrize(
    ("limits_s", "code", "message"),
    [
        ((2.0, 100.0), 1, r"LinuxCNC stopped at line \d+: the time limit of this run is over"),
        ((100.0, 2.0), 2, r"run.py: error: .*output.txt: LinuxCNC did not run the program to an end; .*"),
    ],
    ids=["the driver's limit", "the hard limit"],
)
def test_a_run_that_takes_too_long_is_ended(tmp_path: Path, limits_s: tuple[float, float], code: int, message: str):
    """The driver stops at its own limit; where it does not, LinuxCNC is ended from outside."""
    script = (
        f"import sys; sys.argv[1:] = ['-o', {str(tmp_path / 'out')!r}]; sys.path.insert(0, {str(EXAMPLE)!r})\n"
        f"import controller, runpy; limits_s = {limits_s}\n"
        "controller._limit_s, controller._hard_limit_s = (lambda *_, s=s: s for s in limits_s)\n"
        f"runpy.run_path({str(EXAMPLE / 'run.py')!r}, run_name='__main__')"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    assert result.returncode == code
    assert re.fullmatch(message, result.stderr.splitlines()[-1])
    assert not processes(orphaned=True)


@pytest.mark.parametrize("route", ["side", "over"])
def test_the_interpreter_takes_the_program_and_moves_as_the_reader_read_it(tmp_path: Path, route: str):
    """rs274 -g prints the canonical motion of a program without running it."""
    setup = make_setup(read_gauge("step-gauge-420"), route=route)
    path = tmp_path / "program.ngc"
    path.write_text(render(setup.program, DIALECTS["linuxcnc"]))
    printed = subprocess.run(
        ["rs274", "-g", str(path)], capture_output=True, text=True, timeout=60, check=True, stdin=subprocess.DEVNULL
    ).stdout
    program = read_program(path, ProbingSettings())
    motions = re.findall(r"(STRAIGHT_(?:FEED|PROBE))\(([^)]*)\)", printed)
    assert [kind == "STRAIGHT_PROBE" for kind, _ in motions] == program.is_measure.tolist()
    places = np.array([[float(value) for value in values.split(",")[:3]] for _, values in motions])
    search = program.settings.search_mm * np.nan_to_num(program.approach)
    np.testing.assert_allclose(places, program.position_mm + search, atol=0.51e-4)
