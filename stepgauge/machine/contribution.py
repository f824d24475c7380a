"""Contributions of one's own to a budget: what a laboratory knows besides, with distribution and sensitivity."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, ValidationError

from stepgauge.errors import InputError, naming
from stepgauge.files.config import TomlTable

DIVISOR = {"normal": 1.0, "uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0), "arcsine": math.sqrt(2.0)}
"""From the stated value to the standard uncertainty (JCGM 100:2008, 4.3): of normal it is one already, of the others
the half width."""
EXPECTED = 'NAME=VALUE with KEY=VALUE behind commas, e.g. "form of the faces=0.2, distribution=uniform, dof=8"'


class Contribution(TomlTable):
    """One contribution: a ``[[contribution]]`` of the machine file, or the text of an option.

    ``sensitivity`` moves every face by itself; ``sensitivity_per_m`` all faces together, in proportion to the position.
    """

    name: str = Field(min_length=1, description="what it is, e.g. form of the faces")
    value: float = Field(ge=0, allow_inf_nan=False, description="standard uncertainty, or half width of the others")
    unit: str = Field("um", description="unit of the value")
    distribution: Literal["normal", "uniform", "triangular", "arcsine"] = Field("normal", description="of the value")
    dof: float | None = Field(None, ge=1, description="degrees of freedom; without it infinite")
    sensitivity: float | None = Field(None, allow_inf_nan=False, description="um at a face per unit of the value")
    sensitivity_per_m: float | None = Field(
        None, allow_inf_nan=False, description="um per unit of the value and per m of the position, common to all faces"
    )

    @property
    def u(self) -> float:
        """Standard uncertainty of the value, in its unit."""
        return self.value / DIVISOR[self.distribution]

    @property
    def u_face_um(self) -> float:
        """Standard uncertainty of every face by itself, um."""
        own = 1.0 if self.sensitivity is None and self.sensitivity_per_m is None else self.sensitivity or 0.0
        return abs(own) * self.u

    @property
    def u_um_per_m(self) -> float:
        """Standard uncertainty in proportion to the position, common to all faces, um per m."""
        return abs(self.sensitivity_per_m or 0.0) * self.u


def parse_contribution(text: str) -> Contribution:
    """``form of the faces=0.2, distribution=uniform, dof=8``: the first is name and value.

    :class:`InputError` for another form, an unknown key, or a value that the key does not take.
    """
    first, *more = (part.partition("=") for part in text.split(","))
    pairs = {"name": first[0].strip(), "value": first[2].strip(), **{k.strip(): v.strip() for k, _, v in more}}
    if not all(mark for _, mark, _ in (first, *more)) or len(pairs) != len(more) + 2:
        raise InputError(naming("contributions"), "this is no contribution", found=repr(text), expected=EXPECTED)
    numbers = {"value", "dof", "sensitivity", "sensitivity_per_m"}
    try:
        typed = {key: float(value) if key in numbers else value for key, value in pairs.items()}
        return Contribution.model_validate(typed)
    except (ValidationError, ValueError) as error:
        found = error.errors()[0] if isinstance(error, ValidationError) else None
        what = f"key {found['loc'][0]}: {found['msg']}" if found else str(error)
        raise InputError(naming("contributions"), what, found=repr(text), expected=EXPECTED) from None
