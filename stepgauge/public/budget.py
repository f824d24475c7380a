"""``budget``: the uncertainty budget of what an evaluation reports, with the Monte Carlo beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.montecarlo import Model, ModelOptions, Summary, read_model, run_monte_carlo
from stepgauge.public.evaluate import R_EFF
from stepgauge.public.inputs import File, as_gauge, as_machine, as_placements, at_least, one_of, several
from stepgauge.standards.budget import Asked, Progress, make_budget
from stepgauge.standards.budget_files import StoredBudget, stored_budget
from stepgauge.standards.budget_sources import Repeats

if TYPE_CHECKING:
    from stepgauge.machine.virtual import Run
    from stepgauge.recording import Recording

REPEATS = ("pooled", "face")
COVERAGE_PERCENT = (50.0, 99.99)


def budget(
    sources: File | Recording | Run | Iterable[File | Recording | Run],
    gauge: File | Gauge,
    machine: File | Machine,
    *,
    placements: File | Placement | Iterable[File | Placement] = (),
    blocks: str | None = None,
    r_eff: str = "first",
    u_gauge_temperature_K: float | None = None,
    certificate_correlation: float | None = None,
    repeats: str = "pooled",
    coverage_percent: float = 95.45,
    runs: int = 10_000,
    seed: int = 0,
    gauge_temperature_C: float | None = None,
    search_mm: float = 2.0,
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
    r_eff : effective tip radius from the ``"first"`` used block or from ``"all"``
    u_gauge_temperature_K : standard uncertainty of the gauge's temperature; default: the machine file's
    certificate_correlation : of any two certified positions, 0 to 1; default: the gauge file's, or 0
    repeats : repeatability ``"pooled"`` over all faces, or by ``"face"``
    coverage_percent : coverage probability, 50 to 99.99
    runs, seed : of the Monte Carlo; 0 runs: none
    gauge_temperature_C : as a program is run; default: that of the certificate
    search_mm : search beyond the target of a program, where its text does not state it
    progress : given ``"Monte Carlo"`` or ``"budget"``, returns what is called with (done, total)

    Returns
    -------
    The budget as ``budget.json`` holds it, lengths in um; what no file states is listed as not included.
    """
    _check(certificate_correlation, coverage_percent, runs)
    at_least("u_gauge_temperature_K", u_gauge_temperature_K, 0.0, "K")
    at_least("search_mm", search_mm, 0.0, "mm", beyond=True)
    steps = _correlated(as_gauge(gauge), certificate_correlation)
    lies = as_placements(placements, steps)
    origin = cast(REffOrigin, one_of("r_eff", r_eff, R_EFF))
    choice = ModelOptions(u_gauge_temperature_K, origin, blocks, gauge_temperature_C, search_mm)
    given = [getattr(one, "recording", one) for one in several(sources)]
    model = read_model(given, as_machine(machine), steps, lies, choice)
    shown = progress or _silent
    simulated = _monte_carlo(model, runs, seed, shown) if runs else None
    asked = Asked(lies, cast(Repeats, one_of("repeats", repeats, REPEATS)), coverage_percent)
    return stored_budget(model, make_budget(model, asked, simulated, shown("budget")), runs)


def _silent(_: str) -> Progress:
    """Nobody watches."""
    return lambda done, total: None


def _check(correlation: float | None, coverage_percent: float, runs: int) -> None:
    if correlation is not None and not 0.0 <= correlation <= 1.0:
        raise InputError(naming("certificate_correlation"), "out of range", found=correlation, expected="0 to 1")
    if not COVERAGE_PERCENT[0] <= coverage_percent <= COVERAGE_PERCENT[1]:
        raise InputError(naming("coverage_percent"), "out of range", found=coverage_percent, expected="50 to 99.99")
    if runs != 0 and runs < 2:
        raise InputError(naming("runs"), "too few runs", found=runs, expected="0 or at least 2")


def _correlated(gauge: Gauge, correlation: float | None) -> Gauge:
    """The gauge with the correlation of its certified positions as asked."""
    if correlation is None:
        return gauge
    return replace(gauge, certificate=gauge.certificate.model_copy(update={"correlation": correlation}))


def _monte_carlo(model: Model, runs: int, seed: int, shown: Callable[[str], Progress]) -> Summary | None:
    return run_monte_carlo(model, runs, seed, progress=shown("Monte Carlo")) if model.inputs.names else None
