"""Effects of the gauge, alike everywhere in the machine: a defective face, a wrong way round, bending, misalignment."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from stepgauge.effects import grids
from stepgauge.effects.base import GAUGE, Displacement, Effect, EffectPrior, Wording, parameter
from stepgauge.effects.probings import Probings
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array

MOST_REVERSED_MM = 1.0
"""Largest difference of a face to its mirror image at which a probe that searches still finds it."""


def _placement_choice() -> Any:
    """The choice of one placement."""
    meaning, grid = "number of the placement; without it all", grids.placements
    return parameter(None, unit="", role="choice", meaning=meaning, ge=1, le=10_000, grid=grid)


class BlockDefect(Effect):
    """One face is not at its certified position: d = um along the gauge axis at that face, wherever the gauge lies."""

    kind: ClassVar[str] = "block_defect"
    equation: ClassVar[str] = "d = um along the gauge axis where the face is 'face'"
    source: ClassVar[str] = "definition; positive towards the end block"
    covariates: ClassVar[tuple[str, ...]] = ("face",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 0.5, "wear, a burr, dirt on a face", basis="certificate")
    words: ClassVar[Wording | None] = Wording(
        "block defect",
        "Face {face} lies {um} nearer to the {um:end|beginning} block than certified.",
        "Is the position of face {face} in the gauge file that of its certificate? Look for dirt, rust or dents on it.",
        "Clean it; then have the gauge calibrated.",
        german=Wording(
            "fehlerhafte Fläche",
            "Fläche {face} liegt um {um} näher am {um:End|Anfangs}block als im Schein.",
            "Steht die Position von Fläche {face} in der Datei wie im Schein? Auf Schmutz, Rost oder Dellen ansehen.",
            "Reinigen; dann das Stufenendmaß kalibrieren lassen.",
        ),
    )
    face: int = parameter(unit="", role="choice", meaning="number of the face", ge=1, le=10_000, grid=grids.faces)
    um: float = parameter(unit="um", meaning="true minus certified position", ge=-1e4, le=1e4, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero on all other faces; :class:`InputError` for a face that the gauge does not have."""
        _check_number("face", self.face, probings, 1)
        return {"approach": probings.shifted_along_gauge(self.um * (probings.face == self.face))}


