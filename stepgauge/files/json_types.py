"""Values as the types that JSON has: it knows no undefined number, no array and no date."""

from __future__ import annotations

import math
from typing import Any


def defined(value: float) -> float | None:
    """A number, None where it is undefined or without bound."""
    return float(value) if math.isfinite(value) else None


def json_types(value: Any) -> Any:
    """The same in JSON types: arrays as lists, undefined numbers as null, dates and whatever else as text."""
    if isinstance(value, dict):
        return {key: json_types(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [json_types(one) for one in value]
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return defined(value)
    if hasattr(value, "tolist"):
        return json_types(value.tolist())
    return value.isoformat() if hasattr(value, "isoformat") else str(value)
