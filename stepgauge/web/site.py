"""What the pages share: the project's folder, who may ask, and one writer at a time.

Work that takes longer than a click: a verb of the command line in a process of its own.

It goes on when the page is closed and when the server dies; its result is its files.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.files.children import python_environment, python_line
from stepgauge.project.file import Verbs
from stepgauge.project.find import NAME
from stepgauge.web.measuring import Runs

if TYPE_CHECKING:
    from stepgauge.project.file import Project


MOST_AT_ONCE = 2
MOST_KEPT = 20
"""Ended works whose words are kept for the window that asked for them."""


@dataclass
class Work:
    """A verb that runs or has run. ``then``: the address that shows its result."""

    number: int
    arguments: tuple[str, ...]
    then: str
    process: subprocess.Popen[bytes]
    said: IO[bytes]
    began_s: float = field(default_factory=time.monotonic)

    @property
    def command(self) -> str:
        """What one would type."""
        return f"stepgauge {shlex.join(self.arguments)}"

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self.process.poll() is None

    @property
    def has_failed(self) -> bool:
        """Whether it ended with an error."""
        return self.process.poll() not in (None, 0)

    @property
    def seconds(self) -> float:
        """Time since it began, s."""
        return time.monotonic() - self.began_s

    def words(self) -> list[str]:
        """The last lines that it has said."""
        self.said.seek(max(0, self.said.seek(0, os.SEEK_END) - 8000))
        text = self.said.read().decode("utf-8", "replace").replace("\r", "\n")
        return [line for line in text.splitlines() if line.strip()][-12:]

    def stop(self) -> None:
        """End it; what it has not finished leaves no file."""
        if self.is_running:
            self.process.terminate()


class WorkList:
    """The works of this server."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock, self._last = folder, threading.Lock(), 0
        self._all: dict[int, Work] = {}

    def start(self, arguments: Sequence[str], then: str) -> Work:
        """Run a verb in the project's folder; the same one, if it runs already, is not begun twice.

        :class:`InputError` where as many run as the machine should be given.
        """
        with self._lock:
            running = [one for one in self._all.values() if one.is_running]
            for one in running:
                if one.arguments == tuple(arguments):
                    return one
            if len(running) >= MOST_AT_ONCE:
                raise InputError("work", f"{len(running)} works are running", expected="one of them ended")
            self._last += 1
            self._all[self._last] = self._begin(self._last, tuple(arguments), then)
            for old in sorted(self._all)[:-MOST_KEPT]:
                if not self._all[old].is_running:
                    self._all.pop(old).said.close()
            return self._all[self._last]

    def _begin(self, number: int, arguments: tuple[str, ...], then: str) -> Work:
        said = tempfile.TemporaryFile()  # noqa: SIM115  closed with the work
        process = subprocess.Popen(
            python_line("stepgauge", *arguments),
            cwd=self._folder,
            env=python_environment(),
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
            start_new_session=True,
        )
        return Work(number, arguments, then, process, said)

    def get(self, number: int) -> Work:
        """A work by its number (:class:`InputError` where this server knows none)."""
        if number not in self._all:
            raise InputError("work", "not known to this server", found=number, expected="its result, if it has ended")
        return self._all[number]


LARGEST_REQUEST_BYTES = 32 * 2**20
"""Of a whole form: a dense scan as a workbook has some MB."""


@dataclass
class Site:
    """One served project.

    ``folder``: its folder, which no request leaves; ``verbs``: those of the command line, which may have tables in the
    project file; ``port``: where it listens; ``token``: what a request must bring; ``on_loopback``: only this computer
    reaches it; ``is_ending``: whoever streams to a page stops.
    """

    folder: Path
    verbs: Verbs
    port: int
    token: str
    on_loopback: bool = True
    is_ending: bool = False
    works: WorkList = field(init=False)
    runs: Runs = field(init=False)
    _writer: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self.folder = self.folder.resolve()
        self.works, self.runs = WorkList(self.folder), Runs(self.folder)

    def close(self) -> None:
        """The server ends: machines that measure for it stop; other work goes on, and writes its files."""
        self.runs.close()

    @property
    def has_project(self) -> bool:
        """Whether the folder has a project file."""
        return (self.folder / NAME).is_file()

    def project(self) -> Project:
        """The project file, read anew (:class:`InputError` where it is wrong or missing)."""
        from stepgauge.errors import InputError
        from stepgauge.project.file import read_project

        if not self.has_project:
            raise InputError(self.folder, "the folder has no project yet", expected=f"{NAME}, made on the first page")
        return read_project(self.folder / NAME, self.verbs)

    def stated(self, key: str) -> str:
        """Gauge or machine as the project file states it, from wherever the page was begun.

        :class:`InputError` where it does not.
        """
        from stepgauge.project.file import stated_file

        stated = stated_file(self.project(), key)
        return os.path.abspath(stated) if os.path.exists(stated) else stated  # else: the name of a shipped one

    @property
    def placement(self) -> str:
        """Where the project has, or will have, its placement."""
        from stepgauge.project.create import OUTPUTS

        project = self.project()
        return project.place(str(project.values.get("placement", OUTPUTS["locate"])))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """One writer at a time; what is written inside appears together, when it is done."""
        from stepgauge.files.outputs import one_set

        with self._writer, one_set():
            yield


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
