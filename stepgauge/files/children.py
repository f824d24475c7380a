"""Python that stepgauge starts: no module of it comes from the working folder, which may be somebody else's project."""

from __future__ import annotations

import os
import site
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
"""Folder that holds the package."""


def python_line(module: str, *arguments: str) -> list[str]:
    """The command that runs a module in a process of its own; to be started with :func:`python_environment`."""
    return [sys.executable, "-P", "-m", module, *arguments]


def python_environment() -> dict[str, str]:
    """The environment of this process, for one whose modules are those of the installation.

    An empty entry of ``PYTHONPATH`` (``:/opt/tools``) and a relative one mean the working folder, whatever that is.
    """
    stated = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    paths = [one for one in stated if os.path.isabs(one) and not _is_here(one)]
    if not _is_installed() and str(ROOT) not in paths:
        paths.append(str(ROOT))  # a checkout that is no installation
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return {**kept, "PYTHONSAFEPATH": "1", **({"PYTHONPATH": os.pathsep.join(paths)} if paths else {})}


@contextmanager
def safe_children() -> Iterator[None]:
    """What libraries start inside, who ask for no environment, gets :func:`python_environment`."""
    before, own = dict(os.environ), python_environment()
    names = ("PYTHONSAFEPATH", "PYTHONPATH")
    _set(names, own)
    try:
        yield
    finally:
        _set(names, before)


def _set(names: tuple[str, ...], values: dict[str, str]) -> None:
    for name in names:
        if name in values:
            os.environ[name] = values[name]
        else:
            os.environ.pop(name, None)


def _is_here(path: str) -> bool:
    """Whether it is the working folder, unless the package itself is there."""
    place = Path(path).resolve()
    return place == Path.cwd() and place != ROOT


def _is_installed() -> bool:
    return str(ROOT) in [*site.getsitepackages(), site.getusersitepackages()]
