"""The types of numbers in arrays, files of them, and whether two things hold the same of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.outputs import replacing

ARRAY = "array of this file"
"""Key of the number of an array in the JSON before it."""
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


def write_arrays(path: str | Path, said: Any) -> None:
    """Write dataclasses, dictionaries, lists, texts, numbers and arrays as one file: JSON and the arrays behind it."""
    arrays: list[NDArray[Any]] = []

    def numbered(value: Any) -> dict[str, Any]:
        if is_dataclass(value):
            return {one.name: getattr(value, one.name) for one in fields(value)}
        arrays.append(np.asarray(value))
        return {ARRAY: len(arrays) - 1}

    text = json.dumps(said, default=numbered)
    with replacing(path) as beside, beside.open("wb") as file:
        for one in (np.array(text), *arrays):
            np.save(file, one, allow_pickle=False)


def read_arrays(path: str | Path) -> Any:
    """What :func:`write_arrays` wrote; :class:`InputError` for another file."""
    try:
        with Path(path).open("rb") as file:
            text, arrays = str(np.load(file, allow_pickle=False)), list[NDArray[Any]]()
            while file.peek(1):
                arrays.append(np.load(file, allow_pickle=False))
        return json.loads(text, object_hook=lambda one: arrays[one[ARRAY]] if set(one) == {ARRAY} else one)
    except (OSError, ValueError, IndexError, TypeError, EOFError) as error:
        raise InputError(path, "not whole", found=str(error), expected="the file as stepgauge wrote it") from None
