"""``stepgauge dialects``: the languages of controllers, their options, and what is understood of each."""

from __future__ import annotations

import click


@click.command("dialects")
@click.argument("name", required=False, metavar="[NAME]")
def command(name: str | None) -> None:
    """List the languages of controllers, or print what is understood of one.

    The options are those of 'stepgauge plan --set'. The statements are all that a program may hold, from the shipped
    template or from your own: anything else is refused, wherever it stands. Each has the source that confirms it.

    \b
    stepgauge dialects
    stepgauge dialects fanuc
    """
    from stepgauge.errors import InputError
    from stepgauge.programs import DIALECTS
    from stepgauge.programs.describe import described

    if name is None:
        for dialect in DIALECTS.values():
            click.echo(f"{dialect.name:12} {dialect.suffix:8} {dialect.title}")
        return
    if name not in DIALECTS:
        raise InputError(name, "not a dialect", expected=", ".join(DIALECTS))
    known = DIALECTS[name]
    if known.family:
        click.echo(f"As '{known.family}', and:\n")
    click.echo(described(known), nl=False)
