"""The further measurement that discriminates the rivals of a map, found by simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import partial

import numpy as np

from stepgauge.diagnosis.maps.candidates import Table
from stepgauge.diagnosis.maps.model import MapModel, Terms, changed_table, predict, read_force_gauge
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.design import entropy, expected_information_gain
from stepgauge.probes.directions_map import normals_of

LEAST_SHARE, NEARLY = 0.5, 0.9
"""Share of what is not known that a measurement must tell; and share of the best one's gain that is as good."""
COARSE = {"trigger_force_N": 0.02, "deflection_um": 0.2, "pretravel_um": 0.2}
"""Assumed scatter of a quantity that the map does not have: N and um."""
OTHERS = {"trigger_force_N": "trigger force", "deflection_um": "deflection of the tip"}
GRIDS = (
    ("map more polar angles", (20.0, 40.0, 60.0, 90.0), range(0, 120, 15)),
    ("map all azimuths at 60 and 90 deg", (60.0, 90.0), range(0, 360, 15)),
)
Predicted = Mapping[str, Array]
"""Values of quantities by name."""


@dataclass(frozen=True)
class Measurement:
    """A feasible further measurement: in words, and what a changed table predicts for it.

    ``command``: the one that predicts it.
    """

    words: str
    values: Callable[[Table], Predicted]
    command: str = ""


def best_measurement(model: MapModel, sigma: Sequence[Array], rivals: Sequence[Terms], weights: Sequence[float]) -> str:
    """The measurement that is expected to tell most about which of several rivals holds, with the command that predicts
    it.

    ``weights``: in proportion to the probability of each rival.
    """
    p = np.array(weights) / sum(weights)
    scatter = COARSE | {m.name: float(np.median(s)) for m, s in zip(model.data.measured, sigma, strict=True)}
    feasible = list(_feasible(model))
    gains = [expected_information_gain(p, _distances(one, model.table, rivals, scatter)) for one in feasible]
    if max(gains) < LEAST_SHARE * entropy(p):
        return "no measurement with this probe separates them; open it and measure its seat"
    # among those that are worth nearly as much the one that is the least trouble
    chosen = next(one for one, gain in zip(feasible, gains, strict=True) if gain >= NEARLY * max(gains))
    words = f"{chosen.words} (expected information {max(gains):.1f} of {entropy(p):.1f} nats)"
    return f"{words}: {chosen.command}" if chosen.command else words


def _distances(measurement: Measurement, table: Table, rivals: Sequence[Terms], scatter: Mapping[str, float]) -> Array:
    """Chi-square distances ``(h, h)`` of what the rivals predict; 0 if one has no prediction."""
    try:
        every = [measurement.values(changed_table(table, one)) for one in rivals]
    except InputError:
        return np.zeros((len(rivals), len(rivals)))
    over = [np.concatenate([values.ravel() / scatter[name] for name, values in one.items()]) for one in every]
    values = np.array(over)[:, np.isfinite(over).all(axis=0)]
    return np.asarray(((values[:, None] - values) ** 2).sum(axis=2))


def _feasible(model: MapModel) -> Iterator[Measurement]:
    """What can be measured, what is less trouble first."""
    names = [m.name for m in model.data.measured]
    seat = "seat" in model.table
    for words, polar, azimuth in GRIDS if seat else GRIDS[1:]:
        angles = f"--polar {','.join(f'{p:g}' for p in polar)} --azimuth {azimuth.start}:{azimuth[-1]}:{azimuth.step}"
        command = f"stepgauge probe map probe.diagnosed.toml {angles} -o planned-map.csv"
        yield Measurement(words, partial(_at, model, names, normals_of(list(polar), list(azimuth)), 0.0), command)
    if seat:
        yield Measurement("load the force gauge with a known weight of about 1 N", partial(_force, force_N=1.0))
        yield Measurement("measure the force that lifts the stylus along its axis", _force)
        for name in sorted({*OTHERS} - {*names}):
            yield Measurement(f"measure the {OTHERS[name]} too", partial(_at, model, [name], model.data.normals, 0.0))
        length = sum(section["length_mm"] for section in model.table["stylus"])
        words = f"measure the same directions with a stylus longer by {length:g} mm"
        yield Measurement(words, partial(_at, model, names, model.data.normals, length))


def _at(model: MapModel, names: Sequence[str], normals: Array, longer_mm: float, table: Table) -> Predicted:
    """What the probe gives in some directions, with a stylus that is longer."""
    if longer_mm:
        table = deepcopy(table)
        table["stylus"][-1]["length_mm"] += longer_mm
        table.pop("stylus_length_mm", None)
    return dict(zip(names, predict(table, model.where, normals, names), strict=True))


def _force(table: Table, force_N: float | None = None) -> Predicted:
    """What the force gauge shows for a force; without one for that which lifts the stylus."""
    force = float(table["seat"]["preload_N"]) if force_N is None else force_N
    return {"trigger_force_N": read_force_gauge(table, np.array([force]))}
