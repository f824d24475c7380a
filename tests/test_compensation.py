"""Error tables for controllers: known axis errors come out as put in, in the words of each controller."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.compensation import FORMATS, TableOptions, TipRadius, axis_faces, make_table, render_table
from stepgauge.compensation.skew import find_skew, render_skew
from stepgauge.compensation.table import CompensationTable
from stepgauge.effects.compensation import COLUMNS, read_compensation
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.files.templating import fill_template
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording, join_recordings
from tests.build import make_gauge

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
    noise_um: float = 0.0,
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


def test_without_a_tip_radius_a_constant_reversal_stays_with_r_eff() -> None:
    """Block 1 gives R_eff, which swallows its reversal: there is none left, and the table says so."""
    recording = measured(GAUGE, lambda x: 0.0 * x, 6.0)
    table = table_of(GAUGE, recording, tip=None)
    np.testing.assert_allclose(table.reversal_um, 0.0, atol=1e-9)
    assert any("hides the reversal" in note for note in table.notes)
    np.testing.assert_allclose(table_of(GAUGE, recording).reversal_um, 6.0, atol=1e-9)


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
    warm = Recording(recording.frame.assign(gauge_temperature_C=26.0), {}, "warm.csv")
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


def linuxcnc_motor(text: str, kind: int, p: Array, forward: bool) -> Array:
    """Where LinuxCNC sends the motor for a commanded p, after the documentation of COMP_FILE and COMP_FILE_TYPE."""
    nominal, one, other = np.array([list(map(float, line.split())) for line in text.splitlines()]).T
    column = one if forward else other
    trim = nominal - column if kind == 0 else column
    return p + np.interp(p, nominal, trim)


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize("forward", [True, False])
def test_linuxcnc_sends_the_motor_where_the_table_is_right(kind: int, forward: bool) -> None:
    reversal = 5.0
    table = table_of(GAUGE, measured(GAUGE, reversal_um=reversal))
    text = render_table(table, FORMATS["linuxcnc"], kind=kind)
    p = np.linspace(125.0, 340.0, 60)
    motor = linuxcnc_motor(text, kind, p, forward)
    true = motor - (wave_um(motor) + (1 if forward else -1) * reversal / 2.0) * 1e-3
    off_um = (true - p) * 1e3
    # a constant is the choice of the zero; 20 mm chords of the wave leave +-h^2/8 A (2 pi / P)^2 = 0.15 um
    assert np.ptp(off_um) < 0.35
    other = linuxcnc_motor(text, kind, p, not forward)
    away = other - (wave_um(other) - (1 if forward else -1) * reversal / 2.0) * 1e-3
    assert np.abs(away - true).max() * 1e3 < 0.35, "both senses end at the same place"


def test_linuxcnc_file_has_nothing_but_triplets_and_no_more_than_it_takes() -> None:
    table = table_of(GAUGE, measured(GAUGE))
    text = render_table(table, FORMATS["linuxcnc"])
    assert all(re.fullmatch(r"\S+ \S+ \S+", line) for line in text.splitlines())
    with pytest.raises(InputError, match=r"too long for LinuxCNC.*found 468 rows; expected at most 256"):
        render_table(table_of(GAUGE, measured(GAUGE), step_mm=0.5), FORMATS["linuxcnc"])


def test_siemens_value_added_to_the_encoder_gives_the_true_place() -> None:
    """SINUMERIK K3: the value is added to the actual value; even steps from MIN to MAX."""
    table = table_of(GAUGE, measured(GAUGE), travel="mean", step_mm=10.0, zero_at_mm=130.0)
    text = render_table(table, FORMATS["siemens"])
    value = np.array([float(v) for v in re.findall(r"^\$AA_ENC_COMP\[0,\d+,AX1\]=(\S+)$", text, re.M)])
    low, high, step = (float(re.search(rf"_{n}\[0,AX1\]=(\S+)", text)[1]) for n in ("MIN", "MAX", "STEP"))  # type: ignore[index]
    assert high == pytest.approx(low + (len(value) - 1) * step)
    encoder = np.linspace(low, high, 40)
    true = encoder - wave_um(encoder) * 1e-3
    corrected = encoder + np.interp(encoder, low + step * np.arange(len(value)), value)
    assert np.ptp(corrected - true) * 1e3 < 0.3
    assert value[round((130.0 - low) / step)] == 0.0
    assert text.startswith("%_N_AX1_EEC_INI\n")
    assert text.endswith("M17\n")


def test_siemens_has_one_table_and_even_steps() -> None:
    with pytest.raises(InputError, match="one table for both senses"):
        render_table(table_of(GAUGE, measured(GAUGE), step_mm=10.0), FORMATS["siemens"])
    with pytest.raises(InputError, match="needs even spacing"):
        render_table(table_of(GAUGE, measured(GAUGE), travel="mean"), FORMATS["siemens"])


def test_the_csv_is_what_the_effect_reads(tmp_path: Path) -> None:
    table = table_of(GAUGE, measured(GAUGE, reversal_um=3.0))
    (tmp_path / "x.csv").write_text(render_table(table, FORMATS["csv"]))
    assert ",".join(COLUMNS) in (tmp_path / "x.csv").read_text()
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


def reached(command, error_um=wave_um, reversal_um: float = 5.0) -> dict[int, Array]:
    """Where a machine with this axis error ends when its control sends ``command(p, sense)`` for p; by sense."""
    places = {}
    for sense in (1, -1):
        motor = command(CHECK, sense)
        places[sense] = motor - (error_um(motor) + sense * reversal_um / 2.0) * 1e-3
    return places


CHECK = np.linspace(135.0, 330.0, 50)


def left_um(places: dict[int, Array]) -> float:
    """Largest departure from the commanded places, a constant apart, of both senses together."""
    off = np.concatenate([(places[sense] - CHECK) * 1e3 for sense in (1, -1)])
    return float(np.ptp(off)) / 2.0


def test_a_machine_is_right_with_what_every_control_is_given() -> None:
    """Measured, compensated, measured again: each file read back by a few lines that do what the control does."""
    table = table_of(GAUGE, measured(GAUGE, reversal_um=5.0), step_mm=10.0)
    assert left_um(reached(lambda p, _: p)) > 8.0
    cec = render_table(table, FORMATS["siemens-cec"])
    values = {t: np.array([float(v) for v in re.findall(rf"^\$AN_CEC\[{t},\d+\]=(\S+)$", cec, re.M)]) for t in (0, 1)}
    senses = {int(d): int(t) for t, d in re.findall(r"^\$AN_CEC_DIRECTION\[(\d)\]=(\S+)$", cec, re.M)}
    low = float(re.search(r"CEC_MIN\[0\]=(\S+)", cec)[1])  # type: ignore[index]
    grid = low + 10.0 * np.arange(len(values[0]))
    assert left_um(reached(lambda p, sense: p + np.interp(p, grid, values[senses[sense]]))) < 0.2
    com = render_table(table, FORMATS["heidenhain"])
    rows = np.array([[float(v) for v in row.split()] for row in re.findall(r"^\d+ .*$", com, re.M)])
    assert left_um(reached(lambda p, sense: p - np.interp(p, rows[:, 1], rows[:, 3 if sense > 0 else 2]))) < 0.25
    assert "NOT CONFIRMED: the sense of the values" in com
    fanuc = render_table(table, FORMATS["fanuc"])
    assert left_um(reached(lambda p, sense: p + fanuc_um(fanuc, p, sense) * 1e-3)) < 1.2  # pulses of 1 um


@pytest.mark.parametrize("travel", ["both", "mean"])
def test_the_program_for_fanuc_sets_what_the_list_says(travel: str) -> None:
    """Parameters and points as the control has them after G11, of the second axis; the compensation is the list's."""
    table = table_of(GAUGE, measured(GAUGE, reversal_um=5.0), step_mm=10.0, travel=travel)
    listed = render_table(table, FORMATS["fanuc"], joint=1)
    text = render_table(table, FORMATS["fanuc-g10"], joint=1)
    assert "\n#3006=1" in text.split("G10 L50")[0]
    assert text.endswith("G11\nM30\n%\n")
    blocks = [re.fullmatch(r"N(\d+)(?: P(\d))? R(-?\d+)", one) for one in text.split("\n") if one.startswith("N")]
    value = {int(n): int(r) for n, p, r in (one.groups() for one in blocks if one) if (p == "2") == (int(n) < 10000)}
    assert len(value) == len(blocks) == text.split("G10 L50\n")[1].split("G11")[0].count("\n")
    assert value[3624] == 10000
    assert 3605 not in value, "its other bits are not ours"
    assert (3626 in value) == (travel == "both")
    low, high, grid = value[3621], value[3622], table.position_mm
    for sense in (1, -1):
        first = value[3626] if travel == "both" and sense < 0 else low
        total = np.cumsum([value[10000 + first + i] for i in range(high - low + 1)]) * value[3623]
        start = value[3627] * value[3623] if travel == "both" and sense < 0 else 0
        error = np.interp(CHECK, grid, total - total[value[3620] - low] + start)
        np.testing.assert_allclose(error, fanuc_um(listed, CHECK, sense), atol=1e-9)
    with pytest.raises(InputError, match="no points left in the control; found 4; expected 0 to 3"):
        render_table(table, FORMATS["fanuc-g10"], joint=4)


