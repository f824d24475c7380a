"""The blind benchmark: independent of the package, sealed, of the stated sizes, and scored by the stated rules."""

from __future__ import annotations

import argparse
import ast
import json
import shlex
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.blind import machine_causes, run_causes
from benchmarks.blind.catalogue import RECIPES, SINGLES
from benchmarks.blind.cause import along, size, strength_for
from benchmarks.blind.generate import Case, list_cases, make_case, make_cases, seal, with_combinations
from benchmarks.blind.identify import Names, leftovers
from benchmarks.blind.left_out import deleted_kinds, forgetful, matrix, matrix_text, score_left_out
from benchmarks.blind.reference_stepwise import main as reference
from benchmarks.blind.run import benchmark, diagnose
from benchmarks.blind.run import main as run_main
from benchmarks.blind.scene import Design, Scene, make_scene
from benchmarks.blind.score import combinations_of, explains, interval_hits, score_case, wilson_interval
from benchmarks.blind.spelling import covariate, key_of
from benchmarks.blind.table import summarise, text
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.recording import join_recordings, read_recording

BLIND = Path(__file__).resolve().parent.parent / "benchmarks" / "blind"
GENERATOR = [
    *("kits", "scene", "scatter", "ways", "cause", "machine_causes", "run_causes", "outsiders"),
    *(
        "probe_causes",
        "axis_causes",
        "chain_causes",
        "temperature_causes",
        "volume_causes",
        "families",
        "further_families",
    ),
    *("identify", "bound", "recipe", "catalogue", "further_catalogue", "writers", "generate"),
]
SINGLE_KINDS = {recipe.name for recipe in SINGLES}


def scene_of(kit: str, seed: int = 3, **settings: Any) -> Scene:
    return make_scene(Design(kit, **settings), np.random.default_rng(seed))


def options_for(tool: Path | str, **settings: Any) -> argparse.Namespace:
    arguments = "{recordings} --gauge {gauge} --machine {machine} -o {out}"
    chosen = {
        "first_seed": 1,
        "seeds": 1,
        "sizes": "1",
        "families": "single",
        "names": "squareness_xz",
        "nulls": 0,
        "sample": 0,
        "keep": True,
    }
    chosen |= {"jobs": 1, "timeout": 30, "left_out": False, "tool": f"{tool} {arguments}", **settings}
    return argparse.Namespace(**chosen)


def read_folder(folder: Path) -> pd.DataFrame:
    paths = sorted(folder.glob("recording*.csv"))
    return join_recordings([read_recording(path) for path in paths]).frame


# --- independence and concealment -------------------------------------------------------------------------------------


@pytest.mark.parametrize("module", GENERATOR)
def test_generator_imports_nothing_but_numpy_the_standard_library_and_itself(module: str) -> None:
    roots, siblings = set(), set()
    for node in ast.walk(ast.parse((BLIND / f"{module}.py").read_text())):
        if isinstance(node, ast.Import):
            roots |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            roots.add((node.module or "").split(".")[0])
            if node.module == "benchmarks.blind":
                siblings |= {name.name for name in node.names}
            elif (node.module or "").startswith("benchmarks."):
                siblings.add(node.module.rpartition(".")[2])
    assert siblings <= set(GENERATOR)
    assert roots <= sys.stdlib_module_names | {"numpy", "benchmarks"}


def test_generator_runs_where_the_package_cannot_be_imported(tmp_path: Path) -> None:
    script = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in ('stepgauge', 'scipy', 'pandas', 'pydantic'):
            raise ImportError('refused: ' + name)
