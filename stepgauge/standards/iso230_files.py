"""A positioning test as files: ``iso230.json``, ``iso230.csv`` (a row per target), ``iso230-deviations.csv``.

Positioning by other standards than ISO 230-2, from the same deviations: VDI/DGQ 3441 and ASME B5.54.

The formulas of VDI/DGQ 3441:1977 are those that makers of laser interferometers print; those of ASME B5.54 are taken
from the same kind of source. Neither text was at hand: :data:`UNCONFIRMED` says so wherever the numbers go.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.conditions.decision import ConformityDecision
from stepgauge.files.notation import make_sentence
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.recording.conventions import convention_words, instrument_words
from stepgauge.standards.gauge_table import gauge_to_dict
from stepgauge.standards.iso230 import AxisParameters, Parameters
from stepgauge.standards.iso230_decision import parameters_um
from stepgauge.standards.positioning import PAIRINGS, AxisTest, PositioningTest, Units
from stepgauge.standards.rules import incomplete

STANDARD = "ISO 230-2:2014 with Amendment 1:2016"
SIGN_CONVENTION = (
    "a deviation is the actual position minus the target position, that is certified minus indicated position"
)
ACTUAL = {"reading": "The readings are the actual positions", "target": "The targets are the actual positions"}
"""By what is taken for the actual position."""
TARGET_COLUMNS = (
    "target_mm",
    "along_gauge_mm",
    "block",
    "mean_up_um",
    "u_mean_up_um",
    "s_up_um",
    "r_up_um",
    "mean_down_um",
    "u_mean_down_um",
    "s_down_um",
    "r_down_um",
    "mean_um",
    "b_um",
    "r_um",
)
DEVIATION_COLUMNS = ("placement", "target_mm", "block", "direction", "run", "cycle", "deviation_um")


def positioning_to_dict(test: PositioningTest) -> dict[str, Any]:
    """Everything the test says, as JSON types; keys end in the units of the axis."""
    return dict(rename_units(linear_keys(test), test.units))


def rename_units(value: Any, units: Units) -> Any:
    """The same with keys that end in the units of the axis, in place of mm and um."""
    if isinstance(value, dict):
        return {key_in(name, units): rename_units(one, units) for name, one in value.items()}
    return [rename_units(one, units) for one in value] if isinstance(value, list) else value


def key_in(name: str, units: Units) -> str:
    """A key or column that ends in mm or um, in the units of the axis."""
    stem, _, unit = name.rpartition("_")
    told = {"mm": units.position, "um": units.deviation}
    return f"{stem}_{told[unit]}" if unit in told else name


def linear_keys(test: PositioningTest) -> dict[str, Any]:
    """The same with the keys of a linear axis, whatever it is."""
    return {
        "format": "stepgauge test iso230 1",
        "stepgauge": __version__,
        "standard": STANDARD,
        "recording": test.path,
        "comments": dict(test.comments),
        **_reference(test),
        "conditions": test.conditions.to_dicts(),
        "complete": test.complete,
        "tolerances_um": dict(test.requirement.tolerance_um),
        "expanded_uncertainty_um": test.requirement.expanded_um,
        "decision": decide_test(test).to_dict(),
        "statements": statements(test),
        "axes": [axis_to_dict(one, test.further) for one in test.axes],
    }


def decide_test(test: PositioningTest) -> ConformityDecision:
    """The decision on all axes."""
    return test.requirement.decision([(one.name, parameters_um(one.parameters)) for one in test.axes])


def _reference(test: PositioningTest) -> dict[str, Any]:
    """What realises the positions: the gauge, or an instrument beside the axis."""
    if test.gauge is None or test.tip is None or test.pairing is None:
        return {**test.instrument, "temperature_convention": instrument_words(test.comments)}
    return {
        "gauge": gauge_to_dict(test.gauge),
        "tip_diameter": {"diameter_mm": test.tip.diameter_mm, "u_um": test.tip.u_um, "origin": test.tip.origin},
        "pairing": PAIRINGS[test.pairing],
        "sign_convention": SIGN_CONVENTION,
        "temperature_convention": convention_words(
            test.comments, all(one.temperature_C is not None for one in test.axes)
        ),
    }


def axis_to_dict(one: AxisTest, further: tuple[str, ...] = ()) -> dict[str, Any]:
    """One axis: its parameters in um, also by ``further`` standards, its targets and all deviations."""
    p = one.parameters
    return {
        "placement": one.placement,
        "axis": one.axis,
        "name": one.name,
        "off_deg": one.off_deg,
        "gauge_against_axis": None if one.title else one.reversed,
        "runs": list(one.runs),
        "measured_mm": [float(one.targets.machine_mm.min()), float(one.targets.machine_mm.max())],
        "axis_travel_mm": one.travel_mm,
        "gauge_temperature_C": one.temperature_C,
        "parameters_um": parameters_um(p),
        "further": further_um(p, further),
        "targets": target_rows(one),
        **{f"deviations_{way}_um": direction.x_um.tolist() for way, direction in p.directions.items()},
        "rules": [rule.to_dict() for rule in one.rules],
        "excluded": [part.to_dict() for part in one.excluded],
    }


def target_rows(one: AxisTest) -> list[dict[str, Any]]:
    """One dictionary per target with the columns of ``iso230.csv``."""
    p, t = one.parameters, one.targets
    columns = {"target_mm": t.machine_mm, "along_gauge_mm": t.gauge_mm, "block": t.block}
    for way, found in p.directions.items():
        columns |= {f"mean_{way}_um": found.mean_um, f"u_mean_{way}_um": found.u_mean_um}
        columns |= {f"s_{way}_um": found.s_um, f"r_{way}_um": found.R_at_um}
    if isinstance(p, AxisParameters):
        columns |= {"mean_um": p.mean_um, "b_um": p.B_at_um, "r_um": p.R_at_um}
    names = [name for name in TARGET_COLUMNS if name in columns]
    rows = zip(*(columns[name] for name in names), strict=True)
    return [dict(zip(names, (value.item() for value in row), strict=True)) for row in rows]


def statements(test: PositioningTest) -> list[str]:
    """What the numbers rest on, and what the test leaves open, in sentences."""
    return assumptions(test) + [
        f"Placement {one.placement}, {one.name}: {text}." for one in test.axes for text in incomplete(one.rules)
    ]


def assumptions(test: PositioningTest) -> list[str]:
    """What is taken for granted to see readings, or probed faces, as positioning."""
    scatter = "The scatter is that of positioning and {} together."
    if test.tip is None or test.pairing is None:
        return [
            f"{ACTUAL[test.instrument['actual']]}{_own_reversal(test)}.",
            make_sentence(instrument_words(test.comments)),
            scatter.format(test.instrument["instrument"]),
        ]
    return [
        "Every block is a target position: the face probed in the positive direction stands for the positive"
        " approach, the"
        " other face, minus the tip diameter, for the negative approach; " + PAIRINGS[test.pairing] + ".",
        f"Tip diameter {test.tip.diameter_mm:.5f} mm: {test.tip.origin}. An error of it moves every reversal value B by"
        " as much. A diameter qualified on a sphere of this machine has the machine's reversal in it.",
        scatter.format("probe"),
    ]


def _own_reversal(test: PositioningTest) -> str:
    both = any(isinstance(one.parameters, AxisParameters) for one in test.axes)
    return "; the reversal of the instrument, if it has one, is in every B" if both else ""


def targets_csv(test: PositioningTest) -> str:
    """One row per target."""
    names = [name for name in TARGET_COLUMNS if any(name in row for one in test.axes for row in target_rows(one)[:1])]
    rows = [
        [one.placement, *(result_cell(row[name]) if name in row else "" for name in names)]
        for one in test.axes
        for row in target_rows(one)
    ]
    return csv_text(["placement", *(key_in(name, test.units) for name in names)], rows)


def deviations_csv(test: PositioningTest) -> str:
    """One row per deviation."""
    rows: list[list[object]] = []
    for one in test.axes:
        for name, direction in one.parameters.directions.items():
            for target, block, values in zip(one.targets.machine_mm, one.targets.block, direction.x_um, strict=True):
                rows += [
                    [one.placement, f"{target:.6f}", block, name, run + 1, one.runs[run], f"{value:.6g}"]
                    for run, value in enumerate(values)
                ]
    return csv_text([key_in(name, test.units) for name in DEVIATION_COLUMNS], rows)


UNCONFIRMED = {
    "vdi3441": "VDI/DGQ 3441:1977: formulas from secondary sources, its text was not at hand: unconfirmed",
    "b5.54": "ASME B5.54 (positioning, with the formulas of its edition of 2005, which follow ISO 230-2): unconfirmed",
}


def vdi3441_um(p: AxisParameters) -> dict[str, float]:
    """Positional uncertainty P, positional deviation Pa, scatter Ps and reversal U, their largest and means, um.

    With the means x and standard deviations s of each direction at a target: mean m = (x_up + x_down) / 2,
    U = |x_up - x_down|, Ps = 6 (s_up + s_down) / 2; P is the largest m + (U + Ps) / 2 minus the smallest
    m - (U + Ps) / 2, Pa the range of m.
    """
    middle = p.mean_um
    reversal = np.abs(p.B_at_um)
    scatter = 6.0 * (p.up.s_um + p.down.s_um) / 2.0
    half = (reversal + scatter) / 2.0
    return {
        "P": float((middle + half).max() - (middle - half).min()),
        "Pa": float(np.ptp(middle)),
        "Ps_max": float(scatter.max()),
        "Ps_mean": float(scatter.mean()),
        "U_max": float(reversal.max()),
        "U_mean": float(reversal.mean()),
    }


def b554_um(p: AxisParameters) -> dict[str, float]:
    """Bidirectional accuracy, repeatability of each direction and of both, systematic deviation and lost motion, um."""
    return {
        "accuracy": p.A_um,
        "repeatability_forward": p.up.R_um,
        "repeatability_reverse": p.down.R_um,
        "repeatability_bidirectional": p.R_um,
        "systematic_deviation": p.E_um,
        "lost_motion": float(np.abs(p.mean_B_um)),
    }


FURTHER: dict[str, Callable[[AxisParameters], dict[str, float]]] = {"vdi3441": vdi3441_um, "b5.54": b554_um}
LABELS = {"vdi3441": "VDI/DGQ 3441", "b5.54": "ASME B5.54"}


def further_um(parameters: Parameters, standards: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """By standard its parameters in um, and what is unconfirmed; none of an axis approached in one direction."""
    if not isinstance(parameters, AxisParameters):
        return {}
    return {name: {"parameters_um": FURTHER[name](parameters), "note": UNCONFIRMED[name]} for name in standards}
