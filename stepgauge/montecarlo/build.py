"""The model of a measurement: of a program that is yet to run, or of a recording that was made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stepgauge.conditions.readings import Readings, project_readings
from stepgauge.effects import Effect, Setting
from stepgauge.effects.thermal import ScaleTemperature, UncompensatedScales
from stepgauge.evaluation.evaluate import Evaluation, evaluate
from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine import virtual
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import machine_effects
from stepgauge.machine.virtual import execute
from stepgauge.montecarlo.inputs import MonteCarloInputs, collect_inputs, effect_key, pooled_deviation_um
from stepgauge.montecarlo.model import MonteCarloModel, PlacementReadings, model_quantities
from stepgauge.motion.moves import Program
from stepgauge.recording import Recording
from stepgauge.recording.conventions import warmer_K
from stepgauge.recording.face_readings import FaceReadings


def program_model(
    program: Program,
    machine: Machine,
    gauge: Gauge,
    placement: Placement,
    conditions: virtual.RunConditions | None = None,
    u_gauge_temperature_K: float = 0.0,
    origin: REffOrigin | None = None,
) -> MonteCarloModel:
    """The model of a measurement yet to be made: the program on the virtual CMM.

    Raises the stop of a program that does not run through.
    """
    executed = execute(program, machine, gauge, placement, conditions)
    if executed.stop is not None:
        raise executed.stop
    recording = Recording(executed.columns, {}, program.name)
    inputs = collect_inputs(machine, gauge, u_gauge_temperature_K)
    nominal = evaluate(recording, gauge, None, origin)
    return _model(recording, nominal, machine, executed.setting, inputs, 1.0)


def recording_model(
    recording: Recording,
    machine: Machine,
    gauge: Gauge,
    u_gauge_temperature_K: float = 0.0,
    origin: REffOrigin | None = None,
    blocks: tuple[int, int] | None = None,
    correct_drift: bool = False,
) -> MonteCarloModel:
    """The model of a measurement that was made; ``blocks`` and ``correct_drift`` as in ``evaluate``.

    The effects of the machine file are influence quantities of this measurement: only their uncertain parameters
    count. The repeatability is that of the recording, pooled over its faces, where it has repeats.
    """
    nominal = evaluate(recording, gauge, blocks, origin, correct_drift=correct_drift)
    setting = Setting.of(machine, gauge, {one.placement: one.axis for one in nominal.results})
    inputs = collect_inputs(machine, gauge, u_gauge_temperature_K)
    model = _model(recording, nominal, machine, setting, inputs, -1.0, correct_drift)
    pooled, _ = pooled_deviation_um(model.nominal.results)
    if not np.isfinite(pooled):
        return model
    table = machine.table.model_copy(update={"repeatability_um": pooled})
    inputs = replace(inputs, repeatability=pooled > 0.0)
    return replace(model, machine=replace(machine, table=table), inputs=inputs)


def _model(
    recording: Recording,
    nominal: Evaluation,
    machine: Machine,
    setting: Setting,
    inputs: MonteCarloInputs,
    sign: float,
    correct_drift: bool = False,
) -> MonteCarloModel:
    gauge, origin = nominal.gauge, nominal.r_eff_origin
    parts, first = [], 0
    for result in nominal.results:
        recorded_C = result.scale_temperature_C
        scales_C = machine.table.temperature_C if recorded_C is None else recorded_C
        number = result.placement
        own = recording.select_placement(number)
        readings = project_readings(own, gauge, nominal.blocks, correct_drift=correct_drift)
        part = _part(own, gauge, readings, number, first, sign, scales_C)
        parts.append(part)
        first += len(part)
    effects = tuple(machine_effects(machine))
    counts = tuple(sign > 0 or drawn for drawn in _is_drawn(machine, effects))
    return MonteCarloModel(
        machine, gauge, effects, setting, inputs, tuple(parts), nominal, origin, sign, model_quantities(parts), counts
    )


def _is_drawn(machine: Machine, effects: Sequence[Effect]) -> list[bool]:
    """Effects that change from run to run: by a parameter, or with the temperature or expansion of the scales."""
    places = [place for uncertain in machine.uncertain if (place := effect_key(uncertain.key)) is not None]
    first = len(effects) - len(machine.effects)
    indices = {first + index for index, _ in places}
    by_scales = (ScaleTemperature, UncompensatedScales)
    return [index in indices or isinstance(effect, by_scales) for index, effect in enumerate(effects)]


def _recorded_K(recording: Recording, gauge: Gauge) -> Array | float:
    """How much warmer than its certificate the gauge was, K, whoever corrected its readings for it: the coefficient of
    expansion that the correction was made with has its uncertainty."""
    if "gauge_temperature_C" not in recording.columns:
        return warmer_K(recording, gauge)
    return np.asarray(recording.columns["gauge_temperature_C"] - gauge.table.reference_temperature_C, float)


def _part(
    recording: Recording,
    gauge: Gauge,
    readings: Readings,
    number: int,
    first_row: int,
    sign: float,
    scales_C: float,
) -> PlacementReadings:
    if readings.kept is not None:
        recording = recording.select_rows(readings.kept)
    if sign < 0:
        one = readings.by_face
        means = FaceReadings.of(one.mean_mm[one.face], one.face, len(one.count))
        readings = replace(readings, by_face=means)  # the noise of the recording is drawn anew
    warmer = np.broadcast_to(_recorded_K(recording, gauge), (len(readings.face),))
    return PlacementReadings(number, recording.columns, readings, warmer, scales_C, first_row)
