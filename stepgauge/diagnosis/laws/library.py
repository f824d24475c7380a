"""All named effects that a recording can show, as signatures along the approach.

An effect with a direction is a family for every machine axis along which a motion shows, and one with a free direction
between them: its components are linear parameters.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.laws.grids import choices_of, shapes_of
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, along_approach_um, effect_kinds
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.chunks import chunks
from stepgauge.inference.problem import AmplitudePrior
from stepgauge.recording import APPROACH

NOT_LAWS = {"axis_compensation", "empirical", "error_map", "outliers", "noise_growth"}
"""Kinds that are not laws of the mean with own parameters: fitted elsewhere or not at all."""
SEEN_SHARE = 0.1
"""Least component along some gauge axis of a direction in which motion is searched."""
NOTHING = 1e-9
"""Share of the largest from which a signature, or the power of a motion in another direction, is not zero."""
NEAR_AXIS = np.cos(np.radians(5.0))
PLACE = "place"
"""What laws of an axis by itself depend on."""
ORIGIN_ONLY = 3e-3
"""Share of a signature that must remain beside the origins; below it the signature is an origin."""


@lru_cache(maxsize=8)
def whole(count: int) -> Array:
    """Shares of what shows on all rows alike ``(1, n)``: one array for all laws, so that they are worked on at once."""
    return np.ones((1, count))


@dataclass(frozen=True)
class Family:
    """One law with its choices made (axis, face, ...) and its signatures.

    ``law``: the effect class. ``atoms``: the non-linear parameters of each signature; ``pattern (atoms,
    depth, n)``: displacement in um for a unit of each of its linear parameters, along the approach or where ``shares
    (k, n)`` are given to be multiplied by each of these: families that differ only in the shares hold the same pattern.
    ``directions (k, 3)``: unit vectors whose components make the direction
    of motion, where that is free. ``prior``: standard deviation of what is expected of its sizes, infinite for none;
    ``sizes``: the mixture of which it is one, None for none.
    ``taken``: non-linear parameters that the recording does not determine; they are taken to be what is usual.
    ``within``: the ranges of the family of which these are some shapes, None for the ranges of its own.
    ``alone``: odds over those of its kind of one that is a cause by itself, None for one that shares them.
    ``about``: median and logarithmic standard deviation of shapes with a log-normal prior; ``log_weight (atoms,)``:
    logarithms of the prior of the shapes.
    """

    law: type[Effect]
    label: str
    choices: dict[str, Any]
    atoms: Sequence[dict[str, Any]]
    pattern: Array
    covariate: str = ""
    directions: Array | None = None
    prior: float = np.inf
    sizes: AmplitudePrior | None = None
    shares: Array | None = None
    taken: frozenset[str] = frozenset()
    within: dict[str, tuple[float, float]] | None = None
    alone: float | None = None
    about: dict[str, tuple[float, float]] = field(default_factory=dict)
    log_weight: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def kind(self) -> str:
        """Its name in the vocabulary."""
        return self.law.kind

    @property
    def positive(self) -> bool:
        """Whether its size cannot be negative; that of a wave only turns its phase.

        Nor can that of a law without one, whose shapes have their sizes already: a longer lever is no shorter one
        turned round.
        """
        bounds = [p.low for p in self.law.parameters() if p.role == "linear"]
        return self.kind == "misalignment" or (self.law.phase() is None and min(bounds, default=0.0) >= 0.0)

    @cached_property
    def dimension(self) -> int:
        """Number ``d`` of linear parameters."""
        return int(self.pattern.shape[1]) * len(self.share_rows)

    @property
    def share_rows(self) -> Array:
        """The shares, ones where none are given."""
        return whole(self.pattern.shape[2]) if self.shares is None else self.shares

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and largest value on the grid of every non-linear parameter that is one number and no angle."""
        if self.within is not None:
            return self.within
        names = [name for name, value in self.atoms[-1].items() if isinstance(value, float | int)]
        # an angle goes on beyond a turn, what is usual is no bound
        turning = {p.name for p in self.law.parameters() if p.turn}
        names = [name for name in names if name not in turning and name not in self.about]
        values = {name: [atom[name] for atom in self.atoms if atom[name] is not None] for name in names}
        return {name: (float(min(tried)), float(max(tried))) for name, tried in values.items()}

    def log_prior(self, shape: Mapping[str, Any]) -> float:
        """Logarithm of the prior density of a shape of which something is usual, up to a constant."""
        far = [np.log(shape[name] / median) / spread for name, (median, spread) in self.about.items()]
        return -0.5 * float(np.square(far).sum())

    def signature(self, atom: int) -> Array:
        """One of the signatures, shape ``(d, n)``."""
        return np.concatenate([self.pattern[atom] * share for share in self.share_rows])


