"""Columns of a table: what each is by its name, its unit, and cycle and direction in its name.

One vocabulary (:mod:`.vocabulary`) and two recipes of what is wanted: :data:`AXIS` (targets and readings of one axis,
one spot, distances) and :data:`POINTS` (coordinates and directions). Names are hypotheses; :mod:`.rivals` compares them
with one another and with the numbers. A choice by hand (``--column``) goes before, and removes its rivals.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from fnmatch import fnmatchcase

from stepgauge.errors import InputError, naming
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.tables.vocabulary import (
    LABEL,
    MEASURE,
    WORDS,
    Label,
    parse_label,
    says,
    signs_of,
    split_name,
    words_of,
)  # fmt: skip
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION


class Role(StrEnum):
    """What a column of one axis is; the roles of points are the columns of a recording."""

    TARGET = "target"
    READING = "reading"
    DEVIATION = "deviation"
    CORRECTION = "correction"
    UNSIGNED = "deviation of unknown sign"
    VALUES = "values"
    """Columns of cycles that are not named as readings or as deviations: their size tells."""
    WAY = "way"
    CYCLE = "cycle"
    TIME = "time_s"
    PLACEMENT = "placement"
    FROM = "from"
    TO = "to"
    U_TARGET = "u_target"
    DROPPED = "dropped"
    IGNORE = "ignore"


DEVIATIONS = (Role.DEVIATION, Role.CORRECTION, Role.UNSIGNED)
VALUES = (Role.READING, *DEVIATIONS)
VALUE_ROLES = (*VALUES, Role.VALUES)
NORMAL = ["normal_i", "normal_j", "normal_k"]
DIRECTIONS = (*APPROACH, *NORMAL)
OF_AXIS = tuple(map(Role, ("target", "reading", "deviation", "correction", "way", "from", "to", "u_target")))
"""Roles that ``--column`` may name of one axis alone."""
OF_POINTS = (*POSITION, *APPROACH, *NORMAL, *COUNTS, *OPTIONAL[1:])
ROLES = (*OF_AXIS, *OF_POINTS, Role.IGNORE)
"""What ``--column`` may name."""
QUANTITY = {
    **dict.fromkeys(POSITION, "length"),
    "time_s": "time",
    "speed_mm_s": "speed",
    **{name: "temperature" for name in OPTIONAL if name.endswith("_C")},
}
"""What a role of points must be."""
LONGEST_HEADER = 200
"""Characters of the name of a column; longer ones are text."""
_CALLED = {"direction": Role.WAY, "time": Role.TIME, "run": Role.CYCLE}
_BY_WORD = (Role.FROM, Role.TO, Role.WAY, Role.TIME, Role.CYCLE, Role.PLACEMENT)
"""Roles that a word of their own says."""
_NUMBERED = ("target", "target beside", "reading", "reading beside", "deviation", "way", "cycle")
"""What columns may be that a number and a direction tell apart."""
_LETTERS = {letter: place for place, letters in enumerate(("ix", "jy", "kz")) for letter in letters}
_VECTORS = {**dict.fromkeys(WORDS["approach"], APPROACH), **dict.fromkeys(WORDS["normal"], NORMAL)}


@dataclass(frozen=True)
class Column:
    """``header`` as it stands there, ``name``: without its unit; ``role``: None for a number recorded besides;
    ``label``: cycle and direction, where the name says them; ``sign``: -1 for readings that go against the targets;
    ``forward``: the text of the direction +, where it was told by hand.
    """

    place: int
    header: str
    name: str
    role: str | None
    unit: Unit | None
    label: Label = LABEL
    sign: float = 1.0
    forward: str = ""

    @property
    def called(self) -> str:
        """The header, or ``#3``."""
        return self.header or f"#{self.place + 1}"


def called(one: Column, among: Sequence[Column]) -> str:
    """How a choice names a column: by its header, or by its place where another one has the same."""
    return one.called if sum(other.header == one.header for other in among) == 1 else f"#{one.place + 1}"


