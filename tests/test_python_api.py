"""``import stepgauge``: what is public, that it is light, and that it gives what the command line gives."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import types
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from glob import glob
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot

import stepgauge as sg
from stepgauge.errors import python_text
from stepgauge.files.text import read_json
from stepgauge.verbs.catalogue import all_verbs
from tests.axis.made import axis
from tests.cli.conftest import Run as Command
from tests.cli.conftest import run  # noqa: F401
from tests.conftest import ROOT

POINTS, MACHINE = ROOT / "examples/demo/points.csv", ROOT / "examples/demo/machine.toml"
FEA = ROOT / "examples/omp40-fea"
GAUGE = "step-gauge-420"
SIGNATURES = """
add_to_fleet(store, recordings, gauge=None, machine=None, *, placements=(), roster=None, machine_id=None,
    machine_type=None, hall=None, probe_id=None, gauge_id=None, measured_at=None, progress=None)
budget(sources, gauge, machine, *, placements=(), method="gum", blocks=None, r_eff_origin=None,
    u_gauge_temperature_K=None, certificate_correlation=None, repeats="pooled", coverage_percent=95.45, runs=10000,
    seed=0, gauge_temperature_C=None, search_mm=2.0, measurand="as-is", contributions=(), measured_at=None,
    temperature_convention=None, correct_drift=False, jobs=1, runs_folder=None, progress=None)
budget_fleet(store, *, jobs=1, scheduler=None, memory_MB=None, progress=None, blocks=None, r_eff_origin=None,
    u_gauge_temperature_K=None, certificate_correlation=None, repeats="pooled", coverage_percent=95.45,
    runs=10000, seed=0, measurand="as-is", contributions=(), measured_at=None, temperature_convention=None,
    correct_drift=False)
check_dcc(certificate, *, schema=None)
compact_fleet(store)
compensate(measured, *, to, axis=None, plane=None, template=None, actual=None, u_length_um_per_m=0.0,
    tip_radius_mm=None, u_tip_radius_um=0.0, travel=None, step_mm=None, range_mm=None, extend="none", zero_at_mm=None,
    offset_mm=0.0, angle_limit_deg=1.0, placement_number=None, file_type=0, joint=None, unconfirmed_sense=None)
compensate_points(points, *, qualification, method="lobed", on_sphere=False)
diagnose(recordings, gauge=None, machine=None, *, further_styli=(), probe=None, columns=None, each=False, jobs=1,
    without=(), priors=None, kind=None, progress=None)
diagnose_fleet(store, *, without=(), priors=None, jobs=1, scheduler=None, memory_MB=None, progress=None)
evaluate(recordings, gauge, *, placements=(), blocks=None, r_eff_origin=None, measured_at=None,
    machine_name=None, temperature_convention=None, correct_drift=False, mpe=None, machine=None, budget=None)
evaluate_fleet(store, *, jobs=1, scheduler=None, memory_MB=None, progress=None, blocks=None,
    r_eff_origin=None, temperature_convention=None, correct_drift=False)
export_fleet(store, output, *, where="true")
export_gauge_dcc(gauge, *, certificate, schema=None)
export_recording(recording, *, to, placement_number=None, length_unit="mm", delimiter=None, decimal="point",
    points="centres", tip_radius_mm=None, log_form="log")
fleet_cluster(*, workers=2, port=8786, memory_MB=None, idle_s=None, ready=<built-in function print>)
import_gauge_dcc(certificate, *, name=None, serial=None, material=None, expansion_per_K=None,
    u_expansion_per_K=None, reference_temperature_C=None, block_width_mm=None, block_height_mm=None, positions=None,
    nominal=None, deviations=None)
import_recording(log, *, format=None, sensor=None, gauge=None, placement=None, program=None, machine=None,
    placement_number=1, tip_radius_mm=None, points=None, gauge_temperature_C=None, temperature_convention=None,
    unit=None, deviation_unit=None, temperature_unit="C", time_unit=None, columns=(), rows=(), constants=(),
    accept=(), header=None, table=None, sheet=None, delimiter=None, decimal=None, targets=None, heights=None)
infer_fleet(store, *, jobs=1, scheduler=None, memory_MB=None, progress=None)
investigate(placement, gauge, machine, output, *, ask, server=None, simulate=False, faults=None, seed=0,
    minutes=60.0, odds=20.0, within_mm=None, level=False, hands_minutes=5.0, further_styli=(), cycles=2, without=(),
    priors=None, resume=False, yes=False, homing=False, tool="StepGaugeProbe", figure="png", tell=None,
    progress=None, stop=None)
iso10360(recordings, gauge, *, mpe, mpe_repeatability_um=None, machine=None, placements=(),
    offset_recordings=(), mpe_offset=None, offset_machine=None, normal=None, normal_gauge=None,
    tip_diameter_mm=None, u_tip_diameter_um=None, unidirectional="fronts", lengths_mm=None,
    u_gauge_temperature_K=None, u_alignment_mrad=None, u_fixture_um=None, also=(), coverage_factor=2.0,
    temperature_convention=None)
iso10360_5(points, *, sphere_diameter_mm, tip_diameters_mm, mpe_form_um=None, mpe_size_um=None,
    mpe_location_um=None, u_sphere_diameter_um=None, sphere_form_um=None, u_sphere_form_um=None,
    another_sphere=False, coverage_factor=2.0, machine_name=None)
iso230(recordings, gauge=None, *, machine=None, placements=(), tip_diameter_mm=None, pair="middle", actual=None,
    tolerances=(), also=(), expanded_uncertainty_um=None, temperature_convention=None)
iso230_3(source, gauge=None, *, test, tolerances=(), expanded_uncertainty_um=None)
list_dialects(name=None)
list_effects(kinds=(), gauge=None, machine=None)
list_files(name=None)
list_gauges()
list_machines()
list_priors()
locate(points, gauge, *, machine=None, blocks=None, tip_radius_mm=None, repeatability_um=None, turned=False,
    surface=False)
machine_history(folder, *, limits=None, machine_name=None, gauge_serial=None, date_from="record", store=None,
    rebuild=False, own_store=None, tell=None)
measure(program, machine, gauge, placement, *, server, journal, resume=False, homing=False,
    tool="StepGaugeProbe", gauge_temperature_C=None, placement_number=1, dialect=None, search_mm=2.0, spy=None,
    progress=None, stop=None, cycles=5, first_again=False, route="side", around="+s", order="blocks",
    clearance_mm=5.0, margin_mm=0.5, height_mm=0.0, standoff_mm=None, measuring_speed_mm_s=None,
    travel_speed_mm_s=None, home_mm=None, blocks=None)
plan(placement, gauge, machine=None, *, cycles=5, first_again=False, blocks=None, route="side", around="+s",
    order="blocks", clearance_mm=5.0, margin_mm=0.5, height_mm=0.0, home_mm=None, standoff_mm=None, search_mm=2.0,
    measuring_speed_mm_s=None, travel_speed_mm_s=None, tip_radius_mm=None, points_on=None, teach=False)