sys.meta_path.insert(0, Refuse())
from benchmarks.blind.generate import main
main([sys.argv[1], '--seeds', '1', '--sizes', '1', '--families', 'single', '--names', 'scale_error'])
"""
    subprocess.run([sys.executable, "-c", script, str(tmp_path / "b")], cwd=BLIND.parent.parent, check=True, timeout=60)
    assert len(list((tmp_path / "b" / "sealed").iterdir())) == 2  # scale_error and periodic_scale_error


PROBE = '''
"""A nosy tool: looks for any truth in the folders around its case, its environment and its open files."""
import json, os
from pathlib import Path

def main(argv):
    out = Path(argv[argv.index("-o") + 1])
    around = Path(argv[argv.index("--gauge") + 1]).parents[2]
    found = [key for key, value in os.environ.items() if "sealed" in value]
    places = [path for path in around.rglob("*") if path.is_file()]
    places += [Path(os.readlink(f"/proc/self/fd/{fd}")) for fd in os.listdir("/proc/self/fd")
               if os.path.exists(f"/proc/self/fd/{fd}")]
    for path in places:
        if path.is_file() and path.suffix == ".json" and "leftover_chi2" in path.read_text():
            found.append(str(path))
    out.mkdir(parents=True, exist_ok=True)
    (out / "diagnosis.json").write_text(json.dumps({"verdict": "adequate", "found": found}))
'''


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="the nosy tool reads /proc, which this system lacks")
def test_a_nosy_tool_finds_no_truth_while_it_runs_and_finds_it_afterwards(tmp_path: Path) -> None:
    tool = tmp_path / "nosy.py"
    tool.write_text(PROBE)
    results, identity = benchmark(options_for(tool), tmp_path / "run")
    case = results[0]["case"]
    assert results[0]["error"] == ""
    assert json.loads((tmp_path / "run" / "out" / case / "diagnosis.json").read_text())["found"] == []
    sealed = tmp_path / "run" / "sealed"
    assert stat.S_IMODE(sealed.stat().st_mode) == 0o700
    assert stat.S_IMODE((sealed / f"{case}.json").stat().st_mode) == 0o600
    if not identity:  # the same search, now that the truth is written, shows that it can find one
        arguments = f"{tool} {{recordings}} --gauge {{gauge}} --machine {{machine}} -o {{out}}"
        diagnose([tmp_path / "run" / "public" / case], tmp_path / "run" / "out", arguments, 30, {})
        again = json.loads((tmp_path / "run" / "out" / case / "diagnosis.json").read_text())
        assert again["found"] == [str(sealed / f"{case}.json")]


def test_public_files_do_not_say_what_is_concealed(tmp_path: Path) -> None:
    case = Case("single:squareness", 1.0, 5)
    truth = make_case(case, tmp_path)
    content = "".join(path.read_text() for path in (tmp_path / case.case_id).iterdir()).lower()
    columns = {"gauge_temperature", "scale_temperature"}  # kinds that begin the name of a documented column
    words = {*SINGLE_KINDS, "seed", "effect", "truth", str(truth["causes"][0]["strength"])} - columns
    assert [word for word in words if word in content] == []
    assert "squareness" not in case.case_id


def test_same_seed_same_files(tmp_path: Path) -> None:
    case = Case("pair:gauge_temperature+block_defect", 0.5, 2)
    truths = [make_case(case, tmp_path / name) for name in "ab"]
    first, second = ({p.name: p.read_bytes() for p in (tmp_path / n / case.case_id).iterdir()} for n in "ab")
    assert first == second
    assert truths[0] == truths[1]
    assert make_case(Case(case.recipe, 0.5, 3), tmp_path)["causes"] != truths[0]["causes"]


def test_processes_make_the_same_cases(tmp_path: Path) -> None:
    cases = list_cases([1], families=["null"], nulls=9)
    assert list(make_cases(cases, tmp_path / "a", jobs=2)) == list(make_cases(cases, tmp_path / "b"))


# --- recordings -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", [key for key in RECIPES if not key.startswith(("scatter", "way"))][::6])
def test_recipes_write_files_that_the_package_reads(key: str, tmp_path: Path) -> None:
    """Every sixth of them: all causes are made by the tests below and by those of the later kinds."""
    case = Case(key, 1.0 if RECIPES[key].causes else 0.0, 7)
    truth = make_case(case, tmp_path)
    folder = tmp_path / case.case_id
    frame, gauge = read_folder(folder), read_gauge(folder / "gauge.toml")
    machine = read_machine(folder / "machine.toml")
    assert 240 <= len(frame) == truth["rows"] <= 900
    assert 12 <= gauge.n_blocks <= 30
    assert frame["cycle"].max() in range(3, 7)
    assert frame["face"].max() == gauge.n_faces
    assert frame.groupby("placement")["time_s"].is_monotonic_increasing.all()
    inside = (frame[["x_mm", "y_mm", "z_mm"]] > machine.travel_mm[:, 0]) & (
        frame[["x_mm", "y_mm", "z_mm"]] < machine.travel_mm[:, 1]
    )
    assert inside.all(axis=None)
    assert machine.effects == ()


OTHERS = [key for key in RECIPES if key.startswith(("way-null", "way-outside", "scatter-null"))]


@pytest.mark.parametrize("key", OTHERS[::3])
def test_other_scatters_and_ways_write_files_that_the_package_reads(key: str, tmp_path: Path) -> None:
    case = Case(key, 0.0 if "null" in key else 1.0, 7)
    truth = make_case(case, tmp_path)
    frame, machine = read_folder(tmp_path / case.case_id), read_machine(tmp_path / case.case_id / "machine.toml")
    places = frame[["x_mm", "y_mm", "z_mm"]].to_numpy()
    assert 170 <= len(frame) == truth["rows"] <= 900
    assert ((places > machine.travel_mm[:, 0]) & (places < machine.travel_mm[:, 1])).all()
    assert np.diff(frame["time_s"]).min() > 0.0 or "placement" in frame


def residual_um(folder: Path) -> tuple[pd.DataFrame, np.ndarray]:
    """Along the approach, less certificate, radius and placement origins: by the package's own readers."""
    frame, gauge = read_folder(folder), read_gauge(folder / "gauge.toml")
    machine = read_machine(folder / "machine.toml")
    approach = frame[["approach_i", "approach_j", "approach_k"]].to_numpy()
    side = np.where(frame["face"] % 2, 1.0, -1.0)
    warm = gauge.table.expansion_per_K * (frame["gauge_temperature_C"].to_numpy() - 20.0)
    expected = side * gauge.position_mm[frame["face"] - 1] * (1.0 + warm)
    expected -= machine.probe.tip_radius_mm - machine.probe.pretravel_um * 1e-3
    found = np.einsum("ij,ij->i", frame[["x_mm", "y_mm", "z_mm"]].to_numpy(), approach)
    off = (found - expected) * 1e3
    return frame, without_origins(frame, off, side)


