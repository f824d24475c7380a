"""``stepgauge fleet add``: recordings into the store."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.fleet.options import STORE, bar
from stepgauge.cli.options import GAUGE_VARIABLE, machine_option, placement_option, say


@click.command("add")
@STORE
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@click.option(
    "--gauge",
    "-g",
    envvar=GAUGE_VARIABLE,
    metavar="GAUGE",
    help="Gauge file (TOML), or the name of a shipped one, where a roster does not state it.",
)
@machine_option(False, "Machine file (TOML), or the name of a shipped one; a diagnosis needs it.")
@placement_option("Placement file; once per placement in the recordings, in order.")
@click.option("--roster", metavar="FILE", help="Table (CSV) with the owners of the recordings, see above.")
@click.option("--machine-id", metavar="ID", help="Identity of the machine. Default: the name that a recording states.")
@click.option("--machine-type", metavar="TYPE", help="Model line of the machine.")
@click.option("--hall", metavar="HALL", help="Hall that the machine stood in.")
@click.option("--probe-id", metavar="ID", help="Identity of the probe.")
@click.option("--gauge-id", metavar="ID", help="Identity of the gauge. Default: its serial number.")
@click.option("--measured-at", metavar="DATE", help="When it was measured, where the recordings do not say.")
def command(store: str, recordings: tuple[str, ...], **options: Any) -> None:
    """Add recordings to a store; makes the store where there is none.

    Adding a recording again changes nothing, for it is known by its content. What a recording states in its comments
    counts: machine_id, machine_type, hall, probe_id, gauge_id, measured_at. The roster has a row for each file, by its
    column 'recording' (from the roster's folder), or for each machine, by its column 'machine', and further columns of:
    type, hall, probe, gauge, measured_at, gauge_file, machine_file, placement_file. A contradiction is an error.

    Several processes may add to one store at the same time, and any of them may be killed: what a recording needs is
    there as a whole or not at all.

    \b
    stepgauge fleet add fleet logs/*.csv -g step-gauge-420 -m bridge-cmm --machine-id M1 --hall North
    stepgauge fleet add fleet logs/*.csv --roster roster.csv
    """
    from stepgauge.fleet.store import Fleet
    from stepgauge.public.fleet import add_to_fleet

    placements = options.pop("placement_files")
    with bar("adding") as progress:
        new, known = add_to_fleet(store, recordings, placements=placements, **options, progress=progress)
    added = f"{len(new)} recording{'' if len(new) == 1 else 's'} added"
    say(f"{added}, {len(known)} {'was' if len(known) == 1 else 'were'} there: {len(Fleet(store).index())} in {store}")