plan_iso10360(gauge, machine, *, cycles=3, stylus="auto", allow_short=False, search_mm=2.0, first_again=False,
    route="side", around="+s", order="blocks", clearance_mm=5.0, margin_mm=0.5, height_mm=0.0, standoff_mm=None,
    measuring_speed_mm_s=None, travel_speed_mm_s=None)
probe_bench(series, *, contact_from="signal", coverage_factor=2.0)
probe_map(probe, *, polar_deg="10:90:10", azimuth_deg="0:360:10", stylus_direction=None)
probe_sphere(probe, *, sphere_diameter_mm=25.0, count=25, scatter_um=0.2, seed=1, stylus_direction=None)
qualify_probe(points, *, sphere_diameter_mm, u_sphere_diameter_um=0.0, tip_diameter_mm=None, u_tip_diameter_um=0.0,
    noise_um=None, transducer="kinematic", lobe_azimuth_deg=None, slip="full", stylus_axis=(0.0, 0.0, 1.0))
query_fleet(store, sql)
read_axis_recording(path)
read_budget(path)
read_diagnosis(path)
read_evaluation(path, gauge=None)
read_gauge(name)
read_machine(name)
read_placement(path, gauge=None)
read_probe_map(path)
read_recording(path)
read_result(path)
report(results, output, *, gauge=None, placements=(), machine=None, budget=None, certificate=None, mpe=None,
    interactive=False, recordings=(), number=None, operator=None, customer=None, location=None, date=None,
    remarks=None, language="en", template=None)
serve(machine, gauge, placement, *, faults=None, speed=1.0, port=1294, host="127.0.0.1", further_styli=(),
    gauge_temperature_C=None, seed=None, start_time_s=0.0, tool="StepGaugeProbe", idle_s=None, client_idle_s=1800.0,
    log=None, tell=<built-in function print>)
simulate(program, machine, gauge, placement, *, true_placement=None, seed=0, gauge_temperature_C=None,
    placement_number=1, start_time_s=0.0, dialect=None, search_mm=2.0, explain=False, keep_stopped=False, log=None,
    teach=False)
watch_fleet(store, *, limits=None, risk=0.05, jobs=1, scheduler=None, memory_MB=None, progress=None)
write_dcc(evaluation, gauge, *, certificate, machine=None, budget=None, attach=None, schema=None)
"""
METHODS = """
AxisRecording.summary(self)
AxisRecording.to_frame(self)
AxisRecording.plot(self, axes=None)
AxisRecording.write(self, path)
Diagnosis.summary(self)
Diagnosis.to_frame(self)
Diagnosis.plot(self, axes=None)
Diagnosis.write(self, folder, figure="png")
Diagnosis.read(path)
DirectionMap.summary(self)
DirectionMap.to_frame(self)
DirectionMap.plot(self, axes=None)
DirectionMap.write(self, path)
Evaluation.summary(self)
Evaluation.to_frame(self)
Evaluation.plot(self, axes=None, placement=None, *, before=None)
Evaluation.write(self, folder)
FleetInference.summary(self)
FleetInference.to_frame(self)
FleetInference.plot(self, axes=None)
FleetInference.write(self, path)
FleetWatch.summary(self)
FleetWatch.to_frame(self)
FleetWatch.write(self, folder, figure="png")
Gauge.summary(self)
Gauge.to_frame(self)
Gauge.plot(self, axes=None)
Machine.add_effect(self, kind, **parameters)
Machine.set_uncertainty(self, **stated)
Machine.summary(self)
Machine.to_frame(self)
Machine.write(self, path)
Placement.summary(self)
Placement.to_frame(self)
Placement.plot(self, axes=None)
Placement.write(self, path)
Plan.summary(self)
Plan.to_frame(self)
Plan.plot(self, axes=None)
Plan.write(self, path, dialect=None, *, template=None, tool="", unchecked=False, settings=None)
Plan.text(self, dialect, *, template=None, tool="", unchecked=False, settings=None)
Recording.summary(self)
Recording.to_frame(self)
Recording.plot(self, axes=None)
Recording.write(self, path)
Run.summary(self)
Run.to_frame(self)
Run.plot(self, axes=None)
Run.write(self, path)
StoredBudget.summary(self)
StoredBudget.to_frame(self)
StoredBudget.plot(self, axes=None, placement=None)
StoredBudget.write(self, folder, figure="png")
StoredResult.summary(self)
StoredResult.to_frame(self)
"""


def table(text: str) -> dict[str, str]:
    """Names and what stands in their parentheses, of one or more lines each."""
    lines = re.sub(r"\n {4}", " ", text).strip().splitlines()
    return {name: f"({rest}" for name, _, rest in (line.partition("(") for line in lines)}


@pytest.fixture(autouse=True)
def _no_screen() -> Iterator[None]:
    """Figures of pyplot are drawn in memory, and closed."""
    matplotlib.use("Agg")
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Every kind of result."""
    gauge, machine = sg.read_gauge(GAUGE), sg.read_machine(MACHINE)
    placement = sg.locate(POINTS, gauge, machine=machine)
    plan = sg.plan(placement, gauge, machine, cycles=3, blocks=(1, 9))
    moved = sg.simulate(plan, machine, gauge, placement, seed=1, explain=True)
    along = axis(np.linspace(0.0, 500.0, 11), lambda target, way: 0.02 * target + 2.0 * way)
    folder = tmp_path_factory.mktemp("axis")
    along.write(folder / "axis.csv")
    of_axis = sg.diagnose(folder / "axis.csv")
    of_axis.write(folder)
    return {
        "axis recording": sg.read_axis_recording(folder / "axis.csv"),
        "axis diagnosis": of_axis,
        "map diagnosis": sg.diagnose(FEA / "map.csv", probe=FEA / "existing-method.toml"),
        "stored diagnosis": sg.read_diagnosis(folder),
        "machine": machine,
        "gauge": gauge,
        "placement": placement,
        "plan": plan,
        "run": moved,
        "recording": moved.recording,
        "evaluation": sg.evaluate(moved, gauge),
        "budget": sg.budget(moved, gauge, machine, runs=0),
        "diagnosis": sg.diagnose(
            sg.simulate(plan, _with_a_scale_error(machine), gauge, placement, seed=1), gauge, _without_effects(machine)
        ),
        "probe map": sg.probe_map("omp40-2-50mm", azimuth_deg="0:360:30"),
    }


def _with_a_scale_error(machine: sg.Machine) -> sg.Machine:
    return replace(machine, effects=tuple({"kind": "scale_error", "axis": axis, "ppm": 30.0} for axis in "xy"))


def _without_effects(machine: sg.Machine) -> sg.Machine:
    return replace(machine, effects=())


def blocks() -> list[str]:
    """The Python blocks of the page, in order."""
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(encoding="utf-8"), re.S)