def without_origins(frame: pd.DataFrame, off: np.ndarray, side: np.ndarray) -> np.ndarray:
    origins = np.column_stack([side * (frame["placement"] == place) for place in frame["placement"].unique()])
    return off - origins @ np.linalg.lstsq(origins, off, rcond=None)[0]


@pytest.mark.parametrize("seed", range(4))
def test_a_null_recording_is_noise_about_the_certificate(seed: int, tmp_path: Path) -> None:
    case = Case("null:null", 0.0, seed)
    truth = make_case(case, tmp_path)
    _, off = residual_um(tmp_path / case.case_id)
    spread = np.hypot(truth["sigma_um"], 0.1)  # certificate and recorded temperatures add up to 0.1 um
    assert 0.9 * truth["sigma_um"] < off.std() < 1.15 * spread
    assert abs(off.mean()) < 4.0 * spread / np.sqrt(len(off))
    assert truth["causes"] == []


LINEAR = ["scale_error", "squareness", "angular_x_about_z", "gauge_bending", "thermal_drift", "step_change", "outliers"]


@pytest.mark.parametrize("name", LINEAR)
def test_the_size_of_an_effect_is_its_rms_over_the_noise(name: str, tmp_path: Path) -> None:
    """The same seed at sizes 3 and 1 has the same noise, so the difference of the files is twice the effect."""
    truths, offs = [], []
    for wanted in (3.0, 1.0):
        case = Case(f"single:{name}", wanted, 4)
        truths.append(make_case(case, tmp_path))
        frame, off = residual_um(tmp_path / case.case_id)
        offs.append(off)
    difference = (offs[0] - offs[1]) - (offs[0] - offs[1]).mean()
    side = np.where(frame["face"] % 2, 1.0, -1.0)
    columns = np.column_stack([np.ones(len(frame)), *(side * (frame["placement"] == p) for p in set(frame.placement))])
    difference -= columns @ np.linalg.lstsq(columns, difference, rcond=None)[0]
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(2.0 * truths[0]["sigma_um"], rel=0.01)
    assert truths[0]["causes"][0]["size"] == pytest.approx(3.0, rel=1.1e-3)


# --- causes -----------------------------------------------------------------------------------------------------------


def random() -> np.random.Generator:
    return np.random.default_rng(11)


def test_summed_pitch_errors_make_the_stated_slope() -> None:
    scene = scene_of("x")
    cause = machine_causes.scale_error(scene, random(), 0)
    slope = np.polyfit(scene.centre_mm[:, 0], cause.displace(8.0)[:, 0], 1)[0] * 1e3
    assert slope == pytest.approx(cause.parameters(8.0)["ppm"], rel=5e-3)


def test_play_shifts_readings_by_half_of_it_to_either_side() -> None:
    scene = scene_of("x")
    cause = machine_causes.reversal_error(scene, random(), 0)
    sign = np.sign(cause.parameters(4.0)["um"])
    assert cause.displace(4.0)[:, 0] == pytest.approx(sign * 2.0 * np.sign(scene.approach[:, 0]))


def test_a_leaning_axis_shifts_x_by_angle_times_y() -> None:
    scene = scene_of("diagonal")
    cause = machine_causes.squareness(scene, random(), "xy")
    urad = cause.parameters(20.0)["urad"]
    assert cause.displace(20.0)[:, 0] == pytest.approx(urad * 1e-3 * scene.centre_mm[:, 1], rel=1e-4)


def test_a_curved_guideway_gives_abbe_errors() -> None:
    scene = scene_of("x_front_rear")
    cause = machine_causes.angular_error(scene, random(), 0, 2)
    k, (x, y) = cause.parameters(10.0)["urad_per_m"], scene.centre_mm[:, :2].T
    assert cause.displace(10.0)[:, 0] == pytest.approx(-k * 1e-6 * x * y, rel=1e-4)


