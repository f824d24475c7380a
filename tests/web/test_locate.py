"""Sixteen points in the browser: pasted, wrong, uploaded; what a technician gets to see."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepgauge.alignment.slips import agreement
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.importing.sixteen import read_sixteen
from stepgauge.web.pages import locate
from stepgauge.web.pages.locate import complete_points_text
from tests.conftest import ROOT
from tests.web.conftest import Asked, Served, Watched, make_project

POINTS = ROOT / "examples/demo/points.csv"
TEXT = POINTS.read_text(encoding="utf-8")


def test_rows_as_they_are_pasted_are_the_same_points(tmp_path: Path) -> None:
    rows = [line.split(",") for line in TEXT.splitlines()[2:]]
    german = "\n".join("\t".join(cell.replace(".", ",") for cell in row) for row in rows)
    pasted = ("\n".join("; ".join(row[1:]) for row in rows), "\n".join(" ".join(row) for row in rows), german)
    for text in pasted:
        path = tmp_path / "points.csv"
        path.write_text(complete_points_text(text))
        assert np.array_equal(read_sixteen(path), read_sixteen(POINTS))
    assert complete_points_text(TEXT) == TEXT
    assert complete_points_text("no numbers\n") == "no numbers\n"


def test_points_that_were_refused_are_still_there_on_return(tmp_path: Path) -> None:
    """The tip radius had to be stated first, on another page, and the points were gone."""
    folder = make_project(tmp_path / "project")
    rows = [line for line in TEXT.splitlines() if line[:1].isdigit()]
    swapped = "\n".join([*rows[:5], "6" + rows[6][1:], "7" + rows[5][1:], *rows[7:]])
    assert 'role="alert"' in Asked(folder).post(locate.locate, {"pasted": swapped})
    assert rows[6][1:] in Asked(folder).get(locate.show)


def test_the_point_that_disagrees_is_found_with_its_distance(gauge: Gauge) -> None:
    points = read_sixteen(POINTS)
    good = agreement(points, gauge, (1, 21))
    assert good is not None
    assert good.suspects == ()
    assert np.abs(good.off_mm).max() < 2e-3
    points[7] += 0.9 * good.lies.axis
    found = agreement(points, gauge, (1, 21))
    assert found is not None
    assert found.suspects == (8,)
    assert found.off_mm[7] == pytest.approx(0.9, abs=0.01)
    assert np.allclose(found.lies.axis, good.lies.axis, atol=1e-5)
    assert agreement(np.zeros((16, 3)), gauge, (1, 21)) is None


def test_two_points_that_were_exchanged_are_both_to_blame_and_no_other(gauge: Gauge) -> None:
    points = read_sixteen(POINTS)
    good = agreement(points, gauge, (1, 21))
    assert good is not None
    swapped = points.copy()
    swapped[[3, 4]] = points[[4, 3]]
    found = agreement(swapped, gauge, (1, 21))
    assert found is not None
    assert found.suspects == (4, 5)
    assert np.allclose(found.lies.axis, good.lies.axis, atol=1e-9)
    assert np.flatnonzero(np.abs(found.off_mm) > 0.01).tolist() == [3, 4]


def paste(page: Any, text: str) -> None:
    page.get_by_label("Or paste the rows").fill(text)
    page.get_by_role("button", name="Locate").click()


def test_from_wrong_points_to_a_placement(served: Served, watched: Watched) -> None:
    page = watched.page
    page.goto(f"{served.address}/locate")
    paste(page, "\n".join(TEXT.splitlines()[:-1]))
    assert "1 of the 16 points missing" in page.get_by_role("alert").inner_text()
    assert not list(served.folder.glob("points*"))
    paste(page, TEXT.replace("324.9965", "325.8965"))
    page.get_by_text("disagrees with the others").wait_for()
    assert "point 8" in page.get_by_role("alert").inner_text()
    assert not (served.folder / "placement.toml").exists()
    assert page.get_by_role("cell", name="front face, block 21").count() == 3, "the gauge's number, not block 2"
    paste(page, TEXT.replace("324.9965", "326.8965"))
    page.get_by_text("off by 1.9").wait_for()
    assert [path.name for path in served.folder.glob("points*")] == ["points-refused.csv"]
    page.get_by_label("A file of points").set_input_files(str(POINTS))
    page.get_by_label("Or paste the rows").fill("")
    page.get_by_role("button", name="Locate").click()
    page.get_by_text("The gauge is located").wait_for()
    page.locator(".plot[data-ready]").wait_for()
    assert watched.violations() == []
    assert [path.name for path in served.folder.glob("points*")] == ["points.csv"]
    written = tomllib.loads((served.folder / "placement.toml").read_text())
    assert written["last_block"] == 21


def test_points_on_the_surface_and_the_teach_program_without_a_word_of_the_command_line(
    served: Served, watched: Watched
) -> None:
    """The example of the page, compensated by hand: refused with the name of the box, taken with it; then a program."""
    page = watched.page
    page.goto(f"{served.address}/locate?example=1")
    radius = 2.0
    rows = [line.split(",") for line in page.get_by_label("Or paste the rows").input_value().splitlines()[1:]]
    points = np.array([[float(cell) for cell in row[1:]] for row in rows])
    along = np.argmax(np.abs(points[8] - points[0]))
    a = np.eye(3)[along]
    s = np.cross(a, [0.0, 0.0, 1.0])
    normals = np.tile([-a, -a, -a, s, -s, [0, 0, 1], [0, 0, 1], a], (2, 1))
    surface = "\n".join(" ".join(f"{value:.4f}" for value in one) for one in points - radius * normals)
    paste(page, surface)
    said = page.get_by_role("alert").inner_text()
    assert said.startswith("Points: the points look compensated by the tip radius")
    assert "The points are corrected for the tip radius already" in said
    page.get_by_label("corrected for the tip radius already").check()
    page.get_by_role("button", name="Locate").click()
    page.get_by_text("The gauge is located").wait_for()
    written = tomllib.loads((served.folder / "placement.toml").read_text())
    assert written["tip_radius_mm"] == pytest.approx(radius, abs=1e-3)
    page.get_by_label("corrected for the tip radius already").uncheck()
    page.get_by_text("Let the machine probe the points").click()
    page.get_by_label("Or paste the rows").fill("\n".join(" ".join(f"{v:.4f}" for v in one) for one in points))
    page.get_by_role("button", name="Write the teach program").click()
    page.get_by_text("The teach program is written").wait_for()
    assert watched.violations() == []
    assert (served.folder / "teach.dmi").read_text().count("PTMEAS") == 16


def test_a_scene_has_the_gauge_and_the_travel(served: Served) -> None:
    status, _, body = served.ask("/locate/scene.json?points=points.csv")
    names = [one["name"] for one in json.loads(body)["data"]]
    assert status == 200
    assert names == ["blocks", "rail", "points (centre of the tip)", "travel of the machine"]
    assert served.ask("/locate/scene.json?points=../../etc/passwd")[0] == 422


def test_a_cell_that_is_no_number_is_named_with_its_row_however_the_rows_are_pasted(tmp_path: Path) -> None:
    rows = [line.split(",") for line in TEXT.splitlines()[2:]]
    rows[6][2] = "n/a"
    for apart in ("\t", "; ", " ", ","):
        path = tmp_path / "points.csv"
        path.write_text(complete_points_text("\n".join(apart.join(row) for row in rows)))
        with pytest.raises(InputError, match=r"points\.csv:8.*y_mm.*n/a"):
            read_sixteen(path)
