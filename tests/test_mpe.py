"""The maximum permissible error of length measurement, A + L/K."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.standards.mpe import Mpe


def test_by_hand() -> None:
    """1.8 + 420/350 = 3.0 um; lengths count by their size; a cap holds."""
    np.testing.assert_allclose(Mpe.parse("1.8 + L/350").at_um([0.0, 420.0, -420.0]), [1.8, 3.0, 3.0])
    np.testing.assert_allclose(Mpe.parse("min(1.8+L/350, 2.5)").at_um([0.0, 420.0]), [1.8, 2.5])
    np.testing.assert_allclose(Mpe.parse("2.5 um").at_um([0.0, 420.0]), 2.5)
    np.testing.assert_allclose(Mpe.parse("L/200").at_um([100.0]), 0.5)


@given(st.floats(0.01, 50).map(lambda v: round(v, 3)), st.integers(1, 5000), st.none() | st.integers(51, 90))
def test_what_is_printed_is_read_again(a: float, k: int, cap: int | None) -> None:
    limit = Mpe(a, float(k), float("inf") if cap is None else float(cap))
    assert Mpe.parse(str(limit)) == limit


@pytest.mark.parametrize(
    "text", ["", "A + L/K", "1.8 + L*350", "1,8 + L/350", "-1 + L/300", "1 + L/0", "0", "min(1, 0)"]
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"--mpe: .*found .*expected \"A \+ L/K\""):
        Mpe.parse(text)
