"""Watching: every machine and gauge against its own history, its peers and its limits, and when it is due again.

What is watched is what the crossing leaves of a visit when the other owners' shares are taken off, so that a machine is
not blamed for the gauge that visited it.

How far owners in order differ, for statements about one of them.

The inference takes the likeliest spread (empirical Bayes). Few machines do not determine it, and the likeliest one is
then often its least: taken for known it would say of every machine that it is as good, whatever was measured of it. A
statement about one machine is made over all spreads that the fleet leaves possible. Prior of a spread: half-Cauchy,
which Gelman, Bayesian Analysis 1 (2006) 515, recommends for few groups, with the usual size of a cause as its scale.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse, special
from scipy.special import ndtr

from stepgauge.conditions.decision import Outcome, decide
from stepgauge.files.arrays import Array
from stepgauge.files.dates import YEAR_DAYS
from stepgauge.fleet.hierarchical.answer import ExplainedNumber, FleetInference
from stepgauge.fleet.hierarchical.background import Background, RandomEffect
from stepgauge.fleet.hierarchical.drifting import DriftPrior, DriftState, beyond, due_day, follow
from stepgauge.fleet.hierarchical.priors import fleet_priors
from stepgauge.history.series import FALSE_WARNINGS
from stepgauge.history.trend import findings
from stepgauge.physics.robust import mad_sigma

WALKS = (0.0, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Walks in the root of a year that are tried, over the level's standard deviation; the fleet says which."""
RATE, JUMP = 1.0, 5.0
"""Standard deviations of the rate in a year and of a known jump, over the level's."""
SEEN = 0.5
"""Least share of a component that some visit must see, over the largest in the fleet, for it to be watched."""
RISK, HORIZON_DAYS = 0.05, 5.0 * YEAR_DAYS
FALSE_SHARE = 0.05
"""Of the owners that are said to have left their peers (Benjamini and Hochberg, J. R. Stat. Soc. B 57 (1995) 289)."""


@dataclass(frozen=True)
class Watched:
    """One quantity of one owner.

    ``days``, ``level``, ``u``: its history; ``rate``: in a year; ``peers``: median and standard deviation of its line
    or of the other gauges, with the probability of lying so far out by chance; ``due``: day, None past the horizon.
    """

    owner_kind: Literal["machine", "gauge"]
    owner: str
    quantity: str
    unit: str
    days: tuple[float, ...]
    level: tuple[float, ...]
    u: tuple[float, ...]
    rate: float
    u_rate: float
    changes: tuple[tuple[float, float], ...]
    peers: tuple[float, float] | None = None
    by_chance: float = 1.0
    leaves_peers: bool = False
    limit: float | None = None
    outcome: Outcome | None = None
    out_now: float | None = None
    due: float | None = None
    drifts: bool = False
    """Whether the rate is a finding among all rates of the fleet, as the history of one machine finds its own."""


@dataclass(frozen=True)
class _Followed:
    """States of one owner with the components that were seen."""

    owner_kind: Literal["machine", "gauge"]
    owner: str
    keys: list[tuple[str, str]]
    states: list[DriftState]
    changes: dict[int, tuple[float, float]]
    prior: DriftPrior


def watch(found: FleetInference, limits: Mapping[str, float] | None = None, risk: float = RISK) -> list[Watched]:
    """Every quantity of every machine and gauge.

    Parameters
    ----------
    found : of :func:`stepgauge.fleet.hierarchical.infer.infer`
    limits : by quantity (``scale``, ``squareness``, ``reversal``, ``certificate_scale``, ``wear``), in its unit
    risk : probability of being out of limits from which on it is due
    """
    series: list[Watched] = []
    kinds_of: tuple[Literal["machine", "gauge"], ...] = ("machine", "gauge")
    for number, kinds in ((found.slopes, "slopes"), (found.sizes, "sizes")):
        if number is not None:
            number = replace(number, background=believed(number.background, number.value - number.explained()))
            for owner_kind in kinds_of:
                series += _watch_kind(found, number, owner_kind, kinds, limits or {}, risk)
    return _against_chance(series)


def _watch_kind(
    found: FleetInference,
    number: ExplainedNumber,
    owner_kind: Literal["machine", "gauge"],
    kinds: str,
    limits: Mapping[str, float],
    risk: float,
) -> list[Watched]:
    tried = [[*_follow(found, number, owner_kind, kinds, walk)] for walk in WALKS]
    best = int(np.argmax([sum(gain for _, gain in one) for one in tried]))
    followed = [one for one, _ in tried[best]]
    said = [row for one in followed for row in _said(one, kinds, limits, risk)]
    return _add_peers(said, found)


def _usual(number: ExplainedNumber, owner_kind: str, kind: str, line: str) -> float:
    """Standard deviation of first levels: of machines of a line with all that is wrong, of gauges as the priors say."""
    if owner_kind == "gauge":
        return fleet_priors().kinds["gauge"][kind].usual
    own = [float(np.max(term.sd)) for term in number.background.terms if term.name == f"machine {kind} of {line}"]
    sizes = [one.size for one in number.found if one.owner_kind in ("machine", "type") and one.kind == kind]
    return float(np.sqrt(np.mean(np.square(own)) + (np.mean(np.square(sizes)) if sizes else 0.0)))


