"""A law that is stated as a finding: its set, values, and probability; for machines, axes and probe maps alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from stepgauge.diagnosis.fits.solve import Estimate, widened
from stepgauge.diagnosis.priors import Decision
from stepgauge.diagnosis.result import Finding, Replacement
from stepgauge.diagnosis.stating_rules import (
    LEAST_ODDS,
    StatedTerm,
    credible_laws,
    joined_kinds,
    replacements,
    set_probability,
    spread_factor,
)
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.posterior import AlternativeHypothesis, Member, Posterior


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
