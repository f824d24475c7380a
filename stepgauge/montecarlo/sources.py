"""The model of a Monte Carlo or a budget from the files of a measurement, made or yet to be made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine, check_recorded
from stepgauge.machine.virtual import RunConditions, probing_settings
from stepgauge.montecarlo.build import program_model, recording_model
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.planning.plan import parse_section
from stepgauge.programs import read_program
from stepgauge.recording import Recording, is_recording_file, join_recordings, read_recording
from stepgauge.recording.conventions import complete_by_machine, state_convention


@dataclass(frozen=True)
class ModelOptions:
    """Options beside the files.

    ``u_gauge_temperature_K``: None: that of the machine file, which is of a thermometer and does not count where
    no gauge temperature was recorded; ``origin``: of R_eff, None: as in ``evaluate``;
    ``blocks``: used section of a recording, ``A:B``;
    ``gauge_temperature_C``: as a program is run (None: of the certificate); ``search_mm``: beyond the target of a
    program whose text does not state it; ``at_reference``: of a recording, whether the measurand is the machine at
    20 deg C: else it is as it is, and what the temperature of its scales makes is its error and no uncertainty;
    ``correct_drift``, ``temperature_convention``: of a recording, as in ``evaluate``.
    """

    u_gauge_temperature_K: float | None = None
    origin: REffOrigin | None = None
    blocks: str | None = None
    gauge_temperature_C: float | None = None
    search_mm: float = 2.0
    at_reference: bool = False
    correct_drift: bool = False
    temperature_convention: str | None = None


def read_model(
    sources: Sequence[str | Path | Recording],
    machine: Machine,
    gauge: Gauge,
    placements: Sequence[Placement] = (),
    options: ModelOptions | None = None,
) -> MonteCarloModel:
    """The model of recordings (read, or CSV or Parquet, joined) or of one program, told apart by the file's name.

    :class:`InputError` where recordings are of another machine, where a program comes without exactly one placement,
    and as the readers of the files.
    """
    options = options or ModelOptions()
    files = [one for one in sources if not isinstance(one, Recording)]
    if not files or len(files) < len(sources) or is_recording_file(files[0]):
        read = [one if isinstance(one, Recording) else read_recording(one) for one in sources]
        stated = [state_convention(one, options.temperature_convention) for one in read]
        tables = [complete_by_machine(one, machine.table) for one in stated]
        recording = tables[0] if len(tables) == 1 else join_recordings(tables)
        check_recorded(recording.comments, machine)
        if options.gauge_temperature_C is not None:
            raise InputError(naming("gauge_temperature_C"), "belongs to a program; a recording has its own")
        section = parse_section(options.blocks, gauge)
        u_K = _u_recorded_K(recording, machine, options)
        model = recording_model(recording, machine, gauge, u_K, options.origin, section, options.correct_drift)
        return model if options.at_reference else model.keep_temperature_error()
    _check_program(files, placements, options)
    program = read_program(files[0], probing_settings(machine, options.search_mm))
    conditions = RunConditions(gauge.temperature_C(options.gauge_temperature_C))
    u_K = machine.u_gauge_temperature_K(options.u_gauge_temperature_K)
    return program_model(program, machine, gauge, placements[0], conditions, u_K, options.origin)


def _u_recorded_K(recording: Recording, machine: Machine, options: ModelOptions) -> float:
    """Of the gauge temperature of a recording: a thermometer that was not read makes nothing certain."""
    asked = options.u_gauge_temperature_K
    if asked is None and "gauge_temperature_C" not in recording.frame:
        return 0.0
    return machine.u_gauge_temperature_K(asked)


def _check_program(sources: Sequence[str | Path], placements: Sequence[Placement], options: ModelOptions) -> None:
    if len(sources) > 1:
        raise InputError(sources[1], "one program at a time", found=f"{len(sources)} files")
    if len(placements) != 1:
        raise InputError(
            naming("placements"),
            "a program needs to know how the gauge lies",
            found=f"{len(placements)} placement files",
            expected="one",
        )
    if options.correct_drift:
        raise InputError(naming("correct_drift"), "belongs to a recording; a program has not drifted yet")
    if options.temperature_convention:
        raise InputError(naming("temperature_convention"), "belongs to a recording; a program has no readings yet")
    if options.blocks:
        raise InputError(naming("blocks"), "belongs to a recording; a program measures what it was planned for")
