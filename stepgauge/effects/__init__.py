"""What bends the readings of a machine: one vocabulary for the virtual CMM and for the diagnosis.

An effect is one class in a module of this package. Its fields are the parameters (with unit, bounds and a sensible
range), and :meth:`Effect.displacement_um` gives the displacement of all probings at once. The module is found by
itself. Modules of another distribution are found by the entry point group ``stepgauge.effects``.
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
from stepgauge.effects.probings import Probings, Setting
from stepgauge.effects.totals import along_approach_um, total_displacement_um
from stepgauge.errors import InputError
from stepgauge.files.config import check_table

__all__ = [
    "Effect",
    "Parameter",
    "Probings",
    "Setting",
    "along_approach_um",
    "effect_kinds",
    "make_effects",
    "total_displacement_um",
]


def effect_kinds(every: bool = False) -> dict[str, type[Effect]]:
    """Effect classes by their kind: those of this package, of installed extensions and of the running program.

    ``every``: also those that the virtual CMM can switch on and no diagnosis looks for.
    """
    _import_modules()
    return {effect.kind: effect for effect in _subclasses(Effect) if effect.kind and (every or effect.sought)}


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
