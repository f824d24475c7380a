"""The files of a diagnosis: ``diagnosis.json``, ``diagnosis.md``, the machine file, the figures.

Every parameter in the JSON is an object with ``value``; numbers also have ``u`` (standard uncertainty, null if the
data give none) and ``unit``, choices (axis, plane, face, direction, ...) have ``value`` only.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.diagnosis.output.machine_text import effect_table, machine_text
from stepgauge.diagnosis.output.probe_file import probe_file
from stepgauge.diagnosis.output.rows import ROWS_FILE, row_table, rows_csv
from stepgauge.diagnosis.result import (
    DRAWN_FILE,
    FILE,
    OUTLIERS,
    ComputedDiagnosis,
    Finding,
    GaugeDiagnosis,
    Located,
    StatedDiagnosis,
    rms,
)
from stepgauge.diagnosis.wording.aliases import aliases_of, bounded, even_steps_mm
from stepgauge.diagnosis.wording.findings import GAUGE, Subject, meaning
from stepgauge.diagnosis.wording.phrases import worded, worded_all
from stepgauge.files.arrays import Rows, write_arrays
from stepgauge.files.checksum import file_sha256
from stepgauge.files.json_types import json_types
from stepgauge.files.text import format_of, write_json, write_sealed
from stepgauge.machine.file import Machine
from stepgauge.recording.columns import CORRECTED
from stepgauge.recording.simulated import is_simulated
from stepgauge.standards.budget_given import stated_machine
from stepgauge.standards.mpe import Mpe

FORMAT = format_of("diagnosis")
MACHINE_FILE = "machine.diagnosed.toml"
HEADLINE_FOLDS = ("cycles", "faces")
"""Groups of which the first in the recording is used for ``holdout_rms_*``. The prediction of a face that is held out
does not know its error against the certificate, which adds the uncertainty of the certificate to the noise."""


def write_diagnosis(folder: str | Path, diagnosis: ComputedDiagnosis, suffix: str = "png") -> list[Path]:
    """Write a diagnosis into a folder (made if missing); returns the paths written, the JSON first.

    ``diagnosis.json``, ``diagnosis.md``, ``residuals.csv``, what else stands beside it, and the figures (``suffix``:
    png, svg or pdf). Nothing is written before all is computed; every file appears only when complete.
    """
    from stepgauge.figures.style import save_figure
    from stepgauge.reports.diagnosis import diagnosis_story
    from stepgauge.reports.render import markdown

    target = Path(folder)
    said, texts = diagnosis.outputs(target)
    kept = diagnosis.drawn()
    figures = diagnosis.figures() if kept is None else kept.figures()
    drawn = {f"{name}.{suffix}": figure for name, figure in figures.items()}
    texts = {"diagnosis.md": markdown(diagnosis_story(said, dict.fromkeys(drawn, ""))), **texts}
    write_json(target / FILE, said)
    for name, text in texts.items():
        write_sealed(target / name, text)
    for name, figure in drawn.items():
        save_figure(figure, target / name, bool(said["inputs"]["simulated"]))
    if kept is not None:
        write_arrays(target / DRAWN_FILE, kept)
    return [target / name for name in (FILE, *texts, *drawn, *([] if kept is None else [DRAWN_FILE]))]


def gauge_outputs(diagnosis: GaugeDiagnosis, folder: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """See :meth:`.ComputedDiagnosis.outputs`: the machine file, the probe file of a tripod, placements of runs."""
    machine, remarks = machine_text(diagnosis, folder)
    said = diagnosis_to_dict(diagnosis, folder)
    probe, more = probe_file(diagnosis)
    said["remarks"] += remarks + more
    rows = rows_csv(row_table(diagnosis))
    return said, {ROWS_FILE: rows, MACHINE_FILE: machine, **probe, **diagnosis.placements}


def diagnosis_to_dict(diagnosis: GaugeDiagnosis, folder: str | Path = ".") -> dict[str, Any]:
    """A diagnosis as JSON types; undefined numbers are None.

    ``folder`` is that of the proposed placements, for the commands that name them.
    """
    said = statements_to_dict(diagnosis, folder)
    return {**said, "inputs": json_types(_inputs(diagnosis))}


def statements_to_dict(diagnosis: GaugeDiagnosis, folder: str | Path = ".") -> dict[str, Any]:
    """The same without the files that it was made from; parameters as :func:`diagnosis_to_dict`."""

    def renamed(text: str) -> str:
        for stem in (name.removesuffix(".toml") for name in diagnosis.placements):
            text = text.replace(f" {stem}.", f" {(Path(folder) / stem).as_posix()}.")
        return text

    at = replace(GAUGE, corrected=_is_corrected(diagnosis))
    said = {
        **common_json(diagnosis, lambda one: _details(one, diagnosis), renamed, at),
        "fit": _fit(diagnosis),
        "noise": _noise(diagnosis),
        "measured": _measured(diagnosis),
        "remarks": worded_all(one for one in diagnosis.remarks if not _pretravel([one])),
        "further": {"separate_by": renamed(diagnosis.further), "commands": commands_in(renamed(diagnosis.further))},
        "may_remain": [asdict(one) for one in diagnosis.may_remain],
    }
    return json_types(said)


Details = Callable[[Finding | Located], Mapping[str, Any]]
"""How large what a finding or a form moves is, in the units of the diagnosis, and whatever else is known of it."""
Renamed = Callable[[str], str]
"""From the text of a proposal to that with the folder of the files that it names."""


def common_json(diagnosis: StatedDiagnosis, details: Details, renamed: Renamed, at: Subject = GAUGE) -> dict[str, Any]:
    """What the diagnosis of a gauge and of a probe's map have in common: statements, search and predictive check."""
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "verdict": diagnosis.verdict,
        "effects": [_finding(one, details, renamed, at) for one in diagnosis.findings],
        "located": [_located(one, one in diagnosis.unexplained, details, renamed) for one in diagnosis.located],
        "unexplained": [_located(one, True, details, renamed) for one in diagnosis.unexplained],
        "trail": [
            {"action": step.action, "effect": step.label, "log10_odds": step.gain / math.log(10.0)}
            for step in diagnosis.trail
        ],
        "probabilities": diagnosis.probabilities,
        "checks": [{**asdict(one), "words": worded(one.phrase)} for one in diagnosis.checks],
    }


