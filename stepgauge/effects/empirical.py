"""A structure without a known cause: a formula of covariates with fitted coefficients."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from stepgauge.effects.base import GAUGE, AnyDirection, Displacement, Effect, Wording, along, parameter
from stepgauge.effects.probings import Probings
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.formula import Formula, parse_formula
from stepgauge.recording import POSITION

parse = lru_cache(parse_formula)
RESTED = "rested"
COORDINATES = ("position_mm", *POSITION)
DERIVED = {
    "position_mm": "certified position of the face along the gauge, mm",
    "side": "+1 for fronts, -1 for backs",
    "row": "number of the probing, from 0",
    "touches": "touches since the last pause longer than a minute, in order of time",
    "touches_N": "the same since a pause longer than N seconds, N a whole number",
    "turning_mm": "way along the gauge between touches since it last turned round, mm",
    "rest_s": "time since the touch before, s",
    f"{RESTED}_N": "roots of this rest and of those before earlier touches, s^0.5, fading to 1/e over N touches",
    "COORDINATE_held_N": "way of x_mm, y_mm, z_mm or position_mm since it turned, mm, at most N um to either side",
    "COLUMN_lag_N": "a recorded column as a body with a time constant of N seconds follows it",
    "way": "+1 where the touch before was nearer to face 1, -1 where it was farther from it",
    "azimuth_rad": "azimuth of the approach about the stylus, from machine +x",
}
"""Covariates beside the columns of the recording."""
PAUSE_S = 60.0
"""Shortest time between two probings that is a pause."""


class Empirical(Effect):
    """A fitted formula without a known cause: d = formula(covariates, coefficients).

    The formula knows the columns of the recording by name (``x_mm``, ``time_s``, ``gauge_temperature_C``, any further
    one), what ``DERIVED`` lists, and the coefficients. It is parsed, and never executed as code:
    :mod:`stepgauge.files.formula`.
    """

    kind: ClassVar[str] = "empirical"
    equation: ClassVar[str] = "d = formula along the direction, um"
    source: ClassVar[str] = "the fit that found it"
    covariates: ClassVar[tuple[str, ...]] = ("formula",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    words: ClassVar[Wording | None] = Wording(
        "empirical law",
        "A formula without a known cause: {formula}.",
        "Look for the cause by other means.",
        "Nothing: do not adjust or compensate before the cause is known.",
        german=Wording(
            "empirisches Gesetz",
            "Eine Formel ohne bekannte Ursache: {formula}.",
            "Die Ursache auf anderem Weg suchen.",
            "Nichts justieren oder kompensieren, bevor die Ursache bekannt ist.",
        ),
    )
    formula: str = parameter(unit="um", role="choice", meaning="e.g. a + b * log(speed_mm_s)", min_length=1)
    coefficients: dict[str, float] = Field(
        default_factory=dict,
        description="values of the names in the formula that are no covariates",
        json_schema_extra={"unit": "", "role": "nonlinear", "sensible": None},
    )
    direction: AnyDirection = parameter(
        "approach", unit="", role="choice", meaning="approach, x, y, z or a vector in machine axes"
    )

    @model_validator(mode="after")
    def _understood(self) -> Empirical:
        unused = set(self.coefficients) - self.parsed.names
        if unused:
            raise ValueError(f"formula with the coefficient {min(unused)!r} in it")
        return self

    @property
    def parsed(self) -> Formula:
        """The formula ready to be evaluated."""
        return parse(self.formula)

    @property
    def label(self) -> str:
        """Without the formula, which cannot be part of the name of a column."""
        return self.kind

    def displacement_um(self, probings: Probings) -> Displacement:
        """The formula for all rows; :class:`InputError` where it is not finite or has an unknown name."""
        names = self.parsed.names
        columns = {name: _covariate(probings, name) for name in names if name not in self.coefficients}
        um = self.parsed(columns | {name: np.asarray(c, float) for name, c in self.coefficients.items()})
        if not np.isfinite(um).all():
            raise InputError("effects", "an empirical formula is not finite for every probing", found=self.formula)
        um = np.broadcast_to(um, np.broadcast_shapes(um.shape, (len(probings),)))
        return along(self.direction, um)


def holds(formula: str, probings: Probings) -> NDArray[np.bool_]:
    """Where a formula of covariates is true (not 0), ``(n,)``."""
    parsed = parse(formula)
    return np.asarray(parsed({name: _covariate(probings, name) for name in parsed.names}) != 0)


def _covariate(probings: Probings, name: str) -> Array:
    if name in _NAMED:
        return _NAMED[name](probings)
    column, lag, seconds = name.rpartition("_lag_")
    if lag and seconds.isdecimal():
        return probings.lagged(column, float(seconds))
    column, held, um = name.rpartition("_held_")
    if held and um.isdecimal() and column in COORDINATES:
        return probings.held_mm(column, float(um) * 1e-3)
    prefix, _, number = name.rpartition("_")
    if prefix in _NUMBERED and number.isdecimal():
        return _NUMBERED[prefix](probings, float(number))
    return probings.column(name)


def _row(probings: Probings) -> Array:
    return np.arange(probings.first_row, probings.first_row + len(probings), dtype=float)


def _azimuth_rad(probings: Probings) -> Array:
    cosine, sine = probings.lateral_share()
    return np.arctan2(sine, cosine)


_NAMED: dict[str, Callable[[Probings], Array]] = {
    "position_mm": lambda probings: probings.certified_mm(),
    "side": lambda probings: np.where(probings.face % 2 == 1, 1.0, -1.0),
    "row": _row,
    "touches": lambda probings: probings.touches_since_pause(PAUSE_S),
    "turning_mm": lambda probings: probings.since_turning_mm(),
    "rest_s": lambda probings: probings.rest_s(),
    "way": lambda probings: probings.way(),
    "azimuth_rad": _azimuth_rad,
}
_NUMBERED: dict[str, Callable[[Probings, float], Array]] = {
    "touches": lambda probings, pause_s: probings.touches_since_pause(pause_s),
    RESTED: lambda probings, touches: probings.rested(touches),
}
