"""``report``: results as pages to sign, to read, to lay over each other, to explore."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import Of, verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Flag, Reads, Repeated, Writes
from stepgauge.verbs.shared import File, GaugeIfNeeded, MachineIfNeeded, Mpe, Placements
from stepgauge.verbs.statements import NAMES, stated

if TYPE_CHECKING:
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.recording import Recording
    from stepgauge.standards.budget_files import StoredBudget
    from stepgauge.verbs.reporting import Reported

WORDS = tuple(name for name in NAMES if name not in ("date", "language", "template"))
"""What only a person can say."""
SIGNED = ("placements", "budget", "certificate", "mpe")
"""What only a report to sign prints."""


def leave(values: dict[str, Any], _: set[str]) -> tuple[str, ...]:
    """What others than a report to sign do not print, and what a certificate states itself."""
    from stepgauge.reports.kinds import kind_of

    results = values["results"]
    kind = kind_of(results[0])
    if len(results) == 1 and not values["interactive"] and kind == "evaluation":
        return WORDS if values["certificate"] else ()
    judged = len(results) == 1 and kind != "evaluation"
    return (*WORDS, *SIGNED, *(("gauge", "machine") if judged else ()))


@verb(leaves=leave)
def report(
    results: Annotated[
        "File | Evaluation | Any | Iterable[File | Evaluation]",
        Repeated(Reads("RESULT", folder=True), "result"),
        ARGUMENT,
    ],
    output: Annotated[File, Writes(short="o")],
    *,
    gauge: GaugeIfNeeded = None,
    placements: Placements = (),
    machine: MachineIfNeeded = None,
    budget: Annotated["File | StoredBudget | None", Reads("BUDGET", folder=True)] = None,
    certificate: Annotated[File | None, Reads("FILE", short="c")] = None,
    mpe: Mpe = None,
    interactive: Annotated[bool, Flag()] = False,
    recordings: Annotated[
        "File | Recording | Iterable[File | Recording]", Repeated(Reads("RECORDING", short="r"), "recording")
    ] = (),
    **statement: Annotated[Any, Of(stated, *NAMES)],
) -> "Reported":
    """Pages from results: a report to sign, the story of a diagnosis, an overlay, a page to explore.

    RESULT is the folder that a verb wrote, or its JSON file. Of an evaluation: a report to print and sign. Certificate,
    machine, placement, conditions, effective radius, the table of all faces, figures, notes, and a place for
    signatures. What is not known is listed as not stated; nothing is assumed. Reports on an example certificate state
    this on every page. With ``budget`` every error has its expanded uncertainty, and the budget is printed. With
    ``certificate`` it is a calibration certificate ('stepgauge list files certificate --copy-to .' gives a file to fill
    in).

    Of a diagnosis: page 1 states what to do first and what was found, each cause and rival with its own value;
    evidence and appendix follow. Of an investigation: every run with its reason and its result. Of the JSON file of
    'fleet infer': the causes with their owners, and the recordings that prove them.

    Of several evaluations of one gauge: an overlay, every error before and after, and their differences with their
    own uncertainty.

    Parameters
    ----------
    results : an evaluation or a diagnosis, its folder or JSON file; the folder of an investigation; the inference of a
        fleet or its JSON file; or several evaluations, the first being the one before
    output : the report to write: NAME.pdf, or NAME.html (one file, to print from a browser); of an overlay also .png,
        .svg
    gauge : gauge file or shipped name: adds the certificate's uncertainties; must be the gauge of the evaluation
    placements : placement file of locate (needs ``gauge``): adds angles and uncertainties; once per placement, in order
    machine : machine file or shipped name: adds travel, speeds, probe and temperature of the scales
    budget : budget.json of stepgauge budget, or its folder: adds uncertainties; default: that of RESULT, in
        its folder or among the results of the project
    certificate : certificate.toml: makes the report a calibration certificate in the order of ISO/IEC 17025; it states
        number, operator, customer, location, date and remarks itself; one that was issued is never written over
    mpe : maximum permissible error "A + L/K" or "min(A + L/K, B)", um with L in mm: pass, fail or undecidable by
        ISO 14253-1; default: that of the certificate, else that of the evaluation, else of the machine file
    interactive : a page (.html, one file, no network): click a face or a finding to see its probings
    recordings : of an evaluation whose single probings such a page shows, in order; default: those that it was made
        from
    statement : of the report of one evaluation: number, operator, customer, location, date, remarks; of every report
        its language, and a template of your own

    Returns
    -------
    Notes on the file, mostly none.

    Raises
    ------
    InputError
        files that are not of this evaluation, evaluations that cannot be compared, a template that fails

    Examples
    --------
    stepgauge report result -o report.pdf
    stepgauge report result -g step-gauge-420 -p placement.toml -m bridge-cmm \\
        --number 2026-017 --operator "A. Meyer" -o report.pdf
    stepgauge report result -g step-gauge-420 --budget result -c certificate.toml -o certificate.pdf
    stepgauge report diagnosis -o diagnosis.pdf
    stepgauge report before after -o overlay.pdf
    stepgauge report result -g step-gauge-420 --interactive -o explore.html
    """
    from stepgauge.verbs.inputs import several
    from stepgauge.verbs.reporting import Reported, ReportRequest, write_result

    said = {name: statement.get(name) for name in WORDS}
    given, lies = several(results), several(placements)
    language = statement.get("language") or "en"
    request = ReportRequest(
        given, output, gauge, lies, machine, budget, certificate, statement.get("date"), said, mpe, language
    )
    return Reported(write_result(request, statement.get("template"), interactive, several(recordings)))
