"""Questions in SQL over the store, answered by DuckDB.

The views: ``recordings`` (without the sources), ``probings``, and for every table of results one of its name, with the
owners of each recording. Nothing that a question says can change a file.
"""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.files.checksum import check_name
from stepgauge.files.resource_limits import MB, ResourceLimits, work_within
from stepgauge.fleet.disk import locked
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.schema import BUDGETS, DIAGNOSES, EVALUATIONS, OWNERS, PROBINGS, StoredColumn, arrow_schema, needed
from stepgauge.fleet.store import Fleet

RESULTS: dict[str, tuple[StoredColumn, ...]] = {"evaluations": EVALUATIONS, "budgets": BUDGETS, "diagnoses": DIAGNOSES}
"""Tables that are there, empty, before anything was worked out."""
SECONDS, MEMORY_MB = 60.0, 2000.0
"""Processor time and memory of a question, besides 0.2 s and 20 MB for each MB of the store."""
_IDENTITY = ", ".join(f'r."{name}"' for name in (*OWNERS, "measured_at"))

if TYPE_CHECKING:
    import pandas as pd


def query(fleet: Fleet, sql: str) -> Any:
    """The answer to a question in SQL, as an Arrow table.

    :class:`InputError` for one that DuckDB does not take, and for one that needs more than its budget.
    """
    size = sum(path.stat().st_size for path in fleet.folder.rglob("*.parquet")) / MB
    budget = ResourceLimits(SECONDS + 0.2 * size, MEMORY_MB + 20.0 * size, "this question")
    with locked(fleet.folder, alone=False):
        given = {"folder": str(fleet.folder), "sql": sql, "memory_MB": budget.memory_MB}
        answer = work_within(budget, _answer, given, "SQL")
    return needed("pyarrow").ipc.open_stream(answer).read_all()


def _answer(given: dict[str, Any]) -> bytes:
    """The answer as a stream of Arrow, in the process that is for this question alone."""
    duckdb, arrow, sql = needed("duckdb"), needed("pyarrow"), given["sql"]
    with duckdb.connect() as connection:
        try:
            asked = connection.extract_statements(sql)
            if len(asked) != 1 or asked[0].type != duckdb.StatementType.SELECT:
                raise InputError("SQL", "this is no question", found=sql, expected="one SELECT")
            _open(connection, Fleet(given["folder"]), _named(connection, sql))
            connection.execute(f"SET memory_limit = '{given['memory_MB'] / 2.0:.0f}MB'")
            connection.execute("SET lock_configuration = true")
            table = connection.sql(sql).to_arrow_table()
        except duckdb.Error as error:
            raise InputError("SQL", " ".join(str(error).split()), found=sql) from None
    sink = arrow.BufferOutputStream()
    with arrow.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    return bytes(sink.getvalue())


def _named(connection: Any, sql: str) -> set[str] | None:
    """The views that a question names: only their files are looked at. None for all, where that cannot be told."""
    try:
        return {str(name) for name in connection.get_table_names(sql)}
    except needed("duckdb").Error:
        return None


def write_answer(answer: pd.DataFrame, path: str | Path) -> None:
    """Write an answer as CSV, JSON (a list of objects) or Parquet, by the extension of the file."""
    from stepgauge.files.text import replacing

    suffix = Path(path).suffix.lower()
    with replacing(path) as beside:
        if suffix == ".parquet":
            rows = needed("pyarrow").Table.from_pandas(answer, preserve_index=False)
            needed("pyarrow.parquet").write_table(rows, beside, compression="zstd")
        else:
            beside.write_text(answer_text(answer, "json" if suffix == ".json" else "csv"), encoding="utf-8")


def answer_text(answer: pd.DataFrame, form: str) -> str:
    """An answer as the text of a CSV or JSON file; what is unknown is empty, or null."""
    if form == "csv":
        text: str = answer.to_csv(index=False, lineterminator="\n")
        return text
    rows = json.loads(answer.to_json(orient="records", date_format="iso", double_precision=15))
    return "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows) + "\n]\n"


def _open(connection: Any, fleet: Fleet, named: set[str] | None) -> None:
    """The views that are named, and from then on neither other files nor settings for what a question may say."""
    index, folder = fleet.index(), fleet.folder.resolve()
    connection.register("recordings", index)
    if named is None or "probings" in named:
        with ThreadPoolExecutor() as pool:  # a checksum of much is taken by all processors
            paths = list(pool.map(check_name, [folder / name for name in sorted(set(index["file"].to_pylist()))]))
        _view(connection, "probings", paths, PROBINGS)
    kept = {table.folder.name: table for table in tables_of(fleet)}
    for name in dict.fromkeys((*RESULTS, *kept)):
        if named is None or name in named:
            files = [path.resolve() for path in kept[name].files()] if name in kept else []
            _view(connection, f"{name}_rows", files, RESULTS.get(name, ()))
            connection.execute(
                f'CREATE VIEW "{name}" AS SELECT t.recording, {_IDENTITY}, t.* EXCLUDE (recording)'
                f' FROM "{name}_rows" t JOIN recordings r USING (recording)'
            )
    connection.execute(f"SET allowed_directories = ['{_quoted(folder)}']")
    connection.execute("SET enable_external_access = false")


def _view(connection: Any, name: str, paths: list[Path], columns: tuple[StoredColumn, ...]) -> None:
    """A view of files; those of a machine and a month that a question leaves out are not opened."""
    if paths:
        listed = ", ".join(f"'{_quoted(path)}'" for path in paths)
        of_path = "{'machine': VARCHAR, 'month': VARCHAR}" if columns is PROBINGS else ""
        said = f"hive_partitioning = true, hive_types = {of_path}" if of_path else "hive_partitioning = false"
        connection.execute(f'CREATE VIEW "{name}" AS FROM read_parquet([{listed}], {said})')
    else:
        connection.register(name, arrow_schema(columns).empty_table())


def _quoted(path: Path) -> str:
    return str(path).replace("'", "''")
