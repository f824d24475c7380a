"""A project in the browser: where it lies, where it is served, and how the browser learns the address."""

from __future__ import annotations

import os
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from stepgauge.errors import InputError
from stepgauge.files.outputs import outside_of_sets
from stepgauge.project.file import Verbs
from stepgauge.project.find import find_project
from stepgauge.web.server import LOOPBACK, Listening, serve


def serve_project(
    project: str | Path | None,
    verbs: Verbs,
    host: str | None,
    port: int | None,
    with_browser: bool,
    tell: Callable[[str], None],
    ready: Callable[[str], None],
) -> None:
    """Serve a project until it is told to end; errors as :func:`serve`."""
    found = find_project() if project is None else None
    folder = Path(project or (found.parent if found else "."))
    if not folder.is_dir():
        raise InputError(folder, "no such folder", expected="the folder of a project")
    os.chdir(folder)
    listening = Listening(host or LOOPBACK, port)
    with outside_of_sets(), TemporaryDirectory(prefix="stepgauge-") as private:

        def answers(address: str) -> None:
            """Told once requests are answered."""
            if not listening.is_loopback:
                tell("warning: whoever has this address can change the project and move the machine")
            ready(address)
            if with_browser:
                open_browser(address, Path(private))

        serve(Path.cwd(), verbs, listening, answers)


def open_browser(address: str, private: Path) -> None:
    """By a page in a folder of this user: every user of the computer sees what is on a command line."""
    page = private / "stepgauge.html"
    page.write_text(f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">', encoding="ascii")
    threading.Thread(target=webbrowser.open, args=(page.as_uri(),), daemon=True).start()
