"""What a recorded temperature did while nobody read it, as an uncertainty of the laws that follow it.

A lag remembers: what the air did in a pause, or before the first reading, acts on the readings after it. The law takes
the temperature to go straight from one reading to the next, and to have been at rest before the first. What it would
have been had it gone on smoothly, with the rates of change on either side, is as possible; the difference counts as a
standard uncertainty of the input (GUM 4.3.7), pause by pause. Its share, of which the readings may tell something, is
fitted beside size and lag with that prior, and leaves its uncertainty in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.beside import Beside, beside
from stepgauge.diagnosis.fits.solve import Estimate, Fitted, Solved
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import along_approach_um
from stepgauge.effects.following import Following
from stepgauge.effects.probings import Probings

Array = NDArray[np.float64]
LAG, UNREAD = "lag_s", "unread"
MOST_PAUSES = 20
"""The longest pauses; in shorter ones a curve and its chord differ with the square of the time."""
FEWEST = 3
"""Readings from which a rate of change is taken."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


def with_unrecorded(fitted: Fitted, data: Residuals, metric: Metric) -> Fitted:
    """The fit, with larger uncertainties of size and lag of the laws that follow a temperature."""
    solved = [
        _wider(one, beside(fitted, place, data, metric), data) if isinstance(one.effect, Following) else one
        for place, one in enumerate(fitted.solved)
    ]
    return replace(fitted, solved=tuple(solved))


def _wider(solved: Solved, beside: Beside, data: Residuals) -> Solved:
    effect = solved.effect
    assert isinstance(effect, Following)
    if not effect.lag_s or solved.parameters[LAG].u is None:
        return solved
    (size,) = (p.name for p in type(effect).parameters() if p.role == "linear")
    value = solved.parameters[size].value
    if not value:
        return solved
    longer = solved.displacement_um(data, **{LAG: effect.lag_s * 1.01}) - solved.displacement_um(data)
    unread = np.array([_moved(effect, shift, data) for shift in _shifts(effect, data)])
    columns = beside(
        np.vstack([solved.displacement_um(data), longer * 100.0, unread])
    )  # of size and lag as shares of themselves
    known = np.diag([0.0, 0.0, *np.ones(len(unread))])
    covariance = np.linalg.pinv(columns @ columns.T + known, hermitian=True)
    move = covariance @ (columns @ (beside.left - beside(solved.displacement_um(data))))
    share = np.sqrt(np.diag(covariance)[:2] + move[:2] ** 2)
    u = {size: abs(value) * float(share[0]), LAG: effect.lag_s * float(share[1])}
    told = {name: _at_least(one, u.get(name, 0.0)) for name, one in solved.parameters.items()}
    return replace(solved, parameters=told)


def _at_least(one: Estimate, u: float) -> Estimate:
    return one if one.u is None else replace(one, u=max(one.u, float(u)))


def _moved(effect: Following, shift_K: Array, data: Residuals) -> Array:
    """Displacement along the approach ``(n,)`` by a shift of the temperature that acts."""
    probings = Probings({**_columns(data), UNREAD: shift_K}, data.probings.setting)
    acting = effect.model_copy(update={"column": UNREAD, "minus": None, LAG: 0.0, "from_C": 0.0})
    return np.broadcast_to(along_approach_um(acting, probings), len(data)).astype(float)


def _columns(data: Residuals) -> dict[str, Array]:
    return {str(name): data.probings.column(name) for name in data.frame.columns}


def _shifts(effect: Following, data: Residuals) -> Iterator[Array]:
    """By how much the acting temperature would be another ``(n,)``, K: before the record, and for each pause."""
    for name in filter(None, (effect.column, effect.minus)):
        time_s, values = data.probings.time_s, data.probings.column(name).astype(float)
        order = np.argsort(time_s, kind="stable")
        for shift in unread_shifts(time_s[order], values[order], effect.lag_s):
            found = np.empty(len(data))
            found[order] = shift
            yield found


def unread_shifts(time_s: Array, values: Array, lag_s: float) -> Iterator[Array]:
    """Shifts ``(n,)`` of the lagged ``values`` of rising ``time_s`` by what may have been where there is no reading.

    A curve with the rates of change at both ends of a pause (a cubic) in place of the chord, and a rate before the
    record in place of rest.
    """
    yield -_bend(time_s, values, 0, lag_s, 1, 0.0) * lag_s * np.exp(-(time_s - time_s[0]) / lag_s)
    steps = np.diff(time_s)
    for row in np.argsort(-steps)[:MOST_PAUSES]:
        long_s = float(steps[row])
        chord = (values[row + 1] - values[row]) / max(long_s, 1e-9)
        before, behind = (_bend(time_s, values, row + i, long_s, way, chord) for i, way in ((0, -1), (1, 1)))
        u = (NODES + 1.0) / 2.0
        off = long_s * (before * u * (1.0 - u) ** 2 - behind * u**2 * (1.0 - u))
        acted = float(WEIGHTS @ (off * np.exp(-long_s * (1.0 - u) / lag_s))) * long_s / (2.0 * lag_s)
        after = np.maximum(time_s - time_s[row + 1], 0.0)
        yield np.where(np.arange(len(time_s)) > row, acted * np.exp(-after / lag_s), 0.0)


def _bend(time_s: Array, values: Array, row: int, within_s: float, way: int, expected: float) -> float:
    """Rate of change minus the expected one, from a row on (way 1) or up to it (-1); 0 where there are few readings.

    The rate is that of the readings within some time.
    """
    near = (way * (time_s - time_s[row]) >= 0.0) & (np.abs(time_s - time_s[row]) <= within_s)
    if near.sum() < FEWEST or np.ptp(time_s[near]) == 0.0:
        return 0.0
    own = time_s[near] - time_s[near].mean()
    return float(own @ values[near] / (own @ own)) - expected