def test_the_page_runs_and_its_loop_is_short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loop = [line for line in blocks()[0].splitlines() if line.strip()]
    assert len(loop) <= 12
    assert blocks()[0] in (ROOT / "README.md").read_text(encoding="utf-8")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    known: dict[str, Any] = {}
    for block in blocks():
        exec(compile(block, "docs/python.md", "exec"), known)
    assert known["diagnosis"].verdict == "adequate"
    written = {"gauge.dmi", "report.pdf", "result/evaluation.json", "result/evaluation.csv", "worst.png"}
    assert all((tmp_path / name).stat().st_size > 0 for name in written)


def test_the_page_names_all_that_is_public() -> None:
    page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    assert [name for name in sg.__all__ if f"`{name}" not in page] == []
    kinds = {name for name in sg.__all__ if inspect.isclass(getattr(sg, name))}
    assert {*table(SIGNATURES), *kinds, "__version__", "inference"} == set(sg.__all__)


@pytest.mark.parametrize("name", table(SIGNATURES))
def test_signatures_of_the_verbs(name: str) -> None:
    assert signature(getattr(sg, name)) == table(SIGNATURES)[name]


@pytest.mark.parametrize("name", table(METHODS))
def test_signatures_of_the_methods(name: str) -> None:
    kind, _, method = name.partition(".")
    assert signature(getattr(getattr(sg, kind), method)) == table(METHODS)[name]


def signature(function: Any) -> str:
    """Names and defaults."""
    plain = [one.replace(annotation=inspect.Parameter.empty) for one in inspect.signature(function).parameters.values()]
    return str(inspect.Signature(plain)).replace("'", '"')


def test_importing_loads_no_library() -> None:
    heavy = {"numpy", "pandas", "matplotlib", "pydantic", "scipy", "click", "starlette", "uvicorn"}
    script = f"import stepgauge, sys; print(*({heavy} & {{*sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_a_room_does_not_take_the_place_of_its_verb() -> None:
    script = "import stepgauge as sg, stepgauge.alignment.checks, stepgauge.diagnosis.result, stepgauge.reports.page\n"
    script += "from stepgauge.alignment import read_points\nfrom stepgauge import locate\n"
    script += "print(all(callable(f) for f in (sg.locate, sg.diagnose, sg.report, locate)), sg.figures is not None)"
    script = script.replace("import stepgauge as sg,", "import stepgauge as sg, stepgauge.figures,")
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True True"


def test_an_unknown_name_is_an_error_and_all_names_are_listed() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'calibrate'"):
        _ = sg.calibrate  # type: ignore[attr-defined]
    assert set(dir(sg)) == set(sg.__all__)


