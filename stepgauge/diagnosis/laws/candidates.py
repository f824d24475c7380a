"""The laws of the vocabulary as candidates: their signatures in this recording, with their priors."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from stepgauge.diagnosis.fits.solve import fitted_effect
from stepgauge.diagnosis.laws.discrepancy import Discrepancy, UnobservedCourses, is_process
from stepgauge.diagnosis.laws.grids import ALL, is_common, usual_shape
from stepgauge.diagnosis.laws.library import Family, effect_families, family_signatures
from stepgauge.diagnosis.laws.usual import odds_of, size_of_shape, usual_size
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array, Rows
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import AmplitudePrior, Law, Refined

OF_THE_PROBE = ("kinematic_pretravel", "seat_defect")
"""Laws of which a recording has one, since it was made with one probe."""
BESIDE_FIRST, ALONE = 1e-9, 30.0
"""What the log odds of a first wave or step rise by beside a second one: nothing; what a second lacks without it."""
SAME_PERIOD = 1e-9
"""Share of a period by which one on the grid may differ from a whole part of a turn."""


def law_candidates(data: Residuals, priors: Priors, metric: Metric, without: Collection[str] = ()) -> list[Law]:
    """Candidates for all laws with a signature here; ``metric``: for the fit of shapes between points of the grid."""
    families = [one for whole in effect_families(data, priors, without) for one in _apart_in_turn(whole, data.probings)]
    share, labels, patterns = _shares(families, priors, data), Counter[str](), dict[int, Array]()
    courses = dict[int, UnobservedCourses]()
    found = []
    for family, own in zip(families, share, strict=True):
        labels[family.label] += 1
        label = family.label if labels[family.label] == 1 else f"{family.label} #{labels[family.label]}"
        every = {p.name: usual_shape(p, data.machine) for p in family.law.parameters() if p.name in family.atoms[0]}
        family = replace(family, about={name: usual for name, usual in every.items() if usual is not None})
        sizes, log_odds = sizes_of(family, priors, data), float(np.log(odds_of(family.kind, priors) * own))
        again = None if is_common(family.kind, family.choices) else priors.laws.of(family.kind).again
        if id(family.pattern) not in patterns:
            size = np.array([size_of_shape(family.kind, atom, family.atoms) for atom in family.atoms])
            usual = size.astype(family.pattern.dtype)[:, None, None]
            patterns[id(family.pattern)] = family.pattern if (size == 1.0).all() else usual * family.pattern
            courses[id(family.pattern)] = UnobservedCourses(family.pattern)
        tolerance = priors.laws.discrepancy if is_process(family) else 0.0
        beside = Discrepancy(family, courses[id(family.pattern)], data, tolerance)
        found.append(
            Law(
                family.kind,
                label,
                True,
                log_odds,
                sizes,
                replace(family, prior=float(sizes.sd.max()), sizes=sizes),
                pattern=patterns[id(family.pattern)],
                shares=family.share_rows,
                log_weight=family.log_weight,
                positive=family.positive,
                least=priors.laws.of(family.kind).least,
                once=family.kind in OF_THE_PROBE,
                again=0.0 if again is None else float(np.log(again)) - log_odds,
                refine=partial(_refined, family, data, metric, beside) if len(family.atoms) > 1 else None,
                discrepancy=beside if beside.any else None,
            )
        )
    return found if data.probings.setting.recording == "gauge" else [two for one in found for two in _twice(one)]


def _twice(law: Law) -> Iterator[Law]:
    """A wave or step, and a second one of its kind that is there beside the first only; any other law once.

    A scale or a drive has several periods, and one of them may be told in time beside one along the axis.
    """
    own = law.source.law
    if (len(own.sines()) != 1 and not own.several) or law.source.alone is not None:
        yield law
        return
    first = replace(law, again=BESIDE_FIRST)
    yield first
    second = replace(law, label=f"{law.label} #again", log_odds=law.log_odds - ALONE, again=ALONE, first=first)
    yield replace(second, pattern=law.pattern[:])  # another array: tables know a pattern by its identity


def _apart_in_turn(family: Family, probings: Probings) -> Iterator[Family]:
    """A family without its few periods in a turn of a rotary axis, and each of these by itself; any other as it is.

    Whatever turns with the axis has the same error after a turn, a Fourier series of the angle. Its first terms have
    causes of their own (eccentricity, tilt), which stand together, and periods that no reading has to tell. Shorter
    waves are of gears, lines and poles, of which one of many is there: a law with a period to be found.
    """
    turn_mm, per_turn = probings.setting.turn_mm, family.law.per_turn()
    if turn_mm is None or not per_turn:
        yield family
        return
    name = family.law.rhythm()[0]
    count = turn_mm / np.array([atom[name] for atom in family.atoms])
    whole = {n: np.flatnonzero(np.abs(count - n) < SAME_PERIOD * n) for n in per_turn}
    rest = np.setdiff1d(np.arange(len(count)), np.concatenate(list(whole.values())))
    if rest.size:
        yield _select(family, rest)
    for n, atoms in whole.items():
        if atoms.size:
            one = _select(family, atoms)
            yield replace(one, taken=one.taken | {name}, alone=per_turn[n], log_weight=np.zeros(1))


def _select(family: Family, rows: Rows) -> Family:
    """A family with some of its shapes."""
    kept = [family.atoms[int(row)] for row in rows]
    return replace(family, atoms=kept, pattern=family.pattern[rows], log_weight=family.log_weight[rows])


def usual_signature(family: Family, shape: dict[str, Any], data: Residuals) -> Array:
    """The signature of a shape, with its shares, for amplitudes as usual as those of the kind, ``(d, n)``."""
    return size_of_shape(family.kind, shape, family.atoms) * family_signatures(family, shape, data)


def _shares(families: Sequence[Family], priors: Priors, data: Residuals) -> list[float]:
    """The share of each law in the odds of its kind, which all choices have together.

    One of all axes at once is another cause than those of single ones, with odds of its own.
    """
    common = [one.choices.get("axis") == ALL for one in families]
    odds = [one.law.preference(one.choices) for one in families]
    rare = {kind: law.rarity(data.probings) for kind, law in {one.kind: one.law for one in families}.items()}
    whole = defaultdict[str, float](float)
    for family, own, every in zip(families, odds, common, strict=True):
        whole[family.kind] += 0.0 if every or family.alone is not None else own
    return [
        rare[family.kind] * (family.alone or (priors.laws.all_axes if every else own / max(whole[family.kind], own)))
        for family, own, every in zip(families, odds, common, strict=True)
    ]


def sizes_of(family: Family, priors: Priors, data: Residuals) -> AmplitudePrior:
    """Prior of a law's amplitudes, in the unit of its linear parameter.

    A misalignment is linear in its square; a law without an amplitude has the size one.
    """
    span_mm = float(np.ptp(data.probings.certified_mm()))
    usual = usual_size(family.law, priors, data.gauge, data.machine, span_mm, family.choices)
    if family.kind == "misalignment":
        wide = priors.sizes.about(usual.size)
        return AmplitudePrior(wide.sd**2, wide.log_weight)
    if not any(p.role == "linear" for p in family.law.parameters()):
        return AmplitudePrior(np.ones(1), np.zeros(1))
    return priors.sizes.about(usual.size, usual.most, priors.laws.of(family.kind).least)


def _refined(
    family: Family, data: Residuals, metric: Metric, beside: Discrepancy, atom: int, um: Array
) -> Refined | None:
    """The law with its shape fitted, starting from a shape of the grid."""
    if not any(isinstance(v, float | tuple) for v in family.atoms[atom].values()):
        return None
    try:
        effect = fitted_effect(family, atom, replace(data, um=um), metric)
    except (ValueError, FloatingPointError, np.linalg.LinAlgError):
        return None
    shape = {name: getattr(effect, name) for name in family.atoms[0]}
    gain = family.log_prior(shape) - family.log_prior(family.atoms[atom])
    return Refined(np.concatenate([usual_signature(family, shape, data), beside(atom, shape)]), shape, gain)
