"""Evaluations and diagnoses of a fleet are those of each recording alone, to the last digit, on any engine."""

from __future__ import annotations

import inspect
import pickle
import subprocess
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stepgauge as sg
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import UM
from stepgauge.executors.processes import InProcess, Processes
from stepgauge.fleet.batches import Batch, StoredBatch, opened
from stepgauge.fleet.budgeting import budget_fleet
from stepgauge.fleet.content import recording_key
from stepgauge.fleet.diagnosing import diagnose_fleet
from stepgauge.fleet.evaluating import EvaluationChoices, evaluate_fleet
from stepgauge.fleet.query import query
from stepgauge.fleet.results import Results
from stepgauge.fleet.store import Fleet
from stepgauge.montecarlo import ModelOptions
from stepgauge.recording import Recording, read_recording, write_recording
from stepgauge.standards.budget_files import COLUMNS
from stepgauge.standards.budgeting import BudgetChoices
from stepgauge.verbs.fleet_work import EVALUATION
from tests.fleet.made import GAUGE, make_entry, make_fleet

OPTIONS = asdict(EvaluationChoices())


class Far(InProcess):
    """Stands for workers elsewhere, to whom the recordings themselves are sent."""

    near = False

    def submit(self, number: int, item: Any) -> None:
        assert isinstance(item, Batch)
        super().submit(number, pickle.loads(pickle.dumps(item)))


