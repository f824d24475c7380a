"""Fields of a form from the definition of a verb: a parameter of a verb is a field without a further line."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from stepgauge.verbs.catalogue import find_verb
from stepgauge.verbs.define import REQUIRED, VerbParameter
from stepgauge.verbs.kinds import Count, Flag, Number, OneOf
from stepgauge.web.fields import Field, FieldKind
from stepgauge.web.forms import NO_BOUND


def verb_fields(words: str, leave_out: Collection[str] = (), only: Collection[str] = ()) -> dict[str, Field]:
    """The fields of a verb by its words, ``"plan"``: of its own parameters but files, those of ``only`` where stated.

    The name of a field is that of the option; ``label`` is the parameter, whose unit a text of the page may say.
    """
    own = (one for one in find_verb(words).parameters if one.at_command and not (one.writes or one.kind.is_path))
    asked = (one for one in own if not one.one.is_path and one.name not in leave_out)
    return {one.name: _field(one) for one in asked if not only or one.name in only}


def _field(one: VerbParameter) -> Field:
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
