"""The truth, the seal and the scorer of examples/linuxcnc-concealed, without LinuxCNC."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from stepgauge.diagnosis.output.files import FORMAT
from stepgauge.effects import effect_kinds
from stepgauge.errors import InputError
from stepgauge.files.text import write_json
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples" / "linuxcnc-concealed"
sys.path.append(str(EXAMPLE))
import cases  # noqa: E402
import conceal  # noqa: E402
import score  # noqa: E402
import truth  # noqa: E402


def test_every_case_is_measured_and_its_truth_is_of_the_vocabulary():
    every = cases.read_cases()
    assert len(every) >= 5
    for name, case in every.items():
        effect = truth.read_truth(name).effect
        assert len(case.placements) * len(case.speeds_mm_s) == 2
        for placement in case.placements:
            read_placement(EXAMPLE / f"{placement}.toml", read_gauge(cases.GAUGE))
        if effect is not None:
            names = {parameter.name for parameter in effect_kinds()[effect.kind].parameters()}
            assert effect.parameter in names
            assert {"axis", "direction"} & names or not effect.choice


@pytest.mark.parametrize(
    ("case", "hidden_um", "effect_um"),
    [
        ("scale", lambda h: (1.0 / h.scale_gain["x"] - 1.0) * 1e6, lambda value: value),
        ("backlash", lambda h: h.play_mm["y"] * 1e3, lambda value: value),
        ("drift", lambda h: h.drift_mm_s["x"] * 1e3, lambda per_h: per_h / 3600.0),
        ("debounce", lambda h: h.debounce_samples * h.servo_period_ns * 1e-6, lambda ms: ms),
        ("latch", lambda h: h.servo_period_ns * 1e-6 / 2.0, lambda ms: ms + 0.05),
    ],
)
def test_what_is_hidden_is_the_effect_that_the_scorer_expects(case, hidden_um, effect_um):
    """Both are written in the truth file; here one follows from the other."""
    one = truth.read_truth(case)
    assert one.effect is not None
    assert hidden_um(one.hidden) == pytest.approx(effect_um(one.effect.value), rel=1e-6)


def test_a_case_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="there is no case 'nonsense'; expected nothing, scale"):
        truth.read_truth("nonsense")


def test_the_lag_of_every_run_is_another_and_that_of_a_run_always_the_same():
    draws = [conceal.seeded(seed).random() for seed in ("scale/along-x-4-mm-s", "scale/along-y-4-mm-s")]
    assert draws[0] != draws[1]
    assert draws[0] == conceal.seeded("scale/along-x-4-mm-s").random()


def diagnosis(tmp_path: Path, verdict: str, *effects: dict[str, object]) -> Path:
    told = [{"confounded_with": [], "alternatives": [], **effect} for effect in effects]
    path = tmp_path / "diagnosis.json"
    said = {"format": FORMAT, "verdict": verdict, "effects": told, "unexplained": [], "fit": {}, "inputs": {}}
    write_json(path, said)
    return path


def scale(axis: str = "x", ppm: float = 40.0, u: float | None = 0.5, **more: object) -> dict[str, object]:
    parameters = {"axis": {"value": axis}, "ppm": {"value": ppm, "u": u, "unit": "um/m"}}
    return {"kind": "scale_error", "parameters": parameters, **more}


DELAY = {"kind": "trigger_delay", "parameters": {"ms": {"value": 0.1, "u": 0.01, "unit": "ms"}}}


def growth(per: str) -> dict[str, object]:
    """Scatter that grows with a covariate."""
    parameters = {"per": {"value": per}, "rate": {"value": 0.1, "u": None, "unit": "um"}}
    return {"kind": "noise_growth", "parameters": parameters}


def drift(direction: object) -> dict[str, object]:
    """A drift of the size that is hidden."""
    rate = {"value": 1800.0, "u": 20.0, "unit": "um/h"}
    return {"kind": "thermal_drift", "parameters": {"direction": {"value": direction}, "rate_um_per_h": rate}}


WARM = {
    "kind": "scale_temperature",
    "parameters": {"axis": {"value": "x"}, "delta_K": {"value": -3.5, "u": 0.1, "unit": "K"}},
    "confounded_with": ["scale_error"],
}


@pytest.mark.parametrize(
    ("case", "verdict", "effects", "right"),
    [
        ("nothing", "adequate", [], True),
        ("nothing", "effects", [DELAY], False),
        ("nothing", "unknown", [], False),
        ("scale", "effects", [scale()], True),
        ("scale", "effects", [scale(ppm=38.1)], True),
        ("scale", "effects", [scale(ppm=37.9)], False),
        ("scale", "effects", [scale(u=None)], False),
        ("scale", "effects", [scale(axis="y")], False),
        ("scale", "effects", [scale(), DELAY], False),
        ("scale", "effects", [scale(), growth("speed")], True),
        ("scale", "effects", [scale(), growth("position")], False),
        ("scale", "effects", [WARM], True),
        ("scale", "effects", [{**WARM, "confounded_with": []}], False),
        ("scale", "unknown", [scale()], False),
        ("scale", "adequate", [], False),
        ("debounce", "effects", [DELAY], False),
        ("drift", "effects", [drift("x")], True),
        ("drift", "effects", [drift([0.9992, 0.0265, 0.0314])], True),
        ("drift", "effects", [drift([-0.9992, 0.0265, 0.0314])], False),
        ("drift", "effects", [drift([0.99, 0.14, 0.0])], False),
        ("drift", "effects", [drift("y")], False),
        ("drift", "effects", [drift([0.0, 1.0, 0.0])], False),
    ],
)
def test_the_scorer_tells_right_from_wrong(tmp_path: Path, case: str, verdict: str, effects: list, right: bool):
    found = score.score(case, diagnosis(tmp_path, verdict, *effects))
    assert found.right is right
    assert (" yes " if right else " NO ") in score.table([found])[1]


def sealed(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, EXAMPLE / "sealed.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_sealed_file_cannot_be_opened_by_any_name(tmp_path: Path):
    """The truth as the machine file, by its own path and through a link; an unsealed run reads it and complains."""
    link = tmp_path / "machine.toml"
    link.symlink_to(EXAMPLE / "truth.toml")
    recording = tmp_path / "recording.csv"
    recording.write_text("cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k\n1,1,0,0,0,1,0,0\n")
    for path in (EXAMPLE / "truth.toml", link):
        verb = ["diagnose", recording, "-g", "step-gauge-420", "-m", path, "-o", tmp_path / "out"]
        result = sealed(EXAMPLE / "truth.toml", "--", *verb)
        assert (result.returncode, result.stderr) == (3, "error: truth.toml is sealed\n")
    assert sealed("--", *verb).returncode == 2
    assert not (tmp_path / "out").exists()
