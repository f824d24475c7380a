"""Further tables as people hand them over: languages, two rows of headers, records, units that stand elsewhere."""

from __future__ import annotations

import io
import json

import numpy as np
import openpyxl
import pandas as pd

from tests.importing.layouts.judge import AXIS, DISTANCES, GAUGE, SPOT, Layout
from tests.importing.layouts.truth import BESIDE, NINE, ON_GAUGE, comma, lines, positioning, probed, series, told

HANDED = "tables as laboratories hand them over"
LASER = "exports of laser software: targets by runs below a preamble"
CMM = "public converters of CMM reports"
ISO2 = "ISO 230-2:2014, bidirectional report"
BOTH, ONE = positioning(), positioning(cycles=1, ways=(1,))
LARGE = positioning(targets=tuple(float(t) for t in range(0, 3001, 250)))
FINE = probed()
DRIFT = series(30, 30.0)
SHARED = {"beside": BESIDE, "options": ON_GAUGE, "knows": {"--tip-radius": "2"}}
FACES = FINE[["cycle", "face", "x_mm", "y_mm", "z_mm"]]
MM = {"--unit": "mm"}


def word(r: pd.Series, up: str, down: str) -> str:
    return up if r.way > 0 else down


def wide(frame: pd.DataFrame, cell: str = "{:.3f}", mark: str = ";") -> str:
    """A row per target: there and back, cycle by cycle."""
    rows = []
    for t in sorted(frame.target.unique()):
        by = frame[frame.target == t].set_index(["cycle", "way"])["deviation"]
        cells = [cell.format(by[c, w]) for c in sorted(frame.cycle.unique()) for w in (1, -1)]
        rows.append(mark.join([f"{t:g}", *cells]))
    return "\n".join(rows) + "\n"


def book(rows: list[list[object]], merged: tuple[str, ...] = ()) -> bytes:
    made = openpyxl.Workbook()
    sheet = made.active
    assert sheet is not None
    for row in rows:
        sheet.append(row)
    for cells in merged:
        sheet.merge_cells(cells)
    stream = io.BytesIO()
    made.save(stream)
    return stream.getvalue()


def blocks(head: str, up: str, down: str, row: str) -> str:
    """A block per run and direction below a line that names it."""
    text = ""
    for (cycle, way), part in BOTH.groupby(["cycle", "way"], sort=False):
        text += head.format(n=cycle, way=up if way > 0 else down)
        text += "".join(row.format(t=r.target, v=r.reading, d=r.deviation) for _, r in part.iterrows())
    return text


def grouped(value: float, digits: int = 4) -> str:
    return f"{value:,.{digits}f}"


def swiss(value: float, digits: int = 4) -> str:
    return f"{value:,.{digits}f}".replace(",", "'")


def german(value: float, digits: int = 4) -> str:
    return f"{value:,.{digits}f}".replace(",", " ").replace(".", ",").replace(" ", ".")


def clock(seconds: float, form: str) -> str:
    return (pd.Timestamp("2026-03-02 08:15:00") + pd.Timedelta(seconds=seconds)).strftime(form)


def nested(r: pd.Series) -> dict[str, object]:
    return {"axis": "X", "commanded": {"mm": r.target}, "measured": {"mm": round(r.reading, 7)}, "way": int(r.way)}


def phd2(count: int = 30) -> tuple[str, pd.DataFrame]:
    random = np.random.default_rng(2)
    ra = random.normal(0.0, 0.4, count).round(2)
    head = (
        "PHD2 version 2.6.13 [Windows], Log version 2.5. Log enabled at 2026-03-19 21:30:00\n\n"
        "Guiding Begins at 2026-03-19 21:31:00\nDither = both axes, Dither scale = 1.000\n"
        "Pixel scale = 1.50 arc-sec/px, Binning = 1, Focal length = 500 mm\n"
        "Frame,Time,mount,dx,dy,RARawDistance,DECRawDistance,RAGuideDistance,DECGuideDistance,RADuration,RADirection,"
        "DECDuration,DECDirection,XStep,YStep,StarMass,SNR,ErrorCode\n"
    )
    body = "".join(
        f'{n + 1},{2.5 * n:.3f},"Mount",{-x:.3f},{0.1 * x:.3f},{x:.3f},{0.2 * x:.3f},{0.7 * x:.3f},0.000,'
        f"{abs(int(x * 500))},{'W' if x > 0 else 'E'},0,,,,{40000 + n},{30 + n % 3}.2,0\n"
        for n, x in enumerate(ra)
    )
    end = "Guiding Ends at 2026-03-19 21:33:00\n"
    return head + body + end, pd.DataFrame({"time_s": 2.5 * np.arange(count), "reading": ra * 1.5})


