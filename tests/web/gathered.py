"""The messages that a page may show, gathered from the code: every text that is given to an error, a question, a
condition, a note, a warning; a gap ``{}`` for what is filled in.
"""

from __future__ import annotations

import ast
import html
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import stepgauge
from stepgauge.languages.messages import read_german, texts

ROOT = Path(stepgauge.__file__).parent
NO_PAGE = {
    *("cli", "fleet", "ippdme", "demonstration", "executors", "investigation", "exporting", "compensation"),
    *("dialects", "verbs", "standards/iso", "standards/drift", "standards/position", "standards/length"),
    *("live/linuxcnc", "live/server", "probes/bench", "probes/qualification", "probes/compensation", "physics"),
    *("effects/loading", "effects/empirical", "dcc/write", "dcc/xml", "programs/options", "files/sandbox"),
}
"""Rooms, and files by their beginning, that no page leads to: verbs and options of the command line alone."""
TEXTS: dict[str, tuple[int | str, ...]] = {
    "ValueError": (0,),
    "Error": (1, "found", "expected"),
    "ask": (1, "found"),
    "Choice": (2, "words"),
    "take": (0,),
    "reject": (0, 1),
    "Conflict": (1, 2, 3, 4),
    "_refused": (3, 4, 5),
    "Condition": (2, 3, 4, "found", "expected"),
    "Alert": (5,),
    "naming": ("words",),
}
"""Arguments that are texts, by the end of a function's name."""
TALKING = (
    *("alignment/", "conditions/", "evaluation/", "history/", "importing/"),
    *("correspondence/", "project/status", "recording/"),
    *("diagnosis/design", "diagnosis/further_runs"),
)
"""Rooms whose every string of two words or more is one that a page may show."""
OF_FILES = ("machine/file", "probes/schema", "reports/certificate_file")
"""Tables of files that forms of the page write: what contradicts itself in them is told as a ``ValueError``."""
MUTE = ("importing/vocabulary.py", "importing/tables/vocabulary.py", "labels.py", "history/store.py", "makes.py")
"""Files of words that are looked for, not said."""
NO_WORDS = re.compile(r"[\\|^$]|\(\?|%[A-Z]|^stepgauge \w+ 1$")


def gathered() -> dict[str, set[str]]:
    """Every text with the files that it is in."""
    found: dict[str, set[str]] = {}
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if not name.startswith(tuple(NO_PAGE)):
            tree = ast.parse(path.read_text("utf-8"))
            talks = name.startswith(TALKING) and not name.endswith(MUTE)
            for text in (*_texts(tree, name.startswith(OF_FILES)), *(_sentences(tree) if talks else ())):
                if has_words(text):
                    found.setdefault(text, set()).add(name)
    return found


def has_words(text: str) -> bool:
    """Whether there is anything to translate beside gaps and signs."""
    return sum(map(str.isalpha, text.replace("{}", ""))) > 3


