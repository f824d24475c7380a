"""Candidates for causes: whose, of which kind, where, and since when."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from stepgauge.files.arrays import Array
from stepgauge.files.dates import YEAR_DAYS
from stepgauge.fleet.hierarchical.background import Background
from stepgauge.fleet.hierarchical.priors import FleetPriors


@dataclass(frozen=True)
class Cause:
    """One candidate. ``where``: axis, plane, block or side; ``course``: ``always``, ``since`` a day, ``growing`` from a
    day on, ``season``, or ``once`` for one visit; ``day``: NaN where there is none."""

    owner_kind: str
    owner: str
    kind: str
    where: str = ""
    course: str = "always"
    day: float = np.nan


@dataclass
class CandidateColumns:
    """Candidates under construction: their columns over visits."""

    count: int
    causes: list[Cause] = field(default_factory=list)
    log_odds: list[float] = field(default_factory=list)
    usual: list[float] = field(default_factory=list)
    _rows: list[NDArray[np.intp]] = field(default_factory=list)
    _values: list[Array] = field(default_factory=list)

    def add(self, cause: Cause, rows: NDArray[np.intp], values: Array, odds: float, usual: float) -> None:
        """One candidate that shows in some visits; nothing where it shows in none."""
        if np.abs(values).max(initial=0.0) < 1e-9:
            return
        self.causes.append(cause)
        self.log_odds.append(float(np.log(odds)))
        self.usual.append(usual)
        self._rows.append(rows)
        self._values.append(values)

    def matrix(self) -> sparse.csc_matrix:
        """All columns, ``(visits, candidates)``."""
        ends = np.cumsum([0, *map(len, self._rows)])
        if not self._rows:
            return sparse.csc_matrix((self.count, 0))
        data = (np.concatenate(self._values), np.concatenate(self._rows), ends)
        return sparse.csc_matrix(data, shape=(self.count, len(self._rows)))


class VisitCandidates:
    """Candidates over one number of every visit, before a background."""

    def __init__(self, columns: CandidateColumns, background: Background) -> None:
        self.causes, self.background = columns.causes, background
        self.columns = columns.matrix()
        self._transposed = self.columns.T.tocsr()
        self.owner = owners_of(columns.causes)
        self.log_odds, self.usual = np.array(columns.log_odds), np.array(columns.usual)
        self.renew()

    def renew(self) -> None:
        """After a change of the background."""
        self.power = self.background.power(self.columns)

    def score(self, residual: Array) -> Array:
        """x' V^-1 r of every candidate."""
        return np.asarray(self._transposed @ self.background.solve(residual))

    def fit(self, rows: NDArray[np.intp], size: Array) -> Array:
        """The sum of some candidates."""
        return np.asarray(self.columns[:, rows] @ size)


def owners_of(causes: Sequence[Cause]) -> NDArray[np.intp]:
    """Numbers of the owners, in any order."""
    known: dict[tuple[str, str], int] = {}
    return np.array([known.setdefault((one.owner_kind, one.owner), len(known)) for one in causes], np.intp)


def dates_of(day: Array, priors: FleetPriors) -> Array:
    """First days of a change that tell visits apart: every day of a visit but the first, or some of them."""
    known = np.unique(day)[1:]
    if len(known) <= priors.time.dates:
        return known
    return known[np.unique(np.linspace(0, len(known) - 1, priors.time.dates).round().astype(int))]


def courses(day: Array, priors: FleetPriors) -> Iterator[tuple[str, float, Array, float]]:
    """Constant causes of an owner with visits on some days: course, day, factor ``(n,)``, share of the odds."""
    dates = dates_of(day, priors)
    yield "always", np.nan, np.ones(len(day)), priors.time.always if len(dates) else 1.0
    for since in dates:
        yield "since", float(since), (day >= since).astype(float), (1.0 - priors.time.always) / len(dates)


def growth(day: Array, priors: FleetPriors, begin: float) -> Iterator[tuple[str, float, Array, float]]:
    """Causes that grow from some day on, years since then as the factor."""
    dates = np.concatenate([[begin], dates_of(day, priors)[:-1]])
    dates = dates[:: max(1, len(dates) // 8)]
    for since in dates:
        share = priors.time.always if since == begin else (1.0 - priors.time.always) / max(len(dates) - 1, 1)
        yield "growing", float(since), np.maximum(day - since, 0.0) / YEAR_DAYS, share


def owner_visits(number: NDArray[np.intp], names: Sequence[str]) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """Every owner with the numbers of its visits."""
    order = np.argsort(number, kind="stable")
    ends = np.searchsorted(number[order], np.arange(len(names) + 1))
    for name, low, high in zip(names, ends[:-1], ends[1:], strict=True):
        yield name, order[low:high]
