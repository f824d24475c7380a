"""Units of D-SI: what they are worth, and that nothing is guessed."""

from __future__ import annotations

import pytest

from stepgauge.dcc.units import LENGTH, parse_unit


@pytest.mark.parametrize(
    ("text", "factor", "dimension"),
    [
        (r"\metre", 1.0, LENGTH),
        (r"\milli\metre", 1e-3, LENGTH),
        (r"\micro\metre", 1e-6, LENGTH),
        (r"\nano\metre", 1e-9, LENGTH),
        (r"\kelvin\tothe{-1}", 1.0, (0, -1, 0, 0)),
        (r"\per\kelvin", 1.0, (0, -1, 0, 0)),
        (r"\micro\metre\per\metre\per\kelvin", 1e-6, (0, -1, 0, 0)),
        (r"\milli\metre\tothe{2}", 1e-6, (2, 0, 0, 0)),
        (r"\kilo\gram", 1.0, (0, 0, 0, 1)),
        (r"\one", 1.0, (0, 0, 0, 0)),
        (r"\percent", 0.01, (0, 0, 0, 0)),
    ],
)
def test_worth(text: str, factor: float, dimension: tuple[int, ...]) -> None:
    unit = parse_unit(text)
    assert unit.factor == pytest.approx(factor)
    assert unit.dimension == dimension
    assert not unit.celsius


def test_degrees_celsius_begin_elsewhere() -> None:
    assert parse_unit(r"\degreecelsius").celsius
    assert not parse_unit(r"\kelvin").celsius


@pytest.mark.parametrize(
    "text", ["", "mm", "um", r"\micron", r"\milli", r"\metre x", r"\micro\metre\tothe{x}", r"\\metre"]
)
def test_nothing_is_guessed(text: str) -> None:
    with pytest.raises(ValueError, match=r"unit|D-SI|prefix"):
        parse_unit(text)
