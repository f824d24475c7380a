"""Every result: what it says, its table, its figure, a short repr; and all that is read back from its file."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import pandas as pd
import pytest
from matplotlib import pyplot

import stepgauge as sg
from stepgauge.verbs import catalogue
from tests.cli.probe_files import bench_series
from tests.conftest import ROOT

POINTS, MACHINE, GAUGE = ROOT / "examples/demo/points.csv", ROOT / "examples/demo/machine.toml", "step-gauge-420"
STORED = {
    "budget": "uncertainty",
    "compensate": "compensation",
    "history": "history",
    "test iso230": "test iso230",
    "test iso10360": "test iso10360",
    "probe qualify": "qualification",
    "probe bench": "bench",
}
"""Verbs whose result ``read_result`` gives back, with its noun; here the budget is that of a Monte Carlo."""
ELSEWHERE = {
    "evaluate": "read_evaluation",
    "diagnose": "read_diagnosis",
    "investigate": "read_diagnosis",
    "locate": "read_placement",
    "plan": "the program, which simulate reads",
    "simulate": "read_recording",
    "measure": "read_recording",
    "import": "read_recording, read_axis_recording",
    "probe map": "read_probe_map",
    "probe sphere": "a table of points, which qualify reads",
    "probe compensate": "a table of points",
    "test iso10360-5": "as the other tests",
    "test iso230-3": "as the other tests",
    "test plan": "programs",
    "fleet infer": "read_result",
    "fleet watch": "read_result",
    "dcc import-gauge": "read_gauge",
}
"""Other results that are written, and what reads them."""
NOTHING = {
    *("init", "status", "web", "demo", "report", "serve", "export", "fleet cluster"),
    *(words for words in catalogue.PLACES if words.startswith("list ")),
    *("dcc write", "dcc check", "dcc export-gauge", "fleet add", "fleet query", "fleet export", "fleet compact"),
    *("fleet evaluate", "fleet budget", "fleet diagnose"),
}
"""Verbs that write documents, a store or nothing: there is no result to read back."""


VALUES = ("budget", "compensate", "history", "probe qualify", "probe bench")
"""Results that are values; the others hold the functions that write their reports."""


def test_of_every_verb_it_is_known_how_its_result_comes_back() -> None:
    assert {*STORED, *ELSEWHERE, *NOTHING} == {*catalogue.PLACES}


@pytest.fixture(autouse=True)
def _no_screen() -> Iterator[None]:
    matplotlib.use("Agg")
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("results")
    gauge, machine = sg.read_gauge(GAUGE), sg.read_machine(MACHINE)
    placement = sg.locate(POINTS, gauge, machine=machine)
    plan = sg.plan(placement, gauge, machine, cycles=5, blocks=(1, 9))
    run = sg.simulate(plan, machine, gauge, placement, seed=1)
    for day in ("2026-05-05", "2026-06-05", "2026-07-05"):
        sg.evaluate(run, gauge, measured_at=day).write(folder / day)
    sphere = sg.probe_sphere("omp40-2-50mm", seed=3)
    sphere.write(folder / "sphere.csv")
    bench_series(folder / "bench.csv", {0.0: 5.0, 120.0: 6.0})
    return {
        "budget": sg.budget(run, gauge, machine, method="monte-carlo", runs=60),
        "compensate": sg.compensate(folder / "2026-05-05", to="linuxcnc", axis="y"),
        "history": sg.machine_history(folder),
        "test iso230": sg.iso230(run, gauge, machine=machine),
        "test iso10360": sg.iso10360(run, gauge, mpe="3 + L/200"),
        "probe qualify": sg.qualify_probe(folder / "sphere.csv", sphere_diameter_mm=25.0, tip_diameter_mm=6.0),
        "probe bench": sg.probe_bench(folder / "bench.csv"),
    }


WRITES: dict[str, Callable[[Any, Path], Any]] = {
    "compensate": lambda found, folder: found.write(folder / "y.comp"),
    "probe qualify": lambda found, folder: found.write(folder / "qualification.json"),
    "probe bench": lambda found, folder: found.write(folder / "pushes.csv"),
}


@pytest.mark.parametrize("words", STORED)
def test_a_result_comes_back_with_the_same_lines_and_the_same_table(
    words: str, results: dict[str, Any], tmp_path: Path
) -> None:
    found = results[words]
    WRITES.get(words, lambda one, folder: one.write(folder))(found, tmp_path)
    back = sg.read_result(tmp_path)
    assert back.kind == STORED[words]
    assert back.summary() == found.summary()
    pd.testing.assert_frame_equal(back.to_frame(), plain(found.to_frame()), check_dtype=False)
    assert len(repr(back).splitlines()) <= 8
    assert not hasattr(back, "plot")  # a table of numbers against a number of something else says nothing
    assert str(back.to_frame().columns[0]) in back._repr_html_()


def plain(frame: pd.DataFrame) -> pd.DataFrame:
    """Dates as the text of a file, and None as NaN."""
    dates = {name: frame[name].map(lambda one: one.isoformat()) for name in frame if str(name).endswith("_at")}
    return frame.assign(**dates)


@pytest.mark.parametrize("words", STORED)
def test_a_result_says_draws_and_tabulates_itself(words: str, results: dict[str, Any]) -> None:
    found = results[words]
    assert found.summary()
    assert len(found.to_frame())
    assert len(repr(found)) < 1200
    drawn = found.plot()
    assert drawn.has_data()
    assert drawn.figure.number in pyplot.get_fignums(), "a notebook would not show it"


def test_a_diagnosis_is_read_back_as_any_result(tmp_path: Path) -> None:
    """Of whatever format number it is."""
    axis = pd.DataFrame({"target_mm": [0.0, 10.0, 25.0, 37.0] * 3, "deviation_um": [0.1, 0.2, 0.0, 0.3] * 3})
    found = sg.diagnose(sg.import_recording(axis.assign(direction="+"), sensor="laser"))
    found.write(tmp_path)
    assert sg.read_result(tmp_path).summary() == found.summary()


def test_equal_results_are_equal(results: dict[str, Any]) -> None:
    """``==`` of objects that hold arrays is one truth, as of everything else in Python."""
    gauge, machine = sg.read_gauge(GAUGE), sg.read_machine(MACHINE)
    placement = sg.locate(POINTS, gauge, machine=machine)
    plan = sg.plan(placement, gauge, machine)
    run = sg.simulate(plan, machine, gauge, placement, seed=1)
    evaluation = sg.evaluate(run, gauge)
    for one in (gauge, machine, placement, plan, run, evaluation, *(results[words] for words in VALUES)):
        assert one == pickle.loads(pickle.dumps(one)), type(one).__name__
        assert one != 3.0
    assert evaluation != sg.evaluate(sg.simulate(plan, machine, gauge, placement, seed=2), gauge)


def test_a_result_that_was_changed_is_refused(results: dict[str, Any], tmp_path: Path) -> None:
    results["probe bench"].write(tmp_path / "pushes.csv")
    file = tmp_path / "pushes.json"
    file.write_text(file.read_text().replace("pre-travel", "pretravel", 1))
    with pytest.raises(sg.InputError, match="changed after it was written"):
        sg.read_result(file)


def test_a_folder_without_a_result_and_one_with_two_are_refused(results: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(sg.InputError, match="not one result of stepgauge; found none"):
        sg.read_result(tmp_path)
    results["history"].write(tmp_path)
    results["probe bench"].write(tmp_path / "pushes.csv")
    with pytest.raises(sg.InputError, match=r"found history\.json, pushes\.json"):
        sg.read_result(tmp_path)
