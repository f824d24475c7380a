"""Controls that apply a compensation file, each written from the sentence of its maker or from the firmware's source.

Nothing here knows how the package makes a file. A :data:`Motor` says to which place of its own scale (the motor's or
encoder's) a control sends an axis that is commanded to ``p`` mm, in a sense of travel, +1 or -1. What a person sets at
the control is what the file asks for; a table that nobody is told to switch on stays off.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np

Array = np.ndarray
Motor = Callable[[Array, int], Array]
COMMENT = r"^[;#(].*$"


def linuxcnc(text: str, kind: int, _home_mm: float) -> Motor:
    """usrmotintf.cc reads triplets up to the first line that is none; type 0 becomes nominal minus value.

    control.c (compute_screw_comp) adds the trim of the direction of travel to the joint's command.
    """
    rows: list[list[float]] = []
    for line in text.splitlines():
        try:
            nominal, forward, reverse = map(float, line.split()[:3])
        except ValueError:
            break
        rows.append([nominal, forward, reverse])
    assert 2 <= len(rows) <= 256
    nominal, *columns = np.array(rows).T
    assert (np.diff(nominal) > 0).all()
    forward, reverse = ((nominal - one) if kind == 0 else one for one in columns)
    return lambda p, sense: p + np.interp(p, nominal, forward if sense > 0 else reverse)


def _settings(text: str) -> dict[str, str]:
    """What the comments of a SINUMERIK file tell a person to set, the last time that counts."""
    return dict(re.findall(r"(\$[MS][ANC]_\w+\[[^\]]*\]) = (\d+)", "\n".join(re.findall(COMMENT, text, re.M))))


def _assigned(text: str, name: str) -> dict[str, str]:
    """Index -> value of a system variable; ``M17`` ends the file."""
    body = re.sub(COMMENT, "", text, flags=re.M).split("M17")[0]
    assert "CHANDATA(1)" in body
    return dict(re.findall(rf"^\${name}\[([^\]]*)\]=(\S+)$", body, re.M))


def _even(values: dict[int, float], low: float, high: float, step: float) -> tuple[Array, Array]:
    """Points from MIN to MAX in STEP; values beyond are ignored; the end values go on."""
    last = round((high - low) / step)
    assert set(range(last + 1)) <= set(values)
    return low + step * np.arange(last + 1), np.array([values[n] for n in range(last + 1)])


def siemens(text: str, measuring_system: int, _home_mm: float) -> Motor:
    """K3: the value is added to what the encoder reads; a positive one moves the axis in negative direction."""
    points = {tuple(key.split(",")): float(value) for key, value in _assigned(text, "AA_ENC_COMP").items()}
    ((e, axis),) = {(key[0], key[2]) for key in points}
    assert int(e) == measuring_system
    low, high, step = (float(_assigned(text, f"AA_ENC_COMP_{n}")[f"{e},{axis}"]) for n in ("MIN", "MAX", "STEP"))
    assert _assigned(text, "AA_ENC_COMP_IS_MODULO")[f"{e},{axis}"] == "0"
    at, value = _even({int(key[1]): one for key, one in points.items()}, low, high, step)
    on = _settings(text).get(f"$MA_ENC_COMP_ENABLE[{e},{axis}]") == "1"
    return lambda p, _: p - on * np.interp(p, at, value)


def siemens_cec(text: str, _kind: int, _home_mm: float) -> Motor:
    """K3: input is the setpoint; a positive value moves the axis in negative direction; tables add up."""
    tables: dict[str, dict[int, float]] = {}
    for key, value in _assigned(text, "AN_CEC").items():
        t, n = key.split(",")
        tables.setdefault(t, {})[int(n)] = float(value)
    names = ("INPUT_AXIS", "OUTPUT_AXIS", "STEP", "MIN", "MAX", "DIRECTION", "MULT_BY_TABLE", "IS_MODULO")
    said = {name: _assigned(text, f"AN_CEC_{name}") for name in names}
    on = _settings(text)

    def motor(p: Array, sense: int) -> Array:
        for t, values in tables.items():
            axis = said["INPUT_AXIS"][t].strip("()")
            assert said["OUTPUT_AXIS"][t].strip("()") == axis
            assert said["MULT_BY_TABLE"][t] == said["IS_MODULO"][t] == "0"
            enabled = on.get(f"$SN_CEC_TABLE_ENABLE[{t}]") == on.get(f"$MA_CEC_ENABLE[{axis}]") == "1"
            if enabled and int(said["DIRECTION"][t]) in (0, sense):
                low, high, step = (float(said[name][t]) for name in ("MIN", "MAX", "STEP"))
                p = p - np.interp(p, *_even(values, low, high, step))
        return p

    return motor


def heidenhain(text: str, _kind: int, _home_mm: float) -> Motor:
    """By analogy with MP720 (positive: the table travels too far): the value is added to what the scale reads."""
    names = re.search(r"^NR .*$", text, re.M).group().split()  # type: ignore[union-attr]
    rows = np.array([line.split() for line in re.findall(r"^\d+ .*$", text, re.M)], float)
    column = dict(zip(names, rows.T, strict=True))
    value = {1: column[names[-1]], -1: column["BACKLASH"]}
    return lambda p, sense: p - np.interp(p, column["AXISPOS"], value[sense])


def _pitch(parameter: dict[int, float], points: dict[int, int], step_mm: float, home_mm: float, both: bool) -> Motor:
    """B-63980EN, pages 99 and 100: point n belongs to the section below it; the sum begins at the reference position.

    A-77810E: in negative travel the points from 3626 on; at the reference position the compensation is 3627, where
    reference return was in positive direction. By analogy with Mitsubishi a positive sum sends the axis farther.
    """
    low, high, reference = (int(parameter[n]) for n in (3621, 3622, 3620))
    at = home_mm + step_mm * (np.arange(low, high + 1) - reference)

    def motor(p: Array, sense: int) -> Array:
        other = both and sense < 0
        first = int(parameter[3626]) if other else low
        total = np.cumsum([points[first + n] for n in range(high - low + 1)])
        total = total - total[reference - low] + (parameter[3627] if other else 0)
        return p + 1e-3 * parameter[3623] * np.interp(p, at, total)

    return motor


def fanuc(text: str, _kind: int, home_mm: float) -> Motor:
    """The list, keyed in by somebody who does what it says."""
    parameter = {int(n): float(v) for n, v in re.findall(r"(36\d\d) = (-?[\d.]+)", text)}
    points = {int(n): int(v) for n, v in re.findall(r"^(\d+) \S+ (-?\d+)$", text, re.M)}
    return _pitch(parameter, points, parameter[3624], home_mm, "3605 BIT 0 = 1" in text)


def fanuc_g10(text: str, _kind: int, home_mm: float) -> Motor:
    """G10 L50 to G11: N is a parameter (with P, the axis) or, from 10000, a point; 3624 in least increments."""
    body = re.sub(r"\([^()\n]*\)", "", text).split("G10 L50\n")[1].split("G11")[0]
    words = [dict(re.findall(r"([NPR])(-?\d+)", line)) for line in body.splitlines()]
    (axis,) = {word["P"] for word in words if "P" in word}
    parameter = {int(word["N"]): float(word["R"]) for word in words if word.get("P") == axis}
    points = {int(word["N"]) - 10000: int(word["R"]) for word in words if "P" not in word}
    assert 3605 not in parameter, "R would clear its other bits"
    return _pitch(parameter, points, parameter[3624] * 1e-3, home_mm, "3605 BIT 0 SET" in text and 3626 in parameter)


def _stretched(factor: float, play_mm: float) -> Motor:
    """Steps per mm from machine zero; backlash steps in positive travel (Marlin: after a last move back)."""
    return lambda p, sense: p * factor + (play_mm if sense > 0 else 0.0)


def grbl(text: str, _kind: int, _home_mm: float) -> Motor:
    """$100 to $102 times the factor; $160 to $162 is grblHAL's play in mm."""
    number, factor = re.search(r"^FACTOR \$(\d+) (\S+)$", text, re.M).groups()  # type: ignore[union-attr]
    play = re.search(rf"^\${int(number) + 60}=(\S+)$", text, re.M)
    return _stretched(float(factor), float(play[1]) if play else 0.0)