def test_the_evaluations_are_those_of_each_recording_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the file on the disk by the verb's own function, against the store by batches in two processes."""
    monkeypatch.setattr("stepgauge.fleet.working.BATCH", 4)
    fleet = make_fleet(tmp_path / "fleet", 10)
    bad = make_entry(fleet, 11).recording
    bad = Recording(
        bad.frame.assign(x_mm=bad.frame["x_mm"] * (1.0 + 0.1 * (bad.frame["face"] > 20))), bad.comments, "bad.csv"
    )
    fleet.add([replace(make_entry(fleet, 11), recording=bad)])
    told: list[tuple[int, int]] = []
    errors = evaluate_fleet(fleet, Processes(2), progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (11, 11)
    assert len(errors) == 1
    assert errors[0].startswith("bad.csv: probing")
    rows = {row["recording"]: row for row in Results(fleet, "evaluations", OPTIONS).read().to_pylist()}
    for number in range(10):
        entry = make_entry(fleet, number)
        path = tmp_path / "one.csv"
        write_recording(path, entry.recording)
        one = evaluate(read_recording(path), fleet.gauge(entry.certificate))
        row, (result,) = rows[recording_key(entry.recording)], one.results
        for name in (*UM, "position_mm"):
            assert np.array_equal(row[name], getattr(result, name), equal_nan=True)
        assert (row["r_eff_mm"], row["band_um"]) == (result.radius.r_eff_mm, result.band_um)
        assert row["notes"] == list(result.notes)
    assert evaluate_fleet(fleet, InProcess()) == []  # nothing is left to do
    before = Results(fleet, "evaluations", OPTIONS).read()
    Results(fleet, "evaluations", OPTIONS).clear()
    evaluate_fleet(fleet, Far())
    assert repr(Results(fleet, "evaluations", OPTIONS).read().to_pylist()) == repr(before.to_pylist())
    assert rows[recording_key(bad)]["error"] == errors[0]


def test_a_fleet_is_evaluated_with_the_choices_of_one_recording(tmp_path: Path) -> None:
    """Gauges at 22 deg C: a convention that is stated for all is that of each, as in ``evaluate``."""
    fleet = Fleet(tmp_path / "fleet", create=True)
    entry = make_entry(fleet, 1)
    warm = Recording(entry.recording.frame.assign(gauge_temperature_C=22.0), {}, "warm.csv")
    fleet.add([replace(entry, recording=warm)])
    (asked,) = evaluate_fleet(fleet, InProcess())
    assert "nothing states whether the readings are corrected" in asked
    assert "expected temperature_convention in the machine file" in asked
    choices = EvaluationChoices(temperature_convention="corrected_to_20", correct_drift=True)
    assert evaluate_fleet(fleet, InProcess(), choices) == []
    (row,) = Results(fleet, "evaluations", asdict(choices)).read().to_pylist()
    alone = sg.evaluate(warm, GAUGE, temperature_convention="corrected_to_20", correct_drift=True)
    assert np.array_equal(row["xm_um"], alone.results[0].xm_um, equal_nan=True)
    assert tuple(asdict(choices)) == EVALUATION
    assert set(EVALUATION) <= set(inspect.signature(sg.evaluate).parameters)


def stop(done: int, total: int) -> None:
    """Somebody who does not wait for the second."""
    if done:
        raise InterruptedError


def test_the_budgets_are_those_of_each_recording_alone(tmp_path: Path) -> None:
    """Of :func:`stepgauge.budget`, with its Monte Carlo, here, in a process, and by workers that have no store."""
    fleet = make_fleet(tmp_path / "fleet", 2, cycles=2)
    fleet.add([replace(make_entry(fleet, 3), machine_file=None)])
    choice = BudgetChoices(ModelOptions(u_gauge_temperature_K=0.05), correlation=0.5, runs=50)
    told: list[tuple[int, int]] = []
    errors = budget_fleet(fleet, Processes(1), choice, lambda done, total: told.append((done, total)))
    assert told[-1] == (3, 3)
    assert [error.partition(" was ")[0] for error in errors] == ["recording-3.csv: no machine file"]
    table = Results(fleet, "budgets", asdict(choice))
    rows = table.read().to_pylist()
    for number in range(2):
        entry = make_entry(fleet, number, cycles=2)
        gauge, machine = fleet.gauge(entry.certificate), fleet.machine(entry.machine_file or "")
        stated = {"u_gauge_temperature_K": 0.05, "certificate_correlation": 0.5, "runs": 50}
        alone = sg.budget(entry.recording, gauge, machine, **stated)
        mine = [row for row in rows if row["recording"] == recording_key(entry.recording)]
        assert len(mine) == len(alone.quantities) > 100
        for row, line in zip(mine, alone.quantities, strict=True):
            assert {name: row[name] for name in COLUMNS} == {name: getattr(line, name) for name in COLUMNS}
            assert dict(row["contributions_um"]) == line.contributions_um
            assert line.monte_carlo is not None
            assert row["monte_carlo_high_95_um"] == line.monte_carlo.high_95_um
            assert "resolution" in row["not_included"]
    assert budget_fleet(fleet, InProcess(), choice) == []  # nothing is left to do
    table.clear()
    with pytest.raises(InterruptedError):
        budget_fleet(fleet, InProcess(), choice, stop)
    assert table.done() == set()
    budget_fleet(fleet, Far(), choice)  # goes on from the journal
    assert Results(fleet, "budgets", asdict(choice)).read().to_pylist() == rows
    asked = "SELECT machine, max(expanded_um) FROM budgets WHERE quantity = 'xm' GROUP BY machine ORDER BY machine"
    assert query(fleet, asked)["machine"].to_pylist() == ["M1", "M2"]


KILLED = """
import sys
from stepgauge.fleet import diagnosing
from stepgauge.fleet.store import Fleet
from stepgauge.executors.processes import InProcess
from tests.fleet.test_evaluating import quick
diagnosing.diagnose_batch = quick
diagnosing.diagnose_fleet(Fleet(sys.argv[1]), InProcess(), progress=lambda done, total: print(done, flush=True))
"""


def quick(batch: StoredBatch, without: tuple[str, ...], priors: object) -> dict[str, Any]:
    """Something in place of a diagnosis, which takes its time to the last digit."""
    time.sleep(0.05)
    (one,) = opened(batch).stored
    mean = float(one.columns["x_mm"].mean())
    fit = {"noise_um": mean, "rms_before_um": mean, "rms_after_um": None}
    effects = [{"kind": "scale_error", "label": "scale error x", "probability": 0.5}]
    return {"summary": str(mean), "said": {"verdict": "effects", "effects": effects, "fit": fit}}


def test_a_stopped_diagnosis_goes_on_where_it_was_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepgauge.fleet.diagnosing.diagnose_batch", quick)
    monkeypatch.setattr("stepgauge.fleet.working.PORTION", 5)
    whole, cut = make_fleet(tmp_path / "whole", 12), make_fleet(tmp_path / "cut", 12)
    assert diagnose_fleet(whole, InProcess()) == []
    with subprocess.Popen([sys.executable, "-c", KILLED, str(cut.folder)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"1\n"
        process.kill()
    done = (cut.folder / "diagnoses.journal").read_bytes().count(b"\n") - 1
    assert 1 <= done < 12
    told: list[int] = []
    assert diagnose_fleet(cut, InProcess(), progress=lambda done, total: told.append(done)) == []
    assert not (cut.folder / "diagnoses.journal").exists()
    tables = [Results(fleet, "diagnoses", {"without": [], "priors": None}).read() for fleet in (whole, cut)]
    assert tables[0].equals(tables[1])
    assert len(tables[0]) == told[-1] == 12
