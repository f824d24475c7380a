"""Spheres, maps, drift tests, faces of a certificate and recordings that other programs saved, on the one reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from stepgauge.effects.maps import read_map
from stepgauge.errors import InputError
from stepgauge.files.tables import read_numbers
from stepgauge.gauge.certified import read_gauge
from stepgauge.probes.directions_map import read_probe_map
from stepgauge.probes.files import read_points
from stepgauge.recording import Recording, read_recording, write_recording
from stepgauge.standards.drift import read_drift
from tests.importing.made import make_case

CERTIFICATES = {
    "German, Windows-1252": ("Fläche;Nennwert [mm];Istwert [mm];U [µm]\n{rows}", ";", ",", 1.0, "cp1252"),
    "positions in um": (
        "Face\tNominal (mm)\tCertified position (um)\tUncertainty (um)\n{rows}",
        "\t",
        ".",
        1e3,
        "utf-8",
    ),
    "below a preamble": ("Certificate 12\n\nFace,Nominal [mm],Measured [mm],U [um]\n{rows}", ",", ".", 1.0, "utf-8"),
}


def own_faces() -> pd.DataFrame:
    gauge = read_gauge("step-gauge-420")
    face = np.arange(1, gauge.n_faces + 1)
    columns = {"face": face, "nominal": gauge.nominal_mm, "position": gauge.position_mm, "u": 0.3}
    return pd.DataFrame(columns)


def gauge_file(folder: Path, faces: bytes) -> Path:
    (folder / "faces.csv").write_bytes(faces)
    (folder / "gauge.toml").write_text(GAUGE)
    return folder / "gauge.toml"


GAUGE = """[gauge]
name = "foreign"
serial = "1"
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


@pytest.mark.parametrize("name", CERTIFICATES)
def test_faces_of_a_certificate(tmp_path: Path, name: str) -> None:
    text, mark, decimal, factor, encoding = CERTIFICATES[name]
    rows = "\n".join(
        mark.join([f"{r.face:.0f}", *(f"{v:.6f}".replace(".", decimal) for v in (r.nominal, r.position * factor, r.u))])
        for r in own_faces().itertuples()
    )
    gauge = read_gauge(gauge_file(tmp_path, text.format(rows=rows).encode(encoding)))
    np.testing.assert_allclose(gauge.position_mm, own_faces()["position"], atol=1e-9)


@pytest.mark.parametrize(("header", "sign"), [("Deviation (um)", 1.0), ("Soll-Ist [um]", -1.0)])
def test_deviations_of_a_certificate_have_the_sign_of_their_name(tmp_path: Path, header: str, sign: float) -> None:
    faces = own_faces()
    deviation = sign * 1e3 * (faces["position"] - faces["nominal"])
    rows = "\n".join(
        f"{f:.0f};{n:.6f};{d:.6f};0.3" for f, n, d in zip(faces["face"], faces["nominal"], deviation, strict=True)
    )
    text = f"Face;Nominal [mm];{header};U [um]\n{rows}\n"
    gauge = read_gauge(gauge_file(tmp_path, text.encode()))
    np.testing.assert_allclose(gauge.position_mm, faces["position"], atol=1e-8)


def test_a_certificate_without_units_or_with_two_positions_is_refused(tmp_path: Path) -> None:
    for header, words in (("U;Remark", "unit"), ("U [um];Measured [mm]", "two columns")):
        text = f"Face;Nominal [mm];Position [mm];{header}\n1;0;0;0.3;0\n2;20;20;0.3;20.5\n"
        with pytest.raises(InputError, match=words):
            read_gauge(gauge_file(tmp_path, text.encode()))


def test_points_of_a_sphere_in_inches_with_normals(tmp_path: Path) -> None:
    """Normals point out of the sphere, approaches into it."""
    normal = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])
    points = 12.5 * normal
    rows = "\n".join(
        "\t".join(f"{v:.9f}".replace(".", ",") for v in [*p / 25.4, *n]) for p, n in zip(points, normal, strict=True)
    )
    path = tmp_path / "sphere.txt"
    path.write_bytes(f"X [inch]\tY [inch]\tZ [inch]\tNx\tNy\tNz\n{rows}\n".encode("utf-16"))
    found = read_points(path)
    np.testing.assert_allclose(found.position_mm, points, atol=1e-6)
    np.testing.assert_allclose(found.approach, -normal, atol=1e-9)


def test_a_map_of_a_probe_with_semicolons(tmp_path: Path) -> None:
    rows = [f"{p};{a};0,08;1,2;{a / 100 + p / 10:.3f}".replace(".", ",") for p in (90, 60) for a in (0, 120, 240)]
    header = "Polar [°];Azimuth [°];Trigger force N;Deflection [µm];Pretravel [nm]"
    (tmp_path / "map.csv").write_text("\n".join([header.replace("force N", "force_N"), *rows]))
    found = read_probe_map(tmp_path / "map.csv")
    assert found.pretravel_um.shape == (2, 3)
    np.testing.assert_allclose(found.pretravel_um[0, 1], 1e-3 * (1.2 + 9.0))


