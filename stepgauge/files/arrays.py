"""The types of numbers in arrays, and results that hold the same of them."""

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


def same_content(one: Any, other: object) -> bool:
    """Whether two results of a kind hold the same numbers and words, wherever they were read from: their ``==``."""
    if type(one) is not type(other) or not is_dataclass(one):
        return NotImplemented
    return _same_fields(one, other)


def _same_fields(one: Any, other: Any) -> bool:
    names = [field.name for field in fields(one) if field.compare and field.name != "path"]
    return all(_same(getattr(one, name), getattr(other, name)) for name in names)


def _same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if type(one) is type(other) and is_dataclass(one):
        return _same_fields(one, other)
    if all(hasattr(each, "iloc") and hasattr(each, "columns") for each in (one, other)):
        return list(one.columns) == list(other.columns) and all(_same(one[name], other[name]) for name in one.columns)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        return len(one) == len(other) and all(map(_same, one, other))
    if hasattr(one, "__array__") or hasattr(other, "__array__"):
        values, others = np.asarray(one), np.asarray(other)
        numbers = values.dtype.kind in "fc" and others.dtype.kind in "fc"
        return np.array_equal(values, others, equal_nan=numbers)
    return bool(one == other)
