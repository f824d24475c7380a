"""The input quantities of a Monte Carlo: values with an uncertainty, and one set of draws for every run."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepgauge.effects import effect_kinds
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import PlacementResult
from stepgauge.files.arrays import Array
from stepgauge.files.config import TomlTable, check_table
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.machine.uncertain import Uncertain, replaced

EXPANSION = "gauge.expansion_per_K"
GAUGE_TEMPERATURE = "gauge temperature"
CERTIFICATE = "certificate"
REPEATABILITY = "repeatability"
MACHINE_KEYS = (
    "machine.repeatability_um",
    "machine.temperature_C",
    "machine.scale_expansion_per_K",
    "probe.pretravel_um",
)
"""Keys outside the effects that may have an uncertainty."""
_EFFECT_KEY = re.compile(r"effect\[(\d+)\]\.([^\[\]]+)")
NOTHING = "nothing"
"""In place of the name of an input: all inputs are held at their best estimates."""


@dataclass(frozen=True)
class MonteCarloInputs:
    """Scalar inputs in a fixed order, and what varies by face (``certificate``) and by probing (``repeatability``).

    ``names`` lists all inputs by the names that contributions are reported under.
    """

    scalars: tuple[Uncertain, ...]
    certificate: bool
    repeatability: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs: the scalars, then the groups that are drawn as a whole."""
        groups = [CERTIFICATE] * self.certificate + [REPEATABILITY] * self.repeatability
        return (*(scalar.key for scalar in self.scalars), *groups)


@dataclass(frozen=True)
class Draws:
    """Random numbers of some runs; inputs that are held at their best estimates are missing.

    ``scalar``: values by key, ``(runs, 1)``; ``certificate (runs, n_faces)`` standard normal, correlated as the gauge
    file states; ``noise (runs, n)`` standard normal.
    """

    runs: int
    scalar: dict[str, Array]
    certificate: Array | None
    noise: Array | None


def collect_inputs(machine: Machine, gauge: Gauge, u_gauge_temperature_K: float = 0.0) -> MonteCarloInputs:
    """All inputs of a machine, a gauge and a thermometer.

    :class:`InputError` where a key that cannot carry an uncertainty does, or where a draw could leave its bounds.
    """
    for uncertain in machine.uncertain:
        _check_reach(machine, uncertain)
    scalars = list(machine.uncertain)
    table = gauge.table
    if table.expansion_uncertainty_per_K:
        scalars.append(Uncertain(EXPANSION, table.expansion_per_K, table.expansion_uncertainty_per_K))
    if u_gauge_temperature_K:
        scalars.append(Uncertain(GAUGE_TEMPERATURE, 0.0, u_gauge_temperature_K))
    noisy = machine.table.repeatability_um > 0 or any(t.get("kind") == "noise_growth" for t in machine.effects)
    return MonteCarloInputs(tuple(scalars), bool(gauge.u_um.any()), noisy)


def _check_reach(machine: Machine, uncertain: Uncertain) -> None:
    """Both ends of what can be drawn must be values that the file could state."""
    for end in uncertain.ends:
        effect = effect_key(uncertain.key)
        if effect is not None:
            index, path = effect
            table = replaced(machine.effects[index], path, end)
            kind = effect_kinds(every=True).get(str(table.pop("kind", None)))
            if kind is not None:
                check_table(kind, table, _beyond(machine, uncertain), f"effect[{index + 1}]")
        elif uncertain.key in MACHINE_KEYS:
            part, name = uncertain.key.split(".")
            held: TomlTable = machine.table if part == "machine" else machine.probe
            check_table(type(held), {**held.model_dump(), name: end}, _beyond(machine, uncertain), part)
        else:
            expected = f"a plain value; uncertain may be parameters of effects and {', '.join(MACHINE_KEYS)}"
            raise InputError(machine.path, f"key {uncertain.key} cannot carry an uncertainty", expected=expected)


def _beyond(machine: Machine, uncertain: Uncertain) -> str:
    low, high = uncertain.ends
    drawn = f"{machine.path}: key {uncertain.key} may be drawn from {low:g} to {high:g} ({uncertain.distribution}"
    return drawn + (", uniform ends sooner)" if uncertain.distribution in ("normal", "student") else ")")


def effect_key(key: str) -> tuple[int, list[str]] | None:
    """Index of the effect and path of the parameter of a key like ``effect[1].coefficients.a``; None for others."""
    match = _EFFECT_KEY.fullmatch(key)
    return (int(match[1]) - 1, match[2].split(".")) if match else None


def draw(
    inputs: MonteCarloInputs,
    seed: int,
    runs: Sequence[int],
    n_faces: int,
    n_rows: int,
    only: str | None = None,
    correlation: Array | None = None,
) -> Draws:
    """The draws of some runs, always the same for a run number and a seed.

    Every run has its own counter-based stream (Philox, key = seed and run), so that nothing depends on which process
    draws it or together with which others. ``only``: hold all inputs but this one at their best estimates.
    ``correlation``: matrix of the certified positions, ``(n_faces, n_faces)``; None for independent ones.
    """
    uniform = np.empty((len(runs), len(inputs.scalars)))
    certificate = np.empty((len(runs), n_faces)) if inputs.certificate and only in (None, CERTIFICATE) else None
    noise = np.empty((len(runs), n_rows)) if inputs.repeatability and only in (None, REPEATABILITY) else None
    philox = np.random.Philox(key=[seed, 0])
    fresh, random = philox.state, np.random.Generator(philox)
    for row, run in enumerate(runs):
        fresh["state"]["key"][1] = run  # setting the state is four times as fast as a generator of its own
        philox.state = fresh
        random.random(out=uniform[row])
        faces = random.standard_normal(n_faces)
        if certificate is not None:
            certificate[row] = faces
        if noise is not None:
            random.standard_normal(out=noise[row])
    if certificate is not None and correlation is not None:
        certificate = certificate @ _square_root(correlation)
    scalar = {
        scalar.key: scalar.draw(uniform[:, i : i + 1])
        for i, scalar in enumerate(inputs.scalars)
        if only in (None, scalar.key)
    }
    return Draws(len(runs), scalar, certificate, noise)


def _square_root(correlation: Array) -> Array:
    """The symmetric square root of a correlation matrix, which may be singular (fully correlated faces)."""
    values, vectors = np.linalg.eigh(correlation)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def pooled_deviation_um(results: Sequence[PlacementResult]) -> tuple[float, int]:
    """Standard deviation of one probing from the repeats of all faces, um, and its degrees of freedom.

    JCGM 100:2008, 4.2.4: the sum of n - 1 over the faces. NaN and 0 without repeats.
    """
    deviation = np.concatenate([np.where(r.face % 2 == 1, r.sf_um, r.sb_um) for r in results])
    freedom = np.concatenate([np.maximum(r.count - 1, 0) for r in results])
    known = np.isfinite(deviation) & (freedom > 0)
    if not known.any():
        return float("nan"), 0
    total = int(freedom[known].sum())
    return float(np.sqrt((deviation[known] ** 2 * freedom[known]).sum() / total)), total
