"""What is said: one table of statements with their probabilities, from which all the rest follows.

Probabilities are averages over all hypotheses that were computed. The rules, for recordings, axes and probe maps alike:

1. A statement (a law with its set, structure without a law, a property of the scatter) is made if its probability is at
   least ``stated``.
2. The verdict is ``unknown`` if structure is stated, or if some structure without a law is as probable as that though
   no single one is, or if the readings exclude that there is nothing (odds of ``excluded``); else ``effects`` if a law
   or a property of the scatter is stated; else ``adequate`` if the probability that there is nothing is at least
   ``stated``; else ``insufficient``: the recording cannot tell.
3. That known physics explains the recording is said if the probability of the stated findings together, with no
   structure besides, is at least ``stated``.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from stepgauge.diagnosis.priors import Decision
from stepgauge.diagnosis.result import Finding, Located, Replacement, Verdict
from stepgauge.inference.noise_models import OUTLYING
from stepgauge.inference.posterior import Posterior, WeightedHypothesis

SCATTER = ("growth", "burst", "correlation", "certificate", OUTLYING, "heavy")
"""Properties of the scatter that have a probability."""
OPEN, UNDECIDED = "structure", "undecided"
"""Forms of structure of which it is not known what it depends on, and of what may be structure or several laws."""
MOST_POSSIBLE, LEAST_POSSIBLE = 3, 0.05
"""Most statements that are listed as possible, and the probability from which they are."""
MOST_TOGETHER = 6
"""Most hypotheses of laws that are listed where no single cause is likelier than not."""


Stated = TypeVar("Stated", bound=Finding)


@dataclass(frozen=True)
class Conclusion(Generic[Stated]):
    """What is stated, the verdict that follows, and the table of probabilities in JSON types."""

    verdict: Verdict
    findings: tuple[Stated, ...]
    structure: tuple[Located, ...]
    table: dict[str, Any]


def conclude(
    answer: Posterior,
    findings: Sequence[Stated],
    structure: Sequence[Located],
    decision: Decision,
    negligible: Collection[str] = (),
) -> Conclusion[Stated]:
    """The statements that are made of a posterior, and what follows from their probabilities.

    ``negligible``: labels of laws whose presence is as good as nothing.
    """
    made = tuple(one for one in findings if one.probability >= decision.stated)
    left = tuple(one for one in structure if one.probability >= decision.stated)
    left = left or tuple(undecided(answer, made, decision))
    nothing = answer.probability_of_nothing(negligible)
    verdict: Verdict = "insufficient"
    if left or made:
        verdict = "unknown" if left else "effects"
    elif nothing >= decision.stated:
        verdict = "adequate"
    return Conclusion(verdict, made, left, _table(answer, nothing, made, left))


def undecided(answer: Posterior, stated: Sequence[Finding], decision: Decision) -> Iterator[Located]:
    """What is likelier than not though no single one is, where no structure is stated: structure, or anything at all.

    ``stated``: the findings. Two laws may be as probable as two others or as one random function, so that none of these
    is a statement: what they are is told with the odds of the laws. That there is anything is not said where only the
    priors make it likelier than not, but where nothing is excluded.
    """
    unnamed = _probability(answer, _has_structure)
    any_term = _probability(answer, lambda one: bool(one.candidates))
    if unnamed >= decision.stated:
        yield _open_structure(answer, unnamed)
    elif any_term >= decision.excluded * (1.0 - any_term) and not any(
        one.probability >= decision.stated for one in stated
    ):
        names = _covariates(answer) or ["position"]
        found = Located(names[0], "both", UNDECIDED, [{"say": UNDECIDED}], 1.0, any_term)
        yield replace(found, laws=tuple(_together(answer)))


def _together(answer: Posterior) -> Iterator[Replacement]:
    """Hypotheses of laws only, the most probable first, with their odds against the best one with structure."""
    ranked = sorted(zip(answer.weights, answer.hypotheses, strict=True), key=lambda pair: -pair[0])
    most = next((weight for weight, one in ranked if _has_structure(one)), ranked[0][0])
    laws = [(weight, one) for weight, one in ranked if one.candidates and not _has_structure(one)]
    for weight, one in laws[:MOST_TOGETHER]:
        yield Replacement(tuple(sorted(c.source.label for c in one.candidates)), float(weight / most))


def _probability(answer: Posterior, holds: Callable[[WeightedHypothesis], bool]) -> float:
    return float(sum(w for w, one in zip(answer.weights, answer.hypotheses, strict=True) if holds(one)))


def _has_structure(one: WeightedHypothesis) -> bool:
    return any(not candidate.named for candidate in one.candidates)


def _open_structure(answer: Posterior, probability: float) -> Located:
    """Structure of which no single form is probable: what it may depend on, the most probable first."""
    names = _covariates(answer)
    return Located(names[0], "both", OPEN, [{"say": "open", "covariates": names}], 1.0, probability)


def _covariates(answer: Posterior) -> list[str]:
    """What structure without a law may depend on, the most probable first."""
    probability_of: dict[str, float] = defaultdict(float)
    for weight, one in zip(answer.weights, answer.hypotheses, strict=True):
        for name in {c.source.covariate for c in one.candidates if not c.named}:
            probability_of[name] += float(weight)
    return sorted(probability_of, key=lambda name: -probability_of[name])[:MOST_POSSIBLE]


def _table(
    answer: Posterior, nothing: float, findings: Sequence[Finding], structure: Sequence[Located]
) -> dict[str, Any]:
    """Probabilities of the statements: nothing, each law by itself and with its set, each structure, the scatter."""
    rows: list[dict[str, Any]] = []
    for one in findings:
        about = {"kind": one.kind, "parameters": {name: {"value": value} for name, value in one.choices.items()}}
        rows.append({**about, "probability": one.own, "includes_set": False})
        more = {"confounded_with": list(one.confounded_with)}
        rows.append({**about, **more, "probability": one.probability, "includes_set": True})
    rows += [
        {"form": one.form, "covariate": one.covariate, "probability": one.probability, "includes_set": False}
        for one in structure
    ]
    return {
        "adequate": nothing,
        "explained": _probability(answer, lambda one: _explains(one, findings)),
        "all_geometry": _probability(answer, lambda one: any(c.combined for c in one.candidates)),
        "scatter": {name: answer.probability_of_scatter(name) for name in SCATTER},
        "statements": rows,
        "possible": list(_possible(answer, findings, structure)),
    }


def _explains(one: WeightedHypothesis, findings: Sequence[Finding]) -> bool:
    """Whether a hypothesis has a cause of every finding's set, and no structure without a law."""
    kinds = {candidate.kind for candidate in one.candidates}
    sets = [{finding.kind, *finding.confounded_with} for finding in findings if finding.share_um.any()]
    return not _has_structure(one) and all(_has_any(kinds, own) for own in sets)


def _has_any(kinds: set[str], own: set[str]) -> bool:
    return any(set(kind.split(" + ")) <= kinds for kind in own)


def _possible(
    answer: Posterior, findings: Sequence[Finding], structure: Sequence[Located]
) -> Iterator[Mapping[str, Any]]:
    """What is not stated and may be there all the same, the most probable first."""
    probability_of: dict[tuple[str, str], float] = defaultdict(float)
    for weight, one in zip(answer.weights, answer.hypotheses, strict=True):
        for key in {_key(candidate) for candidate in one.candidates}:
            probability_of[key] += float(weight)
    known = {("label", label) for one in findings for label in (one.label, *(m.label for m in one.members))}
    known |= {("covariate", one.covariate) for one in structure}
    ranked = sorted(probability_of.items(), key=lambda item: -item[1])
    rest = [(key, p) for key, p in ranked if key not in known and p >= LEAST_POSSIBLE][:MOST_POSSIBLE]
    yield from ({what: name, "probability": p} for (what, name), p in rest)


def _key(candidate: Any) -> tuple[str, str]:
    return (
        ("label", candidate.label.partition(" #")[0]) if candidate.named else ("covariate", candidate.source.covariate)
    )
