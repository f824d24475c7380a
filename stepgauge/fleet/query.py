"""Questions in SQL over the store, answered by DuckDB.

The views: ``recordings`` (without the sources), ``probings``, and for every table of results one of its name, with the
owners of each recording. Nothing that a question says can change a file.
"""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd

from stepgauge.errors import InputError
from stepgauge.files.checksum import check_name
from stepgauge.files.resource_limits import MB, ResourceLimits, work_within
from stepgauge.files.tables import csv_text
from stepgauge.files.text import replacing, write_text
from stepgauge.fleet.adding import COLUMNS
from stepgauge.fleet.content import kept_files, safe_name
from stepgauge.fleet.disk import locked
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.rows import read_rows
from stepgauge.fleet.schema import BUDGETS, DIAGNOSES, EVALUATIONS, OWNERS, PROBINGS, StoredColumn, arrow_schema, needed
from stepgauge.fleet.store import Fleet

RESULTS: dict[str, tuple[StoredColumn, ...]] = {"evaluations": EVALUATIONS, "budgets": BUDGETS, "diagnoses": DIAGNOSES}
"""Tables that are there, empty, before anything was worked out."""
SECONDS, MEMORY_MB = 60.0, 2000.0
"""Processor time and memory of a question, besides 0.2 s and 20 MB for each MB of the store."""
_IDENTITY = ", ".join(f'r."{name}"' for name in (*OWNERS, "measured_at"))


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


ROSTER = "roster.csv"


def export(fleet: Fleet, folder: str | Path, where: str = "true") -> list[Path]:
    """Write recordings into a folder, with a roster by which 'fleet add' makes the same fleet of them again.

    Parameters
    ----------
    fleet : the store
    folder : for ``recordings/``, ``gauge/``, ``machine/``, ``placement/`` and the roster (made if missing)
    where : which ones: a condition of SQL on the view ``recordings``

    Returns
    -------
    The files of the recordings.
    """
    target = Path(folder)
    chosen = query(fleet, f"SELECT recording FROM recordings WHERE {where}")["recording"].to_pylist()
    frame = fleet.recordings()
    frame = frame[frame["recording"].isin(chosen)]
    if frame.empty:
        raise InputError(fleet.folder, "no recording of the fleet is meant", found=where)
    names = _file_names(frame)
    written = [
        _write(target / "recordings" / names[str(row["recording"])], row["source"])
        for row in _sources(fleet, set(chosen))
    ]
    rows = [_roster_row(row, names, fleet, target) for row in frame.itertuples(index=False)]
    write_text(target / ROSTER, csv_text(COLUMNS, rows))
    return written


def _file_names(frame: pd.DataFrame) -> dict[str, str]:
    """The names that came in, as every system takes them; where several recordings have one, the key is before it."""
    names = frame["name"].map(lambda name: safe_name(str(name)))
    often = names.str.casefold().duplicated(keep=False)
    pairs = zip(frame["recording"], names, often, strict=True)
    return {str(key): f"{key}-{name}" if several else name for key, name, several in pairs}


def _sources(fleet: Fleet, chosen: set[str]) -> Any:
    """Key and source of the chosen recordings, file after file."""
    arrow = needed("pyarrow.compute")
    keys = needed("pyarrow").array(sorted(chosen))
    with locked(fleet.folder, alone=False):
        for path in sorted((fleet.folder / "sources").glob("*.parquet")):
            yield from read_rows(path, filters=arrow.field("recording").isin(keys)).to_pylist()


def _write(path: Path, data: bytes) -> Path:
    with replacing(path) as beside:
        beside.write_bytes(data)
    return path


def _roster_row(row: Any, names: dict[str, str], fleet: Fleet, target: Path) -> list[str]:
    cells = {name: getattr(row, name) for name in ("machine", "type", "hall", "probe", "gauge")}
    cells["recording"] = f"recordings/{names[row.recording]}"
    cells["measured_at"] = row.measured_at.isoformat()
    cells["gauge_file"] = _copied(fleet, "gauge", row.certificate, target)
    cells["machine_file"] = _copied(fleet, "machine", row.machine_file, target)
    placements = [f"placement/{row.recording}-{number}.toml" for number in range(1, len(row.placement_files) + 1)]
    for name, text in zip(placements, row.placement_files, strict=True):
        write_text(target / name, text)
    cells["placement_file"] = ";".join(placements)
    return ["" if cells[name] is None else str(cells[name]) for name in COLUMNS]


def _copied(fleet: Fleet, kind: str, key: str | None, target: Path) -> str | None:
    """The kept files beside the recordings, once; the main one by its way from the target."""
    if key is None:
        return None
    files = kept_files(fleet.folder / "objects" / kind, key)
    for name, data in files.items():
        place = target / kind / key / name
        if not (place.is_file() and place.read_bytes() == data):
            _write(place, data)
    return f"{kind}/{key}/{next(iter(files))}"
