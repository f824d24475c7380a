"""SafePaths between the measuring path and wherever the machine stands: clear of the gauge, or none."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.live.safe_path import INSIDE_MM, SafePaths
from tests.live.made import lying, small_gauge, small_machine, small_program

GAUGE, MACHINE = small_gauge(), small_machine()
LIES = lying(GAUGE)
WAYS = SafePaths(MACHINE, GAUGE, LIES)
PROGRAM = small_program(GAUGE, MACHINE)
PATH = list(PROGRAM.position_mm[~PROGRAM.is_measure])


@given(st.tuples(st.floats(1.0, 399.0), st.floats(1.0, 399.0), st.floats(1.0, 299.0)))
def test_every_way_is_clear_and_inside_the_travel(place: tuple[float, float, float]) -> None:
    here = np.array(place)
    free = WAYS.gap_mm(here, here) >= WAYS.margin_mm
    try:
        way, number = WAYS.to_path(here, [], PATH)
    except InputError:
        above = np.array([*here[:2], 299.0])
        assert not free or WAYS.gap_mm(here, above) < WAYS.margin_mm
        return
    assert free
    assert (way[-1] == PATH[number]).all()
    for a, b in pairwise([here, *way]):
        assert WAYS.gap_mm(a, b) >= WAYS.margin_mm - 1e-5
    assert all((one >= MACHINE.travel_mm[:, 0]).all() and (one <= MACHINE.travel_mm[:, 1]).all() for one in way)


@pytest.mark.parametrize("gap_mm", [0.0, 0.01, 0.3, 2.9])
def test_the_way_out_begins_with_a_step_back_from_a_near_face(gap_mm: float) -> None:
    face = GAUGE.position_mm[2]
    here = LIES.to_machine(GAUGE, [face - 2.0 - gap_mm, 0.0, 0.0])
    start = LIES.to_machine(GAUGE, [face - 2.0 - 3.0, 0.0, 0.0])
    way = WAYS.out(here, [start])
    assert (way[0] == start).all() == (gap_mm < WAYS.margin_mm)
    assert way[-1][2] == pytest.approx(300.0 - INSIDE_MM)
    assert WAYS.gap_mm(way[-1], way[-1]) > 1.0


def test_inside_a_block_there_is_no_way() -> None:
    here = LIES.to_machine(GAUGE, [5.0, 0.0, 0.0])
    for find in (lambda: WAYS.out(here, [here]), lambda: WAYS.to_path(here, [here], PATH)):
        with pytest.raises(InputError, match="brought by hand to a place above the gauge"):
            find()
