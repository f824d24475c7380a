"""The story of the demo: faults that are concealed are found, the seal keeps what it must, and the answer is judged."""

from __future__ import annotations

from pathlib import Path

import pytest

import stepgauge as sg
from stepgauge.demonstration.conceal import SEALED, close_seal, conceal_fault, open_seal
from stepgauge.demonstration.faults import FAULTS, NAMES
from stepgauge.demonstration.reveal import compare_answer, reveal
from tests.conftest import ROOT

TRUTH = {"kind": "reversal_error", "axis": "y", "um": 5.0}
Programs = list[tuple[Path, sg.Placement]]


def member(kind: str, axis: str, share: float, um: float) -> dict:
    numbers = {"axis": {"value": axis}, "um": {"value": um, "u": 0.1, "unit": "um"}}
    return {"kind": kind, "label": f"{kind}_{axis}", "conditional_probability": share, "parameters": numbers}


def diagnosis_of(*sets: list[dict]) -> dict:
    return {"effects": [{**one[0], "probability": 0.99, "set": one} for one in sets]}


def test_an_answer_is_judged_by_kind_and_axis() -> None:
    right, elsewhere = member("reversal_error", "y", 0.7, 5.1), member("reversal_error", "x", 0.2, 5.1)
    found = compare_answer(TRUTH, diagnosis_of([right, elsewhere]))
    assert found.place == 1
    assert found.numbers[0].deviation == pytest.approx(1.0)
    assert "named it first, with probability 0.70, of 2" in found.sentence()
    assert compare_answer(TRUTH, diagnosis_of([elsewhere, right])).place == 2
    missed = compare_answer(TRUTH, diagnosis_of([elsewhere]))
    assert (missed.place, missed.numbers) == (0, ())
    assert "did not name it" in missed.sentence()
    assert "did not name it" in compare_answer(TRUTH, {"effects": []}).sentence()


def test_what_nobody_concealed_is_said() -> None:
    stated = diagnosis_of([member("scale_error", "x", 0.9, 3.0)], [member("reversal_error", "y", 0.9, 5.0)])
    assert compare_answer(TRUTH, stated).others == ("scale error x",)


def test_a_phase_is_compared_on_its_own_turn() -> None:
    truth = {"kind": "wave", "phase_deg": 350.0}
    numbers = {"phase_deg": {"value": -12.0, "u": 1.0, "unit": "deg"}}
    found = compare_answer(
        truth, diagnosis_of([{"kind": "wave", "label": "wave", "conditional_probability": 1, "parameters": numbers}])
    )
    assert found.numbers[0].found == pytest.approx(348.0)


def test_a_seal_is_opened_with_its_checksum_only(tmp_path: Path) -> None:
    path = tmp_path / SEALED
    checksum = close_seal(path, TRUTH, "salt")
    assert open_seal(path, checksum) == TRUTH
    assert checksum != close_seal(tmp_path / "other.txt", TRUTH, "another salt")
    assert "reversal" not in path.read_text()
    with pytest.raises(sg.InputError, match="changed after it was closed"):
        open_seal(path, close_seal(path, {**TRUTH, "um": 6.0}, "salt").replace("0", "1"))
    path.write_text("nothing\n")
    with pytest.raises(sg.InputError, match="changed after it was closed"):
        open_seal(path, checksum)


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Programs:
    """The gauge along y and along x, as in the demo, with two cycles each."""
    folder, demo = tmp_path_factory.mktemp("programs"), ROOT / "examples/demo"
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine(demo / "machine.toml")
    placements = [
        sg.locate(demo / "points.csv", gauge, machine=machine),
        sg.read_placement(demo / "along-x.toml", gauge),
    ]
    for number, one in enumerate(placements):
        sg.plan(one, gauge, machine, cycles=2).write(folder / f"{number}.dmi", dialect="dmis")
    return [(folder / f"{number}.dmi", one) for number, one in enumerate(placements)]


@pytest.mark.parametrize("name", NAMES)
def test_a_concealed_fault_is_named_with_its_size(name: str, programs: Programs, tmp_path: Path) -> None:
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine(ROOT / "examples/demo/machine.toml")
    concealed = conceal_fault(tmp_path, machine, gauge, programs, name, seed=11)
    assert "effect" not in "".join(path.read_text() for path in concealed.recordings)
    sg.diagnose(list(concealed.recordings), gauge, machine).write(tmp_path / "diagnosis")
    revealed = reveal(tmp_path, concealed, tmp_path / "diagnosis")
    assert revealed.fault == FAULTS[NAMES.index(name)].words
    assert revealed.answer.place in (1, 2, 3)
    assert not [one for one in revealed.answer.numbers if abs(one.deviation) > 4.0]
    assert any(one.u > 0.0 for one in revealed.answer.numbers)
    held = revealed.fit["holdout"]["faces" if name == "knock" else "cycles"]  # a cycle before a knock cannot know it
    assert held["rms_after_um"] < 0.6 < held["rms_before_um"]
    page = (tmp_path / "story.html").read_text()
    assert concealed.checksum in page
    assert 'src="http' not in page
    assert 'href="http' not in page


def test_a_seed_conceals_the_same_fault_again_and_none_another(programs: Programs, tmp_path: Path) -> None:
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine(ROOT / "examples/demo/machine.toml")
    sealed = []
    for number, seed in enumerate((3, 3, None, None)):
        sealed.append(conceal_fault(tmp_path / str(number), machine, gauge, programs[1:], seed=seed).checksum)
    assert sealed[0] == sealed[1]
    assert len(set(sealed)) == 3


def test_a_fault_that_nobody_knows_is_refused_with_those_that_are_known(programs: Programs, tmp_path: Path) -> None:
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    with pytest.raises(sg.InputError, match="backlash, scale"):
        conceal_fault(tmp_path, machine, gauge, programs, "gremlin")
