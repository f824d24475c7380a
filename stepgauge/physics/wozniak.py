"""Wozniak's compensation: one constant from an ordinary sphere qualification gives the pre-travel in every direction.

The model has the shape of the probe's mechanics and one unknown, w = A g(beta, gamma) (Eq 4). The qualification gives
A, since the true tip radius is known (Eq 9). Directions are outward surface normals in the probe's frame (z = stylus
axis, tip to body): beta is their azimuth, gamma their elevation. ``lobe_azimuth_rad`` is the azimuth in which the
probe triggers with the least pre-travel; a tripod has three such azimuths, 120 deg apart.

Numbers of equations: Adam Wozniak, Simple method of 3D error compensation of triggering probes on coordinate
measuring machine, Eqs 4-9.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array
from stepgauge.physics.directions import angles_rad
from stepgauge.physics.sphere import fit_sphere

Transducer = Literal["kinematic", "piezo"]
Slip = Literal["full", "mayer"]

LOBE_PERIOD_RAD = 2.0 * np.pi / 3.0

_MAX_STEPS = 50
_TOLERANCE_MM = 1e-10
_LEAST_UM = 1e-3
"""No reading is better than this."""
_FINE = 41


@dataclass(frozen=True)
class LobeModel:
    """The shape g of the pre-travel body: everything in Eq 4 but its constant A.

    Attributes
    ----------
    transducer : ``"kinematic"`` (contacts that open: three lobes about the axis) or ``"piezo"`` (rotationally
        symmetric)
    lobe_azimuth_rad : azimuth of least pre-travel; not used for ``"piezo"``
    slip : ``"full"`` lets the tip slide freely over the surface, as Eq 4 does; ``"mayer"`` scales the horizontal tip
        displacement by Mayer's coefficient of slip
    """

    transducer: Transducer = "kinematic"
    lobe_azimuth_rad: float = 0.0
    slip: Slip = "full"

    def shape(self, normal: ArrayLike) -> Array:
        """g = w / A, (...), for unit outward normals (..., 3) in the probe's frame; 0 at the pole (Eq 4)."""
        azimuth, elevation = angles_rad(normal)
        value = np.cos(elevation) ** 2
        if self.transducer == "kinematic":
            value = value / np.cos(fold_azimuth_rad(azimuth, self.lobe_azimuth_rad))
        if self.slip == "mayer":
            value = value * mayer_slip(np.pi / 2.0 - np.abs(elevation))
        return value

    def pretravel_um(self, normal: ArrayLike, constant_um: float) -> Array:
        """w = A g in um, (...)."""
        return constant_um * self.shape(normal)


@dataclass(frozen=True)
class Calibration:
    """Result of a sphere qualification for the model: A and its standard uncertainty (None if not known).

    ``centre_mm`` is the sphere's centre, ``residuals_um`` (n,) probed minus modelled radii.
    """

    model: LobeModel
    constant_um: float
    u_constant_um: float | None
    centre_mm: Array
    residuals_um: Array


def fold_azimuth_rad(azimuth_rad: ArrayLike, lobe_azimuth_rad: float = 0.0) -> Array:
    """Azimuth from the nearest lobe, -60..60 deg.

    Eq 4 prints beta mod 120 deg, whose cosine is zero at 90 deg: folding to both sides of a lobe is meant.
    """
    turned = np.asarray(azimuth_rad, dtype=float) - lobe_azimuth_rad
    return turned - LOBE_PERIOD_RAD * np.round(turned / LOBE_PERIOD_RAD)


def mayer_slip(polar_rad: ArrayLike) -> Array:
    """Mayer's coefficient of slip lambda = exp(-beta / 4), beta being the angle from the stylus axis in rad.

    It is 1 along the axis and 0.675 perpendicular to it.
    """
    return np.exp(-np.asarray(polar_rad, dtype=float) / 4.0)


def mayer_pretravel_um(vertical_um: ArrayLike, horizontal_um: ArrayLike, polar_rad: ArrayLike) -> Array:
    """Pre-travel along the normal from the two tip displacements, R = p cos beta + lambda h sin beta (Eq 1).

    With lambda = 1 (the limit of full slip) this is the projection on the normal, as printed in Eq 1. The paper does
    not say which term lambda scales; here it is the lateral displacement h, which slip changes (an interpretation).
    """
    polar = np.asarray(polar_rad, dtype=float)
    horizontal = mayer_slip(polar) * np.asarray(horizontal_um, dtype=float)
    return np.asarray(vertical_um, dtype=float) * np.cos(polar) + horizontal * np.sin(polar)


