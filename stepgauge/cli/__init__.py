"""The ``stepgauge`` command: every verb from its definition, loaded only when it is called."""

from __future__ import annotations

import shlex
import sys

import click

from stepgauge import __version__
from stepgauge.cli.groups import VerbGroup
from stepgauge.cli.pipes import readers_may_leave
from stepgauge.errors import LONGEST, InputError, one_line
from stepgauge.verbs.catalogue import TASKS


@click.group(
    cls=VerbGroup,
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
        _complain(name, error.cli_text(), error.longest)
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