Recipe = Callable[[str, "Unit | None"], "str | None"]
"""What a column is by its name and unit, of what is wanted."""


def read_columns(
    headers: Sequence[str], units: Sequence[Unit | None], chosen: Mapping[str, str], recipe: Recipe
) -> list[Column]:
    """The roles of all columns; ``units``: those of a row of units; ``chosen``: headers by role, by hand.

    A choice removes its rivals: what else is named as that role, or as another one of values, is recorded besides.
    Of an axis, columns whose names differ only in a number and a direction are the readings of a wide table, and
    readings named by hand with a minus before the header are taken with the other sign; a text behind the header of
    the directions, as in ``way="Side=A"``, is the direction +.
    """
    columns = []
    chosen, forward = _split_forward(headers, chosen)
    turned = {role: text[1:] for role, text in chosen.items() if role == Role.READING and text.startswith("-")}
    for place, (header, stated) in enumerate(zip(headers, units, strict=True)):
        if len(header) > LONGEST_HEADER:
            columns.append(Column(place, header[:LONGEST_HEADER], header[:LONGEST_HEADER], None, None))
            continue
        whole = recipe is POINTS and point_role(header, None) in DIRECTIONS  # the k of i, j, k is no unit
        name, own = (header.strip(), None) if whole else split_name(header)
        unit = stated or own
        by_hand = _chosen(header, name, place, chosen)
        plain = header.strip() if recipe is POINTS and header.strip() in OF_POINTS else recipe(name, unit)
        role = by_hand or (None if plain in chosen or (recipe is AXIS and _removed(plain, chosen)) else plain)
        sign = 1.0
        if by_hand is None and (against := _chosen(header, name, place, turned)):
            role, sign = against, -1.0
        columns.append(Column(place, header, name, Role.DROPPED if role == Role.IGNORE else role, unit, sign=sign,
                              forward=forward if by_hand == Role.WAY else ""))  # fmt: skip
    return columns if recipe is POINTS else _arcsec_columns(columns, chosen)


def _split_forward(headers: Sequence[str], chosen: Mapping[str, str]) -> tuple[Mapping[str, str], str]:
    """The choices without the text of the direction + behind a header, and that text."""
    header, equals, forward = chosen.get(Role.WAY, "").rpartition("=")
    if not equals or chosen[Role.WAY] in headers:
        return chosen, ""
    return {**chosen, Role.WAY: header}, forward


def parse_columns(given: Mapping[str, str] | str | Sequence[str]) -> dict[str, str]:
    """``("reading=Run *", ..)`` as a mapping; :class:`InputError` for what is no role."""
    found: dict[str, str] = {}
    texts = [f"{name}={header}" for name, header in given.items()] if isinstance(given, Mapping) else given
    for text in (texts,) if isinstance(texts, str) else texts:
        role, equals, header = text.partition("=")
        name = _CALLED.get(role.strip(), role.strip())
        if name in found and name != Role.IGNORE:
            words = 'one HEADER, of several runs one for all as "Run *", or {} with names of the runs'
            what = f"{name} is given twice"
            raise InputError(naming("columns"), what, found=repr(text), expected=naming("header", words=words))
        if not equals or not header.strip() or name not in ROLES:
            expected = f"NAME=HEADER, NAME of {', '.join(ROLES)}"
            raise InputError(naming("columns"), "not understood", found=repr(text), expected=expected)
        found[name] = "\n".join([*([found[name]] if name == Role.IGNORE and name in found else []), header.strip()])
    return found


def check_chosen(columns: Sequence[Column], chosen: Mapping[str, str], path: str) -> None:
    """Every column that is named by hand must be there."""
    for role, header in chosen.items():
        if role != Role.IGNORE and not any(one.role == role for one in columns):
            known = ", ".join(one.header for one in columns if one.header)
            raise InputError(path, f"there is no column {header!r} for {role}", found=known[:200])


