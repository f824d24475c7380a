"""The classes of the benchmark: which causes, in which measurements, and what the right answer is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.blind import machine_causes as machine
from benchmarks.blind import outsiders
from benchmarks.blind import run_causes as run
from benchmarks.blind.cause import Cause
from benchmarks.blind.scene import Design, Scene

Random = np.random.Generator
Make = Callable[[Scene, Random], Cause]
SIZES = (3.0, 1.0, 0.5, 0.3)


@dataclass(frozen=True)
class Recipe:
    """One row of the benchmark: the causes to conceal and the measurements to choose from.

    ``whole_set`` are the kinds that a confounded answer must contain; ``forgiven`` kinds may be named in addition.
    """

    family: str
    name: str
    causes: tuple[Make, ...]
    designs: tuple[Design, ...]
    whole_set: tuple[str, ...] = ()
    forgiven: tuple[str, ...] = ()


def _pick(make: Callable[..., Cause], *choices: object) -> Make:
    """The cause with one of several axes, planes or axis pairs, by the random numbers of the case."""

    def made(scene: Scene, random: Random) -> Cause:
        choice = choices[int(random.integers(len(choices)))]
        return make(scene, random, *choice) if isinstance(choice, tuple) else make(scene, random, choice)

    return made


def _kits(*names: str, **settings: object) -> tuple[Design, ...]:
    return tuple(Design(name, **settings) for name in names)  # type: ignore[arg-type]


_ALL_ROUND = _kits("x_y_diagonal", "x_y_diagonal_space", "x_turned", "x_shifted_y", "mirrored")
_FLAT = _kits("x_y_diagonal", "mirrored")
_SHIFTED_X = _kits("x_shifted_y", longest_mm=420.0)
_SHIFTED_Y = _kits("y_shifted_x", longest_mm=420.0)


def _single(name: str, make: Make, designs: tuple[Design, ...], forgiven: tuple[str, ...] = ()) -> Recipe:
    return Recipe("single", name, (make,), designs, forgiven=forgiven)


_SCALE_OF_ANGLE = ("scale_error", "scale_temperature")
SINGLES = (
    _single("scale_error", _pick(machine.scale_error, 0, 1), _FLAT),
    _single("scale_curvature", _pick(machine.scale_curvature, 0), _SHIFTED_X),
    _single("scale_curvature_y", _pick(machine.scale_curvature, 1), _SHIFTED_Y),
    _single("periodic_scale_error", _pick(machine.periodic_scale_error, 0), _SHIFTED_X),
    _single("local_scale_defect", _pick(machine.local_scale_defect, 0), _SHIFTED_X),
    _single("squareness", _pick(machine.squareness, "xy"), _FLAT),
    _single("squareness_xz", _pick(machine.squareness, "xz"), _kits("xz_mirrored")),
    _single("squareness_yz", _pick(machine.squareness, "yz"), _kits("yz_mirrored")),
    _single("angular_x_about_z", _pick(machine.angular_error, (0, 2)), _kits("x_front_rear"), _SCALE_OF_ANGLE),
    _single("angular_x_about_y", _pick(machine.angular_error, (0, 1)), _kits("x_low_high"), _SCALE_OF_ANGLE),
    _single("angular_y_about_z", _pick(machine.angular_error, (1, 2)), _kits("y_left_right"), _SCALE_OF_ANGLE),
    _single("angular_y_about_x", _pick(machine.angular_error, (1, 0)), _kits("y_low_high"), _SCALE_OF_ANGLE),
    _single("straightness", _pick(machine.straightness, (0, 1), (1, 0)), _kits("mirrored")),
    _single("reversal_error", _pick(machine.reversal_error, 0, 1), _kits("x_y_diagonal", "mirrored", speeds=2)),
    _single("effective_radius", run.effective_radius, _kits("x_y_diagonal", "x_y", "mirrored", speeds=2)),
    _single("probe_lobing", run.probe_lobing, _kits("azimuths", speeds=2)),
    _single("trigger_delay", run.trigger_delay, _kits("x_y_diagonal", "x", "x_y", speeds=2)),
    _single("gauge_temperature", run.gauge_temperature, _ALL_ROUND),
    _single("scale_temperature", _pick(run.scale_temperature, 0, 1), _FLAT),
    _single("thermal_drift", run.thermal_drift, _kits("x", "y", "diagonal", "x_y")),
    _single("temperature_cycle", run.temperature_cycle, _ALL_ROUND),
    _single("step_change", run.step_change, _kits("x", "x_y", "x_y_diagonal")),
    _single("misalignment", run.misalignment, _ALL_ROUND),
    _single("block_defect", run.block_defect, _ALL_ROUND + _kits("x", "y")),
    _single("gauge_bending", run.gauge_bending, _kits("x_turned", "x_shifted_y")),
    _single("approach_memory", run.approach_memory, _kits("x_y", "x_y_diagonal", pauses_per_placement=8)),
    _single("noise_growth", run.noise_growth, _kits("x", "x_y", "x_y_diagonal")),
    _single("outliers", run.outliers, _ALL_ROUND),
)


def _pair(first: tuple[str, Make], second: tuple[str, Make], designs: tuple[Design, ...]) -> Recipe:
    return Recipe("pair", f"{first[0]}+{second[0]}", (first[1], second[1]), designs)


_SCALE = ("scale_error", _pick(machine.scale_error, 0, 1))
_PERIODIC = ("periodic_scale_error", _pick(machine.periodic_scale_error, 0))
_LOCAL = ("local_scale_defect", _pick(machine.local_scale_defect, 0))
_SQUARE = ("squareness", _pick(machine.squareness, "xy"))
_REVERSAL = ("reversal_error", _pick(machine.reversal_error, 0))
PAIRS = (
    _pair(_SCALE, ("thermal_drift", run.thermal_drift), _FLAT),
    _pair(_SCALE, ("temperature_cycle", run.temperature_cycle), _FLAT),
    _pair(_PERIODIC, ("step_change", run.step_change), _SHIFTED_X),
    _pair(("gauge_temperature", run.gauge_temperature), ("block_defect", run.block_defect), _FLAT),
    _pair(("gauge_temperature", run.gauge_temperature), ("outliers", run.outliers), _FLAT),
    _pair(_SQUARE, _REVERSAL, _kits("mirrored", speeds=2)),
    _pair(("effective_radius", run.effective_radius), _LOCAL, _kits("x_shifted_y", speeds=2, longest_mm=420.0)),
    _pair(("effective_radius", run.effective_radius), _SQUARE, _kits("mirrored", speeds=2)),
    _pair(("trigger_delay", run.trigger_delay), ("block_defect", run.block_defect), _kits("x_y_diagonal", speeds=2)),
    _pair(("scale_curvature", _pick(machine.scale_curvature, 0)), ("step_change", run.step_change), _SHIFTED_X),
    _pair(_PERIODIC, ("temperature_cycle", run.temperature_cycle), _SHIFTED_X),
)

_STRETCH_X = ("scale_error", "gauge_temperature", "scale_temperature")
_RADIUS_X = ("effective_radius", "reversal_error")
_RADIUS_SPEED = ("effective_radius", "trigger_delay")


def _confounded(name: str, make: Make, designs: tuple[Design, ...], whole_set: tuple[str, ...]) -> Recipe:
    return Recipe("confounded", name, (make,), designs, whole_set)


_X2 = _kits("x", speeds=2)
_X_Y1 = _kits("x_y", "x_y_diagonal", speeds=1)
CONFOUNDED = (
    _confounded("stretch:scale_error", _pick(machine.scale_error, 0), _kits("x"), _STRETCH_X),
    _confounded("stretch:gauge_temperature", run.gauge_temperature, _kits("x", "y"), _STRETCH_X),
    _confounded("stretch:scale_temperature", _pick(run.scale_temperature, 0), _kits("x"), _STRETCH_X),
    _confounded("stretch_diagonal:squareness", _pick(machine.squareness, "xy"), _kits("diagonal"),
                ("squareness", *_STRETCH_X)),
    _confounded("size:effective_radius", run.effective_radius, _X2, _RADIUS_X),
    _confounded("latch:trigger_delay", run.trigger_delay, _X_Y1, _RADIUS_SPEED),
    _confounded("latch:effective_radius", run.effective_radius, _X_Y1, _RADIUS_SPEED),
    _confounded("all_three:trigger_delay", run.trigger_delay, _kits("x", "y", speeds=1), (*_RADIUS_X, "trigger_delay")),
)  # fmt: skip

_OUTSIDE = _kits("x", "x_y", "x_y_diagonal")
OUTSIDERS = tuple(
    Recipe("outsider", name, (getattr(outsiders, name),), designs)
    for name, designs in {
        "power_law_memory": _kits("x_y", "x_y_diagonal", pauses_per_placement=8),
        "time_sawtooth": _OUTSIDE,
        "humidity": _OUTSIDE,
        "preisach": _kits("x", "x_y", order="up_down"),
        "random_walk": _OUTSIDE,
        "corner_cubic": _kits("corner"),
        "compensation_staircase": _kits("x_shifted_y", longest_mm=420.0),
        "cycle_offsets": _kits("x_y", "x_y_diagonal", least_cycles=5),
    }.items()
)

NULL = Recipe(
    "null", "null", (), _ALL_ROUND + _kits("x", "y", "diagonal", "x_y", "azimuths", "x_front_rear", "y_low_high")
)
RECIPES = {recipe.family + ":" + recipe.name: recipe for recipe in (*SINGLES, *PAIRS, *CONFOUNDED, *OUTSIDERS, NULL)}