def fanuc_um(text: str, p: Array, sense: int) -> Array:
    """Sum of the pulses from the reference, between the points on a straight line."""
    say = {n: float(v) for n, v in re.findall(r"^PARAMETER (\d+) = (\S+)", text, re.M)}
    part = text.split("NUMBER")[1 if sense > 0 else 2]
    rows = np.array([[float(v) for v in row.split()] for row in re.findall(r"^\d+ \S+ \S+$", part, re.M)])
    total = np.cumsum(rows[:, 2]) * say["3623"]
    start = float(re.search(r"3627 = (\S+)", text)[1]) * say["3623"] if sense < 0 else 0.0  # type: ignore[index]
    return np.interp(p, rows[:, 1], total - total[int(say["3620"] - say["3621"])] + start)


@pytest.mark.parametrize("name", ["grbl", "marlin", "rrf"])
def test_scale_and_play_are_taken_away_and_the_rest_is_stated(name: str) -> None:
    """Steps per mm and play from the file; what is left is the wave, as the file says."""
    table = table_of(GAUGE, measured(GAUGE, reversal_um=40.0), step_mm=10.0)
    text = render_table(table, FORMATS[name])
    pattern = r"^M579 X(\S+)" if name == "rrf" else r"^FACTOR \S+ (?:X )?(\d\S+)$"
    factor = float(re.search(pattern, text, re.M)[1])  # type: ignore[index]
    play = float(re.search(r"^(?:M425 (?:F1 )?X|\$160=)(\S+)$", text, re.M)[1])  # type: ignore[index]
    stated = float(re.search(r"left after both: (\S+) um", text)[1])  # type: ignore[index]
    assert play == pytest.approx(0.040, abs=1e-4)
    off = left_um(reached(lambda p, sense: p * factor + (play / 2.0 if sense > 0 else -play / 2.0), reversal_um=40.0))
    assert off <= stated + 0.3 < 6.0
    backwards = table_of(GAUGE, measured(GAUGE, reversal_um=-4.0), step_mm=10.0)
    assert "not that of a play" in render_table(backwards, FORMATS[name])


