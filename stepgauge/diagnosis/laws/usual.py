"""What size of a law is usual with this gauge, on this machine: the median of its prior, and what it was made from.

The table of the priors holds for a machine and a gauge of ordinary size and grade (``[sizes]``). Errors of a machine's
axes grow with its grade, the sag of a gauge with the fourth power of its length, the bending of a stylus with the third
power of its length, and a defect of a block is one only beyond what its certificate states.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stepgauge.diagnosis.priors import Priors, SizePriors
from stepgauge.effects import Effect
from stepgauge.effects.following import PART_OF
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine

SAG_LENGTH_MM, SAG_HEIGHT_MM, STYLUS_MM = 1000.0, 30.0, 50.0
"""Gauge and stylus for which the table states sag and compliance: sag ~ length^4 / height^2, compliance ~ length^3."""


@dataclass(frozen=True)
class Usual:
    """``size``: median, in the unit of the linear parameter; ``factors``: what multiplied that of the table.

    ``most``: the largest standard deviation of the size that is possible.
    """

    size: float
    factors: dict[str, float]
    most: float


def usual_size(
    law: type[Effect],
    priors: Priors,
    gauge: Gauge | None = None,
    machine: Machine | None = None,
    span_mm: float | None = None,
    choices: Mapping[str, object] | None = None,
) -> Usual:
    """The usual size of a law; without a gauge or a machine file that of the table.

    ``span_mm``: from the first to the last position that is measured; without it the length of the gauge. ``choices``:
    those of the law, such as its column.
    """
    prior = priors.laws.of(law.kind)
    factors, most = dict(_BASES[prior.basis](priors.sizes, gauge, machine)), prior.most
    if choices is not None and is_corrected(law.kind, choices):
        factors["the evaluation corrects for this temperature: what is left is of the coefficient"] = (
            priors.laws.corrected
        )
        most = min(most, priors.laws.corrected_most)
    if gauge is not None and is_per_length(law):
        span = float(gauge.position_mm[-1]) if span_mm is None else span_mm
        if 0.0 < span < priors.sizes.shortest_mm:
            factors[f"over {span:g} mm an error is as large, in um, as over {priors.sizes.shortest_mm:g} mm"] = (
                priors.sizes.shortest_mm / span
            )
    return Usual(prior.usual * float(np.prod(list(factors.values()))), factors, most)


def is_corrected(kind: str, choices: Mapping[str, object]) -> bool:
    """Whether a length follows the temperature for which the evaluation corrects it."""
    return kind == "thermal_expansion_of" and PART_OF.get(str(choices["column"])) == choices["of"]


def is_per_length(law: type[Effect]) -> bool:
    """Whether the size of a law is stated per length."""
    return law.covariates[0] in ("coordinate", "position") and not is_height(law)


def is_height(law: type[Effect]) -> bool:
    """Whether the size of a law is in um, and not per a length that the law states."""
    units = {p.unit for p in law.parameters() if p.role == "linear"}
    return units == {"um"} and "length_mm" not in law.model_fields


Factors = Iterator[tuple[str, float]]


def _no_factors(sizes: SizePriors, gauge: Gauge | None, machine: Machine | None) -> Factors:
    yield from ()


def _grade_factors(sizes: SizePriors, gauge: Gauge | None, machine: Machine | None) -> Factors:
    if machine is not None and machine.table.repeatability_um > 0.0:
        um = machine.table.repeatability_um
        yield (
            f"repeatability {um:g} um, of the machine of the table {sizes.repeatability_um:g} um",
            (um / sizes.repeatability_um),
        )


def _sag_factors(sizes: SizePriors, gauge: Gauge | None, machine: Machine | None) -> Factors:
    if gauge is not None:
        length, height = float(gauge.position_mm[-1]), gauge.table.rail_height_mm
        yield f"the gauge is {length:g} mm long (power 4)", (length / SAG_LENGTH_MM) ** 4
        yield f"its bar is {height:g} mm high (power -2)", (SAG_HEIGHT_MM / height) ** 2


def _certificate_factors(sizes: SizePriors, gauge: Gauge | None, machine: Machine | None) -> Factors:
    if gauge is not None and (u_um := float(np.median(gauge.u_um))) > sizes.certificate_um:
        yield f"the certificate states u = {u_um:.2g} um", u_um / sizes.certificate_um


def _stylus_factors(sizes: SizePriors, gauge: Gauge | None, machine: Machine | None) -> Factors:
    if machine is not None:
        length = machine.probe.shank_length_mm
        yield f"the stylus is {length:g} mm long (power 3)", (length / STYLUS_MM) ** 3


_BASES: dict[str, Callable[[SizePriors, Gauge | None, Machine | None], Factors]] = {
    "": _no_factors,
    "grade": _grade_factors,
    "sag": _sag_factors,
    "certificate": _certificate_factors,
    "stylus": _stylus_factors,
}


def size_of_shape(kind: str, shape: Mapping[str, Any], shapes: Sequence[Mapping[str, Any]]) -> float:
    """The size that is usual with this shape of a law, over that of its kind; ``shapes``: all that are tried.

    A drift that has ended within an hour moved by what is usual in an hour, however quickly: its rate is higher. One
    that is linear in the recording has a longer time constant than any that is tried.
    """
    if kind != "thermal_drift":
        return 1.0
    tried = [constant for one in shapes if (constant := one["time_constant_h"]) is not None]
    constant_h = shape["time_constant_h"] or max(tried, default=1.0)
    return max(1.0, 1.0 / float(constant_h))


def odds_of(kind: str, priors: Priors) -> float:
    """Prior odds that a law of this kind is there, of a recording that can show it."""
    return priors.laws.odds * priors.laws.of(kind).odds
