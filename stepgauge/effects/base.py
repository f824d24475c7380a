"""The base of all effects: described parameters, and the displacement of all probings at once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, get_args

import numpy as np
from annotated_types import Ge, Gt, Le, Lt
from numpy.typing import NDArray
from pydantic import Field, PlainValidator, field_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from stepgauge.effects.probings import Probings
from stepgauge.effects.words import Wording as Wording
from stepgauge.files.arrays import Array
from stepgauge.files.config import TomlTable
from stepgauge.files.formula import parse_formula

Axis = Literal["x", "y", "z"]
Displacement = dict[str, Array]
"""Displacement in um by component: ``x``, ``y``, ``z`` (machine axes) or ``approach`` (along the approach)."""
Role = Literal["linear", "nonlinear", "phase", "choice", "fixed"]
"""``linear``: the displacement is proportional to it (to all linear ones together). ``nonlinear``: found by a search.
``phase``: of a sine, whose amplitude is the linear parameter: both together are linear as a sine and a cosine.
``choice``: which axis, plane, face or form. ``fixed``: a reference that only rescales another parameter or is known."""
Grid = Callable[[Probings, Mapping[str, Any]], Sequence[Any] | NDArray[np.float64]]
"""From a recording and the choices that are made to the values of a parameter that a search tries. None stands for what
is there without it: at once, from the beginning, for ever."""


def _direction(value: object) -> object:
    if value in ("x", "y", "z"):
        return value
    vector = _numbers(value)
    size = float(np.linalg.norm(vector))
    if len(vector) != 3 or not 1e-9 < size < 1e9:
        raise ValueError("x, y, z, or a vector of three numbers with a length")
    return tuple(float(share / size) for share in vector)


def _numbers(value: object) -> list[float]:
    """The components of a vector; none where any of them is no number."""
    numbers = list(value) if isinstance(value, list | tuple) else []
    good = all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers)
    return numbers if good else []


def _direction_or_approach(value: object) -> object:
    return value if value == "approach" else _direction(value)


Vector = tuple[float, float, float]
Direction = Annotated[Axis | Vector, PlainValidator(_direction)]
"""A machine axis by name, or a vector ``[i, j, k]`` in machine axes (made a unit vector)."""
AnyDirection = Annotated[Literal["approach"] | Axis | Vector, PlainValidator(_direction_or_approach)]
"""A direction, or ``approach``: along the approach of each probing."""


@dataclass(frozen=True)
class UsualShape:
    """Log-normal prior of a shape: median, and the factor of one standard deviation; ``why``: its reason.

    ``beyond_stylus``: whether the median counts from the end of the stylus.
    """

    median: float
    factor: float
    why: str = ""
    beyond_stylus: bool = False


def parameter(
    default: Any = ...,
    *,
    unit: str,
    meaning: str,
    role: Role = "linear",
    sensible: tuple[float, float] | None = None,
    grid: Grid | None = None,
    turn: float = 0.0,
    clock: bool = False,
    edge: bool = False,
    fitted: bool = True,
    decades: bool = False,
    odds: float | None = None,
    usual: UsualShape | None = None,
    **bounds: float,
) -> Any:
    """A field of an effect.

    Parameters
    ----------
    unit : as printed, ``""`` for none
    meaning : in words
    role : see :data:`Role`
    sensible : the range on real machines, in which a search is made
    grid : the values that a search tries in a recording (:mod:`.grids`); without it as many over ``sensible`` as the
        recording tells apart, or the choices of the type
    turn : of an angle, after which everything is as before, 0 for none; of a phase 360
    clock : whether it is a time of the recording's clock
    edge : whether it is the place where the effect lies or begins; a time of the clock always is
    fitted : whether it is fitted between the values of its grid; a time of a step is not
    decades : whether it is as likely in every decade of its sensible range, however dense its grid is there
    odds : of any value of its grid, over None
    usual : what is usual of it, if anything
    bounds : ``ge``, ``gt``, ``le``, ``lt``, beyond which a value is an error
    """
    turn = 360.0 if not turn and role == "phase" else turn
    extra: dict[str, Any] = {"unit": unit, "role": role, "sensible": sensible}
    extra |= {"grid": grid, "turn": turn, "clock": clock, "edge": edge or clock, "fitted": fitted}
    extra |= {"decades": decades, "odds": odds, "usual": usual}
    described = f"{meaning}, {unit}" if unit else meaning
    return Field(default, description=described, json_schema_extra=extra, **bounds)  # type: ignore[call-overload]


@dataclass(frozen=True)
class Parameter:
    """Description of a parameter, see :func:`parameter`; ``open_low``, ``open_high``: the bound is excluded."""

    name: str
    unit: str
    role: Role
    meaning: str
    low: float
    high: float
    open_low: bool
    open_high: bool
    sensible: tuple[float, float] | None
    required: bool
    default: Any
    choices: tuple[str, ...]
    grid: Grid | None = None
    turn: float = 0.0
    clock: bool = False
    edge: bool = False
    fitted: bool = True
    decades: bool = False
    odds: float | None = None
    usual: UsualShape | None = None


@dataclass(frozen=True)
class EffectPrior:
    """What is usual of an effect before a reading is seen, and why.

    ``odds``: over those of a common kind; ``usual``: median size, in the unit of the linear parameter (``unit`` where
    that is not it); ``most``: the largest standard deviation of a size that is physically possible; ``least``: the
    smallest size that occurs; ``again``: odds of it on another axis where one has it; ``basis``: what the size grows
    with: ``grade`` the repeatability of the machine, ``sag`` length^4 / height^2 of the gauge's bar, ``stylus`` its
    length^3, ``certificate`` the standard uncertainty of the gauge where that is large.
    """

    odds: float
    usual: float
    why: str = ""
    basis: str = ""
    most: float = np.inf
    again: float | None = None
    unit: str = ""
    least: float = 0.0


UNDETERMINED = 0.05
"""Factor on the odds of an effect in a recording that hardly tells it from simpler ones."""
RECORDINGS = ("gauge", "linear", "rotary", "spot", "distances")
"""What a recording is of: a gauge on a machine, one axis with two ends or with turns, one place over time, distances
between stations."""
GAUGE, AXES = ("gauge",), ("gauge", "linear", "rotary")


class Effect(TomlTable):
    """A cause of systematic errors in recordings; a subclass names it (``kind``) and gives its displacement.

    Class variables: ``equation``, one line to read; ``source``, the reference for it; ``covariates``, the columns of
    the recording that the displacement depends on; ``sought``, whether the diagnosis has it among its candidates;
    ``prior``, how common and how large it is, a common kind of a tenth of its sensible range where none is stated;
    ``recordings``, those of :data:`RECORDINGS` that can show it; ``touch``, those in which only what touches has it;
    ``words``, for a person at the machine, and ``axis_words`` at an axis by itself and ``corrected_words``
    of readings that had been corrected for the tip, where those differ;
    ``process``, whether its shape idealises a process, so that a part of its size has other shapes;
    ``several``: whether an axis that is recorded by itself may have it more than once, as every sine.

    The equations broadcast: a column has shape ``(n,)`` or ``(runs, n)``, a parameter is a number or of shape
    ``(runs, 1)``.
    """

    kind: ClassVar[str] = ""
    equation: ClassVar[str] = ""
    source: ClassVar[str] = ""
    covariates: ClassVar[tuple[str, ...]] = ()
    sought: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = None
    recordings: ClassVar[tuple[str, ...]] = RECORDINGS
    touch: ClassVar[tuple[str, ...]] = ()
    process: ClassVar[bool] = False
    several: ClassVar[bool] = False
    words: ClassVar[Wording | None] = None
    axis_words: ClassVar[Wording | None] = None
    corrected_words: ClassVar[Wording | None] = None
    when: str | None = Field(
        None, description="formula that is true where the effect acts, as x_mm > 300; without it everywhere"
    )

    @field_validator("when")
    @classmethod
    def _understood_when(cls, value: str | None) -> str | None:
        if value is not None:
            parse_formula(value)
        return value

    def displacement_um(self, probings: Probings) -> Displacement:
        """Displacement of the recorded coordinates, um, each component of shape ``(n,)``."""
        raise NotImplementedError

    def scatter_um(self, probings: Probings) -> Array | None:
        """Standard deviation that this effect adds to the repeatability (in quadrature), um, shape ``(n,)``."""
        return None

    def expected(self) -> Effect:
        """The effect as far as it can be predicted: without what depends on a phase that no recording contains."""
        return self

    def uncertain_um(self, probings: Probings) -> Array:
        """What comes with the effect by unknown amounts, um: the standard uncertainty of each, ``(p, n)``."""
        return np.zeros((0, len(probings)))

    def latched_um(self, probings: Probings) -> Array | None:
        """Standard deviation of the part that :meth:`expected` leaves out, um, shape ``(n,)``; None for no such part.

        It may be the same in all repeats, or another one in each: that depends on the phase.
        """
        return None

    def unit_of(self, name: str) -> str:
        """The unit of a parameter, with the choices of this effect."""
        return next((p.unit for p in self.parameters() if p.name == name), "")

    def prepared(self, where: str | Path) -> Self:
        """The effect ready for use; ``where`` is its machine file, to find other files that it names."""
        return self

    @property
    def label(self) -> str:
        """The kind with its choices: ``scale_error_x``."""
        chosen = (getattr(self, p.name) for p in self.parameters() if p.role == "choice")
        return "_".join([self.kind, *(value for value in map(_word, chosen) if value)])

    def replace_values(self, **values: float | Array) -> Self:
        """A copy with other parameter values, unchecked; arrays of shape ``(runs, 1)`` give ``(runs, n)``."""
        return self.model_copy(update=values)

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """All parameters in the order of the class, without ``when``, which every effect may have."""
        return _parameters(cls)

    @classmethod
    def words_at(cls, of: str) -> Wording | None:
        """The words for a recording of a ``gauge``, of one ``corrected`` for the tip, or of an ``axis`` by itself."""
        return {"axis": cls.axis_words, "corrected": cls.corrected_words}.get(of) or cls.words

    @classmethod
    def sines(cls) -> tuple[tuple[Parameter, Parameter], ...]:
        """Amplitude and phase of each of the sines whose sum an effect is, the fundamental first; none of any other."""
        linear, phases = ([p for p in cls.parameters() if p.role == role] for role in ("linear", "phase"))
        return tuple(zip(linear, phases, strict=False))

    @classmethod
    def phase(cls) -> Parameter | None:
        """The phase of an effect that is a sine, None for any other."""
        return next((phase for _, phase in cls.sines()), None)

    @classmethod
    def rhythm(cls) -> tuple[str, bool]:
        """Of a sine, the parameter that is its period or frequency, and whether it is a frequency; empty for others."""
        found = [p for p in cls.parameters() if p.role == "nonlinear" and cls.phase() is not None]
        return (found[0].name, found[0].unit == "Hz") if found else ("", False)

    @classmethod
    def free_direction(cls) -> str:
        """Name of the parameter that is any direction of the machine, empty where there is none."""
        return next((name for name, field in cls.model_fields.items() if field.annotation == Axis | Vector), "")

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """Factor on the prior odds by what the recording is like."""
        return 1.0

    @classmethod
    def preference(cls, choices: Mapping[str, Any]) -> float:
        """Prior odds of these choices over others of the same effect."""
        return 1.0

    @classmethod
    def per_turn(cls) -> Mapping[int, float]:
        """Whole periods in a turn of a rotary axis that are causes of their own, and the odds of each over its kind's.

        What closes after a turn has exactly such a period, however few readings tell it.
        """
        return {}

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Whether choices are none that another effect is made for, or other choices of this one."""
        return True

    @classmethod
    def title(cls) -> str:
        """The first sentence of the docstring, before the equation."""
        return inspect.cleandoc(cls.__doc__ or "").split("\n")[0].split(":")[0].rstrip(".")


