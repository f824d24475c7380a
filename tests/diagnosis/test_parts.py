"""Laws that hold in a part of the record only: they are named with their condition, and only where it is there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from stepgauge.cli import main
from stepgauge.diagnosis.clock import on_recording_clock
from stepgauge.diagnosis.laws.candidates import law_candidates
from stepgauge.diagnosis.laws.library import effect_families, signatures
from stepgauge.diagnosis.laws.parts import EDGES, FEWEST_VALUES, conditions, is_told, laws_in_parts, may_have, part_laws
from stepgauge.diagnosis.output.machine_text import effect_table
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.effects import along_approach_um, make_effects
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.machine.file import read_machine
from stepgauge.recording import Recording, write_recording
from tests.diagnosis.made import machine
from tests.diagnosis.test_further_laws import STEPS, THREE, Axis, bent, measured, named, told, turned

ALONG_X = (turned(0.0), turned(0.0))
SQUARE = {"kind": "squareness", "plane": "xy", "urad": 12.0}
WAVE = {"kind": "periodic_scale_error", "axis": "x", "period_mm": 37.0, "amplitude_um": 1.0}
DELAY = {"kind": "effective_radius", "um": 2.0}

CASES: dict[str, tuple[tuple[Axis, ...], dict[str, Any], str, float, float]] = {
    "beyond a place": ((*THREE, turned(0.0)), SQUARE | {"when": "y_mm > 600"}, "y_mm >", 600.0, 20.0),
    "along a part of the axis": (ALONG_X, WAVE | {"when": "x_mm > 350"}, "x_mm >", 350.0, 20.0),
    "after a time": ((turned(0.0),), DELAY | {"when": "time_s > 120"}, "time_s >", 120.0, 15.0),
}


@pytest.mark.parametrize("name", CASES)
def test_a_law_in_a_part_of_the_record_is_named_with_its_condition(name: str) -> None:
    axes, table, condition, edge, near = CASES[name]
    found = told(bent(measured(axes, 3), table))
    one = next(each for each in found.findings if table["kind"] in (each.kind, *each.confounded_with))
    assert one.where.startswith(condition)
    assert float(one.where.split()[-1]) == pytest.approx(edge, abs=near)
    assert one.effect is not None
    assert effect_table(one.effect)["when"] == one.where
    (stated,) = (each for each in found.contents["effects"] if each["where"])
    assert stated["meaning"].startswith(f"Only where {one.where}: ")


def test_the_files_of_a_diagnosis_have_the_condition(tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    write_recording(path, bent(measured((*THREE, turned(0.0)), 3), SQUARE | {"when": "y_mm > 600"}))
    main(["diagnose", str(path), "-g", "step-gauge-420", "-m", "bridge-cmm", "-o", str(tmp_path / "out")])
    (effect,) = json.loads((tmp_path / "out/diagnosis.json").read_text())["effects"]
    assert effect["where"].startswith("y_mm > 6") or effect["where"].startswith("y_mm > 5")
    assert "when" not in effect["parameters"]
    (added,) = read_machine(tmp_path / "out/machine.diagnosed.toml").effects
    assert added["when"] == effect["where"]
    assert f"Only where {effect['where']}" in (tmp_path / "out/diagnosis.md").read_text()


def test_a_law_that_holds_everywhere_has_no_condition() -> None:
    assert named(told(bent(measured((*THREE, turned(0.0)), 3), SQUARE)), SQUARE["kind"]).where == ""


def laws(recording: Recording) -> tuple[Any, list[Any]]:
    data = make_residuals(recording, STEPS, machine())
    bare, priors = bare_problem(data), shipped_priors()
    scatters = NoiseModels(bare, priors.scatter)
    return data, law_candidates(data, priors, Metric(bare, scatters.plain(), scatters, bare.within_um))


def test_the_signature_is_the_displacement_of_the_effect_with_its_condition() -> None:
    data, every = laws(measured((turned(0.0), turned(90.0)), 5))
    law = next(one for one in every if one.label == "scale_error_x")
    parts = laws_in_parts(data, shipped_priors())(law, 0)
    part = next(one for one in parts if one.label.endswith("x_mm >"))
    assert 5 < part.atoms <= EDGES
    for atom in (0, 5, part.atoms - 1):
        shape = part.source.atoms[atom]
        (effect,) = make_effects([{"kind": "scale_error", "axis": "x", "ppm": 1.0, **shape}], "test")
        assert_allclose(part.columns(atom)[0], along_approach_um(effect, data.probings))
        assert_allclose(part.columns(atom), signatures(part.source.law, part.source.choices, [shape], data)[0])


def test_all_parts_together_have_the_odds_of_the_law_times_those_of_a_part() -> None:
    data, every = laws(measured((turned(0.0), turned(90.0)), 5))
    priors, law = shipped_priors(), every[0]
    parts = part_laws(data, priors, tuple(conditions(data)), law, 0)
    assert np.exp([one.log_odds for one in parts]).sum() == pytest.approx(priors.laws.part * np.exp(law.log_odds))
    assert all(np.exp(one.log_weight).sum() == pytest.approx(1.0) for one in parts)
    assert not [one for part in parts[:2] for one in part_laws(data, priors, tuple(conditions(data)), part, 0)]


@pytest.mark.parametrize(
    ("kind", "condition", "may"),
    [
        ("squareness", "y_mm >", True),
        ("squareness", "time_s >", True),
        ("scale_error", "y_mm >", False),  # how one axis acts on another is stated by the chain
        ("scale_curvature", "x_mm >", False),  # a polynomial over a whole travel
        ("step_change", "time_s >", False),  # it has a beginning of its own
        ("effective_radius", "x_mm >", True),
    ],
)
def test_which_laws_may_hold_in_which_parts(kind: str, condition: str, may: bool) -> None:
    data = make_residuals(measured((turned(0.0), turned(45.0)), 3), STEPS, machine())
    family = next(
        one
        for one in effect_families(data, shipped_priors())
        if one.kind == kind and one.choices.get("axis", "x") == "x"
    )
    assert may_have(family, condition) is may


def test_a_condition_in_time_is_told_by_the_clock_of_the_recording() -> None:
    found = told(bent(measured((turned(0.0),), 3), CASES["after a time"][1]))
    one = next(each for each in found.findings if each.where)
    later = on_recording_clock(one, 86_400.0)
    assert float(later.where.split()[-1]) == pytest.approx(86_400.0 + float(one.where.split()[-1]))
    assert later.effect is not None
    assert later.effect.when == later.where


def test_a_gauge_that_lies_a_little_aslant_tells_nothing_of_the_axis_it_hardly_moves_along() -> None:
    """Its heights tell the faces apart: a step of some millimetres in z would stand for one along the gauge."""
    level = make_residuals(measured((turned(2.0, 0.3), turned(80.0, -0.3)), 1), STEPS, machine())
    kinds = {(one.kind, one.choices.get("axis")) for one in effect_families(level, shipped_priors())}
    assert {("scale_joint", "x"), ("scale_joint", "y"), ("scale_error", "x")} <= kinds
    assert not any(axis == "z" for kind, axis in kinds if kind.startswith("scale"))
    raised = make_residuals(measured((turned(2.0, 20.0), turned(80.0, -0.3)), 1), STEPS, machine())
    assert ("scale_error", "z") in {
        (one.kind, one.choices.get("axis")) for one in effect_families(raised, shipped_priors())
    }
    assert level.frame["z_mm"].nunique() >= FEWEST_VALUES
    found = {one.name: one.formulas for one in conditions(level)}
    assert "x_mm >" in found
    for formula in found.get("z_mm >", ()):
        edge = float(formula.split()[-1])
        for _, own in level.frame.groupby("placement"):
            assert not own["z_mm"].min() < edge < own["z_mm"].max()


def test_a_part_of_few_faces_tells_no_law_with_as_many_parameters() -> None:
    data = make_residuals(measured(ALONG_X, 3), STEPS, machine())
    every = {one.label: one for one in effect_families(data, shipped_priors())}
    last = np.flatnonzero(data.group >= np.unique(data.group)[-3])
    few = np.zeros(len(data))
    few[last] = 1.0
    for label, told_by_three in (("effective_radius", True), ("periodic_scale_error_x", False)):
        signature = every[label].signature(0) * few
        assert is_told(every[label], signature, data) is told_by_three