def test_what_the_command_line_writes(tmp_path: Path, run: Command, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: F811
    monkeypatch.setattr("stepgauge.files.dates.moment_now", lambda: "2026-05-06T07:08:09+00:00")

    def cli(*words: object) -> None:
        done = run(*words)
        assert done.code == 0, done.err

    common = ("-g", GAUGE, "-m", MACHINE)
    gauge, machine, a, b = sg.read_gauge(GAUGE), sg.read_machine(MACHINE), tmp_path / "cli", tmp_path / "python"
    cli("locate", POINTS, *common, "-o", a / "p.toml")
    sg.locate(POINTS, gauge, machine=machine).write(b / "p.toml")
    placement = sg.read_placement(a / "p.toml", gauge)
    cli("plan", a / "p.toml", *common, "-d", "linuxcnc", "--blocks", "1:9", "--cycles", 3, "-o", a / "p.ngc")
    sg.plan(placement, gauge, machine, blocks="1:9", cycles=3).write(b / "p.ngc")
    cli("simulate", a / "p.ngc", *common, "-p", a / "p.toml", "--seed", 7, "-o", a / "r.csv")
    sg.simulate(a / "p.ngc", machine, gauge, placement, seed=7).write(b / "r.csv")
    cli("evaluate", a / "r.csv", "-g", GAUGE, "-p", a / "p.toml", "-o", a / "result")
    sg.evaluate(a / "r.csv", gauge, placements=a / "p.toml").write(b / "result")
    cli("budget", a / "r.csv", *common, "-p", a / "p.toml", "--runs", 50, "-o", a / "result")
    sg.budget(a / "r.csv", gauge, machine, placements=placement, runs=50).write(b / "result")
    cli("probe", "map", "omp40-2-50mm", "--azimuth", "0:360:60", "-o", a / "map.csv")
    sg.probe_map("omp40-2-50mm", azimuth_deg=range(0, 360, 60)).write(b / "map.csv")
    for name in ("p.toml", "p.ngc", "r.csv", "result/evaluation.csv", "result/budget.csv", "map.csv"):
        assert (a / name).read_bytes() == (b / name).read_bytes(), name
    for name in ("result/evaluation.json", "result/budget.json"):
        of_verb, of_python = read_json(a / name), read_json(b / name)
        assert of_verb.pop("inputs")
        assert {**of_verb, "checksum": ""} == {**of_python, "checksum": ""}


def test_the_diagnosis_is_that_of_the_command_line(tmp_path: Path, run: Command, measured: dict[str, Any]) -> None:  # noqa: F811
    measured["run"].write(tmp_path / "r.csv")
    done = run("diagnose", tmp_path / "r.csv", "-g", GAUGE, "-m", MACHINE, "-o", tmp_path / "cli")
    assert done.code == 0, done.err
    found = sg.diagnose(tmp_path / "r.csv", GAUGE, MACHINE)
    found.write(tmp_path / "python")
    assert found.summary() in done.err
    said = [read_json(tmp_path / name / "diagnosis.json") for name in ("cli", "python")]
    of_verb, of_python = ({**one, "made_from": [], "checksum": ""} for one in said)
    assert {one["name"] for one in said[0]["made_from"] if "name" in one} >= {"step-gauge-420.toml"}
    assert of_verb == of_python


def test_an_import_that_left_questions_is_named_where_its_recording_is_taken() -> None:
    table = pd.DataFrame({"target_mm": np.arange(8.0), "reading_mm": np.arange(8.0)})
    with pytest.raises(sg.InputError, match="'reading_mm' has no number in any row"):  # which no answer settles
        sg.import_recording(table.assign(reading_mm=np.nan), sensor="laser")
    taken = sg.import_recording(table.mask(table == 3.0).assign(target_mm=table["target_mm"]), sensor="laser")
    with pytest.raises(sg.InputError, match="an import that leaves questions open has no recording"):
        sg.diagnose(taken.recording)
    with pytest.raises(sg.InputError, match="readings are missing"):
        sg.diagnose(taken)


def test_the_curve_of_what_has_no_law_is_in_the_table_of_readings(tmp_path: Path) -> None:
    """A piezo whose branches differ by a parabola: the curve is the truth within the noise of 4 nm."""
    rng = np.random.default_rng(5)
    target = np.linspace(0.0, 100.0, 26) + rng.uniform(-0.8, 0.8, 26)
    place, way = np.tile(np.r_[target, target[::-1]], 3), np.tile(np.repeat([1, -1], 26), 3)
    bow = place / 100.0 * (1.0 - place / 100.0)
    um = (0.3 + 0.12 * way) * bow
    columns = {"cycle": np.repeat([1, 2, 3], 52), "direction": way, "target_um": place}
    table = pd.DataFrame({**columns, "reading_um": place + um + rng.normal(0.0, 0.004, len(um))})
    found = sg.diagnose(sg.import_recording(table, sensor="capacitive"), kind="piezo")
    found.write(tmp_path)
    rows = pd.read_csv(tmp_path / "residuals.csv")
    assert found.verdict == "unknown"
    assert found.to_frame().set_index("kind").loc[["structure"], "probability"].min() > 0.5
    curve = rows["before_um"] - rows["after_um"]
    assert np.std(curve - um) < 0.002


def test_a_table_is_given_as_columns_rows_or_an_array() -> None:
    table = pd.DataFrame({"target_mm": [0.0, 10.0, 25.0] * 3, "reading_mm": [0.001, 10.002, 25.0] * 3})
    known = sg.import_recording(table, sensor="laser", constants={"direction": "+"})
    for given in (table.to_dict("list"), table.to_dict("records"), table.to_records(index=False)):
        assert sg.import_recording(given, sensor="laser", constants={"direction": "+"}) == known
    with pytest.raises(sg.InputError, match="neither a file nor what is read from one; found"):
        sg.import_recording({"a": 1}, sensor="laser")


def test_findings_of_the_same_name_have_a_bar_each(measured: dict[str, Any]) -> None:
    said = dict(measured["axis diagnosis"].contents)
    stored = sg.Diagnosis({**said, "effects": [said["effects"][0]] * 3})
    bars = stored.plot().patches
    assert len({bar.get_y() for bar in bars}) == 3


SHOWN = ("gauge", "placement", "plan", "run", "recording", "evaluation", "budget", "diagnosis", "probe map")
OF_ONE_AXIS_OR_A_PROBE = ("axis recording", "axis diagnosis", "map diagnosis", "stored diagnosis")


@pytest.mark.parametrize("kind", [*SHOWN, *OF_ONE_AXIS_OR_A_PROBE])
def test_results_show_themselves(kind: str, measured: dict[str, Any]) -> None:
    result = measured[kind]
    assert result.summary()
    frame = result.to_frame()
    assert len(frame) > 0
    html = result._repr_html_()
    assert html.count("<table") == 1
    assert str(frame.columns[-1]) in html
    own = result.plot()
    assert own.get_xlabel()
    assert own.has_data()
    given = pyplot.figure().add_subplot()
    assert result.plot(given) is given
    assert given.get_ylabel() == own.get_ylabel()


def test_a_machine_says_what_its_file_states(measured: dict[str, Any]) -> None:
    machine = measured["machine"]
    assert "travel 700 x 1200 x 600 mm" in machine.summary()
    assert "effects: " + ", ".join(one["kind"].replace("_", " ") for one in machine.effects) in machine.summary()
    assert set(machine.to_frame()["kind"].dropna()) == {one["kind"] for one in machine.effects}
    assert machine._repr_html_().count("<table") == 1


@pytest.mark.parametrize("kind", ["diagnosis", "axis diagnosis", "map diagnosis"])
def test_a_diagnosis_comes_back_as_it_was_said(kind: str, measured: dict[str, Any], tmp_path: Path) -> None:
    found = measured[kind]
    found.write(tmp_path / "a")
    back = sg.read_diagnosis(tmp_path / "a")
    assert (back.verdict, back.summary()) == (found.verdict, found.summary())
    rows = ["effect", "parameter", "unit"]
    written, read = found.to_frame(), back.to_frame()
    read = read[read["u"].notna() | read.set_index(rows).index.isin(written.set_index(rows).index)]
    np.testing.assert_allclose(
        read[["value", "u"]].to_numpy(float), written[["value", "u"]].to_numpy(float), rtol=1e-12
    )
    assert read[rows].to_numpy().tolist() == written[rows].to_numpy().tolist()
    assert type(back) is sg.Diagnosis
    assert isinstance(found, sg.Diagnosis)
    assert repr(back) == repr(found)
    assert len(repr(found).splitlines()) <= 3
    back.write(tmp_path / "b")
    assert (tmp_path / "b/diagnosis.json").read_bytes() == (tmp_path / "a/diagnosis.json").read_bytes()


@pytest.mark.parametrize("kind", ["diagnosis", "axis diagnosis", "map diagnosis", "stored diagnosis"])
def test_every_diagnosis_has_a_page(kind: str, measured: dict[str, Any], tmp_path: Path) -> None:
    sg.report(measured[kind], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "What to do first" in page
    assert f"Verdict: {measured[kind].verdict}" in page


def test_a_table_in_memory_is_diagnosed_as_its_file(measured: dict[str, Any], tmp_path: Path) -> None:
    measured["recording"].write(tmp_path / "r.csv")
    frame = pd.read_csv(tmp_path / "r.csv", comment="#")
    frame.attrs = dict(measured["recording"].comments)
    of_table, of_file = (sg.diagnose(one, GAUGE, MACHINE) for one in (frame, tmp_path / "r.csv"))
    assert of_table.summary() == of_file.summary()
    one = measured["axis recording"]
    one.write(tmp_path / "a.csv")
    frame = pd.read_csv(tmp_path / "a.csv", comment="#")
    frame.attrs = {"recording": "axis", "unit": one.units.position, "sensor": one.sensor}
    assert sg.diagnose(frame).summary() == measured["axis diagnosis"].summary()
    with pytest.raises(sg.InputError, match="reading"):
        sg.diagnose(frame.drop(columns="reading_mm"))


def test_an_axis_and_a_probe_are_diagnosed_as_at_the_command_line(
    tmp_path: Path,
    run: Command,  # noqa: F811
    measured: dict[str, Any],
) -> None:
    axis_csv, chart = tmp_path / "axis.csv", tmp_path / "map.csv"
    measured["axis recording"].write(axis_csv)
    measured["probe map"].write(chart)
    for words in ((axis_csv,), (chart, "--probe", "omp40-2-50mm")):
        done = run("diagnose", *words, "-o", tmp_path / "cli" / Path(words[0]).stem)
        assert done.code == 0, done.err
    found = sg.diagnose([sg.read_axis_recording(axis_csv)])
    assert found.to_frame().set_index("kind").loc["scale_error", "value"] == pytest.approx(20.0, abs=1.0)
    found.write(tmp_path / "python/axis")
    sg.diagnose(measured["probe map"], probe="omp40-2-50mm").write(tmp_path / "python/map")
    for name in ("axis", "map"):
        both = (read_json(tmp_path / place / name / "diagnosis.json") for place in ("cli", "python"))
        of_verb, of_python = ({**one, "made_from": [], "checksum": ""} for one in both)  # the verb notes what it read
        if name == "map":
            assert of_verb.pop("inputs")["map"]["sha256"]
            assert of_python.pop("inputs")["probe"]
        assert of_verb == of_python


def test_a_notebook_escapes_what_files_say(measured: dict[str, Any]) -> None:
    recording = measured["recording"].assign_comments(operator="<script>alert(1)</script>")
    assert "<script>" not in recording._repr_html_()
    assert "&lt;script&gt;" in recording._repr_html_()


def test_results_come_back_from_their_files(tmp_path: Path, measured: dict[str, Any]) -> None:
    gauge = measured["gauge"]
    measured["evaluation"].write(tmp_path)
    back = sg.read_evaluation(tmp_path)
    assert back == measured["evaluation"] == sg.read_evaluation(tmp_path, gauge) == sg.read_result(tmp_path)
    assert back.to_frame().equals(measured["evaluation"].to_frame())
    assert back.summary() == measured["evaluation"].summary()
    back.write(tmp_path / "again")
    assert (tmp_path / "again/evaluation.json").read_bytes() == (tmp_path / "evaluation.json").read_bytes()
    limited = sg.evaluate(measured["recording"], gauge, mpe="min(1.8 + L/350, 3)")
    limited.write(tmp_path / "limited")
    back = sg.read_evaluation(tmp_path / "limited", gauge)
    assert (back.limit, back.summary()) == (limited.limit, limited.summary())
    assert "errors are beyond the limit" in back.summary()
    measured["budget"].write(tmp_path)
    assert sg.read_budget(tmp_path) == measured["budget"]
    measured["placement"].write(tmp_path / "p.toml")
    placement = sg.read_placement(tmp_path / "p.toml", gauge)
    np.testing.assert_allclose(placement.to_frame(), measured["placement"].to_frame(), rtol=0, atol=2e-12)
    assert placement.details == measured["placement"].details
    measured["run"].write(tmp_path / "r.csv")
    table, written = sg.read_recording(tmp_path / "r.csv").to_frame(), measured["run"].to_frame()
    np.testing.assert_allclose(table[written.columns], written, rtol=0, atol=5.1e-5)
    np.testing.assert_allclose(table[["x_mm", "y_mm", "z_mm"]], written[["x_mm", "y_mm", "z_mm"]], rtol=0, atol=5.1e-8)
    measured["probe map"].write(tmp_path / "map.csv")
    found = sg.read_probe_map(tmp_path / "map.csv")
    np.testing.assert_allclose(found.to_frame(), measured["probe map"].to_frame(), rtol=5.1e-6)


def test_the_decision_is_a_value_of_every_result_with_limits(tmp_path: Path, measured: dict[str, Any]) -> None:
    """Proven below MPE - U, nonconformity proven above MPE + U, else the reason; also in the JSON and read back."""
    gauge, machine, moved = (measured[name] for name in ("gauge", "machine", "run"))
    known = machine.set_uncertainty(gauge_temperature_K=0.02, probing_um=0.1, resolution_um=0.1)
    budget = sg.budget(moved, gauge, known, runs=0, placements=measured["placement"])
    assert not budget.not_included
    for mpe, passed, outcome in (("50", True, "conforms"), ("0.01", False, "does not conform")):
        found = sg.evaluate(moved, gauge, mpe=mpe, budget=budget, placements=measured["placement"])
        assert (found.decision.passed, found.decision.outcome, found.decision.reason) == (passed, outcome, "")
        found.write(tmp_path)
        assert read_json(tmp_path / "evaluation.json")["decision"]["passed"] is passed
        assert sg.read_evaluation(tmp_path).decision == found.decision
    bare = sg.evaluate(moved, gauge, mpe="50").decision
    assert (bare.passed, "the uncertainty budget" in bare.reason) == (None, True)
    assert sg.evaluate(moved, gauge).decision.reason == "no limit was stated"
    length = sg.iso10360(moved, gauge, mpe="50")
    positioning = sg.iso230(moved, gauge, tolerances="A=500", expanded_uncertainty_um=1.0)
    assert (length.decision.passed, positioning.decision.passed) == (None, True)
    assert "positions" in length.decision.reason
    for one in (length, positioning):
        one.write(tmp_path / "test")
        assert sg.read_result(tmp_path / "test" / f"{one.name}.json").decision == one.decision
        said = read_json(tmp_path / "test" / f"{one.name}.json")["decision"]
        assert (said["passed"], said["reason"]) == (one.decision.passed, one.decision.reason)
    with pytest.raises(sg.InputError, match="budget: needs mpe, or machine with a limit"):
        sg.evaluate(moved, gauge, budget=budget)


def test_a_report_of_an_object_says_what_that_of_its_files_says(tmp_path: Path, measured: dict[str, Any]) -> None:
    evaluation, placement, budget = (measured[name] for name in ("evaluation", "placement", "budget"))
    evaluation.write(tmp_path)
    budget.write(tmp_path)
    placement.write(tmp_path / "p.toml")
    import datetime

    said = {"operator": "A. Person", "date": datetime.date(2026, 3, 2), "machine": MACHINE}
    sg.report(evaluation, tmp_path / "a.html", placements=placement, budget=budget, **said)
    files = {"gauge": GAUGE, "placements": [tmp_path / "p.toml"], "budget": tmp_path}
    sg.report(tmp_path, tmp_path / "b.html", **files, **said)
    of_object, of_files = ((tmp_path / name).read_text(encoding="utf-8") for name in ("a.html", "b.html"))
    assert "A. Person" in of_object
    assert re.findall(r"<td[^>]*>(.*?)</td>", of_object) == re.findall(r"<td[^>]*>(.*?)</td>", of_files)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda m: sg.plan(m["placement"], m["gauge"], cycles=0), "cycles: out of range; found 0"),
        (lambda m: sg.plan(m["placement"], m["gauge"], route="under"), "route: not a choice; found 'under'"),
        (lambda m: sg.plan(m["placement"], m["gauge"], clearance_mm=-1.0), "clearance_mm: out of range"),
        (lambda m: sg.read_gauge(None), "gauge file: this names no file; found None"),
        (
            lambda m: sg.locate(np.full((16, 3), np.nan), m["gauge"]),
            "points: point 1 is not known; found nan, nan, nan",
        ),
        (
            lambda m: sg.simulate(m["plan"], MACHINE, m["gauge"], m["placement"], gauge_temperature_C=float("nan")),
            "gauge_temperature_C: no temperature of a gauge; found nan; expected -10 to 60 deg C",
        ),
        (
            lambda m: sg.simulate(m["plan"], MACHINE, m["gauge"], m["placement"], gauge_temperature_C=100.0),
            "gauge_temperature_C: no temperature of a gauge; found 100.0",
        ),
        (lambda m: sg.plan(m["gauge"], m["placement"]), "this is no gauge; found Placement"),
        (lambda m: m["plan"].text("fortran"), "not a dialect; found 'fortran'"),
        (lambda m: m["plan"].write("program.txt"), "the suffix does not say the dialect"),
        (lambda m: sg.evaluate(m["gauge"], m["gauge"]), "this is no recording; found Gauge"),
        (lambda m: sg.evaluate([], m["gauge"]), "recordings: there is none"),
        (lambda m: sg.evaluate(m["run"], m["gauge"], r_eff_origin="last"), "r_eff_origin: not a choice"),
        (lambda m: m["evaluation"].plot(placement=4), "the evaluation does not have it; found 4; expected 1"),
        (lambda m: sg.locate([[0.0, 0.0, 0.0]], m["gauge"]), "points: not 16 points"),
        (lambda m: sg.report(m["evaluation"], "report.docx"), "not a kind of report"),
        (lambda m: sg.report("nowhere", "report.pdf"), "no such file"),
        (lambda m: sg.budget(m["run"], m["gauge"], MACHINE, coverage_percent=101.0), "coverage_percent: out of range"),
        (lambda m: sg.budget(m["run"], m["gauge"], MACHINE, gauge_temperature_C=293.0), "no temperature of a gauge"),
        (lambda m: sg.simulate(m["plan"], MACHINE, m["gauge"], m["placement"], seed=-1), "seed: out of range"),
        (lambda m: sg.diagnose(m["run"]), "gauge: a recording of a gauge needs it"),
        (lambda m: sg.diagnose(m["run"], GAUGE), "machine: a recording of a gauge needs it"),
        (
            lambda m: sg.diagnose(m["axis recording"], GAUGE),
            "gauge: a recording of one axis, a spot or distances needs",
        ),
        (lambda m: sg.diagnose([m["axis recording"], m["run"]]), "this is of one axis, the others are of a gauge"),
        (lambda m: sg.diagnose(m["gauge"], probe="omp40-2-50mm"), "map: this is no map; found Gauge"),
        (lambda m: sg.probe_map("omp40-2-50mm", polar_deg="200"), "polar_deg: angle out of range; found 200"),
        (lambda m: sg.evaluate(m["run"], m["gauge"], blocks="1:99"), "blocks: last block is not on this gauge"),
        (lambda m: sg.evaluate(m["run"], m["gauge"], measured_at="02.03.26"), "measured_at: measured_at is no date"),
        (lambda m: sg.plan(replace(m["placement"], tip_radius_mm=None), m["gauge"]), "expected tip_radius_mm, machine"),
        (lambda m: sg.read_diagnosis(POINTS), "not valid JSON"),
        (lambda m: sg.probe_map("omp40-2-50mm", stylus_direction=(0, 0, 0)), "stylus_direction: not a direction"),
    ],
)
def test_wrong_input_is_one_line(wrong: Any, message: str, measured: dict[str, Any]) -> None:
    with pytest.raises(sg.InputError, match=re.escape(message)) as raised:
        wrong(measured)
    assert "\n" not in str(raised.value)


