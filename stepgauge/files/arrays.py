"""The types of numbers in arrays, and whether two things hold the same of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Floating-point numbers; shapes stand in the docstrings."""
Rows = NDArray[np.int64]
"""Numbers of rows."""


def compared_fields(one: Any) -> dict[str, Any]:
    """The fields of a dataclass that are compared, wherever it was read from."""
    return {field.name: getattr(one, field.name) for field in fields(one) if field.compare and field.name != "path"}


def same_content(one: Any, other: Any) -> bool:
    """Whether both hold the same numbers and words: objects, tables, arrays and what holds them; NaN beside NaN."""
    if one is other:
        return True
    if type(one) is type(other) and is_dataclass(one) and not isinstance(one, type):
        return same_content(compared_fields(one), compared_fields(other))
    if all(hasattr(each, "iloc") and hasattr(each, "columns") for each in (one, other)):
        return list(one.columns) == list(other.columns) and all(
            same_content(one[name], other[name]) for name in one.columns
        )
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same_content(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        return len(one) == len(other) and all(map(same_content, one, other))
    if hasattr(one, "__array__") or hasattr(other, "__array__"):
        values, others = np.asarray(one), np.asarray(other)
        numbers = values.dtype.kind in "fc" and others.dtype.kind in "fc"
        return np.array_equal(values, others, equal_nan=numbers)
    return bool(one == other)
