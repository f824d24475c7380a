"""Cost of a fleet: ``python benchmarks/fleet_cost.py [--recordings 10000] [--probings 1e8] [--folder DIR]``.

Recordings of about 400 rows into the store, evaluated and diagnosed from it by processes of this computer and by a Dask
cluster, and questions in SQL over many probings. Prints seconds with their bars, how cost grows with the number of
recordings, and the load of the computer, without which the seconds mean little.
"""

from __future__ import annotations

import argparse
import datetime
import gc
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from table import Table

from stepgauge.executors.dask import Dask, local_cluster
from stepgauge.executors.processes import InProcess, Processes
from stepgauge.executors.task import Engine, perform
from stepgauge.fleet.budgeting import budget_fleet
from stepgauge.fleet.content import read_with_files
from stepgauge.fleet.diagnosing import diagnose_fleet
from stepgauge.fleet.evaluating import evaluate_fleet
from stepgauge.fleet.query import query
from stepgauge.fleet.results import Results
from stepgauge.fleet.rows import make_probings, write_rows
from stepgauge.fleet.schema import PROBINGS, RECORDINGS, arrow_schema
from stepgauge.fleet.store import Entry, Fleet, _index_rows
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.recording import Recording

CYCLES = 10
"""Of the 42 faces: 420 rows."""
MACHINES, MONTHS, HALLS = 200, 24, ("North", "South", "West")
SIZES = (100, 1000, 10_000)
SAMPLES = (16, 64)
"""Recordings of which budgets and diagnoses are made: what the second number takes longer is without the start."""
Work = Callable[[Fleet, Engine], object]
WORKED = {"budget": "budgets", "diagnose": "diagnoses"}
MANY_MONTHS = 2
"""Of the store of very many probings."""
QUESTIONS = {
    "probings by hall": "SELECT hall, count(*), avg(z_mm), stddev(z_mm) FROM probings GROUP BY hall",
    "a face by gauge and month": "SELECT gauge, month, avg(x_mm) FROM probings WHERE face = 20 GROUP BY ALL",
    "a machine's readings": "SELECT month, face, avg(x_mm) FROM probings WHERE machine = 'M007' GROUP BY ALL",
    "owners": "SELECT hall, type, count(DISTINCT gauge) FROM recordings GROUP BY ALL",
    "how many": "SELECT count(*) FROM probings",
}  # fmt: skip


def make_recording(gauge: Gauge, number: int) -> Recording:
    """A recording along x with a scale error and noise of 0.3 um."""
    random = np.random.default_rng(number)
    face = np.tile(np.arange(1, gauge.n_faces + 1), CYCLES)
    front, n = face % 2 == 1, len(face)
    celsius = np.round(20.0 + 0.1 * np.sin(np.arange(n) / 50.0), 3)
    grown = gauge.table.expansion_per_K * (celsius - 20.0)
    along = gauge.position_mm[face - 1] * (1.0 + grown + number % 7 * 1e-6) + np.where(front, -1.997, 1.997)
    columns = {
        "placement": np.ones(n, np.int64),
        "cycle": np.repeat(np.arange(1, CYCLES + 1), gauge.n_faces),
        "face": face,
        "x_mm": np.round(100.0 + along + random.normal(0.0, 3e-4, n), 7),
        "y_mm": np.round(300.0 + random.normal(0.0, 1e-4, n), 7),
        "z_mm": np.round(100.0 + random.normal(0.0, 1e-4, n), 7),
        "approach_i": np.where(front, 1.0, -1.0),
        "approach_j": np.zeros(n),
        "approach_k": np.zeros(n),
        "time_s": np.arange(n) * 3.0,
        "gauge_temperature_C": celsius,
    }
    return Recording(columns, {"tip_radius_mm": "2"}, f"{number}.csv")


def owners(number: int) -> dict[str, str | None]:
    """Of the recording of that number."""
    machine = number % MACHINES
    hall = HALLS[machine % len(HALLS)]
    return {
        "machine": f"M{machine:03d}",
        "type": f"T{machine % 5}",
        "hall": hall,
        "probe": None,
        "gauge": f"G{number % 20:02d}",
    }