def _chosen(header: str, name: str, place: int, chosen: Mapping[str, str]) -> str | None:
    """The role that a column was given by hand: by its header, its name without the unit, ``#3``, or ``Run *``."""
    for role, patterns in chosen.items():
        for pattern in patterns.casefold().split("\n"):
            if pattern in (header.casefold(), name.casefold(), f"#{place + 1}"):
                return role
            if header and fnmatchcase(header.casefold(), pattern.replace("[", "[[]")):
                return role
    return None


def _removed(role: str | None, chosen: Mapping[str, str]) -> bool:
    """Whether a choice stands in the place of a role that a name suggests."""
    return role in VALUES and any(one in chosen for one in VALUES)


# one axis


def axis_role(name: str, unit: Unit | None = None) -> str | None:
    """What a column of one axis is by its name, where its unit allows it."""
    role = _axis_role(name)
    if unit is None or unit.quantity == "none":
        return role
    if unit.quantity in ("length", "angle"):
        return role if role in (Role.TARGET, *VALUE_ROLES, Role.U_TARGET, Role.DROPPED) else None
    return role if unit.quantity == "time" and role == Role.TIME else None


AXIS = axis_role


def _axis_role(name: str) -> str | None:
    words = words_of(name)
    if not words:
        return None
    if words[0] == "u" or says(words, "uncertainty") - {"u"}:
        return Role.U_TARGET if {"target", "nominal", "reference"} & set(words) else Role.DROPPED
    if says(words, "besides"):
        return None
    if words[0] in WORDS["statistic"] and not says(words, "reading", "reading beside"):
        return Role.DROPPED
    for role in _BY_WORD:
        told = says(words, role)
        stations = role in (Role.FROM, Role.TO)
        plain = set(words) <= WORDS[role] | WORDS["station"] if stations else len(words) - len(told) < 2
        if told and (plain or role == Role.WAY):
            return role
    signs = signs_of(name, bool(says(words, Role.DEVIATION)))
    if signs:
        return Role.UNSIGNED if len(signs) > 1 else Role.DEVIATION if 1 in signs else Role.CORRECTION
    of_values = next((one for one in (Role.TARGET, Role.READING) if says(words, one, f"{one} beside")), None)
    return of_values or (Role.DROPPED if set(words) <= WORDS["count"] else None)


def is_known(name: str) -> bool:
    """Whether a name says what is under it: a role, a statistic, or a quantity that is recorded besides."""
    return _axis_role(name) is not None or bool(says(words_of(name), "besides", "face"))


def remainder(name: str) -> frozenset[str]:
    """The words of a name beside those of its role: ``x`` of ``Meas X``, by which it goes with ``Nom X``."""
    known = frozenset().union(*(WORDS[one] for one in (*_NUMBERED, *_BY_WORD, "idle")))
    return frozenset(words_of(name)) - (known - WORDS["place"])


def _arcsec_columns(columns: list[Column], chosen: Mapping[str, str]) -> list[Column]:
    columns = [_labelled(one, chosen) for one in columns]
    columns = _wide(columns)
    if {Role.FROM, Role.TO} <= {one.role for one in columns}:  # a station may be called a target, and is no position
        none = (Role.TARGET, *DEVIATIONS, Role.WAY)
        columns = [replace(one, role=None) if one.role in none else one for one in columns]
    if not any(one.unit is not None and one.unit.quantity == "angle" for one in columns):
        return columns
    marked = [one.unit is not None and one.unit.name == '"' for one in columns]  # beside an angle it is of arcseconds
    return [replace(one, unit=find_unit("arcsec")) if mark else one for one, mark in zip(columns, marked, strict=True)]


def _labelled(one: Column, chosen: Mapping[str, str]) -> Column:
    """A column whose name says a cycle or a direction: its own, or, as ``Run 3``, that of the readings below it."""
    label, by_hand = parse_label(one.name), _chosen(one.header, one.name, one.place, chosen)
    own = (Role.TARGET, Role.TIME, Role.FROM, Role.TO, Role.U_TARGET, Role.PLACEMENT)
    if label == LABEL or by_hand == Role.IGNORE or one.role in own or MEASURE.fullmatch(one.header.strip()):
        return one
    return replace(one, role=None if one.role in (Role.CYCLE, Role.WAY) and by_hand is None else one.role, label=label)


