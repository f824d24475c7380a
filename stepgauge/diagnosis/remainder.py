"""What the errors that are set by a number may still be, whether they are named or not.

Each with the uncertainty of one that is left as it is: about zero, from all that the readings say of it (GUM F.2.4.5).
Averaged over the hypotheses that contain it. The probability that there is none is not averaged in: what is as good as
nothing is never exactly nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy import special

from stepgauge.diagnosis.hypotheses import Searched
from stepgauge.diagnosis.result import Located
from stepgauge.diagnosis.wording.action import held
from stepgauge.diagnosis.wording.findings import states_value
from stepgauge.diagnosis.wording.notation import COVERAGE
from stepgauge.diagnosis.wording.structure import UNDETERMINED
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.problem import Candidate


@dataclass(frozen=True)
class MayRemain:
    """An error by its label: standard uncertainty about zero ``u``, in ``unit``; ``seen_um``: what u moves here."""

    label: str
    u: float
    unit: str
    seen_um: float


def may_remain(found: Searched) -> Iterator[MayRemain]:
    """The errors that are set by a number and that these readings show."""
    for candidate in found.search.problem.candidates:
        if candidate.named and not candidate.combined and states_value(candidate.kind) and candidate.first is None:
            u = _about_zero(candidate, found)
            if u is None:
                continue
            seen_um = u * float(np.abs(found.data.without_origins(candidate.columns(0)[0])).max())
            unit = next(one.unit for one in candidate.source.law.parameters() if one.role == "linear")
            yield MayRemain(candidate.label, u, unit, seen_um)


def negligible(remaining: Iterable[MayRemain], noise_um: float, kind: str | None) -> frozenset[str]:
    """Labels of the errors whose presence is as good as nothing: what may remain is within what the machine holds."""
    held_um = held(kind, noise_um)
    return frozenset(one.label for one in remaining if COVERAGE * one.seen_um <= held_um)


def is_negligible(one: Located, negligible: Collection[str]) -> bool:
    """Whether structure is only like laws whose presence is as good as nothing."""
    like = [] if isinstance(one.phrases, str) else [phrase.get("law") for phrase in one.phrases]
    return one.form == UNDETERMINED and bool(like) and {*like} <= {*negligible}


def _about_zero(candidate: Candidate, found: Searched) -> float | None:
    """Root mean square of a size over the hypotheses that contain it, by their probabilities."""
    known, holding = found.search.evidence.best_by_labels, list[tuple[float, Hypothesis]]()
    for weight, one in zip(found.answer.weights, found.answer.hypotheses, strict=True):
        if weight > 0.0 and candidate.label in one.labels and one.labels in known:
            holding.append((float(weight), known[one.labels]))
    if not holding:
        look = next((one for one in found.search.screen(found.answer.best) if one.candidate is candidate), None)
        if look is None:
            return None
        holding.append((1.0, found.search.added(found.answer.best, look)))
    squares = np.array([_square(candidate, hypothesis) for _, hypothesis in holding])
    weights = np.array([weight for weight, _ in holding])
    return float(np.sqrt(weights @ squares / weights.sum())) * found.model.wider


def _square(candidate: Candidate, hypothesis: Hypothesis) -> float:
    """Mean square of a size, over all usual sizes: the precision of each takes the place of that of the present one."""
    place = hypothesis.place_of(candidate.label)
    assert place is not None  # it is one of those that hold the candidate
    mean, covariance = hypothesis.amplitudes(place)
    known, term = 1.0 / float(covariance[0, 0]), hypothesis.terms[place]
    variance = 1.0 / np.maximum(known - term.sd**-2.0 + candidate.sizes.sd**-2.0, candidate.sizes.sd**-2.0)
    squares = variance + (float(mean[0]) * known * variance) ** 2
    return float(special.softmax(hypothesis.size_log_evidence[place]) @ squares)
