"""The truth file: what is hidden in a case, and what effect of the vocabulary that is."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from stepgauge.errors import InputError
from stepgauge.files.config import TomlTable, check_table, read_toml

HERE = Path(__file__).resolve().parent
TRUTH = HERE / "truth.toml"
ByAxis = dict[Literal["x", "y", "z"], float]


class Hidden(TomlTable):
    """What is set in the controller's HAL and INI files; nothing by default."""

    scale_ppm: ByAxis = Field(default_factory=dict, description="a scale reads too long by, um/m")
    play_um: ByAxis = Field(default_factory=dict, description="width of the play between scale and table, um")
    drift_um_per_s: ByAxis = Field(default_factory=dict, description="growth of an axis' readings, um/s")
    squareness_urad: float = Field(0.0, description="x reads too long by this share of y, urad")
    debounce_samples: int = Field(0, ge=0, description="looks at the probe by which a contact is late")
    servo_period_ns: int = Field(100_000, ge=10_000, description="time between two looks, ns")

    @property
    def scale_gain(self) -> ByAxis:
        """Place of the carriage over what its scale reads."""
        return {axis: 1.0 / (1.0 + self.scale_ppm.get(axis, 0.0) * 1e-6) for axis in ("x", "y", "z")}

    @property
    def lean(self) -> float:
        """Place of the table on x over that on y."""
        return -self.squareness_urad * 1e-6

    @property
    def play_mm(self) -> ByAxis:
        """Width of the play of each axis, mm."""
        return {axis: self.play_um.get(axis, 0.0) * 1e-3 for axis in ("x", "y", "z")}

    @property
    def drift_mm_s(self) -> ByAxis:
        """Growth of the readings of each axis, mm/s."""
        return {axis: self.drift_um_per_s.get(axis, 0.0) * 1e-3 for axis in ("x", "y", "z")}


class TrueEffect(TomlTable):
    """What the hidden thing does to a reading, in words of the vocabulary."""

    kind: str
    parameter: str
    value: float
    axis: str | None = None
    direction: str | None = None

    @property
    def choice(self) -> str:
        """The axis or direction, empty where the kind has none."""
        return self.axis or self.direction or ""


class Truth(TomlTable):
    """One case; without an effect nothing is hidden."""

    hidden: Hidden = Field(default_factory=Hidden)
    effect: TrueEffect | None = None


def read_truth(case: str) -> Truth:
    """The truth of a case; :class:`InputError` where the file has none of that name."""
    cases = read_toml(TRUTH)
    if case not in cases:
        raise InputError(TRUTH, f"there is no case {case!r}", expected=", ".join(cases))
    return check_table(Truth, cases[case], TRUTH, case)
