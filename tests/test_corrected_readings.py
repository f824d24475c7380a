"""Readings that the machine had corrected for its tip are judged as it indicated them, whatever turns them back."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.diagnosis.output.files import diagnosis_to_dict
from stepgauge.diagnosis.wording.findings import meaning, remedy, subject
from stepgauge.diagnosis.wording.notation import members_of
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.montecarlo.build import recording_model
from stepgauge.montecarlo.run import run_monte_carlo
from stepgauge.recording import APPROACH, POSITION, Recording, join_recordings
from stepgauge.recording.columns import CORRECTED
from stepgauge.standards.budget import make_budget
from stepgauge.standards.conformity import conformity
from stepgauge.standards.mpe import Mpe
from stepgauge.standards.tip import tip_diameter
from tests.measured import lay, shipped

GAUGE, MACHINE = shipped()
AXIS = lay(GAUGE).axis
FACES = np.tile(np.arange(1, 13), 3)


def indicated(reversal_um: float, radius_mm: float, scatter_um: float = 0.0) -> Recording:
    """Faces as a machine indicates them: backs short by the reversal, turned back with some radius."""
    approach = np.where(FACES % 2 == 1, 1.0, -1.0)
    noise = np.random.default_rng(3).normal(0.0, scatter_um, len(FACES))
    off_um = np.where(FACES % 2 == 1, 0.0, -reversal_um) + noise
    along = GAUGE.position_mm[FACES - 1] + off_um * 1e-3 - approach * radius_mm
    frame = pd.DataFrame({"placement": 1, "cycle": np.repeat([1, 2, 3], 12), "face": FACES})
    frame[POSITION] = np.array([150.0, 150.0, 200.0]) + along[:, None] * AXIS
    frame[APPROACH] = approach[:, None] * AXIS
    frame["gauge_temperature_C"] = GAUGE.table.reference_temperature_C
    return Recording(frame, {CORRECTED: f"{radius_mm:.9g}"}, "indicated.csv")


@pytest.mark.parametrize("radius_mm", [0.5, 1.5, 2.0])
def test_a_reversal_common_to_all_blocks_is_an_error_of_the_machine(radius_mm: float) -> None:
    """A machine that reads every block 8 um short passed with 2.2 um + L/300: the effective radius took all of it."""
    found = evaluate(indicated(8.0, radius_mm), GAUGE)
    result = found.results[0]
    assert found.r_eff_origin == "corrected"
    np.testing.assert_allclose(result.xb_um[1::2], -8.0, atol=1e-6)
    np.testing.assert_allclose(result.xf_um[::2], 0.0, atol=1e-6)
    assert (result.radius.r_eff_mm, result.radius.u_mm, result.radius.blocks) == (radius_mm, 0.0, ())
    judged = [conformity(evaluation_to_dict(one), None, Mpe.parse("2.2 + L/300")) for one in (found, fitted(radius_mm))]
    beyond = [sum(abs(face.error_um) > face.limit_um for face in one.faces) for one in judged]
    assert beyond == [6, 0]


def fitted(radius_mm: float) -> sg.Evaluation:
    """The same with the radius of the first block, as of tip centres."""
    return evaluate(indicated(8.0, radius_mm), GAUGE, r_eff_origin="first")


def test_what_no_machine_corrected_has_no_radius_of_a_correction() -> None:
    plain = replace(indicated(0.0, 1.5), comments={})
    assert evaluate(plain, GAUGE).r_eff_origin == "first"
    with pytest.raises(InputError, match="had not been corrected"):
        evaluate(plain, GAUGE, r_eff_origin="corrected")


def test_the_radius_that_turns_them_back_changes_nothing_and_recordings_of_two_become_one() -> None:
    one, other = indicated(3.0, 1.5, 0.4), indicated(3.0, 1.5006156, 0.4)
    joined = join_recordings([one, other])
    assert joined.comments[CORRECTED] == "1.5"
    first, second = evaluate(joined, GAUGE).results
    np.testing.assert_allclose(first.xb_um, second.xb_um, atol=1e-6)
    np.testing.assert_allclose(first.xm_um, evaluate(other, GAUGE).results[0].xm_um, atol=1e-6)
    with pytest.raises(InputError, match="other recordings had been corrected"):
        join_recordings([one, replace(other, comments={})])


def test_the_budget_has_no_radius_and_agrees_with_the_monte_carlo() -> None:
    model = recording_model(indicated(3.0, 1.5, 0.4), MACHINE, GAUGE, 0.1)
    budget = make_budget(model, None, run_monte_carlo(model, 2000, 5))
    assert "r_eff_mm" not in {line.name for line in budget.lines}
    backs = [line for line in budget.lines if line.name == "xb_um" and line.face and line.face % 2 == 0]
    assert len(backs) == 6
    for line in backs:
        assert line.through_radius == 0.0
        assert line.monte_carlo is not None
        assert line.same_terms_u == pytest.approx(line.monte_carlo[0], rel=0.06)


def test_a_wrong_correction_is_what_a_radius_can_be_and_no_pretravel_of_the_machine_file() -> None:
    """Blocks are read 8 um short: 4 um too much were taken off, and a default of the machine file has no part in it."""
    said = diagnosis_to_dict(sg.diagnose(indicated(8.0, 1.5, 0.2), GAUGE, MACHINE))
    at = subject(said)
    one = next(one for effect in said["effects"] for one in members_of(effect) if one["kind"] == "effective_radius")
    assert one["parameters"]["um"]["value"] == pytest.approx(4.0, abs=0.2)
    assert one["meaning"] == meaning(one, at)
    for language, much in {"en": "too much for the tip", "de": "zu viel ab"}.items():
        told = f"{meaning(one, at, language)} {remedy(one, at, language)}"
        assert much in told
        assert not re.search(r"pre-?travel|Vorlauf|machine file|Maschinendatei", told)


def test_a_test_by_a_standard_takes_the_diameter_of_the_correction() -> None:
    tip = tip_diameter(indicated(8.0, 1.5), GAUGE)
    assert tip is not None
    assert (tip.diameter_mm, tip.own_block) == (3.0, False)
