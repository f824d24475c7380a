"""Two terms of one law, as two steps: which is which in another hypothesis, where either may have either label."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.problem import Term


def law_of(term: Term) -> str:
    """The label of a term's law, whether it is the first or the second one in its hypothesis."""
    return (term.candidate.first or term.candidate).label


def place_of_same(own: Term, twins: Sequence[Term], one: Hypothesis) -> int | None:
    """Which term of a hypothesis is that of another one, whose ``twins`` of one law it is among; None for none."""

    def is_same(term: Term) -> bool:
        if law_of(term) != law_of(own):
            return False
        if own.n_amplitudes > 1:
            return term.atom == own.atom
        return len(twins) < 2 or max(twins, key=lambda twin: _likeness(term, twin)) is own

    near = [place for place, term in enumerate(one.terms) if is_same(term)]
    return near[0] if len(near) == 1 else max(near, key=lambda place: _likeness(one.terms[place], own), default=None)


def _likeness(one: Term, other: Term) -> float:
    """Cosine between the first columns of two terms, without its sign."""
    a, b = one.columns[0], other.columns[0]
    return abs(float(a @ b)) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300)
