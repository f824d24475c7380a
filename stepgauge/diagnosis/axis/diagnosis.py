"""Recordings of an axis, a spot or distances to a diagnosis in a folder, without gauge and machine files."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from stepgauge.axis.recording import AxisRecording, join_axis_recordings, places_of
from stepgauge.axis.sensors import SENSORS, not_candidates
from stepgauge.diagnosis.axis.residuals import AxisData, axis_data
from stepgauge.diagnosis.axis.reversal import is_reversal, words_of_reversal
from stepgauge.diagnosis.axis.told import OPPOSITE, AxisWording
from stepgauge.diagnosis.engine import diagnose_residuals
from stepgauge.diagnosis.output.files import diagnosis_to_dict, without_nan
from stepgauge.diagnosis.output.inputs import Inputs
from stepgauge.diagnosis.output.rows import ROWS_FILE, row_table, rows_csv
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.result import Diagnosis, GaugeDiagnosis
from stepgauge.diagnosis.wording.aliases import even
from stepgauge.diagnosis.wording.axis import About, axis_aliases, axis_limits, kind_name, meaning, uneven_targets
from stepgauge.files.checksum import file_sha256
from stepgauge.files.outputs import open_set
from stepgauge.files.text import write_json, write_text
from stepgauge.recording.simulated import is_simulated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNUSED = ("empirical", "inputs")
"""Parts of the JSON that are of a gauge on a machine, and are told otherwise here."""


@dataclass(frozen=True, repr=False)
class AxisDiagnosis(Diagnosis):
    """The diagnosis of an axis, a spot or distances: as it was computed, with its data, and in the user's units.

    ``recordings``: as they were read.
    """

    drawn_by: ClassVar[str] = "axis.draw_residuals"
    verdict: str
    found: GaugeDiagnosis
    data: AxisData
    recordings: tuple[AxisRecording, ...] = ()
    path: str = ""

    @cached_property
    def said(self) -> dict[str, Any]:
        """All that is stated, in JSON types and the user's units."""
        files = [{"path": str(one.path), "sha256": file_sha256(one.path)} for one in self.recordings]
        simulated = any(is_simulated(one.comments) for one in self.recordings)
        return {**_said(self.found, self.data), "inputs": {"recordings": files, "simulated": simulated}}

    def figures(self) -> dict[str, Figure]:
        """Deviations before and after."""
        from stepgauge.figures.axis import axis_figure

        return {"residuals": axis_figure(self.found, self.data)}

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``diagnosis.json``, ``diagnosis.md`` and the figure; returns the paths."""
        with open_set():
            return write_axis_diagnosis(folder, self, figure)


def diagnose_axis(
    recording: AxisRecording, without: Collection[str] = (), priors: Priors | None = None
) -> AxisDiagnosis:
    """What is behind the deviations of an axis; parameters as :func:`stepgauge.diagnosis.engine.diagnose`.

    Only effects that the sensor and the form of the recording can have are candidates.
    """
    data = axis_data(recording)
    absent = {*not_candidates(recording.sensor, recording.form, recording.units.axis == "rotary"), *without}
    found = diagnose_residuals(data.residuals, absent, priors)
    return AxisDiagnosis(found.verdict, found, data, (recording,))


def diagnose_axes(
    recordings: Sequence[AxisRecording], without: Collection[str] = (), priors: Priors | None = None
) -> AxisDiagnosis:
    """Recordings of one axis together, as its settings up."""
    whole = recordings[0] if len(recordings) == 1 else join_axis_recordings(recordings)
    return replace(diagnose_axis(whole, without, priors), recordings=tuple(recordings))


def write_axis_diagnosis(output: str | Path, told: AxisDiagnosis, suffix: str = "png") -> list[Path]:
    """Write ``diagnosis.json``, ``diagnosis.md`` and the figure into a folder (made if missing)."""
    from stepgauge.figures.style import save_figure
    from stepgauge.reports.axis_diagnosis import axis_story
    from stepgauge.reports.render import markdown

    target, figure = Path(output), f"residuals.{suffix}"
    said = told.said
    write_json(target / "diagnosis.json", said)
    names = [(Path(one.path).name, len(one)) for one in told.recordings]
    write_text(target / ROWS_FILE, rows_csv(_rows(told, names)))
    write_text(target / "diagnosis.md", markdown(axis_story(said, [figure])))
    save_figure(told.figures()["residuals"], target / figure, bool(said["inputs"]["simulated"]))
    return [target / name for name in ("diagnosis.json", "diagnosis.md", ROWS_FILE, figure)]


def _rows(told: AxisDiagnosis, names: Sequence[tuple[str, int]]) -> pd.DataFrame:
    """Every reading with its residual, in the user's units and with the sign of a reading."""
    recording, data = told.data.recording, told.data
    frame, units = recording.frame, recording.units
    places = frame["target" if "target" in frame else "reading"].to_numpy(float)
    factor = frame["way"].to_numpy(float) / data.scaling.deviation / units.base_deviation
    return row_table(told.found, (), names, (units.position, places), (units.deviation, factor))