@settings(max_examples=15, deadline=None)
@given(skew=st.floats(-2e-3, 2e-3), sx=st.floats(-2e-4, 2e-4), sy=st.floats(-2e-4, 2e-4))
def test_a_skew_is_found_and_taken_away(skew: float, sx: float, sy: float) -> None:
    """Indicated x = x (1 + sx) + skew y. Marlin and Klipper send x - f y: f = -skew; scales do not disturb it."""

    def evaluation(corrected: float = 0.0) -> dict[str, Any]:
        """What both diagonals give where the control shows x - corrected y for what its motor says."""
        parts = [diagonal(number, yaw, corrected) for number, yaw in enumerate((0.7, -0.7), 1)]
        return evaluation_to_dict(evaluate(join_recordings(parts), GAUGE))

    def diagonal(number: int, yaw: float, corrected: float) -> Recording:
        axis = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        face = np.tile(np.arange(1, GAUGE.n_faces + 1), 2)
        way = np.where(face % 2 == 1, 1.0, -1.0)
        true = np.outer(GAUGE.position_mm[face - 1] - way * RADIUS, axis)
        seen = true + np.c_[sx * true[:, 0] + skew * true[:, 1], sy * true[:, 1], 0.0 * face]
        frame = pd.DataFrame({"placement": number, "cycle": np.arange(len(face)) // GAUGE.n_faces + 1, "face": face})
        seen[:, 0] -= corrected * seen[:, 1]
        frame[["x_mm", "y_mm", "z_mm"]] = seen
        frame[["approach_i", "approach_j", "approach_k"]] = way[:, None] * axis
        return Recording(frame, {}, "made.csv")

    data = evaluation()
    found = find_skew(data, "evaluation.json", "xy")
    assert found.alpha_rad == pytest.approx(skew, abs=3e-6 + 3e-3 * abs(skew))
    marlin = float(re.search(r"^M852 I(\S+)$", render_skew(found, "marlin", data, "e"), re.M)[1])  # type: ignore[index]
    lengths = re.search(r"^SET_SKEW XY=(\S+),(\S+),(\S+)$", render_skew(found, "klipper", data, "e"), re.M)
    ac, bd, ad = (float(v) for v in lengths.groups())  # type: ignore[union-attr]
    side = np.sqrt(2 * ac * ac + 2 * bd * bd - 4 * ad * ad) / 2.0
    klipper = np.tan(np.pi / 2 - np.arccos((ac * ac - side * side - ad * ad) / (2 * side * ad)))
    assert klipper == pytest.approx(marlin, abs=1e-7)
    assert abs(-marlin - skew) < 3e-6 + 3e-3 * abs(skew)  # true x = (x - f y) - skew y = x
    rrf = re.search(r"^M556 S(\S+) X(\S+)$", render_skew(found, "rrf", data, "e"), re.M)
    tangent = float(rrf[2]) / float(rrf[1])  # type: ignore[index]
    assert tangent == pytest.approx(-marlin, abs=1e-7)
    again = find_skew(evaluation(corrected=tangent), "evaluation.json", "xy")  # the motor gets x + tangent y
    assert abs(again.alpha_rad) < 3e-6 + 3e-3 * abs(skew)
    with pytest.raises(InputError, match="no two placements along the diagonals of yz; found 0 placements"):
        find_skew(data, "evaluation.json", "yz")
