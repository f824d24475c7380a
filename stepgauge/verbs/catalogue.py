"""Which verbs there are, by task, and where the function of each is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module

from stepgauge.verbs.define import Verb, verb_of

PLACES: Mapping[str, str] = {
    "evaluate": "evaluate.evaluate",
    "locate": "locate.locate",
}
"""The words of each verb, and its module and function in this room."""


def find_verb(words: str) -> Verb:
    """The definition of a verb by its words, ``"evaluate"`` or ``"probe map"``."""
    module, _, function = PLACES[words].rpartition(".")
    return verb_of(getattr(import_module(f"stepgauge.verbs.{module}"), function))


def all_verbs() -> Iterator[tuple[str, Verb]]:
    """Every verb with its words."""
    return ((words, find_verb(words)) for words in PLACES)
