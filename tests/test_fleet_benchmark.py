"""The fleet's benchmark: independent of the package, sealed, of the stated sizes, readable, scored by its rules."""

from __future__ import annotations

import ast
import csv
import json
import stat
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.fleet import parts
from benchmarks.fleet.causes import CLEAR, Cause, bump_sd_mm
from benchmarks.fleet.design import Fleet, make_fleet
from benchmarks.fleet.generate import main as generate
from benchmarks.fleet.generate import readings
from benchmarks.fleet.observer import KELVIN_PPM, Observer, Patterns, rate_observer, trigger_observer
from benchmarks.fleet.plant import RATE_KINDS, plant
from benchmarks.fleet.run import main as run
from benchmarks.fleet.score import FAMILIES, KINDS, read_answer, read_truth, score, summary, text
from benchmarks.fleet.score import main as score_main
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.recording import read_recording

FLEET = Path(__file__).resolve().parent.parent / "benchmarks" / "fleet"
GENERATOR = ("parts", "design", "physics", "causes", "observer", "plant", "writers", "generate")
SEED, SMALL = 4, 120


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleets") / "fleet"
    generate([str(folder), "--seed", str(SEED), "--recordings", str(SMALL)])
    return folder


@pytest.fixture(scope="module")
def fleet() -> Fleet:
    return make_fleet(SEED, SMALL)


def rate_and_trigger(fleet: Fleet, number: int, columns: dict[str, Any]) -> tuple[float, float, float]:
    """How much longer than certified a recording reads (ppm), how much later it triggers (um), its scatter (um)."""
    recording = fleet.recordings[number]
    gauge = fleet.gauges[recording.gauge]
    face = columns["face"].astype(int)
    side = np.where(face % 2 == 1, 1.0, -1.0)
    certified = gauge.certified_mm[face - 1] * (1.0 + parts.EXPANSION_PER_K * (columns["gauge_C"] - 20.0))
    expected = certified - side * (parts.TIP_RADIUS_MM - parts.PRETRAVEL_UM * 1e-3)
    later_um = 1e3 * (columns["tip"] @ np.array(recording.axis) - expected)
    design = np.column_stack([np.ones(len(face)), 1e-3 * certified, side])
    _, rate, trigger = np.linalg.lstsq(design, later_um, rcond=None)[0]
    of_face = [later_um[face == k] for k in np.unique(face)]
    scatter = np.sqrt(np.mean([np.var(values, ddof=1) for values in of_face]))
    return float(rate), float(trigger), float(scatter)


def small_cause(kind: str, fleet: Fleet, number: int) -> Cause:
    """A cause of size 1 in one recording, of an owner that may have it."""
    owner_kind = KINDS[kind][0]
    owner = str(fleet.names_of[owner_kind][number])
    where = {"scale": "x", "reversal": "x", "squareness": "xy", "wear": "fronts"}.get(kind, "")
    recording = fleet.recordings[number]
    return Cause(owner_kind, owner, kind, where, 1.0, details={"kelvin_of_day": {recording.day: 1.0}})


# --- independence and concealment -------------------------------------------------------------------------------------


@pytest.mark.parametrize("module", GENERATOR)
def test_generator_imports_nothing_of_the_package(module: str) -> None:
    roots, siblings = set(), set()
    for node in ast.walk(ast.parse((FLEET / f"{module}.py").read_text())):
        if isinstance(node, ast.Import):
            roots |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            roots.add((node.module or "").split(".")[0])
            siblings |= {node.module} if (node.module or "").startswith("benchmarks.") else set()
    assert siblings <= {f"benchmarks.fleet.{name}" for name in GENERATOR} | {
        "benchmarks.fleet",
        "benchmarks.blind.generate",
    }
    assert roots <= sys.stdlib_module_names | {"numpy", "benchmarks"}


def test_truth_is_sealed_and_reproducible_and_nothing_open_tells_it(folder: Path, tmp_path: Path) -> None:
    generate([str(tmp_path / "again"), "--seed", str(SEED), "--recordings", str(SMALL)])
    files = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(tmp_path / "again") for path in (tmp_path / "again").rglob("*.*"))
    assert all((folder / path).read_bytes() == (tmp_path / "again" / path).read_bytes() for path in files)
    assert stat.S_IMODE((folder / "sealed").stat().st_mode) == 0o700
    assert stat.S_IMODE((folder / "sealed" / "truth.json").stat().st_mode) == 0o600
    assert {path.suffix for path in (folder / "open").rglob("*") if path.is_file()} == {".csv", ".toml"}


