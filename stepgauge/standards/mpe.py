"""The maximum permissible error of length measurement in the forms of ISO 10360: A + L/K, with or without a cap."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.errors import InputError, naming

_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)"
_FORM = re.compile(
    rf"(?P<constant>{_NUMBER})(?:\+(?P<factor>{_NUMBER})?\*?L/(?P<k>{_NUMBER}))?"
    rf"|(?P<times>{_NUMBER})?\*?L/(?P<divisor>{_NUMBER})",
    re.I,
)
EXPECTED = '"A + L/K" (A in um, L in mm, K without unit), "A", "L/K", or "min(A + L/K, B)"'


@dataclass(frozen=True)
class Mpe:
    """Plus and minus ``min(A + L/K, cap)``: ``constant_um`` A, ``divisor`` K (infinite: any length), ``cap_um``.

    These are the forms that ISO 10360-2:2009 gives for it in its terms and definitions.
    """

    constant_um: float
    divisor: float = np.inf
    cap_um: float = np.inf

    @classmethod
    def parse(cls, text: str) -> Mpe:
        """``1.8 + L/350``, ``2,5 + 3L/1000``, ``2.5``, ``min(1.8 + L/350, 3)``; um at the end may stand.

        :class:`InputError` for anything else, and where nothing would be permitted.
        """
        compact = re.sub(r"\s+|[uµμ]m", "", text)
        if not compact.lower().startswith("min("):  # there a comma stands between the two limits
            compact = re.sub(r"(?<=\d),(?=\d)", ".", compact)
        capped = re.fullmatch(rf"min\((.+),({_NUMBER})\)", compact, re.I)
        match = _FORM.fullmatch(capped[1] if capped else compact)
        if match is None:
            raise InputError(naming("mpe"), "this is no maximum permissible error", found=repr(text), expected=EXPECTED)
        cap_um = float(capped[2]) if capped else np.inf
        constant = match["constant"] or "0"
        factor, divisor = (
            float(match["factor"] or match["times"] or 1.0),
            float(match["k"] or match["divisor"] or "inf"),
        )
        if 0.0 in (factor, divisor, cap_um) or (float(constant) == 0.0 and np.isinf(divisor)):
            raise InputError(naming("mpe"), "a limit of zero or without bound", found=repr(text), expected=EXPECTED)
        return cls(float(constant), divisor / factor, cap_um)

    def at_um(self, length_mm: ArrayLike) -> NDArray[np.float64]:
        """The limit for lengths (their size counts), um, of the same shape."""
        length = np.abs(np.asarray(length_mm, float))
        return np.minimum(self.constant_um + length / self.divisor, self.cap_um)

    @property
    def um_per_mm(self) -> float:
        """1/K."""
        return 1.0 / self.divisor

    def __str__(self) -> str:
        text = f"{self.constant_um:g}" + (f" + L/{self.divisor:g}" if np.isfinite(self.divisor) else "")
        return f"min({text}, {self.cap_um:g})" if np.isfinite(self.cap_um) else text

    def to_text(self) -> str:
        """As printed on a figure or in a report."""
        text = f"({self})" if np.isfinite(self.divisor) and not np.isfinite(self.cap_um) else f"{self}"
        return f"{text} µm, L in mm" if np.isfinite(self.divisor) else f"{text} µm"
