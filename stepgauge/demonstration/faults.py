"""Faults to conceal: effects of the vocabulary, of sizes that a worn or badly set machine has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, naming

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Fault:
    """``name`` on the command line, ``words`` for a person; ``kind`` and ``choices`` of the effect.

    ``sizes``: for each parameter the range from which its size is drawn, with either sign where ``signed``.
    """

    name: str
    words: str
    kind: str
    choices: Mapping[str, str]
    sizes: Mapping[str, tuple[float, float]]
    signed: str = ""

    def draw(self, random: np.random.Generator) -> dict[str, Any]:
        """The table ``[[effect]]`` of a machine that has the fault."""
        sizes = {name: round(float(random.uniform(*between)), 2) for name, between in self.sizes.items()}
        if self.signed and random.random() < 0.5:
            sizes[self.signed] = -sizes[self.signed]
        return {"kind": self.kind, **self.choices, **sizes}


FAULTS = (
    Fault("backlash", "backlash of the y axis", "reversal_error", {"axis": "y"}, {"um": (3.0, 8.0)}, "um"),
    Fault("scale", "a wrong scale of the y axis", "scale_error", {"axis": "y"}, {"ppm": (8.0, 25.0)}, "ppm"),
    Fault(
        "wave",
        "a periodic error of the y scale",
        "periodic_scale_error",
        {"axis": "y"},
        {"period_mm": (70.0, 130.0), "amplitude_um": (1.5, 4.0), "phase_deg": (0.0, 360.0)},
    ),
    Fault(
        "damage",
        "a damaged place of the y scale",
        "local_scale_defect",
        {"axis": "y"},
        {"at_mm": (400.0, 560.0), "width_mm": (40.0, 80.0), "height_um": (3.0, 6.0)},
        "height_um",
    ),
    Fault("warm", "a gauge warmer than its thermometer says", "gauge_temperature", {}, {"delta_K": (0.5, 1.5)}),
    Fault(
        "knock",
        "a knock that shifted the gauge along x",
        "step_change",
        {"direction": "x"},
        {"time_s": (80.0, 200.0), "um": (3.0, 8.0)},
        "um",
    ),
    Fault("tip", "a tip of another radius than qualified", "effective_radius", {}, {"um": (2.0, 8.0)}, "um"),
)
"""What ``stepgauge demo --conceal`` offers. A gauge along y and along x can tell all of them, some as one of a set."""

NAMES = tuple(one.name for one in FAULTS)


def choose_fault(name: str | None, random: np.random.Generator) -> Fault:
    """The fault of this name, or one at random; :class:`InputError` for a name that is none."""
    if name is None:
        return FAULTS[int(random.integers(len(FAULTS)))]
    for one in FAULTS:
        if one.name == name:
            return one
    raise InputError(naming("conceal"), "no fault has this name", found=name, expected=", ".join(NAMES))
