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
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from stepgauge.diagnose.extent import Extent
from stepgauge.diagnose.forms import Covariate, axes_shown, covariates, make_form, mask
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
STEPS = np.linspace(-1.0, 1.0, 7) / 3.0
"""Frequencies about that of the best sine, cycles over the span of the covariate."""
FINE_STEPS, FINER = np.linspace(-1.0, 1.0, 21) / 3.0, np.linspace(-0.5, 0.5, 5)
"""The same where the wave is fitted, and bins of the phase about the best."""
FEWEST_CYCLES = 1.0
"""In the span of the covariate, below which nothing repeats."""
FEWEST_IN_PERIOD = 6.0
"""Values of the covariate in a period below which its corners are not seen, and any alternation is such a wave."""
LEAST_SINE = 15.0
"""Gain of the best sine below which no wave could be told from scatter."""
SINES_SHARE, CHEAPEST = 0.6, 80.0
"""Share of a sawtooth that a sine explains, and gain by which other forms may be the dearer description."""
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
    """Waves over a covariate ``values (n,)`` that show in every row by a ``share (n,)``.

    ``families``: one for each shape; ``sines``: the family of what is their fundamental.
    """

    families: Sequence[Family]
    sines: Family
    values: Array
    share: Array

    def looks(
        self, periods: Array, extent: Extent, left: Array, model: Array, judge: Judge, whitening: Whitening
    ) -> Iterator[WaveLook]:
        """The best wave of every shape with one of some periods, found near one of the sines of an ``extent``.

        It is looked for beside a model's orthonormal columns ``(n, k)``; ``left`` is free of these.
        """
        for family, (gain, period, ahead) in zip(
            self.families, self.best(periods, left, model, whitening), strict=True
        ):
            form = str(family.details["form"])
            found = judge.look(family, 0, gain, _extent(form, extent))
            column = wave(form, self.values / period + ahead) * self.share
            yield WaveLook(**vars(found), period=period, ahead=ahead, column=column)

    def about(self, form: str, period: float, left: Array, whitening: Whitening) -> Iterator[tuple[float, float]]:
        """Periods and shares of one ahead on a finer grid about the best wave with about a period."""
        periods = self.periods_near(period, FINE_STEPS / 4.0)
        if not len(periods):
            return
        none = np.zeros((len(left), 0))
        _, best, ahead = self.best(periods, left, none, whitening)[SHAPES.index(form)]
        yield from product(map(float, self.periods_near(best, FINE_STEPS / 20.0)), ahead + FINER / BINS)

    def best(self, periods: Array, left: Array, model: Array, whitening: Whitening) -> list[tuple[float, float, float]]:
        """Gain, period and share of a period ahead of the best wave of every shape with one of some periods."""
        columns, known = self._columns(left, model, whitening), 1 + model.shape[1]
        gains = np.stack([self._gains(period, columns, known, whitening) for period in periods], axis=1)
        best = [np.unravel_index(int(own.argmax()), own.shape) for own in gains]
        return [
            (float(own[at]), float(periods[at[0]]), float(at[1] / BINS)) for own, at in zip(gains, best, strict=True)
        ]

    def periods_near(self, period: float, steps: Array) -> Array:
        """Periods about another, in ``steps`` of their number in the span; none where corners could not be seen."""
        span, most = float(np.ptp(self.values)), len(np.unique(self.values)) / FEWEST_IN_PERIOD
        cycles = span / period + steps
        return span / cycles[(cycles > FEWEST_CYCLES) & (cycles < most)]

    def _columns(self, left: Array, model: Array, whitening: Whitening) -> Array:
        """What sums over bins are made of, ``(n, q)``: for the products with the residual, the model, the nuisances."""
        scaled = self.share * whitening.inverse_sigma
        back = whitening.carried_back(np.column_stack([left, model]))
        return np.column_stack([back * self.share[:, None], whitening.squared[0] * scaled[:, None], scaled**2])

    def _gains(self, period: float, columns: Array, known: int, whitening: Whitening) -> Array:
        """Gains of all shapes and phases, ``(shapes, BINS)``; ``known``: columns of the residual and the model."""
        by_bin, shapes = self._bins(period) @ columns, band_limited()
        dots, square = shapes @ by_bin[:, :-1], shapes**2 @ by_bin[:, -1]
        dot, beside, taken = np.split(dots, [1, known], axis=-1)
        seen = square - ((taken @ whitening.squared[1]) * taken).sum(axis=-1) - (beside**2).sum(axis=-1)
        stiff = self.sines.prior**-2
        return np.where(seen > COLLINEAR * square, dot[..., 0] ** 2 / (np.maximum(seen, 0.0) + stiff), 0.0)

    def _bins(self, period: float) -> sparse.csr_array:
        """Which rows fall in which bin of the phase, ``(BINS, n)``."""
        bins = np.floor(self.values / period % 1.0 * BINS).astype(int) % BINS
        rows = np.arange(len(bins))
        return sparse.csr_array((np.ones(len(bins)), (bins, rows)), shape=(BINS, len(bins)))


