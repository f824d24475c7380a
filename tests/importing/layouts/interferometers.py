"""Tables of interferometers, dial gauges and people: columns of targets and readings, of either sign."""

from __future__ import annotations

import io

import numpy as np
import openpyxl
import pandas as pd

from tests.importing.layouts.judge import AXIS, DISTANCES, Layout
from tests.importing.layouts.truth import NINE, comma, lines, positioning, told

ISO = "ISO 230-2:2014, tables of the test report"
HANDED = "tables as laboratories hand them over (findings of the project)"
BOTH = positioning()
ONE = positioning(cycles=1, ways=(1,))


def book(rows: list[list[object]]) -> bytes:
    """A workbook of one sheet."""
    made = openpyxl.Workbook()
    sheet = made.active
    assert sheet is not None
    for row in rows:
        sheet.append(row)
    stream = io.BytesIO()
    made.save(stream)
    return stream.getvalue()


def scan(count: int = 1201) -> pd.DataFrame:
    """A position every 0.25 mm, one sweep."""
    target = np.arange(count) * 0.25
    deviation = (0.008 * target + 1.5 * np.sin(2.0 * np.pi * target / 10.0) + 0.3).round(3)
    frame = pd.DataFrame({"target": target, "way": 1, "cycle": 1, "deviation": deviation})
    return frame.assign(reading=(target + deviation * 1e-3).round(7))


SCAN = scan()
PAIRS = {"--column target": "Commanded [mm]", "--column reading": "Measured [mm]"}


def forwards_and_back(t: float) -> list[str]:
    """The cells of a row of a wide table: cycle by cycle, there and back."""
    found = BOTH[BOTH.target == t].set_index(["cycle", "way"])["deviation"]
    return [f"{found[c, w]:.3f}" for c in (1, 2) for w in (1, -1)]


