"""Text through a Jinja template, a shipped one or the user's own, in Jinja's sandbox.

Names that a template uses but is not given are errors (strict undefined). Filters: ``fixed(n)`` prints n decimals and
never -0; ``plain`` keeps letters, digits, space, dot, dash and underscore. A template may extend a shipped one of its
kind by its file name, and then states only the blocks that differ.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Mapping
from pathlib import Path

import jinja2
from jinja2 import meta
from jinja2.sandbox import ImmutableSandboxedEnvironment

from stepgauge.errors import InputError
from stepgauge.files import read_text
from stepgauge.resources import folder


def fill_template(source: Path, kind: str, context: Mapping[str, object]) -> str:
    """The text of a template file; ``kind`` is the folder of ``templates`` whose files it may extend.

    :class:`InputError` names the line of a template that fails: syntax, an unknown name, something the sandbox forbids.
    """
    environment, text = _environment(kind), read_text(source)
    try:
        filled = environment.from_string(text).render(context)
        _check_use(environment, text, source, context)
        return filled
    except jinja2.TemplateSyntaxError as error:
        raise InputError(f"{source}:{error.lineno}", f"template: {error.message}") from None
    except InputError:
        raise
    except Exception as error:  # whatever a user's template does is the template's fault: name its line
        raise InputError(f"{source}:{_template_line(error)}", f"template: {error}") from None


def _check_use(environment: jinja2.Environment, text: str, source: Path, context: Mapping[str, object]) -> None:
    """Another file given for a template prints itself, whatever was measured: refused before the machine gets it."""
    tree = environment.parse(text)
    if meta.find_undeclared_variables(tree) & set(context) or any(meta.find_referenced_templates(tree)):
        return
    raise InputError(source, "template: it uses nothing of what it is given", expected="one of " + ", ".join(context))


def _environment(kind: str) -> jinja2.Environment:
    environment = ImmutableSandboxedEnvironment(
        loader=jinja2.FileSystemLoader(folder("templates") / kind),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(fixed=fixed, plain=plain)
    return environment


def fixed(value: float, decimals: int) -> str:
    """A number with a fixed count of decimals, without exponent and without a negative zero."""
    text = f"{float(value):.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def plain(text: object) -> str:
    """Text that every controller takes in a comment or a file name."""
    return re.sub(r"[^A-Za-z0-9 ._-]", "_", str(text))


def check_ascii(text: str, source: Path) -> None:
    """Controllers read ASCII; a degree sign in a comment stops some of them."""
    for line, content in enumerate(text.splitlines(), 1):
        if not content.isascii():
            raise InputError(source, f"line {line} of the rendered text is not ASCII", found=repr(content))


def _template_line(error: Exception) -> int:
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == "<template>"]
    return frames[-1].lineno or 0 if frames else 0
