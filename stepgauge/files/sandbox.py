"""Jinja's sandbox for one template: what it is given, and what it may call.

A template sees values only: records, tuples, texts and numbers. None of them has a method that changes or writes
anything. A user's own template runs in a process of its own (:mod:`stepgauge.files.templating`).
"""

from __future__ import annotations

import traceback
from collections import namedtuple
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import jinja2
from jinja2 import meta
from jinja2.sandbox import ImmutableSandboxedEnvironment

from stepgauge.errors import InputError
from stepgauge.files.controls import fixed, plain, signed
from stepgauge.files.resources import folder


def render_text(text: str, source: str, kind: str, values: Mapping[str, Any], most_characters: float) -> str:
    """The text that a template makes of ``values`` (JSON types); ``kind``: folder of templates that it may extend.

    :class:`InputError` names the line of a template that fails: syntax, an unknown name, something the sandbox forbids,
    more than ``most_characters`` of text.
    """
    try:
        template, used = _compiled(kind, text)
        filled = _limited(template, {name: _seen(value) for name, value in values.items()}, most_characters)
        _check_use(used, source, values)
        return filled
    except jinja2.TemplateSyntaxError as error:
        raise InputError(f"{source}:{error.lineno}", f"template: {error.message}") from None
    except InputError:
        raise
    except MemoryError:
        raise InputError(source, "template: it needs too much memory") from None
    except Exception as error:  # whatever a user's template does is the template's fault: name its line
        said = str(error) or type(error).__name__
        raise InputError(f"{source}:{template_line(error)}", f"template: {said}") from None


def render_task(given: dict[str, Any]) -> bytes:
    """The same with the arguments as one object, for a process of its own."""
    return render_text(**given).encode("utf-8", "surrogatepass")


def _limited(template: jinja2.Template, values: dict[str, Any], most_characters: float) -> str:
    pieces, size = [], 0
    for piece in template.generate(values):
        pieces.append(piece)
        size += len(piece)
        if size > most_characters:
            raise ValueError(f"the text has no end: more than {most_characters:.0f} characters")
    return "".join(pieces)


def _seen(value: Any) -> Any:
    """JSON types as a template sees them: an object is a record that cannot be changed, an array a tuple."""
    if isinstance(value, dict):
        names = tuple(value)
        inside = [_seen(item) for item in value.values()]
        record = _record(names)
        return MappingProxyType(dict(zip(names, inside, strict=True))) if record is None else record(*inside)
    if isinstance(value, list):
        return tuple(map(_seen, value))
    return value


@lru_cache(maxsize=256)
def _record(names: tuple[str, ...]) -> Any:
    """The tuple with these names, None where they cannot be names."""
    try:
        return namedtuple("Values", names)
    except ValueError:
        return None


@lru_cache(maxsize=16)
def _compiled(kind: str, text: str) -> tuple[jinja2.Template, frozenset[str]]:
    """A template and the names that it uses; one that extends another uses what that one uses: ``*``."""
    environment = _environment(kind)
    template, tree = environment.from_string(text), environment.parse(text)
    more = {"*"} if any(meta.find_referenced_templates(tree)) else set()
    return template, frozenset(meta.find_undeclared_variables(tree) | more)


def _check_use(used: frozenset[str], source: str, values: Mapping[str, Any]) -> None:
    """Another file given for a template prints itself, whatever was measured: refused before the machine gets it."""
    if not used & {"*", *values}:
        raise InputError(
            source, "template: it uses nothing of what it is given", expected="one of " + ", ".join(values)
        )


def _environment(kind: str) -> jinja2.Environment:
    environment = ImmutableSandboxedEnvironment(
        loader=jinja2.FileSystemLoader(folder("templates") / kind),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(fixed=fixed, signed=signed, plain=plain)
    return environment


def template_line(error: Exception) -> int:
    """The line of a template at which it failed; 0 where that is not known."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == "<template>"]
    return frames[-1].lineno or 0 if frames else 0
