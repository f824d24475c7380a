"""Fields of a form from a table of a file: each key with its type, unit and bounds, read back as the file has it."""

from __future__ import annotations

import datetime
import types
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from stepgauge.errors import InputError, naming
from stepgauge.files.config import TomlTable
from stepgauge.verbs.catalogue import find_verb
from stepgauge.verbs.define import REQUIRED, VerbParameter
from stepgauge.verbs.kinds import Count, Flag, Number, OneOf
from stepgauge.web.forms import NO_BOUND, Form

FieldKind = Literal["text", "number", "date", "choice", "tick"]
UNITS: Mapping[str, str] = {
    "expansion_per_K": "10⁻⁶/K",
    "expansion_uncertainty_per_K": "10⁻⁶/K",
    "scale_expansion_per_K": "10⁻⁶/K",
    "proportional_um_per_m": "µm/m",
    "drift_um_per_m_per_year": "µm/m",
}
SUFFIXES = (("_mm_s", "mm/s"), ("_mm", "mm"), ("_um", "µm"), ("_C", "°C"), ("_K", "K"), ("_percent", "%"))
PER_MILLION = "10⁻⁶/K"


@dataclass(frozen=True)
class Field:
    """A field: ``name`` is the key of the file, ``factor`` what the value of the file is divided by to be shown.

    ``above``: more than ``least``; ``label``: what it is called, where that is not its name (``name`` may say of which
    table it is); ``default``: what holds where it is empty; ``whole``: a whole number; ``sentence``: what it is;
    ``decides``: a decision (pass, fail) needs it.
    """

    name: str
    kind: FieldKind
    unit: str = ""
    least: float = -1e9
    most: float = 1e9
    above: bool = False
    required: bool = False
    choices: tuple[str, ...] = ()
    factor: float = 1.0
    label: str = ""
    default: str = ""
    whole: bool = False
    sentence: str = ""
    decides: bool = False

    def shown(self, value: Any) -> str:
        """A value of the file as the field has it."""
        if value is None or value == "":
            return ""
        if self.kind == "number":
            return f"{float(value) / self.factor:.12g}"
        return ("1" if value else "") if self.kind == "tick" else str(value)

    def read(self, form: Form) -> Any:
        """What was entered, as the file has it; None for nothing (:class:`InputError` for what it cannot be)."""
        if self.kind == "tick":
            return True if form.has(self.name) else None
        if not form.has(self.name):
            if self.required:
                raise InputError(naming(self.label or self.name), naming("not_filled_in"))
            return None
        if self.kind == "number":
            value = form.number(self.name, self.least / self.factor, self.most / self.factor, above=self.above)
            if self.whole:
                return form.whole(self.name, int(self.least), int(self.most))
            return None if value is None else float(f"{value * self.factor:.12g}")
        return _date(self.name, form.text(self.name)) if self.kind == "date" else self._text(form.text(self.name))

    def _text(self, given: str) -> str:
        if self.choices and given not in self.choices:
            raise InputError(
                naming(self.name), naming("not_a_choice"), found=repr(given), expected=", ".join(self.choices)
            )
        return given


def _date(name: str, given: str) -> datetime.date:
    """``2026-03-02``, as the field of a browser sends it, or ``2.3.2026``."""
    for form in ("%Y-%m-%d", "%d.%m.%Y"):
        try:
            return datetime.datetime.strptime(given, form).date()
        except ValueError:
            continue
    raise InputError(naming(name), naming("not_a_date"), found=repr(given), expected="2026-03-02 or 02.03.2026")


def fields_of(model: type[TomlTable], names: Sequence[str], table: str = "") -> tuple[Field, ...]:
    """Fields for some keys of a table, in this order; ``table``: its name, before that of the key, in a large form."""
    found = (_field(name, model.model_fields[name], False) for name in names)
    return tuple(replace(one, name=f"{table}.{one.name}", label=one.name) if table else one for one in found)


