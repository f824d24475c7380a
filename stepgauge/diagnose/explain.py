"""What explains the residuals: the course of a search, from laws to what has none."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.confounded import rivals
from stepgauge.diagnose.corners import corners
from stepgauge.diagnose.departures import departure
from stepgauge.diagnose.forms import form_families
from stepgauge.diagnose.library import effect_families
from stepgauge.diagnose.locate import behind_placements, describe, most_telling
from stepgauge.diagnose.noise import (
    GROWTH_BESIDE_P,
    STILL_GROWING_P,
    Noise,
    estimate_noise,
    growth_of,
    with_lone_rows,
)
from stepgauge.diagnose.plainer import merged, plainer
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.result import Located
from stepgauge.diagnose.search import Library, Look
from stepgauge.diagnose.select import MOST_TERMS, SAME_FIT, Selector, Term
from stepgauge.diagnose.simpler import EXPLAINED, Simpler, instead_of, simpler, without_shadows
from stepgauge.diagnose.smooth import Forms
from stepgauge.diagnose.solve import Solved
from stepgauge.diagnose.wandering import smooth_forms
from stepgauge.diagnose.whitening import Whitening, make_whitening, orthonormal

Array = NDArray[np.float64]
UNKNOWN_FALSE_ALARM = 0.003
"""Chance that structure without a law is seen where there is none."""
SETTLING_ROUNDS = 3
MOST_NAMELESS, MOST_COMPARED = 3, 30
"""Covariates that structure without a law is told of, and the forms from which they are taken."""
SAME_NOISE = 0.03


@dataclass(frozen=True)
class Explained:
    """What was found: the laws, where the disagreement lives, and what is left without a law.

    ``refuted``: what speaks against the law that comes nearest to what is left.
    """

    noise: Noise
    selector: Selector
    terms: tuple[Term, ...]
    located: tuple[Located, ...]
    unexplained: tuple[Located, ...]
    refuted: tuple[str, ...] = ()


def explain(data: Residuals, noise: Noise, without: Collection[str]) -> Explained:
    """The laws in residuals, and what is left without one.

    Laws are selected beside the scatter, the scatter is judged again beside them, and they are held against forms: what
    a form says in fewer words than they do, what they leave, and where one of them departs from itself.
    """
    noise = with_lone_rows(_growing_beside_forms(noise, data), data.um, data, beside_outliers=True)
    whitening = make_whitening(data, noise.by_row_um)
    families = list(effect_families(data, without))
    selector = Selector(Library(families, whitening), whitening, data)
    terms, forms = selector.select(), all_forms(data, whitening)
    # what looked like scatter, outliers among it, may have been the effect, and the other way round
    again = _judged_again(noise, selector, terms, data)
    if not _same(noise, again) and not _structured(forms, selector, terms, again):
        noise = again
        selector = _beside(noise, selector, data)
        terms, forms = selector.select(), all_forms(data, selector.whitening)
    found = _held_against_forms(forms, selector, terms, noise)
    grown = _growing_beside_laws(found, data)
    if grown is None:
        return found
    selector = _beside(grown, selector, data)
    return _held_against_forms(all_forms(data, selector.whitening), selector, selector.select(), grown)


def _beside(noise: Noise, selector: Selector, data: Residuals) -> Selector:
    """The same candidates beside another scatter."""
    whitening = make_whitening(data, noise.by_row_um)
    return Selector(selector.library.judged_by(whitening), whitening, data, selector.trail)


def _held_against_forms(forms: Forms, selector: Selector, terms: tuple[Term, ...], noise: Noise) -> Explained:
    """The laws that stay where forms are tried in their place, beside them and on themselves."""
    terms = _settle(selector, terms)
    for weeded in (plainer, merged, without_shadows):
        if (fewer := weeded(selector, terms)) != terms:
            terms = _settle(selector, fewer)
    instead, nameless = simpler(forms, selector, terms, noise), _Nameless()
    if instead is None:
        named, (terms, nameless) = terms, _left_over(forms, selector, terms)
        instead = simpler(forms, selector, terms, noise) if len(terms) > len(named) else None
    refuted: tuple[str, ...] = ()
    if instead is None and not nameless.looks:
        terms, instead, refuted = _departing(forms, selector, terms)
    if instead is not None:
        # a law that stood for a part beside those that went may have to stand for the whole
        terms = _beside_form(forms, selector, _settle(selector, instead.kept), instead)
        nameless, refuted = _Nameless((instead.form,), instead.share), (*refuted, *instead.refuted)
    if nameless.looks:
        nameless = _behind_placements(nameless, forms, selector, terms)
    return Explained(noise, selector, terms, most_telling(forms, selector.data), nameless.described, refuted)


def _beside_form(forms: Forms, selector: Selector, terms: tuple[Term, ...], instead: Simpler) -> tuple[Term, ...]:
    """The laws less those that came in settling without the form and are chance beside it: they bent to it."""
    columns = selector.whitening(forms.columns(instead.form)).T
    same = {term.index for term in instead.kept}
    for term in (term for term in terms if term.index not in same):
        others = tuple(other for other in terms if other != term)
        left, basis = selector.residual(others)
        basis = orthonormal(np.column_stack([basis, columns]))
        look = selector.library.look(term.index, left, basis, selector.dof - basis.shape[1])
        if look.log_p > selector.bar:
            return _beside_form(forms, selector, others, instead)
    return terms


def _structured(forms: Forms, selector: Selector, terms: tuple[Term, ...], again: Noise) -> bool:
    """Whether rows that are outliers now stand alone in structure without a law, and are none."""
    alone = ~np.isfinite(again.by_row_um) & (selector.whitening.inverse_sigma > 0.0)
    if not alone.any():
        return False
    # a row with a column of its own is as good as left out
    left, basis = selector.residual(terms)
    basis = orthonormal(np.column_stack([basis, selector.whitening(np.eye(len(left))[alone]).T]))
    left = left - basis @ (basis.T @ left)
    look = forms.looks(left, basis, selector.dof - basis.shape[1])[0]
    return look.log_p <= _bar(forms)


def _growing_beside_laws(found: Explained, data: Residuals) -> Noise | None:
    """The scatter where laws that leave nothing else show it to grow and repeats did not, or the other way round.

    What repeats cannot say of the scatter, for every set of them has a mean of its own, all rows can beside a model.
    None where both say the same.
    """
    if found.unexplained:
        return None
    noise, selector = found.noise, found.selector
    left_um = data.um - displaced_um(selector.fit(found.terms).solved, data)
    if noise.growth is not None:
        noise = estimate_noise(replace(data, um=left_um), may_grow=False)
        selector = _beside(noise, selector, data)
    left, basis = selector.residual(found.terms)
    chance = GROWTH_BESIDE_P if found.noise.growth is None else STILL_GROWING_P
    growth = growth_of(data, left, (basis**2).sum(axis=1), np.isfinite(noise.by_row_um), chance)
    if (growth is None) == (found.noise.growth is None):
        return None
    return estimate_noise(replace(data, um=left_um), may_grow=False, growth=growth)


def _departing(
    forms: Forms, selector: Selector, terms: tuple[Term, ...]
) -> tuple[tuple[Term, ...], Simpler | None, tuple[str, ...]]:
    """The laws that are what they say, a form for one that is not, and what refutes it; one more law where one does."""
    found = departure(selector, terms)
    if found is None:
        return terms, None, ()
    law, departing = selector.looks(terms)[0], selector.library.families[terms[found.place].index]
    # a second law of the same kind would be the departure by another name
    explains = law.gain >= EXPLAINED * found.look.gain and law.family.kind != departing.kind
    if explains and (more := _with_one_more(selector, terms, law)):
        return _departing(forms, selector, more)
    kept = terms[: found.place] + terms[found.place + 1 :]
    instead = instead_of(forms, selector, terms, kept, refuted=True)
    chance = f"chance of it in scatter: {np.exp(found.look.log_p):.1g}"
    return terms, instead, () if instead is None else (f"{found.words} ({chance})",)


def _with_one_more(selector: Selector, terms: tuple[Term, ...], law: Look) -> tuple[Term, ...]:
    """The terms settled with one more law; none where there is no room, or it may be chance and does not stay."""
    if len(terms) >= MOST_TERMS or law.log_p > selector.bar:
        return ()
    settled = _settle(selector, (*terms, selector.term_of(law)))
    return settled if len(settled) > len(terms) else ()


def _growing_beside_forms(noise: Noise, data: Residuals) -> Noise:
    """The scatter without its growth where that is the growth of some structure, and gone with it."""
    if noise.growth is None:
        return noise
    plain = estimate_noise(data, may_grow=False)
    basis = _clearest(plain, data)
    if basis is None:
        return noise
    white = make_whitening(data, plain.by_row_um)(data.um)
    left = white - basis @ (basis.T @ white)
    still = growth_of(data, left, (basis**2).sum(axis=1), np.isfinite(plain.by_row_um))
    return plain if still is None else noise


def _clearest(noise: Noise, data: Residuals) -> Array | None:
    """Orthonormal columns ``(n, k)`` of the form that tells most, None where it may be chance."""
    whitening = make_whitening(data, noise.by_row_um)
    forms = all_forms(data, whitening)
    look = forms.looks(whitening(data.um), np.zeros((len(data), 0)), whitening.dof)[0]
    if look.log_p > _bar(forms):
        return None
    return orthonormal(whitening(forms.columns(look)).T)


def all_forms(data: Residuals, whitening: Whitening) -> Forms:
    """Formulas, random functions and waves that structure without a law is described by."""
    formulas = list(form_families(data))
    return Forms(formulas, list(smooth_forms(data)), whitening, list(corners(formulas, data)))


def _bar(forms: Forms) -> float:
    """Logarithm of the chance below which a form is structure and no scatter, every form having its share."""
    return float(np.log(UNKNOWN_FALSE_ALARM / max(len(forms.families), 1)))


def _judged_again(noise: Noise, selector: Selector, terms: tuple[Term, ...], data: Residuals) -> Noise:
    """The scatter beside the effects found, and the rows that stand alone beside them."""
    left_um = data.um - displaced_um(selector.fit(_placed_by_all(noise, selector, terms, data)).solved, data)
    if terms:
        noise = estimate_noise(replace(data, um=left_um))
    return with_lone_rows(noise, left_um, data)


def _placed_by_all(noise: Noise, selector: Selector, terms: tuple[Term, ...], data: Residuals) -> tuple[Term, ...]:
    """The same laws, each with the signature that suits the outliers best of those that the other rows leave open.

    Rows at a step look like outliers of their repeats; without them nothing says on which side of them the step is.
    """
    if not terms or not noise.outliers.size:
        return terms
    sigma_um = np.where(np.isfinite(noise.by_row_um), noise.by_row_um, noise.sigma_um)
    every = _beside(replace(noise, by_row_um=sigma_um), selector, data)
    for place, term in enumerate(terms):
        others = terms[:place] + terms[place + 1 :]
        gains = selector.library.gains(term.index, *selector.residual(others))
        open_left = gains >= gains[term.atom] - SAME_FIT
        best = np.where(open_left, every.library.gains(term.index, *every.residual(others)), -np.inf).argmax()
        terms = (*terms[:place], replace(term, atom=int(best)), *terms[place + 1 :])
    return terms


def _same(one: Noise, other: Noise) -> bool:
    """Whether two judgements of the scatter differ too little to matter."""
    alike = np.isfinite(one.by_row_um) == np.isfinite(other.by_row_um)
    return bool(alike.all()) and np.allclose(one.by_row_um, other.by_row_um, rtol=SAME_NOISE)


def _settle(selector: Selector, terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """The likeliest law in every place, each judged beside what now stands in the others; none where all are chance."""
    for _ in range(SETTLING_ROUNDS):
        before = terms
        for place in range(len(terms)):
            likeliest = rivals(selector, terms, place).looks[0]
            if likeliest.log_p > selector.bar:
                return _settle(selector, terms[:place] + terms[place + 1 :])
            terms = selector.exchanged(terms, place, likeliest)
        terms = selector.dealiased(terms)
        if terms == before:
            break
    return terms


@dataclass(frozen=True)
class _Nameless:
    """Forms of what is left without a law, the clearest first, and its share of all structure."""

    looks: tuple[Look, ...] = ()
    share: float = 0.0

    @property
    def described(self) -> tuple[Located, ...]:
        return tuple(describe(look, self.share) for look in self.looks)


def _left_over(forms: Forms, selector: Selector, terms: tuple[Term, ...]) -> tuple[tuple[Term, ...], _Nameless]:
    """Structure that the laws leave, and the laws, with one more where it makes up what is left.

    What is left must be neither chance nor the small departure of a named law from its ideal shape.
    """
    left, basis = selector.residual(terms)
    looks = forms.looks(left, basis, selector.dof - basis.shape[1])
    found = [look for look in looks if look.log_p <= _bar(forms)]
    if not found:
        return terms, _Nameless()
    explained = float(selector.data @ selector.data - left @ left)
    extra = max(found[0].gain - found[0].dimension, 0.0)
    if terms and explained / (explained + extra) >= EXPLAINED:
        return terms, _Nameless()
    law = selector.looks(terms)[0]
    if law.gain >= EXPLAINED * found[0].gain and (more := _with_one_more(selector, terms, law)):
        return _left_over(forms, selector, more)
    first = {look.family.covariate: look for look in reversed(found[:MOST_COMPARED])}
    clearest = sorted(first.values(), key=lambda look: look.log_p)[:MOST_NAMELESS]
    return terms, _Nameless(tuple(clearest), extra / (explained + extra))


def _behind_placements(nameless: _Nameless, forms: Forms, selector: Selector, terms: tuple[Term, ...]) -> _Nameless:
    """The forms behind the levels of the placements where they are a matter of these."""
    left, basis = selector.residual(terms)
    looks = forms.looks(left, basis, selector.dof - basis.shape[1])
    return replace(nameless, looks=tuple(behind_placements(nameless.looks, looks, forms, left, basis)[:MOST_NAMELESS]))


def displaced_um(solved: Sequence[Solved], data: Residuals) -> Array:
    """What laws move the readings by together, along the approach, shape ``(n,)``."""
    return sum((one.displacement_um(data) for one in solved), np.zeros(len(data)))
