"""``budget``: the uncertainty of what an evaluation reports, by the GUM's sums or by Monte Carlo."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Number, OneOf, Pair, Reads, Repeated, Supplied
from stepgauge.verbs.shared import (
    Convention,
    CorrectDrift,
    Figure,
    File,
    GaugeLike,
    GaugeTemperature,
    Jobs,
    MachineLike,
    MeasuredAt,
    OutputFolder,
    Placements,
    ReffOrigin,
    Search,
    Section,
    UGaugeTemperature,
)

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.evaluation.face_errors import REffOrigin
    from stepgauge.machine.virtual import Run
    from stepgauge.montecarlo.result import MonteCarloBudget
    from stepgauge.recording import Recording
    from stepgauge.standards.budget import Progress
    from stepgauge.standards.budget_files import StoredBudget
    from stepgauge.standards.budget_sources import Repeats
    from stepgauge.standards.budgeting import BudgetChoices as Chosen

CHOICE = (
    *("blocks", "r_eff_origin", "u_gauge_temperature_K", "certificate_correlation", "repeats", "coverage_percent"),
    *("runs", "seed", "measurand", "contributions", "measured_at", "temperature_convention", "correct_drift"),
)
"""What is chosen beside the files, of one recording or of those of a fleet."""


def write(budget: "StoredBudget | MonteCarloBudget", output: OutputFolder, *, figure: Figure = "png") -> list[Path]:
    """Files of a budget.

    Parameters
    ----------
    output : folder for budget.json, budget.csv (or uncertainty.json, uncertainty.csv) and the figures, e.g. that of the
        evaluation (made if missing)
    """
    return budget.write(output, figure)


@verb(write)
def budget(
    sources: Annotated[
        "File | Recording | Run | pd.DataFrame | Iterable[File | Recording | Run | pd.DataFrame]",
        Repeated(Reads("PROGRAM|RECORDING"), "source"),
        ARGUMENT,
    ],
    gauge: GaugeLike,
    machine: MachineLike,
    *,
    placements: Placements = (),
    method: Annotated[str, OneOf("gum", "monte-carlo")] = "gum",
    blocks: Section = None,
    r_eff_origin: ReffOrigin = None,
    u_gauge_temperature_K: UGaugeTemperature = None,
    certificate_correlation: Annotated[float | None, Number("", 0.0, 1.0)] = None,
    repeats: Annotated[str, OneOf("pooled", "face")] = "pooled",
    coverage_percent: Annotated[float, Number("%", 50.0, 99.99)] = 95.45,
    runs: Annotated[int, Count(0)] = 10_000,
    seed: Annotated[int, Count(0)] = 0,
    gauge_temperature_C: GaugeTemperature = None,
    search_mm: Search = 2.0,
    measurand: Annotated[str, OneOf("as-is", "at-20")] = "as-is",
    contributions: Annotated["str | Iterable[str]", Repeated(Pair(whole=True), "contribution")] = (),
    measured_at: MeasuredAt = None,
    temperature_convention: Convention = None,
    correct_drift: CorrectDrift = False,
    jobs: Jobs = 1,
    runs_folder: Annotated[Path | None, Supplied("runs folder")] = None,
    progress: Annotated["Callable[[str], Progress] | None", Supplied("bars")] = None,
) -> "StoredBudget | MonteCarloBudget":
    """Uncertainty of the errors that an evaluation reports, by source.

    By the method gum: a budget (GUM) of R_eff, XF, XB, XM and XR at every face, with the Monte Carlo beside it. Counted
    are the gauge's certificate with its correlation and its drift since, temperature and expansion of the gauge (of the
    scales for the measurand at-20), probing, resolution, alignment, repeatability, contributions of your own and every
    uncertain value of the machine file; R_eff enters XB through its own readings. What no file states is not assumed:
    it is listed as not evaluated, with the key that would state it. In the machine file:

        [uncertainty]
        gauge_temperature_K = 0.05                # standard uncertainty, K; or { u = 0.05, dof = 8 }
        probing_um = 0.2                          # of a face, the same in every cycle, um
        resolution_um = 0.1                       # smallest step of the reading, um
        [machine]
        temperature_C = { value = 20.2, u = 0.1 } # of the scales

    In the gauge file: correlation and degrees_of_freedom of [certificate]. In the placement: [uncertainty] of locate.

    By monte-carlo: the distribution of every number that evaluate reports (JCGM 101), with its 95 % interval and the
    contribution of each input. Of a program: what the virtual CMM would measure, over all that is uncertain. Of
    recordings: how sure the errors evaluated from them are; effects of the machine file then count as disturbances of
    the measurement, by their uncertain parameters only. A value of the machine file carries an uncertainty as
    ppm = { value = 2.5, u = 0.8, distribution = "uniform" } (normal, uniform, triangular, arcsine, student). The same
    seed gives the same numbers; an interrupted command goes on where it stopped when it is repeated.

    Parameters
    ----------
    sources : recordings, runs, tables or their files, or the file of one program
    machine : machine file with its [uncertainty] table and uncertain values
    placements : placement file: its [uncertainty] gives the alignment; once per placement, in order; needed with a
        program
    method : the GUM's sums, or the propagation of distributions
    certificate_correlation : correlation coefficient of any two certified positions; default: the gauge file's, or 0
    repeats : repeatability: one standard deviation for all faces, or one by face with n - 1 degrees of freedom
    coverage_percent : coverage probability; 95.45 is k = 2 for many degrees of freedom
    runs : Monte Carlo runs; beside a budget 0: none
    seed : seed of the Monte Carlo; the same gives the same
    measurand : what is measured: the machine as it is, or at 20 deg C, with the temperature of its scales in U
    contributions : a contribution of your own, in um or with a sensitivity: 'form=0.2, distribution=uniform, dof=8';
        further keys: sensitivity, sensitivity_per_m; or [[contribution]] in the machine file
    measured_at : ISO date, where no recording says it: the age of the calibration
    jobs : of monte-carlo: processes at most, as far as the work is worth it; changes no number
    runs_folder : of monte-carlo: where the runs are kept meanwhile, so that a repeated call goes on
    progress : given ``"Monte Carlo"`` or ``"budget"``, returns what is called with (done, total)

    Returns
    -------
    The budget as ``budget.json`` holds it, lengths in um; what no file states is listed as not included. By
    monte-carlo the distributions.

    Examples
    --------
    stepgauge evaluate recording.csv -g step-gauge-420 -o result
    stepgauge budget recording.csv -g step-gauge-420 -m machine.toml -p placement.toml -o result
    stepgauge budget gauge.dmi -m bridge-cmm -g step-gauge-420 -p placement.toml --method monte-carlo -o distributions
    """
    from stepgauge.errors import InputError, naming
    from stepgauge.standards.budgeting import whole_budget
    from stepgauge.verbs.inputs import resolve_gauge, resolve_machine, resolve_placements, resolve_sources

    chosen = budget_choice(
        blocks=blocks,
        r_eff_origin=r_eff_origin,
        u_gauge_temperature_K=u_gauge_temperature_K,
        certificate_correlation=certificate_correlation,
        repeats=repeats,
        coverage_percent=coverage_percent,
        runs=runs,
        seed=seed,
        gauge_temperature_C=gauge_temperature_C,
        search_mm=search_mm,
        measurand=measurand,
        contributions=contributions,
        measured_at=measured_at,
        temperature_convention=temperature_convention,
        correct_drift=correct_drift,
    )
    steps, given = resolve_gauge(gauge), resolve_sources(sources)
    if method == "gum":
        return whole_budget(
            given, resolve_machine(machine), steps, resolve_placements(placements, steps), chosen, progress
        )
    if runs < 2:
        raise InputError(naming("runs"), "too few runs", found=runs, expected="2 or more")
    from stepgauge.montecarlo import read_model
    from stepgauge.montecarlo.result import monte_carlo_budget

    model = read_model(given, resolve_machine(machine), steps, resolve_placements(placements, steps), chosen.model)
    told = None if progress is None else progress("runs")
    return monte_carlo_budget(model, runs, seed, jobs, runs_folder, told)


def budget_choice(
    *,
    blocks: "str | Sequence[int] | None" = None,
    r_eff_origin: str | None = None,
    u_gauge_temperature_K: float | None = None,
    certificate_correlation: float | None = None,
    repeats: str = "pooled",
    coverage_percent: float = 95.45,
    runs: int = 10_000,
    seed: int = 0,
    gauge_temperature_C: float | None = None,
    search_mm: float = 2.0,
    measurand: str = "as-is",
    contributions: str | Iterable[str] = (),
    measured_at: str | None = None,
    temperature_convention: str | None = None,
    correct_drift: bool = False,
) -> "Chosen":
    """What :func:`budget` takes beside the files."""
    from stepgauge.machine.contribution import parse_contribution
    from stepgauge.montecarlo import ModelOptions
    from stepgauge.standards.budgeting import BudgetChoices as Chosen

    origin, by = cast("REffOrigin | None", r_eff_origin), cast("Repeats", repeats)
    section = blocks if blocks is None or isinstance(blocks, str) else ":".join(map(str, blocks))
    conditions = (gauge_temperature_C, search_mm, measurand == "at-20", correct_drift, temperature_convention)
    model = ModelOptions(u_gauge_temperature_K, origin, section, *conditions)
    texts = [contributions] if isinstance(contributions, str) else contributions
    own = tuple(parse_contribution(text) for text in texts)
    return Chosen(model, certificate_correlation, by, coverage_percent, runs, seed, own, measured_at)
