"""The classes of the benchmark: which causes, in which measurements, and what the right answer is."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from benchmarks.blind import machine_causes as machine
from benchmarks.blind import outsiders
from benchmarks.blind import run_causes as run
from benchmarks.blind.further_catalogue import FURTHER
from benchmarks.blind.recipe import SIZES, Make, Recipe, kits, pick
from benchmarks.blind.scatter import NOT_IDEAL
from benchmarks.blind.scene import Design
from benchmarks.blind.ways import MONTH_S, WAYS

NULLS = 500
"""Recordings with nothing in them, by default; of every scatter and way a share of that (``Recipe.nulls``)."""


_ALL_ROUND = kits("x_y_diagonal", "x_y_diagonal_space", "x_turned", "x_shifted_y", "mirrored")
_FLAT = kits("x_y_diagonal", "mirrored")
_SHIFTED_X = kits("x_shifted_y", longest_mm=420.0)
_SHIFTED_Y = kits("y_shifted_x", longest_mm=420.0)


def _single(name: str, make: Make, designs: tuple[Design, ...], forgiven: tuple[str, ...] = ()) -> Recipe:
    return Recipe("single", name, (make,), designs, forgiven=forgiven)


_SCALE_OF_ANGLE = ("scale_error", "scale_temperature")
SINGLES = (
    _single("scale_error", pick(machine.scale_error, 0, 1), _FLAT),
    _single("scale_curvature", pick(machine.scale_curvature, 0), _SHIFTED_X),
    _single("scale_curvature_y", pick(machine.scale_curvature, 1), _SHIFTED_Y),
    _single("periodic_scale_error", pick(machine.periodic_scale_error, 0), _SHIFTED_X),
    _single("local_scale_defect", pick(machine.local_scale_defect, 0), _SHIFTED_X),
    _single("squareness", pick(machine.squareness, "xy"), _FLAT),
    _single("squareness_xz", pick(machine.squareness, "xz"), kits("xz_mirrored")),
    _single("squareness_yz", pick(machine.squareness, "yz"), kits("yz_mirrored")),
    _single("angular_x_about_z", pick(machine.angular_error, (0, 2)), kits("x_front_rear"), _SCALE_OF_ANGLE),
    _single("angular_x_about_y", pick(machine.angular_error, (0, 1)), kits("x_low_high"), _SCALE_OF_ANGLE),
    _single("angular_y_about_z", pick(machine.angular_error, (1, 2)), kits("y_left_right"), _SCALE_OF_ANGLE),
    _single("angular_y_about_x", pick(machine.angular_error, (1, 0)), kits("y_low_high"), _SCALE_OF_ANGLE),
    _single("straightness", pick(machine.straightness, (0, 1), (1, 0)), kits("mirrored")),
    _single("reversal_error", pick(machine.reversal_error, 0, 1), kits("x_y_diagonal", "mirrored", speeds=2)),
    _single("effective_radius", run.effective_radius, kits("x_y_diagonal", "x_y", "mirrored", speeds=2)),
    _single("probe_lobing", run.probe_lobing, kits("azimuths", speeds=2)),
    _single("trigger_delay", run.trigger_delay, kits("x_y_diagonal", "x", "x_y", speeds=2)),
    _single("gauge_temperature", run.gauge_temperature, _ALL_ROUND),
    _single("scale_temperature", pick(run.scale_temperature, 0, 1), _FLAT),
    _single("thermal_drift", run.thermal_drift, kits("x", "y", "diagonal", "x_y")),
    _single("temperature_cycle", run.temperature_cycle, _ALL_ROUND),
    _single("step_change", run.step_change, kits("x", "x_y", "x_y_diagonal")),
    _single("misalignment", run.misalignment, _ALL_ROUND),
    _single("block_defect", run.block_defect, _ALL_ROUND + kits("x", "y")),
    _single("gauge_bending", run.gauge_bending, kits("x_turned", "x_shifted_y")),
    _single("approach_memory", run.approach_memory, kits("x_y", "x_y_diagonal", pauses_per_placement=8)),
    _single("noise_growth", run.noise_growth, kits("x", "x_y", "x_y_diagonal")),
    _single("outliers", run.outliers, _ALL_ROUND),
)


Named = tuple[str, Make]


def _joint(family: str, causes: tuple[Named, ...], designs: tuple[Design, ...], sizes: tuple[float, ...]) -> Recipe:
    return Recipe(family, "+".join(name for name, _ in causes), tuple(m for _, m in causes), designs, sizes=sizes)


def _pair(first: Named, second: Named, designs: tuple[Design, ...]) -> Recipe:
    return _joint("pair", (first, second), designs, SIZES)


def _triple(*causes: Named, kits: tuple[Design, ...]) -> Recipe:
    return _joint("triple", causes, kits, (1.0, 0.5))


_SCALE = ("scale_error", pick(machine.scale_error, 0, 1))
_PERIODIC = ("periodic_scale_error", pick(machine.periodic_scale_error, 0))
_LOCAL = ("local_scale_defect", pick(machine.local_scale_defect, 0))
_SQUARE = ("squareness", pick(machine.squareness, "xy"))
_REVERSAL = ("reversal_error", pick(machine.reversal_error, 0))
_CURVED = ("scale_curvature", pick(machine.scale_curvature, 0))
_RADIUS = ("effective_radius", run.effective_radius)
_DELAY = ("trigger_delay", run.trigger_delay)
_WARM = ("gauge_temperature", run.gauge_temperature)
_BLOCK = ("block_defect", run.block_defect)
_DUST = ("outliers", run.outliers)
_DRIFT = ("thermal_drift", run.thermal_drift)
_CYCLE = ("temperature_cycle", run.temperature_cycle)
_STEP = ("step_change", run.step_change)
_TWO_SPEEDS = kits("x_shifted_y", speeds=2, longest_mm=420.0)
_MIRRORED = kits("mirrored", speeds=2)
PAIRS = (
    _pair(_SCALE, _DRIFT, _FLAT),
    _pair(_SCALE, _CYCLE, _FLAT),
    _pair(_PERIODIC, _STEP, _SHIFTED_X),
    _pair(_WARM, _BLOCK, _FLAT),
    _pair(_WARM, _DUST, _FLAT),
    _pair(_SQUARE, _REVERSAL, _MIRRORED),
    _pair(_RADIUS, _LOCAL, _TWO_SPEEDS),
    _pair(_RADIUS, _SQUARE, _MIRRORED),
    _pair(_DELAY, _BLOCK, kits("x_y_diagonal", speeds=2)),
    _pair(_CURVED, _STEP, _SHIFTED_X),
    _pair(_PERIODIC, _CYCLE, _SHIFTED_X),
)
TRIPLES = (
    _triple(_SCALE, _SQUARE, _DRIFT, kits=kits("mirrored")),
    _triple(_SCALE, _CYCLE, _DUST, kits=_FLAT),
    _triple(_PERIODIC, _STEP, _RADIUS, kits=_TWO_SPEEDS),
    _triple(_WARM, _BLOCK, _CYCLE, kits=_FLAT),
    _triple(_SQUARE, _REVERSAL, _DRIFT, kits=_MIRRORED),
    _triple(_DELAY, _BLOCK, _STEP, kits=kits("x_y_diagonal", speeds=2)),
    _triple(_CURVED, _STEP, _CYCLE, kits=_SHIFTED_X),
    _triple(_LOCAL, _RADIUS, _DRIFT, kits=_TWO_SPEEDS),
)

_STRETCH_X = ("scale_error", "gauge_temperature", "scale_temperature")
_RADIUS_X = ("effective_radius", "reversal_error")
_RADIUS_SPEED = ("effective_radius", "trigger_delay")


def _confounded(name: str, make: Make, designs: tuple[Design, ...], whole_set: tuple[str, ...]) -> Recipe:
    return Recipe("confounded", name, (make,), designs, whole_set)


_X2 = kits("x", speeds=2)
_X_Y1 = kits("x_y", "x_y_diagonal", speeds=1)
CONFOUNDED = (
    _confounded("stretch:scale_error", pick(machine.scale_error, 0), kits("x"), _STRETCH_X),
    _confounded("stretch:gauge_temperature", run.gauge_temperature, kits("x", "y"), _STRETCH_X),
    _confounded("stretch:scale_temperature", pick(run.scale_temperature, 0), kits("x"), _STRETCH_X),
    _confounded("stretch_diagonal:squareness", pick(machine.squareness, "xy"), kits("diagonal"),
                ("squareness", *_STRETCH_X)),
    _confounded("size:effective_radius", run.effective_radius, _X2, _RADIUS_X),
    _confounded("latch:trigger_delay", run.trigger_delay, _X_Y1, _RADIUS_SPEED),
    _confounded("latch:effective_radius", run.effective_radius, _X_Y1, _RADIUS_SPEED),
    _confounded("all_three:trigger_delay", run.trigger_delay, kits("x", "y", speeds=1), (*_RADIUS_X, "trigger_delay")),
)  # fmt: skip

_OUTSIDE = kits("x", "x_y", "x_y_diagonal")
OUTSIDERS = tuple(
    Recipe("outsider", name, (getattr(outsiders, name),), designs)
    for name, designs in {
        "power_law_memory": kits("x_y", "x_y_diagonal", pauses_per_placement=8),
        "time_sawtooth": _OUTSIDE,
        "humidity": _OUTSIDE,
        "preisach": kits("x", "x_y", order="up_down"),
        "random_walk": _OUTSIDE,
        "corner_cubic": kits("corner"),
        "compensation_staircase": kits("x_shifted_y", longest_mm=420.0),
        "cycle_offsets": kits("x_y", "x_y_diagonal", least_cycles=5),
    }.items()
)

NULL = Recipe(
    "null", "null", (), _ALL_ROUND + kits("x", "y", "diagonal", "x_y", "azimuths", "x_front_rear", "y_low_high")
)

_ORDINARY = {recipe.name: recipe for recipe in (*SINGLES, *PAIRS)}
_IN_SCATTER = {
    "scatter-single": "scale_error periodic_scale_error squareness gauge_temperature trigger_delay thermal_drift "
    "temperature_cycle step_change",
    "scatter-pair": "scale_error+thermal_drift periodic_scale_error+step_change gauge_temperature+block_defect "
    "squareness+reversal_error",
}


def _scattered(family: str, recipe: Recipe, scatter: str) -> Recipe:
    """The same causes, at size 1, under a scatter that is not ideal; a name says the scatter first."""
    name = f"{scatter}:{recipe.name}" if recipe.causes else scatter
    return replace(recipe, family=family, name=name, scatter=scatter, sizes=(1.0,), nulls=0.4)


SCATTERED = tuple(
    _scattered(family, _ORDINARY[name], scatter.name)
    for family, names in _IN_SCATTER.items()
    for scatter in NOT_IDEAL
    for name in names.split()
) + tuple(_scattered("scatter-null", NULL, scatter.name) for scatter in NOT_IDEAL)


def _way(family: str, way: str, *causes: Named, sizes: tuple[float, ...] = (1.0,)) -> Recipe:
    recipe = _joint(family, causes, WAYS[way], sizes)
    return replace(recipe, name=f"{way}:{recipe.name}" if causes else way, nulls=0.1)


_SCALE_X = ("scale_error", pick(machine.scale_error, 0))
_ROOM = ("temperature_cycle", partial(run.slow_cycle, shortest_s=300.0, longest_s=1200.0))
_YEAR = ("temperature_cycle", partial(run.slow_cycle, shortest_s=12.0 * MONTH_S, longest_s=12.001 * MONTH_S))
_IN_WAY: dict[str, tuple[Named, ...]] = {
    "off_axis": (_SCALE_X, _PERIODIC, _LOCAL, _DRIFT),
    "tilted": (_SCALE_X, _WARM, _DRIFT, _CYCLE),
    "rhythm": (_PERIODIC, _DRIFT, _CYCLE, _STEP),
    "long": (_SCALE_X, _CURVED, _DRIFT, _STEP),
    "hour": (_DRIFT, _ROOM, _STEP),
    "years": (_SCALE_X, _DRIFT, _YEAR, _STEP),
    "far": (_SCALE_X, _SQUARE),
}
_BEYOND = {"hour": outsiders.late_heater, "rhythm": outsiders.humidity_lag, "years": outsiders.ageing_scale}
"""Mechanisms that no vocabulary had; the heater has a name since drifts may begin late."""
IN_WAYS = (
    *(_way("way-null", way) for way in WAYS),
    *(_way("way-single", way, cause) for way, causes in _IN_WAY.items() for cause in causes),
    _way("way-pair", "far", _SCALE_X, _SQUARE),
    _way("way-pair", "off_axis", _PERIODIC, _DRIFT),
    *(_way("way-outside", way, (make.__name__, make), sizes=(10.0, 1.0)) for way, make in _BEYOND.items()),
)
RECIPES = {
    recipe.family + ":" + recipe.name: recipe
    for recipe in (*SINGLES, *PAIRS, *TRIPLES, *CONFOUNDED, *OUTSIDERS, NULL, *SCATTERED, *IN_WAYS, *FURTHER)
}
FAMILIES = tuple(dict.fromkeys(recipe.family for recipe in RECIPES.values()))
