"""Errors as the technician reads them, wherever they were raised."""

from __future__ import annotations

import pickle
from concurrent.futures import ProcessPoolExecutor

import pytest

from stepgauge.errors import InputError, ProgramStoppedError


def refuse() -> None:
    raise ProgramStoppedError("points.csv:7", "the tip is in the steel", found="-0.2 mm", expected="a clear path")


@pytest.mark.parametrize("kind", [InputError, ProgramStoppedError])
def test_an_error_stays_what_it_was_from_one_process_to_another(kind: type[InputError]) -> None:
    error = kind("points.csv:7", "no number", found="abc", expected="mm")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error) == "points.csv:7: no number; found abc; expected mm"
    assert (again.where, again.what, again.found, again.expected) == ("points.csv:7", "no number", "abc", "mm")


def test_an_error_of_a_worker_reaches_the_process_that_asked() -> None:
    with ProcessPoolExecutor(1) as pool, pytest.raises(ProgramStoppedError, match=r"found -0\.2 mm; expected a clear"):
        pool.submit(refuse).result()