def test_a_program_that_is_stopped_raises_unless_it_is_kept(measured: dict[str, Any]) -> None:
    placement = measured["placement"]
    off_mm = np.array([40.0, 0.0, 0.0])
    aside = replace(placement, c1_mm=placement.c1_mm + off_mm, c2_mm=placement.c2_mm + off_mm)
    given = (measured["plan"], MACHINE, measured["gauge"], placement)
    with pytest.raises(sg.ProgramStoppedError):
        sg.simulate(*given, true_placement=aside)
    kept = sg.simulate(*given, true_placement=aside, keep_stopped=True)
    assert kept.stop is not None
    assert "stopped: " in kept.summary()


def test_the_package_is_typed_and_a_module() -> None:
    assert (Path(sg.__file__).parent / "py.typed").exists()
    assert isinstance(sg, types.ModuleType)


@pytest.mark.parametrize(
    "kind", ["gauge", "placement", "plan", "run", "recording", "evaluation", "budget", "probe map"]
)
def test_a_result_shows_itself_in_a_few_lines(kind: str, measured: dict[str, Any]) -> None:
    shown = repr(measured[kind])
    assert shown.startswith(f"{type(measured[kind]).__name__}:\n")
    assert len(shown.splitlines()) <= 8
    assert len(shown) < 1000