def test_strength_changes_the_causes_only() -> None:
    fleet = make_fleet(SEED, SMALL)
    full, half = plant(fleet, SEED, 1.0), plant(fleet, SEED, 0.5)
    assert [replace(cause, size=0.0, details={}, leftover_chi2=None) for cause in full] == [
        replace(cause, size=0.0, details={}, leftover_chi2=None) for cause in half
    ]
    np.testing.assert_allclose([cause.size for cause in half], [0.5 * cause.size for cause in full])


# --- what the product reads -------------------------------------------------------------------------------------------


def test_the_product_reads_every_file_and_evaluates_a_recording_of_every_gauge(folder: Path) -> None:
    rows = list(csv.DictReader((folder / "open" / "fleet.csv").read_text().splitlines()))
    assert len(rows) == SMALL
    seen = set()
    for row in rows:
        if row["gauge"] not in seen:
            seen.add(row["gauge"])
            assert read_machine(folder / "open" / row["machine_file"]).table.name == row["machine"]
            recording = read_recording(folder / "open" / row["recording"])
            result = evaluate(recording, read_gauge(folder / "open" / row["gauge_file"]))
            assert 200 < len(recording.frame) < 600
            assert result.results[0].radius.r_eff_mm == pytest.approx(parts.TIP_RADIUS_MM - 0.003, abs=0.01)
    assert len(seen) > 3


def test_recordings_of_another_gauge_are_refused(folder: Path) -> None:
    rows = list(csv.DictReader((folder / "open" / "fleet.csv").read_text().splitlines()))
    other = next(row["gauge_file"] for row in rows if row["gauge"] != rows[0]["gauge"])
    with pytest.raises(InputError, match="serial"):
        evaluate(read_recording(folder / "open" / rows[0]["recording"]), read_gauge(folder / "open" / other))


# --- what is in the readings ------------------------------------------------------------------------------------------


def hidden_rate_ppm(cause: Cause, fleet: Fleet, patterns: Patterns) -> Any:
    """What a cause adds to the rate of every recording, by its truth."""
    unit = patterns.of(cause.owner_kind, cause.owner, cause.kind, cause.where, cause.start or 0)
    if cause.kind == "temperature":
        return KELVIN_PPM * unit * [cause.details["kelvin_of_day"].get(day, 0.0) for day in fleet.day_of]
    of_machine = cause.details.get("of_machine", {})
    return unit * [of_machine.get(name, cause.size) for name in fleet.names_of["machine"]]


@pytest.mark.parametrize("hidden_too", [False, True])
def test_less_what_is_hidden_the_stated_scatter_and_the_usual_errors_are_left(hidden_too: bool, fleet: Fleet) -> None:
    """Repeats scatter as the machine file states; rates and trigger distances as the observer expects (chi2 of n).

    Causes of the rate, where hidden, are taken off by the truth.
    """
    patterns = Patterns(fleet)
    rates = [cause for cause in plant(fleet, SEED, 1.0) if hidden_too and cause.kind in RATE_KINDS]
    numbers = np.array([rate_and_trigger(fleet, k, readings(fleet, k, rates, SEED)) for k in range(SMALL)])
    numbers[:, 0] -= sum((hidden_rate_ppm(cause, fleet, patterns) for cause in rates), start=np.zeros(SMALL))
    stated = np.array([fleet.machines[recording.machine].repeatability_um for recording in fleet.recordings])
    assert np.mean(numbers[:, 2] / stated) == pytest.approx(1.0, abs=0.02)
    for observer, values in ((rate_observer(patterns), numbers[:, 0]), (trigger_observer(patterns), numbers[:, 1])):
        chi2 = float(values @ observer.whiten(values[:, None])[:, 0])
        assert chi2 == pytest.approx(SMALL, abs=4.0 * np.sqrt(2.0 * SMALL))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("periodic", "local_scale", "block")])
