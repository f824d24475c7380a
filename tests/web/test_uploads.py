"""What is uploaded is read with a budget: it ends, whatever it is, and its errors name fields as any other."""

from __future__ import annotations

from typing import Any

import pytest

from stepgauge.errors import InputError
from stepgauge.files import resource_limits
from stepgauge.machine.contribution import parse_contribution
from stepgauge.web import forms as uploads
from stepgauge.web.forms import SMALL, Form, read_upload
from stepgauge.web.pages import gauge, importing, locate

LARGE = b"x" * (SMALL + 1)


def test_an_answer_and_an_error_come_back_as_they_were() -> None:
    assert read_upload(LARGE, "a", sorted, [3, 1, 2]) == [1, 2, 3]
    with pytest.raises(InputError, match="this is no contribution") as refused:
        read_upload(LARGE, "a", parse_contribution, "x")
    assert str(refused.value.named(str.upper)[0]) == "CONTRIBUTIONS"


def test_what_needs_too_much_time_or_memory_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource_limits, "FILE_SECONDS", 1.0)
    monkeypatch.setattr(resource_limits, "FILE_MEMORY_MB", 500.0)
    endless: list[tuple[Any, Any]] = [(bytes, 2_000_000_000), (range(10**12).index, -1.5)]
    for reader, number in endless:
        with pytest.raises(InputError, match=r"a\.csv: this file: it did not come to an end; expected at most 1 s"):
            read_upload(LARGE, "a.csv", reader, number)


@pytest.mark.parametrize("data", [LARGE, b"PK small", b"<small/>"])
def test_every_page_that_takes_a_file_reads_it_so(data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> bytes:
        raise InputError("a", "read in a process of its own")

    monkeypatch.setattr(uploads, "work_within", refuse)
    site: Any = None
    form = Form({"sensor": "laser"}, {"file": data}, {"file": "a.csv"})
    for read in (
        lambda: gauge._found(form),
        lambda: importing._imported(site, form, []),
        lambda: locate.check_sixteen(data),
    ):
        with pytest.raises(InputError, match="read in a process of its own"):
            read()
