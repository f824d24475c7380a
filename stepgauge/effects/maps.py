"""Tabulated errors of an axis, as measured with a laser interferometer or by a calibration laboratory."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from stepgauge.effects.base import GAUGE, Axis, Displacement, Effect, Wording, parameter
from stepgauge.effects.motion import COMPONENTS, Component, moved, reference_point, um_or_mrad
from stepgauge.effects.probings import Probings
from stepgauge.effects.reversal import STANDSTILL
from stepgauge.files.arrays import Array
from stepgauge.files.config import Vector3, file_beside
from stepgauge.files.tables import read_numbers

COLUMNS = ("coordinate_mm", "error")


class ErrorMap(Effect):
    """One of the 18 errors of motion from a table: d = scale * error(x), linear between rows, constant beyond the ends.

    The CSV file has the columns ``coordinate_mm`` (increasing) and ``error``: um for the components x, y, z
    (positioning or straightness), urad for rx, ry, rz (rotations, which act with the arm of :class:`AngularError`), or
    in the unit that its header states.
    """

    kind: ClassVar[str] = "error_map"
    equation: ClassVar[str] = "d = scale error(x), error from a CSV table, linear between its rows"
    source: ClassVar[str] = "ISO 230-2:2014 and ISO 230-1:2012 measurements; Zhang et al. 1985"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    words: ClassVar[Wording | None] = Wording(
        "error map",
        "The machine has an error map of {axis} that its file does not state, or the other way round.",
        "Look whether the error map is switched on in the controller.",
        "State it in the machine file, or switch it off.",
        german=Wording(
            "Fehlerkarte",
            "Die Maschine hat eine Fehlerkarte von {axis}, die ihre Datei nicht angibt, oder umgekehrt.",
            "Nachsehen, ob die Fehlerkarte in der Steuerung eingeschaltet ist.",
            "In der Maschinendatei angeben oder ausschalten.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis of travel: x, y or z")
    component: Component = parameter(unit="", role="choice", meaning=f"tabulated quantity: {COMPONENTS}")
    file: str = parameter(unit="", role="fixed", meaning="CSV file, beside the machine file", min_length=1)
    scale: float = parameter(1.0, unit="1", meaning="factor on the table", ge=-100, le=100, sensible=(0, 2))
    scale_at_mm: Vector3 | None = reference_point()

    def prepared(self, where: str | Path) -> Self:
        """Finds the file beside the machine file and reads it."""
        file = _readable(where, self.file, lambda path: read_map(path, self.component))
        return self.model_copy(update={"file": file})

    def displacement_um(self, probings: Probings) -> Displacement:
        """Interpolated in the coordinate of the travel."""
        coordinate, error = read_map(self.file, self.component)
        amount = self.scale * np.interp(probings.axis_mm(self.axis), coordinate, error)
        return moved(probings, self.axis, self.component, um_or_mrad(amount, self.component), self.scale_at_mm)


@lru_cache(maxsize=64)
def read_map(path: str, component: Component) -> tuple[Array, Array]:
    """Coordinates in mm and errors in um or urad; :class:`InputError` names the row that does not increase."""
    unit = {"length": "um"} if len(component) == 1 else {"angle": "urad"}
    table = read_numbers(path, COLUMNS, unit)
    return table.rising("coordinate_mm"), table["error"]


def _readable(where: str | Path, file: str, read: Callable[[str], object]) -> str:
    """The whole path of a table beside the machine file, which can be read."""
    path = str(file_beside(where, "effect.file", file).resolve())
    read(path)
    return path


AXIS_COLUMNS = ("position_mm", "error_positive_um", "error_negative_um", "u_positive_um", "u_negative_um")


class AxisCompensation(Effect):
    """The controller corrects an axis by a table: d = -error(x, direction of travel), constant beyond its ends.

    The CSV file is that of ``stepgauge compensate --to csv``; linear between its rows. An axis that does not move is
    corrected by the mean of both directions.
    """

    kind: ClassVar[str] = "axis_compensation"
    equation: ClassVar[str] = "d = -scale error(x, sense of travel), error from a CSV table, linear between its rows"
    source: ClassVar[str] = "what controllers do with a bidirectional table of screw or scale errors"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate", "approach")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    words: ClassVar[Wording | None] = Wording(
        "axis compensation",
        "The machine has a compensation of {axis} that its file does not state, or the other way round.",
        "Look whether the compensation of {axis} is switched on in the controller.",
        "State it in the machine file, or switch it off.",
        german=Wording(
            "Achskorrekturtabelle",
            "Die Maschine hat eine Korrektur von {axis}, die ihre Datei nicht angibt, oder umgekehrt.",
            "Nachsehen, ob die Korrektur von {axis} in der Steuerung eingeschaltet ist.",
            "In der Maschinendatei angeben oder ausschalten.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis that is corrected: x, y or z")
    file: str = parameter(unit="", role="fixed", meaning="CSV file, beside the machine file", min_length=1)
    scale: float = parameter(1.0, unit="1", meaning="factor on the table", ge=-100, le=100, sensible=(0, 2))

    def prepared(self, where: str | Path) -> Self:
        """Finds the file beside the machine file and reads it."""
        file = _readable(where, self.file, read_compensation)
        return self.model_copy(update={"file": file})

    def displacement_um(self, probings: Probings) -> Displacement:
        """Minus the error at the coordinate for the direction of travel."""
        position, positive, negative = read_compensation(self.file)
        x, share = probings.axis_mm(self.axis), probings.approach(self.axis)
        sense = np.sign(share) * (np.abs(share) > STANDSTILL)
        forward, back = np.interp(x, position, positive), np.interp(x, position, negative)
        error = (forward + back) / 2.0 + sense * (forward - back) / 2.0
        return {self.axis: -self.scale * error}


@lru_cache(maxsize=64)
def read_compensation(path: str) -> tuple[Array, Array, Array]:
    """Positions (mm) and errors (um) in positive and negative travel; :class:`InputError` names a row out of order."""
    table = read_numbers(path, AXIS_COLUMNS)
    return table.rising("position_mm"), table["error_positive_um"], table["error_negative_um"]
