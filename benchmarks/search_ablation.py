"""What each kind of move of the search is worth: ``python -m benchmarks.search_ablation --problems 40``.

Independent random problems with the same objective: the search as it is, and without one of its moves. Counted are the
problems in which it ends with a less probable hypothesis, the log posterior lost in these, and the hypotheses
that are computed. The problems are those of traps: sums of some causes among the candidates, and several alike; two
causes that nearly cancel each other, so that neither explains anything alone; waves of many periods; noise that is more
or less correlated, and structure that such noise may stand for; laws that hold in a part of the record.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import Candidate, Law, Problem
from stepgauge.inference.search import Search
from stepgauge.inference.standalone import amplitude_prior, make_gaussian_process, make_law, make_problem

Array = NDArray[np.float64]
ROWS, NOISE = 80, 0.3
SIZES = amplitude_prior(0.1, 3.0, 4)
PRIORS = NoisePriors()
LOST = 0.5
"""Difference of the log posterior from which a hypothesis is less probable, nats."""


class WithoutDrop(Search):
    """No term is taken out while it grows."""

    def _dropped(self, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
        yield from ()


class WithoutPairs(Search):
    """No two terms at once."""

    def paired(
        self, hypothesis: Hypothesis, forbidden: frozenset[str] = frozenset(), most: int = 0
    ) -> Iterator[Hypothesis]:
        yield from ()


class WithoutRefit(Search):
    """Shapes stay as they were found first."""

    def polished(self, hypothesis: Hypothesis) -> Hypothesis:
        return hypothesis


class WithoutNoiseFirst(Search):
    """It begins once, with the noise chosen last."""

    def _grown_from_nothing(self) -> Iterator[Hypothesis]:
        yield next(super()._grown_from_nothing())


class WithoutNoiseLast(Search):
    """It begins once, with the noise chosen first."""

    def _grown_from_nothing(self) -> Iterator[Hypothesis]:
        yield self.grow(self.reshaped(self.start))


class WithoutKicks(Search):
    """No term is taken out and forbidden."""

    def _kick(self, best: Hypothesis, place: int) -> Iterator[Hypothesis]:
        yield from ()


class WithoutRivals(Search):
    """Only the term itself is forbidden, not all that may stand for it alone."""

    def _rivals(self, best: Hypothesis, base: Hypothesis) -> frozenset[str]:
        return frozenset()


class WithoutParts(Search):
    """No law in a part of the record."""

    def _part_candidates(self, best: Hypothesis) -> Iterator[Hypothesis]:
        yield from ()


ABLATED: dict[str, type[Search]] = {
    "one term less": WithoutDrop,
    "two terms more": WithoutPairs,
    "shapes fitted anew": WithoutRefit,
    "noise chosen first": WithoutNoiseFirst,
    "noise chosen last": WithoutNoiseLast,
    "kicks": WithoutKicks,
    "kicks without all rivals": WithoutRivals,
    "laws in a part of the record": WithoutParts,
}


def random_problem(seed: int) -> Problem:
    """Up to four causes with traps beside them, in noise that may be correlated."""
    random = np.random.default_rng(seed)
    time, place = np.linspace(0.0, 1.0, ROWS), np.tile(np.linspace(-1.0, 1.0, 16), 5)
    late = (time > random.uniform(0.3, 0.7)).astype(float)
    plain = [_unit(one) for one in random.normal(size=(6, 4)) @ np.array([place, place**2, time, place * time])]
    turns = np.arange(0.5, 8.0, 0.25)[:, None]
    angles = [2.0 * np.pi * turns * x for x in (time, place)]
    waves = [np.stack([np.sin(one), np.cos(one)], 1) for one in angles]
    onsets = np.array([(time > one).astype(float) for one in np.arange(0.05, 1.0, 0.05)])[:, None]
    noise = random.normal(0.0, NOISE, ROWS)
    if seed % 3 == 0:
        correlation = random.uniform(0.4, 0.95)
        for i in range(1, ROWS):
            noise[i] = correlation * noise[i - 1] + np.sqrt(1.0 - correlation**2) * noise[i]
    chosen = random.choice(6, random.integers(1, 4), replace=False)
    amplitude = random.choice([-1.0, 1.0], len(chosen)) * random.uniform(0.2, 1.0, len(chosen))
    um = noise + amplitude @ np.array([plain[i] for i in chosen]) * (late if seed % 4 == 0 else 1.0)
    if seed % 2:
        um = um + 0.5 * np.sin(2.0 * np.pi * random.uniform(1.0, 6.0) * time + random.uniform(0.0, 6.0))
    if seed % 5 == 0:
        plain += [_unit(plain[0] + 0.15 * random.normal(size=ROWS))]
        um = um + random.uniform(1.0, 2.5) * (plain[0] - plain[-1])
    sums = [_unit(um - noise + 0.4 * random.normal(size=ROWS)) for _ in range(1 + seed % 2)]
    candidates: list[Candidate] = [make_law(f"plain {i}", one, SIZES, 0.05) for i, one in enumerate(plain)]
    candidates += [make_law(f"sum {i}", one, SIZES, 0.05) for i, one in enumerate(sums)]
    candidates += [make_law("step", onsets, SIZES, 0.05)]
    candidates += [make_law(f"wave {i}", one, SIZES, 0.05) for i, one in enumerate(waves)]
    candidates += [make_gaussian_process("smooth", place, [0.3, 1.0], SIZES, 0.05)]
    made = make_problem(um, NOISE, candidates, time=time, growing={"time": time})

    def in_part(law: Law, atom: int) -> Sequence[Law]:
        if "where" in law.label:
            return []
        column = law.pattern[atom].astype(float)
        return [make_law(f"{law.label} where late", column * late, SIZES, 0.02)]

    return replace(made, in_part=in_part)


def _unit(column: Array) -> Array:
    return np.asarray(column / np.sqrt((column**2).mean()))


@threadpool_limits.wrap(limits=1, user_api="blas")
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=1)
    chosen = parser.parse_args()
    found: dict[str, list[float]] = {}
    computed: dict[str, int] = {}
    for seed in range(chosen.first_seed, chosen.first_seed + chosen.problems):
        for name, kind in {"": Search, **ABLATED}.items():
            search = kind(random_problem(seed), PRIORS)
            found.setdefault(name, []).append(search.run().log_posterior)
            computed[name] = computed.get(name, 0) + len(search.evidence.visited)
    whole = np.array(found[""])
    print("| without | less probable in | mean loss there, nats | largest | more probable in | computed |")
    print("|---|---|---|---|---|---|")
    for name in ABLATED:
        loss = whole - np.array(found[name])
        worse, better = loss > LOST, loss < -LOST
        mean, most = (float(loss[worse].mean()), float(loss.max())) if worse.any() else (0.0, 0.0)
        share = computed[name] / computed[""]
        print(f"| {name} | {worse.sum()} of {len(loss)} | {mean:.1f} | {most:.1f} | {better.sum()} | {share:.0%} |")


if __name__ == "__main__":
    main()
