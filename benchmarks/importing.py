"""How long the import of a long table takes, against ``pandas.read_csv`` of the same file in the same run, and memory.

    python -m benchmarks.importing --rows 1500000

The bars: at most five times ``read_csv`` (of dates with ``parse_dates``), and 2 GB of memory.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.table import Table, best_s
from stepgauge import import_recording


def positioning(rows: int) -> pd.DataFrame:
    """Targets that come again and again, readings, a temperature."""
    random = np.random.default_rng(0)
    target = np.tile(np.arange(0.0, 1000.0, 10.0), rows // 100)
    reading = (target + random.normal(0.0, 1e-3, len(target))).round(6)
    return pd.DataFrame({"Target [mm]": target, "Reading [mm]": reading, "T [degC]": 20.0 + reading.round(1) % 1.0})


def drift(rows: int) -> pd.DataFrame:
    """Seconds, readings, a temperature."""
    random = np.random.default_rng(1)
    reading, warm = random.normal(0.0, 1.0, rows).round(4), (20.0 + random.normal(0.0, 0.1, rows)).round(3)
    return pd.DataFrame({"time [s]": np.arange(rows) * 0.01, "reading [um]": reading, "Spindle [degC]": warm})


def dated(rows: int) -> pd.DataFrame:
    """The same with dates and times of day."""
    start, step = pd.Timestamp("2026-03-02"), pd.to_timedelta(np.arange(rows) * 0.05, unit="s")
    stamps = (start + step).strftime("%Y-%m-%d %H:%M:%S.%f")
    return drift(rows).drop(columns="time [s]").assign(time=stamps)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=1_500_000)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    table = Table()
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for make in (positioning, drift, dated):
            path = Path(folder) / f"{make.__name__}.csv"
            make(given.rows).to_csv(path, index=False)
            parsed = ["time"] if make is dated else None
            plain = best_s(lambda path=path, of=parsed: pd.read_csv(path, parse_dates=of), given.repeats)  # type: ignore[misc]
            ours = best_s(lambda path=path: import_recording(path, sensor="laser").settled(), given.repeats)  # type: ignore[misc]
            table.add(f"{make.__name__}, {given.rows} rows: import / read_csv", ours / plain, high=5.0)
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    table.add("memory beyond the libraries, with the making of the files", used / 1e6, "GB", high=2.0)
    return table.print()


if __name__ == "__main__":
    sys.exit(main())
