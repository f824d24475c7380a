"""ISO 10360-5:2020: probing performance from 25 points on a test sphere, with one stylus or with five.

P_Form is the range of the radial distances from the centre of the least-squares sphere, P_Size the diameter of that
sphere minus the calibrated one. With five styli (or five ways of one stylus) the same is said of the 125 points
together, and L_Dia is the diameter of the smallest sphere around the five centres. The symbols in full are
P_Form.Sph.1x25:SS:Tact and P_Form.Sph.5x25:MS:Tact, and so on. The text of the standard was not at hand: what is
taken from secondary sources is marked as unconfirmed (:data:`UNCONFIRMED`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.conditions import NOTHING, Conditions, gate
from stepgauge.conditions.decision import Outcome, decide, together
from stepgauge.conditions.sphere import sphere_conditions
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.physics.directions import evenly_spread_points, probe_frame
from stepgauge.physics.sphere import SphereFit, fit_sphere
from stepgauge.probes.files import ProbedPoints
from stepgauge.recording.lines import table_comments
from stepgauge.standards.rules import Rule

STANDARD = "ISO 10360-5:2020"
POINTS, STYLI = 25, 5
NAMES = ("P_Form", "P_Size", "L_Dia")
UNCONFIRMED = (
    "P_Form.Sph.5x25:MS:Tact and P_Size.Sph.5x25:MS:Tact from one sphere through all 125 surface points: unconfirmed",
    "L_Dia.5x25:MS:Tact as the diameter of the smallest sphere around the five centres: unconfirmed (the edition"
    " of 2010"
    " has the largest range of a coordinate, which is given beside it)",
    "diameter of the test sphere 10 mm to 51 mm: unconfirmed",
)
FAR_OFF_MM = 0.1
"""A sphere this far from the stated diameters is another sphere, or another tip."""


@dataclass(frozen=True)
class TestSphere:
    """The calibrated sphere: diameter in mm; form error and standard uncertainties in um, None where not stated.

    ``another``: whether the probe was qualified on another sphere; None where nobody says so.
    """

    __test__ = False

    diameter_mm: float
    u_diameter_um: float | None = None
    form_um: float | None = None
    u_form_um: float | None = None
    another: bool | None = None


@dataclass(frozen=True)
class ProbingLimits:
    """Maximum permissible errors of :data:`NAMES` in um (None: not stated), and the coverage factor of the decision."""

    limit_um: dict[str, float | None] = field(default_factory=dict)
    coverage_factor: float = 2.0


@dataclass(frozen=True)
class StylusPoints:
    """The points of one stylus: surface points (n, 3) in mm, the fit through its tip centres, its qualified tip."""

    path: str
    surface_mm: Array
    fit: SphereFit
    tip_diameter_mm: float
    from_sphere: Array
    """Unit vector from the sphere towards the stylus: the mean outward normal of the points."""


@dataclass(frozen=True)
class Value:
    """A test value in um with its limit, expanded uncertainty and decision; None where nothing was stated."""

    name: str
    symbol: str
    value_um: float
    limit_um: float | None
    expanded_um: float | None
    conditions: Conditions = NOTHING

    @property
    def outcome(self) -> Outcome | None:
        """The decision by ISO 14253-1; None without limit or uncertainty."""
        if self.limit_um is None or self.expanded_um is None:
            return None
        return gate(self.conditions, decide(self.value_um, self.limit_um, self.expanded_um))


@dataclass(frozen=True)
class ProbingTest:
    """The whole test; ``fit`` is the sphere through the surface points of all styli."""

    sphere: TestSphere
    limits: ProbingLimits
    styli: tuple[StylusPoints, ...]
    fit: SphereFit
    comments: dict[str, str] = field(default_factory=dict)
    conditions: Conditions = NOTHING

    @property
    def multiple(self) -> bool:
        """Whether this is the test of several styli."""
        return len(self.styli) > 1

    @property
    def values(self) -> tuple[Value, ...]:
        """P_Form and P_Size, and with several styli L_Dia."""
        size_um = 1e3 * (2.0 * self.fit.radius_mm - self.sphere.diameter_mm)
        found = [("P_Form", self.fit.form_error_um, self._u_form()), ("P_Size", size_um, self._u_size())]
        if self.multiple:
            found.append(("L_Dia", 2e3 * enclosing_radius(self.centres_mm()), 0.0))
        return tuple(self._value(*one) for one in found)

    def _value(self, name: str, value_um: float, u_um: float | None) -> Value:
        tail = "5x25:MS:Tact" if self.multiple else "1x25:SS:Tact"
        symbol = f"{name}.{'' if name == 'L_Dia' else 'Sph.'}{tail}"
        expanded = None if u_um is None else self.limits.coverage_factor * u_um
        return Value(name, symbol, value_um, self.limits.limit_um.get(name), expanded, self.conditions)

    def _u_form(self) -> float | None:
        """sqrt((F / 2)^2 + u(F)^2) of the sphere's form error F (ISO/TS 23165)."""
        sphere = self.sphere
        if sphere.form_um is None or sphere.u_form_um is None:
            return None
        return float(np.hypot(sphere.form_um / 2.0, sphere.u_form_um))

    def _u_size(self) -> float | None:
        """The certificate's: the machine and its qualification are what is tested."""
        return self.sphere.u_diameter_um

    def centres_mm(self) -> Array:
        """Centre found by every stylus, (styli, 3)."""
        return np.array([one.fit.centre_mm for one in self.styli])

    def ranges_um(self) -> Array:
        """Ranges of the centres in x, y and z, (3,)."""
        return np.asarray(1e3 * np.ptp(self.centres_mm(), axis=0))

    @property
    def outcome(self) -> Outcome | None:
        """Of all values that have a limit; None where one of them cannot be decided for want of an uncertainty."""
        decided = [one.outcome for one in self.values if one.limit_um is not None]
        known = [outcome for outcome in decided if outcome is not None]
        return together(known) if known and len(known) == len(decided) else None

    @property
    def missing(self) -> list[str]:
        """Contributions to the uncertainty of the test that were not stated."""
        asked = (
            ("form error of the test sphere and its uncertainty", self._u_form()),
            ("uncertainty of the diameter of the test sphere", self._u_size()),
        )
        return [what for what, u in asked if u is None]


