"""What a form brings, as text, numbers and files; endpoints that wait for nothing but their own work."""

from __future__ import annotations

import base64
import pickle
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ParamSpec, TypeVar, cast

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from stepgauge.errors import InputError, naming
from stepgauge.files.resource_limits import Content, size_limits, work_within

MOST_FIELDS = 200
NO_BOUND = 1e9
"""A number without a bound is less than this on a page."""
LARGEST_TEXT_BYTES = 2**20
"""Of one field that is not a file."""


@dataclass(frozen=True)
class Form:
    """Texts and files by the names of their fields; what is empty is not there, several of one name are lines.

    ``names``: what the files are called.
    """

    texts: Mapping[str, str]
    files: Mapping[str, bytes]
    names: Mapping[str, str] = field(default_factory=dict)

    def text(self, name: str, default: str = "") -> str:
        """What was entered in a field."""
        return self.texts.get(name, default)

    def has(self, name: str) -> bool:
        """Whether a box is ticked."""
        return name in self.texts

    def number(
        self, name: str, least: float, most: float, default: float | None = None, above: bool = False
    ) -> float | None:
        """A number with a decimal point or comma (:class:`InputError` where it is none, or out of its range).

        ``above``: of the range without its lower end.
        """
        given = self.texts.get(name)
        if given is None:
            return default
        try:
            value = float(given.replace(",", "."))
        except ValueError:
            value = float("nan")
        if not (isfinite(value) and least <= value <= most) or (above and value == least):
            expected = f"more than {least:g}, at most {most:g}" if above else f"{least:g} to {most:g}"
            expected = expected.partition(",")[0] if most >= NO_BOUND else expected
            raise InputError(naming(name), naming("not_in_range"), found=repr(given), expected=expected)
        return value

    def whole(self, name: str, least: int, most: int, default: int | None = None) -> int | None:
        """A whole number, as :meth:`number`."""
        value = self.number(name, least, most, default)
        if value is not None and value != int(value):
            raise InputError(naming(name), naming("not_whole"), found=f"{value:g}", expected=f"{least} to {most}")
        return None if value is None else int(value)


async def read_form(request: Request) -> Form:
    """The form of a request; the whole of it is limited by :class:`stepgauge.web.server.Guard`."""
    texts: dict[str, str] = {}
    files: dict[str, bytes] = {}
    names: dict[str, str] = {}
    async with request.form(max_files=20, max_fields=MOST_FIELDS, max_part_size=LARGEST_TEXT_BYTES) as given:
        for name, value in given.multi_items():
            if isinstance(value, UploadFile):
                if data := await value.read():
                    files[name], names[name] = data, value.filename or name
            elif value.strip():
                own = value.strip() if "\n" not in value else value
                texts[name] = f"{texts[name]}\n{own}" if name in texts else own
    return Form(texts, files, names)


def asked_form(request: Request) -> Form:
    """What an address asks for (its query), as a form without files."""
    return Form({key: value for key, value in request.query_params.items() if value}, {})


def form_endpoint(answer: Callable[[Request, Form], Response]) -> Callable[[Request], Awaitable[Response]]:
    """An endpoint that is given its form, in a thread, so that other requests are answered meanwhile."""

    async def endpoint(request: Request) -> Response:
        return await run_in_threadpool(answer, request, await read_form(request))

    return endpoint


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
