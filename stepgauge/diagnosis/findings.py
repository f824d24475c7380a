"""The laws that are stated, each with its credible set, its values and its probability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from stepgauge.diagnosis.credible_finding import credible_finding
from stepgauge.diagnosis.fits.solve import Solved, solve
from stepgauge.diagnosis.laws.geometry import moved_um
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding
from stepgauge.diagnosis.stated_model import Model, law_of_expected_size, law_of_size
from stepgauge.diagnosis.stating_rules import StatedTerm, credible_laws
from stepgauge.effects import Effect
from stepgauge.effects.probings import Probings
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.posterior import Member, Posterior
from stepgauge.recording import APPROACH, POSITION

ANYWHERE, SAME = 60, 1.0 - 1e-9
"""Made-up probings, and the cosine between displacements at them from which two laws are one."""


def findings(model: Model, answer: Posterior, data: Residuals, priors: Priors) -> Iterator[Finding]:
    """The laws that are stated."""
    for statement in model.laws:
        every = credible_laws(statement, priors.decision)
        fits = {
            one.candidate.label: _fitted_instead(one, statement, model, data)
            for one in every
            if not one.candidate.combined
        }
        # the stated one was possible when the others were stated, and stays
        rivals = [
            one
            for one in every
            if one is statement.lead or one.candidate.combined or fits[one.candidate.label].is_possible
        ]
        causes = {label: _cause(solved, data) for label, solved in fits.items()}
        different = _different(rivals, fits, data)
        yield credible_finding(statement, causes, different, answer, model.state, priors.decision, model.wider)
    yield from (_geometry_finding(one, model, answer, data, priors) for one in model.geometry)


def _cause(solved: Solved, data: Residuals) -> Finding:
    """A law with its values; that it is a cause has a probability in its set only."""
    family, moved_um = solved.family, solved.displacement_um(data)
    return Finding(family.kind, family.label, solved.effect, choices_of(solved), solved.parameters, 0.0, moved_um)


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


def choices_of(solved: Solved) -> dict[str, object]:
    """Axis, face, ... of an effect, and its fitted direction."""
    if solved.family.directions is None:
        return dict(solved.family.choices)
    return {**solved.family.choices, "direction": getattr(solved.effect, "direction", None)}
