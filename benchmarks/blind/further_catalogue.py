"""The classes that came later: the probe, further errors of the axes, recorded temperatures."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.blind import axis_causes as axis
from benchmarks.blind import chain_causes as chain
from benchmarks.blind import machine_causes as machine
from benchmarks.blind import probe_causes as probe
from benchmarks.blind import run_causes as run
from benchmarks.blind import temperature_causes as temperature
from benchmarks.blind import volume_causes as volume
from benchmarks.blind.recipe import Make, Random, Recipe, kits, pick
from benchmarks.blind.scene import Chain, Design, Place
from benchmarks.blind.ways import LARGE_TRAVEL_MM, corners, metre

SIZES = (1.0, 0.5)
VOLUME_SIZES = (10.0, 3.0, 1.0)
"""A machine without compensation is off by many times its repeatability."""
SEVERAL_SIZES = (3.0, 1.0)
STEPS_DEG = {3: (20.0, 40.0), 4: (15.0, 35.0), 5: (35.0, 35.0)}
"""Azimuths from placing to placing; none is a sixth of a turn, at which a tripod repeats itself."""


def fan(random: Random, placings: int, rise_deg: float = 0.0) -> list[Place]:
    """The gauge in several azimuths about a vertical stylus, raised or lowered by up to ``rise_deg``, or level."""
    step_deg = float(random.choice(STEPS_DEG[placings])) + random.uniform(-2.0, 2.0)
    first_deg, places = random.uniform(0.0, 180.0), []
    for k in range(placings):
        azimuth = np.radians(first_deg + k * step_deg)
        rise = np.radians(rise_deg * random.uniform(0.6, 1.0)) * (1.0, -1.0, 0.0)[k % 3]
        flat = np.cos(rise) * np.array([np.cos(azimuth), np.sin(azimuth)])
        places.append(((flat[0], flat[1], float(np.sin(rise))), (350.0, 480.0, 290.0)))
    return places


def upright_fan(random: Random, placings: int) -> list[Place]:
    """The same about a stylus turned along x: the gauge lies along y and is raised more and more."""
    lowest, step = random.uniform(-36.0, -30.0), random.uniform(18.0, 22.0)
    angles = np.radians(lowest + step * np.arange(placings))
    return [((0.0, float(np.cos(a)), float(np.sin(a))), (350.0, 480.0, 290.0)) for a in angles]


STYLI_MM = (30.0, 50.0, 75.0)
LEVEL = tuple(Design(places=partial(fan, placings=n), stylus=STYLI_MM) for n in (3, 4, 5))
TILTED = tuple(Design(places=partial(fan, placings=n, rise_deg=40.0), stylus=STYLI_MM) for n in (3, 4))
TURNED = (Design(places=partial(upright_fan, placings=4), stylus=STYLI_MM, stylus_direction=(1.0, 0.0, 0.0)),)
TRIPODS = ("kinematic_pretravel", "seat_defect")


def _probe(name: str, make: Make, designs: tuple[Design, ...], **settings: tuple[str, ...]) -> Recipe:
    return Recipe("probe", name, (make,), designs, sizes=SIZES, **settings)  # type: ignore[arg-type]


PROBE = (
    _probe("tripod", probe.kinematic_pretravel, LEVEL, forgiven=("effective_radius",)),
    _probe("tripod_tilted", probe.kinematic_pretravel, TILTED, forgiven=("effective_radius",)),
    _probe("tripod_turned", probe.kinematic_pretravel, TURNED, forgiven=("effective_radius",)),
    _probe("tripod_unseen", probe.tripod_as_radius, kits("x", "y", "diagonal", stylus=STYLI_MM), not_named=TRIPODS),
    _probe("seat_defect", probe.seat_defect, (*LEVEL[1:], *TILTED[1:]), forgiven=("effective_radius",)),
    _probe("tip_change", probe.tip_change, kits("x_shifted_y", "x_low_high", "y_left_right")),
    _probe("servo_lag", probe.servo_lag, kits("x", "x_y", speeds=3)),
    Recipe("probe-null", "probe", (), (*LEVEL, *TILTED, *TURNED), nulls=0.1),
)

_X = kits("x_shifted_y", longest_mm=420.0)
_THERE_AND_BACK = kits("x", "x_y", "x_shifted_y", order="up_down")


def _chain(name: str, make: Make, designs: tuple[Design, ...]) -> Recipe:
    return Recipe("chain", name, (make,), designs, sizes=SIZES)


_STYLUS_MM = (0.0, 0.0, -170.0)
CHAINS = tuple(
    Chain(table, probe, _STYLUS_MM)
    for table, probe in (("", "yxz"), ("", "xyz"), ("y", "xz"), ("x", "yz"), ("xy", "z"))
)
"""Moving bridge, gantry, moving table along y or x, column; the tip hangs below the point that the scales measure."""


def _in_chain(*names: str) -> tuple[Design, ...]:
    return tuple(replace(design, chain=one) for design in kits(*names) for one in CHAINS)


CHAIN = (
    _chain("scale_joint", pick(axis.scale_joint, 0), _X),
    _chain("scale_gap", pick(axis.scale_gap, 0), _X),
    _chain("reversal_wear", pick(axis.reversal_wear, 0), _X),
    _chain("stick_slip", pick(axis.stick_slip, 0), _THERE_AND_BACK),
    _chain("cubic_scale", pick(axis.cubic_scale, 0), _X),
    _chain("cubic_straightness", pick(axis.cubic_straightness, (0, 1), (1, 0)), kits("mirrored")),
    _chain("rotation_x_about_z", pick(axis.curved_rotation, (0, 2)), kits("x_front_rear")),
    _chain("rotation_y_about_z", pick(axis.curved_rotation, (1, 2)), kits("y_left_right")),
    _chain("rotation_in_chain_x_y", pick(chain.rotation_in_chain, (0, 1)), _in_chain("x_low_high")),
    _chain("rotation_in_chain_x_z", pick(chain.rotation_in_chain, (0, 2)), _in_chain("x_front_rear")),
    _chain("rotation_in_chain_y_x", pick(chain.rotation_in_chain, (1, 0)), _in_chain("y_low_high")),
    _chain("rotation_in_chain_y_z", pick(chain.rotation_in_chain, (1, 2)), _in_chain("y_left_right")),
    _chain("squareness_in_chain", pick(chain.squareness_in_chain, "xy"), _in_chain("x_y_diagonal", "mirrored")),
    Recipe("chain-null", "chain", (), (*_X, *_THERE_AND_BACK, *kits("mirrored", "y_left_right")), nulls=0.1),
)


MOST_OF_ONE = 360
"""More touches than one placing can have, so that a temperature has time to change in its own way."""


def _with(sensors: object, *names: str) -> tuple[Design, ...]:
    return tuple(replace(design, sensors=sensors, least_rows=MOST_OF_ONE) for design in kits(*names))  # type: ignore[arg-type]


def _warm(name: str, make: Make, designs: tuple[Design, ...], **settings: tuple[str, ...]) -> Recipe:
    return Recipe("temperature", name, (make,), designs, sizes=SIZES, **settings)  # type: ignore[arg-type]


_ROOM = partial(_with, temperature.thermometers)
_BEAM = (Design(places=corners, extent=metre, travel_mm=LARGE_TRAVEL_MM, sensors=temperature.two_of_a_beam),)
"""A bridge of one metre is too short to be bent by more than a machine repeats to."""
TEMPERATURE = (
    _warm("thermal_shift", temperature.thermal_shift, _ROOM("x_y", "x_shifted", "x_y_diagonal")),
    _warm("thermal_expansion", pick(temperature.thermal_expansion_of, 0), _ROOM("x_shifted_y", "x_y_diagonal")),
    _warm("thermal_bending", pick(temperature.thermal_bending, (0, 1), (1, 0)), _BEAM),
    _warm("scale_warm_up", pick(temperature.scale_warm_up, 0), _X),
    _warm("gauge_soaking_once", partial(temperature.gauge_soaking, anew=False), kits("x", "y", "x_y", "mirrored")),
    _warm("gauge_soaking_each", partial(temperature.gauge_soaking, anew=True), kits("x_y", "mirrored", "x_shifted")),
    _warm("late_drift", temperature.late_drift, kits("x", "y", "diagonal", "x_y")),
    _warm("drift_beside_decoys", run.thermal_drift, _ROOM("x_y", "x_shifted", "y_shifted")),
    Recipe("temperature-null", "temperature", (), (*_ROOM("x_y", "x_shifted", "x_y_diagonal"), *_BEAM), nulls=0.1),
)
_LINES = kits("mirrored", "x_y_diagonal_space", "xz_mirrored", "yz_mirrored")
_AND_PLAY = (volume.uncompensated, pick(machine.reversal_error, 0, 1))
VOLUME = (
    Recipe("volume", "uncompensated", (volume.uncompensated,), _LINES, sizes=VOLUME_SIZES),
    Recipe("volume", "uncompensated_and_reversal", _AND_PLAY, _LINES, sizes=VOLUME_SIZES),
)
CAUSES: dict[str, Make] = {
    "scale_x": pick(machine.scale_error, 0),
    "scale_y": pick(machine.scale_error, 1),
    "curve": pick(machine.scale_curvature, 0),
    "period": pick(machine.periodic_scale_error, 0),
    "square": pick(machine.squareness, "xy"),
    "yaw": pick(machine.angular_error, (1, 2)),
    "play_x": pick(machine.reversal_error, 0),
    "play_y": pick(machine.reversal_error, 1),
    "radius": run.effective_radius,
    "delay": run.trigger_delay,
    "warm": run.gauge_temperature,
    "block": run.block_defect,
    "drift": run.thermal_drift,
    "cycle": run.temperature_cycle,
    "step": run.step_change,
    "dust": run.outliers,
}


def _several(kit: str, *causes: str) -> Recipe:
    makes = tuple(CAUSES[name] for name in causes)
    return Recipe("several", "+".join(causes), makes, kits(kit, speeds=2), sizes=SEVERAL_SIZES)


SEVERAL = (
    _several("five", "scale_x", "scale_y", "square", "play_x", "radius"),
    _several("seven", "scale_x", "square", "play_y", "warm", "drift", "radius"),
    _several("five", "scale_y", "play_x", "play_y", "radius", "block", "drift"),
    _several("seven", "scale_x", "scale_y", "square", "play_x", "play_y", "radius", "drift"),
    _several("five", "scale_x", "period", "step", "radius", "block"),
    _several("seven", "square", "yaw", "scale_y", "play_x", "cycle"),
    _several("five", "curve", "radius", "delay", "warm", "drift", "dust"),
    _several("seven", "scale_x", "scale_y", "square", "play_x", "radius", "drift", "block", "cycle"),
)
"""What machines in use have: five to eight causes at once."""
FURTHER = (*PROBE, *CHAIN, *TEMPERATURE, *VOLUME, *SEVERAL)
