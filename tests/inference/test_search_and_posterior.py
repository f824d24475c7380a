"""A search without any gauge, what is said of what it visited, and what the package may know."""

from __future__ import annotations

import ast
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import stepgauge.inference as inference
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.stating_rules import (
    StatedTerm,
    _completed,
    answer_of,
    credible_laws,
    joined_kinds,
    replacements,
    set_probability,
)
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.posterior import AlternativeHypothesis, CredibleSet, Member, Posterior, credible_set
from stepgauge.inference.problem import AmplitudePrior, Candidate, Law, Refined, Term
from stepgauge.inference.proposal import Proposal
from stepgauge.inference.search import Search
from tests.inference.made import (
    NOISE_UM,
    ROWS,
    coordinate,
    law,
    noise,
    problem,
    random_function,
    turns,
    waves,
)

Array = NDArray[np.float64]
PLACES = np.linspace(0.1, 0.9, 17)
SLOPE = 1.2 * coordinate()
WAVE = 0.9 * np.sin(2.0 * np.pi * 3.0 * turns() + 0.4)
STEP = 1.0 * (turns() > PLACES[8])
BUMPY = 0.8 * np.sin(11.0 * turns() ** 2)


@lru_cache
def candidates() -> tuple[Candidate, ...]:
    """A slope, waves, steps, and functions of the time."""
    steps = (turns() > PLACES[:, None]).astype(float)[:, None]
    return (
        law("slope", coordinate()[None, None]),
        law("wave", waves(turns(), np.arange(1.0, 8.0, 0.25))),
        law("step", steps),
        random_function(turns(), (0.15, 0.5)),
    )


def answered(um: Array, seed: int = 2) -> Posterior:
    search = Search(problem(noise(seed) + um, candidates()), NoisePriors())
    return answer_of(search, shipped_priors().decision)


def test_a_pair_is_found_and_nothing_beside_it() -> None:
    found = answered(SLOPE + WAVE)
    assert found.best.labels == {"slope", "wave"}
    assert found.probability(["slope"]) > 0.99
    assert found.probability(["wave"]) > 0.99
    (place,) = (i for i, term in enumerate(found.best.terms) if term.candidate.label == "slope")
    mean, covariance = found.best.amplitudes(place)
    assert abs(mean[0] - 1.2) < 4.0 * np.sqrt(covariance[0, 0])
    assert found.best.sigma_um == pytest.approx(NOISE_UM, rel=0.25)


def test_a_triple_is_found() -> None:
    assert answered(SLOPE + WAVE + STEP).best.labels == {"slope", "wave", "step"}


def unit(rows: Array) -> Array:
    """The same with a root mean square of one."""
    return np.asarray(rows / np.sqrt((rows**2).mean(axis=-1, keepdims=True)))


@pytest.mark.parametrize("seed", [7, 8])
def test_many_at_once_are_found_beside_sums_of_some_of_them(seed: int) -> None:
    """One after the other the sums come first, and of seed 8 no exchange of one or two led back from there."""
    random = np.random.default_rng(seed)
    true = unit(random.normal(size=(6, ROWS)))
    sizes = random.choice([-1, 1], 6) * random.uniform(1.0, 2.0, 6)
    sums = []
    for _ in range(5):
        some = random.choice(6, 3, replace=False)
        sums.append(unit(sizes[some] @ true[some] + 0.9 * random.normal(size=ROWS)))
    every = [*((f"true {k}", one) for k, one in enumerate(true)), *((f"sum {k}", one) for k, one in enumerate(sums))]
    laws = tuple(law(label, one[None, None]) for label, one in every)
    found = Search(problem(noise(seed) + sizes @ true, laws), NoisePriors()).run()
    assert found.labels == {f"true {k}" for k in range(6)}


def test_what_has_no_law_is_a_function_of_where_it_lives() -> None:
    found = answered(BUMPY)
    assert found.best.labels == {"a random function"}
    assert found.probability_of_nothing() < 1e-3


def test_correlated_scatter_is_a_scatter_and_no_wave() -> None:
    one = problem(np.zeros(ROWS))
    random, um = np.random.default_rng(3), np.zeros(ROWS)
    level = 0.0
    for row, gap in zip(one.order, np.r_[np.inf, one.gap], strict=True):
        told = 0.9**gap
        level = told * level + np.sqrt(1.0 - told**2) * random.normal(0.0, 3.0 * NOISE_UM)
        um[row] = level
    search = Search(problem(um, candidates()), NoisePriors())
    found = answer_of(search, shipped_priors().decision)
    assert found.best.labels == set()
    assert found.probability_of_scatter("correlation") > 0.9


