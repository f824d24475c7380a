"""An undisturbed measurement: gauge, placings, order of probing, path, clock. No error of any machine is in it yet.

Own code throughout: nothing of the package under test may be imported here or in any module of the generator.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.kits import KITS, PLACES, Place

Array = NDArray[np.float64]
Random = np.random.Generator
TRAVEL_MM = np.array([[0.0, 700.0], [0.0, 1000.0], [0.0, 600.0]])
"""From and to of every axis, of the ordinary machine."""
CLEAR_MM, UP_MM = 3.0, 25.0
"""Start of a search before its face, and height of the moves from gap to gap above the probing line."""
SETTLE_S = 0.4
"""Stand-still after every touch."""


@dataclass(frozen=True)
class Gauge:
    """A gauge as certified and as it truly is: the true one deviates by the stated uncertainties (k = 1)."""

    nominal_mm: Array
    certified_mm: Array
    u_um: Array
    true_mm: Array
    expansion_per_K: float
    u_expansion_per_K: float
    true_expansion_per_K: float

    @property
    def length_mm(self) -> float:
        return float(self.nominal_mm[-1])


@dataclass(frozen=True)
class Sensor:
    """A thermometer beside the machine: its column, and what it sees on a clock finer than the touches, deg C."""

    column: str
    clock_s: Array
    celsius: Array

    def at(self, time_s: Array) -> Array:
        """What it shows at these times, shape ``(n,)``."""
        return np.interp(time_s, self.clock_s, self.celsius)


@dataclass(frozen=True)
class Chain:
    """Which axes carry the table and which the probe, from the base outward; the tip from where the scales measure."""

    table: str
    probe: str
    stylus_mm: tuple[float, float, float]

    def arm_mm(self, travel: int, tip_mm: Array) -> Array:
        """From the reference point of a carriage (zero, with all axes at zero) to the tip: what its rotation acts on.

        The stylus, and the ways of those axes that come after the carriage on the way from the workpiece to the tip: a
        probe's carriage comes after its own axis, a table's before it.
        """
        joints = self.table[::-1] + self.probe
        own = joints.index("xyz"[travel])
        after = joints[own + ("xyz"[travel] in self.probe) :]
        way = (tip_mm - np.array(self.stylus_mm)) * np.array([axis in after for axis in "xyz"])
        return np.asarray(self.stylus_mm + way)


@dataclass(frozen=True)
class Scene:
    """``n`` probings in the order they were made. Arrays are per probing unless said otherwise.

    ``approach`` is the programmed direction of travel, ``axis`` the true gauge axis, ``along_mm`` the true place of the
    face on the gauge at the true temperature; ``way_mm`` the corners of the path, shape ``(n, 5, 3)``: above, start of
    the search, touch, back, above.
    """

    gauge: Gauge
    sigma_um: float
    tip_radius_mm: float
    pretravel_um: float
    placement: NDArray[np.int64]
    cycle: NDArray[np.int64]
    face: NDArray[np.int64]
    side: Array
    axis: Array
    approach: Array
    middle_mm: Array
    along_mm: Array
    centre_mm: Array
    way_mm: Array
    speed_mm_s: Array
    time_s: Array
    gauge_temperature_C: Array
    scale_temperature_C: Array
    humidity_pct: Array
    travel_mm: Array = field(default_factory=TRAVEL_MM.copy)
    sensors: tuple[Sensor, ...] = ()
    stylus_direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    stylus_mm: float | None = None
    chain: Chain | None = None

    def __len__(self) -> int:
        return len(self.face)

    def arm_mm(self, travel: int) -> Array:
        """What a rotation of this carriage acts on; without a chain all coordinates across its travel, ``(n, 3)``."""
        if self.chain:
            return self.chain.arm_mm(travel, self.centre_mm)
        return np.where(np.arange(3) == travel, 0.0, self.centre_mm)


@dataclass(frozen=True)
class Design:
    """What a measurement is made of; ``None`` leaves the choice to the random numbers of the case.

    ``places`` lays the gauge elsewhere than ``kit`` says; ``extent`` gives another gauge and number of cycles,
    ``clock`` other times (from the table of :func:`_lay`); ``one_face`` probes a single face in every cycle.
    ``sensors`` are thermometers whose columns are recorded too. ``stylus`` are the lengths (mm) of which one is stated
    in the machine file, ``stylus_direction`` points from the probe to the tip. A ``chain`` is stated in it too.
    """

    kit: str = ""
    speeds: int | None = None
    order: str | None = None
    pauses_per_placement: int | None = None
    longest_mm: float = 480.0
    least_rows: int = 240
    most_rows: int = 900
    least_cycles: int = 3
    places: Callable[[Random], list[Place]] | None = None
    extent: Callable[[Random], tuple[Gauge, int]] | None = None
    clock: Callable[[dict[str, Array], Random], Array] | None = None
    one_face: bool = False
    travel_mm: Array = field(default_factory=TRAVEL_MM.copy, compare=False)
    sensors: Callable[[Array, Random], tuple[Sensor, ...]] | None = None
    stylus: tuple[float, ...] = ()
    stylus_direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    chain: Chain | None = None


def make_gauge(random: np.random.Generator, longest_mm: float) -> Gauge:
    """12 to 30 blocks, equally spaced, certified to 0.05-0.1 um (k = 1)."""
    pitch_mm = random.choice([p for p in (16.0, 20.0, 25.0, 30.0, 40.0) if 12 * p <= longest_mm + 1.0])
    blocks = int(random.integers(12, min(30, int(longest_mm // pitch_mm)) + 1))
    width_mm = {16.0: 8.0, 20.0: 10.0, 25.0: 10.0, 30.0: 15.0, 40.0: 20.0}[float(pitch_mm)]
    return certified_gauge(random, float(pitch_mm), blocks, width_mm)


def certified_gauge(random: Random, pitch_mm: float, blocks: int, width_mm: float) -> Gauge:
    """A gauge of equally spaced blocks that deviates from its certificate by what is stated there."""
    fronts = pitch_mm * np.arange(blocks)
    nominal = np.column_stack([fronts, fronts + width_mm]).ravel()
    certified = np.round(nominal + np.r_[0.0, random.normal(0.0, 0.8e-3, 2 * blocks - 1)], 5)
    u_um = np.r_[0.0, np.round(random.uniform(0.05, 0.08) + 0.02 * nominal[1:] / nominal[-1], 3)]
    expansion, u_expansion = 11.5e-6, 0.3e-6
    return Gauge(
        nominal,
        certified,
        u_um,
        certified + u_um * 1e-3 * random.standard_normal(2 * blocks),
        expansion,
        u_expansion,
        expansion + u_expansion * random.standard_normal(),
    )


def make_scene(design: Design, random: np.random.Generator) -> Scene:
    """Lay the gauge, decide the order, drive the path and let the clock run."""
    order = design.order or str(random.choice(["blocks", "fronts_backs", "up_down"]))
    places = design.places(random) if design.places else [PLACES[name] for name in KITS[design.kit]]
    gauge, cycles = design.extent(random) if design.extent else _extent(design, len(places), random)
    speeds = _speeds(design.speeds or int(random.integers(1, 3)), random)
    visits = _visits(len(gauge.nominal_mm), cycles, "one" if design.one_face else order)
    parts = [_lay(place, number, visits, speeds, random) for number, place in enumerate(places, 1)]
    table = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    pauses = design.pauses_per_placement if design.pauses_per_placement is not None else int(random.integers(0, 3))
    time_s = design.clock(table, random) if design.clock else ordinary_clock(table, random, pauses)
    scene = replace(_touch(gauge, table, time_s, random), travel_mm=design.travel_mm)
    return replace(
        scene,
        sensors=design.sensors(time_s, random) if design.sensors else (),
        stylus_direction=design.stylus_direction,
        stylus_mm=float(random.choice(design.stylus)) if design.stylus else None,
        chain=design.chain,
    )


def _extent(design: Design, places: int, random: np.random.Generator) -> tuple[Gauge, int]:
    """A gauge and 3 to 6 cycles that give the wanted number of probings."""
    while True:
        gauge = make_gauge(random, design.longest_mm)
        cycles = int(random.integers(design.least_cycles, 7))
        if design.least_rows <= len(gauge.nominal_mm) * places * cycles <= design.most_rows:
            return gauge, cycles


def _speeds(count: int, random: np.random.Generator) -> Array:
    slow = float(random.choice([1.0, 2.0, 3.0]))
    fast = slow * float(random.choice([3.0, 4.0]))
    return np.array([slow, fast, 2.0 * slow][:count])


def _visits(faces: int, cycles: int, order: str) -> list[NDArray[np.int64]]:
    """For each cycle its faces in order, numbered from 1; ``one`` is the first face alone."""
    rising = np.arange(1, faces + 1)
    if order == "one":
        return [rising[:1]] * cycles
    if order == "fronts_backs":
        return [np.r_[rising[0::2], rising[1::2][::-1]]] * cycles
    return [rising[::-1] if order == "up_down" and cycle % 2 else rising for cycle in range(cycles)]


def _lay(
    place: Place, number: int, faces: list[NDArray[np.int64]], speeds: Array, random: np.random.Generator
) -> dict[str, Array]:
    """One placing: the gauge lies a little off its intended place, and the program knows its axis to 0.02 mrad."""
    direction, middle = (np.array(v, float) for v in place)
    true_axis = _unit(direction / np.linalg.norm(direction) + random.normal(0.0, 4e-3, 3))
    programmed = _unit(true_axis + random.normal(0.0, 2e-5, 3))
    middle = middle + random.uniform(-8.0, 8.0, 3)
    cycle = np.repeat(np.arange(1, len(faces) + 1), [len(f) for f in faces])
    face = np.concatenate(faces)
    n = len(face)
    return {
        "placement": np.full(n, number),
        "cycle": cycle,
        "face": face,
        "speed": speeds[(cycle - 1) % len(speeds)],
        "axis": np.tile(true_axis, (n, 1)),
        "programmed": np.tile(programmed, (n, 1)),
        "middle": np.tile(middle, (n, 1)),
        "warmth": np.full(n, random.normal(0.0, 0.06)),
    }


def ordinary_clock(table: dict[str, Array], random: Random, pauses: int = 0) -> Array:
    """Seconds at each touch: moves at 60 mm/s, searches at their speed, stand-still, pauses, re-laying of the gauge."""
    n = len(table["face"])
    travel_s = (2.0 * UP_MM + 20.0) / 60.0 + 0.5
    step = travel_s + CLEAR_MM / table["speed"] + SETTLE_S + random.uniform(0.0, 0.05, n)
    new_cycle = np.r_[False, np.diff(table["cycle"]) != 0]
    new_place = np.r_[False, np.diff(table["placement"]) != 0]
    step += np.where(new_cycle, random.uniform(15.0, 60.0, n), 0.0)
    step += np.where(new_place, random.uniform(500.0, 1200.0, n), 0.0)
    for place in np.unique(table["placement"]):
        rows = np.flatnonzero(table["placement"] == place)
        step[random.choice(rows[3:-3], pauses, replace=False)] += random.uniform(40.0, 400.0, pauses)
    return np.asarray(np.round(np.cumsum(step), 3), float)


def _touch(gauge: Gauge, table: dict[str, Array], time_s: Array, random: np.random.Generator) -> Scene:
    n = len(time_s)
    side = np.where(table["face"] % 2 == 1, 1.0, -1.0)
    hours = time_s / 3600.0
    temperature = 20.0 + table["warmth"] + 0.02 * np.sin(hours * random.uniform(0.5, 2.0) + random.uniform(0.0, 6.0))
    along = expanded_mm(gauge, temperature, table["face"].astype(np.int64))
    approach = side[:, None] * table["programmed"]
    sigma_um = round(float(random.uniform(0.2, 1.0)), 2)
    scene = Scene(
        gauge=gauge,
        sigma_um=sigma_um,
        tip_radius_mm=float(random.choice([1.0, 1.5, 2.0])),
        pretravel_um=float(random.choice([2.0, 5.0, 9.0])),
        placement=table["placement"].astype(np.int64),
        cycle=table["cycle"].astype(np.int64),
        face=table["face"].astype(np.int64),
        side=side,
        axis=table["axis"],
        approach=approach,
        middle_mm=table["middle"],
        along_mm=along,
        centre_mm=np.zeros((n, 3)),
        way_mm=np.zeros((n, 5, 3)),
        speed_mm_s=table["speed"],
        time_s=time_s,
        gauge_temperature_C=temperature,
        scale_temperature_C=20.0 + random.normal(0.0, 0.003, (n, 3)),
        humidity_pct=_humidity(time_s, random),
    )
    centre = contact_mm(scene)
    return replace(scene, centre_mm=centre, way_mm=_way(centre, approach))


def expanded_mm(gauge: Gauge, temperature_C: Array, face: NDArray[np.int_]) -> Array:
    """True place of each probed face: the segments from face to face expand one by one."""
    segments = np.diff(gauge.true_mm, prepend=gauge.true_mm[0])
    warm = 1.0 + gauge.true_expansion_per_K * (temperature_C - 20.0)
    places = gauge.true_mm[0] + np.cumsum(segments)
    return places[face - 1] * warm


def contact_mm(
    scene: Scene,
    *,
    along_mm: Array | None = None,
    axis: Array | None = None,
    tip_radius_mm: float | None = None,
    pretravel_um: Array | float | None = None,
) -> Array:
    """Tip centre at the trigger: the ball meets the plane of the face on its programmed line, then over-travels.

    The plane of a face is square to the true axis at ``along_mm`` from face 1; the line runs along the programmed axis
    through the middle of the gauge. Keyword arguments replace what the scene says.
    """
    along = scene.along_mm if along_mm is None else along_mm
    axis = scene.axis if axis is None else axis
    radius = scene.tip_radius_mm if tip_radius_mm is None else tip_radius_mm
    overtravel = scene.pretravel_um if pretravel_um is None else pretravel_um
    programmed = scene.side[:, None] * scene.approach
    from_middle = along - scene.gauge.length_mm / 2.0 - scene.side * radius
    along_line = from_middle / np.einsum("ij,ij->i", axis, programmed)
    along_line = along_line + scene.side * np.asarray(overtravel) * 1e-3
    return scene.middle_mm + along_line[:, None] * programmed


def _way(centre: Array, approach: Array) -> Array:
    """Corners of the path of each probing; the machine comes from above and leaves to above."""
    start = centre - CLEAR_MM * approach
    above = start + np.array([0.0, 0.0, UP_MM])
    return np.stack([above, start, centre, start, above], axis=1)


def _humidity(time_s: Array, random: np.random.Generator) -> Array:
    """A room whose door is opened now and then: humidity jumps up or down and falls back, with a little noise."""
    opened_s = np.sort(random.uniform(-0.1, 1.0, 25)) * time_s[-1]
    jump, back_s = random.normal(0.0, 3.0, 25), 0.03 * time_s[-1]
    since_s = time_s[:, None] - opened_s
    left = np.where(since_s > 0.0, np.exp(-np.maximum(since_s, 0.0) / back_s), 0.0) @ jump
    return np.round(48.0 + np.clip(left, -12.0, 12.0) + random.normal(0.0, 0.3, len(time_s)), 2)


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)


def recorded_um(scene: Scene, along_um: Array, step_um: float = 0.0) -> Array:
    """What is recorded along the approach, less where the undisturbed tip is; ``step_um`` are the display's steps."""
    if not step_um:
        return along_um
    at_um = 1e3 * np.einsum("ij,ij->i", scene.centre_mm, scene.approach)
    return np.asarray(np.round((at_um + along_um) / step_um) * step_um - at_um)


def indicated_mm(scene: Scene, along_um: Array, random: np.random.Generator) -> Array:
    """What the controller writes: along the approach all that bends the reading, across it only following errors.

    The machine is servoed in its own coordinates, so an error of its geometry never shows across the approach.
    """
    across = random.normal(0.0, 0.5, (len(scene), 3))
    across -= np.einsum("ij,ij->i", across, scene.approach)[:, None] * scene.approach
    return scene.centre_mm + 1e-3 * (along_um[:, None] * scene.approach + across)
