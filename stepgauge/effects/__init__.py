"""Systematic effects on the readings of a machine: one vocabulary for the virtual CMM and for the diagnosis.

An effect is one class in a module of this package. Its fields are the parameters (with unit, bounds, role and a
sensible range), and :meth:`Effect.displacement_um` gives the displacement of all probings at once. The module is found
automatically. Modules of another distribution are found by the entry point group ``stepgauge.effects``, a file by its
path (:func:`load_effects`).
"""

from __future__ import annotations

import pkgutil
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from stepgauge.effects.base import Effect, Parameter
from stepgauge.effects.loading import FROM_FILES, added_effects, is_loaded, load_effects
from stepgauge.effects.probings import Probings, Setting
from stepgauge.effects.totals import along_approach_um, total_displacement_um
from stepgauge.errors import InputError
from stepgauge.files.config import check_table

__all__ = [
    "Effect",
    "Parameter",
    "Probings",
    "Setting",
    "added_effects",
    "along_approach_um",
    "effect_kinds",
    "load_effects",
    "make_effects",
    "total_displacement_um",
]


def effect_kinds(every: bool = False) -> dict[str, type[Effect]]:
    """Effect classes by their kind: those of this package, of installed extensions and of the running program.

    ``every``: also those that only the virtual CMM uses and the diagnosis does not seek.
    """
    _import_modules()
    known = (effect for effect in _subclasses(Effect) if effect.kind and (every or effect.sought))
    return {one.kind: one for one in known if not one.__module__.startswith(FROM_FILES) or is_loaded(one)}


@cache
def _import_modules() -> None:
    for module in pkgutil.iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    for extension in entry_points(group="stepgauge.effects"):
        extension.load()


def _subclasses(parent: type[Effect]) -> Iterable[type[Effect]]:
    for child in parent.__subclasses__():
        yield child
        yield from _subclasses(child)


def make_effects(tables: Iterable[Mapping[str, Any]], where: str | Path) -> list[Effect]:
    """Effects from the ``[[effect]]`` tables of a machine file (:class:`InputError` names the table and the key)."""
    return [_make(dict(table), where, f"effect[{number}]") for number, table in enumerate(tables, 1)]


def _make(table: dict[str, Any], where: str | Path, key: str) -> Effect:
    kind = table.pop("kind", None)
    kinds = effect_kinds(every=True)
    if kind not in kinds:
        raise InputError(
            where, f"key {key}.kind is not a known effect", found=repr(kind), expected=", ".join(sorted(kinds))
        )
    return check_table(kinds[kind], table, where, key).prepared(where)