def test_the_best_is_not_improved_by_what_a_user_would_try_by_hand() -> None:
    """No hypothesis of one or two laws with any of their shapes is likelier than the one that was found."""
    found = answered(SLOPE + WAVE)
    search = found.search
    for base in (search.start, search.without(found.best, 0), search.without(found.best, 1)):
        for look in search.screen(base):
            assert search.added(base, look).log_posterior <= found.best.log_posterior + 1e-9


@pytest.mark.parametrize("um", [np.zeros(ROWS), SLOPE + WAVE, BUMPY, 0.12 * coordinate()])
def test_probabilities_sum_to_one(um: Array) -> None:
    found = answered(um)
    assert found.weights.sum() == pytest.approx(1.0)
    assert 0.0 <= found.probability_of_nothing() <= 1.0
    for place in found.sets:
        assert place.nothing + place.law_probability + place.form_probability == pytest.approx(1.0)
        assert place.members[0].candidate is found.best.terms[place.term].candidate
    some = found.probability([one.label for one in candidates()])
    nothing = sum(w for w, one in zip(found.weights, found.hypotheses, strict=True) if not one.candidates)
    assert some + nothing == pytest.approx(1.0)


def test_nothing_is_adequate_with_a_probability_that_holds() -> None:
    """Of 30 draws of mere scatter nothing is found in nearly all, and the mean of what is said is near their share."""
    said = np.array([answered(np.zeros(ROWS), seed).probability_of_nothing() for seed in range(100, 115)])
    assert (said > 0.5).mean() >= 0.93
    assert said.mean() > 0.75


def test_the_spread_of_an_amplitude_holds_all_hypotheses_that_have_it() -> None:
    found = answered(SLOPE + WAVE)
    spread = found.spread("slope", 1e-3)
    assert spread is not None
    place = next(i for i, term in enumerate(found.best.terms) if term.candidate.label == "slope")
    mean, covariance = found.best.amplitudes(place)
    assert abs(spread[0][0] - mean[0]) < np.sqrt(covariance[0, 0])
    assert spread[1][0, 0] >= 0.9 * covariance[0, 0]
    assert found.spread("step", 1e-3) is None


def test_several_laws_stand_in_place_of_one_only_if_each_of_them_is_needed() -> None:
    """A law that is the sum of two others has these as its alternative, but no twin of it with a third beside."""
    together = SLOPE + WAVE
    sums = (law("sum", together[None, None]), law("twin", together[None, None]))
    search = Search(problem(noise() + together, (*candidates(), *sums)), NoisePriors())
    answer = answer_of(search, shipped_priors().decision)
    (lead,) = answer.best.labels
    assert lead in ("sum", "twin")
    several = {frozenset(one.label for one in alternative.come) for alternative in answer.alternatives(1e-12)}
    assert frozenset({"slope", "wave"}) in several
    assert not any(labels & {"sum", "twin"} for labels in several)


def twins(um: Array, count: int) -> Posterior:
    """The answer where a number of laws fit equally well."""
    alike = [law(f"twin {i}", SLOPE[None, None]) for i in range(count)]
    search = Search(problem(noise() + um, alike), NoisePriors())
    return answer_of(search, shipped_priors().decision)


def test_several_laws_may_be_likelier_than_nothing_though_none_of_them_is() -> None:
    """Where one twin has less than half of the odds of nothing, three of them have more, and one is said with these."""
    faint = next(um for um in np.arange(0.3, 0.0, -0.02)[:, None] * SLOPE if not twins(um, 1).best.terms)
    alone = twins(faint, 1).probability_of_nothing()
    assert alone > 0.5
    count = int(np.ceil(1.5 * alone / (1.0 - alone)))
    found = twins(faint, count)
    assert found.probability_of_nothing() < 0.5
    assert len(found.best.terms) == 1
    (place,) = found.sets
    assert place.law_probability > 0.5
    assert place.law_probability == pytest.approx(1.0 - place.nothing)
    assert found.best.log_posterior < found.search.start.log_posterior  # which has none of them


