"""``residuals.csv`` of a map: every value with its residual before and after, over the noise of its quantity."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from stepgauge.diagnosis.maps.result import MapDiagnosis, QuantityFit
from stepgauge.diagnosis.output.rows import FINDING, FORM

UNIT = "sd"
"""Residuals of forces and lengths beside each other: over the standard deviation of one reading."""


def map_row_table(found: MapDiagnosis) -> pd.DataFrame:
    """One row per value of the map, quantity by quantity.

    Columns as :func:`stepgauge.diagnosis.output.rows.row_table` has them, with these meanings: ``placement`` is the
    number of the quantity, in the order of the fits; ``face`` that of the direction; ``cycle`` counts its repeats;
    ``position_deg`` is the azimuth, ``polar_deg`` the polar angle.
    """
    return pd.concat([_of(fit, number, found) for number, fit in enumerate(found.fits, 1)], ignore_index=True)


def _of(fit: QuantityFit, number: int, found: MapDiagnosis) -> pd.DataFrame:
    data, noise = found.data, fit.noise or fit.measured.quantum or 1.0
    frame = pd.DataFrame({"recording": Path(data.path).name, "row": data.row_numbers, "placement": number}, copy=True)
    frame["cycle"] = pd.Series(data.direction).groupby(data.direction).cumcount().to_numpy() + 1
    frame["face"] = data.direction + 1
    frame["position_deg"], frame["polar_deg"] = data.azimuth_deg, data.polar_deg
    frame["used"] = found.kept.astype(int)
    frame[f"before_{UNIT}"], frame[f"after_{UNIT}"] = fit.before / noise, fit.described / noise
    for place, one in enumerate(found.findings, 1):
        frame[f"{FINDING}_{place}_{UNIT}"] = found.shares(one)[fit.name] / noise
    for place, form in enumerate(found.forms, 1):
        frame[f"{FORM}_{place}_{UNIT}"] = found.shares(form)[fit.name] / noise
    return frame