def constant_from_mean_um(mean_pretravel_um: float, normals: ArrayLike, model: LobeModel) -> float:
    """A from the mean pre-travel over the probed normals (n, 3) (Eqs 6 and 9, for any number of points).

    This needs the mean about the *true* centre of the sphere. About the fitted centre of the five-point pattern the
    pre-travel of the pole is lost, since the pole point alone determines the height of the centre: see
    :func:`calibrate`. Raises ``ValueError`` if all points lie on the pole, where the model is zero.
    """
    mean_shape = float(np.mean(model.shape(normals)))
    if mean_shape <= 1e-6:
        raise ValueError("all points lie on the pole; the constant needs points away from it")
    return mean_pretravel_um / mean_shape


def calibrate(
    points_mm: ArrayLike,
    sphere_radius_mm: float,
    tip_radius_mm: float,
    model: LobeModel,
    to_probe_frame: ArrayLike | None = None,
    u_radii_um: float = 0.0,
    noise_um: float | None = None,
) -> Calibration:
    """A and the sphere's centre together from recorded tip centres on a reference sphere.

    Solves |p_i - c| = R + r - A g(n_i) in the least-squares sense, which is Eq 9 without a known centre. n_i are
    the directions from the present estimate of the centre.

    Parameters
    ----------
    points_mm : (n, 3) recorded tip centres in machine axes, n >= 4, not all on one circle of latitude
    sphere_radius_mm, tip_radius_mm : certified radii of the reference sphere and of the tip
    to_probe_frame : (3, 3) rows x', y', z' of the probe's frame, default the machine's axes
    u_radii_um : standard uncertainty of the sum of the two radii; all of it is in A
    noise_um : standard deviation of one probing; default, that of the residuals

    Raises
    ------
    ValueError : fewer than four points, or a pattern that cannot separate A from a shift of the centre.
    """
    points = np.asarray(points_mm, dtype=float)
    frame = np.eye(3) if to_probe_frame is None else np.asarray(to_probe_frame, dtype=float)
    reach_mm = sphere_radius_mm + tip_radius_mm
    centre, constant_mm = _centre_and_constant_mm(points, reach_mm, model, frame)
    design, excess_mm = _linearise(points, centre, reach_mm, model, frame)
    residuals_um = 1e3 * (excess_mm + constant_mm * design[:, 3])
    u = _constant_uncertainty_um(design, residuals_um, u_radii_um, noise_um)
    return Calibration(model, 1e3 * constant_mm, u, centre, residuals_um)


def compensated_mm(
    points_mm: ArrayLike, approach: ArrayLike, constant_um: float, model: LobeModel, to_probe_frame: ArrayLike | None
) -> Array:
    """Tip centres at first contact: the recorded ones minus the pre-travel along the approach, (n, 3).

    Parameters
    ----------
    points_mm : (n, 3) recorded tip centres, before any radius compensation
    approach : (n, 3) unit vectors of travel towards the surface, in machine axes
    """
    travel = np.asarray(approach, dtype=float)
    frame = np.eye(3) if to_probe_frame is None else np.asarray(to_probe_frame, dtype=float)
    pretravel_mm = 1e-3 * model.pretravel_um(-travel @ frame.T, constant_um)
    return np.asarray(points_mm, dtype=float) - pretravel_mm[..., None] * travel


@dataclass(frozen=True)
class LobeAzimuth:
    """The lobe azimuth (0..120 deg) with its standard uncertainty, and the ``odds`` that the probe has lobes at all."""

    azimuth_rad: float
    u_rad: float
    odds: float


