"""Random placements through every dialect's text, looked at by a controller and a collision check of its own.

    python -m benchmarks.attack.collisions --placements 10000 --seed 1

For each placement a gauge, a probe, a pose and the options of a plan are drawn. The plan is either refused or written
in every dialect; then each text is run (``controllers``), and its path swept (``swept``) against blocks and rail, in
code that shares nothing with the package. Counted are

- collisions: the ball comes nearer to something than the margin, other than to the face it probes; so do, in one text
  of each placement, the shank and the body;
- differences: a text that does not go where the plan goes, or does not probe the faces in the order asked for.

Both must be 0; the exit code says so. The draw of number k depends on the seed and k alone, so ``--first`` repeats one.
"""

from __future__ import annotations

import argparse
import datetime
import sys
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.attack.controllers import CONTROLLERS, Piece
from benchmarks.attack.swept import least_distance
from stepgauge.errors import InputError
from stepgauge.gauge.certified import CertificateTable, Gauge, GaugeTable
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine, MachineTable
from stepgauge.motion.moves import Program
from stepgauge.planning.plan import PlanOptions
from stepgauge.planning.program import ProbingChoice, checked_program, make_settings, program_text
from stepgauge.probes.schema import ConstantTable

Array = NDArray[np.float64]
PRINTED_MM = {"jinyoung": 2e-3}
"""What rounding to the printed digits may do to a place; the other dialects print 1e-6 mm."""
OWN_BLOCK_MM = 0.1
"""How near shank and body may come to the block that is being touched."""
OVERHANG_MM = 15.0
CHUNK = 500
"""The counts are told after so many placements."""


@dataclass(frozen=True)
class Scene:
    """What is measured with what, where and how; ``rotation`` has rows a, s, up, ``origin`` is the middle of face 1."""

    gauge: Gauge
    machine: Machine
    options: PlanOptions
    choice: ProbingChoice
    rotation: Array
    origin: Array

    @property
    def placement(self) -> Placement:
        """The same as the package knows it."""
        middle = (self.gauge.position_mm[0::2] + self.gauge.position_mm[1::2]) / 2.0
        c1, c2 = (self.origin + self.rotation[0] * at for at in (middle[0], middle[-1]))
        return Placement(c1, c2, self.rotation[0], self.rotation[2], 1, len(middle))

    def boxes(self) -> tuple[Array, Array]:
        """Corners of the blocks, and of the rail as the last box, in gauge directions."""
        table, at = self.gauge.table, self.gauge.position_mm
        w, h, n = table.block_width_mm / 2.0, table.block_height_mm / 2.0, len(at) // 2
        low = np.column_stack([at[0::2], np.full(n, -w), np.full(n, -h)])
        high = np.column_stack([at[1::2], np.full(n, w), np.full(n, h)])
        rail = (table.rail_width_mm or table.block_width_mm + 20.0) / 2.0
        low = np.vstack([low, [at[0] - OVERHANG_MM, -rail, -h - table.rail_height_mm]])
        return low, np.vstack([high, [at[-1] + OVERHANG_MM, rail, -h]])

    def faces(self) -> list[int]:
        """The faces in the order asked for."""
        blocks = range(self.options.first_block, self.options.last_block + 1)
        fronts, backs = [2 * b - 1 for b in blocks], [2 * b for b in blocks]
        every = sorted(fronts + backs)
        faces: list[int] = []
        for cycle in range(self.options.cycles):
            if self.options.order == "fronts-backs":
                faces += fronts + backs
            else:
                faces += every[::-1] if self.options.order == "up-down" and cycle % 2 else every
        return faces


def draw(seed: int, number: int) -> Scene:
    """Placement ``number`` of a seed."""
    random = np.random.default_rng([seed, number])
    gauge = _gauge(random)
    rotation = _rotation(random)
    blocks = sorted(random.choice(gauge.n_blocks, 2, replace=False) + 1)
    options = PlanOptions(
        int(blocks[0]),
        int(blocks[1]),
        route=str(random.choice(["side", "over"])),
        order=str(random.choice(["blocks", "fronts-backs", "up-down"])),
        cycles=int(random.integers(1, 3)),
        clearance_mm=float(random.uniform(0.3, 10.0)),
        around=int(random.choice([1, -1])),
        height_mm=float(random.uniform(-0.45, 0.45) * gauge.table.block_height_mm),
    )
    standoff = None if random.random() < 0.7 else float(random.uniform(0.5, 8.0))
    choice = ProbingChoice(standoff, float(random.uniform(0.2, 3.0)))
    origin = random.uniform(-500.0, 500.0, 3)
    return Scene(gauge, _machine(random, rotation), options, choice, rotation, origin)