def _finding(finding: Finding, details: Details, renamed: Renamed, at: Subject) -> dict[str, Any]:
    how = renamed(finding.separate_by)
    said = {
        "kind": finding.kind,
        "label": finding.label,
        "parameters": _parameters(finding),
        "probability": float(np.clip(finding.probability, 0.0, 1.0)),
        "own_probability": float(np.clip(finding.own, 0.0, 1.0)),
        "confounded_with": list(finding.confounded_with),
        "alternatives": list(finding.alternatives),
        "set": [_member(one, details, at) for one in finding.members],
        "several": [
            {"labels": list(one.laws), "others": list(one.others), "odds": one.odds} for one in finding.several
        ],
        "where": finding.where,
        "reason": finding.reason,
        "widened_by": list(finding.widened_by),
        "separate_by": how,
        "expected_information_nats": finding.separation_nats,
        "commands": commands_in(how),
        **details(finding),
    }
    said["parameters"] = bounded(said["parameters"], said.get("aliases", {}))
    return {**said, "meaning": meaning(said, at)}


def _member(member: Finding, details: Details, at: Subject) -> dict[str, Any]:
    """One law of a set with its own values and its meaning."""
    said = {
        "kind": member.kind,
        "label": member.label,
        "conditional_probability": member.probability,
        "parameters": _parameters(member),
        **details(member),
    }
    said["parameters"] = bounded(said["parameters"], said.get("aliases", {}))
    return {**said, "meaning": meaning(said, at)}


