"""Certificates: what is read, and what is refused with its place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.files.resources import folder, shipped_names
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import parse_placement
from tests.build import make_gauge

TOML = """
[gauge]
name = "G"
serial = "S"
material = "steel"
expansion_per_K = 11.5e-6
expansion_uncertainty_per_K = 0.5e-6
reference_temperature_C = 20.0
block_width_mm = 20.0
block_height_mm = 15.0
faces = "faces.csv"
[certificate]
number = "1"
laboratory = "L"
date = 2026-03-02
coverage_factor = 2.0
"""
FACES = "face,nominal_mm,position_mm,uncertainty_um\n1,0,0,0.1\n2,10,10.0012,0.2\n3,20,20.0004,0.2\n4,30,29.9991,0.2\n"


def write(folder: Path, toml: str = TOML, faces: str = FACES) -> Path:
    (folder / "faces.csv").write_text(faces)
    (folder / "gauge.toml").write_text(toml)
    return folder / "gauge.toml"


@pytest.mark.parametrize(("name", "blocks", "span"), [("420", 21, 410), ("600", 30, 590), ("1020", 51, 1010)])
def test_the_shipped_gauges_have_their_blocks_and_are_marked_as_examples(name: str, blocks: int, span: float) -> None:
    gauge = read_gauge(f"step-gauge-{name}")
    assert gauge.n_blocks == blocks
    assert gauge.position_mm[-1] == pytest.approx(span, abs=0.02)
    assert gauge.certificate.example
    assert "EXAMPLE" in (folder("calibration_data") / f"step-gauge-{name}.toml").read_text()
    np.testing.assert_allclose(gauge.block_size_mm, 10.0, atol=0.005)


def test_every_shipped_gauge_is_readable() -> None:
    assert {read_gauge(name).n_blocks for name in shipped_names(".")} == {21, 30, 51}


def test_uncertainties_are_divided_by_the_coverage_factor(tmp_path: Path) -> None:
    np.testing.assert_allclose(read_gauge(write(tmp_path)).u_um, [0.05, 0.1, 0.1, 0.1])


def test_a_steel_gauge_one_kelvin_warm_is_longer_by_11_5_um_per_metre(gauge: Gauge) -> None:
    longer = gauge.position_at(21.0) - gauge.position_mm
    np.testing.assert_allclose(longer * 1e3, 11.5 * gauge.position_mm / 1000.0, atol=1e-9)
    assert np.array_equal(gauge.position_at(20.0), gauge.position_mm)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("3,20,20.0004", "2,20,20.0004", ["faces.csv:4", "twice"]),
        ("3,20,20.0004", "4,20,20.0004", ["faces.csv:4", "out of order", "face 4", "face 3"]),
        ("4,30,29.9991,0.2\n", "", ["even number"]),
        ("29.9991", "19.0", ["faces.csv:5", "must rise"]),
        ("29.9991", "30.9", ["faces.csv:5", "disagree", "30.9"]),
        ("1,0,0,0.1", "1,0,0.5,0.1", ["faces.csv:2", "counted from face 1"]),
        ("0.2\n4", "-0.2\n4", ["faces.csv:4", "negative"]),
        ("0.2\n4", "200\n4", ["faces.csv:4", "too large"]),
        ("29.9991", "nan", ["faces.csv:5", "position_mm", "nan"]),
        ("29.9991", "", ["faces.csv:5", "position_mm", "finite number"]),
        ("29.9991", "29,9991", ["faces.csv:5", "decimal comma"]),
        ("position_mm", "posn", ["faces.csv:1", "missing", "position_mm"]),
        ("uncertainty_um", "uncertainty_um,remark", ["unknown", "remark"]),
    ],
)
def test_faces_that_cannot_be_are_refused_with_their_line(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in FACES
    with pytest.raises(InputError) as caught:
        read_gauge(write(tmp_path, faces=FACES.replace(old, new)))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_nominal_positions_rounded_as_the_message_advises_are_read(tmp_path: Path) -> None:
    """Blocks at any distances: rounded to 1 mm, as the message had it, they were refused with the same message."""
    at_mm = (0.0, 20.003, 60.642, 80.651)
    for digits in (0, 1):
        rows = [f"{face},{round(mm, digits)},{mm},0.2" for face, mm in enumerate(at_mm, 1)]
        faces = "face,nominal_mm,position_mm,uncertainty_um\n" + "\n".join(rows)
        if digits == 1:
            assert read_gauge(write(tmp_path, faces=faces)).position_mm == pytest.approx(at_mm)
            continue
        with pytest.raises(InputError, match=r"60.642 for nominal 61; .* rounded to 0\.1 mm"):
            read_gauge(write(tmp_path, faces=faces))


@pytest.mark.parametrize(("factor", "unit"), [(1 / 25.4, "inches"), (1e-3, "m)"), (1e3, "um")])
def test_positions_in_another_unit_are_named(tmp_path: Path, factor: float, unit: str) -> None:
    rows = [line.split(",") for line in FACES.splitlines()]
    for row in rows[1:]:
        row[2] = repr(float(row[2]) * factor)
    with pytest.raises(InputError, match="look like") as caught:
        read_gauge(write(tmp_path, faces="\n".join(",".join(row) for row in rows)))
    assert unit in str(caught.value)


def test_positions_and_nominal_ones_in_um_are_named(tmp_path: Path) -> None:
    rows = [line.split(",") for line in FACES.splitlines()]
    for row in rows[1:]:
        row[1:3] = [repr(float(cell) * 1e3) for cell in row[1:3]]
    with pytest.raises(InputError, match="positions look like um; found nominal_mm 30000"):
        read_gauge(write(tmp_path, faces="\n".join(",".join(row) for row in rows)))


def test_uncertainties_in_mm_are_noticed(tmp_path: Path) -> None:
    faces = FACES.replace(",0.1\n", ",0.0001\n").replace(",0.2\n", ",0.0002\n")
    with pytest.raises(InputError, match="looks like mm"):
        read_gauge(write(tmp_path, faces=faces))


def test_a_block_of_another_size_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="block 2 are not a block apart"):
        read_gauge(write(tmp_path, faces=FACES.replace("4,30,29.9991", "4,30,30.15")))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "G"', 'name = "G"\nnames = 1', ["gauge.names", "not known", "name?"]),
        ('serial = "S"\n', "", ["gauge.serial", "missing", "serial number"]),
        ("= 20.0\nblock_height", "= -1\nblock_height", ["gauge.block_width_mm", "-1", "greater than 0"]),
        ("11.5e-6", "11.5", ["gauge.expansion_per_K", "11.5"]),
        ("11.5e-6", '"11.5e-6"', ["gauge.expansion_per_K", "valid number"]),
        ("11.5e-6", "nan", ["gauge.expansion_per_K", "finite"]),
        ("2026-03-02", "2226-03-02", ["certificate.date", "future"]),
        ("2026-03-02", '"2 March"', ["certificate.date", "2 March"]),
        ("coverage_factor = 2.0", "coverage_factor = 20", ["certificate.coverage_factor", "20"]),
        ("[certificate]", "[certificat]", ["certificat", "not known"]),
        ("faces.csv", "none.csv", ["gauge.toml: key gauge.faces: no such file; found none.csv"]),
        ("[gauge]", "[gauge", ["not valid TOML", "line 2"]),
    ],
)
def test_wrong_keys_are_refused_with_their_name(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in TOML
    with pytest.raises(InputError) as caught:
        read_gauge(write(tmp_path, toml=TOML.replace(old, new)))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_an_unknown_gauge_names_the_shipped_ones() -> None:
    with pytest.raises(InputError, match="step-gauge-1020, step-gauge-420"):
        read_gauge("no-such-gauge")


@pytest.mark.parametrize(("which", "certified", "placed"), [("certificate", 25.4, 1.0), ("placement", 1.0, 25.4)])
def test_what_is_in_inches_is_named(which: str, certified: float, placed: float) -> None:
    """Nominal and certified positions may both be in inches, so that only the placement shows it; or the other way."""
    gauge = make_gauge(2, size=20.0 / certified, gap=100.0 / certified)
    text = f"c1_mm = [0, 0, 0]\nc2_mm = [{120.0 / placed}, 0, 0]\n"
    with pytest.raises(InputError, match=f"the {which} looks like inches, not mm"):
        parse_placement(text + "first_block = 1\nlast_block = 2\n", "x.toml", gauge)


def test_all_keys_that_are_missing_are_named_at_once() -> None:
    with pytest.raises(InputError, match=r"keys c1_mm, c2_mm, last_block are missing$"):
        parse_placement("first_block = 1\n", "x.toml", make_gauge(2))
