"""``stepgauge.toml``, the project file: read, and asked for what it states.

A key at the top stands for the option of that name of every verb that takes it once; a table ``[VERB]`` (of a group:
``[probe.map]``) for the options of that verb alone. Paths are those seen from the folder of the file.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from stepgauge.errors import InputError, reading
from stepgauge.files.config import parse_toml
from stepgauge.files.resources import shipped_names
from stepgauge.files.text import decode_text

LARGEST_BYTES = 1_000_000
NONE = "what 'locate' writes, or no such key where none is needed"


class KeyKind(Protocol):
    """What the project asks of the kind of a key; ``room``: of the shipped files that it may name."""

    room: str | None

    @property
    def is_read(self) -> bool:
        """Whether it names a file that is read."""


class Verbs(Protocol):
    """What a project knows of the verbs: names of tables, keys at the top, and the keys of each table."""

    @property
    def common(self) -> tuple[str, ...]:
        """Keys at the top."""

    def __iter__(self) -> Iterator[str]: ...

    def kinds(self, words: str) -> Mapping[str, KeyKind]:
        """The kinds of the keys of a verb by its words; none where there is no such verb."""


@dataclass(frozen=True)
class Project:
    """A project file that was read: ``values`` are its keys as written, ``verbs`` what they may be of."""

    path: Path
    values: Mapping[str, Any]
    verbs: Verbs

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

    def stated(self, *verb: str) -> dict[str, Any]:
        """What the file states for a verb: its table over the keys at the top."""
        return {**self.common, **self.table(verb)}

    def place(self, value: str) -> str:
        """A path that the file states, seen from the working folder; one that stands nowhere is a name, and stays."""
        path = self.folder / os.path.expanduser(value)
        if path.exists() or "/" in value or os.sep in value or Path(value).suffix:
            relative = os.path.relpath(path)
            return relative if len(relative) < len(str(path)) else str(path)
        return value


def read_project(path: str | Path, verbs: Verbs) -> Project:
    """Read a project file; ``verbs``: what a table may be of.

    :class:`InputError` for what is no TOML, a key at the top that is not common to verbs, and a table of a verb
    that there is not. The options in a table are checked when its verb runs.
    """
    path = Path(path)
    with reading(path, "project file"):
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(path, "this is no project file", expected=f"at most {LARGEST_BYTES:,} bytes")
        values = parse_toml(decode_text(path.read_bytes(), path), path)  # options, and no input of what they are for
    tables = list(verbs)
    for key, value in values.items():
        if isinstance(value, dict):
            _check_name(path, f"table [{key}]", key, tables)
        else:
            _check_name(path, f"key {key}", key, list(verbs.common))
    return Project(path, values, verbs)


def check_options(project: Project, verb: tuple[str, ...], options: Iterable[str]) -> None:
    """:class:`InputError` for a key in the table of a verb that is no option of it."""
    known = list(options)
    for key, value in project.table(verb).items():
        if not isinstance(value, dict):
            _check_name(project.path, f"key {key} in [{'.'.join(verb)}]", key, known)


def check_file(project: Project, verb: tuple[str, ...], key: str, kind: KeyKind) -> None:
    """:class:`InputError` where a verb is to read a file that the project file states and that is not there.

    What is stated is never left away, for a result without it would look the same.
    """
    own = project.table(verb) if verb else {}
    value = own[key] if key in own else project.values.get(key)
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, str) and not is_there(project, one, kind):
            table = f" in [{'.'.join(verb)}]" if key in own else ""
            shipped = "its path, or the name of a shipped one"
            expected = shipped if kind.room else NONE if key == "placement" else "its path, or no such key"
            raise InputError(
                project.path, f"key {key}{table} names a file that is not there", found=one, expected=expected
            )


def stated_file(project: Project, key: str) -> str:
    """Gauge or machine as the file states it at the top, seen from the working folder; errors as :func:`check_file`."""
    value = project.values.get(key)
    if not isinstance(value, str):
        what, found = (f"key {key} is missing", None) if value is None else (f"key {key} is no text", repr(value))
        raise InputError(project.path, what, found=found, expected="a path, or the name of a shipped file, in quotes")
    check_file(project, (), key, project.verbs.kinds("evaluate")[key])
    return project.place(value)


def lacking(project: Project) -> list[InputError]:
    """What is wrong with the files that the tables of verbs state, and with the certificate that the top states."""
    found = []
    stated: list[tuple[tuple[str, ...], str, set[str]]] = [((), "report", {"certificate"} & set(project.common))]
    stated += [(verb, " ".join(verb), set(project.table(verb))) for verb in _tables(project.values)]
    for verb, words, keys in stated:
        kinds = project.verbs.kinds(words)
        for key in sorted(keys & set(kinds)):
            try:
                check_file(project, verb, key, kinds[key])
            except InputError as error:
                found.append(error)
    return found


def _tables(values: Mapping[str, Any], above: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    inside = [(key, one) for key, one in values.items() if isinstance(one, dict)]
    return [name for key, one in inside for name in ((*above, key), *_tables(one, (*above, key)))]


def is_there(project: Project, value: str, kind: KeyKind) -> bool:
    """Whether a value is a file that exists, the name of a shipped one, or no file that is read."""
    if not kind.is_read or "://" in value:
        return True
    return Path(project.place(value)).exists() or (kind.room is not None and value in shipped_names(kind.room))


def _check_name(path: Path, what: str, key: str, known: list[str]) -> None:
    if key in known:
        return
    near = difflib.get_close_matches(key.replace("_", "-"), known, n=1)
    expected = f"{near[0]}?" if near else "one of " + ", ".join(known)
    raise InputError(path, f"{what} is not known", expected=expected)
