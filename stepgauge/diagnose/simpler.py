"""Named laws, or one form without a name that says the same in fewer words.

Physics that has no name is imitated by piling up laws that are flexible enough. Each law costs its fitted parameters
and the search that found it (a description length); where one form in one covariate leaves as little for less, the laws
that it replaces were imitations. So are several laws of one kind at once, and laws that leave more than the scatter of
the repeats.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy import stats

from stepgauge.diagnose.corners import FINE_STEPS, WaveLook, corners_of, period_of
from stepgauge.diagnose.forms import TOUCHES, WANDERING, WAY, goes_both_ways
from stepgauge.diagnose.noise import Noise
from stepgauge.diagnose.plainer import price_of
from stepgauge.diagnose.search import Judge, Look
from stepgauge.diagnose.select import SAME_FIT, Selector, Term, share_within_repeats
from stepgauge.diagnose.smooth import Forms, SmoothLook
from stepgauge.diagnose.solve import Solved

MARGIN = 5.0
"""By how many nats a form must be a shorter description than a law: laws that are known are likelier beforehand."""
FLEXIBLE_MARGIN = 1.0
"""The same for a law whose shape was fitted (a period, a place, a time constant): it passes for much that is none."""
MARGIN_BESIDE = 3.0
"""The same for a form instead of one law among several, or of several that are all plain."""
PILE_MARGIN = 0.0
"""The same for a form instead of several laws at once, one of them with a fitted shape: none is likelier beforehand."""
RETOLD_MARGIN = 2.2
"""The same where a plain form tells the very story of a law whose shape was fitted, and as well.

A period that all but fits into the pitch of the faces beats with them, and passes for any bow or twist.
"""
CORNER_MARGIN = 3.0
"""By how many nats a wave with corners must be likelier than an oscillation of the vocabulary."""
MISFIT_MARGIN = -8.0
"""The same where the laws do not fit as well as the scatter of the repeats would let them."""
LOCKED_MARGIN = -3.0
"""The same where one among several laws oscillates in time and yet reads the same in every cycle."""
MISFIT_P = 0.002
PILE_MISFIT_P = 0.003
"""The same for several laws at once, which could bend to fit and do not."""
PILE_FORM_P = 0.01
"""Chance of the form that they leave: without one, it is the scatter of the repeats that came out small."""
EXPLAINED = 0.85
"""A law that makes up this share of what a form explains is that law, in a shape a little off its ideal."""
PILE_EXPLAINED = 0.93
OSCILLATIONS = {"temperature_cycle", "vibration"}
LOCKED = 0.25
"""Share of an oscillation's square within the repeats of a probing below which it keeps step with the cycles."""
APART = 0.5
"""The same above which repeats on both ways differ."""
IN_STEP = 0.06
"""The same below which a single one does so too closely for a chance, in as many cycles as :data:`FEWEST_IN_STEP`."""
FEWEST_IN_STEP = 4
WAY_P = 3e-4
"""Chance of what the way there says, below which it is believed where an oscillation keeps step with it."""
WAY_EXPLAINED = 0.5
"""Share of what the oscillation explains that the way must explain: a sine that it hardly tells is one by itself."""
MAY_REPEAT = {"block_defect", "step_change"}
"""Kinds of which two at once are nothing odd, even with the same choices."""


@dataclass(frozen=True)
class Simpler:
    """The laws that stay, and the form that stands for the others; ``share`` of the structure that it explains.

    ``refuted``: what speaks against laws that would explain it as well.
    """

    kept: tuple[Term, ...]
    form: Look
    share: float
    refuted: tuple[str, ...] = ()