def _wide(columns: list[Column]) -> list[Column]:
    """Two columns or more that carry labels and are of one kind are readings, cycle by cycle."""
    stems: dict[tuple[str, ...], list[int]] = {}
    for one in columns:
        if one.label != LABEL and one.role in (None, *VALUES, Role.DROPPED):
            stem = tuple(word for word in words_of(re.sub(r"\d+", " ", one.name)) if not parse_label(word).way)
            stems.setdefault(tuple(word for word in stem if word not in WORDS["idle"]), []).append(one.place)
    groups = [places for stem, places in stems.items() if len(places) > 1 and _tells(stem)]
    if not groups:
        return columns
    most = max(groups, key=len)
    role = next((columns[place].role for place in most if columns[place].role in VALUES), Role.VALUES)
    letters = all(len(columns[place].name) == 1 and columns[place].name.isalpha() for place in most)
    if letters and any(one.role in VALUES for one in columns):
        return columns  # r and d beside what is named as the reading
    return [replace(one, role=role) if one.place in most else one for one in columns]


def _tells(stem: tuple[str, ...]) -> bool:
    """Whether what columns share is a reading, a deviation or a cycle, and not a temperature of several sensors."""
    return says(stem, *_NUMBERED, "correction") | (set(stem) & {"m", "x", "r", "pos", "forward", "backward"}) == set(
        stem
    )


# points of three coordinates


def point_role(name: str, unit: Unit | None = None) -> str | None:
    """What a column of points is by its name: a coordinate, part of a direction, a count, a time, a temperature."""
    every = words_of(name)
    words = [word for word in every if word not in WORDS["point"]]
    words = words if len(words) < 2 else [one for one in words if one not in ("nr", "no", "number", "nummer")] or words
    if not words:
        return None
    degrees = unit is not None and unit.quantity == "temperature"
    if words == ["t"] and unit is not None and unit.quantity == "time":
        return Role.TIME
    if set(words) & WORDS["temperature"]:
        return _direction(words) or _temperature(every)
    return _direction(words) or _single(words) or (_temperature(every) if degrees else None)


POINTS = point_role


def _single(words: Sequence[str]) -> str | None:
    if len(words) != 1:
        return None
    if words[0] in ("x", "y", "z"):
        return f"{words[0]}_mm"
    return next(
        (role for role in (Role.CYCLE, "face", Role.PLACEMENT, Role.TIME, "speed_mm_s") if words[0] in WORDS[role]),
        None,
    )


def _direction(words: Sequence[str]) -> str | None:
    if len(words) == 1 and words[0] in ("i", "j", "k"):
        return NORMAL[_LETTERS[words[0]]]
    if len(words) == 1 and re.fullmatch(r"n[xyz]", words[0]):
        return NORMAL[_LETTERS[words[0][1]]]
    if len(words) == 2 and words[0] in _VECTORS and words[1] in _LETTERS:
        return _VECTORS[words[0]][_LETTERS[words[1]]]
    return None


def _temperature(words: Sequence[str]) -> str | None:
    """Whose temperature it is; one that does not say is the gauge's, and any other word makes it another's."""
    rest = set(words) - WORDS["temperature"] - (WORDS["point"] - WORDS["owner"])
    if not rest:
        return "gauge_temperature_C"
    whose = {"gauge_temperature_C": WORDS["gauge"], **{f"scale_temperature_{a}_C": frozenset(a) for a in "xyz"}}
    return next((role for role, own in whose.items() if rest & own and rest <= own | WORDS["beside gauge"]), None)


def is_temperature(column: Column) -> bool:
    """Whether a column is a temperature, by its unit, also where that is its name, or by a word of its name."""
    unit = column.unit or find_unit(column.header.strip("[]()")) if len(column.header) > 1 else column.unit
    if unit is not None and unit.quantity != "none":
        return unit.quantity == "temperature"
    return bool(set(words_of(re.sub(r"\d", " ", column.name))) & (WORDS["temperature"] - {"t"}))
