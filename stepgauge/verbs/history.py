"""``history``: many evaluations of one machine to trends and warnings."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Flag, OneOf, Pair, Reads, Repeated, Supplied, Text, Writes
from stepgauge.verbs.shared import Figure, File, OutputFolder

if TYPE_CHECKING:
    from stepgauge.history.result import History

LIMITS = ("scale_ppm", "reversal_um", "r_eff_change_um", "band_um", "worst_two_sigma_um")
"""Written out so that --help needs no numpy; a test compares it with the quantities of the history."""


def write(history: "History", output: OutputFolder, *, figure: Figure = "png") -> list[Path]:
    """Files of a history.

    Parameters
    ----------
    output : folder for history.json, history.csv, the figure and the store (made if missing)
    """
    return history.write(output, figure)


@verb(write, shows=True)
def machine_history(
    folder: Annotated[File, Reads("DIR", folder=True), ARGUMENT],
    *,
    limits: Annotated["Mapping[str, float] | None", Repeated(Pair(names=LIMITS), "limit")] = None,
    machine_name: Annotated[str | None, Text("NAME")] = None,
    gauge_serial: Annotated[str | None, Text("SERIAL")] = None,
    date_from: Annotated[str, OneOf("record", "file")] = "record",
    store: Annotated[File | None, Writes("FILE")] = None,
    rebuild: Annotated[bool, Flag()] = False,
    own_store: Annotated[Path | None, Supplied("history store")] = None,
    tell: Annotated["Callable[[str], None] | None", Supplied("tell")] = None,
) -> "History":
    """What many evaluations say of one machine by date: trends, limits, a control chart.

    Every evaluation.json below DIR counts, each placement by the direction of the gauge. The date is measured_at of the
    evaluation ('evaluate --measured-at', or '# measured_at:' in the recording), else a date such as 2026-03-02 in the
    names of its folders. Trend lines are weighted by repeatability; a control chart needs five dates. All trends and
    values are tested together: a report of nothing but noise has any warning in at most one of twenty cases.

    A constant reversal of an axis shows in R_eff, minus half of it: a step gauge sees it as a smaller tip. R_eff is
    compared with the first one of the same tip (within 50 um). Evaluations that name no machine are '(unnamed)':
    'evaluate --machine-name'.

    The store is an SQLite file for other programs; it is brought up to date at every call and can always be rebuilt.

    DIR may be the store of a fleet ('stepgauge fleet') whose recordings were evaluated: then nothing is kept in SQLite.

    Parameters
    ----------
    folder : where the evaluations lie, or the store of a fleet
    limits : warn beyond this; scale_ppm (um/m), reversal_um, r_eff_change_um, band_um, worst_two_sigma_um
    machine_name : only evaluations of this machine
    gauge_serial : only evaluations with this gauge
    date_from : where an evaluation has no measured_at and its path no date: leave it out, or take the file's own date
    store : SQLite store to keep; default: history.sqlite in the output folder
    rebuild : delete the store and make it again from the JSON files
    own_store : the store where none is stated; default: none is kept
    tell : called with what was read and what was left out

    Returns
    -------
    Values by date, trends and warnings.

    Examples
    --------
    stepgauge history archive -o history
    stepgauge history archive --machine-name "Bridge CMM" --limit reversal_um=2 --limit scale_ppm=5 -o history
    """
    from stepgauge.history.result import history_of, stored_entries

    if (Path(folder) / "fleet.json").is_file():
        from stepgauge.fleet.past import history_entries
        from stepgauge.fleet.store import Fleet

        return history_of(history_entries(Fleet(folder)), folder, limits or {}, machine_name, gauge_serial)
    kept = None if store is None and own_store is None else Path(store or own_store or "")
    found = stored_entries(folder, kept, date_from, rebuild, tell or (lambda _: None))  # type: ignore[arg-type]
    return history_of(found, folder, limits or {}, machine_name, gauge_serial, kept)
