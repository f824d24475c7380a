"""Every text of the pages in its languages, from one catalogue (``texts.toml``)."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from functools import cache
from itertools import takewhile
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, Naming, one_line, option_of
from stepgauge.files.notation import MINUS, printed_unit
from stepgauge.languages.messages import LANGUAGES, print_units, said_in_german, texts, translate_message

if TYPE_CHECKING:
    from stepgauge.importing.tables.questions import Question, QuestionAnswer

PASTED = "table.txt"
"""How readers call what was pasted."""
_OFFER = re.compile(r" \(\{\} [^)]*\)")
_HINT = re.compile(r"; | \(")
_ROW_OF = re.compile(r":\d+$")
_UP = re.compile(r"(?:\.\./)+")
_OPTION = re.compile(r"--([a-z][a-z0-9-]*)")
_WITHOUT = re.compile(r"--without [a-z_]+(?: --without [a-z_]+)*")
"""Causes that a diagnosis is to be made without: the page has a button at each."""
_STATED = re.compile(
    r"\b([a-z]\w*) = (\"[^\"]*\"(?: (?:or|oder) \"[^\"]*\")*|\[[^\]]*\]|[^\s,;()]+) (?:in|unter) \[{1,2}\w+\]{1,2}"
)
"""A line of a file, with its table."""
_TABLE = re.compile(
    r"(?:\b[Tt]ab(?:le|elle) )?\[{1,2}([a-z]+)\]{1,2}( (?=[a-z]+_[a-z]))?|\b[Tt]ab(?:le|elle) ([a-z]+)(?= is\b| ist\b)"
)
_OF_TABLE = re.compile(r"\b(?:[Tt]ab(?:le|elle)|[Kk]ey|Schlüssel) \[{0,2}([a-z]+)")
"""The table that a message is about: the same key has another field in each."""
_NOT_OF_A_PAGE = re.compile(r" \(the command below\)|,? (?:and another file|und eine andere Datei)\b")
"""What only somebody at the command line can do."""
_KEY = re.compile(
    r"(?<![\w./'\"=\[-])(?:(?:machine|probe|gauge|certificate|uncertainty|conditions|item|laboratory|customer|method"
    r"|person|statements)\.([a-z]\w*)(?:\.u\b)?|([a-z]+(?:_[A-Za-z]+)+))"
    r"(?![\w/'\"=\]]|\.\w)"
)
_COMMAND = re.compile(r"'?\bstepgauge ([a-z]+)\b(?: (?:[A-Z]{2,}|-{1,2}[a-z][\w-]*|[\w/.-]+\.[a-z]{2,4}))*'?")
_PAGES = {"evaluate": "result", "budget": "result", "diagnose": "diagnosis", "simulate": "run", "import": "importing"}
"""Pages by the verbs that they do, where their names differ."""


def _plain(name: str) -> str:
    """An argument or key as its option is called, without its unit."""
    return option_of(name).removeprefix("--").replace("-", "_")


@cache
def _verbs() -> frozenset[str]:
    """The first words of commands."""
    from stepgauge.verbs.catalogue import VERBS

    return frozenset(name.partition(" ")[0] for name in VERBS)


def best_language(accepted: str) -> str:
    """The language of a header ``Accept-Language``: the first that is known, else English."""
    wished = [one.partition(";")[0].strip().lower()[:2] for one in accepted.split(",")]
    return next((one for one in wished if one in LANGUAGES), "en")


class Words:
    """The texts in one language: ``words("run.left", minutes="3")``."""

    def __init__(self, language: str) -> None:
        self.language = language if language in LANGUAGES else "en"
        self._place = list(LANGUAGES).index(self.language)

    def __call__(self, key: str, **values: Any) -> str:
        """A text, with what stands in braces filled in; numbers are given as text, by :meth:`number`."""
        text = texts()[key][self._place]
        return text.format(**values) if values else text

    def has(self, key: str) -> bool:
        """Whether the catalogue has a text."""
        return key in texts()

    def label(self, name: str, with_part: bool = True) -> str:
        """What a field is called on the page: an argument or a key of a file, with its unit or without.

        ``with_part``: with the part of the form that it is in, where a form has several.
        """
        table, dot, key = name.partition(".")
        if dot and self.has(f"certificate_part.{table}"):
            own = self.label(f"{table}_{key}" if self.has(f"field.{table}_{key}") else key)
            return f"{self(f'certificate_part.{table}')} – {own}" if with_part else own
        plain = _plain(name)
        keys = (f"field.{name}", f"field.{plain}", f"wrong.{name}", f"quantity.{name}", f"nav.{name}")
        return self._first(keys) or plain.replace("_", " ")

    def hint(self, name: str) -> str:
        """Where a person finds what a field asks for; nothing where that is plain."""
        table, _, key = name.rpartition(".")
        return self._first((f"hint.{table}_{key}", f"hint.{key}", f"hint.{_plain(key)}"))

    def _first(self, keys: Iterable[str]) -> str:
        """The first of these texts that there is."""
        return next((self(one) for one in keys if self.has(one)), "")

    def effect(self, label: str) -> str:
        """An effect by its kind, or by its label, which has its choices behind the kind: ``scale_error_x``."""
        from stepgauge.diagnosis.wording.findings import name_of

        return name_of(label, language=self.language)

    def unit(self, unit: str) -> str:
        """A unit as it is set in print, or by its name."""
        return self(f"choice_unit.{unit}") if self.has(f"choice_unit.{unit}") else printed_unit(unit)

    def choice(self, field: str, key: str) -> str:
        """What a choice of a field is called."""
        return self(f"choice_{field}.{key}") if self.has(f"choice_{field}.{key}") else key.replace("_", " ")

    def said(self, error: InputError) -> str:
        """What is wrong, in one line, with the fields of the page in place of arguments."""
        where, what, found, _ = (None if one is None else str(one) for one in error.named(self._short_label))
        asked = [self.way(one) for question in getattr(error, "questions", ()) for one in question.choices]
        parts = (what, found, None if asked else self._without_offers(error.parts[3]))
        what, found, expected = (None if one is None else self._translated(str(one)) for one in parts)
        expected = f" {self.message('or')} ".join(asked) or expected
        said = f"{self._located(where)}: {what}" if where else str(what)
        more = [(self("page.found"), found), (self("page.expected"), expected)]
        whole = "; ".join([said, *(f"{word} {text}" for word, text in more if text is not None)])
        return one_line(self.plain(whole), error.longest)

    def _short_label(self, name: str) -> str:
        """What a field is called in a sentence, without the hint behind it."""
        return _HINT.split(self.label(name), maxsplit=1)[0]

    def _without_offers(self, expected: Any) -> str | None:
        """What was expected, with the fields of the page, without the answers that stand there as choices."""
        if not isinstance(expected, Naming):
            return None if expected is None else str(expected)
        words = _OFFER.sub("", expected.words)
        return Naming(expected.names[: words.count("{}")], words).named(self._short_label)

    def _located(self, where: str) -> str:
        """A place with its row as one says it; what was pasted or uploaded is the table of the page."""
        file, _, row = where.rpartition(":") if _ROW_OF.search(where) else (where, "", "")
        file = file.removesuffix(".txt") if file == PASTED else file
        named = self.label(file) if self.has(f"wrong.{file}") or self.has(f"field.{file}") else file
        return self("page.row", place=named, row=row) if row else named

    def message(self, text: str) -> str:
        """What the program says of its own accord, with the fields of the page in place of options."""
        return self.plain(self._translated(text))

    def _translated(self, text: str) -> str:
        return translate_message(text) if self.language == "de" else text

    def asked(self, question: Question) -> str:
        """What an import leaves open; what was found stands as it is in the file."""
        what = question.what.named(self.label) if isinstance(question.what, Naming) else question.what
        if question.expected is None:
            found = question.found or ""
            told = self._translated(found) if re.match(r"-?\d", found) else found  # else a header, as it was written
            return self.message(what) + (f": {told}" if told else "")
        error = InputError("", what, found=question.found, expected=question.expected)
        return self.said(error)

    def way(self, choice: QuestionAnswer) -> str:
        """What a choice of an import means, in its own words or with the field that it fills in."""
        label, (role, equals, header) = self._short_label(choice.argument), choice.value.partition("=")
        if choice.words or not choice.value:
            return self.message(choice.words) or label
        if equals and choice.argument == "columns":
            return f"{label} '{header}': {self.choice('taken', role)}"
        return f"{label}: {self.choice(choice.argument, choice.value) if choice.value.isidentifier() else choice.value}"

    def ended(self, line: str) -> str:
        """The last line of a verb that failed."""
        return self.plain(said_in_german(line) if self.language == "de" else line)

    def plain(self, text: str) -> str:
        """A text of the program for somebody who sees fields and pages: no command, option, key or way up a folder."""
        text = _UP.sub("", text.removeprefix("stepgauge: error: ")).replace(f"{os.getcwd()}/", "")
        text = _WITHOUT.sub(self._without, text)
        text = _STATED.sub(self._stated, _NOT_OF_A_PAGE.sub("", text))
        tables = _OF_TABLE.findall(text)
        text = _TABLE.sub(self._part_of, text)
        text = _COMMAND.sub(self._page_of, text)
        text = _OPTION.sub(lambda found: self._short_label(found[1].replace("-", "_")), text)
        return MINUS.sub("−", print_units(_KEY.sub(lambda found: self._field_of(found, tables), text)))

    def _without(self, options: re.Match[str]) -> str:
        """The button at the causes that are left out."""
        causes = [self.effect(kind) for kind in options[0].split()[1::2]]
        return self("diagnosis.without_causes", button=self("diagnosis.without"), causes=", ".join(causes))

    def _stated(self, line: re.Match[str]) -> str:
        """A field of the page with what it is to have, for a line of a file."""
        field = self._short_label(line[1])
        return (
            self("page.ticked", field=field) if line[2] == "true" else f"{self('page.field', field=field)}: {line[2]}"
        )

    def _part_of(self, table: re.Match[str]) -> str:
        """The part of a form for a table of a file; nothing before the name of a key, which has its own."""
        if table[2]:
            return ""
        name = table[1] or table[3]
        key = next((key for key in (f"certificate_part.{name}", f"nav.{name}") if self.has(key)), "")
        return self("page.field", field=self(key)) if key else table[0]

    def _field_of(self, key: re.Match[str], tables: Iterable[str]) -> str:
        """The field of the page for a key of a file, in one of the tables; the key where there is none."""
        name = key[1] or key[2]
        name = next((one for one in (f"{table}_{name}" for table in tables) if self.has(f"field.{one}")), name)
        if key[0].startswith("uncertainty.") and self.has(f"field.{_plain(f'u_{name}')}"):
            name = f"u_{name}"
        known = self.has(f"field.{name}") or self.has(f"field.{_plain(name)}")
        return self("page.field", field=self._short_label(name)) if known else key[0]

    def _page_of(self, command: re.Match[str]) -> str:
        """The page on which a command is done; the words themselves where there is none, or this is no command."""
        if command[1] not in _verbs():
            return command[0]
        operands = [*takewhile(lambda word: not word.startswith("-"), command[0].strip("'").split()[2:])]
        laid_over = command[1] == "report" and len(operands) > 1
        key = f"nav.{'result' if laid_over else _PAGES.get(command[1], command[1])}"
        return self("page.page", page=self(key)) if self.has(key) else command[0]

    @staticmethod
    def keys(text: str) -> set[str]:
        """The keys of files and the options that a text of the program names, but those of a table with own fields."""
        tables = _OF_TABLE.findall(text)
        named = {one or other for one, other in _KEY.findall(text)}
        return {
            *(one for one in named if not any(f"field.{table}_{one}" in texts() for table in tables)),
            *(one.replace("-", "_") for one in _OPTION.findall(text)),
        }

    @staticmethod
    def moment(text: str) -> str:
        """A date, or a date with its time to the minute, from ISO 8601: ``2026-11-29 06:00 UTC``."""
        day, _, time = text.partition("T")
        zone = " UTC" if time.endswith(("+00:00", "Z")) else ""
        return f"{day} {time[:5]}{zone}" if time else day

    def decimal(self, text: str) -> str:
        """A number that is text already, with the decimal mark of the language."""
        return text.replace(".", ",") if self.language == "de" else text

    def direction(self, text: str) -> str:
        """An axis by its letter, or by its components as ``(0.71 -0.70 0.00)``, as the language writes them."""
        return self.decimal("; ".join(text.split())).replace("-", "−")

    def number(self, value: float | None, digits: int = 2) -> str:
        """A number with that many decimals, as the language writes it; a dash for none."""
        if value is None or value != value:
            return "–"
        text = f"{round(value, digits) + 0.0:,.{digits}f}".replace("-", "−")
        thin = text.replace(",", "\u202f")
        return thin.replace(".", ",") if self.language == "de" else thin