def _details(one: Finding | Located, diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    if isinstance(one, Located):
        return {"rms_um": rms(one.share_um)} if len(one.share_um) else {}
    rows = json_types(one.choices["rows"]) if one.kind == OUTLIERS else []
    return {
        "aliases": aliases_of(one, diagnosis.data),
        "rms_um": rms(one.share_um),
        "largest_um": float(np.abs(one.share_um).max(initial=0.0)),
        "seen_um": float(np.abs(diagnosis.data.without_origins(one.share_um)).max()) if one.share_um.any() else 0.0,
        **({"rows": [_outlier(row, diagnosis) for row in rows]} if rows else {}),
    }


def commands_in(text: str) -> list[str]:
    """The commands that plan the measurements of a proposal."""
    return re.findall(r"stepgauge plan .+? -o .*?separate-\d+\.\w+|stepgauge probe map .+", text)


def _outlier(row: int, diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    name, inside = diagnosis.row_in_file(row)
    frame = diagnosis.data.frame.iloc[row - 1]
    return {
        "recording": name,
        "row": inside,
        "cycle": int(frame["cycle"]),
        "face": int(frame["face"]),
        "off_um": float(diagnosis.after_um[row - 1]),
    }


def _parameters(finding: Finding) -> dict[str, dict[str, Any]]:
    """Choices first, then numbers; other parameters of the law (a fixed length) without uncertainty."""
    said: dict[str, dict[str, Any]] = {name: {"value": json_types(value)} for name, value in finding.choices.items()}
    for name, estimate in finding.parameters.items():
        if name not in said:
            unit = finding.effect.unit_of(name) if finding.effect is not None else ""
            said[name] = {"value": estimate.value, "u": estimate.u, "unit": unit or estimate.unit}
    if finding.effect is not None:
        for name, value in effect_table(finding.effect).items():
            if name not in ("kind", "when") and name not in said:  # a condition is in "where"
                said[name] = {"value": value, "u": None, "unit": finding.effect.unit_of(name)}
    return said


def _located(one: Located, left: bool, details: Details, renamed: Renamed) -> dict[str, Any]:
    """A form; ``left``: it remains beside the named effects; else it describes the residuals before these."""
    separate_by = renamed(one.separate_by)
    nats = {"expected_information_nats": one.separation_nats}
    proposal = {"separate_by": separate_by, **nats, "commands": commands_in(separate_by)}
    return {
        "covariate": one.covariate,
        "side": one.side,
        "where": one.where,
        "phrases": [] if isinstance(one.phrases, str) else list(one.phrases),
        "share": one.share,
        "probability" if left else "probability_if_alone": one.probability,
        "form": one.form,
        **({"beside": one.beside} if one.beside else {}),
        **details(one),
        **({"laws": [{"labels": list(law.laws), "odds": law.odds} for law in one.laws]} if left else {}),
        **(proposal if separate_by else {}),
    }


def _fit(diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    fit = diagnosis.fit
    names = [name for name in HEADLINE_FOLDS if name in fit.holdout]
    before, after = fit.holdout[names[0]] if names else (math.nan, math.nan)
    said: dict[str, Any] = {
        "noise_um": diagnosis.noise.sigma_um,
        "rms_before_um": fit.rms_before_um,
        "rms_after_um": fit.rms_after_um,
        "holdout_rms_before_um": before,
        "holdout_rms_after_um": after,
        "chi2_dof_after": fit.chi2_dof_after,
        "chi2_dof_before": fit.chi2_dof_before,
        "holdout": {
            by: {"rms_before_um": before, "rms_after_um": after} for by, (before, after) in fit.holdout.items()
        },
    }
    if diagnosis.forms:
        said["rest_rms_um"] = diagnosis.rest_rms_um
    return said


def _noise(diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    noise = diagnosis.noise
    u = noise.sigma_um / math.sqrt(2.0 * noise.dof) if noise.dof > 0 else math.nan
    return {
        "sigma_um": noise.sigma_um,
        "u_um": u,
        "dof": noise.dof,
        "from_repeats": noise.repeats,
        "least": noise.least,
        "machine_file_um": diagnosis.data.machine.table.repeatability_um,
    }


def _pretravel(remarks: Iterable[Mapping[str, Any] | str], number: str = "um") -> list[float]:
    """The pre-travel that fits, um, where the machine file states none, or its standard uncertainty."""
    return [
        one[number]["value"]
        for one in remarks
        if not isinstance(one, str) and one["say"] == "pretravel" and number in one
    ]


def _measured(diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    """What was measured, in JSON types: counts of probings and faces, the length in mm, and each placement."""
    data = diagnosis.data
    frame = data.frame
    placements = [frame[data.placement == i] for i in range(int(data.placement.max()) + 1)]
    return {
        "probings": len(data),
        "faces": len(np.unique(data.face)),
        "length_mm": _length_mm(diagnosis),
        "duration_s": float(np.ptp(data.probings.time_s)) if data.has_time else None,
        "pretravel_um": next(iter(_pretravel(diagnosis.remarks)), None),
        "pretravel_u_um": next(iter(_pretravel(diagnosis.remarks, "u")), None),
        "placements": [
            {
                "placement": int(rows["placement"].iloc[0]),
                "recording": _only_recording(diagnosis, rows.index.to_numpy()),
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


def _length_mm(diagnosis: GaugeDiagnosis) -> float:
    """The longest length of the gauge that was measured."""
    return float(np.ptp(diagnosis.data.probings.certified_mm()))


def _only_recording(diagnosis: GaugeDiagnosis, rows: Rows) -> str:
    """The name of the recording that has these rows, empty where several have."""
    names = {diagnosis.row_in_file(int(row) + 1)[0] for row in diagnosis.data.row[rows]}
    return names.pop() if len(names) == 1 else ""


def _inputs(diagnosis: GaugeDiagnosis) -> dict[str, Any]:
    """The files that a diagnosis was made from with their SHA-256, in JSON types."""
    gauge, machine = diagnosis.data.gauge, diagnosis.data.machine
    faces, length_mm = Path(gauge.path).parent / gauge.table.faces, _length_mm(diagnosis)
    return {
        "recordings": [_file(recording.path) for recording in diagnosis.recordings],
        "tip_corrected": _is_corrected(diagnosis),
        "simulated": any(is_simulated(recording.comments) for recording in diagnosis.recordings),
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
            "stated_sha256": stated_digest(machine),
            "name": machine.table.name,
            "kind": machine.table.kind,
            "mpe_um": None if (limit := machine.table.mpe) is None else float(Mpe.parse(limit).at_um(length_mm)),
            "tip_radius_mm": machine.probe.tip_radius_mm,
            "pretravel_um": _stated_pretravel_um(machine),
            "effects": [effect.get("kind") for effect in machine.effects],
        },
    }


def _is_corrected(diagnosis: GaugeDiagnosis) -> bool:
    """Whether the machine had corrected the readings for its tip."""
    return any(CORRECTED in one.comments for one in diagnosis.recordings)


def _stated_pretravel_um(machine: Machine) -> float | None:
    """The mean pre-travel that somebody stated; a default is nobody's word."""
    probe = machine.probe
    return getattr(probe, "pretravel_um", None) if probe.model == "constant" and probe.states_radius else None


def stated_digest(machine: Machine) -> str:
    """SHA-256 of what a machine file states that a diagnosis depends on: without limit and uncertainties."""
    stated = stated_machine(machine)
    used = {key: stated[key] for key in ("machine", "probe", "effect")}
    return sha256(json.dumps([used, stated["uncertainty"]["resolution_um"]], sort_keys=True).encode()).hexdigest()


def _file(path: str | Path) -> dict[str, Any]:
    return {"path": str(path), "sha256": file_sha256(path)}
