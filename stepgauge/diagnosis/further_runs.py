"""Further runs of a gauge that was measured, and the recording that each would make longer, by simulation.

A run lays the gauge elsewhere or leaves it where it is, and may be measured at another speed, in another order, at some
blocks only, or after a wait. Its readings are ideal: what matters is where, how and when they are taken.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.problem import bare_problem, plain_metric
from stepgauge.diagnosis.residuals import Residuals, unchecked_residuals
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import STANDING_COS, Placement, make_placement
from stepgauge.inference.metric import Metric
from stepgauge.machine.file import Machine
from stepgauge.machine.styli import stylus_words
from stepgauge.motion.moves import Program
from stepgauge.planning.plan import PlanOptions, faces_in_order
from stepgauge.recording import APPROACH, POSITION, Recording
from stepgauge.recording.columns import STYLUS

CYCLES = 2
MARGIN_MM = np.array([40.0, 40.0, 60.0])
"""Distance to the travel limits for stand-off, clearance and lift, on x, y and z."""
SAME_PLACE_MM = 10.0
"""Distance below which a run uses a placement that was recorded, and lays the gauge there again."""
LEVEL_SIN = 0.1
"""Change of its incline up to which a gauge needs nothing more to lie on."""
SPEED_FACTOR = 3.0
PAUSE_S = 120.0
"""Between two runs, s."""
TOUCH_S = 2.0
"""Time between two touches where the recording does not tell, s."""
BEYOND = 1.0
"""A temperature that goes on changing is expected to go on by no more than it has changed so far, times this."""


@dataclass(frozen=True)
class FurtherRun:
    """A further measurement: in words, the position of the gauge, and the speed (None: as before).

    ``blocks``: those that are measured (None: all); ``wait_s``: time before it; ``stays``: neither gauge nor stylus is
    touched, so that the origin is the one it had; ``stylus``: the number of the machine's stylus; ``changed``: it is
    put in for this run, so that the gauge is located and has a new origin even if it is ``kept`` as it lies.
    ``raised``: something must be built for the gauge to lie on.
    """

    words: str
    placement: Placement
    speed_mm_s: float | None = None
    cycles: int = CYCLES
    order: str = "blocks"
    blocks: tuple[int, ...] | None = None
    wait_s: float = PAUSE_S
    stays: bool = False
    stylus: int = 1
    changed: bool = False
    kept: bool = False
    raised: bool = False

    @property
    def is_laid(self) -> bool:
        """Whether the gauge is laid for this run."""
        return not (self.stays or self.kept)

    def options(self, n_blocks: int) -> PlanOptions:
        """The run as a plan of a gauge with so many blocks."""
        return PlanOptions(1, n_blocks, order=self.order, cycles=self.cycles, only_blocks=self.blocks)


@dataclass(frozen=True)
class ExtendedRecording:
    """The recording with the simulated rows of an extra run, and its whitening."""

    run: FurtherRun
    data: Residuals
    metric: Metric


def extended(data: Residuals, sigma_um: float, runs: Iterable[FurtherRun] | None = None) -> list[ExtendedRecording]:
    """The recording with each run, by default all of :func:`further_runs`; ``sigma_um``: scatter of a probing.

    Runs whose readings the machine file cannot predict are left out.
    """
    found = []
    for run in further_runs(data) if runs is None else runs:
        try:
            more = append_run(run, data)
        except InputError:
            continue
        found.append(ExtendedRecording(run, more, independent_metric(more, sigma_um)))
    return found


def independent_metric(data: Residuals, sigma_um: float) -> Metric:
    """The whitening of residuals with independent scatter."""
    return plain_metric(bare_problem(data, independent=True), sigma_um)


def further_runs(data: Residuals) -> Iterator[FurtherRun]:
    """Runs that fit into the travel, the least effort first."""
    here = placement_of(data)
    speed = float(np.median(data.frame["speed_mm_s"])) if "speed_mm_s" in data.frame else None
    if speed is not None:
        slower = max(speed / SPEED_FACTOR, 0.1)
        yield FurtherRun(f"the same placement at {slower:.3g} mm/s instead of {speed:.3g} mm/s", here, slower)
    for number in range(2, len(data.machine.styli) + 2):
        words = f"the same placement with {stylus_words(data.machine, number)}"
        yield FurtherRun(words, here, stylus=number, changed=True, kept=True)
    yield from laid_elsewhere(data, here)


def laid_elsewhere(data: Residuals, here: Placement) -> Iterator[FurtherRun]:
    """Runs with the gauge end for end, shifted and along other directions, within the travel."""
    length = float(np.linalg.norm(here.c2_mm - here.c1_mm))
    middle = (here.c1_mm + here.c2_mm) / 2.0
    options = [("the gauge end for end in the same position", middle, -here.axis)]
    options += [(_moved(m, middle), m, here.axis) for m in _shifts(data, middle, here.axis, length)]
    options = [one for one in options if _is_inside(one[1], *_room(data, one[2], length))]
    lain = [placement_of(data, number) for number in range(int(data.placement.max()) + 1)]
    for words, direction in _directions():
        centre = _turned_about(data, middle, direction, length)
        if abs(direction @ here.axis) < 0.98 and centre is not None:
            before = next((one for one in lain if _is_there(centre, direction, one)), None)
            centre, direction = (_centre(before), before.axis) if before else (centre, direction)
            about = f"the gauge along {words}, about {_text(centre)}"
            options.append((f"{about}, as it lay before" if before else about, centre, direction))
    for words, centre, axis in options:
        if abs(axis[2]) < STANDING_COS:
            half = axis * length / 2.0
            lies = make_placement(centre - half, centre + half, here.first_block, here.last_block)
            raised = abs(axis[2] - here.axis[2]) > LEVEL_SIN or centre[2] > middle[2] + SAME_PLACE_MM
            yield FurtherRun(words, lies, raised=raised)


def _centre(placement: Placement) -> Array:
    """Middle between the centres of its two blocks (3,), mm."""
    middle: Array = (placement.c1_mm + placement.c2_mm) / 2.0
    return middle


def _is_there(centre: Array, direction: Array, lain: Placement) -> bool:
    """Whether a gauge lay about there in this direction, either end first."""
    near = float(np.linalg.norm(centre - _centre(lain))) < SAME_PLACE_MM
    return abs(float(direction @ lain.axis)) > 0.98 and near


def _is_inside(centre: Array, low: Array, high: Array) -> bool:
    return bool(((centre >= low - 1e-9) & (centre <= high + 1e-9)).all())


def _turned_about(data: Residuals, middle: Array, direction: Array, length: float) -> Array | None:
    """Where a gauge is laid along another direction, near where it lay; None where it is too long for the travel.

    On a small machine as near to the limits as can be, at its height; whether its program is clear of them is checked
    with its path.
    """
    low, high = _room(data, direction, length)
    if (low <= high).all():
        return np.clip(middle, low, high)
    limits, half = data.probings.setting.travel_mm, np.abs(direction) * length / 2.0
    low, high = limits[:, 0] + half, limits[:, 1] - half
    return np.clip(middle, low, high) if (low <= high).all() else None


def _moved(place: Array, before: Array) -> str:
    """Where a gauge goes in the same direction; higher up it needs something to lie on."""
    if place[2] > before[2]:
        return f"the gauge raised on supports to {_text(place)}"
    return f"the gauge shifted to {_text(place)}"


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


def placement_of(data: Residuals, place: int = 0) -> Placement:
    """A placement of the gauge, by default the first, from its probings."""
    rows = data.placement == place
    number = int(data.frame["placement"].iloc[int(np.flatnonzero(rows)[0])])
    axis = data.probings.setting.axis[number]
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


def _shifts(data: Residuals, middle: Array, axis: Array, length: float) -> Iterator[Array]:
    """Shifts along each machine axis to the farther limit."""
    low, high = _room(data, axis, length)
    for i in range(3):
        target = middle.copy()
        target[i] = low[i] if middle[i] - low[i] > high[i] - middle[i] else high[i]
        if abs(target[i] - middle[i]) > 50.0:
            yield target


def program_of(run: FurtherRun, gauge: Gauge, machine: Machine, placement: Placement | None = None) -> Program:
    """The checked program of a run, with the gauge where it is found to lie (:class:`InputError` if it fails)."""
    # with all dialects: a tenth of a diagnosis without causes
    from stepgauge.planning.program import ProbingChoice, checked_program, make_settings

    lies, machine = placement or run.placement, machine.select_stylus(run.stylus)
    choice = ProbingChoice(measuring_speed_mm_s=run.speed_mm_s)
    settings = make_settings(gauge, machine, machine.probe.tip_radius_mm, choice)
    return checked_program(lies, gauge, machine, run.options(gauge.n_blocks), settings)


def can_be_planned(run: FurtherRun, data: Residuals) -> bool:
    """Whether the path of a run is clear of gauge and rail and within the travel, as ``stepgauge plan`` checks it."""
    try:
        program_of(replace(run, cycles=1), data.gauge, data.machine)
    except InputError:
        return False
    return True


def append_run(run: FurtherRun, data: Residuals) -> Residuals:
    """The recording followed by the rows of an extra run, with ideal readings."""
    cycle, face = np.array(list(faces_in_order(run.options(data.gauge.n_blocks)))).T
    sign = np.where(face % 2 == 1, 1.0, -1.0)
    axis, radius = run.placement.axis, data.machine.select_stylus(run.stylus).probe.tip_radius_mm
    along = data.gauge.position_mm[face - 1] - sign * radius
    before = {str(name): values.to_numpy() for name, values in data.frame.items()}
    if data.machine.styli:
        before[STYLUS] = data.stylus
    more = {name: np.full(len(face), values[-1], values.dtype) for name, values in before.items()}
    if run.stays:
        more["cycle"] = cycle + int(before["cycle"].max())
    else:
        more["placement"], more["cycle"] = np.full(len(face), int(before["placement"].max()) + 1), cycle
    more["face"] = face
    if STYLUS in more:
        more[STYLUS] = np.full(len(face), run.stylus)
    more |= dict(zip(POSITION, (run.placement.origin_mm(data.gauge) + along[:, None] * axis).T, strict=True))
    more |= dict(zip(APPROACH, (sign[:, None] * axis).T, strict=True))
    if run.speed_mm_s is not None and "speed_mm_s" in more:
        more["speed_mm_s"] = np.full(len(face), run.speed_mm_s)
    if "time_s" in more:
        steps = np.diff(np.sort(before["time_s"].astype(float)))
        touch_s = float(np.median(steps)) if steps.size and np.median(steps) > 0.0 else TOUCH_S
        more["time_s"] = before["time_s"].max() + run.wait_s + touch_s * np.arange(len(face))
        more |= _gone_on(more["time_s"], before)
    both = {name: np.concatenate([values, more[name]]) for name, values in before.items()}
    return unchecked_residuals(Recording(both, {}), data.gauge, data.machine)


def _gone_on(then_s: Array, before: Mapping[str, NDArray[Any]]) -> dict[str, Array]:
    """Temperatures that change go on changing at the mean rate so far, but not for ever."""
    time_s = before["time_s"].astype(float)
    ahead_s, since_s, later = then_s - time_s.max(), time_s - time_s.mean(), {}
    for name in (name for name in before if name.endswith("_C")):
        values = before[name].astype(float)
        span = float(np.ptp(values))
        if span > 0.0 and np.ptp(time_s) > 0.0:
            rate = float(since_s @ values / (since_s @ since_s))
            later[name] = values[time_s.argmax()] + np.clip(rate * ahead_s, -BEYOND * span, BEYOND * span)
    return later