def test_every_cause_has_its_closed_form(kind: str, fleet: Fleet) -> None:
    """One unit of a cause, with the same random numbers: the difference is its pattern, of the documented sign."""
    placed = "diagonal" if kind == "squareness" else "x"
    number = next(k for k, recording in enumerate(fleet.recordings) if recording.placement == placed)
    cause, patterns = small_cause(kind, fleet, number), Patterns(fleet)
    with_it, without = (rate_and_trigger(fleet, number, readings(fleet, number, c, SEED)) for c in ([cause], []))
    in_rate = kind in ("scale", "squareness", "certificate_scale", "gauge_expansion", "temperature")
    unit = patterns.unit(kind, cause.where)[number]
    unit *= 1e6 * fleet.gauges[fleet.gauge_of[number]].true_expansion_per_K if kind == "temperature" else 1.0
    unseen = (
        4.0 * parts.THERMOMETER_K if kind == "gauge_expansion" else 0.01
    )  # the true temperature is not the shown one
    assert with_it[0] - without[0] == pytest.approx(unit if in_rate else 0.0, rel=2e-3, abs=unseen)
    assert with_it[1] - without[1] == pytest.approx(0.0 if in_rate else unit, rel=2e-3, abs=0.01)
    assert with_it[2] == pytest.approx(without[2], rel=0.02)


def test_a_block_and_a_bump_of_the_scale_move_the_same_faces(fleet: Fleet) -> None:
    """At both faces of the block, and hardly anywhere else: a single recording cannot tell them apart."""
    number = next(k for k, recording in enumerate(fleet.recordings) if recording.placement == "x")
    recording = fleet.recordings[number]
    gauge, machine = fleet.gauges[recording.gauge], fleet.machines[recording.machine]
    centre = gauge.nominal_mm[8:10].mean() - gauge.length_mm / 2.0
    details = {"at_mm": recording.middle_mm[0] + centre * recording.axis[0], "sd_mm": bump_sd_mm(gauge)}
    bump = Cause("machine", machine.name, "local_scale", "x", 2.0, details=details)
    block = Cause("gauge", gauge.name, "block", "5", 1.4)
    tips = [readings(fleet, number, causes, SEED)["tip"][: 2 * gauge.blocks, 0] for causes in ([], [bump], [block])]
    by_bump, by_block = (1e3 * (tip - tips[0]) for tip in tips[1:])
    assert np.flatnonzero(by_block > 0.5).tolist() == [8, 9]
    np.testing.assert_allclose(by_bump, by_block, atol=0.25)


def test_a_period_and_worn_blocks_follow_their_formulas(fleet: Fleet) -> None:
    """A wave along its axis in machine coordinates; both faces of the used blocks recede into them by the year."""
    number = next(k for k, recording in enumerate(fleet.recordings) if recording.placement == "x")
    recording = fleet.recordings[number]
    gauge, machine = fleet.gauges[recording.gauge], fleet.machines[recording.machine]
    law = {"of_machine": {machine.name: 1.5}, "phase_rad_of_machine": {machine.name: 0.4}, "period_mm": 47.0}
    wave = Cause("type", machine.line, "periodic", "x", 1.2, details=law)
    worn = Cause("gauge", gauge.name, "wear", "used", 1.5, details={"blocks": 3})
    plain, waved, used = (readings(fleet, number, causes, SEED)["tip"] for causes in ([], [wave], [worn]))
    expected_um = 1.5 * np.sin(2.0 * np.pi * plain[:, 0] / 47.0 + 0.4) * recording.axis[0]
    np.testing.assert_allclose(1e3 * (waved - plain) @ recording.axis, expected_um, atol=2e-3)
    lost_um = 1.5 * (recording.day + 1.0) / 365.25
    shift_um = np.resize([lost_um, -lost_um], 2 * gauge.blocks) * (np.arange(2 * gauge.blocks) < 6)
    first = 1e3 * ((used - plain) @ recording.axis)[: 2 * gauge.blocks]
    np.testing.assert_allclose(first, shift_um, atol=2e-3)


