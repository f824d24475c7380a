"""Of what kind a machine or an axis is: as stated, or, of an axis, with the probability that readings give each kind.

A kind brings prior odds of effects. Where none is stated, the odds are averages over all kinds that are possible, and
the posterior probability of a kind follows from the hypotheses that were averaged over: the marginal likelihood under
its odds, over that under the average, is the mean of the ratio of both priors. Sizes count by the axis itself then, so
that nothing depends on its units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stepgauge.diagnosis.priors import Priors, nearest_name
from stepgauge.errors import InputError, naming
from stepgauge.inference.posterior import Posterior

KIND = "kind"
"""Key of a machine file, and comment of a recording of an axis, that states its kind."""


def stated_kind(stated: str | None, comments: Mapping[str, str], priors: Priors, where: Any) -> str | None:
    """The kind that is stated, by the user before the file; None for none.

    :class:`InputError` at the argument, or at ``where``, for one that the priors do not know.
    """
    kind = (stated or comments.get(KIND) or "").strip()
    if kind and kind not in priors.kinds:
        expected = nearest_name(kind, [*priors.kinds])
        raise InputError(naming(KIND) if stated else where, "no kind of machine or axis", found=kind, expected=expected)
    return kind or None


def possible_kinds(kind: str | None, motion: str, priors: Priors) -> list[str]:
    """The stated kind, or all kinds of axes with a motion, ``linear`` or ``rotary``."""
    return [kind] if kind else [name for name, one in priors.kinds.items() if one.motion in ("", motion)]


def kind_probabilities(answer: Posterior, kinds: Sequence[str], priors: Priors) -> dict[str, float]:
    """Posterior probability of each kind, all as likely before; the most probable first.

    ``answer``: of a search with ``priors.adapt(kinds)``.
    """
    laws = sorted({one.kind for one in answer.search.problem.candidates if one.named})
    factor = np.array([[priors.kinds[name].factor(law) for law in laws] for name in kinds])
    mean = factor.mean(axis=0)
    base = np.array([priors.laws.odds * priors.laws.of(law).odds for law in laws])
    column = {law: i for i, law in enumerate(laws)}
    # what a prior gives to all hypotheses together is one
    log_whole = np.log1p(base * factor).sum(axis=1) - np.log1p(base * mean).sum()
    log_ratio = np.log(factor / mean)
    found = np.zeros(len(kinds))
    for weight, one in zip(answer.weights, answer.hypotheses, strict=True):
        own = [column[c.kind] for c in one.candidates if c.kind in column]
        found += weight * np.exp(log_ratio[:, own].sum(axis=1) - log_whole)
    probability = dict(zip(kinds, (found / found.sum()).tolist(), strict=True))
    return dict(sorted(probability.items(), key=lambda item: -item[1]))
