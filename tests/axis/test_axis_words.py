"""What is told of an axis: every number in the user's unit, and no word of a gauge or a probe."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.sensors import SENSORS, kinds_of, not_candidates
from stepgauge.axis.units import AxisUnits
from stepgauge.diagnosis.axis.conversion import UnitConversion
from stepgauge.diagnosis.axis.residuals import Scaling
from stepgauge.diagnosis.covariates import REST, TOUCHES, TURNING, WAY
from stepgauge.diagnosis.gaussian_processes import random_function as forms
from stepgauge.diagnosis.gaussian_processes.random_function import RandomFunction
from stepgauge.diagnosis.wording import structure as words
from stepgauge.diagnosis.wording.findings import Subject, meaning, name_of
from stepgauge.diagnosis.wording.phrases import worded
from stepgauge.effects import effect_kinds
from stepgauge.figures.effect_panels import TITLES

SHAPES = (
    *((shape, 2.0) for shape in ("trend", "smooth", "rough", "lagged", "wave", "changing length", "levels", "loop")),
    ("beat", (12.0, 34.0)),
    ("memory of rests", 3.0),
    ("hysteresis", (9000, 27000)),
    ("hysteresis", (9000,)),
    ("harmonics", 2),
    ("sawtooth", (120.0, 0.25)),
)
COVARIATES = ("position", "machine x", "face", "order", REST, f"{TOUCHES} of 60 s", TURNING, WAY)
NOT_SAID = ("gauge", "face", "touch", "probing", "machine", "front", "approach", " mm", " um")


def conversion(position: str = "deg", deviation: str | None = None) -> UnitConversion:
    return UnitConversion(AxisUnits.of(position, deviation), Scaling(1.0, 0.1))


@pytest.mark.parametrize("side", ["gauge", "approach"])
@pytest.mark.parametrize(("shape", "number"), SHAPES)
@pytest.mark.parametrize("form", ["axis", "spot", "distances"])
def test_every_form_is_told_in_the_words_of_an_axis(form: str, shape: str, number: object, side: str) -> None:
    assert {shape for shape, _ in SHAPES} >= set(TITLES) | {forms.ROUGH}
    if shape == "harmonics":
        return  # one line has no directions about a stylus
    at = Subject("axis", "deg", "arcsec", form, both_ways=form == "axis")
    for covariate in COVARIATES:
        phrase = words._phrase(RandomFunction(covariate, "mm", shape, (), (number,), (), side=side), shape, number)
        above = {"say": "above", "edge": {"value": -12.5, "unit": "mm"}}
        told = conversion().converted([phrase, words._moved(side), above])
        said = worded(told, at)
        assert not [word for word in NOT_SAID if word in said], said
        assert "only above -12.5 deg" in said
        assert ("directions of travel" in said) == (form == "axis") or shape == "loop"
        assert "unter" not in worded(told, at, "de")
        assert "nur über -12,5 deg" in worded(told, at, "de")


def test_numbers_are_told_in_the_users_unit() -> None:
    linear = conversion("inch")
    resolution = linear.converted({"say": "resolution", "step": {"value": 2.54, "unit": "um"}})
    assert "a resolution of 1000 uin" in worded(resolution, Subject("axis"))
    assert linear.converted({"rms_before_um": 2.54, "time_s": 3.0}) == {
        "rms_before_uin": pytest.approx(1000.0),
        "time_s": 3.0,
    }
    assert linear.converted({"ppm": {"value": 8.0, "u": 1.0, "unit": "um/m"}})["ppm"] == {
        "value": pytest.approx(80.0),
        "u": pytest.approx(10.0),
        "unit": "uin/inch",
    }
    rate = conversion().converted({"ppm": {"value": 1e4, "u": None, "unit": "um/m"}})["ppm"]
    assert (rate["value"], rate["unit"]) == (pytest.approx(100.0), "arcsec/deg")
    period = conversion("m").converted({"period_mm": {"value": 2500.0, "u": 1.0, "unit": "mm"}})
    assert period == {"period_m": {"value": pytest.approx(2.5), "u": pytest.approx(1e-3), "unit": "m"}}


def test_every_unit_of_a_candidate_is_turned_into_the_users() -> None:
    kinds = {k for name in SENSORS for form in ("axis", "spot", "distances") for k in kinds_of(name, form)}
    known = effect_kinds(every=True)
    units = {p.unit for kind in kinds & set(known) for p in known[kind].parameters()}
    of_length = {unit for unit in units if "um" in unit or "mm" in unit}
    assert {"um", "um/m", "um/h"} <= of_length
    for one in (conversion(), conversion("mm")):
        stated_apart = {"um or um/m", "um per m, mm/s or h"}  # by the order of a joint; by what a scatter grows with
        assert of_length - stated_apart <= set(one.factors)


NEVER = {
    *("angular_error", "error_motion", "roll", "squareness", "straightness", "thermal_bending"),
    *(
        "block_defect",
        "block_shift",
        "gauge_bending",
        "gauge_reversed",
        "gauge_soaking",
        "gauge_temperature",
        "misalignment",
    ),
    *("kinematic_pretravel", "lever_arm", "pretravel_scale", "probe_lobing", "seat_defect", "tip_change"),
    *("scale_temperature", "servo_lag"),
    *("axis_compensation", "empirical", "error_map"),
}
"""What one axis cannot show: motions across it, a gauge, the directions of a probe, what a machine file states.

