"""Slips of a hand in what goes into fourteen verbs: refused, said, within U, or accepted silently.

``python -m benchmarks.attack.slips [COUNT] [SEED] [VERB]`` puts COUNT slips (100) into each verb. Every measurement is
made twice: of a machine that keeps its limit and of one that does not, so that a slip can turn a decision either way.
Judged are slips that the data at hand can show; ``docs/readings.md`` lists those that no data can show.
"""

from __future__ import annotations

import random
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.attack.slip_kinds import AXIS, CERTIFICATE, CHANNELS, GAUGE_FILE, GAUGE_TABLE, SPHERE, Kinds
from stepgauge.axis.recording import AxisRecording
from stepgauge.axis.units import AxisUnits
from stepgauge.compensation import TableOptions, TipRadius, axis_faces, make_table
from stepgauge.conditions import Conditions, require_statement
from stepgauge.dcc.elements import to_bytes
from stepgauge.dcc.gauge_read import import_gauge, write_gauge
from stepgauge.dcc.gauge_write import gauge_certificate
from stepgauge.diagnosis.engine import diagnose
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import Evaluation, evaluate
from stepgauge.evaluation.files import evaluation_to_dict, write_evaluation
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.history.entries import read_entries
from stepgauge.machine.file import Machine, read_machine
from stepgauge.montecarlo import recording_model
from stepgauge.physics.directions import evenly_spread_points
from stepgauge.probes.files import read_points
from stepgauge.recording import Recording, read_recording, write_recording
from stepgauge.reports.certificate_file import read_laboratory
from stepgauge.standards.drift import drift_test, read_drift
from stepgauge.standards.iso230_decision import Requirement, parameters_um
from stepgauge.standards.iso10360 import Choices, Specification, length_test
from stepgauge.standards.iso10360_5 import ProbingLimits, TestSphere, probing_test
from stepgauge.standards.iso10360_5_files import decide_test
from stepgauge.standards.length_uncertainty import TestConditions
from stepgauge.standards.mpe import Mpe
from stepgauge.standards.positioning import positioning_test
from stepgauge.standards.positioning_axis import axis_positioning_test

Array = NDArray[np.float64]
BLOCKS, CYCLES, TIP_MM = 12, 5, 3.994
ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Answer:
    """What a verb says: numbers with their U, um, the decision, and every note."""

    um: Array
    expanded_um: Array
    decision: str
    notes: frozenset[str]

    @classmethod
    def of(cls, um: object, expanded_um: object, conditions: Conditions, decision: str = "") -> Answer:
        """From numbers, or one U for all of them."""
        values = np.atleast_1d(np.asarray(um, float))
        return cls(
            values, np.broadcast_to(np.asarray(expanded_um, float), values.shape), decision, frozenset(conditions.notes)
        )


@dataclass
class World:
    """A measurement on disk: a table, the gauge's files, and how wrong the machine is."""

    folder: Path
    wrong: bool
    table: pd.DataFrame
    comments: dict[str, str]
    gauge: Gauge
    machine: Machine = field(default_factory=lambda: read_machine("bridge-cmm"))
    xml: str = ""

    def recording(self) -> Recording:
        """The table, written and read as a file of a user."""
        path = self.folder / "recording.csv"
        write_recording(path, Recording(self.table, self.comments, str(path)))
        return read_recording(path)


