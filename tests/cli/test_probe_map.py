"""``stepgauge probe map``: the table it writes, its angles, its figures, and its complaints."""

import csv

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.probes import read_probe
from stepgauge.probes.angles import parse_angles
from stepgauge.probes.directions_map import COLUMNS, map_directions
from tests.cli.conftest import invoke


def run(*arguments):
    return invoke("probe map", *arguments)


def read(path):
    with path.open() as file:
        rows = list(csv.DictReader(line for line in file if line[0] != "#"))
    return rows, {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def complaint(*arguments):
    result = run(*arguments)
    assert isinstance(result.exception, InputError), result.output
    return str(result.exception)


def test_table_of_the_issue(tmp_path):
    """The example call of the issue: exact columns, 2 x 36 rows, the physics' numbers."""
    out = tmp_path / "map.csv"
    result = run("omp40-2-50mm", "--polar", "90,80", "--azimuth", "0:360:10", "-o", out)
    assert result.exit_code == 0, result.output
    assert out.read_text().splitlines()[1] == "polar_deg,azimuth_deg,trigger_force_N,deflection_um,pretravel_um"
    rows, columns = read(out)
    assert len(rows) == 72
    np.testing.assert_array_equal(columns["polar_deg"], [90] * 36 + [80] * 36)
    np.testing.assert_array_equal(columns["azimuth_deg"][:36], np.arange(0, 360, 10))
    found = map_directions(read_probe("omp40-2-50mm"), [90, 80], np.arange(0, 360, 10))
    for name in COLUMNS[2:]:
        np.testing.assert_allclose(columns[name], getattr(found, name).ravel(), rtol=1e-5)
    # Rodrigues Table 4.1, FEA: 0.75 N and 3.4 um at azimuth 0, 1.22 N and 5.6 um at 60 deg.
    np.testing.assert_allclose(columns["trigger_force_N"][[0, 6]], [0.75, 1.22], rtol=0.008)
    np.testing.assert_allclose(columns["deflection_um"][[0, 6]], [3.4, 5.6], atol=0.1)


def test_says_what_it_found(tmp_path):
    result = run("omp40-2-50mm", "-o", tmp_path / "map.csv")
    assert "OMP40-2, 50 mm stylus: 324 directions" in result.output
    assert "trigger force" in result.output
    assert "wrote " in result.stderr


def test_a_map_is_a_probe_again(tmp_path):
    run("tp6-50mm", "--polar", "0:90:10", "--azimuth", "0:350:10", "-o", tmp_path / "map.csv")
    table = '[probe]\nmodel = "table"\ntip_radius_mm = 2.0\nmap = "map.csv"\n'
    (tmp_path / "measured.toml").write_text(table)
    result = run(tmp_path / "measured.toml", "--polar", "90,40", "--azimuth", "0,60,120", "-o", tmp_path / "again.csv")
    assert result.exit_code == 0, result.output
    _, first = read(tmp_path / "map.csv")
    _, again = read(tmp_path / "again.csv")
    chosen = np.isin(first["polar_deg"], [40, 90]) & np.isin(first["azimuth_deg"], [0, 60, 120])
    np.testing.assert_allclose(np.sort(again["pretravel_um"]), np.sort(first["pretravel_um"][chosen]), rtol=1e-6)


def test_unknown_cells_are_empty(tmp_path):
    (tmp_path / "c.toml").write_text('[probe]\nmodel = "constant"\ntip_radius_mm = 2.0\npretravel_um = 3.0\n')
    run(tmp_path / "c.toml", "--polar", "90", "--azimuth", "0", "-o", tmp_path / "map.csv")
    assert (tmp_path / "map.csv").read_text().splitlines()[2] == "90,0,,,3"


def test_directions_that_never_trigger_are_empty_and_told(tmp_path):
    result = run("tp6-50mm", "--polar", "90,180", "--azimuth", "0", "-o", tmp_path / "map.csv")
    assert "in 1 directions the probe never triggers" in result.output
    assert (tmp_path / "map.csv").read_text().splitlines()[3] == "180,0,,,"


def test_held_level_the_weight_acts_across(tmp_path):
    for name, direction in (("hanging.csv", "0,0,-1"), ("level.csv", "1,0,0")):
        run("tp6-50mm", "--polar", "90", "--stylus-direction", direction, "-o", tmp_path / name)
    _, hanging = read(tmp_path / "hanging.csv")
    _, level = read(tmp_path / "level.csv")
    thirds = hanging["trigger_force_N"].reshape(3, 12)
    np.testing.assert_allclose(thirds[0], thirds[1], rtol=1e-4)
    assert np.ptp(level["trigger_force_N"].reshape(3, 12), axis=0).max() > 0.01


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("90,80", [90, 80]),
        ("0:20:10", [0, 10, 20]),
        ("90:60:-15", [90, 75, 60]),
        ("0:1:0.25,90", [0, 0.25, 0.5, 0.75, 1, 90]),
        ("10,10", [10]),
        ("0:0.3:0.1", [0, 0.1, 0.2, 0.3]),
    ],
)
def test_angles(text, expected):
    assert parse_angles(text, "--polar", 0, 180) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a", r"--polar: not a list of angles; found 'a'"),
        ("0:10", "not a list of angles"),
        ("0:10:0", "lead nowhere"),
        ("0:10:-1", "lead nowhere"),
        ("0:nan:1", "not a list of angles"),
        ("190", "out of range; found 190; expected 0 to 180 deg"),
        ("0:90:1e-9", "too many angles"),
    ],
)
def test_wrong_angles(text, message):
    with pytest.raises(InputError, match=message):
        parse_angles(text, "--polar", 0, 180)


