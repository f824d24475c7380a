"""What there is of something, as text and as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from stepgauge.errors import InputError, naming
from stepgauge.files.display import Summarized
from stepgauge.files.outputs import finish_left
from stepgauge.files.resources import find_shipped
from stepgauge.files.text import read_text, write_text

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class Listing(Summarized):
    """Names with what each is (``rows``), and the ``text`` in which they are said."""

    text: str
    rows: Sequence[tuple[str, str]] = ()

    @classmethod
    def of(cls, rows: Sequence[tuple[str, str]], after: str = "") -> Listing:
        """One line for each name."""
        width = max((len(name) for name, _ in rows), default=0)
        lines = [f"{name:<{width}}  {words}" for name, words in rows]
        return cls("\n".join([*lines, after] if after else lines), rows)

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return (name for name, _ in self.rows)

    def copy(self, folder: str | Path) -> list[Path]:
        """Copy the shipped file that was listed (and what belongs to it) into a folder, to be changed.

        :class:`InputError` where several were listed, or one is there already: nothing is overwritten.
        """
        if len(self.rows) != 1:
            raise InputError(naming("copy_to"), "which file?", expected=naming("name"))
        finish_left(folder)
        shipped, written = find_shipped(self.rows[0][0]), []
        for path in dict.fromkeys([shipped, shipped.with_suffix(".csv")]):
            if path.exists():
                target = Path(folder) / path.name
                if target.exists():
                    raise InputError(target, "exists already", expected="another folder; nothing is overwritten")
                write_text(target, read_text(path))
                written.append(target)
        return written

    def __str__(self) -> str:
        """The text, as the file has it."""
        return self.text

    def summary(self) -> str:
        """The text."""
        return self.text

    def to_frame(self) -> pd.DataFrame:
        """One row per name."""
        import pandas as pd

        return pd.DataFrame(self.rows, columns=["name", "meaning"])
