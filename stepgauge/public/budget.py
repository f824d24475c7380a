"""``budget``: the uncertainty budget of what an evaluation reports, with the Monte Carlo beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, cast

from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.contribution import parse_contribution
from stepgauge.machine.file import Machine
from stepgauge.montecarlo import ModelOptions
from stepgauge.standards.budget import Progress
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.standards.budget_sources import Repeats
from stepgauge.standards.budgeting import Choice, whole_budget
from stepgauge.verbs.inputs import File, a_temperature, as_gauge, as_machine, as_placements, at_least, one_of, several

if TYPE_CHECKING:
    from stepgauge.machine.virtual import Run
    from stepgauge.recording import Recording

R_EFF = ("first", "all")
REPEATS = ("pooled", "face")
MEASURANDS = ("as-is", "at-20")


def budget(
    sources: File | Recording | Run | Iterable[File | Recording | Run],
    gauge: File | Gauge,
    machine: File | Machine,
    *,
    placements: File | Placement | Iterable[File | Placement] = (),
    blocks: str | None = None,
    r_eff_origin: str = "first",
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
    progress: Callable[[str], Progress] | None = None,
) -> StoredBudget:
    """Uncertainty budget (GUM) of R_eff, XF, XB, XM and XR at every face, with the Monte Carlo beside it.

    Parameters
    ----------
    sources : recordings, runs or their files, or the file of one program
    gauge : the certified gauge, its file or shipped name
    machine : its file with the [uncertainty] table and uncertain values
    placements : give the alignment, once per placement, in order; needed with a program
    blocks : first and last block of the used section, ``"A:B"``; default: what was measured
    r_eff_origin : effective tip radius from the ``"first"`` used block or from ``"all"``
    u_gauge_temperature_K : standard uncertainty of the gauge's temperature; default: the machine file's, if recorded
    certificate_correlation : of any two certified positions, 0 to 1; default: the gauge file's, or 0
    repeats : repeatability ``"pooled"`` over all faces, or by ``"face"``
    coverage_percent : coverage probability, 50 to 99.99
    runs, seed : of the Monte Carlo; 0 runs: none
    gauge_temperature_C : as a program is run; default: that of the certificate
    search_mm : search beyond the target of a program, where its text does not state it
    measurand : the machine ``"as-is"``, or ``"at-20"``: at 20 deg C, with the temperature of its scales in U
    contributions : one's own, ``"form of the faces=0.2, distribution=uniform, dof=8"``, beside the machine file's
    measured_at : ISO date, where no recording says it: the age of the gauge's calibration
    temperature_convention, correct_drift : of recordings, as of :func:`stepgauge.evaluate`
    progress : given ``"Monte Carlo"`` or ``"budget"``, returns what is called with (done, total)

    Returns
    -------
    The budget as ``budget.json`` holds it, lengths in um; what no file states is listed as not included.
    """
    choice = budget_choice(
        blocks,
        r_eff_origin,
        u_gauge_temperature_K,
        certificate_correlation,
        repeats,
        coverage_percent,
        runs,
        seed,
        gauge_temperature_C,
        search_mm,
        measurand,
        contributions,
        measured_at,
        temperature_convention,
        correct_drift,
    )
    steps = as_gauge(gauge)
    given = [getattr(one, "recording", one) for one in several(sources)]
    return whole_budget(given, as_machine(machine), steps, as_placements(placements, steps), choice, progress)


def budget_choice(
    blocks: str | None,
    r_eff_origin: str,
    u_gauge_temperature_K: float | None,
    certificate_correlation: float | None,
    repeats: str,
    coverage_percent: float,
    runs: int,
    seed: int,
    gauge_temperature_C: float | None = None,
    search_mm: float = 2.0,
    measurand: str = "as-is",
    contributions: str | Iterable[str] = (),
    measured_at: str | None = None,
    temperature_convention: str | None = None,
    correct_drift: bool = False,
) -> Choice:
    """What :func:`budget` takes beside the files, checked."""
    at_least("u_gauge_temperature_K", u_gauge_temperature_K, 0.0, "K")
    at_least("search_mm", search_mm, 0.0, "mm", beyond=True)
    a_temperature("gauge_temperature_C", gauge_temperature_C)
    origin = cast(REffOrigin, one_of("r_eff_origin", r_eff_origin, R_EFF))
    by = cast(Repeats, one_of("repeats", repeats, REPEATS))
    at_reference = one_of("measurand", measurand, MEASURANDS) == "at-20"
    recorded = (correct_drift, temperature_convention)
    model = ModelOptions(u_gauge_temperature_K, origin, blocks, gauge_temperature_C, search_mm, at_reference, *recorded)
    texts = [contributions] if isinstance(contributions, str) else contributions
    own = tuple(parse_contribution(text) for text in texts)
    return Choice(model, certificate_correlation, by, coverage_percent, runs, seed, own, measured_at)
