"""``stepgauge init``: a new project."""

from __future__ import annotations

import shlex
import sys

import click

from stepgauge.cli.options import DIALECTS, say, say_written

QUESTIONS = (
    ("gauge", "Gauge file, or the name of a shipped one", "step-gauge-420"),
    ("machine", "Machine file, or the name of a shipped one", "bridge-cmm"),
    ("operator", "Who measures (may stay empty)", ""),
    ("location", "Where (may stay empty)", ""),
)


@click.command("init")
@click.argument("folder", default=".", metavar="[FOLDER]")
@click.option("--gauge", "-g", metavar="GAUGE", help="Gauge file, or the name of a shipped one, which is copied.")
@click.option("--machine", "-m", metavar="MACHINE", help="Machine file, or the name of a shipped one, which is copied.")
@click.option("--dialect", "-d", type=click.Choice(DIALECTS), help="Language of the measuring programs.")
@click.option("--operator", metavar="TEXT", help="Who measures, for the reports.")
@click.option("--customer", metavar="TEXT", help="For whom, for the reports.")
@click.option("--location", metavar="TEXT", help="Where, for the reports.")
@click.option("--certificate", metavar="FILE", help="File with what a certificate of the laboratory states.")
def command(folder: str, dialect: str | None, **stated: str | None) -> None:
    """Make a project: a folder whose file stepgauge.toml states once what every verb would have to be given.

    What is not given as an option is asked for. In the folder and below it, verbs take from the file what is left out
    on the command line, and say so; 'stepgauge status' shows what is there and what to do next.

    \b
    stepgauge init my-machine --gauge step-gauge-420 --machine bridge-cmm --dialect dmis
    cd my-machine
    stepgauge status
    """
    from stepgauge.project.create import NewProject, create_project

    for key, question, default in QUESTIONS:
        if stated[key] is None and sys.stdin.isatty():
            stated[key] = click.prompt(question, default=default, show_default=bool(default), err=True)
    for key in ("gauge", "machine"):
        if not stated[key]:
            raise click.UsageError(f"Missing option '--{key}': nobody is there to be asked.")
    texts = {key: value for key, value in stated.items() if key not in ("gauge", "machine") and value}
    written = create_project(folder, NewProject(str(stated["gauge"]), str(stated["machine"]), texts, dialect))
    say_written(*written)
    say("next: " + ("" if folder == "." else f"cd {shlex.quote(folder)}; ") + "stepgauge status")
