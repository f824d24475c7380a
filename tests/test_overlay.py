"""Evaluations laid over each other: differences, what is in their uncertainty, and what cannot be compared."""

from __future__ import annotations

import datetime
import io
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from pypdf import PdfReader

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import Evaluation, evaluate
from stepgauge.evaluation.face_errors import face_errors
from stepgauge.evaluation.files import evaluation_to_dict, write_evaluation
from stepgauge.recording import Recording, join_recordings
from stepgauge.recording.face_readings import FaceStatistics
from stepgauge.reports.overlay import overlay_content, short_names
from stepgauge.reports.page import UserStatements
from stepgauge.standards.difference import ERRORS, differences
from tests.cli.conftest import Run as Command
from tests.cli.conftest import run  # noqa: F401
from tests.measured import ALONG_X, named, one_placement, shipped, two_placements, with_gaps
from tests.measured import run as measure


def said(evaluation: Evaluation | None = None) -> dict[str, Any]:
    return evaluation_to_dict(evaluation or one_placement())


def of_seed(seed: int, scale_um_m: float = 0.0, axis: Any = None) -> Evaluation:
    """The gauge measured with other readings, and another scale."""
    found = measure(4, axis) if axis else measure(4)
    frame = found.recording.frame.copy()
    along = frame["y_mm"] - frame["y_mm"].min()
    frame["y_mm"] += np.random.default_rng(seed).normal(0.0, 0.3e-3, len(frame)) + scale_um_m * 1e-6 * along
    return evaluate(named(Recording(frame, found.recording.comments)), shipped()[0])


def test_an_evaluation_does_not_differ_from_itself() -> None:
    (found,) = differences(said(), said())
    for error in ERRORS:
        assert np.nanmax(np.abs(found.of(error))) == 0.0
        assert not found.significant(error).any()


def test_a_changed_scale_is_the_difference_and_beyond_its_uncertainty() -> None:
    before, after = of_seed(1), of_seed(2, 30.0)
    (found,) = differences(said(before), said(after))
    expected = 30e-3 * (found.nominal_mm - found.nominal_mm[0])
    last = found.face == 11
    assert found.of("xf")[last] == pytest.approx(expected[last], abs=2.0 * found.expanded_um["xf"][last][0])
    assert found.significant("xf")[last].all()
    assert found.after_um["xm"] == pytest.approx(after.results[0].xm_um, nan_ok=True)


@pytest.mark.parametrize("origin", ["first", "all"])
@pytest.mark.parametrize("make", [one_placement, with_gaps])
def test_repeatability_is_propagated_as_face_means_scatter(origin: Any, make: Callable[[], Evaluation]) -> None:
    """Face means drawn at random, evaluated by the equations themselves, scatter as the stated uncertainty says."""
    data = said(make()) | {"r_eff_origin": origin}
    (found,) = differences(data, data)
    rows = data["placements"][0]["faces"]
    count = np.array([row["count"] for row in rows])
    s = np.array([row["sf_um"] if row["face"] % 2 else row["sb_um"] for row in rows], float)
    free = np.where((count > 1) & np.isfinite(s), count - 1, 0)
    sigma = np.sqrt((free * np.nan_to_num(s) ** 2).sum() / free.sum())
    drawn = np.random.default_rng(3).normal(0.0, 1.0, (4000, len(count))) * sigma * 1e-3 / np.sqrt(np.maximum(count, 1))
    means = np.where(count > 0, drawn, np.nan)
    errors = face_errors(FaceStatistics(found.face, count, means, np.zeros_like(means)), np.zeros(len(count)), origin)
    for error in ERRORS:
        scatter = np.sqrt(2.0) * np.std(getattr(errors, f"{error}_um"), axis=0)
        known = np.isfinite(found.u_um[error])
        assert np.isfinite(scatter[known]).all()
        assert found.u_um[error][known] == pytest.approx(scatter[known], rel=0.06, abs=1e-9)


def test_the_certificate_cancels_and_the_expansion_only_where_temperatures_agree() -> None:
    before = said()
    sure = deepcopy(before)
    for row in sure["placements"][0]["faces"]:
        row["u_certificate_um"] = 1000.0
    same, loose = differences(before, before)[0], differences(sure, sure)[0]
    assert loose.u_um["xm"] == pytest.approx(same.u_um["xm"], nan_ok=True)
    warm = deepcopy(before)
    before["placements"][0]["gauge_temperature_C"], warm["placements"][0]["gauge_temperature_C"] = 20.0, 25.0
    (hot,) = differences(before, warm)
    length_um = (found_position(before, 11) - found_position(before, 1)) * 1e3
    expansion = before["gauge"]["expansion_uncertainty_per_K"] * 5.0 * length_um
    at = hot.face == 11
    assert hot.u_um["xf"][at] == pytest.approx(np.hypot(same.u_um["xf"][at], expansion), rel=1e-6)


