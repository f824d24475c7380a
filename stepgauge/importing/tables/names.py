"""What the columns of a table are: names in several languages, and the units beside them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.tables.questions import Choice, Decisions
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION

NORMAL = ["normal_i", "normal_j", "normal_k"]
DIRECTIONS = (*APPROACH, *NORMAL)
TARGETS = [*POSITION, *APPROACH, *NORMAL, *COUNTS, *OPTIONAL[1:]]
"""What a column may be mapped to."""
QUANTITY = {
    **dict.fromkeys(POSITION, "length"),
    "time_s": "time",
    "speed_mm_s": "speed",
    **{name: "temperature" for name in OPTIONAL if name.endswith("_C")},
}
LONGEST_HEADER = 200
"""Characters of the name of a column; longer ones are text."""
_SAY_NOTHING = """wert value val pos position koordinate koordinaten coordinate coord coords actual act ist istwert
    measured meas messwert gemessen achse axis punkt point tip centre center mitte mittelpunkt antastpunkt probe
    messpunkt ball kugel tastkugel kugelmitte kugelmittelpunkt tastkugelmitte tastkugelmittelpunkt"""
_FILLERS = frozenset(_SAY_NOTHING.split())
_NAMES = {
    "x_mm": "x",
    "y_mm": "y",
    "z_mm": "z",
    "cycle": "cycle zyklus lauf run repeat wiederholung durchgang durchlauf repetition",
    "face": "face flaeche messflaeche surface",
    "placement": "placement lage aufstellung setup",
    "time_s": "time zeit uhrzeit timestamp zeitstempel datetime",
    "speed_mm_s": "speed geschwindigkeit v antastgeschwindigkeit vorschub feed",
}
_WHOSE = {  # folded: ß is ss, ü is ue
    "gauge_temperature_C": """gauge gage part piece workpiece object material specimen artefact artifact werkstueck teil
        bauteil pruefling pruefkoerper objekt messobjekt lehre stufenlehre normal endmass stufenendmass etalon""",
    **{f"scale_temperature_{axis}_C": axis for axis in "xyz"},
}
"""Words of which one must be in the header of a temperature that is this one."""
_NEUTRAL = "step block work test scale massstab axis achse of the at on der des dem am vom von"
"""Words that may stand beside them; any other, such as "air", makes it the temperature of something else."""
_TEMPERATURE = frozenset(("temperature", "temp", "temperatur", "t"))
_COMPOUND = re.compile(r"(\w{3,}?)s?(temperature|temperatur|temp)")
"""German names in one word, such as "Prüflingstemperatur"."""
_UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"})
_OWNERS = frozenset(("axis", "achse", "probe", "tip"))
"""Words that say nothing of a position, and of a temperature whose it is."""
_DIRECTIONS = {"approach": APPROACH, "antastrichtung": APPROACH, "normal": NORMAL, "normale": NORMAL, "n": NORMAL}
_PLACES = {letter: place for place, letters in enumerate(("ix", "jy", "kz")) for letter in letters}
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_BEHIND = re.compile(r"(.*?)\s*(?:\s/\s*|\s+in\s+|_|\s+(?=°))([^\s/]+(?:/[^\s/]+)?)\s*$", re.IGNORECASE)


@dataclass(frozen=True)
class Column:
    """A column of a table: its ``place``, header, what of a recording it is (None: nothing known), and its unit."""

    place: int
    header: str
    name: str
    target: str | None
    unit: Unit | None


def read_header(cells: Sequence[str], mapping: Mapping[str, str]) -> list[Column]:
    """The columns of a header row; ``mapping`` from targets to headers goes before what the names suggest."""
    columns = []
    for place, header in enumerate(cells):
        if len(header) > LONGEST_HEADER:
            columns.append(Column(place, header[:LONGEST_HEADER], header[:LONGEST_HEADER], None, None))
            continue
        name, unit = (header.strip(), None) if _target(header) in DIRECTIONS else split_unit(header)  # the k of i, j, k
        own = Column(place, header, name, None, unit)
        target = next((target for target, chosen in mapping.items() if is_named(own, chosen)), None)
        if target is None:
            target = header.strip() if header.strip() in TARGETS else _target(name, unit)
            if target == "gauge_temperature_C" and unit is not None and unit.quantity == "time":
                target = "time_s"  # t [s], not T
            target = None if target in mapping else target
        columns.append(Column(place, header, name, target, unit))
    return columns


def joined_headers(upper: Sequence[str], lower: Sequence[str]) -> list[str]:
    """Headers of two rows as those of one: names above, in merged cells, and parts or units of them below.

    A merged cell stands in its first column; it is carried to the right over columns that the lower row names.
    """
    joined, group = list[str](), ""
    for place, part in enumerate(lower):
        own = upper[place] if place < len(upper) else ""
        group = own or (group if part else "")
        joined.append(_joined(group, part, own=bool(own)))
    return joined


def _joined(group: str, part: str, *, own: bool) -> str:
    """One header of ``group`` above and ``part`` below; under an ``own`` cell above, a unit is its unit."""
    if not group or not part:
        return group or part
    unit = find_unit(part.strip("[]()"))
    if own and unit is not None and _target(f"{group} {part}") not in DIRECTIONS:
        return f"{group} [{unit.name}]"
    (name, whole), (low, narrow) = split_unit(group), split_unit(part)
    known = narrow or whole
    return f"{name} {low} [{known.name}]" if known is not None else f"{group} {part}"


def split_unit(header: str) -> tuple[str, Unit | None]:
    """Name and unit of a header such as ``X [mm]``, ``X (inch)``, ``Position X / µm``, ``T in °C`` or ``x_mm``."""
    for pattern in (_BRACKETS, _BEHIND):
        match = pattern.fullmatch(header.strip())
        unit = find_unit(match[2]) if match else None
        if match and unit is not None and match[1]:
            return match[1].strip(), unit
    return header.strip(), None


def in_degrees(column: Column) -> bool:
    """Whether a column is a temperature, by its unit, also where that is its name, or by a word of its name."""
    unit = column.unit or find_unit(column.header.strip("[]()")) if len(column.header) > 1 else column.unit
    if unit is not None and unit.quantity != "none":
        return unit.quantity == "temperature"
    return bool(set(_words(re.sub(r"\d", " ", column.name))) & (_TEMPERATURE - {"t"}))


def _words(name: str) -> list[str]:
    """The words of a name, folded, German compounds with a temperature taken apart."""
    plain = unicodedata.normalize("NFC", name).casefold().translate(_UMLAUTS)
    plain = "".join(one for one in unicodedata.normalize("NFD", plain) if not unicodedata.combining(one))
    words: list[str] = []
    for token in re.split(r"[^\w]+|_", plain):
        compound = _COMPOUND.fullmatch(token)
        words += compound.groups() if compound else [token] if token else []
    return words


def _target(name: str, unit: Unit | None = None) -> str | None:
    every = _words(name)
    words = [word for word in every if word not in _FILLERS]
    if not words:
        return None
    if not _TEMPERATURE.isdisjoint(words):
        return _direction(words) or _temperature(every)
    degrees = unit is not None and unit.quantity == "temperature"
    return _direction(words) or _single(words) or (_temperature(every) if degrees else None)


def _single(words: Sequence[str]) -> str | None:
    words = [word for word in words if word not in ("nr", "no", "number", "nummer")] or list(words)
    if len(words) != 1:
        return None
    return next((target for target, names in _NAMES.items() if words[0] in names.split()), None)


def _direction(words: Sequence[str]) -> str | None:
    if len(words) == 1 and words[0] in ("i", "j", "k"):
        return NORMAL[_PLACES[words[0]]]
    if len(words) == 1 and re.fullmatch(r"n[xyz]", words[0]):
        return NORMAL[_PLACES[words[0][1]]]
    if len(words) == 2 and words[0] in _DIRECTIONS and words[1] in _PLACES:
        return _DIRECTIONS[words[0]][_PLACES[words[1]]]
    return None


def _temperature(words: Sequence[str]) -> str | None:
    """Whose temperature it is; one that does not say is the gauge's."""
    rest = set(words) - _TEMPERATURE - (_FILLERS - _OWNERS)
    if not rest:
        return "gauge_temperature_C"
    for target, names in _WHOSE.items():
        own = set(names.split())
        if rest & own and rest <= own.union(_NEUTRAL.split()):
            return target
    return None


