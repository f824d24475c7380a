"""Error tables for controllers: known axis errors come out as put in, in the words of each controller."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.compensation import FORMATS, TableOptions, TipRadius, axis_faces, make_table, render_table
from stepgauge.compensation.table import CompensationTable
from stepgauge.effects.maps import AXIS_COLUMNS, read_compensation
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.files.templating import fill_template
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording, join_recordings
from tests.build import make_gauge
from tests.compensating_controls import CONTROLS

Array = np.ndarray
RADIUS = 1.997
START = np.array([120.0, 80.0, 60.0])


def wave_um(x: Array) -> Array:
    """A screw: long, with a slow wave."""
    return 0.05 * x + 3.0 * np.sin(2 * np.pi * x / 200.0)


def measured(
    gauge: Gauge,
    error_um=wave_um,
    reversal_um: float = 0.0,
    yaw_deg: float = 0.0,
    cycles: int = 2,
    noise_um: float = 1e-9,  # cycles that are the same to the last bit are copies
    seed: int = 0,
) -> Recording:
    """A recording from the definitions: tip centre = face -+ r, plus the error of x by coordinate and sense."""
    yaw = np.radians(yaw_deg)
    axis = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    face = np.tile(np.arange(1, gauge.n_faces + 1), cycles)
    way = np.where(face % 2 == 1, 1.0, -1.0)
    true = START + np.outer(gauge.position_mm[face - 1] - way * RADIUS, axis)
    sense = way * np.sign(axis[0])
    # the error belongs to what is indicated
    indicated = true[:, 0]
    for _ in range(4):
        indicated = true[:, 0] + (error_um(indicated) + sense * reversal_um / 2.0) * 1e-3
    noise = np.random.default_rng(seed).normal(0.0, noise_um, len(face)) * 1e-3
    frame = pd.DataFrame({"placement": 1, "cycle": (np.arange(len(face)) // gauge.n_faces) + 1, "face": face})
    frame["x_mm"], frame["y_mm"], frame["z_mm"] = indicated + noise, true[:, 1], true[:, 2]
    for name, share in zip(("approach_i", "approach_j", "approach_k"), axis, strict=True):
        frame[name] = way * share
    return Recording(frame, {}, "made.csv")


def table_of(gauge: Gauge, recording: Recording, tip: float | None = RADIUS, **options: object) -> CompensationTable:
    data = evaluation_to_dict(evaluate(recording, gauge))
    known = None if tip is None else TipRadius(tip)
    return make_table(axis_faces(data, "evaluation.json", "x", known), TableOptions(**options))  # type: ignore[arg-type]


GAUGE = make_gauge(12, deviation_um=np.r_[0.0, np.random.default_rng(3).normal(0, 2, 23)])


@settings(max_examples=40)
@given(
    turned=st.sampled_from([0.0, 180.0]),
    askew=st.floats(-0.3, 0.3),
    ppm=st.floats(-100, 100),
    reversal=st.floats(-20, 20),
    zero=st.floats(150.0, 300.0),
)
def test_a_scale_error_with_reversal_comes_out_as_put_in(turned, askew, ppm, reversal, zero) -> None:
    """Whichever way the gauge looks: error = ppm (x - zero) +- half of the reversal, from closed form."""
    zero = zero if turned == 0.0 else 240.0 - zero
    recording = measured(GAUGE, lambda x: ppm * 1e-3 * x, reversal, turned + askew)
    table = table_of(GAUGE, recording, zero_at_mm=zero)
    slope = ppm * 1e-3 * (table.position_mm - zero)
    np.testing.assert_allclose(table.positive_um, slope + reversal / 2.0, atol=0.02)
    np.testing.assert_allclose(table.negative_um, slope - reversal / 2.0, atol=0.02)
    assert (np.diff(table.position_mm) > 0).all()


def test_rows_stand_at_the_indicated_tip_centres_of_each_sense() -> None:
    recording = measured(GAUGE)
    table = table_of(GAUGE, recording)
    indicated = recording.frame[recording.frame["cycle"] == 1]["x_mm"].to_numpy()
    np.testing.assert_allclose(table.position_mm, np.sort(indicated), atol=0.06)
    own = np.isin(np.arange(24), np.arange(0, 24, 2))
    np.testing.assert_allclose(
        (table.positive_um - table.positive_um[0])[own], wave_um(indicated[::2]) - wave_um(indicated[0]), atol=0.01
    )


@pytest.mark.parametrize("ppm", [0.0, 920.0])
def test_without_a_tip_radius_there_is_no_reversal_whatever_the_scale_error(ppm: float) -> None:
    """Readings cannot tell it from the tip, and no play is written; R_eff holds the error of a block, which is none."""
    recording = measured(GAUGE, lambda x: 1e-3 * ppm * x, 6.0)
    table = table_of(GAUGE, recording, tip=None)
    np.testing.assert_allclose(table.reversal_um, 0.0, atol=1e-3)
    assert any("mean reversal is taken as 0" in note for note in table.notes)
    for name, setting in (("grbl", "$160="), ("marlin", "M425 F1 "), ("rrf", "M425 X")):
        text = render_table(table, FORMATS[name])
        assert "the play is not known" in text
        assert not any(line.startswith(setting) for line in text.splitlines())
    np.testing.assert_allclose(table_of(GAUGE, recording).reversal_um, 6.0, atol=0.02)  # second order


@pytest.mark.parametrize("tip", [RADIUS, None])
def test_the_stated_uncertainty_is_the_scatter_of_many_tables(tip) -> None:
    """Monte Carlo, four standard deviations of the scatter of 150 recordings; the certificate is perfect here."""
    gauge = make_gauge(6, u_um=0.0)
    tables = [table_of(gauge, measured(gauge, cycles=4, noise_um=0.5, seed=s), tip, step_mm=15.0) for s in range(150)]
    for name in ("positive", "negative"):
        scatter = np.std([getattr(t, f"{name}_um") for t in tables], axis=0)
        stated = np.sqrt(np.mean([getattr(t, f"u_{name}_um") ** 2 for t in tables], axis=0))
        np.testing.assert_allclose(stated[1:], scatter[1:], rtol=0.25)


def test_certificate_and_expansion_are_in_the_uncertainty() -> None:
    """At a face: u^2 = u_face^2 + u_zero^2, and alpha's uncertainty times the warmth times the length."""
    gauge = make_gauge(6, u_um=0.3)
    recording = measured(gauge, lambda x: 0.0 * x)
    table = table_of(gauge, recording, travel="positive")
    np.testing.assert_allclose(table.u_positive_um[1:], 0.3 * np.sqrt(2), rtol=1e-9)
    warm_frame = recording.frame.assign(gauge_temperature_C=26.0)
    warm = Recording(warm_frame, {"temperature_convention": "as_read"}, "warm.csv")
    warmer = table_of(gauge, warm, travel="positive")
    expansion = 0.5e-6 * 6.0 * (warmer.position_mm - warmer.position_mm[0]) * 1e3
    np.testing.assert_allclose(warmer.u_positive_um[1:], np.hypot(0.3 * np.sqrt(2), expansion[1:]), rtol=1e-6)


