"""Lag and size of what follows a temperature, against sums over very many lags that use no derivative."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.marginals import with_marginals
from stepgauge.diagnosis.fits.solve import Fitted, solve
from stepgauge.diagnosis.laws.library import Family, effect_families, family_signatures
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.posterior.priors import shipped_priors
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.diagnosis.runs import plain_metric
from tests.diagnosis.made import machine
from tests.diagnosis.test_further_laws import STEPS, bent, measured, turned, warmed

Array = NDArray[np.float64]
SIGMA_UM = 0.3


def followed(um_per_m_K: float, lag_s: float, seed: int) -> tuple[Residuals, Family, Metric]:
    """A scale that follows the air, in two directions, and the law that does."""
    truth = {"kind": "thermal_expansion_of", "column": "air_C", "of": "x", "um_per_m_K": um_per_m_K, "lag_s": lag_s}
    recording = bent(warmed(measured((turned(4.0), turned(80.0)), seed, 6), seed), truth)
    data = make_residuals(recording, STEPS, machine())
    families = (one for one in effect_families(data, shipped_priors()) if one.kind == "thermal_expansion_of")
    family = next(one for one in families if {"column": "air_C", "of": "x"}.items() <= one.choices.items())
    return data, family, plain_metric(data, SIGMA_UM)


def fit(data: Residuals, family: Family, metric: Metric) -> Fitted:
    """From the best lag of the grid."""
    fits = [solve([family], [atom], data, metric) for atom in range(len(family.atoms)) if family.atoms[atom]["lag_s"]]
    return min(fits, key=lambda one: float(one.left @ one.left))


def summed(data: Residuals, family: Family, metric: Metric, about: tuple[float, float]) -> tuple[float, float]:
    """Root mean squares of lag and size about two values: 400 lags, the size of each integrated in closed form."""
    grid = [float(atom["lag_s"]) for atom in family.atoms if atom["lag_s"]]
    lags = np.geomspace(min(grid) / 8.0, max(grid), 400)
    left, chi2, sizes, widths = metric(data.um), [], [], []
    for lag in lags:
        column = metric(family_signatures(family, {"lag_s": float(lag)}, data))[0]
        gram = float(column @ column)
        sizes.append(float(column @ left) / gram)
        widths.append(1.0 / gram)
        chi2.append(float((left - sizes[-1] * column) @ (left - sizes[-1] * column)) + np.log(gram))
    weight = np.exp(-0.5 * (np.array(chi2) - min(chi2)))
    weight /= weight.sum()
    size = np.sqrt(weight @ (np.array(widths) + (np.array(sizes) - about[1]) ** 2))
    return float(np.sqrt(weight @ (lags - about[0]) ** 2)), float(size)


@pytest.mark.parametrize(("um_per_m_K", "lag_s", "seed"), [(2.0, 40.0, 3), (1.5, 40.0, 5), (1.5, 25.0, 8)])
def test_a_lag_that_is_hardly_determined_is_as_uncertain_as_all_that_are_possible(
    um_per_m_K: float, lag_s: float, seed: int
) -> None:
    data, family, metric = followed(um_per_m_K, lag_s, seed)
    fitted = fit(data, family, metric)
    told, once = (one.solved[0].parameters for one in (with_marginals(fitted, data, metric), fitted))
    lag, size = told["lag_s"], told["um_per_m_K"]
    assert (lag.value, size.value) == (once["lag_s"].value, once["um_per_m_K"].value)
    every = summed(data, family, metric, (lag.value, size.value))
    assert [lag.u, size.u] == pytest.approx(every, rel=0.15)  # one lag, none at all, is not among the 400
    assert lag.u is not None
    assert once["lag_s"].u is not None
    assert lag.u > 1.1 * once["lag_s"].u
