"""Laws that hold in a part of the record only: beyond a coordinate, after a time, above a temperature, one way.

Such a law is the law with a condition (``when``) of one covariate. All laws with all conditions would be too many to
look at from the start: the search asks for those of the laws that it has found, or that are near a form it has found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.laws.grids import goes_both_ways, temperatures
from stepgauge.diagnosis.laws.library import SEEN_SHARE, Family, family_signatures, whole
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects.empirical import holds
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Law
from stepgauge.recording import POSITION
from stepgauge.recording.columns import STYLUS

EDGES = 60
"""Most edges that are tried over a covariate."""
SMALLEST = 1.0 / 16.0
"""Smallest part of the record."""
FEWEST_VALUES = 16
"""Values of a covariate from which on edges are tried: with fewer its values tell levels apart, not a place."""
DIGITS = 6
OF_A_TRAVEL = {"error_motion", "scale_curvature", "straightness"}
"""Polynomials over a whole travel: one that begins somewhere in it is a form."""
OF_THE_PROBE = {"kinematic_pretravel", "lever_arm", "pretravel_scale", "probe_lobing", "seat_defect"}
"""Kinds that the stylus has a part in, besides its radius."""


@dataclass(frozen=True)
class PartOfRecord:
    """A covariate beyond some edge: ``name`` as ``x_mm >``; ``formulas`` that effects understand, one for each edge.

    ``rows (edges, n)``: where each holds.
    """

    name: str
    formulas: tuple[str, ...]
    rows: NDArray[np.bool_]


def conditions(data: Residuals) -> Iterator[PartOfRecord]:
    """The conditions by which this recording has two parts."""
    for name, formulas in _formulas(data):
        yield PartOfRecord(name, formulas, np.array([holds(one, data.probings) for one in formulas]))


def _formulas(data: Residuals) -> Iterator[tuple[str, tuple[str, ...]]]:
    for name in (*POSITION, *(("time_s",) if data.has_time else ()), *temperatures(data)):
        edges = [edge for edge in _edges(data.probings.column(name)) if _parts_places(name, edge, data)]
        for sense in (">", "<"):
            if edges:
                yield f"{name} {sense}", tuple(f"{name} {sense} {edge:.{DIGITS}g}" for edge in edges)
    if data.has_time and goes_both_ways(data):
        yield from ((f"way {sense}", (f"way {sense} 0",)) for sense in (">", "<"))


def stylus_conditions(data: Residuals) -> Iterator[PartOfRecord]:
    """One stylus against the others, by an edge between their numbers."""
    met = np.unique(data.stylus)
    edges = (met[1:] + met[:-1]) / 2.0
    for sense, beyond in ((">", np.greater), ("<", np.less)) if len(edges) else ():
        formulas = tuple(f"{STYLUS} {sense} {edge:g}" for edge in edges)
        yield PartOfRecord(f"{STYLUS} {sense}", formulas, beyond(data.stylus, edges[:, None]))


def _edges(values: Array) -> list[float]:
    """Places between neighbouring values, evenly over the readings; none where a covariate has a few values only."""
    met = np.unique(values)
    if len(met) < FEWEST_VALUES or np.ptp(met) < 1e-6 * max(float(np.abs(met).max()), 1.0):
        return []
    share = np.linspace(SMALLEST, 1.0 - SMALLEST, EDGES)
    place = np.clip(np.searchsorted(met, np.quantile(values, share)), 1, len(met) - 1)
    return sorted({float((met[i - 1] + met[i]) / 2.0) for i in place})


def _parts_places(name: str, edge: float, data: Residuals) -> bool:
    """Whether an edge does not divide a placing by a coordinate along which its gauge does not reach.

    Its touches differ there by how the gauge lies, not by where the machine is.
    """
    if name not in POSITION:
        return True
    values, place = data.probings.column(name), POSITION.index(name)
    return all(
        abs(axis[place]) > SEEN_SHARE or not own.min() < edge < own.max()
        for number, axis in data.probings.setting.axis.items()
        if (own := values[data.frame["placement"].to_numpy() == number]).size
    )


def part_laws(data: Residuals, priors: Priors, every: tuple[PartOfRecord, ...], law: Law, atom: int) -> list[Law]:
    """A law with one of its shapes, under every condition; none of a law that has a condition already."""
    family: Family = law.source
    if law.combined or "when" in family.atoms[atom]:
        return []
    odds = law.log_odds + float(law.log_weight[atom])
    every = tuple(one for one in every if may_have(family, one.name))
    rare = odds + float(np.log(priors.laws.part / max(len(every), 1)))
    everywhere = family_signatures(family, family.atoms[atom], data)
    tried = [_under(one, law, atom, everywhere, rare, data) for one in every]
    if law.kind in OF_THE_PROBE:  # what is wrong with one stylus need not be with another
        tried += [_under(one, law, atom, everywhere, odds, data) for one in stylus_conditions(data)]
    return [one for one in tried if one is not None]


def may_have(family: Family, condition: str) -> bool:
    """Whether a law can hold in such a part only.

    What has a place or a beginning of its own has no further edge, and an error of a scale or a guideway may change
    along the axis that it belongs to, not along another: how axes act on each other is stated by the chain.
    """
    if any(p.edge for p in family.law.parameters()):
        return False
    of_axis = family.law.covariates[0] == "coordinate" and condition.split()[0] in POSITION
    if of_axis and family.kind in OF_A_TRAVEL:
        return False
    return not of_axis or condition[0] in "".join(str(value) for value in family.choices.values())


def _under(condition: PartOfRecord, law: Law, atom: int, everywhere: Array, odds: float, data: Residuals) -> Law | None:
    family: Family = law.source
    atoms = [{**family.atoms[atom], "when": formula} for formula in condition.formulas]
    pattern = everywhere * condition.rows[:, None, :]
    told = [is_told(family, one, data) for one in pattern]
    if not any(told):
        return None
    atoms, pattern = [atom for atom, tell in zip(atoms, told, strict=True) if tell], pattern[told]
    label = f"{family.label} where {condition.name}"
    own = replace(family, label=label, atoms=atoms, pattern=pattern, shares=None, within=family.ranges)
    return replace(
        law,
        label=f"{law.label} where {condition.name}",
        log_odds=odds,
        again=0.0,
        source=own,
        pattern=pattern,
        shares=whole(len(data)),
        log_weight=np.full(len(atoms), -np.log(len(atoms))),
        refine=None,
        discrepancy=None,
    )


def is_told(family: Family, signature: Array, data: Residuals) -> bool:
    """Whether a part has more faces, probed in some direction, than the law and its edge have parameters."""
    free = [p for p in family.law.parameters() if p.role == "nonlinear" and p.name in family.atoms[0]]
    inside = np.abs(signature).max(axis=0) > 0.0
    return len(np.unique(data.group[inside])) > family.dimension + len(free) + 1


def laws_in_parts(data: Residuals, priors: Priors) -> partial[list[Law]]:
    """What a search asks for laws in a part of this recording: from a law and the number of its shape."""
    return partial(part_laws, data, priors, tuple(conditions(data)))