def _extent(form: str, sines: Extent) -> Extent:
    """What waves of all phases and of the periods of some sines draw."""
    longer, turn = steeper(form), 2.0 * np.pi * TURNS[form]
    atoms = sines.atoms * len(STEPS) * BINS
    return Extent(atoms, turn * np.sqrt(longer), turn * sines.length * longer)


def corners(families: Sequence[Family], data: Residuals) -> Iterator[Corners]:
    """Waves near the forms of sines among some."""
    over = {one.name: one for one in covariates(data)}
    for sines in families:
        if sines.details.get("form") == "period" and sines.details["side"] in SIDES:
            side = sines.details["side"]
            yield waves(sines, over[sines.covariate], mask(data, side), side, data)


def corners_of(solved: Solved, data: Residuals) -> Corners | None:
    """Waves whose fundamental an oscillation of the vocabulary may be, moving what it moves; None for another law."""
    name = next((name for name in solved.family.atoms[0] if name in PERIODS), None)
    if name is None:
        return None
    place = f"machine {solved.family.choices['axis']}" if name == "period_mm" else "time"
    over = next((one for one in covariates(data) if one.name == place), None)
    if over is None:
        return None
    angle = 2.0 * np.pi * over.values / period_of(solved)
    sine, cosine = (solved.displacement_um(data, phase_deg=phase) for phase in (0.0, 90.0))
    share = sine * np.sin(angle) + cosine * np.cos(angle)
    share = share / max(float(np.abs(share).max()), 1e-300)
    sides = {side: mask(data, side) for side in ("approach", "gauge", *axes_shown(data))}
    alike = max(sides, key=lambda side: abs(float(share @ sides[side])) / float(np.linalg.norm(sides[side])))
    return waves(solved.family, over, share, alike, data)


def period_of(solved: Solved) -> float:
    """The period of an oscillation of the vocabulary, s or mm."""
    name = next(name for name in solved.family.atoms[0] if name in PERIODS)
    value = float(getattr(solved.effect, name))
    return 1.0 / value if name == "frequency_hz" else value


def waves(sines: Family, over: Covariate, share: Array, side: str, data: Residuals) -> Corners:
    """Waves of every shape over a covariate, with a share in every row, told as on the side it is like."""
    families = [make_form(form, over.name, side, share[None, None], data) for form in SHAPES]
    told = [replace(family, details=family.details | {"unit": over.unit}) for family in families]
    return Corners(told, sines, over.values, share)


def wave(form: str, turns: Array) -> Array:
    """A wave of unit amplitude with its corners, by the turns since its jump (of a square wave: upwards)."""
    part = turns % 1.0
    return 1.0 - 2.0 * part if form == SAWTOOTH else np.where(part < 0.5, 1.0, -1.0)


def formula(form: str, name: str, period: float, ahead: float) -> str:
    """The same in a formula, over a covariate with a name there."""
    part = f"({name} / {period:.12g} + {ahead:.6g}) % 1"
    return f"(1 - 2 * ({part}))" if form == SAWTOOTH else f"(1 - 2 * step({part} - 0.5))"


@cache
def band_limited() -> Array:
    """Waves as far as the orders go, in the middles of the bins, for every shape and phase ``(shapes, BINS, BINS)``."""
    ahead = np.arange(BINS)[:, None] + np.arange(BINS) + 0.5
    sines = np.sin(ORDERS[:, None, None] * 2.0 * np.pi * ahead / BINS)
    return np.array([np.tensordot(AMPLITUDES[form], sines, 1) for form in SHAPES])


def steeper(form: str) -> float:
    """Mean square of a band-limited wave's slope over that of a sine of the same mean square."""
    squares = AMPLITUDES[form] ** 2
    return float((ORDERS**2 * squares).sum() / squares.sum())
