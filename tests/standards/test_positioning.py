"""Recordings of a step gauge as positioning: what was put in comes out, in the sign of ISO 230-2."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.standards.positioning import carry, positioning_test
from tests.build import make_gauge
from tests.standards.made import START_MM, TIP_MM, joined, made

GAUGE = make_gauge(blocks=6, deviation_um=np.array([0, 0.4, -0.3, 0.2, 0.1, 0.5, -0.2, 0.3, 0.6, -0.1, 0.2, 0.4]))
SCATTER = (0.0, 0.6, -0.3, 0.5, -0.8)


def face_mm(face: int) -> float:
    return float(GAUGE.position_mm[face - 1])


def rules_met(test, index: int = 0) -> dict[str, bool | None]:
    return {rule.asks: rule.met for rule in test.axes[index].rules}


def test_scale_error_and_reversal_in_closed_form() -> None:
    """The machine indicates 20 ppm too much, and 1.5 um more on the way up than on the way down.

    The axis then reaches less than it indicates: the deviation at a target falls by 20 um/m, E of each direction is
    20 ppm of the 100 mm between the first and the last block, and B is -1.5 um everywhere.
    """

    def error(cycle: int, face: int) -> float:
        return 20e-3 * face_mm(face) + (0.75 if face % 2 else -0.75) + SCATTER[cycle - 1]

    test = positioning_test(made(GAUGE, error, cycles=5), GAUGE, TIP_MM)
    p = test.axes[0].parameters
    span = float(np.ptp(test.axes[0].targets.gauge_mm))
    assert p.B_at_um == pytest.approx(np.full(6, -1.5), abs=1e-6)
    assert (p.up.E_um, p.down.E_um, p.M_um) == pytest.approx([20e-3 * span] * 3, abs=1e-6)
    assert p.E_um == pytest.approx(20e-3 * span + 1.5, abs=1e-6)
    s = np.std(SCATTER, ddof=1)
    assert p.up.R_um == pytest.approx(4 * s, abs=1e-6)
    assert p.R_um == pytest.approx(4 * s + 1.5, abs=1e-6)
    assert p.A_um == pytest.approx(p.E_um + 4 * s, abs=1e-6)
    assert np.all(np.diff(p.mean_um) < 0), "an axis that indicates too much reaches too little"


def test_faces_as_they_are_mix_the_scale_into_the_reversal() -> None:
    """A block is 10 mm long: 20 ppm of it are 0.2 um that --pair faces takes for reversal."""
    recording = made(GAUGE, lambda _, face: 20e-3 * face_mm(face), cycles=5)
    middle = positioning_test(recording, GAUGE, TIP_MM).axes[0].parameters
    faces = positioning_test(recording, GAUGE, TIP_MM, "faces").axes[0].parameters
    assert middle.B_um == pytest.approx(0.0, abs=1e-6)
    assert faces.mean_B_um == pytest.approx(20e-3 * GAUGE.block_size_mm.mean(), abs=1e-6)


@given(slope=st.floats(-1, 1), offset=st.floats(-100, 100), turn=st.booleans())
def test_carrying_is_exact_on_straight_lines(slope: float, offset: float, turn: bool) -> None:
    at = np.array([0.0, 20.0, 45.0, 60.0])
    to = at + (5.0 if turn else -5.0)
    assert carry(slope * at + offset, at, to) == pytest.approx(slope * (to - at), abs=1e-9)


def test_a_gauge_turned_round_tells_the_same_of_the_axis() -> None:
    """The same machine, x indicated 15 ppm too much and 1 um more when x rises, gauge along +x and along -x."""

    def along(sign: float, across: float = 0.0):
        start_x = START_MM[0] if sign > 0 else START_MM[0] + face_mm(12)

        def error(cycle: int, face: int) -> float:
            x = start_x + sign * face_mm(face)
            rising = sign if face % 2 else -sign
            return sign * (15e-3 * x + 0.5 * rising) + SCATTER[cycle - 1]

        start = np.array([start_x, *START_MM[1:]])
        axis = (sign, across, 0)
        return positioning_test(made(GAUGE, error, axis, cycles=5, start_mm=start), GAUGE, TIP_MM).axes[0]

    one, other = along(1.0), along(-1.0)
    assert (one.reversed, other.reversed) == (False, True)
    assert (one.axis, other.axis) == ("x", "x")
    assert other.parameters.mean_B_um == pytest.approx(one.parameters.mean_B_um, abs=1e-6) == -1.0
    assert other.parameters.E_um == pytest.approx(one.parameters.E_um, abs=1e-3)
    for test in (one, other):
        assert np.all(np.diff(test.targets.machine_mm) > 0)
        assert np.all(np.diff(test.parameters.mean_um) < 0)
    assert one.targets.machine_mm[0] == pytest.approx(START_MM[0] + 5.0, abs=0.02)

    turned = along(-1.0, 0.05)  # 2.9 deg off: several axes move, and the targets are told on x all the same
    assert (turned.axis, turned.nearest, turned.reversed) == (None, "x", True)
    assert turned.parameters.mean_B_um == pytest.approx(-1.0, abs=1e-6)
    assert np.all(np.diff(turned.targets.machine_mm) > 0)
    assert np.all(np.diff(turned.parameters.mean_um) < 0)
    assert turned.parameters.up.mean_um == pytest.approx(other.parameters.up.mean_um, abs=0.01)


def test_the_tip_from_a_block_hides_a_constant_reversal_and_says_so() -> None:
    recording = made(GAUGE, lambda _, face: 0.75 if face % 2 else -0.75, cycles=5)
    own, stated = positioning_test(recording, GAUGE), positioning_test(recording, GAUGE, TIP_MM)
    assert own.axes[0].parameters.B_um == pytest.approx(0.0, abs=1e-6)
    assert stated.axes[0].parameters.B_um == pytest.approx(1.5, abs=1e-6)
    assert rules_met(own)["targets approached in both directions"] is False
    assert rules_met(stated)["targets approached in both directions"] is True


def test_temperature_of_the_gauge_is_corrected_or_missed() -> None:
    """A gauge 2 K warm on a perfect machine has no deviation; without its temperature it looks 23 ppm long."""
    recording = made(GAUGE, cycles=5, temperature_C=22.0)
    assert positioning_test(recording, GAUGE, TIP_MM).axes[0].parameters.E_um == pytest.approx(0.0, abs=1e-6)
    blind = type(recording)(recording.frame.drop(columns="gauge_temperature_C"), {}, recording.path)
    test = positioning_test(blind, GAUGE, TIP_MM)
    assert test.axes[0].parameters.M_um == pytest.approx(23e-3 * 100.0, rel=1e-3)
    assert rules_met(test)["temperature of the reference known"] is False


def test_rules_name_what_is_short() -> None:
    few = positioning_test(made(GAUGE, cycles=3, faces=[1, 2, 3, 4, 5, 6]), GAUGE, TIP_MM)
    met = rules_met(few)
    assert met["5 runs in each direction"] is False
    assert met["5 targets per metre, 5 at least"] is False
    assert met["steps that differ, so that periodic errors are sampled"] is False
    assert met["one axis moves at a time"] is True


def test_a_diagonal_is_no_axis() -> None:
    test = positioning_test(made(GAUGE, axis=(1, 1, 0), cycles=5), GAUGE, TIP_MM)
    assert test.axes[0].axis is None
    assert rules_met(test)["one axis moves at a time"] is False
    assert test.axes[0].off_deg == pytest.approx(45.0)


def test_an_incomplete_run_and_a_lone_face_are_left_out_by_name() -> None:
    frame = made(GAUGE, cycles=6).frame
    frame = frame[~((frame["cycle"] == 4) & (frame["face"] > 8)) & (frame["face"] != 6)]
    test = positioning_test(type(made(GAUGE))(frame, {}, "r.csv"), GAUGE, TIP_MM).axes[0]
    assert test.runs == (1, 2, 3, 5, 6)
    assert test.targets.block.tolist() == [1, 2, 4, 5, 6]
    assert [part.what for part in test.excluded] == ["cycles 4", "faces 5"]


def test_every_placement_is_an_axis() -> None:
    test = positioning_test(joined(made(GAUGE, cycles=5), made(GAUGE, axis=(0, 1, 0), cycles=5)), GAUGE, TIP_MM)
    assert [one.axis for one in test.axes] == ["x", "y"]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"cycles": 1}, "too few runs"),
        ({"cycles": 5, "faces": [1, 3, 5]}, "no two blocks"),
        ({"cycles": 5, "faces": [1, 2, 3]}, "no two blocks"),
    ],
)
def test_what_cannot_be_evaluated(changed: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        positioning_test(made(GAUGE, **changed), GAUGE, TIP_MM)


def test_fronts_alone_give_no_tip_diameter() -> None:
    with pytest.raises(InputError, match="no block has both faces"):
        positioning_test(made(GAUGE, cycles=5, faces=[1, 3, 5]), GAUGE)


def test_another_tip_or_another_gauge_is_found() -> None:
    with pytest.raises(InputError, match=r"another tip \(a radius\?\)"):
        positioning_test(made(GAUGE, cycles=5), GAUGE, TIP_MM / 2.0)
    with pytest.raises(InputError, match="is not where"):
        positioning_test(made(GAUGE, cycles=5), make_gauge(blocks=6, size=12.0, gap=13.0), TIP_MM)
