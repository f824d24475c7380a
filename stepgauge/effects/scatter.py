"""Effects on the scatter instead of the mean: repeatability that grows, and outliers."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from stepgauge.effects.base import Displacement, Effect, Wording, parameter, whole_numbers
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array

Covariate = Literal["x", "y", "z", "position", "speed", "time"]


class NoiseGrowth(Effect):
    """The repeatability grows with position, speed or time: s^2 = s0^2 + (rate c)^2."""

    kind: ClassVar[str] = "noise_growth"
    equation: ClassVar[str] = (
        "s^2 = repeatability^2 + (rate c)^2; c: metres from the travel's low end or face 1, mm/s, or hours"
    )
    source: ClassVar[str] = "quadrature sum of independent scatter, JCGM 100:2008, 5.1.2"
    covariates: ClassVar[tuple[str, ...]] = ("scatter",)
    words: ClassVar[Wording | None] = Wording(
        "noise growth",
        "The scatter grows with {per}, by {rate} added in quadrature; these readings have less weight.",
        "Look for what changes with {per}.",
        "Nothing: readings there have less weight.",
        german=Wording(
            "zunehmende Streuung",
            "Die Streuung wächst mit {per}, um {rate} (quadratisch addiert); diese Werte haben weniger Gewicht.",
            "Suchen, was sich mit {per} ändert.",
            "Nichts: Werte von dort haben weniger Gewicht.",
        ),
    )
    per: Covariate = parameter(
        unit="", role="choice", meaning="x, y, z (machine), position (along the gauge), speed or time"
    )
    rate: float = parameter(
        unit="um per m, mm/s or h",
        meaning="standard deviation per metre of position, per mm/s or per hour",
        ge=0,
        le=1e4,
        sensible=(0, 10),
    )
    start_s: float = parameter(0.0, unit="s", role="fixed", meaning="time from which hours count", ge=-1e12, le=1e12)

    def displacement_um(self, probings: Probings) -> Displacement:
        """None: the mean does not change."""
        return {}

    def scatter_um(self, probings: Probings) -> Array:
        """rate times the covariate."""
        return self.rate * self._covariate(probings)

    def _covariate(self, probings: Probings) -> Array:
        if self.per == "speed":
            return probings.speed_mm_s
        if self.per == "time":
            return (probings.time_s - self.start_s) / 3600.0
        if self.per == "position":
            return probings.certified_mm() * 1e-3
        low = probings.setting.travel_mm["xyz".index(self.per), 0]
        return (probings.coordinate_mm(self.per) - low) * 1e-3


class Outliers(Effect):
    """Isolated erroneous probings: d = um along the approach in the listed rows; no law."""

    kind: ClassVar[str] = "outliers"
    equation: ClassVar[str] = "d = um along the approach where the row is listed"
    source: ClassVar[str] = "definition"
    covariates: ClassVar[tuple[str, ...]] = ("row",)
    words: ClassVar[Wording | None] = Wording(
        "outliers",
        "Some probings are far outside the scatter of the repeats and not used in the fit: dirt, a false"
        " trigger, or a hand on the table.",
        "Clean the tip and the faces that are listed in the appendix.",
        "Measure these points again.",
        german=Wording(
            "einzelne Ausreißer",
            "Einige Antastungen liegen weit außerhalb der Streuung und gehen nicht ein: Schmutz, ein falsches"
            " Schalten oder eine Hand auf dem Tisch.",
            "Die Kugel und die Flächen reinigen, die im Anhang des Berichts stehen.",
            "Diese Punkte noch einmal messen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "outliers",
        "Some readings are far outside the scatter and left out: a lost count, an interrupted beam, dirt, or a"
        " slip in writing.",
        "Look at the readings that are listed in the appendix, and at what happened then.",
        "Measure these targets again.",
        german=Wording(
            "einzelne Ausreißer",
            "Einige Werte liegen weit außerhalb der Streuung und gehen nicht ein: ein verlorener Zähler, ein"
            " unterbrochener Strahl, Schmutz oder ein Schreibfehler.",
            "Die Werte ansehen, die im Anhang des Berichts stehen, und was damals geschah.",
            "Diese Ziele noch einmal messen.",
        ),
    )
    rows: Annotated[tuple[Annotated[int, Field(ge=1)], ...], Field(strict=False)] = parameter(
        unit="", role="choice", meaning="numbers of the rows, counted from 1"
    )
    um: float | Annotated[tuple[float, ...], Field(strict=False)] = parameter(
        10.0, unit="um", meaning="displacement, one for all or one per row", sensible=(-100, 100)
    )

    @model_validator(mode="after")
    def _one_each(self) -> Outliers:
        if isinstance(self.um, tuple) and len(self.um) != len(self.rows):
            raise ValueError(f"um: one number or {len(self.rows)}, one per row, not {len(self.um)}")
        if len(set(self.rows)) != len(self.rows):
            raise ValueError("rows: every row once")
        return self

    def displacement_um(self, probings: Probings) -> Displacement:
        """Row numbers beyond the end of the recording are ignored."""
        rows = whole_numbers(self.rows) - probings.first_row
        inside = (rows >= 0) & (rows < len(probings))
        um = np.asarray(self.um, dtype=float)
        shape = np.broadcast_shapes(um.shape, rows.shape)
        displaced = np.zeros((*shape[:-1], len(probings)))
        displaced[..., rows[inside]] = np.broadcast_to(um, shape)[..., inside]
        return {"approach": displaced}
