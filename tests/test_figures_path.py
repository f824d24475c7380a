"""The path past the gauge, drawn: what is on paper is where the tip was."""

from __future__ import annotations

import base64
import gzip
import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from plotly.offline import get_plotlyjs

from stepgauge.errors import InputError
from stepgauge.figures.path import path_figure
from stepgauge.figures.path_scene import path_scene, probed_points, write_path_html
from stepgauge.figures.style import save_figure
from tests.build import make_gauge, make_pose
from tests.measured import ALONG_X, lay, run, shipped

RADIUS_MM = 2.0


def figure(stop_piece: int | None = None, title: str = "") -> Figure:
    gauge = shipped()[0]
    return path_figure(run(2).path, gauge, lay(gauge), RADIUS_MM, stop_piece, title)


def segments(drawn: Figure, panel: int, kind: str) -> np.ndarray:
    (found,) = [
        one for one in drawn.axes[panel].collections if isinstance(one, LineCollection) and one.get_gid() == kind
    ]
    return np.array(found.get_segments()).reshape(-1, 2, 2)


@pytest.mark.parametrize(("panel", "vertical"), [(0, 1), (1, 2)])
def test_plan_and_elevation_show_the_path_in_gauge_coordinates(panel: int, vertical: int) -> None:
    gauge, path, placement = shipped()[0], run(2).path, lay(shipped()[0])
    ends = [placement.to_gauge(gauge, place)[:, [0, vertical]] for place in (path.start_mm, path.end_mm)]
    both = np.stack(ends, axis=1)
    drawn = figure()
    np.testing.assert_allclose(segments(drawn, panel, "measuring"), both[path.measuring], atol=1e-9)
    depth = [placement.to_gauge(gauge, place)[:, 3 - vertical] for place in (path.start_mm, path.end_mm)]
    half = (gauge.table.block_height_mm if vertical == 1 else gauge.table.block_width_mm) / 2.0
    aside = (np.minimum(*depth) > half) | (np.maximum(*depth) < -half)
    np.testing.assert_allclose(segments(drawn, panel, "travel"), both[~path.measuring & ~aside], atol=1e-9)
    beside = segments(drawn, panel, "travel beside")
    for piece in both[~path.measuring & aside]:
        assert any(covers(line, piece) for line in beside)
    for one, other in itertools.combinations(beside, 2):  # dashes over dashes would be a solid line
        assert not covers(one, other.mean(axis=0)[None]) or np.ptp(other, axis=0).max() < 0.02


def covers(line: np.ndarray, places: np.ndarray) -> bool:
    """Whether places ``(n, 2)`` lie on the line between two places."""
    along = line[1] - line[0]
    length = max(float(np.linalg.norm(along)), 1e-9)
    beyond = (places - line[0]) @ along / length
    off = np.linalg.norm(places - line[0] - np.outer(beyond, along / length), axis=1)
    return bool((off < 0.02).all() and (beyond > -0.02).all() and (beyond < length + 0.02).all())


def test_travel_past_the_side_of_the_blocks_is_told_from_travel_among_them() -> None:
    """In the elevation of a path around the side, only what runs between the blocks' sides is drawn as solid."""
    gauge, path, placement = shipped()[0], run(2).path, lay(shipped()[0])
    ends = [placement.to_gauge(gauge, place)[:, 1] for place in (path.start_mm, path.end_mm)]
    half = gauge.table.block_width_mm / 2.0
    aside = ~path.measuring & ((np.minimum(*ends) > half) | (np.maximum(*ends) < -half))
    assert aside.any()
    rows = np.stack([placement.to_gauge(gauge, place)[:, [0, 2]] for place in (path.start_mm, path.end_mm)], axis=1)
    drawn = segments(figure(), 1, "travel beside")
    assert 0 < len(drawn) < aside.sum()  # two cycles run along the same lines
    assert np.ptp(drawn[..., 0]) == pytest.approx(np.ptp(rows[aside][..., 0]), abs=0.02)


def test_blocks_are_drawn_where_the_certificate_has_them() -> None:
    gauge = shipped()[0]
    for axes in figure().axes:
        (blocks,) = [c for c in axes.collections if isinstance(c, PatchCollection) and c.get_gid() == "blocks"]
        corners = np.array([path.vertices[:, 0] for path in blocks.get_paths()])
        np.testing.assert_allclose(corners.min(axis=1), gauge.position_mm[0::2], atol=1e-4)
        np.testing.assert_allclose(corners.max(axis=1), gauge.position_mm[1::2], atol=1e-4)
        assert axes.get_aspect() == 1.0


def test_tip_balls_of_the_detail_touch_their_faces() -> None:
    gauge = shipped()[0]
    (balls,) = [c for c in figure().axes[2].collections if c.get_gid() == "tip balls"]
    reach = np.array([[path.vertices[:, 0].min(), path.vertices[:, 0].max()] for path in balls.get_paths()])
    # Fronts are touched by a ball's far end, backs by its near end (3 um of pre-travel, centres drawn to 10 um).
    gap = np.abs(reach[:, :, None] - gauge.position_mm).min(axis=(1, 2))
    assert gap.max() < 0.02
    assert len(gap) == 12


