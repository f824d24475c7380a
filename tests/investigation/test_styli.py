"""Further styli: each row as its stylus acts, radii of their own, and the run that only another stylus makes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import stepgauge as sg
from stepgauge.cli import main
from stepgauge.diagnosis.further_runs import FurtherRun
from stepgauge.diagnosis.laws.grids import choices_of
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import make_problem
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.effects import Probings, Setting, effect_kinds, make_effects, total_displacement_um
from stepgauge.gauge.placement import make_placement
from stepgauge.inference.problem import Law
from stepgauge.investigation.decision import Case
from stepgauge.investigation.feasible_runs import Reach, possible_runs
from stepgauge.investigation.locating import locating_settings
from stepgauge.investigation.loop import story_of
from stepgauge.investigation.stations import Served, Simulated
from stepgauge.live.controller import Controller, ControllerOptions, Link
from stepgauge.machine.file import ChainTable, Machine
from stepgauge.machine.styli import add_styli, assign_stylus, numbered
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.recording import Recording, join_recordings
from stepgauge.verbs.serve import machine_state
from tests.investigation.made import Person, begun, lies_along_y
from tests.investigation.test_loop import Counting, StoppedError
from tests.live.made import make_state, serving, small_gauge, small_machine, small_program, with_effects, write_files

SHORT_MM, LONG_MM = 50.0, 120.0
PITCH = {"kind": "angular_error", "travel_axis": "y", "rotation_axis": "x", "urad_per_m": 300.0}
"""The arm pitches as it goes out: at the one height of the tip over it that a stylus has, y is too long."""
OTHERS = {"scale_error", "angular_error", "outliers"}
WITHOUT = tuple(kind for kind in effect_kinds() if kind not in OTHERS)


def arm_machine(length_mm: float = SHORT_MM, radius_mm: float = 2.0, name: str = "", **more: Any) -> Machine:
    """A machine with a horizontal arm: the stylus hangs down from the end of the axis y, the last of the chain."""
    base = small_machine(repeatability_um=0.2, **more)
    chain = ChainTable(
        table=[], probe=["x", "z", "y"], reference_mm={"y": [0.0, 0.0, -100.0]}, stylus_mm=[0.0, 0.0, -length_mm]
    )
    probe = {"stylus_length_mm": length_mm, "tip_radius_mm": radius_mm, "stylus_diameter_mm": radius_mm, "tool": name}
    return replace(
        base,
        table=base.table.model_copy(update={"chain": chain}),
        probe=base.probe.model_copy(update=probe),
        path=f"{length_mm:g} mm.toml",
    )


def both() -> Machine:
    return add_styli(arm_machine(), [arm_machine(LONG_MM, 0.8, "Long")])


def probed(n: int = 60) -> pd.DataFrame:
    """Probings all over the machine, with either stylus."""
    random = np.random.default_rng(9201)
    approach = random.normal(size=(n, 3))
    frame = pd.DataFrame(random.uniform(50.0, 350.0, (n, 3)), columns=["x_mm", "y_mm", "z_mm"])
    frame[["approach_i", "approach_j", "approach_k"]] = approach / np.linalg.norm(approach, axis=1, keepdims=True)
    frame["face"], frame["stylus"] = random.integers(1, 9, n), random.integers(1, 3, n)
    return frame.assign(placement=1, cycle=1, time_s=np.arange(float(n)), speed_mm_s=3.0)


def test_each_row_is_that_of_a_machine_with_its_stylus_alone() -> None:
    """Rigid errors in closed form: the tip that hangs lower has the longer arm; carriages are where they are."""
    machine, frame = both(), probed()
    straight = {"kind": "straightness", "axis": "z", "direction": "x", "um": 5.0, "length_mm": 400.0}
    effects = make_effects([PITCH, {**straight, "when": "stylus > 1"}], "machine")
    together = total_displacement_um(effects, Probings(frame, Setting.of(machine)))
    length = np.where(frame["stylus"] == 2, LONG_MM, SHORT_MM)
    angle_mrad = frame["y_mm"].to_numpy() * 300.0e-6
    assert_allclose(together[:, 1], -angle_mrad * (100.0 - length), atol=1e-12)
    carriage_mm = frame["z_mm"] + LONG_MM - (150.0 + SHORT_MM)  # from the middle of its travel
    sagitta = 5.0 * (1.0 - (carriage_mm / 200.0) ** 2) * (frame["stylus"] == 2)
    assert_allclose(together[:, 0], sagitta, atol=1e-12)
    first = (frame["stylus"] == 1).to_numpy()
    unnamed = total_displacement_um(effects[:1], Probings(frame.drop(columns="stylus"), Setting.of(machine)))
    assert_allclose(unnamed[first], together[first], atol=1e-12)


def test_a_longer_stylus_bends_with_its_length_cubed_and_triggers_at_less_force() -> None:
    frame = probed()
    lobes, tripod = make_effects(
        [
            {"kind": "probe_lobing", "amplitude_um": 1.0, "phase_deg": 20.0},
            {"kind": "kinematic_pretravel", "um_per_N": 2.0, "lever_mm": 65.0},
        ],
        "machine",
    )
    setting, rows = Setting.of(both()), (frame["stylus"] == 2).to_numpy()
    bends = (LONG_MM / SHORT_MM) ** 3
    by_law = [total_displacement_um([one], Probings(frame, setting)) for one in (lobes, tripod)]
    first = Probings(frame.drop(columns="stylus"), setting)
    lever = (SHORT_MM + 14.5) / (LONG_MM + 14.5)
    assert_allclose(by_law[0][rows], total_displacement_um([lobes], first)[rows] * bends * lever, atol=1e-12)
    longer = tripod.replace_values(lever_mm=65.0 + LONG_MM - SHORT_MM, um_per_N=2.0 * bends)
    assert_allclose(by_law[1][rows], total_displacement_um([longer], first)[rows], atol=1e-9)
    assert_allclose(by_law[1][~rows], total_displacement_um([tripod], first)[~rows], atol=1e-9)


def test_what_is_no_further_stylus_of_the_machine_is_refused() -> None:
    own, other = arm_machine(), arm_machine(LONG_MM)
    slower = replace(other, table=other.table.model_copy(update={"measuring_speed_mm_s": 1.0}))
    for wrong, words in (
        (slower, "measuring_speed_mm_s differs; found 1.0; expected 3.0"),
        (arm_machine(LONG_MM, effects=(PITCH,)), "its effects differ; found angular_error"),
        (own, "no other stylus than that of 50 mm.toml"),
    ):
        with pytest.raises(sg.InputError, match=words):
            add_styli(own, [wrong])
    with pytest.raises(sg.InputError, match="stylus 3"):
        add_styli(own, [other]).select_stylus(3)


def measured(first: tuple[dict[str, Any], ...], second: tuple[dict[str, Any], ...]) -> Recording:
    """The gauge along y as placements 1 to 3, the second one with stylus 2; each stylus with its own effects."""
    machine, lies, parts = both(), lies_along_y(), list[Recording]()
    for number, stylus in enumerate((1, 2, 1), 1):
        own = machine.select_stylus(stylus)
        faulty = replace(own, effects=(first, second)[stylus - 1], styli=())
        program, conditions = small_program(small_gauge(), own, 3, lies), RunConditions(20.0, number, 300.0 * number)
        run = run_program(program, faulty, small_gauge(), lies, 9200 + number, conditions)
        parts.append(numbered(run.recording, machine))
        assert set(parts[-1].frame["stylus"]) == {stylus}
    return join_recordings(parts)


def test_a_recording_without_numbers_is_known_by_the_name_of_its_stylus() -> None:
    machine, frame = both(), probed(3).drop(columns="stylus")
    for comments, number in (({"stylus": "Long"}, 2), ({"tip_radius_mm": "2"}, 1), ({}, 1)):
        told = numbered(Recording(frame, comments, "r.csv"), machine)
        assert set(told.frame["stylus"]) == {number}
        assert f"stylus_{number}" in told.comments
    for comments, found in (({"stylus": "Longer"}, "Longer"), ({"tip_radius_mm": "0.8"}, "tip_radius_mm 0.8")):
        with pytest.raises(sg.InputError, match=f"which stylus this was; found {found}"):
            numbered(Recording(frame, comments, "r.csv"), machine)
    assert "stylus" not in numbered(Recording(frame, {"stylus": "Long"}), arm_machine()).frame


def test_the_radius_of_a_further_stylus_is_its_own_and_that_of_the_first_a_finding() -> None:
    """8 um of the second alone are no fault of machine or gauge; 3 um of the first are, whatever the second has."""
    without = tuple(kind for kind in effect_kinds() if kind not in {"effective_radius", "tip_change", "outliers"})
    kind, machine = "effective_radius", both()
    new = sg.diagnose(measured((), ({"kind": kind, "um": 8.0},)), small_gauge(), machine, without=without)
    assert new.verdict == "adequate"
    first = measured(({"kind": kind, "um": 3.0},), ({"kind": kind, "um": -5.0},))
    found = sg.diagnose(first, small_gauge(), machine, without=without)
    (one,) = found.findings
    assert one.kind == kind
    um = one.parameters["um"]
    assert um.u is not None
    assert abs(um.value - 3.0) < 4.0 * um.u < 2.0
    data = make_residuals(first, small_gauge(), machine)
    assert [one["placement"] for one in choices_of(effect_kinds()["tip_change"], data)] == [1, 3]
    with pytest.raises(sg.InputError, match="with stylus 2, which is not stated; expected further_styli"):
        make_residuals(first, small_gauge(), arm_machine())
    words = [run.words for run in possible_runs(data, [lies_along_y()] * 3, machine, Reach())]
    assert not any("with stylus" in one for one in words)  # the gauge lay so with both


def test_a_longer_stylus_tells_the_lever_of_a_tripod_from_its_compliance() -> None:
    """Of level gauges with one stylus only the product is told: force is one over lever, compliance is length cubed."""
    without = tuple(one for one in effect_kinds() if one not in {"effective_radius", "kinematic_pretravel", "outliers"})
    machine, gauge, middle = add_styli(small_machine(0.1), [longer()]), small_gauge(), np.array([200.0, 200.0, 60.0])
    tripod = {"kind": "kinematic_pretravel", "um_per_N": 20.0, "lever_mm": 65.0, "arm_azimuth_deg": 20.0}
    by_stylus = [
        tripod,
        {**tripod, "um_per_N": 20.0 * (LONG_MM / SHORT_MM) ** 3, "lever_mm": 65.0 + LONG_MM - SHORT_MM},
    ]
    parts = list[Recording]()
    for number, (stylus, yaw_deg) in enumerate(product((1, 2), (0.0, 35.0, 60.0, 100.0, 140.0)), 1):
        own, axis = (
            machine.select_stylus(stylus),
            np.array([np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg)), 0.0]),
        )
        lies = make_placement(middle - 30.0 * axis, middle + 30.0 * axis, 1, gauge.n_blocks)
        faulty = replace(own, effects=({**by_stylus[stylus - 1], "part": "varying"},), styli=())
        program, conditions = small_program(gauge, own, 3, lies), RunConditions(20.0, number, 300.0 * number)
        run = run_program(program, faulty, gauge, lies, 9300 + number, conditions)
        parts.append(assign_stylus(run.recording, stylus, machine))
    u_mm = []
    for recording in (join_recordings(parts[:5]), join_recordings(parts)):
        (one,) = sg.diagnose(recording, gauge, machine, without=without).findings
        assert one.kind == "kinematic_pretravel"
        lever = one.parameters["lever_mm"]
        assert lever.u is not None
        assert abs(lever.value - 65.0) < 3.0 * lever.u
        u_mm.append(lever.u)
    assert u_mm[1] < u_mm[0] / 2.0
    data = make_residuals(join_recordings(parts), gauge, machine)
    problem = make_problem(data, shipped_priors(), without)
    law = next(one for one in problem.candidates if isinstance(one, Law) and one.kind == "kinematic_pretravel")
    assert problem.in_part is not None
    alone = {one.label: one for one in problem.in_part(law, 0)}[f"{law.label} where stylus >"]
    assert alone.log_odds == law.log_odds + law.log_weight[0]  # no rarer than that of all styli
    assert (np.abs(alone.pattern).max(axis=(0, 1)) > 0.0).tolist() == (data.stylus == 2).tolist()


def longer() -> Machine:
    """The small machine with a longer stylus."""
    base = small_machine(0.1)
    return replace(base, probe=base.probe.model_copy(update={"stylus_length_mm": LONG_MM}))


BOX = ((180.0, 220.0), (100.0, 260.0), (0.0, 200.0))
"""Room along y only: what is within reach with one stylus is soon told."""


def case_with(machine: Machine) -> Case:
    return Case(small_gauge(), machine, Reach(BOX, level=True), minutes=40.0, without=WITHOUT)


class Breaking(Simulated):
    """A machine whose process is killed at a probing with the second stylus, while the gauge is located."""

    repeats = False

    def __init__(self, machine: Machine, count: Counter[str], stop_at: int) -> None:
        super().__init__(machine, small_gauge(), with_effects(PITCH), 9203)
        self.count, self.stop_at = count, stop_at
        self.clock = vars(count).setdefault("clock", self.clock)

    @contextmanager
    def linked(self, settings: ProbingSettings) -> Iterator[Link]:
        with super().linked(settings) as inner:
            yield Counting(inner, settings, self.count if self.stylus == 2 else Counter(), self.stop_at)


def test_only_another_stylus_tells_a_pitch_of_the_arm_from_a_long_scale(tmp_path: Path) -> None:
    """With one stylus the two stay a set; with a longer one at hand it is asked for, once, also after a kill."""
    with begun(
        tmp_path / "one", Breaking(arm_machine(), Counter(), -1), Person(), case=case_with(arm_machine())
    ) as alone:
        last = alone.go_through()
    assert last["end"]["how"] == "set"
    assert "angular_error" in last["found"][0]["set"]
    count, person, case = Counter[str](), Person(), case_with(both())
    with begun(tmp_path / "two", Breaking(both(), count, 3), person, case=case) as found, pytest.raises(StoppedError):
        found.go_through()
    with begun(tmp_path / "two", Breaking(both(), count, -1), person, True, case) as found:
        last = found.go_through()
        said = story_of(found)
    assert last["end"]["how"] == "cause"
    (one,) = last["found"]
    assert one["label"] == "angular_error_y_x"
    value = one["parameters"]["urad_per_m"]
    assert abs(value["value"] - 300.0) < 4.0 * value["u"] < 150.0
    changes = [run for run in said["runs"] if "with stylus 2 (Long, tip radius 0.8 mm, 120 mm long)" in run["words"]]
    assert len(changes) == 1
    assert "angular_error_y_x" in changes[0]["why"]["tells_apart"]
    assert changes[0]["stylus"] == 2
    assert sum(question.startswith("Change to stylus 2 (Long") for question in person.asked) == 1
    assert len(person.asked) == len(set(person.asked))
    recording = found.recording
    assert set(recording.frame.groupby("placement")["stylus"].nunique()) == {1}
    assert recording.comments["stylus_2"].startswith("stylus 2 (Long")
    assert [recording.comments[name] for name in ("tip_radius_mm", "stylus_2_tip_radius_mm")] == ["2", "0.8"]


def test_a_stylus_that_is_not_there_is_declined_like_any_run(tmp_path: Path) -> None:
    case, person = case_with(both()), Person([False] * 20)
    with begun(tmp_path, Breaking(both(), Counter(), -1), person, case=case) as found:
        found.go_through()
        said = story_of(found)
    assert any(
        words.startswith("the gauge as it lies in placement 1, with stylus 2 (Long") for words in said["declined"]
    )
    assert any("with stylus 2" in words for words in said["needed"])
    assert {run["stylus"] for run in said["runs"]} == {1}


def test_a_server_changes_to_a_stylus_that_it_knows_by_name(tmp_path: Path) -> None:
    machine, settings = both(), locating_settings(both())
    with serving(state := make_state(None, None, machine, lies_along_y())) as port:
        place = Served(f"127.0.0.1:{port}", machine, ControllerOptions(home=True))
        case = replace(case_with(machine), reach=Reach(BOX, level=True, racked=frozenset([1, 2])))
        run = FurtherRun("", lies_along_y(), stylus=2, changed=True, kept=True)
        with begun(tmp_path, place, person := Person(), case=case) as found:
            assert found.runner._prepared(run, "")
            assert person.asked == []
            assert (state.cmm.stylus, state.cmm.tip_radius_mm) == (2, 0.8)
            with place.linked(settings) as link:
                link.prepare(found.runner.wishes)  # which names the first one
                assert state.cmm.stylus == 1
                link.end()
            found.runner.mounted = 2
            assert found.runner.wishes.tool == "Long"
            with place.linked(settings) as link:
                link.prepare(found.runner.wishes)
                assert isinstance(link, Controller)
                assert state.cmm.stylus == 2
                assert not link.change_tool("Longer")
                link.end()
    assert case.reach.rest_minutes(run) == 0.0
    assert replace(case.reach, racked=frozenset()).rest_minutes(replace(run, kept=False)) == 10.0


def test_a_diagnosis_proposes_the_stylus_that_separates(tmp_path: Path) -> None:
    whole = measured((PITCH,), ())
    first = replace(whole, frame=whole.frame[whole.frame["stylus"] == 1])
    files = write_files(tmp_path, arm_machine(), small_gauge(), lies_along_y())
    (tmp_path / "further").mkdir()
    long = write_files(tmp_path / "further", arm_machine(LONG_MM, 0.8, "Long"), small_gauge(), lies_along_y())
    further = long["--machine"]
    (one,) = sg.diagnose(first, files["--gauge"], files["--machine"], further_styli=[further], without=WITHOUT).findings
    assert {one.kind, *one.confounded_with} == {"angular_error", "scale_error"}
    assert "the same placement with stylus 2 (Long, tip radius 0.8 mm, 120 mm long)" in one.separate_by
    assert further in one.separate_by


def test_the_command_line_takes_styli_and_refuses_another_machine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = write_files(tmp_path, arm_machine(), small_gauge(), lies_along_y())
    for name, own in (("long", arm_machine(LONG_MM, 0.8, "Long")), ("other", small_machine(repeatability_um=0.3))):
        (tmp_path / name).mkdir()
        write_files(tmp_path / name, own, small_gauge(), lies_along_y())
    styli = [str(tmp_path / "long" / "machine.toml")]
    where = (files["--machine"], files["--gauge"], files["--placement"])
    served = machine_state(*where, styli, None, (None, 0.0), None, 1, "StepGaugeProbe")
    assert served.tools == ("RefTool", "NoTool", "Long", "StepGaugeProbe")
    recording = measured((), ())
    recording.write(tmp_path / "recording.csv")
    common = ["diagnose", str(tmp_path / "recording.csv"), "-g", files["--gauge"], "-m", files["--machine"]]
    common += [part for kind in WITHOUT for part in ("--without", kind)]

    def told(*more: str) -> str:
        """What is printed, after the exit code."""
        code: Any = 0
        try:
            main([*common, *more])
        except SystemExit as end:
            code = end.code
        printed = capsys.readouterr()
        return f"{code} {printed.out}{printed.err}"

    further = [
        part for name in ("other", "long") for part in ("--further-stylus", str(tmp_path / name / "machine.toml"))
    ]
    missing = told("-o", str(tmp_path / "no"))
    assert missing.startswith("2 ")
    assert "stylus 2, which is not stated; expected --further-stylus" in missing
    wrong = told(*further[:2], "-o", str(tmp_path / "no"))
    assert wrong.startswith("2 ")
    assert "a further stylus is of the same machine, but" in wrong
    assert told(*further[2:], "-o", str(tmp_path / "yes")).startswith("0 adequate")
