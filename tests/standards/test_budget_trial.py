"""A budget with values that are only tried is the budget with the same values stated."""

from __future__ import annotations

from pathlib import Path

import pytest

import stepgauge as sg
from stepgauge.montecarlo import ModelOptions
from stepgauge.recording import Recording
from stepgauge.standards.budget_sources import BudgetOptions
from stepgauge.standards.budget_trial import OPEN_SOURCES, budget_trial, machine_statement
from tests.conftest import ROOT
from tests.measured import run

VALUES = {
    "gauge_temperature": 0.05,
    "scale_temperature": 0.2,
    "scale_expansion": 0.4,
    "probing": 0.1,
    "resolution": 0.3,
}


def test_a_temperature_that_was_not_recorded_is_not_tried_as_if_a_thermometer_had_been_read() -> None:
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    recording = run(2).recording
    silent = Recording(recording.frame.drop(columns="gauge_temperature_C"), {}, "cold.csv")
    names = budget_trial([silent], machine, gauge, BudgetOptions(), ModelOptions(at_reference=True)).names
    assert set(OPEN_SOURCES) - set(names) == {"gauge_temperature"}


NUMBERS = ("value_um", "u_um", "dof", "k", "expanded_um", "through_r_eff_um")


def test_what_is_tried_is_what_it_would_be_if_it_were_stated(tmp_path: Path) -> None:
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    placement = sg.locate(ROOT / "examples/demo/points.csv", gauge, machine=machine)
    program = tmp_path / "gauge.dmi"
    sg.plan(placement, gauge, machine, cycles=2, blocks="1:4").write(program)
    recording = sg.simulate(program, machine, gauge, placement, seed=1, gauge_temperature_C=20.4).recording
    trial = budget_trial([recording], machine, gauge, BudgetOptions((placement,)), ModelOptions(at_reference=True))
    assert set(trial.names) == set(OPEN_SOURCES)

    text = Path(machine.path).read_text()
    kept = [line for line in text.split("\n") if not line.startswith("temperature_C")]
    stated = machine_statement(machine, VALUES)
    for head in ("[machine]", "[uncertainty]"):
        lines = stated.partition(head)[2].partition("\n\n")[0]
        place = kept.index(head) if head in kept else len(kept)
        kept[place : place + 1] = [head, *lines.split("\n")]
    (tmp_path / "known.toml").write_text("\n".join(kept))

    for values, cmm in ((VALUES, tmp_path / "known.toml"), ({}, machine)):
        tried = trial.replace_values(values)
        whole = sg.budget(recording, gauge, cmm, placements=placement, runs=0, measurand="at-20")
        assert len(tried.not_included) == len(whole.not_included)
        assert [one.name for one in tried.sources] == [one.name for one in whole.sources]
        for one, other in zip(tried.quantities, whole.quantities, strict=True):
            assert (one.quantity, one.face, one.dof is None) == (other.quantity, other.face, other.dof is None)
            for name in NUMBERS:
                found, expected = getattr(one, name), getattr(other, name)
                assert (found or 0.0) == pytest.approx(expected or 0.0, rel=1e-9, abs=1e-12), name
            assert one.contributions_um == pytest.approx(other.contributions_um, rel=1e-9, abs=1e-12)
