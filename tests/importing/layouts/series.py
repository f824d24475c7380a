"""One place read again and again: archives, scopes, guide logs, consoles of printers, clocks of every spelling."""

from __future__ import annotations

import datetime

from tests.importing.layouts.judge import SPOT, Layout
from tests.importing.layouts.truth import comma, lines, series, touches

KLIPPER = "Klipper3d/klipper, klippy/extras/probe.py and docs/Probe_Calibrate.md"
MARLIN = "MarlinFirmware/Marlin, G30.cpp and M48.cpp"
RRF = "Duet3D/RepRapFirmware, GCodes4.cpp (reply to G30 S-1)"
SCOPE = "public readers of TwinCAT Scope exports (17 rows of metadata, a pair of time and value per channel)"
EPICS = "EPICS base, camonitor: name, date, time, value"
GUIDE = "PHD2 guide log, version 2.5 (public parsers)"
HANDED = "logs as people hand them over (findings of the project)"
START = datetime.datetime(2021, 6, 13, 20, 5)
LONG, TEN = series(), touches()
TIMED = LONG[["time_s", "reading"]]


def at(seconds: float, form: str) -> str:
    """The clock, seconds after the start."""
    return (START + datetime.timedelta(seconds=seconds)).strftime(form)


def scope(delimiter: str, full: bool) -> str:
    """A channel of a scope: metadata, then pairs of ms and value."""
    meta = ["Name", "SymbolName", "Data-Type", "SampleTime[ms]", "Unit"] if full else ["Name"]
    own = {"Name": "probe", "SymbolName": "MAIN.probe", "Data-Type": "REAL64", "SampleTime[ms]": "60000", "Unit": "mm"}
    head = ["Name", "File", "Starttime of export", "Endtime of export"]
    values = ["Scope", "C:\\s.svdx", "132680811000000000", "132680834400000000"]
    text = "".join(f"{key}{delimiter}{value}\n" for key, value in zip(head, values, strict=True)) + "\n"
    text += "".join(f"{name}{delimiter}{own[name]}\n" for name in meta) + "\n"
    told = comma if delimiter == "\t" else "{:.4f}".format
    return text + lines(
        LONG,
        lambda r: (
            f"{told(r.time_s * 1e3)}{delimiter}{told(r.reading, 6) if delimiter == chr(9) else f'{r.reading:.6f}'}"
        ),
    )


def guide_log() -> str:
    """Errors of a mount in pixels; the pixel scale stands in the head."""
    names = (
        "Frame,Time,mount,dx,dy,RARawDistance,DECRawDistance,RAGuideDistance,DECGuideDistance,RADuration,RADirection"
    )
    return (
        "PHD2 version 2.6.13 [Windows], Log version 2.5. Log enabled at 2025-03-19 21:30:00\n\n"
        "Guiding Begins at 2025-03-19 21:31:00\nPixel scale = 1.50 arc-sec/px, Binning = 1, Focal length = 500 mm\n"
        f"{names}\n"
        + lines(
            LONG.reset_index(),
            lambda r: (
                f'{int(r["index"]) + 1},{r.time_s + 0.5:.3f},"Mount",{(r.reading - 12.5) * 1e3:.3f},0.2,'
                f"{(r.reading - 12.5) * 1e3:.3f},0.300,0.1,0.1,10,W"
            ),
        )
        + "Guiding Ends at 2025-03-19 22:31:00\n"
    )


def klipper(prefix: str = "// ", stamped: bool = False) -> str:
    """The console of PROBE_ACCURACY."""
    stamp = "10:11:12 " if stamped else ""
    text = f"{stamp}{prefix}PROBE_ACCURACY at X:125.000 Y:125.000 Z:10.000 (samples=10 retract=2.000 speed=5.0)\n"
    text += lines(TEN, lambda r: f"{stamp}{prefix}probe at 125.000,125.000 is z={r.reading:.6f}")
    z = TEN.reading
    return text + (
        f"{stamp}{prefix}probe accuracy results: maximum {z.max():.6f}, minimum {z.min():.6f}, range"
        f" {z.max() - z.min():.6f}, average {z.mean():.6f}, median {z.median():.6f}, standard deviation"
        f" {z.std(ddof=0):.6f}\n{'Recv: ' if 'Recv' in prefix else ''}ok\n"
    )


def m48() -> str:
    """Marlin's repeatability test, verbose."""
    text = "Send: M48 P10 V4\nRecv: M48 Z-Probe Repeatability Test\n"
    for n in range(1, 11):
        z = TEN.reading[:n].round(3)
        text += (
            f"Recv: {n} of 10: z: {TEN.reading[n - 1]:.3f} mean: {z.mean():.4f} sigma: {z.std(ddof=0):.6f}"
            f" min: {z.min():.3f} max: {z.max():.3f} range: {z.max() - z.min():.3f}\n"
        )
    return text + "Recv: Finished!\nRecv: Mean: 2.512500 Min: 2.507 Max: 2.517 Range: 0.010\nRecv: ok\n"


