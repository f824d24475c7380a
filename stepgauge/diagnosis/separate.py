"""The measurement that discriminates confounded effects, chosen by simulation.

Every feasible extra run (the gauge rotated, shifted, end for end, or measured at another speed) is added to the
recording by simulation. The best one leaves the largest part of the signature of the effect that its rivals, with their
parameters fitted anew, cannot explain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from shlex import quote

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.diagnosis.library import family_signatures
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.posterior.priors import shipped_priors
from stepgauge.diagnosis.posterior.problem import Candidate
from stepgauge.diagnosis.posterior.scatter import Scatters
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import Residuals, unchecked_residuals
from stepgauge.diagnosis.result import Finding
from stepgauge.diagnosis.solve import Solved, orthonormal
from stepgauge.diagnosis.verdict import Model
from stepgauge.effects import along_approach_um
from stepgauge.errors import InputError
from stepgauge.files.resources import called
from stepgauge.gauge.placement import STANDING_COS, Placement, format_placement, make_placement
from stepgauge.recording import APPROACH, POSITION, Recording

Array = NDArray[np.float64]
CYCLES = 2
MARGIN_MM = np.array([40.0, 40.0, 60.0])
"""Distance to the travel limits for stand-off, clearance and lift, on x, y and z."""
TELLING = 9.0
"""Increase of chi-square from which an extra run is proposed."""
NO_SEPARATION = "the same in every placement and at every speed within this travel; log the temperatures"
SPEED_FACTOR = 3.0
PAUSE_S = 120.0


@dataclass(frozen=True)
class ExtraRun:
    """A further measurement: in words, the position of the gauge, and the speed (None: as before)."""

    words: str
    placement: Placement
    speed_mm_s: float | None = None


@dataclass(frozen=True)
class Separation:
    """The best extra run: the rivals that it excludes, their least chi-square, and the rivals that remain."""

    run: ExtraRun
    chi2: float
    told: tuple[str, ...]
    untold: tuple[str, ...]

    def command(self, name: str, gauge: str, machine: str) -> str:
        """The ``stepgauge plan`` command of the run, with its placement in the file ``name``.toml."""
        speed = "" if self.run.speed_mm_s is None else f" --measuring-speed {self.run.speed_mm_s:g}"
        files = f"{name}.toml -g {quote(gauge)} -m {quote(machine)}"
        return f"stepgauge plan {files} -d dmis --cycles {CYCLES}{speed} -o {name}.dmi"

    def placement_text(self) -> str:
        """The placement file of the run."""
        return format_placement(self.run.placement)


@dataclass(frozen=True)
class Lengthened:
    """The recording with the simulated rows of an extra run, and its whitening."""

    run: ExtraRun
    data: Residuals
    metric: Metric


def lengthened(data: Residuals, sigma_um: float) -> list[Lengthened]:
    """The recording with each feasible extra run, the least effort first; ``sigma_um``: scatter of a probing."""
    found = []
    for run in extra_runs(data):
        try:
            more = _with_run(run, data)
        except InputError:
            continue
        found.append(Lengthened(run, more, _metric(more, sigma_um)))
    return found


def _metric(data: Residuals, sigma_um: float) -> Metric:
    problem = bare_problem(data)
    scatters = Scatters(problem, shipped_priors())
    return Metric(problem, scatters.plain(), scatters, sigma_um)


def with_separations(
    findings: Sequence[Finding], model: Model, data: Residuals
) -> tuple[list[Finding], dict[str, str]]:
    """The findings with the reasons of their sets and the measurements that separate them; placements by file."""
    told: list[Finding] = []
    placements: dict[str, str] = {}
    sets = bool(data.gauge.path) and any(one.confounded_with or one.alternatives for one in findings)
    possible = lengthened(data, model.state.sigma_um) if sets else []
    for place, finding in enumerate(findings):
        if not finding.confounded_with and not finding.alternatives:
            told.append(finding)
            continue
        rivals = [(one.candidate, one.look.atom) for one in model.laws[place].place.rivals if one.candidate.named]
        lead = model.laws[place].lead.candidate
        listed = {finding.label, *finding.alternatives}
        rivals = [
            (c, atom)
            for c, atom in rivals
            if c is not lead and (c.kind in finding.confounded_with or c.source.label in listed)
        ]
        best = separate(place, model.fitted.solved, rivals, possible)
        name, by = f"separate-{len(placements) + 1}", NO_SEPARATION
        if best is not None:
            placements[f"{name}.toml"] = best.placement_text()
            command = best.command(name, called(data.gauge.path), called(data.machine.path))
            rest = f"; {', '.join(best.untold)}: {NO_SEPARATION}" if best.untold else ""
            by = f"{best.run.words}, which separates it from {', '.join(best.told)}: {command}{rest}"
        told.append(replace(finding, reason=_reason(finding, data), separate_by=by))
    return told, placements


def _reason(finding: Finding, data: Residuals) -> str:
    """Why the set cannot be discriminated, in words."""
    others = ", ".join([*finding.confounded_with, *finding.alternatives])
    count = int(data.placement.max()) + 1
    where = "the one placement" if count == 1 else f"the {count} placements"
    return f"in {where} of this recording {finding.label} and {others} have the same signature"


def separate(
    place: int,
    solved: Sequence[Solved],
    rivals: Sequence[tuple[Candidate, int]],
    possible: Sequence[Lengthened],
) -> Separation | None:
    """The extra run that best discriminates one finding from its rivals; None if no feasible run does.

    Parameters
    ----------
    place : index in ``solved`` of the rivals
    solved : the fitted effects
    rivals : the other laws for this place, each with the number of its shape
    possible : result of :func:`lengthened`
    """
    found = []
    for one in possible:
        try:
            left = _left_over(one, place, solved, rivals)
        except InputError:
            continue
        told = {label: chi2 for label, chi2 in left.items() if chi2 > TELLING}
        if told:
            untold = tuple(label for label in left if label not in told)
            found.append(Separation(one.run, min(told.values()), tuple(told), untold))
    # the most rivals first, then the clearest; among runs nearly as clear the one that is the least trouble
    best = max(found, key=lambda one: (len(one.told), one.chi2), default=None)
    return next((one for one in found if best and len(one.told) == len(best.told) and one.chi2 > best.chi2 / 2), None)


def extra_runs(data: Residuals) -> Iterator[ExtraRun]:
    """Runs that fit into the travel, the least effort first."""
    here = _placement_of(data)
    speed = float(np.median(data.frame["speed_mm_s"])) if "speed_mm_s" in data.frame else None
    if speed is not None:
        slower = max(speed / SPEED_FACTOR, 0.1)
        yield ExtraRun(f"the same placement at {slower:.3g} mm/s instead of {speed:.3g} mm/s", here, slower)
    length = float(np.linalg.norm(here.c2_mm - here.c1_mm))
    middle = (here.c1_mm + here.c2_mm) / 2.0
    options = [("the gauge end for end in the same position", middle, -here.axis)]
    options += [(f"the gauge shifted to {_text(m)}", m, here.axis) for m in _shifts(data, middle, here.axis, length)]
    for words, direction in _directions():
        centre = _nearest_inside(data, middle, direction, length)
        if abs(direction @ here.axis) < 0.98 and centre is not None:
            options.append((f"the gauge along {words}, about {_text(centre)}", centre, direction))
    for words, centre, axis in options:
        if abs(axis[2]) < STANDING_COS and _inside(data, centre, axis, length):
            half = axis * length / 2.0
            yield ExtraRun(words, make_placement(centre - half, centre + half, here.first_block, here.last_block))


def _text(place: Array) -> str:
    return "({:.0f}, {:.0f}, {:.0f}) mm".format(*place)


def _directions() -> Iterator[tuple[str, Array]]:
    diagonal = 1.0 / np.sqrt(2.0)
    yield "machine x", np.array([1.0, 0.0, 0.0])
    yield "machine y", np.array([0.0, 1.0, 0.0])
    yield "the diagonal of x and y", np.array([diagonal, diagonal, 0.0])
    yield "the diagonal of x and -y", np.array([diagonal, -diagonal, 0.0])
    yield "an incline of 30 deg over x", np.array([np.sqrt(0.75), 0.0, 0.5])
    yield "an incline of 30 deg over y", np.array([0.0, np.sqrt(0.75), 0.5])


def _placement_of(data: Residuals) -> Placement:
    """The first placement of the gauge, from its probings."""
    number = int(data.frame["placement"].iloc[int(np.flatnonzero(data.placement == 0)[0])])
    axis = data.probings.setting.axis[number]
    rows = data.placement == 0
    position = data.frame[POSITION].to_numpy(float)[rows]
    face_one = (position - data.gauge.position_mm[data.face[rows] - 1][:, None] * axis).mean(axis=0)
    c1, c2 = (face_one + axis * data.gauge.block_centre_mm[block] for block in (0, -1))
    up = None if abs(axis[2]) < STANDING_COS else np.array([1.0, 0.0, 0.0])
    return make_placement(c1, c2, 1, data.gauge.n_blocks, up)


def _room(data: Residuals, axis: Array, length: float) -> tuple[Array, Array]:
    """Least and largest coordinates of the centre of a gauge in this direction."""
    limits = data.probings.setting.travel_mm
    reach = np.abs(axis) * (length / 2.0 + 30.0) + MARGIN_MM
    return limits[:, 0] + reach, limits[:, 1] - reach


def _inside(data: Residuals, centre: Array, axis: Array, length: float) -> bool:
    low, high = _room(data, axis, length)
    return bool((centre >= low - 1e-9).all() and (centre <= high + 1e-9).all())


def _nearest_inside(data: Residuals, centre: Array, axis: Array, length: float) -> Array | None:
    low, high = _room(data, axis, length)
    return None if (low > high).any() else np.clip(centre, low, high)


def _shifts(data: Residuals, middle: Array, axis: Array, length: float) -> Iterator[Array]:
    """Shifts along each machine axis to the farther limit."""
    low, high = _room(data, axis, length)
    for i in range(3):
        target = middle.copy()
        target[i] = low[i] if middle[i] - low[i] > high[i] - middle[i] else high[i]
        if abs(target[i] - middle[i]) > 50.0:
            yield target


def _left_over(
    one: Lengthened, place: int, solved: Sequence[Solved], rivals: Sequence[tuple[Candidate, int]]
) -> dict[str, float]:
    """The chi-square of the effect that each rival cannot explain, with the extra run added."""
    more, metric = one.data, one.metric
    effect = metric(np.asarray(along_approach_um(solved[place].effect, more.probings)))
    others = [metric(along_approach_um(s.effect, more.probings)) for i, s in enumerate(solved) if i != place]
    left_over = {}
    for candidate, atom in rivals:
        family = candidate.source
        columns = metric(family_signatures(family, family.atoms[atom], more))
        basis = orthonormal(np.vstack([*others, *columns]).T)
        left = effect - basis @ (basis.T @ effect)
        left_over[family.label] = float(left @ left)
    return left_over


def _with_run(run: ExtraRun, data: Residuals) -> Residuals:
    """The recording followed by the rows of an extra run, with ideal readings."""
    face = np.tile(np.arange(1, data.gauge.n_faces + 1), CYCLES)
    sign = np.where(face % 2 == 1, 1.0, -1.0)
    axis, radius = run.placement.axis, data.machine.probe.tip_radius_mm
    along = data.gauge.position_mm[face - 1] - sign * radius
    position = run.placement.origin_mm(data.gauge) + along[:, None] * axis
    columns: dict[str, object] = {name: data.frame[name].iloc[-1] for name in data.frame.columns}
    frame = pd.DataFrame(columns, index=range(len(face)))
    frame["placement"] = int(data.frame["placement"].max()) + 1
    frame["cycle"], frame["face"] = np.repeat(np.arange(1, CYCLES + 1), data.gauge.n_faces), face
    frame[POSITION], frame[APPROACH] = position, sign[:, None] * axis
    if "time_s" in frame:
        frame["time_s"] = data.frame["time_s"].max() + PAUSE_S + 2.0 * np.arange(len(face))
    if run.speed_mm_s is not None:
        frame["speed_mm_s"] = run.speed_mm_s
    both = pd.concat([data.frame, frame[data.frame.columns]], ignore_index=True)
    return unchecked_residuals(Recording(both), data.gauge, data.machine)
