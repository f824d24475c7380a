"""What nobody stated is no finding: pre-travel and repeatability that a machine file leaves out."""

from __future__ import annotations

import re

import pytest

import stepgauge as sg
from stepgauge.diagnosis.output.files import diagnosis_to_dict
from stepgauge.diagnosis.wording.limits import machine_doubts
from tests.conftest import ROOT

BRIDGE = (ROOT / "calibration_data/machines/bridge-cmm.toml").read_text()


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> dict[str, sg.Machine]:
    """The shipped machine as it is, as its probe triggers late and scatters, and without either stated."""
    folder = tmp_path_factory.mktemp("machines")
    texts = {
        "stated": BRIDGE,
        "true": BRIDGE.replace("pretravel_um = 3.0", "pretravel_um = 7.5").replace("y_um = 0.3", "y_um = 1.5"),
        "unstated": re.sub(r"(?m)^(pretravel_um|repeatability_um).*\n", "", BRIDGE),
    }
    for name, text in texts.items():
        (folder / f"{name}.toml").write_text(text)
    return {name: sg.read_machine(folder / f"{name}.toml") for name in texts}


@pytest.fixture(scope="module")
def recording(machines: dict[str, sg.Machine]) -> sg.Recording:
    gauge = sg.read_gauge("step-gauge-420")
    placement = sg.read_placement(ROOT / "examples/demo/along-x.toml", gauge)
    plan = sg.plan(placement, gauge, machines["true"], cycles=3, blocks="1:12")
    return sg.simulate(plan, machines["true"], gauge, placement, seed=3, gauge_temperature_C=20.0).recording


def test_a_pre_travel_that_is_stated_wrongly_is_a_finding_and_one_that_is_not_stated_a_value(
    recording: sg.Recording, machines: dict[str, sg.Machine]
) -> None:
    told = sg.diagnose(recording, "step-gauge-420", machines["stated"])
    assert [one.kind for one in told.findings][:2] == ["repeatability", "effective_radius"]
    found = sg.diagnose(recording, "step-gauge-420", machines["unstated"])
    assert found.findings == ()
    [remark] = [one for one in found.remarks if one["say"] == "pretravel"]
    off_um, u_um = abs(remark["um"]["value"] - 7.5), remark["u"]["value"]
    assert off_um < 3.0 * u_um
    assert 0.02 < u_um < 0.5
    assert re.search(
        r"pre-travel: 7\.\d+ ± 0\.\d+ um \(k = 2\) fits .* pretravel_um in \[probe\]",
        " ".join(machine_doubts(diagnosis_to_dict(found))),
    )


def test_a_backlash_of_open_size_leaves_the_pre_travel_open_and_says_what_helps() -> None:
    said = {"inputs": {"machine": {"tip_radius_mm": 1.0, "kind": "machine tool"}}, "effects": [], "verdict": "unknown"}
    [words] = machine_doubts({**said, "measured": {"pretravel_um": 90.2, "pretravel_u_um": None}})
    assert "do not tell it from a backlash: a placement along a diagonal, or pretravel_um stated in [probe]" in words
    assert "90" not in words


def test_the_virtual_machine_takes_what_is_usual(machines: dict[str, sg.Machine]) -> None:
    gauge = sg.read_gauge("step-gauge-420")
    placement = sg.read_placement(ROOT / "examples/demo/along-x.toml", gauge)
    program = sg.plan(placement, gauge, machines["stated"], cycles=2, blocks="1:3")
    one, other = (
        sg.simulate(program, machines[name], gauge, placement, seed=3).recording.frame
        for name in ("stated", "unstated")
    )
    assert one.equals(other)
    assert machines["unstated"].table.repeatability_um == 0.0
