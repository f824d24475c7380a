"""The chain of axes against homogeneous transformation matrices, multiplied out without any approximation.

The matrices know nothing of arms: they move one body after the other. Their first order comes from a step along the
imaginary axis (Squire and Trapp, SIAM Review 40 (1998) 110), which has no rounding of differences.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from stepgauge.effects import Probings, Setting, make_effects, total_displacement_um
from stepgauge.errors import InputError
from stepgauge.machine.file import Machine, read_machine
from stepgauge.physics.chain import Chain

BRIDGE = (Path(__file__).parent.parent / "calibration_data" / "machines" / "bridge-cmm.toml").read_text()
CHAINS = {
    "moving bridge": ("", "yxz"),
    "gantry": ("", "xyz"),
    "horizontal arm": ("", "xzy"),
    "moving table along x": ("x", "yz"),
    "moving table along y": ("y", "xz"),
    "column with a cross table": ("yx", "z"),
    "knee": ("zyx", ""),
}
STEP = 1e-30


def listed(axes: str) -> str:
    return "[" + ", ".join(f'"{axis}"' for axis in axes) + "]"


def machine_with(folder: Path, chain: str, direction: str = "[0, 0, -1]") -> Machine:
    text = BRIDGE.replace("[probe]\n", f"[probe]\nstylus_direction = {direction}\n")
    (folder / "machine.toml").write_text(f"{text}\n[machine.chain]\n{chain}\n")
    return read_machine(folder / "machine.toml")


def random_machine(folder: Path, name: str, direction: str = "[0, 0, -1]") -> tuple[Machine, dict[str, Any]]:
    """A machine with the chain of that name and random points, and these points."""
    random, (table, probe) = np.random.default_rng(sorted(CHAINS).index(name)), CHAINS[name]
    points = {axis: random.uniform(-600, 600, 3) for axis in "xyz"}
    head, stylus = random.uniform(-80, 80, 3), random.uniform(-150, 150, 3)
    reference = ", ".join(f"{axis} = {point.tolist()}" for axis, point in points.items())
    text = f"table = {listed(table)}\nprobe = {listed(probe)}\nreference_mm = {{ {reference} }}\n"
    text += f"head_mm = {head.tolist()}\nstylus_mm = {stylus.tolist()}"
    return machine_with(folder, text, direction), {"reference": points, "head": head, "stylus": stylus}


def rows(n: int = 40) -> pd.DataFrame:
    """Tips all over the machine."""
    place = np.random.default_rng(3).uniform(-200, 900, (n, 3))
    columns = {f"{axis}_mm": place[:, i] for i, axis in enumerate("xyz")}
    return pd.DataFrame(columns | {"face": 1, "approach_i": 1.0, "approach_j": 0.0, "approach_k": 0.0})


def tips(frame: pd.DataFrame) -> np.ndarray:
    return frame[["x_mm", "y_mm", "z_mm"]].to_numpy()


def the_21_errors(folder: Path) -> list[dict[str, Any]]:
    """Positioning, straightness and rotations of three axes as powers, lines and tables, and three squarenesses."""
    random = np.random.default_rng(21)
    tables: list[dict[str, Any]] = [{"kind": "squareness", "plane": p, "urad": 30.0} for p in ("xy", "xz", "yz")]
    for axis in "xyz":
        tables.append({"kind": "scale_error", "axis": axis, "ppm": float(random.uniform(-20, 20))})
        tables.append({"kind": "roll", "axis": axis, "urad_per_m": float(random.uniform(-40, 40))})
        for order, other in enumerate("xyz".replace(axis, ""), 2):
            (folder / f"{axis}{other}.csv").write_text("coordinate_mm,error\n-500,3\n200,-9\n1200,40\n")
            file = {"kind": "error_map", "axis": axis, "component": f"r{other}", "file": f"{axis}{other}.csv"}
            power = {"axis": axis, "component": other, "order": order, "coefficient": float(random.uniform(-9, 9))}
            tables += [file, {"kind": "error_motion", "about_mm": 100.0, **power}]
    assert len(tables) == 21
    return tables


def displaced_mm(machine: Machine, tables: list[dict[str, Any]], frame: pd.DataFrame) -> np.ndarray:
    effects = make_effects(tables, machine.path)
    return total_displacement_um(effects, Probings(frame, Setting.of(machine))) * 1e-3


def turned(vector: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) about x, then y, then z, of angles (n, 3)."""
    matrix = np.broadcast_to(np.eye(3), (len(vector), 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        one = np.zeros((len(vector), 3, 3), vector.dtype)
        one[:, i, i] = 1.0
        one[:, j, j] = one[:, k, k] = np.cos(vector[:, i])
        one[:, k, j] = np.sin(vector[:, i])
        one[:, j, k] = -one[:, k, j]
        matrix = one @ matrix
    return matrix


def joint(travel: np.ndarray, turn: np.ndarray, about: np.ndarray) -> np.ndarray:
    """Homogeneous matrices (n, 4, 4) of a carriage that turns about a point of its own and travels."""
    matrix = np.zeros((len(travel), 4, 4), np.result_type(travel, turn))
    matrix[:, :3, :3] = turned(turn)
    matrix[:, :3, 3] = about + travel - matrix[:, :3, :3] @ about
    matrix[:, 3, 3] = 1.0
    return matrix


def tip_in_workpiece(
    name: str, points: dict[str, Any], reading: np.ndarray, shift: dict[str, Any], turn: dict[str, Any]
) -> np.ndarray:
    """Where the tip is in the frame of the workpiece, (n, 3), body after body.

    ``shift`` and ``turn``: by axis, what its error does to readings, mm and rad; the carriage does the opposite where
    it carries the probe.
    """
    axes = reading - points["tip"]
    ends = []
    for part, sense in zip(CHAINS[name], (-1.0, 1.0), strict=True):
        matrix = np.broadcast_to(np.eye(4), (len(reading), 4, 4))
        for axis in part:
            i = "xyz".index(axis)
            travel = sense * (np.eye(3)[i] * axes[:, i : i + 1] - shift[axis])
            matrix = matrix @ joint(travel, -sense * turn[axis], points["reference"][axis])
        ends.append(matrix)
    return (np.linalg.inv(ends[0]) @ ends[1] @ np.append(points["tip"], 1.0))[:, :3]


def motions(table: dict[str, Any], folder: Path, axes: np.ndarray) -> tuple[dict[str, Any], dict[str, Any]]:
    """What one error does to readings as a body: translations (mm) and rotations (rad) by axis, from its definition."""
    shift = {axis: np.zeros(axes.shape) for axis in "xyz"}
    turn = {axis: np.zeros(axes.shape) for axis in "xyz"}
    axis = table["plane"][1] if table["kind"] == "squareness" else table["axis"]
    u = axes[:, "xyz".index(axis)]
    if table["kind"] == "squareness":
        shift[axis][:, "xyz".index(table["plane"][0])] = table["urad"] * 1e-6 * u
    elif table["kind"] == "scale_error":
        shift[axis][:, "xyz".index(axis)] = table["ppm"] * 1e-6 * u
    elif table["kind"] == "roll":
        turn[axis][:, "xyz".index(axis)] = table["urad_per_m"] * 1e-9 * u
    elif table["kind"] == "error_motion":
        power = ((u - 100.0) / 1000.0) ** table["order"]
        shift[axis][:, "xyz".index(table["component"])] = table["coefficient"] * 1e-3 * power
    else:
        at, error = np.loadtxt(folder / table["file"], delimiter=",", skiprows=1).T
        turn[axis][:, "xyz".index(table["component"][1])] = np.interp(u, at, error) * 1e-6
    return shift, turn


def scaled(by_axis: dict[str, Any], factor: complex) -> dict[str, Any]:
    return {axis: factor * value for axis, value in by_axis.items()}


@pytest.mark.parametrize("direction", ["[0, 0, -1]", "[0, 1, 0]", "[0.6, 0, -0.8]"])
@pytest.mark.parametrize("name", CHAINS)
def test_each_of_the_21_errors_is_the_first_order_of_the_matrices(name: str, direction: str, tmp_path: Path) -> None:
    machine, points = random_machine(tmp_path, name, direction)
    points["tip"] = points["head"] + points["stylus"] @ machine.sensor.frame
    frame = rows()
    for table in the_21_errors(tmp_path):
        shift, turn = motions(table, tmp_path, tips(frame) - points["tip"])
        there = tip_in_workpiece(name, points, tips(frame), scaled(shift, 1j * STEP), scaled(turn, 1j * STEP))
        expected = -there.imag / STEP
        got = displaced_mm(machine, [table], frame)
        assert np.abs(got - expected).max() < 1e-9 * np.abs(expected).max(), table
        assert_allclose(there.real, tips(frame), atol=1e-9)


@pytest.mark.parametrize("name", CHAINS)
def test_what_is_left_out_is_of_second_order(name: str, tmp_path: Path) -> None:
    """The reading is where the machine stands when its tip truly is at the place: exact by iteration."""
    machine, points = random_machine(tmp_path, name)
    points["tip"] = points["head"] + points["stylus"]
    frame, tables = rows(), the_21_errors(tmp_path)
    every = [motions(table, tmp_path, tips(frame) - points["tip"]) for table in tables]
    shift = {axis: sum(one[0][axis] for one in every) for axis in "xyz"}
    turn = {axis: sum(one[1][axis] for one in every) for axis in "xyz"}
    left = []
    for size in (1.0, 0.5):
        reading = tips(frame)
        for _ in range(6):  # errors by the place, as the virtual CMM takes them
            there = tip_in_workpiece(name, points, reading, scaled(shift, size), scaled(turn, size))
            reading = reading + tips(frame) - there
        left.append(np.abs(reading - tips(frame) - size * displaced_mm(machine, tables, frame)).max())
    assert left[0] < 1e-3 * np.abs(displaced_mm(machine, tables, frame)).max()
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    ("name", "axis", "rotation", "expected"),
    [
        # Roll of a moving bridge: the beam moves y by -R z, and no z; only the ram's z is beyond the x carriage.
        ("moving bridge", "x", "rx", lambda x, y, z: (0 * x, -z, 0 * x)),
        ("moving bridge", "y", "ry", lambda x, y, z: (z, 0 * x, -x)),
        ("moving bridge", "x", "ry", lambda x, y, z: (z, 0 * x, 0 * x)),
        ("moving bridge", "z", "rx", lambda x, y, z: (0 * x, 0 * x, 0 * x)),
        # A table turns what lies on it: its yaw moves a point by its own travel, too.
        ("moving table along x", "x", "rz", lambda x, y, z: (-y, x, 0 * x)),
        ("moving table along x", "y", "rx", lambda x, y, z: (0 * x, -z, 0 * x)),
        # On a knee the saddle's pitch acts on the heights that the knee below it makes.
        ("knee", "y", "rx", lambda x, y, z: (0 * x, -z, y)),
        ("knee", "z", "ry", lambda x, y, z: (z, 0 * x, 0 * x)),
        ("knee", "x", "rz", lambda x, y, z: (-y, x, 0 * x)),
    ],
)
def test_rotations_by_hand(name: str, axis: str, rotation: str, expected: Any, tmp_path: Path) -> None:
    """A turn of 1 urad, wherever the axis is: arms in mm make nm."""
    table, probe = CHAINS[name]
    machine = machine_with(tmp_path, f"table = {listed(table)}\nprobe = {listed(probe)}")
    turn = {"kind": "error_motion", "axis": axis, "component": rotation, "order": 0, "coefficient": 1.0}
    got = displaced_mm(machine, [turn], rows())
    assert_allclose(got * 1e6, np.column_stack(expected(*tips(rows()).T)), atol=1e-9)


def test_lines_bows_and_leans_are_powers_of_the_same_motions(tmp_path: Path) -> None:
    machine, _ = random_machine(tmp_path, "column with a cross table")
    middle = machine.travel_mm[0].mean() - machine.chain.tip_mm[0]  # type: ignore[union-attr]
    for plain, axis, component, order, coefficient, about in (
        ({"kind": "scale_error", "axis": "y", "ppm": 5.0}, "y", "y", 1, 5.0, 0.0),
        ({"kind": "squareness", "plane": "xz", "urad": 7.0}, "z", "x", 1, 7.0, 0.0),
        ({"kind": "scale_curvature", "axis": "x", "um_per_m2": 8.0}, "x", "x", 2, 8.0, middle),
        ({"kind": "roll", "axis": "y", "urad_per_m": 6.0}, "y", "ry", 1, 6.0, 0.0),
        (
            {"kind": "angular_error", "travel_axis": "x", "rotation_axis": "z", "urad_per_m": 6.0},
            "x",
            "rz",
            1,
            6.0,
            0.0,
        ),
    ):
        motion = {"kind": "error_motion", "axis": axis, "component": component, "order": order}
        power = motion | {"coefficient": coefficient, "about_mm": float(about)}
        assert_allclose(displaced_mm(machine, [power], rows()), displaced_mm(machine, [plain], rows()), atol=1e-12)


def test_a_point_named_with_an_error_stands_in_place_of_the_chains(tmp_path: Path) -> None:
    machine, points = random_machine(tmp_path, "moving bridge")
    pitch = {"kind": "angular_error", "travel_axis": "y", "rotation_axis": "x", "urad_per_m": 20.0}
    got = displaced_mm(machine, [pitch | {"scale_at_mm": points["reference"]["y"].tolist()}], rows())
    assert_allclose(got, displaced_mm(machine, [pitch], rows()), atol=1e-15)
    assert np.abs(displaced_mm(machine, [pitch | {"scale_at_mm": [0, 0, 0]}], rows()) - got).max() > 1e-4


def test_without_a_stated_chain_no_arm_is_left_out_but_the_one_along_the_travel(tmp_path: Path) -> None:
    machine = replace(read_machine("bridge-cmm"), path=str(tmp_path / "machine.toml"))
    assert machine.chain is None
    yaw = {"kind": "error_motion", "axis": "y", "component": "rz", "order": 0, "coefficient": 1.0}
    x = tips(rows())[:, 0]
    assert_allclose(displaced_mm(machine, [yaw], rows()) * 1e6, np.column_stack([0 * x, x, 0 * x]), atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('table = ["x"]\nprobe = ["y"]', r"key machine\.chain is wrong.*each of x, y and z once"),
        ('table = ["x"]\nprobe = ["x", "y", "z"]', r"each of x, y and z once"),
        ('probe = ["y", "x", "w"]', r"key machine\.chain\.probe\.2 is wrong; found 'w'"),
        ('prob = ["y", "x", "z"]', r"key machine\.chain\.prob is not known.*"),
        ('probe = ["y", "x", "z"]\nreference_mm = { w = [0, 0, 0] }', r"machine\.chain\.reference_mm\.w is not known"),
        ('probe = ["y", "x", "z"]\nreference_mm = { x = [0, 0] }', r"key machine\.chain\.reference_mm\.x"),
        ('probe = ["y", "x", "z"]\nstylus_mm = "50"', r"key machine\.chain\.stylus_mm is wrong; found '50'"),
        ('probe = ["y", "x", "z"]\nhead_mm = { value = 1.0, u = 0.1 }', r"machine\.chain\.head_mm"),
    ],
)
def test_a_wrong_chain_is_named_by_its_key(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        machine_with(tmp_path, text)


def test_a_chain_of_two_axes_is_none() -> None:
    with pytest.raises(ValueError, match="each of the axes"):
        Chain("x", "y")


def test_the_documented_arms_are_those_of_the_chain() -> None:
    """The table in docs/virtual-cmm.md, row by row."""
    text = (Path(__file__).parent.parent / "docs" / "virtual-cmm.md").read_text()
    arms = [row for row in (line.split("|")[1:-1] for line in text.splitlines()) if len(row) == 6][2:]
    assert len(arms) == len(CHAINS)
    for _, table, probe, *grows in arms:
        chain = Chain(*("".join(re.findall("[xyz]", part)) for part in (table, probe)))
        for axis, told in zip("xyz", grows, strict=True):
            assert chain.beyond(axis) == "".join(re.findall("[xyz]", told.replace("nothing", ""))), (table, probe, axis)