def test_the_tripod_needs_between_one_and_two_times_its_weakest_force() -> None:
    scene = scene_of("azimuths")
    lobing = along(scene, run_causes.probe_lobing(scene, random()).displace(1.0))
    assert np.ptp(lobing) == pytest.approx(0.5, abs=0.05)
    assert lobing.max() < 1.0


def test_a_warm_gauge_expands_by_its_true_coefficient() -> None:
    scene = scene_of("y")
    cause = run_causes.gauge_temperature(scene, random())
    grown = scene.gauge.true_expansion_per_K * cause.parameters(0.5)["delta_K"] * scene.along_mm * 1e3
    assert along(scene, cause.displace(0.5)) == pytest.approx(scene.side * grown, abs=1e-5)


def test_an_angle_stretches_by_half_its_square() -> None:
    scene = scene_of("x")
    stretched = along(scene, run_causes.misalignment(scene, random()).displace(4.0)) * scene.side
    slope = np.polyfit(scene.along_mm, stretched, 1)[0] * 1e-3
    assert slope == pytest.approx(4e-3**2 / 2.0, rel=0.03)  # the program's own 0.03 mrad adds a cross term


def test_a_gauge_may_be_laid_askew_in_one_placing_alone() -> None:
    """The judge knows it as a name of its own: a stretch of that placing leaves nothing, of another one all."""
    scene = scene_of("x_y_diagonal")
    stretch = 50e-3 * scene.side * scene.along_mm * (scene.placement == 2)
    left = leftovers(scene, stretch)
    assert left["misalignment:2"] < 1e-6
    assert left["misalignment:1"] > 100.0
    assert left["misalignment"] > 100.0
    effect = {"kind": "misalignment", "parameters": {"placement": {"value": 2}, "mrad": {"value": 3.0}}}
    assert key_of(effect) == "misalignment:2"


@pytest.mark.parametrize("recipe", SINGLES, ids=lambda recipe: recipe.name)
def test_strengths_give_the_wanted_size(recipe: Any) -> None:
    rng = np.random.default_rng(5)
    scene = make_scene(recipe.designs[0], rng)
    cause = recipe.causes[0](scene, rng)
    assert size(scene, cause, strength_for(scene, cause, 0.5)) == pytest.approx(0.5, rel=1.1e-3)


def test_one_placing_confounds_scale_and_gauge_and_three_separate_them() -> None:
    for kit, same in (("x", True), ("x_y_diagonal", False)):
        scene = scene_of(kit)
        cause = machine_causes.scale_error(scene, random(), 0)
        left = leftovers(scene, along(scene, cause.displace(strength_for(scene, cause, 1.0))))
        assert left["scale_error:x"] < 0.1
        assert left["scale_temperature:x"] < 0.1
        assert (left["gauge_temperature"] < 1.0) is same
        assert same or left["gauge_temperature"] > 36.0


def test_two_kinds_together_leave_nothing_of_what_each_leaves_much_of() -> None:
    scene = scene_of("x_y")
    names = Names(scene)
    radius, play = (
        along(scene, cause.displace(strength_for(scene, cause, 1.0)))
        for cause in (run_causes.effective_radius(scene, random()), machine_causes.reversal_error(scene, random(), 0))
    )
    both = radius + play
    left = names.leftovers(both)
    assert left["effective_radius"] > 36.0
    assert left["reversal_error:x"] > 36.0
    assert names.together(both, ["effective_radius", "reversal_error"]) < 0.1
    assert names.together(both, ["reversal_error"]) == pytest.approx(
        min(chi2 for key, chi2 in left.items() if key.startswith("reversal_error"))
    )
    assert names.together(both, ["effective_radius", "squareness"]) > 36.0


def test_combinations_that_a_tool_tells_are_judged_in_the_measurement_of_the_case(tmp_path: Path) -> None:
    truth = make_case(Case("probe:tripod", 1.0, 3042), tmp_path)
    pair = ("effective_radius", "reversal_error")
    (cause,) = with_combinations(truth, [pair])["causes"]
    alone = min(cause["leftover_chi2"].get(key, 100.0) for key in ("effective_radius", "reversal_error:x"))
    assert cause["combined_chi2"]["effective_radius + reversal_error"] < min(alone, 36.0)
    assert with_combinations(truth, []) == truth


def test_two_laws_of_one_kind_are_judged_as_two(tmp_path: Path) -> None:
    """Errors of two scales in one proportion are what the gauge's temperature is here; neither is alone."""
    truth = make_case(Case("pair:gauge_temperature+block_defect", 0.5, 3147), tmp_path)
    effect = {"kind": "gauge_temperature", "confounded_with": ["scale_error + scale_error"]}
    wrong = {**effect, "confounded_with": ["reversal_error + reversal_error"]}
    told = combinations_of([effect, wrong])
    assert told == {("reversal_error", "reversal_error"), ("scale_error", "scale_error")}
    cause = next(one for one in with_combinations(truth, told)["causes"] if one["kind"] == "gauge_temperature")
    assert min(cause["leftover_chi2"].get(f"scale_error:{axis}", 100.0) for axis in "xyz") > 36.0
    assert explains(effect, cause)
    assert not explains(wrong, cause)


