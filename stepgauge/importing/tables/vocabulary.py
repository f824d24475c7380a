"""Words of the headers of tables, in English, German, French, Italian and Spanish, by what they say; and their units.

One list for all kinds of tables. Words are compared in small letters without accents (ß is ss), umlauts also as ``ae``.
"""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache

from stepgauge.files.numerals import tidy
from stepgauge.files.units import Unit, find_unit

_WORDS = {
    "target": """target targets nominal nominale nom theo command commanded cmd demand demanded setpoint setpoints set
        soll sollwert sollposition sollmass zielposition zielpositionen ziel ref reference referenz consigne konsigne
        cible nennwert nennmass theoretical theorique teorico prevista previsto objetivo""",
    "target beside": """standard normal true certified calibrated stellung winkelstellung step massstab masstab vorgabe
        block blocks endmass parallelendmass""",
    "reading": """actual act ist istwert istposition istmass measured measurement meas reading readings indicated
        indication laser messwert gemessen anzeige anzeigewert mesure mesuree lecture lectura lettura misurata misurato
        medida medido observed feedback reel""",
    "reading beside": """read indicator display displayed ablesung value wert encoder dro probe probed trigger distance
        distanz distanza distancia strecke abstand dial gauge output observation radius
        rayon raggio radio rarawdistance decrawdistance""",
    "deviation": """deviation deviations dev error errors err abweichung abweichungen abw fehler diff difference
        differenz delta residual ecart ecarts erreur scostamento scostamenti errore desviacion diferencia""",
    "correction": """correction corrections compensation compensations korrektur korrekturen korrekturwert
        korrekturwerte kompensation kompensationswert kompensationswerte correzione correccion""",
    "way": """direction dir way richtung fahrtrichtung sense approach bearing_direction travel sens verfahrrichtung
        direzione senso sentido direccion""",
    "cycle": """cycle run cycles runs repeat repetition series zyklus lauf durchgang durchlauf messreihe wiederholung
        trial pass ciclo serie passage essai prova""",
    "placement": "placement setup aufstellung aufspannung session lage",
    "time_s": """time timestamp datetime zeit uhrzeit zeitstempel elapsed seconds clock date_time temps date datum epoch
        hour hours minute minutes second stunde stunden minuten sekunde sekunden heure laufzeit tempo tiempo hora ora
        fecha""",
    "from": "from von start standpunkt de da desde",
    "to": "to nach end zielpunkt vers hacia",
    "face": "face flache messflache surface",
    "speed_mm_s": "speed geschwindigkeit v antastgeschwindigkeit vorschub feed",
    "place": """position pos x y z a b c angle winkel coordinate koordinate axis location place travel posizione
        posicion""",
    "count": "no frame nr # n index idx i point punkt row line id lfd count sample messpunkt num punto numero",
    "statistic": """mean average avg mittel mittelwert mw stdev std sd sigma s u range spannweite min max median
        reversal b umkehrspanne 2s 4s xm standardabweichung repeatability rms sum summe moyenne media""",
    "idle": """the of in on at axis achse value values wert werte point pos position positions col column mm um line
        linear posizione posicion""",
    "station": "pillar station point stand name id no nr",
    "besides": """temperature temp temperatur temperatura humidity pressure feuchte druck luftdruck luftfeuchte rh rpm
        speed drehzahl load last power current strom voltage volt force kraft feed vorschub refractive index brechzahl
        severity status alarm quality judge snr starmass errorcode dx dy raguidedistance decguidedistance raduration
        decduration radirection decdirection xstep ystep""",
    "kind": """axis ax achse feature features merkmal element kind art typ type channel kanal sensor characteristic
        charakteristik machine maschine name signal variable""",
    "point": """wert value val pos position koordinate koordinaten coordinate coord coords actual act ist istwert
        measured meas messwert gemessen achse axis punkt point tip centre center mitte mittelpunkt antastpunkt probe
        messpunkt ball kugel tastkugel kugelmitte kugelmittelpunkt tastkugelmitte tastkugelmittelpunkt""",
    "temperature": "temperature temp temperatur temperatura t",
    "gauge": """gauge gage part piece workpiece object material specimen artefact artifact werkstuck teil bauteil
        prufling prufkorper objekt messobjekt lehre stufenlehre normal endmass stufenendmass etalon""",
    "beside gauge": "step block work test scale massstab axis achse of the at on der des dem am vom von",
    "verdict": "ok nok nio io i.o. n.i.o. pass fail passed failed in out - ja nein yes no true false go ng hi lo",
}
WORDS = {name: frozenset(words.split()) for name, words in _WORDS.items()}
"""Words by what they say. ``beside``: words that say it less surely, so that ``Soll-Wert`` subtracts nothing; ``idle``:
that say nothing beside others; ``point``: that say nothing of a coordinate; ``statistic``: what is computed from the
readings; ``besides``: quantities recorded besides; ``kind``: columns that say of what kind a row is."""
_KNOWN = frozenset().union(*WORDS.values())
_MINUS = frozenset(("minus", "moins", "meno", "menos", "-", "\u2010", "\u2014"))
_TOKEN = re.compile(r"[^\W\d_]+|[-\u2010\u2014]")
_COMPOUND = re.compile(r"(\w{3,}?)s?(temperature|temperatur|temp)")
"""German names in one word, such as "Prüflingstemperatur"."""
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_BEHIND = re.compile(r"(.*?)\s*(?:\s/\s*|\s+in\s+|_|\s+(?=°))([^\s/]+(?:/[^\s/]+)?)\s*$", re.IGNORECASE)
_LOOSELY = (
    re.compile(r"(.+)_([^_\s]+)"),
    re.compile(r"(.+?)(?:\s*/\s*|\s*,\s*|\s+)(\w*[a-zµμ°]{2,}|°|min|arc sec)\s*", re.IGNORECASE),
)


