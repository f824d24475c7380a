"""What a further measurement is expected to tell about which hypothesis holds, in nats.

With equal covariances the predictive distributions of two hypotheses have the Bhattacharyya distance D / 8, D being the
chi-square distance of their means. The mutual information between hypothesis and new readings is at least

    I = - sum_i p_i ln sum_j p_j exp(-D_ij / 8)

(Kolchinsky and Tracey, Entropy 19, 2017: 361, equation 10 with the Chernoff coefficient 1/2). It is zero where all
hypotheses predict the same, and the entropy of the p_i where all predictions lie far apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """What a hypothesis predicts for a recording with further rows.

    ``mean_um (n,)``: its displacements with the values fitted so far; ``columns (k, n)``: how they change with each of
    its parameters; ``precision (k,)``: one over the prior variance of each parameter.
    """

    mean_um: Array
    columns: Array
    precision: Array


def distances(predictions: Sequence[Prediction], new: NDArray[np.bool_], whiten: Callable[[Array], Array]) -> Array:
    """Chi-square distances of the predictions of new rows, shape ``(h, h)``, symmetric.

    The difference of two means stands in the new rows only; what of it the parameters of one hypothesis and the
    nuisance parameters can take over without contradicting the old rows does not count. Of the two directions the
    smaller counts: what either hypothesis could still bend to.

    Parameters
    ----------
    predictions : one for each hypothesis, over all rows
    new : which rows are new, shape ``(n,)``
    whiten : linear map of columns ``(..., n)`` to independent variables of variance one, without nuisances
    """
    means = np.array([one.mean_um for one in predictions]) * new
    count = len(predictions)
    found = np.empty((count, count))
    mapped = whiten(means)
    for j, one in enumerate(predictions):
        found[:, j] = _left(mapped - mapped[j], whiten(one.columns), one.precision)
    return np.minimum(found, found.T)


def _left(differences: Array, columns: Array, precision: Array) -> Array:
    """Chi-square of each difference ``(h, n)`` after the best change of the parameters, shape ``(h,)``."""
    whole = (differences**2).sum(axis=1)
    if not len(columns):
        return whole
    size = 1.0 / np.sqrt(np.maximum((columns**2).sum(axis=1) + precision, 1e-300))
    scaled = columns * size[:, None]
    value, vector = np.linalg.eigh(scaled @ scaled.T + np.diag(precision * size**2))
    keep = value > 1e-12 * value[-1]
    dots = (differences @ scaled.T) @ (vector[:, keep] / np.sqrt(value[keep]))
    return np.maximum(whole - (dots**2).sum(axis=1), 0.0)


def expected_information_gain(probability: Array, distance: Array) -> float:
    """Least expected information about which hypothesis holds, nats.

    Parameters
    ----------
    probability : of each hypothesis, shape ``(h,)``, summing to one
    distance : chi-square distances of their predictions, shape ``(h, h)``
    """
    mixed = np.exp(-distance / 8.0) @ probability
    held = probability > 0.0
    return float(max(-(probability[held] * np.log(mixed[held])).sum(), 0.0))


def entropy(probability: Array) -> float:
    """What is not known yet about which hypothesis holds, nats."""
    held = probability[probability > 0.0]
    return float(-(held * np.log(held)).sum())