def test_a_drift_test_in_minutes_and_mm(tmp_path: Path) -> None:
    rows = "\n".join(f"{n};{0.0005 * n:.4f};{20 + 0.1 * n:.1f}".replace(".", ",") for n in range(8))
    (tmp_path / "drift.csv").write_text(f"Zeit [min];X1 [mm];Raum [°C]\n{rows}\n", encoding="cp1252")
    found = read_drift(str(tmp_path / "drift.csv"))
    np.testing.assert_allclose(found.time_s, 60.0 * np.arange(8))
    np.testing.assert_allclose(found.displacement_um["X1"], 0.5 * np.arange(8))


SAVED = {
    "Windows-1252": lambda text: text.encode("cp1252"),
    "UTF-16": lambda text: text.encode("utf-16"),
    "semicolons": lambda text: _marked(text, ";", ".").encode(),
    "semicolons and decimal commas": lambda text: _marked(text, ";", ",").encode("cp1252"),
}


def _marked(text: str, mark: str, decimal: str) -> str:
    """The table with other marks; comments stay."""
    lines = [line if line[:1] == "#" else line.replace(",", mark).replace(".", decimal) for line in text.splitlines()]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", SAVED)
def test_a_recording_that_another_program_saved_is_evaluated(tmp_path: Path, name: str) -> None:
    case = make_case()
    recording = Recording(case.recording.frame, {"operator": "Müller", "gauge_serial": "SG-420-001"}, "")
    write_recording(tmp_path / "own.csv", recording)
    text = (tmp_path / "own.csv").read_text()
    (tmp_path / "saved.csv").write_bytes(SAVED[name](text))
    own, saved = read_recording(tmp_path / "own.csv"), read_recording(tmp_path / "saved.csv")
    pd.testing.assert_frame_equal(own.frame, saved.frame[own.frame.columns], check_exact=False, atol=1e-9)
    assert saved.comments["operator"] == "Müller"


@pytest.mark.parametrize(
    "text", ["Coordinate [mm];Error [mm]\n0;0,001\n10;0,002\n", "coordinate_mm,error_um\n0,1\n10,2\n"]
)
def test_an_error_map_is_read_in_the_unit_of_its_header(tmp_path: Path, text: str) -> None:
    (tmp_path / "map.csv").write_text(text)
    coordinate, error = read_map(str(tmp_path / "map.csv"), "x")
    np.testing.assert_allclose([coordinate, error], [[0.0, 10.0], [1.0, 2.0]])
    with pytest.raises(InputError, match="error"):
        read_map(str(tmp_path / "map.csv"), "rx")  # a length is no rotation


def test_rotations_of_an_error_map_in_arcseconds(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text("Coordinate [mm];Error [arcsec]\n0;1\n10;2\n")
    np.testing.assert_allclose(read_map(str(tmp_path / "map.csv"), "ry")[1], np.radians([1.0, 2.0]) / 3600.0 * 1e6)


def test_a_unit_that_nobody_asked_for_is_refused(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text("Coordinate [mm];Error [mm]\n0;0,001\n10;0,002\n")
    with pytest.raises(InputError, match="not separated by commas"):
        read_numbers(tmp_path / "map.csv", ("coordinate_mm", "error"))


@pytest.mark.parametrize("more", ["Mean;;10,0;0,3\n", "x2;20;20,1;0,3\n", "\nA;B [mm];C [mm];D\n1;2;3;4\n2;3;4;5\n"])
def test_rows_of_numbers_that_are_none_of_the_table_are_told(tmp_path: Path, more: str) -> None:
    """A command that cannot ask refuses what it would leave out; lines of words change no number."""
    rows = "".join(f"{n};{20 * n - 20};{20 * n - 20},0;0,3\n" for n in range(1, 5))
    text = f"Face;Nominal [mm];Position [mm];U [um]\n{rows}"
    with pytest.raises(InputError, match=r"faces.csv:\d+: (a row of numbers is none of the table|column 'Face')"):
        read_gauge(gauge_file(tmp_path, f"{text}{more}".encode()))
    assert read_gauge(gauge_file(tmp_path, f"{text}\nMeasured at 20 deg C\n".encode())).n_faces == 4


def test_a_damaged_file_of_ours_is_still_refused(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text("x_mm,y_mm,z_mm,approach_i,approach_j,approach_k\n1,2,3,0,0\n")
    with pytest.raises(InputError, match="cut short"):
        read_points(tmp_path / "map.csv")
