"""LinuxCNC itself, headless, on simulated axes: its configuration, one run of a program, and the tidying up after it.

LinuxCNC refuses to run as root, and a second instance on a machine ends the first one. So a run is made in a private
temporary folder as an ordinary user, waits for its turn behind a lock, and is not started beside a LinuxCNC that
somebody else is using. Parts of LinuxCNC leave their parent and session; they are adopted, so that every process that
was started can be found and ended by its number.
"""

from __future__ import annotations

import ctypes
import fcntl
import json
import os
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from hal_gauge import HERE, render

from stepgauge.errors import InputError
from stepgauge.machine.file import Machine
from stepgauge.motion.moves import Program, trace

SERVO_PERIOD_NS = 100_000
ACCELERATION_MM_S2 = 5000.0
PACKAGE = "linuxcnc-uspace"
LOCK = Path(tempfile.gettempdir()) / "stepgauge-linuxcnc.lock"
LOCK_WAIT_S = 600.0
START_S, STOP_S = 60.0, 15.0
ATTEMPTS = 3
STARVED = "Queue is not empty after probing"
"""LinuxCNC up to 2.9 may read the outcome of a touch too early where the machine is busy (its issues 662 and 3650)."""
NOT_UP = "the controller did not come up"
"""Its part for inputs and outputs may miss the commands that are sent while a busy machine starts it; nothing moves."""
BUSY = {STARVED: "read a touch too early", NOT_UP: "did not come up"}
_INSTANCE = ("linuxcncsvr", "milltask", "rtapi_app")


@dataclass(frozen=True)
class ScrewTable:
    """A screw compensation file (COMP_FILE) and its COMP_FILE_TYPE."""

    text: str
    kind: int = 0


@dataclass(frozen=True)
class Drives:
    """What the INI file says of the drives beside their speed; screw tables by the number of the joint."""

    servo_period_ns: int = SERVO_PERIOD_NS
    acceleration_mm_s2: float = ACCELERATION_MM_S2
    screw_tables: Mapping[int, ScrewTable] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """How a run ended: the controller's complaint (None where it had none), the line it was at, and the run time."""

    error: str | None
    line: int
    seconds: float


def latch_bound_um(speed_mm_s: float) -> float:
    """How late the controller may read a contact: the probe is looked at once a servo period, um."""
    return speed_mm_s * SERVO_PERIOD_NS * 1e-9 * 1e3


def require_linuxcnc() -> None:
    """:class:`InputError` with the package to install where LinuxCNC is not on this machine."""
    if shutil.which("linuxcnc") is None:
        raise InputError("linuxcnc", "LinuxCNC is not installed", expected=f"the Debian package {PACKAGE}")


def run_program(
    text: str, program: Program, machine: Machine, hal: str, keep: Path, drives: Drives | None = None
) -> Outcome:
    """Run a program text on LinuxCNC; again where the machine was too :data:`BUSY`, up to :data:`ATTEMPTS` times.

    Parameters
    ----------
    text, program : what the controller reads, and its moves (for the start position and the time limit)
    machine : travel and speeds
    hal : the HAL file of the axes and the gauge
    keep : folder that takes the probe log, the configuration and the controller's output
    drives : servo period and acceleration, where they are not the usual ones

    Raises
    ------
    InputError
        LinuxCNC is missing, is in use by somebody else, or did not start
    """
    require_linuxcnc()
    for attempt in range(ATTEMPTS):
        with _turn(), tempfile.TemporaryDirectory(prefix="stepgauge-linuxcnc-") as name:
            folder = Path(name)
            _write_configuration(folder, text, machine, hal, drives or Drives())
            outcome = _attempt(folder, program, machine, keep)
        if not (outcome.error and _again(attempt, keep)):
            break
    return outcome


def _attempt(folder: Path, program: Program, machine: Machine, keep: Path) -> Outcome:
    user = _ordinary_user(folder)
    try:
        _run(folder, user, _environment(folder, program, machine), _hard_limit_s(program, machine))
    finally:
        _keep(folder, keep)
    return _outcome(folder, keep)


def _again(attempt: int, keep: Path) -> bool:
    """Whether the machine was too busy for LinuxCNC and one more attempt is left; it is told, since it takes longer."""
    output = (keep / "output.txt").read_text(encoding="utf-8", errors="replace")
    reason = next((reason for sign, reason in BUSY.items() if sign in output), None)
    again = reason is not None and attempt + 1 < ATTEMPTS
    if again:
        print(f"LinuxCNC {reason} on a busy machine: the run is repeated", file=sys.stderr)
    return again


