"""What a budget was made with: what gauge, machine and placements state, compared with the files of a certificate.

The same name or serial number does not make the same file. Compared is what the files state, key by key: comments, the
order of the keys and where a file lies do not count.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError
from stepgauge.files.checksum import file_digest
from stepgauge.files.config import parse_toml
from stepgauge.files.text import read_bytes
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, format_placement
from stepgauge.machine.file import NAMED_FILES, Machine

SAME_SHARE = 1e-9
"""Of a number that was written and read again."""
SAME_PLACEMENT = 1e-6
"""Numbers of a placement are written to 1e-7 mm: mm, um, urad and parts of unit vectors."""


def stated_with(gauge: Gauge, machine: Machine, placements: Sequence[Placement]) -> dict[str, Any]:
    """What the files of a budget state, as JSON types, by the kind of file."""
    return {
        "gauge": stated_gauge(gauge),
        "machine": stated_machine(machine),
        "placements": [stated_placement(one) for one in placements],
    }


def stated_gauge(gauge: Gauge) -> dict[str, Any]:
    """What the files of a gauge state, however the table of its faces is called."""
    stated = gauge.to_dict()
    stated["gauge"].pop("faces")
    return stated


def stated_machine(machine: Machine) -> dict[str, Any]:
    """The tables of a machine file and of its probe, with every standard uncertainty beside its value.

    Without its limit: that is what a result is judged by, and no result depends on it.
    """
    own, probe = Path(machine.path).parent, Path(machine.probe_path or machine.path).parent
    return {
        "machine": machine.table.model_dump(mode="json", exclude={"mpe"}),
        "probe": _embed_tables(machine.probe.model_dump(mode="json"), probe),
        "effect": [_embed_tables(one, own) for one in machine.effects],
        "uncertainty": machine.stated.model_dump(mode="json"),
        "contribution": [one.model_dump(mode="json") for one in machine.contributions],
        **{f"{u.key}.{name}": getattr(u, name) for u in machine.uncertain for name in ("u", "distribution", "dof")},
    }


def stated_placement(placement: Placement) -> dict[str, Any]:
    """What a placement file states."""
    return parse_toml(format_placement(placement), "placement")


def _embed_tables(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A table, with the checksum of each file that it names instead of the name: its content counts."""
    named = {key: folder / table[key] for key in NAMED_FILES if isinstance(table.get(key), str)}
    there = {key: path for key, path in named.items() if path.is_file()}
    return {**table, **{key: f"sha256 {file_digest(read_bytes(path))}" for key, path in there.items()}}


def check_given(
    given: dict[str, Any] | None,
    path: str | Path,
    gauge: Gauge | None = None,
    machine: Machine | None = None,
    placements: Sequence[tuple[Placement, str]] = (),
) -> None:
    """:class:`InputError` where a file states something else than the one that a budget was made with.

    ``given``: as :func:`stated_with` made it, None for a budget of an earlier version; ``path``: of the budget;
    ``placements``: each with its file.
    """
    if given is None and (gauge or machine or placements):
        what = "this budget does not tell what its files stated, for an earlier version wrote it"
        raise InputError(path, what, expected="the budget made again")
    given = given or {}
    if gauge is not None:
        _check_same(gauge.path, stated_gauge(gauge), given["gauge"], path)
    if machine is not None:
        _check_same(machine.path, stated_machine(machine), given["machine"], path)
    # a budget without placements says itself that the alignment is not in it
    for (one, file), stored in zip(placements, given.get("placements", ()), strict=False):
        _check_same(file, stated_placement(one), stored, path, SAME_PLACEMENT)


def _check_same(
    file: str, stated: dict[str, Any], stored: dict[str, Any], budget: str | Path, smallest: float = 0.0
) -> None:
    """:class:`InputError` that names the first key by which a file is not the one that the budget was made with."""
    found, expected = dict(_leaves(stated)), dict(_leaves(stored))
    for key in {**expected, **found}:
        if not _same(found.get(key), expected.get(key), smallest):
            what = f"not the file of the budget ({budget}): key {key}"
            raise InputError(file, what, found=_said(found.get(key)), expected=_said(expected.get(key)))


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Every single value by its dotted key; what is not stated is no value."""
    if isinstance(value, dict):
        for name, one in value.items():
            yield from _leaves(one, f"{key}.{name}" if key else name)
    elif isinstance(value, list | tuple):
        for number, one in enumerate(value, 1):
            yield from _leaves(one, f"{key}[{number}]")
    elif value is not None:
        yield key, value


def _same(found: Any, expected: Any, smallest: float) -> bool:
    numbers = [one for one in (found, expected) if isinstance(one, int | float) and not isinstance(one, bool)]
    if len(numbers) == 2:
        return math.isclose(*numbers, rel_tol=SAME_SHARE, abs_tol=smallest)
    return bool(found == expected)


def _said(value: Any) -> str:
    return "not stated" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)