def effect_families(data: Residuals, priors: Priors, without: Collection[str] = ()) -> Iterator[Family]:
    """Families of all named effects whose signature can be computed from this recording and is not zero.

    Kinds in ``without`` are no candidates, nor are those that are not of such recordings.
    """
    directions, of = _shown(data), data.probings.setting.recording
    for kind, law in sorted(effect_kinds().items()):
        if kind in NOT_LAWS or kind in without or of not in law.recordings:
            continue
        for choices in choices_of(law, data):
            try:
                atoms, weight = shapes_of(
                    law, choices, data, partial(signatures, law, choices, data=data), priors.laws.leads
                )
                if not atoms or not _is_shown(law, choices, atoms[0], data):
                    continue
                columns = signatures(law, choices, atoms, data)
            except (InputError, ValueError):
                continue  # impossible choices (travel and direction the same), or a column this recording lacks
            where, taken = covariate_of(law, data), _taken(atoms)
            family = Family(law, law.kind, choices, atoms, columns, where, taken=taken, log_weight=weight)
            if law.free_direction():
                yield from _directed(family, directions, data)
                continue
            size = _sizes(columns, [np.ones((1, len(data)))])[0]
            if len(data.radii) and not _differs(columns, data):
                continue
            left = columns if law.phase() else _remove_origins(columns, data)
            yield from _shown_shapes(replace(family, pattern=left), size)


def _is_shown(law: type[Effect], choices: dict[str, Any], atom: dict[str, Any], data: Residuals) -> bool:
    """Whether a motion along one machine axis shows along some gauge, and two axes that lean along one and the same.

    Where it does not, a step of some millimetres along that axis would stand for one of some micrometres along the
    gauge, and how the gauges happen to lie for an axis that leans.
    """
    reach, plane = np.abs(list(data.probings.setting.axis.values())), ["xyz".index(a) for a in choices.get("plane", "")]
    if plane and reach[:, plane].min(axis=1).max() <= SEEN_SHARE:
        return False
    reached = reached_axes(data)
    linear = [p.name for p in law.parameters() if p.role == "linear"]
    moved = _made(law, fixed_values(law) | choices | atom | dict.fromkeys(linear, 1.0)).displacement_um(data.probings)
    if len(moved) != 1 or not set(moved) <= set("xyz"):
        return True
    return next(iter(moved)) in reached


def reached_axes(data: Residuals) -> list[str]:
    """The machine axes along which some gauge reaches."""
    reach = np.abs(list(data.probings.setting.axis.values())).max(axis=0)
    return [axis for axis, far in zip("xyz", reach, strict=True) if far > SEEN_SHARE]


def _differs(columns: Array, data: Residuals) -> bool:
    """Whether any shape of a law is more than origins and radii that are not known: no reading tells of others."""
    left = data.without_origins(columns)
    return bool((np.linalg.norm(left, axis=2) > ORIGIN_ONLY * np.linalg.norm(columns, axis=2)).any())


def _remove_origins(columns: Array, data: Residuals) -> Array:
    """Signatures ``(atoms, d, n)`` without their part in the origins of the placements.

    The shape of a law may be mostly a constant, such as a parabola over the travel near its middle: the rest is still
    the law. A law that is only a constant would leave rounding, so it is not changed. Oscillations are not changed
    either: with the period of the pitch of the gauge they could fit anything with a very large amplitude.
    """
    left = data.without_origins(columns)
    size, whole = (np.linalg.norm(one, axis=2, keepdims=True) for one in (left, columns))
    return np.where(size > ORIGIN_ONLY * whole, left, columns)


def visible_directions(axes: Array) -> Iterator[str | tuple[float, ...] | Array]:
    """Directions in which placements with gauge axes ``(m, 3)`` show a motion.

    If all placements are on one line, only a motion along it shows: the name of a machine axis if the line is near one,
    else the line. Otherwise the machine axes that show, and then unit vectors ``(k, 3)`` that span all that shows.
    """
    _, size, span = np.linalg.svd(axes, full_matrices=False)
    span = span[size > SEEN_SHARE]
    if len(span) == 1:
        line = axes[0] * np.sign(axes[0][np.abs(axes[0]).argmax()])
        nearest = int(np.abs(line).argmax())
        yield "xyz"[nearest] if line[nearest] > NEAR_AXIS else tuple(float(share) for share in line)
        return
    yield from (axis for i, axis in enumerate("xyz") if np.abs(axes[:, i]).max() > SEEN_SHARE)
    yield span


