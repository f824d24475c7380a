"""What the pages share: the project's folder, who may ask, and one writer at a time."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from stepgauge.project.file import Verbs
from stepgauge.project.find import NAME
from stepgauge.web.measuring import Runs
from stepgauge.web.work import WorkList

if TYPE_CHECKING:
    from stepgauge.project.file import Project

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