def test_nothing_is_extrapolated_unless_asked_for() -> None:
    recording = measured(GAUGE, lambda x: 0.1 * x)
    with pytest.raises(InputError, match=r"outside what was measured on x; found 100\.000 to .* or extend"):
        table_of(GAUGE, recording, range_mm=(100.0, 200.0))
    with pytest.raises(InputError, match=r"the zero of the table is outside"):
        table_of(GAUGE, recording, zero_at_mm=0.0)
    held = table_of(GAUGE, recording, range_mm=(60.0, 200.0), extend="hold")
    assert held.positive_um[0] == pytest.approx(held.positive_um[1])
    line = table_of(GAUGE, recording, range_mm=(60.0, 200.0), extend="linear", zero_at_mm=60.0)
    np.testing.assert_allclose(line.mean_um, 0.1 * (line.position_mm - 60.0), atol=0.02)
    for table in (held, line):
        assert any(note.startswith("extrapolated: 1 of ") for note in table.notes)


def test_a_gauge_across_is_refused_with_its_angle() -> None:
    data = evaluation_to_dict(evaluate(measured(GAUGE, yaw_deg=7.5), GAUGE))
    with pytest.raises(
        InputError, match=r"does not lie along x.*found placement 1: 7\.50 deg off x; expected at most 1"
    ):
        axis_faces(data, "evaluation.json", "x")
    assert axis_faces(data, "evaluation.json", "x", angle_limit_deg=8.0).share == pytest.approx(np.cos(np.radians(7.5)))


