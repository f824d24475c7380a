"""A certificate is made with the files of its budget: the same name or serial number does not make the same file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.evaluation.files import evaluation_to_dict, write_evaluation
from stepgauge.files.resources import folder
from stepgauge.gauge.placement import write_placement
from stepgauge.reports.sources import read_sources
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.standards.budget_given import check_given, stated_machine
from stepgauge.verbs.report import report
from tests.dcc.made import SAID
from tests.dcc.test_machine_certificate import call
from tests.measured import lay, named, one_placement, run, shipped

U_K = "temperature_C = { value = 20.0, u = 0.15 }"


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A gauge, a machine and a placement as files, with the evaluation and the budget made with them."""
    data = folder("calibration_data")
    for name in ("step-gauge-420.toml", "step-gauge-420.csv"):
        (tmp_path / name).write_text((data / name).read_text(encoding="utf-8"), encoding="utf-8")
    text = (data / "machines" / "bridge-cmm.toml").read_text(encoding="utf-8")
    (tmp_path / "m.toml").write_text(text.replace("temperature_C = 20.0 ", U_K), encoding="utf-8")
    write_placement(tmp_path / "p.toml", replace(lay(shipped()[0]), details={"uncertainty": {"yaw_urad": 3.0}}))
    write_evaluation(tmp_path / "res", one_placement())
    given = tmp_path / "step-gauge-420.toml", tmp_path / "m.toml"
    made = sg.budget(named(run().recording), *given, placements=tmp_path / "p.toml", runs=0)
    made.write(tmp_path / "res")
    return tmp_path


def other(files: Path, name: str, was: str, now: str) -> Path:
    """Another file of the same name and serial number, in which one thing is not the same."""
    text = (files / name).read_text(encoding="utf-8")
    assert was in text
    (files / "other").mkdir(exist_ok=True)
    kept = [line for line in text.splitlines(keepends=True) if not line.startswith("# checksum")]  # a change is meant
    (files / "other" / name).write_text("".join(kept).replace(was, now, 1), encoding="utf-8")
    return files / "other" / name


def issue(files: Path, **changed: Any) -> Path:
    given: dict[str, Any] = {
        "gauge": files / "step-gauge-420.toml",
        "machine": files / "m.toml",
        "placements": files / "p.toml",
    }
    given |= {"budget": files / "res", "certificate": SAID}
    (files / "c.pdf").unlink(missing_ok=True)
    report(files / "res", files / "c.pdf", **{**given, **changed})
    return files / "c.pdf"


@pytest.mark.parametrize(
    ("kind", "name", "was", "now", "said"),
    [
        ("machine", "m.toml", "u = 0.15", "u = 1.5", r"key machine\.temperature_C\.u; found 1.5; expected 0.15"),
        ("placements", "p.toml", "yaw_urad = 3.0", "yaw_urad = 3000.0", r"yaw_urad; found 3000; expected 3"),
        ("gauge", "step-gauge-420.toml", "coverage_factor = 2", "coverage_factor = 3", r"found 3.*expected 2"),
        ("gauge", "step-gauge-420.toml", "block_width_mm = ", "block_width_mm = 1", r"key gauge\.block_width_mm"),
    ],
)
def test_another_file_of_the_same_name_is_refused(
    files: Path, kind: str, name: str, was: str, now: str, said: str
) -> None:
    changed = other(files, name, was, now)
    (files / "other" / "step-gauge-420.csv").write_text((files / "step-gauge-420.csv").read_text())
    with pytest.raises(InputError, match=said) as refused:
        issue(files, **{kind: changed})
    assert str(changed) in str(refused.value)
    assert not (files / "c.pdf").exists()


def test_certified_uncertainties_are_those_of_the_evaluation(files: Path) -> None:
    """Without a budget, too, for the report prints them."""
    table = (files / "step-gauge-420.csv").read_text(encoding="utf-8").rstrip().split("\n")
    other(files, "step-gauge-420.toml", "coverage", "coverage")
    last = table[-1].rpartition(",")[0] + ",9.21"
    (files / "other" / "step-gauge-420.csv").write_text("\n".join([*table[:-1], last]) + "\n", encoding="utf-8")
    evaluation = evaluation_to_dict(one_placement())
    faces = evaluation["placements"][0]["faces"]
    faces[-1]["u_certificate_um"] *= 2.0
    with pytest.raises(InputError, match=f"standard uncertainty of face {faces[-1]['face']}"):
        read_sources(evaluation, files / "step-gauge-420.toml")
    with pytest.raises(InputError, match=r"not the file of the budget .*: key u_um\[\d+\]"):
        issue(files, gauge=files / "other" / "step-gauge-420.toml")


def test_the_same_content_is_the_same_file(files: Path) -> None:
    """Comments, the order of keys, another place and objects do not count."""
    machine = other(files, "m.toml", "[machine]\n", "# checked, A. M.\n[machine]   # ours\n")
    placement = sg.read_placement(other(files, "p.toml", "# Placement", "# The placement"), shipped()[0])
    assert issue(files, machine=machine, placements=placement).exists()
    assert issue(files, machine=sg.read_machine(machine), gauge="step-gauge-420").exists()


def test_a_shipped_machine_by_its_name_and_a_placement_as_it_was_located(files: Path) -> None:
    """A placement that is written and read back is the same one, though its numbers are rounded."""
    made = sg.budget(named(run().recording), shipped()[0], "bridge-cmm", placements=files / "p.toml", runs=0)
    issue(files, budget=made, gauge="step-gauge-420", machine="bridge-cmm")
    placement = lay(shipped()[0], (-0.0012345678912, 1.0, 0.0123456789))
    write_placement(files / "turned.toml", placement)
    turned = sg.budget(named(run().recording), shipped()[0], "bridge-cmm", placements=placement, runs=0)
    check_given(turned.given, "b", placements=[(sg.read_placement(files / "turned.toml", shipped()[0]), "turned.toml")])


def test_a_table_beside_the_machine_file_counts_by_its_content(tmp_path: Path) -> None:
    text = (folder("calibration_data") / "machines" / "bridge-cmm.toml").read_text(encoding="utf-8")
    effect = '\n[[effect]]\nkind = "error_map"\naxis = "x"\ncomponent = "positioning"\nfile = "map.csv"\n'
    found = []
    for number in (1, 2, 2):
        place = tmp_path / str(len(found))
        place.mkdir()
        (place / "map.csv").write_text(f"coordinate_mm,error\n0,0\n100,{number}\n")
        (place / "m.toml").write_text(text + effect, encoding="utf-8")
        found.append(stated_machine(sg.read_machine(place / "m.toml"))["effect"])
    assert found[0] != found[1] == found[2]


def test_the_certificate_for_machines_to_read(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed = other(files, "m.toml", "u = 0.15", "u = 1.5")
    common = ("dcc", "write", files / "res", "-g", files / "step-gauge-420.toml", "-c", SAID, "-o", files / "c.xml")
    code, said = call(capsys, *common, "-m", changed)
    assert (code, "key machine.temperature_C.u; found 1.5; expected 0.15" in said) == (2, True), said
    assert call(capsys, *common, "-m", files / "m.toml")[0] == 0


def test_a_budget_that_does_not_tell_is_made_again(files: Path) -> None:
    made = StoredBudget.model_validate({**sg.read_budget(files / "res").model_dump(), "given": None})
    with pytest.raises(InputError, match="earlier version wrote it; expected the budget made again"):
        issue(files, budget=made)