LAYOUTS = [
    Layout(
        "Soll, Ist and Diff, decimal comma",
        HANDED,
        AXIS,
        "Messprotokoll Laserinterferometer\nMaschine;VMC 850\n\nNr.;Soll [mm];Ist [mm];Diff [µm]\n"
        + lines(
            BOTH.reset_index(),
            lambda r: f"{int(r['index']) + 1};{comma(r.target)};{comma(r.reading, 7)};{comma(r.deviation, 3)}",
        ),
        told(BOTH),
    ),
    Layout(
        "difference Soll-Ist",
        HANDED,
        AXIS,
        "Sollposition [mm];Soll-Ist [µm]\n" + lines(BOTH, lambda r: f"{comma(r.target)};{comma(-r.deviation, 3)}"),
        told(BOTH),
    ),
    Layout(
        "nominal minus actual",
        HANDED,
        AXIS,
        "Nominal (mm),Nominal - Actual (um)\n" + lines(BOTH, lambda r: f"{r.target},{-r.deviation}"),
        told(BOTH),
    ),
    Layout(
        "actual minus nominal, in mm",
        HANDED,
        AXIS,
        "Nominal (mm),Actual - Nominal (mm)\n" + lines(BOTH, lambda r: f"{r.target},{r.deviation * 1e-3:.6f}"),
        told(BOTH),
    ),
    Layout(
        "Diff whose sign nothing states",
        HANDED,
        AXIS,
        "Target (mm),Diff (um)\n" + lines(BOTH, lambda r: f"{r.target},{r.deviation}"),
        told(BOTH),
        knows={"--column deviation": "Diff (um)"},
    ),
    Layout(
        "target and commanded position beside the reading",
        HANDED,
        AXIS,
        "Target [mm],Commanded [mm],Measured [mm]\n"
        + lines(ONE, lambda r: f"{r.target},{r.target + 0.5},{r.target + 0.5 + r.deviation * 1e-3:.6f}"),
        told(ONE.assign(target=ONE.target + 0.5)),
        knows=PAIRS,
        must_ask=True,
    ),
    Layout(
        "reference, command and reading, the reference being an encoder",
        HANDED,
        AXIS,
        "Cmd (mm)\tRef (mm)\tLaser (mm)\n"
        + lines(ONE, lambda r: f"{r.target}\t{r.target + 0.0071:.4f}\t{r.reading:.6f}"),
        told(ONE),
        ".txt",
        knows={"--column target": "Cmd (mm)", "--column reading": "Laser (mm)"},
        must_ask=True,
    ),
    Layout(
        "workbook with two rows of headers",
        HANDED,
        AXIS,
        book(
            [
                ["Positioning accuracy"],
                [],
                ["Target", "Cycle 1", None, "Cycle 2", None],
                ["mm", "fwd [um]", "rev [um]", "fwd [um]", "rev [um]"],
                *([t, *(float(v) for v in forwards_and_back(t))] for t in NINE),
            ]
        ),
        told(BOTH),
        ".xlsx",
        knows={"--unit": "mm", "--deviation-unit": "um"},
    ),
    Layout(
        "Markdown table",
        "CommonMark, GitHub tables",
        AXIS,
        "# X axis\n\n| Target [mm] | Reading [mm] |\n|---:|---:|\n"
        + lines(BOTH, lambda r: f"| {r.target:.1f} | {r.reading:.6f} |")
        + "\nEnd of the report.\n",
        told(BOTH),
        ".md",
    ),
    Layout(
        "columns set apart by spaces, names of two words",
        HANDED,
        AXIS,
        "Target pos [mm]   Laser reading [mm]\n" + lines(BOTH, lambda r: f"{r.target:15.3f}   {r.reading:18.6f}"),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "tabs with empty cells and a remark",
        HANDED,
        AXIS,
        "Target [mm]\tRemark\tNote\tReading [mm]\n"
        + lines(ONE, lambda r: f"{r.target:g}\t{'x' if r.target == 400 else ''}\t\t{r.reading:.6f}"),
        told(ONE),
        ".txt",
    ),
    Layout(
        "Windows-1252, umlauts in the header",
        HANDED,
        AXIS,
        (
            "Prüfer: Müller\nSollposition [mm];Abweichung vorwärts [µm];Abweichung rückwärts [µm]\n"
            + "".join(f"{comma(t)};{';'.join(forwards_and_back(t)[:2]).replace('.', ',')}\n" for t in NINE)
        ).encode("cp1252"),
        told(BOTH[BOTH.cycle == 1]),
    ),
    Layout(
        "a column for every run of ISO 230-2, target numbers beside",
        ISO,
        AXIS,
        "i;Target position [mm];x1 up [um];x1 down [um];x2 up [um];x2 down [um]\n"
        + "".join(f"{n};{t:g};{';'.join(forwards_and_back(t))}\n" for n, t in enumerate(NINE, 1)),
        told(BOTH),
    ),
    Layout(
        "a row for every run of ISO 230-2",
        ISO,
        AXIS,
        "Target [mm];"
        + ";".join(f"{t:g}" for t in NINE)
        + "\n"
        + "".join(
            f"Run {c} {'up' if w > 0 else 'down'} [um];"
            + ";".join(f"{v}" for v in run.sort_values("target").deviation)
            + "\n"
            for (c, w), run in BOTH.groupby(["cycle", "way"])
        ),
        told(BOTH),
        knows={"--deviation-unit": "um"},
    ),
    Layout(
        "blocks of runs with their names between",
        HANDED,
        AXIS,
        "Axis X\n"
        + "".join(
            f"\nRun {c} {'forward' if w > 0 else 'reverse'}\nPosition (mm);Error (um)\n"
            + lines(run.sort_values("target", ascending=w > 0), lambda r: f"{r.target};{r.deviation}")
            for (c, w), run in sorted(BOTH.groupby(["cycle", "way"]), key=lambda one: (one[0][0], -one[0][1]))
        ),
        told(BOTH),
    ),
    Layout(
        "plate of holes: three pairs of measured and nominal values",
        "reports of a drilled plate (findings of the project)",
        AXIS,
        "Plug Plate: 1\nDate: 2005-03-15\n\n"
        "    Meas X    Meas Y     Nom X     Nom Y     Err X     Err Y  Meas D   Nom D\n"
        + lines(
            ONE,
            lambda r: (
                f"{r.reading:10.6f} {-215.282 + r.target * 1e-5:9.3f} {r.target:9.3f} {-215.281:9.3f} "
                f"{r.deviation * 1e-3:9.6f} {-0.001 + r.target * 1e-5:9.3f} {2.176:7.3f} {2.167:7.3f}"
            ),
        ),
        told(ONE),
        ".txt",
        "touch",
        knows={"--column target": "Nom X", "--column reading": "Meas X", "--unit": "mm"},
    ),
    Layout(
        "dense scan of 1,201 positions",
        HANDED,
        AXIS,
        "position_mm,encoder_mm\n" + lines(SCAN, lambda r: f"{r.target:.2f},{r.reading:.6f}"),
        told(SCAN),
        sensor="encoder",
        knows={"--column target": "position_mm", "--column reading": "encoder_mm"},
    ),
    Layout(
        "one target, ten readings",
        HANDED,
        AXIS,
        "target_mm,reading_mm\n" + "".join(f"100,{100.0005 + n * 1e-4:.4f}\n" for n in (3, 1, 4, 1, 5, 9, 2, 6, 5, 3)),
        pd.DataFrame(
            {
                "target": 100.0,
                "way": 1,
                "cycle": range(1, 11),
                "deviation": [0.5 + n * 0.1 for n in (3, 1, 4, 1, 5, 9, 2, 6, 5, 3)],
            }
        ),
        knows={"--set": "direction=+"},
    ),
    Layout(
        "temperature beside the readings, [degC]",
        HANDED,
        AXIS,
        "Target [mm],Reading [mm],Material [degC],Air [degC]\n"
        + lines(BOTH, lambda r: f"{r.target},{r.reading:.6f},{20.1 + r.cycle * 0.1:.2f},{21.3 + r.way * 0.1:.2f}"),
        told(BOTH),
        covariates=("Material_C", "Air_C"),
    ),
    Layout(
        "radius over angle of a circular test",
        "tables of circular tests after ISO 230-4",
        AXIS,
        "Angle [deg];Radial deviation [um]\n" + "".join(f"{a};{3.0 * np.cos(np.radians(a)):.3f}\n" for a in range(360)),
        None,
        sensor="other",
    ),
    Layout(
        "baseline of an electronic distance meter",
        "ISO 17123-4, full test procedure",
        DISTANCES,
        "from,to,distance_m\n0,1,19.9981\n0,2,80.0023\n0,3,161.0051\n1,2,60.0040\n1,3,141.0062\n2,3,81.0027\n",
        pd.DataFrame(
            {
                "from_station": [0, 0, 0, 1, 1, 2],
                "to_station": [1, 2, 3, 2, 3, 3],
                "reading": [19.9981, 80.0023, 161.0051, 60.0040, 141.0062, 81.0027],
            }
        ),
        sensor="edm",
        units=("m", "mm"),
    ),
]
