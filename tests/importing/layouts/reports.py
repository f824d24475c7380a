"""Reports of coordinate measuring machines, measuring logs of controls: a row per coordinate or a block per feature."""

from __future__ import annotations

import pandas as pd

from tests.importing.layouts.interferometers import book
from tests.importing.layouts.judge import AXIS, Layout
from tests.importing.layouts.truth import comma, lines, positioning, told

PCDMIS = "public parsers of PC-DMIS text reports (rows AX, NOMINAL, MEAS, tolerances, DEV, OUTTOL)"
CALYPSO = "public converter of Calypso's chr table (planid, partnb, id, type, idsymbol, actual, nominal, ..)"
UNCONFIRMED = "unconfirmed: no description found, form after the controls' manuals as remembered"
X = positioning((10.0, 30.0, 50.0, 70.0, 90.0, 110.0), 1, (1,)).drop(columns="reading")
X = X.assign(deviation=(X.deviation * 10).round(0) / 10.0).assign(reading=lambda t: t.target + t.deviation * 1e-3)
CHR = "planid partnb id type idsymbol actual nominal uppertol lowertol deviation exceed featureid unit"
SIDE = X.reset_index(drop=True).assign(nominal=5.0, measured=lambda t: 5.02 + 1e-3 * (t.index % 3))
ROWS_OF = {"--rows": "X"}
"""The rows of one axis."""
HEAD = "AX    NOMINAL    MEAS       +TOL       -TOL      DEV     OUTTOL"
NEWER = "AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL"


def dim(number: int, x: pd.Series, newer: bool = False, side: bool = True, diameter: bool = False) -> str:
    """The block of a feature."""
    text = f"DIM LOC{number}= LOCATION OF POINT PNT{number}  UNITS=MM\n{NEWER if newer else HEAD}\n"
    rows = [("X", x.target, x.reading)] + [("Y", 5.0, SIDE.measured[number - 1])] * side
    rows += [("D", 2.167, 2.167 + 1e-3 * number)] * diameter
    for name, nominal, measured in rows:
        own = [measured, 0.05, 0.05] if not newer else [0.05, 0.05, measured]
        cells = [nominal, *own, measured - nominal, 0.0]
        text += name + "".join(f"{cell:12.4f}" for cell in cells) + "\n"
    return text


def dims(**choice: bool) -> str:
    return "".join(dim(number, one, **choice) for number, (_, one) in enumerate(X.iterrows(), 1))


def listed(delimiter: str, decimal_comma: bool = False, kinds: tuple[str, ...] = ("X", "Y", "D")) -> str:
    """Feature, axis, nominal, actual, deviation and tolerance, a row per coordinate."""
    text = delimiter.join(["Feature", "Axis", "Nominal", "Actual", "Deviation", "Tol"]) + "\n"
    for number, (_, one) in enumerate(X.iterrows(), 1):
        own = {"X": (one.target, one.reading), "Y": (5.0, SIDE.measured[number - 1]), "D": (8.0, 8.001 + 1e-4 * number)}
        for kind in kinds:
            numbers = [own[kind][0], own[kind][1], own[kind][1] - own[kind][0], 0.05]
            cells = [comma(value) if decimal_comma else f"{value:.4f}" for value in numbers]
            text += delimiter.join([f"Hole{number}", kind, *cells]) + "\n"
    return text


def calypso() -> str:
    text = CHR.replace(" ", "\t") + "\n"
    for number, (_, one) in enumerate(X.iterrows(), 1):
        for axis, nominal, actual in (
            ("X", one.target, one.reading),
            ("Y", 5.0, SIDE.measured[number - 1]),
            ("D", 16.0, 16.002 + 1e-4 * number),
        ):
            kind = {"X": "xValue", "Y": "yValue", "D": "diameter"}[axis]
            numbers = [actual, nominal, 0.05, -0.05, actual - nominal]
            cells = ["plate", "7", f"Hole{number}_{axis}", f"{axis}1", kind, *(f"{value:.7f}" for value in numbers)]
            text += "\t".join([*cells, "", f"Hole{number}", "mm"]) + "\n"
    return text


