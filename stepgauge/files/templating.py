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
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.resource_limits import MB, ResourceLimits, work_within
from stepgauge.files.resources import folder
from stepgauge.files.text import read_text


def fill_template(source: Path, kind: str, context: Mapping[str, object]) -> str:
    """The text of a template file; ``kind`` is the folder of ``templates`` whose files it may extend.

    :class:`InputError` names the line of a template that fails: syntax, an unknown name, something the sandbox forbids;
    and a template that is out of its budget.
    """
    from stepgauge.files.sandbox import render_task, render_text  # Jinja is long to load

    text, values = read_text(source), {name: _values(value) for name, value in context.items()}
    if source.resolve().is_relative_to(folder("templates").resolve()):
        return render_text(text, str(source), kind, values, float("inf"))
    size = len(json.dumps(values))
    given = {"text": text, "source": str(source), "kind": kind, "values": values, "most_characters": MB + 10 * size}
    return work_within(template_budget(size), render_task, given, source).decode("utf-8", "surrogatepass")


def template_budget(size: int, seconds: float = 3.0, memory_MB: float = 400.0) -> ResourceLimits:
    """What a template of somebody's own may use that is given so many bytes."""
    return ResourceLimits(seconds + 3.0 * size / MB, memory_MB + 60.0 * size / MB, "template")


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


def check_printable(text: str, source: Path) -> None:
    """Controllers read printable ASCII; a degree sign stops some of them, and not all end a line at a form feed."""
    for line, content in enumerate(text.split("\n"), 1):
        odd = next((sign for sign in content if not " " <= sign <= "~" and sign != "\t"), None)
        if odd is not None:
            what = "not ASCII" if odd > "~" and not odd.isascii() else "a control character"
            raise InputError(source, f"line {line} of the rendered text has a sign that is {what}", found=repr(odd))