def test_a_table_in_a_notebook_keeps_every_digit_of_a_position(measured: dict[str, Any]) -> None:
    assert "400.00035" in measured["gauge"]._repr_html_()


def test_a_data_frame_goes_in_where_a_recording_does(measured: dict[str, Any]) -> None:
    frame = measured["run"].recording.to_frame()
    assert sg.evaluate(frame, GAUGE).r_eff_mm == measured["evaluation"].r_eff_mm
    with pytest.raises(
        sg.InputError, match=r"which face each point belongs to; .* import_recording\(table, gauge=.., placement=..\)"
    ):
        sg.evaluate(frame.drop(columns="face"), GAUGE)


def test_help_shows_types_and_no_options_and_a_wrong_name_is_answered() -> None:
    """What the command line makes of a parameter is nothing for ``help()``; ``sensr`` was meant to be ``sensor``."""
    shown = str(inspect.signature(sg.plan))
    assert "cycles: int = 5" in shown
    assert "Annotated" not in shown
    with pytest.raises(TypeError, match=r"import_recording\(\) .*'sensr'; did you mean 'sensor'\?"):
        sg.import_recording("log.csv", sensr="laser interferometer")


def test_help_explains_every_argument_that_a_verb_takes() -> None:
    """Also those that another verb defines, as what a person states on a report."""
    verbs = [one for one in (getattr(sg, name) for name in sg.__all__) if hasattr(one, "verb")]
    assert len(verbs) > 35
    for one in verbs:
        told = dict(re.findall(r"^(\w+) : (\S.*)$", one.__doc__ or "", re.M))
        assert not set(inspect.signature(one).parameters) - set(told), one.__name__


def test_a_row_of_a_table_is_named_as_pandas_names_it(measured: dict[str, Any]) -> None:
    """Whatever reads it, and whatever its index is: of a filtered table no label is the number of a row."""
    probed = measured["recording"].to_frame()
    axis = sg.import_recording("docs/recipes/data/laser.csv", sensor="laser").recording
    read = axis.frame.copy()
    read.attrs = {"recording": "axis", "unit": "mm", "sensor": "laser"}
    sphere = sg.probe_sphere("omp40-2-50mm", seed=3).to_frame()
    chart = sg.probe_map("omp40-2-50mm").to_frame()
    size = {"sphere_diameter_mm": 25.0, "tip_diameter_mm": 6.0}
    asked: list[tuple[pd.DataFrame, str, Callable[[pd.DataFrame], object]]] = [
        (probed, "x_mm", lambda table: sg.evaluate(table, measured["gauge"])),
        (probed, "x_mm", lambda table: sg.import_recording(table, gauge=measured["gauge"])),
        (read, "reading", lambda table: sg.diagnose(table)),
        (sphere, "y_mm", lambda table: sg.qualify_probe(table, **size)),
        (sphere.rename(columns={"y_mm": "Y [mm]"}), "Y [mm]", lambda table: sg.qualify_probe(table, **size)),
        (chart, "pretravel_um", lambda table: sg.diagnose(table, probe="omp40-2-50mm")),
    ]
    for table, column, call in asked:
        for wrong in ("abc", "12,x"):
            bad = table.astype(object).set_axis(np.arange(len(table)) + 1000)
            bad.iloc[5, list(table.columns).index(column)] = wrong
            with pytest.raises(sg.InputError, match=r"^DataFrame\.iloc\[5\]: "):
                call(bad)


