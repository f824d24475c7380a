"""The further measurement that discriminates the rivals of a map, found by simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from stepgauge.diagnosis.maps.candidates import Table
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel, build_probe, changed_table, predict, read_gauge
from stepgauge.diagnosis.maps.stated_map import FittedChanges
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.design import entropy, expected_information_gain
from stepgauge.probes import Probe
from stepgauge.probes.directions_map import normals_of

LEAST_SHARE, NEARLY = 0.5, 0.9
"""Share of what is not known that a measurement must tell; and share of the best one's gain that is as good."""
_COARSE = (0.02, 0.2)
"""Assumed scatter of a quantity that the map does not have: N and um."""

REASONS = {
    frozenset(
        {"lever_arm", "stylus_length"}
    ): "the lever of a force at the tip is the stylus and what it is held by; only "
    "how far the stylus bends tells them apart",
    frozenset({"lever_arm", "contact_radius"}): "a force at the tip reaches the contacts through the ratio of lever to "
    "contact radius alone",
    frozenset({"preload", "force_gauge_scale"}): "every trigger force is proportional to the spring's force, so a "
    "gauge that reads too much looks like a stronger spring",
    frozenset({"lever_arm", "preload"}): "square to the stylus the force is about preload times contact radius over "
    "lever; only oblique directions tell the three apart",
    frozenset({"contact_radius", "preload"}): "square to the stylus the force is about preload times contact radius "
    "over lever; only oblique directions tell the three apart",
    frozenset({"lever_arm", "force_gauge_scale"}): "square to the stylus the lever scales all forces alike, as a "
    "force gauge does",
    frozenset({"contact_radius", "force_gauge_scale"}): "square to the stylus the contact radius scales all forces "
    "alike, as a force gauge does",
}


@dataclass(frozen=True)
class Measurement:
    """A feasible further measurement: in words, the command that predicts it, and the prediction of a model.

    ``values`` takes the changed table, the terms and the model; it returns predictions over their scatter.
    """

    words: str
    command: str
    values: Callable[[Table, Sequence[ChangeTerm]], Array]


def reason(first: str, second: str) -> str:
    """Why two changes have the same signature, in words."""
    known = REASONS.get(frozenset({first, second}))
    return known or f"over the directions measured, {first} and {second} change the values in the same way"


def best_measurement(
    model: MapModel, sigma: Sequence[Array], rivals: Sequence[FittedChanges], weights: Sequence[float]
) -> str:
    """The measurement that is expected to tell most about which of several rivals holds, with the command that predicts
    it; empty for a single one.

    ``weights``: in proportion to the probability of each rival.
    """
    if len(rivals) < 2:
        return ""
    p = np.array(weights) / sum(weights)
    feasible = _feasible(model, sigma)
    gains = [expected_information_gain(p, _distances(one, model.table, rivals)) for one in feasible]
    if max(gains) < LEAST_SHARE * entropy(p):
        return "no measurement with this probe separates them; open it and measure its seat"
    # among those that are worth nearly as much the one that is the least trouble
    chosen = next(one for one, gain in zip(feasible, gains, strict=True) if gain >= NEARLY * max(gains))
    words = f"{chosen.words} (expected information {max(gains):.1f} of {entropy(p):.1f} nats)"
    return f"{words}: {chosen.command}" if chosen.command else words


def _distances(measurement: Measurement, table: Table, rivals: Sequence[FittedChanges]) -> Array:
    """Chi-square distances ``(h, h)`` of what the rivals predict; 0 if one has no prediction."""
    try:
        values = np.array([measurement.values(changed_table(table, one.terms), one.terms) for one in rivals])
    except InputError:
        return np.zeros((len(rivals), len(rivals)))
    values = values[:, np.isfinite(values).all(axis=0)]
    return np.asarray(((values[:, None] - values) ** 2).sum(axis=2))


