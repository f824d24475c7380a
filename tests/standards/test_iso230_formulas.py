"""ISO 230-2 formulas: an example by hand, a published report, and properties. Clauses: ISO 230-2:2006, clause 2."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from stepgauge.standards.iso230 import axis_parameters

ROOT_2 = np.sqrt(2.0)

# Two targets, two runs: means and standard deviations by hand. s of two values is their difference / sqrt(2).
HAND_UP = np.array([[1.0, 3.0], [6.0, 6.0]])  # means 2, 6; s = sqrt(2), 0
HAND_DOWN = np.array([[0.0, 0.0], [1.0, 5.0]])  # means 0, 3; s = 0, 2 sqrt(2)


def test_the_example_by_hand() -> None:
    p = axis_parameters(HAND_UP, HAND_DOWN)
    assert p.up.mean_um == pytest.approx([2.0, 6.0])  # 2.10
    assert p.down.mean_um == pytest.approx([0.0, 3.0])
    assert p.mean_um == pytest.approx([1.0, 4.5])  # 2.11
    assert p.B_at_um == pytest.approx([2.0, 3.0])  # 2.12
    assert p.B_um == pytest.approx(3.0)  # 2.13
    assert p.mean_B_um == pytest.approx(2.5)  # 2.14
    assert p.up.s_um == pytest.approx([ROOT_2, 0.0])  # 2.15
    assert p.down.s_um == pytest.approx([0.0, 2 * ROOT_2])
    assert p.up.R_at_um == pytest.approx([4 * ROOT_2, 0.0])  # 2.16
    # 2.17, target 1: max(2 sqrt2 + 0 + 2; 4 sqrt2; 0) = max(4.83; 5.66); target 2: max(4 sqrt2 + 3; 0; 8 sqrt2)
    assert p.R_at_um == pytest.approx([4 * ROOT_2, 8 * ROOT_2])
    assert p.up.R_um == pytest.approx(4 * ROOT_2)  # 2.18
    assert p.R_um == pytest.approx(8 * ROOT_2)  # 2.19
    assert (p.up.E_um, p.down.E_um) == pytest.approx((4.0, 3.0))  # 2.20
    assert p.E_um == pytest.approx(6.0)  # 2.21: 6 - 0
    assert p.M_um == pytest.approx(3.5)  # 2.22: 4.5 - 1
    assert p.up.A_um == pytest.approx(6.0 - (2.0 - 2 * ROOT_2))  # 2.23
    assert p.down.A_um == pytest.approx((3 + 4 * ROOT_2) - (3 - 4 * ROOT_2))
    assert p.A_um == pytest.approx((3 + 4 * ROOT_2) - (3 - 4 * ROOT_2))  # 2.24: both ends from the second target


# A published ISO 230-2 report of a slit axis at a neutron instrument (ecmc motion test report, 3 November 2021, public
# repository of the ecmc project): deviations and results in um as printed.
ECMC_UP = np.array(
    [
        [3.35, 2.33, 1.72, 2.13, 1.72],
        [-0.26, 0.15, 0.96, 0.56, 0.56],
        [1.02, -0.40, 2.25, 3.06, 4.49],
        [-8.49, -9.10, -7.88, -9.10, -10.53],
        [5.83, 6.24, 6.85, 5.62, 5.62],
    ]
)
ECMC_DOWN = np.array(
    [
        [5.18, 5.18, 4.16, 3.35, 3.14],
        [-3.72, -3.93, -4.33, -4.13, -4.74],
        [-1.83, -1.63, -0.20, -0.61, 0.0],
        [-7.68, -8.09, -7.07, -8.09, -8.49],
        [7.05, 7.25, 7.05, 7.05, 6.44],
    ]
)


def test_a_published_report_agrees() -> None:
    """To its printed 0.01 um (its own values are rounded from more digits, so one unit in the last place and a bit)."""
    p = axis_parameters(ECMC_UP, ECMC_DOWN)

    def agrees(found, printed) -> None:
        assert found == pytest.approx(printed, abs=0.016)

    agrees(p.up.mean_um, [2.25, 0.39, 2.08, -9.02, 6.03])
    agrees(p.down.mean_um, [4.20, -4.17, -0.85, -7.88, 6.97])
    agrees(p.mean_um, [3.23, -1.89, 0.62, -8.45, 6.50])
    agrees(p.B_at_um, [-1.96, 4.56, 2.93, -1.14, -0.94])
    agrees((p.B_um, p.mean_B_um), (4.56, 0.69))
    agrees(p.up.s_um, [0.67, 0.46, 1.88, 0.98, 0.52])
    agrees(p.down.s_um, [0.97, 0.39, 0.83, 0.54, 0.31])
    agrees(p.up.R_at_um, [2.68, 1.86, 7.50, 3.93, 2.08])
    agrees(p.R_at_um, [5.24, 6.28, 8.35, 4.19, 2.59])
    agrees((p.up.R_um, p.down.R_um), (7.50, 3.88))
    agrees((p.up.E_um, p.down.E_um, p.M_um), (15.05, 14.85, 14.95))
    agrees((p.up.A_um, p.down.A_um, p.A_um), (18.06, 16.55, 18.58))


def test_where_the_published_report_leaves_the_definition() -> None:
    """It prints R = 7.50, the larger of R up and R down, where 2.19 asks for the largest R_i of its own table (8.35);
    and E = 14.85, which is E down, where 2.21 asks for the range of the means of both directions: 6.97 + 9.02."""
    p = axis_parameters(ECMC_UP, ECMC_DOWN)
    assert p.R_um == pytest.approx(8.35, abs=0.016)
    assert p.E_um == pytest.approx(6.97 + 9.02, abs=0.016)


DEVIATIONS = hnp.arrays(float, (4, 5), elements=st.floats(-50, 50))


@given(up=DEVIATIONS, down=DEVIATIONS, shift=st.floats(-100, 100))
def test_a_shift_of_the_zero_changes_nothing(up, down, shift) -> None:
    p, q = axis_parameters(up, down), axis_parameters(up + shift, down + shift)
    for name in ("A_um", "E_um", "R_um", "B_um", "mean_B_um", "M_um"):
        assert getattr(q, name) == pytest.approx(getattr(p, name), abs=1e-9)


@given(up=DEVIATIONS, down=DEVIATIONS)
def test_what_contains_what(up, down) -> None:
    p = axis_parameters(up, down)
    small = 1e-9
    assert p.A_um >= p.E_um - small
    assert p.A_um >= max(p.up.A_um, p.down.A_um) - small
    assert p.E_um >= p.M_um - small
    assert p.R_um >= max(p.up.R_um, p.down.R_um, p.B_um) - small
    turned = axis_parameters(down, up)
    assert (turned.A_um, turned.R_um, turned.B_um) == pytest.approx((p.A_um, p.R_um, p.B_um))
    assert turned.mean_B_um == pytest.approx(-p.mean_B_um)


@given(x=DEVIATIONS)
def test_without_reversal_both_directions_are_one(x) -> None:
    p = axis_parameters(x, x)
    assert p.B_um == 0.0
    assert (p.A_um, p.E_um, p.M_um, p.R_um) == pytest.approx((p.up.A_um, p.up.E_um, p.up.E_um, p.up.R_um))


@pytest.mark.parametrize(
    ("up", "down", "words"),
    [
        (np.zeros((3, 1)), np.zeros((3, 2)), "two runs"),
        (np.zeros((3, 2)), np.zeros((2, 2)), "same targets"),
        (np.zeros(3), np.zeros(3), "targets, runs"),
        (np.full((2, 2), np.nan), np.zeros((2, 2)), "finite"),
    ],
)
def test_what_is_no_test_is_refused(up, down, words) -> None:
    with pytest.raises(ValueError, match=words):
        axis_parameters(up, down)
