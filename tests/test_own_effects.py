"""Effects of a file that somebody names: simulated, found and named; refused with what they lack; never found alone."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from stepgauge.cli import main
from stepgauge.diagnosis.engine import diagnose
from stepgauge.effects import added_effects, effect_kinds, make_effects
from stepgauge.errors import InputError
from stepgauge.executors.processes import Processes
from tests.diagnosis.made import ALONG_X, as_file, gauge, machine, record

HEAD = '''
from __future__ import annotations
from typing import ClassVar
import numpy as np
from stepgauge.effects.base import Axis, Displacement, Effect, parameter
from stepgauge.effects.probings import Probings

class {name}(Effect):
    """{title}: d = f(x)."""

    kind: ClassVar[str] = "{kind}"
    equation: ClassVar[str] = "d = f(x)"
    source: ClassVar[str] = "definition"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
'''
CUBIC = (
    HEAD.format(name="Cubic", title="The error of a scale is cubic", kind="cubic")
    + """
    amplitude_um: float = parameter(unit="um", meaning="amplitude", ge=-1e3, le=1e3, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        return {self.axis: self.amplitude_um * (probings.axis_mm(self.axis) / 100.0 - 5.0) ** 3}
"""
)
BELT = (
    HEAD.format(name="BeltSlip", title="A belt creeps and jumps tooth by tooth", kind="belt_slip")
    + """
    period_mm: float = parameter(unit="mm", role="nonlinear", meaning="pitch", gt=0, le=1e4, sensible=(1, 200))
    phase_deg: float = parameter(
        0.0, unit="deg", role="nonlinear", meaning="phase at coordinate 0", ge=-360, le=360, sensible=(-180, 180)
    )
    amplitude_um: float = parameter(unit="um", meaning="height of the jump", ge=-1e3, le=1e3, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        turns = probings.axis_mm(self.axis) / self.period_mm + self.phase_deg / 360.0
        return {self.axis: self.amplitude_um * (turns - np.floor(turns) - 0.5)}
"""
)
LUMP = (
    HEAD.format(name="Lump", title="A guideway has a lump", kind="lump")
    + """
    where: float = parameter(unit="mm", role="nonlinear", meaning="its place", ge=-1e4, le=1e4, sensible=(0, 1000))
    far: float = parameter(unit="mm", role="nonlinear", meaning="its length", gt=0, le=1e4, sensible=(10, 300))
    much: float = parameter(unit="um", meaning="its height", ge=-1e3, le=1e3, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        return {self.axis: self.much / np.cosh((probings.axis_mm(self.axis) - self.where) / self.far) ** 2}
"""
)
WAVE = (
    HEAD.format(name="Rack", title="A rack has a pitch error", kind="rack")
    + """
    tooth: float = parameter(unit="mm", role="nonlinear", meaning="its pitch", gt=0, le=1e4, sensible=(20, 300))
    size: float = parameter(unit="um", meaning="its size", ge=0, le=1e3, sensible=(0, 20))
    begins: float = parameter(0.0, unit="1", role="phase", meaning="its phase", ge=-1, le=1, turn=1.0, sensible=(0, 1))

    def displacement_um(self, probings: Probings) -> Displacement:
        return {self.axis: self.size * np.cos(2 * np.pi * (probings.axis_mm(self.axis) / self.tooth + self.begins))}
"""
)
OTHER_WAVES = ("periodic_scale_error",)
CASES: list[tuple[str, dict[str, Any], tuple[str, ...]]] = [
    (CUBIC, {"kind": "cubic", "axis": "x", "amplitude_um": -0.08}, ()),
    (BELT, {"kind": "belt_slip", "axis": "x", "period_mm": 61.0, "phase_deg": 33.0, "amplitude_um": 5.0}, ()),
    (LUMP, {"kind": "lump", "axis": "x", "where": 320.0, "far": 30.0, "much": -4.0}, ("local_scale_defect",)),
    (WAVE, {"kind": "rack", "axis": "x", "tooth": 83.0, "size": 3.0, "begins": 0.3}, OTHER_WAVES),
]


def own(tmp_path: Path, text: str, name: str = "mine.py") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("text", "table", "without"), CASES, ids=[table["kind"] for _, table, _ in CASES])
def test_an_effect_of_ones_own_is_found_and_named_with_its_values(
    text: str, table: dict[str, Any], without: tuple[str, ...], tmp_path: Path
) -> None:
    """``without``: effects of the vocabulary that say nearly the same."""
    with added_effects([own(tmp_path, text)]):
        recording = record(machine([table]), axes=[ALONG_X], cycles=4)
        found = diagnose(recording, gauge(), machine(), without, separations=False)
        assert [one.kind for one in found.findings] == [table["kind"]], found.unexplained
        finding = found.findings[0]
        assert finding.probability > 0.9
        linear = next(p.name for p in effect_kinds()[table["kind"]].parameters() if p.role == "linear")
        assert finding.parameters[linear].value == pytest.approx(table[linear], rel=0.15)
    assert table["kind"] not in effect_kinds(every=True)


def test_the_command_takes_the_file_and_every_page_has_a_sentence(tmp_path: Path) -> None:
    path = own(tmp_path, CUBIC)
    with added_effects([path]):
        recording = as_file(tmp_path, record(machine([CASES[0][1]]), axes=[ALONG_X], cycles=4))
        out = tmp_path / "out"
        main(
            [
                "diagnose",
                str(recording),
                "-g",
                "step-gauge-420",
                "-m",
                "bridge-cmm",
                "--effects",
                str(path),
                "-o",
                str(out),
            ]
        )
        said = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
        assert [one["kind"] for one in said["effects"]] == ["cubic"]
        assert "The error of a scale is cubic" in (out / "diagnosis.md").read_text(encoding="utf-8")
        assert 'kind = "cubic"' in (out / "machine.diagnosed.toml").read_text(encoding="utf-8")


def test_other_processes_know_the_effect_too(tmp_path: Path) -> None:
    workers = Processes(1)
    with added_effects([own(tmp_path, CUBIC)]):
        workers.open(partial(make_effects, where="machine.toml"))
        try:
            workers.submit(0, [CASES[0][1]])
            _, reply = workers.reply()
        finally:
            workers.close()
        assert [one.label for one in reply.value] == ["cubic_x"]


def test_a_file_that_is_not_named_is_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own(tmp_path, "raise SystemExit('imported')", "effects.py")
    own(tmp_path, "raise SystemExit('imported')", "effect_mine.py")
    monkeypatch.chdir(tmp_path)
    main(["list", "effects", "scale_error"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "no effect in this file"),
        ("def f(:", r"fails in line 1"),
        ("import no_such_module_here", r"fails in line 1.*ModuleNotFoundError"),
        (CUBIC.replace('"cubic"', '"scale_error"'), "exists already"),
        (CUBIC.replace('source: ClassVar[str] = "definition"', 'source: ClassVar[str] = ""'), "has no source"),
        (CUBIC.replace(", sensible=(-20, 20)", "").replace('unit="um",', 'unit="um", role="nonlinear",'), "sensible="),
        (CUBIC.replace('unit="um",', 'unit="um", role="amplitude",'), "role"),
        (CUBIC.replace("(-20, 20)", "(20, -20)"), "sensible"),
        (CUBIC[: CUBIC.index("    def displacement_um")], "displacement_um"),
        (CUBIC.replace("probings.axis_mm(self.axis)", "probings.axis_cm()"), r"fails on a trial in line 20"),
        (CUBIC.replace("{self.axis:", "{'w':"), "x, y, z or approach"),
        (
            WAVE.replace('unit="um", meaning', 'unit="um", role="nonlinear", meaning'),
            "phase needs one linear amplitude",
        ),
    ],
)
def test_a_file_that_lacks_something_is_refused_with_what_to_add(text: str, words: str, tmp_path: Path) -> None:
    before = set(effect_kinds(every=True))
    with pytest.raises(InputError, match=words), added_effects([own(tmp_path, text)]):
        pass
    assert set(effect_kinds(every=True)) == before


def test_no_such_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"), added_effects([tmp_path / "none.py"]):
        pass
