"""What can be right of small single causes, by the false alarms that are allowed.

    python -m benchmarks.blind.limit --size 0.2 --first-seed 3225 --seeds 8 --nulls 200

The observer of :mod:`benchmarks.blind.bound` names what is most probable, and nothing besides: no names that cannot be
told apart, which would have to be right as well. The likelier a cause is to it beforehand, the more of them it names,
and the more often it does so where nothing is concealed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from math import log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.bound import NEAR, RIGHT, Signatures, bound, weighed
from benchmarks.blind.generate import Case, concealed_in, list_cases

Array = NDArray[np.float64]
PRIOR_ODDS = (1, 2, 3, 5, 10, 20)
"""Of some cause, against nothing; the observer of the bound has even ones."""


def right_of_singles(size: float, seeds: range) -> Iterator[Array]:
    """For each single cause the share of drawings in which it is named, by prior odds, and as the bound counts."""
    for case in list_cases(seeds, families=["single"], sizes=[size]):
        signatures, truths = concealed_in(case)
        as_bound = bound(signatures, truths, case.seed)
        if signatures.growth is not None:  # of one law, at even odds
            yield np.full(len(PRIOR_ODDS) + 1, as_bound)
            continue
        yield np.array([*named_rightly(signatures, truths, case.seed), as_bound])


def named_rightly(signatures: Signatures, truths: Sequence[Mapping[str, Any]], seed: int) -> Array:
    """Share of drawings in which what is most probable is the truth, or may be mentioned, by prior odds."""
    weight, classes, length = weighed(signatures, truths, seed)
    named = (classes[_best(weight, length, odds)] for odds in PRIOR_ODDS)
    return np.array([np.isin(one, (RIGHT, NEAR)).mean() for one in named])


def false_alarms(cases: list[Case]) -> Iterator[Array]:
    """For each recording with nothing concealed the share of drawings in which a cause is named, by prior odds."""
    for case in cases:
        weight, _, length = weighed(concealed_in(case)[0], (), case.seed)
        yield np.array([(length[_best(weight, length, odds)] > 0).mean() for odds in PRIOR_ODDS])


def _best(weight: Array, length: NDArray[np.intp], odds: float) -> NDArray[np.intp]:
    """The most probable set of each drawing."""
    return np.asarray((weight + log(odds) * (length > 0)).argmax(axis=1))


def text(size: float, right: Array, alarms: Array) -> str:
    """The table: right and false alarms by prior odds."""
    lines = [f"{len(right)} single causes of size {size:g}, {len(alarms)} recordings with nothing concealed"]
    lines.append(f"with what cannot be told apart, at even odds: {right[:, -1].mean():.1%} right")
    for odds, share, alarm in zip(PRIOR_ODDS, right.mean(axis=0), alarms.mean(axis=0), strict=False):
        lines.append(f"prior odds {odds:3d}: {share:6.1%} right, {alarm:6.2%} false alarms")
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> None:
    parser: Any = argparse.ArgumentParser(description="What can be right of small single causes.")
    parser.add_argument("--size", type=float, default=0.2, help="effect over noise (default 0.2)")
    parser.add_argument("--first-seed", type=int, default=1, help="first seed (default 1)")
    parser.add_argument("--seeds", type=int, default=8, help="number of seeds (default 8)")
    parser.add_argument("--nulls", type=int, default=200, help="recordings with nothing concealed (default 200)")
    options = parser.parse_args(argv)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    nulls = list_cases(seeds, families=["null"], nulls=options.nulls)
    right = np.array(list(right_of_singles(options.size, seeds)))
    print(text(options.size, right, np.array(list(false_alarms(nulls)))))


if __name__ == "__main__":
    main()
