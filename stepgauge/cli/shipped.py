"""``stepgauge shipped``: list or copy the shipped gauges, machines and templates."""

from __future__ import annotations

from pathlib import Path

import click

from stepgauge.cli.options import say


@click.command("shipped")
@click.argument("name", required=False, metavar="[NAME]")
@click.option("--copy-to", metavar="FOLDER", help="Copy the file NAME (and what belongs to it) there, to be changed.")
def command(name: str | None, copy_to: str | None) -> None:
    """List the shipped gauges, machines and templates, print one, or copy it to change it.

    Every --gauge and --machine takes the names listed here as well as paths.

    \b
    stepgauge shipped
    stepgauge shipped step-gauge-420.toml
    stepgauge shipped dmis.j2 --copy-to my-templates
    """
    from stepgauge.errors import InputError
    from stepgauge.files.resources import shipped_files
    from stepgauge.files.text import read_text

    files = shipped_files()
    if name is None:
        for path, purpose in files.values():
            click.echo(f"{path.name:32} {purpose}")
        return
    known = files.get(name) or files.get(f"{name}.toml") or files.get(f"{name}.j2")
    if known is None:
        raise InputError(name, "no such shipped file", expected=", ".join(files))
    if copy_to is None:
        click.echo(read_text(known[0]), nl=False)
        return
    _copy(known[0], copy_to)


def _copy(shipped: Path, folder: str) -> None:
    """The file into a folder, with the table beside it if it has one."""
    from stepgauge.errors import InputError
    from stepgauge.files.outputs import finish_left
    from stepgauge.files.text import read_text, write_text

    finish_left(folder)
    for path in dict.fromkeys([shipped, shipped.with_suffix(".csv")]):
        if path.exists():
            target = Path(folder) / path.name
            if target.exists():
                raise InputError(target, "exists already", expected="another folder; nothing is overwritten")
            write_text(target, read_text(path))
            say(f"wrote {target}")
