"""Files of laser software in sections. Two public programs read them and one writes them; the fields follow these."""

from __future__ import annotations

import pandas as pd

from tests.importing.layouts.judge import AXIS, Layout
from tests.importing.layouts.truth import NINE, lines, positioning, told

READERS = "public readers and a writer of .rtl files (sections HEADER to EOF, Flags, Run-count, Target-count)"
BOTH = positioning()
ONE_WAY = positioning(cycles=3, ways=(1,))


def runs(frame: pd.DataFrame) -> pd.DataFrame:
    """A run for every sweep, counted from 1."""
    sweep = 2 * frame["cycle"] - (frame["way"] > 0) if (frame["way"] < 0).any() else frame["cycle"]
    return frame.assign(run=sweep.astype(int), number=frame["target"].map({t: n for n, t in enumerate(NINE, 1)}))


def sections(
    data: str,
    flags: str = "0 0 2 0",
    run_count: int = 4,
    target_count: int = 9,
    kind: str = "linear",
    mark: str = ".",
    end: str = "\nENVIRONMENT::\nAir temp   : 20.1\nEOF::\n",
) -> str:
    """The file around the rows of run, target and deviation."""
    number = [f"{t:.4f}".replace(".", mark) for t in NINE]
    listed = "\n".join(" ".join(number[n : n + 4]) for n in (0, 4, 8))
    return (
        f"HEADER::\nFile Type: {kind}\nOwner    : a laboratory\nVersion no: 1\n\nTARGET DATA::\nFiletype  : ISO\n"
        f"Target-count: {target_count}\nTargets :\n{listed} \nFlags: {flags}\n\nUSER-TEXT::\nMachine: VMC 850\n"
        f"Serial No: 17\nDate:2024-01-02 10:11:12\nBy:op\nAxis:X\nLocation:hall 2\nTITLE:X axis\n\nRUNS::\n"
        f"Run-count:{run_count}\n\nDEVIATIONS::\nRun Target Data:\n{data}{end}"
    )


def rows(frame: pd.DataFrame, mark: str = ".") -> str:
    """Run, number of the target and deviation."""
    return lines(runs(frame), lambda r: f"{int(r.run)}   {int(r.number)}      {r.deviation:.3f}".replace(".", mark, 1))


def zeros() -> str:
    """Runs of one direction, with return runs that were never measured."""
    text = ""
    for cycle, sweep in ONE_WAY.groupby("cycle"):
        first = 2 * int(str(cycle)) - 1
        text += lines(runs(sweep), lambda r, n=first: f"{n}   {int(r.number)}      {r.deviation:.3f}")  # type: ignore[misc]
        text += "".join(f"{first + 1}   {number}      0\n" for number in range(9, 0, -1))
    return text


def angular() -> str:
    """An axis of rotation: targets in deg, deviations in arcsec."""
    return sections(rows(BOTH), kind="angular")


LAYOUTS = [
    Layout("laser file, both directions", READERS, AXIS, sections(rows(BOTH)), told(BOTH), ".rtl"),
    Layout(
        "laser file, lines end as on Windows, another section before the end",
        READERS,
        AXIS,
        sections(rows(BOTH), end="\nEQUIPMENT::\nLaser: 1\n\nENVIRONMENT::\nAir temp: 20.1\nEOF::\n").replace(
            "\n", "\r\n"
        ),
        told(BOTH),
        ".rtl",
    ),
    Layout(
        "laser file, flag of one direction, every run forward",
        READERS,
        AXIS,
        sections(rows(ONE_WAY), flags="0 1 2 0", run_count=3),
        told(ONE_WAY),
        ".rtl",
    ),
    Layout(
        "laser file, flag of one direction, return runs filled with zeros",
        READERS,
        AXIS,
        sections(zeros(), flags="0 1 2 0", run_count=6),
        told(ONE_WAY),
        ".rtl",
    ),
    Layout(
        "laser file, rows sorted by target",
        READERS,
        AXIS,
        sections(rows(BOTH.sort_values(["target", "cycle"]))),
        told(BOTH),
        ".rtl",
    ),
    Layout("laser file, decimal comma", READERS, AXIS, sections(rows(BOTH, ","), mark=","), told(BOTH), ".rtl"),
    Layout(
        "laser file of an axis of rotation",
        READERS,
        AXIS,
        angular(),
        told(BOTH),
        ".rtl",
        knows={"--unit": "deg", "--deviation-unit": "arcsec"},
        units=("deg", "arcsec"),
    ),
    Layout(
        "averages of both directions in three tables (.pos)",
        "public readers of .pos files: three tables of position and average error, mm",
        AXIS,
        "Targets :\n"
        + " ".join(f"{t:.3f}" for t in NINE)
        + "\nFlags: 0 0 2 0\n"
        + "".join(
            f"Position   \t{title} Avg Error\n"
            + "".join(
                f"{t:.3f}\t{(one if way is None else one[one.way == way]).deviation.mean() * 1e-3:.6f}\n"
                for t, one in BOTH[BOTH.cycle == 1].groupby("target")
            )
            for title, way in (("Bidirectional", None), ("Forward Directional", 1), ("Reverse Directional", -1))
        )
        + "ENVIRONMENT::\n",
        told(BOTH[(BOTH.cycle == 1) & (BOTH.way == 1)]),
        ".pos",
        knows={"--unit": "mm", "--deviation-unit": "mm", "--table": "2"},
    ),
    Layout(
        "laser file, cut in mid-row",
        READERS,
        AXIS,
        sections(rows(BOTH)[:-9], end=""),
        None,
        ".rtl",
    ),
    Layout(
        "laser file, cut after a run",
        READERS,
        AXIS,
        sections("".join(rows(BOTH).splitlines(keepends=True)[:27])),
        None,
        ".rtl",
    ),
    Layout(
        "laser file that counts ten targets and lists nine",
        READERS,
        AXIS,
        sections(rows(BOTH), target_count=10),
        None,
        ".rtl",
    ),
    Layout(
        "laser file with a run that has a target twice",
        READERS,
        AXIS,
        sections(rows(BOTH).replace("1   4  ", "1   3  ")),
        None,
        ".rtl",
    ),
]
