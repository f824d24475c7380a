"""How often the diagnosis of probe maps is right: ``python benchmarks/probe_maps.py --nulls 100 --seeds 4``.

Maps are made of a probe file, noise and, concealed, nothing (false alarms), a change of the construction (named?),
structure that no construction has (called unknown?), or bad single rows. Size is the rms of what is concealed over the
noise of one reading, in the quantity where it is largest. Changes of the construction are computed by the probe's own
statics: this shows what noise does to the verdict, not whether the statics are right.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from stepgauge.diagnosis.maps.candidates import ProbeChange, candidates_for
from stepgauge.diagnosis.maps.data import MapData, Measured
from stepgauge.diagnosis.maps.diagnose import diagnose_map
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel, predict
from stepgauge.diagnosis.maps.result import MapDiagnosis

Array = NDArray[np.float64]
KINEMATIC: dict[str, Any] = {
    "model": "kinematic",
    "tip_radius_mm": 3.0,
    "seat": {"preload_N": 5.91, "contact_radius_mm": 16.34, "contact_angle_deg": 27.266},
    "stylus": [{"length_mm": 50.0, "diameter_mm": 4.5, "modulus_GPa": 413.0, "poisson": 0.22}],
}
CONSTANT: dict[str, Any] = {"model": "constant", "tip_radius_mm": 2.0, "pretravel_um": 12.0}
NOISE = {"trigger_force_N": 0.01, "deflection_um": 0.05, "pretravel_um": 0.2}


@dataclass(frozen=True)
class Plan:
    """Which directions are probed how often, of what probe, and what is measured."""

    name: str
    table: dict[str, Any]
    quantities: tuple[str, ...]
    rings: tuple[float, ...]
    spokes: tuple[float, ...]
    repeats: int

    @property
    def angles(self) -> tuple[Array, Array]:
        polar, azimuth = (g.ravel() for g in np.meshgrid(self.rings, self.spokes, indexing="ij"))
        return np.tile(polar, self.repeats), np.tile(azimuth, self.repeats)


TURN = tuple(np.arange(0.0, 360.0, 20.0))
PLANS = (
    Plan("forces and deflections, once", KINEMATIC, ("trigger_force_N", "deflection_um"), (30, 50, 70, 90), TURN, 1),
    Plan("forces and deflections, 3 times", KINEMATIC, ("trigger_force_N", "deflection_um"), (30, 60, 90), TURN, 3),
    Plan("deflections, once", KINEMATIC, ("deflection_um",), (30, 50, 70, 90), TURN, 1),
    Plan("pre-travel, once", CONSTANT, ("pretravel_um",), (30, 50, 70, 90), TURN, 1),
    Plan("pre-travel, 3 times", CONSTANT, ("pretravel_um",), (30, 60, 90), TURN, 3),
)


def made(plan: Plan, rng: np.random.Generator, concealed: dict[str, Array] | None = None) -> MapData:
    """A map: what the probe file says, what is concealed, and noise; printed to a fifth of it or finer."""
    polar, azimuth = plan.angles
    normals = MapData("map", polar, azimuth, (), 0).normals
    said = predict(plan.table, "truth", normals, plan.quantities)
    measured = []
    for name, values in zip(plan.quantities, said, strict=True):
        off = 0.0 if concealed is None else concealed[name]
        digit = 1e-3 if name == "trigger_force_N" else 1e-2
        read = np.round((values + off + rng.normal(0.0, NOISE[name], len(polar))) / digit) * digit
        measured.append(Measured(name, name[name.rindex("_") + 1 :], np.maximum(read, 0.0), digit))
    return MapData("map", polar, azimuth, tuple(measured), 0)


def diagnosed(plan: Plan, data: MapData, candidates: list[ProbeChange] | None = None) -> MapDiagnosis:
    return diagnose_map(MapModel(plan.table, plan.name, data), candidates)


def changes(plan: Plan, size: float) -> Iterator[tuple[ChangeTerm, dict[str, Array]]]:
    """Every change that the probe can have, so large that it has this size, with what it adds to each quantity.

    Wozniak's triangular law, which is no small change of anything, is tested elsewhere; other styli: :func:`exchanged`.
    """
    polar, azimuth = plan.angles
    blank = MapData("map", polar, azimuth, tuple(Measured(q, "", polar, 0.0) for q in plan.quantities), 0)
    model = MapModel(plan.table, plan.name, blank)
    said = model.predict(())
    for candidate in candidates_for(plan.table, plan.quantities):

        def term(share: float, candidate: ProbeChange = candidate) -> ChangeTerm:
            return ChangeTerm(candidate, tuple(k.none + share * (k.high - k.none) for k in candidate.knobs))

        def added(term: ChangeTerm) -> dict[str, Array]:
            return {q: m - s for q, m, s in zip(plan.quantities, model.predict((term,)), said, strict=True)}

        def excess(share: float) -> float:
            return max(_rms(off) / NOISE[q] for q, off in added(term(share)).items()) - size

        if candidate.choice != "triangular" and candidate.kind != "stylus_length":
            top = next((top for top in (1e-3, 1e-2, 0.05, 0.1, 0.3, 0.6) if excess(top) > 0.0), None)
            if top is not None:
                found = term(brentq(excess, 0.0, top))
                yield found, added(found)


Field = Callable[[Array, Array], Array]
OUTSIDERS: dict[str, Field] = {
    "two lobes": lambda p, a: np.cos(2 * a - 0.7),
    "two lobes across the stylus": lambda p, a: np.sin(p) * np.cos(2 * a + 0.4),
    "five lobes": lambda p, a: np.cos(5 * a - 1.0),
    "step over a sector": lambda p, a: np.tanh((np.cos(a - 2.0) - 0.3) / 0.05),
    "narrow sector": lambda p, a: (np.cos(a - 4.0) > 0.8).astype(float),
    "sawtooth in azimuth": lambda p, a: ((a + 0.5) % (2 * np.pi)) / np.pi - 1.0,
    "wave over polar angle": lambda p, a: np.sin(7.0 * p),
    "step over polar angle": lambda p, a: np.tanh((p - 1.0) / 0.05),
    "dent": lambda p, a: np.exp(-((p - 1.0) ** 2 + (np.sin((a - 2.5) / 2.0) * 2.0) ** 2) / 0.25),
    "four lobes that turn over": lambda p, a: np.cos(4 * a) * np.cos(2 * p),
}


def outsider(plan: Plan, name: str, size: float) -> dict[str, Array]:
    """A field over the directions in the quantity measured last, its mean left in."""
    polar, azimuth = (np.radians(angle) for angle in plan.angles)
    field = OUTSIDERS[name](polar, azimuth)
    off = {q: np.zeros(len(polar)) for q in plan.quantities}
    off[plan.quantities[-1]] = field * size * NOISE[plan.quantities[-1]] / _rms(field)
    return off


def _rng(draw: int, *numbers: int) -> np.random.Generator:
    """Random numbers of a map; another ``draw`` has maps of its own."""
    return np.random.default_rng([numbers[0], *([draw] if draw else []), *numbers[1:]])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _kinds(found: MapDiagnosis) -> list[str]:
    return [finding.kind for finding in found.findings]


def false_alarms(nulls: int, seed: int = 1, draw: int = 0) -> dict[str, list[str]]:
    """Verdicts other than adequate on maps in which nothing is concealed, by plan."""
    alarms: dict[str, list[str]] = {plan.name: [] for plan in PLANS}
    for number in range(nulls):
        plan = PLANS[number % len(PLANS)]
        found = diagnosed(plan, made(plan, _rng(draw, seed, number)))
        if found.verdict != "adequate":
            alarms[plan.name].append(", ".join(_kinds(found)) or found.unexplained[0].where)
    return alarms


def named(size: float, seeds: int, draw: int = 0) -> Iterator[tuple[str, bool, list[float]]]:
    """Change, whether it is in the set that alone was named, and its values' errors over their uncertainties."""
    for i, plan in enumerate(PLANS):
        for number, (truth, off) in enumerate(changes(plan, size)):
            for seed in range(seeds):
                found = diagnosed(plan, made(plan, _rng(draw, 2, i, number, seed), off))
                sets = [{f.kind, *f.confounded_with} for f in found.findings]
                right = found.verdict == "effects" and len(sets) == 1 and truth.candidate.kind in sets[0]
                yield truth.candidate.label, right, _pulls(found, truth)


