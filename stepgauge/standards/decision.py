"""Maximum permissible errors and the decision rule of ISO 14253-1: uncertainty counts against who wants to prove."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.errors import InputError

Array = NDArray[np.float64]
Outcome = Literal["conforms", "does not conform", "not decidable"]
DECISION_SOURCE = "ISO 14253-1, decision rules for proving conformity or nonconformity"
_NUMBER = r"(\d+(?:\.\d*)?|\.\d+)"
_MPE = re.compile(rf"^{_NUMBER}(?:\+{_NUMBER}?\*?L/{_NUMBER})?$")


@dataclass(frozen=True)
class PermissibleError:
    """A maximum permissible error of length measurement, plus and minus: the smaller of A + L / K and a cap.

    ``constant_um``: A; ``um_per_mm``: 1 / K with K in mm per um; ``cap_um``: None without a cap. These are the forms
    that ISO 10360-2:2009 gives for the maximum permissible error of length measurement in its terms and definitions.
    """

    constant_um: float
    um_per_mm: float = 0.0
    cap_um: float | None = None

    def at(self, length_mm: ArrayLike) -> Array:
        """The limit in um at lengths in mm (any shape)."""
        limit = self.constant_um + self.um_per_mm * np.asarray(length_mm, float)
        return limit if self.cap_um is None else np.minimum(limit, self.cap_um)

    def __str__(self) -> str:
        text = f"{self.constant_um:g}" + (f" + L/{1.0 / self.um_per_mm:g}" if self.um_per_mm else "")
        return f"{text} µm, L in mm" if self.cap_um is None else f"min({text}; {self.cap_um:g}) µm, L in mm"


def parse_mpe(text: str, cap_um: float | None = None) -> PermissibleError:
    """``"1.8 + L/350"``, ``"2 + 3L/1000"`` or ``"2.5"`` (um, L in mm) as a permissible error.

    :class:`InputError` where it is not of that form or nothing would be permitted.
    """
    found = _MPE.match(re.sub(r"\s+|um$|µm$", "", text))
    if not found:
        raise InputError("--mpe", "not a permissible error", found=repr(text), expected='"A + L/K" in um, L in mm')
    constant, factor, divisor = found.groups()
    if divisor is not None and float(divisor) == 0.0:
        raise InputError("--mpe", "K is zero", found=repr(text), expected='"A + L/K" with K above 0')
    slope = float(factor or 1.0) / float(divisor) if divisor else 0.0
    if float(constant) + slope == 0.0:
        raise InputError("--mpe", "permits no error at all", found=repr(text), expected="A or L/K above 0")
    return PermissibleError(float(constant), slope, cap_um)


def decide(value_um: float, limit_um: float, expanded_um: float) -> Outcome:
    """Whether a test value proves conformity with plus and minus a limit, nonconformity, or neither (ISO 14253-1).

    ``expanded_um`` is the expanded uncertainty of the test value: it narrows the zone in which conformity is proven,
    and widens that beyond which nonconformity is.
    """
    size = abs(value_um)
    if size <= limit_um - expanded_um:
        return "conforms"
    return "does not conform" if size > limit_um + expanded_um else "not decidable"


def together(outcomes: list[Outcome]) -> Outcome:
    """The outcome of several test values: one that does not conform decides, then one that is not decidable."""
    for worst in ("does not conform", "not decidable"):
        if worst in outcomes:
            return worst
    return "conforms"
