"""What there is of something, as text and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stepgauge.files.display import Summarized

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
