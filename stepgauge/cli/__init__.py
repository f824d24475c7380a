"""The ``stepgauge`` command: one verb per module, loaded only when it is called."""

from __future__ import annotations

import importlib
import shlex
import sys
from pathlib import Path
from typing import Any

import click

from stepgauge import __version__
from stepgauge.cli.pipes import readers_may_leave
from stepgauge.errors import LONGEST, InputError, one_line
from stepgauge.project.find import find_project
from stepgauge.verbs.catalogue import PLACES

Tasks = dict[str, dict[str, tuple[str, str]]]


class LazyGroup(click.Group):
    """A group whose verbs live in modules that are imported only when the verb runs.

    ``tasks`` maps a heading to its verbs, and a verb to ``(module, help)``; every module calls its click command
    ``command``. The help of the group is written from the map, so that it costs no import of numpy.
    """

    def __init__(self, *args: Any, tasks: Tasks | None = None, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.tasks = tasks or {}
        self.verbs = {verb: place for verbs in self.tasks.values() for verb, place in verbs.items()}

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.verbs)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.verbs:
            return None
        words = " ".join((*_words(ctx), cmd_name))
        command = (
            _command(words, cmd_name) if words in PLACES else importlib.import_module(self.verbs[cmd_name][0]).command
        )
        if cmd_name in WITH_EFFECTS and EFFECTS not in command.params:
            command.params.append(EFFECTS)
        path = None if ctx.resilient_parsing or cmd_name in NOT_IN_PROJECTS else find_project()
        return command if path is None else _in_project(command, ctx, path, cmd_name)

    def invoke(self, ctx: click.Context) -> Any:
        """What a verb writes is one set of files, which appears when the verb is done."""
        from stepgauge.files.outputs import one_set

        if ctx.parent is not None:
            return super().invoke(ctx)
        with one_set():
            return super().invoke(ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, self.verbs))
        for heading, verbs in self.tasks.items():
            with formatter.section(heading):
                formatter.write_dl([(verb.ljust(width), text) for verb, (_, text) in verbs.items()])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The group alone, ``help`` and ``help VERB`` print help, as ``--help`` does."""
        if not args and not ctx.resilient_parsing:
            args = ["--help"]
        elif args[:1] == ["help"]:
            args = [*args[1:], "--help"]
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """The verb that is meant; one that is mistyped is an error that names the nearest."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            import difflib

            near = difflib.get_close_matches(args[0], list(self.verbs), n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise click.UsageError(error.message + hint, ctx) from None


def _command(words: str, name: str) -> click.Command:
    """The command of a verb from its definition."""
    from stepgauge.cli.build import make_command
    from stepgauge.verbs.catalogue import find_verb

    return make_command(name, find_verb(words))


def _in_project(command: click.Command, ctx: click.Context, path: Path, name: str) -> click.Command:
    """The verb with what the project file states where an option is left out."""
    from stepgauge.cli.defaults import with_defaults
    from stepgauge.project.file import read_project

    verb = (*_words(ctx), name)
    if isinstance(command, click.Group):
        return command
    return with_defaults(command, ctx, read_project(path, VERBS), verb)


def _words(ctx: click.Context) -> tuple[str, ...]:
    """The groups that a verb belongs to, below the program's own name."""
    return () if ctx.parent is None else (*_words(ctx.parent), str(ctx.info_name))


def _load_effects(context: click.Context, _: click.Parameter, files: tuple[str, ...]) -> None:
    """Import the files of effects that the command line names, and no others."""
    if files and not context.resilient_parsing:
        from stepgauge.effects import load_effects

        for file in files:
            load_effects(file)


EFFECTS = click.Option(
    ["--effects"],
    multiple=True,
    expose_value=False,
    is_eager=True,
    callback=_load_effects,
    metavar="FILE",
    help="Python file with effects of your own, which it runs (docs/adding-an-effect.md); once per file.",
)
WITH_EFFECTS = ("simulate", "serve", "measure", "budget", "uncertainty", "diagnose", "investigate", "effects")
"""Verbs that know the vocabulary of effects."""
NOT_IN_PROJECTS = ("init", "web", "demo", "shipped", "dialects", "effects")
"""Verbs that need nothing of what a project file states, and must run where it is wrong."""
TASKS: Tasks = {
    "Start here": {
        "init": ("stepgauge.cli.init", "make a project: one file that states gauge, machine, names"),
        "web": ("stepgauge.cli.web", "the project in a browser"),
        "status": ("stepgauge.cli.status", "what the project has, and what to do next"),
        "demo": ("stepgauge.cli.demo", "the whole loop on an example, ending in a PDF report"),
        "shipped": ("stepgauge.cli.shipped", "list or copy the shipped gauges, machines, templates"),
    },
    "Measure": {
        "locate": ("stepgauge.cli.locate", "16 probed points -> placement of the gauge"),
        "plan": ("stepgauge.cli.plan", "placement + gauge -> a checked measuring program"),
        "dialects": ("stepgauge.cli.dialects", "languages of controllers: options, what is understood"),
        "simulate": ("stepgauge.cli.simulate", "program -> recording, on the virtual CMM"),
        "measure": ("stepgauge.cli.measure", "program -> recording, on a CMM over I++ DME"),
        "serve": ("stepgauge.cli.serve", "the virtual CMM as an I++ DME server"),
        "import": ("stepgauge.cli.import_", "controller's log, DMIS output, table -> recording"),
        "export": ("stepgauge.cli.export", "recording -> DMIS, I++ DME, LinuxCNC, CSV, Excel"),
    },
    "Evaluate": {
        "evaluate": ("stepgauge.cli.evaluate", "recording + certificate -> errors with 2s bands"),
        "iso10360": ("stepgauge.cli.iso10360", "recordings -> length measurement test of ISO 10360-2"),
        "iso10360-5": ("stepgauge.cli.iso10360_5", "points on a sphere -> probing test of ISO 10360-5"),
        "iso230": ("stepgauge.cli.iso230", "recording -> positioning accuracy by ISO 230-2"),
        "iso230-3": ("stepgauge.cli.iso230_3", "displacements over time -> drift tests of ISO 230-3"),
        "budget": ("stepgauge.cli.budget", "uncertainty of the errors by the GUM, by source"),
        "uncertainty": ("stepgauge.cli.uncertainty", "uncertainty of the errors by Monte Carlo"),
    },
    "Show and certify": {
        "report": ("stepgauge.cli.report", "results -> report, certificate, overlay (PDF, HTML)"),
        "dcc": ("stepgauge.cli.dcc", "Digital Calibration Certificates (XML)"),
        "figures": ("stepgauge.cli.figures", "the figures of a measurement"),
        "history": ("stepgauge.cli.history", "many evaluations of a machine -> trends, warnings"),
    },
    "Many machines": {
        "fleet": ("stepgauge.cli.fleet", "recordings of many machines: store, queries, causes"),
    },
    "Understand and improve the machine": {
        "diagnose": ("stepgauge.cli.diagnose", "recording + machine model -> causes of the deviations"),
        "investigate": ("stepgauge.cli.investigate", "measure and diagnose until the cause is clear"),
        "effects": ("stepgauge.cli.effects", "systematic effects: equations, parameters"),
        "compensate": ("stepgauge.cli.compensate", "evaluation -> an error table for a controller"),
        "probe": ("stepgauge.cli.probe", "the probe itself: map, qualify, compensate, bench"),
    },
}
VERBS = {verb: place for verbs in TASKS.values() for verb, place in verbs.items()}


@click.group(
    cls=LazyGroup,
    tasks=TASKS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Lengths are in mm, deviations in um, angles in degrees on the command line. In a project ('stepgauge init')"
    " options that are left out, required ones too, come from stepgauge.toml. 'stepgauge VERB --help' explains a verb.",
)
@click.version_option(__version__, "--version", "-V", prog_name="stepgauge")
def cli() -> None:
    """Calibrate a coordinate measuring machine or a probing machine tool with a step gauge.

    \b
    certificate + 16 points -> locate -> plan -> program -> machine or simulate -> recording
    recording + certificate -> evaluate -> report
    recording + certificate + machine model -> diagnose -> better machine model
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; wrong input ends with one line on stderr and exit code 2, never a traceback."""
    run_command(cli, "stepgauge", arguments)


def run_command(command: click.Command, name: str, arguments: list[str] | None = None) -> None:
    """Run a click command (ours, or that of an example) so that whatever goes wrong ends with one line.

    Exit code 2 for wrong input, 130 where it was interrupted. A reader of what is printed may leave at any time.
    """
    with readers_may_leave():
        _run(command, name, arguments)


def _run(command: click.Command, name: str, arguments: list[str] | None) -> None:
    try:
        code = command.main(args=arguments, prog_name=name, standalone_mode=False)
        if isinstance(code, int) and code:  # what click makes of its Exit
            sys.exit(code)
    except click.ClickException as error:
        verb = getattr(getattr(error, "ctx", None), "command_path", name)
        _complain(name, f"{one_line(error.format_message(), LONGEST - 50)} ('{verb} --help' explains)")
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        _complain(name, "interrupted")
        sys.exit(130)
    except InputError as error:
        _complain(name, error.as_typed(), error.longest)
        sys.exit(2)
    except OSError as error:
        _complain(name, f"{error.filename or 'file system'}: {error.strerror or error}")
        sys.exit(2)
    except MemoryError:
        _complain(name, "this needs more memory than there is")
        sys.exit(2)
    except Exception as error:
        if isinstance(error.__context__, KeyboardInterrupt):  # interrupted in the middle of an import
            _complain(name, "interrupted")
            sys.exit(130)
        raise


def show_and_run(*arguments: object) -> int:
    """Run a verb and show it as a user would type it; errors are raised, for whoever runs several.

    Returns 130 for one that was stopped, else 0.
    """
    words = [str(argument) for argument in arguments]
    click.echo(f"$ stepgauge {shlex.join(words)}", err=True)
    return cli.main(args=words, prog_name="stepgauge", standalone_mode=False) or 0


def _complain(name: str, message: str, longest: int = LONGEST) -> None:
    click.echo(f"{name}: error: {one_line(message, longest)}", err=True)
