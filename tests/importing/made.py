"""Recordings made up by the tests, and the program that would have given them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.logs import import_log
from stepgauge.importing.result import Imported
from stepgauge.importing.tables.read import TableLayout
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from stepgauge.recording import Recording
from tests.build import make_gauge, make_pose

RADIUS_MM = 1.5
ORIGIN_MM = (120.0, -40.0, 80.0)


@dataclass(frozen=True)
class Case:
    """A gauge, where it lies, and a recording of it: faces in block order, front then back, cycle by cycle."""

    gauge: Gauge
    placement: Placement
    recording: Recording

    def imported(self, path: Path, source: str, program: Program | None = None, **options: object) -> Imported:
        choice = ImportOptions(**options)  # type: ignore[arg-type]
        return import_log(path, source, self.gauge, self.placement, program, choice)

    def stated(self, path: Path, source: str, layout: TableLayout | None = None) -> Imported:
        """Imported without a placement: the file states the faces."""
        return import_log(path, source, self.gauge, None, None, None, layout)

    def program(self, dialect: str = "dmis") -> Program:
        cycles = int(self.recording.frame["cycle"].max())
        options = PlanOptions(1, self.gauge.n_blocks, cycles=cycles)
        settings = ProbingSettings(standoff_mm=1.0, tip_radius_mm=RADIUS_MM)
        text = render(make_program(self.placement, self.gauge, options, settings), DIALECTS[dialect])
        return DIALECTS[dialect].read(text, "program.txt", settings)

    def changed(self, **columns: object) -> Case:
        return replace(self, recording=replace(self.recording, frame=self.recording.frame.assign(**columns)))


def make_case(
    gauge: Gauge | None = None,
    yaw: float = 0.4,
    pitch: float = 0.05,
    cycles: int = 3,
    seed: int = 1,
    comments: dict[str, str] | None = None,
) -> Case:
    """Tip centres one radius before every certified face, less a pre-travel and some scatter, by numpy alone."""
    gauge = gauge or make_gauge(4)
    pose = make_pose(yaw, pitch, 0.02, ORIGIN_MM)
    face = np.tile(np.arange(1, gauge.n_faces + 1), cycles)
    sign = np.where(face % 2 == 1, 1.0, -1.0)
    random = np.random.default_rng(seed)
    along = gauge.position_mm[face - 1] - sign * (RADIUS_MM - 0.003) + 1e-3 * random.normal(size=len(face))
    position = pose.place(np.c_[along, np.zeros((len(face), 2))])
    frame = pd.DataFrame({"placement": 1, "cycle": np.repeat(np.arange(1, cycles + 1), gauge.n_faces), "face": face})
    frame[["x_mm", "y_mm", "z_mm"]] = position.round(7)
    frame[["approach_i", "approach_j", "approach_k"]] = (sign[:, None] * pose.rotation[0]).round(10)
    frame["time_s"] = (2.5 + 3.25 * np.arange(len(face))).round(4)
    frame["gauge_temperature_C"] = 20.4
    stated = {"tip_radius_mm": f"{RADIUS_MM:g}"} if comments is None else comments
    return Case(gauge, pose.placement(gauge), Recording(frame, stated, "recording.csv"))


def table_of(
    case: Case,
    columns: dict[str, str],
    delimiter: str = ";",
    decimal: str = ",",
    digits: int = 6,
    above: Sequence[str] = (),
) -> str:
    """A table as a person would hand it over: headers by the name of the recording's column."""
    rows = [delimiter.join(columns.values())]
    for _, row in case.recording.frame.iterrows():
        rows.append(delimiter.join(f"{row[name]:.{digits}f}".replace(".", decimal) for name in columns))
    return "\n".join([*above, *rows]) + "\n"
