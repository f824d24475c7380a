"""Numbers and tables as further makes write them: exponents with D, degrees and minutes, runs as rows."""

from __future__ import annotations

import pandas as pd

from tests.importing.layouts.handed import BOTH, MM, word
from tests.importing.layouts.judge import AXIS, GAUGE, Layout
from tests.importing.layouts.truth import BESIDE, NINE, ON_GAUGE, comma, lines, probed, told

H = "tables as laboratories hand them over"
POINTS = probed()
SECONDS = BOTH.assign(target=BOTH.target * 0.4, deviation=(BOTH.deviation + 7.0).round(2))
"""An axis of rotation: targets in deg, deviations in arcsec."""


def parts(degrees: float) -> tuple[int, int, float]:
    """Degrees, minutes and seconds."""
    seconds = round(degrees * 3600.0, 2)
    return int(seconds // 3600), int(seconds % 3600 // 60), round(seconds % 60, 2)


def by_run() -> str:
    """A row per run: its number, its direction, and the deviation at every target."""
    runs = BOTH.groupby(["cycle", "way"], sort=False)
    return "".join(
        f"{cycle};{'+' if way > 0 else '-'};{';'.join(map(str, run.sort_values('target').deviation))}\n"
        for (cycle, way), run in runs
    )


def fortran(row: pd.Series) -> str:
    return f"{row.target / 1e3:12.4f}D+03  {row.reading / 1e3:18.11f}D+03  {row.way:3.0f}  {row.cycle:3.0f}"


def behind(value: float) -> str:
    """A number with its minus behind it."""
    return comma(abs(value), 3) + ("-" if value < 0 else "")


def angle(row: pd.Series) -> tuple[int, int, float]:
    return parts(row.target + row.deviation / 3600.0)


LAYOUTS = [
    Layout(
        "a row per run, targets name the columns",
        H,
        AXIS,
        "Run;Dir;" + ";".join(f"{t:g} mm" for t in NINE) + "\n" + by_run(),
        told(BOTH),
        knows={"--deviation-unit": "um"},
    ),
    Layout(
        "a row per run, targets without a unit name the columns",
        H,
        AXIS,
        "Lauf;Richtung;" + ";".join(f"{t:g}" for t in NINE) + "\n" + by_run(),
        told(BOTH),
        knows={"--deviation-unit": "um", **MM},
    ),
    Layout(
        "exponents of Fortran, fixed width",
        H,
        AXIS,
        "   TARGET_MM        READING_MM     WAY  CYC\n" + lines(BOTH, fortran),
        told(BOTH),
        ".txt",
    ),
    Layout(
        "the minus behind the number",
        H,
        AXIS,
        "Target mm;Error um;Dir\n"
        + lines(BOTH, lambda r: f"{comma(r.target, 1)};{behind(r.deviation)};{word(r, 'up', 'down')}"),
        told(BOTH),
    ),
    Layout(
        "degrees, minutes and seconds in one cell",
        H,
        AXIS,
        "Target [deg];Reading;Dir\n"
        + lines(SECONDS, lambda r: "{:g};{}°{:02d}'{:05.2f}\";{}".format(r.target, *angle(r), word(r, "+", "-"))),
        told(SECONDS),
        units=("deg", "arcsec"),
    ),
    Layout(
        "degrees, minutes and seconds in three columns",
        H,
        AXIS,
        "Target [deg];deg;min;sec;Dir\n"
        + lines(SECONDS, lambda r: "{:g};{};{};{};{}".format(r.target, *angle(r), word(r, "+", "-"))),
        told(SECONDS),
        units=("deg", "arcsec"),
    ),
    Layout(
        "points by number, their values in a line",
        "unconfirmed",
        AXIS,
        "".join(
            f"MEASURING POINT {n}\nSetpoint: {r.target:.3f} mm   Actual: {r.reading:.7f} mm\n"
            for n, r in enumerate(BOTH.itertuples(), 1)
        ),
        told(BOTH),
        ".txt",
        knows=MM,
    ),
    Layout(
        "inch and microinch by the sign for micro",
        H,
        AXIS,
        "Target (in),Error (µin),Dir\n"
        + lines(BOTH, lambda r: f"{r.target / 25.4:.9f},{r.deviation / 25.4e-3:.5f},{word(r, '+', '-')}"),
        told(BOTH),
    ),
    Layout(
        "pages with the header again, which are no runs",
        H,
        AXIS,
        "".join(
            f"Page {n // 9 + 1}\nTarget [mm];Reading [mm];Dir\n"
            + lines(BOTH[n : n + 9], lambda r: f"{r.target};{r.reading:.7f};{word(r, '+', '-')}")
            for n in range(0, len(BOTH), 9)
        ),
        told(BOTH),
    ),
    Layout(
        "coordinates of a point below one another",
        "public parsers of such reports",
        GAUGE,
        "".join(
            f"PNT{n}  X  {r.x_mm:.4f}\nPNT{n}  Y  {r.y_mm:.4f}\nPNT{n}  Z  {r.z_mm:.4f}\n"
            for n, r in enumerate(POINTS.itertuples(), 1)
        ),
        POINTS,
        ".txt",
        options=(*ON_GAUGE, "--tip-radius", "2"),
        beside=BESIDE,
    ),
]
