"""Further tables, each with one thing that nobody named before; the second exam of the reader."""

from __future__ import annotations

import pandas as pd

from tests.importing.layouts.handed import BOTH, DRIFT, FACES, FINE, MM, ONE, SHARED, TIMED, book, clock, wide, word
from tests.importing.layouts.judge import AXIS, GAUGE, SPOT, Layout
from tests.importing.layouts.truth import NINE, comma, lines, told, touches

H = "tables as laboratories hand them over"
DU = {**MM, "--deviation-unit": "um"}
TEN = touches()


def by(t: float, c: int, w: int) -> pd.Series:
    return BOTH[(BOTH.target == t) & (BOTH.cycle == c) & (BOTH.way == w)].iloc[0]


LAYOUTS = [
    Layout(
        "German blocks of three lines",
        H,
        AXIS,
        "MESSPROTOKOLL\n\n"
        + lines(
            ONE,
            lambda r: (
                f"SOLLWERT    : {r.target:.4f}\nISTWERT     : {r.reading:.6f}\nABWEICHUNG  : {r.deviation * 1e-3:.6f}\n"
            ),
        ),
        told(ONE),
        ".txt",
        "touch",
        knows={**MM, "--deviation-unit": "mm"},
    ),
    Layout(
        "runs, units, directions: three rows of headers",
        H,
        AXIS,
        "Target;Run 1;Run 1;Run 2;Run 2\nmm;um;um;um;um\n;+;-;+;-\n" + wide(BOTH),
        told(BOTH),
    ),
    Layout(
        "runs and a row of directions",
        H,
        AXIS,
        "Target [mm];Run 1 [um];Run 1 [um];Run 2 [um];Run 2 [um]\n;+;-;+;-\n" + wide(BOTH),
        told(BOTH),
    ),
    Layout(
        "unit as fact, position and error",
        H,
        AXIS,
        "Unit;mm\nErrors in;um\n\nPosition;Error;Direction\n"
        + lines(BOTH, lambda r: f"{r.target};{r.deviation};{word(r, '+', '-')}"),
        told(BOTH),
        knows=DU,
    ),
    Layout(
        "Ist hin, Ist rueck",
        H,
        AXIS,
        "Soll [mm];Ist hin [mm];Ist rück [mm]\n"
        + "".join(f"{comma(t)};{comma(by(t, 1, 1).reading, 6)};{comma(by(t, 1, -1).reading, 6)}\n" for t in NINE),
        told(BOTH[BOTH.cycle == 1]),
    ),
    Layout(
        "sorted by target",
        H,
        AXIS,
        "target_mm,run,direction,deviation_um\n"
        + lines(
            BOTH.sort_values(["target", "cycle", "way"]),
            lambda r: f"{r.target},{r.cycle:.0f},{word(r, '+', '-')},{r.deviation}",
        ),
        told(BOTH),
    ),
    Layout(
        "two tables below one another",
        H,
        AXIS,
        "Forward\nTarget [mm];Deviation [um]\n"
        + lines(BOTH[(BOTH.way == 1) & (BOTH.cycle == 1)], lambda r: f"{r.target};{r.deviation}")
        + "\nReverse\nTarget [mm];Deviation [um]\n"
        + lines(BOTH[(BOTH.way == -1) & (BOTH.cycle == 1)], lambda r: f"{r.target};{r.deviation}"),
        told(BOTH[BOTH.cycle == 1]),
    ),
    Layout(
        "unit in every cell",
        H,
        AXIS,
        "Target,Reading\n" + lines(BOTH, lambda r: f"{r.target} mm,{r.reading} mm"),
        told(BOTH),
    ),
    Layout(
        "quoted decimal commas",
        H,
        AXIS,
        '"Soll [mm]","Ist [mm]"\n' + lines(BOTH, lambda r: f'"{comma(r.target)}","{comma(r.reading, 6)}"'),
        told(BOTH),
    ),
    Layout(
        "elapsed hh:mm:ss",
        H,
        SPOT,
        "Elapsed;Value [um]\n"
        + lines(
            DRIFT,
            lambda r: (
                f"{int(r.time_s) // 3600:02d}:{int(r.time_s) // 60 % 60:02d}:{int(r.time_s) % 60:02d};"
                f"{r.reading * 1e3:.3f}"
            ),
        ),
        TIMED,
        sensor="inductive",
    ),
    Layout(
        "epoch ms",
        H,
        SPOT,
        "timestamp,value_um\n"
        + lines(DRIFT, lambda r: f"{1772439300000 + int(r.time_s * 1000)},{r.reading * 1e3:.3f}"),
        TIMED,
        sensor="inductive",
    ),
    Layout(
        "excel with dates",
        H,
        SPOT,
        book(
            [
                ["Zeitpunkt", "Anzeige [mm]"],
                *[
                    [(pd.Timestamp("2026-03-02 08:15") + pd.Timedelta(seconds=t)).to_pydatetime(), v]
                    for t, v in zip(TIMED.time_s, TIMED.reading, strict=True)
                ],
            ]
        ),
        TIMED,
        ".xlsx",
        sensor="dial",
    ),
    Layout(
        "Klipper, results of a contact probe",
        H,
        SPOT,
        "PROBE_ACCURACY at X:150.000 Y:150.000 Z:10.000 (samples=10 retract=3.000 speed=5.0 lift_speed=5.0)\n"
        + lines(TEN, lambda r: f"// Result: at 150.000,150.000 estimate contact at z={r.reading:.6f}")
        + "probe accuracy results: maximum 2.51, minimum 2.50, range 0.01, average 2.5, standard deviation 0.001\n",
        TEN,
        ".txt",
        "touch",
        knows=MM,
    ),
    Layout(
        "Marlin, G30 between answers of a sender",
        H,
        SPOT,
        "Send: G30\n" + lines(TEN, lambda r: f"Recv: Bed X: 110.000 Y: 110.000 Z: {r.reading:.4f}\nRecv: ok") + "",
        TEN,
        ".txt",
        "touch",
        knows=MM,
    ),
    Layout(
        "setpoints and actual values, units in a row",
        H,
        AXIS,
        "Messpunkt;Sollwert;Istwert;Differenz;Toleranz\n-;mm;mm;mm;mm\n"
        + lines(
            ONE.reset_index(),
            lambda r: f"{int(r['index']) + 1};{r.target:.3f};{r.reading:.6f};{r.deviation * 1e-3:.6f};0.01",
        ),
        told(ONE),
        sensor="touch",
    ),
    Layout(
        "EPICS strip tool",
        H,
        SPOT,
        "# Generated by StripTool\n# Sample-Time\tLAB:POS\n"
        + lines(DRIFT, lambda r: f"{clock(r.time_s, '%m/%d/%Y %H:%M:%S')}\t{r.reading:.6f}"),
        TIMED,
        ".stp",
        "inductive",
        knows={**MM},
    ),
    Layout(
        "rotary deg and rad",
        H,
        AXIS,
        "Nominal angle (deg),Measured angle (deg)\n"
        + lines(BOTH, lambda r: f"{r.target},{r.target + r.deviation / 3600:.9f}"),
        told(BOTH),
        sensor="autocollimator",
        units=("deg", "arcsec"),
    ),
    Layout(
        "inch axis",
        H,
        AXIS,
        "Target (in),Error (uin)\n" + lines(BOTH, lambda r: f"{r.target / 25.4:.9f},{r.deviation / 25.4e-3:.5f}"),
        told(BOTH),
    ),
    Layout(
        "semantic points de",
        H,
        GAUGE,
        "Nr.;Name;X-Koordinate;Y-Koordinate;Z-Koordinate;Bemerkung\n"
        + lines(FINE.reset_index(), lambda r: f"{int(r['index']) + 1};Fläche;{comma(r.x_mm)};300,0000;200,0000;"),
        FACES,
        **SHARED,
    ),
    Layout(
        "points tip centre words",
        H,
        GAUGE,
        "Point,Tip centre X (mm),Tip centre Y (mm),Tip centre Z (mm),Timestamp\n"
        + lines(
            FINE.reset_index(),
            lambda r: f"{int(r['index']) + 1},{r.x_mm},300.0,200.0,{clock(5.0 * r['index'], '%H:%M:%S')}",
        ),
        FACES,
        **SHARED,
    ),
    Layout(
        "points numpy savetxt",
        H,
        GAUGE,
        "# x y z\n" + lines(FINE, lambda r: f"{r.x_mm:.6e} {300.0:.6e} {200.0:.6e}"),
        FACES.assign(x_mm=[float(f"{x:.6e}") for x in FACES.x_mm]),
        ".dat",
        **SHARED,
    ),
    Layout(
        "R table with row names",
        H,
        AXIS,
        '"target_mm" "reading_mm"\n'
        + lines(BOTH.reset_index(), lambda r: f'"{int(r["index"]) + 1}" {r.target} {r.reading}'),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "temperatures in F beside",
        H,
        AXIS,
        "Target (mm),Deviation (um),Air (F)\n" + lines(BOTH, lambda r: f"{r.target},{r.deviation},68.5"),
        told(BOTH),
        covariates=["Air_C"],
    ),
]