def test_one_more_law_is_judged_by_its_own_place_in_whatever_order_the_two_were_computed() -> None:
    """Beside a slope that is sure, a wave that is not: the hypothesis of both stands there with the wave first."""
    search = Search(problem(noise() + SLOPE, candidates()), NoisePriors())
    best = search.added(search.start, search.screen(search.start)[0])
    assert best.labels == {"slope"}
    look = search.screen(best)[0]
    both = search.evidence((look.term(), *best.terms), best.noise, best.sigma_um)
    assert search.added(best, look) is both
    assert both.index(look.candidate) == 0
    assert both.log_posterior < best.log_posterior
    assert _completed(search, best, shipped_priors().decision) is best


def test_a_shape_is_fitted_to_residuals_of_which_no_nuisance_took_a_part() -> None:
    """Errors of the certificate take much of a large wave, as long as there is no wave in the hypothesis."""
    given: list[Array] = []

    def refine(_: int, um: Array) -> None:
        given.append(um)

    wave = law("wave", waves(turns(), np.arange(1.0, 8.0, 0.25)), refine=refine)
    um = noise() + 30.0 * WAVE
    search = Search(problem(um, (law("slope", coordinate()[None, None]), wave)), NoisePriors())
    looks = {look.candidate.label: look for look in search.screen(search.start)}
    assert np.abs(search.start.residual_um - um).max() > 0.01
    search.added(search.start, looks["wave"])
    np.testing.assert_array_equal(given[-1], um)
    sloped = search.added(search.start, looks["slope"])
    search.added(sloped, looks["wave"])
    np.testing.assert_allclose(given[-1], um - sloped.amplitudes(0)[0] @ sloped.terms[0].columns)


def test_volumes_of_correlated_scatter_are_not_those_of_independent_scatter() -> None:
    """A term that moves from one model to the other has the volume of the new one; what is out of date has no vote."""
    search = Search(problem(noise() + 0.3 * WAVE, candidates()), NoisePriors())

    def with_wave(state: Hypothesis) -> Hypothesis:
        return search.added(state, next(one for one in search.screen(state) if one.candidate.label == "wave"))

    vague = with_wave(search.evidence((), search.noise_models.changed(search.start.noise, correlation=0.8)))
    assert vague.current
    moved = search.evidence(vague.terms, search.start.noise)
    assert not moved.current
    assert moved not in search.evidence.current
    found, sharp = search.reshaped(vague), with_wave(search.start)
    assert not found.noise.correlated
    assert found.current
    assert found.log_posterior == pytest.approx(sharp.log_posterior, abs=1e-6)
    assert found.terms[0].log_prior != pytest.approx(moved.terms[0].log_prior, abs=0.01)


