"""``diagnose``: recordings and machine model to what departs from it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from stepgauge.diagnosis.engine import diagnose as diagnose_recording
from stepgauge.diagnosis.posterior.priors import read_priors
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.public.inputs import File, as_gauge, as_machine, as_recordings, several
from stepgauge.recording import Recording, join_recordings

if TYPE_CHECKING:
    from stepgauge.machine.virtual import Run


def diagnose(
    recordings: File | Recording | Run | Iterable[File | Recording | Run],
    gauge: File | Gauge,
    machine: File | Machine,
    *,
    without: str | Iterable[str] = (),
    priors: File | None = None,
) -> Diagnosis:
    """Find where a recording departs from the simulation, identify the physical effect, and model it.

    Parameters
    ----------
    recordings : one recording, run or file, or several as placements of one machine
    gauge : the certified gauge, its file or shipped name
    machine : the machine that is to be judged, with the effects it already has
    without : kinds of effects that are known not to be there, as ``stepgauge effects`` lists them
    priors : file that replaces a part of the shipped priors

    Returns
    -------
    The verdict (adequate, effects, unknown, insufficient), the findings with values, uncertainties and probabilities.

    Raises
    ------
    InputError
        recordings of another gauge or machine, or too small for a diagnosis
    """
    tables = as_recordings(recordings)
    whole = tables[0] if len(tables) == 1 else join_recordings(tables)
    table = None if priors is None else read_priors(priors)
    found = diagnose_recording(whole, as_gauge(gauge), as_machine(machine), several(without), table)
    return replace(found, recordings=tuple(tables))