def test_several_placements_along_the_axis_need_a_choice() -> None:
    joined = join_recordings([measured(GAUGE), measured(GAUGE, yaw_deg=180.0), measured(GAUGE, yaw_deg=90.0)])
    data = evaluation_to_dict(evaluate(joined, GAUGE))
    with pytest.raises(
        InputError, match="several placements lie along x; found 1, 2; expected one, with placement_number"
    ):
        axis_faces(data, "e.json", "x")
    assert axis_faces(data, "e.json", "x", placement=2).share == pytest.approx(-1.0)
    assert axis_faces(data, "e.json", "y").about["placement"] == 3
    with pytest.raises(InputError, match="there is no placement 4"):
        axis_faces(data, "e.json", "x", placement=4)


def test_linuxcnc_file_begins_with_its_triplets_and_has_no_more_than_it_takes() -> None:
    """The controller stops at the first line that is no triplet."""
    table = table_of(GAUGE, measured(GAUGE))
    lines = render_table(table, FORMATS["linuxcnc"]).splitlines()
    assert all(re.fullmatch(r"-?[\d.]+ -?[\d.]+ -?[\d.]+", line) for line in lines[: len(table)])
    assert all(line.startswith("# ") for line in lines[len(table) :])
    with pytest.raises(InputError, match=r"too long for LinuxCNC.*found 468 rows; expected at most 256"):
        render_table(table_of(GAUGE, measured(GAUGE), step_mm=0.5), FORMATS["linuxcnc"])


def test_siemens_has_one_table_and_even_steps() -> None:
    with pytest.raises(InputError, match="one table for both senses"):
        render_table(table_of(GAUGE, measured(GAUGE), step_mm=10.0), FORMATS["siemens"])
    with pytest.raises(InputError, match="needs even spacing"):
        render_table(table_of(GAUGE, measured(GAUGE), travel="mean"), FORMATS["siemens"])


def test_the_csv_is_what_the_effect_reads(tmp_path: Path) -> None:
    table = table_of(GAUGE, measured(GAUGE, reversal_um=3.0))
    (tmp_path / "x.csv").write_text(render_table(table, FORMATS["csv"]))
    assert ",".join(AXIS_COLUMNS) in (tmp_path / "x.csv").read_text()
    position, positive, negative = read_compensation(str(tmp_path / "x.csv"))
    np.testing.assert_allclose(position, table.position_mm, atol=1e-6)
    np.testing.assert_allclose(positive, table.positive_um, atol=1e-4)
    np.testing.assert_allclose(negative, table.negative_um, atol=1e-4)


def test_a_template_of_ones_own_in_the_sandbox(tmp_path: Path) -> None:
    table = table_of(GAUGE, measured(GAUGE))
    own = tmp_path / "own.j2"
    own.write_text(
        "{% for row in rows %}\n{{ row.position_mm | fixed(1) }};{{ -row.mean_um | fixed(2) }}\n{% endfor %}\n"
    )
    assert len(render_table(table, FORMATS["csv"], own).splitlines()) == 24
    own.write_text("\n{{ rows[0].error }}\n")
    with pytest.raises(InputError, match=r"own\.j2:2: template: .*no attribute 'error'"):
        render_table(table, FORMATS["csv"], own)
    own.write_text("{{ ''.__class__.__mro__ }}")
    with pytest.raises(InputError, match=r"own\.j2:1: template: .*unsafe"):
        render_table(table, FORMATS["csv"], own)
    own.write_text("{% for %}")
    with pytest.raises(InputError, match=r"own\.j2:1: template"):
        fill_template(own, "compensation", {})


