"""Qualification of a tip on a reference sphere, kept as a JSON file, and the compensation of points with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from stepgauge import __version__
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.config import TomlTable, Vector3, check_table
from stepgauge.files.text import read_result, write_json
from stepgauge.physics import lobing, wozniak
from stepgauge.physics.directions import probe_frame
from stepgauge.physics.sphere import QualifiedRadius, effective_radius
from stepgauge.physics.wozniak import LobeModel, Slip, Transducer
from stepgauge.probes.files import ProbedPoints

WITH_TIP = naming("tip_diameter_mm", words="a qualification made with {}")
LARGEST_PRETRAVEL_SHARE = 0.1
"""Pre-travel over tip radius above which a stated diameter must be wrong."""
KIND = "qualification"
_ABOUT = ("format", "stepgauge", "inputs", "result", "checksum")
Method = Literal["lobed", "mean"]
Positive = Annotated[float, Field(gt=0.0)]

# On a sphere the approach and the normal found agree within the aim of the operator; beyond this they are not a pair.
_AIM_RAD = np.radians(30.0)
FEWEST_FOR_SPHERE = 4
_FEWEST_FOR_LOBES = 12
LEAST_ODDS = 20.0
"""Below these that the probe has lobes, none are claimed."""


@dataclass(frozen=True)
class Reference:
    """The reference sphere and the tip.

    ``tip_diameter_mm`` None leaves the lobes out. ``u_sphere_um`` and ``u_tip_um`` are the standard uncertainties of
    the diameters, ``noise_um`` that of one probing (None: from the residuals); ``stylus_axis`` is from tip to body.
    """

    sphere_diameter_mm: float
    tip_diameter_mm: float | None = None
    u_sphere_um: float = 0.0
    u_tip_um: float = 0.0
    noise_um: float | None = None
    stylus_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)


class LobeTable(TomlTable):
    """The lobed pre-travel model of a qualified tip."""

    transducer: Transducer
    slip: Slip
    lobe_azimuth_deg: float = Field(description="azimuth of least pre-travel about the stylus axis, from machine x")
    lobe_azimuth_fitted: bool
    u_lobe_azimuth_deg: float | None = Field(None, description="standard uncertainty; of a stated azimuth none")
    constant_um: float = Field(description="A of Wozniak's Eq 4")
    u_constant_um: float | None
    mean_pretravel_um: float = Field(description="over the probed points, by the model")

    @property
    def model(self) -> LobeModel:
        """The model these numbers belong to."""
        return LobeModel(self.transducer, float(np.radians(self.lobe_azimuth_deg)), self.slip)


class MisfitTable(TomlTable):
    """What the model of the lobes leaves in the residuals, as :class:`stepgauge.physics.lobing.Misfit`."""

    waves: int = Field(description="waves in a turn about the stylus; 0: by the angle to the stylus")
    range_um: float
    chance: float = Field(description="of as much in scatter alone")


class Qualification(TomlTable):
    """Result of a qualification; the JSON file has the same keys."""

    points: int
    sphere_diameter_mm: Positive
    tip_diameter_mm: Positive | None
    stylus_axis: Vector3
    r_eff_mm: float
    u_r_eff_mm: float | None
    centre_mm: Vector3
    noise_um: float | None
    form_error_um: float = Field(description="range of radial residuals about the least-squares sphere")
    form_error_compensated_um: float | None = Field(description="the same after compensation of the lobes")
    residuals_um: list[float]
    residuals_compensated_um: list[float] | None
    lobes: LobeTable | None
    undetermined: str = Field("", description="why the readings do not tell the lobes")
    misfit: MisfitTable | None = Field(None, description="lobing of another shape than the model, where it shows")
    simulated: bool = Field(False, description="no machine was measured")

    @property
    def worse_by_um(self) -> float:
        """By how much the compensation of the lobes increases the form error; 0 where it does not."""
        compensated = self.form_error_compensated_um
        return 0.0 if compensated is None else max(compensated - self.form_error_um, 0.0)

    def worse_words(self) -> str:
        """That the model of the lobes does not fit this probe, in words."""
        return (
            f"compensation of the lobes increases the form error from {self.form_error_um:.2f} to"
            f" {self.form_error_compensated_um:.2f} um: the model of the lobes does not fit this probe"
        )

    def misfit_words(self) -> str:
        """What the model leaves, in words; empty where that is like scatter."""
        left = self.misfit
        if left is None:
            return ""
        follow = f"{left.waves} waves a turn about the stylus" if left.waves else "the angle to the stylus"
        once = float(f"{1.0 / max(left.chance, 1e-6):.1g}")
        return (
            f"the residuals follow {follow}, by {left.range_um:.2f} um: scatter alone leaves as much at most once in"
            f" {once:.0f} qualifications; the lobing has another shape than the model"
        )


def qualify(points: ProbedPoints, reference: Reference, model: LobeModel, find_azimuth: bool = False) -> Qualification:
    """Effective radius of a tip and, where its diameter is known, the constant of its lobes.

    ``find_azimuth``: their azimuth is that of the readings, and there are none where these do not tell it.

    Raises :class:`InputError` where the points are too few, lie in a plane, or were approached from within the sphere.
    """
    if len(points.position_mm) < FEWEST_FOR_SPHERE:
        expected = "at least 4 points; 5 to qualify a tip, or the 25 of ISO 10360-5"
        found = len(points.position_mm)
        raise InputError(points.rows.path, "too few points for a sphere", found=found, expected=expected)
    try:
        radius = effective_radius(
            points.position_mm, reference.sphere_diameter_mm / 2.0, reference.u_sphere_um / 2.0, reference.noise_um
        )
        _check_radius(points, reference, radius.r_eff_mm)
        _check_approaches(points, radius.fit.centre_mm)
        lobes = _lobes(points, reference, model, find_azimuth, radius.fit.form_error_um)
    except ValueError as error:
        raise InputError(points.rows.path, str(error)) from None
    result = _make_qualification(reference, radius, lobes)
    left = _misfit(points, reference, radius, lobes)
    return result.model_copy(update={"simulated": points.simulated, "misfit": left})


def _misfit(points: ProbedPoints, reference: Reference, radius: QualifiedRadius, lobes: _Lobes) -> MisfitTable | None:
    """Structure beside the model; of a tip whose diameter is not known there is no model, and lobes are no wonder."""
    if reference.tip_diameter_mm is None:
        return None
    found = lobes.calibration
    normals = points.position_mm - (radius.fit.centre_mm if found is None else found.centre_mm)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    of_probe = normals @ probe_frame(reference.stylus_axis).T
    shapes = [np.ones(len(normals))] if found is None else [found.model.shape(of_probe)]
    if found is not None and lobes.azimuth is not None:
        turned = replace(found.model, lobe_azimuth_rad=found.model.lobe_azimuth_rad + 1e-3)
        shapes.append(turned.shape(of_probe) - shapes[0])
    residuals_um = radius.fit.residuals_um if found is None else found.residuals_um
    left = lobing.misfit(residuals_um, of_probe, np.column_stack([normals, *shapes]), reference.noise_um)
    return None if left is None else MisfitTable(waves=left.waves, range_um=left.range_um, chance=left.chance)


def _check_radius(points: ProbedPoints, reference: Reference, r_eff_mm: float) -> None:
    """A tip radius is positive, and no pre-travel is a tenth of it."""
    if r_eff_mm <= 0.0:
        raise InputError(
            points.rows.path,
            naming("sphere_diameter_mm", words="the points lie on a smaller sphere than {} says"),
            found=f"a radius of {reference.sphere_diameter_mm / 2.0 + r_eff_mm:.4f} mm with the tip",
            expected=f"more than {reference.sphere_diameter_mm / 2.0:g} mm",
        )
    known = reference.tip_diameter_mm
    if known is not None and abs(known / 2.0 - r_eff_mm) > LARGEST_PRETRAVEL_SHARE * known / 2.0:
        raise InputError(
            points.rows.path,
            naming("tip_diameter_mm", "sphere_diameter_mm", words="the points contradict {} or {}"),
            found=f"an effective tip radius of {r_eff_mm:.4f} mm",
            expected=f"about {known / 2.0:g} mm",
        )


def compensated_centres_mm(
    points: ProbedPoints, qualification: Qualification, method: Method, where: str | Path = "qualification"
) -> tuple[Array, Array]:
    """Tip centres at first contact, (n, 3), and the pre-travel subtracted, (n,) in um.

    ``"lobed"`` takes it from the direction, ``"mean"`` takes the same, R_eff against the tip radius, everywhere.
    Raises :class:`InputError` in the name of ``where`` if the qualification lacks what the method needs.
    """
    if method == "mean":
        pretravel_um = np.full(
            len(points.approach), 1e3 * (tip_radius_mm(qualification, where) - qualification.r_eff_mm)
        )
    else:
        if qualification.lobes is None:
            why = qualification.undetermined
            expected = naming("method", words="{} mean") if why else WITH_TIP
            raise InputError(where, "it has no lobes", found=why or None, expected=expected)
        normals = -points.approach @ probe_frame(qualification.stylus_axis).T
        pretravel_um = qualification.lobes.model.pretravel_um(normals, qualification.lobes.constant_um)
    return points.position_mm - 1e-3 * pretravel_um[:, None] * points.approach, pretravel_um


def tip_radius_mm(qualification: Qualification, where: str | Path = "qualification") -> float:
    """True radius of the tip; :class:`InputError` if the qualification was made without it."""
    if qualification.tip_diameter_mm is None:
        raise InputError(where, "the tip diameter is missing", expected=WITH_TIP)
    return qualification.tip_diameter_mm / 2.0


def write_qualification(path: str | Path, qualification: Qualification) -> None:
    """The qualification as JSON."""
    write_json(path, {"format": f"stepgauge {KIND} 1", "stepgauge": __version__, **qualification.model_dump()})


def read_qualification(path: str | Path) -> Qualification:
    """A qualification file; :class:`InputError` names what is wrong with it."""
    return check_qualification(read_result(path, KIND), path)


def check_qualification(data: Mapping[str, Any], path: str | Path) -> Qualification:
    """What a file of a qualification states."""
    return check_table(Qualification, {key: value for key, value in data.items() if key not in _ABOUT}, path)


def _check_approaches(points: ProbedPoints, centre_mm: Array) -> None:
    radial = points.position_mm - centre_mm
    cosine = -np.sum(radial * points.approach, axis=1) / np.linalg.norm(radial, axis=1)
    wrong = np.flatnonzero(cosine < np.cos(_AIM_RAD))
    if len(wrong):
        angle = np.degrees(np.arccos(np.clip(cosine[wrong[0]], -1.0, 1.0)))
        raise InputError(
            points.rows.at(wrong[0]),
            "the approach does not aim at the sphere's centre (a surface normal instead of the travel?)",
            found=f"{angle:.0f} deg off",
            expected="the unit vector of travel towards the surface",
        )


@dataclass(frozen=True)
class _Lobes:
    """What is known of the lobes: the model with its calibration, or why there is none."""

    calibration: wozniak.Calibration | None = None
    mean_pretravel_um: float = 0.0
    azimuth: wozniak.LobeAzimuth | None = None
    undetermined: str = ""

    def table(self) -> LobeTable | None:
        """As the qualification has it."""
        found, azimuth = self.calibration, self.azimuth
        if found is None:
            return None
        return LobeTable(
            transducer=found.model.transducer,
            slip=found.model.slip,
            lobe_azimuth_deg=float(np.degrees(found.model.lobe_azimuth_rad)),
            lobe_azimuth_fitted=azimuth is not None,
            u_lobe_azimuth_deg=None if azimuth is None else float(np.degrees(azimuth.u_rad)),
            constant_um=found.constant_um,
            u_constant_um=found.u_constant_um,
            mean_pretravel_um=self.mean_pretravel_um,
        )


def _lobes(points: ProbedPoints, reference: Reference, model: LobeModel, find: bool, form_error_um: float) -> _Lobes:
    """The lobes, whose azimuth the readings must tell; nothing that makes the form worse is claimed."""
    if reference.tip_diameter_mm is None:
        return _Lobes()
    radii = reference.sphere_diameter_mm / 2.0, reference.tip_diameter_mm / 2.0
    frame, azimuth = probe_frame(reference.stylus_axis), None
    if find and model.transducer == "kinematic":
        if len(points.position_mm) < _FEWEST_FOR_LOBES:
            return _Lobes(undetermined=f"their azimuth needs {_FEWEST_FOR_LOBES} points, or is to be stated")
        azimuth = wozniak.find_lobe_azimuth(points.position_mm, *radii, model, frame, reference.noise_um)
        if azimuth.odds < LEAST_ODDS:
            return _Lobes(undetermined=f"the readings do not show them (odds {azimuth.odds:.2g})")
        model = LobeModel(model.transducer, azimuth.azimuth_rad, model.slip)
    u_radii_um = float(np.hypot(reference.u_sphere_um, reference.u_tip_um)) / 2.0
    found = wozniak.calibrate(points.position_mm, *radii, model, frame, u_radii_um, reference.noise_um)
    if azimuth is not None and np.ptp(found.residuals_um) > form_error_um:
        return _Lobes(undetermined="without them the form error is smaller")
    pretravel_um = model.pretravel_um(-points.approach @ frame.T, found.constant_um)
    return _Lobes(found, float(pretravel_um.mean()), azimuth)


def _make_qualification(reference: Reference, radius: QualifiedRadius, lobes: _Lobes) -> Qualification:
    fit = radius.fit
    compensated = None if lobes.calibration is None else lobes.calibration.residuals_um
    return Qualification(
        points=len(fit.residuals_um),
        sphere_diameter_mm=reference.sphere_diameter_mm,
        tip_diameter_mm=reference.tip_diameter_mm,
        stylus_axis=reference.stylus_axis,
        r_eff_mm=radius.r_eff_mm,
        u_r_eff_mm=None if radius.u_r_eff_um is None else 1e-3 * radius.u_r_eff_um,
        centre_mm=(float(fit.centre_mm[0]), float(fit.centre_mm[1]), float(fit.centre_mm[2])),
        noise_um=fit.noise_um,
        form_error_um=fit.form_error_um,
        form_error_compensated_um=None if compensated is None else float(np.ptp(compensated)),
        residuals_um=fit.residuals_um.tolist(),
        residuals_compensated_um=None if compensated is None else compensated.tolist(),
        lobes=lobes.table(),
        undetermined=lobes.undetermined,
    )
