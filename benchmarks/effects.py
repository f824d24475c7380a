"""Cost of the virtual CMM's effects and of an evaluation, as ratios: ``python benchmarks/effects.py``.

The unit is one pass of np.sin over 1e6 float64 on the same core in the same run. The reading of a recording is compared
with pandas.read_csv of the same file.
"""

from __future__ import annotations

import sys
import tempfile
import tomllib
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from table import Table, best_s

from stepgauge.effects import Effect, Probings, Setting, effect_kinds, make_effects, total_displacement_um
from stepgauge.effects.maps import AXIS_COLUMNS
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.recording import Recording, read_recording, write_recording

GAUGE = read_gauge("step-gauge-420")
MACHINE = read_machine("bridge-cmm")
AXIS = np.array([0.6, 0.8, 0.0])
TYPICAL: list[dict[str, Any]] = [
    *({"kind": "scale_error", "axis": axis, "ppm": 2.5} for axis in "xyz"),
    *({"kind": "squareness", "plane": plane, "urad": 4.0} for plane in ("xy", "xz", "yz")),
    {"kind": "periodic_scale_error", "axis": "x", "period_mm": 20.0, "amplitude_um": 0.4},
    {"kind": "reversal_error", "axis": "x", "um": 0.5},
    {"kind": "probe_lobing", "amplitude_um": 0.5},
    {"kind": "thermal_drift", "direction": "x", "rate_um_per_h": 1.0},
]
EVERY: list[dict[str, Any]] = tomllib.loads((Path(__file__).parent / "every-effect.toml").read_text())["effect"]


def table_of(rows: int) -> pd.DataFrame:
    """Cycles of the 420 mm gauge lying in the xy plane."""
    random = np.random.default_rng(1)
    face = np.arange(rows) % GAUGE.n_faces + 1
    way = np.where(face % 2 == 1, 1.0, -1.0)
    along = GAUGE.position_mm[face - 1] - way * 2.0 + random.normal(0.0, 3e-4, rows)
    place = np.array([100.0, 150.0, 100.0]) + along[:, None] * AXIS
    columns = {"placement": np.ones(rows, np.int64), "cycle": np.arange(rows) // GAUGE.n_faces + 1, "face": face}
    columns |= {f"{axis}_mm": place[:, i].copy() for i, axis in enumerate("xyz")}
    columns |= {f"approach_{letter}": way * a for letter, a in zip("ijk", AXIS, strict=True)}
    return pd.DataFrame(columns | {"time_s": 4.0 * np.arange(rows), "speed_mm_s": 3.0})


def cost_s(effects: list[Effect], frame: pd.DataFrame, repeats: int = 5) -> float:
    """Displacement of all rows, columns taken from the table anew."""
    setting = Setting.of(MACHINE, GAUGE, {1: AXIS})
    return best_s(lambda: total_displacement_um(effects, Probings(frame, setting)), repeats)


def bytes_per_row(effects: list[Effect], frame: pd.DataFrame) -> float:
    """Peak of what is allocated beyond the table."""
    setting = Setting.of(MACHINE, GAUGE, {1: AXIS})
    tracemalloc.start()
    total_displacement_um(effects, Probings(frame, setting))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / len(frame)


def displacement(table: Table, every: list[Effect]) -> None:
    """Cost, memory and growth of the displacement."""
    frame = table_of(1_000_000)
    random = np.random.default_rng(2).uniform(0.0, 700.0, len(frame))
    pass_s = best_s(lambda: np.sin(random), 9)
    table.add("one pass of np.sin over 1e6", pass_s * 1e3, "ms")
    shipped = make_effects(MACHINE.effects, MACHINE.path)
    typical = make_effects(TYPICAL, "typical.toml")
    table.add("displacement of 1e6 rows, machine as shipped", cost_s(shipped, frame) / pass_s, "passes", high=8)
    table.add(f"... with {len(typical)} effects of a usual machine", cost_s(typical, frame) / pass_s, "passes", high=8)
    table.add(f"... with all {len(every)} effects on", cost_s(every, frame) / pass_s, "passes", high=30)
    table.add("memory beyond the table, all effects", bytes_per_row(every, frame), "bytes/row", high=400)
    sizes = [10_000, 100_000, 1_000_000, 10_000_000]
    times = [cost_s(every, table_of(n), 25 if n < 1_000_000 else 5 if n == 1_000_000 else 2) for n in sizes]
    for n, seconds in zip(sizes, times, strict=True):
        table.add(f"all effects, {n:.0e} rows", seconds / n * 1e9, "ns/row")
    slope = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    table.add("slope of time over rows, log-log, 1e4 to 1e7", float(slope), low=0.95, high=1.1)


def evaluation(table: Table, folder: Path) -> None:
    """Reading and evaluating a recording of 1e6 rows."""
    csv, parquet = folder / "recording.csv", folder / "recording.parquet"
    recording = Recording(table_of(1_000_000))
    write_recording(csv, recording)
    write_recording(parquet, recording)
    pandas_s = best_s(lambda: pd.read_csv(csv, comment="#"), 3)
    table.add("pandas.read_csv of 1e6 rows", pandas_s, "s")
    evaluate_s = best_s(lambda: evaluate(read_recording(csv), GAUGE), 3)
    table.add("read and evaluate the same file", evaluate_s / pandas_s, "times read_csv", high=2)
    table.add("evaluate alone", best_s(lambda: evaluate(recording, GAUGE), 3) / pandas_s, "times read_csv", high=0.2)
    parquet_s = best_s(lambda: evaluate(read_recording(parquet), GAUGE), 3)
    table.add("read and evaluate as Parquet", parquet_s / pandas_s, "times read_csv")


def main() -> int:
    """Measure and print; the exit code is the number of bars missed."""
    table = Table()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "map.csv").write_text("coordinate_mm,error\n0,0\n300,3\n700,-1\n", encoding="utf-8")
        (folder / "table.csv").write_text(",".join(AXIS_COLUMNS) + "\n0,0,0,0,0\n700,5,3,0,0\n", encoding="utf-8")
        every = make_effects(EVERY, folder / "machine.toml")
        assert {effect.kind for effect in every} == set(effect_kinds(every=True))
        displacement(table, every)
        evaluation(table, folder)
    return table.print()


if __name__ == "__main__":
    sys.exit(main())