STYLI_MM = (20.0, 30.0, 40.0, 60.0, 75.0, 100.0)


def exchanged(seeds: int, draw: int = 0) -> Iterator[tuple[float, str, str]]:
    """Length of another stylus than the file's, verdict, and what is named; "" where that is the length, or its set."""
    for i, plan in enumerate(PLANS):
        polar, azimuth = plan.angles
        normals = MapData("map", polar, azimuth, (), 0).normals
        known = predict(plan.table, "file", normals, plan.quantities)
        for length in STYLI_MM if "stylus" in plan.table else ():
            other = deepcopy(plan.table)
            other["stylus"][0]["length_mm"] = length
            values = predict(other, "truth", normals, plan.quantities)
            off = {q: v - k for q, v, k in zip(plan.quantities, values, known, strict=True)}
            for seed in range(seeds):
                found = diagnosed(plan, made(plan, _rng(draw, 6, i, int(length), seed), off))
                sets = [{f.kind, *f.confounded_with} for f in found.findings]
                right = len(sets) == 1 and "stylus_length" in sets[0]
                yield length, found.verdict, "" if right else ", ".join(_kinds(found))


def _pulls(found: MapDiagnosis, truth: ChangeTerm) -> list[float]:
    """Of the values that are stated as such; components of a vector or of lobes are not."""
    stated = next((f.parameters for f in found.findings if f.label == truth.candidate.label), {})
    pairs = [(stated.get(k.name), v) for k, v in zip(truth.candidate.knobs, truth.values, strict=True)]
    return [(estimate.value - v) / estimate.u for estimate, v in pairs if estimate is not None and estimate.u]


