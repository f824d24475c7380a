"""``stepgauge`` in a process that is refused what would give the truth away.

Called as ``sealed.py SEALED... -- VERB ARGUMENTS``: opening a file that is one of SEALED, or lies in one of them, ends
the process with exit code 3, whoever asks for it and however (an audit hook cannot be taken out again).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

BROKEN = 3


def seal(sealed: Sequence[Path]) -> None:
    """Refuse to open ``sealed`` for the rest of this process."""

    def refuse(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
            path = Path(os.fsdecode(arguments[0])).resolve()
            if any(path.is_relative_to(one) for one in sealed):
                os.write(2, f"error: {path.name} is sealed\n".encode())
                os._exit(BROKEN)

    sys.addaudithook(refuse)


if __name__ == "__main__":
    end = sys.argv.index("--")
    seal([Path(one).resolve() for one in sys.argv[1:end]])
    from stepgauge.cli import main

    sys.argv = ["stepgauge", *sys.argv[end + 1 :]]
    sys.exit(main())