def moment(number: int) -> datetime.datetime:
    """When it was measured: machine after machine, a month later each round."""
    month = number // MACHINES % MONTHS
    return datetime.datetime(2024 + month // 12, 1 + month % 12, 1 + number // (MACHINES * MONTHS) % 28, 9)


def fill(fleet: Fleet, count: int) -> float:
    """Add recordings; returns the seconds that it took without making them."""
    gauge, files = read_with_files(read_gauge, "step-gauge-420")
    certificate = fleet.keep("gauge", files)
    machine = fleet.keep("machine", read_with_files(read_machine, "bridge-cmm")[1])
    took_s = 0.0
    for first in range(0, count, 1000):
        entries = [
            Entry(make_recording(gauge, number), owners(number), moment(number), certificate, machine)
            for number in range(first, min(first + 1000, count))
        ]
        took_s += seconds(lambda entries=entries: fleet.add(entries))  # type: ignore[misc]
    return took_s


def seconds(act: Callable[[], object]) -> float:
    """By the clock on the wall."""
    gc.collect()
    began = time.perf_counter()
    act()
    return time.perf_counter() - began


def load() -> str:
    """Of the computer, in the last minute, with the number of processors."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"


def slope(sizes: list[int], values: list[float]) -> float:
    """Exponent of the growth."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def cost_alone(folder: Path) -> None:
    """What a process of its own needs for a fleet of one size: printed for the one that asked, as seconds and MB."""
    fleet = Fleet(folder)
    gauge = fleet.gauge(fleet.recordings()["certificate"][0])
    from stepgauge.evaluation.evaluate import evaluate

    evaluate(make_recording(gauge, 0), gauge)
    perform(len, "")  # what is loaded once
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.process_time()
    errors = evaluate_fleet(fleet, InProcess())
    took = time.process_time() - began
    print(took, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e3, len(errors))


def growth(table: Table, folder: Path, sizes: list[int]) -> None:
    """Processor seconds and memory of one process, from small fleets to large ones."""
    took, grown = [], []
    for size in sizes:
        fleet = Fleet(folder / f"of-{size}", create=True)
        print(f"add {size} recordings: {fill(fleet, size):.1f} s ({load()})")
        command = [sys.executable, __file__, "--alone", str(fleet.folder)]
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
        took.append(float(said[0]))
        grown.append(float(said[1]))
        print(
            f"evaluate {size} recordings in one process: {took[-1]:.2f} s of processor, {grown[-1]:.0f} MB more memory"
        )
    table.add("evaluation: exponent of time by number", slope(sizes, took), "", 0.95, 1.05)
    table.add("evaluation: exponent of memory by number", slope(sizes, [max(mb, 1.0) for mb in grown]), "", None, 1.05)


def engines(table: Table, fleet: Fleet, count: int) -> None:
    """The whole fleet on two processes and on a cluster of one and of two workers; diagnoses by a sample."""
    results = Results(fleet, "evaluations", {"blocks": None, "r_eff_origin": "first"})
    took = seconds(lambda: evaluate_fleet(fleet, Processes(2)))
    table.add(f"evaluate {count} recordings, two processes", took, "s", high=60.0 * count / 10_000)
    on_dask = []
    for workers in (1, 2):
        with local_cluster(workers) as cluster:
            engine = Dask(cluster.file)
            results.clear()
            on_dask.append(seconds(lambda engine=engine: evaluate_fleet(fleet, engine)))  # type: ignore[misc]
            print(f"evaluate {count} recordings, Dask, {workers} workers: {on_dask[-1]:.1f} s ({load()})")
    table.add("evaluate: Dask, one worker's time by two's", on_dask[0] / on_dask[1], "", low=1.7)


def one_by_one(
    table: Table, folder: Path, name: str, work: Callable[[Fleet, Engine], object], most_min: float | None
) -> None:
    """A sample of budgets or diagnoses on two processes and on one and two workers, as it would be for 10 000."""
    few, many = SAMPLES

    def taken(count: int, engine: Engine, where: str) -> float:
        fleet = Fleet(folder / f"{name}-{where}-{count}", create=True)
        fill(fleet, count)
        return seconds(lambda: work(fleet, engine))

    took = [taken(count, Processes(2), "here") for count in SAMPLES]
    each = (took[1] - took[0]) / (many - few)
    print(f"{name}: {took[0]:.1f} s for {few}, {took[1]:.1f} s for {many}, so {each:.3f} s each ({load()})")
    table.add(f"{name} 10000 recordings, two processes", each * 10_000 / 60.0, "min", high=most_min)
    on_dask = []
    for workers in (1, 2):
        with local_cluster(workers) as cluster:
            on_dask.append(taken(many, Dask(cluster.file), f"dask-{workers}"))
    table.add(f"{name}: Dask, one worker's time by two's", on_dask[0] / on_dask[1], "", low=1.7)
    files = sum(path.stat().st_size for path in (folder / f"{name}-here-{few}" / WORKED[name]).glob("*.parquet"))
    print(f"{name}: {files / few / 1e3:.1f} kB each ({load()})")


def fill_many(fleet: Fleet, probings: float) -> int:
    """A store of very many probings in 400 files or more, as they are after 'fleet compact'; returns how many."""
    arrow, index = __import__("pyarrow"), list[dict[str, Any]]()
    gauge, files = read_with_files(read_gauge, "step-gauge-420")
    certificate = fleet.keep("gauge", files)
    rows_each = gauge.n_faces * CYCLES
    each = max(round(probings / rows_each / (MACHINES * MANY_MONTHS)), 1)
    block = _block(Entry(make_recording(gauge, 0), owners(0), moment(0), certificate), each)
    schema, row = arrow_schema(PROBINGS), np.repeat(np.arange(each), rows_each)
    for number in range(MACHINES * MANY_MONTHS):
        entry = Entry(make_recording(gauge, number), owners(number), moment(number), certificate)
        keys = [f"{number:08x}{one:024x}" for one in range(each)]
        fixed: dict[str, Any] = {**entry.owners, "measured_at": entry.measured_at}
        columns = [
            arrow.array(keys).take(arrow.array(row)) if field.name == "recording"
            else arrow.repeat(arrow.scalar(fixed[field.name], field.type), len(block)) if field.name in fixed
            else block[field.name]
            for field in schema
        ]  # fmt: skip
        part = fleet._partition(str(entry.owners["machine"]), entry.month)
        path = write_rows(part, [arrow.Table.from_arrays(columns, schema=schema)], PROBINGS)
        one = _index_rows({"": entry}, path.relative_to(fleet.folder).as_posix())[0]
        index += [one | {"recording": key, "first_row": i * rows_each} for i, key in enumerate(keys)]
    fleet.write_index(arrow.Table.from_pylist(index, arrow_schema(RECORDINGS)))
    return len(index) * rows_each


def _block(entry: Entry, each: int) -> Any:
    """The probings of so many recordings, each with a noise of its own."""
    arrow, random = __import__("pyarrow"), np.random.default_rng(0)
    block = arrow.concat_tables([make_probings("0", entry)] * each).combine_chunks()
    for name in ("x_mm", "y_mm", "z_mm"):
        noisy = block[name].to_numpy() + np.round(random.normal(0.0, 3e-4, len(block)), 7)
        block = block.set_column(block.schema.get_field_index(name), block.schema.field(name), arrow.array(noisy))
    return block


def questions(table: Table, folder: Path, probings: float) -> None:
    """Answers over very many probings."""
    fleet = Fleet(folder / "many", create=True)
    if not len(fleet.index()):
        took = seconds(lambda: fill_many(fleet, probings))
        size = sum(path.stat().st_size for path in fleet.folder.rglob("*.parquet"))
        print(f"{probings:.0e} probings written in {took:.0f} s: {size / 1e9:.2f} GB, {size / probings:.1f} bytes each")
    for name, sql in QUESTIONS.items():
        began = time.process_time()
        took = [seconds(lambda sql=sql: query(Fleet(fleet.folder), sql)) for _ in range(2)]  # type: ignore[misc]
        table.add(f"query: {name}", min(took), "s", high=5.0)
        print(f"{name}: {took[0]:.2f} s at first, {(time.process_time() - began) / 2:.2f} s of processor ({load()})")


def main() -> int:
    """Measure and print; the exit code is the number of bars missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=10_000)
    parser.add_argument("--probings", type=float, default=1e8)
    parser.add_argument("--folder", type=Path, help="keep the stores here; default: a folder that is deleted")
    parser.add_argument("--only", choices=["growth", "engines", "budgets", "diagnoses", "questions"])
    parser.add_argument("--alone", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.alone:
        cost_alone(given.alone)
        return 0
    table = Table()
    print(load())
    with tempfile.TemporaryDirectory() as name:
        folder = given.folder or Path(name)
        if given.only in (None, "growth"):
            growth(table, folder, [size for size in SIZES if size <= given.recordings])
        if given.only in (None, "engines"):
            fleet = Fleet(folder / f"of-{given.recordings}", create=True)
            if not len(fleet.index()):
                table.add(f"add {given.recordings} recordings", fill(fleet, given.recordings), "s")
            Results(fleet, "evaluations").clear()
            engines(table, fleet, given.recordings)
        if given.only in (None, "budgets"):
            one_by_one(table, folder, "budget", budget_fleet, None)
        if given.only in (None, "diagnoses"):
            one_by_one(table, folder, "diagnose", diagnose_fleet, 60.0)
        if given.only in (None, "questions"):
            questions(table, folder, given.probings)
    print(load())
    return table.print()


if __name__ == "__main__":
    sys.exit(main())
