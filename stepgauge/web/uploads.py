"""What somebody uploads or pastes is read in a process of its own, with the budget of time and memory of ``import``."""

from __future__ import annotations

import base64
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ParamSpec, TypeVar, cast

from stepgauge.errors import InputError
from stepgauge.files.resource_limits import Content, size_limits, work_within

P = ParamSpec("P")
T = TypeVar("T")


PACKED = (b"PK", b"<")
"""An archive may be larger unpacked, and XML larger read."""
SMALL = 20_000
"""Bytes of plain text that are read at once, while somebody types: the readers take a time in proportion to it."""


def read_upload(data: bytes, name: str, reader: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """What ``reader``, a function of a module, gives for its arguments; ``data`` and ``name`` of what was uploaded.

    :class:`InputError`: that of the reader, or the budget is spent.
    """
    if len(data) <= SMALL and b"\0" not in data and not data.startswith(PACKED):
        return reader(*args, **kwargs)
    call = base64.b64encode(pickle.dumps((reader, args, kwargs))).decode("ascii")
    answer = pickle.loads(work_within(size_limits(len(data)), _read, {"call": call}, name))  # our own process wrote it
    if isinstance(answer, InputError):
        raise answer
    return cast(T, answer)


@contextmanager
def private_file(name: str) -> Iterator[Path]:
    """A path for what is read or written as a file; errors name the file as the person knows it."""
    with TemporaryDirectory() as folder:
        try:
            yield Path(folder) / name
        except InputError as error:
            raise error.at(error.where.replace(f"{folder}/", "")) from None


def _read(given: Content) -> bytes:
    """In the process: the call, with its answer or its error, which names fields of the page."""
    reader, args, kwargs = pickle.loads(base64.b64decode(given["call"]))
    answer: Any
    try:
        answer = reader(*args, **kwargs)
    except InputError as error:
        answer = error
    return pickle.dumps(answer)
