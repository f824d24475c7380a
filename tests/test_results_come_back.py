"""Every result: what it says, its table, its figure, a short repr; and all that is read back from its file."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot

import stepgauge as sg
from stepgauge.errors import for_command
from stepgauge.verbs import catalogue
from tests.cli.probe_files import bench_series
from tests.conftest import ROOT

POINTS, MACHINE, GAUGE = ROOT / "examples/demo/points.csv", ROOT / "examples/demo/machine.toml", "step-gauge-420"
STORED = {
    "budget": "uncertainty",
    "compensate": "compensation",
    "history": "history",
    "test iso230": "test iso230",
    "test iso230-3": "test iso230-3",
    "test iso10360": "test iso10360",
    "test iso10360-5": "test iso10360-5",
    "test plan": "iso10360 plan",
    "probe qualify": "qualification",
    "probe bench": "bench",
}
"""Verbs whose result ``read_result`` gives back by its lines and table; here the budget is that of a Monte Carlo."""
OWN = (
    *("evaluate", "diagnose", "diagnose an axis", "diagnose a map", "budget by GUM", "locate", "simulate"),
    *("import", "import an axis", "probe map", "probe sphere", "dcc import-gauge", "machine"),
)
"""Results that come back as objects of their own kind."""
ELSEWHERE = {
    "investigate": "a diagnosis",
    "measure": "a recording",
    "fleet infer": "tests/fleet",
    "fleet watch": "tests/fleet",
}
NOTHING = {
    *("init", "status", "web", "demo", "report", "serve", "export", "fleet cluster", "plan", "probe compensate"),
    *(words for words in catalogue.PLACES if words.startswith("list ")),
    *("dcc write", "dcc check", "dcc export-gauge", "fleet add", "fleet query", "fleet export", "fleet compact"),
    *("fleet evaluate", "fleet budget", "fleet diagnose"),
}
"""Verbs that write documents, programs, tables of points, a store or nothing: there is no result to read back."""


def test_of_every_verb_it_is_known_how_its_result_comes_back() -> None:
    assert {*STORED, *OWN, *ELSEWHERE, *NOTHING} >= {*catalogue.PLACES}


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
    drift = pd.DataFrame({"time_s": np.arange(0.0, 7200.0, 60.0), "x1_um": np.linspace(0.0, 3.0, 120)})
    two = run.recording.assign_columns(placement=1)
    axis = pd.DataFrame({"target_mm": np.tile(np.arange(0.0, 400.0, 23.0), 3)})
    axis = axis.assign(reading_mm=axis["target_mm"] * (1.0 + 12e-6) + 1e-7 / 3.0, direction="+")
    imported = sg.import_recording(axis, sensor="laser")
    worn = machine.add_effect("scale_error", axis="y", ppm={"value": 30.0, "u": 1.0 / 3.0})
    return {
        "test iso230-3": sg.iso230_3(drift, test="etve"),
        "test iso10360-5": sg.iso10360_5(sphere, sphere_diameter_mm=25.0, tip_diameters_mm=5.99),
        "test plan": sg.plan_iso10360(gauge, machine, allow_short=True),
        "evaluate": sg.evaluate(run, gauge, mpe="3 + L/200"),
        "diagnose": sg.diagnose(sg.simulate(plan, worn, gauge, placement, seed=1), gauge, machine),
        "diagnose an axis": sg.diagnose(imported),
        "diagnose a map": sg.diagnose(chart := sg.probe_map("omp40-2-50mm"), probe="omp40-2-50mm"),
        "budget by GUM": sg.budget(run, gauge, machine, runs=0),
        "locate": placement,
        "simulate": sg.simulate(plan, machine, gauge, placement, seed=1, explain=True),
        "import": sg.import_recording(two.to_frame(), gauge=gauge),
        "import an axis": imported,
        "probe map": chart,
        "probe sphere": sphere,
        "machine": worn.set_uncertainty(probing_um=0.1),
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
    "test plan": lambda found, folder: found.write(folder, "dmis"),
}
FILES = {
    **dict.fromkeys(("locate", "machine"), "it.toml"),
    **dict.fromkeys(("simulate", "import", "import an axis", "probe map", "probe sphere"), "it.csv"),
}
"""Results that are a file, not a folder."""


@pytest.mark.parametrize("words", [*STORED, *(one for one in OWN if one != "dcc import-gauge")])
def test_what_is_written_equals_what_is_read_back(words: str, results: dict[str, Any], tmp_path: Path) -> None:
    found, place = results[words], tmp_path / FILES.get(words, "")
    WRITES.get(words, lambda one, path: one.write(path))(found, place)
    back = sg.read_result(place)
    assert back == found
    assert found == back
    assert back.summary() == found.summary() or words in {"simulate", "import", "import an axis", "probe map"}
    assert words != "diagnose" or "separate-1" in str(back.contents["effects"])
    others = [one for name, one in results.items() if name != words]
    assert not [one for one in others if one in (found, back)]


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
    if words == "test plan":
        return
    drawn = found.plot()
    assert drawn.has_data()
    assert drawn.figure.number in pyplot.get_fignums(), "a notebook would not show it"


def test_a_summary_in_python_names_arguments(results: dict[str, Any]) -> None:
    for name, one in results.items():
        words = re.sub("stepgauge [^;]*", "", one.summary())
        assert not re.search(r"(?<![\w-])--[a-z]", words), (name, words)
    with for_command():
        assert "--" in results["budget by GUM"].summary()


def test_a_result_with_other_numbers_is_another(results: dict[str, Any]) -> None:
    gauge, machine = sg.read_gauge(GAUGE), sg.read_machine(MACHINE)
    assert gauge == sg.read_gauge(GAUGE)
    for one in (gauge, *(results[name] for name in ("evaluate", "simulate", "history", "machine"))):
        assert one == pickle.loads(pickle.dumps(one)), type(one).__name__
        assert one != 3.0
    first, second = (sg.simulate(sg.plan(results["locate"], gauge, machine), machine, gauge, results["locate"], seed=n)
                     for n in (1, 2))  # fmt: skip
    assert first != second
    assert sg.evaluate(first, gauge) != sg.evaluate(second, gauge)


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