THOUSANDTHS = TEN.assign(reading=TEN.reading.map(lambda z: float(f"{z:.3f}")))
MM = {"--unit": "mm"}
Z = {"--column reading": "z", **MM}
HOURS = TIMED.assign(time_s=TIMED.time_s)
LAYOUTS = [
    Layout("Klipper, PROBE_ACCURACY in its own console", KLIPPER, SPOT, klipper(), TEN, ".txt", "touch", knows=Z),
    Layout(
        "Klipper, PROBE_ACCURACY through OctoPrint",
        KLIPPER,
        SPOT,
        "Send: PROBE_ACCURACY\n" + klipper("Recv: // "),
        TEN,
        ".log",
        "touch",
        knows=Z,
    ),
    Layout(
        "Klipper, PROBE_ACCURACY with the time before every line",
        KLIPPER,
        SPOT,
        klipper(stamped=True),
        TEN,
        ".txt",
        "touch",
        knows=Z,
    ),
    Layout(
        "Klipper, a mesh of several places",
        KLIPPER,
        SPOT,
        "".join(f"// probe at {x}.000,{y}.000 is z={0.1 + x * 1e-4:.6f}\n" for y in (10, 110) for x in (10, 60, 110)),
        None,
        ".txt",
        "touch",
        knows=MM,
    ),
    Layout(
        "Marlin, G30 at one place",
        MARLIN,
        SPOT,
        lines(
            THOUSANDTHS,
            lambda r: (
                f"Send: G30 X100 Y100\nRecv: Bed X:100.00 Y:100.00 Z:{r.reading:.3f}\n"
                "Recv: X:100.00 Y:100.00 Z:15.00 E:0.00 Count X:8000 Y:8000 Z:6000\nRecv: ok"
            ),
        ),
        THOUSANDTHS,
        ".log",
        "touch",
        knows=MM,
    ),
    Layout("Marlin, M48", MARLIN, SPOT, m48(), THOUSANDTHS, ".log", "touch", knows=Z),
    Layout(
        "RepRapFirmware, G30 S-1 again and again",
        RRF,
        SPOT,
        "M558\nZ Probe 0: type 9, dive height 5.0mm\n"
        + lines(THOUSANDTHS, lambda r: f"G30 S-1\nStopped at height {r.reading:.3f} mm"),
        THOUSANDTHS,
        ".txt",
        "touch",
        knows=MM,
    ),
    Layout(
        "TwinCAT scope, tabs and decimal commas", SCOPE, SPOT, scope("\t", True), TIMED, ".txt", "inductive", knows=MM
    ),
    Layout("TwinCAT scope, names alone", SCOPE, SPOT, scope(",", False), TIMED, ".csv", "inductive", knows=MM),
    Layout(
        "EPICS, camonitor",
        EPICS,
        SPOT,
        lines(LONG, lambda r: f"LAB:LVDT1:POS {at(r.time_s, '%Y-%m-%d %H:%M:%S')}.123456 {r.reading:.6f}"),
        TIMED,
        ".txt",
        "inductive",
        knows={**MM, "--header": "name,date,time,reading"},
    ),
    Layout(
        "EPICS archive, two channels interleaved",
        EPICS,
        SPOT,
        lines(
            LONG,
            lambda r: (
                f"LAB:LVDT1:POS {at(r.time_s, '%Y-%m-%d %H:%M:%S')}.123456 {r.reading:.6f}\n"
                f"LAB:AIR:TEMP {at(r.time_s, '%Y-%m-%d %H:%M:%S')}.223456 {20.1 + r.time_s * 1e-5:.4f}"
            ),
        ),
        TIMED,
        ".txt",
        "inductive",
        knows={**MM, "--header": "name,date,time,reading", "--rows": "LAB:LVDT1:POS"},
    ),
    Layout("guide log in pixels", GUIDE, SPOT, guide_log(), None, ".txt", "other"),
    Layout(
        "minutes and hours in two columns",
        HANDED,
        SPOT,
        "Hour;Minute;Reading [mm]\n"
        + lines(
            LONG, lambda r: f"{20 + (5 + int(r.time_s / 60)) // 60};{(5 + int(r.time_s / 60)) % 60};{r.reading:.6f}"
        ),
        TIMED,
        sensor="inductive",
    ),
    Layout(
        "date and time joined by a hyphen",
        HANDED,
        SPOT,
        "time,reading_mm\n" + lines(LONG, lambda r: f"{at(r.time_s, '%Y/%m/%d-%H:%M:%S')},{r.reading:.6f}"),
        TIMED,
        sensor="inductive",
    ),
    Layout(
        "temperatures in [degC]",
        HANDED,
        SPOT,
        "Elapsed time [min],Spindle [degC],Displacement [um]\n"
        + lines(LONG, lambda r: f"{r.time_s / 60:g},{20 + r.time_s / 1000:.3f},{r.reading * 1e3:.3f}"),
        TIMED,
        sensor="capacitive",
        covariates=("Spindle_C",),
    ),
    Layout(
        "ten readings without a clock",
        HANDED,
        SPOT,
        "Reading [mm]\n" + lines(TEN, lambda r: f"{r.reading:.4f}"),
        TEN,
        sensor="dial",
    ),
    Layout(
        "seconds since 1970",
        HANDED,
        SPOT,
        "epoch [s],reading [mm]\n" + lines(LONG, lambda r: f"{1623614700 + r.time_s:.0f},{r.reading:.6f}"),
        TIMED,
        sensor="inductive",
        knows={"--column time_s": "epoch [s]"},
    ),
]