def simpler(forms: Forms, selector: Selector, terms: tuple[Term, ...], noise: Noise) -> Simpler | None:
    """The shortest description by some of the laws and one form; None where the laws alone are shorter."""
    if not terms:
        return None
    history = _instead_of_alternating(forms, selector, terms)
    if history is not None and not _twice(selector, history.kept):
        return history
    cornered = _instead_of_sine(selector, terms)
    if cornered is not None:
        return cornered
    repeated = _twice(selector, terms)
    lowered = _lowered_margin(selector, terms, noise)
    fewer = [kept for kept in _subsets(terms) if len(repeated & set(kept)) <= 1]
    tried = [(kept, *_with_form(forms, selector, terms, kept)) for kept in fewer]
    ahead = [saved - min(lowered, _margin(selector, terms, kept)) for kept, saved, _ in tried]
    if repeated or max(ahead) > 0.0:
        return tried[int(np.argmax(ahead))][2]
    if len(terms) > 1 and _misfit(selector, terms, noise, PILE_MISFIT_P, PILE_EXPLAINED):
        beside = instead_of(forms, selector, terms, terms)
        return beside if beside is not None and beside.form.log_p <= np.log(PILE_FORM_P) else None
    return None


def _margin(selector: Selector, terms: tuple[Term, ...], kept: tuple[Term, ...]) -> float:
    """By how many nats a form must be the shorter description to stand for the laws that are not kept."""
    bends = any(selector.library.families[term.index].fitted_shape for term in terms if term not in kept)
    if len(terms) == 1:
        return FLEXIBLE_MARGIN if bends else MARGIN
    if len(kept) == len(terms) - 1:
        return MARGIN_BESIDE
    return PILE_MARGIN if bends else MARGIN_BESIDE


def _lowered_margin(selector: Selector, terms: tuple[Term, ...], noise: Noise) -> float:
    """By how many nats a form may be the longer description of what the laws describe badly, or by a rare chance."""
    if _misfit(selector, terms, noise, MISFIT_P, EXPLAINED):
        return MISFIT_MARGIN
    return LOCKED_MARGIN if _locked(selector, terms) else np.inf


def instead_of(
    forms: Forms, selector: Selector, terms: tuple[Term, ...], kept: tuple[Term, ...], refuted: bool = False
) -> Simpler | None:
    """The best form in place of the laws that are not kept; of laws ``refuted`` it may be the same story retold."""
    return _with_form(forms, selector, terms, kept, refuted)[1]


def _subsets(terms: tuple[Term, ...]) -> Iterator[tuple[Term, ...]]:
    for count in range(len(terms)):
        yield from combinations(terms, count)


def _twice(selector: Selector, terms: Sequence[Term]) -> set[Term]:
    """Terms of a kind that stands there more than once with the same choices, or free in its direction."""
    families = [selector.library.families[term.index] for term in terms]
    names = [f.kind if f.directions is not None or "direction" in f.choices else f.label for f in families]
    counts = Counter(name for name, f in zip(names, families, strict=True) if f.kind not in MAY_REPEAT)
    return {term for term, name in zip(terms, names, strict=True) if counts[name] > 1}