def test_no_carriage_rotates_more_than_carriages_do(tmp_path: Path) -> None:
    """Of this seed the first measurement would need 1.6 mrad/m: its gauges hardly show a rotation."""
    truth = make_case(Case("chain:rotation_in_chain_x_z", 1.0, 2912), tmp_path)
    assert abs(truth["causes"][0]["parameters"]["urad_per_m"]) < 200.0
    assert truth["bound"] > 0.9


def test_the_certificate_may_take_up_what_it_is_unsure_of() -> None:
    """A face that is off by its stated uncertainty costs about one unit of chi2 to explain without any cause."""
    scene = scene_of("x_y")
    face = int(np.argmax(scene.gauge.u_um)) + 1
    off = scene.side * (scene.face == face) * scene.gauge.u_um[face - 1]
    assert 0.0 < leftovers(scene, off)["scale_curvature:x"] < 1.0


@pytest.mark.parametrize("key", [key for key in RECIPES if key.startswith("confounded")])
def test_nobody_can_tell_the_members_of_a_set_apart(key: str, tmp_path: Path) -> None:
    truth = make_case(Case(key, 1.0, 12), tmp_path)
    left = truth["causes"][0]["leftover_chi2"]
    for kind in truth["whole_set"]:
        assert min(chi2 for name, chi2 in left.items() if name.partition(":")[0] == kind) < 1.0


@pytest.mark.parametrize("key", [key for key in RECIPES if key.startswith("outsider")])
def test_no_known_name_fits_an_outsider(key: str, tmp_path: Path) -> None:
    truth = make_case(Case(key, 1.0, 12), tmp_path)
    assert truth["causes"][0]["best_known"][1] > 99.9
    assert truth["covariates"]


# --- scoring ----------------------------------------------------------------------------------------------------------


def cause_of(kind: str, where: str = "", parameters: dict[str, float] | None = None, **left: float) -> dict[str, Any]:
    chi2 = {key.replace("__", ":"): value for key, value in left.items()}
    own = {f"{kind}:{where}" if where else kind: 0.0}
    return {
        "kind": kind,
        "where": where,
        "parameters": parameters or {},
        "size": 1.0,
        "own_form_chi2": 0.0,
        "leftover_chi2": {**own, **chi2},
        "best_known": None,
    }


def truth_of(family: str, *causes: dict[str, Any], **more: Any) -> dict[str, Any]:
    base = {"case": "c", "family": family, "name": "n", "size": 1.0, "seed": 1, "rows": 9, "noise_rms_um": 0.5}
    return {**base, "causes": list(causes), "whole_set": [], "forgiven": [], "covariates": [], **more}


def found(kind: str, *confounded: str, **parameters: Any) -> dict[str, Any]:
    return {"kind": kind, "parameters": parameters, "confounded_with": list(confounded)}


def verdict(word: str, *effects: dict[str, Any], located: str = "") -> dict[str, Any]:
    return {"verdict": word, "effects": list(effects), "located": [{"covariate": located}] if located else []}


SQUARE = cause_of("squareness", "xy", angular_error__x__x=0.1, scale_error__x=80.0)
STRETCH = cause_of("scale_error", "x", scale_temperature__x=0.0, gauge_temperature=0.2, misalignment=0.2)
SEAT = cause_of("seat_defect", effective_radius=80.0, reversal_error__x=60.0, tip_change__1=70.0, trigger_delay=20.0)
SEAT["combined_chi2"] = {"effective_radius + reversal_error": 3.0, "effective_radius + tip_change": 50.0}


@pytest.mark.parametrize(
    ("cause", "effect", "right"),
    [
        (SQUARE, found("squareness", plane="xy"), True),
        (SQUARE, found("squareness", plane={"value": "yx"}), True),
        (SQUARE, found("squareness", plane="xz"), False),
        (SQUARE, found("squareness", "scale_error", plane="xy"), False),  # says too much
        (SQUARE, found("squareness", "angular_error", plane="xy"), True),
        (SQUARE, found("squareness", "geometric_errors", plane="xy"), True),  # of which it is one
        (SQUARE, found("geometric_errors", "squareness"), False),
        (SQUARE, found("scale_error", "squareness", axis="x"), False),
        (STRETCH, found("scale_error", axis="x"), False),  # silent about what nobody can tell apart
        (STRETCH, found("scale_error", "gauge_temperature", axis="x"), True),
        (STRETCH, found("gauge_temperature", "scale_error"), True),
        (STRETCH, found("gauge_temperature", "misalignment"), False),  # the truth is not in the set
        (STRETCH, found("scale_error", "gauge_temperature", axis="y"), False),
        (cause_of("block_defect", "7"), found("block_defect", face={"value": 7}), True),
        (cause_of("block_defect", "7"), found("block_defect", face=8), False),
        (cause_of("angular_error", "x/z"), found("angular_error", travel="x", rotation="z"), True),
        (cause_of("angular_error", "x/z"), found("angular_error", travel="x", rotation="y"), False),
        (cause_of("thermal_drift"), found("step_change"), False),
        (SEAT, found("seat_defect", "reversal_error + lever_arm"), True),  # an arm is a radius: they fit together
        (SEAT, found("seat_defect", "effective_radius", "reversal_error"), False),  # neither does alone
        (SEAT, found("seat_defect", "effective_radius + tip_change"), False),
        (SEAT, found("seat_defect", "tip_change + trigger_delay"), True),  # one of them does alone
        (SEAT, found("seat_defect", "tip_change + reversal_error"), False),
    ],
)
def test_a_name_is_right(cause: dict[str, Any], effect: dict[str, Any], right: bool) -> None:
    assert explains(effect, cause) is right


