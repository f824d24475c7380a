"""Which companions make another answer, when an answer ends it, and that what does not matter is not waited for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stepgauge.diagnosis.further_runs import FurtherRun, extended
from stepgauge.diagnosis.hypotheses import HypothesisTerm, RivalHypothesis
from stepgauge.diagnosis.laws.candidates import law_candidates
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.investigation.decision import NOTHING, End, InvestigationState, Rated, Unseen, decide, unseen
from stepgauge.investigation.relevance import Foresight, answers
from tests.diagnosis.made import ALONG_Y, gauge, machine, record
from tests.investigation.made import lies_along_y, small_case


@dataclass(frozen=True)
class Named:
    """What of a candidate an answer has."""

    label: str
    named: bool = True

    @property
    def source(self) -> Any:
        return SimpleNamespace(label=self.label)


def supposed(probability: float, *labels: str) -> RivalHypothesis:
    parts = tuple(HypothesisTerm(Named(label, label != "unknown"), 0, 1.0) for label in labels)  # type: ignore[arg-type]
    return RivalHypothesis(parts, probability)


POSSIBLE = [
    supposed(0.5, "reversal"),
    supposed(0.2, "reversal", "lobing"),
    supposed(0.15, "reversal", "unknown"),
    supposed(0.1, "radius"),
    supposed(0.05, "radius", "reversal"),
]
SIZE = np.array([2.0, 2.3, 3.0, 2.1, 2.9])
"""What each displaces; two are apart by the difference, at least."""


def told(least_um: float) -> Foresight:
    apart_um = np.abs(SIZE - SIZE[:, None])
    return Foresight((), tuple(POSSIBLE), least_um, answers(POSSIBLE, apart_um, least_um))


def test_a_small_companion_makes_no_other_answer_and_a_large_one_does() -> None:
    found = told(0.4)
    assert found.answers[0] == found.answers[1] == (frozenset({"reversal"}), False)
    assert found.answers[2] == (frozenset({"reversal"}), True)
    np.testing.assert_allclose(found.settled, 0.7)


def test_another_cause_is_another_answer_however_near() -> None:
    """What takes the place of a cause is no companion of it: radius and reversal are 0.1 um apart."""
    found = told(0.4)
    assert found.answers[3] == (frozenset({"radius"}), False)
    assert found.answers[4] == (frozenset({"radius", "reversal"}), False)


def test_beside_nothing_everything_matters() -> None:
    found = told(0.0)
    assert len(set(found.answers)) == len(POSSIBLE)
    assert found.settled == 0.5


def learnt(settled: float, own: float, share_um: float, hidden: Unseen) -> Any:
    """After a run: one large cause at odds of 100 to 1, and a second finding."""
    shares = ((0.99, 3.0), (own, share_um))
    findings = [
        SimpleNamespace(own=p, share_um=np.full(2, um), confounded_with=(), alternatives=()) for p, um in shares
    ]
    data = SimpleNamespace(without_origins=lambda um: um)
    diagnosis: Any = SimpleNamespace(verdict="effects", findings=findings, data=data)
    run = FurtherRun("the gauge as it lies, once more", lies_along_y(), stays=True)
    return InvestigationState(diagnosis, (), (Rated(run, 2.0, 2.0, 0.02, (), hidden),), (), settled, 0.3)


SHOWN = Unseen(("squareness",), np.array([1.0 / 60.0]), np.array([0.05]))
"""What a run would show that a squareness needs."""


@pytest.mark.parametrize(
    ("settled", "own", "share_um", "hidden", "ends"),
    [
        (0.97, 0.6, 0.2, NOTHING, "the answer stands"),
        (0.97, 0.6, 0.5, NOTHING, "no run within reach tells enough"),
        (0.90, 0.99, 0.5, NOTHING, "no run within reach tells enough"),
        (0.97, 0.99, 0.5, SHOWN, None),
    ],
)
def test_an_answer_ends_it_at_its_odds_where_nothing_that_matters_is_hidden(
    settled: float, own: float, share_um: float, hidden: Unseen, ends: str | None
) -> None:
    """A small second finding need not have the odds; a squareness that only another run shows is waited for."""
    case, here = small_case(), lies_along_y()
    across = replace(here, axis=np.array([1.0, 0.0, 0.0]))
    found = decide(case, learnt(settled, own, share_um, hidden), [here, across])
    assert (found.why if isinstance(found, End) else None) == ends


def test_a_law_counts_as_hidden_as_far_as_it_may_still_matter() -> None:
    """A gauge along y shows no squareness; the diagonal shows one of three, most sizes of which exceed the scatter."""
    data = make_residuals(record(machine(), (ALONG_Y,), cycles=2), gauge(), machine())
    diagonal = next(one for one in extended(data, 0.3) if "diagonal" in one.run.words)
    priors = shipped_priors()
    kept = {law.kind for law in law_candidates(data, priors, diagonal.metric)} - {"squareness", "scale_error"}
    odds = []
    for least_um in (0.0, 0.3, 3.0, 100.0):
        found = unseen(diagonal, len(data), priors, kept, (), least_um)
        odds.append({kind: sum(found.odds[np.array(found.kinds) == kind]) for kind in ("squareness", "scale_error")})
    every = np.array([[one["squareness"], one["scale_error"]] for one in odds])
    assert (np.diff(every, axis=0) < 0.0).all()
    assert every[1, 0] > 0.5 * every[0, 0] / 3.0
    assert every[3].max() < 1e-3
