"""From a standard uncertainty and its degrees of freedom to the expanded one (JCGM 100:2008, clause 6 and Annex G).

Propagation and effective degrees of freedom (Welch-Satterthwaite) are GTC's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

APPROXIMATELY_95 = 95.45
"""Coverage probability in percent at which k = 2 for a normal distribution."""


@dataclass(frozen=True)
class Expanded:
    """``U = k u``: ``u`` and ``expanded`` in the unit of the quantity, ``dof`` effective (infinite where it is)."""

    u: float
    dof: float
    k: float
    expanded: float


def expand(number: Any, percent: float = APPROXIMATELY_95) -> Expanded:
    """The expanded uncertainty of a GTC uncertain number.

    Parameters
    ----------
    number : GTC uncertain real number, or a plain one (uncertainty 0)
    percent : coverage probability

    Returns
    -------
    ``k`` is Student's t of the effective degrees of freedom, cut to the next lower integer (G.4, as in H.1.6); at
    least 1 of them.
    """
    from GTC import dof, uncertainty

    u = float(uncertainty(number))
    freedom = float(dof(number)) if u > 0.0 else math.inf
    k = coverage_factor(freedom, percent)
    return Expanded(u, freedom, k, k * u)


def coverage_factor(dof: float, percent: float) -> float:
    """Student's t for a symmetric interval of this probability, %, at degrees of freedom cut to an integer."""
    from GTC.reporting import k_factor

    return float(k_factor(math.inf if math.isinf(dof) else max(1, math.floor(dof + 1e-9)), percent))
