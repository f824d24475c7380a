"""Text through a Jinja template, a shipped one or the user's own, in Jinja's sandbox and within a budget.

Names that a template uses but is not given are errors (strict undefined). Filters: ``fixed(n)`` prints n decimals and
never -0, ``signed(n)`` also a plus; ``plain`` keeps letters, digits,
space, dot, dash and underscore. A template may extend a shipped one of its
kind by its file name, and then states only the blocks that differ.

A template is given a copy, in values that cannot be changed (:mod:`stepgauge.files.sandbox`). Shipped templates are
rendered here; a user's own one in a process of its own, which costs a sixth of a second and may use

- 3 s of processor time and 3 s per MB of what it is given,
- 400 MB of memory and 60 times what it is given,
- 1 MB of text and 10 times what it is given.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.resources import folder
from stepgauge.files.sandbox import fixed, plain, render_text
from stepgauge.files.text import read_text

__all__ = ["check_printable", "fill_template", "fixed", "plain"]

MB = 1_000_000
_START = "import sys; sys.path[:] = sys.argv[1:]; from stepgauge.files.sandbox import main; main()"
_WAIT = 10.0
"""Seconds of a busy machine per second of processor time."""


def fill_template(source: Path, kind: str, context: Mapping[str, object]) -> str:
    """The text of a template file; ``kind`` is the folder of ``templates`` whose files it may extend.

    :class:`InputError` names the line of a template that fails: syntax, an unknown name, something the sandbox forbids;
    and a template that is out of its budget.
    """
    text, values = read_text(source), {name: _values(value) for name, value in context.items()}
    if source.resolve().is_relative_to(folder("templates").resolve()):
        return render_text(text, str(source), kind, values, float("inf"))
    return _in_own_process(text, source, kind, values)


def _values(value: object) -> Any:
    """A copy in JSON types: objects and mappings by the names of their fields, arrays as lists of numbers."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        return value if type(value) in (int, float) else float(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if is_dataclass(value):
        return {one.name: _values(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _values(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        names = getattr(value, "_fields", None)
        inside = [_values(item) for item in value]
        return inside if names is None else dict(zip(names, inside, strict=True))
    raise TypeError(f"a template sees values, not a {type(value).__name__}")


def _in_own_process(text: str, source: Path, kind: str, values: Mapping[str, Any]) -> str:
    given = json.dumps(values)
    size = len(given)
    seconds = 3 + 3 * size // MB
    task = {
        "text": text,
        "source": str(source),
        "kind": kind,
        "seconds": seconds,
        "bytes": 400 * MB + 60 * size,
        "characters": MB + 10 * size,
    }
    try:
        done = subprocess.run(
            [sys.executable, "-c", _START, *sys.path],
            input=json.dumps(task)[:-1] + f', "values": {given}}}',
            capture_output=True,
            encoding="utf-8",
            timeout=_WAIT * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _out_of_budget(source, seconds) from None
    if done.returncode != 0 or not done.stdout:
        raise _out_of_budget(source, seconds)
    made = json.loads(done.stdout)
    if "error" in made:
        where, what, found, expected = made["error"]
        raise InputError(where, what, found=found, expected=expected)
    return str(made["text"])


def _out_of_budget(source: Path, seconds: float) -> InputError:
    return InputError(
        source,
        "template: it did not come to an end",
        expected=f"a text within {seconds:g} s of processor time and the memory for it",
    )


def check_printable(text: str, source: Path) -> None:
    """Controllers read printable ASCII; a degree sign stops some of them, and not all end a line at a form feed."""
    for line, content in enumerate(text.split("\n"), 1):
        odd = next((sign for sign in content if not " " <= sign <= "~" and sign != "\t"), None)
        if odd is not None:
            what = "not ASCII" if odd > "~" and not odd.isascii() else "a control character"
            raise InputError(source, f"line {line} of the rendered text has a sign that is {what}", found=repr(odd))
