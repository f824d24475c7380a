"""Sentences of a diagnosis that belong to no effect, in English and in German (``catalogue.toml``, ``words.toml``)."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

from stepgauge.effects.words import Wording

LANGUAGES = ("en", "de")
DECIMAL = re.compile(r"(?<=\d)\.(?=\d)")


@cache
def sentences() -> Mapping[str, Sequence[str]]:
    """Sentences by their keys, in the order of :data:`LANGUAGES`."""
    with Path(__file__).with_name("catalogue.toml").open("rb") as file:
        return tomllib.load(file)


@cache
def words(table: str) -> Mapping[str, Wording]:
    """Words by kind: of a ``finding`` that is no effect, of ``structure`` by its form, of a ``map`` of a probe."""
    with Path(__file__).with_name("words.toml").open("rb") as file:
        every = tomllib.load(file)[table]
    return {kind: replace(Wording(*one["en"]), german=Wording(*one["de"])) for kind, one in every.items()}


def say(key: str, language: str = "en", **values: object) -> str:
    """A sentence in a language, with what stands in braces filled in."""
    text = sentences()[key][LANGUAGES.index(language)]
    if language == "de":
        values = {name: DECIMAL.sub(",", str(value)) for name, value in values.items()}
    return text.format(**values) if values else text


def listed(words: Sequence[str], last: str = "and", language: str = "en") -> str:
    """``a, b and c``."""
    return "".join(words) if len(words) < 2 else f"{', '.join(words[:-1])} {say(last, language)} {words[-1]}"
