"""Other laws that say the same in fewer words: plain ones for one with a fitted shape, one law for two.

A search adds one law at a time, the one that explains most by itself, and exchanges one at a time. A period that all
but fits into the pitch of the faces beats with them: with the right phase it moves fronts and backs apart and lets both
drift along the gauge, and so explains by itself what a wrong radius and a warm gauge do together. A warm gauge and a
scale of y that is too long are at last one scale of x, beside a squareness that was found after them.
"""

from __future__ import annotations

from itertools import combinations

from stepgauge.diagnose.search import Look
from stepgauge.diagnose.select import MOST_TERMS, Selector, Term

NEAR = 10.0
"""By how many nats a description may be the longer before all its parameters are fitted."""
MOST_PLAIN = 2
"""Plain laws that may stand for one with a fitted shape."""


def plainer(selector: Selector, terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """The terms with plain laws, or none, in the place of one with a fitted shape if that is shorter.

    So the information criterion has its say on a law besides the chance of it; what noise looks like is often a swing
    or a period that is significant and yet not worth the words that it takes to tell it.
    """
    for place, term in enumerate(terms):
        if not selector.library.families[term.index].fitted_shape:
            continue
        kept = terms[:place] + terms[place + 1 :]
        instead = _with_plain(selector, kept)
        if _length(selector, instead) < _length(selector, terms):
            action = "replaced by plainer laws" if len(instead) > len(kept) else "dropped: not worth its words"
            selector.log(action, selector.look_at(term.index, kept))
            return plainer(selector, instead)
    return terms


def merged(selector: Selector, terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """The terms with one law in the place of two, wherever that is the shorter description."""
    length = _length(selector, terms) if len(terms) > 1 else 0.0
    for two in combinations(terms, 2):
        kept = tuple(term for term in terms if term not in two)
        law = selector.looks(kept)[0]
        instead = (*kept, selector.term_of(law))
        alone = law.price(selector.dof, selector.library.breadth) + (selector.sum_of_squares(kept) - law.gain) / 2.0
        if alone < length + NEAR and _length(selector, instead) < length:
            selector.log("in the place of two", law)
            return merged(selector, instead)
    return terms


def price_of(selector: Selector, terms: tuple[Term, ...], term: Term) -> float:
    """What a law costs beside the others, nats."""
    others = tuple(other for other in terms if other != term)
    return selector.look_at(term.index, others).price(selector.dof, selector.library.breadth)


def _with_plain(selector: Selector, kept: tuple[Term, ...]) -> tuple[Term, ...]:
    """The terms kept and the most telling plain laws beside them, each again in its place beside the other."""
    terms = kept
    while len(terms) < min(len(kept) + MOST_PLAIN, MOST_TERMS):
        look = _most_telling(selector, terms)
        if look is None or look.log_p > selector.bar:
            return terms
        terms = (*terms, selector.term_of(look))
    for place in range(len(kept), len(terms)):
        look = _most_telling(selector, terms[:place] + terms[place + 1 :])
        terms = selector.exchanged(terms, place, look) if look else terms
    return terms


def _most_telling(selector: Selector, terms: tuple[Term, ...]) -> Look | None:
    """The plain law that tells most beside the terms."""
    return next((look for look in selector.looks(terms) if not look.family.fitted_shape), None)


def _length(selector: Selector, terms: tuple[Term, ...]) -> float:
    """What it takes to say the laws with their values, and what they leave, nats."""
    return sum(price_of(selector, terms, term) for term in terms) + selector.sum_of_squares(terms) / 2.0
