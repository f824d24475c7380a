"""What the page states in files that people write, too: their comments, and whatever else stands there, stay."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stepgauge.project.find import NAME
from stepgauge.web.site import Site


def merged(text: str, tables: Mapping[str, Mapping[str, Any]]) -> str:
    """TOML with some keys of some tables changed; ``""`` is the top, None takes a key away."""
    import tomlkit

    document = tomlkit.parse(text)
    for name, values in tables.items():
        table: Any = document
        for part in filter(None, name.split(".")):
            table = table.setdefault(part, tomlkit.table())
        for key, value in values.items():
            if value is None:
                table.pop(key, None)
            elif table.get(key) != value:
                table[key] = value
    return tomlkit.dumps(document)


def changed(path: Path, tables: Mapping[str, Mapping[str, Any]]) -> str:
    """A file of the project, or an empty one, :func:`merged`; it is read before a set of files is begun."""
    from stepgauge.files.text import read_text

    return merged(read_text(path) if path.exists() else "", tables)


def state(site: Site, values: Mapping[str, Any]) -> None:
    """Write keys of the project file; a folder without one gets it."""
    from stepgauge.files.text import write_text
    from stepgauge.project.create import NewProject, create_project

    if not site.has_project:
        with site.writing():
            create_project(site.folder, NewProject("", "", {}))
    site.project()
    text = changed(site.folder / NAME, {"": values})
    with site.writing():
        write_text(site.folder / NAME, text)
