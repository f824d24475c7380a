"""The sections of a report: labels with values, and the missing statements of each."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.files.notation import clean, number, number_ranges, plural, quantity, uncertainty, vector
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, has_yaw
from stepgauge.machine.file import Machine
from stepgauge.recording.conventions import needs_gauge_temperature
from stepgauge.standards.budget_files import StoredBudget

DATE_MISSING = "date of the measurement (the recording does not say)"


@dataclass
class Section:
    """A titled list of labelled values; ``missing`` names what was not stated."""

    title: str
    rows: list[tuple[str, str | None]] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    def add(self, label: str, value: object) -> None:
        """A line of the section; None is printed as not stated."""
        self.rows.append((label, None if value is None else clean(value)))

    def to_dict(self) -> dict[str, Any]:
        """Plain containers for a template."""
        return {"title": self.title, "rows": [{"label": label, "value": value} for label, value in self.rows]}


def certificate_section(evaluation: dict[str, Any], gauge: Gauge | None) -> Section:
    """The gauge and its certificate; a gauge file adds the uncertainties."""
    stored = evaluation["gauge"]
    section = Section("Step gauge and its certificate")
    section.add("Gauge", f"{stored['name']}, serial {stored['serial']}")
    section.add("Certificate", stored["certificate"])
    section.add("Calibrated by", stored["laboratory"])
    section.add("Calibrated on", stored["date"])
    section.add("Material", stored["material"])
    section.add("Expansion", _expansion(stored["expansion_per_K"], gauge))
    section.add("Positions hold at", quantity(stored["reference_temperature_C"], 1, "°C"))
    if gauge is None:
        section.missing.append("uncertainty of the certified positions and of the expansion (gauge file)")
    else:
        k = gauge.certificate.coverage_factor
        low, high = float(gauge.u_um.min()) * k, float(gauge.u_um.max()) * k
        section.add("Uncertainty", f"U = {number(low, 2)} to {number(high, 2)} µm (k = {k:g})")
    return section


def _expansion(per_K: float, gauge: Gauge | None) -> str:
    text = f"{per_K * 1e6:.4g} × 10⁻⁶ / K"
    return text if gauge is None else f"{text} (u = {gauge.table.expansion_uncertainty_per_K * 1e6:.3g} × 10⁻⁶ / K)"


def machine_section(evaluation: dict[str, Any], machine: Machine | None) -> Section:
    """Machine and probe as the machine file has them; without it, what the recording says."""
    section = Section("Machine and probe")
    if machine is None:
        section.add("Machine", evaluation["comments"].get("machine", "not stated"))
        section.missing.append("machine and probe data (machine file)")
        return section
    table, probe = machine.table, machine.probe
    section.add("Machine", table.name)
    travel = ", ".join(f"{number(low, 0)} to {number(high, 0)}" for low, high in machine.travel_mm)
    section.add("Travel x, y, z (mm)", travel)
    section.add("Measuring speed", f"{table.measuring_speed_mm_s:g} mm/s (machine file)")
    section.add("Probe", f"{probe.name or 'touch-trigger'}, stylus {probe.shank_length_mm:g} mm")
    section.add("Tip radius, nominal", quantity(probe.tip_radius_mm, 4, "mm"))
    return section


def placement_section(result: dict[str, Any], placement: Placement | None) -> Section:
    """The placement of the gauge: the evaluated axis, and the result of locating it."""
    section = Section(f"Placement {result['placement']}")
    axis = np.asarray(result["axis"])
    section.add("Evaluated along (x, y, z)", vector(axis, 6))
    details = {} if placement is None else placement.details
    _add_orientation(section, axis if placement is None else placement.axis, details)
    if placement is None:
        section.add("First probed point", vector(result["origin_mm"], 3, "mm"))
        section.missing.append(
            f"placement {result['placement']}: block centres, angles between block normals and axis, "
            "uncertainties (placement file)"
        )
        return section
    for name, block, centre in (
        ("C1", placement.first_block, placement.c1_mm),
        ("C2", placement.last_block, placement.c2_mm),
    ):
        u = details.get("uncertainty", {}).get(f"{name.lower()}_um")
        tail = f"; u = {vector(u, 2, 'µm')}" if u else ""
        section.add(f"Centre {name}, block {block}", vector(centre, 4, "mm") + tail)
    _add_normals(section, details, result["placement"])
    return section


def _add_orientation(section: Section, axis: np.ndarray, details: dict[str, Any]) -> None:
    """Yaw about +z from +x, pitch from the xy plane towards +z."""
    u = details.get("uncertainty", {})
    yaw, pitch = np.degrees(np.arctan2(axis[1], axis[0])), np.degrees(np.arcsin(np.clip(axis[2], -1.0, 1.0)))
    stated = _append_u(quantity(float(yaw), 5, "°"), u.get("yaw_urad"))
    section.add("Yaw, +x to +y", stated if has_yaw(axis) else "undefined, the gauge stands upright")
    section.add("Pitch, towards +z", _append_u(quantity(float(pitch), 5, "°"), u.get("pitch_urad")))


def _add_normals(section: Section, details: dict[str, Any], number_of_placement: int) -> None:
    angles, u = details.get("angles", {}), details.get("uncertainty", {})
    for name in ("n1", "n2"):
        tilt = angles.get(f"{name}_to_axis_mrad")
        if tilt is None:
            section.missing.append(f"placement {number_of_placement}: angle between {name.upper()} and the axis")
        else:
            value = _append_u(quantity(float(tilt), 3, "mrad"), u.get(f"{name}_urad"))
            section.add(f"Normal {name.upper()} to axis", value)
    if not u:
        section.missing.append(f"placement {number_of_placement}: uncertainties of the located axis")


def _append_u(text: str, u_urad: float | None) -> str:
    return text if u_urad is None else f"{text} (u = {number(float(u_urad), 1)} µrad)"


def conditions_section(evaluation: dict[str, Any], machine: Machine | None) -> Section:
    """Temperatures, and the corrections for them."""
    section = Section("Temperatures")
    several = len(evaluation["placements"]) > 1
    for result in evaluation["placements"]:
        label = f"Gauge, placement {result['placement']}" if several else "Gauge temperature"
        temperature = result["gauge_temperature_C"]
        section.add(label, "not recorded" if temperature is None else f"{number(temperature, 2)} °C (mean)")
        if temperature is None and needs_gauge_temperature(evaluation["comments"]):
            where = f" of placement {result['placement']}" if several else ""
            section.missing.append(f"gauge temperature{where} (certified positions are used uncorrected)")
        _add_scales(section, result, machine, f"Scales, placement {result['placement']}" if several else None)
    section.add("Convention", evaluation["temperature_convention"])
    return section


def _add_scales(section: Section, result: dict[str, Any], machine: Machine | None, label: str | None) -> None:
    """The temperature of the scales along the gauge: as recorded, else as the machine file states it."""
    recorded_C = result.get("scale_temperature_C")
    if recorded_C is not None:
        section.add(label or "Scale temperature", f"{number(recorded_C, 2)} °C (mean, recorded)")
    elif machine is not None:
        section.add(label or "Scale temperature", f"{number(machine.table.temperature_C, 2)} °C (machine file)")
    elif (what := "temperature of the scales (machine file)") not in section.missing:
        section.missing.append(what)


def u_of_radius(result: dict[str, Any]) -> str:
    """The standard uncertainty of R_eff of a placement; a dash where nothing was read twice."""
    u_mm = result["u_r_eff_mm"]
    return quantity(None if u_mm is None else u_mm * 1e3, 2, "µm")


def radius_section(evaluation: dict[str, Any], machine: Machine | None, budget: StoredBudget | None = None) -> Section:
    """The effective radius, where it comes from and what follows from that; with U where there is a budget."""
    section = Section("Effective tip radius")
    nominal_mm = machine.probe.tip_radius_mm if machine else None
    several = len(evaluation["placements"]) > 1
    for result in evaluation["placements"]:
        tail = f", placement {result['placement']}" if several else ""
        if not result["r_eff_blocks"]:
            section.add(f"Of the correction{tail}", f"{number(result['r_eff_mm'], 5)} mm")
            continue
        line = budget.find("r_eff", result["placement"], None) if budget else None
        u = f"u = {u_of_radius(result)}"
        if line is not None:
            u = f"U = {uncertainty(line.expanded_um)} µm, k = {line.k:.2f}"
        section.add(f"R_eff{tail}", f"{number(result['r_eff_mm'], 5)} mm ({u})")
        section.add(f"From {plural('block', len(result['r_eff_blocks']))}{tail}", number_ranges(result["r_eff_blocks"]))
        if nominal_mm is not None:
            pretravel_um = (nominal_mm - result["r_eff_mm"]) * 1e3
            section.add(f"Nominal radius − R_eff{tail}", quantity(pretravel_um, 2, "µm"))
    section.add("Origin", evaluation["r_eff_meaning"])
    return section


def recording_section(evaluation: dict[str, Any], title: str = "Recording") -> Section:
    """The recording and what it says of itself."""
    section = Section(title)
    section.add("File", file_names(evaluation["recording"].split(", ")) or "not stated")
    add_comments(section, evaluation["comments"])
    return section


def file_names(paths: Iterable[str]) -> str:
    """Names without folders, which say nothing to who reads a report."""
    return ", ".join(Path(path).name for path in paths if path)


COMMENTS = {
    "gauge": "Gauge, as recorded",
    "gauge_serial": "Gauge serial number",
    "machine": "Machine, as recorded",
    "program": "Program",
    "seed": "Seed of the simulation",
    "tip_radius_mm": "Tip radius, as recorded",
    "measured": "Measured",
    "measured_at": "Measured",
    "date": "Date",
    "time": "Time",
    "log": "Log",
}
UNITS = {"_mm": "mm", "_um": "µm", "_C": "°C", "_s": "s", "_deg": "°"}
OF_THE_READER = {"import", "temperature_convention", "artefact"}
"""How a file was read is for its reader ("log" says where it came from); a convention is said in words elsewhere."""
_MOMENT = re.compile(r"(\d{4}-\d\d-\d\d)T(\d\d:\d\d)(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:?\d\d)?")


def add_comments(section: Section, comments: dict[str, str]) -> None:
    """What a recording says of itself, in words and with units; a missing date is remarked."""
    for key, value in sorted(comments.items()):
        if key not in OF_THE_READER:
            section.add(*comment_line(key, value))
    if not {"date", "measured", "measured_at", "time"} & set(comments):
        section.missing.append(DATE_MISSING)


def comment_line(key: str, value: str) -> tuple[str, str]:
    """Label and value of a comment: ``tip_radius_mm: 2`` is "Nominal tip radius", "2 mm"."""
    unit = next((unit for end, unit in UNITS.items() if key.endswith(end)), "")
    stem = key[: -len(next(end for end in UNITS if key.endswith(end)))] if unit else key
    label = COMMENTS.get(key) or stem.replace("_", " ").strip().capitalize()
    if key == "log":  # a table is what a file is where nothing else is said
        value = value.replace(" (table)", "")
    shown = file_names(value.split("; ")) if key == "program" else _MOMENT.sub(r"\1 \2", value)
    return label, f"{shown} {unit}".strip()