def is_named(column: Column, header: str) -> bool:
    """Whether a column is the one that was named by hand: by its header, its name without the unit, or as ``#3``."""
    return header.casefold() in (column.header.casefold(), column.name.casefold(), f"#{column.place + 1}")


def check_columns(
    columns: Sequence[Column],
    where: str,
    mapping: Mapping[str, str],
    numbers: Callable[[int], NDArray[np.float64]],
    decisions: Decisions,
) -> None:
    """Every target once (a copy is the same column), every mapped header there, and units of the right quantity."""
    seen: dict[str, Column] = {}
    for column in columns:
        if column.target is None:
            continue
        first = seen.setdefault(column.target, column)
        if first is not column and not np.array_equal(numbers(first.place), numbers(column.place), equal_nan=True):
            found = f"{first.header!r} and {column.header!r}"
            ways = [Choice("columns", f"{column.target}={one.header}") for one in (first, column)]
            decisions.ask(where, f"two columns may be {column.target}", *ways, found=found)
        quantity = QUANTITY.get(column.target)
        if column.unit and column.unit.quantity not in (quantity, "none"):
            raise InputError(
                where,
                f"column {column.header!r} cannot be {column.target}",
                found=f"unit {column.unit.name}",
                expected=f"a unit of {quantity}" if quantity else "no unit",
            )
    for target, header in mapping.items():
        if target not in seen:
            known = ", ".join(column.header for column in columns if column.header)
            raise InputError(where, f"there is no column {header!r} for {target}", found=known)


def parse_mapping(texts: Sequence[str]) -> dict[str, str]:
    """``("x_mm=Messwert X", ..)`` as ``{"x_mm": "Messwert X"}``; :class:`InputError` for unknown targets."""
    mapping = {}
    for text in texts:
        target, equals, header = text.partition("=")
        if not equals or not header.strip() or target.strip() not in TARGETS:
            names = ", ".join(TARGETS)
            raise InputError(
                naming("columns"), "not understood", found=repr(text), expected=f"NAME=HEADER, NAME of {names}"
            )
        mapping[target.strip()] = header.strip()
    return mapping