def test_the_decision_knows_nothing_of_gauges_probes_and_recordings() -> None:
    """Of this project it imports itself only."""
    allowed = "stepgauge.inference"
    for path in Path(inference.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else names
            for name in names:
                assert not name.startswith("stepgauge") or name.startswith(allowed), (path.name, name)


def rival(label: str, share: float, odds: float, named: bool = True) -> Member:
    candidate = replace(law(label, SLOPE[None, None]), kind=label, named=named, log_odds=float(np.log(odds)))
    return Member(candidate, share, Proposal(candidate, 0.0, 0.0, 0, 1.0))


def test_several_laws_for_one_are_told_from_a_twentieth_of_its_probability_on() -> None:
    """More laws always fit as well: what speaks against them is their prior odds, which count here."""
    come = (law("slope", SLOPE[None, None]), law("wave", WAVE[None, None]))
    start = Search(problem(noise()), NoisePriors()).start
    near, far = (AlternativeHypothesis(("sum",), come, odds, start) for odds in (0.06, 0.04))
    decision = shipped_priors().decision
    assert joined_kinds(replacements([near, far], "sum", "sum", decision)) == ("slope + wave",)
    assert replacements([far], "sum", "sum", decision) == []
    assert replacements([near], "sum", "slope", decision) == []
    assert replacements([near], "other", "sum", decision) == []


def test_two_laws_that_two_others_may_replace_are_as_probable_as_they_are_together() -> None:
    """The sum of two laws is that of two others: in the place of each alone nothing else fits."""
    one, two, swap = coordinate(), np.cos(9.0 * turns()), np.sin(23.0 * turns())
    pairs = {"a": one, "b": two, "c": one + swap, "d": two - swap}
    laws = [law(label, um[None, None]) for label, um in pairs.items()]
    answer = answer_of(Search(problem(noise() + one + two, laws), NoisePriors()), shipped_priors().decision)
    assert answer.best.labels in ({"a", "b"}, {"c", "d"})
    several = answer.alternatives(1e-4)
    for place in answer.sets:
        lead = place.members[0]
        label = lead.candidate.label
        assert lead.probability > 0.99
        alone = set_probability(answer, [lead], [])
        assert alone == pytest.approx(answer.probability([label]))
        assert 0.1 < alone < 0.9
        combined = replacements(several, label, label, shipped_priors().decision)
        assert joined_kinds(combined) in (("c + d",), ("a + b",))
        assert set_probability(answer, [lead], combined) > 0.99


def test_laws_replaced_one_by_one_by_rivals_of_their_own_are_no_further_alternative() -> None:
    """Two sets of two were told a second time, as two laws together in place of two."""
    one, two = coordinate(), np.cos(9.0 * turns())
    pairs = {"a": one, "as a": one, "b": two, "as b": two}
    laws = [law(label, um[None, None]) for label, um in pairs.items()]
    answer = answer_of(Search(problem(noise() + one + two, laws), NoisePriors()), shipped_priors().decision)
    assert [len(place.members) for place in answer.sets] == [2, 2]
    assert {"as a", "as b"} in [set(labels) for labels in answer.log_posterior]
    assert answer.alternatives(1e-4) == []


def test_what_stands_in_a_set_is_probable_or_not_excluded_by_the_readings() -> None:
    """A rare law that fits as well is listed, and so is what has a tenth of the probability, however common it is."""
    lead, rare, tenth = rival("lead", 0.75, 0.05), rival("rare", 0.03, 0.002), rival("tenth", 0.1, 0.2)
    worse, form, faint = rival("worse", 0.03, 0.2), rival("form", 0.05, 0.05, named=False), rival("faint", 0.01, 0.001)
    rivals = (rare, lead, tenth, worse, form, faint)
    said = StatedTerm(CredibleSet(0, rivals, 0.03), lead, Term(lead.candidate, 0, SLOPE[None], 1.0, 0.0))
    labels = [one.candidate.label for one in credible_laws(said, shipped_priors().decision)]
    assert labels == ["lead", "tenth", "rare"]


def test_a_law_that_fits_as_well_at_its_best_is_not_excluded_for_the_range_of_its_shapes() -> None:
    """A bump of one width beside one of any width and place: the second pays for every bump that is not there."""
    shape = np.exp(-(((coordinate() - 0.1) / 0.3) ** 2))
    bumps = np.exp(-(((coordinate() - np.linspace(-1.0, 1.0, 41)[:, None]) / 0.3) ** 2))[:, None]
    narrow, free = law("one", shape[None, None]), law("any", bumps)
    other = law("other", (shape * np.sign(coordinate() - 0.1))[None, None])
    search = Search(problem(noise() + 2.0 * shape, (narrow, free, other)), NoisePriors())
    place = credible_set(search, search.run(), 0)
    found = StatedTerm(place, place.members[0], search.run().terms[0])
    assert found.lead.candidate.label == "one"
    strict = shipped_priors().decision.model_copy(update={"excluded": 1.5})
    labels = [one.candidate.label for one in credible_laws(found, strict)]
    assert labels == ["one", "any"]


def test_what_the_readings_do_not_speak_for_is_nothing() -> None:
    """Thirty laws that explain nothing keep the odds that they had: together they are no cause of a faint slope."""
    random = np.random.default_rng(5)
    others = [law(f"other {i}", random.normal(size=(1, 1, ROWS))) for i in range(30)]
    search = Search(problem(noise() + 0.12 * SLOPE, (law("slope", SLOPE[None, None]), *others)), NoisePriors())
    best = search.added(search.start, next(one for one in search.screen(search.start) if one.candidate.kind == "slope"))
    place = credible_set(search, best, 0)
    assert place.members[0].candidate.label == "slope"
    assert len(place.members) < 25
    assert place.nothing + sum(one.probability for one in place.members) == pytest.approx(1.0)
    for one in place.members[1:]:
        gain = (
            one.proposal.gain if one.hypothesis is None else one.hypothesis.log_posterior - search.start.log_posterior
        )
        assert gain > one.candidate.log_odds


def test_a_signature_next_to_the_origin_does_not_lend_rivals_a_probability() -> None:
    """What nearly vanishes beside the origins is seen in double precision only: a look takes it for nothing."""
    side = problem(np.zeros(ROWS)).free[0]
    wide = AmplitudePrior(np.array([1.0, 3000.0]), np.log([0.5, 0.5]))
    hidden = replace(law("hidden", (side + 5e-4 * SLOPE)[None, None]), sizes=wide)
    random = np.random.default_rng(5)
    others = [law(f"other {i}", random.normal(size=(1, 1, ROWS))) for i in range(30)]
    search = Search(problem(noise() + SLOPE, (hidden, law("slope", SLOPE[None, None]), *others)), NoisePriors())
    own = next(one for one in search.screen(search.start) if one.candidate is hidden)
    best = search.added(search.start, own)
    assert best.log_posterior > search.start.log_posterior + own.gain + 10.0
    place = credible_set(search, best, 0)
    share = {one.candidate.label: one.probability for one in place.members}
    assert share["hidden"] > 0.05
    assert share["slope"] > 0.05
    assert sum(share.values()) - share["hidden"] - share["slope"] < 0.01


@pytest.mark.parametrize("seed", range(3))
def test_one_face_beside_something_larger_is_no_certificate_whose_uncertainty_is_too_small(seed: int) -> None:
    """Laws alike are more probable than the face at first, and beside them all faces may be off by more than stated."""
    certified = problem(np.zeros(ROWS)).certified
    faces = [law(f"face {i}", row[None, None]) for i, row in enumerate(certified)]
    alike = [law(f"wave along {axis}", waves(turns(), [3.0])) for axis in "abcd"]
    um = noise(seed) + 3.0 * np.sin(6.0 * np.pi * turns() + 0.4) + 1.3 * certified[4]
    best = Search(problem(um, (*faces, *alike)), NoisePriors()).run()
    assert "face 4" in best.labels
    assert len(best.labels) == 2
    assert best.noise.certificate == 1.0


def test_a_fitted_shape_has_the_volume_of_its_peak_and_nothing_larger_is_averaged() -> None:
    """A wave ten times the scatter between two periods of a coarse grid, beside the sum over a fine one."""
    counts, finer = np.arange(1.0, 8.0, 0.5), np.arange(0.75, 7.75, 0.005)
    um = 3.0 * np.sin(2.0 * np.pi * 3.23 * turns() + 0.4) + noise()

    def refine(atom: int, left_um: Array) -> Refined:
        near = counts[atom] + np.linspace(-0.5, 0.5, 201)
        left = [np.linalg.lstsq(one.T, left_um, rcond=None)[1][0] for one in waves(turns(), near)]
        best = int(np.argmin(left))
        return Refined(waves(turns(), near[best : best + 1])[0], near[best])

    own = law("wave", waves(turns(), counts), refine=refine)
    search = Search(problem(um, (own,)), NoisePriors())
    found = search.run()
    assert found.terms[0].shape == pytest.approx(3.23, abs=0.04)
    every = [
        search.evidence(
            (Term(own, i, columns, own.sizes.sd[-1], own.log_odds - np.log(len(finer))),), found.noise
        ).log_posterior
        for i, columns in enumerate(waves(turns(), finer), 1000)
    ]
    assert found.log_posterior == pytest.approx(np.logaddexp.reduce(every), abs=0.7)
    fitted = [one.log_posterior for one in search.evidence.current if one.terms and one.terms[0].atom < 1000]
    assert max(fitted) == found.log_posterior


def test_a_law_in_a_part_is_one_law_from_whichever_place_it_is_asked_for() -> None:
    """Two laws of one name would be two terms, and the one that stands in a hypothesis no candidate."""
    late = (turns() > 0.3).astype(float)
    slope, bow = (
        law(name, column[None, None]) for name, column in (("slope", coordinate()), ("bow", coordinate() ** 2))
    )

    def in_part(one: Law, atom: int) -> list[Law]:
        return [] if "late" in one.label else [law(f"{one.label} where late", one.pattern[atom][None] * late)]

    um = noise() + (3.0 * coordinate() + 2.0 * coordinate() ** 2) * late
    one = replace(problem(um, (slope, bow), growing={"position": (coordinate() + 1.0) / 2.0}), in_part=in_part)
    search = Search(one, NoisePriors())
    base = search.added(search.start, search.screen(search.start)[0])
    first, again = ({term.candidate for found in search.part_moves(base) for term in found.terms} for _ in range(2))
    assert first == again  # the very same objects
    best = answer_of(search, shipped_priors().decision).best
    assert best.labels == {"slope where late", "bow where late"}
    assert all(any(term.candidate is one for one in search.problem.candidates) for term in best.terms)
