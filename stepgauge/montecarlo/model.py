"""From drawn inputs to the results of ``evaluate``, for many runs at once.

A program is run once on the virtual CMM without errors. In a run the positions of the faces follow from the drawn
certificate, expansion and temperature, the probe triggers with the drawn pre-travel, and the drawn effects and the
repeatability displace the indication. Faces are planes, so a shifted face moves the trigger along its approach exactly,
and the coordinates that effects use move with it.

Effects are not added to a recording again: its readings are the estimates, and a run gives the errors that would result
if the inputs differed from their best estimates as drawn. So the same displacements count with the opposite sign,
relative to those of the best estimates; the means over the cycles stand for the readings and the repeatability for
their scatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stepgauge.conditions import Conditions
from stepgauge.conditions.readings import Readings
from stepgauge.effects import Effect, Probings, Setting
from stepgauge.effects.thermal import REFERENCE_C
from stepgauge.effects.totals import added_up, scatter_um
from stepgauge.evaluation.evaluate import Evaluation, PlacementResult
from stepgauge.evaluation.face_errors import FaceErrors, REffOrigin, band_um, face_errors, worst_two_sigma_um
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.machine.uncertain import Uncertain, replaced
from stepgauge.montecarlo.inputs import (
    EXPANSION,
    GAUGE_TEMPERATURE,
    NOTHING,
    Draws,
    MonteCarloInputs,
    draw,
    effect_key,
)
from stepgauge.recording.conventions import convention_of
from stepgauge.recording.face_readings import FaceStatistics, face_statistics

BY_FACE = ("xf_um", "sf_um", "xb_um", "sb_um", "xm_um", "xr_um")
SCALE_KEYS = {"machine.temperature_C", "machine.scale_expansion_per_K"}
SCALARS = ("r_eff_mm", "u_r_eff_mm", "span_mm", "band_um", "worst_two_sigma_um")


@dataclass(frozen=True)
class ModelQuantity:
    """One number that ``evaluate`` reports; ``face`` is None for those of a whole placement."""

    name: str
    placement: int
    face: int | None = None


@dataclass(frozen=True)
class PlacementReadings:
    """One placement: its columns, its readings along the gauge axis, and two temperatures.

    ``warmer_K``: of the gauge over that of its certificate; ``scales_C``: of the scales, as recorded, else as stated.
    """

    placement: int
    columns: dict[str, Array]
    readings: Readings
    warmer_K: Array
    scales_C: float
    first_row: int

    def __len__(self) -> int:
        return len(self.readings.face)


@dataclass(frozen=True)
class MonteCarloModel:
    """The model of a Monte Carlo; ``sign`` is +1 for a program and -1 for a recording.

    ``quantities`` names the columns of :meth:`values`; ``nominal`` is the evaluation of the recording, or of a program
    on a machine without errors; ``counts`` marks the effects that have an influence; ``at_reference``: whether the
    measurand is the machine at 20 deg C, whose scales have no temperature of their own.
    """

    machine: Machine
    gauge: Gauge
    effects: tuple[Effect, ...]
    setting: Setting
    inputs: MonteCarloInputs
    parts: tuple[PlacementReadings, ...]
    nominal: Evaluation
    origin: REffOrigin
    sign: float
    quantities: tuple[ModelQuantity, ...]
    counts: tuple[bool, ...]
    at_reference: bool = True

    @property
    def conditions(self) -> Conditions:
        """What was found of the readings of a recording; of a program there are none."""
        return self.nominal.conditions if self.sign < 0.0 else Conditions()

    def keep_temperature_error(self) -> MonteCarloModel:
        """The model whose measurand is the machine as it is: what its scales' temperature makes is its own error,
        unless that is corrected."""
        gone = set() if self.corrects_scales else SCALE_KEYS
        scalars = tuple(one for one in self.inputs.scalars if one.key not in gone)
        return replace(self, inputs=replace(self.inputs, scalars=scalars), at_reference=False)

    @property
    def corrects_scales(self) -> bool:
        """Whether the readings are corrected for the expansion of the scales, which then is part of the correction."""
        return self.sign < 0.0 and convention_of(self.nominal.comments) == "nominal_expansion"

    @property
    def n_rows(self) -> int:
        """Number of probings over all parts."""
        return sum(len(part) for part in self.parts)

    def values(self, seed: int, runs: Sequence[int], only: str | None = None) -> Array:
        """All quantities of some runs, shape ``(runs, quantities)``; ``only``: see :func:`inputs.draw`."""
        draws = draw(self.inputs, seed, runs, self.gauge.n_faces, self.n_rows, only, self.gauge.correlation)
        drawn = _Drawn(self, draws)
        return np.concatenate([_evaluated(self, part, drawn) for part in self.parts], axis=1)

    def best(self) -> Array:
        """All quantities at the best estimates, shape ``(quantities,)``; a recording's are those of its evaluation."""
        if self.sign > 0:
            return self.values(0, [0], only=NOTHING)[0]
        return np.concatenate([_reported(result) for result in self.nominal.results])

    def label(self, name: str) -> str:
        """``effect[2].urad`` as ``squareness xy: urad``; other inputs as they are."""
        place = effect_key(name)
        if place is None:
            return name
        return f"{self.effect_of(place[0]).label.replace('_', ' ')}: {'.'.join(place[1])}"

    def effect_of(self, index: int) -> Effect:
        """The effect of the machine file with this index; uncompensated scales come before those of the file."""
        return self.effects[len(self.effects) - len(self.machine.effects) + index]

    def response_um(self, part: PlacementReadings, scalar: Uncertain) -> Array:
        """Change of the readings of a placement by one standard uncertainty of a scalar input, um, shape ``(n,)``.

        A central difference through the virtual CMM (JCGM 100:2008, 5.1.3 note 2).
        """
        ends = np.array([[scalar.value + scalar.u], [scalar.value - scalar.u]])
        drawn = _Drawn(self, Draws(2, {scalar.key: ends}, None, None))
        um = np.broadcast_to(self.sign * _displacement_um(self, part, drawn), (2, len(part)))
        return (um[0] - um[1]) / 2.0

    def noise_um(self, part: PlacementReadings) -> Array:
        """Standard deviation of every probing of a placement along its approach, um, shape ``(n,)``."""
        drawn = _Drawn(self, Draws(1, {}, None, None))
        sigma = scatter_um(drawn.effects(part), Probings(part.columns, self.setting), drawn.repeatability_um())[-1]
        return np.broadcast_to(sigma, (1, len(part)))[0]


