"""``stepgauge probe qualify``: what it finds in points of known truth, and what it says about wrong ones."""

import json

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.physics import directions
from tests.cli.conftest import invoke

from .probe_files import HEADER, SPHERE_MM, sphere_points


def run(*arguments):
    return invoke("probe qualify", *arguments)


def complaint(*arguments):
    result = run(*arguments)
    assert isinstance(result.exception, InputError), result.output
    return str(result.exception)


@pytest.fixture
def points(tmp_path):
    return sphere_points(tmp_path / "sphere.csv", directions.iso_10360_5_points())


def test_effective_radius_and_lobes(points, tmp_path):
    out = tmp_path / "q.json"
    result = run(points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "--lobe-azimuth", 20, "-o", out)
    assert result.exit_code == 0, result.output
    found = json.loads(out.read_text())
    assert found["lobes"]["constant_um"] == pytest.approx(5.0, abs=1e-4)
    assert found["form_error_compensated_um"] == pytest.approx(0.0, abs=1e-3)
    assert found["form_error_um"] > 3.0
    assert isinstance(found["u_r_eff_mm"], float)
    assert found["points"] == 25
    assert "A = 5.00 um" in result.output


def test_a_model_of_the_lobes_that_does_not_fit_is_a_warning(points, tmp_path):
    """The lobes lie at 20 deg; at 80 deg the model is their opposite, and the compensation makes the form worse."""
    common = (points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "-o", tmp_path / "q.json")
    wrong, right = run(*common, "--lobe-azimuth", 80), run(*common, "--lobe-azimuth", 20)
    assert wrong.exit_code == right.exit_code == 0
    assert "warning: compensation of the lobes increases the form error from" in wrong.output
    assert "warning" not in right.output


