"""A dialect in print: its options and its table, for ``stepgauge list dialects NAME`` and the docs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from stepgauge.programs import DIALECTS
from stepgauge.programs.dialect import Dialect
from stepgauge.programs.grammar import END, FIRST, FRAME, LAST, START, Code, DialectGrammar, Production

Row = tuple[str, ...]
_STANDS = {
    START: "before the first move",
    END: "after the last move",
    FIRST: "first",
    LAST: "last",
    FRAME: "first and last",
    "": "",
}


def described(dialect: Dialect) -> str:
    """Options and table of a dialect as Markdown; of a variant only what its family does not have."""
    return "\n\n".join(_table(head, rows) for head, rows in _groups(dialect) if rows) + "\n"


def _groups(dialect: Dialect) -> Iterator[tuple[Row, Sequence[Row]]]:
    family = DIALECTS.get(dialect.family)
    table, known = dialect.table, family.table if family else None
    options = [(name, one) for name, one in dialect.options.items() if not family or family.options[name] != one]
    yield (
        ("option", "default", "values", "meaning"),
        [
            (f"`{name}`", f"`{one.default}`" if one.default else "none", one.kind.expected, one.does)
            for name, one in options
        ],
    )
    forms = [one for one in table.forms if not known or one not in known.forms]
    codes = [one for one in table.codes if not known or one not in known.codes]
    yield (
        ("statement", "does", "stands", "source"),
        [(f"`{one.text}`", one.does, _stands(table, one), one.source) for one in forms] + _codes(codes),
    )
    if known is None:
        used = dict.fromkeys(name for one in table.forms for name in re.findall(r"\{(\w+)\}", one.text))
        words = [(f"`{word}`", table.slot(name).what) for word, name in table.words.items()]
        yield ("word", "is"), [*words, *((f"`{{{name}}}`", table.slot(name).what) for name in used)]
        yield (
            ("an expression reads", "is", "source"),
            [(f"`{one.name}`", one.does, one.source) for one in table.variables],
        )
        comments = [(f"`{one.begins}..{one.ends}`", one.what, one.source) for one in table.comments]
        yield ("comment", "of", "source"), comments


def _codes(codes: Sequence[Code]) -> list[Row]:
    """Codes that mean the same in a row."""
    found: dict[Row, list[str]] = {}
    for one in codes:
        found.setdefault((one.does, _STANDS[one.when], one.source), []).append(f"`{one.code}`")
    return [(", ".join(names), *rest) for rest, names in found.items()]


def _stands(table: DialectGrammar, form: Production) -> str:
    before = next((one.text for one in table.forms if one.name == form.after), "")
    return f"directly after `{before}`" if before else _STANDS[form.when]


def _table(head: Row, rows: Sequence[Row]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