def _gauge(random: np.random.Generator) -> Gauge:
    blocks = int(random.integers(2, 6))
    size, gap = random.uniform(5.0, 20.0, blocks), random.uniform(6.0, 20.0, blocks)
    position = np.cumsum(np.column_stack([size, gap]).ravel())
    position = np.concatenate([[0.0], position[:-1]]) + np.concatenate(
        [[0.0], random.uniform(-5e-3, 5e-3, 2 * blocks - 1)]
    )
    table = GaugeTable(
        name="Attacked",
        serial="A-1",
        material="steel",
        expansion_per_K=11.5e-6,
        expansion_uncertainty_per_K=0.5e-6,
        reference_temperature_C=20.0,
        block_width_mm=float(random.uniform(8.0, 30.0)),
        block_height_mm=float(random.uniform(8.0, 25.0)),
        rail_width_mm=float(random.uniform(10.0, 60.0)) if random.random() < 0.5 else None,
        faces="none",
    )
    certificate = CertificateTable(
        number="A", laboratory="A", date=datetime.date(2026, 1, 1), coverage_factor=2.0, example=True
    )
    return Gauge(table, certificate, position.round(3), position, np.full(2 * blocks, 0.1), "attacked.toml")


def _rotation(random: np.random.Generator) -> Array:
    """Mostly lying, at times steep, at times on its side; rows a, s, up."""
    yaw = random.uniform(-np.pi, np.pi)
    pitch = random.normal(0.0, 0.02) if random.random() < 0.6 else random.uniform(-1.5, 1.5)
    roll = 0.0 if random.random() < 0.7 else random.uniform(-1.6, 1.6)
    a = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    level = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    up = np.cos(roll) * np.cross(level, a) + np.sin(roll) * level
    return np.array([a, np.cross(a, up), up])


def _machine(random: np.random.Generator, rotation: Array) -> Machine:
    radius = float(random.uniform(0.5, 3.0))
    square = random.random() < 0.5  # a head that is turned so that the stylus stands square to the gauge
    down = -rotation[2] if square else np.array([0.0, 0.0, -1.0])
    probe = ConstantTable(
        tip_radius_mm=radius,
        stylus_direction=tuple(float(v) for v in down),
        stylus_length_mm=float(random.uniform(15.0, 80.0)),
        stylus_diameter_mm=float(random.uniform(0.3, 0.95) * 2.0 * radius),
        body_diameter_mm=float(random.uniform(10.0, 40.0)),
    )
    limits = dict.fromkeys("xyz", (-3000.0, 3000.0))
    table = MachineTable(
        name="Attacked", travel_mm=limits, repeatability_um=0.3, measuring_speed_mm_s=3.0, travel_speed_mm_s=50.0
    )
    return Machine(table, probe)


def look(scene: Scene, dialect: str, pieces: list[Piece], program: Program, parts: bool = True) -> list[str]:
    """What is wrong with the path of a text, in words; empty where nothing is."""
    tolerance = PRINTED_MM.get(dialect, 5e-6)
    wrong = differences(scene, pieces, program, tolerance)
    return wrong or [
        *ball_too_near(scene, pieces, tolerance),
        *(parts_too_near(scene, pieces, tolerance) if parts else []),
    ]


def differences(scene: Scene, pieces: list[Piece], program: Program, tolerance: float) -> list[str]:
    """The first probing that is not where the certificate puts its face, or the first stop that is left out."""
    measured = np.array([piece.end for piece in pieces if piece.what == "measure"])
    faces, radius = scene.faces(), scene.machine.probe.tip_radius_mm
    if len(measured) != len(faces):
        return [f"{len(measured)} probings, asked for {len(faces)}"]
    outward = np.where(np.array(faces) % 2 == 1, -1.0, 1.0)
    along = scene.gauge.position_mm[np.array(faces) - 1] + outward * radius
    asked = np.column_stack([along, np.zeros(len(faces)), np.full(len(faces), scene.options.height_mm)])
    off = np.abs((measured - scene.origin) @ scene.rotation.T - asked).max(axis=1)
    if (off > 2.0 * tolerance).any():
        return [f"probing {int(off.argmax()) + 1} is {off.max():.6f} mm off face {faces[int(off.argmax())]}"]
    visited = [pieces[0].start, *(piece.end for piece in pieces)]
    stops = np.array(visited)
    missed = [
        row
        for row, place in enumerate(program.position_mm)
        if np.abs(stops - place).max(axis=1).min() > 2.0 * tolerance
    ]
    return [f"the text never goes to move {missed[0] + 1} of the plan"] if missed else []


