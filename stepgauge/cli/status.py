"""``stepgauge status``: what the project has, and what to do next."""

from __future__ import annotations

import click


@click.command("status")
def command() -> None:
    """Show what the project has, what is wrong or older than what it was made from, and what to do next.

    The project is the nearest folder, from the working folder upward, with a file stepgauge.toml; 'stepgauge init'
    makes one.
    """
    import os

    from stepgauge.cli import VERBS
    from stepgauge.errors import InputError
    from stepgauge.project.file import read_project
    from stepgauge.project.find import NAME, find_project
    from stepgauge.project.status import project_status

    path = find_project()
    if path is None:
        raise InputError(NAME, "not found here or in a folder above", expected="a project: 'stepgauge init' makes one")
    found = project_status(read_project(path, VERBS))
    click.echo(f"project     {os.path.relpath(path)}")
    for item in found.items:
        click.echo(f"{item.what:11} {item.path}\n{'':11} {'! ' if item.wrong else ''}{item.said}")
    click.echo(f"next        {found.command}\n{'':11} {found.reason}")