def gauge_world(folder: Path, wrong: bool, seed: int) -> World:
    """Twelve blocks of the shipped gauge along x, five cycles; 1 um/m of error, or 40."""
    gauge = read_gauge("step-gauge-420")
    noise = np.random.default_rng(seed)
    face = np.tile(np.arange(1, 2 * BLOCKS + 1), CYCLES)
    way = np.where(face % 2 == 1, 1.0, -1.0)
    at = gauge.position_mm[face - 1] * (1.0 + (40e-6 if wrong else 1e-6) + gauge.table.expansion_per_K * 0.3)
    table = pd.DataFrame({"placement": 1, "cycle": np.arange(len(face)) // (2 * BLOCKS) + 1, "face": face})
    table["x_mm"] = np.round(100.0 + at - way * TIP_MM / 2.0 + noise.normal(0.0, 3e-4, len(face)), 5)
    table["y_mm"], table["z_mm"] = 200.0, 300.0
    table["approach_i"], table["approach_j"], table["approach_k"] = way, 0.0, 0.0
    table["time_s"] = 2.0 * np.arange(len(face))
    table["gauge_temperature_C"] = np.round(20.3 + noise.normal(0.0, 0.01, len(face)), 2)
    table["scale_temperature_x_C"] = np.round(20.3 + noise.normal(0.0, 0.01, len(face)), 2)
    comments = {"measured_at": "2026-05-04", "temperature_convention": "as_read", "gauge_serial": gauge.table.serial}
    return World(folder, wrong, table, comments, gauge)


def axis_world(folder: Path, wrong: bool, seed: int) -> World:
    """Eleven targets over 500 mm, five runs both ways, a laser with 0.01 um."""
    noise = np.random.default_rng(seed)
    run, way, place = (np.ravel(one) for one in np.indices((5, 2, 11)))
    order = np.where(way == 0, place, 10 - place)
    target = 50.0 * order
    um = (
        (12.0 if wrong else 3.0) * np.sin(target / 90.0)
        + noise.normal(0.0, 0.3, len(run))
        + np.where(way == 0, 0.3, -0.3)
    )
    table = pd.DataFrame({"placement": 1, "cycle": run + 1, "way": 1 - 2 * way, "target": target})
    table["reading"] = np.round(target + um * 1e-3, 5)
    table["room_C"] = np.round(20.0 + 1e-3 * np.arange(len(run)) + noise.normal(0.0, 0.01, len(run)), 2)
    return World(folder, wrong, table, {}, read_gauge("step-gauge-420"))


def sphere_world(folder: Path, wrong: bool, seed: int) -> World:
    """Twenty-five points on a test sphere of 25 mm."""
    noise = np.random.default_rng(seed)
    every = evenly_spread_points(50)
    normal = every[np.argsort(every[:, 2])[25:]]
    size = 15.5 + noise.normal(0.0, 4e-3 if wrong else 4e-4, 25)
    points = np.round(np.array([200.123, 150.456, 80.789]) + normal * size[:, None], 5)
    table = pd.DataFrame(points, columns=["x_mm", "y_mm", "z_mm"])
    table[["approach_i", "approach_j", "approach_k"]] = -normal
    return World(folder, wrong, table, {}, read_gauge("step-gauge-420"))


def drift_world(folder: Path, wrong: bool, seed: int) -> World:
    """A day of two displacements and a room, every five minutes."""
    noise, hours = np.random.default_rng(seed), np.arange(289) / 12.0
    size = 9.0 if wrong else 2.5
    table = pd.DataFrame({"time_s": 3600.0 * hours})
    for name, late in (("x1_um", 1.0), ("y1_um", 2.0)):
        table[name] = np.round(size * np.sin(hours / 4.0 - late) + noise.normal(0.0, 0.05, 289), 3)
    table["room_C"] = np.round(20.0 + np.sin(hours / 4.0) + noise.normal(0.0, 0.01, 289), 2)
    return World(folder, wrong, table, {}, read_gauge("step-gauge-420"))


def certificate_world(folder: Path, wrong: bool, seed: int) -> World:
    """The gauge's certificate as its laboratory would send it."""
    gauge, form = read_gauge("step-gauge-420"), read_laboratory(ROOT / "examples/certificate/gauge-laboratory.toml")
    xml = to_bytes(gauge_certificate(gauge, form)).decode()
    return World(folder, wrong, pd.DataFrame(), {}, gauge, xml=xml)


def _evaluated(world: World) -> tuple[Evaluation, Array, Array]:
    found = evaluate(world.recording(), world.gauge)
    (one,) = found.results
    own = world.gauge.u_um[one.face - 1] ** 2 + np.where(one.face % 2 == 1, one.sf_um, one.sb_um) ** 2 / one.count
    u = np.sqrt(own + own[0] + (2e3 * one.radius.u_mm) ** 2)
    um = np.concatenate([one.xf_um, one.xb_um, one.xm_um, [1e3 * one.radius.r_eff_mm]])
    return found, um, 2.0 * np.concatenate([u, u, u, [max(1e3 * one.radius.u_mm, 0.1)]])


def run_evaluate(world: World) -> Answer:
    found, um, expanded = _evaluated(world)
    return Answer.of(um, expanded, found.conditions)


def run_model(world: World) -> Answer:
    """Budget and uncertainty: their values are those of the model, with its notes."""
    model = recording_model(world.recording(), world.machine, world.gauge)
    _, _, expanded = _evaluated(world)
    (one,) = model.nominal.results
    um = np.concatenate([one.xf_um, one.xb_um, one.xm_um, [1e3 * one.radius.r_eff_mm]])
    return Answer.of(um, expanded, model.conditions)


def run_signed(world: World) -> Answer:
    """A certificate, a place in a fleet: not without a statement."""
    found, um, expanded = _evaluated(world)
    require_statement(found.conditions, found.path)
    return Answer.of(um, expanded, found.conditions)


def run_compensate(world: World) -> Answer:
    found, _, _ = _evaluated(world)
    faces = axis_faces(evaluation_to_dict(found), "evaluation.json", "x", TipRadius(TIP_MM / 2.0))
    table = make_table(faces, TableOptions())
    u = 2.0 * np.r_[table.u_positive_um, table.u_negative_um]
    own = Answer.of(np.r_[table.positive_um, table.negative_um], np.maximum(u, 0.3), found.conditions)
    return replace(own, notes=frozenset(note for note in table.notes if note in own.notes))


def run_history(world: World) -> Answer:
    found, _, _ = _evaluated(world)
    folder = world.folder / "history"
    write_evaluation(folder, found)
    (one,) = read_entries(folder / "evaluation.json", world.folder, "")
    um = [one.scale_ppm, one.reversal_um, 1e3 * one.r_eff_mm]
    return Answer.of(um, [max(2.0 * one.u_scale_ppm, 1.0), 1.0, 0.5], found.conditions)


def run_import_gauge(world: World) -> Answer:
    """The gauge file of a certificate: its positions and their U, and what is told; sizes in um beside them."""
    path = world.folder / "gauge.xml"
    path.write_text(world.xml)
    found = import_gauge(path)
    gauge = write_gauge(world.folder / "gauge.toml", found)
    expanded = gauge.u_um * gauge.certificate.coverage_factor
    table = gauge.table
    um = [*(gauge.position_mm * 1e3), *expanded, table.expansion_per_K * 1e6 * 420.0, table.reference_temperature_C]
    limit = [*np.maximum(world.gauge.u_um * 2.0, 0.1), *np.full(len(expanded), 0.2), 100.0, 1.0]
    return Answer(np.array(um), np.array(limit), "", frozenset(found.report))


def run_diagnose(world: World) -> Answer:
    """What is found, beside the verdict; the slope of the scale is the number."""
    recording = world.recording()
    found = diagnose(recording, world.gauge, world.machine, separations=False)
    said = {f"{one.kind} {sorted(one.parameters)}" for one in found.findings}
    said |= {*found.remarks, *(f"located in {one.covariate}" for one in found.located)}
    ppm = [one.parameters["ppm"].value for one in found.findings if one.kind == "scale_error"]
    return Answer(np.array([sum(ppm) * 0.23]), np.array([0.5]), found.verdict, frozenset(said))


def run_iso230(world: World) -> Answer:
    asked = Requirement({"A": 6.0, "R": 4.0}, 0.8)
    test = positioning_test(world.recording(), world.gauge, TIP_MM, requirement=asked)
    return _decided(test.axes[0].parameters, test.requirement, test.conditions, test.axes[0].rules)


def run_axis(world: World) -> Answer:
    units = AxisUnits.of("mm", "um")
    recording = AxisRecording(world.table, "axis", units, "laser", {}, "axis.csv")
    test = axis_positioning_test(recording, None, Requirement({"A": 15.0, "R": 4.0}, 0.8))
    return _decided(test.axes[0].parameters, test.requirement, test.conditions, test.axes[0].rules)


def _decided(parameters: object, asked: Requirement, conditions: Conditions, rules: object) -> Answer:
    values = parameters_um(parameters)  # type: ignore[arg-type]
    outcomes = ", ".join(asked.outcomes(values).values())
    answer = Answer.of([values[name] for name in ("A", "E", "R", "B")], 0.8, conditions, outcomes)
    unmet = {rule.found for rule in rules if rule.met is False}  # type: ignore[attr-defined]
    return replace(answer, notes=answer.notes | unmet)


def run_iso10360(world: World) -> Answer:
    test = length_test(
        world.recording(),
        world.gauge,
        Specification(Mpe.parse("1.8 + L/350"), 1.5),
        TestConditions(temperature_u_K=0.05, alignment_mrad=0.1, fixture_um=0.1),
        Choices(tip_diameter_mm=TIP_MM),
    )
    lengths = test.lengths("bidirectional")
    um = np.concatenate([one.error_um for one in lengths])
    expanded = np.concatenate([np.full(len(one.error_um), one.expanded_um) for one in lengths])
    said = f"{test.outcome('bidirectional')}, {test.repeatability_outcome('bidirectional')}"
    answer = Answer.of(um, np.maximum(expanded, 1.0), test.conditions, said)
    return replace(answer, notes=answer.notes | {rule.found for rule in test.rules if rule.met is False})


def run_sphere(world: World) -> Answer:
    path = world.folder / "sphere.csv"
    world.table.to_csv(path, index=False)
    limits = ProbingLimits({"P_Form": 5.0, "P_Size": 4.0})
    test = probing_test([read_points(path)], TestSphere(25.0, 0.1, 0.1, 0.03, True), [6.0], limits)
    um = [one.value_um for one in test.values]
    return Answer.of(
        um, 0.5, test.conditions, decide_test(test).text if test.conditions.preventing else str(test.outcome)
    )


def run_drift(world: World) -> Answer:
    path = world.folder / "drift.csv"
    world.table.to_csv(path, index=False)
    test = drift_test(read_drift(str(path)), "etve", Requirement({"x1": 8.0, "y1": 8.0}, 0.6))
    said = ", ".join(test.requirement.outcomes(test.values_um).values())
    return Answer.of(list(test.values_um.values()), 0.6, test.conditions, said)


@dataclass(frozen=True)
class Verb:
    """A verb with what it is given and the kinds of slips in that."""

    make: Callable[[Path, bool, int], World]
    run: Callable[[World], Answer]
    kinds: Kinds


OF_GAUGE = GAUGE_TABLE | GAUGE_FILE
VERBS = {
    "evaluate": Verb(gauge_world, run_evaluate, OF_GAUGE),
    "budget": Verb(gauge_world, run_model, OF_GAUGE),
    "uncertainty": Verb(gauge_world, run_model, OF_GAUGE),
    "iso230": Verb(gauge_world, run_iso230, OF_GAUGE),
    "iso230 of one axis": Verb(axis_world, run_axis, AXIS),
    "iso10360": Verb(gauge_world, run_iso10360, OF_GAUGE),
    "iso10360-5": Verb(sphere_world, run_sphere, SPHERE),
    "iso230-3": Verb(drift_world, run_drift, CHANNELS),
    "compensate": Verb(gauge_world, run_compensate, OF_GAUGE),
    "report and dcc": Verb(gauge_world, run_signed, OF_GAUGE),
    "history": Verb(gauge_world, run_history, OF_GAUGE),
    "fleet": Verb(gauge_world, run_signed, OF_GAUGE),
    "dcc import-gauge": Verb(certificate_world, run_import_gauge, CERTIFICATE),
    "diagnose": Verb(gauge_world, run_diagnose, OF_GAUGE),
}


def attack(verb: Verb, count: int, seed: int, folder: Path) -> tuple[Counter[str], list[str]]:
    """Slips into one verb: what came of them, and a line for each that was silent or turned a decision to conforms."""
    pick, outcomes, silent = random.Random(seed), Counter[str](), list[str]()
    worlds = [verb.make(folder, wrong, seed) for wrong in (False, True)]
    good = [verb.run(world) for world in worlds]
    for number in range(count):
        index, name = number % 2, pick.choice(sorted(verb.kinds))
        world = replace(worlds[index], table=worlds[index].table.copy(), comments=dict(worlds[index].comments))
        said = verb.kinds[name](world, pick)
        outcome = judged(verb, world, good[index])
        outcomes[outcome] += 1
        if outcome in ("silent", "turned to conforms"):
            silent.append(f"{outcome}: {name}: {said} ({'wrong' if index else 'good'} machine)")
    return outcomes, silent


def judged(verb: Verb, world: World, good: Answer) -> str:
    """What a verb makes of a slip."""
    try:
        found = verb.run(world)
    except InputError:
        return "refused"
    if "no statement" in found.decision.casefold():
        return "no statement"
    decisions = zip(good.decision.split(", "), found.decision.split(", "), strict=False)
    if any(before != after == "conforms" for before, after in decisions):
        return "turned to conforms"
    if _plain(found.notes) - _plain(good.notes):
        return "said"
    same = len(found.um) == len(good.um)
    moved = np.nanmax(np.abs(found.um - good.um) / good.expanded_um, initial=0.0) if same else np.inf
    return "within U" if moved <= 1.0 and found.decision == good.decision else "silent"


def _plain(notes: frozenset[str]) -> set[str]:
    """Notes without their numbers: one that was there before says nothing new by another size."""
    return {re.sub(r"[-+]?\d[\d.e-]*", "#", note) for note in notes}


def main(count: int = 100, seed: int = 47, only: str = "") -> int:
    """All verbs, or one; the number of slips that were silent."""
    total, bad = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for place, (name, verb) in enumerate(VERBS.items()):
            if only not in ("", name):
                continue
            outcomes, silent = attack(verb, count, seed + 1000 * place, Path(folder))
            total, bad = total + count, bad + len(silent)
            print(f"{name}: {', '.join(f'{n} {what}' for what, n in sorted(outcomes.items()))}", flush=True)
            for line in silent:
                print(f"    {line}", flush=True)
    print(f"{bad} of {total} silent")
    return bad


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:3]]
    sys.exit(int(main(*numbers, *sys.argv[3:]) > 0))
