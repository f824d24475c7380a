"""Priors of the noise: odds of each departure from equal, independent, normal readings, against none."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class NoisePriors(BaseModel):
    """Odds and ranges of the models of the noise.

    ``sigma_factor``: one standard deviation of the log-normal prior of sigma about what is stated; ``outliers``,
    ``heavy``, ``growth``, ``correlation``, ``flicker``, ``burst``, ``certificate``, ``rounded``: odds of outlying rows,
    of Student's tails, of a standard deviation that grows with a covariate, of first-order autoregression, of 1/f
    noise, of one noisy stretch, of stated uncertainties that are too small, and of rounding that repeats share;
    ``outlier_share``: mean rate of outliers where there are any. The other entries are the values that each model may
    take, all equally likely.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    sigma_factor: float = Field(3.0, gt=1.0)
    outliers: float = Field(0.1, gt=0.0)
    outlier_share: float = Field(0.01, gt=0.0, lt=0.5)
    outlier_sizes: list[float] = Field(default=[4.0, 16.0, 128.0, 2000.0, 30000.0], min_length=1)
    heavy: float = Field(0.1, gt=0.0)
    heavy_freedoms: list[float] = Field(default=[3.0, 7.0], min_length=1)
    growth: float = Field(0.03, gt=0.0)
    growth_rates: list[float] = Field(default=[0.7, 1.5, 3.0, 6.0], min_length=1)
    correlation: float = Field(0.03, gt=0.0)
    correlations: list[float] = Field(default=[0.3, 0.5, 0.7, 0.8, 0.9, 0.95], min_length=1)
    flicker: float = Field(0.01, gt=0.0)
    flicker_shares: list[float] = Field(default=[0.3, 0.6, 1.0], min_length=1)
    burst: float = Field(0.03, gt=0.0)
    burst_factors: list[float] = Field(default=[2.0, 4.0, 8.0], min_length=1)
    certificate: float = Field(0.03, gt=0.0)
    certificate_factors: list[float] = Field(default=[2.0, 4.0], min_length=1)
    rounded: float = Field(0.5, gt=0.0)