def found_position(data: dict[str, Any], face: int) -> float:
    return next(float(row["position_mm"]) for row in data["placements"][0]["faces"] if row["face"] == face)


def test_certified_positions_that_only_one_of_them_used_do_not_cancel() -> None:
    """With R_eff of all blocks, a block that was measured only once enters one of the two with its certificate."""
    whole, part = said() | {"r_eff_origin": "all"}, said(with_gaps()) | {"r_eff_origin": "all"}
    plain, exact = deepcopy(part), deepcopy(whole)
    for one in (plain, exact):
        for row in one["placements"][0]["faces"]:
            row["u_certificate_um"] = 0.0
    with_it, without = differences(whole, part)[0].u_um["xb"], differences(exact, plain)[0].u_um["xb"]
    share = np.sqrt(with_it**2 - without**2)[[1, 5, 9, 11]]
    assert share == pytest.approx(_share_of_blocks(whole, 2 * np.array([2, 4])), rel=1e-6)


def _share_of_blocks(data: dict[str, Any], backs: Any) -> float:
    """XB has minus the mean block size: 1/6 of each of six blocks, or 1/4 of each of the four that are complete."""
    u = {row["face"]: row["u_certificate_um"] for row in data["placements"][0]["faces"]}
    weight = {face: 1 / 6 if face in {*backs, *(backs - 1)} else 1 / 4 - 1 / 6 for face in u}
    return float(np.sqrt(sum((weight[face] * u[face]) ** 2 for face in u)))


def test_single_cycles_have_no_uncertainty_and_say_so() -> None:
    one = said(one_placement(1))
    (found,) = differences(one, one)
    assert np.isnan(found.expanded_um["xm"]).all()
    assert any("no face was probed twice" in note for note in found.notes)


def _serial(data: dict[str, Any]) -> None:
    data["gauge"]["serial"] = "OTHER"


def _certificate(data: dict[str, Any]) -> None:
    data["gauge"]["certificate"] = "OTHER"


def _axis(data: dict[str, Any]) -> None:
    data["placements"][0]["axis"] = [1.0, 0.0, 0.0]


def _reversed(data: dict[str, Any]) -> None:
    data["placements"][0]["axis"] = [-v for v in data["placements"][0]["axis"]]


def _reference(data: dict[str, Any]) -> None:
    data["placements"][0]["faces"][0]["count"] = 0


def _origin(data: dict[str, Any]) -> None:
    data["r_eff_origin"] = "all"


def _position(data: dict[str, Any]) -> None:
    data["placements"][0]["faces"][3]["position_mm"] += 0.01


