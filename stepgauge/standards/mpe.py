"""The maximum permissible error of length measurement in the forms of ISO 10360: A + L/K, with or without a cap."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.errors import InputError

_NUMBER = r"(\d+(?:\.\d+)?|\.\d+)"
_FORM = re.compile(rf"{_NUMBER}(?:\+L/{_NUMBER})?|L/{_NUMBER}", re.I)
EXPECTED = '"A + L/K" (A in um, L in mm, K without unit), "A", or "min(A + L/K, B)"'


@dataclass(frozen=True)
class Mpe:
    """``min(A + L/K, cap)``: ``constant_um`` A, ``divisor`` K (infinite: no dependence on length), ``cap_um``."""

    constant_um: float
    divisor: float = np.inf
    cap_um: float = np.inf

    @classmethod
    def parse(cls, text: str) -> Mpe:
        """``1.8 + L/350``, ``2.5``, ``min(1.8 + L/350, 3)``; :class:`InputError` for anything else."""
        compact = re.sub(r"\s+|um|µm", "", text)
        capped = re.fullmatch(rf"min\((.+),{_NUMBER}\)", compact, re.I)
        match = _FORM.fullmatch(capped[1] if capped else compact)
        if match is None:
            raise InputError("--mpe", "this is no maximum permissible error", found=repr(text), expected=EXPECTED)
        constant, divisor, alone = match.groups()
        result = cls(float(constant or 0.0), float(divisor or alone or "inf"), float(capped[2]) if capped else np.inf)
        if result.divisor == 0.0 or result.cap_um <= 0.0 or (constant and float(constant) == 0.0 and not divisor):
            raise InputError("--mpe", "a limit of zero or without bound", found=repr(text), expected=EXPECTED)
        return result

    def at_um(self, length_mm: ArrayLike) -> NDArray[np.float64]:
        """The limit for lengths (their size counts), um, of the same shape."""
        length = np.abs(np.asarray(length_mm, float))
        return np.minimum(self.constant_um + length / self.divisor, self.cap_um)

    def __str__(self) -> str:
        text = f"{self.constant_um:g}" + (f" + L/{self.divisor:g}" if np.isfinite(self.divisor) else "")
        return f"min({text}, {self.cap_um:g})" if np.isfinite(self.cap_um) else text
