"""Reader of the Jin Young CNC code of Pahk & Kim (Fig 4): ``MV`` moves, ``MS`` measures, ``PO 1`` opens a point.

``MS`` takes the tip centre at nominal contact; its direction is the line from the position before. The text carries no
settings: search, speeds and tip are the controller's. What it writes down is not published: there is no log.
"""

from __future__ import annotations

import re

from stepgauge.programs.reading import Reader


def recognises(text: str) -> bool:
    """Whether the first statement is one of this dialect's."""
    return re.match(r"\s*(MV\s+[-\d.]|PO\s+\d)", text) is not None


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    ended = False
    for reader.line, raw in enumerate(text.splitlines(), 1):
        statement = raw.strip()
        if not statement:
            continue
        if ended:
            reader.fail("statement after END;", found=repr(statement))
        ended = _statement(reader, statement)
    if not ended:
        reader.cut_short("END; as the last statement")


def _statement(reader: Reader, statement: str) -> bool:
    """Take one statement; True for the one that ends the program."""
    words = statement.removesuffix(";").split()
    if words in (["END"], ["PO", "1"]) and statement.endswith(";"):
        return words == ["END"]
    if words[:1] not in (["MV"], ["MS"]) or not statement.endswith(";"):
        reader.fail("statement not understood", found=repr(statement), expected="MV x y z ;  MS x y z ;  PO 1 ;  END;")
    target = reader.numbers(words[1:], 3, words[0])
    if words[0] == "MV":
        reader.goto(target)
    else:
        reader.touch(target, reader.from_here(target, "MS"))
    return False
