"""Where the uncertainty of an evaluation comes from: every source as GTC numbers by face, and those not stated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.placement import Placement
from stepgauge.machine.contribution import Contribution
from stepgauge.machine.file import StandardUncertainty
from stepgauge.montecarlo.inputs import (
    CERTIFICATE,
    EXPANSION,
    GAUGE_TEMPERATURE,
    REPEATABILITY,
    effect_key,
    pooled_deviation_um,
)
from stepgauge.montecarlo.model import MonteCarloModel, PlacementReadings
from stepgauge.standards.budget_further import (
    condition_um,
    drift_correction,
    gauge_ages,
    gauge_drift,
    own_contributions,
    shown_by_readings,
)
from stepgauge.standards.budget_terms import BudgetTerm, UncertaintySource, independent
from stepgauge.standards.coverage import APPROXIMATELY_95

Repeats = Literal["pooled", "face"]
LABELS = {
    CERTIFICATE: "gauge certificate",
    EXPANSION: "expansion of the gauge",
    GAUGE_TEMPERATURE: "temperature of the gauge",
    "machine.temperature_C": "temperature of the scales",
    "machine.scale_expansion_per_K": "expansion of the scales",
    "probe.pretravel_um": "pre-travel",
}
PROBING, RESOLUTION, ALIGNMENT = "probing", "resolution", "alignment"


@dataclass(frozen=True)
class BudgetOptions:
    """Statements of the user for a budget beside the files.

    ``placements``: in the order of the recording, or none; ``repeats``: one standard deviation for all faces
    (``"pooled"``, GUM 4.2.4) or one by face with n - 1 degrees of freedom; ``percent``: coverage probability;
    ``contributions``: one's own; ``measured_at``: date, where the recording does not say.
    """

    placements: Sequence[Placement] = ()
    repeats: Repeats = "pooled"
    percent: float = APPROXIMATELY_95
    contributions: Sequence[Contribution] = ()
    measured_at: str | None = None


def terms(
    model: MonteCarloModel, part: PlacementReadings, asked: BudgetOptions, placement: Placement | None
) -> list[BudgetTerm]:
    """All sources that are stated, as GTC numbers that are independent from source to source."""
    found = [_certificate(model, part), _repeatability(model, part, asked.repeats)]
    found += [_scalar(model, part, index) for index in range(len(model.inputs.scalars))]
    found += [_probing(model, part), _resolution(model, part), _alignment(model, part, placement)]
    found += [gauge_drift(model, part, asked.measured_at), drift_correction(model, part)]
    found += shown_by_readings(model, part)
    return [term for term in found if term is not None] + own_contributions(model, part, asked.contributions)


def _range(u: Array) -> tuple[float, float]:
    return float(u.min()), float(u.max())


def _certificate(model: MonteCarloModel, part: PlacementReadings) -> BudgetTerm | None:
    from GTC import set_correlation

    gauge, faces = model.gauge, part.readings.faces
    u = gauge.u_um[faces - 1]
    if not u.any():
        return None
    dof = gauge.certificate.degrees_of_freedom or math.inf
    um = independent(u, dof, CERTIFICATE)
    if gauge.correlation is not None:
        correlation = gauge.correlation[np.ix_(faces - 1, faces - 1)]
        for i, j in zip(*np.nonzero(np.triu(correlation, 1)), strict=True):
            if u[i] and u[j]:
                set_correlation(min(float(correlation[i, j]), 1.0), um[i], um[j])
    return BudgetTerm(
        UncertaintySource(
            CERTIFICATE, LABELS[CERTIFICATE], "B", _range(u), "um", dof, "gauge file: uncertainty_um, coverage_factor"
        ),
        um,
    )


def _repeatability(model: MonteCarloModel, part: PlacementReadings, repeats: Repeats) -> BudgetTerm | None:
    """Of the mean over the cycles: s / sqrt(n)."""
    faces = part.readings.faces
    count = np.maximum(np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)[faces], 1)
    _, freedom = pooled_deviation_um(model.nominal.results) if model.sign < 0 else (math.nan, 0)
    if freedom and repeats == "face":
        return _repeats_by_face(model, part, count)
    sigma = part_deviation_um(model, part)
    if not sigma.any():
        return None
    u, dof = sigma / np.sqrt(count), float(freedom) if freedom else math.inf
    said = "recording: pooled over the faces" if freedom else "machine file: repeatability_um"
    source = UncertaintySource(REPEATABILITY, REPEATABILITY, "A" if freedom else "B", _range(u), "um", dof, said)
    return BudgetTerm(source, independent(u, dof, REPEATABILITY))


def part_deviation_um(model: MonteCarloModel, part: PlacementReadings) -> Array:
    """Standard deviation of a probing of every face, um: pooled of a recording, as modelled of a program."""
    faces = part.readings.faces
    variance = np.bincount(part.readings.face, model.noise_um(part) ** 2, int(faces[-1]) + 1)
    count = np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)
    deviation: Array = np.sqrt(variance / np.maximum(count, 1))[faces]
    return deviation


def _repeats_by_face(model: MonteCarloModel, part: PlacementReadings, count: NDArray[np.int64]) -> BudgetTerm:
    from GTC import ureal

    result = next(r for r in model.nominal.results if r.placement == part.placement)
    deviation = np.where(result.face % 2 == 1, result.sf_um, result.sb_um)
    single = (count < 2) & (result.count > 0)
    if single.any():
        raise InputError(
            model.nominal.path,
            f"face {result.face[single][0]} was probed once: it has no standard deviation of its own",
            expected=naming("repeats", words="at least two cycles, or the pooled standard deviation ({} pooled)"),
        )
    u = np.nan_to_num(deviation) / np.sqrt(count)
    um = [ureal(0.0, float(v), float(n - 1)) if v > 0 else 0.0 for v, n in zip(u, count, strict=True)]
    dof = float((count - 1)[result.count > 0].min())
    return BudgetTerm(
        UncertaintySource(REPEATABILITY, REPEATABILITY, "A", _range(u), "um", dof, "recording: by face, n - 1"), um
    )


def _scalar(model: MonteCarloModel, part: PlacementReadings, index: int) -> BudgetTerm | None:
    """An uncertain value that moves all readings together; None for the size of the scatter, which moves none."""
    from GTC import ureal

    scalar = model.inputs.scalars[index]
    if scalar.key == "machine.repeatability_um":
        return None
    response = model.response_um(part, scalar)
    faces = part.readings.faces
    count = np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)
    mean = (np.bincount(part.readings.face, response, int(faces[-1]) + 1) / np.maximum(count, 1))[faces]
    stated = model.machine.stated.gauge_temperature_K if scalar.key == GAUGE_TEMPERATURE else None
    dof = scalar.dof or (stated.dof if stated is not None and stated.u == scalar.u else None) or math.inf
    one = ureal(0.0, 1.0, dof, label=scalar.key)
    label = LABELS.get(scalar.key) or model.label(scalar.key)
    u, unit, stated_by = (scalar.u, scalar.u), _unit(model, scalar.key), _stated_by(scalar.key)
    source = UncertaintySource(scalar.key, label, "B", u, unit, dof, stated_by)
    return BudgetTerm(source, [float(v) * one for v in mean])


def _unit(model: MonteCarloModel, key: str) -> str:
    """The unit of an uncertain value: as its effect has it, or as the name of its key ends."""
    place = effect_key(key)
    if place is not None:
        known = {one.name: one.unit for one in model.effect_of(place[0]).parameters()}
        return known.get(place[1][0], "")
    units = {GAUGE_TEMPERATURE: "K", "machine.temperature_C": "K", "probe.pretravel_um": "um"}
    return units.get(key, "1/K")


def _stated_by(key: str) -> str:
    if key == GAUGE_TEMPERATURE:
        return "--u-gauge-temperature or [uncertainty] of the machine file"
    return "gauge file" if key.startswith("gauge.") else "machine file"


def _probing(model: MonteCarloModel, part: PlacementReadings) -> BudgetTerm | None:
    stated: StandardUncertainty | None = model.machine.stated.probing_um
    if stated is None or not stated.u:
        return None
    dof = stated.dof or math.inf
    u = np.full(len(part.readings.faces), stated.u)
    source = UncertaintySource(PROBING, PROBING, "B", _range(u), "um", dof, "machine file: [uncertainty] probing_um")
    return BudgetTerm(source, independent(u, dof, PROBING))


def _resolution(model: MonteCarloModel, part: PlacementReadings) -> BudgetTerm | None:
    """Half a step to each side, rectangular (GUM F.2.2.1): step / sqrt(12), the same in every cycle of a face.

    The step is the stated one, or that of the readings where these show a coarser one.
    """
    stated, seen = model.machine.stated.resolution_um, 2.0 * condition_um(model, part, "resolution")
    step = max(stated or 0.0, seen)
    if step == 0.0:
        return None
    said = f"recording: steps of {seen:g} um" if seen > (stated or 0.0) else "machine file: [uncertainty] resolution_um"
    u = np.full(len(part.readings.faces), step / math.sqrt(12.0))
    source = UncertaintySource(RESOLUTION, RESOLUTION, "B", _range(u), "um", math.inf, said)
    return BudgetTerm(source, independent(u, math.inf, RESOLUTION))


def _alignment(model: MonteCarloModel, part: PlacementReadings, placement: Placement | None) -> BudgetTerm | None:
    """Readings are too long by S phi^2 / 2 if the probed line is at the angle phi to the gauge.

    Both what locating leaves unknown and the angle that the readings show count.
    """
    from GTC import ureal

    if placement is None:
        return None
    u_rad = axis_uncertainty_rad(placement)
    if u_rad is None:
        return None
    position_um = model.gauge.position_mm[part.readings.faces - 1] * 1e3
    seen = condition_um(model, part, "alignment") / max(float(np.ptp(position_um)), 1.0)
    cosine = math.hypot(cosine_rms(*u_rad), seen)
    one = ureal(0.0, 1.0, math.inf, label=ALIGNMENT)
    tilt = math.sqrt(2.0 * seen)
    u_urad = (min(u_rad) * 1e6, max(*u_rad, tilt) * 1e6)
    said = "placement file: [uncertainty]" + (f"; the readings are {tilt * 1e3:.2f} mrad off" if seen else "")
    source = UncertaintySource(ALIGNMENT, ALIGNMENT, "B", u_urad, "urad", math.inf, said)
    return BudgetTerm(source, [float(v) * cosine * one for v in position_um])


def axis_uncertainty_rad(placement: Placement) -> tuple[float, float] | None:
    """Standard uncertainty of the axis in two directions across it, rad; None if the placement does not state it.

    Yaw is an angle in the xy plane: across the axis it counts times the cosine of the pitch.
    """
    stated = placement.details.get("uncertainty", {})
    if "yaw_urad" not in stated or "pitch_urad" not in stated:
        return None
    level = float(np.hypot(placement.axis[0], placement.axis[1]))
    return float(stated["yaw_urad"]) * level * 1e-6, float(stated["pitch_urad"]) * 1e-6


def cosine_rms(u1_rad: float, u2_rad: float) -> float:
    """Root mean square of (d1^2 + d2^2) / 2 for two independent normal angles.

    The error always has one sign (JCGM 100:2008, F.2.4.4). It is not corrected here: its root mean square holds its
    mean as well as its spread, from E[(d1^2 + d2^2)^2] = 3 u1^4 + 3 u2^4 + 2 u1^2 u2^2.
    """
    return math.sqrt(3.0 * u1_rad**4 + 3.0 * u2_rad**4 + 2.0 * (u1_rad * u2_rad) ** 2) / 2.0


def assumptions(model: MonteCarloModel, asked: BudgetOptions) -> list[str]:
    """Assumptions where no file makes a statement, in sentences for the report."""
    certificate = model.gauge.certificate
    said = []
    if certificate.correlation is None and certificate.proportional_um_per_m is None:
        said.append("the certificate states no correlation of its positions: taken as independent (correlation 0)")
    if certificate.proportional_um_per_m is not None:
        per_m = f"{certificate.proportional_um_per_m:g} um per m of the certificate's uncertainty"
        said.append(f"{per_m} are proportional to the position and common to all faces")
    if certificate.correlation is not None:
        rest = " apart from that" if certificate.proportional_um_per_m is not None else ""
        said.append(f"any two certified positions have the correlation coefficient {certificate.correlation:g}{rest}")
    if certificate.degrees_of_freedom is None:
        said.append("the certificate states no degrees of freedom: they are taken as infinite")
    scales = [model.machine.scales_doubt(one.scale_temperature_C) for one in model.nominal.results]
    said += [f"{doubt}: the recorded temperature is used" for doubt in dict.fromkeys(scales) if doubt]
    if any(condition.size_um for condition in model.nominal.conditions.of("reversal")):
        said.append(
            "XR is as it is defined: what a scale error shows in it (see the notes) is neither corrected nor in U"
        )
    if not gauge_ages(model):
        said.append("the gauge has its certified length: nothing was measured but a virtual one")
    if asked.repeats == "pooled":
        said.append("one standard deviation of a probing holds for all faces")
    if model.machine.stated.resolution_um is not None:
        said.append("the resolution is not reduced by averaging: every cycle of a face may be rounded alike")
    if any(axis_uncertainty_rad(placement) for placement in asked.placements):
        said.append("the cosine error of the alignment is not corrected: its root mean square counts as uncertainty")
    return said
