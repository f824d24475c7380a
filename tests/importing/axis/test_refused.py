"""What a table of an axis leaves open is asked for in one line, with the option that settles it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from stepgauge.axis.recording import read_axis_recording
from stepgauge.gauge.certified import read_gauge
from stepgauge.recording import read_recording
from tests.cli.conftest import Run

NUMBERS = "".join(f"{n * 10},{n * 0.1:.2f},{n * 0.2:.2f}\n" for n in range(8))
PAIRS = "".join(f"{n * 10},{n * 0.1:.2f}\n" for n in range(8))
OPEN = [
    ("target,error_um\n" + PAIRS, [], "the unit of the targets is not stated; .*expected --unit mm"),
    ("target_mm,error\n" + PAIRS, [], "the unit of the deviations is not stated; .*expected --deviation-unit um"),
    (
        "target,error\n" + PAIRS,
        [],
        "2 questions are open; expected 1.*the targets is not stated .*--unit mm.* 2.*deviations .*--deviation-unit um",
    ),
    (
        "target_mm;x+1 um;x-1 um\n" + NUMBERS.replace(",", ";"),
        [],
        r"columns are the same cycle and direction; found 'x\+1 um' and 'x-1 um'",
    ),
    (PAIRS, [], 'no row above the numbers names the columns; .*expected --header "target_mm,reading_mm"'),
    (
        "target_mm,error_um\n" + "".join(f"{n * 10},\n" for n in range(8)),
        [],
        "column 'error_um' has no number in any row; found nothing",
    ),
    ("target_mm,sensor A,sensor B\n" + NUMBERS, [], "no column is named as the reading; .*--column reading="),
    ("target_mm,error A um,error B um\n" + NUMBERS, [], "several columns may be the deviation; .*--column deviation="),
    (
        "target_mm,error_um\n" + PAIRS.replace(",0.30", ",bad"),
        [],
        r"t.csv:5: column 'error_um' is not a number; found 'bad'",
    ),
    (
        "target_mm,error_um\n" + PAIRS.replace(",0.30", ","),
        [],
        r"t.csv:5: readings are missing; found 'error_um', rows 5; expected --accept missing",
    ),
    (
        "target_mm,reading\n" + "".join(f"{n * 25.4},{n}\n" for n in range(8)),
        [],
        "neither readings nor deviations .*inches",
    ),
    (
        "target_mm,reading_mm,direction\n" + "".join(f"{n},{n},{'left-ish' if n == 3 else '+'}\n" for n in range(8)),
        [],
        r"t.csv:5: column 'direction' is no direction of travel; found 'left-ish'; .*--column ignore=\"direction\"",
    ),
    ("target_mm;error_um\n" + "0;1,234\n1;2,345\n2;3,456\n", [], "a comma may be a decimal mark or .*--decimal comma"),
    ("target_mm,error_um\n" + PAIRS, ["--targets", "0,11"], "a target is not in the list; found 70"),
    ("target_mm,error_um\n" + PAIRS, ["--targets", "0:70"], "--targets: not understood; .*FIRST:LAST:STEP"),
    ("target_mm,error_um\n" + PAIRS, ["--column", "reading=Nothing"], "there is no column 'Nothing' for reading"),
    ("target_mm,error_um\n" + PAIRS, ["--column", "height=error_um"], "--column: not understood; .*NAME of target"),
    ("angle_deg,error_um\n" + PAIRS, [], "--deviation-unit: not a unit of this axis; found um"),
    (
        "Forward (um);Reverse (um)\n" + PAIRS.replace(",", ";"),
        [],
        "readings of two directions have no targets; expected --targets 0:500:25",
    ),
    (
        "target_mm,error_um\n" + PAIRS,
        ["--unit", "deg"],
        "--unit is another unit than that of the header; found deg; expected mm",
    ),
    (
        "target_mm,error_um\n" + PAIRS,
        ["--deviation-unit", "mm"],
        "--deviation-unit is another unit than that of the header; found mm; expected um",
    ),
    ('{"a": 1}', [], "no records are found"),
    ("nothing\nto see\n", [], "no table of numbers is found"),
]


@pytest.mark.parametrize(("text", "options", "words"), OPEN, ids=[words[:40] for _, _, words in OPEN])
def test_what_is_open_is_asked_for(run: Run, tmp_path: Path, text: str, options: list[str], words: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    result = run("import", tmp_path / "t.csv", "--sensor", "laser", *options, "-o", tmp_path / "axis.csv")
    assert result.code == 2
    assert not (tmp_path / "axis.csv").exists()
    assert len(result.err.strip().splitlines()) == 1
    assert re.search(words, result.err), result.err


def test_short_german_names_of_places_and_directions(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "axis.csv"
    rows = [f"{place};positiv;{place},0001" for place in (0, 50, 100)]
    rows += [f"{place};negativ;{place},0004" for place in (100, 50, 0)]
    path.write_text("\n".join(["Pos [mm];Richtung;Ist [mm]", *rows]))
    said = run("import", path, "--sensor", "laser", "-o", tmp_path / "out.csv")
    assert said.code == 0
    assert "mapped: Pos [mm] -> target, Richtung -> way, Ist [mm] -> reading" in said.err
    assert "6 readings of 3 targets, cycles: 1, direction stated" in said.err


def test_a_table_of_one_axis_without_a_sensor_names_the_option(run: Run, tmp_path: Path) -> None:
    for text in ("target_mm,error_um\n" + PAIRS, "target_mm;error_um;T\n" + NUMBERS.replace(",", ";")):
        (tmp_path / "t.csv").write_text(text)
        result = run("import", tmp_path / "t.csv", "-o", tmp_path / "axis.csv")
        assert result.code == 2
        assert "--sensor" in result.err


def test_constants_stand_for_columns_that_a_table_lacks(run: Run, tmp_path: Path) -> None:
    """Tip centres along x with the other two coordinates given, as a recording of a gauge; a direction for an axis."""
    rows = "".join(f"{100 + 10 * n + (1 if n % 2 else -1)},{n + 1},{-1 if n % 2 else 1}\n" for n in range(8))
    (tmp_path / "t.csv").write_text("x_mm,face,approach_i\n" + rows)
    constants = [f"--set={name}=0" for name in ("y_mm", "z_mm", "approach_j", "approach_k")]
    result = run("import", tmp_path / "t.csv", *constants, "--set", "cycle=1", "-o", tmp_path / "points.csv")
    assert result.code == 0, result.err
    back = read_recording(tmp_path / "points.csv")
    assert (back.position_mm[:, 1:] == 0.0).all()
    assert back.frame["cycle"].tolist() == [1] * 8
    (tmp_path / "t.csv").write_text("target_mm,error_um\n" + PAIRS)
    command = ("import", tmp_path / "t.csv", "--sensor", "dial", "--set", "direction=-", "-o", tmp_path / "axis.csv")
    assert run(*command).code == 0
    assert set(read_axis_recording(tmp_path / "axis.csv").frame["way"]) == {-1}
    assert "expected NAME=VALUE" in run(*command[:4], "--set", "direction", *command[6:]).err


def test_targets_that_a_reference_read_are_told_apart_by_place(run: Run, tmp_path: Path) -> None:
    """A reference instrument reads no place twice the same: there and back three times are six readings of each."""
    targets = np.tile(np.r_[np.arange(0.0, 101.0, 10.0), np.arange(100.0, -1.0, -10.0)], 3)
    reference = targets + np.random.default_rng(0).normal(0.0, 0.005, len(targets))
    rows = "".join(f"{one:.4f},{one * 1.0001:.4f}\n" for one in reference)
    (tmp_path / "t.csv").write_text("Reference (mm),DUT (mm)\n" + rows)
    command = (
        "import",
        tmp_path / "t.csv",
        "--sensor",
        "encoder",
        "-o",
        tmp_path / "axis.csv",
    )
    result = run(*command)
    assert "66 readings of 11 targets, cycles: 3" in result.out + result.err
    way = read_axis_recording(tmp_path / "axis.csv").frame["way"].to_numpy()
    assert way.tolist() == ([1] * 11 + [-1] * 11) * 3


def test_a_gauge_or_a_list_gives_the_targets_their_certified_positions(run: Run, tmp_path: Path) -> None:
    gauge = read_gauge("step-gauge-420")
    rows = "".join(f"{n:g},{c + 1e-3:.6f}\n" for n, c in zip(gauge.nominal_mm, gauge.position_mm, strict=True))
    (tmp_path / "t.csv").write_text("nominal_mm,measured_mm\n" + rows)
    command = ("import", tmp_path / "t.csv", "--sensor", "dial", "-o", tmp_path / "axis.csv")
    assert run(*command, "-g", "step-gauge-420").code == 0
    back = read_axis_recording(tmp_path / "axis.csv")
    np.testing.assert_allclose(back.deviation, 1.0, atol=1e-3)
    np.testing.assert_allclose(back.frame["u_target"], gauge.u_um)
    assert back.comments["artefact"] == gauge.table.name
    listed = "".join(f"{n} {c} {u}\n" for n, c, u in zip(gauge.nominal_mm, gauge.position_mm, gauge.u_um, strict=True))
    (tmp_path / "list.txt").write_text("nominal certified u\n" + listed)
    assert run(*command, "--targets", tmp_path / "list.txt").code == 0
    np.testing.assert_allclose(read_axis_recording(tmp_path / "axis.csv").deviation, 1.0, atol=1e-3)


def test_missing_readings_are_taken_where_that_is_said(run: Run, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("target_mm,run 1 um,run 2 um\n" + NUMBERS.replace(",0.60\n", ",\n"))
    command = ("import", tmp_path / "t.csv", "--sensor", "laser", "-o", tmp_path / "axis.csv")
    assert "--accept missing" in run(*command).err
    assert run(*command, "--accept", "missing").code == 0
    back = read_axis_recording(tmp_path / "axis.csv")
    assert len(back) == 15
    second = back.deviation[back.frame["cycle"] == 2]
    np.testing.assert_allclose(second, [0.0, 0.2, 0.4, 0.8, 1.0, 1.2, 1.4], atol=1e-6)