def test_a_missing_face_leaves_a_longer_interpolation_and_no_shift() -> None:
    """Face 1 was not measured: the coordinates start at face 2, a back."""
    recording = measured(GAUGE)
    kept = Recording(recording.frame[~recording.frame["face"].isin([1, 9])], {}, "gaps.csv")
    options = {"zero_at_mm": 150.0, "step_mm": 10.0, "range_mm": (140.0, 340.0)}
    whole, gaps = (table_of(GAUGE, r, **options) for r in (recording, kept))
    np.testing.assert_allclose(gaps.position_mm, whole.position_mm, atol=1e-9)
    np.testing.assert_allclose(gaps.negative_um, whole.negative_um, atol=0.3)


@pytest.mark.parametrize("name", ["grbl", "marlin", "rrf"])
def test_scale_and_play_are_taken_away_and_the_rest_is_stated(name: str) -> None:
    """Steps per mm and play from the file; what is left is the wave, as the file says."""
    table = table_of(GAUGE, measured(GAUGE, reversal_um=40.0), step_mm=10.0)
    text = render_table(table, FORMATS[name])
    stated = float(re.search(r"left after both: (\S+) um", text)[1])  # type: ignore[index]
    command, p = CONTROLS[name](text, 0, 0.0), np.linspace(135.0, 330.0, 50)
    motor = {sense: command(p, sense) for sense in (1, -1)}
    assert motor[1] - motor[-1] == pytest.approx(0.040, abs=1e-4)
    off_um = [(motor[sense] - p) * 1e3 - wave_um(motor[sense]) - sense * 20.0 for sense in motor]
    assert np.ptp(off_um) / 2.0 <= stated + 0.3 < 6.0
    backwards = table_of(GAUGE, measured(GAUGE, reversal_um=-4.0), step_mm=10.0)
    assert "not that of a play" in render_table(backwards, FORMATS[name])


def test_of_the_program_for_fanuc_no_axis_has_the_points_of_another() -> None:
    table = table_of(GAUGE, measured(GAUGE, reversal_um=5.0), step_mm=10.0)
    texts = [render_table(table, FORMATS["fanuc-g10"], joint=n, unconfirmed_sense="fanuc-g10") for n in range(4)]
    points = [set(re.findall(r"^N(1\d{4}) R", text, re.M)) for text in texts]
    assert len(set.union(*points)) == sum(map(len, points)) == 4 * 2 * len(table)
    assert all("\n#3006=1" in text.split("G10 L50")[0] and text.endswith("G11\nM30\n%\n") for text in texts)
    assert all(re.fullmatch(r"%|[A-Z0-9#=]+( [PR]\S+)*|G10 L50|.*\([^()]+\)", line) for line in texts[0].splitlines())
    with pytest.raises(InputError, match="no points left in the control; found 4; expected 0 to 3"):
        render_table(table, FORMATS["fanuc-g10"], joint=4, unconfirmed_sense="fanuc-g10")


def test_of_the_tables_of_sinumerik_no_axis_has_those_of_another() -> None:
    table = table_of(GAUGE, measured(GAUGE, reversal_um=5.0), step_mm=10.0)
    texts = [render_table(table, FORMATS["siemens-cec"], joint=n) for n in range(3)]
    numbers = [sorted(set(re.findall(r"^\$AN_CEC\[(\d+),", text, re.M))) for text in texts]
    assert numbers == [["0", "1"], ["2", "3"], ["4", "5"]]
