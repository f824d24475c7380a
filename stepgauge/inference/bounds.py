"""Normal priors that are cut: amplitudes that cannot be negative, or cannot be small."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

Array = NDArray[np.float64]


def log_inside(mean: ArrayLike, u: ArrayLike, sd: ArrayLike, least: ArrayLike, positive: ArrayLike) -> Array:
    """What the log evidence rises by if the amplitude is known to be ``least`` or more.

    The share of the posterior inside the bound over that of the prior, both normal without the bound; any shapes that
    match.

    Parameters
    ----------
    mean, u : of the amplitude without the bound
    sd : standard deviation of its prior, which has the mean zero
    least : the smallest magnitude that it may have
    positive : whether it is above zero; else its sign is free
    """
    mean, u, sd, least = (np.asarray(one, float) for one in (mean, u, sd, least))
    above, below = special.log_ndtr((mean - least) / u), special.log_ndtr((-mean - least) / u)
    prior = special.log_ndtr(-least / sd)
    return np.asarray(np.where(positive, above - prior, np.logaddexp(above, below) - prior - np.log(2.0)))