@pytest.mark.parametrize(
    ("size", "own_form_chi2", "right"), [(1.0, 35.0, False), (1.0, 37.0, True), (0.3, 8.0, False), (0.3, 10.0, True)]
)
def test_a_cause_in_another_form_than_its_kind_may_be_unknown(size: float, own_form_chi2: float, right: bool) -> None:
    """Of 200 probings at 0.3 of the noise there are 18 in all: half of it is another form, little as it is."""
    lobing = cause_of("probe_lobing") | {"size": size, "own_form_chi2": own_form_chi2}
    truth = truth_of("single", lobing, rows=200, covariates=["placement"])
    assert score_case(truth, verdict("unknown", located="placement"))["right"] is right
    assert score_case(truth, verdict("unknown", located="time"))["right"] is False


@pytest.mark.parametrize(
    ("truth", "diagnosis", "right"),
    [
        (truth_of("single", SQUARE), verdict("effects", found("squareness", plane="xy")), True),
        (truth_of("single", SQUARE), verdict("unknown", found("squareness", plane="xy")), False),
        (truth_of("single", SQUARE), verdict("adequate"), False),
        (truth_of("single", SQUARE), None, False),
        (truth_of("single", SQUARE), verdict("effects", found("squareness", plane="xy"), found("outliers")), False),
        (
            truth_of("single", SQUARE, forgiven=["outliers"]),
            verdict("effects", found("squareness", plane="xy"), found("outliers")),
            True,
        ),
        (truth_of("pair", SQUARE, cause_of("thermal_drift")), verdict("effects", found("thermal_drift")), False),
        (
            truth_of("pair", SQUARE, cause_of("thermal_drift")),
            verdict("effects", found("thermal_drift"), found("squareness", plane="xy")),
            True,
        ),
        (
            truth_of("confounded", STRETCH, whole_set=["scale_error", "gauge_temperature", "scale_temperature"]),
            verdict("effects", found("gauge_temperature", "scale_error")),
            False,
        ),
        (
            truth_of("confounded", STRETCH, whole_set=["scale_error", "gauge_temperature", "scale_temperature"]),
            verdict("effects", found("gauge_temperature", "scale_error", "scale_temperature")),
            True,
        ),
        (truth_of("outsider", covariates=["time"]), verdict("unknown", located="time_s"), True),
        (truth_of("outsider", covariates=["time"]), verdict("unknown", located="speed"), False),
        (truth_of("outsider", covariates=["time"]), verdict("effects", found("thermal_drift"), located="time"), False),
        (truth_of("null"), verdict("adequate"), True),
        (truth_of("null"), verdict("insufficient"), False),
    ],
)
def test_an_answer_is_right(truth: dict[str, Any], diagnosis: dict[str, Any] | None, right: bool) -> None:
    assert score_case(truth, diagnosis)["right"] is right


def test_false_alarms_are_any_finding_on_a_null_recording() -> None:
    answers = [verdict("adequate"), verdict("insufficient"), verdict("unknown"), verdict("adequate", found("outliers"))]
    alarms = [score_case(truth_of("null"), answer)["false_alarm"] for answer in answers]
    assert alarms == [False, False, True, True]


def test_a_kind_that_was_left_out_must_come_back_unknown() -> None:
    truth = truth_of("single", {**SQUARE, "leftover_chi2": {"squareness:xy": 0.0}}, covariates=["machine"])
    assert score_left_out(truth, verdict("unknown", located="machine x"))["right"]
    assert not score_left_out(truth, verdict("effects", found("scale_error", axis="x")))["right"]
    assert not score_left_out(truth_of("single", SQUARE), verdict("unknown"))["scored"]  # angular_error fits


