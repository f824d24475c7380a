"""``stepgauge probe compensate``: surface points come out where they are."""

import csv
import json

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.files.text import write_json
from stepgauge.physics import directions
from stepgauge.physics.sphere import fit_sphere
from tests.cli.conftest import invoke

from .probe_files import HEADER, SPHERE_MM, sphere_points


def run(*arguments):
    return invoke("probe compensate", *arguments)


@pytest.fixture
def qualification(tmp_path):
    points = sphere_points(tmp_path / "sphere.csv", directions.five_points(0.1))
    out = tmp_path / "q.json"
    options = [points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "--lobe-azimuth", 20, "-o", out]
    assert invoke("probe qualify", *options).exit_code == 0
    return out


def columns(path, *names):
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return np.array([[float(row[name]) for name in names] for row in rows])


def test_five_points_compensate_another_sphere(tmp_path, qualification):
    """Qualified with five points on one sphere, 400 directions on another one come out round."""
    points = sphere_points(tmp_path / "other.csv", directions.nine_degree_points(1), diameter_mm=30.0)
    out = tmp_path / "c.csv"
    result = run(points, "-q", qualification, "-o", out, "--on-sphere", "--plot", tmp_path / "c.png")
    assert result.exit_code == 0, result.output
    fit = fit_sphere(columns(out, "surface_x_mm", "surface_y_mm", "surface_z_mm"))
    assert 2 * fit.radius_mm == pytest.approx(30.0, abs=2e-5)
    assert fit.form_error_um < 0.02
    assert "lobed model" in result.output
    assert (tmp_path / "c.png").stat().st_size > 10_000


def test_a_compensation_that_makes_it_worse_is_a_warning(tmp_path):
    points, out = sphere_points(tmp_path / "sphere.csv", directions.iso_10360_5_points()), tmp_path / "q.json"
    options = [points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "--lobe-azimuth", 80, "-o", out]
    assert invoke("probe qualify", *options).exit_code == 0
    worse = run(points, "-q", out, "-o", tmp_path / "c.csv", "--on-sphere").output
    assert "warning: by the qualification, compensation of the lobes increases" in worse
    assert "warning: on these points the form error is" in worse
    assert "use --method mean" in worse
    assert "warning: by" not in run(points, "-q", out, "--method", "mean", "-o", tmp_path / "c.csv").output


def test_mean_method_takes_the_same_everywhere(tmp_path, qualification):
    points, out = sphere_points(tmp_path / "p.csv", directions.five_points()), tmp_path / "c.csv"
    run(points, "-q", qualification, "--method", "mean", "-o", out)
    taken_off = columns(out, "pretravel_um")
    r_eff = json.loads(qualification.read_text())["r_eff_mm"]
    np.testing.assert_allclose(taken_off, 1e3 * (2.0 - r_eff))


def test_other_columns_are_kept(tmp_path, qualification):
    path, out = tmp_path / "part.csv", tmp_path / "c.csv"
    path.write_text("# a part\nname," + HEADER + ",remark\nface 1,10,0,0,-1,0,0,left\n")
    assert run(path, "-q", qualification, "-o", out, "--plot", tmp_path / "c.svg").exit_code == 0
    with out.open() as file:
        (row,) = csv.DictReader(file)
    assert (row["name"], row["remark"]) == ("face 1", "left")
    # The tip radius further along the approach, and back by the pre-travel.
    assert float(row["surface_x_mm"]) == pytest.approx(10.0 - 2.0 + 1e-3 * float(row["pretravel_um"]))


@pytest.mark.parametrize(
    ("edit", "part"),
    [
        (lambda data: data.pop("r_eff_mm"), "r_eff_mm is missing"),
        (lambda data: data.update(typo=1), "typo is not known"),
        (lambda data: data.update(lobes=None), "it has no lobes"),
        (lambda data: data.update(tip_diameter_mm=None, lobes=None), "no lobes"),
        (lambda data: data.update(r_eff_mm="two"), "r_eff_mm is wrong"),
    ],
)
def test_wrong_qualifications_are_named(tmp_path, qualification, edit, part):
    data = json.loads(qualification.read_text())
    edit(data)
    write_json(qualification, data)
    result = run(
        sphere_points(tmp_path / "p.csv", directions.five_points()), "-q", qualification, "-o", tmp_path / "c.csv"
    )
    assert isinstance(result.exception, InputError)
    assert part in str(result.exception)
    assert not (tmp_path / "c.csv").exists()


def test_text_that_is_no_json_is_named(tmp_path, qualification):
    qualification.write_text("r_eff = 2")
    result = run(
        sphere_points(tmp_path / "p.csv", directions.five_points()), "-q", qualification, "-o", tmp_path / "c.csv"
    )
    assert "q.json:1: not valid JSON" in str(result.exception)


def test_compensating_twice_is_refused(tmp_path, qualification):
    points, out = sphere_points(tmp_path / "p.csv", directions.five_points()), tmp_path / "c.csv"
    run(points, "-q", qualification, "-o", out)
    result = run(out, "-q", qualification, "-o", tmp_path / "twice.csv")
    assert "there already" in str(result.exception)
