"""What ISO 230-2:2014 (with Amendment 1:2016) asks of a positioning test, checked one by one.

The rules are those of linear axes up to 2 000 mm, and of rotary axes up to 360 deg. Clauses are named by their subject:
the editions number them differently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.recording.conventions import CONVENTIONS, REFERENCE_C, Convention
from stepgauge.standards.rules import Rule
from stepgauge.standards.tip import TipDiameter

RUNS = 5
LEAST_TARGETS = 5
TARGETS_PER_M = 5.0
LONGEST_MM = 2000.0
SAME_STEP = 1e-3
"""Steps between targets that differ by less than this share are one constant step."""
LINEAR = "ISO 230-2:2014, linear axes up to 2\u00a0000 mm"
FULL_TURN_DEG = 360.0
AT_20_K = 0.1
"""Nearer to 20 deg C than this scales and gauge are at 20 deg C: 1 um/m of steel."""
TARGETS_BY_TRAVEL = ((90.0, 3), (180.0, 5), (FULL_TURN_DEG, 8))
"""Least number of targets by the travel of a rotary axis, deg, up to and with it."""
ROTARY = "ISO 230-2:2014, rotary axes up to 360° (numbers of targets: its text was not at hand, unconfirmed)"


@dataclass(frozen=True)
class Thermal:
    """Mean temperatures of gauge and scales, deg C (None: not recorded), and what the readings were corrected for."""

    gauge_C: float | None
    scales_C: float | None
    convention: Convention | None


def rules_of(
    target_mm: Array, runs: int, off_deg: float, along_deg: float, tip: TipDiameter, thermal: Thermal
) -> tuple[Rule, ...]:
    """Every rule, in the order of the standard; ``target_mm (m,)`` are the target positions, rising."""
    temperature_C = thermal.gauge_C
    known = "not recorded" if temperature_C is None else f"{temperature_C:.2f} °C (mean), positions corrected to it"
    return (
        Rule(
            "ISO 230-2:2014, scope",
            "one axis moves at a time",
            f"the gauge lies {off_deg:.2f}° off the nearest axis",
            off_deg <= along_deg,
        ),
        *_runs_and_targets(target_mm, runs),
        _reversal(tip),
        _temperature(known, temperature_C is not None),
        _nominal_expansion(thermal),
    )


def axis_rules(
    target: Array,
    runs: int,
    temperatures: Sequence[str],
    rotary: bool = False,
    ways: Sequence[str] = ("up", "down"),
    doubt: str | None = None,
) -> tuple[Rule, ...]:
    """Every rule for an axis that an instrument read; ``target (m,)`` in mm, of a rotary axis in deg.

    ``temperatures``: columns that were recorded besides; ``ways``: directions in which targets were approached;
    ``doubt``: why they may not be true.
    """
    known = f"recorded ({', '.join(temperatures)})" if temperatures else "not recorded"
    found = _runs_and_targets_of_turn(target, runs) if rotary else _runs_and_targets(target, runs)
    one_way = Rule(
        "ISO 230-2:2014, test procedure",
        "targets approached in both directions",
        f"approached {ways[0]} only: reversal, and all that is of both directions, is not known",
        False,
    )
    directions = [one_way] if len(ways) == 1 else []
    if doubt:
        asked = "directions of approach as the targets follow each other"
        directions.append(Rule("ISO 230-2:2014, test procedure", asked, doubt, False))
    return (*found, *directions, _temperature(known, bool(temperatures)))


def _temperature(found: str, met: bool) -> Rule:
    return Rule("ISO 230-2:2014, test conditions", "temperature of the reference known", found, met)


def _nominal_expansion(thermal: Thermal) -> Rule:
    """Results hold at 20 deg C: readings at other temperatures are corrected for the expansion of scales and gauge."""
    source = "ISO 230-2:2014, test conditions (ISO 1: 20 °C)"
    asks = "readings corrected for nominal differential expansion where scales or gauge are not at 20 °C"
    away = [abs(one - REFERENCE_C) for one in (thermal.gauge_C, thermal.scales_C) if one is not None]
    if thermal.convention in ("nominal_expansion", "corrected_to_20"):
        return Rule(source, asks, CONVENTIONS[thermal.convention], True)
    if not away:
        return Rule(source, asks, "no temperature was recorded", None)
    found = f"{max(away):.2f} K off 20 °C; the expansion of the scales is not corrected and is in the deviations"
    return Rule(source, asks, found, max(away) <= AT_20_K)


def _runs_and_targets(target_mm: Array, runs: int) -> tuple[Rule, ...]:
    """What is asked of the runs and of the target positions, whatever realises them."""
    span_mm = float(np.ptp(target_mm))
    asked = max(LEAST_TARGETS, int(np.ceil(TARGETS_PER_M * span_mm * 1e-3)))
    return (
        Rule(LINEAR, f"{RUNS} runs in each direction", f"{runs} runs", runs >= RUNS),
        Rule(
            LINEAR,
            f"{TARGETS_PER_M:g} targets per metre, {LEAST_TARGETS} at least",
            f"{len(target_mm)} targets over {span_mm:.1f} mm, asked {asked}",
            len(target_mm) >= asked,
        ),
        Rule(LINEAR, f"measurement travel up to {LONGEST_MM:g} mm", f"{span_mm:.1f} mm", span_mm <= LONGEST_MM),
        _steps(target_mm),
    )


def _runs_and_targets_of_turn(target_deg: Array, runs: int) -> tuple[Rule, ...]:
    """The same of a rotary axis."""
    span_deg = float(np.ptp(target_deg))
    asked = next((least for travel, least in TARGETS_BY_TRAVEL if span_deg <= travel), TARGETS_BY_TRAVEL[-1][1])
    by_travel = ", ".join(f"{least} up to {travel:g}°" for travel, least in TARGETS_BY_TRAVEL)
    return (
        Rule(ROTARY, f"{RUNS} runs in each direction", f"{runs} runs", runs >= RUNS),
        Rule(
            ROTARY,
            f"targets by travel: {by_travel}",
            f"{len(target_deg)} targets over {span_deg:.1f}°, asked {asked}",
            len(target_deg) >= asked,
        ),
        Rule(ROTARY, "measurement travel up to 360°", f"{span_deg:.1f}°", span_deg <= FULL_TURN_DEG * (1.0 + 1e-9)),
        _steps(target_deg, "°"),
    )


def _steps(target_mm: Array, unit: str = " mm") -> Rule:
    """A constant step can hide an error whose period divides it."""
    steps = np.diff(target_mm)
    constant = bool(np.ptp(steps) <= SAME_STEP * steps.mean())
    found = f"constant step of {steps.mean():.3f}{unit}: an error with a period that divides it does not show"
    return Rule(
        "ISO 230-2:2014, selection of target positions",
        "steps that differ, so that periodic errors are sampled",
        found if constant else f"steps of {steps.min():.3f} to {steps.max():.3f}{unit}",
        not constant,
    )


def _reversal(tip: TipDiameter) -> Rule:
    asks = "targets approached in both directions"
    source = "ISO 230-2:2014, Annex D (step gauges; its text was not at hand: unconfirmed)"
    if tip.own_block:
        found = (
            f"fronts and backs of blocks, the tip diameter from {tip.origin}: the reversal of that block is zero by"
            " construction, and B is the change of the reversal along the axis"
        )
        return Rule(source, asks, found, False)
    found = f"fronts and backs of blocks, tip diameter {tip.diameter_mm:.5f} mm, {tip.origin}"
    return Rule(source, asks, found, True)
