"""``stepgauge fleet compact``: many small files into few."""

from __future__ import annotations

import click

from stepgauge.cli.fleet.options import STORE
from stepgauge.cli.options import say


@click.command("compact")
@STORE
def command(store: str) -> None:
    """Make few large files of the many small ones that single additions leave, so that questions stay quick.

    Others wait while this runs. It may be killed at any moment: nothing is lost or there twice.
    """
    from stepgauge.fleet.compacting import compact
    from stepgauge.fleet.store import Fleet

    found = compact(Fleet(store))
    say(f"{found.before} files before, {found.after} now")