def _components(number: ExplainedNumber, owner_kind: str, kinds: str) -> dict[tuple[str, str], Array]:
    if owner_kind == "machine":
        return dict(number.unit)
    one = np.ones(len(number.value))
    return {("certificate_scale", ""): one} if kinds == "slopes" else {("wear", ""): 0.5 * one}


def _follow(
    found: FleetInference, number: ExplainedNumber, owner_kind: Literal["machine", "gauge"], kinds: str, walk: float
) -> Iterator[tuple[_Followed, float]]:
    """Every owner's states, with the logarithm of their density."""
    components = _components(number, owner_kind, kinds)
    others, every = _Others.of(number, owner_kind), number.explained()
    variance = 1.0 / number.background.weight
    fleet = found.fleet
    for place, owner in enumerate(fleet.names[owner_kind]):
        rows = np.flatnonzero(fleet.owner[owner_kind] == place)
        rows = rows[np.argsort(fleet.day[rows], kind="stable")]
        own = [key for key, share in components.items() if np.abs(share[rows]).max() > SEEN * np.abs(share).max()]
        if not own:
            continue
        shares = np.column_stack([components[key][rows] for key in own])
        line = fleet.visits[rows[0]].type if owner_kind == "machine" else ""
        wrong = every[rows] - _own_wrong(number, owner_kind, owner, line)[rows]
        value = number.value[rows] - others.share[rows] - wrong
        changes = _changes(number, owner_kind, owner, own)
        jumps = [(interval[1], component) for component, interval in changes.items()]
        prior = DriftPrior.of(np.array([_usual(number, owner_kind, kind, line) for kind, _ in own]), RATE, walk, JUMP)
        states, gain = follow(np.floor(fleet.day[rows]), value, variance[rows], shares, prior, jumps)
        lent = np.diag(np.concatenate([others.lent(rows, shares, prior.level), np.zeros(len(own))]))
        states = [replace(state, covariance=state.covariance + lent) for state in states]
        yield _Followed(owner_kind, owner, own, states, changes, prior), gain


@dataclass(frozen=True)
class _Others:
    """What the background's terms of other kinds of owners make of every visit ``(n,)``, and how well that is known:
    the covariance of their coefficients, whose columns are ``(n, q)``."""

    share: Array
    columns: sparse.csr_matrix
    covariance: Array
    weight: Array

    @classmethod
    def of(cls, number: ExplainedNumber, owner_kind: str) -> _Others:
        """All terms but those of one kind of owner, by what causes leave."""
        background = number.background
        at = background.inverse @ (background.weighted.T @ (number.value - number.explained()))
        names = [term.name for term in background.terms for _ in range(term.columns.shape[1])]
        other = np.flatnonzero([not name.startswith(owner_kind) for name in names])
        columns = background.columns[:, other].tocsr()
        return cls(columns @ at[other], columns, background.inverse[np.ix_(other, other)], background.weight)

    def lent(self, rows: NDArray[np.intp], shares: Array, level: Array) -> Array:
        """Variance that it lends to levels, ``(k,)``, which more visits of the same gauge do not lessen.

        Law of total variance: the levels by least squares with their priors are linear in what others make of visits.
        """
        weighted = shares * self.weight[rows][:, None]
        gain = np.linalg.solve(weighted.T @ shares + np.diag(level**-2.0), weighted.T)
        used = np.unique(self.columns[rows].indices)
        through = gain @ self.columns[rows][:, used].toarray()
        return np.einsum("kq,qr,kr->k", through, self.covariance[np.ix_(used, used)], through)


def _own_wrong(number: ExplainedNumber, owner_kind: str, owner: str, line: str) -> Array:
    """What an owner's own causes make of every visit; a machine answers for what is wrong with its line, too.

    An expansion is no length: it is taken off.
    """
    mine = {(owner_kind, owner), ("type", line)}
    return number.explained(lambda one: (one.owner_kind, one.owner) in mine and one.kind != "gauge_expansion")


def _changes(
    number: ExplainedNumber, owner_kind: str, owner: str, own: Sequence[tuple[str, str]]
) -> dict[int, tuple[float, float]]:
    """By component the days between which it changed, of causes that were named with a date."""
    dated = [one for one in number.found if (one.owner_kind, one.owner) == (owner_kind, owner) and one.begin]
    dated = [one for one in dated if one.course == "since" and (one.kind, one.where) in own]
    return {own.index((one.kind, one.where)): one.begin for one in dated if one.begin}


def _said(one: _Followed, kinds: str, limits: Mapping[str, float], risk: float) -> Iterator[Watched]:
    count = len(one.keys)
    for k, (kind, where) in enumerate(one.keys):
        last = one.states[-1]
        u = tuple(float(np.sqrt(state.covariance[k, k])) for state in one.states)
        limit = limits.get(kind)
        judged = _judged(last, k, u[-1], float(one.prior.walk[k]), limit, risk)
        unit = {"slopes": "um/m", "sizes": "um"}[kinds]
        changes = (one.changes[k],) if k in one.changes else ()
        yield Watched(
            one.owner_kind,
            one.owner,
            f"{kind} {where}".strip(),
            "urad" if kind == "squareness" else unit,
            tuple(state.day for state in one.states),
            tuple(float(state.level[k]) for state in one.states),
            u,
            float(last.rate[k]),
            float(np.sqrt(last.covariance[count + k, count + k])),
            changes,
            limit=limit,
            **judged,
        )


