"""Parameters that several verbs share, so that they are spelled, bounded and explained the same everywhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import (
    BlockRange,
    Count,
    Flag,
    Moment,
    Number,
    OneOf,
    Reads,
    Repeated,
    Supplied,
    Text,
    Writes,
)

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.gauge.certified import Gauge
    from stepgauge.gauge.placement import Placement
    from stepgauge.machine.file import Machine
    from stepgauge.machine.virtual import Run
    from stepgauge.recording import Recording

File = str | Path
GAUGE_VARIABLE, MACHINE_VARIABLE = "STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"
"""Environment variables that stand for --gauge and --machine where these are left out."""
GAUGE = Reads("GAUGE", room=".", short="g", variable=GAUGE_VARIABLE)
MACHINE = Reads("MACHINE", room="machines", short="m", variable=MACHINE_VARIABLE)
PLACEMENT = Reads("P", short="p")
DIALECTS = (
    *("jinyoung", "dmis", "linuxcnc", "ippdme", "fanuc", "haas", "mazak", "mitsubishi", "siemens", "heidenhain"),
    *("grbl", "rrf"),
)
"""Written out so that --help needs no import of the readers; a test compares it with theirs."""


def controllers() -> dict[str, str]:
    """Dialects by the names of the controllers that understand them."""
    from stepgauge.programs import CONTROLLERS

    return CONTROLLERS


DIALECT = OneOf(*DIALECTS, names=controllers)

GaugeLike = Annotated["File | Gauge", GAUGE, "the certified gauge: its file, or the name of a shipped one"]
GaugeIfNeeded = Annotated["File | Gauge | None", GAUGE, "the certified gauge: its file, or the name of a shipped one"]
MachineLike = Annotated["File | Machine", MACHINE, "machine: its file, or the name of a shipped one"]
MachineIfNeeded = Annotated["File | Machine | None", MACHINE, "machine: its file, or the name of a shipped one"]
PlacementLike = Annotated["File | Placement", PLACEMENT, "how the gauge lies: the file that locate wrote"]
Placements = Annotated[
    "File | Placement | Iterable[File | Placement]",
    Repeated(PLACEMENT, "placement"),
    "where the gauge lay, once per placement in the recordings, in order; default: the axis is the mean approach",
]
Recordings = Annotated[
    "File | Recording | Run | pd.DataFrame | Iterable[File | Recording | Run | pd.DataFrame]",
    Repeated(Reads("RECORDING"), "recording"),
    ARGUMENT,
    "one recording, run, table or file, or several as several placements",
]
Section = Annotated[
    "str | Sequence[int] | None",
    BlockRange(),
    "first and last block of the used section, 1:21; default: what was measured",
]
ReffOrigin = Annotated[
    str | None,
    OneOf("first", "all", "corrected"),
    "effective radius from the first used block (its XB is then zero by construction), from all used blocks, or that by"
    " which the readings had been corrected; default: the last for such readings, else first",
]
Figure = Annotated[str, OneOf("png", "svg", "pdf"), "format of the figures in the folder"]
FIGURES = (".png", ".svg", ".pdf")
TEMPERATURE = Number("deg C", -10.0, 60.0, what="no temperature of a gauge")
GaugeTemperature = Annotated[
    float | None, TEMPERATURE, "temperature of the gauge as a program is run; default: that of the certificate"
]
LARGEST_U_K = 5.0
"""Nobody knows the temperature of a gauge so badly, K; as in :mod:`stepgauge.machine.file`, which a test compares."""
UGaugeTemperature = Annotated[
    float | None,
    Number("K", 0.0, LARGEST_U_K),
    "standard uncertainty of the gauge's temperature; default: gauge_temperature_K in [uncertainty] of the machine file"
    " if the temperature was recorded; else not counted",
]
Convention = Annotated[
    str | None,
    OneOf("as_read", "corrected_to_20", "nominal_expansion"),
    "what the readings have been corrected for. as_read: nothing; corrected_to_20: the machine has corrected them to 20"
    " deg C; nominal_expansion: to be corrected here, with the expansion of scales and gauge; default: as the recording"
    " says",
]
CorrectDrift = Annotated[bool, Flag(), "take off a drift with time that the repeats show; default: it is remarked"]
MeasuredAt = Annotated[
    str | None, Moment(), "when it was measured, 2026-03-02 or with time, where the recording does not say"
]
MachineName = Annotated[str | None, Text("NAME"), "machine that measured it, where the recording does not say"]
Mpe = Annotated[str | None, Text("LIMIT"), 'maximum permissible error "A + L/K" or "min(A + L/K, B)", um with L in mm']
TipRadius = Annotated[float | None, Number("mm", above=0.0), "nominal tip radius"]
TipDiameter = Annotated[
    float | None, Number("mm", above=0.0), "effective tip diameter as the machine's qualification gave it"
]
CoverageFactor = Annotated[float, Number("", 1.0, 4.0, name="factor"), "factor k from standard to expanded uncertainty"]
Search = Annotated[
    float, Number("mm", above=0.0), "search beyond the target of a program, where its text does not state it"
]
Jobs = Annotated[
    int | None,
    Count(1, at_command=None),
    "processes at most; 1: this one, None (at the command line the default): as many as there are processors",
]
Tool = Annotated[str, Text("NAME"), "what the server calls the probe"]
PlacementNumber = Annotated[int, Count(1), "number of this placement, in a calibration with several"]
Dialect = Annotated[str | None, DIALECT, "language of the program; default: recognised from its text"]
FurtherStyli = Annotated[
    "File | Machine | Iterable[File | Machine]",
    Repeated(Reads("FILE"), "further-stylus"),
    "machine file with a further stylus, otherwise the same as the machine",
]
Without = Annotated[
    "str | Iterable[str]",
    Repeated(Text("KIND"), "without"),
    "kind of effect ('stepgauge list effects') that is known not to be there",
]
Priors = Annotated[
    File | None, Reads("FILE"), "priors (TOML) in place of the shipped ones; what the file leaves out stays"
]
Progress = Annotated["Callable[[int, int], None] | None", Supplied("bar"), "told (done, total)"]
OutputFolder = Annotated[File, Writes(folder=True, short="o"), "folder to write into (made if missing)"]
OutputFile = Annotated[File, Writes(short="o"), "file to write"]
Plot = Annotated[File | None, Writes("FILE", suffixes=FIGURES), "figure to write"]