def test_the_observer_is_a_least_squares_fit_with_a_known_covariance() -> None:
    """Three recordings of one machine, two gauges: the leftover equals that of the whole covariance inverted."""
    variance, machine = np.array([1.0, 2.0, 3.0]), np.ones((3, 1))
    observer = Observer(variance, machine, np.array([2.0]))
    gauge, pattern = np.array([[1.0], [1.0], [0.0]]), np.array([0.0, 1.0, 1.0])
    observer.expect(gauge, 0.5)
    inverse = np.linalg.inv(np.diag(variance) + 4.0 * machine @ machine.T + 0.25 * gauge @ gauge.T)
    rival = gauge[:, 0]
    left = pattern @ inverse @ pattern - (pattern @ inverse @ rival) ** 2 / (rival @ inverse @ rival)
    assert observer.leftover(pattern, gauge) == pytest.approx(left)


def test_undetermined_pairs_share_every_recording_and_determined_ones_do_not() -> None:
    fleet = make_fleet(2, 300)
    causes = plant(fleet, 2, 1.0)
    assert {cause.determined for cause in causes} == {True, False}
    for cause in causes:
        own = fleet.owned(cause.owner_kind, cause.owner)
        always = [rival for rival in cause.rivals if np.array_equal(own, fleet.owned(*rival[:2]))]
        assert bool(always) != cause.determined


# --- the score --------------------------------------------------------------------------------------------------------


def entry(cause: dict[str, Any], probability: float = 0.99, **changes: Any) -> dict[str, Any]:
    kept = {key: cause[key] for key in ("owner_kind", "owner", "kind", "where", "size")}
    dates = cause["start_between"] or [None, None]
    instead = [] if cause["determined"] else cause["rivals"]
    return {**kept, "from": dates[0], "to": dates[1], "probability": probability, "instead": instead, **changes}


def hidden(owner_kind: str, owner: str, kind: str, **changes: Any) -> dict[str, Any]:
    cause = {"owner_kind": owner_kind, "owner": owner, "kind": kind, "where": None, "size": 2.0, "unit": "um"}
    cause |= {"strength": 1.0, "start_between": None, "members": [], "determined": True, "rivals": []}
    return {**cause, **changes}