def _field(name: str, info: FieldInfo, required: bool) -> Field:
    types_of = _types(info.annotation)
    choices = tuple(str(one) for kind in types_of if get_origin(kind) is Literal for one in get_args(kind))
    kinds: dict[Any, FieldKind] = {bool: "tick", datetime.date: "date", float: "number"}
    kind: FieldKind = "choice" if choices else next((kinds[one] for one in types_of if one in kinds), "text")
    unit = UNITS.get(name) or next((unit for end, unit in SUFFIXES if name.endswith(end)), "")
    low = [float(str(getattr(one, key))) for one in info.metadata for key in ("ge", "gt") if hasattr(one, key)]
    high = [float(str(getattr(one, key))) for one in info.metadata for key in ("le", "lt") if hasattr(one, key)]
    factor = 1e-6 if unit == PER_MILLION else 1.0
    return Field(
        name,
        kind,
        unit,
        max(low, default=-1e9),
        min(high, default=1e9),
        any(hasattr(one, "gt") for one in info.metadata),
        required or info.is_required(),
        choices,
        factor,
    )


def _types(annotation: Any) -> list[Any]:
    """The types of a key, without None and annotations."""
    origin = get_origin(annotation)
    if origin in (Union, types.UnionType):
        return [inner for one in get_args(annotation) if one is not type(None) for inner in _types(one)]
    return [get_args(annotation)[0]] if hasattr(annotation, "__metadata__") else [annotation]


def read_fields(form: Form, fields: Iterable[Field]) -> dict[str, Any]:
    """The keys that were filled in, as the file has them."""
    values = {one.name: one.read(form) for one in fields}
    return {name: value for name, value in values.items() if value is not None}


def verb_fields(words: str, leave_out: Collection[str] = (), only: Collection[str] = ()) -> dict[str, Field]:
    """The fields of a verb by its words, ``"plan"``: of its own parameters but files, those of ``only`` where stated.

    The name of a field is that of the option; ``label`` is the parameter, whose unit a text of the page may say.
    """
    own = (one for one in find_verb(words).parameters if one.at_command and not (one.writes or one.kind.is_path))
    asked = (one for one in own if not one.one.is_path and one.name not in leave_out)
    return {one.name: _verb_field(one) for one in asked if not only or one.name in only}


def _verb_field(one: VerbParameter) -> Field:
    kind, shown = one.one, ""
    if one.default not in (REQUIRED, None, False, ()):
        shown = f"{one.default:g}" if isinstance(one.default, float) else str(one.default)
    kinds: Mapping[type, FieldKind] = {Flag: "tick", OneOf: "choice", Number: "number", Count: "number"}
    least, most = -NO_BOUND, NO_BOUND
    if isinstance(kind, Number):
        least, most = max(kind.low if kind.above is None else kind.above, -NO_BOUND), min(kind.high, NO_BOUND)
    return Field(
        one.key.replace("-", "_"),
        kinds.get(type(kind), "text"),
        kind.unit.replace("um", "µm").replace("deg C", "°C"),
        least,
        most,
        isinstance(kind, Number) and kind.above is not None,
        one.required,
        tuple(getattr(kind, "words", ())),
        label=one.name,
        default=shown,
        whole=isinstance(kind, Count),
        sentence=one.sentence.replace("``", ""),
    )


def options(fields: Mapping[str, Field], values: Mapping[str, str]) -> list[str]:
    """The words of the command line for what is not as usual; ``values`` by the names of the fields."""
    found: list[str] = []
    for one in fields.values():
        text, name = values.get(one.name, ""), f"--{one.name.replace('_', '-')}"
        if text and text != one.default:
            found += [name] if one.kind == "tick" else [name, text]
    return found


def keywords(fields: Mapping[str, Field], texts: Mapping[str, str]) -> dict[str, Any]:
    """The arguments of the Python function; what is empty is left to its default (:class:`InputError` for no value)."""
    from stepgauge.web.forms import Form

    form = Form({name: text for name, text in texts.items() if text}, {})
    values = {name: one.read(form) for name, one in fields.items()}
    return {name: value for name, value in values.items() if value is not None}