def test_lobe_azimuth_is_found(points, tmp_path):
    out = tmp_path / "q.json"
    run(points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "-o", out)
    lobes = json.loads(out.read_text())["lobes"]
    assert abs(lobes["lobe_azimuth_deg"] - 20.0) < 3.0 * lobes["u_lobe_azimuth_deg"] < 1.0
    assert lobes["lobe_azimuth_fitted"] is True


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_claimed_of_a_form_error_and_the_form_never_gets_worse(tmp_path, seed):
    rng, out = np.random.default_rng(seed), tmp_path / "q.json"
    pattern = directions.iso_10360_5_points()
    radius = SPHERE_MM / 2.0 + 2.0 - 1e-3 * (3.0 + rng.normal(0.0, 1.0, len(pattern)))
    table = np.column_stack([pattern * radius[:, None], -pattern])
    np.savetxt(tmp_path / "s.csv", table, delimiter=",", header=HEADER, comments="", fmt="%.9f")
    result = run(tmp_path / "s.csv", "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "-o", out)
    found = json.loads(out.read_text())
    assert (found["lobes"], found["form_error_compensated_um"]) == (None, None)
    assert "lobes              not determined: the readings do not show them" in result.output
    done = invoke("probe compensate", tmp_path / "s.csv", "-q", out, "-o", tmp_path / "c.csv")
    assert "expected --method mean" in done.exception.args[0]
    mean = invoke("probe compensate", tmp_path / "s.csv", "-q", out, "-o", tmp_path / "c.csv", "--method", "mean")
    assert mean.exit_code == 0, mean.output


def test_a_horizontal_probe_is_qualified_about_its_own_axis(tmp_path):
    points = sphere_points(tmp_path / "s.csv", directions.iso_10360_5_points(), axis=(1.0, 0.0, 0.0))
    out = tmp_path / "q.json"
    run(points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "--lobe-azimuth", 20,
        "--stylus-axis", "1,0,0", "-o", out)  # fmt: skip
    assert json.loads(out.read_text())["lobes"]["constant_um"] == pytest.approx(5.0, abs=1e-4)


def test_without_the_tip_there_is_a_radius_but_no_lobes(points, tmp_path):
    out = tmp_path / "q.json"
    result = run(points, "--sphere-diameter", SPHERE_MM, "-o", out)
    found = json.loads(out.read_text())
    assert found["lobes"] is None
    assert found["r_eff_mm"] == pytest.approx(2.0, abs=0.01)
    assert "not known without the diameter of the tip" in result.output


def test_uncertainty_of_the_sphere_goes_into_the_radius(points, tmp_path):
    u = {}
    for stated in (0.0, 1.0):
        out = tmp_path / "q.json"
        run(points, "--sphere-diameter", SPHERE_MM, "--u-sphere-diameter", stated, "--noise", 0.3, "-o", out)
        u[stated] = json.loads(out.read_text())["u_r_eff_mm"]
    assert u[1.0] == pytest.approx(np.hypot(u[0.0], 0.5e-3))


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_figure_is_written(points, tmp_path, suffix):
    figure = tmp_path / f"q{suffix}"
    result = run(
        points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "-o", tmp_path / "q.json", "--plot", figure
    )
    assert result.exit_code == 0, result.output
    assert figure.stat().st_size > 2000


class TestWrongInput:
    def test_normals_in_place_of_approaches(self, points, tmp_path):
        data = np.loadtxt(points, delimiter=",", skiprows=1)
        data[7, 3:] *= -1.0
        np.savetxt(points, data, delimiter=",", header=HEADER, comments="", fmt="%.9f")
        message = complaint(points, "--sphere-diameter", SPHERE_MM, "-o", tmp_path / "q.json")
        assert "sphere.csv:9" in message
        assert "180 deg off" in message
        assert not (tmp_path / "q.json").exists()

    @pytest.mark.parametrize(
        ("text", "parts"),
        [
            ("", ["the table is empty"]),
            (HEADER, ["header but no rows"]),
            ("x_mm,y_mm,z_mm\n1,2,3", ["column approach_i is missing"]),
            (HEADER + "\n1,2,3,0,0", ["sphere.csv:2", "another number of cells"]),
            (HEADER + "\n1,2,3,0,0,1\n1,2,nan,0,0,1", ["sphere.csv:3", "z_mm", "finite number"]),
            (HEADER + "\n1,2,3,0,0,1\n1,2,3,0,0,2", ["sphere.csv:3", "not a unit vector", "length 2"]),
            (HEADER + "\n1,2,3,0,0,1\n2,2,3,0,0,1", ["at least 4 points"]),
        ],
    )
    def test_tables(self, tmp_path, text, parts):
        path = tmp_path / "sphere.csv"
        path.write_text(text)
        message = complaint(path, "--sphere-diameter", SPHERE_MM, "-o", tmp_path / "q.json")
        for part in parts:
            assert part in message

    @pytest.mark.parametrize(
        ("options", "part"),
        [
            (["--sphere-diameter", -25], "--sphere-diameter"),
            (["--sphere-diameter", 25, "--tip-diameter", 0], "--tip-diameter"),
            (["--sphere-diameter", 25, "--noise", -1], "--noise"),
            (["--sphere-diameter", 25, "--stylus-axis", "0,0,0", "--tip-diameter", 4], "stylus"),
            (["--sphere-diameter", 25, "--stylus-axis", "nan,0,0", "--tip-diameter", 4], "stylus"),
            (["--sphere-diameter", 25, "--u-tip-diameter", -1], "--u-tip-diameter"),
            (["--sphere-diameter", 25, "--lobe-azimuth", "left", "--tip-diameter", 4], "--lobe-azimuth"),
        ],
    )
    def test_options(self, points, tmp_path, options, part):
        result = run(points, *options, "-o", tmp_path / "q.json")
        assert result.exit_code != 0
        assert part in result.output + str(result.exception)
        assert not (tmp_path / "q.json").exists()

    def test_five_points_cannot_find_the_lobe(self, tmp_path):
        points = sphere_points(tmp_path / "five.csv", directions.five_points())
        result = run(points, "--sphere-diameter", SPHERE_MM, "--tip-diameter", 4, "-o", tmp_path / "q.json")
        assert "not determined: their azimuth needs 12 points, or is to be stated" in result.output

    def test_a_missing_file(self, tmp_path):
        assert "no such file" in complaint(tmp_path / "none.csv", "--sphere-diameter", 25, "-o", tmp_path / "q.json")
