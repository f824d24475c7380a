"""The plan of the seven positions: where the gauge lies, what is measured, and what does not fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import Machine, Travel, read_machine
from stepgauge.machine.virtual import probing_settings, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, faces_in_order, middle_standoff_mm
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from stepgauge.recording import join_recordings
from stepgauge.standards.iso10360 import Choices, Specification, length_test
from stepgauge.standards.iso10360_planned import PlannedPosition, plan_positions
from stepgauge.standards.length_uncertainty import TestConditions
from stepgauge.standards.mpe import Mpe

OPTIONS = PlanOptions(1, 2, cycles=3)


@pytest.fixture(scope="module")
def gauge() -> Gauge:
    return read_gauge("step-gauge-1020")


@pytest.fixture(scope="module")
def machine() -> Machine:
    return read_machine("bridge-cmm")


def settings(gauge: Gauge) -> ProbingSettings:
    standoff = middle_standoff_mm(gauge, 2.0)
    return ProbingSettings(standoff_mm=standoff, retract_mm=standoff)


@pytest.fixture(scope="module")
def planned(gauge: Gauge, machine: Machine) -> list[PlannedPosition]:
    return plan_positions(gauge, machine, OPTIONS, settings(gauge))


def with_travel(machine: Machine, **travel: tuple[float, float]) -> Machine:
    changed = machine.table.travel_mm.model_copy(update=travel)
    return replace(machine, table=machine.table.model_copy(update={"travel_mm": Travel(**changed.model_dump())}))


def test_the_long_gauge_is_long_enough_for_the_bridge_cmm(planned: list[PlannedPosition]) -> None:
    """Its diagonals are 1513 mm long: 66 % of it are 998.8 mm, the gauge has 1010 mm."""
    assert [one.problem for one in planned] == [None] * 7
    assert [one.share >= 0.66 for one in planned] == [True] * 7
    assert planned[3].line_mm == pytest.approx(np.sqrt(700.0**2 + 1200.0**2 + 600.0**2))
    assert planned[3].longest_mm == 1010.0


def test_the_section_is_centred_on_its_line(planned: list[PlannedPosition], gauge: Gauge, machine: Machine) -> None:
    for one in planned:
        start, end = one.orientation.ends_mm(machine.travel_mm)
        assert one.placement is not None
        last = gauge.position_mm[2 * one.blocks[-1] - 1]
        middle = one.placement.to_machine(gauge, [last / 2.0, 0.0, 0.0])
        assert middle == pytest.approx((start + end) / 2.0, abs=1e-9)
        assert np.cross(one.placement.axis, end - start) == pytest.approx(np.zeros(3), abs=1e-9)


def test_every_program_stays_in_the_travel_and_touches_five_lengths(
    planned: list[PlannedPosition], gauge: Gauge, machine: Machine
) -> None:
    for one in planned:
        assert one.program is not None
        position = one.program.position_mm
        assert (position >= machine.travel_mm[:, 0]).all()
        assert (position <= machine.travel_mm[:, 1]).all()
        assert len(one.blocks) == 6
        assert one.program.n_points == 6 * 2 * 3
        lengths = gauge.nominal_mm[2 * np.array(one.blocks[1:]) - 1]
        assert lengths[0] == 30.0
        assert np.diff(lengths).max() < 0.3 * lengths[-1]


def test_the_stylus_is_turned_only_where_it_must(planned: list[PlannedPosition], machine: Machine) -> None:
    """Level gauges are measured as the machine file has it; on diagonals and on end the stylus stands square."""
    assert [one.turned(machine) for one in planned] == [True] * 4 + [False, False, True]
    for one in planned:
        if one.turned(machine):
            assert one.probe is not None
            assert one.placement is not None
            assert np.dot(one.probe.stylus_direction, one.placement.axis) == pytest.approx(0.0, abs=1e-12)
    assert planned[6].tip_off_ram_mm() == pytest.approx(50.0 + 120.0)


def test_a_stylus_that_may_not_turn_is_refused_by_name(gauge: Gauge, machine: Machine) -> None:
    problems = [one.problem or "" for one in plan_positions(gauge, machine, OPTIONS, settings(gauge), "machine")]
    assert "comes too close" in problems[6]
    assert problems[4] == ""


def test_a_gauge_that_is_too_short_says_by_how_much(machine: Machine) -> None:
    short = read_gauge("step-gauge-420")
    problems = [one.problem for one in plan_positions(short, machine, OPTIONS, settings(short))]
    diagonal = np.sqrt(700.0**2 + 1200.0**2 + 600.0**2)
    assert f"short by {0.66 * diagonal - 410.0:.1f} mm; the gauge has 21 blocks" in str(problems[0])
    assert f"short by {0.66 * 1200.0 - 410.0:.1f} mm" in str(problems[5])
    assert "asked 462.0 mm" in str(problems[4])
    assert problems[6] is None, "410 mm are 68 % of 600 mm"


def test_a_travel_with_no_room_says_by_how_much(gauge: Gauge, machine: Machine) -> None:
    flat = with_travel(machine, z=(0.0, 100.0))
    one = plan_positions(gauge, flat, OPTIONS, settings(gauge))[6]
    assert one.program is None
    assert str(one.problem).startswith("does not fit: with blocks 1 to 6 the travel is too small by")
    assert "mm in z" in str(one.problem)


def test_only_the_chosen_blocks_in_their_order() -> None:
    options = PlanOptions(2, 9, cycles=2, order="up-down", only_blocks=(2, 5, 9))
    assert list(faces_in_order(options)) == [(1, f) for f in (3, 4, 9, 10, 17, 18)] + [
        (2, f) for f in (18, 17, 10, 9, 4, 3)
    ]


def test_the_programs_measure_a_known_machine(planned: list[PlannedPosition], gauge: Gauge, machine: Machine) -> None:
    """From text to test: x 10 ppm too long lengthens what lies along (i, j, k) by 10 ppm i^2 of it, in every position.

    Between the tip centres of a bidirectional reading lie the length and the tip's 4 mm.
    """
    bent = replace(
        machine,
        table=machine.table.model_copy(update={"repeatability_um": 0.0002}),
        effects=({"kind": "scale_error", "axis": "x", "ppm": 10.0},),
    )
    recordings = []
    for one in planned:
        assert one.program is not None
        assert one.placement is not None
        assert one.probe is not None
        cmm = replace(bent, probe=one.probe)
        text = render(one.program, DIALECTS["dmis"], None)
        moves = DIALECTS["dmis"].read(text, "program", probing_settings(cmm, 2.0))
        recordings.append(run_program(moves, cmm, gauge, one.placement, 0).recording)
    spec = Specification(Mpe.parse("1.8 + L/350"))
    sure = TestConditions(temperature_u_K=0.0, alignment_mrad=0.0, fixture_um=0.0)
    test = length_test(join_recordings(recordings), gauge, spec, sure, Choices(3.994), machine)
    assert test.complete
    for position in test.positions:
        share = 10e-3 * position.table.axis[0] ** 2
        for one in position.lengths:
            apart_mm = one.length_mm + (4.0 if one.kind == "bidirectional" else 0.0)
            assert one.error_um == pytest.approx([share * apart_mm] * 3, abs=0.001)
    assert test.outcome("bidirectional") == "does not conform"