def test_a_kind_is_left_out_with_its_other_name_but_not_with_what_merely_fits_here() -> None:
    scale = cause_of("scale_error", "x", scale_temperature__x=0.0, squareness__xy=200.0)
    assert deleted_kinds(truth_of("single", scale)) == ("scale_error", "scale_temperature")
    assert score_left_out(truth_of("single", scale), verdict("unknown"))["scored"]
    fitted = score_left_out(truth_of("single", STRETCH), verdict("unknown"))
    assert (fitted["scored"], fitted["nearest"]) == (False, "gauge_temperature")
    assert deleted_kinds(truth_of("single", SQUARE)) == ("squareness",)


@pytest.mark.parametrize(
    ("diagnosis", "column"),
    [
        (verdict("unknown", located="time_s"), "unknown"),
        (verdict("unknown", found("step_change"), located="time_s"), "+ named"),
        (verdict("unknown", found("step_change"), located="speed"), "astray"),
        (verdict("unknown"), "astray"),
        (verdict("effects", found("step_change"), found("outliers"), located="time_s"), "step_change"),
        (verdict("adequate", found("outliers")), "outliers"),
        (verdict("adequate"), "adequate"),
        (verdict("insufficient"), "insufficient"),
        (None, "no answer"),
    ],
)
def test_each_case_left_out_falls_into_one_column(diagnosis: dict[str, Any] | None, column: str) -> None:
    truth = truth_of("single", cause_of("thermal_drift", step_change=50.0), covariates=["time"])
    result = score_left_out(truth, diagnosis)
    assert result["came_back"] == column
    assert result["right"] is (column in ("unknown", "+ named"))


def test_the_confusion_matrix_counts_every_case_once() -> None:
    drift = truth_of("single", cause_of("thermal_drift", step_change=50.0), covariates=["time"])
    fits = truth_of("single", cause_of("thermal_drift", step_change=4.0), covariates=["time"])
    step = truth_of("single", cause_of("step_change"), covariates=["time"], size=3.0)
    unknown, named = verdict("unknown", located="time"), verdict("effects", found("step_change"))
    beside = verdict("unknown", found("outliers"), found("outliers"), located="time")
    cases = [(drift, unknown), (drift, beside), (drift, named), (fits, named), (step, unknown)]
    rows = matrix(score_left_out(*case) for case in cases)
    assert [(row["size"], row["deleted"]) for row in rows] == [(3.0, ["step_change"]), (1.0, ["thermal_drift"])]
    assert rows[0]["came_back"] == {"unknown": 1}
    assert rows[1]["came_back"] == {"unknown": 1, "+ named": 1, "step_change": 1}
    assert (rows[1]["scored"], rows[1]["not_scored"]) == (3, 1)
    assert rows[1]["named_beside"] == {"outliers": 1}
    assert rows[1]["not_scored_fitted_by"] == {"step_change": 1}
    lines = matrix_text(rows).splitlines()
    assert lines[1].split() == ["step_change", "1", ".", ".", ".", ".", "1", "100", "."]
    assert next(line for line in lines if line.startswith("thermal_drift")).split()[1:] == [
        *("1", "1", ".", ".", "1"),  # unknown, with a name, astray, adequate, step_change
        *("3", "67", "1"),  # scored, per cent unknown, not scored
    ]
    assert "[1]: step_change named" in lines


def test_a_tool_is_told_every_kind_that_it_must_forget() -> None:
    told = forgetful("tool {recordings} --without={kind} -o {out}", ("scale_error", "scale_temperature"))
    both = ["--without=scale_error", "--without=scale_temperature"]
    assert shlex.split(told) == ["tool", "{recordings}", *both, "-o", "{out}"]


def test_intervals_count_only_where_one_cause_is_named() -> None:
    cause = cause_of("scale_error", "x", {"ppm": 5.0})
    hit, miss = {"value": 5.9, "u": 0.5, "unit": "ppm"}, {"value": 6.1, "u": 0.5, "unit": "ppm"}
    assert interval_hits(found("scale_error", axis="x", ppm=hit), cause) == [True]
    assert interval_hits(found("scale_error", axis="x", ppm=miss), cause) == [False]
    assert interval_hits(found("scale_error", "scale_temperature", axis="x", ppm=hit), cause) == []


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("position", "gauge"),
        ("position in the machine", "machine"),
        ("machine_x", "machine"),
        ("x_mm", "machine"),
        ("approach azimuth", "azimuth"),
        ("time_s", "time"),
        ("time since last touch", "pause"),
        ("order of probing", "order"),
        ("speed", "speed"),
        ("gauge_temperature_C", "gauge_temperature_c"),
    ],
)
def test_covariates_in_other_words(words: str, name: str) -> None:
    assert covariate(words) == name


def test_wilson_interval_against_published_values() -> None:
    assert wilson_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)  # Newcombe 1998, table I, method 3
    assert wilson_interval(0, 20)[0] == 0.0


# --- runner -----------------------------------------------------------------------------------------------------------


