"""Foreign layouts: right at once, or asked for and then right; never wrong, and no question without its answer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.layouts.judge import ASKED, MOST_OPTIONS, REFUSED, RIGHT, Layout, judge
from tests.importing.layouts.layouts import LAYOUTS

PENDING = {
    "reference, command and reading, the reference being an encoder": "wrong",
    "laser file, flag of one direction, return runs filled with zeros": "wrong",
    "laser file, rows sorted by target": "wrong",
    "laser file, decimal comma": "refused",
    "averages of both directions in three tables (.pos)": "wrong",
    "laser file, cut in mid-row": "accepted",
    "laser file, cut after a run": "accepted",
    "laser file that counts ten targets and lists nine": "accepted",
    "laser file with a run that has a target twice": "accepted",
    "target and commanded position beside the reading": "wrong",
    "Markdown table": "refused",
    "tabs with empty cells and a remark": "wrong",
    "plate of holes: three pairs of measured and nominal values": "refused",
    "dense scan of 1,201 positions": "wrong",
    "temperature beside the readings, [degC]": "lost",
    "PC-DMIS text report, X and Y of every point": "wrong",
    "PC-DMIS text report with diameters": "wrong",
    "PC-DMIS report in Excel": "wrong",
    "Calypso table of characteristics": "wrong",
    "report of any make: feature and axis in columns": "wrong",
    "the same, German numbers": "wrong",
    "measuring log of a HEIDENHAIN cycle for one coordinate": "refused",
    "measuring protocol of SINUMERIK as a table": "wrong",
    "Klipper, PROBE_ACCURACY in its own console": "refused",
    "Klipper, PROBE_ACCURACY through OctoPrint": "refused",
    "Klipper, PROBE_ACCURACY with the time before every line": "refused",
    "Marlin, G30 at one place": "refused",
    "Marlin, M48": "refused",
    "RepRapFirmware, G30 S-1 again and again": "refused",
    "TwinCAT scope, tabs and decimal commas": "wrong",
    "TwinCAT scope, names alone": "wrong",
    "EPICS, camonitor": "refused",
    "EPICS archive, two channels interleaved": "refused",
    "minutes and hours in two columns": "lost",
    "date and time joined by a hyphen": "refused",
    "temperatures in [degC]": "lost",
    "seconds since 1970": "lost",
    "points in columns of spaces": "refused",
    "points without a header": "refused",
    "recording with an empty column of temperatures and empty rows": "refused",
    "16 points of a display, decimal commas": "refused",
    "certificate with deviations, nominal minus measured": "wrong",
    "certificate with deviations, Nennmass minus Istmass": "wrong",
    "certificate with deviations, Soll-Ist": "wrong",
}
"""What is not yet right, and how it fails: wrong, lost, refused in vain, accepted and never to be."""
READABLE = [layout for layout in LAYOUTS if layout.truth is not None]


def test_there_are_enough_of_them() -> None:
    assert len({layout.name for layout in LAYOUTS}) == len(LAYOUTS)
    assert len(READABLE) >= 45


def marked(layout: Layout) -> object:
    known = PENDING.get(layout.name)
    marks = [pytest.mark.xfail(reason=known, strict=False)] if known else []
    return pytest.param(layout, marks=marks, id=layout.name)


@pytest.mark.parametrize("layout", [marked(layout) for layout in LAYOUTS])
def test_layout(tmp_path: Path, layout: Layout) -> None:
    verdict = judge(layout, tmp_path)
    if layout.truth is None:
        assert verdict.kind == REFUSED, verdict
    else:
        assert verdict.kind in (RIGHT, ASKED), verdict
        assert verdict.options <= MOST_OPTIONS, verdict
