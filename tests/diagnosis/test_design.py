"""The run that separates the members of a set."""

from __future__ import annotations

import pytest

from stepgauge.diagnosis.design import extended, separate
from stepgauge.diagnosis.engine import diagnose_with_search
from stepgauge.diagnosis.residuals import make_residuals
from tests.diagnosis.made import ALONG_X, gauge, machine, record


def test_one_law_in_several_parts_is_one_rival_of_which_all_must_be_excluded() -> None:
    """Laws in parts of the record have the label of the law: a set with two of them ended in a traceback."""
    truth = machine(({"kind": "scale_error", "axis": "x", "ppm": 8.0},))
    data = make_residuals(record(truth, (ALONG_X,)), gauge(), machine())
    told, searched = diagnose_with_search(data, separations=False)
    assert searched is not None
    model = searched.model
    others = [one for one in model.laws[0].credible_set.members if one.candidate.named][1:3]
    rivals = [(one.candidate, one.proposal.atom) for one in others]
    possible = extended(data, model.state.sigma_um)
    once = separate(0, model.fitted.solved, rivals, [0.5, *[0.25] * len(rivals)], possible)
    twice = separate(0, model.fitted.solved, [*rivals, rivals[0]], [0.5, *[0.125] * (len(rivals) + 1)], possible)
    assert told.findings[0].confounded_with
    assert once is not None
    assert twice is not None
    assert (twice.run, twice.excludes) == (once.run, once.excludes)
    assert twice.expected_information_gain == pytest.approx(once.expected_information_gain, rel=0.5)
