"""How often an ideal observer is right: the bound that no diagnosis can be expected to pass.

The observer knows the noise and the certificate's uncertainty, the list of mechanisms, and of each the exact shape that
it has in this measurement (one drawing; of what is concealed, the true one). It does not know which of them are there,
nor how strong they are. It weighs sets of mechanisms by Bayes' rule and answers as a diagnosis does. The README states
the assumptions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from math import lgamma, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind import axis_causes as axes
from benchmarks.blind import machine_causes as machine
from benchmarks.blind import outsiders
from benchmarks.blind import probe_causes as probe
from benchmarks.blind import run_causes as run
from benchmarks.blind import temperature_causes as temperature
from benchmarks.blind.cause import Cause, along, nuisances, without
from benchmarks.blind.identify import NEAR_CHI2, whitener
from benchmarks.blind.scatter import Scatter
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Random = np.random.Generator
Make = Callable[[Scene, Random], Cause]
Set = tuple[int, ...]
DRAWS = 200
"""Drawings of the noise; the share right is known to 0.035 or better for one case, to 0.002 over a class."""
LOG_DOUBT = log(20.0)
"""Names whose posterior is within 20 of the best are told with it, as not to be told apart."""
LEANING = 0.05
"""An axis along which no approach has this share, or two axes whose product has not, cannot be seen."""
UNSEEN = 1e-3
"""Share of a mechanism that must be left when origins are taken out."""
MORE_CAUSES = 0.25
"""Prior odds of every further cause; of one cause against nothing they are even."""


@dataclass(frozen=True)
class Signatures:
    """Mechanisms in one measurement, each of size 1: keys, products in units of the noise, which are concealed.

    ``usual`` is the standard deviation of the strength beforehand, in units of that at size 1: one, or less where the
    machine is displaced by more than twice of what the approaches show, because they hardly go that way. ``growth`` is
    the variance of a scatter that grows, where that is concealed, in units of its final one and of the noise.
    """

    keys: list[str]
    gram: Array
    usual: Array
    concealed: list[int]
    growth: Array | None = None


def mechanisms(scene: Scene) -> Iterator[Make]:
    """The causes of the catalogue that this measurement may show."""
    seen = [axis for axis in range(3) if np.abs(scene.approach[:, axis]).max() > LEANING]
    of_axis = (
        *(machine.scale_error, machine.scale_curvature, machine.periodic_scale_error, machine.local_scale_defect),
        *(machine.reversal_error, run.scale_temperature),
    )
    yield from (partial(make, axis=axis) for make in of_axis for axis in seen)
    leaning = [
        (a, b)
        for a, b in combinations(range(3), 2)
        if np.abs(scene.approach[:, a] * scene.approach[:, b]).max() > LEANING
    ]
    yield from (partial(machine.squareness, plane="xyz"[a] + "xyz"[b]) for a, b in leaning)
    yield from (partial(machine.angular_error, travel=a, rotation=b) for a, b in ((0, 2), (0, 1), (1, 2), (1, 0)))
    yield from (partial(machine.straightness, travel=a, sideways=b) for a, b in ((0, 1), (1, 0)) if (0, 1) in leaning)
    yield from (run.effective_radius, run.probe_lobing, run.trigger_delay, run.gauge_temperature, run.misalignment)
    yield from (run.block_defect, run.gauge_bending, run.approach_memory, run.outliers)
    yield from (run.thermal_drift, run.temperature_cycle, run.step_change)
    yield from (outsiders.power_law_memory, outsiders.time_sawtooth, outsiders.humidity, outsiders.random_walk)
    yield outsiders.cycle_offsets
    yield from _further_mechanisms(scene, seen, leaning)


def _further_mechanisms(scene: Scene, seen: list[int], leaning: list[tuple[int, int]]) -> Iterator[Make]:
    """Those of the probe, of further errors of the axes and of temperatures; last, so that earlier drawings stay."""
    of_axis = (
        *(axes.scale_joint, axes.scale_gap, axes.reversal_wear, axes.stick_slip, axes.cubic_scale),
        temperature.scale_warm_up,
    )
    yield from (partial(make, axis=axis) for make in of_axis for axis in seen)
    ways = ((0, 1), (1, 0)) if (0, 1) in leaning else ()
    yield from (partial(axes.cubic_straightness, travel=a, sideways=b) for a, b in ways)
    yield from (partial(axes.curved_rotation, travel=a, rotation=2) for a in (0, 1))
    yield from (probe.kinematic_pretravel, probe.seat_defect, probe.tip_change, probe.servo_lag)
    yield temperature.late_drift
    columns = {sensor.column for sensor in scene.sensors}
    if columns >= set(temperature.ROOM):
        yield temperature.thermal_shift
        yield from (partial(temperature.thermal_expansion_of, axis=axis) for axis in seen)
    if temperature.TOP in columns:
        yield from (partial(temperature.thermal_bending, travel=a, sideways=b) for a, b in ways)
    yield from (partial(temperature.gauge_soaking, anew=anew) for anew in (False, True))


def signatures_of(scene: Scene, scatter: Scatter, concealed: Sequence[Cause], random: Random) -> Signatures:
    """All mechanisms that can be seen in this measurement: what is concealed as it is, of every other one drawing."""
    causes = list(concealed)
    for make in mechanisms(scene):
        try:
            other = make(scene, random)
        except ValueError:  # no placing along that axis
            continue
        if other.key not in [cause.key for cause in causes]:
            causes.append(other)
    drawn = [_of_size_one(scene, cause) for cause in causes]
    visible = [k for k, (column, _) in enumerate(drawn) if column.any() or k < len(concealed)]
    whiten = whitener(scene, scatter)
    white, origins = whiten(np.array([drawn[k][0] for k in visible])), whiten(nuisances(scene, radius=False).T)
    base = np.linalg.qr(origins.T)[0]
    white = white - (white @ base) @ base.T
    return Signatures(
        keys=[causes[k].key for k in visible],
        gram=scatter.information * white @ white.T,
        usual=np.array([drawn[k][1] for k in visible]),
        concealed=list(range(len(concealed))),
        growth=_growth(scene) if [cause.kind for cause in concealed] == ["noise_growth"] else None,
    )


def _of_size_one(scene: Scene, cause: Cause) -> tuple[Array, float]:
    """The mechanism along the approach, um, at size 1 (zeros where it cannot be seen), and how usual such a size is."""
    moved = cause.displace(cause.start)
    raw = along(scene, moved)
    rms = _rms(without(nuisances(scene, radius=not cause.radius_is_effect), raw))
    if rms <= UNSEEN * _rms(raw):
        return np.zeros(len(scene)), 1.0
    for place in np.unique(scene.placement):
        moved = moved - (scene.placement == place)[:, None] * moved[scene.placement == place].mean(axis=0)
    shown = _rms(along(scene, moved)) / max(_rms(moved) * np.sqrt(3.0), 1e-300)
    return raw * scene.sigma_um / rms, float(np.clip(2.0 * shown, 1e-6, 1.0))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _growth(scene: Scene) -> Array:
    return np.asarray(((scene.time_s - scene.time_s[0]) / np.ptp(scene.time_s)) ** 4 / scene.sigma_um**2)


def bound(signatures: Signatures, truths: Sequence[Mapping[str, Any]], seed: int) -> float:
    """Share of drawings of the noise in which the observer's answer is right."""
    if signatures.growth is not None:
        return _growth_found(signatures, float(truths[0]["strength"]), np.random.default_rng([seed, 77]))
    weight, classes, _ = weighed(signatures, truths, seed)
    return float(np.mean(_is_right(weight, classes)))


