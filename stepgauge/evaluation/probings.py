"""The error of every single probing, beside the means that an evaluation states."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stepgauge.conditions.readings import project_readings
from stepgauge.evaluation.evaluate import Evaluation, PlacementResult
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.columns import TEMPERATURES

if TYPE_CHECKING:
    import pandas as pd


def probing_errors(recording: Recording, evaluation: Evaluation) -> list[pd.DataFrame]:
    """One table per placement, one row per probing of the used section, in the order of the recording.

    Columns: ``placement``, ``cycle``, ``face``, ``front``, ``nominal_mm``, ``x_mm``, ``y_mm``, ``z_mm``; ``used``:
    false for what the evaluation left out; ``error_um``: error as XF or XB; ``residual_um``: the same from the mean of
    its face, along the gauge axis; ``time_s`` and temperatures where they were recorded.
    """
    several = len(evaluation.results) > 1
    return [
        _placement_table(recording.select_placement(result.placement) if several else recording, evaluation, result)
        for result in evaluation.results
    ]


def _placement_table(recording: Recording, evaluation: Evaluation, result: PlacementResult) -> pd.DataFrame:
    readings = project_readings(recording, evaluation.gauge, evaluation.blocks, result.axis, leave_out=False)
    frame = recording.frame.reset_index(drop=True)
    table = frame[["placement", "cycle", "face", *POSITION]].assign(
        front=readings.face % 2 == 1,
        used=~np.isin(np.arange(len(frame)), [one.row for one in readings.left_out]),
        off_um=readings.off_mm * 1e3,
        nominal_mm=evaluation.gauge.nominal_mm[readings.face - 1],
    )
    for name in ("time_s", *TEMPERATURES):
        if name in frame:
            table[name] = frame[name]
    table = table[np.isin(readings.face, readings.faces)].reset_index(drop=True)
    used = table["off_um"].where(table["used"])
    residual = table["off_um"] - used.groupby(table["face"]).transform("mean")
    own = np.where(result.face % 2 == 1, result.xf_um, result.xb_um)
    mean = own[np.searchsorted(result.face, table["face"].to_numpy())]
    return table.assign(residual_um=residual, error_um=mean + residual).drop(columns="off_um")
