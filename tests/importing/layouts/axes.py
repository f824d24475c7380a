"""One positioning test written down as programs and people of different make do it.

Two cycles over nine targets there and back. Every layout is a text of the same readings; the unit of deviations is a
few um, or arcsec, so that no digit is lost.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Sequence

import numpy as np
import openpyxl
import pandas as pd

from tests.importing.layouts import judge

TARGETS = np.arange(0.0, 401.0, 50.0)
CYCLES = (1, 2)


def deviation(target: float, way: int, cycle: int) -> float:
    """What was read, um or arcsec: no two readings alike, so that none can stand for another."""
    return round(0.011 * target + 1.3 * way + 0.2 * cycle + 0.01 * (target / 50.0 % 3.0), 3)


def travelled() -> list[tuple[float, int, int]]:
    """Target, way and cycle in the order of travel."""
    there = [(t, 1, c) for c in CYCLES for t in TARGETS]
    back = [(t, -1, c) for c in CYCLES for t in TARGETS[::-1]]
    return sorted([*there, *back], key=lambda one: (one[2], -one[1]))


def truth() -> pd.DataFrame:
    rows = [(t, w, c, deviation(t, w, c)) for t, w, c in travelled()]
    return pd.DataFrame(rows, columns=["target", "way", "cycle", "deviation"])


def written(
    name: str,
    content: str | bytes,
    options: Sequence[str] = (),
    unit: str = "mm",
    deviation_unit: str = "um",
    sensor: str = "laser",
    suffix: str = ".csv",
    covariates: Sequence[str] = (),
    factor: float = 1.0,
) -> judge.Layout:
    """``content``: what stands in the file; ``factor``: unit of its targets over those that :func:`truth` has."""
    of_file = {"mm": 1e-3}.get(deviation_unit, 1.0)  # metres with readings in metres: told in mm
    told = truth()
    told = told.assign(target=told["target"] * factor, deviation=told["deviation"] * of_file)
    units = (unit, deviation_unit)
    made = "tables as programs and people of different make write them"
    return judge.Layout(
        name, made, judge.AXIS, content, told, suffix, sensor, options, units=units, covariates=covariates
    )


def rows_of(line: Callable[[float, int, int], str], header: str, above: str = "", below: str = "") -> str:
    return above + header + "\n" + "\n".join(line(*one) for one in travelled()) + "\n" + below


def wide(line: Callable[[float], str], header: str, above: str = "", below: str = "") -> str:
    return above + header + "\n" + "\n".join(line(t) for t in TARGETS) + "\n" + below


def listed(separator: str) -> Callable[[float], str]:
    """A row of a wide table: the target, then its deviations there and back, cycle by cycle."""
    return lambda t: separator.join([f"{t:g}", *(f"{v}" for v in all_of(t))])


def de(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}f}".replace(".", ",")


def all_of(t: float) -> list[float]:
    """Deviations of a target: there and back, cycle by cycle."""
    return [deviation(t, w, c) for c in CYCLES for w in (1, -1)]


def swept(counted: bool) -> str:
    """A column for each direction, sweep below sweep; ``counted``: with the number of the run."""
    rows = [(c, t) for c in CYCLES for t in TARGETS]
    lines = [f"{f'{c};' * counted}{de(t)};{de(deviation(t, 1, c))};{de(deviation(t, -1, c))}" for c, t in rows]
    return "Run;" * counted + "Target (mm);Forward (um);Reverse (um)\n" + "\n".join(lines) + "\n"


def laser_sections() -> str:
    """Targets in a list, readings by run and target, as laser software with sections writes them."""
    runs = [(r, w, c) for r, (c, w) in enumerate([(c, w) for c in CYCLES for w in (1, -1)], 1)]
    order = {1: range(len(TARGETS)), -1: range(len(TARGETS) - 1, -1, -1)}
    data = [f"{r:5d}{n + 1:5d}   {deviation(TARGETS[n], w, c):.6f}" for r, w, c in runs for n in order[w]]
    listed = "\n".join(" ".join(f"{t:.4f}" for t in TARGETS[i : i + 5]) for i in (0, 5))
    head = "HEADER::\nFile Type: Linear\nOwner: A laboratory\n\nTARGET DATA::\nTarget-count: 9\nTargets :\n"
    return f"{head}{listed}\nFlags: 0 0 1\n\nRUNS::\nRun-count:4\n\nDEVIATIONS::\nRun Target Data:\n" + "\n".join(
        [*data, "", "ENVIRONMENT::", "Air temp: 20.1", "EOF::"]
    )


def workbook(rows: Sequence[Sequence[object]], sheet: str, cover: bool = True) -> bytes:
    book = openpyxl.Workbook()
    first = book.active
    assert first is not None
    if cover:
        first.title = "Cover"
        first.append(["Calibration of axis X"])
        first = book.create_sheet(sheet)
    for row in rows:
        first.append(list(row))
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def blocks() -> str:
    """A block of rows for every run, with its name above."""
    text = "Positioning test of X\n"
    for c in CYCLES:
        for w in (1, -1):
            targets = TARGETS if w > 0 else TARGETS[::-1]
            text += f"\nRun {c} {'forward' if w > 0 else 'reverse'}\n"
            text += "Position (mm)   Error (um)\n" if (c, w) == (1, 1) else ""
            text += "\n".join(f"{t:10.3f}   {deviation(t, w, c):10.3f}" for t in targets) + "\n"
    return text


def n_of(t: float, w: int, c: int) -> int:
    return travelled().index((t, w, c)) + 1


def records(**names: str) -> list[dict[str, object]]:
    return [
        {names["t"]: t, names["r"]: t + deviation(t, w, c) * 1e-3, names["w"]: "up" if w > 0 else "down", names["c"]: c}
        for t, w, c in travelled()
    ]


LAYOUTS = [
    written(
        "plain rows", rows_of(lambda t, w, c: f"{t},{deviation(t, w, c)},{w},{c}", "target_mm,deviation_um,way,cycle")
    ),
    written(
        "reading beside target, way and cycle from the order",
        rows_of(lambda t, w, c: f"{t:.4f};{t + deviation(t, w, c) * 1e-3:.6f}", "Nominal [mm];Measured [mm]"),
    ),
    written(
        "German, decimal comma, Windows-1252, preamble and means below",
        wide(
            lambda t: ";".join([de(t, 1), *(de(v) for v in all_of(t))]),
            "Sollposition [mm];Abw. Lauf 1 hin [µm];Abw. Lauf 1 rück [µm];Abw. Lauf 2 hin [µm];Abw. Lauf 2 rück [µm]",
            "Prüfprotokoll;;;;\nMaschine;VMC 850;;;\nPrüfer;Müller;;;\n\n",
            "Mittelwert;0,1;0,2;0,3;0,4\nSpannweite;1,0;1,1;1,2;1,3\n",
        ).encode("cp1252"),
        ["--column", "deviation=Abw.*"],
    ),
    written(
        "two header rows with merged names and a row of units",
        wide(
            listed("\t"),
            "Target\tfwd\tbwd\tfwd\tbwd\nmm\tum\tum\tum\tum",
            "\tRun 1\t\tRun 2\t\n",
        ),
    ),
    written(
        "arrows for directions, one column each",
        wide(
            listed("|"),
            "P [mm]|x1↑ [µm]|x1↓ [µm]|x2↑ [µm]|x2↓ [µm]",
        ),
        ["--column", "target=P"],
    ),
    written(
        "a form of ISO 230-2: a column for every target, a row for every run",
        "Machine;VMC 850\n\ni;"
        + ";".join(str(n) for n in range(1, 10))
        + "\nTarget position [mm];"
        + ";".join(f"{t:g}" for t in TARGETS)
        + "\n"
        + "\n".join(
            f"x{c} {'↑' if w > 0 else '↓'};" + ";".join(f"{deviation(t, w, c)}" for t in TARGETS)
            for c in CYCLES
            for w in (1, -1)
        )
        + "\nMean unidirectional;"
        + ";".join("0.5" for _ in TARGETS)
        + "\n",
        ["--deviation-unit", "um"],
    ),
    written(
        "a sign and a number for every column",
        wide(listed(";"), "target [mm];+1 [um];-1 [um];+2 [um];-2 [um]"),
    ),
    written("forward and reverse, sweeps below one another", swept(counted=False)),
    written("forward and reverse, sweeps below one another, with a column Run", swept(counted=True)),
    written("sections of laser software", laser_sections(), suffix=".rtl"),
    written("a block for every run", blocks(), suffix=".txt"),
    written(
        "no header",
        "\n".join(f"{t:.3f} {deviation(t, w, c):.3f}" for t, w, c in travelled()),
        ["--header", "target_mm,deviation_um"],
        suffix=".dat",
    ),
    written(
        "header in a comment, as numerical programs write it",
        "# target_mm reading_mm\n"
        + "\n".join(f"{t:.6f} {t + deviation(t, w, c) * 1e-3:.6f}" for t, w, c in travelled()),
        suffix=".txt",
    ),
    written(
        "inches and microinches",
        rows_of(lambda t, w, c: f"{t},{deviation(t, w, c)}", "Command (in),Error (uin)"),
        unit="inch",
        deviation_unit="uin",
    ),
    written(
        "metres, readings in metres",
        rows_of(lambda t, w, c: f"{t * 1e-3:.3f},{(t + deviation(t, w, c) * 1e-3) * 1e-3:.9f}", "ref_m,laser_m"),
        unit="m",
        deviation_unit="mm",
        factor=1e-3,
    ),
    written(
        "stage in um, deviations in nm",
        rows_of(lambda t, w, c: f"{t},{deviation(t, w, c)}", "Setpoint (um),Deviation (nm)"),
        unit="um",
        deviation_unit="nm",
        sensor="capacitive",
    ),
    written(
        "rotary table in deg and arcsec",
        rows_of(
            lambda t, w, c: f"{t};{deviation(t, w, c)};{'CW' if w > 0 else 'CCW'}", 'Angle [°];Error ["];Direction'
        ),
        unit="deg",
        deviation_unit="arcsec",
        sensor="autocollimator",
    ),
    written(
        "rotary encoder, readings in deg",
        rows_of(lambda t, w, c: f"{t:.1f},{t + deviation(t, w, c) / 3600.0:.9f}", "true angle (deg),encoder (deg)"),
        unit="deg",
        deviation_unit="arcsec",
        sensor="encoder",
    ),
    written(
        "dial gauge list, units nowhere",
        rows_of(lambda t, w, c: f"{t:.0f}   {deviation(t, w, c):.3f}", "Position   Dial"),
        ["--unit", "mm", "--deviation-unit", "um"],
        sensor="dial",
        suffix=".txt",
    ),
    written(
        "numbered points with humidity and temperature",
        rows_of(
            lambda t, w, c: f"{int(t / 50) + 1},{t},{deviation(t, w, c)},{20 + c / 10},{40 + w}",
            "Point No,Nominal mm,Deviation um,Material temp (C),Humidity %",
        ),
        covariates=["Material temp_C", "Humidity %"],
    ),
    written(
        "date and time in every row",
        rows_of(
            lambda t, w, c: f"2026-03-02 10:{c:02d}:{int(t / 50) + (30 if w < 0 else 0):02d},{t},{deviation(t, w, c)}",
            "Timestamp,Target (mm),Dev (um)",
        ),
    ),
    written(
        "date and time of day in two columns",
        rows_of(
            lambda t, w, c: (
                f"02.03.2026;10:{c:02d}:{int(t / 50) + (30 if w < 0 else 0):02d};{de(t)};{de(deviation(t, w, c))}"
            ),
            "Datum;Uhrzeit;Soll [mm];Abweichung [µm]",
        ),
    ),
    written(
        "JSON records inside an object",
        json.dumps({"machine": "VMC", "data": records(t="nominal_mm", r="actual_mm", w="direction", c="run")}),
        suffix=".json",
    ),
    written(
        "one JSON object per line",
        "\n".join(json.dumps(one) for one in records(t="target_mm", r="measured_mm", w="dir", c="cycle")),
        suffix=".jsonl",
    ),
    written(
        "JSON lists by column",
        json.dumps(
            {
                "target_mm": [t for t, _, _ in travelled()],
                "deviation_um": [deviation(*one) for one in travelled()],
                "direction": [w for _, w, _ in travelled()],
            }
        ),
        suffix=".json",
    ),
    written(
        "Excel, a sheet by name, a column per cycle and direction",
        workbook(
            [
                ["Machine", "VMC"],
                [],
                ["", "Cycle 1", "", "Cycle 2", ""],
                ["Target position (mm)", "+ (um)", "- (um)", "+ (um)", "- (um)"],
                *([t, *all_of(t)] for t in TARGETS),
                ["Mean", 1.0, 2.0, 3.0, 4.0],
            ],
            "X axis",
        ),
        ["--sheet", "X axis"],
        suffix=".xlsx",
    ),
    written(
        "Excel, one sheet, rows",
        workbook(
            [["Target [mm]", "Actual [mm]"], *([t, t + deviation(t, w, c) * 1e-3] for t, w, c in travelled())],
            "",
            False,
        ),
        suffix=".xlsx",
    ),
    written(
        "targets given on the command line, readings alone",
        rows_of(lambda t, w, c: f"{n_of(t, w, c)};{t + deviation(t, w, c) * 1e-3:.6f}", "Nr;Messwert [mm]"),
        ["--targets", "0:400:50"],
    ),
    written(
        "targets by their number in a list",
        rows_of(lambda t, w, c: f"{int(t / 50) + 1};{deviation(t, w, c):.3f}", "target;error [um]"),
        ["--targets", "0,50,100,150,200,250,300,350,400", "--unit", "mm"],
    ),
    written(
        "reading and deviation both there",
        rows_of(
            lambda t, w, c: f"{t},{t + deviation(t, w, c) * 1e-3:.6f},{deviation(t, w, c)},{c}",
            "Target mm,Measured mm,Error um,Run",
        ),
    ),
    written(
        "a row for every cycle is a column for every target: sep= line and thousands",
        "sep=;\n"
        + rows_of(
            lambda t, w, c: f"{de(t, 1)};{de(deviation(t, w, c))};{'+' if w > 0 else '-'}", "Ziel mm;Fehler µm;+/-"
        ),
        ["--column", "way=+/-"],
    ),
    written(
        "UTF-16 with tabs, French",
        rows_of(lambda t, w, c: f"{de(t, 1)}\t{de(deviation(t, w, c))}", "Consigne (mm)\tÉcart (µm)").encode("utf-16"),
    ),
    written(
        "readings against gauge blocks, dial gauge in mm",
        rows_of(
            lambda t, w, c: f"{t:.1f} {t + deviation(t, w, c) * 1e-3:.6f} {'rising' if w > 0 else 'falling'}",
            "Reference/mm Indication/mm Sense",
        ),
        sensor="dial",
        suffix=".txt",
    ),
]
