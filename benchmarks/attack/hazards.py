"""Hazardous constructs at every kind of place of every shipped template, and in every option: none may be accepted.

    python -m benchmarks.attack.hazards [--each 2] [--show 20] [--rs274] [DIALECT ...]

A template is filled with a small plan; each construct of the corpus (:mod:`benchmarks.attack.constructs`) is put into
the text at each kind of place (header, before and after moves, in branches and loops, in blocks and remarks, behind the
end, in place of numbers), and into each option of the dialect. The text is then read and compared with the plan, as
``plan`` does for a template of somebody's own. What a controller would not execute at its place (:mod:`.executed`) is
harmless and not counted. Exit code 0: none of the others was accepted, and no error but a refusal in one line; else
they are shown with place and reason. ``--each N`` puts a construct at every place ``N`` times, on other lines and from
the second time on in other spellings, drawn by ``--seed``. ``--rs274``: LinuxCNC's own interpreter says how many
constructs of its family it executes.
"""

from __future__ import annotations

import argparse
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from benchmarks.attack.constructs import FAMILIES, Construct, constructs
from benchmarks.attack.executed import is_harmless, run_by
from benchmarks.attack.insertions import Text, insertions
from stepgauge.errors import InputError
from stepgauge.files.templating import check_printable
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import Program
from stepgauge.planning.plan import PlanOptions
from stepgauge.planning.program import ProbingChoice, checked_program, make_settings, program_text
from stepgauge.programs import DIALECTS
from stepgauge.programs.compare import difference, read_again


@cache
def planned() -> Program:
    """Two blocks, one cycle, the gauge a little askew."""
    import numpy as np

    gauge = read_gauge("step-gauge-420")
    axis = np.array([0.8, 0.6, 0.0])
    start = np.array([-61.25, 120.75, 33.5])
    across = np.array([0.0, 0.0, 1.0])
    lies = Placement(start, start + 20.0 * (gauge.n_blocks - 1) * axis, axis, across, 1, gauge.n_blocks)
    settings = make_settings(gauge, None, 2.0, ProbingChoice())
    return checked_program(lies, gauge, None, PlanOptions(1, 2, cycles=1), settings)


@dataclass
class Count:
    """What came of the constructs of a dialect."""

    outcome: Counter[str] = field(default_factory=Counter)
    accepted: list[tuple[str, Construct, str]] = field(default_factory=list)

    def add(self, place: str, construct: Construct, what: str, put_in: str) -> None:
        """One insertion."""
        self.outcome[what] += 1
        if what in ("accepted", "traceback"):
            self.accepted.append((place, construct, put_in))


class Target:
    """A dialect with its shipped template, filled."""

    def __init__(self, dialect: str) -> None:
        self.dialect = DIALECTS[dialect]
        self.program = self.dialect.slowed(planned())
        self.text = program_text(planned(), dialect).text

    def accepts(self, text: str) -> bool:
        """Whether ``plan`` would write this text, if a template gave it."""
        check_printable(text, Path("attacked.j2"))
        back = read_again(text, self.dialect, self.program.settings)
        return difference(self.program, back, self.dialect) is None

    def judge(self, text: str, start: int, end: int) -> str:
        """What came of an insertion at ``start:end`` of ``text``."""
        if is_harmless(self.text, text, start, end, self.dialect.name):
            return "harmless"
        return _outcome(lambda: self.accepts(text))

    def judge_option(self, name: str, value: str, harmful: bool) -> str:
        """What came of a value of an option; ``harmful``: a name of a file that is not the log's."""

        def takes() -> bool:
            nonlocal text
            text = program_text(planned(), self.dialect.name, options={name: value}).text
            return True

        text = self.text
        outcome = _outcome(takes)
        if outcome != "accepted" or harmful:
            return outcome
        bare = [run_by(one, self.dialect.name) for one in (self.text, text)]
        return "harmless" if bare[0] == bare[1] else "accepted"


def _outcome(takes: Callable[[], bool]) -> str:
    """What comes of a text: anything but a refusal in one line is wrong, too."""
    try:
        return "accepted" if takes() else "refused"
    except InputError:
        return "refused"
    except Exception:
        return "traceback"


