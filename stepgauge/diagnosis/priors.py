"""The priors of a diagnosis: one table, with reasons, that a user may print and replace."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from stepgauge.errors import InputError
from stepgauge.files.config import Table, check_table, read_toml
from stepgauge.inference.priors import NoisePriors
from stepgauge.inference.problem import AmplitudePrior

Array = NDArray[np.float64]
FILE = "priors.toml"


class Decision(Table):
    """Probabilities from which results are stated."""

    stated: float = Field(ge=0.5, lt=1.0)
    in_set: float = Field(gt=0.0, lt=0.5)
    excluded: float = Field(gt=1.0)
    determined: float = Field(gt=0.0)


class SizePriors(Table):
    """Distribution of amplitudes: ``below``, ``above`` are factors from the usual size that make one e times rarer."""

    below: float = Field(gt=1.0)
    above: float = Field(gt=1.0)
    shortest_mm: float = Field(ge=0.0)
    repeatability_um: float = Field(gt=0.0)
    certificate_um: float = Field(gt=0.0)
    steps: list[float] = Field(min_length=1)

    def about(self, usual: float, most: float = np.inf) -> AmplitudePrior:
        """The mixture about a usual size, without standard deviations above ``most``."""
        steps = np.array([step for step in self.steps if usual * step <= most] or self.steps[:1])
        weight = -np.abs(np.log(steps)) / np.log(np.where(steps > 1.0, self.above, self.below))
        return AmplitudePrior(usual * steps, weight - np.logaddexp.reduce(weight))


class FormPriors(Table):
    """Forms: structure without a known law."""

    odds: float = Field(gt=0.0)
    lag: float = Field(gt=0.0)
    own_column: float = Field(gt=0.0)
    product: float = Field(gt=0.0)
    wave: float = Field(gt=0.0)
    sizes: list[float] = Field(min_length=1)
    size_weights: list[float] = Field(min_length=1)
    lengths: list[float] = Field(min_length=1)
    lags: list[float] = Field(min_length=1)

    @model_validator(mode="after")
    def _paired(self) -> FormPriors:
        if len(self.sizes) != len(self.size_weights):
            raise ValueError("as many size_weights as sizes")
        return self

    def about(self, scale_um: float) -> AmplitudePrior:
        """The mixture over the stated repeatability."""
        return AmplitudePrior(
            np.array(self.sizes) * scale_um, np.log(np.array(self.size_weights) / sum(self.size_weights))
        )


class KindPrior(Table):
    """Prior odds and usual size of one kind of law; ``basis``: what the size depends on; ``why``: its reason.

    ``most``: the largest standard deviation of its size that is physically possible; ``again``: odds that another axis
    has it where one has, without a value as if there was none; ``least``: the smallest size that occurs, of maps.
    """

    odds: float = Field(gt=0.0)
    usual: float = Field(gt=0.0)
    most: float = Field(np.inf, gt=0.0)
    least: float = Field(0.0, ge=0.0)
    again: float | None = Field(None, gt=0.0)
    basis: Literal["", "grade", "sag", "certificate", "stylus"] = ""
    unit: str = ""
    why: str = ""


class ShapePrior(Table):
    """Log-normal prior of a shape: median, and the factor of one standard deviation.

    With the basis "stylus" the median is ``usual`` beyond the length of the stylus.
    """

    usual: float = Field(gt=0.0)
    factor: float = Field(gt=1.0)
    basis: Literal["", "stylus"] = ""
    why: str = ""


class LawPriors(Table):
    """All kinds of laws.

    ``part``: odds of one in a part of the record only, over one everywhere; ``same_part``: odds that a law follows
    thermometers on the part that it moves, over others: a bending the difference of two on one part, an expansion no
    thermometer that is documented to be on another part; ``corrected``: size of what follows a temperature for which
    the evaluation corrects, over that of what follows others, ``corrected_most``: its largest standard deviation;
    ``lag``: odds of a body that takes time to follow, over one that follows at once; ``late``: those of a beginning
    during the measurement; ``unqualified``: odds of the whole pre-travel of a tripod, over its variation about the mean
    of a qualification; ``all_axes``: of one error of all axes, over one of any of them; ``discrepancy``: standard
    deviation of what laws with a shape in ``processes`` leave out, as a share of their size.
    """

    odds: float = Field(gt=0.0)
    part: float = Field(0.01, gt=0.0)
    same_part: float = Field(10.0, gt=0.0)
    corrected: float = Field(0.2, gt=0.0)
    corrected_most: float = Field(12.0, gt=0.0)
    lag: float = Field(1.0, gt=0.0)
    late: float = Field(0.2, gt=0.0)
    unqualified: float = Field(0.03, gt=0.0)
    all_axes: float = Field(1.5, gt=0.0)
    discrepancy: float = Field(0.05, ge=0.0, lt=1.0)
    processes: list[str] = Field(default_factory=list)
    kinds: dict[str, KindPrior]

    def of(self, kind: str) -> KindPrior:
        """Those of one kind; for a kind that is not in the file, common odds and a usual size of one unit."""
        return self.kinds.get(kind, KindPrior(odds=1.0, usual=1.0))


class MapPriors(Table):
    """Further priors of probe maps and of their laws."""

    gauge_share: float = Field(gt=0.0, lt=0.1)
    slight: float = Field(ge=0.0, lt=0.1)
    laws: LawPriors


class Priors(Table):
    """All values that are set by hand, see ``priors.toml``."""

    decision: Decision
    sizes: SizePriors
    scatter: NoisePriors
    forms: FormPriors
    shapes: dict[str, list[float]]
    usual_shapes: dict[str, ShapePrior]
    laws: LawPriors
    maps: MapPriors

    @model_validator(mode="after")
    def _ranges(self) -> Priors:
        for name, ends in self.shapes.items():
            if len(ends) != 2 or not 0.0 < ends[0] < ends[1]:
                raise ValueError(f"for {name} two positive numbers, the smaller one first")
        return self


def priors_text() -> str:
    """The shipped file with its reasons."""
    return (files("stepgauge.diagnosis") / FILE).read_text("utf-8")


@cache
def shipped_priors() -> Priors:
    """The priors of the shipped file."""
    return check_table(Priors, tomllib.loads(priors_text()), FILE)


def read_priors(path: str | Path) -> Priors:
    """The shipped priors, replaced by those of a file (:class:`InputError` for a file that is not valid)."""
    own, shipped = read_toml(path), shipped_priors()
    _check_kinds(path, own, ("laws", "kinds"), shipped.laws)
    _check_kinds(path, own, ("maps", "laws", "kinds"), shipped.maps.laws)
    return check_table(Priors, _over(tomllib.loads(priors_text()), own), path)


def _check_kinds(path: str | Path, own: Any, keys: Sequence[str], laws: LawPriors) -> None:
    """Kinds of laws in a file must be known; values that are no tables are reported elsewhere."""
    for key in keys:
        own = own.get(key) if isinstance(own, dict) else None
    for kind in own if isinstance(own, dict) else ():
        if kind not in laws.kinds:
            near = difflib.get_close_matches(kind, laws.kinds, 1)
            expected = f"{near[0]}?" if near else ", ".join(laws.kinds)
            raise InputError(path, f"key {'.'.join(keys)}.{kind} is no kind of law", expected=expected)


def _over(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Nested tables with some keys replaced."""
    merged = dict(base)
    for key, value in own.items():
        old = base.get(key)
        merged[key] = _over(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return merged
