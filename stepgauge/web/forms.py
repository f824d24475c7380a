"""What a form brings, as text, numbers and files; endpoints that wait for nothing but their own work."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from stepgauge.errors import InputError, naming

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
    """The form of a request; the whole of it is limited by :class:`stepgauge.web.guard.Guard`."""
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