Direction = str | tuple[float, ...] | Array
"""A machine axis, a unit vector, or the unit vectors ``(k, 3)`` between which a direction is free."""


def _shown(data: Residuals) -> list[tuple[Direction, Array]]:
    """The directions in which a motion shows, and the shares ``(k, n)`` of each in the approaches."""
    approach = data.frame[APPROACH].to_numpy(float)
    directions = list(visible_directions(np.array(list(data.probings.setting.axis.values()))))
    units = [np.eye(3)["xyz".index(one)] if isinstance(one, str) else np.array(one) for one in directions]
    return [(one, np.atleast_2d(unit) @ approach.T) for one, unit in zip(directions, units, strict=True)]


def covariate_of(law: type[Effect], data: Residuals) -> str:
    """What a law depends on; of an axis by itself a place, whose functions contain it, and so do levels of targets.

    A function of the distance has a mean, too, which is a constant of a distance meter.
    """
    recording, first = data.probings.setting.recording, law.covariates[0]
    of_distance = recording == "distances" and first == "side"
    return PLACE if recording != "gauge" and (first == "coordinate" or of_distance) else first


def _directed(family: Family, directions: Sequence[tuple[Direction, Array]], data: Residuals) -> Iterator[Family]:
    """One family for every direction, from the signatures of a motion along each approach."""
    sizes, free = _sizes(family.pattern, [shares for _, shares in directions]), family.law.free_direction()
    for (direction, shares), size in zip(directions, sizes, strict=True):
        if isinstance(direction, np.ndarray):
            rest = {name: value for name, value in family.choices.items() if name != free}
            own = replace(family, choices=rest, shares=shares, directions=direction)
            size = size * _tells_direction(family.pattern, shares, data)
        else:
            own = replace(family, choices=family.choices | {free: direction}, shares=shares)
        yield from _shown_shapes(own, size)


def _tells_direction(pattern: Array, shares: Array, data: Residuals) -> NDArray[np.bool_]:
    """Which shapes show every component ``(k, n)`` of a free direction beside the origins.

    One that shows in one placement, as a step within it does, is a motion along its line, whatever the direction.
    """
    told = []
    for some in chunks(len(pattern), len(shares) * pattern[0].size):
        left = np.array([data.without_origins(pattern[some] * share) for share in shares])
        value = np.linalg.eigvalsh(np.einsum("iadn,jadn->aij", left, left))
        told.append(value[:, 0] > NOTHING * value[:, -1])
    return np.concatenate(told)


def _sizes(pattern: Array, shares: Sequence[Array]) -> list[Array]:
    """Rms of the largest signature of every atom, um, shape ``(atoms,)``, for each of some shares."""
    power = np.concatenate(shares).T ** 2
    squares = np.concatenate([pattern[some] ** 2 @ power for some in chunks(len(pattern), pattern[0].size)])
    cuts = np.cumsum([len(one) for one in shares])[:-1]
    return [np.sqrt(part.max(axis=(1, 2)) / len(power)) for part in np.split(squares, cuts, axis=2)]


def _shown_shapes(family: Family, size: Array) -> Iterator[Family]:
    """The family with those of its signatures that are not zero, if there are any; ``size (atoms,)``: of each."""
    seen, law = size > NOTHING * max(float(size.max()), 1e-300), family.law
    if not seen.any() or size.max() == 0.0:
        return
    label = law.kind
    if family.directions is None:
        label = law.model_construct(**(fixed_values(law) | family.choices | family.atoms[0])).label
    kept = [atom for atom, keep in zip(family.atoms, seen, strict=True) if keep]
    pattern = family.pattern if seen.all() else family.pattern[seen]
    yield replace(family, label=label, atoms=kept, pattern=pattern, log_weight=family.log_weight[seen])


def _taken(atoms: Sequence[dict[str, Any]]) -> frozenset[str]:
    """Parameters of which one value alone was tried where others were varied."""
    if len(atoms) < 2:
        return frozenset()
    return frozenset(name for name, value in atoms[0].items() if all(atom[name] == value for atom in atoms))