def _said(found: GaugeDiagnosis, data: AxisData) -> dict[str, Any]:
    recording = data.recording
    units, form = recording.units, recording.form
    raw = diagnosis_to_dict(found, Inputs((_Rows(recording),)))  # type: ignore[arg-type]
    teller = AxisWording(units, data.scaling, recording.both_ways, form)
    said = teller.told({key: value for key, value in raw.items() if key not in UNUSED})
    about = _about(recording)
    for effect in said["effects"]:
        effect["in_practice"] = meaning(effect["kind"], effect["parameters"], about)
        effect["name"] = kind_name(effect["kind"], form)
        effect["separate_by"], effect["commands"], effect["reason"] = "", [], ""
        effect["aliases"] = axis_aliases(effect["parameters"], about)
        if effect["aliases"] and about.even is not None:
            effect["separate_by"] = uneven_targets(about.even, about.position)
        for one in effect["set"]:
            one["in_practice"], one["name"] = (
                meaning(one["kind"], one["parameters"], about),
                kind_name(one["kind"], form),
            )
        for row in effect.get("rows", []):
            row["target"] = _target_of(recording, int(row["row"]))
            row.pop("face", None)
            row.pop("pair", None)
    for one in (*said["unexplained"], *said["located"]):
        if is_reversal(recording, one["covariate"], OPPOSITE in one["where"]):
            one["where"] = words_of_reversal(recording)
    said["unexplained"].sort(key=lambda one: -one["probability"])
    said["measured"] = {name: said["measured"][name] for name in ("duration_s", "time_recorded")}
    said["noise"].pop(f"machine_file_{units.deviation}")
    said["fit"]["holdout"] = {"targets" if by == "faces" else by: one for by, one in said["fit"]["holdout"].items()}
    said["axis"] = {**_axis(recording), "repeatability": data.repeatability / units.base_deviation}
    said["axis"]["even_step"] = about.even.spacing if about.even else None
    said["limits"] = [*axis_limits(said, about), *said.pop("remarks")]
    return dict(without_nan(said))


class _Rows:
    """A recording as the list of outliers wants it."""

    def __init__(self, recording: AxisRecording) -> None:
        self.path, self.count, self.comments = recording.path, len(recording), recording.comments

    def __len__(self) -> int:
        return self.count


def _axis(recording: AxisRecording) -> dict[str, Any]:
    """What was measured, by what, in which units."""
    units, frame = recording.units, recording.frame
    return {
        "form": recording.form,
        "sensor": recording.sensor,
        "sensor_words": SENSORS[recording.sensor].words,
        "artefact": recording.comments.get("artefact", "none"),
        "kind": units.axis,
        "unit": units.position,
        "deviation_unit": units.deviation,
        "readings": len(frame),
        "targets": len(np.unique(places_of(frame["target"].to_numpy(float)))) if "target" in frame else 0,
        "cycles": int(frame["cycle"].nunique()),
        "both_ways": recording.both_ways,
        "covariates": recording.covariates,
        "largest": float(np.abs(recording.deviation).max()) if recording.form == "axis" else None,
    }


def _about(recording: AxisRecording) -> About:
    frame, units = recording.frame, recording.units
    places = frame["target"] if "target" in frame else frame["reading"]
    minutes = float(np.ptp(frame["time_s"])) / 60.0 if "time_s" in frame else float("nan")
    span = float(np.ptp(places.to_numpy(float)))
    steps = even(places) if recording.form == "axis" else None
    unit_mm = units.base_position if units.axis == "linear" else None
    return About(span, minutes, units.position, units.deviation, recording.sensor, recording.form, steps, unit_mm)


def _target_of(recording: AxisRecording, row: int) -> str:
    frame = recording.frame.iloc[row - 1]
    if recording.form == "distances":
        return f"{frame['from_station']} to {frame['to_station']}"
    return f"{frame['target']:.12g} {recording.units.position}" if "target" in frame else "-"
