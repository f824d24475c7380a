"""``stepgauge.toml``, the project file: read, and asked for what it states.

A key at the top stands for the option of that name of every verb that takes it once; a table ``[VERB]`` (of a group:
``[probe.map]``) for the options of that verb alone. Paths are those seen from the folder of the file.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, reading
from stepgauge.files.config import parse_toml
from stepgauge.files.resources import shipped_names
from stepgauge.files.text import as_text

LARGEST_BYTES = 1_000_000
COMMON: Mapping[str, str] = {
    "gauge": "gauge file, or the name of a shipped one",
    "machine": "machine file, or the name of a shipped one",
    "placement": "placement file, as 'locate' writes it",
    "certificate": "file with what a certificate of the laboratory states",
    "operator": "who measures",
    "customer": "for whom",
    "location": "where",
    "blocks": "first and last block of the used section, A:B",
    "r-eff-origin": "blocks that the effective radius is taken from: first or all",
    "gauge-temperature": "temperature of the gauge, deg C",
    "u-gauge-temperature": "its standard uncertainty, K",
    "tip-radius": "nominal tip radius, mm",
    "mpe": "maximum permissible error, as --mpe takes it",
    "coverage-factor": "coverage factor k of expanded uncertainties",
    "figure": "format of figures: png, svg or pdf",
    "length-unit": "unit of lengths in foreign tables: mm, um, m or inch",
}
"""Keys at the top of the file and their meaning: options that several verbs share."""


WRITTEN = (
    "output",
    "log",
    "spy",
    "store",
    "plot",
    "plot-html",
    "plot-shares",
    "body-plot",
    "force-plot",
    "polar-plot",
    "copy-to",
)
"""Keys of files that are written."""
SHIPPED = {"gauge": ".", "normal-gauge": ".", "machine": "machines", "offset-machine": "machines", "probe": "probes"}
"""Rooms of the shipped files that some keys may name."""
READ = (
    *SHIPPED, "attach", "budget", "certificate", "faults", "further-stylus", "heights", "normal", "offset-recording",
    "placement", "priors", "qualification", "recording", "roster", "scheduler", "schema", "template", "true-placement",
)  # fmt: skip
"""Keys of files that are read, and must be there."""
_EXPECTED = {
    "placement": "what 'locate' writes, or no such key where none is needed",
    **dict.fromkeys(SHIPPED, "its path, or the name of a shipped one"),
}


@dataclass(frozen=True)
class Project:
    """A project file that was read: ``values`` are its keys as written."""

    path: Path
    values: Mapping[str, Any]

    @property
    def folder(self) -> Path:
        """Folder of the project, from which its paths count."""
        return self.path.parent

    @property
    def common(self) -> dict[str, Any]:
        """The keys at the top."""
        return {key: value for key, value in self.values.items() if not isinstance(value, dict)}

    def table(self, verb: tuple[str, ...]) -> dict[str, Any]:
        """What the table of a verb states, ``("evaluate",)`` or ``("probe", "map")``; empty where there is none."""
        table: Any = self.values
        for word in verb:
            table = table.get(word, {})
            if not isinstance(table, dict):
                return {}
        return dict(table)

    def place(self, value: str) -> str:
        """A path that the file states, seen from the working folder; one that stands nowhere is a name, and stays."""
        path = self.folder / os.path.expanduser(value)
        if path.exists() or "/" in value or os.sep in value or Path(value).suffix:
            relative = os.path.relpath(path)
            return relative if len(relative) < len(str(path)) else str(path)
        return value


def read_project(path: str | Path, verbs: Iterable[str]) -> Project:
    """Read a project file; ``verbs`` are the names that a table may have.

    :class:`InputError` for what is no TOML, a key at the top that is not one of :data:`COMMON`, and a table of a verb
    that there is not. The options in a table are checked when its verb runs.
    """
    path = Path(path)
    with reading(path, "project file"):
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(path, "this is no project file", expected=f"at most {LARGEST_BYTES:,} bytes")
        values = parse_toml(as_text(path.read_bytes(), path), path)  # options, and no input of what they are for
    tables = list(verbs)
    for key, value in values.items():
        if isinstance(value, dict):
            _check_name(path, f"table [{key}]", key, tables)
        else:
            _check_name(path, f"key {key}", key, list(COMMON))
    return Project(path, values)


def check_options(project: Project, verb: tuple[str, ...], options: Iterable[str]) -> None:
    """:class:`InputError` for a key in the table of a verb that is no option of it."""
    known = list(options)
    for key, value in project.table(verb).items():
        if not isinstance(value, dict):
            _check_name(project.path, f"key {key} in [{'.'.join(verb)}]", key, known)


def check_file(project: Project, verb: tuple[str, ...], key: str) -> None:
    """:class:`InputError` where a verb is to read a file that the project file states and that is not there.

    What is stated is never left away, for a result without it would look the same.
    """
    own = project.table(verb) if verb else {}
    value = own[key] if key in own else project.values.get(key)
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, str) and not is_there(project, key, one):
            table = f" in [{'.'.join(verb)}]" if key in own else ""
            what = f"key {key}{table} names a file that is not there"
            raise InputError(project.path, what, found=one, expected=_EXPECTED.get(key, "its path, or no such key"))


def stated_file(project: Project, key: str) -> str:
    """Gauge or machine as the file states it at the top, seen from the working folder; errors as :func:`check_file`."""
    value = project.values.get(key)
    if not isinstance(value, str):
        what, found = (f"key {key} is missing", None) if value is None else (f"key {key} is no text", repr(value))
        raise InputError(project.path, what, found=found, expected="a path, or the name of a shipped file, in quotes")
    check_file(project, (), key)
    return project.place(value)


def lacking(project: Project) -> list[InputError]:
    """What is wrong with the files that the tables of verbs state, and the top besides gauge, machine and placement."""
    found = []
    verbs = [(), *_tables(project.values)]
    for verb in verbs:
        stated = project.table(verb) if verb else {key: project.common.get(key) for key in ("certificate",)}
        for key in stated:
            try:
                check_file(project, verb, key)
            except InputError as error:
                found.append(error)
    return found


def _tables(values: Mapping[str, Any], above: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    inside = [(key, one) for key, one in values.items() if isinstance(one, dict)]
    return [name for key, one in inside for name in ((*above, key), *_tables(one, (*above, key)))]


def is_there(project: Project, key: str, value: str) -> bool:
    """Whether a value of ``key`` is a file that exists, the name of a shipped one, or no file that is read."""
    if key not in READ or "://" in value:
        return True
    room = SHIPPED.get(key)
    return Path(project.place(value)).exists() or (room is not None and value in shipped_names(room))


def _check_name(path: Path, what: str, key: str, known: list[str]) -> None:
    if key in known:
        return
    near = difflib.get_close_matches(key.replace("_", "-"), known, n=1)
    expected = f"{near[0]}?" if near else "one of " + ", ".join(known)
    raise InputError(path, f"{what} is not known", expected=expected)
