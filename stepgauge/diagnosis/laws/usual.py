"""What size of a law is usual with this gauge, on this machine: the median of its prior, and what it was made from.

The table of the priors holds for a machine and a gauge of ordinary size and grade (``[sizes]``). Errors of a machine's
axes grow with its grade, the sag of a gauge with the fourth power of its length, the bending of a stylus with the third
power of its length, and a defect of a block is one only beyond what its certificate states.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
    prior, sizes = priors.laws.of(law.kind), priors.sizes
    factors, most = dict(_factors(prior.basis, sizes, gauge, machine)), prior.most
    if (
        law.kind == "thermal_expansion_of"
        and choices is not None
        and PART_OF.get(str(choices["column"])) == choices["of"]
    ):
        factors["the evaluation corrects for this temperature: what is left is of the coefficient"] = (
            priors.laws.corrected
        )
        most = min(most, priors.laws.corrected_most)
    units = {p.unit for p in law.parameters() if p.role == "linear"}
    per_length = units != {"um"} or "length_mm" in law.model_fields
    if gauge is not None and law.covariates[0] in ("coordinate", "position") and per_length:
        span, least = float(gauge.position_mm[-1]) if span_mm is None else span_mm, sizes.shortest_mm
        if 0.0 < span < least:
            factors[f"over {span:g} mm an error is as large, in um, as over {least:g} mm"] = least / span
    return Usual(prior.usual * float(np.prod(list(factors.values()))), factors, most)


def _factors(
    basis: str, sizes: SizePriors, gauge: Gauge | None, machine: Machine | None
) -> Iterator[tuple[str, float]]:
    """What a size of the table is multiplied by, by what it depends on; nothing of what is not known."""
    if basis == "grade" and machine is not None and (um := machine.table.repeatability_um) > 0.0:
        usual = sizes.repeatability_um
        yield f"repeatability {um:g} um, of the machine of the table {usual:g} um", um / usual
    if basis == "sag" and gauge is not None:
        length, height = float(gauge.position_mm[-1]), gauge.table.rail_height_mm
        yield f"the gauge is {length:g} mm long (power 4)", (length / SAG_LENGTH_MM) ** 4
        yield f"its bar is {height:g} mm high (power -2)", (SAG_HEIGHT_MM / height) ** 2
    if basis == "certificate" and gauge is not None and (u_um := float(np.median(gauge.u_um))) > sizes.certificate_um:
        yield f"the certificate states u = {u_um:.2g} um", u_um / sizes.certificate_um
    if basis == "stylus" and machine is not None:
        length = machine.probe.shank_length_mm
        yield f"the stylus is {length:g} mm long (power 3)", (length / STYLUS_MM) ** 3


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
