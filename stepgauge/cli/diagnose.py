"""``stepgauge diagnose``: recording + certificate + machine model -> what is wrong with the model."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import FURTHER_STYLUS, SUFFIX, leaves, machine_option, output, say

if TYPE_CHECKING:
    from stepgauge.diagnosis.many import Outcome


SHOW = "show"


def _show_priors(context: click.Context, _: click.Parameter, value: str | None) -> str | None:
    """Print the shipped priors where the option stands alone."""
    if value != SHOW or context.resilient_parsing:
        return value
    from stepgauge.diagnosis.priors import priors_text

    click.echo(priors_text(), nl=False)
    raise click.exceptions.Exit


def _left(options: dict[str, Any]) -> tuple[str, ...]:
    """Neither the map of a probe nor a recording without a gauge needs these."""
    needed = options["probe"] is None and not _are_of_axis(options["recordings"])
    return () if needed else ("gauge", "machine")


@click.command("diagnose")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...|MAP")
@click.option(
    "--gauge", "-g", envvar="STEPGAUGE_GAUGE", metavar="GAUGE", help="Gauge file (TOML), or the name of a shipped one."
)
@machine_option(False, "Machine file (TOML) that is to be judged, or the name of a shipped one.")
@FURTHER_STYLUS
@click.option("--probe", metavar="PROBE", help="Probe file that is to be judged against a MAP, instead of a machine.")
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="NAME=HEADER",
    help="Of a MAP: which column holds a quantity, e.g. trigger_force_N=force_fea_N; once per quantity.",
)
@output("Folder for diagnosis.json, diagnosis.md, the diagnosed machine or probe file and the figures.")
@click.option(
    "--together/--each",
    default=True,
    show_default=True,
    help="Several recordings as placements of one machine in one diagnosis, or each on its own into OUTPUT/NAME/.",
)
@click.option(
    "--jobs",
    "-j",
    type=click.IntRange(1),
    default=None,
    metavar="N",
    help="Processes that share the recordings of --each; default: the processors there are.",
)
@click.option(
    "--without",
    multiple=True,
    metavar="KIND",
    help="Kind of effect (see 'stepgauge list effects') that is known not to be there, e.g. vibration; once per kind.",
)
@click.option(
    "--priors",
    is_flag=False,
    flag_value=SHOW,
    is_eager=True,
    callback=_show_priors,
    metavar="[FILE]",
    help="Priors in place of the shipped ones (TOML); what the file leaves out stays. Without FILE: print them.",
)
@SUFFIX
@leaves(_left)
def command(
    recordings: tuple[str, ...],
    gauge: str | None,
    machine: str | None,
    styli: tuple[str, ...],
    probe: str | None,
    columns: tuple[str, ...],
    output: str,
    together: bool,
    jobs: int | None,
    suffix: str,
    without: tuple[str, ...],
    priors: str | None,
) -> None:
    """Find where a recording departs from the simulation, identify the physical effect, and model it.

    The simulation is that of the machine file, with the effects it already has; the placement of the gauge is fitted.
    The verdict is one of: adequate (the residuals have no structure beyond the scatter), effects (known effects explain
    them), unknown (structure that no known effect explains, described by an empirical function), insufficient (the
    recording cannot discriminate). The exit code is 0 for all four. Effects that this recording cannot discriminate are
    reported as a set, with the measurement that separates them.

    Rows with a number other than 1 in the column stylus were probed with a --further-stylus: the first one is 2.
    Without the column a comment '# stylus: NAME' states it; 'measure' and 'simulate' write it where [probe] has a name.

    Prior knowledge (how common a cause is, and its usual size) is one table with reasons: --priors prints it,
    --priors FILE replaces a part of it.

    Several recordings are placements of one machine: their common effects are estimated from all of them. With --each
    they are diagnosed one by one; the names of the files must then differ, and one that cannot be diagnosed is named
    and does not stop the others.

    Recordings of one axis, at one position, or of distances ('stepgauge import --sensor') need neither gauge nor
    machine; only effects that their sensor can have are considered, and the result is in their units.

    With --probe the MAP of a probe (polar_deg, azimuth_deg and trigger_force_N, deflection_um or pretravel_um; see
    'stepgauge probe map') is diagnosed instead: which part of the probe's construction differs from its file.

    \b
    stepgauge diagnose recording.csv --gauge step-gauge-420 --machine bridge-cmm -o diagnosis
    stepgauge diagnose along-x.csv along-y.csv -g my-gauge.toml -m my-cmm.toml -o diagnosis
    stepgauge diagnose logs/*.csv -g my-gauge.toml -m my-cmm.toml --each --jobs 4 -o diagnoses
    stepgauge diagnose map.csv --probe omp40-2-50mm -o diagnosis
    stepgauge diagnose axis.csv -o diagnosis
    """
    if probe is not None:
        if without or not together:
            raise click.UsageError("--without and --each are for recordings; --probe takes neither of them")
        _diagnose_map(recordings, probe, columns, output, suffix, priors)
        return
    if _are_of_axis(recordings):
        _diagnose_axis(recordings, output, together, suffix, without, priors)
        return
    if gauge is None or machine is None:
        raise click.UsageError("a recording needs --gauge and --machine; the map of a probe needs --probe")
    from stepgauge.diagnosis.many import diagnose_each, diagnose_together
    from stepgauge.diagnosis.priors import read_priors

    table = None if priors is None else read_priors(priors)
    if together:
        with _found_so_far() as progress:
            outcome = diagnose_together(recordings, gauge, machine, output, suffix, without, table, styli, progress)
        _say_outcome(outcome, with_first=True)
        return
    outcomes = diagnose_each(recordings, gauge, machine, output, jobs, suffix, without, table, styli)
    _say_each(outcomes, len(recordings), output)


@contextmanager
def _found_so_far() -> Iterator[Callable[[Sequence[str]], None]]:
    """What a search has found up to now, in a line of a terminal, gone when it ends: it may take half a minute."""
    shown = sys.stderr.isatty()

    def show(labels: Sequence[str]) -> None:
        if shown:
            text = f"searching; up to now: {', '.join(labels).replace('_', ' ') or 'nothing'}"
            click.echo(f"\r\033[K{text[: shutil.get_terminal_size().columns - 1]}", nl=False, err=True)

    try:
        show(())
        yield show
    finally:
        if shown:
            click.echo("\r\033[K", nl=False, err=True)


def _are_of_axis(recordings: tuple[str, ...]) -> bool:
    """Whether all recordings are of one axis, a spot or distances; one kind with the other is a mistake."""
    from stepgauge.axis.recording import is_axis_recording

    if not any(map(is_axis_recording, recordings)):  # without the functions of Python, which import all that diagnoses
        return False
    from stepgauge.public.diagnose import are_of_axis

    return are_of_axis(recordings)


def _diagnose_axis(
    recordings: tuple[str, ...],
    output: str,
    together: bool,
    suffix: str,
    without: tuple[str, ...],
    priors: str | None,
) -> None:
    """Recordings without a gauge: together as settings up of one axis, or each into its own folder."""
    from pathlib import Path

    from stepgauge.diagnosis.result import FILE, Diagnosis
    from stepgauge.files.outputs import one_set, refuse_own
    from stepgauge.public.diagnose import diagnose
    from stepgauge.reports.axis_diagnosis import first_of

    sets = [list(recordings)] if together else [[one] for one in recordings]
    for paths in sets:
        folder = Path(output) if together else Path(output) / Path(paths[0]).stem
        refuse_own(folder / FILE)
        found = diagnose(paths, without=without, priors=priors)
        with one_set():
            files = found.write(folder, suffix)
        say(found.summary() if together else f"{folder.name}: {found.summary()}")
        _say_first(first_of(Diagnosis.read(files[0]).said) if together else ())
        say(f"wrote {folder}: " + ", ".join(path.name for path in files))


def _diagnose_map(
    maps: tuple[str, ...], probe: str, columns: tuple[str, ...], output: str, suffix: str, priors: str | None
) -> None:
    from stepgauge.diagnosis.priors import read_priors
    from stepgauge.diagnosis.probe_map import diagnose_probe_map, parse_columns
    from stepgauge.diagnosis.result import Diagnosis
    from stepgauge.reports.probe_diagnosis import first_of

    if len(maps) != 1:
        raise click.UsageError("--probe takes one map at a time")
    table = None if priors is None else read_priors(priors)
    say(diagnose_probe_map(maps[0], probe, output, parse_columns(columns), suffix, table).summary())
    _say_first(first_of(Diagnosis.read(f"{output}/diagnosis.json").said))
    say(f"wrote {output}")


def _say_first(lines: Iterable[str]) -> None:
    """What to do first."""
    for line in lines:
        say(line)


def _say_each(outcomes: Iterable[Outcome], count: int, output: str) -> None:
    """Each outcome as it comes; an error at the end where a recording could not be diagnosed."""
    from stepgauge.errors import PartlyDoneError

    failed = 0
    for number, outcome in enumerate(outcomes, 1):
        _say_outcome(outcome, f"[{number}/{count}] {outcome.name}: ")
        failed += not outcome.files
    if failed:
        raise PartlyDoneError(output, f"{failed} of {count} recordings could not be diagnosed")


def _say_outcome(outcome: Outcome, before: str = "", with_first: bool = False) -> None:
    """The verdict, what to do first where there is one diagnosis, and the files."""
    say(before + outcome.summary)
    _say_first(outcome.first if with_first else ())
    if outcome.files:
        say(f"{before}wrote {outcome.files[0].parent}: " + ", ".join(path.name for path in outcome.files))
