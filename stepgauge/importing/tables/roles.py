"""What the columns of a table of one axis are by their names: target, reading, deviation, direction, cycle, time.

Deviations come with either sign (:mod:`.signs`): a ``correction`` is the negative of a ``deviation``. Names are
hypotheses; :mod:`.rivals` compares them with one another and with the numbers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from stepgauge.errors import InputError, naming
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.tables.labels import LABEL, Label, parse_label
from stepgauge.importing.tables.names import split_unit
from stepgauge.importing.tables.signs import CORRECTIONS, folded, signs_of

TARGET, READING, DEVIATION, CORRECTION = "target", "reading", "deviation", "correction"
UNSIGNED = "deviation of unknown sign"
WAY, CYCLE, TIME, PLACEMENT, FROM, TO, U_TARGET = "way", "cycle", "time_s", "placement", "from", "to", "u_target"
DROPPED, IGNORE = "dropped", "ignore"
ROLES = (TARGET, READING, DEVIATION, CORRECTION, WAY, CYCLE, TIME, PLACEMENT, FROM, TO, U_TARGET, IGNORE)
"""What ``--column`` may name."""
DEVIATIONS = (DEVIATION, CORRECTION, UNSIGNED)
VALUES = (READING, *DEVIATIONS)
READING_OR_DEVIATION = "values"
"""Columns of cycles that are not named as readings or as deviations: their size tells."""
VALUE_ROLES = (*VALUES, READING_OR_DEVIATION)
_WORDS = {
    TARGET: """target targets nominal nom theo command commanded cmd demand demanded setpoint set soll sollwert
        sollposition zielposition ziel reference ref referenz standard normal true certified calibrated nennwert
        nennmass konsigne consigne theoretical sollmass stellung winkelstellung step masstab vorgabe""",
    DEVIATION: """deviation deviations dev error errors err abweichung abweichungen fehler diff difference differenz
        delta residual ecart erreur""",
    READING: """reading readings read measured measurement meas actual act indicated indication indicator display
        displayed ist istwert istposition messwert anzeige anzeigewert ablesung value wert laser encoder dro probe
        probed trigger distance distanz strecke abstand dial gauge output feedback mesure lecture observed
        observation""",
    WAY: "direction dir way richtung fahrtrichtung sense approach bearing_direction travel sens verfahrrichtung",
    CYCLE: "cycle run cycles runs repeat repetition series zyklus lauf durchgang messreihe wiederholung trial pass",
    PLACEMENT: "placement setup aufstellung aufspannung session",
    TIME: """time timestamp datetime zeit uhrzeit zeitstempel elapsed seconds clock date_time temps date datum epoch
        hour hours minute minutes second stunde stunden minuten sekunde sekunden heure laufzeit""",
    FROM: "from von start standpunkt",
    TO: "to nach end zielpunkt",
}
_PLACE = "position pos x y z a b c angle winkel coordinate koordinate axis location place travel"
_COUNT = "no nr # n index idx i point punkt row line id lfd count sample messpunkt num"
_STATISTIC = """mean average avg mittel mittelwert mw stdev std sd sigma s u range spannweite min max median reversal b
    umkehrspanne 2s 4s xm standardabweichung repeatability rms sum summe moyenne"""
_IDLES = """the of in on at axis achse value values wert werte point pos position positions col column mm um line
    linear"""
_NAMES = "pillar station point stand name id no nr"
_RECORDED_BESIDES = """temperature temp temperatur humidity pressure feuchte druck luftdruck luftfeuchte rh rpm speed
    drehzahl load last power current strom voltage volt force kraft feed vorschub refractive index brechzahl"""
_POSITION, _NUMBER, _STATISTICS, _IDLE, _STATION, _BESIDE = (
    frozenset(words.split()) for words in (_PLACE, _COUNT, _STATISTIC, _IDLES, _NAMES, _RECORDED_BESIDES)
)
"""Words of a place, which is a target where no other column is one; of a row's number; of what is computed from the
readings; words that say nothing of a wide table; words beside those of a station; and quantities that are recorded
besides."""
_CALLED = {"direction": WAY, "time": TIME, "run": CYCLE}
_UNIT_BEHIND = re.compile(r"(.+?)(?:\s*/\s*|\s*,\s*|\s+)(\w*[a-zµμ°]{2,}|°|min|arc sec)\s*", re.IGNORECASE)
_LAST = re.compile(r"(.+)_([^_\s]+)")
_PLACES = (TARGET, *VALUE_ROLES)
"""Roles of a length or an angle."""
_U = re.compile(r"^u[ _(]|uncertainty|unsicherheit|^u$", re.IGNORECASE)


@dataclass(frozen=True)
class Role:
    """A column: place, header, role (None: a number recorded besides), unit, and cycle and way where its name says."""

    place: int
    header: str
    role: str | None
    unit: Unit | None
    label: Label = LABEL


def read_roles(headers: Sequence[str], units: Sequence[Unit | None], chosen: Mapping[str, str]) -> list[Role]:
    """The roles of all columns by name; ``chosen``: headers by role (``*`` stands for any text) go before.

    Columns whose names differ only in a number and a direction are the readings of a wide table. A choice removes its
    rivals: what else is named as that role, or as another one of values, is a number recorded besides.
    """
    named = [split_name(header) for header in headers]
    roles = []
    for place, (header, (name, own), unit) in enumerate(zip(headers, named, units, strict=True)):
        of = unit or own
        stated = _chosen(header, name, place, chosen)
        role = stated or _role(name)
        if stated is None and ((of is not None and not _may_have(role, of)) or _removed(role, chosen)):
            role = None
        role = DROPPED if role == IGNORE else role
        roles.append(Role(place, header, role, of))
    roles = [_labelled(one, name, chosen) for one, (name, _) in zip(roles, named, strict=True)]
    roles = _wide(roles, [name for name, _ in named])
    roles = _settled(roles, [name for name, _ in named])
    if {FROM, TO} <= {one.role for one in roles}:  # a station may be called a target: its place is no position
        roles = [replace(one, role=None) if one.role in (TARGET, *DEVIATIONS, WAY) else one for one in roles]
    return _arcseconds(roles)


def _removed(role: str | None, chosen: Mapping[str, str]) -> bool:
    """Whether a choice stands in the place of a role that a name suggests."""
    values = role in VALUES and any(one in chosen for one in VALUES)
    return values or (role is not None and role != DROPPED and role in chosen)


def _arcseconds(roles: list[Role]) -> list[Role]:
    """Beside an angle the sign of inches is that of arcseconds."""
    if not any(one.unit is not None and one.unit.quantity == "angle" for one in roles):
        return roles
    marked = {one.place for one in roles if one.unit is not None and one.unit.name == '"'}
    return [replace(one, unit=find_unit("arcsec")) if one.place in marked else one for one in roles]


def _may_have(role: str | None, unit: Unit) -> bool:
    """Whether a role may have a unit: places and deviations a length or an angle, others none or a time."""
    if unit.quantity in ("length", "angle"):
        return role in (*_PLACES, U_TARGET, DROPPED)
    return unit.quantity == "none" or (unit.quantity == "time" and role == TIME)


def split_name(header: str) -> tuple[str, Unit | None]:
    """Name and unit of a header; beside ``X [mm]`` and ``x_mm`` also ``X mm``, ``X/mm`` and ``X, mm``."""
    name, unit = split_unit(header)
    match = None if unit is not None else _LAST.fullmatch(header.strip()) or _UNIT_BEHIND.fullmatch(header.strip())
    known = find_unit(match[2].replace("arc sec", "arcsec")) if match else None
    if match is None or known is None or known.quantity == "none":
        return name, unit
    return match[1].strip(), known


def parse_roles(texts: Sequence[str]) -> dict[str, str]:
    """``("reading=Run *", ..)`` as a mapping; :class:`InputError` for what is no role."""
    found: dict[str, str] = {}
    for text in texts:
        role, equals, header = text.partition("=")
        name = _CALLED.get(role.strip(), role.strip())
        if not equals or not header.strip() or name not in ROLES:
            expected = f"NAME=HEADER, NAME of {', '.join(ROLES)}"
            raise InputError(naming("columns"), "not understood", found=repr(text), expected=expected)
        found[name] = "\n".join([*([found[name]] if name == IGNORE and name in found else []), header.strip()])
    return found


def role_of(header: str) -> str | None:
    """What a column, or a row of a form, is by its name alone."""
    return _role(split_name(header)[0])


def is_known(name: str) -> bool:
    """Whether a name says what is under it: a role, a statistic, or a quantity that is recorded besides."""
    return _role(name) is not None or bool(set(words_of(name)) & _BESIDE)


def remainder(name: str) -> frozenset[str]:
    """The words of a name beside those of its role: ``x`` of ``Meas X``, by which it goes with ``Nom X``."""
    known = {word for words in _WORDS.values() for word in words.split()} | _IDLE
    return frozenset(words_of(name)) - (known - _POSITION)


def words_of(name: str) -> list[str]:
    """The words of a name, folded, without accents and signs."""
    return [word for word in re.split(r"[^a-z0-9#]+", folded(name)) if word]


def _chosen(header: str, name: str, place: int, chosen: Mapping[str, str]) -> str | None:
    for role, patterns in chosen.items():
        for pattern in patterns.casefold().split("\n"):
            if pattern in (header.casefold(), name.casefold(), f"#{place + 1}"):
                return role
            if header and fnmatchcase(header.casefold(), pattern):
                return role
    return None


def _role(name: str) -> str | None:
    words = words_of(name)
    if not words:
        return None
    if _U.search(name):
        return U_TARGET if {"target", "nominal", "reference"} & set(words) else DROPPED
    if set(words) & _BESIDE:
        return None
    if words[0] in _STATISTICS and not set(words) & set(_WORDS[READING].split()):
        return DROPPED
    for role in (FROM, TO, WAY, TIME, CYCLE, PLACEMENT):
        known = _WORDS[role].split()
        told = set(words) & set(known)
        plain = not set(words) - set(known) - _STATION if role in (FROM, TO) else len(words) - len(told) < 2
        if told and (plain or role == WAY):
            return role
    return _value_role(name, set(words)) or (DROPPED if set(words) <= _NUMBER else None)


def _value_role(name: str, words: set[str]) -> str | None:
    """What the values of a column are; deviations with the sign that the name gives them."""
    signs = signs_of(name, bool(words & set(_WORDS[DEVIATION].split())))
    if signs:
        return UNSIGNED if len(signs) > 1 else DEVIATION if 1 in signs else CORRECTION
    return next((role for role in (TARGET, READING) if words & set(_WORDS[role].split())), None)


def _labelled(one: Role, name: str, chosen: Mapping[str, str]) -> Role:
    """A column whose name says a cycle or a direction: its own, or, as ``Run 3``, that of the readings below it."""
    label = parse_label(name)
    if label == LABEL or one.role in (TARGET, TIME, FROM, TO, U_TARGET, PLACEMENT):
        return one
    of_readings = one.role in (CYCLE, WAY) and _chosen(one.header, name, one.place, chosen) is None
    return replace(one, role=None if of_readings else one.role, label=label)


def _wide(roles: list[Role], names: Sequence[str]) -> list[Role]:
    """Two columns or more that carry labels and are of one kind are readings, cycle by cycle."""
    stems: dict[tuple[str, ...], list[int]] = {}
    for place, (one, name) in enumerate(zip(roles, names, strict=True)):
        if one.label != LABEL and one.role in (None, *VALUES, DROPPED):
            stem = tuple(word for word in _stem(name) if word not in _IDLE)
            stems.setdefault(stem, []).append(place)
    groups = [places for stem, places in stems.items() if len(places) > 1 and _tells(stem)]
    if not groups:
        return roles
    most = max(groups, key=len)
    role = next((roles[place].role for place in most if roles[place].role in VALUES), READING_OR_DEVIATION)
    return [replace(one, role=role) if one.place in most else one for one in roles]


def _tells(stem: tuple[str, ...]) -> bool:
    """Whether what columns share is a reading, a deviation or a cycle, and not a temperature of several sensors."""
    known = {word for role in (TARGET, READING, DEVIATION, CYCLE, WAY) for word in _WORDS[role].split()}
    return set(stem) <= known | set(CORRECTIONS.split()) | {"m", "x", "r", "pos", "forward", "backward"}


def _stem(name: str) -> list[str]:
    return [word for word in words_of(re.sub(r"\d+", " ", name)) if not parse_label(word).way]


def _settled(roles: list[Role], names: Sequence[str]) -> list[Role]:
    """A place is the target where no other column is one."""
    values = [one for one in roles if one.role in VALUE_ROLES]
    labelled = [one for one in roles if one.label != LABEL]
    places = [
        one.place
        for one, name in zip(roles, names, strict=True)
        if one.role is None and words_of(name) and set(words_of(name)) <= _POSITION
        if one.label == LABEL or (words_of(name) == ["pos"] and labelled == [one])  # not the positive way of two
    ]
    if any(one.role == TARGET for one in roles) or len(places) != 1 or not values:
        return roles
    return [replace(one, role=TARGET, label=LABEL) if one.place == places[0] else one for one in roles]