And what is there to simulate only."""
KINDS = {kind for name in SENSORS for form in ("axis", "spot", "distances") for kind in kinds_of(name, form)} & {
    *effect_kinds()
}


def test_every_kind_is_one_that_an_axis_can_have_or_cannot() -> None:
    """A new kind has to be put on one side; what cannot be is no candidate, whatever the sensor and the form."""
    assert {*effect_kinds(), *NEVER} == KINDS | NEVER
    assert set() == KINDS & NEVER
    for sensor in SENSORS:
        for form in ("axis", "spot", "distances"):
            assert not_candidates(sensor, form) >= NEVER & set(effect_kinds())


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_of_an_axis_has_words_of_its_own(kind: str) -> None:
    """In the units of the user, and with the numbers of the parameters."""
    at = Subject("axis", "inch", "uin")
    told = conversion("inch").converted({"parameters": parameters(kind)})["parameters"]
    for order in (0, 1):
        told = {**told, "order": {"value": order}} if "order" in told else told
        said = meaning({"kind": kind, "parameters": told, "largest_uin": 3.0}, at)
        never = ("nan", "None", "gauge", "face", "probing", " um ", " mm ", "um_per")
        assert not [word for word in never if word in said], said
        assert "_" not in name_of(kind, "axis")
        assert not name_of(kind, "axis").endswith(" of")
    if kind == "thermal_shift":
        assert "follow air_C less body_C, 120 s late" in said


def parameters(kind: str) -> dict[str, dict[str, object]]:
    """Every parameter of a kind, numbers as 120 in its unit."""
    choices = {"axis": "x", "column": "air_C", "minus": "body_C", "per": "machine x", "order": 0, "of": "x"}
    law = effect_kinds()[kind]
    return {
        one.name: {"value": choices.get(one.name, "x")}
        if one.role == "choice"
        else {
            "value": 120.0,
            "u": 1.0,
            "unit": one.unit.replace("um or um/m", "um").replace("um per m, mm/s or h", "um/h"),
        }
        for one in law.parameters()
    }


def test_laws_are_told_by_their_names() -> None:
    nearest = {"say": "nearest", "law": "periodic_scale_error_x", "times": "2"}
    assert worded(nearest, Subject("axis")).startswith("periodic scale error is the nearest law")
    assert name_of("effective_radius_x", "axis") == "additive constant"


def test_an_axis_whose_targets_are_each_come_to_from_one_side_has_no_reversal_by_target() -> None:
    """The summary ended in a traceback where the side alternated, as with the faces of a gauge."""
    random, rows = np.random.default_rng(0), []
    for cycle in range(1, 6):
        for number in range(24):
            sign = (1, -1)[number % 2]
            rows.append((cycle, 15.0 * number, "+-"[number % 2], -2.0 * sign + random.normal(0.0, 0.5)))
    table = pd.DataFrame(rows, columns=["run", "target_mm", "direction", "deviation_um"])
    found = sg.diagnose(sg.import_recording(table, sensor="laser"))
    assert "reversal error" in found.summary()
    assert len(found.to_frame())


def test_harmonics_that_a_wave_takes_with_it_are_told() -> None:
    """A second harmonic of a third of the first was put down to the wave without a word that one could search for."""
    phrase = {"say": "inexact", "law": "periodic_scale_error", "size": {"value": 18.0, "unit": "nm"}, "percent": "30"}
    assert "(its second and third harmonic)" in worded([{**phrase, "wave": "True", "lag": ""}], Subject("axis"))
    assert "harmonic" not in worded([{**phrase, "wave": "", "lag": ""}], Subject("axis"))
