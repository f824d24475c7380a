"""Where on the map the disagreement lives, and what is left that no change of the construction explains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.fit import Fitted
from stepgauge.diagnose.result import Located
from stepgauge.diagnose.search import log_p_value
from stepgauge.diagnose.whitening import orthonormal

Array = NDArray[np.float64]
FALSE_ALARM = 0.004
"""Chance that structure is seen where there is none."""
EXPLAINED = 0.85
"""The named changes must make up this share of the structure that they are in, or it counts as unknown."""
HARMONICS = (1, 2, 3, 4, 6)
MOST_LOCATED = 4
_LOBES = {1: "one lobe", 2: "two lobes", 3: "three lobes", 4: "four lobes", 6: "six lobes"}


@dataclass(frozen=True)
class Form:
    """A shape without a law: of which quantity, over which covariate, its columns ``(d, n)``."""

    quantity: int
    covariate: str
    form: str
    where: str
    columns: Array


def forms_of(data: MapData) -> Iterator[Form]:
    """Offset, trend and bow over the polar angle, free shape by rings, harmonics and free shape over the azimuth."""
    for i, measured in enumerate(data.measured):
        name = measured.name.rsplit("_", 1)[0].replace("_", " ")
        yield Form(i, "all directions", "offset", f"{name}: a constant", np.ones((1, len(data))))
        yield from _polar_forms(i, name, data)
        yield from _azimuth_forms(i, name, data)


def _polar_forms(i: int, name: str, data: MapData) -> Iterator[Form]:
    rings = int(data.rings.max()) + 1
    if rings > 1:
        u = (data.polar_deg - data.polar_deg.mean()) / np.ptp(data.polar_deg)
        yield Form(i, "polar_deg", "trend", f"{name}: grows or falls with the polar angle", u[None])
        if rings > 2:
            yield Form(i, "polar_deg", "bow", f"{name}: a bow over the polar angle", np.stack([u, u**2]))
        if 3 < rings <= len(data) // 3:
            yield Form(i, "polar_deg", "free shape", f"{name}: changes with the polar angle", _groups(data.rings))


def _azimuth_forms(i: int, name: str, data: MapData) -> Iterator[Form]:
    azimuth, spokes = np.radians(data.azimuth_deg), int(data.spokes.max()) + 1
    for order in HARMONICS:
        if spokes > 2 * order or (spokes > 3 and order >= 3):
            waves = np.stack([np.cos(order * azimuth), np.sin(order * azimuth)])
            yield Form(i, "azimuth_deg", f"harmonic {order}", f"{name}: {_LOBES[order]} in the azimuth", waves)
    if 3 < spokes <= len(data) // 3:
        yield Form(i, "azimuth_deg", "free shape", f"{name}: changes with the azimuth", _groups(data.spokes))


def _groups(index: NDArray[np.intp]) -> Array:
    """Indicators of groups less their mean, at most eight of them."""
    count = int(index.max()) + 1
    bins = index * min(count, 8) // count
    columns = (bins == np.arange(bins.max() + 1)[:, None]).astype(float)
    return (columns - columns.mean(axis=1, keepdims=True))[:-1]


def most_telling(data: MapData, whitened: Array, fitted: Fitted) -> tuple[Located, ...]:
    """The forms that, one beside the other, carry the structure of residuals (m,), most surprising first."""
    total = max(float(whitened @ whitened) - len(whitened), 1.0)
    return tuple(_located(*each, total) for each in _standing_out(data, whitened, fitted))


def unexplained(data: MapData, before: Array, fitted: Fitted) -> tuple[Located, ...]:
    """Structure left over that is neither chance nor a slight departure of the laws from what the probe does.

    ``before (m,)``: residuals without any change, over the same scatter.
    """
    found = _standing_out(data, fitted.whitened, fitted)
    extra = sum(gain for _, gain, _ in found)
    explained = max(float(before @ before) - fitted.rss, 0.0)
    if not found or (fitted.terms and explained / (explained + extra) >= EXPLAINED):
        return ()
    return tuple(_located(*each, explained + extra) for each in found)


def _standing_out(data: MapData, whitened: Array, fitted: Fitted) -> list[tuple[Form, float, float]]:
    """Forms beside the fitted terms and each other, with gain and surprise, as long as they are no chance."""
    found: list[tuple[Form, float, float]] = []
    forms = list(forms_of(data))
    basis = orthonormal(fitted.jacobian)
    while len(found) < MOST_LOCATED:
        left = whitened - basis @ (basis.T @ whitened)
        looks = [_look(form, left, basis, fitted.sigma) for form in forms]
        best = int(np.argmin([log_p for log_p, _, _ in looks]))
        log_p, gain, columns = looks[best]
        if log_p > np.log(FALSE_ALARM / len(forms)):
            break
        found.append((forms[best], gain, log_p))
        basis = orthonormal(np.column_stack([basis, columns]))
    return found


def _located(form: Form, gain: float, log_p: float, total: float) -> Located:
    share = round(min(gain / total, 1.0), 4)
    return Located(form.covariate, "both", form.form, form.where, share, float(np.exp(log_p)))


def _look(form: Form, left: Array, basis: Array, sigma: Sequence[Array]) -> tuple[float, float, Array]:
    """Surprise, gain and whitened columns (m, d) of a form beside a basis."""
    columns = np.zeros((len(left), len(form.columns)))
    n = len(sigma[0])
    columns[form.quantity * n : (form.quantity + 1) * n] = (form.columns / sigma[form.quantity]).T
    beside = orthonormal(columns - basis @ (basis.T @ columns))
    gain = float(((beside.T @ left) ** 2).sum())
    d = beside.shape[1]
    dof = len(left) - basis.shape[1]
    if d == 0 or dof - d < 2:
        return 0.0, 0.0, columns
    variance = max((float(left @ left) - gain) / (dof - d), 1e-12)
    return log_p_value(gain / variance, d, dof, 1.0), gain, columns
