"""``probe.diagnosed.toml``: the tripod that a diagnosis names, as a probe file to simulate and compensate with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from stepgauge.diagnosis.output.machine_text import toml_types
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis
from stepgauge.effects.tripod import QUALIFIED, KinematicPretravel
from stepgauge.machine.file import Machine
from stepgauge.physics import stylus

PROBE_FILE = "probe.diagnosed.toml"
THINNEST_MM, THICKEST_MM = 0.1, 50.0
"""Diameters that a section of a probe file may have."""


def probe_file(diagnosis: GaugeDiagnosis) -> tuple[dict[str, str], list[str]]:
    """The file by its name with its text, and what has to be known of it; both empty where no tripod is named."""
    named = [one for one in diagnosis.findings if isinstance(one.effect, KinematicPretravel)]
    if not named:
        return {}, []
    machine = diagnosis.data.machine
    return {PROBE_FILE: _text(named[0], machine)}, [_remark(named[0], machine)]


def _text(finding: Finding, machine: Machine) -> str:
    import tomli_w

    heading = (
        "# The tripod that stepgauge diagnose has named, as a probe: its seat as fitted or taken.",
        "# The stylus is one section that stands for stylus, module and contact: it gives way as much as was found.",
    )
    assert isinstance(finding.effect, KinematicPretravel)
    return "\n".join([*heading, tomli_w.dumps({"probe": toml_types(_table(finding.effect, machine))})])


def _table(tripod: KinematicPretravel, machine: Machine) -> dict[str, Any]:
    probe = machine.probe
    length = min(probe.shank_length_mm, tripod.lever_mm)
    section = giving_way(length, tripod.um_per_N * 1e-3, tripod.along)
    seat = {name: getattr(tripod, name) for name in ("preload_N", "contact_radius_mm", "contact_angle_deg", "friction")}
    return {
        "model": "kinematic",
        "name": f"{probe.name or machine.table.name}, as diagnosed",
        "tip_radius_mm": probe.tip_radius_mm,
        "stylus_direction": list(probe.stylus_direction),
        "roll_deg": probe.roll_deg,
        "stylus_diameter_mm": 2.0 * probe.shank_radius_mm,
        "body_diameter_mm": probe.body_diameter_mm,
        "body_length_mm": probe.body_length_mm,
        "seat": {**seat, "carrier_mm": tripod.lever_mm - length, "arm_azimuth_deg": tripod.arm_azimuth_deg},
        "stylus": [{name: getattr(section, name) for name in ("length_mm", "diameter_mm", "modulus_GPa")}],
    }


def giving_way(length_mm: float, lateral_mm_per_N: float, along: float) -> stylus.StylusSection:
    """A section of a length that gives way so much across the stylus, and ``along`` times as much along it.

    The ratio of the two depends on its diameter alone; of one that would have to be thicker than a file allows, the
    compliance across is kept.
    """
    from scipy.optimize import brentq  # takes a third of a second to import, and few recordings name a tripod

    def section(diameter_mm: float) -> stylus.StylusSection:
        return stylus.StylusSection(length_mm, diameter_mm, 1.0)

    def too_stiff_along(diameter_mm: float) -> float:
        one = [section(diameter_mm)]
        return stylus.axial_compliance_mm_per_N(one) / stylus.lateral_compliance_mm_per_N(one) - along

    inside = too_stiff_along(THINNEST_MM) < 0.0 < too_stiff_along(THICKEST_MM)
    diameter_mm = float(brentq(too_stiff_along, THINNEST_MM, THICKEST_MM)) if inside else THICKEST_MM
    softest = section(diameter_mm)
    return replace(softest, modulus_GPa=stylus.lateral_compliance_mm_per_N([softest]) / lateral_mm_per_N)


def _remark(finding: Finding, machine: Machine) -> str:
    """Which constant the file has in place of the machine file's."""
    assert isinstance(finding.effect, KinematicPretravel)
    tripod = finding.effect
    whole = tripod.model_copy(update={"part": "whole"})
    mean_um = tripod.um_per_N * float(whole.force_N(QUALIFIED).mean())
    modelled_um = float(machine.sensor.pretravel_um(machine.sensor.approaches(QUALIFIED)).mean())
    beside = "which it replaces" if tripod.part == "varying" else "which comes on top of it"
    return (
        f"the tripod stands in {PROBE_FILE} as a probe: its mean pre-travel over the 25 points of ISO 10360-5 is"
        f" {mean_um:.2f} um; the probe of the machine file has {modelled_um:.2f} um, {beside}"
    )
