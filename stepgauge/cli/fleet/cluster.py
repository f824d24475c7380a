"""``stepgauge fleet cluster``: a Dask cluster on this computer."""

from __future__ import annotations

import click

from stepgauge.cli.options import POSITIVE


@click.command("cluster")
@click.option("--workers", type=click.IntRange(1), default=2, show_default=True, metavar="N", help="Worker processes.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8786, show_default=True, help="Of the scheduler; 0: any free one."
)
@click.option(
    "--memory", type=POSITIVE, metavar="MB", help="Limit for each worker. Default: its share of the computer's."
)
@click.option("--idle", type=POSITIVE, metavar="S", help="End when nobody has used it for so long, s. Default: Ctrl-C.")
def command(workers: int, port: int, memory: float | None, idle: float | None) -> None:
    """Start a scheduler and workers of Dask on this computer, for the option --scheduler of the other verbs.

    Only you can use it: it speaks TLS, and its key is in a file that nobody else can read. Prints that file, which is
    what --scheduler takes, and runs until Ctrl-C, or until it was idle for so long. For several computers start
    'dask scheduler' and 'dask worker --nthreads 1' on them, with TLS of their own.

    \b
    stepgauge fleet cluster --workers 2 --idle 600 &
    stepgauge fleet evaluate fleet --scheduler /tmp/stepgauge-k3x9/cluster.json
    """
    from stepgauge.executors.dask import local_cluster, wait_until_idle

    with local_cluster(workers, port, memory) as cluster:
        click.echo(cluster.file)
        wait_until_idle(cluster, idle)
