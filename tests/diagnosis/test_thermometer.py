"""What all lengths of the gauge have in common without an error of the machine: its temperature, its certificate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.testing import assert_allclose

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.gauge.certified import Gauge
from stepgauge.inference.metric import nuisances
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.machine.file import Machine, StandardUncertainty
from stepgauge.recording import Recording
from tests.diagnosis.made import ALONG_X, ALONG_Y, by_hand, gauge, machine, side_of

AT_C, U_K, PPM = 20.0, 0.3, 4.5
STRETCH = {"gauge_temperature", "scale_temperature", "scale_error"}
STEPS = gauge()


def thermometer(u_K: float | None) -> Machine:
    on = machine()
    stated = None if u_K is None else StandardUncertainty(u=u_K)
    return replace(on, stated=on.stated.model_copy(update={"gauge_temperature_K": stated}))


def stretched(at_C: float = AT_C, ppm: float = PPM) -> Recording:
    def along_um(rows: pd.DataFrame) -> np.ndarray:
        at_mm = STEPS.position_mm[rows["face"] - 1]
        return (ppm + STEPS.table.expansion_per_K * 1e6 * (at_C - 20.0)) * 1e-3 * at_mm * side_of(rows)

    return by_hand(STEPS, along_um, (ALONG_X, ALONG_Y), gauge_temperature_C=lambda rows: np.full(len(rows), at_C))


def covariance(on: Machine, steps: Gauge, at_C: float) -> tuple[np.ndarray, np.ndarray]:
    """Of what nuisances but the origins move along the gauge, um^2, and the position of every row, mm."""
    data = make_residuals(stretched(at_C), steps, on)
    problem = replace(bare_problem(data), free=np.zeros((0, len(data))))
    columns, sd = nuisances(problem, NoiseModels(problem, NoisePriors()).plain())
    along = columns * sd[:, None] * data.side
    return along.T @ along, steps.position_mm[data.face - 1]


def test_the_uncertain_temperature_and_expansion_of_the_gauge_are_in_the_covariance() -> None:
    """GUM 5.1: S^2 (alpha^2 u^2(T) + (T - 20)^2 u^2(alpha)), common to all rows of all placements."""
    table, at_C = STEPS.table, 23.0
    without, at_mm = covariance(thermometer(None), STEPS, AT_C)
    whole, _ = covariance(thermometer(U_K), STEPS, at_C)
    share = (table.expansion_per_K * U_K) ** 2 + (table.expansion_uncertainty_per_K * (at_C - 20.0)) ** 2
    assert_allclose(whole - without, share * np.outer(at_mm, at_mm) * 1e6, atol=1e-9)


def test_the_correlation_of_the_certificate_is_in_the_covariance() -> None:
    certificate = STEPS.certificate.model_copy(update={"proportional_um_per_m": 0.15, "correlation": 0.4})
    correlated = replace(STEPS, certificate=certificate)
    found, _ = covariance(thermometer(None), correlated, AT_C)
    face = np.tile(np.arange(STEPS.n_faces), len(found) // STEPS.n_faces)
    assert correlated.correlation is not None
    stated = correlated.correlation * np.outer(STEPS.u_um, STEPS.u_um)
    assert_allclose(found, stated[np.ix_(face, face)], atol=1e-9)


def test_what_the_thermometer_may_be_off_is_no_error_of_the_machine() -> None:
    """4.5 um/m in all directions: 1.3 standard uncertainties of the thermometer, and 80 of the readings."""
    sure, unsure = (diagnose(stretched(), STEPS, thermometer(u), separations=False) for u in (None, U_K))
    assert {one.kind for one in sure.findings} & STRETCH
    assert not {one.kind for one in unsure.findings} & STRETCH
