"""The files of this example: one measurement on the virtual CMM, written down as five kinds of machines would.

    python make.py

The DMIS output is compensated by the tip radius, the German table was saved by a spreadsheet (decimal comma,
Windows-1252, times of day), the workbook has a cover sheet and units in a row of their own.
"""

from __future__ import annotations

import datetime
from pathlib import Path

import openpyxl

from stepgauge.exporting import Export, ExportOptions, export_recording
from stepgauge.files.text import write_text
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.machine.file import read_machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from stepgauge.recording import Recording

HERE = Path(__file__).resolve().parent
START = datetime.datetime(2026, 3, 2, 23, 59, 50)


def measure() -> Recording:
    """Blocks 1 to 3 of the shipped gauge, twice, and the programs that do so."""
    gauge = read_gauge("step-gauge-420")
    placement = read_placement(HERE / "placement.toml", gauge)
    settings = ProbingSettings(standoff_mm=2.0)
    moves = make_program(placement, gauge, PlanOptions(1, 3, cycles=2), settings)
    for name in ("dmis", "linuxcnc"):
        write_text(HERE / f"gauge{DIALECTS[name].suffix}", render(moves, DIALECTS[name]))
    run = run_program(moves, read_machine("bridge-cmm"), gauge, placement, 3, RunConditions(20.4))
    comments = {"gauge_serial": gauge.table.serial, "seed": "3", "tip_radius_mm": "2"}
    return Recording(run.recording.frame, comments, "measurement")


def german_table(recording: Recording) -> str:
    """A protocol as a spreadsheet saves it in Germany."""
    lines = ["Messprotokoll Stufenendmaß;;;;;;", "Prüfer: A. Person;;;;;;"]
    lines.append("Nr;Messwert X / mm;Messwert Y / mm;Messwert Z / mm;T in °C;Uhrzeit;Bemerkung")
    for number, row in recording.frame.iterrows():
        moment = START + datetime.timedelta(seconds=float(row["time_s"]))
        xyz = ";".join(f"{row[name]:.5f}" for name in ("x_mm", "y_mm", "z_mm")).replace(".", ",")
        lines.append(f"{int(str(number)) + 1};{xyz};20,4;{moment:%H:%M:%S};i. O.")
    return "\n".join(lines) + "\n"


def workbook(recording: Recording, path: Path) -> None:
    """Inches and Fahrenheit, normals, and a sheet before the one with the points."""
    book = openpyxl.Workbook()
    book.active.title = "Cover"
    book.active.append(["Step gauge calibration"])
    sheet = book.create_sheet("Points")
    sheet.append(["Run", "Surface", "X actual", "Y actual", "Z actual", "I", "J", "K", "Part temperature"])
    sheet.append([None, None, "inch", "inch", "inch", None, None, None, "°F"])
    for (_, row), xyz, ijk in zip(
        recording.frame.iterrows(), recording.position_mm / 25.4, -recording.approach, strict=True
    ):
        sheet.append([int(row["cycle"]), int(row["face"]), *map(float, xyz), *map(float, ijk), 68.72])
    book.save(path)


def bare(export: Export) -> bytes:
    """A log as the machine itself writes it, without the comments that stepgauge puts above."""
    lines = export.content.splitlines(keepends=True)
    return b"".join(line for line in lines if not line.startswith(b"#"))


def main() -> None:
    """Write all files beside this one."""
    recording = measure()
    export_recording(recording, "dmis", ExportOptions(surface=True)).write(HERE / "dmis.dmo")
    for name, form, log_form in (
        ("ippdme.log", "ippdme", "log"),
        ("linuxcnc-log.txt", "linuxcnc", "log"),
        ("linuxcnc-probeopen.txt", "linuxcnc", "probeopen"),
    ):
        export = export_recording(recording, form, ExportOptions(log_form=log_form))
        (HERE / name).write_bytes(bare(export))
    (HERE / "protokoll.csv").write_bytes(german_table(recording).encode("cp1252"))
    workbook(recording, HERE / "points.xlsx")


if __name__ == "__main__":
    main()
