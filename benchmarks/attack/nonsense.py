"""Accepted nonsense: a slip in one number that moves a result by more than its stated uncertainty, and nobody says so.

Damaged are the recording, the certificate's table, and the files of gauge and placement of the measurement that
:mod:`benchmarks.attack.targets` makes. Compared are R_eff and the errors XF, XB and XM of every face with those of the
undamaged files; the stated uncertainty of each is that of certificate and repeatability, expanded with k = 2.
"""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.attack.mutate import slip
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import PlacementResult, evaluate
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.recording import read_recording

Array = NDArray[np.float64]
SLIPS = {
    "recording": "recording.csv",
    "certificate table": "step-gauge-420.csv",
    "gauge file": "step-gauge-420.toml",
    "placement": "placement.toml",
}
WEIGHTS = (6, 2, 1, 1)


@dataclass
class Outcome:
    """The numbers that are compared, um, and the notes."""

    um: Array
    notes: frozenset[str]


class Nonsense:
    """Slips in numbers, and what came of them."""

    BAR: ClassVar[float] = 1e-3

    def __init__(self, place: Path) -> None:
        self.place = place
        self.gauge = read_gauge(place / "step-gauge-420.toml")
        self.data = {name: (place / file).read_bytes() for name, file in SLIPS.items()}
        self.good, self.u_um = self._evaluate({})
        self.counts: Counter[tuple[str, str]] = Counter()
        self.silent: list[tuple[int, str, str, float]] = []

    def _evaluate(self, paths: dict[str, Path]) -> tuple[Outcome, Array]:
        gauge = read_gauge(paths.get("gauge file", self.place / SLIPS["gauge file"]))
        lies = read_placement(paths.get("placement", self.place / SLIPS["placement"]), gauge)
        recording = read_recording(paths.get("recording", self.place / SLIPS["recording"]))
        (result,) = evaluate(recording, gauge, placements=[lies]).results
        return _outcome(result), _expanded_um(result, gauge)

    def attack(self, number: int, pick: random.Random) -> tuple[str, str]:
        """One slip; the outcome, and what is wrong with it (nothing where it is refused, said, or too small)."""
        (name,) = pick.choices(list(SLIPS), WEIGHTS)
        data = slip(self.data[name], pick)
        paths = self._write(name, data)
        try:
            found, _ = self._evaluate(paths)
        except InputError:
            return self._count(name, "slip refused")
        except Exception as error:
            return "traceback", f"slip in {name}: {type(error).__name__}: {error}"
        finally:
            for path in self.place.glob("out-*"):
                path.unlink()
        if len(found.um) != len(self.good.um):
            return self._count(name, "slip said" if found.notes - self.good.notes else "slip accepted, other faces")
        with np.errstate(invalid="ignore"):
            moved = np.nanmax(np.abs(found.um - self.good.um) / self.u_um, initial=0.0)
        lost = bool((np.isfinite(self.good.um) & ~np.isfinite(found.um)).any())
        if moved <= 1.0 and not lost:
            return self._count(name, "slip within the uncertainty")
        if found.notes - self.good.notes:
            return self._count(name, "slip said")
        self.silent.append((number, name, _difference(self.data[name], data), float(moved)))
        return self._count(name, "slip accepted silently")

    def _write(self, name: str, data: bytes) -> dict[str, Path]:
        path = self.place / f"out-{SLIPS[name]}"
        path.write_bytes(data)
        if name != "certificate table":
            return {name: path}
        table = self.place / "out-step-gauge-420.toml"
        table.write_text((self.place / SLIPS["gauge file"]).read_text().replace(SLIPS[name], path.name))
        return {"gauge file": table}

    def _count(self, name: str, outcome: str) -> tuple[str, str]:
        self.counts[name, outcome] += 1
        return outcome, ""

    def share(self) -> float:
        """Silent ones among all slips."""
        return len(self.silent) / max(self.counts.total(), 1)

    def summary(self) -> str:
        """What came of the slips, by file, and the silent ones."""
        lines = [f"  {self.counts.total()} slips, {len(self.silent)} accepted silently ({self.share():.2g}):"]
        for name in SLIPS:
            said = ", ".join(f"{n} {what}" for (file, what), n in sorted(self.counts.items()) if file == name)
            lines.append(f"    {name}: {said}")
        lines += [f"    input {n}: {name}: {change}: {by:.2g} U" for n, name, change, by in self.silent[:25]]
        return "\n".join(lines)


def _outcome(result: PlacementResult) -> Outcome:
    values = [result.xf_um, result.xb_um, result.xm_um, [result.radius.r_eff_mm * 1e3]]
    return Outcome(np.concatenate(values), frozenset(result.notes))


def _expanded_um(result: PlacementResult, gauge: Gauge) -> Array:
    """U = 2 u of every compared number, from certificate and repeatability of face, reference and radius."""
    repeat = np.where(result.face % 2 == 1, result.sf_um, result.sb_um)
    own = gauge.u_um[result.face - 1] ** 2 + repeat**2 / result.count
    u = np.sqrt(own + own[0] + (2e3 * result.radius.u_mm) ** 2)
    return 2.0 * np.concatenate([u, u, u, [result.radius.u_mm * 1e3]])


def _difference(before: bytes, after: bytes) -> str:
    old, new = before.decode().split("\n"), after.decode(errors="replace").split("\n")
    for number, (a, b) in enumerate(zip(old, new, strict=False), 1):
        if a != b:
            at = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
            return f"line {number}: ..{a[max(at - 12, 0) : at + 12]}.. -> ..{b[max(at - 12, 0) : at + 12]}.."
    return "nothing"
