"""Sizes, lengths and directions as a technician reads them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.notation import rounded


def span_mm(axis: str, data: Residuals) -> float:
    """Travel of an axis that the probings used, mm."""
    return float(np.ptp(data.probings.coordinate_mm(axis)))


def length_mm(data: Residuals) -> float:
    """Certified length that the probings covered, mm."""
    return float(np.ptp(data.probings.certified_mm()))


def size(value: float) -> str:
    """The magnitude in two significant digits."""
    return rounded(abs(value), 2)


def in_um(value: float, digits: int = 2) -> str:
    """A length of some um: two significant digits, never an exponent."""
    large = abs(value)
    decimals = int(np.clip(digits - 1 - np.floor(np.log10(large)), 0, 4)) if large > 1e-9 else 1
    return f"{large:.{decimals}f} um"


def long(value: float) -> str:
    """What an error of this sign makes a length: too ``long``, too ``short``."""
    return "long" if value > 0 else "short"


def towards(direction: Any, um: float) -> str:
    """A displacement along a machine axis, in words."""
    if isinstance(direction, str):
        return f"{'+' if um > 0 else '-'}{direction}"
    return f"{'' if um > 0 else '-'}{line(direction)}"


def line(direction: Any) -> str:
    """A machine axis by name, or a direction by its components."""
    if isinstance(direction, str):
        return direction
    return f"({', '.join(f'{d + 0.0:.3f}' for d in np.round(direction, 3))})"


def name_of(kind: str) -> str:
    """A kind in words."""
    return " ".join(kind.replace("_", " ").split())


def in_place(kinds: Iterable[str], combinations: Sequence[Sequence[str]]) -> list[str]:
    """What may be in place of a finding, in words; several laws together by their labels, which have the axes.

    ``kinds``: as ``confounded_with`` has them, ``a + b`` for two together; ``combinations``: the labels of these.
    """
    found: list[str] = []
    for kind in kinds:
        parts = sorted(kind.split(" + "))
        same = [sorted(laws) for laws in combinations if len(laws) == len(parts) > 1]
        alike = [laws for laws in same if all(map(str.startswith, laws, parts))]
        found += [" + ".join(map(name_of, laws)) for laws in alike] or [name_of(kind)]
    return list(dict.fromkeys(found))


def listed(words: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def misfit(before_um: float, after_um: float) -> Iterator[str]:
    """That named effects do not reduce the residuals, which must not be overlooked."""
    if after_um > before_um:
        yield f"the named effects leave {after_um:.3g} um rms of {before_um:.3g} um: do not enter their values"


def significant(value: float | None, digits: int = 3) -> str:
    """A number to some significant digits, without an exponent where it is not usual."""
    if value is None:
        return "undefined"
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        decimals = 0 if value == 0.0 else max(digits - 1 - math.floor(math.log10(abs(value))), 0)
        return f"{value:.{decimals}f}"
    return f"{value:.{digits - 1}e}"
