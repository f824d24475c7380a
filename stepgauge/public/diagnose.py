"""``diagnose``: recordings and machine model to what departs from it; recordings of an axis alone; maps of a probe."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from stepgauge.axis.recording import (
    FORM,
    FORMS,
    AxisRecording,
    axis_recording_of_frame,
    is_axis_recording,
    read_axis_recording,
)
from stepgauge.diagnosis.engine import diagnose as diagnose_recording
from stepgauge.diagnosis.many import of_one_machine
from stepgauge.diagnosis.priors import Priors, read_priors
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.verbs.inputs import File, as_gauge, as_machine_with, as_recordings, of_kind, several

if TYPE_CHECKING:
    from stepgauge.probes.directions_map import DirectionMap


def diagnose(
    recordings: Any,
    gauge: File | Gauge | None = None,
    machine: File | Machine | None = None,
    *,
    styli: File | Machine | Iterable[File | Machine] = (),
    without: str | Iterable[str] = (),
    priors: File | None = None,
) -> Diagnosis:
    """Find where a recording departs from the simulation, identify the physical effect, and model it.

    Parameters
    ----------
    recordings : one recording, run, file or DataFrame (columns as in a file, its comments in ``attrs``), or several as
        placements of one machine; or recordings of one axis, of one spot or of distances, which need neither gauge nor
        machine: several are settings up of one axis
    gauge : the certified gauge, its file or shipped name
    machine : the machine that is to be judged, with the effects it already has
    styli : machine files with further styli, as of ``investigate``: 2, 3, ... in the column ``stylus``, or by their
        ``tool`` or ``name`` in the comment ``stylus`` of a recording
    without : kinds of effects that are known not to be there, as ``stepgauge list effects`` lists them
    priors : file that replaces a part of the shipped priors

    Returns
    -------
    The verdict (adequate, effects, unknown, insufficient), the findings with values, uncertainties and probabilities;
    of an axis in the units of its recording.

    Raises
    ------
    InputError
        recordings of another gauge or machine, of different kinds, or too small for a diagnosis
    """
    given, table = several(recordings), _priors(priors)
    if are_of_axis(given):
        if gauge is not None or machine is not None:
            given_too = naming("gauge" if gauge is not None else "machine")
            raise InputError(given_too, "a recording of one axis, a spot or distances needs none")
        from stepgauge.diagnosis.axis.diagnosis import diagnose_axes

        return diagnose_axes([_axis(one) for one in given], several(without), table)
    if gauge is None or machine is None:
        missing = "gauge" if gauge is None else "machine"
        raise InputError(
            naming(missing), "a recording of a gauge needs it", expected=naming("gauge", "machine", words="{} and {}")
        )
    cmm = as_machine_with(machine, styli)
    tables, whole = of_one_machine(as_recordings(given), cmm)
    found = diagnose_recording(whole, as_gauge(gauge), cmm, several(without), table)
    return replace(found, recordings=tuple(tables))


def diagnose_probe_map(
    probe_map: File | DirectionMap,
    probe: File,
    *,
    columns: Mapping[str, str] | None = None,
    priors: File | None = None,
) -> Diagnosis:
    """Find which part of the construction of a probe is not as its file says, from a map of the probe.

    Parameters
    ----------
    probe_map : a map, or a CSV file with ``polar_deg,azimuth_deg`` and one or more of ``trigger_force_N``,
        ``deflection_um``, ``pretravel_um``
    probe : probe file that is to be judged, or the name of a shipped one
    columns : quantity to the name of its column in a foreign file, ``{"trigger_force_N": "force_mN"}``
    priors : file that replaces a part of the shipped priors

    Returns
    -------
    The verdict, the changes of the construction with values, uncertainties and probabilities, and the changed probe.

    Raises
    ------
    InputError
        a map that cannot be read, a quantity that the probe file does not give, a probe that is known by its map only
    """
    from stepgauge.diagnosis.maps.data import data_of_map, read_map_data
    from stepgauge.diagnosis.probe_map import judged_map
    from stepgauge.probes.directions_map import DirectionMap

    if isinstance(probe_map, File):
        data = read_map_data(probe_map, columns)
    else:
        data = data_of_map(of_kind(probe_map, DirectionMap, "probe_map"))
    return judged_map(data, probe, _priors(priors))


def are_of_axis(given: Iterable[object]) -> bool:
    """Whether all recordings are of an axis, a spot or distances; some beside those of a gauge are a mistake."""
    given = list(given)
    found = [_is_of_axis(one) for one in given]
    if any(found) and not all(found):
        one = given[found.index(True)]
        where = one if isinstance(one, str | Path) else getattr(one, "path", "") or "recordings"
        raise InputError(where, "this is of one axis, the others are of a gauge", expected="recordings of one kind")
    return bool(found) and all(found)


def _is_of_axis(one: object) -> bool:
    if isinstance(one, File):
        return is_axis_recording(one)
    return isinstance(one, AxisRecording) or (isinstance(one, pd.DataFrame) and one.attrs.get(FORM) in FORMS)


def _axis(given: File | pd.DataFrame | AxisRecording) -> AxisRecording:
    if isinstance(given, pd.DataFrame):
        return axis_recording_of_frame(given)
    return read_axis_recording(given) if isinstance(given, File) else given


def _priors(path: File | None) -> Priors | None:
    return None if path is None else read_priors(path)