def test_the_stop_is_marked_and_ends_the_path() -> None:
    gauge, path, placement = shipped()[0], run(2).path, lay(shipped()[0])
    piece = int(np.flatnonzero(path.measuring)[4])
    drawn = figure(piece)
    for axes, vertical in zip(drawn.axes, (1, 2, 1, 2), strict=True):
        (cross,) = [one for one in axes.get_lines() if one.get_gid() == "stop"]
        there = placement.to_gauge(gauge, path.end_mm[piece])[[0, vertical]]
        np.testing.assert_allclose(cross.get_xydata()[0], there, atol=1e-9)
        (probed,) = [one for one in axes.get_lines() if one.get_gid() == "probed"]
        assert len(probed.get_xydata()) == 4
        low, high = axes.get_xlim()
        assert low < there[0] < high
    assert "stopped here" in [text.get_text() for text in drawn.legends[0].get_texts()]
    assert len(segments(drawn, 0, "measuring")) + len(segments(drawn, 0, "travel")) == piece + 1


def test_a_short_gauge_needs_no_detail() -> None:
    gauge = make_gauge(3)
    placement = make_pose(0.4, 0.1).placement(gauge)
    assert len(path_figure(run(1).path, gauge, placement, RADIUS_MM).axes) == 2


@pytest.mark.parametrize("axis", [(-0.001, 1.0, 0.0), ALONG_X])
def test_probed_points_are_the_faces_and_cycles_of_the_recording(axis: tuple[float, float, float]) -> None:
    gauge, done = shipped()[0], run(2, axis, noise_um=0.0)
    points = probed_points(done.path, gauge, lay(gauge, axis), RADIUS_MM)
    frame = done.recording.frame
    assert list(points.face) == list(frame["face"])
    assert list(points.cycle) == list(frame["cycle"])
    np.testing.assert_allclose(points.tip_mm, done.recording.position_mm, atol=1e-6)


def test_files_are_written_the_same_twice_and_any_title_will_do(tmp_path: Path) -> None:
    gauge = shipped()[0]
    file, again = tmp_path / "path.svg", tmp_path / "again.svg"
    for one in (file, again):
        save_figure(path_figure(run(1).path, gauge, lay(gauge), RADIUS_MM, None, r"$\frac{ 50% <&>"), one, True)
    assert file.read_bytes() == again.read_bytes()
    assert file.stat().st_size > 5000


def test_wrong_suffixes_leave_no_file(tmp_path: Path) -> None:
    gauge = shipped()[0]
    with pytest.raises(InputError, match=r"path\.gif"):
        save_figure(path_figure(run(1).path, gauge, lay(gauge), RADIUS_MM), tmp_path / "path.gif", True)
    with pytest.raises(InputError, match=r"\.html"):
        write_path_html(tmp_path / "path.png", path_scene(run(1).path, gauge, lay(gauge), RADIUS_MM))
    assert list(tmp_path.iterdir()) == []


def test_the_scene_has_solid_blocks_in_machine_coordinates() -> None:
    gauge, machine = shipped()
    placement = lay(gauge, ALONG_X)
    scene = path_scene(run(1, ALONG_X).path, gauge, placement, RADIUS_MM, machine.travel_mm)
    blocks, rail, *_ = scene.data
    corners = np.column_stack([blocks.x, blocks.y, blocks.z])
    assert len(corners) == 8 * gauge.n_blocks
    assert len(blocks.i) == 12 * gauge.n_blocks
    along = placement.to_gauge(gauge, corners)[:, 0].reshape(-1, 8)
    np.testing.assert_allclose(along.min(axis=1), gauge.position_mm[0::2], atol=1e-4)
    np.testing.assert_allclose(along.max(axis=1), gauge.position_mm[1::2], atol=1e-4)
    assert closed(np.column_stack([rail.i, rail.j, rail.k]))
    (volume,) = [one for one in scene.data if one.name == "travel of the machine"]
    ends = np.array([[v for v in getattr(volume, axis) if v is not None] for axis in "xyz"])
    np.testing.assert_allclose(np.column_stack([ends.min(axis=1), ends.max(axis=1)]), machine.travel_mm)


def closed(triangles: np.ndarray) -> bool:
    """Whether every edge of a mesh belongs to exactly two triangles: a solid without holes."""
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def test_the_html_is_one_file_with_hover_text(tmp_path: Path) -> None:
    gauge, machine = shipped()
    title = "</script><script>alert(1)</script>"
    scene = path_scene(run(1).path, gauge, lay(gauge), RADIUS_MM, machine.travel_mm, 20, title)
    file = write_path_html(tmp_path / "path.html", scene)
    text = file.read_text(encoding="utf-8")
    assert text.count("</script>") == 3  # those of the page
    assert not re.search(r"<script[^>]+src=|<link", text)  # nothing is fetched
    drawn = json.loads(re.search(r'id="scene">(.*?)</script>', text, re.DOTALL)[1])  # type: ignore[index]
    (probed,) = [one for one in drawn["data"] if one["name"].startswith("probed")]
    assert probed["customdata"][:2] == [[1, 1], [2, 1]]
    assert "face %{customdata[0]}, cycle %{customdata[1]}" in probed["hovertemplate"]
    packed = re.search(r'id="library">(.*?)</script>', text, re.DOTALL)[1]  # type: ignore[index]
    assert gzip.decompress(base64.b64decode(packed)).decode() == get_plotlyjs()
    assert "stopped here" in [one["name"] for one in drawn["data"]]


def test_moves_repeated_in_every_cycle_are_in_the_page_once(tmp_path: Path) -> None:
    gauge = shipped()[0]
    one, five = (
        write_path_html(tmp_path / f"{n}.html", path_scene(run(n).path, gauge, lay(gauge), RADIUS_MM)).stat().st_size
        for n in (1, 5)
    )
    assert one < 2.5e6  # the library alone is 4.8 MB
    assert five - one < 20e3
