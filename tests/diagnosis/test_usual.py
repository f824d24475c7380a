"""What size is usual: given the gauge, the machine and its probe."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stepgauge.cli import main
from stepgauge.diagnosis.laws.grids import shape_range
from stepgauge.diagnosis.laws.usual import size_of_shape, usual_size
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.effects import effect_kinds
from stepgauge.effects.following import SAME_PART
from stepgauge.gauge.certified import Gauge
from tests.diagnosis.made import gauge, machine

PRIORS, KINDS = shipped_priors(), effect_kinds()
STEPS, ON = gauge(), machine()


def stretched(factor: float) -> Gauge:
    return replace(STEPS, position_mm=STEPS.position_mm * factor, nominal_mm=STEPS.nominal_mm * factor)


def usual(kind: str, *given: object) -> float:
    return usual_size(KINDS[kind], PRIORS, *given).size  # type: ignore[arg-type]


def test_a_bar_twice_as_long_sags_sixteen_times_as_much_and_one_twice_as_high_a_quarter() -> None:
    once = usual("gauge_bending", STEPS)
    assert usual("gauge_bending", stretched(2.0)) == pytest.approx(16.0 * once)
    high = replace(STEPS, table=STEPS.table.model_copy(update={"rail_height_mm": 60.0}))
    assert usual("gauge_bending", high) == pytest.approx(once / 4.0)


def test_a_short_bar_does_not_sag_by_tens_of_micrometres() -> None:
    assert usual("gauge_bending", stretched(0.1)) * PRIORS.sizes.above < 0.01


@pytest.mark.parametrize("kind", ["scale_error", "squareness", "reversal_error"])
def test_errors_of_axes_grow_with_the_repeatability_and_those_of_the_room_do_not(kind: str) -> None:
    coarse = machine(noise_um=10.0 * ON.table.repeatability_um)
    assert usual(kind, STEPS, coarse) == pytest.approx(10.0 * usual(kind, STEPS, ON))
    assert usual("thermal_drift", STEPS, coarse) == usual("thermal_drift", STEPS, ON)


def test_a_block_defect_is_one_beyond_the_certificate() -> None:
    poor = replace(STEPS, u_um=STEPS.u_um + 2.0)
    assert usual("block_defect", poor) > 15.0 * usual("block_defect")


def test_of_a_temperature_that_is_corrected_only_the_coefficient_is_left() -> None:
    kind = KINDS["thermal_expansion_of"]
    sizes = {
        (column, of): usual_size(kind, PRIORS, choices={"column": column, "of": of}).size
        for column in ("gauge_temperature_C", "scale_temperature_x_C", "bridge_C")
        for of in ("gauge", "x")
    }
    corrected = {("gauge_temperature_C", "gauge"), ("scale_temperature_x_C", "x")}
    assert {size for which, size in sizes.items() if which in corrected} == {1.0}
    assert {size for which, size in sizes.items() if which not in corrected} == {5.0}


def test_a_drift_that_ends_within_an_hour_moves_by_what_is_usual_in_an_hour() -> None:
    shapes: list[dict[str, float | None]] = [{"time_constant_h": hours} for hours in (None, 0.01, 0.1, 0.5)]
    for shape in shapes[1:]:
        assert size_of_shape("thermal_drift", shape, shapes) * shape["time_constant_h"] == pytest.approx(1.0)
    for hours in (1.0, 30.0):
        assert size_of_shape("thermal_drift", {"time_constant_h": hours}, shapes) == 1.0
    assert size_of_shape("scale_warm_up", {"time_constant_h": 0.1}, shapes) == 1.0


def test_a_linear_drift_is_as_quick_as_the_slowest_that_is_not_linear() -> None:
    linear = {"time_constant_h": None}
    for longest in (0.01, 0.3):
        assert size_of_shape("thermal_drift", linear, [linear, {"time_constant_h": longest}]) == 1.0 / longest
    assert size_of_shape("thermal_drift", linear, [linear, {"time_constant_h": 20.0}]) == 1.0


def test_a_longer_stylus_bends_with_its_third_power() -> None:
    long = replace(ON, probe=ON.probe.model_copy(update={"stylus_length_mm": 100.0}))
    assert usual("kinematic_pretravel", STEPS, long) == pytest.approx(8.0 * usual("kinematic_pretravel", STEPS, ON))


def test_a_period_is_between_two_steps_of_the_display_and_the_travel() -> None:
    period = next(p for p in KINDS["periodic_scale_error"].parameters() if p.decades)
    assert shape_range(period, ON, "y") == (0.004, 1200.0)
    shown = replace(ON, stated=ON.stated.model_copy(update={"resolution_um": 5.0}))
    assert shape_range(period, shown, "x") == (0.01, 700.0)


def test_effects_tells_what_is_usual_here(capsys: pytest.CaptureFixture[str]) -> None:
    main(["list", "effects", "gauge_bending", "periodic_scale_error", "-g", "step-gauge-420", "-m", "bridge-cmm"])
    said = capsys.readouterr().out
    for words in ("usual size: 1.7 um of sag", "410 mm long (power 4)", "y 0.004 to 1200", "prior odds: 1 to 20"):
        assert words in said
    main(["list", "effects", "scale_error"])
    assert "grows with the repeatability of the machine (--machine)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("bridge_top_C", "bridge_bottom_C", True),
        ("Column_left_temperature_C", "column_right_temperature_C", True),
        ("bridge_top_C", "room_C", False),
        ("bridge_top_C", "", False),
        ("scale_temperature_x_C", "scale_temperature_y_C", False),
        ("temperature_1_C", "temperature_2_C", False),
    ],
)
def test_two_thermometers_on_one_part_are_there_for_its_bending(one: str, other: str, same: bool) -> None:
    """Scales have documented columns, one for each axis; names that begin with the quantity tell of no part."""
    choices = {"column": one} | ({"minus": other} if other else {})
    assert (KINDS["thermal_bending"].preference(choices | {"axis": "y"}) > 1.0) == same
    assert KINDS["thermal_shift"].preference(choices) == 1.0


@pytest.mark.parametrize(
    ("part", "column", "other"),
    [
        ("x", "gauge_temperature_C", True),
        ("x", "scale_temperature_y_C", True),
        ("x", "scale_temperature_x_C", False),
        ("x", "room_C", False),
        ("gauge", "scale_temperature_x_C", True),
        ("gauge", "gauge_temperature_C", False),
    ],
)
def test_a_thermometer_on_another_part_is_less_likely_to_tell_of_a_length(part: str, column: str, other: bool) -> None:
    odds = KINDS["thermal_expansion_of"].preference({"of": part, "column": column})
    assert odds == (1.0 / SAME_PART if other else 1.0)
    assert KINDS["scale_error"].preference({"axis": "x"}) == 1.0


@pytest.mark.parametrize(
    ("part", "column", "most"),
    [("gauge", "gauge_temperature_C", 12.0), ("x", "scale_temperature_x_C", 12.0), ("x", "room_C", 30.0)],
)
def test_where_the_evaluation_corrects_no_more_is_possible_than_of_the_coefficient(
    part: str, column: str, most: float
) -> None:
    """A squareness was told as a gauge that grows by 34 um/(m K) with its own thermometer, by which it is corrected."""
    law = KINDS["thermal_expansion_of"]
    found = usual_size(law, PRIORS, choices={"of": part, "column": column})
    assert found.most == pytest.approx(most)
    assert PRIORS.sizes.about(found.size, found.most).sd.max() <= most