def marlin(text: str, _kind: int, _home_mm: float) -> Motor:
    """M92 takes the old steps times the factor; M425 F1: the whole play."""
    axis, factor = re.search(r"^FACTOR M92 ([XYZ]) (\S+)$", text, re.M).groups()  # type: ignore[union-attr]
    play = re.search(rf"^M425 F1 {axis}(\S+)$", text, re.M)
    return _stretched(float(factor), float(play[1]) if play else 0.0)


def rrf(text: str, _kind: int, _home_mm: float) -> Motor:
    """GCodes.cpp: command times axisScaleFactors (M579); M425: play."""
    axis, factor = re.search(r"^M579 ([XYZ])(\S+)$", text, re.M).groups()  # type: ignore[union-attr]
    play = re.search(rf"^M425 {axis}(\S+)$", text, re.M)
    return _stretched(float(factor), float(play[1]) if play else 0.0)


def csv(text: str, _kind: int, _home_mm: float) -> Motor:
    """The error is added to the command."""
    lines = [line.split(",") for line in re.sub(COMMENT, "", text, flags=re.M).split("\n") if line]
    column = dict(zip(lines[0], np.array(lines[1:], float).T, strict=True))
    error = {1: column["error_positive_um"], -1: column["error_negative_um"]}
    return lambda p, sense: p + 1e-3 * np.interp(p, column["position_mm"], error[sense])