def _feasible(model: MapModel, sigma: Sequence[Array]) -> list[Measurement]:
    if "seat" not in model.table:
        return [_on_grid("map all azimuths at 60 and 90 deg", (60.0, 90.0), range(0, 360, 15), model, sigma)]
    length = sum(section["length_mm"] for section in model.table["stylus"])
    found = [
        _on_grid("map more polar angles", (20.0, 40.0, 60.0, 90.0), range(0, 120, 15), model, sigma),
        _on_grid("map all azimuths at 60 and 90 deg", (60.0, 90.0), range(0, 360, 15), model, sigma),
        Measurement("load the force gauge with a known weight of about 1 N", "", _dead_weight(model, sigma)),
        Measurement("measure the force that lifts the stylus along its axis", "", _spring(model, sigma)),
    ]
    longer = _longer(f"measure the same directions with a stylus longer by {length:g} mm", length, model, sigma)
    missing = {"trigger_force_N", "deflection_um"} - {m.name for m in model.data.measured}
    words = {"trigger_force_N": "trigger force", "deflection_um": "deflection of the tip"}
    return [*found, *(_also(name, f"measure the {words[name]} too", model) for name in sorted(missing)), longer]


def _scatter(model: MapModel, sigma: Sequence[Array]) -> dict[str, float]:
    found = {"trigger_force_N": _COARSE[0], "deflection_um": _COARSE[1], "pretravel_um": _COARSE[1]}
    return found | {m.name: float(np.median(s)) for m, s in zip(model.data.measured, sigma, strict=True)}


def _predicted(probe: Probe, terms: Sequence[ChangeTerm], normals: Array, scatter: dict[str, float]) -> Array:
    parts = predict(probe, terms, normals, list(scatter))
    return np.concatenate([part.ravel() / s for part, s in zip(parts, scatter.values(), strict=True)])


def _measured_only(model: MapModel, sigma: Sequence[Array]) -> dict[str, float]:
    scatter = _scatter(model, sigma)
    return {m.name: scatter[m.name] for m in model.data.measured}


def _on_grid(
    words: str, polar: Sequence[float], azimuth: range, model: MapModel, sigma: Sequence[Array]
) -> Measurement:
    normals, scatter = normals_of(list(polar), list(azimuth)), _measured_only(model, sigma)
    angles = f"--polar {','.join(f'{p:g}' for p in polar)} --azimuth {azimuth.start}:{azimuth[-1]}:{azimuth.step}"
    command = f"stepgauge probe map probe.diagnosed.toml {angles} -o planned-map.csv"

    def values(table: Table, terms: Sequence[ChangeTerm]) -> Array:
        return _predicted(build_probe(table, model.where), terms, normals, scatter)

    return Measurement(words, command, values)


def _longer(words: str, extra_mm: float, model: MapModel, sigma: Sequence[Array]) -> Measurement:
    scatter = _measured_only(model, sigma)

    def values(table: Table, terms: Sequence[ChangeTerm]) -> Array:
        longer = deepcopy(table)
        longer["stylus"][-1]["length_mm"] += extra_mm
        longer.pop("stylus_length_mm", None)
        return _predicted(build_probe(longer, model.where), terms, model.data.normals, scatter)

    return Measurement(words, "", values)


def _spring(model: MapModel, sigma: Sequence[Array]) -> Callable[[Table, Sequence[ChangeTerm]], Array]:
    scatter = _scatter(model, sigma)["trigger_force_N"]

    def values(table: Table, terms: Sequence[ChangeTerm]) -> Array:
        return read_gauge(terms, np.array([table["seat"]["preload_N"]])) / scatter

    return values


def _dead_weight(model: MapModel, sigma: Sequence[Array]) -> Callable[[Table, Sequence[ChangeTerm]], Array]:
    scatter = _scatter(model, sigma)["trigger_force_N"]

    def values(table: Table, terms: Sequence[ChangeTerm]) -> Array:
        del table
        return read_gauge(terms, np.ones(1)) / scatter

    return values


def _also(name: str, words: str, model: MapModel) -> Measurement:
    scatter = {name: _COARSE[name.endswith("_um")]}

    def values(table: Table, terms: Sequence[ChangeTerm]) -> Array:
        return _predicted(build_probe(table, model.where), terms, model.data.normals, scatter)

    return Measurement(words, "", values)