def fixed_values(law: type[Effect]) -> dict[str, Any]:
    """Defaults of the fixed parameters; a length that only rescales is one metre."""
    values: dict[str, Any] = {}
    for p in law.parameters():
        if p.role == "fixed":
            values[p.name] = 1000.0 if p.required else p.default
    return values


def signatures(law: type[Effect], choices: dict[str, Any], atoms: Sequence[dict[str, Any]], data: Residuals) -> Array:
    """Displacement along the approach for a unit of each linear parameter, um, shape ``(atoms, d, n)``.

    Waves of many periods are in single precision, as all grids: half of what a recording needs are these.
    """
    unset = [tuple(name for name, value in atom.items() if value is None) for atom in atoms]
    if len(set(unset)) > 1:
        return _apart(law, choices, atoms, unset, data)
    if len(atoms) < 2 or any(not isinstance(value, float | int | tuple) for atom in atoms for value in atom.values()):
        return np.concatenate([np.stack(_columns(law, choices, atom, data, 1), axis=1) for atom in atoms])
    depth, precision = (2 * len(law.sines()), np.float32) if law.sines() else (1, np.float64)
    found = np.empty((len(atoms), depth, len(data)), precision)
    for some in chunks(len(atoms), len(data)):
        together = {name: _stacked([atom[name] for atom in atoms[some]]) for name in atoms[0]}
        for place, column in enumerate(_columns(law, choices, together, data, len(atoms[some]))):
            found[some, place] = column
    return found


def _stacked(values: Sequence[float | tuple[float, ...]]) -> Array | tuple[Array, ...]:
    """Values of one parameter as a column ``(atoms, 1)``; of several numbers, as of two supports, a column for each."""
    if isinstance(values[0], tuple):
        return tuple(np.array(part, float)[:, None] for part in zip(*values, strict=True))
    return np.array(values, float)[:, None]


def _apart(
    law: type[Effect],
    choices: dict[str, Any],
    atoms: Sequence[dict[str, Any]],
    unset: Sequence[tuple[str, ...]],
    data: Residuals,
) -> Array:
    """Signatures of those with the same parameters unset together, in the order of the atoms."""
    rows, parts = [], []
    for names in dict.fromkeys(unset):
        own = [row for row, other in enumerate(unset) if other == names]
        rows += own
        parts.append(signatures(law, choices, [stated(atoms[row]) for row in own], data))
    return np.asarray(np.concatenate(parts)[np.argsort(rows)])


def family_signatures(family: Family, atom: dict[str, Any], data: Residuals) -> Array:
    """One signature of a family in another recording, shape ``(d, n)``."""
    name = family.law.free_direction()
    free = [{}] if family.directions is None else [{name: tuple(unit)} for unit in family.directions]
    return np.concatenate([signatures(family.law, family.choices | one, [atom], data)[0] for one in free])


def carried(family: Family, effect: Effect, data: Residuals) -> Family:
    """A family in another recording, with the one signature that a fitted effect of it has."""
    atom = {name: getattr(effect, name) for name in family.atoms[0]}
    return replace(family, atoms=[atom], pattern=family_signatures(family, atom, data)[None], shares=None)


def _columns(
    law: type[Effect], choices: dict[str, Any], atom: dict[str, Any], data: Residuals, count: int
) -> list[Array]:
    """One array ``(count, n)`` per linear parameter; a sine of any amplitude and phase is a sum of two."""
    linear = [p.name for p in law.parameters() if p.role == "linear"]
    values = fixed_values(law) | choices | atom | dict.fromkeys(linear, 1.0)
    if not law.sines():
        return [_column(law, values, data, count)]
    silent = values | dict.fromkeys(linear, 0.0)
    return [
        _column(law, silent | {amplitude.name: 1.0, phase.name: at}, data, count)
        for amplitude, phase in law.sines()
        for at in (0.0, phase.turn / 4.0)
    ]


def _column(law: type[Effect], values: dict[str, Any], data: Residuals, count: int) -> Array:
    with np.errstate(all="ignore"):
        um = np.broadcast_to(along_approach_um(_made(law, values), data.probings), (count, len(data))).astype(float)
    return np.where(np.isfinite(um).all(axis=1, keepdims=True), um, 0.0)


def _made(law: type[Effect], values: dict[str, Any]) -> Effect:
    known = stated(values)
    # one that has a rule between its choices must be built with validation
    return law.model_validate(known) if law.kind == "straightness" else law.model_construct(**known)


def stated(values: dict[str, Any]) -> dict[str, Any]:
    """Values without those that are left to the law's defaults."""
    return {name: value for name, value in values.items() if value is not None}