def test_the_truth_as_answer_is_right_in_everything(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = read_truth(folder)
    path = folder.parent / "perfect.json"
    path.write_text(json.dumps({"causes": [entry(cause) for cause in truth["causes"]]}))
    figures = summary(score(truth, read_answer(path)))
    for key in ("attributed", "pairs_settled", "left_open"):
        assert figures[key][0] == figures[key][1], key
    assert figures["attributed"][1] >= 8
    assert figures["false_discoveries"][0] == figures["overclaimed"][0] == 0
    assert figures["brier"] == pytest.approx(1e-4)
    score_main([str(folder), str(path)])
    assert capsys.readouterr().out.startswith("no misses")


def test_the_rival_named_is_a_miss_a_false_discovery_and_a_pair_not_settled() -> None:
    rival = {"owner_kind": "machine", "owner": "M1", "kind": "scale"}
    truth = {"causes": [hidden("gauge", "G1", "certificate_scale", rivals=[rival])]}
    said = {**rival, "probability": 0.9}
    figures = summary(score(truth, [said]))
    assert (figures["attributed"], figures["false_discoveries"], figures["pairs_settled"]) == ([0, 1], [1, 1], [0, 1])
    both = score(truth, [said, entry(truth["causes"][0])])
    assert summary(both)["pairs_settled"] == [0, 1]
    assert summary(both)["false_discoveries"] == [1, 2]
    assert "false discovery: M1 scale (0.90)" in text(both)


def test_a_false_discovery_spoils_the_pair_with_which_it_shares_most_recordings() -> None:
    rivals = [
        {"owner_kind": "gauge", "owner": "G1", "kind": "certificate_scale", "overlap": share} for share in (0.1, 0.4)
    ]
    causes = [
        hidden("machine", name, "scale", rivals=[rival]) for name, rival in zip(("M1", "M2"), rivals, strict=True)
    ]
    said = [entry(cause) for cause in causes] + [{**rivals[0], "probability": 0.9}]
    assert [verdict.settled for verdict in score({"causes": causes}, said).verdicts] == [True, False]


def test_what_nothing_determines_must_be_left_open() -> None:
    rival = {"owner_kind": "machine", "owner": "M1", "kind": "scale"}
    cause = hidden("gauge", "G1", "certificate_scale", rivals=[rival], determined=False)
    own = {"owner_kind": "gauge", "owner": "G1", "kind": "certificate_scale"}
    truth = {"causes": [cause]}
    for first, second in ((own, rival), (rival, own)):
        open_ = summary(score(truth, [{**first, "probability": 0.95, "instead": [second]}]))
        assert (open_["left_open"], open_["overclaimed"], open_["false_discoveries"]) == ([1, 1], [0, 1], [0, 1])
    firm = summary(score(truth, [{**rival, "probability": 0.95}]))
    assert (firm["left_open"], firm["overclaimed"], firm["false_discoveries"]) == ([0, 1], [1, 1], [1, 1])


def test_machines_of_a_wrong_line_count_only_where_the_line_is_not_named() -> None:
    truth = {"causes": [hidden("type", "T1", "scale", members=["M1", "M2"], where="x")]}
    machine = {"owner_kind": "machine", "owner": "M1", "kind": "scale", "where": "x", "probability": 0.8}
    assert summary(score(truth, [machine]))["false_discoveries"] == [1, 1]
    assert summary(score(truth, [machine, entry(truth["causes"][0])]))["false_discoveries"] == [0, 1]


def test_dates_sizes_places_and_doubts_are_judged() -> None:
    cause = hidden("machine", "M1", "scale", where="x", start_between=["2025-03-01", "2025-04-01"])
    truth = {"causes": [cause]}
    late = score(truth, [entry(cause, **{"from": "2025-05-01", "to": "2025-06-01", "size": 2.7, "u": 0.2})]).verdicts[0]
    assert (late.attributed, late.date_right, late.size_right) == (True, False, False)
    near = score(truth, [entry(cause, **{"from": "2025-03-20", "to": "2025-06-01", "size": 2.3, "u": 0.2})]).verdicts[0]
    assert (near.date_right, near.size_right) == (True, True)
    assert summary(score(truth, [entry(cause, where="y")]))["false_discoveries"] == [1, 1]
    assert not score(truth, [entry(cause, 0.4)]).verdicts[0].attributed
    assert (
        not score(truth, [entry(cause, instead=[{"owner_kind": "gauge", "owner": "G1", "kind": "block"}])])
        .verdicts[0]
        .attributed
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "rust"}, "entry 1: kind 'rust', expected one of scale"),
        ({"owner_kind": "hall"}, "entry 1: scale of a hall, expected machine or type"),
        ({"probability": 1.2}, "entry 1: probability 1.2, expected 0 to 1"),
    ],
)
def test_answers_with_other_words_are_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = tmp_path / "answer.json"
    path.write_text(
        json.dumps([{"owner_kind": "machine", "owner": "M1", "kind": "scale", "probability": 0.9, **change}])
    )
    with pytest.raises(ValueError, match=message):
        read_answer(path)


def test_the_words_of_score_and_generator_agree() -> None:
    assert set(CLEAR) == set(KINDS) == set().union(*FAMILIES)


def test_run_scores_what_a_tool_answers_and_hides_the_truth_meanwhile(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tool = tmp_path / "tool.py"
    tool.write_text(
        "import json, pathlib, sys\n"
        "found = [str(p) for p in pathlib.Path(sys.argv[1]).parent.parent.rglob('truth*')]\n"
        "entry = dict(owner_kind='probe', owner='P99', kind='radius', probability=0.6 if not found else 0.9)\n"
        "pathlib.Path(sys.argv[2]).write_text(json.dumps([entry]))\n"
    )
    words = ["--seeds", "5", "--recordings", "60", "--add", "true", "--keep", str(tmp_path / "kept")]
    run([*words, "--infer", f"{sys.executable} {tool} {{roster}} {{answer}}", "-o", str(tmp_path / "figures.json")])
    out = capsys.readouterr().out
    assert "false discovery: P99 radius (0.60)" in out
    assert "missed: " in out
    assert json.loads((tmp_path / "figures.json").read_text())["total"]["false_discoveries"] == [1, 1]
    assert (tmp_path / "kept" / "5" / "sealed" / "truth.json").exists()
