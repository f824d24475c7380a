"""``residuals.csv``: every reading of a diagnosis with its residual before and after, and what each finding does to it.

A page in which a finding is clicked is made from this table, long after the diagnosis.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.text import read_text

ROWS_FILE = "residuals.csv"
FINDING, FORM = "finding", "form"


def row_table(
    diagnosis: GaugeDiagnosis,
    position: tuple[str, Array] | None = None,
    deviation: tuple[str, Array | float] = ("um", 1.0),
) -> pd.DataFrame:
    """A table with one row per reading, in the order of the recordings.

    Columns: ``recording`` and ``row`` in it, ``placement``, ``cycle``, ``face``, ``position_mm`` along the gauge,
    ``time_s`` where it was recorded, ``used`` (0: left out as an outlier), ``before_um`` and ``after_um`` (residuals
    without and with all findings and forms), and ``finding_1_um`` .. and ``form_1_um`` ..: what each finding and each
    form (its posterior mean) adds to a reading, without what only moves the origins.

    Parameters
    ----------
    position, deviation : unit and values, and unit and factor of what is told, where these are not mm along the gauge
        and um along the approach
    """
    data = diagnosis.data
    where, along = position or ("mm", np.asarray(data.probings.certified_mm(), float))
    unit, factor = deviation
    frame = pd.DataFrame(
        {
            "recording": np.concatenate([[name] * count for name, count in diagnosis.files])[data.row],
            "row": np.concatenate([np.arange(1, count + 1) for _, count in diagnosis.files])[data.row],
            "placement": data.frame["placement"].to_numpy(),
            "cycle": data.frame["cycle"].to_numpy(),
            "face": data.face,
            f"position_{where}": along,
        }
    )
    if data.has_time:
        frame["time_s"] = data.frame["time_s"].to_numpy(float)
    frame["used"] = np.isfinite(diagnosis.noise.by_row_um).astype(int)
    frame[f"before_{unit}"] = diagnosis.before_um * factor
    frame[f"after_{unit}"] = diagnosis.rest_um * factor
    findings, forms = ([one.share_um for one in each] for each in (diagnosis.findings, diagnosis.forms))
    for kind, each in ((FINDING, findings), (FORM, forms)):
        for number, share_um in enumerate(each, 1):
            frame[f"{kind}_{number}_{unit}"] = data.without_origins(share_um) * factor
    return frame


def rows_csv(table: pd.DataFrame) -> str:
    """The table as text, to seven significant digits: no residual says more."""
    return table.to_csv(index=False, lineterminator="\n", float_format="%.7g")


def read_rows(folder: str | Path) -> pd.DataFrame:
    """``residuals.csv`` of a diagnosis; :class:`InputError` where it is missing or none."""
    import io

    path = Path(folder) / ROWS_FILE
    text = read_text(path)
    try:
        table = pd.read_csv(io.StringIO(text), dtype={"recording": str}, keep_default_na=False)
    except (ValueError, pd.errors.ParserError) as error:
        raise InputError(path, f"not a table of residuals: {error}") from None
    needed = {"recording", "row", "placement", "cycle", "face", "used"}
    numbers = [name for name in table.columns if name != "recording"]
    kinds_known = all(pd.api.types.is_numeric_dtype(table[name]) for name in numbers)
    if not needed <= set(table.columns) or not kinds_known or unit_of(table) is None or table.empty:
        expected = "the file that stepgauge diagnose wrote beside diagnosis.json"
        raise InputError(
            path, "not a table of residuals", found=", ".join(map(str, table.columns))[:80], expected=expected
        )
    return table


def unit_of(table: pd.DataFrame) -> str | None:
    """The unit of the residuals, from the names of their columns; None where there are none."""
    units = [str(name).removeprefix("before_") for name in table.columns if str(name).startswith("before_")]
    return units[0] if units and f"after_{units[0]}" in table.columns else None