def test_complaints(tmp_path):
    out = ("-o", tmp_path / "m.csv")
    assert "no such probe file" in complaint("nothing", *out)
    assert "not a direction" in complaint("tp6-50mm", "--stylus-direction", "0,0,0", *out)
    assert "too many directions" in complaint("tp6-50mm", "--polar", "0:180:0.1", "--azimuth", "0:360:0.1", *out)


def test_a_wrong_figure_name_costs_no_table(tmp_path):
    for name in ("body", "body.jpg"):
        result = run("tp6-50mm", "--body-plot", tmp_path / name, "-o", tmp_path / "m.csv")
        assert result.exit_code == 2
        assert "--body-plot: not a name with such a suffix" in str(result.exception)
    assert not (tmp_path / "m.csv").exists()


MAGIC = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}


def test_figures(tmp_path):
    kinds = {"polar": "svg", "body": "png", "force": "pdf"}
    names = {option: tmp_path / f"{option}.{kind}" for option, kind in kinds.items()}
    options = [part for option, path in names.items() for part in (f"--{option}-plot", path)]
    result = run("tp6-30mm", "--polar", "90,60,30", *options, "-o", tmp_path / "m.csv")
    assert result.exit_code == 0, result.output
    for option, path in names.items():
        assert path.read_bytes().startswith(MAGIC[kinds[option]])


def test_figures_are_the_same_twice_and_leave_no_state(tmp_path):
    import matplotlib

    before = dict(matplotlib.rcParams)
    for name in ("a.svg", "b.svg"):
        run(
            "tp200-50mm", "--polar", "90", "--azimuth", "0:90:30", "--polar-plot", tmp_path / name, "-o", tmp_path / "m"
        )
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert dict(matplotlib.rcParams) == before


def test_curves_show_the_numbers(tmp_path, monkeypatch):
    """The polar plot carries the table's values, closed around the turn."""
    from stepgauge.figures import probe as figures

    drawn = []
    monkeypatch.setattr(figures, "save_figure", lambda fig, path, simulated: drawn.append(fig))
    found = map_directions(read_probe("omp40-2-50mm"), [90.0, 60.0], np.arange(0.0, 360.0, 10.0))
    figures.draw_polar(found, tmp_path / "p.png")
    figures.draw_curves(found, tmp_path / "f.png")
    force, pretravel = drawn[0].axes
    np.testing.assert_array_equal(force.lines[0].get_ydata()[:-1], found.trigger_force_N[0])
    np.testing.assert_array_equal(pretravel.lines[1].get_ydata()[:-1], found.pretravel_um[1])
    assert force.lines[0].get_ydata()[-1] == found.trigger_force_N[0, 0]
    assert [axes.get_ylabel() for axes in drawn[1].axes] == [
        "trigger force (N)",
        "deflection (\N{MICRO SIGN}m)",
        "pre-travel (\N{MICRO SIGN}m)",
    ]
