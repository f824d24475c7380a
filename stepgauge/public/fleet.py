"""The verbs of a fleet: recordings of many machines and gauges in a store, and work on all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from stepgauge.errors import InputError, naming
from stepgauge.executors.choice import engine_of
from stepgauge.verbs.inputs import File, at_least, one_of, several

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.fleet.hierarchical.answer import FleetInference
    from stepgauge.fleet.hierarchical.watching import FleetWatch

Progress = Callable[[int, int], None]


def add_to_fleet(
    store: File,
    recordings: File | Iterable[File],
    gauge: File | None = None,
    machine: File | None = None,
    *,
    placements: File | Iterable[File] = (),
    roster: File | None = None,
    machine_id: str | None = None,
    machine_type: str | None = None,
    hall: str | None = None,
    probe_id: str | None = None,
    gauge_id: str | None = None,
    measured_at: str | None = None,
    progress: Progress | None = None,
) -> tuple[list[str], list[str]]:
    """Add recordings to a store, with all that belongs to them; makes the store where there is none.

    What a recording states in its comments counts, then a row of the roster, then what is stated here.

    Parameters
    ----------
    store : its folder
    recordings : files, CSV or Parquet
    gauge, machine : files or shipped names, where the roster does not state them; only a diagnosis, a budget and an
        inference need the machine
    placements : files, once per placement in the recordings, in order
    roster : table (CSV) with whose the recordings are, ``docs/fleet.md``
    machine_id, machine_type, hall, probe_id, gauge_id : whose all of them are
    measured_at : ISO date, where the recordings do not say
    progress : told how many of how many files are done

    Returns
    -------
    The keys of the new recordings, and those of the recordings that were there.

    Raises
    ------
    InputError
        a recording that is not of its gauge, or that states something else; those before it stay added
    """
    from stepgauge.fleet.adding import Stated, add_files
    from stepgauge.fleet.store import Fleet

    owners = {"machine": machine_id, "type": machine_type, "hall": hall, "probe": probe_id, "gauge": gauge_id}
    files = [None if name is None else str(name) for name in (gauge, machine, roster)]
    stated = Stated(owners, measured_at, files[0], files[1], [str(one) for one in several(placements)], files[2])
    return add_files(Fleet(store, create=True), [str(one) for one in several(recordings)], stated, progress)


def query_fleet(store: File, sql: str) -> pd.DataFrame:
    """The answer to a question in the SQL of DuckDB, a row for each row of it.

    Parameters
    ----------
    store : its folder
    sql : one SELECT over the views ``recordings``, ``probings``, ``evaluations``, ``budgets`` and ``diagnoses``, whose
        columns with their units ``docs/fleet.md`` lists

    Raises
    ------
    InputError
        no store, or a question that DuckDB does not take; none can change a file
    """
    from stepgauge.fleet.query import query
    from stepgauge.fleet.store import Fleet

    answer: pd.DataFrame = query(Fleet(store), sql).to_pandas()
    return answer


def export_fleet(store: File, folder: File, where: str = "true") -> list[Path]:
    """Write recordings of a store as the files that came in, byte for byte, with a roster to add them again.

    Parameters
    ----------
    store : its folder
    folder : for recordings, certificates, machine files, placements and ``roster.csv`` (made if missing)
    where : which recordings: a condition of SQL on the view ``recordings``

    Returns
    -------
    The files of the recordings.
    """
    from stepgauge.fleet.export import export
    from stepgauge.fleet.store import Fleet

    return export(Fleet(store), folder, where)


def evaluate_fleet(
    store: File,
    *,
    blocks: str | None = None,
    r_eff_origin: str = "first",
    jobs: int | None = 1,
    scheduler: str | None = None,
    memory_MB: float | None = None,
    progress: Progress | None = None,
) -> list[str]:
    """Evaluate the recordings of a store that have no evaluation with these options; the view ``evaluations`` has them.

    Parameters
    ----------
    store : its folder
    blocks : first and last block of the used section, ``"A:B"``; default: what was measured
    r_eff_origin : effective tip radius from the ``"first"`` used block or from ``"all"``
    jobs : processes; 1: this process, None: as many as there are processors
    scheduler : a Dask cluster that does the work instead: the file of ``fleet cluster``, or ``tcp://host:port``
    memory_MB : what each process may allocate
    progress : told how many of how many recordings are done

    Returns
    -------
    Why some cannot be evaluated, a line each.
    """
    from stepgauge.fleet.evaluating import evaluate_fleet as evaluate_stored
    from stepgauge.fleet.store import Fleet

    R_EFF = ("first", "all")

    engine = engine_of(jobs, scheduler, memory_MB)
    return evaluate_stored(Fleet(store), engine, blocks, one_of("r_eff_origin", r_eff_origin, R_EFF), progress)


def budget_fleet(
    store: File,
    *,
    blocks: str | None = None,
    r_eff_origin: str = "first",
    u_gauge_temperature_K: float | None = None,
    certificate_correlation: float | None = None,
    repeats: str = "pooled",
    coverage_percent: float = 95.45,
    runs: int = 10_000,
    seed: int = 0,
    measurand: str = "as-is",
    contributions: str | Iterable[str] = (),
    measured_at: str | None = None,
    temperature_convention: str | None = None,
    correct_drift: bool = False,
    jobs: int | None = 1,
    scheduler: str | None = None,
    memory_MB: float | None = None,
    progress: Progress | None = None,
) -> list[str]:
    """Uncertainty budgets, with Monte Carlo, of the recordings that have none with these options: view ``budgets``.

    Needs a machine file with each recording. The numbers are those of :func:`stepgauge.budget` of each alone; each
    budget is on the disk as it is made.

    Parameters
    ----------
    store : its folder
    blocks, r_eff_origin, u_gauge_temperature_K, certificate_correlation, repeats, coverage_percent, runs, seed : as of
        :func:`stepgauge.budget`, the same for all recordings
    measurand, contributions, measured_at, temperature_convention, correct_drift : as of :func:`stepgauge.budget`, too
    jobs, scheduler, memory_MB, progress : as of :func:`evaluate_fleet`

    Returns
    -------
    Why some have no budget, a line each.
    """
    from stepgauge.fleet.budgeting import budget_fleet as budget_stored
    from stepgauge.fleet.store import Fleet
    from stepgauge.public.budget import budget_choice

    stated = (u_gauge_temperature_K, certificate_correlation, repeats, coverage_percent, runs, seed)
    further: dict[str, object] = {"measurand": measurand, "contributions": contributions, "measured_at": measured_at}
    further |= {"temperature_convention": temperature_convention, "correct_drift": correct_drift}
    choice = budget_choice(blocks, r_eff_origin, *stated, **further)  # type: ignore[arg-type]
    return budget_stored(Fleet(store), engine_of(jobs, scheduler, memory_MB), choice, progress)


def diagnose_fleet(
    store: File,
    *,
    without: Iterable[str] = (),
    priors: File | None = None,
    jobs: int | None = 1,
    scheduler: str | None = None,
    memory_MB: float | None = None,
    progress: Progress | None = None,
) -> list[str]:
    """Diagnose, each by itself, the recordings that have no diagnosis with these options: the view ``diagnoses``.

    Needs a machine file with each recording. Each diagnosis is on the disk as it is made.

    Parameters
    ----------
    store : its folder
    without : kinds of effects that are known to be absent
    priors : file (TOML) in place of the shipped ones
    jobs, scheduler, memory_MB, progress : as of :func:`evaluate_fleet`

    Returns
    -------
    Why some cannot be diagnosed, a line each.
    """
    from stepgauge.diagnosis.priors import read_priors
    from stepgauge.fleet.diagnosing import diagnose_fleet as diagnose_stored
    from stepgauge.fleet.store import Fleet

    table = None if priors is None else read_priors(priors)
    return diagnose_stored(Fleet(store), engine_of(jobs, scheduler, memory_MB), tuple(without), table, progress)


def infer_fleet(
    store: File,
    *,
    jobs: int | None = 1,
    scheduler: str | None = None,
    memory_MB: float | None = None,
    progress: Progress | None = None,
) -> FleetInference:
    """What follows a gauge from machine to machine, stays with a machine, or is shared by a line or a hall.

    Parameters
    ----------
    store : its folder; every recording needs a machine file
    jobs, scheduler, memory_MB : who reads the recordings, as of :func:`evaluate_fleet`
    progress : told how many of how many recordings have been read

    Returns
    -------
    FleetInference
        named causes; its ``left_out`` says which recordings cannot be used, and why

    Raises
    ------
    InputError
        no store, or no recording in it that can be used
    """
    from stepgauge.fleet.hierarchical.stored import infer_store

    return infer_store(store, engine_of(jobs, scheduler, memory_MB), progress)


def watch_fleet(
    store: File,
    *,
    limits: Mapping[str, float] | None = None,
    risk: float = 0.05,
    jobs: int | None = 1,
    scheduler: str | None = None,
    memory_MB: float | None = None,
    progress: Progress | None = None,
) -> FleetWatch:
    """Machines and gauges against their own history, their peers and their limits, and when they are due.

    Drifts of a machine with a gauge are those of ``stepgauge history``; recordings without an evaluation get one.

    Parameters
    ----------
    store : its folder; every recording needs a machine file
    limits : maximum permissible sizes by name: ``scale`` (um/m), ``squareness`` (urad), ``reversal`` (um),
        ``certificate_scale`` (um/m), ``wear`` (um)
    risk : probability of being out of limits that is accepted until the next calibration, 0 to 0.5
    jobs, scheduler, memory_MB, progress : as of :func:`infer_fleet`

    Returns
    -------
    FleetWatch
        every quantity of every machine and gauge

    Raises
    ------
    InputError
        no store, no recording in it that can be used, or a limit of something that is not watched
    """
    from stepgauge.fleet.hierarchical.watching import LIMITS, FleetWatch
    from stepgauge.fleet.past import history_entries
    from stepgauge.fleet.store import Fleet

    for name, size in (limits or {}).items():
        at_least(one_of("limits", name, LIMITS), size, 0.0, beyond=True)
    if not 0.0 < risk <= 0.5:
        raise InputError(naming("risk"), "out of range", found=risk, expected="more than 0, at most 0.5")
    found = infer_fleet(store, jobs=jobs, scheduler=scheduler, memory_MB=memory_MB, progress=progress)
    evaluate_fleet(store, jobs=jobs, scheduler=scheduler, memory_MB=memory_MB)
    return FleetWatch.of(found, limits or {}, risk, history_entries(Fleet(store)))
