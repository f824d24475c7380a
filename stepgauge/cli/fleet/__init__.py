"""``stepgauge fleet``: many machines, many gauges, many years."""

from __future__ import annotations

import click

from stepgauge.cli import LazyGroup

VERBS = {
    "add": ("stepgauge.cli.fleet.add", "recordings with machine, gauge, placement -> store"),
    "query": ("stepgauge.cli.fleet.query", "a question in SQL -> table (CSV, JSON, Parquet)"),
    "export": ("stepgauge.cli.fleet.export", "store -> the files that came in, byte for byte"),
    "compact": ("stepgauge.cli.fleet.compact", "many small files of the store -> few"),
    "evaluate": ("stepgauge.cli.fleet.evaluate", "evaluate what has no evaluation yet"),
    "budget": ("stepgauge.cli.fleet.budget", "uncertainty budgets, with Monte Carlo, of what has none yet"),
    "diagnose": ("stepgauge.cli.fleet.diagnose", "diagnose what has no diagnosis yet, each by itself"),
    "infer": ("stepgauge.cli.fleet.infer", "whose fault: machine, gauge, model line, hall or probe"),
    "watch": ("stepgauge.cli.fleet.watch", "changes, trends, limits and due dates of machines and gauges"),
    "cluster": ("stepgauge.cli.fleet.cluster", "a Dask cluster on this computer"),
}


@click.group(cls=LazyGroup, tasks={"Verbs": VERBS})
def command() -> None:
    """Recordings of many machines and gauges in one store, and work on all of them.

    A store is a folder of Parquet files, which any program can read. Needs 'pip install stepgauge[fleet]'.
    """
