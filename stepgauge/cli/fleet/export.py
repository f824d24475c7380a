"""``stepgauge fleet export``: the files that came in."""

from __future__ import annotations

import click

from stepgauge.cli.fleet.options import STORE
from stepgauge.cli.options import output, say


@click.command("export")
@STORE
@output("Folder for recordings, gauges, machines, placements and roster.csv (made if missing).")
@click.option(
    "--where", default="true", metavar="SQL", help="Which recordings: a condition on the view recordings. Default: all."
)
def command(store: str, output: str, where: str) -> None:
    """Write recordings of a store as the files that came in, byte for byte.

    Certificates, machine files and placement files come with them, and a roster by which 'fleet add' makes the same
    store again.

    \b
    stepgauge fleet export fleet -o exported
    stepgauge fleet export fleet --where "machine = 'M1' AND measured_at >= '2026-01-01'" -o exported
    stepgauge fleet add another exported/recordings/* --roster exported/roster.csv
    """
    from stepgauge.public.fleet import export_fleet

    written = export_fleet(store, output, where)
    say(f"wrote {len(written)} recordings and roster.csv to {output}")
