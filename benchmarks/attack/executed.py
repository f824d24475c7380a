"""What a controller executes of a text: not remarks and literals, nor what stands behind the end.

Written from the manuals, without any code of the package. Whether a construct is harmless at its place follows from
this alone: it is, where the controller executes the same with it as without it, or where nothing uses what it sets.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Syntax:
    """What a controller passes over.

    ``remark``, ``literal``: patterns within a line; ``active``: remarks that are commands; ``anywhere``: characters
    that are taken out of the stream before anything else sees them; ``end``: pattern of the line behind which nothing
    is executed (None: everything is), but for what stands behind a label that is jumped to (``label``, ``jump``:
    patterns with the name in a group), up to a line that ends as ``end`` or ``stop`` says; ``leader``: what a text
    begins with is executed only from such a line on; ``file_end``: behind it stands nothing; ``reset``: a line whose
    effect the end takes back, where no move follows; ``settings``: lines that set what every program sets anew, and
    what uses it (no harm where nothing of that follows).
    """

    remark: str = r"(?!)"
    literal: str = r"(?!)"
    active: str = r"(?!)"
    anywhere: str = r"(?!)"
    end: str | None = None
    stop: str = r"(?!)"
    label: str = r"(?!)"
    jump: str = r"(?!)"
    leader: str | None = None
    file_end: str | None = None
    reset: str = r"(?!)"
    settings: Mapping[str, str] = field(default_factory=dict)


_RESET = r"(?:G(?:1[789]|2[01]|49|5[4-9](?:\.[123])?|50\d|500|6[014]|70|71|700|710|9[0134]) *)+\n *(?:M0*2|M30|M121)\b"
"""Plane, units, offset, mode: nothing moves any more, and the end or the next program sets them."""
_MACRO_B = Syntax(
    remark=r"\([^()\n;%]*\)",
    end=r"(?:N\d+ *)?M(?:30|02|2|99)\b",
    stop=r".*#3000 *=",
    label=r"N(\d+)",
    jump=r"GOTO *(\d+)",
    leader="%",
    reset=_RESET,
)
SYNTAX = {
    "fanuc": _MACRO_B,
    "haas": _MACRO_B,
    "mazak": _MACRO_B,
    "mitsubishi": _MACRO_B,
    "siemens": Syntax(
        remark=r";[^\n]*",
        literal=r'"[^"\n]*"',
        end=r"(?:\w+: *)?(?:M30|M2|M17)\s*$",
        label=r"(\w+):",
        jump=r"GOTO[FB]? +(\w+)",
        reset=_RESET,
    ),
    "heidenhain": Syntax(
        remark=r";[^\n]*",
        literal=r'"[^"\n]*"|(?<=F-PRINT )\S+ / \S+',
        end=r"M30\s*$|END PGM",
        label=r'LBL "?(\w+)"?',
        jump=r'GOTO LBL "?(\w+)"?',
        file_end=r"END PGM",
    ),
    "linuxcnc": Syntax(
        remark=r"\([^()\n]*\)|;[^\n]*",
        active=r"(?i)[(;]\s*(?:LOG|LOGOPEN|LOGAPPEND|LOGCLOSE|PROBEOPEN|PROBECLOSE|PY|ABORT)\s*[,) ]",
        end=r"(?i)\s*(?:M0*2|M30|%)\b",
        reset=_RESET,
    ),
    "grbl": Syntax(remark=r"\([^()\n]*\)|;[^\n]*", anywhere=r"[!~?\x18\x80-\xff]", reset=_RESET),
    "rrf": Syntax(remark=r";[^\n]*", literal=r'"[^"\n]*"', reset=_RESET),
    "dmis": Syntax(
        remark=r"\$\$[^\n]*",
        literal=r"'[^'\n]*'|DID\(\w+\)",
        end=r"ENDFIL",
        settings={
            r"SNSET/(?:APPRCH|SEARCH|RETRCT),|FEDRAT/MESVEL": r"PTMEAS/",
            r"FEDRAT/POSVEL|MODE/|UNITS/|SNSLCT/|S\(\w+\)=SNSDEF|PRCOMP/": r"GOTO/|PTMEAS/",
        },
    ),
    "ippdme": Syntax(
        literal=r'"[^"\n]*"',
        end=r":\s*$",
        settings={
            r"SetProp\(Tool\.PtMeasPar": r"\d+ PtMeas",
            r"SetProp\(Tool\.GoToPar|EndSession\(\)": r"\d+ (?:GoTo|PtMeas)",
        },
    ),
    "jinyoung": Syntax(end=r"END\s*;"),
}


def executed(text: str, dialect: str) -> list[bool]:
    """For every character whether the controller executes it."""
    known = SYNTAX[dialect]
    mask: list[bool] = []
    for line, runs in zip(text.splitlines(keepends=True), _reached(text, known), strict=True):
        mask += _of_line(line, known) if runs else [False] * len(line)
    return mask


def _of_line(line: str, known: Syntax) -> list[bool]:
    mask = [not sign.isspace() for sign in line]
    for match in re.finditer(f"{known.literal}|{known.remark}", line):
        if not re.match(known.active, match[0]):
            mask[match.start() : match.end()] = [False] * len(match[0])
    for match in re.finditer(known.anywhere, line):
        mask[match.start()] = True
    return mask


def _reached(text: str, known: Syntax) -> list[bool]:
    """Line by line whether the controller can come there."""
    bare = [re.sub(f"{known.literal}|{known.remark}", "", line) for line in text.splitlines()]
    targets = set(re.findall(known.jump, text))
    runs, closed, reached = known.leader is None, False, []
    for raw, line in zip(text.splitlines(), bare, strict=True):
        label = re.match(known.label, raw)
        runs = runs or (known.leader is not None and not any(reached) and raw.startswith(known.leader))
        runs = (runs or (label is not None and label[1] in targets)) and not closed
        reached.append(runs)
        ends = known.end is not None and re.match(known.end, line) is not None
        runs = runs and not ends and re.match(known.stop, line) is None
        closed = closed or (known.file_end is not None and re.match(known.file_end, line) is not None)
    return reached


def run_by(text: str, dialect: str) -> str:
    """All that a controller executes of a text, in its order, without blanks."""
    return "".join(sign for sign, runs in zip(text, executed(text, dialect), strict=True) if runs)


_SUBJECT = re.compile(r"SetProp\([\w.]+|[A-Z]+/(?:[A-Z]+,)?")
"""What a setting is about: the statement without its values."""


def _takes_no_effect(text: str, start: int, end: int, dialect: str) -> bool:
    """Whether what a construct sets is set again, or the program ends, before anything uses it; or was said before."""
    known, put_in = SYNTAX[dialect], text[start:end]
    if re.match(known.reset, text[start:]):
        return True
    subject = _SUBJECT.match(put_in)
    for setting, uses in known.settings.items():
        if all(re.match(setting, line) for line in put_in.splitlines()):
            unused = re.split(rf"(?m)^(?:{uses})", text[end:])[0]
            if len(unused) == len(text[end:]) or (subject is not None and subject[0] in unused):
                return True
    head = re.split(r"(?m)^(?:\d+ GoTo|GOTO/)", text)[0]
    said = re.search(rf"(?m)^(?:\d+ )?{re.escape(put_in)}$", text[:start])
    return bool(known.settings) and end < len(head) and said is not None


def is_harmless(before: str, after: str, start: int, end: int, dialect: str) -> bool:
    """Whether the controller does with ``after`` what it does with ``before``, where ``start:end`` was put in.

    What a construct hides counts as well as what it does.
    """
    return run_by(before, dialect) == run_by(after, dialect) or _takes_no_effect(after, start, end, dialect)
