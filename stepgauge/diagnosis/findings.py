"""The laws that are stated, each with its credible set, its values and its probability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from stepgauge.diagnosis.credible import (
    LEAST_ODDS,
    StatedTerm,
    credible_laws,
    joined_kinds,
    replacements,
    set_probability,
    spread_factor,
)
from stepgauge.diagnosis.fits.solve import Estimate, Solved, solve, widened
from stepgauge.diagnosis.laws.geometry import moved_um
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, FindingMember, Replacement
from stepgauge.diagnosis.stated_model import Model, law_of_expected_size, law_of_size
from stepgauge.effects import Effect
from stepgauge.effects.probings import Probings
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.posterior import AlternativeHypothesis, Member, Posterior
from stepgauge.recording import APPROACH, POSITION

ANYWHERE, SAME = 60, 1.0 - 1e-9
"""Made-up probings, and the cosine between displacements at them from which two laws are one."""


def findings(model: Model, answer: Posterior, data: Residuals, priors: Priors, wider: float) -> Iterator[Finding]:
    """The laws that are stated; ``wider``: factor on uncertainties from the predictive check."""
    several = answer.alternatives(LEAST_ODDS)
    for said, solved in zip(model.laws, model.fitted.solved, strict=True):
        every = credible_laws(said, priors.decision)
        fits = {one.candidate.label: _in_place(one, said, model, data) for one in every if not one.candidate.combined}
        # the stated one was possible when the others were told, and stays
        rivals = [
            one for one in every if one is said.lead or one.candidate.combined or fits[one.candidate.label].is_possible
        ]
        rivals = _different(rivals, fits, data)
        label = said.lead.candidate.label
        combined = replacements(several, label, solved.family.kind, priors.decision)
        probability = set_probability(answer, every, combined)
        alone = set_probability(answer, every, []) / max(probability, 1e-300)
        possible = sum(one.probability for one in rivals) / sum(one.probability for one in every)
        kinds = tuple(dict.fromkeys(one.candidate.kind for one in rivals if one.candidate.kind != solved.family.kind))
        same = tuple(
            dict.fromkeys(
                one.candidate.source.label
                for one in rivals
                if one.candidate.kind == solved.family.kind and one.candidate.source.label != solved.family.label
            )
        )
        wide = widened(solved.parameters, spread_factor(answer, model.state, label, priors.decision.in_set) * wider)
        yield Finding(
            solved.family.kind,
            solved.family.label,
            solved.effect,
            choices_of(solved),
            wide,
            probability,
            solved.displacement_um(data),
            own=min(answer.probability([label]) / possible, probability),
            confounded_with=tuple(dict.fromkeys((*kinds, *joined_kinds(combined)))),
            alternatives=same,
            members=tuple(_members(rivals, fits, alone, wide)),
            several=_replacements(several, label),
            where=solved.effect.when or "",
        )
    yield from (_of_geometry(one, several, model, answer, data, priors, wider) for one in model.geometry)


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
    """Probings all over the travel of the machine, in all directions; other columns are those of the recording."""
    random, rows = np.random.default_rng(0), np.arange(ANYWHERE) % len(data)
    columns = {name: data.probings.column(name)[rows] for name in data.frame.columns}
    low, high = data.probings.setting.travel_mm.T
    columns |= dict(zip(POSITION, (low + (high - low) * random.random((ANYWHERE, 3))).T, strict=True))
    approach = random.normal(size=(ANYWHERE, 3))
    columns |= dict(zip(APPROACH, (approach / np.linalg.norm(approach, axis=1, keepdims=True)).T, strict=True))
    return Probings(pd.DataFrame(columns), data.probings.setting)


def _replacements(several: list[AlternativeHypothesis], label: str) -> tuple[Replacement, ...]:
    """Combinations of laws in place of one and perhaps of others, the most probable first."""
    found: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = {}
    for one in several:
        if label in one.gone and all(c.named for c in one.come):
            come = tuple(sorted(c.source.label for c in one.come))
            others = tuple(sorted(other.partition(" #")[0] for other in one.gone if other != label))
            found[come, others] = max(found.get((come, others), 0.0), one.odds)
    ranked = sorted(found.items(), key=lambda item: -item[1])
    return tuple(Replacement(come, odds, others) for (come, others), odds in ranked)


def _of_geometry(
    said: StatedTerm,
    several: list[AlternativeHypothesis],
    model: Model,
    answer: Posterior,
    data: Residuals,
    priors: Priors,
    wider: float,
) -> Finding:
    """All geometric errors at once, as the readings without the other laws tell them."""
    term, state, geometry, decision = said.term, model.state, said.source, priors.decision
    left_um = data.um - sum((solved.displacement_um(data) for solved in model.fitted.solved), np.zeros(len(data)))
    search, beside = answer.search, [one.term.nuisance for one in model.forms]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)
    sizes, covariance = geometry.posterior(metric, left_um, term.sd)
    effects, estimates = geometry.made(sizes), geometry.estimates(sizes, covariance)
    label, rivals = term.candidate.label, credible_laws(said, decision)
    combined = replacements(several, label, label, decision)
    return Finding(
        geometry.kind,
        label,
        None,
        {},
        widened(estimates, spread_factor(answer, state, label, decision.in_set) * wider),
        set_probability(answer, rivals, combined),
        moved_um(effects, data),
        own=answer.probability([label]),
        confounded_with=tuple(dict.fromkeys((*(one.candidate.kind for one in rivals[1:]), *joined_kinds(combined)))),
        effects=effects,
    )


def _members(
    rivals: list[Member], fits: dict[str, Solved], alone: float, own: dict[str, Estimate]
) -> Iterator[FindingMember]:
    """All laws of a set, each with its own values from a fit in its place; none for a set of one.

    The stated one is first and has its ``own`` values; ``alone``: their share of the probability of the finding, of
    which combinations have the rest.
    """
    if len(rivals) < 2:
        return
    total = sum(one.probability for one in rivals)
    for one in (one for one in rivals if not one.candidate.combined):
        solved = fits[one.candidate.label]
        parameters, share = own if one is rivals[0] else solved.parameters, alone * one.probability / total
        yield FindingMember(
            solved.family.kind, solved.family.label, share, solved.effect, choices_of(solved), parameters
        )


def _in_place(rival: Member, said: StatedTerm, model: Model, data: Residuals) -> Solved:
    """A law as it is fitted in the place of a stated one, beside the other laws."""
    place = model.laws.index(said)
    if rival is said.lead:
        return model.fitted.solved[place]
    families = [law_of_expected_size(one, model.state) for one in model.laws]
    atoms = [one.term.atom for one in model.laws]
    families[place], atoms[place] = (
        law_of_size(rival.candidate.source, rival.proposal.atom, rival.proposal.sd),
        rival.proposal.atom,
    )
    return solve(families, atoms, data, model.metric).solved[place]


def choices_of(solved: Solved) -> dict[str, object]:
    """Axis, face, ... of an effect, and its fitted direction."""
    if solved.family.directions is None:
        return dict(solved.family.choices)
    return {**solved.family.choices, "direction": getattr(solved.effect, "direction", None)}