def attack(dialect: str, each: int = 1, seed: int = 1, share: float = 1.0) -> Count:
    """Every construct of a dialect at every kind of place and in every option, or a ``share`` of them by ``seed``."""
    target, count, pick = Target(dialect), Count(), random.Random(f"{dialect}-{seed}")
    for construct in constructs(dialect):
        for place, text, start, end in _drawn(target, construct, each, pick):
            if share == 1.0 or pick.random() < share:
                count.add(place, construct, target.judge(text, start, end), text[start:end])
        for name, value, harmful in _values(target, construct):
            if share == 1.0 or pick.random() < share:
                count.add(f"--set {name}", construct, target.judge_option(name, value, harmful), value)
    return count


def _drawn(target: Target, construct: Construct, each: int, pick: random.Random) -> Iterator[tuple[str, str, int, int]]:
    known = Text(target.text, target.dialect.name)
    for time_number in range(each):
        spelled = construct.spelled(target.dialect.name, pick) if time_number else construct
        yield from insertions(known, spelled, pick)


ASKED_FOR = {
    "offset": r"G5[4-9](\.[123])?|G54\.1 P\d+|G5\d\d",
    "spindle_deg": r"[-+]?\d+(\.\d+)?",
    "orient": r"M19( R\d+)?",
}
"""Values that somebody may ask for by an option, by its documented kind."""


def _values(target: Target, construct: Construct) -> Iterator[tuple[str, str, bool]]:
    for name, option in target.dialect.options.items():
        default = str(getattr(option, "default", option))
        names_file = name in ("file", "folder", "mask")
        if construct.kind == "path" and names_file:
            yield name, construct.text, True
        elif construct.kind == "number" and default:
            if not re.fullmatch(ASKED_FOR.get(name, r"(?!)"), construct.in_place_of(default)):
                yield name, construct.in_place_of(default), False
        elif construct.kind == "block" and not re.fullmatch(ASKED_FOR.get(name, r"(?!)"), construct.text):
            yield name, construct.text, False


def executed_by_linuxcnc() -> str:
    """How many constructs of its family LinuxCNC's interpreter takes, before the first move of the shipped program."""
    if shutil.which("rs274") is None:
        return "rs274 is not installed"
    target = Target("linuxcnc")
    known = Text(target.text, "linuxcnc")
    blocks = [one for one in constructs("linuxcnc") if one.kind == "block"]
    taken = 0
    with tempfile.TemporaryDirectory() as folder:
        for one in blocks:
            text = known.with_line(known.first_move, one.text)[0]
            path = Path(folder) / "a.ngc"
            path.write_text(text)
            command = ["rs274", "-g", str(path)]
            try:
                done = subprocess.run(command, capture_output=True, timeout=2, check=False, cwd=folder)
                taken += done.returncode == 0
            except subprocess.TimeoutExpired:  # an endless loop is executed, too
                taken += 1
    return f"rs274 executes {taken} of {len(blocks)} constructs of linuxcnc where it finds them"


def main() -> int:
    """A line per dialect; exit code 1 where anything was accepted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dialects", nargs="*", metavar="DIALECT", help="default: all")
    parser.add_argument("--each", type=int, default=2, help="times that a construct is put at every kind of place")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", type=int, default=20, help="accepted ones shown by dialect")
    parser.add_argument("--rs274", action="store_true", help="ask LinuxCNC's interpreter, too")
    asked = parser.parse_args()
    total: Counter[str] = Counter()
    print("dialect      constructs  refused  accepted  traceback  harmless  time, s")
    for name in asked.dialects or FAMILIES:
        began = time.perf_counter()
        count = attack(name, asked.each, asked.seed)
        total += count.outcome
        numbers = "  ".join(f"{count.outcome[what]:8d}" for what in ("refused", "accepted", "traceback", "harmless"))
        print(f"{name:12s} {len(constructs(name)):10d} {numbers} {time.perf_counter() - began:8.1f}", flush=True)
        places = Counter(place for place, _, _ in count.accepted)
        print("".join(f"    {number} {place}\n" for place, number in places.most_common()), end="")
        for place, construct, put_in in count.accepted[: asked.show]:
            print(f"    {place}: {put_in!r}: {construct.reason}")
    bad = total["accepted"] + total["traceback"]
    print(f"all: {total['refused'] + bad} hazardous, {total['accepted']} accepted, {total['traceback']} tracebacks")
    if asked.rs274:
        print(executed_by_linuxcnc())
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