@cache
def _parameters(effect: type[Effect]) -> tuple[Parameter, ...]:
    return tuple(_describe(name, field) for name, field in effect.model_fields.items() if name != "when")


def _word(value: object) -> str:
    return str(value) if isinstance(value, str | int) else ""


def _describe(name: str, field: FieldInfo) -> Parameter:
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    low, open_low = _bound(field.metadata, Ge, "ge", Gt, "gt", -np.inf)
    high, open_high = _bound(field.metadata, Le, "le", Lt, "lt", np.inf)
    unit = str(extra.get("unit", ""))
    meaning = (field.description or "").removesuffix(f", {unit}") if unit else field.description or ""
    return Parameter(
        name=name,
        unit=unit,
        role=extra.get("role", "fixed"),  # type: ignore[arg-type]
        meaning=meaning,
        low=low,
        high=high,
        open_low=open_low,
        open_high=open_high,
        sensible=extra.get("sensible"),  # type: ignore[arg-type]
        required=field.is_required(),
        default=None if field.default is PydanticUndefined else field.default,
        choices=_choices(field.annotation),
        grid=extra.get("grid"),  # type: ignore[arg-type]
        turn=float(extra.get("turn") or 0.0),  # type: ignore[arg-type]
        clock=bool(extra.get("clock", False)),
        edge=bool(extra.get("edge", False)),
        fitted=bool(extra.get("fitted", True)),
        decades=bool(extra.get("decades", False)),
        odds=extra.get("odds"),  # type: ignore[arg-type]
        usual=extra.get("usual"),  # type: ignore[arg-type]
    )


def _bound(
    metadata: Sequence[Any], closed: type, closed_name: str, opened: type, open_name: str, none: float
) -> tuple[float, bool]:
    for mark in metadata:
        if isinstance(mark, closed):
            return float(getattr(mark, closed_name)), False
        if isinstance(mark, opened):
            return float(getattr(mark, open_name)), True
    return none, False


def _choices(annotation: Any) -> tuple[str, ...]:
    """The words of a ``Literal``, or of all in a union."""
    arguments = get_args(annotation)
    if arguments and all(isinstance(argument, str) for argument in arguments):
        return arguments
    return tuple(word for argument in arguments for word in _choices(argument))


def along(direction: str | Vector, um: Array) -> Displacement:
    """A displacement along a direction, by components."""
    if isinstance(direction, str):
        return {direction: um}
    return {axis: share * um for axis, share in zip("xyz", direction, strict=True) if share}


def whole_numbers(values: Sequence[int]) -> NDArray[np.int64]:
    """Numbers counted from 1 as indices counted from 0."""
    return np.asarray(values, dtype=np.int64) - 1