def _write_configuration(folder: Path, text: str, machine: Machine, hal: str, drives: Drives) -> None:
    limits = [
        {"letter": letter, "low_mm": low, "high_mm": high}
        for letter, (low, high) in zip("XYZ", machine.travel_mm.tolist(), strict=True)
    ]
    ini = render(
        HERE / "simulation.ini.j2",
        axes=limits,
        servo_period_ns=drives.servo_period_ns,
        speed_mm_s=machine.table.travel_speed_mm_s,
        acceleration_mm_s2=drives.acceleration_mm_s2,
        screw_tables=drives.screw_tables,
    )
    tip = machine.probe.tip_radius_mm
    for file, content in (
        ("program.ngc", text),
        ("simulation.hal", hal),
        ("simulation.ini", ini),
        ("tool.tbl", f"T1 P1 Z0 D{2 * tip:g} ; probe, tip radius {tip:g} mm\n"),
        ("parameters.var", ""),
        *((f"joint-{joint}.comp", table.text) for joint, table in drives.screw_tables.items()),
    ):
        (folder / file).write_text(content, encoding="utf-8")
    shutil.copy(HERE / "driver.py", folder / "driver.py")
    (folder / "driver.py").chmod(0o755)


def _ordinary_user(folder: Path) -> dict[str, object]:
    """How to start a process as somebody who is not root, who then owns the folder."""
    if os.geteuid() != 0:
        return {}
    nobody = pwd.getpwnam("nobody")
    for path in (folder, *folder.iterdir()):
        os.chown(path, nobody.pw_uid, nobody.pw_gid)
    return {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}


def _environment(folder: Path, program: Program, machine: Machine) -> dict[str, str]:
    """The way to the first position is the machine's own: up, across, and then the program comes down."""
    x, y, _ = program.position_mm[0]
    before = [f"G53 G0 Z{machine.travel_mm[2, 1] - 1e-3:.3f}", f"G53 G0 X{x:.3f} Y{y:.3f}"]
    return {
        "PATH": os.environ.get("PATH", os.defpath),
        "HOME": str(folder),
        "LC_ALL": "C",
        "STEPGAUGE_START_S": f"{START_S:.0f}",
        "STEPGAUGE_LIMIT_S": f"{_limit_s(program, machine):.0f}",
        "STEPGAUGE_BEFORE": json.dumps(before),
    }


def _limit_s(program: Program, machine: Machine) -> float:
    """Three times what the path takes at the speeds of the program with a stop at every corner, and half a minute."""
    path = trace(program)
    speed = program.settings
    search = path.measuring.sum() * (speed.standoff_mm + speed.search_mm) / speed.measuring_speed_mm_s
    travel = path.length_mm[~path.measuring].sum() / speed.travel_speed_mm_s
    corners = len(path.length_mm) * machine.table.travel_speed_mm_s / ACCELERATION_MM_S2
    return float(30.0 + 3.0 * (search + travel + corners))


def _hard_limit_s(program: Program, machine: Machine) -> float:
    """When LinuxCNC is ended from outside, because its driver has not."""
    return START_S + _limit_s(program, machine) + START_S


@contextmanager
def _turn() -> Iterator[None]:
    """Hold the lock that lets one simulation run at a time on this machine."""
    handle = _open_lock()
    try:
        _wait_for(handle)
        _refuse_other_instances()
        yield
    finally:
        os.close(handle)


def _open_lock() -> int:
    """Opened for reading where it is there: in a shared folder only its owner may open it for writing."""
    try:
        return os.open(LOCK, os.O_RDONLY)
    except FileNotFoundError:
        return os.open(LOCK, os.O_RDWR | os.O_CREAT, 0o644)


def _wait_for(handle: int) -> None:
    deadline = time.monotonic() + LOCK_WAIT_S
    while True:
        try:
            return fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise InputError(LOCK, f"another simulation has held this lock for {LOCK_WAIT_S:g} s") from None
            time.sleep(0.5)


def _refuse_other_instances() -> None:
    for pid in _processes():
        name = _stat(pid)[0]
        if name in _INSTANCE:
            raise InputError(
                "linuxcnc",
                "a LinuxCNC is already running here, and a second one would end it",
                found=f"{name}, process {pid}",
                expected="none; close it first",
            )


@contextmanager
def running(
    program: Program, machine: Machine, hal: str, keep: Path, drives: Drives | None = None, limit_s: float | None = None
) -> Iterator[Callable[[Iterable[str]], None]]:
    """LinuxCNC on and homed, above the first position of a program, for whoever moves it by its Python interface.

    Parameters and errors as :func:`run_program`; ``limit_s``: how long it stays up, by default as long as the program
    needs. Gives a function that runs lines of HAL on the controller that is up.
    """
    require_linuxcnc()
    with _turn(), tempfile.TemporaryDirectory(prefix="stepgauge-linuxcnc-") as name:
        folder = Path(name)
        _write_configuration(folder, "", machine, hal, drives or Drives())
        user = _ordinary_user(folder)
        environment = {**_environment(folder, program, machine), "STEPGAUGE_IDLE": "yes"}
        if limit_s is not None:
            environment["STEPGAUGE_LIMIT_S"] = f"{limit_s:.0f}"
        try:
            with _ready(folder, user, environment, keep) as process:
                yield lambda lines: _set_hal(lines, environment, user)
                (folder / "end").touch()
                with suppress(subprocess.TimeoutExpired):
                    process.wait(STOP_S)
        finally:
            _keep(folder, keep)