def without_shadows(selector: Selector, terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """The laws less those that explain but a small part of what another of their kind does.

    What a law in a shape a little off its ideal leaves, looks like a little more of the same law.
    """
    twins = _twice(selector, terms)
    fewer = {i: terms[:i] + terms[i + 1 :] for i, term in enumerate(terms) if term in twins}
    if not fewer:
        return terms
    place, kept = min(fewer.items(), key=lambda one: selector.sum_of_squares(one[1]))
    kinds = [selector.library.families[term.index].kind for term in terms]
    others = tuple(term for term, kind in zip(terms, kinds, strict=True) if kind != kinds[place])
    alone, together, none = (selector.sum_of_squares(some) for some in (kept, terms, others))
    return without_shadows(selector, kept) if alone - together <= (1.0 - EXPLAINED) * (none - together) else terms


def _locked(selector: Selector, terms: Sequence[Term]) -> bool:
    """Whether one law among several oscillates in time and yet reads the same in every cycle.

    An oscillation that keeps step with the cycles is a rare chance; what depends on the place and on the way there, as
    hysteresis does, keeps step with them always.
    """
    if len(terms) < 2:
        return False
    group, side = selector.residuals.group, selector.residuals.side
    return any(
        share_within_repeats(solved.displacement_um(selector.residuals) * side, group) < LOCKED
        for solved in selector.fit(tuple(terms)).solved
        if solved.family.kind in OSCILLATIONS
    )


def _instead_of_alternating(forms: Forms, selector: Selector, terms: tuple[Term, ...]) -> Simpler | None:
    """What depends on the way there, where laws swing in time with it; None where none does, or the way says nothing.

    To swing in time and yet read the same whenever the gauge is run the same way, and otherwise on the way back, is a
    rare chance; hysteresis does it always.
    """
    alternating = _alternating(selector, terms)
    if not alternating:
        return None
    kept = tuple(term for term in terms if term not in alternating)
    left, basis = selector.residual(kept)
    looks = forms.looks(left, basis, selector.dof - basis.shape[1])
    least = WAY_EXPLAINED * (float(left @ left) - selector.sum_of_squares(terms))
    ways = [look for look in looks if look.family.covariate == WAY and look.log_p <= np.log(WAY_P)]
    ways = [look for look in ways if look.gain >= least]
    if not ways:
        return None
    labels = [selector.library.families[term.index].label for term in alternating]
    against = tuple(f"{label} would have to keep step with the measuring cycles by chance" for label in labels)
    return replace(_described(kept, ways[0], float(left @ left) - selector.dof), refuted=against)


def _alternating(selector: Selector, terms: tuple[Term, ...]) -> list[Term]:
    """Oscillations in time that are a matter of the way by what they read in repeats.

    The same on one way and something else on the other; or, of a single law, the same in all cycles: its period is that
    of the cycles, and so it swings once on the way there and back, as a loop does.
    """
    data = selector.residuals
    if not goes_both_ways(data):
        return []
    in_step = IN_STEP if len(terms) == 1 and data.frame["cycle"].nunique() >= FEWEST_IN_STEP else 0.0
    ways = np.unique(np.column_stack([data.group, data.probings.way()]), axis=0, return_inverse=True)[1].ravel()
    found = []
    for term, solved in zip(terms, selector.fit(terms).solved, strict=True):
        along_um = solved.displacement_um(data) * data.side
        shared = share_within_repeats(along_um, data.group)
        apart = shared > APART and share_within_repeats(along_um, ways) < LOCKED
        if solved.family.kind in OSCILLATIONS and (apart or shared < in_step):
            found.append(term)
    return found


def _instead_of_sine(selector: Selector, terms: tuple[Term, ...]) -> Simpler | None:
    """A wave with corners in the place of an oscillation that is only the fundamental of it; None where none is.

    Either has a size, a phase and a period: the likelier of them is the one that explains more. Further oscillations of
    the kind, which may be its overtones, go with it, and what they cost is saved.
    """
    families = [selector.library.families[term.index] for term in terms]
    for term, solved in zip(terms, selector.fit(terms).solved, strict=True):
        kind = solved.family.kind
        kept = tuple(other for other, family in zip(terms, families, strict=True) if family.kind != kind)
        best = _best_wave(selector, solved, selector.look_at(term.index, kept), kept)
        if best is None:
            continue
        here = selector.sum_of_squares(kept)
        named = here - selector.sum_of_squares(terms)
        saved = sum(price_of(selector, terms, other) for other in set(terms) - {*kept, term})
        if (best.gain - named) / 2.0 + saved >= CORNER_MARGIN:
            against = f"a {best.family.label}, takes {best.gain:.0f} off chi-square, a sine {named:.0f}"
            return replace(_described(kept, best, here - selector.dof), refuted=(f"{solved.family.label}: {against}",))
    return None


def _best_wave(selector: Selector, solved: Solved, sine: Look, kept: tuple[Term, ...]) -> Look | None:
    """The wave with corners, about the period of an oscillation and moving what it moves, that explains most."""
    waves = corners_of(solved, selector.residuals)
    if waves is None:
        return None
    periods = waves.periods_near(period_of(solved), FINE_STEPS)
    if not len(periods):
        return None
    left, basis = selector.residual(kept)
    judge = Judge(float(left @ left), selector.dof - basis.shape[1])
    looks = waves.looks(periods, sine.extent, left, basis, judge, selector.whitening)
    return max(looks, key=lambda look: look.gain)


def _misfit(selector: Selector, terms: tuple[Term, ...], noise: Noise, chance: float, share: float) -> bool:
    """Whether the laws leave more between the sets of repeats than within them, and not just a little of it all."""
    left, basis = selector.residual(terms)
    dof = selector.dof - basis.shape[1] - noise.dof
    between = float(left @ left) - noise.dof
    if dof < 1 or stats.f.sf(between / dof, dof, noise.dof) > chance:
        return False
    explained = float(selector.data @ selector.data - left @ left)
    return explained < share * (explained + between - dof)


def _with_form(
    forms: Forms, selector: Selector, terms: tuple[Term, ...], kept: tuple[Term, ...], refuted: bool = False
) -> tuple[float, Simpler | None]:
    """By how much the best form beside the laws kept is shorter than the laws it replaces, and that description."""
    left, basis = selector.residual(kept)
    here, rows, count = float(left @ left), selector.dof, len(forms.families)
    named = here - selector.sum_of_squares(terms)
    price = sum(price_of(selector, terms, term) for term in terms if term not in kept)
    known = set() if refuted else set(terms) - set(kept) - _twice(selector, terms)
    removed = [selector.look_at(term.index, kept) for term in terms if term in known]

    def saved(look: Look) -> float:
        return look.gain / 2.0 - look.price(rows, count) - (named / 2.0 - price)

    def speaks(look: Look) -> bool:
        return all(_another_story(look, law) for law in removed) or _retold(look, removed, named, saved(look))

    looks = [look for look in forms.looks(left, basis, rows - basis.shape[1]) if speaks(look)]
    if not looks:
        return float("-inf"), None
    best = max(looks, key=saved)
    return saved(best), _described(kept, best, here - rows)


def _retold(look: Look, removed: Sequence[Look], named: float, saved: float) -> bool:
    """Whether a plain form tells the story of one law with a fitted shape as well as it (``named``), in fewer words."""
    if len(removed) != 1 or not removed[0].family.fitted_shape or not _is_plain(look):
        return False
    return look.gain >= named - SAME_FIT and saved >= RETOLD_MARGIN


def _is_plain(look: Look) -> bool:
    """Whether a form has nothing to fit but its sizes, or one size and where it begins; what wanders fits all."""
    if isinstance(look, SmoothLook):
        return look.family.covariate not in WANDERING
    if isinstance(look, WaveLook):
        return False
    return not look.family.fitted_shape or look.family.dimension == 1


def _described(kept: tuple[Term, ...], form: Look, structure: float) -> Simpler:
    """The laws kept and a form, with its share of the ``structure`` that the sum of squares has beyond scatter."""
    return Simpler(kept, form, min(form.gain / max(structure, form.gain), 1.0))


def _another_story(look: Look, law: Look) -> bool:
    """Whether a form says more than a law that it would replace, or something else.

    It may make an oscillation in time a matter of the way or the cycle: fast enough oscillations alias into anything
    that alternates. Touches since a long pause but count the time.
    """
    if law.gain - _by_chance(law) < EXPLAINED * (look.gain - _by_chance(look)):
        return True
    in_time = look.family.covariate in WANDERING or look.family.covariate.startswith(TOUCHES)
    return law.family.kind in OSCILLATIONS and not in_time


def _by_chance(look: Look) -> float:
    """About what the best of so many looks gains in mere scatter."""
    return look.dimension + 2.0 * float(np.log(look.looks))
