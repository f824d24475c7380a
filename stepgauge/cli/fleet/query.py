"""``stepgauge fleet query``: a question in SQL."""

from __future__ import annotations

import click

from stepgauge.cli.fleet.options import STORE
from stepgauge.cli.options import say_written


def _check(_: click.Context, param: click.Parameter, value: str | None) -> str | None:
    if value is not None and not value.lower().endswith((".csv", ".json", ".parquet")):
        raise click.BadParameter(f"{value} is no table", param=param, param_hint="--output (.csv, .json or .parquet)")
    return value


@click.command("query")
@STORE
@click.argument("sql", metavar="SQL")
@click.option(
    "-o",
    "--output",
    callback=_check,
    metavar="PATH",
    help="Table to write (.csv, .json or .parquet). Default: print it.",
)
@click.option(
    "--to",
    "form",
    type=click.Choice(["csv", "json"]),
    default="csv",
    show_default=True,
    help="Form of the table that is printed.",
)
def command(store: str, sql: str, output: str | None, form: str) -> None:
    """Answer a question in SQL (DuckDB) over a store.

    The views are recordings, probings, evaluations, budgets, diagnoses, and one for each further table of results;
    'DESCRIBE recordings' lists the columns of one, docs/fleet.md explains them. A question changes nothing.

    \b
    stepgauge fleet query fleet "SELECT machine, count(*) FROM recordings GROUP BY machine"
    stepgauge fleet query fleet "SELECT hall, avg(scale_ppm) FROM evaluations GROUP BY hall" -o halls.csv
    """
    from stepgauge.fleet.query import answer_text, query, write_answer
    from stepgauge.fleet.store import Fleet

    table = query(Fleet(store), sql)
    if output is None:
        click.echo(answer_text(table, form), nl=False)
        return
    write_answer(table, output)
    say_written(output)