def folded(text: str) -> str:
    """A name in small letters without accents, with plain minus signs."""
    letters = unicodedata.normalize("NFKD", tidy(text).casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


@lru_cache(4096)
def words_of(name: str) -> tuple[str, ...]:
    """The words of a name, folded; umlauts written as two letters as one, temperatures out of German compounds."""
    found = list[str]()
    for word in re.split(r"[^a-z0-9#]+", folded(name)):
        plain = re.sub("([aou])e", r"\1", word)
        word = plain if word not in _KNOWN and plain in _KNOWN else word
        compound = _COMPOUND.fullmatch(word) if word not in _KNOWN else None
        found += [words_of(compound[1])[0], compound[2]] if compound else [word] if word else []
    return tuple(found)


def says(words: tuple[str, ...], *of: str) -> set[str]:
    """Those of the words that are of these lists."""
    return {word for word in words if any(word in WORDS[one] for one in of)}


def split_unit(header: str) -> tuple[str, Unit | None]:
    """Name and unit of a header such as ``X [mm]``, ``X (inch)``, ``Position X / µm``, ``T in °C`` or ``x_mm``."""
    for pattern in (_BRACKETS, _BEHIND):
        match = pattern.fullmatch(header.strip())
        unit = find_unit(match[2]) if match else None
        if match and unit is not None and match[1]:
            return match[1].strip(), unit
    return header.strip(), None


def split_name(header: str) -> tuple[str, Unit | None]:
    """Name and unit of a header; beside ``X [mm]`` and ``x_mm`` also ``X mm``, ``X/mm`` and ``X, mm``."""
    name, unit = split_unit(header)
    match = None if unit is not None else next(filter(None, (one.fullmatch(header.strip()) for one in _LOOSELY)), None)
    known = find_unit(match[2].replace("arc sec", "arcsec")) if match else None
    if match is None or known is None or known.quantity == "none":
        return name, unit
    return match[1].strip(), known


def subtractions(name: str) -> set[int]:
    """The orders in which a name subtracts: +1 for reading minus target, -1 for target minus reading."""
    tokens = [token for token in _TOKEN.findall(folded(name)) if token not in _IDLE]
    plain = re.sub("-+", "-", "".join(map(_letter, tokens)))
    return {sign for order, sign in (("R-T", 1), ("T-R", -1)) if order in plain}


_IDLE = frozenset(["value", "values", "val", "position", "positions", "pos", "point", "wert", "werte", "mass", "punkt"])


def _letter(token: str) -> str:
    """``T`` for a word of targets, ``R`` for one of readings, ``-`` for a minus, ``.`` for another word."""
    return "-" if token in _MINUS else "T" if token in WORDS["target"] else "R" if token in WORDS["reading"] else "."


def signs_of(name: str, deviation: bool | None = None) -> set[int]:
    """The signs that the words of a name give its values: +1 for reading minus target, -1 for target minus reading.

    None without such a word, both where they contradict. The order in which a name subtracts (``Soll-Ist``) says more
    than its other words, for an ``Abweichung Soll-Ist`` is no deviation. A correction or compensation value is what is
    added to a reading: the negative of its deviation (VIM 2.53). ``deviation``: whether one of the words is a word for
    a deviation; default: by the words.
    """
    tokens = frozenset(_TOKEN.findall(folded(name)))
    if deviation is None:
        deviation = bool(tokens & WORDS["deviation"])
    told = subtractions(name) or ({1} if deviation else set())
    return told | ({-1} if tokens & WORDS["correction"] else set())
