"""Flipped bits in every kind of file that stepgauge writes and reads back: what is read is as it was, or refused.

    python -m benchmarks.attack.flips --bits 1000 --seed 1

Counted are silent changes (what is read is another thing than before) and tracebacks (errors other than the one line
of a refusal); none may be. A bit that changes nothing, in a comment or between the pages of a store, is no change.
Kinds of files have equal shares, whatever their sizes.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.attack.targets import call, make_measurement
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.errors import InputError
from stepgauge.evaluation.files import read_evaluation
from stepgauge.executors.journal import open_steps
from stepgauge.executors.processes import InProcess
from stepgauge.fleet.evaluating import evaluate_fleet
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.rows import read_rows
from stepgauge.fleet.store import Fleet, _read_gauge, _read_machine
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.history import refresh_store
from stepgauge.live.journal import look, start
from stepgauge.machine.file import read_machine
from stepgauge.probes.qualification import read_qualification
from stepgauge.standards.budget_files import read_budget
from stepgauge.web.measuring import MeasurementRequest, read_request
from tests.fleet.made import make_fleet


@dataclass(frozen=True)
class Kind:
    """Files of one kind and what is read of them, in a form that can be compared."""

    name: str
    files: tuple[Path, ...]
    read: Callable[[Path], object]


@dataclass
class Count:
    """What came of the bits; ``bad`` says which must not be."""

    outcome: Counter[str] = field(default_factory=Counter)
    bad: list[str] = field(default_factory=list)


def make_kinds(place: Path) -> list[Kind]:
    """The files, made by the verbs and functions that write them."""
    make_measurement(place)
    gauge = read_gauge(place / "step-gauge-420.toml")
    words = ("-g", place / "step-gauge-420.toml", "-m", place / "machine.toml")
    call("diagnose", place / "recording.csv", *words, "-o", place / "cause")
    fleet = _fleet(place / "fleet")
    store = place / "history.sqlite"
    archive = place / "archive/2026-03-02"
    archive.mkdir(parents=True)
    (archive / "evaluation.json").write_bytes((place / "result/evaluation.json").read_bytes())
    refresh_store(store, archive.parent)
    MeasurementRequest("r.csv", "gauge.toml", "machine.toml", "placement.toml", seed=7).write(
        place / "r.csv.request.json"
    )

    def placed(path: Path) -> str:
        return repr(read_placement(path, gauge))

    kinds: list[tuple[str, Iterable[Path], Callable[[Path], object]]] = [
        ("journal of a measurement", [_measured(place / "m.csv.journal")], _read_journal),
        ("journal of steps", [_steps(place / "steps")], _read_steps),
        ("store of a history", [store], lambda path: repr(refresh_store(path, archive.parent).entries)),
        ("evaluation.json", [place / "result/evaluation.json"], lambda path: read_evaluation(path, with_inputs=False)),
        ("budget.json", [place / "result/budget.json"], read_budget),
        ("diagnosis.json", [place / "cause/diagnosis.json"], lambda path: Diagnosis.read(path).contents),
        ("qualification.json", [place / "qualification.json"], read_qualification),
        ("placement.toml", [place / "placement.toml"], placed),
        ("machine.diagnosed.toml", [place / "cause/machine.diagnosed.toml"], _read_machine_table),
        ("measurement as asked", [place / "r.csv.request.json"], read_request),
        ("store of a fleet", _stored(fleet), lambda _: _all_of(fleet)),
    ]  # fmt: skip
    return [Kind(name, tuple(files), read) for name, files, read in kinds]


def _measured(path: Path) -> Path:
    random_ = np.random.default_rng(3)
    head = {"plan": "p", "machine": "m", "gauge": "g", "points": 60, "started": "2026-11-23T08:00:00.000+00:00"}
    journal = start(path, head)
    for point in range(1, 41):
        position = dict(zip(("x_mm", "y_mm", "z_mm"), random_.uniform(0.0, 500.0, 3).round(4).tolist(), strict=True))
        journal.add(point, {"gauge_temperature_C": 20.3, **position, "time_s": 3.0 * point, "speed_mm_s": 3.0})
    journal.close()
    return path


def _steps(folder: Path) -> Path:
    steps = open_steps(folder, {"gauge": "T-1", "odds": 20.0}, False)
    for number in range(12):
        steps.once(f"measured {number}", lambda number=number: {"path": f"run-{number}.csv", "minutes": 1.5 * number})  # type: ignore[misc]
    steps.close()
    return steps.path


def _read_steps(path: Path) -> object:
    steps = open_steps(path.parent, {"gauge": "T-1", "odds": 20.0}, True)
    steps.close()
    return steps.done


def _read_journal(path: Path) -> object:
    return look(path).head, look(path).rows


def _read_machine_table(path: Path) -> object:
    return repr(read_machine(path).table)


def _fleet(folder: Path) -> Path:
    evaluate_fleet(make_fleet(folder, 3, 1), InProcess())
    return folder


def _stored(folder: Path) -> list[Path]:
    return [one for one in sorted(folder.rglob("*")) if one.is_file() and one.name != ".lock"]


def _all_of(folder: Path) -> object:
    """Everything that the package reads out of a store."""
    _read_gauge.cache_clear()
    _read_machine.cache_clear()
    fleet = Fleet(folder)
    frame = fleet.recordings()
    said: list[Any] = [frame.to_csv()]
    for key, recording in sorted(fleet.read_many(frame["recording"].tolist())):
        said += [key, recording.frame.to_csv(), dict(recording.comments)]
    for row in frame.itertuples():
        said += [fleet.gauge(row.certificate).position_mm.tolist(), repr(fleet.machine(row.machine_file).table)]
    said += [read_rows(path).to_pylist() for path in sorted((folder / "sources").glob("*.parquet"))]
    return [*said, *(repr(table.read().to_pylist()) for table in tables_of(fleet))]


def attack(kinds: list[Kind], bits: int, seed: int) -> Count:
    """Flip so many bits, one at a time, each kind in turn."""
    count, pick = Count(), random.Random(seed)
    known = {kind.name: kind.read(kind.files[0]) for kind in kinds}
    for number in range(bits):
        kind = kinds[number % len(kinds)]
        path = pick.choice(kind.files)
        whole = path.read_bytes()
        place, bit = pick.randrange(len(whole)), pick.randrange(8)
        damaged = bytearray(whole)
        damaged[place] ^= 1 << bit
        path.write_bytes(bytes(damaged))
        try:
            outcome = "the same" if kind.read(path) == known[kind.name] else "silent change"
        except InputError:
            outcome = "refused"
        except Exception as error:
            outcome = f"traceback: {type(error).__name__}: {error}"
        path.write_bytes(whole)
        count.outcome[outcome.partition(":")[0]] += 1
        if outcome not in ("the same", "refused"):
            count.bad.append(f"{kind.name}, {path.name}, bit {bit} of byte {place}: {outcome}")
    return count


def main() -> int:
    """Print the counts; the exit code is the number of what must not be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bits", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        count = attack(make_kinds(Path(place) / "m"), given.bits, given.seed)
    for line in count.bad:
        print(line)
    print(", ".join(f"{number} {what}" for what, number in sorted(count.outcome.items())))
    return len(count.bad)


if __name__ == "__main__":
    sys.exit(main())
