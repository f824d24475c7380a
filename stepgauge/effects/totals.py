"""Sums over effects: the total displacement, the scatter, and the share of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stepgauge.effects.base import Displacement, Effect
from stepgauge.effects.empirical import holds
from stepgauge.effects.probings import Probings
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array

BLOCK_ROWS = 16384
"""Rows worked on at a time: a dozen columns of them stay in a processor's cache."""


def total_displacement_um(effects: Sequence[Effect], probings: Probings) -> Array:
    """Sum of the displacements of all effects in machine axes, um, shape ``(n, 3)``."""
    total = np.zeros((len(probings), 3))
    if effects:
        for rows, block in probings.blocks(BLOCK_ROWS):
            for column, um in enumerate(added_up(effects, block)):
                total[rows, column] = um
    return total


def added_up(effects: Sequence[Effect], probings: Probings) -> tuple[Array, Array, Array]:
    """Sums of the displacements on x, y and z, um, of shape ``(n,)`` or, with parameters by run, ``(runs, n)``."""
    sums: dict[str, Array] = {}
    for effect in effects:
        for component, um in displacement_um(effect, probings).items():
            sums[component] = sums[component] + um if component in sums else um
    along = sums.get("approach")
    if along is not None:
        for axis in "xyz":
            share = along * probings.approach(axis)
            sums[axis] = sums[axis] + share if axis in sums else share
    zero = np.zeros(len(probings))
    return sums.get("x", zero), sums.get("y", zero), sums.get("z", zero)


def displacement_um(effect: Effect, probings: Probings) -> Displacement:
    """Displacement of one effect, um, in each row with the stylus that it was probed with.

    :class:`InputError` names the effect as in the machine file.
    """
    try:
        found = _where_it_acts(effect, probings)
        for rows, others in probings.iterate_styli():
            other = _where_it_acts(effect, others)
            found = {one: np.where(rows, other.get(one, 0.0), found.get(one, 0.0)) for one in {**found, **other}}
        return found
    except InputError as error:
        raise error.at(f'[[effect]] kind = "{effect.kind}"') from None


def _where_it_acts(effect: Effect, probings: Probings) -> Displacement:
    found = effect.displacement_um(probings)
    if effect.when is None:
        return found
    there = holds(effect.when, probings)
    return {component: um * there for component, um in found.items()}


def along_approach_um(effect: Effect, probings: Probings) -> Array:
    """Displacement of one effect along the approach, um, shape ``(n,)``; other directions are not measured."""
    total = np.zeros(len(probings))
    for component, um in displacement_um(effect, probings).items():
        total = total + (um if component == "approach" else um * probings.approach(component))
    return total


def latched_um(effects: Sequence[Effect], probings: Probings) -> Array:
    """Standard deviation of what depends on a phase that nobody recorded, um, shape ``(n,)``."""
    total = np.zeros(len(probings))
    for effect in effects:
        um = effect.latched_um(probings)
        if um is not None:
            total = np.hypot(total, um if effect.when is None else um * holds(effect.when, probings))
    return total


def scatter_um(effects: Sequence[Effect], probings: Probings, repeatability_um: float | Array) -> list[Array]:
    """Standard deviation along the approach with the first 0, 1, 2, ... effects, um; the last one is the total."""
    steps: list[Array] = [np.asarray(repeatability_um, float)]
    for effect in effects:
        try:
            extra = effect.scatter_um(probings)
            if extra is not None and effect.when is not None:
                extra = extra * holds(effect.when, probings)
        except InputError as error:
            raise error.at(f'[[effect]] kind = "{effect.kind}"') from None
        steps.append(steps[-1] if extra is None else np.sqrt(steps[-1] ** 2 + extra**2))
    return steps
