"""TOML files that people write, checked key by key against a pydantic model."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stepgauge.errors import InputError, reading
from stepgauge.files.outputs import place_of
from stepgauge.files.text import LARGEST_NUMBER, read_text

LEAST_NUMBER = 1e-30
"""No quantity of ours is smaller, in whatever unit, and not zero."""
Vector3 = Annotated[tuple[float, float, float], Field(strict=False)]
"""Three numbers, written as a TOML array."""


class TomlTable(BaseModel):
    """A TOML table: unknown keys, numbers in quotes, NaN and infinities are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)


Model = TypeVar("Model", bound=TomlTable)


_DECIMAL_COMMA = re.compile(r"=\s*-?\d+,\d|\d,\d+\s+-?\d")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The content of a TOML file; :class:`InputError` names the line of a syntax error, and a number that is none."""
    return parse_toml(read_text(path), path)


def parse_toml(text: str, path: str | Path) -> dict[str, Any]:
    """TOML from text; ``path`` is for messages. Errors as :func:`read_toml`."""
    with reading(path, "TOML file"):
        try:
            data = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            comma = " (a decimal comma? TOML has points)" if _DECIMAL_COMMA.search(text) else ""
            raise InputError(path, f"not valid TOML: {error}{comma}") from None
        _check_finite(data, path, "")
    return data


def _check_finite(value: object, path: str | Path, key: str) -> None:
    """``nan`` and ``inf`` are numbers of TOML, but of no file of ours; nor are those that overflow when squared."""
    if isinstance(value, float | int) and not (value == 0 or LEAST_NUMBER <= abs(value) <= LARGEST_NUMBER):
        expected = f"a finite number, 0 or {LEAST_NUMBER:g} to {LARGEST_NUMBER:g} in size"
        raise InputError(path, f"key {key} is wrong", found=value, expected=expected)
    if isinstance(value, dict):
        for name, one in value.items():
            _check_finite(one, path, f"{key}.{name}" if key else name)
    if isinstance(value, list):
        for number, one in enumerate(value, 1):
            _check_finite(one, path, f"{key}[{number}]")


def file_beside(where: str | Path, key: str, name: str) -> Path:
    """The path of a file that the file ``where`` names (:class:`InputError` with its key where it is not there)."""
    path = Path(where).parent / name
    if not place_of(path).is_file():
        raise InputError(
            where, f"key {key}: no such file", found=name, expected="its path from the folder of this file"
        )
    return path


def check_table(model: type[Model], data: object, where: str | Path, key: str = "") -> Model:
    """``data`` as a ``model``; the first thing wrong becomes an :class:`InputError` naming its key.

    ``key`` is the dotted name of the table inside the file ``where``.
    """
    if not isinstance(data, dict):
        raise InputError(where, f"table [{key}] is missing", expected=", ".join(model.model_fields))
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _make_input_error(model, error, where, key) from None


def _make_input_error(model: type[TomlTable], error: ValidationError, where: str | Path, key: str) -> InputError:
    details = error.errors(include_url=False)
    first = _first(model, details)
    name = ".".join(str(part) for part in (key, *first["loc"]) if part != "")
    more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
    if first["type"] == "extra_forbidden":
        return InputError(where, f"key {name} is not known{more}", expected=_known_keys(model, str(first["loc"][-1])))
    if first["type"] == "missing":
        return _missing(model, details, first, where, name)
    said = first["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    asked, meaning = _PLAIN.get(first["type"], said), _meaning(model, first["loc"]) if first["loc"] else ""
    expected = f"{asked} ({meaning})" if asked and meaning else asked or meaning
    what = f"{'key' if first['loc'] else 'table'} {name} is wrong{more}"
    return InputError(where, what, found=_written(first["input"]), expected=expected)


def _missing(model: type[TomlTable], details: list[Any], first: Any, where: str | Path, name: str) -> InputError:
    """Every key of the table that is missing at once, and how much else is wrong in it."""
    beside = [one for one in details if one["type"] == "missing" and one["loc"][:-1] == first["loc"][:-1]]
    more = f" (and {len(details) - len(beside)} more)" if len(details) > len(beside) else ""
    keys = [str(one["loc"][-1]) for one in beside if one is not first]
    if not keys:
        return InputError(where, f"key {name} is missing{more}", expected=_meaning(model, first["loc"]))
    return InputError(where, f"keys {', '.join([name, *keys])} are missing{more}")


_PLAIN = {
    "string_type": "text in quotes",
    "string_too_short": "text",
    "string_pattern_mismatch": "",
    "too_long": "fewer values",
    "date_type": "a date",
    "bool_type": "true or false",
    "list_type": "a list in brackets",
}
"""What is asked, where pydantic says it in words of Python; nothing where the meaning of the key says it."""


def _written(value: object) -> str | None:
    """A value as a file states it; of a whole table, in which keys contradict each other, nothing."""
    if isinstance(value, dict | BaseModel):
        return None
    if isinstance(value, list | tuple):
        return f"[{', '.join(str(_written(one)) for one in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) else str(value)


def _first(model: type[TomlTable], details: list[Any]) -> Any:
    """What is wrong first; a key that is missing because another one is misspelt comes after that one."""
    for one in details:
        name = str(one["loc"][-1]) if one["loc"] else ""
        if one["type"] == "extra_forbidden" and difflib.get_close_matches(name, list(model.model_fields), n=1):
            return one
    return details[0]


def _known_keys(model: type[TomlTable], name: str) -> str:
    near = difflib.get_close_matches(name, list(model.model_fields), n=1)
    return f"{near[0]}?" if near else "one of " + ", ".join(model.model_fields)


def _meaning(model: type[TomlTable], loc: tuple[int | str, ...]) -> str:
    field = model.model_fields.get(str(loc[0])) if loc else None
    return (field.description if field and field.description else "see the documentation").rstrip(".")
