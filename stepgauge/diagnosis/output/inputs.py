"""What a diagnosis was made from, in JSON types: the files with their checksums, and what was measured."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.diagnosis.wording.aliases import even_steps_mm
from stepgauge.files.checksum import file_sha256
from stepgauge.recording import Recording
from stepgauge.recording.simulated import is_simulated


@dataclass(frozen=True)
class Inputs:
    """Input of a diagnosis: the recordings as read, in the order in which they were joined."""

    recordings: tuple[Recording, ...]

    def where(self, row: int) -> tuple[str, int]:
        """The recording and the row in it (from 1) of a row of all of them together (from 1)."""
        for recording in self.recordings:
            if row <= len(recording):
                return Path(recording.path).name, row
            row -= len(recording)
        raise IndexError(row)


def measured_json(diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    """What was measured, in JSON types: counts of probings and faces, the length in mm, and each placement."""
    data = diagnosis.data
    frame = data.frame
    placements = [frame[data.placement == i] for i in range(int(data.placement.max()) + 1)]
    return {
        "probings": len(data),
        "faces": len(np.unique(data.face)),
        "length_mm": float(np.ptp(data.probings.certified_mm())),
        "duration_s": float(np.ptp(data.probings.time_s)) if data.has_time else None,
        "placements": [
            {
                "placement": int(rows["placement"].iloc[0]),
                "axis": [float(v) for v in data.probings.setting.axis[int(rows["placement"].iloc[0])]],
                "probings": len(rows),
                "first_block": (int(rows["face"].min()) + 1) // 2,
                "last_block": (int(rows["face"].max()) + 1) // 2,
                "cycles": int(rows["cycle"].nunique()),
            }
            for rows in placements
        ],
        "speeds_mm_s": sorted({float(s) for s in frame["speed_mm_s"].round(6)}) if "speed_mm_s" in frame else [],
        "gauge_temperature_recorded": "gauge_temperature_C" in frame,
        "time_recorded": data.has_time,
        "even_steps_mm": even_steps_mm(data),
        "copied_cycles": [{"placement": placement, "cycle": cycle} for placement, cycle in data.copied],
    }


def inputs_json(diagnosis: GaugeDiagnosis, inputs: Inputs) -> dict[str, Any]:
    """The files that a diagnosis was made from with their SHA-256, in JSON types."""
    gauge, machine = diagnosis.data.gauge, diagnosis.data.machine
    faces = Path(gauge.path).parent / gauge.table.faces
    return {
        "recordings": [_file(recording.path) for recording in inputs.recordings],
        "simulated": any(is_simulated(recording.comments) for recording in inputs.recordings),
        "gauge": {
            **_file(gauge.path),
            "faces_sha256": file_sha256(faces),
            "name": gauge.table.name,
            "serial": gauge.table.serial,
            "certificate": gauge.certificate.number,
            "example": gauge.certificate.example,
        },
        "machine": {
            **_file(machine.path),
            "name": machine.table.name,
            "kind": machine.table.kind,
            "tip_radius_mm": machine.probe.tip_radius_mm,
            "effects": [effect.get("kind") for effect in machine.effects],
        },
    }


def _file(path: str | Path) -> dict[str, Any]:
    return {"path": str(path), "sha256": file_sha256(path)}