class _Drawn:
    """The inputs of a block of runs, each of shape ``(runs, 1)`` or, by face, ``(runs, n_faces)``."""

    def __init__(self, model: MonteCarloModel, draws: Draws) -> None:
        self.model, self.draws = model, draws
        self.scalar, self.runs = draws.scalar, draws.runs

    def get(self, key: str, best: Array | float) -> Array | float:
        """A scalar input, or its best estimate where it is certain."""
        return self.scalar.get(key, best)

    def effects(self, part: PlacementReadings) -> list[Effect]:
        """The effects with their drawn parameters, for a placement."""
        drawn = list(self.model.effects)
        first = len(drawn) - len(self.model.machine.effects)  # uncompensated scales come before those of the file
        for key, values in self.scalar.items():
            place = effect_key(key)
            if place is not None:
                index, path = first + place[0], place[1]
                drawn[index] = _replace_value(drawn[index], path, values)
        if first:
            drawn[0] = drawn[0].replace_values(temperature_C=self.scale_temperature(part))
        return [effect for effect, counts in zip(drawn, self.model.counts, strict=True) if counts]

    def scale_temperature(self, part: PlacementReadings) -> Array | float:
        """Of the scales in a placement, deg C: the thermometer is off by as much as the machine file lets it be."""
        stated = self.model.machine.table.temperature_C
        return part.scales_C + (self.get("machine.temperature_C", stated) - stated)

    def setting(self) -> Setting:
        """The setting with the drawn expansion of the scales."""
        best = self.model.setting.scale_expansion_per_K
        return replace(self.model.setting, scale_expansion_per_K=self.get("machine.scale_expansion_per_K", best))

    def true_position_mm(self) -> Array:
        """Certified positions as drawn, at the reference temperature, ``(runs, n_faces)`` or ``(n_faces,)``."""
        position = self.model.gauge.position_mm
        if self.draws.certificate is None:
            return position
        return position + self.draws.certificate * (self.model.gauge.u_um * 1e-3)

    def face_shift_um(self, part: PlacementReadings) -> Array:
        """True minus assumed positions of the faces along the gauge, um, by row."""
        gauge = self.model.gauge
        face = part.readings.face - 1
        shift = self.true_position_mm()[..., face] - gauge.position_mm[face]
        alpha = self.get(EXPANSION, gauge.table.expansion_per_K)
        warmer = part.warmer_K + self.get(GAUGE_TEMPERATURE, 0.0)
        known = gauge.table.expansion_per_K * part.warmer_K
        return (shift + gauge.position_mm[face] * (alpha * warmer - known)) * 1e3

    def pretravel_um(self) -> Array | float:
        """Drawn minus modelled pre-travel."""
        if "probe.pretravel_um" not in self.scalar:
            return 0.0
        # only a probe of constant or lobed pre-travel has this key, and there it is added to all directions alike
        return self.scalar["probe.pretravel_um"] - self.model.machine.probe.model_dump()["pretravel_um"]

    def noise(self, part: PlacementReadings) -> Array | None:
        """Standard normal numbers of the rows of a placement."""
        noise = self.draws.noise
        return None if noise is None else noise[:, part.first_row : part.first_row + len(part)]

    def repeatability_um(self) -> Array | float:
        return self.get("machine.repeatability_um", self.model.machine.table.repeatability_um)