def _swept(scene: Scene, pieces: list[Piece], foot_mm: float, length_mm: float) -> Array:
    """Least distance of every piece to every box, for a line above the tip centre, shape ``(pieces, boxes)``."""
    low, high = scene.boxes()
    start = (np.array([piece.start for piece in pieces]) - scene.origin) @ scene.rotation.T
    step = (np.array([piece.end for piece in pieces]) - scene.origin) @ scene.rotation.T - start
    upward = -scene.rotation @ np.array(scene.machine.probe.stylus_direction)
    pair = [np.repeat(one, len(low), axis=0) for one in (start, step)]
    box = [np.tile(one, (len(start), 1)) for one in (low, high)]
    foot, shank = (np.tile(mm * upward, (len(pair[0]), 1)) for mm in (foot_mm, length_mm))
    return least_distance(*pair, foot, shank, *box).reshape(len(start), len(low))


def _own(scene: Scene, pieces: list[Piece]) -> NDArray[np.intp]:
    """The block that each piece ends at or comes from, -1 for none."""
    faces, own, count = scene.faces(), np.full(len(pieces), -1), -1
    for row, piece in enumerate(pieces):
        if piece.what == "measure":
            count += 1
            own[row] = (faces[count] - 1) // 2
            if row + 1 < len(pieces):
                own[row + 1] = own[row]
    return own


def ball_too_near(scene: Scene, pieces: list[Piece], tolerance: float) -> list[str]:
    """The first piece on which the tip ball comes nearer to something than the margin."""
    gap = _swept(scene, pieces, 0.0, 0.0) - scene.machine.probe.tip_radius_mm
    least = np.full_like(gap, scene.options.margin_mm - 2.0 * tolerance)
    own = _own(scene, pieces)
    touching = np.flatnonzero(own >= 0)
    least[touching, own[touching]] = -2.0 * tolerance
    return _near("the ball", gap, least)


def parts_too_near(scene: Scene, pieces: list[Piece], tolerance: float) -> list[str]:
    """The same for the shank and the body of the probe."""
    probe = scene.machine.probe
    length, own = probe.shank_length_mm, _own(scene, pieces)
    touching = np.flatnonzero(own >= 0)
    wrong = []
    for name, radius, foot, long in (
        ("the shank", probe.shank_radius_mm, 0.0, length),
        ("the body", probe.body_diameter_mm / 2.0, length, probe.body_length_mm),
    ):
        gap = _swept(scene, pieces, foot, long) - radius
        least = np.full_like(gap, scene.options.margin_mm - 2.0 * tolerance)
        least[touching, own[touching]] = OWN_BLOCK_MM - 2.0 * tolerance
        wrong += _near(name, gap, least)
    return wrong


def _near(name: str, gap: Array, least: Array) -> list[str]:
    short = gap < least
    if not short.any():
        return []
    piece, box = (int(place) for place in np.argwhere(short)[0])
    return [f"{name} comes within {gap[piece, box]:.4f} mm of box {box + 1} on piece {piece + 1}"]


def attack(seed: int, number: int) -> tuple[Counter[str], list[str]]:
    """Plan placement ``number``, run every text of it; counts, and what went wrong."""
    scene, count, wrong = draw(seed, number), Counter[str](), []
    try:
        settings = make_settings(scene.gauge, scene.machine, scene.machine.probe.tip_radius_mm, scene.choice)
        program = checked_program(scene.placement, scene.gauge, scene.machine, scene.options, settings)
    except InputError as error:
        count["refused: " + error.what.split(" block ")[0].split(" the rail")[0]] += 1
        return count, wrong
    count["planned"] += 1
    for order, (dialect, controller) in enumerate(CONTROLLERS.items()):
        try:
            text = program_text(program, dialect).text
        except InputError as error:
            count["differences"] += 1
            wrong.append(f"placement {number}, {dialect}: {error}")
            continue
        pieces = controller(text, settings.tip_radius_mm, settings.search_mm)
        count["texts"] += 1
        count["pieces swept"] += len(pieces)
        found = look(scene, dialect, pieces, program, parts=order == number % len(CONTROLLERS))
        for words in found:
            count["collisions" if " comes within " in words else "differences"] += 1
        wrong += [f"placement {number}, {dialect}: {words}" for words in found]
    return count, wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--placements", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    began, count = time.perf_counter(), Counter[str]()
    for done in range(asked.placements):
        if done and not done % CHUNK:
            tell(asked.seed, asked.first, done, began, count)
        found, wrong = attack(asked.seed, asked.first + done)
        count += found
        for words in wrong:
            print(words, flush=True)
    tell(asked.seed, asked.first, asked.placements, began, count)
    sys.exit(1 if count["collisions"] or count["differences"] else 0)


def tell(seed: int, first: int, done: int, began: float, count: Counter[str]) -> None:
    """The counts so far."""
    print(f"{done} placements from {first}, seed {seed}, {time.perf_counter() - began:.0f} s")
    for name in sorted({*count, "collisions", "differences"}):
        print(f"{count[name]:9d}  {name}", flush=True)


if __name__ == "__main__":
    main()