def _texts(tree: ast.Module, says_values: bool) -> Iterator[str]:
    known = _assigned(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            wanted = next((places for end, places in TEXTS.items() if name.endswith(end)), ())
            if name in ("TypeError", "KeyError") or (name == "ValueError" and not says_values):
                continue
            for place in wanted:
                if isinstance(place, int):
                    given = node.args[place : place + 1]
                else:
                    given = [one.value for one in node.keywords if one.arg == place]
                for one in given:
                    yield from _templates(one, known)


def _sentences(tree: ast.Module) -> Iterator[str]:
    """Every string of two words or more that is no docstring and no pattern."""
    docs = {id(one.value) for one in ast.walk(tree) if isinstance(one, ast.Expr)}
    parts = {id(one) for whole in ast.walk(tree) if isinstance(whole, ast.JoinedStr) for one in whole.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and id(node) not in docs | parts):
            for text in _templates(node, {}, 0):
                if re.search(r"[a-z]{2}.* .*[a-z]{2}|[a-z]{3} | [a-z]{3}", text) and not NO_WORDS.search(text):
                    yield text


def _assigned(tree: ast.Module) -> dict[str, list[ast.expr]]:
    """What names stand for: assignments, and what functions of this module return."""
    known: dict[str, list[ast.expr]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    known.setdefault(target.id, []).append(node.value)
                elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    for one, value in zip(target.elts, node.value.elts, strict=False):
                        known.setdefault(getattr(one, "id", ""), []).append(value)
        elif isinstance(node, ast.FunctionDef):
            returned = [one.value for one in ast.walk(node) if isinstance(one, ast.Return | ast.Yield) and one.value]
            known.setdefault(f"{node.name}()", []).extend(returned)
    return known


def _templates(node: ast.expr, known: dict[str, list[ast.expr]], deep: int = 3) -> Iterator[str]:
    """The texts that an expression may be; names are followed ``deep`` steps."""
    if isinstance(node, ast.Constant):
        yield from (node.value,) if isinstance(node.value, str) else ()
    elif isinstance(node, ast.JoinedStr):
        yield "".join(str(one.value) if isinstance(one, ast.Constant) else "{}" for one in node.values)
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        yield from (a + b for a in _templates(node.left, known) for b in _templates(node.right, known))
    if not isinstance(node, ast.BinOp):
        named = _named(node)
        for one in known.get(named, ()) if named and deep > 0 else _inside(node):
            yield from _templates(one, known, deep - 1 if named or isinstance(node, ast.JoinedStr) else deep)


def _named(node: ast.expr) -> str:
    """The name that an expression is, or the function that it calls."""
    if isinstance(node, ast.Call):
        return f"{node.func.id}()" if isinstance(node.func, ast.Name) else ""
    return node.id if isinstance(node, ast.Name) else ""


def _inside(node: ast.expr) -> list[ast.expr]:
    """The parts of an expression that it may be, or that fill a gap of it."""
    if isinstance(node, ast.JoinedStr):
        return [one.value for one in node.values if isinstance(one, ast.FormattedValue)]
    if isinstance(node, ast.IfExp):
        return [node.body, node.orelse]
    if isinstance(node, ast.Subscript):
        return [node.value]
    if isinstance(node, ast.BoolOp | ast.Dict):
        return list(node.values)
    return list(node.elts) if isinstance(node, ast.Tuple | ast.List) else []


_KEYS = re.compile(r"'[^']*'|\"[^\"]*\"|„[^“]*“|{\w*}|\S*[_/=\[\]]\S*|--\S+|\S+\.\w{2,4}\b|stepgauge [\w ]+|\S+ ->")
"""What is the same in every language: what somebody wrote, keys, files, options, columns of a table."""
_LETTERS = re.compile(r"[^\W\d_]{2,}")
_OF_MAKERS = {"cnc", "code", "command", "smooth", "one", "write", "and", "log", "cmm", "file"}
"""Words of the names of controllers."""


def _words(text: str) -> set[str]:
    return {word.lower() for word in _LETTERS.findall(_KEYS.sub(" ", text))}


@cache
def _english() -> frozenset[str]:
    """Words that stand in English texts of the program and in no German one."""
    pairs = [*texts().values(), *read_german("messages.toml").items(), *read_german("printed.toml").items()]
    english, german = ({word for pair in pairs for word in _words(pair[place])} for place in (0, 1))
    return frozenset(english - german)


def english_words(text: str, names: bool = False) -> list[str]:
    """Words of a German text of a page that are English; ``names``: where names of controllers stand, too."""
    return sorted(_words(text) & _english() - (_OF_MAKERS if names else set()))


def visible(page: str) -> list[str]:
    """The texts of a page of HTML that a person reads, piece by piece."""
    body = re.sub(r"(?s)<(script|style|code|textarea)\b.*?</\1>|<option value=\"en\".*?</option>", " ", page)
    said = re.findall(r'(?:aria-label|title|placeholder|data-label)="([^"]*)"', body)
    return [html.unescape(one).strip() for one in (*re.split(r"<[^>]+>", body), *said) if one.strip()]