def _judged(last: DriftState, k: int, u: float, walk: float, limit: float | None, risk: float) -> dict[str, Any]:
    """Decision by ISO 14253-1, probability of being out now, and the day on which it is due."""
    if limit is None:
        return {}
    level = float(last.level[k])
    out = float(beyond(np.array(level), np.array(u), limit))
    return {
        "outcome": decide(level, limit, 2.0 * u),
        "out_now": out,
        "due": due_day(last, k, walk, limit, risk, HORIZON_DAYS),
    }


def _add_peers(said: list[Watched], found: FleetInference) -> list[Watched]:
    """Each with the spread of its peers: machines of its line, or all other gauges."""
    line = {v.machine: v.type for v in found.fleet.visits}
    groups: dict[tuple[str, str], list[Watched]] = {}
    for one in said:
        groups.setdefault((one.quantity, line.get(one.owner, "") if one.owner_kind == "machine" else ""), []).append(
            one
        )
    return [_compare_with_peers(one, group) for group in groups.values() for one in group]


def _compare_with_peers(one: Watched, group: Sequence[Watched]) -> Watched:
    others = [other for other in group if other.owner != one.owner]
    if len(others) < 4:
        return one
    level, u = (np.array([getattr(other, name)[-1] for other in others]) for name in ("level", "u"))
    middle = float(np.median(level))
    robust = mad_sigma(level - middle)
    spread = float(np.hypot(robust, np.median(u) if robust == 0.0 else 0.0))
    z = abs(one.level[-1] - middle) / float(np.hypot(spread, one.u[-1]))
    return replace(one, peers=(middle, spread), by_chance=float(2.0 * ndtr(-z)))


def _against_chance(series: list[Watched]) -> list[Watched]:
    """Those that leave their peers, with the false share among them controlled."""
    order = sorted(range(len(series)), key=lambda row: series[row].by_chance)
    passed = [rank for rank, row in enumerate(order, 1) if series[row].by_chance <= FALSE_SHARE * rank / len(series)]
    last = max(passed, default=0)
    leaving = set(order[:last])
    drifting = findings([_rate_by_chance(one) for one in series], FALSE_WARNINGS)
    return [replace(one, leaves_peers=row in leaving, drifts=drifting[row]) for row, one in enumerate(series)]


def _rate_by_chance(one: Watched) -> float:
    """Probability of so large a rate where there is none."""
    return float(2.0 * ndtr(-abs(one.rate) / one.u_rate)) if one.u_rate > 0.0 else float(one.rate == 0.0)


STEPS, LARGEST = 60, 3.0
"""Spreads that are tried, evenly by their logarithm; the largest of them over the usual size of a cause."""
ROUNDS = 4
"""What is known of one spread depends on the others: each round goes on from the last."""


def believed(background: Background, um: Array) -> Background:
    """A background whose spreads are the roots of their expected squares, from what causes leave of visits ``(n,)``.

    Coefficients of a spread that is not determined are then as uncertain as their own visits leave them.
    """
    wide = copy(background)
    wide.terms = [replace(term) for term in background.terms]
    for _ in range(ROUNDS):
        value, variance = _own(wide, um)
        for term, low, high in zip(wide.terms, wide.ends[:-1], wide.ends[1:], strict=True):
            usual = _usual_peer(term)
            if usual is not None:
                term.sd = _expected(value[low:high], variance[low:high], term.least, usual)
        wide.factor()
    return wide


def _usual_peer(term: RandomEffect) -> float | None:
    """Of machines and probes; the days of halls are many, and what a certificate states is known."""
    owner_kind, kind = term.name.split()[:2]
    prior = fleet_priors().kinds.get(owner_kind, {}).get(kind)
    return None if term.known or prior is None else prior.usual


def _own(background: Background, um: Array) -> tuple[Array, Array]:
    """What every coefficient is by the visits alone, and its variance ``(q,)``: of its posterior less its prior."""
    prior2 = background.prior**2
    share = np.maximum(1.0 - np.diag(background.inverse) / prior2, 1e-9)
    at = background.inverse @ (background.weighted.T @ um)
    return at / share, prior2 * (1.0 - share) / share


def _expected(value: Array, variance: Array, least: float, usual: float) -> float:
    """Root of the expected square of a spread, of which coefficients with these variances are known ``(q,)``."""
    spread = np.geomspace(least, max(LARGEST * usual, 2.0 * least), STEPS)
    total = spread[:, None] ** 2 + variance
    log = -0.5 * (np.log(total) + value**2 / total).sum(axis=1)
    weight = special.softmax(log + np.log(spread) - np.log1p((spread / usual) ** 2))
    return float(np.sqrt(weight @ spread**2))
