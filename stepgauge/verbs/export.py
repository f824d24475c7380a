"""``export``: a recording to the files that other programs read."""

from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Number, OneOf, Reads
from stepgauge.verbs.shared import File, OutputFile

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.exporting import Export
    from stepgauge.machine.virtual import Run
    from stepgauge.recording import Recording

DELIMITERS = {"semicolon": ";", "tab": "\t", "bar": "|", "comma": ","}


def write(export: "Export", output: OutputFile) -> list[File]:
    """The file.

    Parameters
    ----------
    output : file to write
    """
    export.write(output)
    return [output]


@verb(write)
def export_recording(
    recording: Annotated["File | Recording | Run | pd.DataFrame", Reads("RECORDING"), ARGUMENT],
    *,
    to: Annotated[str, OneOf("dmis", "ippdme", "linuxcnc", "csv", "xlsx")],
    placement_number: Annotated[int | None, Count(1)] = None,
    length_unit: Annotated[str, OneOf("mm", "um", "m", "inch")] = "mm",
    delimiter: Annotated[str | None, OneOf(*DELIMITERS)] = None,
    decimal: Annotated[str, OneOf("point", "comma")] = "point",
    points: Annotated[str, OneOf("centres", "surface")] = "centres",
    tip_radius_mm: Annotated[float | None, Number("mm", above=0.0, high=25.0)] = None,
    log_form: Annotated[str, OneOf("log", "probeopen")] = "log",
) -> "Export":
    """Write a recording in the form of another program.

    'stepgauge import' reads every one of them back as the same recording, to the printed digits (1e-7 mm; 1e-6 mm in
    the PROBEOPEN form). What a form has no room for is said. Cycle and face are part of the tables and, as the names of
    the points, of DMIS; from the logs they are found again with --gauge and --placement.

    Parameters
    ----------
    recording : one recording, run, table or file
    to : DMIS output, an I++ DME session log, a LinuxCNC probe log, a table as text (CSV) or in Excel
    placement_number : export this placement only; default: all; the logs have room for one
    length_unit : of coordinates in a table, or in DMIS (mm, m, inch)
    delimiter : of a CSV table; default: comma, or semicolon with a decimal comma
    decimal : decimal mark of a CSV table
    points : tip centres, or points compensated by the tip radius (DMIS with PRCOMP/ON, and tables)
    tip_radius_mm : radius of the tip ball; default: what the recording states
    log_form : of LinuxCNC: the numbered (LOG,..) rows, or the nine columns of (PROBEOPEN ..)

    Returns
    -------
    The content of the file, and in a few lines what was left out of it.

    Raises
    ------
    InputError
        several placements in a form that has room for one, surface points without a tip radius, marks that clash

    Examples
    --------
    stepgauge export recording.csv --to xlsx -o recording.xlsx
    stepgauge export recording.csv --to csv --delimiter semicolon --decimal comma --length-unit um -o for-excel.csv
    stepgauge export recording.csv --to dmis --points surface --tip-radius 2 -o results.dmo
    """
    from stepgauge.errors import InputError, naming
    from stepgauge.exporting import ExportOptions
    from stepgauge.exporting import export_recording as export
    from stepgauge.verbs.inputs import resolve_recordings

    if to != "csv" and (delimiter or decimal == "comma"):
        raise InputError(naming("delimiter", "decimal", words="{}, {}"), "are of a CSV table", found=to)
    if to != "linuxcnc" and log_form != "log":
        raise InputError(naming("log_form"), "is of LinuxCNC", found=to)
    mark = "," if decimal == "comma" else "."
    between = DELIMITERS[delimiter or ("semicolon" if mark == "," else "comma")]
    surface = points == "surface"
    options = ExportOptions(length_unit, between, mark, placement_number, surface, tip_radius_mm, log_form)
    (table,) = resolve_recordings(recording)
    return export(table, to, options)
