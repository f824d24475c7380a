"""Ways of measuring that are not ideal: where the gauge lies, what is probed, and when."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.scene import Design, Gauge, Place, certified_gauge, make_gauge, ordinary_clock

Array = NDArray[np.float64]
Random = np.random.Generator
RHYTHM_S = 5.0
MONTH_S = 365.25 * 86400.0 / 12.0
LONG_TRAVEL_MM = np.array([[0.0, 6000.0], [0.0, 1000.0], [0.0, 600.0]])
LARGE_TRAVEL_MM = np.array([[0.0, 2000.0], [0.0, 3000.0], [0.0, 1000.0]])
"""Of a bed of six metres, and of a large bridge."""


def _turned(degrees: float) -> tuple[float, float, float]:
    """A direction in the plane of the table, from x."""
    return float(np.cos(np.radians(degrees))), float(np.sin(np.radians(degrees))), 0.0


def off_axis(random: Random, placings: int) -> list[Place]:
    """The gauge lies 0.5 to 45 deg off x (small angles as often as large ones), then as much off y."""
    degrees = float(np.exp(random.uniform(np.log(0.5), np.log(45.0)))) * float(random.choice([-1.0, 1.0]))
    return [(_turned(degrees + 90.0 * k), (350.0, 480.0, 200.0)) for k in range(placings)]


def tilted(random: Random, placings: int) -> list[Place]:
    """The gauge stands 5 to 40 deg above the table, along x, then along y."""
    places: list[Place] = []
    for k in range(placings):
        rise = np.radians(random.uniform(5.0, 40.0)) * random.choice([-1.0, 1.0])
        flat = np.cos(rise) * np.array(_turned(90.0 * k + random.uniform(-20.0, 20.0)))
        places.append(((flat[0], flat[1], float(np.sin(rise))), (350.0, 480.0, 290.0)))
    return places


def far_corner(random: Random) -> list[Place]:
    """Four placings of a short gauge in the far corner of the machine."""
    middle = (560.0, 850.0, 250.0)
    return [(_turned(degrees), middle) for degrees in (0.0, 45.0, 135.0, 90.0)]


def along_the_bed(random: Random) -> list[Place]:
    """One placing in the middle of a bed of six metres."""
    return [((1.0, 0.0, 0.0), (3000.0, 420.0, 200.0))]


def corners(random: Random) -> list[Place]:
    """A large bridge: in two opposite corners along one diagonal, in the others along the other."""
    low, high = (random.uniform(500.0, 700.0, 2) * share for share in (1.0, np.array([2.2, 3.6])))
    rising, falling = _turned(45.0), _turned(135.0)
    middles = (
        (rising, low[0], low[1]),
        (falling, high[0], low[1]),
        (rising, high[0], high[1]),
        (falling, low[0], high[1]),
    )
    return [(axis, (float(x), float(y), 300.0)) for axis, x, y in middles]


def _short(random: Random) -> tuple[Gauge, int]:
    return make_gauge(random, 200.0), int(random.integers(4, 7))


def metre(random: Random) -> tuple[Gauge, int]:
    """A gauge of 0.6 to 1 m, in two or three cycles."""
    return certified_gauge(random, 40.0, int(random.integers(16, 26)), 20.0), int(random.integers(2, 4))


def _metres(random: Random) -> tuple[Gauge, int]:
    """Eleven places, 250 or 500 mm apart, probed from both sides in 8 to 12 cycles."""
    return certified_gauge(random, float(random.choice([250.0, 500.0])), 11, 40.0), int(random.integers(8, 13))


def _one_spot(random: Random) -> tuple[Gauge, int]:
    """An hour at one face, a touch every 4 to 6 s."""
    return make_gauge(random, 480.0), int(random.integers(600, 901))


def _two_years(random: Random) -> tuple[Gauge, int]:
    """Twelve to sixteen blocks, once in each of 24 months."""
    return certified_gauge(random, 25.0, int(random.integers(12, 17)), 10.0), 24


def rhythm_clock(table: dict[str, Array], random: Random) -> Array:
    """A touch every 5.0 s exactly; to lay the gauge again takes a whole number of beats."""
    new_place = np.r_[False, np.diff(table["placement"]) != 0]
    beats = 1 + np.where(new_place, random.integers(100, 240, len(new_place)), 0)
    return np.asarray(RHYTHM_S * np.cumsum(beats), float)


def hour_clock(table: dict[str, Array], random: Random) -> Array:
    """Touches evenly over an hour, give or take 50 ms."""
    n = len(table["face"])
    return np.asarray(np.round(3600.0 / n * np.arange(1, n + 1) + random.uniform(0.0, 0.05, n), 3))


def monthly_clock(table: dict[str, Array], random: Random) -> Array:
    """A series of some minutes every month, give or take two days."""
    within = ordinary_clock(table, random)
    months = table["cycle"] - 1
    days_off = random.uniform(-2.0, 2.0, int(table["cycle"].max()))
    return np.asarray(within + months * MONTH_S + days_off[months.astype(int)] * 86400.0 + 3.0 * 86400.0)


WAYS: dict[str, tuple[Design, ...]] = {
    "off_axis": (
        Design(places=partial(off_axis, placings=1)),
        Design(places=partial(off_axis, placings=2), longest_mm=420.0),
    ),
    "tilted": (Design(places=partial(tilted, placings=1)), Design(places=partial(tilted, placings=2))),
    "rhythm": (Design("x", clock=rhythm_clock), Design("x_y", clock=rhythm_clock)),
    "long": (Design(places=along_the_bed, extent=_metres, travel_mm=LONG_TRAVEL_MM),),
    "hour": (Design("x", extent=_one_spot, clock=hour_clock, one_face=True, speeds=1),),
    "years": (Design("x", extent=_two_years, clock=monthly_clock, pauses_per_placement=0),),
    "far": (Design(places=far_corner, extent=_short),),
}
"""Measurements of each way; ``far`` is a short gauge far from zero."""
