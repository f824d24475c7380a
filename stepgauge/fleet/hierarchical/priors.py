"""The priors of the fleet's inference: one table with reasons, ``priors.toml``."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files

import numpy as np
from pydantic import Field

from stepgauge.files.config import TomlTable, check_table
from stepgauge.fleet.hierarchical.single_effects import SizeMixture

FILE = "priors.toml"


class StatingThresholds(TomlTable):
    """Probabilities from which causes are stated."""

    named: float = Field(ge=0.5, lt=1.0)
    false_share: float = Field(gt=0.0, lt=0.5)
    settled: float = Field(gt=0.5, lt=1.0)
    interval: float = Field(gt=0.5, lt=1.0)


class EffectSizePrior(TomlTable):
    """Distribution of sizes over the usual one."""

    spread: float = Field(gt=1.0)
    steps: list[float] = Field(min_length=1)

    def mixture(self) -> SizeMixture:
        """As normal distributions with logarithmic weights."""
        steps = np.array(self.steps)
        weight = -0.5 * (np.log(steps) / np.log(self.spread)) ** 2
        return SizeMixture(steps, weight - np.logaddexp.reduce(weight))


class TimePriors(TomlTable):
    """When causes begin."""

    always: float = Field(gt=0.0, lt=1.0)
    dates: int = Field(ge=2)
    season: float = Field(gt=0.0, lt=1.0)
    alone: float = Field(gt=0.0, lt=0.5)


class Legitimate(TomlTable):
    """Least standard deviations of what is nothing wrong."""

    shape_um: float = Field(gt=0.0)
    wave_um: float = Field(gt=0.0)
    scale_um_m: float = Field(gt=0.0)
    size_um: float = Field(gt=0.0)
    day_K: float = Field(gt=0.0)


class CausePrior(TomlTable):
    """Prior odds and usual size of one kind of cause at one owner."""

    odds: float = Field(gt=0.0)
    usual: float = Field(gt=0.0)
    unit: str = ""
    why: str = ""


class FleetPriors(TomlTable):
    """All values that are set by hand, see ``priors.toml``; ``kinds``: by kind of owner and kind of cause."""

    decision: StatingThresholds
    sizes: EffectSizePrior
    time: TimePriors
    legitimate: Legitimate
    kinds: dict[str, dict[str, CausePrior]]


@cache
def fleet_priors() -> FleetPriors:
    """The priors of the shipped file."""
    text = (files("stepgauge.fleet.hierarchical") / FILE).read_text("utf-8")
    return check_table(FleetPriors, tomllib.loads(text), FILE)