CONTROLS: dict[str, Callable[[str, int, float], Motor]] = {
    "linuxcnc": linuxcnc,
    "siemens": siemens,
    "siemens-cec": siemens_cec,
    "heidenhain": heidenhain,
    "fanuc": fanuc,
    "fanuc-g10": fanuc_g10,
    "grbl": grbl,
    "marlin": marlin,
    "rrf": rrf,
    "csv": csv,
}
"""By ``--to``: the text, the number that a format asks for, and where the axis has its reference position, mm."""


def skew_marlin(text: str) -> tuple[int, int, float]:
    """planner.h: x - y I - z J, y - z K goes to the motors; axes and what is added of the second to the first."""
    letter, value = re.search(r"^M852 ([IJK])(\S+)$", text, re.M).groups()  # type: ignore[union-attr]
    return *{"I": (0, 1), "J": (0, 2), "K": (1, 2)}[letter], -float(value)


def skew_klipper(text: str) -> tuple[int, int, float]:
    """skew_correction.py: the factor from two diagonals and a side, by the law of cosines; x - y factor."""
    plane, *lengths = re.search(r"^SET_SKEW (\w\w)=(\S+),(\S+),(\S+)$", text, re.M).groups()  # type: ignore[union-attr]
    ac, bd, ad = map(float, lengths)
    side = math.sqrt(2 * ac * ac + 2 * bd * bd - 4 * ad * ad) / 2.0
    factor = math.tan(math.pi / 2 - math.acos((ac * ac - side * side - ad * ad) / (2 * side * ad)))
    return "XYZ".index(plane[0]), "XYZ".index(plane[1]), -factor


def skew_rrf(text: str) -> tuple[int, int, float]:
    """Move3.cpp (AxisTransform): x + tanXY y + tanXZ z, y + tanYZ z; M556 X is tanXY S, Y tanYZ S, Z tanXZ S."""
    over, letter, value = re.search(r"^M556 S(\S+) ([XYZ])(\S+)$", text, re.M).groups()  # type: ignore[union-attr]
    return *{"X": (0, 1), "Y": (1, 2), "Z": (0, 2)}[letter], float(value) / float(over)


SKEW_CONTROLS = {"marlin": skew_marlin, "klipper": skew_klipper, "rrf": skew_rrf}
