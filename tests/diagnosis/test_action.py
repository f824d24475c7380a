"""One rule decides what is to be done about a finding, and when there is nothing left to do."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import stepgauge as sg
from stepgauge.diagnosis.wording.action import actions, is_good_enough
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.diagnosis.wording.limits import machine_doubts
from stepgauge.recording import join_recordings
from stepgauge.reports.findings import found_part
from stepgauge.reports.first_steps import first_lines

RECIPE = Path(sg.__file__).parents[1] / "docs/recipes/small-machines.md"


def effect(kind: str, size: float, unit: str, **choices: Any) -> str:
    chosen = "".join(f'{name} = "{value}"\n' for name, value in choices.items())
    return f'\n[[effect]]\nkind = "{kind}"\n{chosen}{unit} = {size}\n'


def recipe_files(folder: Path) -> None:
    for name, text in re.findall(r"`([a-z.]+)`:\n\n```(?:toml|text)\n(.*?)```", RECIPE.read_text("utf-8"), re.S):
        (folder / name).write_text(text, encoding="utf-8")


def measured(folder: Path, errors: str, seed: int, pretravel_um: float = 20.0, **how: Any) -> dict[str, Any]:
    """What is said of the router of the recipe with errors that its file does not have, measured along four lines."""
    recipe_files(folder)
    mill, bar = (folder / "router.toml").read_text("utf-8"), folder / "bar.toml"
    (folder / "true.toml").write_text(mill.replace("um = 20.0", f"um = {pretravel_um}") + errors, encoding="utf-8")
    runs = []
    for number, place in enumerate((folder / f"{name}.toml" for name in ("x", "y", "up", "down")), 1):
        program = place.with_suffix(".gcode")
        plan = sg.plan(place, bar, folder / "router.toml", order="up-down", cycles=6)
        plan.write(program, dialect="grbl")
        done = sg.simulate(program, folder / "true.toml", bar, place, seed=seed + number).recording
        runs.append(replace(done, frame=done.frame.assign(placement=number)))
    return dict(sg.diagnose(join_recordings(runs), bar, folder / "router.toml", **how).contents)


@pytest.fixture(scope="module")
def repaired(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    errors = effect("scale_error", 12.0, "ppm", axis="x") + effect("squareness", -16.0, "urad", plane="xy")
    return measured(tmp_path_factory.mktemp("repaired"), errors, 40, 21.0)


def test_a_repaired_machine_is_good_enough_and_what_may_remain_covers_what_does(repaired: dict[str, Any]) -> None:
    assert is_good_enough(repaired)
    assert repaired["verdict"] == "adequate"
    assert not {"enter", "check", "repair", "misfit"} & {*actions(repaired)}
    lines = first_lines(repaired)
    assert lines[-1].startswith("good enough: Stop. What may remain (k = 2): ")
    assert not any(line.startswith(("measure again", "enter", "repair", "check")) for line in lines)
    left = {one["label"]: one for one in repaired["may_remain"]}
    true = {"scale_error_x": 12.0, "scale_error_y": 0.0, "squareness_xy": 16.0, "effective_radius": 1.0}
    assert {*left} == {*true, "reversal_error_x", "reversal_error_y"}
    for label, size in true.items():
        assert size <= 2.0 * left[label]["u"], label


def finding(kind: str, number: Mapping[str, Any], choice: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    named = {name: {"value": value} for name, value in choice.items()}
    alone: dict[str, Any] = {"set": [], "several": [], "confounded_with": [], "alternatives": [], "separate_by": ""}
    sure = {"probability": 0.97, "own_probability": 0.97, "commands": [], "meaning": "It is so."}
    label = "_".join([kind, *map(str, choice.values())])
    return {"kind": kind, "label": label, "parameters": {**named, **number}, **sure, **alone, **more}


def backlash(um: float, u: float, **more: Any) -> dict[str, Any]:
    return finding("reversal_error", {"um": {"value": um, "u": u, "unit": "um"}}, {"axis": "x"}, seen_um=um / 2, **more)


REVERSED = finding("gauge_reversed", {"share": {"value": 1.0, "u": 0.01, "unit": "1"}}, {"placement": 3}, seen_um=99.0)
LOOSE = finding(
    "repeatability",
    {name: {"value": um, "u": None, "unit": "um"} for name, um in (("repeatability_um", 20.0), ("stated_um", 3.0))},
    {},
    seen_um=0.0,
)


def said(*effects: Mapping[str, Any], after_um: float = 3.0, kind: str | None = "machine tool") -> dict[str, Any]:
    places = [{"placement": 3, "recording": "up.csv"}]
    left = [{"label": "scale_error_x", "u": 10.0, "unit": "um/m", "seen_um": 0.8}]
    return {
        "verdict": "effects",
        "effects": list(effects),
        "unexplained": [],
        "fit": {"rms_before_um": 3.5, "rms_after_um": after_um, "noise_um": 3.0},
        "inputs": {"machine": {"kind": kind, "pretravel_um": 20.0}},
        "measured": {"placements": places},
        "probabilities": {"explained": 0.9, "adequate": 0.01},
        "may_remain": left,
        "further": {"separate_by": "", "commands": []},
    }


def starts(data: Mapping[str, Any]) -> list[str]:
    return [line.partition(":")[0] for line in first_lines(data)]


RIVAL: dict[str, Any] = {"confounded_with": ["scale_error"]}
HARMFUL = [backlash(um, 1.6, conditional_probability=0.5) for um in (2.0, 43.0)]
"""A small error, or a large one in its place."""


@pytest.mark.parametrize(
    ("one", "after_um", "kind", "action"),
    [
        (backlash(71.0, 3.0), 3.0, "machine tool", "enter"),
        (backlash(7.0, 1.5), 3.0, "machine tool", "enter"),  # seen less than 2 sigma of a reading, and sure
        (backlash(39.0, 35.0), 3.0, "machine tool", "unknown"),  # it may be 109 um
        (backlash(2.0, 1.6), 3.0, "machine tool", "left"),  # whatever it is, it does no harm
        (backlash(5.0, 1.6) | {"probability": 0.79}, 3.0, "machine tool", "left"),
        (backlash(50.0, 1.6) | {"probability": 0.79}, 3.0, "machine tool", "enter"),
        (backlash(5.0, 1.6), 3.7, "machine tool", "left"),
        (backlash(5.0, 1.6, **RIVAL), 3.0, "machine tool", "left"),
        (backlash(2.0, 1.6, set=HARMFUL), 3.0, "machine tool", "check"),
        (backlash(5.0, 1.6, **RIVAL), 3.0, "cmm", "check"),  # the mean of many readings counts there
        (backlash(50.0, 3.0, **RIVAL), 3.0, "machine tool", "check"),
        (backlash(50.0, 3.0), 3.7, "machine tool", "misfit"),
    ],
)
def test_one_rule_says_what_is_done_about_a_finding(one: Any, after_um: float, kind: str, action: str) -> None:
    data = said(one, after_um=after_um, kind=kind)
    assert actions(data) == [action]
    left = action == "left"
    assert is_good_enough(data) is left
    assert ("enter" in starts(data)) is (action in ("enter", "unknown"))
    assert ("good enough" in starts(data)) is left
    assert not left or not {"check", "repair", "enter", "measure again"} & {*starts(data)}
    assert ("$160" in str(found_part(data))) is (action in ("enter", "check") and kind != "cmm")
    assert ("known physics explains it" in headline(data)) is (after_um < 3.5)


def test_what_can_do_no_harm_is_what_the_machine_holds() -> None:
    """In closed form: seen 2.5 um of 5 +- 3.2 um are at most 4.1 um; with an MPE that is the limit, of any machine."""
    unsure = backlash(5.0, 1.6, **RIVAL)
    for kind in ("machine tool", "cmm"):
        for mpe_um, action in ((4.2, "left"), (4.0, "check")):
            data = said(unsure, kind=kind)
            data["inputs"]["machine"]["mpe_um"] = mpe_um
            assert actions(data) == [action]
    assert any("4.1 um at most, within the 6.0 um" in line for line in first_lines(said(unsure)))


WAVE = finding(
    "periodic_scale_error",
    {"amplitude_um": {"value": 13.5, "u": 2.0, "unit": "um"}, "period_mm": {"value": 10.0, "u": 30.0, "unit": "mm"}},
    {"axis": "x"},
    seen_um=13.0,
)


def test_the_loop_of_repairs_ends_at_the_limits_of_the_machine() -> None:
    """13 um of an amplitude of 13.5 +- 4 um are at most 16.9 um; its period has no part in that."""
    lines = first_lines(said(WAVE))
    assert any(line.startswith("good enough: The settings are right") and "± 20 um/m" in line for line in lines)
    assert any("periodic scale error x is a limit" in line and "up to 17 um by it" in line for line in lines)
    assert not any(line.startswith("measure again") for line in lines)
    for more in (backlash(71.0, 3.0), REVERSED):
        assert any(line.startswith("measure again") for line in first_lines(said(WAVE, more)))


def test_no_measurement_is_asked_for_where_only_a_file_changes() -> None:
    radius = finding("effective_radius", {"um": {"value": 24.0, "u": 2.0, "unit": "um"}}, {}, seen_um=24.0)
    for effects, again in (((radius,), False), ((radius, backlash(71.0, 3.0)), True)):
        (line,) = (one for one in first_lines(said(*effects)) if one.startswith("measure again"))
        assert ("run the programs again" in line) is again


@pytest.mark.parametrize("spoilt", [REVERSED, LOOSE])
def test_no_number_is_entered_before_what_spoils_it_is_mended_and_measured_again(spoilt: dict[str, Any]) -> None:
    lines = first_lines(said(backlash(71.0, 3.0), spoilt))
    assert [line for line in lines if line.startswith("enter")] == [
        "enter: 1: Nothing yet: first settle 2, then measure and diagnose again."
    ]
    assert any(line.startswith("repair: 2: ") for line in lines)


def test_a_plan_tells_which_screws_the_blocks_of_a_bar_hide(tmp_path: Path) -> None:
    """Along an axis, of a machine with screws; those of the recipe hide none."""
    recipe_files(tmp_path)
    bar, mill, places = tmp_path / "bar.toml", tmp_path / "router.toml", (tmp_path / "x.toml", tmp_path / "up.toml")
    assert not any(sg.plan(one, bar, mill).notes for one in places)
    for name, before, now in (("bar.csv", "6.3", "0.0"), ("x.toml", "-93.7", "-100.0")):
        text = (tmp_path / name).read_text("utf-8")
        (tmp_path / name).write_text(text.replace(before, now), encoding="utf-8")
    (note,) = sg.plan(places[0], bar, mill).notes
    assert "whole multiples of 1, 2, 2.5, 4, 5, 10, 20, 25 mm apart" in note
    mill.write_text(mill.read_text("utf-8").replace("machine tool", "cmm"), encoding="utf-8")
    assert not sg.plan(places[0], bar, mill).notes


def structure(covariate: str, form: str = "smooth", **more: Any) -> dict[str, Any]:
    words = {"where": f"a smooth function of {covariate}", "side": "both", "probability": 0.99, "phrases": []}
    return {"covariate": covariate, "form": form, **words, "separate_by": "", "commands": [], "laws": [], **more}


def test_what_came_in_the_course_of_the_measurement_is_mended_before_numbers_are_entered() -> None:
    """A stylus came loose in one of four runs, and six numbers of these runs were offered first."""
    lines = first_lines(said(backlash(71.0, 3.0)) | {"unexplained": [structure("order")]})
    assert "enter: 1: Nothing yet: first settle 2, then measure and diagnose again." in lines
    assert any(line.startswith("check: 2: ") and "loose stylus" in line for line in lines)
    for free in (structure("position"), structure("order", "sawtooth")):  # which has a mean
        place = first_lines(said(backlash(71.0, 3.0)) | {"unexplained": [free]})
        assert "enter: 1: These do not wait for 2: their ± allows for it." in place
        assert any(line.startswith("enter: 1: $160: + 0.0710") for line in place)
        assert any("drive the axis to and fro" in line for line in place) is (free["covariate"] == "order")


def test_numbers_do_not_wait_for_a_finding_with_rivals() -> None:
    rival = finding("periodic_scale_error", {}, {"axis": "x"}, seen_um=9.0, **RIVAL)
    lines = first_lines(said(backlash(71.0, 3.0), rival))
    assert "enter: 1: These do not wait for 2: their ± allows for it." in lines
    assert "repair: 2: Nothing yet: the checks tell first which of the causes of a finding it is." in lines


def test_structure_that_is_like_a_law_has_the_check_of_that_law_and_of_this_kind_of_machine() -> None:
    like = structure("position", "undetermined", phrases=[{"say": "similar", "law": "effective_radius"}])
    for kind, check in (("machine tool", "both sides of one gauge block"), ("cmm", "on the reference sphere")):
        (line,) = (one for one in first_lines(said(kind=kind) | {"unexplained": [like]}) if one.startswith("check"))
        assert check in line


def test_a_further_run_says_how_it_is_added() -> None:
    open_ = structure("position", commands=["stepgauge plan why/separate-1.toml"], separate_by="a run")
    lines = first_lines(said() | {"unexplained": [open_]})
    assert any("name its recording beside all the others" in line for line in lines)
    assert not any("--placement-number" in line for line in lines)  # joined placements are numbered on


def test_a_shifted_block_is_looked_for_in_the_gauge_file_first() -> None:
    shifted = finding("block_shift", {"um": {"value": -100.9, "u": 2.0, "unit": "um"}}, {"block": 2}, seen_um=90.0)
    lines = first_lines(said(shifted, backlash(71.0, 3.0)))
    assert lines[0].startswith("check: 1: Are the positions of block 2 in the gauge file those of its certificate?")
    assert "enter: 2: Nothing yet: first settle 1, then measure and diagnose again." in lines


def test_a_finding_of_a_placement_names_its_recording() -> None:
    assert "gauge reversed up.csv" in headline(said(REVERSED))


@pytest.mark.parametrize("language", ["en", "de"])
def test_what_widens_an_uncertainty_is_told_with_what_settles_it(language: str) -> None:
    """A scale error of 330 um/m in place of 33 stood there without a word: the temperatures were not known."""
    one = backlash(71.0, 3.0, widened_by=["scale_temperature_all", "gauge_temperature"])
    (told,) = machine_doubts(said(one, LOOSE), language)
    assert told.endswith("--without gauge_temperature --without scale_temperature.")
    for label in ("gauge_temperature", "scale_temperature_all"):
        assert name_of(label, language=language) in told
    assert ("calibrated thermometer" in told) is (language == "en")
    assert not [*machine_doubts(said(backlash(71.0, 3.0)))]


def test_a_scale_error_of_both_axes_is_known_as_well_as_the_temperatures(tmp_path: Path) -> None:
    errors = effect("scale_error", -1076.0, "ppm", axis="x") + effect("scale_error", -1230.0, "ppm", axis="y")
    temperatures = ("gauge_temperature", "scale_temperature")
    vague, sure = (measured(tmp_path, errors, 60, without=without) for without in ((), temperatures))
    for data, wide in ((vague, True), (sure, False)):
        scales = [one for one in data["effects"] if one["kind"] == "scale_error"]
        assert len(scales) == 2
        assert all(bool(one["widened_by"]) is wide for one in scales)
        assert all((one["parameters"]["ppm"]["u"] > 40.0) is wide for one in scales)


def test_numbers_are_told_as_they_are_typed() -> None:
    radius = finding("effective_radius", {"um": {"value": 24.0, "u": 2.0, "unit": "um"}}, {})
    square = finding("squareness", {"urad": {"value": -336.0, "u": 10.0, "unit": "urad"}}, {"plane": "xy"})
    lines = first_lines(said(backlash(-71.5, 3.0), radius, square))
    enter = [line for line in lines if line.startswith("enter")]
    assert enter[0].startswith("enter: 1: $160: - 0.0715 ± 0.0060 mm (k = 2)")
    assert "pretravel_um = 44.0 ± 4.0 um (k = 2)" in enter[1]
    assert "+ end of y 0.0336 ± 0.0020 mm per 100 mm (k = 2) towards -x" in enter[2]


def test_what_is_not_sure_is_told_in_the_order_of_its_probability() -> None:
    possible = [{"label": "squareness_xy", "probability": 0.62}, {"label": "scale_error_y", "probability": 0.06}]
    data = said() | {"verdict": "insufficient", "probabilities": {"adequate": 0.15, "possible": possible}}
    order = "squareness xy 0.62, nothing at all 0.15, scale error y 0.06"
    assert headline(data).endswith(f"No cause is sure enough to be stated: {order}.")
