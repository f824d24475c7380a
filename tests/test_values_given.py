"""What Python gives a verb: the kinds of its parameters take it, or say what is wrong, found and expected."""

from __future__ import annotations

import inspect
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.verbs.catalogue import all_verbs
from stepgauge.verbs.kinds import Pair, Reads, Repeated, Text
from tests.axis.test_conditions import table
from tests.conftest import ROOT


def axis() -> Any:
    return sg.import_recording(table(), sensor="laser").settled()


@pytest.mark.parametrize("given", [{"A": 12}, MappingProxyType({"A": 12.0}), "A=12", ["A=12"], ("A=12",)])
def test_pairs_are_a_mapping_or_texts(given: Any) -> None:
    assert sg.iso230(axis(), tolerances=given).test.requirement.tolerance_um == {"A": 12.0}


def test_every_parameter_of_every_verb_refuses_what_is_none_of_its_kind() -> None:
    """By name; whatever the kind, an object that nothing understands ends as one line."""
    checked = 0
    for _, verb in all_verbs():
        for one in verb.parameters:
            if isinstance(one.one, Reads | Text | Pair):
                lists = [] if getattr(one.one, "numbers", False) else [[3 + 4j]]
                for wrong in (*lists, b"text", object()):
                    with pytest.raises(InputError, match=f"^{one.name}: .*found .*expected "):
                        one.kind.taken(one.name, wrong)
                    checked += 1
    assert checked > 200


def test_a_number_is_taken_for_a_text_that_is_one() -> None:
    assert Text("LIMIT").taken("mpe", 3.0) == "3.0"
    assert Text("LIMIT").taken("mpe", np.float64(3.5)) == "3.5"
    assert Repeated(Pair(names=("A",)), "limit").taken("limits", ["A=3"]) == {"A": 3.0}


@pytest.mark.parametrize("wrong", [{"a": 1}, np.zeros((3, 2)), 3.0, None, b"x", [pd.DataFrame()]])
def test_an_import_takes_a_path_an_open_file_or_a_table(wrong: Any) -> None:
    with pytest.raises(InputError, match=r"^log: neither a file nor what is read from one"):
        sg.import_recording(wrong, sensor="laser")


def test_a_diagnosis_takes_what_an_import_gives() -> None:
    asked = sg.import_recording(table(1e-3), sensor="laser")
    with pytest.raises(InputError, match="is their unit um"):
        sg.diagnose(asked)
    stated = sg.import_recording(table(1e-3), sensor="laser", deviation_unit="um")
    assert sg.diagnose(stated).contents == sg.diagnose(stated.recording).contents
    with pytest.raises(InputError, match=r"a table that is no recording.*import_recording"):
        sg.diagnose(table())


def test_every_diagnosis_tells_its_progress() -> None:
    """Of an axis and of the map of a probe as of a gauge."""
    heard: list[list[str]] = []
    sg.diagnose(axis(), progress=heard.append)
    assert heard
    before = len(heard)
    sg.diagnose(sg.probe_map("omp40-2-50mm"), probe="omp40-2-100mm", progress=heard.append)
    assert len(heard) > before


def test_a_qualification_goes_in_as_it_was_found_written_or_read_back(tmp_path: Path) -> None:
    sphere = sg.probe_sphere("omp40-2-50mm", seed=3)
    found = sg.qualify_probe(sphere, sphere_diameter_mm=25.0, tip_diameter_mm=6.0)
    found.write(tmp_path / "q.json")
    given = (found, tmp_path / "q.json", sg.read_result(tmp_path / "q.json"))
    first, *others = [sg.compensate_points(sphere, qualification=one).to_frame() for one in given]
    assert all(one.equals(first) for one in others)
    with pytest.raises(InputError, match="qualification: this is no qualification; found SpherePoints"):
        sg.compensate_points(sphere, qualification=sphere)


def test_a_wrong_name_is_answered_by_one_that_the_verb_takes_and_was_not_given() -> None:
    """Before what is missing, for that may be what was misspelt."""
    with pytest.raises(TypeError, match=r"argument 'tip_diameter_mm'; did you mean 'tip_diameters_mm'\?"):
        sg.iso10360_5([], tip_diameter_mm=3.0)
    with pytest.raises(TypeError, match=r"argument 'set'; did you mean 'constants'\?"):
        sg.import_recording("log.csv", set={"direction": "+"})
    with pytest.raises(TypeError, match="argument 'colour'; it takes points, gauge, machine, "):
        sg.locate("points.csv", "step-gauge-420", colour="red")
    for name in {verb.function.__name__ for _, verb in all_verbs()} & {*sg.__all__}:
        function = getattr(sg, name)
        known = inspect.signature(function).parameters
        for wrong in {other for one in known for other in (one[:-1], one.replace("_", ""), f"{one}_mm")} - {*known}:
            with pytest.raises(TypeError, match=f"{name}.* argument '{wrong}'; ") as raised:
                function(**{wrong: 1})
            near = re.search(r"did you mean '(\w+)'", str(raised.value))
            assert near is None or near[1] in known


def test_a_report_of_a_test_says_who_writes_it(tmp_path: Path) -> None:
    test = sg.iso230(axis())
    with pytest.raises(InputError, match=r"writes its own report.*write\(folder, operator"):
        sg.report(test, tmp_path / "x.pdf")
    assert not list(tmp_path.iterdir())
    paths = test.write(tmp_path)
    assert any(path.suffix == ".pdf" for path in paths)
    with pytest.raises(InputError, match=r"^axes: .*plot\(\) alone"):
        test.plot(test.plot())


