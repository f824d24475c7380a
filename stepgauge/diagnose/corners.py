"""Waves with corners: what repeats in a sawtooth or a square wave, where a sine is only the fundamental of it.

A room heated by a thermostat, a table of corrections without interpolation, a relay: each repeats, and jumps. They are
looked for near the best sine, which carries most of such a wave. In a few bins of the phase the products with waves of
all phases are sums by bins, so that a look costs little more than the sums for each of a few periods.

How many looks that is: the band-limited waves of all phases and periods draw a surface on the unit sphere. Where a sine
draws its way in one direction for the phase and in one for the period, a wave of amplitudes a_k draws both by a factor
of (sum k^2 a_k^2 / sum a_k^2)^(1/2) longer (Worsley's count of looks for a surface: see :mod:`~.extent`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from stepgauge.diagnose.extent import Extent
from stepgauge.diagnose.forms import axes_shown, covariates, make_form, mask
from stepgauge.diagnose.library import Family
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.search import COLLINEAR, PERIODS, Judge, Look
from stepgauge.diagnose.solve import Solved
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
SAWTOOTH, SQUARE = SHAPES = "sawtooth", "square wave"
ORDERS = np.arange(1.0, 9.0)
AMPLITUDES = {SAWTOOTH: 1.0 / ORDERS, SQUARE: (ORDERS % 2.0) / ORDERS}
"""Of the fundamental and its overtones (the Fourier series of the waves), as far as a corner is seen."""
TURNS = {SAWTOOTH: 1.0, SQUARE: 0.5}
"""Phases, turns, after which a wave is itself again but for its sign."""
BINS = 48
"""Of the phase: a jump is placed to half of one."""
STEPS = np.linspace(-1.0, 1.0, 9) / 3.0
"""Frequencies about that of the best sine, cycles over the span of the covariate."""
FINE_STEPS, FINER = np.linspace(-1.0, 1.0, 21) / 3.0, np.linspace(-0.5, 0.5, 5)
"""The same where the wave is fitted, and bins of the phase about the best."""
FEWEST_CYCLES = 0.5
"""In the span of the covariate, below which nothing repeats."""
FEWEST_IN_PERIOD = 6.0
"""Values of the covariate in a period below which its corners are not seen, and any alternation is such a wave."""
LEAST_SINE = 15.0
"""Gain of the best sine below which no wave could be told from scatter."""
SIDES = ("approach", "gauge", "x", "y", "z")
"""Where waves are looked for; those of one side's faces only are described by their sines."""


@dataclass(frozen=True)
class WaveLook(Look):
    """A look at a wave.

    ``period`` in the unit of its covariate; ``ahead``: the share of a period that it is ahead of one beginning at
    nought; ``column (n,)``: what it moves the readings by along the approach for an amplitude of one um.
    """

    period: float = 0.0
    ahead: float = 0.0
    column: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Corners:
    """Waves of one shape over a covariate ``values (n,)`` that show in every row by a ``share (n,)``.

    ``sines``: the family of what is their fundamental.
    """

    family: Family
    sines: Family
    values: Array
    share: Array

    @property
    def form(self) -> str:
        """The shape of the wave."""
        return str(self.family.details["form"])

    @property
    def side(self) -> str:
        """On which side of the gauge, or along which axis, it moves the readings."""
        return str(self.family.details["side"])

    def look(
        self, periods: Array, sines: Extent, left: Array, model: Array, judge: Judge, whitening: Whitening
    ) -> WaveLook:
        """The best wave with one of some periods, found near one of the sines of an extent.

        It is looked for beside a model's orthonormal columns ``(n, k)``; ``left`` is free of these.
        """
        gain, period, ahead = self.best(periods, left, model, whitening)
        found = judge.look(self.family, 0, gain, self._extent(sines))
        column = wave(self.form, self.values / period + ahead) * self.share
        return WaveLook(**vars(found), period=period, ahead=ahead, column=column)

    def about(self, period: float, left: Array, whitening: Whitening) -> Iterator[tuple[float, float]]:
        """Periods and shares of one ahead on a finer grid about those of the best wave near the best sine."""
        periods = self.periods_near(period, FINE_STEPS)
        if not len(periods):
            return
        _, period, ahead = self.best(periods, left, np.zeros((len(left), 0)), whitening)
        near = self.periods_near(period, FINE_STEPS / len(FINE_STEPS))
        yield from product(map(float, near), ahead + FINER / BINS)

    def best(self, periods: Array, left: Array, model: Array, whitening: Whitening) -> tuple[float, float, float]:
        """Gain, period and share of a period ahead of the best wave with one of some periods."""
        back = whitening.carried_back(np.column_stack([left, model]))
        gains = np.array([self._gains(period, back, whitening) for period in periods])
        near, phase = np.unravel_index(int(gains.argmax()), gains.shape)
        return float(gains[near, phase]), float(periods[near]), float(phase / BINS)

    def periods_near(self, period: float, steps: Array) -> Array:
        """Periods about another, in ``steps`` of their number in the span; none where corners could not be seen."""
        span, most = float(np.ptp(self.values)), len(np.unique(self.values)) / FEWEST_IN_PERIOD
        cycles = span / period + steps
        return span / cycles[(cycles > FEWEST_CYCLES) & (cycles < most)]

    def _gains(self, period: float, back: Array, whitening: Whitening) -> Array:
        """Gains of waves of all phases, ``(BINS,)``; ``back``: see :meth:`Whitening.carried_back`."""
        scaled = self.share * whitening.inverse_sigma
        take, middle = whitening.squared
        columns = np.column_stack([back * self.share[:, None], take * scaled[:, None], scaled**2])
        by_bin = self._bins(period) @ columns
        waves = band_limited(self.form)
        dots, square = waves @ by_bin[:, :-1], waves**2 @ by_bin[:, -1]
        dot, beside, taken = np.split(dots, [1, back.shape[1]], axis=1)
        seen = square - ((taken @ middle) * taken).sum(axis=1) - (beside**2).sum(axis=1)
        stiff = self.family.prior**-2
        return np.where(seen > COLLINEAR * square, dot[:, 0] ** 2 / (np.maximum(seen, 0.0) + stiff), 0.0)

    def _bins(self, period: float) -> sparse.csr_array:
        """Which rows fall in which bin of the phase, ``(BINS, n)``."""
        bins = np.floor(self.values / period % 1.0 * BINS).astype(int) % BINS
        rows = np.arange(len(bins))
        return sparse.csr_array((np.ones(len(bins)), (bins, rows)), shape=(BINS, len(bins)))

    def _extent(self, sines: Extent) -> Extent:
        longer, turn = steeper(self.form), 2.0 * np.pi * TURNS[self.form]
        atoms = sines.atoms * len(STEPS) * BINS
        return Extent(atoms, turn * np.sqrt(longer), turn * sines.length * longer)


