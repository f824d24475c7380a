"""Where the project file is; without any import that a verb's ``--help`` would have to wait for."""

from __future__ import annotations

from pathlib import Path

NAME = "stepgauge.toml"


def find_project(start: str | Path = ".") -> Path | None:
    """The project file of the folder ``start`` or of the nearest folder above it; None where there is none."""
    folder = Path(start).absolute()
    return next((path for one in (folder, *folder.parents) if (path := one / NAME).is_file()), None)