def _replace_value(effect: Effect, path: list[str], value: Array) -> Effect:
    if len(path) == 1:
        return effect.replace_values(**{path[0]: value})
    table = replaced({path[0]: getattr(effect, path[0])}, path, value)
    return effect.model_copy(update=table)


def _evaluated(model: MonteCarloModel, part: PlacementReadings, drawn: _Drawn) -> Array:
    """The quantities of one placement, shape ``(runs, quantities)``."""
    readings = part.readings
    um = model.sign * _displacement_um(model, part, drawn)
    off_mm = np.broadcast_to(readings.off_mm + um * 1e-3, (drawn.runs, len(part)))
    seen = face_statistics(off_mm, readings.face, readings.faces)
    gauge, faces = model.gauge, readings.faces
    u_um, correlation = gauge.u_um[faces - 1], gauge.correlation_of(faces)
    errors = face_errors(seen, u_um, model.origin, correlation, readings.corrected_mm)
    true_mm = np.broadcast_to(drawn.true_position_mm(), (drawn.runs, model.gauge.n_faces))
    span_mm = true_mm[:, readings.faces[-1] - 1] - true_mm[:, readings.faces[0] - 1]
    return np.column_stack(_columns(seen, errors, span_mm))


def _columns(seen: FaceStatistics, errors: FaceErrors, span_mm: Array) -> list[Array]:
    """In the order of :func:`_quantities`."""
    by_face = [getattr(errors, name) for name in BY_FACE]
    single = [errors.r_eff_mm, errors.u_r_eff_mm, span_mm, band_um(errors.xm_um), worst_two_sigma_um(seen)]
    return [*by_face, *(values[:, None] for values in single)]


def _reported(result: PlacementResult) -> Array:
    """The values of an evaluation, in the same order."""
    single = [result.radius.r_eff_mm, result.radius.u_mm, result.span_mm, result.band_um, result.worst_two_sigma_um]
    return np.concatenate([*(getattr(result, name) for name in BY_FACE), single])


def model_quantities(parts: Sequence[PlacementReadings]) -> tuple[ModelQuantity, ...]:
    found = []
    for part in parts:
        found += [ModelQuantity(name, part.placement, int(face)) for name in BY_FACE for face in part.readings.faces]
        found += [ModelQuantity(name, part.placement) for name in SCALARS]
    return tuple(found)


def _displacement_um(model: MonteCarloModel, part: PlacementReadings, drawn: _Drawn) -> Array:
    """Change of the readings along the gauge axis by the drawn inputs, um, shape ``(runs, n)``."""
    base = Probings(part.columns, model.setting)
    along_um = base.shifted_along_gauge(drawn.face_shift_um(part)) + drawn.pretravel_um()
    probings = Probings(_moved(part, along_um), drawn.setting())
    effects = drawn.effects(part)
    sigma_um = scatter_um(effects, probings, drawn.repeatability_um())[-1]
    noise = drawn.noise(part)
    if noise is not None:
        along_um = along_um + sigma_um * noise
    axis = part.readings.axis
    share = sum(a * probings.approach(name) for a, name in zip(axis, "xyz", strict=True))
    bent = _projected(added_up(effects, probings), axis)
    if model.sign < 0:
        best = _Drawn(model, Draws(1, {}, None, None)).effects(part)
        bent = bent - _projected(added_up(best, base), axis)
    return along_um * share + bent + _sensor_um(model, part, drawn)


def _moved(part: PlacementReadings, along_um: Array) -> dict[str, Array]:
    """The columns with the coordinates at which the probe triggers in these runs."""
    if along_um.ndim == 1:
        return part.columns
    pairs = zip(("x_mm", "y_mm", "z_mm"), ("approach_i", "approach_j", "approach_k"), strict=True)
    moved = {to: part.columns[to] + (along_um * 1e-3) * part.columns[p] for to, p in pairs if part.columns[p].any()}
    return {**part.columns, **moved}


def _projected(xyz_um: tuple[Array, Array, Array], axis: Array) -> Array:
    total: Array = sum((a * um for a, um in zip(axis, xyz_um, strict=True) if a), np.zeros(1))
    return total


def _sensor_um(model: MonteCarloModel, part: PlacementReadings, drawn: _Drawn) -> Array | float:
    """Error of compensated scales if temperature or expansion differ from the values of the controller.

    -(alpha_s (T - 20) - alpha_0 (T_0 - 20)) x, with alpha_0 of the machine file and the best estimate T_0.
    """
    table = model.machine.table
    if not table.scales_compensated or not SCALE_KEYS & drawn.scalar.keys():
        return 0.0
    taken = table.scale_expansion_per_K * (part.scales_C - REFERENCE_C)
    true = drawn.setting().scale_expansion_per_K * (drawn.scale_temperature(part) - REFERENCE_C)
    x_um = _projected((part.columns["x_mm"], part.columns["y_mm"], part.columns["z_mm"]), part.readings.axis) * 1e3
    return -(true - taken) * x_um