def _placements(data: dict[str, Any]) -> None:
    data["placements"] *= 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_serial, "serial number"),
        (_certificate, "another certificate"),
        (_axis, "lay along another axis"),
        (_reversed, "lay along another axis"),
        (_reference, "count from another face"),
        (_origin, "effective radius"),
        (_position, "certified position of face 4"),
        (_placements, "number of placements"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_line(change: Any, words: str) -> None:
    other = deepcopy(said())
    change(other)
    with pytest.raises(InputError, match=words) as error:
        differences(said(), other, ("a", "later"))
    assert str(error.value).startswith("later: ")
    assert "\n" not in str(error.value)


def folders(tmp_path: Path, *made: Evaluation) -> list[Path]:
    names = [tmp_path / name for name in ("before", "after", "third")[: len(made)]]
    for name, one in zip(names, made, strict=True):
        write_evaluation(name, one)
    return names


def test_the_pages_have_every_face_and_say_what_cancels(run: Command, tmp_path: Path) -> None:  # noqa: F811
    places = folders(tmp_path, of_seed(1), of_seed(2, 30.0))
    for suffix in ("pdf", "html", "png"):
        done = run("report", *places, "-o", tmp_path / f"overlay.{suffix}")
        assert done.code == 0, done.err
    pdf = PdfReader(io.BytesIO((tmp_path / "overlay.pdf").read_bytes()))
    text = "\n".join(page.extract_text() for page in pdf.pages)
    assert "after − before" in text
    assert "cancels in the difference" in text
    assert "is not in U: thermometers" in text
    assert [line for line in text.splitlines() if line.startswith("12 110.0")]
    assert "overlay.json" in pdf.attachments
    assert (tmp_path / "overlay.png").stat().st_size > 10_000
    assert "after − before" in (tmp_path / "overlay.html").read_text("utf-8")


def test_three_evaluations_are_compared_with_the_first(tmp_path: Path) -> None:
    places = folders(tmp_path, of_seed(1), of_seed(2), of_seed(3, 30.0))
    sg.report(places, tmp_path / "overlay.html")
    page = (tmp_path / "overlay.html").read_text("utf-8")
    assert "third − before by face" in page
    assert "after − before by face" in page
    assert "third − after" not in page


def test_two_placements_have_a_figure_and_a_table_each(tmp_path: Path) -> None:
    both = two_placements()
    again = evaluate(named(join_recordings([measure(2).recording, measure(3, ALONG_X).recording])), shipped()[0])
    sg.report([both, again], tmp_path / "overlay.html")
    page = (tmp_path / "overlay.html").read_text("utf-8")
    assert page.count("<figure>") == page.count("by face, placement") == 2
    with pytest.raises(InputError, match="one placement"):
        sg.report([both, again], tmp_path / "overlay.png")
    assert not (tmp_path / "overlay.png").exists()


def test_the_table_rounds_as_the_summary_does() -> None:
    """Both to the place of U with two digits: the summary had said -0.9 of the face that the table gave -0.94."""
    both = [evaluation_to_dict(evaluate(named(measure(cycles).recording), shipped()[0])) for cycles in (2, 3)]
    page = overlay_content(both, [differences(*both)], ["A", "B"], UserStatements(datetime.date(2026, 5, 4)))
    (table,) = page["tables"]
    rows = {row[0]: row[4:] for row in table["rows"]}
    for number, (_, where, difference, expanded, *_) in enumerate(page["result"]["rows"]):
        cells = rows[where.split(",")[0].removeprefix("face ")]
        assert cells[2 * number].rstrip("*\u2007\u2008") == difference.removesuffix(" µm")
        assert cells[2 * number + 1].rstrip("\u2007\u2008") == expanded.removesuffix(" µm")


def test_an_evaluation_is_not_laid_over_itself(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="evaluation 2 repeats evaluation 1"):
        sg.report([one_placement(), one_placement()], tmp_path / "overlay.pdf")
    assert not (tmp_path / "overlay.pdf").exists()


def test_other_results_and_options_of_a_signed_report_are_refused(run: Command, tmp_path: Path) -> None:  # noqa: F811
    places = folders(tmp_path, of_seed(1), of_seed(2))
    done = run("report", *places, "--number", "N-1", "-o", tmp_path / "overlay.pdf")
    assert done.code == 2
    assert "number" in done.err
    done = run("report", places[0], tmp_path / "before" / "evaluation.csv", "-o", tmp_path / "overlay.pdf")
    assert done.code == 2
    along_x = evaluate(named(measure(3, ALONG_X).recording), shipped()[0])
    with pytest.raises(InputError, match="along another axis"):
        sg.report([places[0], along_x], tmp_path / "overlay.pdf")
    assert not (tmp_path / "overlay.pdf").exists()


def test_names_are_as_short_as_they_differ() -> None:
    assert short_names(["a/before", "a/after/evaluation.json"]) == ["before", "after"]
    assert short_names(["may/result", "june/result"]) == ["may/result", "june/result"]
    assert short_names(["result", "result"]) == ["result (1)", "result (2)"]


def test_an_evaluation_is_plotted_over_an_earlier_one() -> None:
    matplotlib.use("Agg")
    before, after = of_seed(1), of_seed(2, 30.0)
    axes = after.plot(before=before)
    drawn = {str(line.get_label()): line for line in axes.get_lines()}
    (found,) = differences(said(before), said(after))
    assert np.asarray(drawn["after − before, ± U"].get_ydata(), float) == pytest.approx(found.of("xm"), nan_ok=True)
    assert np.asarray(drawn["XM before"].get_ydata(), float) == pytest.approx(before.results[0].xm_um, nan_ok=True)
    other = replace(before, gauge=sg.read_gauge("step-gauge-600"))
    with pytest.raises(InputError, match="serial number"):
        after.plot(before=other)