PHD2, GUIDED = phd2()
TIMED = DRIFT[["time_s", "reading"]]
CIRCLE = pd.DataFrame({"angle": np.arange(0.0, 360.0, 10.0)})
CIRCLE = CIRCLE.assign(
    reading=(100.0 + 1e-3 * (3.0 * np.cos(np.deg2rad(CIRCLE.angle)) + 0.5 * np.sin(CIRCLE.angle))).round(6)
)

LAYOUTS = [
    Layout(
        "French, there and back in columns",
        ISO2,
        AXIS,
        "Rapport de mesure\nMachine;CU 400\n\n"
        "Position cible (mm);Aller 1 (µm);Retour 1 (µm);Aller 2 (µm);Retour 2 (µm)\n" + wide(BOTH).replace(".", ","),
        told(BOTH),
    ),
    Layout(
        "Italian, a row per reading",
        HANDED,
        AXIS,
        "Posizione nominale [mm];Posizione misurata [mm];Scostamento [µm];Ciclo;Direzione\n"
        + lines(
            BOTH,
            lambda r: (
                f"{comma(r.target)};{comma(r.reading, 7)};{comma(r.deviation, 3)};{r.cycle:.0f};"
                f"{word(r, 'avanti', 'indietro')}"
            ),
        ),
        told(BOTH),
    ),
    Layout(
        "Spanish, a row per reading",
        HANDED,
        AXIS,
        "Posición nominal (mm)\tLectura (mm)\tDesviación (um)\tCiclo\tSentido\n"
        + lines(
            BOTH,
            lambda r: (
                f"{r.target:.3f}\t{r.reading:.7f}\t{r.deviation:.3f}\t{r.cycle:.0f}\t{word(r, 'adelante', 'atrás')}"
            ),
        ),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "thousands in English, tabs",
        HANDED,
        AXIS,
        "Nominal [mm]\tActual [mm]\tRun\n"
        + lines(LARGE, lambda r: f"{grouped(r.target)}\t{grouped(r.reading, 7)}\t{r.cycle:.0f}"),
        told(LARGE),
        ".txt",
    ),
    Layout(
        "thousands in German",
        HANDED,
        AXIS,
        "Sollwert [mm];Istwert [mm];Lauf\n"
        + lines(LARGE, lambda r: f"{german(r.target)};{german(r.reading, 7)};{r.cycle:.0f}"),
        told(LARGE),
    ),
    Layout(
        "thousands in Swiss",
        HANDED,
        AXIS,
        "Soll [mm];Ist [mm]\n" + lines(LARGE, lambda r: f"{swiss(r.target)};{swiss(r.reading, 7)}"),
        told(LARGE),
    ),
    Layout(
        "bars without an edge, units in a row",
        HANDED,
        AXIS,
        "Target|Deviation|Direction\nmm|um|\n"
        + lines(BOTH, lambda r: f"{r.target}|{r.deviation}|{word(r, 'fwd', 'rev')}"),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "fixed width, two rows of headers, empty cells",
        HANDED,
        AXIS,
        "   Target     Reading   Remark\n     (mm)        (mm)\n"
        + lines(
            BOTH.reset_index(),
            lambda r: f"{r.target:9.3f} {r.reading:11.6f}   {'door opened' if r['index'] == 7 else ''}".rstrip(),
        ),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "records, one per line, objects inside",
        "JSON lines",
        AXIS,
        lines(BOTH, lambda r: json.dumps(nested(r))),
        told(BOTH),
        ".jsonl",
    ),
    Layout(
        "records split into columns and data",
        "pandas, orient=split",
        AXIS,
        json.dumps({"columns": ["target_mm", "reading_mm"], "data": BOTH[["target", "reading"]].to_numpy().tolist()}),
        told(BOTH),
        ".json",
    ),
    Layout(
        "records below a head that states the unit once",
        "JSON of a laboratory's script",
        AXIS,
        json.dumps(
            {
                "instrument": "laser",
                "units": "mm",
                "runs": 2,
                "points": [{"set": r.target, "get": round(r.reading, 7)} for _, r in BOTH.iterrows()],
            }
        ),
        told(BOTH),
        ".json",
        knows={"--column target": "set", "--column reading": "get"},
    ),
    Layout(
        "laser export, runs below one another with a line each",
        LASER,
        AXIS,
        "Test: linear\nAxis: X\nUnits: mm\n"
        + blocks("\nRun {n}, {way}\nTarget, Measured\n", "forward", "reverse", "{t:.3f}, {v:.6f}\n"),
        told(BOTH),
    ),
    Layout(
        "laser export, columns of runs, statistics beside and below",
        LASER,
        AXIS,
        "Title,X axis\nDate,2026-03-02\nTemperature,20.1,C\n\n"
        "Target (mm),Run 1 + (um),Run 1 - (um),Run 2 + (um),Run 2 - (um),Mean (um),2 Sigma (um)\n"
        + "".join(f"{row},0.1,0.2\n" for row in wide(BOTH, mark=",").splitlines())
        + "Max,9,9,9,9,9,9\nAccuracy A,12.1\n",
        told(BOTH),
    ),
    Layout(
        "a row per run, unit in the first cell",
        ISO2,
        AXIS,
        "Sollposition [mm];"
        + ";".join(f"{t:g}" for t in NINE)
        + "\n"
        + "".join(
            f"Lauf {c} {'vor' if w > 0 else 'zurück'} [µm];"
            + ";".join(
                comma(BOTH[(BOTH.cycle == c) & (BOTH.way == w) & (BOTH.target == t)].deviation.iloc[0], 3) for t in NINE
            )
            + "\n"
            for c in (1, 2)
            for w in (1, -1)
        )
        + "Mittelwert;"
        + ";".join("0,1" for _ in NINE)
        + "\n",
        told(BOTH),
    ),
    Layout(
        "workbook, merged cycles over directions and a row of units",
        HANDED,
        AXIS,
        book(
            [
                ["Positioniergenauigkeit X", None, None, None, None],
                ["Zielposition", "Zyklus 1", None, "Zyklus 2", None],
                [None, "vorwärts", "rückwärts", "vorwärts", "rückwärts"],
                ["mm", "µm", "µm", "µm", "µm"],
                *[[float(cell) for cell in row.split(";")] for row in wide(BOTH).splitlines()],
            ],
            ("A1:E1", "B2:C2", "D2:E2"),
        ),
        told(BOTH),
        ".xlsx",
    ),
    Layout(
        "workbook whose target stands once for its readings, merged",
        HANDED,
        AXIS,
        book(
            [
                ["Target [mm]", "Direction", "Reading [mm]"],
                *[
                    [t if n == 0 else None, d, round(r, 7)]
                    for t in NINE
                    for n, (d, r) in enumerate(
                        zip(("up", "down"), [t + 1e-3 * (t / 100.0 + 1), t + 1e-3 * (t / 100.0 - 1)], strict=True)
                    )
                ],
            ]
        ),
        pd.DataFrame(
            [(t, w, 1, t / 100.0 + w) for t in NINE for w in (1, -1)], columns=["target", "way", "cycle", "deviation"]
        ),
        ".xlsx",
    ),
    Layout(
        "header over two lines in quotes",
        HANDED,
        AXIS,
        '"Target\n[mm]","Deviation\n[um]"\n' + lines(BOTH, lambda r: f"{r.target},{r.deviation}"),
        told(BOTH),
    ),
    Layout(
        "comments and pauses between the rows",
        HANDED,
        AXIS,
        "# X axis\nTarget [mm];Reading [mm]\n"
        + lines(
            BOTH.reset_index(),
            lambda r: f"{r.target};{r.reading}" + ("\n# pause\n" if r["index"] % 9 == 8 else ""),
        ),
        told(BOTH),
    ),
    Layout(
        "UTF-16 as spreadsheets save text",
        HANDED,
        AXIS,
        ("Soll [mm]\tAbweichung [µm]\n" + lines(BOTH, lambda r: f"{comma(r.target)}\t{comma(r.deviation, 3)}")).encode(
            "utf-16"
        ),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "Windows-1252, means below",
        HANDED,
        AXIS,
        (
            "Prüfprotokoll\nPrüfer;Müller\n\nSollmaß [mm];Istmaß [mm];Abw. [µm]\n"
            + lines(BOTH, lambda r: f"{comma(r.target)};{comma(r.reading, 7)};{comma(r.deviation, 3)}")
            + "\nMittelwert;;1,2\nSpannweite;;8,1\n"
        ).encode("cp1252"),
        told(BOTH),
    ),
    Layout(
        "dial gauge against gauge blocks",
        HANDED,
        AXIS,
        "Gauge block (mm)\tDial (mm)\n" + lines(ONE, lambda r: f"{r.target}\t{r.reading:.6f}"),
        told(ONE),
        ".txt",
        "dial",
    ),
    Layout(
        "autocollimator and rotary table, signs of angle",
        HANDED,
        AXIS,
        "Winkel [°];Abweichung [″]\n" + lines(BOTH, lambda r: f"{comma(r.target, 1)};{comma(r.deviation, 3)}"),
        told(BOTH),
        sensor="autocollimator",
        units=("deg", "arcsec"),
    ),
    Layout(
        "measuring system compared, names of features",
        CMM,
        AXIS,
        "ID;Merkmal;Nennmaß;Istmaß;OT;UT;Abw.\n"
        + lines(
            ONE.reset_index(),
            lambda r: (
                f"{int(r['index']) + 1};Abstand {int(r['index']) + 1};{comma(r.target)};{comma(r.reading, 6)};0,010;"
                f"-0,010;{comma(r.deviation * 1e-3, 6)}"
            ),
        ),
        told(ONE),
        sensor="touch",
        knows={**MM, "--deviation-unit": "mm"},
    ),
    Layout(
        "points compared in three coordinates, one of them wanted",
        CMM,
        AXIS,
        "Name,Nom X,Nom Y,Nom Z,Meas X,Meas Y,Meas Z,Dev X,Dev Y,Dev Z\n"
        + lines(
            ONE.reset_index(),
            lambda r: (
                f"P{int(r['index'])},{r.target:.4f},{10 + r['index']:.4f},5.0000,{r.reading:.6f},"
                f"{10.002 + r['index']:.4f},5.0010,{r.deviation * 1e-3:.6f},0.0020,0.0010"
            ),
        ),
        told(ONE),
        sensor="touch",
        knows={"--column target": "Nom X", "--column reading": "Meas X", **MM},
    ),
    Layout(
        "control, setpoint and actual value in one line each",
        "measuring cycles of controls (unconfirmed)",
        AXIS,
        "MESSPROTOKOLL\n"
        + lines(
            ONE, lambda r: f"Sollwert: {r.target:.3f} Istwert: {r.reading:.6f} Differenz: {r.deviation * 1e-3:.6f}"
        ),
        told(ONE),
        ".txt",
        "touch",
        knows={**MM, "--deviation-unit": "mm"},
    ),
    Layout(
        "date and time in two columns, German",
        HANDED,
        SPOT,
        "Datum;Uhrzeit;Weg [µm];Temp. Spindel [°C]\n"
        + lines(
            DRIFT,
            lambda r: f"{clock(r.time_s, '%d.%m.%Y')};{clock(r.time_s, '%H:%M:%S')};{comma(r.reading * 1e3, 3)};21,5",
        ),
        TIMED,
        sensor="inductive",
    ),
    Layout(
        "archiver, nanoseconds and a zone",
        "EPICS archiver appliance, CSV",
        SPOT,
        "# PV: LAB:POS, units: mm\nTimestamp,LAB:POS,Severity\n"
        + lines(DRIFT, lambda r: f"{clock(r.time_s, '%Y-%m-%dT%H:%M:%S')}.123456789Z,{r.reading:.6f},0"),
        TIMED,
        sensor="inductive",
        knows=MM,
    ),
    Layout(
        "logger with a word per row and one overflow",
        "loggers of displacement sensors",
        SPOT,
        "No.,Time,Judge,OUT1 [mm]\n"
        + lines(
            DRIFT.reset_index(),
            lambda r: (
                f"{int(r['index']) + 1},{clock(r.time_s, '%H:%M:%S')},{'NG' if r['index'] in (4, 9) else 'GO'},"
                + ("-FFFFFFF" if r["index"] == 9 else f"{r.reading:.6f}")
            ),
        ),
        TIMED.drop(index=9),
        sensor="laser",
        knows={"--accept": "missing", "--rows": "Judge=*"},
    ),
    Layout(
        "time without a unit",
        HANDED,
        SPOT,
        "Time,Reading [mm]\n" + lines(DRIFT, lambda r: f"{r.time_s / 60.0},{r.reading:.6f}"),
        TIMED,
        sensor="inductive",
        knows={"--time-unit": "min"},
        must_ask=True,
    ),
    Layout(
        "guide log",
        "PHD2 guide log 2.5",
        SPOT,
        PHD2,
        GUIDED,
        ".txt",
        "optical",
        knows={"--column reading": "RARawDistance", "--rows": "mount=*"},
        units=("arcsec", "arcsec"),
    ),
    Layout(
        "circular test, radius over angle",
        "ISO 230-4",
        SPOT,
        "Angle [deg],Radius [mm]\n" + lines(CIRCLE, lambda r: f"{r.angle:g},{r.reading:.6f}"),
        CIRCLE[["reading"]],
        covariates=["Angle [deg]"],
    ),
    Layout(
        "French distances",
        HANDED,
        DISTANCES,
        "De;Vers;Distance (m)\n"
        + "".join(
            f"P{a};P{b};{comma(10.0 * (b - a) + 1e-3 * a + 2e-4 * b, 5)}\n"
            for a in range(1, 5)
            for b in range(a + 1, 5)
        ),
        pd.DataFrame(
            [10.0 * (b - a) + 1e-3 * a + 2e-4 * b for a in range(1, 5) for b in range(a + 1, 5)], columns=["reading"]
        ),
        sensor="edm",
        units=("m", "mm"),
    ),
    Layout(
        "points, German, units in a row, tabs",
        HANDED,
        GAUGE,
        "Messpunkt-Nr\tX-Istwert\tY-Istwert\tZ-Istwert\n\tmm\tmm\tmm\n"
        + lines(FINE.reset_index(), lambda r: f"{int(r['index']) + 1}\t{comma(r.x_mm)}\t300,0000\t200,0000"),
        FACES,
        ".txt",
        **SHARED,
    ),
    Layout(
        "points as records",
        "JSON of a script",
        GAUGE,
        json.dumps([{"id": n, "x": r.x_mm, "y": 300.0, "z": 200.0} for n, (_, r) in enumerate(FINE.iterrows(), 1)]),
        FACES,
        ".json",
        **SHARED,
    ),
    Layout(
        "points in a workbook, merged title and two rows of headers",
        HANDED,
        GAUGE,
        book(
            [
                ["Messpunkte", None, None, None],
                ["Punkt", "Position", None, None],
                [None, "X", "Y", "Z"],
                ["", "mm", "mm", "mm"],
                *[[f"P{n}", r.x_mm, 300.0, 200.0] for n, (_, r) in enumerate(FINE.iterrows(), 1)],
            ],
            ("A1:D1", "B2:D2"),
        ),
        FACES,
        ".xlsx",
        **SHARED,
    ),
    Layout(
        "points with normals, fixed width, Italian",
        HANDED,
        GAUGE,
        " Punto         X         Y         Z    I    J    K\n"
        + lines(
            FINE.reset_index(),
            lambda r: (
                f"{int(r['index']) + 1:6d}{r.x_mm:10.4f}{300.0:10.4f}{200.0:10.4f}"
                f"{-1 if r.face % 2 else 1:5d}    0    0"
            ),
        ),
        FACES,
        ".txt",
        **SHARED,
    ),
    Layout(
        "points in um",
        HANDED,
        GAUGE,
        "X (um);Y (um);Z (um)\n" + lines(FINE, lambda r: f"{r.x_mm * 1e3:.1f};300000.0;200000.0"),
        FACES,
        **SHARED,
    ),
    Layout(
        "points, nominal beside actual",
        CMM,
        GAUGE,
        "Name;X nominal;Y nominal;Z nominal;X actual;Y actual;Z actual\n"
        + lines(
            FINE.reset_index(),
            lambda r: f"P{int(r['index'])};{round(r.x_mm):.3f};300.000;200.000;{r.x_mm:.4f};300.0000;200.0000",
        ),
        FACES,
        **SHARED,
    ),
    Layout(
        "a summary alone, no readings",
        "Marlin, M48 without V4",
        SPOT,
        "M48\nFinished!\nMean: 2.500125 Min: 2.497 Max: 2.503 Range: 0.005\nStandard Deviation: 0.001250\n",
        None,
        ".log",
        "touch",
        knows=MM,
    ),
]
