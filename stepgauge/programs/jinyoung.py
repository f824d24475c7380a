"""The Jin Young CNC code of Pahk & Kim (Fig 4): ``MV`` moves, ``MS`` measures, ``PO 1`` opens a point.

``MS`` takes the tip centre at nominal contact; its direction is the line from the position before. The text carries no
settings: search, speeds and tip are the controller's. What it writes down is not published: there is no log.
"""

from __future__ import annotations

import re
from typing import ClassVar

from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import Dialect
from stepgauge.programs.execution import VirtualController
from stepgauge.programs.grammar import ENDS, LAST, QUIET, DialectGrammar, Production

SOURCE = "Pahk and Kim, Fig 4"
TABLE = DialectGrammar(
    "jinyoung",
    forms=(
        Production("go", "MV {number} {number} {number} ;", "move", SOURCE),
        Production("measure", "MS {number} {number} {number} ;", "measures: the tip centre at nominal contact", SOURCE),
        Production("nothing", "PO 1 ;", "opens a point", SOURCE, QUIET),
        Production("end", "END ;", "end of the program", SOURCE, ENDS, LAST),
    ),
    any_case=False,
    last="end",
)


def recognises(text: str) -> bool:
    """Whether the first statement is one of this dialect's."""
    return re.match(r"\s*(MV\s+[-\d.]|PO\s+\d)", text) is not None


class JinYoung(VirtualController):
    """The controller between statements."""

    table: ClassVar[DialectGrammar] = TABLE

    def go(self, block: Block) -> None:
        """A move of the tip centre."""
        self.reader.goto([float(value) for value in block.fields])

    def measure(self, block: Block) -> None:
        """A search along the line from the position before."""
        target = [float(value) for value in block.fields]
        self.reader.touch(target, self.reader.direction_to(target, "MS"))

    end = VirtualController.nothing


DIALECTS = (
    Dialect(
        "jinyoung", "Jin Young CNC CMM (Pahk & Kim, Fig 4)", ".jyc", JinYoung, recognises, 3, (), log_decimals=None
    ),
)