def probing_test(
    points: Sequence[ProbedPoints],
    sphere: TestSphere,
    tip_diameter_mm: Sequence[float],
    limits: ProbingLimits | None = None,
) -> ProbingTest:
    """The test from recorded tip centres.

    Parameters
    ----------
    points : of one stylus, or of each of several
    sphere : the calibrated test sphere
    tip_diameter_mm : effective diameters as qualified, one for all styli or one for each
    limits : maximum permissible errors

    Raises
    ------
    InputError
        another count of diameters than of styli, points that fit no sphere or one of another size, points given twice
    """
    diameters = list(tip_diameter_mm) * (len(points) if len(tip_diameter_mm) == 1 else 1)
    if len(diameters) != len(points):
        raise InputError(
            naming("tip_diameter_mm"),
            "one for all styli or one for each",
            found=len(diameters),
            expected=f"1 or {len(points)}",
        )
    _check_different(points)
    styli = tuple(_stylus(one, sphere, tip) for one, tip in zip(points, diameters, strict=True))
    together_mm = np.vstack([one.surface_mm for one in styli])
    comments = {key: value for one in points for key, value in table_comments(one.rows.path).items()}
    found = [sphere_conditions(one.position_mm, one.rows.path) for one in points]
    conditions = sum(found, Conditions())
    return ProbingTest(sphere, limits or ProbingLimits(), styli, fit_sphere(together_mm), comments, conditions)


def _check_different(points: Sequence[ProbedPoints]) -> None:
    for one, other in combinations(points, 2):
        if np.array_equal(one.position_mm, other.position_mm):
            raise InputError(other.rows.path, f"the same points as {one.rows.path}", expected="those of another stylus")


def _stylus(points: ProbedPoints, sphere: TestSphere, tip_mm: float) -> StylusPoints:
    path = points.rows.path
    try:
        fit = fit_sphere(points.position_mm)
    except ValueError as error:
        raise InputError(path, str(error)) from None
    expected = (sphere.diameter_mm + tip_mm) / 2.0
    if abs(fit.radius_mm - expected) > FAR_OFF_MM:
        raise InputError(
            path,
            naming("sphere_diameter_mm", "tip_diameters_mm", words="the points contradict {} or {}"),
            found=f"tip centres on a sphere of radius {fit.radius_mm:.4f} mm",
            expected=f"about {expected:.4f} mm",
        )
    normal = points.position_mm - fit.centre_mm
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    if (np.einsum("ij,ij->i", normal, points.approach) > 0.0).any():
        towards = "approaches towards the sphere"
        raise InputError(path, "points were approached from within the sphere", expected=towards)
    mean = normal.mean(axis=0)
    return StylusPoints(path, points.position_mm - normal * tip_mm / 2.0, fit, tip_mm, mean / np.linalg.norm(mean))


