"""What an uncertainty budget lacks: the contributions that nobody states, each with what states it."""

from __future__ import annotations

from dataclasses import dataclass

from stepgauge.montecarlo.inputs import CERTIFICATE, EXPANSION, GAUGE_TEMPERATURE, REPEATABILITY
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.standards.budget_further import (
    DRIFT_STATED_BY,
    GAUGE_DRIFT,
    condition_um,
    drift_um_per_m_per_year,
    gauge_ages,
    measured_on,
)
from stepgauge.standards.budget_sources import (
    ALIGNMENT,
    PROBING,
    RESOLUTION,
    BudgetOptions,
    axis_uncertainty_rad,
)


@dataclass(frozen=True)
class UnstatedSource:
    """A contribution that nobody states: the ``source`` that it would be, ``what`` it is, and what states it."""

    source: str
    what: str
    state_by: str


Check = tuple[bool, UnstatedSource]
U_GAUGE_TEMPERATURE = UnstatedSource(
    GAUGE_TEMPERATURE,
    "temperature of the gauge",
    "--u-gauge-temperature, or gauge_temperature_K in [uncertainty] of the machine file",
)
UNRECORDED_TEMPERATURE = UnstatedSource(
    "gauge_temperature_C",
    "temperature of the gauge (not recorded; taken as the certificate's)",
    "--u-gauge-temperature, how far it may have been off (that of the machine file is of a thermometer)",
)
U_PROBING = UnstatedSource(
    PROBING,
    "probing (what differs from face to face and not from cycle to cycle)",
    "probing_um in [uncertainty] of the machine file",
)


def missing(model: MonteCarloModel, asked: BudgetOptions) -> list[UnstatedSource]:
    """Contributions to the budget of this measurement that were not stated; no value is assumed for them.

    One's own contribution of that name states it.
    """
    machine, gauge, keys = model.machine, model.gauge, model.inputs.names
    recorded = model.nominal.results[0].gauge_temperature_C is not None
    located = asked.placements and all(axis_uncertainty_rad(placement) for placement in asked.placements)
    checks: tuple[Check, ...] = (
        (
            bool(gauge.u_um.any()),
            UnstatedSource(CERTIFICATE, "gauge certificate", "column uncertainty_um of the faces of the gauge file"),
        ),
        (
            gauge.table.expansion_uncertainty_per_K > 0,
            UnstatedSource(EXPANSION, "expansion of the gauge", "gauge.expansion_uncertainty_per_K"),
        ),
        (GAUGE_TEMPERATURE in keys, U_GAUGE_TEMPERATURE if recorded else UNRECORDED_TEMPERATURE),
        *_scales(model),
        *_age(model, asked),
        (machine.stated.probing_um is not None, U_PROBING),
        (
            machine.stated.resolution_um is not None or any(condition_um(model, p, "resolution") for p in model.parts),
            UnstatedSource(RESOLUTION, "resolution", "resolution_um in [uncertainty] of the machine file"),
        ),
        (
            bool(located),
            UnstatedSource(
                ALIGNMENT, "alignment (cosine error)", "the placement with its [uncertainty] yaw_urad and pitch_urad"
            ),
        ),
        (
            REPEATABILITY in keys,
            UnstatedSource(REPEATABILITY, "repeatability", "two or more cycles, or machine.repeatability_um"),
        ),
    )
    own = {one.name for one in (*machine.contributions, *asked.contributions)}
    return [one for present, one in checks if not present and one.what.partition(" (")[0] not in own]


def _scales(model: MonteCarloModel) -> list[Check]:
    """What is asked of the scales: only the machine at 20 deg C has not the errors that their temperature makes, and
    readings that were corrected for their expansion hold what is not known of it."""
    if not (model.at_reference or model.corrects_scales):
        return []
    checks = [
        (
            f"machine.{key}" in model.inputs.names,
            UnstatedSource(
                f"machine.{key}",
                f"{what} of the scales",
                f"machine.{key} = {{ value = .., u = .. }} in the machine file",
            ),
        )
        for key, what in (("temperature_C", "temperature"), ("scale_expansion_per_K", "expansion"))
    ]
    if model.corrects_scales:
        return checks
    return [
        *checks,
        (
            model.sign > 0 or model.machine.table.scales_compensated,
            UnstatedSource(
                "scales at 20 deg C",
                "correction of the readings to scales at 20 deg C (the machine file says that the controller makes"
                " none)",
                "a measurand as it is, or scales that are compensated",
            ),
        ),
    ]


def _age(model: MonteCarloModel, asked: BudgetOptions) -> list[Check]:
    """What is asked of the time since the gauge was calibrated."""
    if not gauge_ages(model):
        return []
    return [
        (
            drift_um_per_m_per_year(model.gauge) is not None,
            UnstatedSource(GAUGE_DRIFT, "drift of the gauge since its calibration", DRIFT_STATED_BY),
        ),
        (
            measured_on(model, asked.measured_at) is not None,
            UnstatedSource(
                "measured_at",
                "age of the gauge's calibration (nobody says when it was measured)",
                "--measured-at, or # measured_at: in the recording",
            ),
        ),
    ]
