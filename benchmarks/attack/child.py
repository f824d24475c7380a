"""A verb in a process of its own that can be killed or starved; forked, so that nothing has to be loaded again."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.attack.targets import call, make_measurement

G, M = ("-g", "step-gauge-420.toml"), ("-m", "machine.toml")
WRITERS: dict[str, tuple[object, ...]] = {
    "locate": ("points.csv", *G, *M, "-o", "out/placement.toml"),
    "plan": ("placement.toml", *G, *M, "-d", "dmis", "--blocks", "1:4", "-o", "out/p.dmi"),
    "simulate": ("program.dmi", *G, *M, "-p", "placement.toml", "--plot", "out/r.png", "-o", "out/r.csv"),
    "import": ("log-dmis.dmo", *G, "-p", "log-placement.toml", "-o", "out/r.csv"),
    "export": ("recording.csv", "--to", "dmis", "-o", "out/r.dmo"),
    "evaluate": ("recording.csv", *G, "-o", "out"),
    "budget": ("recording.csv", *G, *M, "--runs", 0, "-o", "out"),
    "budget --method monte-carlo": ("recording.csv", *G, *M, "--runs", 100, "-o", "out"),
    "test iso230": ("recording.csv", *G, "-o", "out"),
    "test iso10360": ("recording.csv", *G, "--mpe", "1.8 + L/350", "-o", "out"),
    "compensate": ("result", "--axis", "y", "--to", "csv", "--angle-limit", 10, "-o", "out/c.csv"),
    "report": ("result", "-o", "out/r.html"),
    "evaluate --draw all": ("recording.csv", *G, *M, "-o", "out"),
    "probe qualify": ("sphere.csv", "--sphere-diameter", 25, "--tip-diameter", 4, "-o", "out/q.json"),
    "probe compensate": ("sphere.csv", "-q", "qualification.json", "-o", "out/c.csv"),
    "probe map": ("omp40-2-50mm.toml", "--polar", "90", "--azimuth", "0:350:30", "-o", "out/m.csv"),
    "history": ("result", "--date-from", "file", "-o", "out"),
    "diagnose": ("recording.csv", *G, *M, "-o", "out"),
    "dcc write": ("result", "-c", "certificate.toml", *G, "-o", "out/c.xml"),
    "dcc export-gauge": ("step-gauge-420.toml", "-c", "gauge-laboratory.toml", "-o", "out/g.xml"),
    "dcc import-gauge": ("gauge.xml", "-o", "out/g.toml"),
    "list files": ("step-gauge-420", "--copy-to", "out"),
    "demo": ("-o", "out"),
}
"""Verbs that write, as called in the folder of the measurement; what they write goes to ``out``."""
NEVER_OVER = {"list files"}
"""Verbs that refuse to write over a file that is there."""
STEPWISE = {"demo"}
"""Verbs that run others, each with a set of its own."""
RUNS = ".uncertainty-runs"
"""Where a Monte Carlo keeps what it has done, to go on from there after a kill."""
STORE = "history.sqlite"
"""The store of a history keeps itself whole, by its own journal beside it."""
Attack = Callable[[Path, str], list[str]]


@dataclass(frozen=True)
class Ended:
    """How a child ended: killed, or with this message (empty: all went well); how long it took."""

    killed: bool
    message: str
    took_s: float


def run(verb: str, first: Callable[[], object] = lambda: None, kill_after_s: float | None = None) -> Ended:
    """Run a verb of :data:`WRITERS` in a forked process, after ``first``; kill it after some seconds."""
    reading, writing = os.pipe()
    begun = time.perf_counter()
    process = os.fork()
    if process == 0:
        _child(verb, first, writing)
    os.close(writing)
    if kill_after_s is not None:
        time.sleep(kill_after_s)
        os.kill(process, signal.SIGKILL)
    with os.fdopen(reading, encoding="utf-8", errors="replace") as said:
        message = said.read()
    status = os.waitpid(process, 0)[1]
    return Ended(os.WIFSIGNALED(status), message, time.perf_counter() - begun)


def _child(verb: str, first: Callable[[], object], writing: int) -> None:
    """Never returns: the fork ends here, without the parent's clearing up."""
    try:
        first()
        call(*verb.split(), *WRITERS[verb])
    except BaseException as error:
        os.write(writing, f"{type(error).__name__}: {error}".encode()[:2000])
    os._exit(0)


def written(place: Path) -> dict[str, bytes]:
    """The files below ``out`` with their content; without those that are kept from run to run."""
    out = place / "out"
    files = {path.relative_to(out).as_posix(): path for path in sorted(out.rglob("*")) if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if not name.startswith((STORE, RUNS))}


def lay_old(place: Path, names: list[str]) -> dict[str, bytes]:
    """Files of an earlier call under these names."""
    old = {name: f"old {name}\n".encode() for name in names}
    for name, content in old.items():
        path = place / "out" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return old


def verb_parser(about: str | None) -> argparse.ArgumentParser:
    """A parser with ``--verb``, and these words as its help."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--verb", action="append", choices=WRITERS, help="only this one; repeatable")
    return parser


def for_every_verb(attack: Attack, verbs: list[str] | None) -> int:
    """Attack these verbs, or every one that writes, and tell; the exit code is 1 where anything was found."""
    found: list[str] = []
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        make_measurement(Path(folder))
        for verb in verbs or WRITERS:
            mine = attack(Path(folder), verb)
            print(f"{verb:18} {'nothing wrong' if not mine else f'{len(mine)} wrong'}", flush=True)
            found += mine
    print("\n".join(found))
    return int(bool(found))