def test_a_recording_in_inches_is_read_from_its_file_as_from_a_table(measured: dict[str, Any], tmp_path: Path) -> None:
    """A file that lacks a column of ours is a table of any make, as a DataFrame is."""
    inches = measured["recording"].to_frame()
    for one in "xyz":
        inches[f"{one}_in"] = inches.pop(f"{one}_mm") / 25.4
    inches.to_csv(tmp_path / "inch.csv", index=False)
    evaluated = [sg.evaluate(one, measured["gauge"]) for one in (inches, tmp_path / "inch.csv")]
    assert evaluated[0].r_eff_mm == pytest.approx(evaluated[1].r_eff_mm, abs=1e-7)
    assert evaluated[1].r_eff_mm == pytest.approx(measured["evaluation"].r_eff_mm, abs=1e-7)


@pytest.mark.parametrize("given", ["axsi.csv", ["axsi.csv", "axsi-2.csv"]])
def test_a_file_that_is_not_there_is_told_before_whatever_else_is_missing(
    given: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the file of the folder that may have been meant, if any."""
    monkeypatch.chdir(tmp_path)
    for name in ("axis.csv", "axis.toml", "notes.txt"):
        Path(name).touch()
    one_file = given[0] if isinstance(given, list) else given
    for verb in (sg.diagnose, sg.iso230, partial(sg.evaluate, gauge=GAUGE)):
        with pytest.raises(sg.InputError, match=r"^axsi\.csv: no such file; expected axis\.csv\?$"):
            verb(given)
        with pytest.raises(sg.InputError, match="recordings: there is none; expected one recording or more"):
            verb([])
    for verb in (partial(sg.iso230_3, test="etve"), partial(sg.compensate, to="csv", axis="x")):
        with pytest.raises(sg.InputError, match=r"^axsi\.csv: no such file; expected axis\.csv\?$"):
            verb(one_file)
    with pytest.raises(sg.InputError, match=r"^other\.dat: no such file$"):
        sg.diagnose("other.dat")


def test_an_option_that_is_there_several_times_is_a_list_in_python() -> None:
    assert python_text("left out: --without gauge_temperature --without misalignment.") == (
        'left out: without=["gauge_temperature", "misalignment"].'
    )
    assert python_text("with --without geometric_errors, and") == 'with without="geometric_errors", and'
    assert python_text('--column reading="Dev [um]" --column target=T') == (
        'columns={"reading": "Dev [um]"} columns={"target": "T"}'
    )


def test_positions_of_faces_along_a_placed_gauge_are_touches_of_it(measured: dict[str, Any]) -> None:
    """Nothing is left to ask where gauge and placement are stated; without them one question names both ways."""
    gauge, lies = measured["gauge"], measured["placement"]
    nominal = np.tile(gauge.nominal_mm, 3)
    table = pd.DataFrame({"face": np.tile(np.arange(1, gauge.n_faces + 1), 3), "nominal": nominal})
    table["measured"] = np.tile(gauge.position_mm, 3) + 0.004 + np.random.default_rng(1).normal(0.0, 1e-4, len(table))
    errors = sg.evaluate(sg.import_recording(table, gauge=gauge, placement=lies), gauge).to_frame()
    assert errors["xm_um"].abs().max() < 0.5
    open_ = sg.import_recording(table).summary()
    assert "placement with the gauge, for the errors of its faces" in open_
    assert 'sensor="touch" with the gauge, for one axis' in open_


def test_the_budget_of_an_axis_is_told_where_it_is(measured: dict[str, Any]) -> None:
    """ISO 230-2 has mean and s at every target; u of a mean is s over the root of the runs (GUM 4.2.3)."""
    stage = sg.import_recording("docs/recipes/data/laser.csv", sensor="laser").recording
    for verb in (sg.evaluate, partial(sg.budget, machine=measured["machine"])):
        with pytest.raises(sg.InputError, match="of this one iso230 gives mean and u at every target, diagnose the c"):
            verb(stage, gauge=measured["gauge"])
    targets = sg.iso230(stage).to_frame()
    assert targets["u_mean_up_um"].to_numpy() == pytest.approx(targets["s_up_um"].to_numpy() / np.sqrt(5.0))
    assert targets["u_mean_down_um"].to_numpy() == pytest.approx(targets["s_down_um"].to_numpy() / np.sqrt(5.0))


def test_levels_of_a_pivoted_table_with_short_names_are_direction_and_no_readings() -> None:
    """``r`` and ``d`` are labels of runs and of a way back elsewhere; beside values they are what they hold."""
    random = np.random.default_rng(3)
    every = [(x, r, d) for r in (1, 2, 3) for d in ("up", "down") for x in np.arange(0.0, 501.0, 50.0)]
    long = pd.DataFrame(every, columns=["x", "r", "d"])
    long["um"] = 8e-3 * long["x"] + np.where(long["d"] == "up", 1.0, -1.0) + random.normal(0.0, 0.1, len(long))
    wide = long.pivot_table(index="x", columns=["r", "d"], values="um")
    stage = sg.import_recording(wide, sensor="laser", unit="mm", deviation_unit="um").settled()
    assert sg.iso230(stage).test.axes[0].parameters.mean_B_um == pytest.approx(2.0, abs=0.2)
    other = long.rename(columns={"d": "side", "r": "pass", "x": "target"}).drop(columns="pass")
    asked = sg.import_recording(other, sensor="laser", unit="mm", deviation_unit="um", columns={"deviation": "um"})
    assert "way" in asked.summary()


def test_a_series_is_a_table_of_its_name_and_of_that_of_its_index() -> None:
    read = pd.Series([0.0, 0.1, 0.2, 0.1], pd.Index([0.0, 60.0, 120.0, 180.0], name="time_s"), name="reading_um")
    spot = sg.import_recording(read, sensor="capacitive").settled()
    assert list(spot.frame["reading"]) == list(read)
    assert list(spot.frame["time_s"]) == list(read.index)
    with pytest.raises(sg.InputError, match=r"^setting up 2 repeats the readings of setting up 1"):
        sg.diagnose([spot, spot])


def test_who_measured_stands_in_the_report_of_a_test(tmp_path: Path) -> None:
    """In Python as at the command line; what is no statement is no argument."""
    test = sg.iso230(sg.import_recording("docs/recipes/data/laser.csv", sensor="laser"))
    test.write(tmp_path / "test", operator="Ada Byron")
    assert (tmp_path / "test/iso230.pdf").stat().st_size > 2000
    with pytest.raises(TypeError, match="operater"):
        test.write(tmp_path / "other", operater="Ada Byron")


def test_coordinates_under_odd_names_are_asked_for_by_all_their_names(measured: dict[str, Any]) -> None:
    odd = measured["recording"].to_frame().rename(columns={"x_mm": "P1", "y_mm": "P2", "z_mm": "P3"})
    asked = sg.import_recording(odd, gauge=measured["gauge"], placement=measured["placement"])
    assert "and so on for x_mm, y_mm, z_mm" in asked.summary()


def test_blocks_from_the_far_end_are_told_the_other_way_round(measured: dict[str, Any]) -> None:
    with pytest.raises(sg.InputError, match=r"first block is behind its last one; found '5:2'; expected 2:5"):
        sg.evaluate(measured["run"], measured["gauge"], blocks=(5, 2))


def test_a_table_goes_in_where_its_file_does() -> None:
    """Points of a sphere, displacements, a map: a DataFrame or a result gives the same numbers."""
    sphere = sg.probe_sphere("omp40-2-50mm", seed=3)
    size = {"sphere_diameter_mm": 25.0}
    qualified = [sg.qualify_probe(one, tip_diameter_mm=6.0, **size) for one in (sphere, sphere.to_frame())]
    assert qualified[0] == qualified[1]
    tested = [sg.iso10360_5(one, tip_diameters_mm=6.0, **size) for one in (sphere, [sphere.to_frame()])]
    assert tested[0].summary() == tested[1].summary()
    assert "imulated" in str(tested[0].test)
    minutes = np.arange(0.0, 150.0)
    table = pd.DataFrame({"time_s": 60.0 * minutes, "x1_um": np.sin(minutes / 40.0), "room_C": 20.0 + minutes / 300.0})
    assert sg.iso230_3(table, test="etve").summary() == sg.iso230_3(table.set_index("time_s"), test="etve").summary()
    with pytest.raises(
        sg.InputError, match=r"DataFrame: a column is neither displacement nor temperature; found x1_foo"
    ):
        sg.iso230_3(table.rename(columns={"x1_um": "x1_foo"}), test="etve")
    probe_map = sg.probe_map("omp40-2-50mm")
    assert sg.diagnose(probe_map.to_frame(), probe="omp40-2-50mm").verdict == "adequate"


def test_a_recording_as_a_table_is_the_same_recording(measured: dict[str, Any]) -> None:
    """Its comments go with it: the gauge that it was measured on, whether it was simulated, a convention."""
    frame = measured["recording"].to_frame()
    assert (
        sg.evaluate(frame, measured["gauge"]).summary()
        == sg.evaluate(measured["recording"], measured["gauge"]).summary()
    )
    with pytest.raises(sg.InputError, match="serial"):
        sg.evaluate(frame, "step-gauge-1020")


def test_a_fault_is_put_into_a_machine_and_what_is_none_is_refused_there() -> None:
    machine = sg.read_machine("bridge-cmm")
    worn = machine.add_effect("reversal_error", axis="y", um=5.0)
    assert worn.effects == (*machine.effects, {"kind": "reversal_error", "axis": "y", "um": 5.0})
    assert "reversal error" in worn.summary()
    with pytest.raises(sg.InputError, match=r"kind is not a known effect; found 'reversal_eror'"):
        machine.add_effect("reversal_eror", axis="y", um=5.0)
    with pytest.raises(sg.InputError, match=r"um is missing"):
        machine.add_effect("reversal_error", axis="y", ppm=5.0)


LIVE = ("sg.serve", "sg.measure", "sg.investigate", "sg.fleet_cluster")
UNSHIPPED = (
    *("probe.ngc", "results.dmo", '"points.csv", gauge="step-gauge-420", placement', "sensors.csv", "warm-up.csv"),
    *(
        "pushes.csv",
        "gauge.xml",
        "laboratory.toml",
        "roster",
        "scheduler=",
        "my-dialect.j2",
        "positioning.xlsx",
        "my-",
        "step-gauge-1020",
    ),
    *(
        "before",
        "archive",
        "cause",
        "certificate",
        "diagonals",
        "logs",
        "exported",
        "rough.csv",
        '"fleet"',
        'axis="x"',
        "monte-carlo",
    ),
)
"""What is not made here, of which the call is only bound to the function."""


def test_examples_in_help_are_python_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of all verbs, one after the other in a folder with the files that they name."""
    names = {verb.function.__name__ for _, verb in all_verbs()} & {*sg.__all__}
    texts = {name: inspect.getdoc(getattr(sg, name)) or "" for name in names}
    assert [name for name, text in texts.items() if re.search(r"\bstepgauge [a-z0-9]+ |(?<![\w-])--[a-z]", text)] == []
    lines = {line for text in texts.values() for line in re.findall(r"^>>> (sg\..*)", text, re.M)}
    monkeypatch.chdir(tmp_path)
    (tmp_path / "points.csv").write_bytes(POINTS.read_bytes())
    (tmp_path / "machine.toml").write_text(str(sg.list_files("bridge-cmm.toml")), encoding="utf-8")
    ran, first = (
        0,
        (
            "sg.locate",
            'sg.plan("placement.toml"',
            "sg.simulate",
            "sg.evaluate(",
            "sg.probe_",
            "sg.qualify_",
            "sg.budget(",
        ),
    )
    order = {one: next((i for i, head in enumerate(first) if one.startswith(head)), 9) for one in lines}
    for line in sorted(lines, key=lambda one: (order[one], -len(one), one)):
        if line.startswith(LIVE) or any(one in line for one in UNSHIPPED):
            ast.parse(line)
            continue
        eval(line, {"sg": sg, "glob": glob})
        ran += 1
        if line.startswith("sg.simulate"):
            for seed, name in enumerate(("x", "y", "diagonal", "along-x", "along-y", "position-1"), 1):
                found = sg.simulate("gauge.dmi", "bridge-cmm", GAUGE, "placement.toml", seed=seed)
                found.write(f"{name}.csv")
        if line.startswith("sg.probe_sphere"):
            (tmp_path / "part.csv").write_bytes((tmp_path / "sphere.csv").read_bytes())
            axis(np.arange(0.0, 300.0, 20.0), lambda target, way: 0.01 * target).write("axis.csv")
    assert ran > 25


def test_what_is_listed_can_be_gone_through() -> None:
    assert "step-gauge-420" in list(sg.list_gauges())
    assert list(sg.list_gauges()) == [name for name, _ in sg.list_gauges().rows]
