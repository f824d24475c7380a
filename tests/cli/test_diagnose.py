"""``stepgauge diagnose`` as a user runs it."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stepgauge.diagnosis.output.files import diagnosis_to_dict, write_diagnosis
from stepgauge.diagnosis.result import GaugeDiagnosis, read_diagnosis
from stepgauge.diagnosis.wording.limits import machine_doubts
from stepgauge.errors import InputError
from stepgauge.recording import Recording
from stepgauge.verbs.catalogue import VERBS
from tests.cli.conftest import Run
from tests.conftest import ROOT
from tests.diagnosis.made import (
    ALONG_X,
    ALONG_Y,
    OUTLIERS,
    SCALE,
    as_file,
    machine,
    made,
    record,
    too_few,
)

COMMON = ("-g", "step-gauge-420", "-m", "bridge-cmm")


def diagnosis(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))


def kinds(folder: Path) -> set[str]:
    return {effect["kind"] for effect in diagnosis(folder)["effects"]}


def sets(folder: Path) -> list[set[str]]:
    """What is named with what it cannot be told from."""
    return [{effect["kind"], *effect["confounded_with"]} for effect in diagnosis(folder)["effects"]]


def named_sets(found: GaugeDiagnosis) -> list[set[str]]:
    return [{one.kind, *one.confounded_with} for one in found.findings]


def numbers(effect: dict[str, Any]) -> dict[str, float]:
    """Values of the parameters that are numbers."""
    return {name: one["value"] for name, one in effect["parameters"].items() if "unit" in one}


def diagnosed(run: Run, folder: Path, recording: Recording, name: str) -> Path:
    """The folder of the diagnosis of a recording."""
    result = run("diagnose", as_file(folder, recording, name), *COMMON, "-o", folder / f"{name}-out")
    assert result.code == 0, result.err
    return folder / f"{name}-out"


def test_the_verb_is_there(run: Run) -> None:
    assert "diagnose" in VERBS
    assert "diagnose" in run("--help").out
    assert "--each" in run("diagnose", "--help").out


@pytest.mark.parametrize(
    ("effects", "verdict", "named"),
    [
        ((), "adequate", set()),
        (SCALE, "effects", {"scale_error"}),
        (OUTLIERS, "effects", {"outliers"}),
    ],
)
def test_verdicts(effects: tuple[dict[str, Any], ...], verdict: str, named: set[str], tmp_path: Path, run: Run) -> None:
    path = as_file(tmp_path, record(machine(effects), seed=3))
    result = run("diagnose", path, *COMMON, "-o", tmp_path / "out")
    assert result.code == 0, result.err
    assert result.out == ""
    first, *steps, last = result.err.splitlines()
    assert first.startswith(verdict)
    assert last.startswith("wrote ")
    kinds = [line.split(":")[0] for line in steps if not line.startswith(("stepgauge plan ", "note: "))]
    assert kinds == sorted(kinds, key=["found", "check", "repair", "enter", "good enough", "measure again"].index)
    assert set(kinds) == ({"found", "check", "repair", "measure again"} if named else {"good enough"})
    assert diagnosis(tmp_path / "out")["verdict"] == verdict
    sure = [one for one in diagnosis(tmp_path / "out")["effects"] if one["probability"] > 0.8]
    assert len(sure) == len(named)
    for kind in named:
        assert any(kind in one for one in sets(tmp_path / "out"))


def test_what_to_enter_is_told_with_its_number_and_no_other_verb_takes_a_diagnosis(tmp_path: Path, run: Run) -> None:
    path = as_file(tmp_path, record(machine(SCALE), seed=3))
    said = run("diagnose", path, *COMMON, "-o", tmp_path / "out").err
    ppm = diagnosis(tmp_path / "out")["effects"][0]["parameters"]["ppm"]["value"]
    assert f"found: 1: scale error x: {ppm:.0f}"[:-1] in said
    story = (tmp_path / "out" / "diagnosis.md").read_text(encoding="utf-8")
    assert f"divides by {1.0 + ppm * 1e-6:.6f}" in story, story
    frame = read_diagnosis(tmp_path / "out").to_frame()
    assert (frame["rival_of"] == "scale_error_x").any()
    assert frame.groupby("effect")["probability"].first().sum() <= 1.0
    table = run("compensate", tmp_path / "out", "--axis", "x", "--to", "grbl", "-o", tmp_path / "x.txt")
    assert table.code == 2
    assert "found diagnosis.json" in table.err
    assert "stands in its diagnosis.md" in table.err


@pytest.mark.parametrize(
    ("um", "kind", "verdict", "noted"),
    [
        (1001.4, "machine tool", "effects", "0.9986 ± 0.0030 mm (k = 2) fits"),
        (-950.0, "machine tool", "effects", "2.9500 ± 0.0030 mm (k = 2) fits"),
        (60.0, "machine tool", "effects", ""),
        (60.0, None, "effects", ""),
        (60.0, None, "unknown", "state kind"),
    ],
)
def test_a_machine_file_that_states_another_tip_or_no_kind_is_told(
    um: float, kind: str | None, verdict: str, noted: str
) -> None:
    parameters = {"um": {"value": um, "u": 1.5, "unit": "um"}}
    effect = {"kind": "effective_radius", "parameters": parameters, "confounded_with": []}
    stated = {"machine": {"kind": kind, "tip_radius_mm": 2.0}}
    said = {"verdict": verdict, "effects": [effect], "inputs": stated, "probabilities": {"all_geometry": 0.0}}
    doubts = list(machine_doubts(said))
    assert [noted in one for one in doubts] == ([True] if noted else [])


@pytest.mark.parametrize(
    ("kinds", "possible", "noted"),
    [
        (["scale_error"], 0.02, True),
        (["scale_error"], 0.001, False),
        (["scale_error", "geometric_errors"], 0.9, True),
        (["geometric_errors"], 0.9, False),
    ],
)
def test_all_errors_of_the_guides_at_once_say_where_they_can_be_left_out(
    kinds: list[str], possible: float, noted: bool
) -> None:
    """They widen the ± of a scale whether they are its rival, stand beside it or are only possible."""
    effects = [{"kind": kind, "parameters": {}} for kind in kinds]
    said = {"verdict": "effects", "effects": effects, "inputs": {"machine": {"kind": "machine tool"}}}
    doubts = list(machine_doubts({**said, "probabilities": {"all_geometry": possible}}))
    assert ["--without geometric_errors" in one for one in doubts] == [True] * noted


@pytest.mark.parametrize(("option", "name"), [("--kind", "mill"), ("--without", "geometric")])
def test_a_name_that_there_is_not_is_of_its_option(option: str, name: str, tmp_path: Path, run: Run) -> None:
    path = as_file(tmp_path, too_few())
    result = run("diagnose", path, *COMMON, option, name, "-o", tmp_path / "out")
    assert result.code == 2
    assert f"error: {option}: no" in result.err


def test_too_little_to_tell_is_a_verdict_and_no_error(tmp_path: Path, run: Run) -> None:
    path = as_file(tmp_path, too_few())
    assert run("diagnose", path, *COMMON, "-o", tmp_path / "out").code == 0
    assert diagnosis(tmp_path / "out")["verdict"] == "insufficient"
    assert (tmp_path / "out" / "diagnosis.md").is_file()


@pytest.mark.parametrize("name", ["diagnosis.md", "overview.png", "diagnosis.json", "separate-1.toml"])
def test_files_that_are_somebodys_own_are_not_replaced(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("my own")
    with pytest.raises(InputError, match=f"{re.escape(name)}.* is of no earlier result") as refused:
        made("null")[1].write(tmp_path)
    for words in ("no diagnosis.json of stepgauge in this folder", "another folder"):
        assert words in str(refused.value)
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [(name, "my own")]


def test_files_of_an_earlier_diagnosis_are_replaced_and_others_stay(tmp_path: Path, run: Run) -> None:
    """Which they are is seen by its diagnosis.json."""
    path, out = as_file(tmp_path, record(machine(), seed=3)), tmp_path / "out"
    out.mkdir()
    (out / "diagnosis.md").write_text("my own")
    result = run("diagnose", path, *COMMON, "-o", out)
    assert result.code == 2
    assert "diagnosis.md" in result.err
    (out / "diagnosis.md").unlink()
    (out / "notes.txt").write_text("notes")
    for _ in range(2):
        assert run("diagnose", path, *COMMON, "-o", out).code == 0
    assert (out / "notes.txt").read_text() == "notes"


def test_another_tip_than_that_of_the_machine_file_is_refused(tmp_path: Path, run: Run) -> None:
    """It would be told as an effective radius or a reversal error of a millimetre."""
    path = as_file(tmp_path, record(machine(), seed=3))
    shown = (ROOT / "calibration_data" / "machines" / "bridge-cmm.toml").read_text()
    (tmp_path / "other.toml").write_text(re.sub(r"(?m)^tip_radius_mm = .*$", "tip_radius_mm = 3.0", shown))
    result = run("diagnose", path, "-g", "step-gauge-420", "-m", tmp_path / "other.toml", "-o", tmp_path / "out")
    assert (result.code, (tmp_path / "out").exists()) == (2, False)
    for words in (path.name, "other.toml", "# tip_radius_mm: 2", "expected 3", "--machine or --further-stylus"):
        assert words in result.err


def test_two_simulations_with_one_seed_are_refused_together(tmp_path: Path, run: Run) -> None:
    parts = [as_file(tmp_path, record(machine(), [ALONG_X], seed), f"{name}") for name, seed in (("a", 3), ("b", 3))]
    result = run("diagnose", *parts, *COMMON, "-o", tmp_path / "out")
    assert (result.code, (tmp_path / "out").exists()) == (2, False)
    for words in (parts[1].name, "simulated with the same seed as", parts[0].name):
        assert words in result.err
    assert "found # seed: 1003" in result.err
    assert "--seed" in result.err


def test_recordings_are_placements_of_one_machine_together(tmp_path: Path, run: Run) -> None:
    parts = [
        as_file(tmp_path, record(machine(SCALE), [axis], seed), name)
        for name, axis, seed in (("along-x", ALONG_X, 1), ("along-y", ALONG_Y, 2))
    ]
    result = run("diagnose", *parts, *COMMON, "-o", tmp_path / "out")
    assert result.code == 0, result.err
    data = diagnosis(tmp_path / "out")
    assert [one["placement"] for one in data["measured"]["placements"]] == [1, 2]
    assert [Path(one["path"]).name for one in data["inputs"]["recordings"]] == ["along-x.csv", "along-y.csv"]
    # One placement cannot tell the machine's scale from the gauge's length, two can.
    (together,) = sets(tmp_path / "out")
    assert "scale_error" in together
    assert "gauge_temperature" not in together


def test_each_on_its_own_over_processes(tmp_path: Path, run: Run) -> None:
    first, second = (as_file(tmp_path, made(name)[0], f"r-{name}") for name in ("null", "scale"))
    result = run("diagnose", first, second, *COMMON, "--each", "--jobs", 2, "-o", tmp_path / "out")
    assert result.code == 0, result.err
    assert "r-null: adequate" in result.err
    assert "r-scale: effects" in result.err
    assert diagnosis(tmp_path / "out" / "r-null")["verdict"] == "adequate"
    assert kinds(tmp_path / "out" / "r-scale") == {made("scale")[1].findings[0].kind}


def test_one_that_cannot_be_diagnosed_does_not_stop_the_others(tmp_path: Path, run: Run) -> None:
    recording = made("null")[0]
    short = as_file(tmp_path, replace(recording, frame=recording.frame.head(3)), "short")
    good = as_file(tmp_path, recording, "good")
    result = run("diagnose", short, good, *COMMON, "--each", "--jobs", 1, "-o", tmp_path / "out")
    assert result.code == 2
    assert "too small" in result.err
    assert "1 recordings could not be used" in result.err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["good"]


def test_the_same_whatever_the_order_of_rows_and_columns(tmp_path: Path, run: Run) -> None:
    recording, found = made("pair")
    plain = diagnosis_to_dict(replace(found, recordings=(recording,)))
    shuffled = recording.frame.sample(frac=1.0, random_state=5)[list(recording.frame.columns[::-1])]
    other = diagnosis(diagnosed(run, tmp_path, replace(recording, frame=shuffled), "shuffled"))
    assert other["verdict"] == plain["verdict"]
    assert [one["label"] for one in other["effects"]] == [one["label"] for one in plain["effects"]]
    for one, same in zip(other["effects"], plain["effects"], strict=True):
        assert numbers(one) == pytest.approx(numbers(same), rel=1e-3)


def test_the_same_when_the_clock_starts_at_another_time(tmp_path: Path, run: Run) -> None:
    recording, plain = made("pair")
    later = recording.frame.assign(time_s=recording.frame["time_s"] + 86_400.0)
    assert sets(diagnosed(run, tmp_path, replace(recording, frame=later), "later")) == named_sets(plain)


def test_the_same_with_the_gauge_turned_end_for_end(tmp_path: Path, run: Run) -> None:
    turned = record(machine(SCALE), [(-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)], seed=4)
    assert sets(diagnosed(run, tmp_path, turned, "turned")) == named_sets(made("scale")[1])


def test_the_diagnosed_machine_can_be_diagnosed_in_its_turn(tmp_path: Path, run: Run) -> None:
    recording, found = made("scale")
    path = as_file(tmp_path, recording)
    write_diagnosis(tmp_path / "one", replace(found, recordings=(recording,)))
    better = tmp_path / "one" / "machine.diagnosed.toml"
    result = run("diagnose", path, "-g", "step-gauge-420", "-m", better, "-o", tmp_path / "two")
    assert result.code == 0, result.err
    before, after = diagnosis(tmp_path / "one"), diagnosis(tmp_path / "two")
    assert after["verdict"] == "adequate"
    assert after["fit"]["rms_before_um"] == pytest.approx(before["fit"]["rms_after_um"], rel=1e-3)
    assert after["inputs"]["machine"]["effects"] == [effect["kind"] for effect in before["effects"]]


def broken(path: Path, old: str, new: str) -> Path:
    """A copy of a recording with one thing wrong."""
    text = path.read_text()
    assert old in text
    target = path.with_name("broken.csv")
    target.write_text(text.replace(old, new, 1))
    return target


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{tmp}/none.csv", "-g", "step-gauge-420", "-m", "bridge-cmm"], ["none.csv", "no such file"]),
        (["{good}", "-g", "no-gauge", "-m", "bridge-cmm"], ["no-gauge", "step-gauge-420"]),
        (["{good}", "-g", "step-gauge-420", "-m", "no-machine"], ["no-machine", "bridge-cmm"]),
        (["{broken}", "-g", "step-gauge-420", "-m", "bridge-cmm"], ["broken.csv:", "is not a"]),
        (["{short}", "-g", "step-gauge-420", "-m", "bridge-cmm"], ["short.csv", "too small", "3 probings"]),
        (["{good}", "-g", "step-gauge-420"], ["--machine"]),
        (
            ["{good}", "{good}", "-g", "step-gauge-420", "-m", "bridge-cmm", "--each"],
            ["2 recordings", "different names"],
        ),
        (["{good}", "-g", "step-gauge-420", "-m", "bridge-cmm", "--jobs", "0"], ["--jobs"]),
    ],
)
def test_wrong_input_is_exit_code_two_and_leaves_nothing(
    arguments: list[str], words: list[str], tmp_path: Path, run: Run
) -> None:
    recording = made("scale, one placement")[0]
    good = as_file(tmp_path, recording, "good")
    short = as_file(tmp_path, replace(recording, frame=recording.frame.head(3)), "short")
    names = {"tmp": tmp_path, "good": good, "short": short, "broken": broken(good, "\n1,1,1,", "\n1,1,nan,")}
    result = run("diagnose", *(text.format(**names) for text in arguments), "-o", tmp_path / "out")
    assert result.code == 2
    assert "Traceback" not in result.err
    for word in words:
        assert word in result.err
    assert not (tmp_path / "out").exists()


MAP_HEAD = "polar_deg,azimuth_deg,trigger_force_N\n"


def force_map(folder: Path, rows: list[str]) -> Path:
    path = folder / "map.csv"
    path.write_text(MAP_HEAD + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["90,0,0.75", "90,10,0.74", "80,0,0.76"], "the map has 3 rows in 3 directions"),
        ([f"{polar},30,{1.0 / polar:.4f}" for polar in range(10, 91, 5)], "better a full turn: the map has 1"),
        ([f"90,{azimuth},0.7" for azimuth in range(0, 360, 10)], "the same to the last digit"),
        (["90,0,0.7"] * 12, "12 rows in 1 directions"),
    ],
)
def test_a_map_that_cannot_tell_is_insufficient_and_says_what_is_missing(
    run: Run, tmp_path: Path, rows: list[str], said: str
) -> None:
    out = tmp_path / "out"
    result = run("diagnose", force_map(tmp_path, rows), "--probe", "omp40-2-50mm", "-o", out)
    assert result.code == 0, result.err
    assert result.err.startswith("insufficient: ")
    assert said in result.err
    assert diagnosis(out)["effects"] == []
    assert "The map lacks" in (out / "diagnosis.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["90,0,nan", "90,10,0.7"], "map.csv:2"),
        (["90,0,0.7", "90,10,-0.7"], "map.csv:3"),
        (["90,0", "90,10,0.7"], "map.csv:2"),
        ([], "no rows"),
    ],
)
def test_a_map_that_is_wrong_is_an_error_and_leaves_nothing(
    run: Run, tmp_path: Path, rows: list[str], said: str
) -> None:
    result = run("diagnose", force_map(tmp_path, rows), "--probe", "omp40-2-50mm", "-o", tmp_path / "out")
    assert result.code == 2
    assert said in result.err
    assert not (tmp_path / "out").exists()


def test_a_file_of_priors_is_taken_for_maps_too(run: Run, tmp_path: Path) -> None:
    rows, mine, out = ["90,0,0.75", "90,10,0.74", "80,0,0.76"], tmp_path / "mine.toml", tmp_path / "out"
    words = ("diagnose", force_map(tmp_path, rows), "--probe", "omp40-2-50mm", "-o", out, "--priors", mine)
    mine.write_text("[maps]\nslight = 2.0\n")
    result = run(*words)
    assert result.code == 2
    assert "slight" in result.err
    assert not out.exists()
    mine.write_text("[maps.laws.kinds]\nlever_arm = { odds = 0.1, usual = 1.0 }\n")
    assert run(*words).code == 0


@pytest.mark.parametrize("terminal", [True, False])
def test_a_terminal_shows_what_is_found_while_the_search_goes_on(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch, terminal: bool
) -> None:
    recording = as_file(tmp_path, record(machine(SCALE), [ALONG_X, ALONG_Y]), "scale")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    result = run("diagnose", recording, *COMMON, "-o", tmp_path / "out")
    shown = [line for line in re.split("[\r\n]", result.err) if "up to now" in line]
    assert bool(shown) is terminal
    if terminal:
        assert shown[0].endswith("up to now: nothing")
        assert "scale error x" in shown[-1]