def test_a_tool_that_dies_or_hangs_costs_only_its_case(tmp_path: Path) -> None:
    tool = tmp_path / "tool.py"
    tool.write_text(
        "import json, os, time\nfrom pathlib import Path\n"
        "def main(argv):\n"
        "    out = Path(argv[-1])\n"
        "    if out.name == 'b': os._exit(3)\n"
        "    if out.name == 'c': time.sleep(20)\n"
        "    if out.name == 'd': raise ValueError('no')\n"
    )
    folders = [tmp_path / name for name in "abcde"]
    answers = diagnose(folders, tmp_path, f"{tool} -o {{out}}", 3, {})
    assert [answers[name]["error"] for name in "ae"] == ["", ""]
    assert "died" in answers["b"]["error"]
    assert "OutOfTime" in answers["c"]["error"]
    assert answers["d"]["error"] == "ValueError: no"


@pytest.mark.parametrize(("tool", "error"), [("stepgauge list files", ""), ("stepgauge guess", "exit code 2")])
def test_the_package_itself_runs_inside_the_worker(tool: str, error: str, tmp_path: Path) -> None:
    answer = diagnose([tmp_path / "a", tmp_path / "b"], tmp_path, tool, 30, {})["b"]
    assert answer["error"].startswith(error)
    assert bool(answer["error"]) is bool(error)
    assert 0.0 < answer["seconds"] < 20.0


def test_the_baseline_names_a_strong_squareness_and_the_table_says_so(tmp_path: Path) -> None:
    results, _ = benchmark(options_for(BLIND / "reference_stepwise.py", sizes="3", seeds=2), tmp_path / "run")
    assert [result["right"] for result in results] == [True, True]
    summary = summarise(results)
    assert summary["classes"][0]["right_pct"] == 100.0
    assert "single:squareness_xz" in text(summary)


FORGETFUL = '''
"""Says what it was told to forget, as if that were what it found."""
import json
from pathlib import Path

def main(argv):
    out = Path(argv[argv.index("-o") + 1])
    told = [part.partition("=")[2] for part in argv if part.startswith("--forget=")]
    out.mkdir(parents=True, exist_ok=True)
    effects = [{"kind": kind} for kind in told]
    (out / "diagnosis.json").write_text(json.dumps({"verdict": "effects", "effects": effects}))
'''


def test_one_command_leaves_every_single_out_in_turn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tool, results = tmp_path / "forgetful.py", tmp_path / "results.json"
    tool.write_text(FORGETFUL)
    template = f"{tool} {{recordings}} --gauge {{gauge}} --machine {{machine}} -o {{out}} --forget={{kind}}"
    selection = ["--seeds", "1", "--sizes", "1", "--names", "scale_"]  # pairs and sets of that name are no singles
    run_main(["--left-out", *selection, "--tool", template, "-o", str(results)])
    content = json.loads(results.read_text())
    assert {case["family"] for case in content["cases"]} == {"left_out"}
    assert all(case["named"] == case["deleted"] and not case["right"] for case in content["cases"])
    deleted = [row["deleted"] for row in content["left_out"]]
    assert ["scale_curvature"] in deleted
    assert ["scale_error", "scale_temperature"] in deleted
    assert sum(row["scored"] + row["not_scored"] for row in content["left_out"]) == len(content["cases"])
    assert "scale_temperature, scale_error" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--left-out", "--tool", "tool {recordings} -o {out}"], "must hold {kind}"),
        (["--tool", "tool {recordings} --forget={kind}"], "only --left-out"),
        (["--left-out", "--families", "pair"], "no single"),
    ],
)
def test_a_kind_to_forget_is_asked_for_where_it_is_needed(
    options: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        run_main(options)
    assert stop.value.code == 2
    assert problem in capsys.readouterr().err


def test_the_baseline_writes_the_documented_file(tmp_path: Path) -> None:
    case = Case("single:trigger_delay", 3.0, 1)
    make_case(case, tmp_path)
    folder = tmp_path / case.case_id
    recordings = [str(path) for path in sorted(folder.glob("recording*.csv"))]
    gauge, machine = folder / "gauge.toml", folder / "machine.toml"
    reference([*recordings, "--gauge", str(gauge), "--machine", str(machine), "-o", str(tmp_path / "out")])
    diagnosis = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert diagnosis["verdict"] == "effects"
    assert diagnosis["effects"][0]["kind"] == "trigger_delay"
    assert diagnosis["effects"][0]["parameters"]["ms"]["unit"] == "ms"


def test_sealed_truths_can_be_read_back(tmp_path: Path) -> None:
    truth = make_case(Case("outsider:preisach", 1.0, 1), tmp_path / "public")
    seal(tmp_path / "sealed", [truth])
    assert json.loads((tmp_path / "sealed" / f"{truth['case']}.json").read_text()) == truth
