"""A verb: one function whose signature, kinds of parameters and docstring are its only definition.

Read from it are the click command, the checks of the Python function, the keys of the project file, the fields of the
page and the tables of the documentation.
"""

from __future__ import annotations

import difflib
import inspect
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, wraps
from typing import Any, ParamSpec, TypeVar

from stepgauge.errors import python_text, without_unit
from stepgauge.verbs.kind import ARGUMENT, Kind
from stepgauge.verbs.kinds import Reads, Repeated, Supplied, Writes

P = ParamSpec("P")
T = TypeVar("T")
SHORT = {"output": "o", "dialect": "d", "jobs": "j", "coverage_factor": "k"}
"""Parameters with a short name of their own, besides those of files."""
REQUIRED = inspect.Parameter.empty
_HEAD = re.compile(r"^(Parameters|Returns|Raises|Examples)\n-+$", re.M)


@dataclass(frozen=True, init=False)
class Of:
    """Marks ``**parameters``: those of these names that another verb defines."""

    function: Callable[..., Any]
    names: tuple[str, ...]

    def __init__(self, function: Callable[..., Any], *names: str) -> None:
        object.__setattr__(self, "function", function)
        object.__setattr__(self, "names", names)


@dataclass(frozen=True)
class VerbParameter:
    """One parameter of a verb: ``sentence`` says what it is, ``default`` is :data:`REQUIRED` where there is none.

    ``writes``: it says what is written of the result, and is none of the Python function's. ``borrowed``: another verb
    defines it, and it is passed on where it was given.
    """

    name: str
    kind: Kind
    default: Any
    sentence: str
    argument: bool = False
    writes: bool = False
    borrowed: bool = False

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        return self.default is REQUIRED and not getattr(self.kind, "optional", False)

    @property
    def repeated(self) -> bool:
        """Whether it takes several."""
        return isinstance(self.kind, Repeated)

    @property
    def one(self) -> Kind:
        """The kind of a single value."""
        return self.kind.kind if isinstance(self.kind, Repeated) else self.kind

    @property
    def key(self) -> str:
        """Its name at the command line and in the project file: without the unit."""
        return without_unit(getattr(self.kind, "option", "") or self.name)

    @property
    def short(self) -> str:
        """The letter that stands for it at the command line; empty where there is none."""
        return self.one.short if isinstance(self.one, Reads | Writes) else SHORT.get(self.name, "")

    @property
    def at_command(self) -> bool:
        """Whether the command line has it."""
        return not isinstance(self.kind, Supplied)

    @property
    def field(self) -> dict[str, Any]:
        """What a form needs to ask for it."""
        words = list(getattr(self.one, "words", ()))
        known = {"name": self.name, "kind": self.one.name, "unit": self.one.unit, "bounds": self.one.bounds()}
        default = None if self.required else self.default
        return {**known, "choices": words, "default": default, "required": self.required, "sentence": self.sentence}

    @property
    def facts(self) -> list[str]:
        """Bounds with unit and default, as help and documentation show them."""
        shown = [self.one.bounds() or self.one.unit] if not hasattr(self.one, "words") else []
        if self.default not in (REQUIRED, None, False, (), ""):
            shown.append(f"default: {self.default}")
        return [one for one in shown if one]