def enclosing_radius(points: ArrayLike) -> float:
    """Radius of the smallest sphere around a few points (n, 3): that of two, three or four of them which holds all."""
    every = np.asarray(points, float)
    tolerance = 1e-9 * (1.0 + float(np.abs(every).max()))
    best = np.inf
    for count in range(2, min(len(every), 4) + 1):
        for some in combinations(every, count):
            centre = _circumcentre(np.array(some))
            radius = float(np.linalg.norm(every - centre, axis=1).max())
            reach = float(np.linalg.norm(some[0] - centre))
            if radius <= reach + tolerance:
                best = min(best, radius)
    return float(best) if np.isfinite(best) else 0.0


def _circumcentre(points: Array) -> Array:
    """The point of their own line, plane or space that is as far from each of two to four points."""
    base = points[1:] - points[0]
    shares = np.linalg.lstsq(2.0 * base @ base.T, (base**2).sum(axis=1), rcond=None)[0]
    return np.asarray(points[0] + shares @ base)


SPHERE_MM = (10.0, 51.0)
LARGEST_GAP_DEG = 35.0
"""No place of the hemisphere may be farther than this from the nearest point. The standard asks for points
approximately evenly distributed over at least a hemisphere; this limit is ours. Its recommended pattern leaves 23
deg."""
APART_DEG = 60.0
"""Styli nearer to each other than this are one way of probing."""


def rules_of(test: ProbingTest) -> tuple[Rule, ...]:
    """Every rule, in the order in which a tester goes through them."""
    low, high = SPHERE_MM
    size = test.sphere.diameter_mm
    return (
        *((_styli(test),) if test.multiple else ()),
        _points(test),
        _spread(test),
        Rule(
            f"{STANDARD}, measuring equipment (unconfirmed)",
            f"a test sphere of {low:g} mm to {high:g} mm",
            f"{size:g} mm",
            low <= size <= high,
        ),
        Rule(
            f"{STANDARD}, measuring equipment",
            "a test sphere that the probe was not qualified on",
            "not recorded" if test.sphere.another is None else "stated",
            test.sphere.another,
        ),
    )


def _styli(test: ProbingTest) -> Rule:
    ways = np.array([one.from_sphere for one in test.styli])
    angles = np.degrees(np.arccos(np.clip(ways @ ways.T, -1.0, 1.0)))[np.triu_indices(len(ways), 1)]
    found = f"{len(ways)}, at least {angles.min():.0f}° apart"
    met = len(ways) == STYLI and bool(angles.min() >= APART_DEG)
    return Rule(
        f"{STANDARD}, multi-stylus test", f"{STYLI} styli or ways of one stylus, square to each other", found, met
    )


def _points(test: ProbingTest) -> Rule:
    counts = [len(one.surface_mm) for one in test.styli]
    found = ", ".join(str(count) for count in counts)
    return Rule(f"{STANDARD}, measuring procedure", f"{POINTS} points", found, all(count == POINTS for count in counts))


def _spread(test: ProbingTest) -> Rule:
    gaps = [largest_gap_deg(one) for one in test.styli]
    asks = f"points spread over at least a hemisphere (here: no place farther than {LARGEST_GAP_DEG:g}° from a point)"
    found = f"farthest place {max(gaps):.0f}°"
    return Rule(f"{STANDARD}, measuring procedure", asks, found, max(gaps) <= LARGEST_GAP_DEG)


def largest_gap_deg(stylus: StylusPoints) -> float:
    """Largest angle from a place of the hemisphere about the stylus to the nearest point."""
    places = evenly_spread_points(400) @ probe_frame(tuple(stylus.from_sphere))
    normals = stylus.surface_mm - stylus.fit.centre_mm
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    nearest = (places @ normals.T).max(axis=1)
    return float(np.degrees(np.arccos(np.clip(nearest.min(), -1.0, 1.0))))
