"""Periodic errors of scales: one period for a line of machines, an amplitude and phase for every machine.

A period is sought visit by visit, since phases of places far apart need the period to be known better than a grid has
it, and then refined with one phase per machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from stepgauge.files.arrays import Array
from stepgauge.fleet.hierarchical.causes import Cause
from stepgauge.fleet.hierarchical.priors import FleetPriors
from stepgauge.fleet.hierarchical.visits import Crossing, GaugeVisits, split_by_ladder

SHORTEST_MM, LONGEST_MM = 4.0, 200.0
"""Periods: from fine screws to a third of a gauge, below which a period is no straight line."""
MAIN_SHARE = 0.7
"""Least component of a gauge's axis along the scale that it looks at."""
STEP = 0.4
"""Steps of the frequency, in turns over a gauge."""
LEFT = 0.1
"""Least share of a wave that must be left beside origin, slope and block size, for a visit to tell of it."""
FINE, MOST, FINE_STEPS = 61, 50, 24


@dataclass(frozen=True)
class Periodic:
    """A period of one axis of some machines: amplitudes in um by machine, its log factor against none."""

    cause: Cause
    period_mm: float
    log_factor: float
    amplitude_um: dict[str, float]
    u_um: float
    visits: NDArray[np.intp]


def frequencies(ladders: Sequence[GaugeVisits]) -> Array:
    """Turns per mm, fine enough for the longest gauge."""
    longest = max(float(ladder.gauge.position_mm[-1]) for ladder in ladders)
    return np.arange(1.0 / LONGEST_MM, 1.0 / SHORTEST_MM, STEP / longest)


def spectra(ladder: GaugeVisits, solved: Array, axis: int, turns: Array) -> tuple[Array, Array]:
    """Scores and power of a wave in every visit: complex ``(n, p)``, real ``(n, p)``.

    ``solved (n, f)``: V^-1 times the departures. The power is that of the weights alone.
    """
    share = ladder.axis[:, axis]
    score = np.empty((len(share), len(turns)), complex)
    power = np.empty((len(share), len(turns)))
    framed = ladder.frame[None] * ladder.weight[:, :, None]
    for row in range(len(share)):
        wave = _wave(ladder.at_mm[row, :, axis], turns)
        seen = np.column_stack([solved[row], framed[row]]).T.astype(np.complex64) @ wave
        score[row] = seen[0] * share[row]
        taken = np.einsum("ip,ij,jp->p", seen[1:].conj(), ladder.normal[row], seen[1:]).real
        power[row] = share[row] ** 2 * np.maximum(ladder.weight[row].sum() - taken, 0.0) / 2.0
    whole = share**2 * ladder.weight.sum(axis=1) / 2.0
    power[power < LEFT * whole[:, None]] = 0.0
    return np.where(power > 0.0, score, 0.0), power


def _wave(at_mm: Array, turns: Array) -> NDArray[np.complex64]:
    """Unit waves ``(f, p)`` of evenly spaced frequencies: products of coarse and fine steps cost less than sines."""
    step = turns[1] - turns[0] if len(turns) > 1 else 0.0
    fine = _turned(at_mm, np.asarray(step * np.arange(FINE_STEPS), float))
    coarse = _turned(at_mm, turns[::FINE_STEPS])
    return (coarse[:, :, None] * fine[:, None, :]).reshape(len(at_mm), -1)[:, : len(turns)]


def _turned(at_mm: Array, turns: Array) -> NDArray[np.complex64]:
    """Turns are counted in double precision, since places may be metres away."""
    phase = np.outer(at_mm, turns)
    return np.exp((2j * np.pi * (phase - np.rint(phase))).astype(np.complex64))


def log_factor(score: Array, power: Array, sd: float, legitimate: float) -> Array:
    """Of a wave with normal amplitudes of sine and cosine, against one of the size that machines in order have."""
    return _log_marginal(score, power, float(np.hypot(sd, legitimate))) - _log_marginal(score, power, legitimate)


def _log_marginal(score: Array, power: Array, sd: float) -> Array:
    gain = 1.0 + sd**2 * power
    return np.asarray(-np.log(gain) + 0.5 * sd**2 * np.abs(score) ** 2 / gain)


class Waves:
    """Spectra of all visits whose gauge lies along one axis, brought up to date where something is taken off.

    ``visits (v,)`` with ``score`` and ``power (v, p)``; ``place``: ladder and row of every one.
    """

    def __init__(self, ladders: Sequence[GaugeVisits], solved: Sequence[Array], axis: int) -> None:
        self.ladders, self.axis, self.turns = ladders, axis, frequencies(ladders)
        self.along = [np.flatnonzero(np.abs(ladder.axis[:, axis]) > MAIN_SHARE) for ladder in ladders]
        self.visits = np.concatenate([ladder.visits[rows] for ladder, rows in zip(ladders, self.along, strict=True)])
        both = [
            spectra(ladder.part(rows), one[rows], axis, self.turns)
            for ladder, one, rows in zip(ladders, solved, self.along, strict=True)
        ]
        self.score = np.concatenate([score for score, _ in both])
        self.power = np.concatenate([power for _, power in both])

    def renew(self, solved: Sequence[Array], visits: NDArray[np.intp]) -> None:
        """Scores of some visits anew."""
        first = 0
        for ladder, one, rows in zip(self.ladders, solved, self.along, strict=True):
            for number, row in enumerate(rows):
                if ladder.visits[row] in visits:
                    wave = _wave(ladder.at_mm[row, :, self.axis], self.turns)
                    score = one[row] @ wave * ladder.axis[row, self.axis]
                    self.score[first + number] = np.where(self.power[first + number] > 0.0, score, 0.0)
            first += len(rows)