def weighed(
    signatures: Signatures, truths: Sequence[Mapping[str, Any]], seed: int
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Log posterior odds of sets against nothing for drawings of the noise ``(draws, sets)``.

    With what each set is (:data:`RIGHT` and so on) and how many mechanisms it has, ``(sets,)``.
    """
    random = np.random.default_rng([seed, 77])
    gram, concealed = signatures.gram, signatures.concealed
    sizes = np.array([truth["size"] for truth in truths])
    values, vectors = np.linalg.eigh(gram)
    noise = random.standard_normal((DRAWS, len(gram))) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
    seen = noise + gram[:, concealed] @ sizes
    parts = _by_length(neighbours(concealed, len(gram)))
    weight = np.concatenate([_log_weight(signatures, part, seen) for part in parts], axis=1)
    classes = np.array([_class_of(signatures, truths, one) for part in parts for one in part])
    return weight, classes, np.array([len(one) for part in parts for one in part])


def neighbours(concealed: Sequence[int], count: int) -> list[Set]:
    """Every part of what is concealed, alone and with any one other mechanism."""
    parts = [part for size in range(len(concealed) + 1) for part in combinations(concealed, size)]
    more = {tuple(sorted((*part, k))) for part in parts for k in range(count) if k not in part}
    return sorted(set(parts) | more)


def _by_length(sets: Sequence[Set]) -> list[list[Set]]:
    return [[one for one in sets if len(one) == length] for length in range(max(map(len, sets)) + 1)]


def _log_weight(signatures: Signatures, sets: Sequence[Set], seen: Array) -> Array:
    """Log posterior odds against nothing, up to a constant, shape ``(draws, sets)``; strengths normal about zero."""
    length = len(sets[0])
    if not length:
        return np.zeros((len(seen), 1))
    rows = np.array(sets)
    usual = signatures.usual[rows]
    precision = signatures.gram[rows[:, :, None], rows[:, None, :]] + np.eye(length) / usual[:, :, None] ** 2
    part = seen[:, rows]
    gain = np.einsum("dsi,sij,dsj->ds", part, np.linalg.inv(precision), part) / 2.0
    paid = np.linalg.slogdet(precision)[1] / 2.0 + np.log(usual).sum(axis=1)
    prior = _log_priors(signatures)[rows].sum(axis=1) + lgamma(length + 1) + (length - 1) * log(MORE_CAUSES)
    return np.asarray(gain - paid + prior)


def _log_priors(signatures: Signatures) -> Array:
    """All kinds alike, and within a kind all its axes, planes or faces."""
    kinds = [key.partition(":")[0] for key in signatures.keys]
    return np.array([-log(len(set(kinds)) * kinds.count(kind)) for kind in kinds])


RIGHT, NEAR, FAR, OTHER = 0, 1, 2, 3
"""What a set is: the truth; a name of it exchanged for one that may be mentioned; for another one; anything else."""


def _class_of(signatures: Signatures, truths: Sequence[Mapping[str, Any]], one: Set) -> int:
    concealed = signatures.concealed
    missing, added = [k for k in concealed if k not in one], [k for k in one if k not in concealed]
    if not missing and not added:
        return RIGHT
    if len(missing) != 1 or len(added) != 1:
        return OTHER
    return NEAR if _may_be_mentioned(truths[concealed.index(missing[0])], signatures.keys[added[0]]) else FAR


def _may_be_mentioned(truth: Mapping[str, Any], key: str) -> bool:
    kind = key.partition(":")[0]
    if truth["kind"] in outsiders.BEYOND and kind in outsiders.BEYOND:
        return bool(set(outsiders.LIVES_IN[kind]) & set(outsiders.LIVES_IN[truth["kind"]]))
    return truth["leftover_chi2"].get(key, np.inf) < NEAR_CHI2 or kind == truth["kind"] == "straightness"


def _is_right(weight: Array, classes: Array) -> Array:
    """The best set is the truth or near to it, the truth is not ruled out, and nothing far is told with it."""
    doubt = weight > weight.max(axis=1, keepdims=True) - LOG_DOUBT
    best = classes[weight.argmax(axis=1)]
    told = doubt[:, classes == RIGHT].any(axis=1) & ~doubt[:, classes == FAR].any(axis=1)
    return np.asarray(((best == RIGHT) | (best == NEAR)) & told)


def _growth_found(signatures: Signatures, strength_um: float, random: Random) -> float:
    """The same for a scatter that grows, whose law and strength are known, against a constant one."""
    more = np.asarray(signatures.growth) * strength_um**2
    residual2 = random.standard_normal((DRAWS, len(more))) ** 2 * (1.0 + more)
    gain = (residual2 @ (more / (1.0 + more)) - np.log1p(more).sum()) / 2.0
    return float(np.mean(gain - log(len(signatures.keys)) > 0.0))
