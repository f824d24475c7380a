"""``diagnose``: recordings and machine model to what departs from it; an axis alone; the map of a probe."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Flag, Pair, Reads, Repeated, Supplied, Text
from stepgauge.verbs.shared import (
    Figure,
    File,
    FurtherStyli,
    GaugeIfNeeded,
    Jobs,
    MachineIfNeeded,
    OutputFolder,
    Priors,
    Without,
)

if TYPE_CHECKING:
    from stepgauge.diagnosis.result import Diagnosis
    from stepgauge.gauge.certified import Gauge
    from stepgauge.machine.file import Machine


def leave(values: dict[str, Any], _: set[str]) -> tuple[str, ...]:
    """Neither the map of a probe nor a recording without a gauge needs these."""
    from stepgauge.axis.recording import is_axis_recording

    needed = values["probe"] is None and not any(map(is_axis_recording, values["recordings"]))
    return () if needed else ("gauge", "machine")


def write(diagnosis: Any, output: OutputFolder, *, figure: Figure = "png") -> Written:
    """Files of a diagnosis.

    Parameters
    ----------
    output : folder for diagnosis.json, diagnosis.md, the diagnosed machine or probe file and the figures
    """
    from stepgauge.diagnosis.many import Separately
    from stepgauge.reports.kinds import first_lines

    paths = diagnosis.write(output, figure)
    return Written(paths, () if isinstance(diagnosis, Separately) else first_lines(paths[0]))


@verb(write, leaves=leave, partly=True)
def diagnose(
    recordings: Annotated[Any, Repeated(Reads("RECORDING"), "recording"), ARGUMENT],
    gauge: GaugeIfNeeded = None,
    machine: MachineIfNeeded = None,
    *,
    further_styli: FurtherStyli = (),
    probe: Annotated[File | None, Reads("PROBE", room="probes")] = None,
    columns: Annotated["Mapping[str, str] | None", Repeated(Pair(metavar="NAME=HEADER"), "column")] = None,
    each: Annotated[bool, Flag()] = False,
    jobs: Jobs = 1,
    without: Without = (),
    priors: Priors = None,
    kind: Annotated[str | None, Text("KIND")] = None,
    progress: Annotated[Any, Supplied("search")] = None,
) -> "Diagnosis":
    """Find where a recording departs from the simulation, and the physical effect that explains it.

    The simulation is that of the machine file, with the effects it already has; the placement of the gauge is fitted.
    The verdict is one of: adequate (the residuals have no structure beyond the scatter), effects (known effects explain
    them), unknown (structure that no known effect explains), insufficient (the recording cannot discriminate). The exit
    code is 0 for all four. Effects that this recording cannot discriminate are reported as a set, with the measurement
    that separates them.

    Rows with a number other than 1 in the column stylus were probed with a further stylus: the first one is 2. Without
    the column a comment '# stylus: NAME' states it; 'measure' and 'simulate' write it where [probe] has a name.

    Prior knowledge (how common a cause is, and its usual size) is one table with reasons: 'stepgauge list priors'
    prints it, ``priors`` replaces a part of it.

    What is usual depends on the ``kind`` of machine or axis: cmm, "machine tool", "linear stage", piezo, "rotary
    table", "telescope mount", printer or encoder. A machine file may state it (kind), and so may a comment '# kind:
    NAME' of a recording of an axis; of an axis without one, each kind has the probability that the readings give it.

    Several recordings are placements of one machine: their common effects are estimated from all of them. With ``each``
    they are diagnosed one by one into OUTPUT/NAME/; the names of the files must then differ, and one that cannot be
    diagnosed is named and does not stop the others.

    Recordings of one axis, at one position, or of distances ('stepgauge import --sensor') need neither gauge nor
    machine; only effects that their sensor can have are considered, and the result is in their units.

    With ``probe`` the map of a probe (polar_deg, azimuth_deg and trigger_force_N, deflection_um or pretravel_um; see
    'stepgauge probe map') is diagnosed instead: which part of the probe's construction differs from its file.

    Parameters
    ----------
    recordings : one recording, run, file or DataFrame, or several as placements of one machine; or recordings of one
        axis, one spot or distances; or the map of a probe
    machine : the machine that is to be judged, with the effects it already has
    probe : probe file that is to be judged against a map, instead of a machine
    columns : of a map: which column holds a quantity, e.g. trigger_force_N=force_fea_N
    each : several recordings each on its own, instead of as placements of one machine in one diagnosis
    kind : of machine or axis, in place of that in its file
    jobs : of ``each``: processes that share the recordings
    progress : told the labels of what a search has found up to now

    Returns
    -------
    The verdict (adequate, effects, unknown, insufficient), the findings with values, uncertainties and probabilities;
    of an axis in the units of its recording, of a map the changes of the construction.

    Raises
    ------
    InputError
        recordings of another gauge or machine, of different kinds, or too small for a diagnosis

    Examples
    --------
    stepgauge diagnose recording.csv --gauge step-gauge-420 --machine bridge-cmm -o diagnosis
    stepgauge diagnose along-x.csv along-y.csv -g my-gauge.toml -m my-cmm.toml -o diagnosis
    stepgauge diagnose logs/*.csv -g my-gauge.toml -m my-cmm.toml --each --jobs 4 -o diagnoses
    stepgauge diagnose map.csv --probe omp40-2-50mm -o diagnosis
    stepgauge diagnose axis.csv -o diagnosis
    """
    from stepgauge.diagnosis.priors import read_priors
    from stepgauge.errors import InputError, naming
    from stepgauge.verbs.inputs import (
        are_of_axis,
        resolve_gauge,
        resolve_machine_with_styli,
        resolve_recordings,
        several,
    )

    given, table, excluded = several(recordings), None if priors is None else read_priors(priors), several(without)
    if probe is not None:
        if excluded or each or kind:
            where = naming("without", "each", "kind", words="{}, {}, {}")
            raise InputError(where, "are for recordings", expected=naming("probe", words="no {}"))
        return _map(given, probe, columns, table, progress)
    of_axis = are_of_axis(given)
    if of_axis and (gauge is not None or machine is not None):
        given_too = naming("gauge" if gauge is not None else "machine")
        raise InputError(given_too, "a recording of one axis, a spot or distances needs none")
    if not of_axis and (gauge is None or machine is None):
        first = resolve_recordings(given[0])[0]  # what is wrong there is told first
        found = f"{len(first)} readings of faces"
        missing, both = naming("gauge" if gauge is None else "machine"), naming("gauge", "machine", words="{} and {}")
        raise InputError(missing, "a recording of a gauge needs it", found=found, expected=both)
    one: Any = partial(_axes, without=excluded, table=table, kind=kind)
    if gauge is not None and machine is not None:
        cmm, steps = resolve_machine_with_styli(machine, further_styli), resolve_gauge(gauge)
        one = partial(_together, gauge=steps, machine=cmm, without=excluded, table=table, kind=kind)
    if each:
        return _separately(given, one, jobs)
    return one(given, progress=progress)


def _together(
    given: Any, gauge: "Gauge", machine: "Machine", without: list[str], table: Any, kind: Any, progress: Any = None
) -> "Diagnosis":
    """Recordings as placements of one machine."""
    from dataclasses import replace

    from stepgauge.diagnosis.engine import diagnose as diagnose_recording
    from stepgauge.diagnosis.many import join_stylus_recordings
    from stepgauge.verbs.inputs import resolve_recordings

    tables, whole = join_stylus_recordings(resolve_recordings(given), machine)
    found = diagnose_recording(whole, gauge, machine, without, table, progress=progress, kind=kind)
    return replace(found, recordings=tuple(tables))


def _axes(given: Any, without: list[str], table: Any, kind: Any, progress: Any = None) -> "Diagnosis":
    """Recordings of one axis, a spot or distances, as settings up of one axis."""
    from stepgauge.diagnosis.axis.diagnosis import diagnose_axes
    from stepgauge.verbs.inputs import resolve_axis, several

    return diagnose_axes([resolve_axis(one) for one in several(given)], without, table, kind, progress)


def _map(given: list[Any], probe: File, columns: "Mapping[str, str] | None", table: Any, progress: Any) -> "Diagnosis":
    """The map of a probe."""
    from stepgauge.diagnosis.maps.data import data_of_map, read_map_data
    from stepgauge.diagnosis.maps.diagnose import judged_map
    from stepgauge.errors import InputError, naming
    from stepgauge.files.tables import given_table
    from stepgauge.probes.directions_map import DirectionMap
    from stepgauge.verbs.inputs import require_kind

    if len(given) != 1:
        raise InputError(naming("probe"), "takes one map at a time", found=len(given))
    one = given_table(given[0])
    data = read_map_data(one, columns) if isinstance(one, File) else data_of_map(require_kind(one, DirectionMap, "map"))
    return judged_map(data, probe, table, progress)


def _separately(given: list[Any], one: Any, jobs: int | None) -> Any:
    """Each by itself, when it is written."""
    from stepgauge.diagnosis.many import Separately

    return Separately([str(path) for path in given], one, jobs)