def find_periodic(
    fleet: Crossing, ladders: Sequence[GaugeVisits], solve: Solve, um: Array, priors: FleetPriors
) -> tuple[list[Periodic], Array]:
    """Periods one after the other, the likeliest first, and the departures that they explain, flat.

    ``solve``: V^-1 of departures, flat; ``um``: departures that nothing else explains, flat.
    """
    explained = np.zeros_like(um)
    found: list[Periodic] = []
    solved = split_by_ladder(ladders, solve(um))
    waves = [Waves(ladders, solved, axis) for axis in range(3)]
    while len(found) < MOST:
        best = max((_likeliest(fleet, one, priors) for one in waves), key=lambda candidate: candidate[0])
        if best[0] < np.log(priors.decision.named / (1.0 - priors.decision.named)):
            break
        one, part = _fitted(fleet, ladders, solve, um - explained, best, priors)
        if one.log_factor < 0.0:
            break
        found.append(one)
        explained = explained + part
        solved = split_by_ladder(ladders, solve(um - explained))
        for wave in waves:
            wave.renew(solved, one.visits)
    return found, explained


Solve = Callable[[Array], Array]
Likeliest = tuple[float, str, str, int, float, NDArray[np.intp]]


def _likeliest(fleet: Crossing, waves: Waves, priors: FleetPriors) -> Likeliest:
    """Log odds, kind of owner, owner, axis, turns per mm and visits of the likeliest period along one axis."""
    best: Likeliest = (-np.inf, "", "", waves.axis, 0.0, np.zeros(0, np.intp))
    if not len(waves.visits):
        return best
    for kind in ("type", "machine"):
        prior = priors.kinds[kind]["periodic"]
        factor = log_factor(waves.score, waves.power, prior.usual, priors.legitimate.wave_um)
        number = fleet.owner[kind][waves.visits]
        groups = sparse.csr_matrix((np.ones(len(number)), (number, np.arange(len(number)))))
        total = groups @ factor
        owner, at = np.unravel_index(int(total.argmax()), total.shape)
        odds = float(np.logaddexp.reduce(total[owner])) - np.log(len(waves.turns)) + np.log(prior.odds)
        if odds > best[0]:
            visits = waves.visits[number == owner]
            best = (odds, kind, fleet.names[kind][owner], waves.axis, float(waves.turns[at]), visits)
    return best


def _fitted(
    fleet: Crossing, ladders: Sequence[GaugeVisits], solve: Solve, left: Array, best: Likeliest, priors: FleetPriors
) -> tuple[Periodic, Array]:
    """The period refined with one phase for every machine, and what it explains."""
    _, kind, owner, axis, about, visits = best
    prior, solved = priors.kinds[kind]["periodic"], split_by_ladder(ladders, solve(left))
    step = STEP / max(float(ladder.gauge.position_mm[-1]) for ladder in ladders)
    tried = about + np.linspace(-1.0, 1.0, FINE) * step
    machine, score, power = _coherent(fleet, ladders, solved, axis, tried, visits)
    total = log_factor(score, power, prior.usual, priors.legitimate.wave_um).sum(axis=0)
    at = int(total.argmax())
    shrunk = prior.usual**2 / (1.0 + prior.usual**2 * power[:, at])
    size = shrunk * score[:, at]
    amplitude = {fleet.names["machine"][m]: float(abs(one)) for m, one in zip(machine, size, strict=True)}
    cause = Cause(kind, owner, "periodic", "xyz"[axis])
    u = float(np.sqrt(np.mean(shrunk) / len(machine)))
    odds = float(np.logaddexp.reduce(total)) + np.log(prior.odds / len(frequencies(ladders)) / FINE * 2.0)
    one = Periodic(cause, 1.0 / float(tried[at]), odds, amplitude, u, visits)
    return one, _explained(
        fleet, ladders, axis, float(tried[at]), dict(zip(machine.tolist(), size, strict=True)), visits
    )


def _coherent(
    fleet: Crossing,
    ladders: Sequence[GaugeVisits],
    solved: Sequence[Array],
    axis: int,
    turns: Array,
    visits: NDArray[np.intp],
) -> tuple[NDArray[np.intp], Array, Array]:
    """Scores and power of every machine, its visits with one phase: ``(m,)``, complex and real ``(m, p)``."""
    machines = np.unique(fleet.owner["machine"][visits])
    score = np.zeros((len(machines), len(turns)), complex)
    power = np.zeros((len(machines), len(turns)))
    for ladder, one in zip(ladders, solved, strict=True):
        rows = np.flatnonzero(np.isin(ladder.visits, visits))
        own = spectra(ladder.part(rows), one[rows], axis, turns)
        place = np.searchsorted(machines, fleet.owner["machine"][ladder.visits[rows]])
        np.add.at(score, place, own[0])
        np.add.at(power, place, own[1])
    return machines, score, power


def _explained(
    fleet: Crossing,
    ladders: Sequence[GaugeVisits],
    axis: int,
    turns: float,
    size: dict[int, complex],
    visits: NDArray[np.intp],
) -> Array:
    parts = []
    for ladder in ladders:
        part = np.zeros_like(ladder.um)
        for row in np.flatnonzero(np.isin(ladder.visits, visits)):
            amplitude = size[int(fleet.owner["machine"][ladder.visits[row]])]
            wave = np.exp(2j * np.pi * ladder.at_mm[row, :, axis] * turns) * ladder.axis[row, axis]
            part[row] = (amplitude.conjugate() * wave).real
        parts.append(part.ravel())
    return np.concatenate(parts)
