"""Where the project file is; without any import that a verb's ``--help`` would have to wait for."""

from __future__ import annotations

from pathlib import Path

NAME = "stepgauge.toml"


def find_project() -> Path | None:
    """The project file of this folder or of the nearest folder above it; None where there is none."""
    folder = Path().absolute()
    return next((path for one in (folder, *folder.parents) if (path := one / NAME).is_file()), None)