def corners(families: Sequence[Family], data: Residuals) -> Iterator[Corners]:
    """Waves near the forms of sines among some."""
    values = {one.name: one.values for one in covariates(data)}
    for sines in families:
        if sines.details.get("form") == "period" and sines.details["side"] in SIDES:
            side, unit = sines.details["side"], sines.details["unit"]
            yield from waves(sines, values[sines.covariate], mask(data, side), side, unit, data)


def corners_of(solved: Solved, data: Residuals) -> list[Corners]:
    """Waves whose fundamental an oscillation of the vocabulary may be, moving what it moves; none for another law."""
    name = next((name for name in solved.family.atoms[0] if name in PERIODS), None)
    if name is None:
        return []
    over_mm = name == "period_mm"
    values = data.probings.coordinate_mm(str(solved.family.choices["axis"])) if over_mm else data.probings.time_s
    angle = 2.0 * np.pi * values / period_of(solved)
    sine, cosine = (solved.displacement_um(data, phase_deg=phase) for phase in (0.0, 90.0))
    share = sine * np.sin(angle) + cosine * np.cos(angle)
    share = share / max(float(np.abs(share).max()), 1e-300)
    sides = {side: mask(data, side) for side in ("approach", "gauge", *axes_shown(data))}
    alike = max(sides, key=lambda side: abs(float(share @ sides[side])) / float(np.linalg.norm(sides[side])))
    return list(waves(solved.family, values, share, alike, "mm" if over_mm else "s", data))


def period_of(solved: Solved) -> float:
    """The period of an oscillation of the vocabulary, s or mm."""
    name = next(name for name in solved.family.atoms[0] if name in PERIODS)
    value = float(getattr(solved.effect, name))
    return 1.0 / value if name == "frequency_hz" else value


def waves(sines: Family, values: Array, share: Array, side: str, unit: str, data: Residuals) -> Iterator[Corners]:
    """A wave of every shape over a covariate's values, with a share in every row, told as on the side it is like."""
    for form in SHAPES:
        family = make_form(form, sines.covariate, side, share[None, None], data)
        family = replace(family, details=family.details | {"unit": unit})
        yield Corners(family, sines, values, share)


def wave(form: str, turns: Array) -> Array:
    """A wave of unit amplitude with its corners, by the turns since its jump (of a square wave: upwards)."""
    part = turns % 1.0
    return 1.0 - 2.0 * part if form == SAWTOOTH else np.where(part < 0.5, 1.0, -1.0)


def formula(form: str, name: str, period: float, ahead: float) -> str:
    """The same in a formula, over a covariate with a name there."""
    part = f"({name} / {period:.12g} + {ahead:.6g}) % 1"
    return f"(1 - 2 * ({part}))" if form == SAWTOOTH else f"(1 - 2 * step({part} - 0.5))"


def band_limited(form: str) -> Array:
    """The same as far as the orders go, for every phase ``(BINS, BINS)`` in the middles of the bins."""
    ahead = np.arange(BINS)[:, None] + np.arange(BINS) + 0.5
    return np.tensordot(AMPLITUDES[form], np.sin(ORDERS[:, None, None] * 2.0 * np.pi * ahead / BINS), 1)


def steeper(form: str) -> float:
    """Mean square of a band-limited wave's slope over that of a sine of the same mean square."""
    squares = AMPLITUDES[form] ** 2
    return float((ORDERS**2 * squares).sum() / squares.sum())