def find_lobe_azimuth(
    points_mm: ArrayLike,
    sphere_radius_mm: float,
    tip_radius_mm: float,
    model: LobeModel,
    to_probe_frame: ArrayLike | None = None,
    noise_um: float | None = None,
) -> LobeAzimuth:
    """The lobe azimuth from a qualification: mean and standard deviation of its posterior, uniform over 120 deg.

    The odds are those of lobes at some azimuth against what has as many other parameters and none: a sphere of free
    radius, and pre-travel that is round about the stylus. ``noise_um`` None: unknown (Jeffreys' prior), so that the
    likelihood is a power of the sum of squares. Parameters as of :func:`calibrate`.
    """
    points = np.asarray(points_mm, dtype=float)

    def log_likelihood(residuals_um: Array) -> float:
        """Of a model with four parameters, by what it leaves."""
        squares = float(np.sum(residuals_um**2)) + len(points) * _LEAST_UM**2
        return -squares / (2.0 * noise_um**2) if noise_um else -(len(points) - 4) / 2.0 * float(np.log(squares))

    def under(transducer: Transducer, azimuth_rad: float) -> float:
        """Of lobes at an azimuth, or of none."""
        shape = LobeModel(transducer, azimuth_rad, model.slip)
        found = calibrate(points, sphere_radius_mm, tip_radius_mm, shape, to_probe_frame)
        return log_likelihood(found.residuals_um)

    without = np.array([log_likelihood(fit_sphere(points).residuals_um), under("piezo", 0.0)])
    grid = np.radians(np.arange(0.0, 120.0, 2.0))
    coarse = np.array([under(model.transducer, float(one)) for one in grid])
    top = max(coarse.max(), without.max())
    odds = float(np.exp(coarse - top).mean() / max(np.exp(without - top).sum(), 1e-300))
    best = float(grid[coarse.argmax()])
    _, u = _posterior(best, fold_azimuth_rad(grid, best), coarse)
    near = np.linspace(-1.0, 1.0, _FINE) * min(4.0 * u + np.radians(2.0), LOBE_PERIOD_RAD / 2.0)
    azimuth, u = _posterior(best, near, np.array([under(model.transducer, best + float(one)) for one in near]))
    return LobeAzimuth(azimuth % LOBE_PERIOD_RAD, u, odds)


def _posterior(middle_rad: float, off_rad: Array, log_likelihood: Array) -> tuple[float, float]:
    """Mean and standard deviation of an azimuth over a grid of distances from the middle."""
    weight = np.exp(log_likelihood - log_likelihood.max())
    mean = float(np.average(off_rad, weights=weight))
    return middle_rad + mean, float(np.sqrt(np.average((off_rad - mean) ** 2, weights=weight)))


def _centre_and_constant_mm(points: Array, reach_mm: float, model: LobeModel, frame: Array) -> tuple[Array, float]:
    """Gauss-Newton from the least-squares sphere; A is linear, and the directions hardly change with the centre."""
    centre = fit_sphere(points).centre_mm
    for _ in range(_MAX_STEPS):
        design, excess_mm = _linearise(points, centre, reach_mm, model, frame)
        step, _, rank, _ = np.linalg.lstsq(design, excess_mm, rcond=1e-9)
        if rank < 4:
            raise ValueError("the pattern cannot tell the constant from a shift of the centre; spread the points more")
        centre = centre + step[:3]
        if np.linalg.norm(step[:3]) <= _TOLERANCE_MM:
            break
    return centre, -float(step[3])


def _linearise(points: Array, centre: Array, reach_mm: float, model: LobeModel, frame: Array) -> tuple[Array, Array]:
    """Design for (centre step, -A), whose last column is the shape g, and the radial excess over the reach in mm."""
    radial = points - centre
    distance = np.linalg.norm(radial, axis=1)
    normals = radial / distance[:, None]
    return np.column_stack([normals, model.shape(normals @ frame.T)]), distance - reach_mm


def _constant_uncertainty_um(
    design: Array, residuals_um: Array, u_radii_um: float, noise_um: float | None
) -> float | None:
    """From the noise of the points by the fit, and from the uncertainty of the radii, which is common to all points."""
    freedom = len(residuals_um) - 4
    if noise_um is None:
        if freedom == 0:
            return None
        noise_um = float(np.sqrt(np.sum(residuals_um**2) / freedom))
    inverse = np.linalg.pinv(design)
    random = noise_um * np.linalg.norm(inverse[3])
    common = u_radii_um * abs(float(inverse[3].sum()))
    return float(np.hypot(random, common))
