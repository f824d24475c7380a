"""Verbs killed in the middle of their work: the old files or the new ones, never some of each.

    python -m benchmarks.attack.kill --times 10

Every verb that writes runs over files of an earlier call and is killed at a random moment, and once between any two
files that take their places. Then all files must be the old ones, or all new (where it was between them: after the next
run), with nothing beside them but the folder of unfinished files, which the next run must clear.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import stepgauge.files.outputs as outputs
from benchmarks.attack.child import NEVER_OVER, STEPWISE, for_every_verb, lay_old, run, verb_parser, written
from stepgauge.files.outputs import UNFINISHED


def killed_at(files: int) -> Callable[[], object]:
    """Before the verb begins: it will kill itself when this many files have taken their places."""

    def prepare() -> None:
        rename, done = outputs._rename, 0

        def counted(beside: Path, target: Path) -> None:
            nonlocal done
            if done == files:
                os.kill(os.getpid(), signal.SIGKILL)
            done += 1
            rename(beside, target)

        outputs._rename = counted

    return prepare


def attack(place: Path, verb: str, times: int, pick: random.Random) -> list[str]:
    """Kill a verb so often; what was found that must not be."""
    (place / "out").mkdir(exist_ok=True)
    whole = run(verb)
    names = sorted(written(place))
    if whole.message:
        return [f"{verb}: {whole.message}"]
    found = []
    for _ in range(times):
        found += _once(place, verb, names, run_at=pick.uniform(0.0, whole.took_s))
    for files in range(len(names)):
        found += _once(place, verb, names, files=files)
    shutil.rmtree(place / "out", ignore_errors=True)
    return found


def _once(place: Path, verb: str, names: list[str], run_at: float | None = None, files: int = 0) -> list[str]:
    shutil.rmtree(place / "out", ignore_errors=True)
    old = lay_old(place, [] if verb in NEVER_OVER else names)
    ended = run(verb, killed_at(files)) if run_at is None else run(verb, kill_after_s=run_at)
    when = f"{verb}, killed after {run_at:.3f} s" if run_at is not None else f"{verb}, killed at file {files + 1}"
    left = written(place)
    found = [f"{when}: left {name}" for name in left if name not in names and UNFINISHED not in name]
    new = [name for name in names if name in left and left[name] != old.get(name)]
    between = any(name.endswith(outputs.READY) for name in left)
    if not between and verb not in STEPWISE and len(new) not in (0, len(names)):
        found.append(f"{when}: new files beside old ones: {', '.join(new)}")
    return [*found, *(_again(place, verb, names, old, when) if ended.killed else [])]


def _again(place: Path, verb: str, names: list[str], old: dict[str, bytes], when: str) -> list[str]:
    """What the run after a kill left that it must not."""
    message = run(verb).message
    if verb in NEVER_OVER and "exists already" in message:
        message = ""  # the killed run was done
    after = written(place)
    if message or sorted(after) != names or any(after[name] == old.get(name) for name in names):
        return [f"{when}: the next run left {', '.join(after)} {message}"]
    return []


def main() -> int:
    """The command; the exit code is 1 where anything was found."""
    parser = verb_parser(__doc__)
    parser.add_argument("--times", type=int, default=10, help="random moments per verb")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()

    def killed(place: Path, verb: str) -> list[str]:
        return attack(place, verb, asked.times, random.Random(f"{asked.seed}/{verb}"))

    return for_every_verb(killed, asked.verb)


if __name__ == "__main__":
    sys.exit(main())
