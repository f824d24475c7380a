"""Recordings of an axis, a spot or distances to a diagnosis in a folder, without gauge and machine files."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from stepgauge.axis.recording import AxisRecording, join_axis_recordings, places_of
from stepgauge.axis.sensors import SENSORS, not_candidates
from stepgauge.diagnosis.axis.residuals import AxisData, axis_data
from stepgauge.diagnosis.axis.told import Teller
from stepgauge.diagnosis.axis.words import About, aliases_of, kind_name, limits, meaning, uneven_targets
from stepgauge.diagnosis.engine import diagnose_residuals
from stepgauge.diagnosis.output.aliases import even
from stepgauge.diagnosis.output.files import Inputs, checksum, diagnosis_to_dict, without_nan
from stepgauge.diagnosis.output.rows import ROWS_FILE, row_table, rows_csv
from stepgauge.diagnosis.output.summary import axis_line, numbers_of
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.files.outputs import open_set
from stepgauge.files.shown import Shown, as_lines
from stepgauge.files.text import write_json, write_text
from stepgauge.recording.simulated import is_simulated

UNUSED = ("empirical", "inputs")
"""Parts of the JSON that are of a gauge on a machine, and are told otherwise here."""


@dataclass(frozen=True)
class AxisDiagnosis(Shown):
    """The diagnosis of an axis, a spot or distances, with its data.

    ``said``: what is said of it, JSON types in the user's units; ``recordings``: as they were read.
    """

    drawn_by: ClassVar[str] = "axis.draw_residuals"
    found: Diagnosis
    data: AxisData
    said: dict[str, Any] = field(repr=False)
    recordings: tuple[AxisRecording, ...] = ()

    @property
    def verdict(self) -> str:
        """``adequate``, ``effects``, ``unknown`` or ``insufficient``."""
        return self.found.verdict

    def summary(self) -> str:
        """Verdict, effects and fit in a line, in the user's unit."""
        return as_lines(axis_line(self.said))

    def to_frame(self) -> pd.DataFrame:
        """One row per number of an effect: its probability, value, standard uncertainty u, and the user's unit."""
        return numbers_of(self.said)

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
    return AxisDiagnosis(found, data, _said(found, data), (recording,))


def diagnose_axes(
    recordings: Sequence[AxisRecording], without: Collection[str] = (), priors: Priors | None = None
) -> AxisDiagnosis:
    """Recordings of one axis together, as its settings up."""
    whole = recordings[0] if len(recordings) == 1 else join_axis_recordings(recordings)
    return replace(diagnose_axis(whole, without, priors), recordings=tuple(recordings))


def write_axis_diagnosis(output: str | Path, told: AxisDiagnosis, suffix: str = "png") -> list[Path]:
    """Write ``diagnosis.json``, ``diagnosis.md`` and the figure into a folder (made if missing)."""
    from stepgauge.figures.axis import axis_figure
    from stepgauge.figures.style import save_figure
    from stepgauge.reports.axis_diagnosis import axis_story
    from stepgauge.reports.render import markdown

    target, figure = Path(output), f"residuals.{suffix}"
    files = [{"path": str(one.path), "sha256": checksum(one.path)} for one in told.recordings]
    simulated = any(is_simulated(one.comments) for one in told.recordings)
    said = {**told.said, "inputs": {"recordings": files, "simulated": simulated}}
    write_json(target / "diagnosis.json", said)
    names = [(Path(one.path).name, len(one)) for one in told.recordings]
    write_text(target / ROWS_FILE, rows_csv(_rows(told, names)))
    write_text(target / "diagnosis.md", markdown(axis_story(said, [figure])))
    save_figure(axis_figure(told.found, told.data), target / figure, simulated)
    return [target / name for name in ("diagnosis.json", "diagnosis.md", ROWS_FILE, figure)]


def _rows(told: AxisDiagnosis, names: Sequence[tuple[str, int]]) -> pd.DataFrame:
    """Every reading with its residual, in the user's units and with the sign of a reading."""
    recording, data = told.data.recording, told.data
    frame, units = recording.frame, recording.units
    places = frame["target" if "target" in frame else "reading"].to_numpy(float)
    factor = frame["way"].to_numpy(float) / data.scaling.deviation / units.base_deviation
    return row_table(told.found, (), names, (units.position, places), (units.deviation, factor))


def _said(found: Diagnosis, data: AxisData) -> dict[str, Any]:
    recording = data.recording
    units, form = recording.units, recording.form
    raw = diagnosis_to_dict(found, Inputs((_Rows(recording),)))  # type: ignore[arg-type]
    teller = Teller(units, data.scaling, recording.both_ways, form)
    said = teller.told({key: value for key, value in raw.items() if key not in UNUSED})
    about = _about(recording)
    for effect in said["effects"]:
        effect["in_practice"] = meaning(effect["kind"], effect["parameters"], about)
        effect["name"] = kind_name(effect["kind"], form)
        effect["separate_by"], effect["commands"], effect["reason"] = "", [], ""
        effect["aliases"] = aliases_of(effect["parameters"], about)
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
    said["unexplained"].sort(key=lambda one: -one["probability"])
    said["measured"] = {name: said["measured"][name] for name in ("duration_s", "time_recorded")}
    said["noise"].pop(f"machine_file_{units.deviation}")
    said["fit"]["holdout"] = {"targets" if by == "faces" else by: one for by, one in said["fit"]["holdout"].items()}
    said["axis"] = {**_axis(recording), "repeatability": data.repeatability / units.base_deviation}
    said["axis"]["even_step"] = about.even.spacing if about.even else None
    said["limits"] = [*limits(said, about), *said.pop("remarks")]
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
