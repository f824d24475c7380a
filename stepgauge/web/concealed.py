"""A fault that the virtual CMM conceals, chosen by its name and size: what a learner, or a demonstration, looks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, naming
from stepgauge.files.config import read_toml
from stepgauge.web.fields import Field
from stepgauge.web.forms import Form
from stepgauge.web.texts import Words

if TYPE_CHECKING:
    from stepgauge.effects import Effect, Parameter

NEEDS_FILES = ("file", "column", "formula", "coefficients", "rows", "supports_mm")
"""Parameters that a form of a few fields cannot bring."""
ACROSS = ("direction", "rotation_axis")
"""Another axis than that of the travel, where the effect has that, too."""
PREFIX = "fault_"


@dataclass(frozen=True)
class ConcealableFault:
    """A kind of effect, with fields for what must be said of it and a usual value of each."""

    kind: str
    fields: tuple[Field, ...]
    usual: dict[str, str]


def kinds() -> dict[str, type[Effect]]:
    """The kinds that can be chosen by a few numbers."""
    from stepgauge.effects import effect_kinds

    known = effect_kinds(every=True)
    return {
        kind: effect
        for kind, effect in sorted(known.items())
        if not any(one.name in NEEDS_FILES and one.required for one in effect.parameters())
    }


def names(words: Words) -> list[tuple[str, str]]:
    """Kinds with their names, in the order of the names."""
    return sorted(((kind, words.effect(kind)) for kind in kinds()), key=lambda one: one[1].casefold())


def last_fault(folder: Path) -> dict[str, Any]:
    """The fault of the run that began last in a project, as a file has it, or nothing: it is the same machine still."""
    from stepgauge.live.journal import SUFFIX
    from stepgauge.project.create import RECORDINGS

    begun = max((folder / RECORDINGS).glob(f"*{SUFFIX}"), key=lambda one: one.stat().st_mtime, default=None)
    place = None if begun is None else fault_file(Path(str(begun).removesuffix(SUFFIX)))
    if place is None or not place.is_file():
        return {}
    return next(iter(read_toml(place).get("effect", ())), {})


def fault_file(recording: Path) -> Path:
    """The file of the fault of a run, beside its recording."""
    return recording.with_name(f"{recording.name}.fault.toml")


def fault(kind: str, along: str = "x", before: Mapping[str, Any] | None = None) -> ConcealableFault:
    """The form of a kind (:class:`InputError` for what is none).

    ``along``: the axis on which an error shows; ``before``: a fault that is kept if it is of this kind.
    """
    known = kinds()
    if kind not in known:
        raise InputError(naming("fault"), naming("not_a_choice"), found=repr(kind))
    asked = [one for one in known[kind].parameters() if one.required]
    usual = {f"{PREFIX}{one.name}": _choice(one, asked, along) if one.choices else _usual(one) for one in asked}
    if before and before.get("kind") == kind:
        usual |= {name: _written(before[key]) for name in usual if (key := name.removeprefix(PREFIX)) in before}
    return ConcealableFault(kind, tuple(map(_field, asked)), usual)


def _field(one: Parameter) -> Field:
    unit = "" if one.unit == "1" else one.unit
    return Field(
        f"{PREFIX}{one.name}",
        "choice" if one.choices else "number",
        unit,
        one.low,
        one.high,
        required=True,
        choices=one.choices,
        label=one.name,
    )


def _choice(one: Parameter, asked: Sequence[Parameter], along: str) -> str:
    """The axis on which the error shows, or a plane with it; beside an axis of the travel, one across it."""
    across = one.name in ACROSS and any("x" in other.choices for other in asked if other.name not in ACROSS)
    wanted = "yxx"["xyz".index(along)] if across else along
    return next((choice for choice in one.choices if wanted in choice), one.choices[0])


def _written(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _usual(one: Parameter) -> str:
    """A value as real machines have it, in one digit: half of the largest that is sensible."""
    low, high = one.sensible or (1.0, 4.0)
    value = (low * high) ** 0.5 if low > 0.0 else high / 2.0 if high < 1000.0 else 200.0
    return f"{float(f'{value:.1g}'):g}"


def table(form: Form) -> dict[str, Any] | None:
    """The ``[[effect]]`` that a form chose; None for none."""
    if not form.has("fault"):
        return None
    chosen = fault(form.text("fault"))
    values = {one.name.removeprefix(PREFIX): one.read(form) for one in chosen.fields}
    whole = {
        key: int(value) if key in ("face", "block", "order", "placement") else value for key, value in values.items()
    }
    return {"kind": chosen.kind, **whole}


def text(effect: dict[str, Any]) -> str:
    """As a file of faults has it, after its effect has been made once."""
    import tomli_w

    from stepgauge.effects import make_effects

    make_effects([effect], "fault")
    return tomli_w.dumps({"effect": [effect]})