def protocol() -> str:
    """A printed protocol: a feature a line."""
    text = "Feature       Nominal    Upper    Lower    Actual    Deviation\n"
    return text + "".join(
        f"Point{number:<8d}{one.target:9.4f}   0.0500  -0.0500  {one.reading:9.4f}   {one.deviation * 1e-3:8.4f}\n"
        for number, (_, one) in enumerate(X.iterrows(), 1)
    )


def excel() -> bytes:
    head = ["Dimension", "AX", "NOMINAL", "MEAS", "+TOL", "-TOL", "DEV", "OUTTOL"]
    rows: list[list[object]] = [["Part name", "plate"], ["Rev", "1"], ["Ser no", "7"], [], list(head)]
    for number, (_, one) in enumerate(X.iterrows(), 1):
        y = float(SIDE.measured[number - 1])
        dev = round(one.deviation * 1e-3, 4)
        rows.append([f"LOC{number}", "X", one.target, round(one.reading, 4), 0.05, 0.05, dev, 0])
        rows.append([f"LOC{number}", "Y", 5.0, y, 0.05, 0.05, round(y - 5.0, 4), 0])
    return book(rows)


MM = {"--unit": "mm", "--deviation-unit": "mm"}
TOLD = told(X)
LAYOUTS = [
    Layout(
        "PC-DMIS text report, X and Y of every point",
        PCDMIS,
        AXIS,
        dims(),
        TOLD,
        ".txt",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "PC-DMIS text report with diameters",
        PCDMIS,
        AXIS,
        dims(diameter=True),
        TOLD,
        ".txt",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "PC-DMIS text report, tolerances before the reading, X alone",
        PCDMIS,
        AXIS,
        dims(newer=True, side=False),
        TOLD,
        ".txt",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "PC-DMIS report in Excel",
        PCDMIS,
        AXIS,
        excel(),
        TOLD,
        ".xlsx",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "Calypso table of characteristics",
        CALYPSO,
        AXIS,
        calypso(),
        TOLD,
        ".txt",
        "touch",
        knows={**ROWS_OF, **MM, "--rows": "xValue"},
    ),
    Layout(
        "Calypso protocol, a feature a line",
        "public parser of Calypso text reports (Feature, Nominal, Upper, Lower, Actual, Deviation)",
        AXIS,
        protocol(),
        TOLD,
        ".txt",
        "touch",
        knows=MM,
    ),
    Layout(
        "report of any make: feature and axis in columns",
        "public converters of CMM reports",
        AXIS,
        listed(","),
        TOLD,
        ".csv",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "the same, German numbers",
        "public converters of CMM reports",
        AXIS,
        listed(";", True, ("X", "Y")),
        TOLD,
        ".csv",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "report of one axis, X in every row",
        "public converters of CMM reports",
        AXIS,
        listed("\t", False, ("X",)),
        TOLD,
        ".txt",
        "touch",
        knows={**ROWS_OF, **MM},
    ),
    Layout(
        "measuring log of a HEIDENHAIN cycle for one coordinate",
        UNCONFIRMED,
        AXIS,
        "MEASURING LOG FROM CYCLE 427\nDATE: 02-03-2026\nTIME: 10:11:12\n\n"
        + lines(
            X,
            lambda r: (
                f"NOMINAL VALUE : {r.target:.4f}\nACTUAL VALUE : {r.reading:.4f}\n"
                f"DEVIATION : {r.deviation * 1e-3:.4f}\n"
            ),
        ),
        TOLD,
        ".txt",
        "touch",
        knows=MM,
    ),
    Layout(
        "measuring protocol of SINUMERIK as a table",
        UNCONFIRMED,
        AXIS,
        "Measuring protocol;02.03.2026;10:11:12\nCycle;Axis;Setpoint [mm];Actual value [mm];Difference [mm]\n"
        + lines(X, lambda r: f"CYCLE978;X;{r.target:.4f};{r.reading:.4f};{r.deviation * 1e-3:.4f}"),
        TOLD,
        ".csv",
        "touch",
        knows={**ROWS_OF, **MM, "--column deviation": "Difference [mm]"},
    ),
]
