"""Questions in SQL over the store, answered by DuckDB.

The views: ``recordings`` (without the sources), ``probings``, and for every table of results one of its name, with the
owners of each recording. Nothing that a question says can change a file.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError
from stepgauge.fleet.disk import locked
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.schema import BUDGETS, DIAGNOSES, EVALUATIONS, OWNERS, PROBINGS, Column, arrow_schema, needed
from stepgauge.fleet.store import Fleet

RESULTS: dict[str, tuple[Column, ...]] = {"evaluations": EVALUATIONS, "budgets": BUDGETS, "diagnoses": DIAGNOSES}
"""Tables that are there, empty, before anything was worked out."""
_IDENTITY = ", ".join(f'r."{name}"' for name in (*OWNERS, "measured_at"))


def query(fleet: Fleet, sql: str) -> Any:
    """The answer to a question in SQL, as an Arrow table; :class:`InputError` for one that DuckDB does not take."""
    duckdb = needed("duckdb")
    with locked(fleet.folder, alone=False), duckdb.connect() as connection:
        _open(connection, fleet)
        try:
            asked = connection.extract_statements(sql)
            if len(asked) != 1 or asked[0].type != duckdb.StatementType.SELECT:
                raise InputError("SQL", "this is no question", found=sql, expected="one SELECT")
            return connection.sql(sql).to_arrow_table()
        except duckdb.Error as error:
            raise InputError("SQL", " ".join(str(error).split()), found=sql) from None


def write_answer(table: Any, path: str | Path) -> None:
    """Write an answer as CSV, JSON (a list of objects) or Parquet, by the extension of the file."""
    from stepgauge.files.text import replacing

    suffix = Path(path).suffix.lower()
    with replacing(path) as beside:
        if suffix == ".parquet":
            needed("pyarrow.parquet").write_table(table, beside, compression="zstd")
        else:
            beside.write_text(answer_text(table, "json" if suffix == ".json" else "csv"), encoding="utf-8")


def answer_text(table: Any, form: str) -> str:
    """An answer as the text of a CSV or JSON file; what is unknown is empty, or null."""
    if form == "csv":
        text: str = table.to_pandas().to_csv(index=False, lineterminator="\n")
        return text
    frame = table.to_pandas()
    rows = json.loads(frame.to_json(orient="records", date_format="iso", double_precision=15))
    return "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows) + "\n]\n"


def _open(connection: Any, fleet: Fleet) -> None:
    """The views, and from then on neither other files nor settings for what a question may say."""
    index, folder = fleet.index(), fleet.folder.resolve()
    connection.register("recordings", index)
    _view(connection, "probings", [folder / name for name in sorted(set(index["file"].to_pylist()))], PROBINGS)
    results = dict(RESULTS) | {table.folder.name: () for table in tables_of(fleet) if table.folder.name not in RESULTS}
    files = {table.folder.name: table.files() for table in tables_of(fleet)}
    for name, columns in results.items():
        _view(connection, f"{name}_rows", [path.resolve() for path in files.get(name, [])], columns)
        connection.execute(
            f'CREATE VIEW "{name}" AS SELECT t.recording, {_IDENTITY}, t.* EXCLUDE (recording)'
            f' FROM "{name}_rows" t JOIN recordings r USING (recording)'
        )
    connection.execute(f"SET allowed_directories = ['{_quoted(folder)}']")
    connection.execute("SET enable_external_access = false")
    connection.execute("SET lock_configuration = true")


def _view(connection: Any, name: str, paths: list[Path], columns: tuple[Column, ...]) -> None:
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
