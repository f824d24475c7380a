"""Work on all recordings of a fleet: evaluations, budgets, diagnoses, causes with their owners, limits, due dates."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.budget import CHOICE, budget
from stepgauge.verbs.define import Of, verb
from stepgauge.verbs.evaluate import evaluate
from stepgauge.verbs.fleet import Memory, Scheduler, Store
from stepgauge.verbs.kinds import Number, Pair, Repeated, Writes
from stepgauge.verbs.shared import Figure, File, Jobs, OutputFolder, Priors, Progress, Without

if TYPE_CHECKING:
    from stepgauge.fleet.done import Worked
    from stepgauge.fleet.hierarchical.answer import FleetInference
    from stepgauge.fleet.hierarchical.watching import FleetWatch

LIMITS = ("scale", "squareness", "reversal", "certificate_scale", "wear")
"""Written out so that --help needs no numpy; a test compares it with what is watched."""
EVALUATION = ("blocks", "r_eff_origin", "temperature_convention", "correct_drift")
"""What is chosen for an evaluation beside the files; a test compares it with what a store keeps of it."""


@verb(partly=True)
def evaluate_fleet(
    store: Store,
    *,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    memory_MB: Memory = None,
    progress: Progress = None,
    **choice: Annotated[Any, Of(evaluate, *EVALUATION)],
) -> "Worked":
    """Evaluate the recordings of a store that have no evaluation with these options.

    The numbers are those of 'stepgauge evaluate' of each recording, whatever does the work. They are in the view
    evaluations of 'fleet query', and 'stepgauge history STORE' reads them. With other options than before all are
    evaluated anew. What is done stays done where this is stopped.

    Returns
    -------
    Why some cannot be evaluated, a line each.

    Examples
    --------
    stepgauge fleet evaluate fleet --jobs 2
    stepgauge fleet evaluate fleet --scheduler /tmp/stepgauge-k3x9/cluster.json
    """
    from stepgauge.executors.task import engine_of
    from stepgauge.fleet.done import Worked
    from stepgauge.fleet.evaluating import EvaluationChoices
    from stepgauge.fleet.evaluating import evaluate_fleet as evaluate_stored
    from stepgauge.fleet.store import Fleet

    chosen, engine = EvaluationChoices(**choice), engine_of(jobs, scheduler, memory_MB)
    errors = evaluate_stored(Fleet(store), engine, chosen, progress)
    return Worked(errors, "evaluated", store)


@verb(partly=True)
def budget_fleet(
    store: Store,
    *,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    memory_MB: Memory = None,
    progress: Progress = None,
    **choice: Annotated[Any, Of(budget, *CHOICE)],
) -> "Worked":
    """Uncertainty budgets of the recordings of a store that have none with these options.

    Needs a machine file with each recording ('fleet add --machine'); placements that were added give the alignment. The
    numbers are those of 'stepgauge budget' of each recording, whatever does the work. They are in the view budgets of
    'fleet query', a row for each quantity. Each budget is on the disk as it is made: the same command goes on where
    this was stopped or killed.

    Returns
    -------
    Why some have no budget, a line each.

    Examples
    --------
    stepgauge fleet budget fleet --jobs 2
    stepgauge fleet query fleet "SELECT machine, max(expanded_um) FROM budgets WHERE quantity = 'xm' GROUP BY machine"
    """
    from stepgauge.executors.task import engine_of
    from stepgauge.fleet.budgeting import budget_fleet as budget_stored
    from stepgauge.fleet.done import Worked
    from stepgauge.fleet.store import Fleet
    from stepgauge.verbs.budget import budget_choice

    chosen, engine = budget_choice(**choice), engine_of(jobs, scheduler, memory_MB)
    return Worked(budget_stored(Fleet(store), engine, chosen, progress), "budgeted", store)


@verb(partly=True)
def diagnose_fleet(
    store: Store,
    *,
    without: Without = (),
    priors: Priors = None,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    memory_MB: Memory = None,
    progress: Progress = None,
) -> "Worked":
    """Diagnose the recordings of a store that have no diagnosis with these options, each by itself.

    Needs a machine file with each recording ('fleet add --machine'). The diagnoses are those of 'stepgauge diagnose'
    of each recording, in the view diagnoses of 'fleet query'. Each is on the disk as it is made: the same command goes
    on where this was stopped or killed.

    Returns
    -------
    Why some cannot be diagnosed, a line each.

    Examples
    --------
    stepgauge fleet diagnose fleet --jobs 2
    stepgauge fleet diagnose fleet --scheduler /tmp/stepgauge-k3x9/cluster.json
    """
    from stepgauge.diagnosis.priors import read_priors
    from stepgauge.executors.task import engine_of
    from stepgauge.fleet.diagnosing import diagnose_fleet as diagnose_stored
    from stepgauge.fleet.done import Worked
    from stepgauge.fleet.store import Fleet
    from stepgauge.verbs.inputs import several

    table = None if priors is None else read_priors(priors)
    engine = engine_of(jobs, scheduler, memory_MB)
    return Worked(diagnose_stored(Fleet(store), engine, tuple(several(without)), table, progress), "diagnosed", store)


def write_inference(
    inference: "FleetInference", output: Annotated[File, Writes(short="o")] = "fleet.json"
) -> list[Path]:
    """Causes and report.

    Parameters
    ----------
    output : JSON file of the causes, the report beside it as Markdown; or NAME.html or NAME.pdf: the report in that
        form, the JSON file beside it
    """
    return list(inference.write(output))


@verb(write_inference, shows=True, partly=True)
def infer_fleet(
    store: Store,
    *,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    memory_MB: Memory = None,
    progress: Progress = None,
) -> "FleetInference":
    """Causes of errors in a fleet, with their owners: a machine, a gauge, a model line, a hall, a probe.

    What follows a gauge from machine to machine is the gauge; what stays with a machine whatever the gauge is the
    machine; what all visits to a hall share on a day is the hall. Every cause is stated with size, U, date, probability
    and the recordings that settle it; what the fleet cannot tell apart is stated as a set, with the measurement that
    would. Needs a machine file for every recording.

    Returns
    -------
    Named causes; ``left_out`` says which recordings cannot be used, and why.

    Raises
    ------
    InputError
        no store, or no recording in it that can be used

    Examples
    --------
    stepgauge fleet infer fleet -o fleet.json
    stepgauge fleet infer fleet --jobs 2 -o fleet.html
    """
    from stepgauge.executors.task import engine_of
    from stepgauge.fleet.hierarchical.stored import infer_store

    return infer_store(store, engine_of(jobs, scheduler, memory_MB), progress)


def write_watch(watch: "FleetWatch", output: OutputFolder, *, figure: Figure = "png") -> list[Path]:
    """Files of a watch.

    Parameters
    ----------
    output : folder for watch.json, watch.csv and the figure (made if missing)
    """
    return list(watch.write(output, figure))


@verb(write_watch, shows=True, partly=True)
def watch_fleet(
    store: Store,
    *,
    limits: Annotated["Mapping[str, float] | None", Repeated(Pair(names=LIMITS), "limit")] = None,
    risk: Annotated[float, Number("", high=0.5, above=0.0)] = 0.05,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    memory_MB: Memory = None,
    progress: Progress = None,
) -> "FleetWatch":
    """Machines and gauges against their own history, their peers and their limits.

    Every visit counts for a machine without the shares of gauge, hall and probe, as 'fleet infer' finds them, so that a
    worn gauge moves no machine. Stated are level, rate and dated changes with U; who leaves the machines of its line
    (at most 5 % of those named are expected to be wrong); with a limit the decision by ISO 14253-1, and the day on
    which the risk of being out of limits is no longer accepted. watch.json is for other programs; its schema is written
    beside it.

    Parameters
    ----------
    limits : maximum permissible size by name: scale (um/m), squareness (urad), reversal (um), certificate_scale (um/m),
        wear (um)
    risk : probability of being out of limits that is accepted until the next calibration

    Returns
    -------
    Every quantity of every machine and gauge.

    Raises
    ------
    InputError
        no store, no recording in it that can be used, or a limit of something that is not watched

    Examples
    --------
    stepgauge fleet watch fleet --limit scale=5 --limit reversal=2 -o watch
    """
    from stepgauge.fleet.hierarchical.watching import FleetWatch
    from stepgauge.fleet.past import history_entries
    from stepgauge.fleet.store import Fleet

    given: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler, "memory_MB": memory_MB}
    found = infer_fleet(store, **given, progress=progress)
    evaluate_fleet(store, **given)
    return FleetWatch.of(found, limits or {}, risk, history_entries(Fleet(store)))
