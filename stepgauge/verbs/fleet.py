"""The verbs of a fleet: recordings of many machines and gauges in a store, and work on all of them."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Number, OneOf, Reads, Repeated, Supplied, Text, Writes
from stepgauge.verbs.shared import (
    GAUGE,
    MACHINE,
    File,
    MeasuredAt,
    OutputFolder,
    Placements,
    Progress,
)

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.fleet.compacting import Compacted
    from stepgauge.fleet.done import Added, Exported

Store = Annotated[File, Reads("STORE", folder=True), ARGUMENT, "folder of the store"]
Scheduler = Annotated[
    str | None,
    Text("FILE"),
    "work on a Dask cluster: the file of 'fleet cluster', or tcp://host:port; default: processes here",
]
Memory = Annotated[float | None, Number("MB", above=0.0), "what each process may allocate; default: no limit"]
Identity = Annotated[str | None, Text("ID")]


@verb()
def add_to_fleet(
    store: Store,
    recordings: Annotated["File | Iterable[File]", Repeated(Reads("RECORDING"), "recording"), ARGUMENT],
    gauge: Annotated[File | None, GAUGE] = None,
    machine: Annotated[File | None, MACHINE] = None,
    *,
    placements: Placements = (),
    roster: Annotated[File | None, Reads("FILE")] = None,
    machine_id: Identity = None,
    machine_type: Annotated[str | None, Text("TYPE")] = None,
    hall: Annotated[str | None, Text("HALL")] = None,
    probe_id: Identity = None,
    gauge_id: Identity = None,
    measured_at: MeasuredAt = None,
    progress: Progress = None,
) -> "Added":
    """Add recordings with what belongs to them to a store.

    Makes the store where there is none. Adding a recording again changes nothing, for it is known by its content. What
    a recording states in its comments counts: machine_id, machine_type, hall, probe_id, gauge_id, measured_at. The
    roster has a row for each file, by its column 'recording' (from the roster's folder), or for each machine, by its
    column 'machine', and further columns of: type, hall, probe, gauge, measured_at, gauge_file, machine_file,
    placement_file. A contradiction is an error.

    Several processes may add to one store at the same time, and any of them may be killed: what a recording needs is
    there as a whole or not at all.

    Parameters
    ----------
    recordings : files, CSV or Parquet
    gauge : gauge file or shipped name, where a roster does not state it
    machine : machine file or shipped name; only a diagnosis, a budget and an inference need it
    placements : placement file; once per placement in the recordings, in order
    roster : table (CSV) with the owners of the recordings
    machine_id : identity of the machine; default: the name that a recording states
    machine_type : model line of the machine
    hall : hall that the machine stood in
    probe_id : identity of the probe
    gauge_id : identity of the gauge; default: its serial number
    measured_at : ISO date, where the recordings do not say

    Returns
    -------
    The keys of the new recordings, and those of the recordings that were there.

    Raises
    ------
    InputError
        a recording that is not of its gauge, or that states something else; those before it stay added

    Examples
    --------
    stepgauge fleet add fleet logs/*.csv -g step-gauge-420 -m bridge-cmm --machine-id M1 --hall North
    stepgauge fleet add fleet logs/*.csv --roster roster.csv
    """
    from stepgauge.fleet.adding import StatedIdentity, add_files
    from stepgauge.fleet.done import Added
    from stepgauge.fleet.store import Fleet
    from stepgauge.verbs.inputs import several

    owners = {"machine": machine_id, "type": machine_type, "hall": hall, "probe": probe_id, "gauge": gauge_id}
    files = [None if name is None else str(name) for name in (gauge, machine, roster)]
    stated = StatedIdentity(
        owners, measured_at, files[0], files[1], [str(one) for one in several(placements)], files[2]
    )
    found = add_files(Fleet(store, create=True), [str(one) for one in several(recordings)], stated, progress)
    return Added.of(found, store, len(Fleet(store).index()))


def write_answer(
    answer: "pd.DataFrame",
    output: Annotated[File | None, Writes(suffixes=(".csv", ".json", ".parquet"), short="o")] = None,
    *,
    to: Annotated[str, OneOf("csv", "json")] = "csv",
) -> list[File]:
    """The answer as a file, or as text.

    Parameters
    ----------
    output : table to write; default: print it
    to : form of the table that is printed
    """
    import sys

    from stepgauge.fleet.query import answer_text
    from stepgauge.fleet.query import write_answer as write

    if output is None:
        sys.stdout.write(answer_text(answer, to))
        return []
    write(answer, output)
    return [output]


@verb(write_answer, says=lambda _: "")
def query_fleet(store: Store, sql: Annotated[str, Text("SQL"), ARGUMENT]) -> "pd.DataFrame":
    """Answer a question in SQL (DuckDB) over a store.

    The views are recordings, probings, evaluations, budgets, diagnoses, and one for each further table of results;
    'DESCRIBE recordings' lists the columns of one, docs/fleet.md explains them. A question changes nothing.

    Parameters
    ----------
    sql : one SELECT over the views

    Returns
    -------
    A row for each row of the answer.

    Raises
    ------
    InputError
        no store, or a question that DuckDB does not take; none can change a file

    Examples
    --------
    stepgauge fleet query fleet "SELECT machine, count(*) FROM recordings GROUP BY machine"
    stepgauge fleet query fleet "SELECT hall, avg(scale_ppm) FROM evaluations GROUP BY hall" -o halls.csv
    """
    from stepgauge.fleet.query import query
    from stepgauge.fleet.store import Fleet

    answer: pd.DataFrame = query(Fleet(store), sql).to_pandas()
    return answer


@verb()
def export_fleet(
    store: Store,
    output: OutputFolder,
    *,
    where: Annotated[str, Text("SQL")] = "true",
) -> "Exported":
    """Write recordings of a store as the files that came in, byte for byte.

    Certificates, machine files and placement files come with them, and a roster by which 'fleet add' makes the same
    store again.

    Parameters
    ----------
    output : folder for recordings, gauges, machines, placements and roster.csv (made if missing)
    where : which recordings: a condition of SQL on the view recordings

    Returns
    -------
    The files of the recordings.

    Examples
    --------
    stepgauge fleet export fleet -o exported
    stepgauge fleet export fleet --where "machine = 'M1' AND measured_at >= '2026-01-01'" -o exported
    stepgauge fleet add another exported/recordings/* --roster exported/roster.csv
    """
    from stepgauge.fleet.done import Exported
    from stepgauge.fleet.query import export
    from stepgauge.fleet.store import Fleet

    return Exported(export(Fleet(store), output, where), output)


@verb()
def compact_fleet(store: Store) -> "Compacted":
    """Make few large files of the many small ones of a store.

    Single additions leave them; questions stay quick without them. Others wait while this runs. It may be killed at any
    moment: nothing is lost or there twice.
    """
    from stepgauge.fleet.compacting import compact
    from stepgauge.fleet.store import Fleet

    return compact(Fleet(store))


@verb()
def fleet_cluster(
    *,
    workers: Annotated[int, Count(1)] = 2,
    port: Annotated[int, Count(0, 65535)] = 8786,
    memory_MB: Annotated[float | None, Number("MB", above=0.0)] = None,
    idle_s: Annotated[float | None, Number("s", above=0.0)] = None,
    ready: Annotated[Any, Supplied("print")] = print,
) -> None:
    """A Dask cluster on this computer, for the option --scheduler of the other verbs.

    Only you can use it: it speaks TLS, and its key is in a file that nobody else can read. Prints that file, which is
    what --scheduler takes, and runs until Ctrl-C, or until it was idle for so long. For several computers start
    'dask scheduler' and 'dask worker --nthreads 1' on them, with TLS of their own.

    Parameters
    ----------
    workers : worker processes
    port : of the scheduler; 0: any free one
    memory_MB : limit for each worker; default: its share of the computer's
    idle_s : end when nobody has used it for so long; default: Ctrl-C
    ready : called with the file of the cluster

    Examples
    --------
    stepgauge fleet cluster --workers 2 --idle 600 &
    stepgauge fleet evaluate fleet --scheduler /tmp/stepgauge-k3x9/cluster.json
    """
    from stepgauge.executors.dask import local_cluster, wait_until_idle

    with local_cluster(workers, port, memory_MB) as cluster:
        ready(cluster.file)
        wait_until_idle(cluster, idle_s)
