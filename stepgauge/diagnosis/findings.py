"""The laws that are stated, each with its credible set, its values and its probability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from stepgauge.diagnosis.fits.solve import Estimate, Solved, solve, widened
from stepgauge.diagnosis.laws.geometry import moved_um
from stepgauge.diagnosis.priors import Decision, Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, Replacement
from stepgauge.diagnosis.stated_model import Model, law_of_expected_size, law_of_size
from stepgauge.diagnosis.stating_rules import (
    LEAST_ODDS,
    StatedTerm,
    credible_laws,
    joined_kinds,
    replacements,
    set_probability,
    spread_factor,
    widening,
)
from stepgauge.effects import Effect
from stepgauge.effects.probings import Probings
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.posterior import AlternativeHypothesis, Member, Posterior
from stepgauge.recording import APPROACH, POSITION

ANYWHERE, SAME = 60, 1.0 - 1e-9
"""Made-up probings, and the cosine between displacements at them from which two laws are one."""


def findings(model: Model, answer: Posterior, data: Residuals, priors: Priors) -> Iterator[Finding]:
    """The laws that are stated."""
    for statement in model.laws:
        rivals, fits = [], {}
        for one in credible_laws(statement, priors.decision):
            if not one.candidate.combined:
                solved = _fitted_instead(one, statement, model, data)
                if one is not statement.lead and not (solved.is_possible and _has_all(solved, priors.decision)):
                    continue  # the stated one was possible when the others were stated, and stays
                fits[one.candidate.label] = solved
            rivals.append(one)
        causes = {label: _cause(solved, data) for label, solved in fits.items()}
        different = _different(rivals, fits, data)
        yield credible_finding(statement, causes, different, answer, model.state, priors.decision, model.wider)
    yield from (_geometry_finding(one, model, answer, data, priors) for one in model.geometry)


def _has_all(solved: Solved, decision: Decision) -> bool:
    """Whether each of several sizes of a law is told from none: without one it is a simpler law by another name."""
    known = [one for one in solved.sizes if one.u is not None]
    return len(solved.sizes) < 2 or all(abs(one.value) >= decision.determined * (one.u or 0.0) for one in known)


def _different(laws: Sequence[Member], fits: Mapping[str, Solved], data: Residuals) -> list[Member]:
    """Laws without those that are another one by another name.

    They have the same parameters and move any reading alike, not only these. A warm scale and one that was made too
    long move any reading alike, too, but are two causes with parameters of their own.
    """
    anywhere = _scattered(data)
    kept: list[Member] = []
    moved: list[tuple[set[str], Array]] = []
    for one in laws:
        solved = fits.get(one.candidate.label)
        own = None if solved is None else _direction(solved.effect, anywhere)
        names = set() if solved is None else set(solved.parameters)
        if own is not None and any(names == its and abs(own @ other) > SAME for its, other in moved):
            continue
        kept.append(one)
        moved += [] if own is None else [(names, own)]
    return kept


def _direction(effect: Effect, probings: Probings) -> Array | None:
    """All displacements of an effect as one vector of length 1; None where it moves nothing, or needs other columns."""
    try:
        moved = effect.displacement_um(probings)
    except (InputError, ValueError):  # it needs columns or a course in time that made-up probings lack
        return None
    every = np.concatenate([np.broadcast_to(moved.get(axis, 0.0), len(probings)) for axis in "xyz"])
    size = float(np.linalg.norm(every))
    return every / size if np.isfinite(size) and size > 0.0 else None


def _scattered(data: Residuals) -> Probings:
    """Probings all over the travel of the machine, in all directions; other columns as all over the recording."""
    random, rows = np.random.default_rng(0), np.linspace(0, len(data) - 1, ANYWHERE).astype(int)
    columns = {name: values[rows] for name, values in data.columns.items()}
    low, high = data.probings.setting.travel_mm.T
    columns |= dict(zip(POSITION, (low + (high - low) * random.random((ANYWHERE, 3))).T, strict=True))
    approach = random.normal(size=(ANYWHERE, 3))
    columns |= dict(zip(APPROACH, (approach / np.linalg.norm(approach, axis=1, keepdims=True)).T, strict=True))
    return Probings(pd.DataFrame(columns), data.probings.setting)


def _geometry_finding(
    statement: StatedTerm, model: Model, answer: Posterior, data: Residuals, priors: Priors
) -> Finding:
    """All geometric errors at once, as the readings without the other laws tell them."""
    term, state, geometry = statement.term, model.state, statement.source
    left_um = data.um - sum((solved.displacement_um(data) for solved in model.fitted.solved), np.zeros(len(data)))
    search, nuisances = answer.search, [one.term.nuisance for one in model.forms]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, nuisances)
    sizes, covariance = geometry.posterior(metric, left_um, term.sd)
    effects, estimates = geometry.made(sizes), geometry.estimates(sizes, covariance)
    label = term.candidate.label
    cause = {label: Finding(geometry.kind, label, None, {}, estimates, 0.0, moved_um(effects, data))}
    rivals = credible_laws(statement, priors.decision)
    found = credible_finding(statement, cause, rivals, answer, state, priors.decision, model.wider)
    return replace(found, effects=effects, members=(), several=())


def _fitted_instead(rival: Member, statement: StatedTerm, model: Model, data: Residuals) -> Solved:
    """A law as it is fitted in the place of a stated one, together with the other laws."""
    index = model.laws.index(statement)
    if rival is statement.lead:
        return model.fitted.solved[index]
    families = [law_of_expected_size(one, model.state) for one in model.laws]
    atoms = [one.term.atom for one in model.laws]
    families[index], atoms[index] = (
        law_of_size(rival.candidate.source, rival.proposal.atom, rival.proposal.sd),
        rival.proposal.atom,
    )
    return solve(families, atoms, data, model.metric).solved[index]


def _cause(solved: Solved, data: Residuals) -> Finding:
    """A law with axis, face, ... and its fitted direction; that it is a cause has a probability in its set only."""
    family, choices = solved.family, dict(solved.family.choices)
    if family.directions is not None:
        choices["direction"] = getattr(solved.effect, "direction", None)
    moved_um = solved.displacement_um(data)
    return Finding(family.kind, family.label, solved.effect, choices, solved.parameters, 0.0, moved_um)


def credible_finding(
    said: StatedTerm,
    fits: Mapping[str, Finding],
    rivals: Sequence[Member],
    answer: Posterior,
    state: Hypothesis,
    decision: Decision,
    wider: float,
    least_wider: float = 1.0,
) -> Finding:
    """The finding of a place.

    Parameters
    ----------
    said : the statement
    fits : laws with their values as fitted in the place of the stated one, by the label of the candidate; of all rivals
        that are single laws, or of the stated one alone
    rivals : those of the credible laws that are told, the stated one first
    answer, state : the posterior, and the hypothesis that is stated
    decision : limits from which something is stated
    wider : factor on uncertainties from the predictive check
    least_wider : least factor for what other hypotheses say of the values
    """
    label, every, several = said.lead.candidate.label, credible_laws(said, decision), answer.alternatives(LEAST_ODDS)
    own = fits[label]
    combined = replacements(several, label, own.kind, decision)
    probability = set_probability(answer, every, combined)
    possible = sum(one.probability for one in rivals) / sum(one.probability for one in every)
    kinds = [one.candidate.kind for one in rivals if one.candidate.kind != own.kind]
    same = [_label(one, fits) for one in rivals if one.candidate.kind == own.kind and _label(one, fits) != own.label]
    factor = max(spread_factor(answer, state, label, decision.in_set), least_wider) * wider
    values = widened(own.parameters, factor)
    alone = set_probability(answer, every, []) / max(probability, 1e-300)
    leading = rivals[0].probability / sum(one.probability for one in rivals)
    return replace(
        own,
        parameters=values,
        probability=probability,
        # of two terms of one kind each hypothesis has the label of the first: the place itself tells which it is
        own=min(answer.probability_of_any([frozenset({label})]) / possible, probability * alone * leading),
        confounded_with=tuple(dict.fromkeys((*kinds, *joined_kinds(combined)))),
        alternatives=tuple(dict.fromkeys(same)),
        members=tuple(_members(rivals, fits, alone, values)),
        several=_replacements(several, label),
        where=(own.effect.when or "") if own.effect is not None else "",
        widened_by=widening(answer, state, label, decision.in_set),
    )


def _label(one: Member, fits: Mapping[str, Finding]) -> str:
    fitted = fits.get(one.candidate.label)
    return str(one.candidate.source.label) if fitted is None else fitted.label


def _members(
    rivals: Sequence[Member], fits: Mapping[str, Finding], alone: float, own: dict[str, Estimate]
) -> Iterator[Finding]:
    """All laws of a set, each with its own values from a fit in its place; none for a set of one.

    The stated one is first and has its ``own`` values; ``alone``: their share of the probability of the finding, of
    which combinations have the rest.
    """
    if len(rivals) < 2:
        return
    total = sum(one.probability for one in rivals)
    for one in (one for one in rivals if one.candidate.label in fits):
        fitted, share = fits[one.candidate.label], alone * one.probability / total
        values = own if one is rivals[0] else fitted.parameters
        yield replace(fitted, parameters=values, probability=share)


def _replacements(several: Sequence[AlternativeHypothesis], label: str) -> tuple[Replacement, ...]:
    """Combinations of laws in place of one and perhaps of others, the most probable first."""
    found: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = {}
    for one in several:
        if label in one.gone and all(c.named for c in one.come):
            come = tuple(sorted(c.source.label for c in one.come))
            others = tuple(sorted(other.partition(" #")[0] for other in one.gone if other != label))
            found[come, others] = max(found.get((come, others), 0.0), one.odds)
    ranked = sorted(found.items(), key=lambda item: -item[1])
    return tuple(Replacement(come, odds, others) for (come, others), odds in ranked)
