"""Damaged files for every reader and verb: what must not happen, counted.

    python -m benchmarks.attack.fuzz --inputs 100000 --seed 1

Most inputs go to the readers and what is computed at once from them; a share goes to whole verbs. Counted are
tracebacks (errors other than the one line of a refusal), hangs over 5 s, memory, messages that are not one line of 300
printable characters, files that were harmed, and accepted nonsense: a slip in one number of recording, certificate or
placement that moves a result by more than its stated uncertainty without a refusal and without a note. Every input
follows from its seed and number: ``--only 1234`` runs one again and shows its error.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from benchmarks.attack.mutate import wild
from benchmarks.attack.nonsense import Nonsense
from benchmarks.attack.targets import Target, make_measurement, readers, verbs
from stepgauge.errors import InputError

HANG_S = 5.0
VERB_SHARE, SLIP_SHARE = 0.01, 0.25
"""Of all inputs: how many run a whole verb, and how many are slips of a pen whose result is looked at."""
SHOWN = 15


class HangError(BaseException):
    """Longer than :data:`HANG_S`."""


@dataclass
class Count:
    """What came of the inputs; ``bad`` lists the numbers of those that must not be, by what happened."""

    outcome: Counter[str] = field(default_factory=Counter)
    bad: list[tuple[int, str, str]] = field(default_factory=list)
    slowest_s: float = 0.0
    slowest: int = 0

    def add(self, number: int, outcome: str, what: str = "") -> None:
        """One more; ``what`` says why it must not be."""
        self.outcome[outcome] += 1
        if what:
            self.bad.append((number, outcome, what))


@contextmanager
def limit(seconds: float) -> Iterator[None]:
    """:class:`HangError` where the body takes more time of the processor, whatever else the machine does."""

    def stop(*_: Any) -> None:
        raise HangError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def judge(error: BaseException | None) -> tuple[str, str]:
    """Outcome of a run, and what is wrong with it (nothing for a good one)."""
    if error is None:
        return "accepted", ""
    if isinstance(error, HangError):
        return "hang", f"over {HANG_S:g} s"
    if isinstance(error, InputError):
        text = str(error)
        odd = len(text) > error.longest or not text.isprintable()
        return ("refused, message odd", text[:80]) if odd else ("refused", "")
    if isinstance(error, click.ClickException | click.exceptions.Exit):
        return "refused", ""
    if isinstance(error, OSError | MemoryError):
        return "refused by the system", ""
    return "traceback", f"{type(error).__name__}: {str(error)[:100]}"


class Field:
    """The measurement that is attacked, and the state that its files must keep."""

    def __init__(self, place: Path) -> None:
        self.place = place
        make_measurement(place)
        self.readers, self.verbs = readers(place), verbs()
        self.data = {one.seed: (place / one.seed).read_bytes() for one in (*self.readers, *self.verbs)}
        (place / "mine.txt").write_text("not to be touched\n")
        self.state = self._state()

    def _state(self) -> dict[str, str]:
        files = [p for p in self.place.rglob("*") if p.is_file() and "out" not in p.relative_to(self.place).parts[0]]
        return {str(p): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}

    def harmed(self) -> list[str]:
        """Files that are not as they were, are gone, or are new."""
        now = self._state()
        return sorted(name for name in {*now, *self.state} if now.get(name) != self.state.get(name))

    def attack(self, target: Target, data: bytes) -> BaseException | None:
        """Run a target on a damaged copy that lies beside the original; what it raised."""
        path = self.place / Path(target.seed).parent / f"out-{Path(target.seed).name}"
        path.write_bytes(data)
        try:
            with limit(HANG_S if not target.is_verb else 4 * HANG_S):
                target.run(path)
        except (Exception, HangError, SystemExit) as error:
            return error
        finally:
            path.unlink(missing_ok=True)
            if target.is_verb:
                shutil.rmtree(path.parent / "out", ignore_errors=True)
        return None


def run(inputs: int, seed: int, place: Path, only: int | None = None) -> tuple[Count, Nonsense]:
    """Attack with so many inputs; ``only``: the one of that number, whose error is shown."""
    arena, count = Field(place), Count()
    nonsense = Nonsense(place)
    for number in range(inputs) if only is None else (only,):
        pick = random.Random(f"{seed}/{number}")
        kind, begun = pick.random(), time.process_time()
        if kind < SLIP_SHARE:
            with limit(4 * HANG_S):
                outcome, what = nonsense.attack(number, pick)
        else:
            target = pick.choice(arena.verbs if kind > 1.0 - VERB_SHARE else arena.readers)
            error = arena.attack(target, wild(arena.data[target.seed], pick))
            outcome, what = judge(error)
            what = what and f"{target.name}: {what}"
            if only is not None and error is not None:
                traceback.print_exception(error)
        count.add(number, outcome, what)
        took = time.process_time() - begun
        if took > count.slowest_s:
            count.slowest_s, count.slowest = took, number
        if number % 1000 == 999:
            for name in arena.harmed():
                count.add(number, "file harmed", name)
    for name in arena.harmed():
        count.add(inputs, "file harmed", name)
    return count, nonsense


def main() -> int:
    """The command; the exit code is 1 where something happened that must not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        count, nonsense = run(asked.inputs, asked.seed, Path(folder) / "m", asked.only)
    print(f"{asked.inputs} inputs, seed {asked.seed}, {time.perf_counter() - begun:.0f} s")
    for outcome, n in count.outcome.most_common():
        print(f"  {n:7d} {outcome}")
    print(f"  slowest: {count.slowest_s:.2f} s (input {count.slowest})")
    print(f"  memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB at most")
    print(nonsense.summary())
    for number, outcome, what in count.bad[:SHOWN]:
        print(f"  input {number}: {outcome}: {what}")
    return int(bool(count.bad) or nonsense.share() > Nonsense.BAR)


if __name__ == "__main__":
    sys.exit(main())
