"""Effects from a file that somebody names: imported from its path, checked, and known from then on.

Nothing is imported that was not named: a module beside the files of a job is none of the vocabulary.
"""

from __future__ import annotations

import hashlib
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import numpy as np

from stepgauge.effects.base import RECORDINGS, Effect, Parameter, Role
from stepgauge.effects.probings import Probings, Setting
from stepgauge.errors import InputError

FROM_FILES = "stepgauge_effects_of_file_"
"""What the names of modules that were read from files begin with."""
_PREPARED: dict[Path, Callable[[], object]] = {}
ROWS = 12
"""Rows on which an effect is tried."""
_LOADED: dict[Path, tuple[type[Effect], ...]] = {}


def is_loaded(effect: type[Effect]) -> bool:
    """Whether an effect of a file is among those that are known now."""
    return any(effect in own for own in _LOADED.values())


def load_effects(path: str | Path) -> tuple[type[Effect], ...]:
    """The effects of a Python file, which a machine file may contain from then on and a diagnosis may name.

    Raises
    ------
    InputError
        no such file; a file that is no Python or fails; without an effect; an effect that lacks something, or whose
        kind exists
    """
    place = Path(path).resolve()
    if place not in _LOADED:
        known = _kinds()
        found = tuple(
            one
            for one in vars(_imported(path, place)).values()
            if isinstance(one, type) and issubclass(one, Effect) and one.__module__.startswith(FROM_FILES) and one.kind
        )
        if not found:
            raise InputError(path, "no effect in this file", expected="a class of stepgauge.effects.Effect with a kind")
        for effect in found:
            _check(effect, path, known)
        _LOADED[place] = found
        _PREPARED[place] = partial(load_effects, str(place))
        _preparing().append(_PREPARED[place])
    return _LOADED[place]


@contextmanager
def added_effects(paths: Sequence[str | Path]) -> Iterator[None]:
    """The effects of some files for as long as this lasts."""
    before = dict(_LOADED)
    try:
        for path in paths:
            load_effects(path)
        yield
    finally:
        for place in set(_LOADED) - set(before):
            _preparing().remove(_PREPARED.pop(place))
            del _LOADED[place]


def _preparing() -> list[Callable[[], object]]:
    """What processes do before their first task: they load the same files."""
    from stepgauge.executors.processes import PREPARING

    return PREPARING


def _kinds() -> set[str]:
    from stepgauge.effects import effect_kinds

    return set(effect_kinds(every=True))


def _imported(path: str | Path, place: Path) -> ModuleType:
    if not place.is_file():
        raise InputError(path, "no such file of effects")
    name = FROM_FILES + hashlib.sha256(str(place).encode()).hexdigest()[:12]
    spec = spec_from_file_location(name, place)
    if spec is None or spec.loader is None:
        raise InputError(path, "not a Python file", expected="NAME.py")
    module = module_from_spec(spec)
    sys.modules[name] = module  # where annotations are looked up
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise InputError(path, f"the file of effects fails{_line(error, place)}", found=_words(error)) from None
    return module


def _line(error: Exception, place: Path) -> str:
    """Where in the file an error is."""
    if isinstance(error, SyntaxError):
        return f" in line {error.lineno}"
    own = [one.lineno for one in traceback.extract_tb(error.__traceback__) if Path(one.filename) == place]
    return f" in line {own[-1]}" if own else ""


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]


def _check(effect: type[Effect], path: str | Path, known: set[str]) -> None:
    """:class:`InputError` for an effect of which something is missing, with what to add."""
    where = f"effect {effect.kind!r}"
    if effect.kind in known:
        raise InputError(path, f"{where}: this kind exists already", expected="another name")
    for name in ("equation", "source", "covariates"):
        if not getattr(effect, name):
            raise InputError(path, f"{where} has no {name}", expected=f"{name}: ClassVar[..] = ..")
    strange = [one for one in effect.recordings if one not in RECORDINGS]
    if strange:
        raise InputError(path, f"{where}: recordings", found=strange, expected=", ".join(RECORDINGS))
    if effect.displacement_um is Effect.displacement_um:
        raise InputError(path, f"{where} has no displacement_um(self, probings)")
    parameters = effect.parameters()
    for p in parameters:
        _check_parameter(p, f"{where}, parameter {p.name!r}", path)
    sines = [p.name for p in parameters if p.role == "phase"]
    linear = [p.name for p in parameters if p.role == "linear"]
    if sines and len(linear) != len(sines):
        raise InputError(path, f"{where}: a phase needs one linear amplitude", found=[*sines, *linear])
    _try(effect, where, path)


def _check_parameter(p: Parameter, where: str, path: str | Path) -> None:
    if p.role not in get_args(Role):
        raise InputError(path, f"{where}: role", found=p.role, expected=", ".join(get_args(Role)))
    if p.role == "nonlinear" and p.grid is None and p.sensible is None and p.usual is None:
        raise InputError(
            path, f"{where} is searched", expected="sensible=(low, high), or a grid (stepgauge.effects.grids)"
        )
    if p.sensible is not None and not (np.isfinite(p.sensible).all() and p.sensible[0] < p.sensible[1]):
        raise InputError(path, f"{where}: sensible", found=p.sensible, expected="the lower and the upper end")
    if p.role == "choice" and not p.choices and p.grid is None and p.required:
        raise InputError(path, f"{where} has no choices", expected="a Literal type, Axis, or a grid")


def _try(effect: type[Effect], where: str, path: str | Path) -> None:
    """:class:`InputError` for an effect that cannot be computed for some rows with the usual columns.

    One that needs another column is not tried.
    """
    values = {p.name: _typical(p) for p in effect.parameters()}
    if "" in values.values():
        return
    rows = np.arange(float(ROWS))
    columns = dict.fromkeys(("x_mm", "y_mm", "z_mm", "time_s"), rows * 30.0) | {"face": rows.astype(int) % 2 + 1}
    columns |= {"approach_i": 1.0 - 2.0 * (rows % 2), "approach_j": 0.0 * rows, "approach_k": 0.0 * rows}
    columns |= {
        "speed_mm_s": 3.0 + 0.0 * rows,
        "placement": 1 + 0 * rows.astype(int),
        "cycle": 1 + rows.astype(int) // 6,
    }
    probings = Probings(columns, Setting(np.array([[0.0, 400.0]] * 3)))
    try:
        with np.errstate(all="ignore"):
            found = effect.model_construct(**values).displacement_um(probings)
            strange = sorted(set(found) - {"x", "y", "z", "approach"})
            um = [np.broadcast_to(one, (ROWS,)) for one in found.values()]
    except InputError:
        return
    except Exception as error:
        place = Path(path).resolve()
        raise InputError(path, f"{where} fails on a trial{_line(error, place)}", found=_words(error)) from None
    if strange:
        raise InputError(path, f"{where}: displacement_um", found=strange, expected="x, y, z or approach")
    if not all(np.isfinite(one).all() for one in um):
        raise InputError(path, f"{where}: displacement_um is no number", found=values)


def _typical(p: Parameter) -> Any:
    """A value of a parameter: a choice, the middle of its sensible range, its default; empty where there is none."""
    if p.choices:
        return p.choices[0]
    if p.sensible is not None:
        low, high = p.sensible
        return float(np.sqrt(low * high)) if low > 0.0 else low + 0.4 * (high - low)
    return "" if p.required else p.default