class Verb:
    """What is known of a verb, from its function and from that which writes its result."""

    def __init__(
        self,
        function: Callable[..., Any],
        writer: Callable[..., Any] | None,
        leaves: Callable[..., Iterable[str]] | None,
        says: Callable[[Any], str] | None,
        in_project: bool,
        shows: bool,
        partly: bool,
    ) -> None:
        self.function, self.writer, self.leaves, self.says = function, writer, leaves, says
        self.in_project, self.shows, self.partly = in_project, shows, partly

    @cached_property
    def parameters(self) -> tuple[VerbParameter, ...]:
        """Those of the function, then those of what is written."""
        own = _parameters(self.function, writes=False)
        if self.writer is None:
            return own
        return (*own, *_parameters(self.writer, writes=True)[1:])

    @property
    def sentence(self) -> str:
        """What it does, in a line."""
        return (self.function.__doc__ or "").partition("\n")[0].rstrip(".")

    @cached_property
    def paragraphs(self) -> list[str]:
        """The explanation, and examples, as they stand in the docstring."""
        sections = _sections(self.function)
        found = [*sections[""].split("\n\n")]
        return [*found, *sections.get("Examples", "").split("\n\n")] if sections.get("Examples") else found

    @property
    def examples(self) -> str:
        """Commands as they are typed."""
        return _sections(self.function).get("Examples", "")

    def taken(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """What Python gives, as the verb wants it; :class:`InputError` for the first value that is none of its kind."""
        found = dict(given)
        for one in self.parameters:
            value = given.get(one.name)
            stated = one.name in given and (one.required if value is None else value is not one.default)
            if stated:
                found[one.name] = one.kind.taken(one.name, given[one.name])
        return found


def verb(
    writer: Callable[..., Any] | None = None,
    *,
    leaves: Callable[..., Iterable[str]] | None = None,
    says: Callable[[Any], str] | None = None,
    in_project: bool = True,
    shows: bool = False,
    partly: bool = False,
) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator: a function becomes a verb, whose parameters are checked by their kinds when Python calls it.

    ``writer`` takes the result and what its own parameters say, writes, and returns the paths. ``leaves`` gives the
    names of the parameters that a call has no use for, from its values and the names of those that were typed: of them
    the project file is not asked. ``says`` gives the lines at the screen, by default those of the result's ``summary``.
    ``in_project``: the project file may state its parameters. ``shows``: the lines were asked for, and go to stdout.
    ``partly``: the ``left_out`` of the result says what could not be done, a line each.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        """The function, with its checks."""
        known = Verb(function, writer, leaves, says, in_project, shows, partly)
        signature = inspect.signature(function)
        readable = _readable(signature)

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> T:
            """The checks, then the work."""
            try:
                readable.bind(*args, **kwargs)  # which names what the function takes by **, too
            except TypeError as error:
                raise TypeError(_unbound(known, error, readable.parameters, kwargs)) from None
            bound = signature.bind(*args, **kwargs)
            for one in signature.parameters.values():
                if one.kind is inspect.Parameter.VAR_KEYWORD:
                    bound.arguments[one.name] = known.taken(bound.arguments.get(one.name, {}))
            bound.arguments.update(known.taken(bound.arguments))
            return function(*bound.args, **bound.kwargs)

        call.verb = known  # type: ignore[attr-defined]
        call.__signature__ = readable  # type: ignore[attr-defined]
        return call

    return decorate


@dataclass(frozen=True)
class _Plain:
    """A type as ``help()`` shows it."""

    text: str

    def __repr__(self) -> str:
        return self.text


def _readable(signature: inspect.Signature) -> inspect.Signature:
    """The signature for a person: types without what the command line makes of them, borrowed parameters by name."""
    known = list[inspect.Parameter]()
    for one in signature.parameters.values():
        of = next((mark for mark in getattr(one.annotation, "__metadata__", ()) if isinstance(mark, Of)), None)
        others = inspect.signature(of.function).parameters if of else {}
        known += [others[name].replace(kind=inspect.Parameter.KEYWORD_ONLY) for name in of.names] if of else [one]
    plain = [one.replace(annotation=_plain(one.annotation)) for one in known]
    return signature.replace(parameters=plain, return_annotation=_plain(signature.return_annotation))


def _plain(annotation: Any) -> Any:
    if annotation is inspect.Parameter.empty:
        return annotation
    kind = getattr(annotation, "__origin__", annotation) if hasattr(annotation, "__metadata__") else annotation
    text = inspect.formatannotation(kind)
    return _Plain(re.sub(r"ForwardRef\('([^']*)'\)|'([^']*)'|\b(?:[a-z_]\w*\.)+(?=[A-Z])", r"\1\2", text))


def _unbound(verb: Verb, error: TypeError, known: Mapping[str, Any], given: Mapping[str, Any]) -> str:
    """What Python says of a call that does not fit, with the function's name, and a name that was probably meant.

    What is not known comes first, for it may be what is missing, misspelt or as the command line calls it.
    """
    name, unknown = verb.function.__name__, [one for one in given if one not in known]
    if not unknown:
        return f"{name}() {error}"
    free = {one: one for one in known if one not in given}
    free |= {one.key.replace("-", "_"): one.name for one in verb.parameters if one.name in free}
    near = difflib.get_close_matches(unknown[0], free, 1)
    meant = f"; did you mean {free[near[0]]!r}?" if near else f"; it takes {', '.join(known)}"
    return f"{name}() got an unexpected keyword argument {unknown[0]!r}{meant}"


def verb_of(function: Callable[..., Any]) -> Verb:
    """The definition that a function carries."""
    known: Verb = function.verb  # type: ignore[attr-defined]
    return known


def document(function: Callable[..., Any]) -> None:
    """Complete the docstring of a verb for Python: parameters that verbs share, and calls in place of commands."""
    from stepgauge.verbs.catalogue import python_examples

    known, parts = verb_of(function), _sections(function)
    lines = [f"{one.name} : {one.sentence}" for one in known.parameters if not one.writes]
    parts["Parameters"] = "\n".join(textwrap.fill(line, 116, subsequent_indent="    ") for line in lines)
    if "Examples" in parts:
        parts["Examples"] = python_examples(parts["Examples"])
    order = ["", "Parameters", *(name for name in parts if name not in ("", "Parameters"))]
    sections = (f"{name}\n{'-' * len(name)}\n{parts[name]}".strip() for name in order)
    function.__doc__ = python_text("\n\n".join(sections))


def _parameters(function: Callable[..., Any], writes: bool) -> tuple[VerbParameter, ...]:
    stated = _sentences(_sections(function).get("Parameters", ""))
    found = []
    for one in inspect.signature(function).parameters.values():
        marks = getattr(one.annotation, "__metadata__", ())
        of = next((mark for mark in marks if isinstance(mark, Of)), None)
        if of is not None:
            known: Verb | None = getattr(of.function, "verb", None)  # whose function shows types for people by now
            defined = _parameters(of.function, writes=False) if known is None else known.parameters
            others = {other.name: other for other in defined}
            found += [replace(others[name], argument=False, writes=writes, borrowed=True) for name in of.names]
            continue
        kind = next((mark for mark in marks if isinstance(mark, Kind)), Kind())
        shared = next((mark for mark in marks if isinstance(mark, str) and mark != ARGUMENT), "")
        sentence = stated.get(one.name, shared)
        found.append(VerbParameter(one.name, kind, one.default, sentence, ARGUMENT in marks, writes))
    return tuple(found)


def _sections(function: Callable[..., Any]) -> dict[str, str]:
    """Parts of the docstring by their headings; the first has none."""
    parts = _HEAD.split(inspect.cleandoc(function.__doc__ or ""))
    return {"": parts[0].strip(), **{parts[i]: parts[i + 1].strip() for i in range(1, len(parts), 2)}}


def _sentences(text: str) -> dict[str, str]:
    """What stands for each name, on one line."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in text.splitlines():
        head, colon, rest = line.partition(" : ")
        if colon and not line.startswith(" "):
            names = [name.strip() for name in head.split(",")]
            found.update(dict.fromkeys(names, rest.strip()))
        else:
            found.update({name: f"{found[name]} {line.strip()}" for name in names})
    return found


def reads(parameters: Iterable[VerbParameter]) -> list[VerbParameter]:
    """Those that name files to read."""
    return [one for one in parameters if isinstance(one.one, Reads)]


def writes(parameters: Iterable[VerbParameter]) -> list[VerbParameter]:
    """Those that name files to write."""
    return [one for one in parameters if isinstance(one.one, Writes)]
