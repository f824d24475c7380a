"""Lag and size of what follows a temperature, against sums over very many lags that use no derivative."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.marginals import marginalise
from stepgauge.diagnosis.fits.solve import Fitted, solve
from stepgauge.diagnosis.further_runs import independent_metric
from stepgauge.diagnosis.laws.library import Family, effect_families, family_signatures
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.inference.metric import Metric
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
    return data, family, independent_metric(data, SIGMA_UM)


def fit(data: Residuals, family: Family, metric: Metric) -> Fitted:
    """From the best lag of the grid."""
    fits = [solve([family], [atom], data, metric) for atom in range(len(family.atoms)) if family.atoms[atom]["lag_s"]]
    return min(fits, key=lambda one: float(one.left @ one.left))


def summed(data: Residuals, family: Family, metric: Metric) -> tuple[tuple[float, float], tuple[float, float]]:
    """Means and standard deviations of lag and size: 2000 lags, the size of each integrated in closed form."""
    grid = [float(atom["lag_s"]) for atom in family.atoms if atom["lag_s"]]
    lags = np.geomspace(min(grid) / 8.0, max(grid), 2000)
    left, chi2, sizes, widths = metric(data.um), [], [], []
    for lag in lags:
        column = metric(family_signatures(family, {"lag_s": float(lag)}, data))[0]
        gram = float(column @ column)
        sizes.append(float(column @ left) / gram)
        widths.append(1.0 / gram)
        chi2.append(float((left - sizes[-1] * column) @ (left - sizes[-1] * column)) + np.log(gram))
    weight = np.exp(-0.5 * (np.array(chi2) - min(chi2)))
    weight /= weight.sum()
    lag_s, size = weight @ lags, weight @ sizes
    size_u = np.sqrt(weight @ (np.array(widths) + (np.array(sizes) - size) ** 2))
    return (float(lag_s), float(np.sqrt(weight @ (lags - lag_s) ** 2))), (float(size), float(size_u))


@pytest.mark.parametrize(
    ("um_per_m_K", "lag_s", "seed"), [(2.0, 40.0, 3), (1.5, 40.0, 5), (1.5, 25.0, 8), (60.0, 70.0, 4)]
)
def test_lag_and_size_are_told_by_their_expectations_over_all_lags(um_per_m_K: float, lag_s: float, seed: int) -> None:
    """Of lags that are hardly determined, and of one to a hundredth: far less than a step of the lags of the range."""
    data, family, metric = followed(um_per_m_K, lag_s, seed)
    told = marginalise(fit(data, family, metric), data, metric).solved[0].parameters
    lag, size = ((told[name].value, told[name].u) for name in ("lag_s", "um_per_m_K"))
    every = summed(data, family, metric)
    assert lag == pytest.approx(every[0], rel=0.06)  # one lag, none at all, is not among the 2000
    assert size == pytest.approx(every[1], rel=0.06)


def test_what_follows_at_once_has_no_lag() -> None:
    """The weight of all lags but none is some 1e-30, and so is the expectation: it was told with thirty zeros."""
    data, family, metric = followed(600.0, 0.0, 4)
    at_once = next(n for n, one in enumerate(family.atoms) if not one["lag_s"])
    for fitted in (fit(data, family, metric), solve([family], [at_once], data, metric)):
        found = marginalise(fitted, data, metric).solved[0]
        assert (found.parameters["lag_s"].value, found.parameters["lag_s"].u) == (0.0, None)
        assert found.effect.lag_s == 0.0
        assert found.parameters["um_per_m_K"].value == pytest.approx(600.0, rel=0.01)
