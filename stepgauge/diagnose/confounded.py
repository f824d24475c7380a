"""Effects that this recording cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.search import Look
from stepgauge.diagnose.select import Selector, Term

Array = NDArray[np.float64]

UNDECIDED = np.log(20.0)
"""Two laws that are likelier than each other by less than this factor are not told apart."""
MOST_IMPLAUSIBLE = UNDECIDED + 0.5
"""Where every law needs a size that does not occur, none is preferred for needing a little less."""


@dataclass(frozen=True)
class Rivals:
    """The laws that could stand in one place of the model, best first, with their posterior weights."""

    looks: tuple[Look, ...]
    weights: tuple[float, ...]


def rivals(selector: Selector, terms: tuple[Term, ...], place: int) -> Rivals:
    """All families that explain nearly as much as the best one in one place, the other terms staying."""
    others = terms[:place] + terms[place + 1 :]
    looks = selector.looks(others)
    near = [look for look in looks if look.log_p <= looks[0].log_p + MOST_IMPLAUSIBLE]
    rank = {id(look): look.log_p + _implausible(look, selector, others) for look in near}
    near.sort(key=lambda look: rank[id(look)])
    near = [look for look in near if rank[id(look)] <= rank[id(near[0])] + UNDECIDED]
    weight = np.exp([rank[id(near[0])] - rank[id(look)] for look in near])
    return Rivals(tuple(near), tuple(float(w) for w in weight / weight.sum()))


def _implausible(look: Look, selector: Selector, others: tuple[Term, ...]) -> float:
    """How much less likely a law is because it needs a size that does not occur: a heavy tail, 1 / (1 + size)^2.

    Without this an axis that hardly moves in the recording could explain everything, by a scale ten per cent too long.
    """
    law = look.family.law
    sensible = [p.sensible for p in law.parameters() if p.role == "linear" and p.sensible] if law else []
    if not sensible:
        return 0.0
    columns = selector.columns((*others, selector.term_of(look)))
    coefficients = np.linalg.lstsq(columns, selector.data, rcond=None)[0][-look.family.dimension :]
    needed = float(np.linalg.norm(coefficients)) / max(abs(bound) for bound in sensible[0])
    return min(2.0 * float(np.log1p(needed)), MOST_IMPLAUSIBLE)