def outsiders(size: float, seeds: int, draw: int = 0) -> Iterator[tuple[str, str, str]]:
    """Field, verdict and what was named, for every plan and seed."""
    for i, plan in enumerate(PLANS):
        for number, name in enumerate(OUTSIDERS):
            for seed in range(seeds):
                rng = _rng(draw, 3, i, number, seed)
                found = diagnosed(plan, made(plan, rng, outsider(plan, name, size)))
                yield name, found.verdict, ", ".join(_kinds(found))


def left_out(size: float, seeds: int, draw: int = 0) -> Iterator[tuple[str, str, str]]:
    """Change that is deleted from the candidates, with all that the same map could take it for; verdict and names."""
    for i, plan in enumerate(PLANS):
        for truth, off in changes(plan, size):
            candidate = truth.candidate
            data = made(plan, _rng(draw, 4, i, 0), off)
            known = [f for f in diagnosed(plan, data).findings if candidate.kind in {f.kind, *f.confounded_with}]
            gone = {candidate.kind, *(kind for f in known for kind in {f.kind, *f.confounded_with})}
            others = [c for c in candidates_for(plan.table, plan.quantities) if c.kind not in gone]
            for seed in range(seeds):
                found = diagnosed(plan, made(plan, _rng(draw, 4, i, seed), off), others)
                yield candidate.label, found.verdict, ", ".join(_kinds(found))


def with_outliers(size: float, seeds: int, draw: int = 0) -> Iterator[tuple[str, bool, bool]]:
    """Change, whether it is named beside two bad rows, and whether just those rows are listed."""
    for i, plan in enumerate(PLANS):
        for truth, off in changes(plan, size):
            for seed in range(seeds):
                rng = _rng(draw, 5, i, seed)
                data = made(plan, rng, off)
                bad = rng.choice(len(data), 2, replace=False)
                data = spoiled(data, bad, 15.0)
                found = diagnosed(plan, data)
                rows = np.flatnonzero(~found.kept)
                right = any(truth.candidate.kind in {f.kind, *f.confounded_with} for f in found.findings)
                yield truth.candidate.label, right, set(rows) == set(map(int, bad))


def spoiled(data: MapData, rows: NDArray[np.intp], sigmas: float) -> MapData:
    """Rows off by so many standard deviations in the quantity measured last."""
    last = data.measured[-1]
    values = deepcopy(last.values)
    values[rows] += sigmas * NOISE[last.name]
    return replace(data, measured=(*data.measured[:-1], replace(last, values=values)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nulls", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--sizes", default="3,1,0.5")
    parser.add_argument("--draw", type=int, default=0, help="number of a set of maps that nothing was tried on")
    asked = parser.parse_args()
    alarms = false_alarms(asked.nulls, draw=asked.draw)
    print(f"false alarms: {sum(map(len, alarms.values()))} of {asked.nulls}", {k: v for k, v in alarms.items() if v})
    styli = list(exchanged(asked.seeds, asked.draw))
    print(f"another stylus: named {_share(v == 'effects' and not n for _, v, n in styli)}")
    print("   not:", sorted({one for one in styli if one[1] != "effects" or one[2]}))
    for size in map(float, asked.sizes.split(",")):
        single = list(named(size, asked.seeds, asked.draw))
        print(f"size {size:g}: named {_share(right for _, right, _ in single)}", _wrong(single))
        pulls = [pull for _, right, values in single if right for pull in values]
        print(f"  95 % intervals hold the truth: {_share(abs(pull) < 1.96 for pull in pulls)}")
        odd = list(outsiders(size, asked.seeds, asked.draw))
        print(f"  outsiders unknown {_share(verdict == 'unknown' for _, verdict, _ in odd)}")
        print("   not:", sorted({(n, v, k) for n, v, k in odd if v != "unknown"}))
        gone = list(left_out(size, 1, asked.draw))
        print(f"  left out: unknown {_share(verdict == 'unknown' for _, verdict, _ in gone)}")
        print("   not:", sorted({(n, v, k) for n, v, k in gone if v != "unknown"}))
        bad = list(with_outliers(size, 1, asked.draw))
        print(f"  beside outliers: named {_share(r for _, r, _ in bad)}, rows right {_share(r for _, _, r in bad)}")


def _share(right: Any) -> str:
    flags = list(right)
    return f"{100.0 * np.mean(flags):.0f} % of {len(flags)}"


def _wrong(single: list[tuple[str, bool, list[float]]]) -> dict[str, int]:
    labels = [label for label, right, _ in single if not right]
    return {label: labels.count(label) for label in dict.fromkeys(labels)}


if __name__ == "__main__":
    main()
