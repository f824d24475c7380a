"""The sphere fitted to probed points, and the effective tip radius from a qualification.

A recorded tip centre lies ``sphere radius + tip radius - pre-travel`` from the centre of the reference sphere, so the
fitted radius minus that of the reference sphere is R_eff = r - w, which includes the mean pre-travel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array

_MAX_STEPS = 50
_TOLERANCE = 1e-12


@dataclass(frozen=True)
class SphereFit:
    """A least-squares sphere.

    Attributes
    ----------
    centre_mm : (3,)
    radius_mm : fitted radius
    covariance_mm2 : (4, 4) of centre and radius; None with four points and no stated noise (no degree of freedom is
        left)
    residuals_um : (n,) distance of each point outside the sphere
    noise_um : standard deviation of one point: the stated one, or the one of the residuals
    degrees_of_freedom : n - 4
    """

    centre_mm: Array
    radius_mm: float
    covariance_mm2: Array | None
    residuals_um: Array
    noise_um: float | None
    degrees_of_freedom: int

    @property
    def form_error_um(self) -> float:
        """Largest minus smallest residual, the range of radial distances about the least-squares centre."""
        return float(np.ptp(self.residuals_um))

    @property
    def u_radius_um(self) -> float | None:
        """Standard uncertainty of the radius; None if the noise is not known."""
        return None if self.covariance_mm2 is None else float(1e3 * np.sqrt(self.covariance_mm2[3, 3]))

    @property
    def u_centre_um(self) -> Array | None:
        """Standard uncertainties of the centre, (3,); None if the noise is not known."""
        return None if self.covariance_mm2 is None else 1e3 * np.sqrt(np.diag(self.covariance_mm2)[:3])


@dataclass(frozen=True)
class QualifiedRadius:
    """R_eff of a qualified tip, in mm, its standard uncertainty in um (None where unknown) and the fit behind it."""

    r_eff_mm: float
    u_r_eff_um: float | None
    fit: SphereFit


def fit_sphere(points_mm: ArrayLike, noise_um: float | None = None) -> SphereFit:
    """Sphere of least sum of squared radial distances through n >= 4 points, (n, 3) in mm, in any pattern.

    The linear fit of x^2 + y^2 + z^2 starts Gauss-Newton on the true radial distances. With ``noise_um`` (standard
    deviation of one probing) the uncertainty follows from it; without, from the residuals, which then also contain
    the lobing of the probe and the form error of the sphere: with few degrees of freedom this is a rough estimate.

    Raises ``ValueError`` for fewer than four points, or points in one plane, which do not define one sphere.
    """
    points = np.asarray(points_mm, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
        raise ValueError(f"a sphere needs at least 4 points of three coordinates, not an array of shape {points.shape}")
    shift = points.mean(axis=0)
    size = float(np.linalg.norm(points - shift, axis=1).max())
    if size == 0.0:
        raise ValueError("the points lie in one plane (or coincide); a sphere needs points around it")
    solution = _refine((points - shift) / size, _linear_sphere((points - shift) / size)) * size
    solution[:3] += shift
    radial = points - solution[:3]
    distance = np.linalg.norm(radial, axis=1)
    residuals_um = 1e3 * (distance - solution[3])
    design = np.column_stack([-radial / distance[:, None], -np.ones(len(points))])
    freedom = len(points) - 4
    noise = noise_um if noise_um is not None else _noise_um(residuals_um, freedom)
    covariance = None if noise is None else (noise * 1e-3) ** 2 * np.linalg.inv(design.T @ design)
    return SphereFit(solution[:3], float(solution[3]), covariance, residuals_um, noise, freedom)


def effective_radius(
    points_mm: ArrayLike,
    sphere_radius_mm: float,
    u_sphere_radius_um: float = 0.0,
    noise_um: float | None = None,
) -> QualifiedRadius:
    """R_eff = r - w of a tip from recorded tip centres on a reference sphere.

    Parameters
    ----------
    points_mm : (n, 3) recorded tip centres, n >= 4
    sphere_radius_mm, u_sphere_radius_um : certified radius of the reference sphere and its standard uncertainty
    noise_um : standard deviation of one probing, if known; else it is taken from the residuals
    """
    fit = fit_sphere(points_mm, noise_um)
    u_fit = fit.u_radius_um
    u = None if u_fit is None else float(np.hypot(u_fit, u_sphere_radius_um))
    return QualifiedRadius(fit.radius_mm - sphere_radius_mm, u, fit)


def _linear_sphere(points: Array) -> Array:
    """Centre and radius of the algebraic fit: |p|^2 = 2 c.p + (R^2 - |c|^2) is linear in c and the bracket."""
    design = np.column_stack([2.0 * points, np.ones(len(points))])
    (*centre, rest), _, rank, _ = np.linalg.lstsq(design, np.sum(points**2, axis=1), rcond=1e-9)
    if rank < 4:
        raise ValueError("the points lie in one plane (or coincide); a sphere needs points around it")
    c = np.array(centre)
    return np.append(c, np.sqrt(max(rest + c @ c, 0.0)))


def _refine(points: Array, solution: Array) -> Array:
    for _ in range(_MAX_STEPS):
        radial = points - solution[:3]
        distance = np.linalg.norm(radial, axis=1)
        design = np.column_stack([radial / distance[:, None], np.ones(len(points))])
        step = np.linalg.lstsq(design, distance - solution[3], rcond=None)[0]
        solution = solution + step
        if np.linalg.norm(step) <= _TOLERANCE:
            break
    return solution


def _noise_um(residuals_um: Array, degrees_of_freedom: int) -> float | None:
    if degrees_of_freedom == 0:
        return None
    return float(np.sqrt(np.sum(residuals_um**2) / degrees_of_freedom))