def test_missing_readings_cost_their_targets_where_that_leaves_more() -> None:
    """Two gaps in different runs left one run of three: the 15 targets without them are whole in all."""
    holed = table()
    holed.loc[[5, 40], "deviation [um]"] = np.nan
    (one,) = sg.iso230(sg.import_recording(holed, sensor="laser", accept="missing")).test.axes
    assert (len(one.targets.machine_mm), one.runs) == (15, (1, 2, 3))
    short = table(runs=5).iloc[:-20]  # a run that was stopped costs itself
    (one,) = sg.iso230(sg.import_recording(short, sensor="laser")).test.axes
    assert (len(one.targets.machine_mm), one.runs) == (17, (1, 2, 3, 4))


def test_recordings_are_equal_where_their_numbers_are(tmp_path: Path) -> None:
    one = axis()
    one.write(tmp_path / "axis.csv")
    back = sg.read_axis_recording(tmp_path / "axis.csv")
    back.write(tmp_path / "again.csv")
    assert sg.read_axis_recording(tmp_path / "again.csv") == back
    assert axis() == one
    assert one != replace(one, frame=one.frame.assign(reading=one.frame["reading"] + 1e-3))
    assert one != "axis"


def test_a_shipped_file_is_its_text_and_can_be_copied_to_be_changed(tmp_path: Path) -> None:
    one = sg.list_files("bridge-cmm.toml")
    assert tomllib.loads(str(one))["machine"]
    (copy,) = one.copy(tmp_path)
    assert copy.read_text().rstrip("\n") == str(one)
    for again in (one, sg.list_files()):
        with pytest.raises(InputError, match=r"exists already|which file\?"):
            again.copy(tmp_path)


def test_a_direction_of_1_and_0_is_told_what_is_understood() -> None:
    given = table().replace({"direction": {"+": 1, "-": 0}})
    asked = sg.import_recording(given, sensor="laser")
    assert asked.recording is None
    assert ("columns", "way=direction=1") in [(one.argument, one.value) for one in asked.questions[0].choices]
    answered = sg.import_recording(given, sensor="laser", columns={"way": "direction=1"}).recording
    stated = sg.import_recording(table(), sensor="laser").recording
    assert answered.frame["way"].tolist() == stated.frame["way"].tolist()


def test_a_table_of_any_form_is_the_recording_that_it_holds() -> None:
    """Inches, bare names, text, times with a zone, levels of columns, an index: as an import takes them."""
    gauge = sg.read_gauge("step-gauge-420")
    points = pd.read_csv(ROOT / "examples/demo/points.csv", comment="#")
    placement = sg.locate(points, gauge)
    run = sg.simulate(sg.plan(placement, gauge, "bridge-cmm"), "bridge-cmm", gauge, placement)
    frame = run.recording.to_frame()
    positions, zone = ["x_mm", "y_mm", "z_mm"], pd.date_range("2026-03-01", periods=len(frame), freq="3s", tz="UTC")
    inches = frame.drop(columns=positions).assign(**{f"{one[0]}_in": frame[one] / 25.4 for one in positions})
    several = frame.set_axis(pd.MultiIndex.from_tuples([("day 1", one) for one in frame]), axis=1)
    nullable = frame.convert_dtypes()
    assert nullable["face"].dtype == "Int64"
    mean = sg.evaluate(frame, gauge).to_frame()["xm_um"]
    for given in (
        *(inches, several, nullable, frame.astype(str), frame.assign(operator="A. Meyer"), frame.assign(time_s=zone)),
        *(frame.set_index(["placement", "cycle", "face"]), frame.rename(columns={one: one[0] for one in positions})),
    ):
        np.testing.assert_allclose(sg.evaluate(given, gauge).to_frame()["xm_um"], mean, atol=2e-3)
    nullable.loc[3, "x_mm"] = pd.NA
    with pytest.raises(InputError, match=r"x_mm'? is not a (finite )?number"):
        sg.evaluate(nullable, gauge)
    with pytest.raises(InputError, match="no row names the columns x, y and z"):
        sg.evaluate(pd.DataFrame({"a": [1.0], "b": [2.0]}), gauge)
    for given in (
        points.drop(columns=positions).assign(**{f"{one[0]}_in": points[one] / 25.4 for one in positions}),
        points.rename(columns={one: one[0] for one in positions}),
        points[positions].to_numpy(),
        points[::-1],
    ):
        np.testing.assert_allclose(sg.locate(given, gauge).to_frame(), placement.to_frame(), atol=1e-6)


def test_a_pivoted_table_of_an_axis_is_the_table_that_was_pivoted() -> None:
    """With its levels of columns, its index reset or not; without a name the values ask for their unit."""
    long = table()
    names = {"index": "target [mm]", "columns": ["run", "direction"]}
    expected = sg.iso230(axis()).summary()
    pivoted = long.pivot_table(**names)
    for given in (pivoted, pivoted.reset_index()):
        assert sg.iso230(sg.import_recording(given, sensor="laser")).summary() == expected
    bare = long.pivot_table(values="deviation [um]", **names)
    with pytest.raises(InputError, match=r"unit of the deviations is not stated.*found value"):
        sg.import_recording(bare, sensor="laser").settled()
    stated = sg.import_recording(bare, sensor="laser", deviation_unit="um")
    assert sg.iso230(stated).to_frame().equals(sg.iso230(axis()).to_frame())
