"""Uncertainty budget of what ``evaluate`` reports (JCGM 100:2008, "GUM"), propagated with GTC.

Every quantity of the evaluation is linear in the mean readings of the faces, so that its sensitivities are found by
evaluating unit readings with the same equations (Pahk & Kim, 1 to 13). Each source of uncertainty moves the readings:
alone (certificate, repeatability, probing, resolution: by face) or together (temperatures, expansion, alignment,
effects of the machine file: one number for all faces, its response taken through the virtual CMM).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.face_errors import FaceStatistics, face_errors
from stepgauge.machine_file import StandardUncertainty
from stepgauge.montecarlo.inputs import CERTIFICATE, GAUGE_TEMPERATURE, REPEATABILITY
from stepgauge.montecarlo.model import Model, Part, pooled_deviation_um
from stepgauge.montecarlo.summary import Summary
from stepgauge.placement import Placement
from stepgauge.standards.coverage import APPROXIMATELY_95, Expanded, expand

Array = NDArray[np.float64]
Repeats = Literal["pooled", "face"]
PROBING, RESOLUTION, ALIGNMENT = "probing", "resolution", "alignment"
RADIUS_SHARE = {"xf_um": 0.0, "xb_um": -2.0, "xm_um": -1.0, "xr_um": -2.0}
"""How each error changes with the effective radius, by definition."""
NEGLIGIBLE = 1e-12


@dataclass(frozen=True)
class Asked:
    """What the person states for a budget beyond the files.

    ``placements``: in the order of the recording, or none; ``repeats``: one standard deviation for all faces
    (``"pooled"``, GUM 4.2.4) or one by face with n - 1 degrees of freedom; ``percent``: coverage probability.
    """

    placements: Sequence[Placement] = ()
    repeats: Repeats = "pooled"
    percent: float = APPROXIMATELY_95


@dataclass(frozen=True)
class Source:
    """A line of the list of sources: ``u`` in ``unit`` (two numbers where it varies by face), type A or B."""

    name: str
    kind: Literal["A", "B"]
    u: tuple[float, float]
    unit: str
    dof: float
    stated_by: str


@dataclass(frozen=True)
class Line:
    """One quantity; ``contribution`` by source and all else in um. ``through_radius`` is part of the others, too.

    ``same_terms_u``: of the sources that the Monte Carlo knows; ``monte_carlo``: u, low and high from there.
    """

    name: str
    placement: int
    face: int | None
    position_mm: float | None
    value: float
    expanded: Expanded
    contribution: dict[str, float]
    through_radius: float
    same_terms_u: float
    monte_carlo: tuple[float, float, float] | None


@dataclass(frozen=True)
class Budget:
    """All lines, the sources they come from, what was assumed, and what nobody stated (what, and how to state it)."""

    sources: tuple[Source, ...]
    lines: tuple[Line, ...]
    assumptions: tuple[str, ...]
    not_included: tuple[tuple[str, str], ...]
    percent: float


@dataclass(frozen=True)
class _Term:
    """A source as GTC numbers: ``um[i]`` is what it adds to the mean reading of face ``i`` of the section."""

    source: Source
    um: list[Any]


def make_budget(model: Model, asked: Asked | None = None, monte_carlo: Summary | None = None) -> Budget:
    """The budget of R_eff and of XF, XB, XM and XR at every face of every placement.

    Parameters
    ----------
    model : of a recording or a program, from :mod:`stepgauge.montecarlo`
    asked : what else is stated
    monte_carlo : of the same model, to stand beside the budget

    Raises
    ------
    InputError
        another number of placements than the model has, a model without any uncertainty
    """
    asked = asked or Asked()
    if asked.placements and len(asked.placements) != len(model.parts):
        expected = f"{len(model.parts)} or none"
        raise InputError(
            "--placement", "one placement file per placement", found=len(asked.placements), expected=expected
        )
    best = dict(zip(model.quantities, model.best(), strict=True))
    lines: list[Line] = []
    sources: dict[str, Source] = {}
    for index, part in enumerate(model.parts):
        terms = _terms(model, part, asked, asked.placements[index] if asked.placements else None)
        sources |= {term.source.name: _wider(sources.get(term.source.name), term.source) for term in terms}
        lines += _lines(model, part, terms, best, asked.percent, monte_carlo)
    if not sources:
        raise InputError(model.machine.path, "nothing that counts has an uncertainty")
    return Budget(
        tuple(sources.values()),
        tuple(lines),
        tuple(_assumptions(model, asked)),
        tuple(_missing(model, asked)),
        asked.percent,
    )


def _wider(one: Source | None, other: Source) -> Source:
    if one is None:
        return other
    u = (min(one.u[0], other.u[0]), max(one.u[1], other.u[1]))
    return Source(other.name, other.kind, u, other.unit, min(one.dof, other.dof), other.stated_by)


# --- sensitivities -----------------------------------------------------------------------------------------------


def sensitivities(model: Model, part: Part) -> dict[str, Array]:
    """Change of every quantity in um per um of the mean reading of every face.

    ``xf_um`` ... ``xr_um`` with shape ``(faces read, faces)``, ``r_eff_mm`` (in um) with ``(faces read,)``.
    """
    faces = part.readings.faces
    count = np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)[faces]
    unit = np.where(count > 0, np.eye(len(faces)), np.nan) * 1e-3
    seen = FaceStatistics(faces, count, unit, np.full_like(unit, np.nan))
    errors = face_errors(seen, np.zeros(len(faces)), model.origin)
    by_face = {name: np.asarray(getattr(errors, name)) for name in RADIUS_SHARE}
    return {**by_face, "r_eff_mm": errors.r_eff_mm * 1e3}


def _lines(
    model: Model,
    part: Part,
    terms: Sequence[_Term],
    best: dict[Any, Any],
    percent: float,
    monte_carlo: Summary | None,
) -> list[Line]:
    from stepgauge.montecarlo.model import Quantity

    share = sensitivities(model, part)
    radius = _weighed(terms, share["r_eff_mm"])
    lines = []
    wanted: list[tuple[Quantity, Array, float]] = [(Quantity("r_eff_mm", part.placement), share["r_eff_mm"], 1.0)]
    for name, coefficient in RADIUS_SHARE.items():
        for i, face in enumerate(part.readings.faces):
            wanted.append((Quantity(name, part.placement, int(face)), share[name][:, i], coefficient))
    for quantity, weights, coefficient in wanted:
        if math.isnan(best[quantity]) or not _defined(weights, part):
            continue
        parts = radius if quantity.face is None else _weighed(terms, weights)
        value = best[quantity] * (1e3 if quantity.face is None else 1.0)
        known = [number for name, number in parts.items() if name in model.inputs.names]
        lines.append(
            Line(
                quantity.name,
                quantity.placement,
                quantity.face,
                None if quantity.face is None else float(model.gauge.position_mm[quantity.face - 1]),
                float(value),
                expand(_total(parts.values()), percent),
                {name: expand(number, percent).u for name, number in parts.items()},
                abs(coefficient) * expand(_total(radius.values()), percent).u,
                expand(_total(known), percent).u,
                _from_runs(monte_carlo, quantity),
            )
        )
    return lines


def _defined(weights: Array, part: Part) -> bool:
    """Whether all faces that a quantity needs were measured; NaN stands at those that were not measured at all."""
    return bool(np.isfinite(weights[np.isin(part.readings.faces, part.readings.face)]).all())


def _weighed(terms: Sequence[_Term], weights: Array) -> dict[str, Any]:
    """The quantity with one source at a time, as GTC numbers."""
    needed = np.flatnonzero(np.abs(np.nan_to_num(weights)) > NEGLIGIBLE)
    return {term.source.name: _total(float(weights[i]) * term.um[i] for i in needed) for term in terms}


def _total(numbers: Any) -> Any:
    return sum(numbers, 0.0)


def _from_runs(monte_carlo: Summary | None, quantity: Any) -> tuple[float, float, float] | None:
    if monte_carlo is None:
        return None
    i = monte_carlo.quantities.index(quantity)
    scale = 1e3 if quantity.face is None else 1.0
    return tuple(scale * float(v[i]) for v in (monte_carlo.u, monte_carlo.low, monte_carlo.high))  # type: ignore[return-value]


# --- sources -----------------------------------------------------------------------------------------------------


def _terms(model: Model, part: Part, asked: Asked, placement: Placement | None) -> list[_Term]:
    found = [_certificate(model, part), _repeatability(model, part, asked.repeats)]
    found += [_scalar(model, part, index) for index in range(len(model.inputs.scalars))]
    found += [_probing(model, part), _resolution(model, part), _alignment(model, part, placement)]
    return [term for term in found if term is not None]


def _independent(u: Array, dof: float, name: str) -> list[Any]:
    """One number per face; one ensemble, so that a common count of degrees of freedom is not counted twice."""
    from GTC import multiple_ureal

    labels = [f"{name} {i}" for i in range(len(u))]
    return list(multiple_ureal([0.0] * len(u), [float(v) for v in u], dof, labels))


def _range(u: Array) -> tuple[float, float]:
    return float(u.min()), float(u.max())


def _certificate(model: Model, part: Part) -> _Term | None:
    from GTC import set_correlation

    gauge, faces = model.gauge, part.readings.faces
    u = gauge.u_um[faces - 1]
    if not u.any():
        return None
    dof = gauge.certificate.degrees_of_freedom or math.inf
    um = _independent(u, dof, CERTIFICATE)
    if gauge.correlation:
        certain = np.flatnonzero(u)
        for i, first in enumerate(certain):
            for second in certain[i + 1 :]:
                set_correlation(gauge.correlation, um[first], um[second])
    return _Term(Source(CERTIFICATE, "B", _range(u), "um", dof, "gauge file: uncertainty_um, coverage_factor"), um)


def _repeatability(model: Model, part: Part, repeats: Repeats) -> _Term | None:
    """Of the mean over the cycles: s / sqrt(n)."""
    faces = part.readings.faces
    count = np.maximum(np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)[faces], 1)
    _, freedom = pooled_deviation_um(model) if model.sign < 0 else (math.nan, 0)
    if freedom and repeats == "face":
        return _repeats_by_face(model, part, count)
    sigma = part_deviation_um(model, part)
    if not sigma.any():
        return None
    u, dof = sigma / np.sqrt(count), float(freedom) if freedom else math.inf
    said = "recording: pooled over the faces" if freedom else "machine file: repeatability_um"
    source = Source(REPEATABILITY, "A" if freedom else "B", _range(u), "um", dof, said)
    return _Term(source, _independent(u, dof, REPEATABILITY))


def part_deviation_um(model: Model, part: Part) -> Array:
    """Standard deviation of a probing of every face, um: pooled of a recording, as modelled of a program."""
    faces = part.readings.faces
    variance = np.bincount(part.readings.face, model.noise_um(part) ** 2, int(faces[-1]) + 1)
    count = np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)
    deviation: Array = np.sqrt(variance / np.maximum(count, 1))[faces]
    return deviation


def _repeats_by_face(model: Model, part: Part, count: NDArray[np.int64]) -> _Term:
    from GTC import ureal

    result = next(r for r in model.nominal.results if r.placement == part.placement)
    deviation = np.where(result.face % 2 == 1, result.sf_um, result.sb_um)
    single = (count < 2) & (result.count > 0)
    if single.any():
        raise InputError(
            model.nominal.path,
            f"face {result.face[single][0]} was probed once: it has no standard deviation of its own",
            expected="at least two cycles, or the pooled standard deviation (--repeats pooled)",
        )
    u = np.nan_to_num(deviation) / np.sqrt(count)
    um = [ureal(0.0, float(v), float(n - 1)) if v > 0 else 0.0 for v, n in zip(u, count, strict=True)]
    dof = float((count - 1)[result.count > 0].min())
    return _Term(Source(REPEATABILITY, "A", _range(u), "um", dof, "recording: by face, n - 1"), um)


def _scalar(model: Model, part: Part, index: int) -> _Term | None:
    """An uncertain value that moves all readings together; None for the size of the scatter, which moves none."""
    from GTC import ureal

    scalar = model.inputs.scalars[index]
    if scalar.key == "machine.repeatability_um":
        return None
    response = model.response_um(part, scalar)
    faces = part.readings.faces
    count = np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)
    mean = (np.bincount(part.readings.face, response, int(faces[-1]) + 1) / np.maximum(count, 1))[faces]
    stated = model.machine.stated.gauge_temperature_K if scalar.key == GAUGE_TEMPERATURE else None
    dof = scalar.dof or (stated.dof if stated is not None and stated.u == scalar.u else None) or math.inf
    one = ureal(0.0, 1.0, dof, label=scalar.key)
    source = Source(scalar.key, "B", (scalar.u, scalar.u), _unit(scalar.key), dof, _stated_by(scalar.key))
    return _Term(source, [float(v) * one for v in mean])


def _unit(key: str) -> str:
    """The unit that the name of a key ends in."""
    if key == GAUGE_TEMPERATURE:
        return "K"
    endings = {"_per_K": "1/K", "_C": "K", "_um": "um", "ppm": "ppm", "urad": "urad", ".um": "um", "_K": "K"}
    return next((unit for ending, unit in endings.items() if key.endswith(ending)), "as the key")


def _stated_by(key: str) -> str:
    if key == GAUGE_TEMPERATURE:
        return "--u-gauge-temperature or [uncertainty] of the machine file"
    return "gauge file" if key.startswith("gauge.") else "machine file"


def _probing(model: Model, part: Part) -> _Term | None:
    stated: StandardUncertainty | None = model.machine.stated.probing_um
    if stated is None or not stated.u:
        return None
    dof = stated.dof or math.inf
    u = np.full(len(part.readings.faces), stated.u)
    source = Source(PROBING, "B", _range(u), "um", dof, "machine file: [uncertainty] probing_um")
    return _Term(source, _independent(u, dof, PROBING))


def _resolution(model: Model, part: Part) -> _Term | None:
    """Half a step to each side, rectangular (GUM F.2.2.1): step / sqrt(12), the same in every cycle of a face."""
    step = model.machine.stated.resolution_um
    if step is None:
        return None
    u = np.full(len(part.readings.faces), step / math.sqrt(12.0))
    source = Source(RESOLUTION, "B", _range(u), "um", math.inf, "machine file: [uncertainty] resolution_um")
    return _Term(source, _independent(u, math.inf, RESOLUTION))


def _alignment(model: Model, part: Part, placement: Placement | None) -> _Term | None:
    """Faces are read too far by S phi^2 / 2 when the probed line is at the angle phi to the gauge."""
    from GTC import ureal

    if placement is None:
        return None
    u_rad = axis_uncertainty_rad(placement)
    if u_rad is None:
        return None
    cosine = cosine_rms(*u_rad)
    position_um = model.gauge.position_mm[part.readings.faces - 1] * 1e3
    one = ureal(0.0, 1.0, math.inf, label=ALIGNMENT)
    largest = max(u_rad) * 1e6
    source = Source(ALIGNMENT, "B", (min(u_rad) * 1e6, largest), "urad", math.inf, "placement file: [uncertainty]")
    return _Term(source, [float(v) * cosine * one for v in position_um])


def axis_uncertainty_rad(placement: Placement) -> tuple[float, float] | None:
    """Standard uncertainty of the axis in two directions across it, rad; None where the placement does not say.

    Yaw is an angle in the xy plane: across the axis it counts times the cosine of the pitch.
    """
    stated = placement.details.get("uncertainty", {})
    if "yaw_urad" not in stated or "pitch_urad" not in stated:
        return None
    level = float(np.hypot(placement.axis[0], placement.axis[1]))
    return float(stated["yaw_urad"]) * level * 1e-6, float(stated["pitch_urad"]) * 1e-6


def cosine_rms(u1_rad: float, u2_rad: float) -> float:
    """Root mean square of (d1^2 + d2^2) / 2 for two independent normal angles.

    The error always has one sign; it is not corrected, so that its mean counts with its spread about it
    (JCGM 100:2008, F.2.4.5): E[(d1^2 + d2^2)^2] = 3 u1^4 + 3 u2^4 + 2 u1^2 u2^2.
    """
    return math.sqrt(3.0 * u1_rad**4 + 3.0 * u2_rad**4 + 2.0 * (u1_rad * u2_rad) ** 2) / 2.0


# --- what was assumed, and what is missing -----------------------------------------------------------------------


def _assumptions(model: Model, asked: Asked) -> list[str]:
    certificate = model.gauge.certificate
    said = []
    if certificate.correlation is None:
        said.append(
            "the certificate states no correlation of its positions: they are taken as independent (correlation 0)"
        )
    else:
        said.append(f"any two certified positions have the correlation coefficient {certificate.correlation:g}")
    if certificate.degrees_of_freedom is None:
        said.append("the certificate states no degrees of freedom: they are taken as infinite")
    if asked.repeats == "pooled":
        said.append("one standard deviation of a probing holds for all faces")
    if model.machine.stated.resolution_um is not None:
        said.append("the resolution is not reduced by averaging: every cycle of a face may be rounded alike")
    if any(axis_uncertainty_rad(placement) for placement in asked.placements):
        said.append("the cosine error of the alignment is not corrected: its root mean square counts as uncertainty")
    return said


def _missing(model: Model, asked: Asked) -> list[tuple[str, str]]:
    """What a budget of this measurement would have and nobody stated; nothing is made up for it."""
    machine, gauge, keys = model.machine, model.gauge, model.inputs.names
    recorded = model.nominal.results[0].gauge_temperature_C is not None
    located = asked.placements and all(axis_uncertainty_rad(placement) for placement in asked.placements)
    checks = (
        (bool(gauge.u_um.any()), "gauge certificate", "column uncertainty_um of the faces of the gauge file"),
        (gauge.table.expansion_uncertainty_per_K > 0, "expansion of the gauge", "gauge.expansion_uncertainty_per_K"),
        (
            GAUGE_TEMPERATURE in keys,
            "temperature of the gauge"
            if recorded
            else "temperature of the gauge (not recorded; taken as the certificate's)",
            "--u-gauge-temperature, or gauge_temperature_K in [uncertainty] of the machine file",
        ),
        (
            "machine.temperature_C" in keys,
            "temperature of the scales",
            "machine.temperature_C = { value = .., u = .. } in the machine file",
        ),
        (
            "machine.scale_expansion_per_K" in keys,
            "expansion of the scales",
            "machine.scale_expansion_per_K = { value = .., u = .. } in the machine file",
        ),
        (
            machine.stated.probing_um is not None,
            "probing (what differs from face to face and not from cycle to cycle)",
            "probing_um in [uncertainty] of the machine file",
        ),
        (machine.stated.resolution_um is not None, "resolution", "resolution_um in [uncertainty] of the machine file"),
        (bool(located), "alignment (cosine error)", "--placement with its [uncertainty] yaw_urad and pitch_urad"),
        (REPEATABILITY in keys, "repeatability", "two or more cycles, or machine.repeatability_um"),
    )
    return [(what, how) for present, what, how in checks if not present]
