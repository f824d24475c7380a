"""Whether files are as they were: what was computed of them may then be shown again (``functools.lru_cache``)."""

from __future__ import annotations

from pathlib import Path

Stamp = tuple[str, int, int]
"""A file: its path, when it was written (ns), its size."""
MOST_BESIDE = 500


def stamps(*paths: str | Path) -> tuple[Stamp, ...]:
    """These files and those beside them, on which they may depend (faces of a gauge, the probe of a machine)."""
    found = []
    for path in map(Path, paths):
        beside = sorted(path.parent.iterdir())[:MOST_BESIDE] if path.parent.is_dir() else []
        for one in (path, *(other for other in beside if other.is_file())):
            if one.exists():
                state = one.stat()
                found.append((str(one), state.st_mtime_ns, state.st_size))
    return tuple(dict.fromkeys(found))