@contextmanager
def _ready(
    folder: Path, user: dict[str, object], environment: dict[str, str], keep: Path
) -> Iterator[subprocess.Popen[bytes]]:
    """LinuxCNC that is up; started again where the machine was too busy for it."""
    for attempt in range(ATTEMPTS):
        with _started(folder, user, environment) as process:
            if _comes_up(folder, process):
                yield process
                return
        _keep(folder, keep)
        if not _again(attempt, keep):
            break
    raise InputError(keep / "output.txt", "LinuxCNC did not come up; what it printed stands here")


def _set_hal(lines: Iterable[str], environment: dict[str, str], user: dict[str, object]) -> None:
    """Lines of HAL on the controller that is up; :class:`InputError` with what it complains about."""
    done = subprocess.run(
        ["halcmd", "-f"],
        input="".join(f"{line}\n" for line in lines),
        env=environment,
        cwd=environment["HOME"],
        capture_output=True,
        text=True,
        check=False,
        **user,  # type: ignore[call-overload]
    )
    if done.returncode:
        raise InputError("halcmd", "HAL was not set", found=done.stderr.strip())


def _comes_up(folder: Path, process: subprocess.Popen[bytes]) -> bool:
    deadline = time.monotonic() + 2.0 * START_S
    while not (folder / "ready").exists():
        if process.poll() is not None or time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def _run(folder: Path, user: dict[str, object], environment: dict[str, str], limit_s: float) -> None:
    """Start LinuxCNC, wait for its end, and leave no process behind."""
    with (
        _started(folder, user, environment) as process,
        suppress(subprocess.TimeoutExpired),  # no outcome is written then, and that is what is reported
    ):
        process.wait(limit_s)


@contextmanager
def _started(folder: Path, user: dict[str, object], environment: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """LinuxCNC's process; at the end none is left of those that it started."""
    _adopt_orphans()
    before = _descendants()
    with (folder / "output.txt").open("wb") as output:
        process = subprocess.Popen(
            ["linuxcnc", "-r", str(folder / "simulation.ini")],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # an interrupt from the keyboard is for us, who then end it in order
            **user,  # type: ignore[call-overload]
        )
    try:
        yield process
    finally:
        _end(process, folder / "driver.pid", before)


def _adopt_orphans() -> None:
    """Become the parent of descendants whose own parent ends (Linux: PR_SET_CHILD_SUBREAPER)."""
    if ctypes.CDLL(None, use_errno=True).prctl(36, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER)")


def _end(process: subprocess.Popen[bytes], driver: Path, before: set[int]) -> None:
    """LinuxCNC tidies up when its display ends, or when it is told to; what is still there after that is ended too."""
    if process.poll() is None:
        pid = int(driver.read_text()) if driver.exists() else process.pid
        if pid in _descendants():
            os.kill(pid, signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            process.wait(STOP_S)
    left = _descendants() - before
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    process.wait()
    for pid in left - {process.pid}:
        with suppress(ChildProcessError):
            os.waitpid(pid, 0)


def _descendants() -> set[int]:
    """Children of this process, theirs, and so on, zombies included."""
    parent = {pid: _stat(pid)[1] for pid in _processes()}
    found: set[int] = set()
    layer = {os.getpid()}
    while layer:
        layer = {pid for pid, of in parent.items() if of in layer} - found
        found |= layer
    return found


def _processes() -> list[int]:
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]


def _stat(pid: int) -> tuple[str, int]:
    """Name and parent of a process; the name is empty for a zombie, and the parent -1 where there is no process."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return "", -1
    name, _, rest = text.partition("(")[2].rpartition(")")
    state, parent = rest.split()[:2]
    return "" if state == "Z" else name, int(parent)


def _keep(folder: Path, keep: Path) -> None:
    keep.mkdir(parents=True, exist_ok=True)
    for file in (*folder.glob("*.txt"), folder / "simulation.hal", folder / "simulation.ini"):
        shutil.copyfile(file, keep / file.name)


def _outcome(folder: Path, keep: Path) -> Outcome:
    try:
        found = json.loads((folder / "outcome.json").read_text())
    except FileNotFoundError:
        raise InputError(
            keep / "output.txt", "LinuxCNC did not run the program to an end; what it printed stands here"
        ) from None
    return Outcome(found["error"], found["line"], found["seconds"])
