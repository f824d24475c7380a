"""What work on a store gives back: what was added, written or left out, in lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


class Worked(list[str]):
    """Why some recordings have no result, a line each; ``left_out`` are the same."""

    def __init__(self, errors: Sequence[str], done: str, store: str | Path) -> None:
        super().__init__(errors)
        self.done, self.store = done, store

    @property
    def left_out(self) -> tuple[str, ...]:
        """The lines."""
        return tuple(self)

    def summary(self) -> str:
        """What was done in which store."""
        return f"{self.done}: {self.store}"


class Added(tuple[list[str], list[str]]):
    """Keys of recordings that are new in a store, and of those that were there; ``in_store``: all that are in it."""

    store: str
    in_store: int

    @classmethod
    def of(cls, keys: tuple[list[str], list[str]], store: str | Path, count: int) -> Added:
        """Of a store after the addition."""
        made = cls(keys)
        made.store, made.in_store = str(store), count
        return made

    def summary(self) -> str:
        """How many were added, were there, and are there now."""
        new, known = self
        added = f"{len(new)} recording{'' if len(new) == 1 else 's'} added"
        were = f"{len(known)} {'was' if len(known) == 1 else 'were'} there"
        return f"{added}, {were}: {self.in_store} in {self.store}"


class Exported(list[Path]):
    """The files of the recordings that were written."""

    def __init__(self, files: Sequence[Path], folder: str | Path) -> None:
        super().__init__(files)
        self.folder = folder

    def summary(self) -> str:
        """How many, and where."""
        return f"{len(self)} recordings and roster.csv"
