"""How many looks a family amounts to: lengths and areas of known curves and surfaces, and chances that are kept."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats
from stepgauge.diagnose.extent import Extent, along_curve, over_surface
from stepgauge.diagnose.search import log_p_value
from stepgauge.diagnose.whitening import Whitening

from stepgauge.diagnose.library import Family

Array = NDArray[np.float64]
ROWS = 12


class Nothing(Whitening):
    """A whitening that leaves all as it is."""

    def __call__(self, columns: Array) -> Array:
        return columns


def as_it_is() -> Nothing:
    empty, none = np.zeros(ROWS), np.zeros((ROWS, 0))
    return Nothing(np.ones(ROWS), empty, empty.astype(np.int64), empty[:1], empty[:1], none)


def patch(polar: Array, azimuth: Array, axes: Array) -> tuple[list[dict[str, float]], Array]:
    """Points of a unit sphere in the space of three of many rows, and their two angles."""
    angles = [(float(p), float(a)) for p in polar for a in azimuth]
    points = np.array([[np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)] for p, a in angles])
    return [{"polar": p, "azimuth": a} for p, a in angles], points @ axes


def three_axes() -> Array:
    return np.linalg.qr(np.random.default_rng(1).normal(size=(ROWS, 3)))[0].T


def family(atoms: list[dict[str, float]], signatures: Array) -> Family:
    return Family("form:patch", "patch", {}, atoms, signatures[:, None])


def test_a_patch_of_a_sphere_has_its_area_and_half_its_rim() -> None:
    polar, azimuth = np.linspace(0.7, 1.3, 41), np.linspace(0.2, 0.9, 41)
    atoms, points = patch(polar, azimuth, three_axes())
    found = over_surface(family(atoms, points), np.ones(len(points)), as_it_is())
    assert found is not None
    rim = 2.0 * 0.6 + 0.7 * (np.sin(0.7) + np.sin(1.3))
    assert found[0] == pytest.approx(rim / 2.0, rel=1e-3)
    assert found[1] == pytest.approx(0.7 * (np.cos(0.7) - np.cos(1.3)), rel=1e-3)


def test_neither_the_size_nor_the_sign_nor_the_order_of_signatures_matters() -> None:
    random = np.random.default_rng(2)
    atoms, points = patch(np.linspace(0.7, 1.3, 9), np.linspace(0.2, 0.9, 8), three_axes())
    wanted = over_surface(family(atoms, points), np.ones(len(points)), as_it_is())
    size = random.choice([-1.0, 1.0], len(points)) * random.uniform(0.1, 10.0, len(points))
    mixed = random.permutation(len(points))
    shuffled = family([atoms[i] for i in mixed], (points * size[:, None])[mixed])
    found = over_surface(shuffled, np.abs(size)[mixed], as_it_is())
    assert wanted is not None
    assert found == pytest.approx(wanted, rel=1e-9)


def test_a_corner_that_is_missing_takes_its_triangles_along() -> None:
    atoms, points = patch(np.linspace(0.9, 1.1, 5), np.linspace(0.2, 0.4, 5), three_axes())
    whole = over_surface(family(atoms, points), np.ones(25), as_it_is())
    left = over_surface(family(atoms[1:], points[1:]), np.ones(24), as_it_is())
    hidden = over_surface(family(atoms, points), np.where(np.arange(25) == 0, 1e6, 1.0), as_it_is())
    assert whole is not None
    assert left is not None
    # the two triangles of a cell stand on the diagonal between its other corners, or one on either side of the corner
    assert 0.0 < whole[1] - left[1] < whole[1] / 15.0
    assert hidden == pytest.approx(left, rel=1e-9)


@pytest.mark.parametrize("atoms", [[{"a": 1.0}, {"a": 2.0}], [{"a": 1.0, "b": 0.0}, {"a": 2.0, "b": 0.0}], [{}]])
def test_what_has_no_two_parameters_draws_no_surface(atoms: list[dict[str, float]]) -> None:
    signatures = np.eye(ROWS)[: len(atoms)]
    assert over_surface(family(atoms, signatures), np.ones(len(atoms)), as_it_is()) is None


def test_an_arc_is_as_long_as_its_angle() -> None:
    angle = np.linspace(0.0, 1.2, 25)
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    gram = np.ones((25, 1, 1))
    cross = (points * np.roll(points, -1, axis=0)).sum(axis=1)[:, None, None]
    assert along_curve(gram, cross) == pytest.approx(1.2, rel=1e-6)


def test_there_are_never_more_looks_than_signatures() -> None:
    assert Extent(7, 100.0, 100.0).looks(50.0) == 7.0
    assert Extent(1, 0.0).looks(50.0) == 1.0


@pytest.mark.parametrize("threshold", [9.0, 13.0])
def test_scatter_comes_as_near_to_a_surface_as_its_area_says(threshold: float) -> None:
    """100 000 draws of scatter in the three dimensions that see the patch: the formula is kept to a tenth."""
    atoms, points = patch(np.linspace(0.6, 1.4, 33), np.linspace(0.0, 0.9, 33), three_axes())
    surface = over_surface(family(atoms, points), np.ones(len(points)), as_it_is())
    assert surface is not None
    scatter = np.random.default_rng(3).normal(size=(100_000, 3))
    directions = points @ three_axes().T
    best = np.concatenate([((part @ directions.T) ** 2).max(axis=1) for part in np.split(scatter, 100)])
    chance = np.exp(log_p_value(threshold, 1, 10**9, Extent(len(points), *surface).looks(threshold)))
    seen = float((best > threshold).mean())
    assert seen == pytest.approx(chance, rel=0.1, abs=3.0 * np.sqrt(chance / 100_000))
    assert stats.chi2.sf(threshold, 1) < seen  # one look would be far too few
