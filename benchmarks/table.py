"""What the benchmarks share: the best of a few timings, and a table of figures against their bars."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field


def best_s(work: Callable[[], object], repeats: int = 5) -> float:
    """Shortest wall-clock time of a few calls, s: the one least disturbed by the rest of the machine."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


@dataclass
class Table:
    """Rows of what was measured, and whether it keeps its bar."""

    rows: list[tuple[str, str, str, str]] = field(default_factory=list)
    missed: int = 0

    def add(self, what: str, value: float, unit: str = "", low: float | None = None, high: float | None = None) -> None:
        """A figure with the range that it should keep, if any."""
        kept = (low is None or value >= low) and (high is None or value <= high)
        bar = " to ".join(f"{end:g}" for end in (low, high) if end is not None)
        bar = f"<= {bar}" if low is None and bar else bar
        self.rows.append((what, f"{value:.3g} {unit}".strip(), bar, "" if not bar else "ok" if kept else "MISSED"))
        self.missed += not kept

    def print(self) -> int:
        """Print the table; the exit code is the number of bars missed."""
        header = ("", "measured", "bar", "")
        widths = [max(len(row[i]) for row in [header, *self.rows]) for i in range(4)]
        for row in [header, *self.rows]:
            print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
        return self.missed