class BlockShift(Effect):
    """A block was moved: d = um along the gauge axis at both of its faces, wherever the gauge lies."""

    kind: ClassVar[str] = "block_shift"
    equation: ClassVar[str] = "d = um along the gauge axis where the face is 2 block - 1 or 2 block"
    source: ClassVar[str] = "definition; positive towards the end block"
    covariates: ClassVar[tuple[str, ...]] = ("face",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.5, 0.5, "a block that was knocked, or is loose in its rail", basis="certificate"
    )
    words: ClassVar[Wording | None] = Wording(
        "block shift",
        "Both faces of block {block} lie {um} nearer to the {um:end|beginning} block than certified: the block"
        " was moved.",
        "Are the positions of block {block} in the gauge file those of its certificate? Look whether the block sits"
        " tight; lay the gauge elsewhere: does the error go with it?",
        "Have the gauge calibrated; do not use it as it is.",
        german=Wording(
            "verschobener Block",
            "Beide Flächen von Block {block} liegen um {um} näher am {um:End|Anfangs}block als im Schein: Der"
            " Block wurde verschoben.",
            "Stehen die Positionen von Block {block} in der Datei wie im Schein? Nachsehen, ob der Block fest sitzt;"
            " das Stufenendmaß anders legen: Wandert die Abweichung mit?",
            "Das Stufenendmaß kalibrieren lassen; so nicht benutzen.",
        ),
    )
    block: int = parameter(unit="", role="choice", meaning="number of the block", ge=1, le=5_000, grid=grids.blocks)
    um: float = parameter(unit="um", meaning="true minus certified position", ge=-1e4, le=1e4, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero on all other blocks; :class:`InputError` for a block that the gauge does not have."""
        _check_number("block", self.block, probings, 2)
        return {"approach": probings.shifted_along_gauge(self.um * ((probings.face + 1) // 2 == self.block))}


def _check_number(part: str, number: int, probings: Probings, faces: int) -> None:
    """:class:`InputError` for a part of so many faces that the gauge does not have."""
    gauge = probings.setting.gauge
    if gauge is not None and number > gauge.n_faces // faces:
        raise InputError("effects", f"no such {part}", found=number, expected=f"1 to {gauge.n_faces // faces}")


class GaugeReversed(Effect):
    """The gauge was laid the wrong way round: each face stands where the certificate has its mirror image.

    Blocks and gaps of most gauges are nominally symmetrical, so that a program runs all the same.
    """

    kind: ClassVar[str] = "gauge_reversed"
    equation: ClassVar[str] = (
        "d = share (S_last - S_(n + 1 - face) - S_face) along the gauge axis, of n faces, in one placement or in all"
    )
    source: ClassVar[str] = "definition: certified positions counted from the other end"
    covariates: ClassVar[tuple[str, ...]] = ("face", "placement")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.1, 1.0, "it is so or not; most gauges fit both ways", most=1.0, again=0.1, least=0.5
    )
    words: ClassVar[Wording | None] = Wording(
        "gauge reversed",
        "{placement:In placement {placement} the|The} faces stand where the certificate has them if it is counted"
        " from the other end (share {share:=3}; 1 if it is so): the gauge was laid the wrong way round, or its blocks"
        " were numbered from the wrong end.",
        "Look at which end of the gauge the beginning of its certificate is.",
        "Turn the gauge round, or number its blocks from the other end; then measure again.",
        german=Wording(
            "Stufenendmaß verkehrt herum",
            "{placement:In Lage {placement} stehen die|Die} Flächen{placement:| stehen}, wo der Schein sie hat, wenn"
            " man vom anderen Ende zählt (Anteil {share:=3}; 1, wenn es so ist): Das Stufenendmaß lag verkehrt herum,"
            " oder seine Blöcke wurden vom falschen Ende gezählt.",
            "Nachsehen, an welchem Ende des Stufenendmaßes sein Schein beginnt.",
            "Das Stufenendmaß umdrehen oder seine Blöcke vom anderen Ende zählen; dann neu messen.",
        ),
    )
    placement: int | None = _placement_choice()
    share: float = parameter(1.0, unit="1", meaning="1 if it is so", ge=0.5, le=1.5, sensible=(0.5, 1.5))

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """A program that probes a gauge that is not symmetrical misses its faces."""
        faces = probings.gauge.position_mm
        missed = np.abs(faces[-1] - faces[::-1] - faces).max() > MOST_REVERSED_MM
        return 1e-6 if missed else 1.0

    def displacement_um(self, probings: Probings) -> Displacement:
        """Mirrored minus certified position of the face."""
        faces = probings.gauge.position_mm
        off_um = probings.expand_faces((faces[-1] - faces[::-1] - faces) * 1e3)
        return {"approach": probings.shifted_along_gauge(self.share * off_um * is_placed(self.placement, probings))}

    def uncertain_um(self, probings: Probings) -> Array:
        """In one placement a face has the error of its mirror image, with another sign, and not its own.

        Their sum is common to both, with the uncertainties of both in the certificate.
        """
        if self.placement is None:
            return super().uncertain_um(probings)
        u_um, pairs = probings.gauge.u_um, np.arange(probings.gauge.n_faces // 2)[:, None]
        of_pair = pairs == np.minimum(probings.face - 1, probings.gauge.n_faces - probings.face)
        um = np.hypot(u_um, u_um[::-1])[pairs] * of_pair * is_placed(self.placement, probings)
        return probings.shifted_along_gauge(um[um.any(axis=1)])


def is_placed(placement: int | None, probings: Probings) -> Array | float:
    """1 on the rows of a placement, 0 on others; 1 on all without one."""
    return 1.0 if placement is None else (probings.column("placement") == placement).astype(float)


class Misalignment(Effect):
    """The probed line is at an angle to the gauge: cosine error, indication S / cos(angle), S angle^2 / 2 too long."""

    kind: ClassVar[str] = "misalignment"
    equation: ClassVar[str] = "d = S (1 / cos(mrad) - 1) along the gauge axis, in one placement or in all"
    source: ClassVar[str] = "cosine error: parallel planes S apart are S / cos(angle) apart along an inclined line"
    covariates: ClassVar[tuple[str, ...]] = ("position", "placement")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.2,
        3.0,
        "1 mm in 300 mm by hand; a placement that was probed is off by a hundredth of that",
        again=0.1,
        unit="mrad",
    )
    words: ClassVar[Wording | None] = Wording(
        "misalignment",
        "{placement:In placement {placement} the|The} probed line is {mrad} off the axis of the gauge; the"
        " cosine error makes lengths too long, by up to {largest}.",
        "Probe the 16 points again and compare the placements (stepgauge locate).",
        "Plan anew with the new placement.",
        german=Wording(
            "Schieflage",
            "{placement:In Lage {placement} liegt die|Die} angetastete Linie {placement:|liegt }um {mrad}"
            " schräg zur Achse des Stufenendmaßes; der Kosinusfehler macht Längen um bis zu {largest} zu groß.",
            "Die 16 Punkte noch einmal antasten und die Lagen vergleichen.",
            "Mit der neuen Lage neu planen.",
        ),
    )
    placement: int | None = _placement_choice()
    mrad: float = parameter(
        unit="mrad",
        role="nonlinear",
        meaning="angle between line and gauge",
        ge=0,
        le=200,
        sensible=(0, 20),
        grid=grids.values(1.0),
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """1 / cos - 1 written as 2 sin^2(half) / cos, exact for small angles."""
        angle = np.asarray(self.mrad) * 1e-3
        stretch = 2.0 * np.sin(angle / 2.0) ** 2 / np.cos(angle) * 1e3
        along_um = stretch * probings.certified_mm() * is_placed(self.placement, probings)
        return {"approach": probings.shifted_along_gauge(along_um)}


class GaugeBending(Effect):
    """The gauge sags between its supports and the faces tilt: d = -height w'(S) along the gauge.

    w is the deflection of a uniform beam as long as the gauge on two supports. ``sag_um`` states its stiffness: the sag
    in the middle if supported at the ends, 5 q L^4 / (384 E I). The slope at the ends vanishes with the supports at the
    Airy points, L (1 -+ 1/sqrt(3)) / 2.
    """

    kind: ClassVar[str] = "gauge_bending"
    equation: ClassVar[str] = "d = -height_mm w'(S) along the gauge axis; w: uniform beam on two supports"
    source: ClassVar[str] = "Euler-Bernoulli beam by Macaulay brackets; Airy points: Phelps, Am. J. Phys. 34 (1966) 419"
    covariates: ClassVar[tuple[str, ...]] = ("position",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.2, 60.0, "a steel bar 30 mm high sags 60 um at 1 m", basis="sag", unit="um of sag"
    )
    words: ClassVar[Wording | None] = Wording(
        "gauge bending",
        "The gauge sags by {sag_um} between its supports, which tilts its faces.",
        "Compare the supports of the gauge with those of its certificate.",
        "Support the gauge there.",
        german=Wording(
            "Durchbiegung des Stufenendmaßes",
            "Das Stufenendmaß biegt sich zwischen seinen Auflagen um {sag_um} durch, was seine Flächen neigt.",
            "Die Auflagen des Stufenendmaßes mit denen seines Scheins vergleichen.",
            "Das Stufenendmaß dort auflegen.",
        ),
    )
    supports_mm: Annotated[tuple[float, float], Field(strict=False)] = parameter(
        unit="mm",
        role="nonlinear",
        meaning="positions [a, b] of the two supports along the gauge from face 1",
        grid=grids.supports_mm,
    )
    sag_um: float = parameter(
        unit="um", meaning="sag in the middle if supported at the ends", ge=-1e5, le=1e5, sensible=(0, 100)
    )
    height_mm: float = parameter(
        22.5, unit="mm", role="fixed", meaning="height of the probed line above the neutral plane", ge=-500, le=500
    )

    @model_validator(mode="after")
    def _apart(self) -> GaugeBending:
        if self.supports_mm[0] >= self.supports_mm[1]:
            raise ValueError("supports_mm [a, b] with a < b")
        return self

    def displacement_um(self, probings: Probings) -> Displacement:
        """The tilt of each face times the height."""
        faces = probings.gauge.position_mm
        tilt = beam_slope(faces, float(faces[-1]), *self.supports_mm)
        shift_um = probings.expand_faces(-tilt)
        return {"approach": probings.shifted_along_gauge(self.sag_um * self.height_mm * shift_um)}


def beam_slope(x_mm: Array, length_mm: float, a_mm: float | Array, b_mm: float | Array) -> Array:
    """Slope w' (up positive, 1/mm) of a uniform beam on supports at a and b, for 1 mm of sag if supported at its ends.

    Of shape ``(n,)`` as ``x_mm``, with columns ``(k, 1)`` of supports ``(k, n)``. M = -q x^2 / 2 + R_a <x - a> +
    R_b <x - b>, integrated once and twice; w = 0 at both supports.
    """
    q = 384.0 / (5.0 * length_mm**4)
    r_a = q * length_mm * (b_mm - length_mm / 2.0) / (b_mm - a_mm)
    r_b = q * length_mm - r_a

    def bracket(x: Array | float, at: float | Array, power: int) -> Array:
        return np.maximum(np.asarray(x) - at, 0.0) ** power

    def deflection(x: float | Array) -> Array:
        return -q * x**4 / 24.0 + r_a * bracket(x, a_mm, 3) / 6.0 + r_b * bracket(x, b_mm, 3) / 6.0

    level = (deflection(b_mm) - deflection(a_mm)) / (b_mm - a_mm)
    slope = -q * x_mm**3 / 6.0 + r_a * bracket(x_mm, a_mm, 2) / 2.0 + r_b * bracket(x_mm, b_mm, 2) / 2.0
    return slope - level
