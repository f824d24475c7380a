"""History: numbers of an entry by hand, trend lines against numpy, the store as a mirror of the files."""

from __future__ import annotations

import datetime
import errno
import json
import re
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict, write_evaluation
from stepgauge.figures.history_chart import history_chart
from stepgauge.files.dates import first_moment, moment_in_path, parse_moment
from stepgauge.files.outputs import open_set
from stepgauge.files.text import write_json
from stepgauge.history import QUANTITIES, HistoryEntry, judge, make_series, refresh_store
from stepgauge.history.entries import read_entries
from stepgauge.history.scores import scores
from stepgauge.history.series import FALSE_WARNINGS, FEWEST_FOR_CONTROL, false_warning_words
from stepgauge.history.trend import findings, fit_line, fit_trend
from stepgauge.recording import join_recordings, read_recording
from stepgauge.verbs.history import LIMITS
from stepgauge.web.texts import Words
from tests.build import make_gauge
from tests.measured import ALONG_X, ALONG_Y, run, shipped
from tests.test_compensation import measured

GAUGE = make_gauge(8, u_um=0.0)
START = datetime.datetime(2024, 1, 1)


def write(folder: Path, machine: str | None = "CMM", when: str | None = None, **made: object) -> Path:
    """An evaluation in a folder."""
    recording = measured(GAUGE, **made).assign_comments(machine=machine, measured_at=when)  # type: ignore[arg-type]
    return write_evaluation(folder, evaluate(recording, GAUGE))[0]


def entry(day: float, value: float, u: float = 0.1, **changed: object) -> HistoryEntry:
    """An entry with a scale error and nothing else to say."""
    numbers = {"reversal_um": 0.0, "u_reversal_um": 0.1, "r_eff_mm": 2.0, "u_r_eff_change_um": 0.1}
    names = {"machine": "CMM", "gauge_serial": "T-1", "certificate": "T", "placement": 1, "direction": "x", "cycles": 2}
    more = {"gauge_temperature_C": 20.0, "span_mm": 150.0, "band_um": 1.0, "worst_two_sigma_um": 0.5}
    given = {"path": f"{day}", "sha256": f"{day}", "date_source": "evaluation", **names, **numbers, **more, **changed}
    when = START + datetime.timedelta(days=day)
    return HistoryEntry(measured_at=when, scale_ppm=value, u_scale_ppm=u, **given)  # type: ignore[arg-type]


def test_an_entry_by_hand(tmp_path: Path) -> None:
    """Slope and mean of the printed XM and XR, and R_eff, from the JSON by plain numpy."""
    path = write(tmp_path / "a", when="2026-05-06T07:08", noise_um=0.4, cycles=3, reversal_um=2.0)
    (one,) = read_entries(path, tmp_path, "sha")
    data = json.loads(path.read_text())
    rows = [row for row in data["placements"][0]["faces"] if row["xm_um"] is not None]
    slope = np.polyfit([r["position_mm"] for r in rows], [r["xm_um"] for r in rows], 1)[0] * 1e3
    assert one.scale_ppm == pytest.approx(slope, abs=1e-9)
    assert one.reversal_um == pytest.approx(np.mean([r["xr_um"] for r in rows]), abs=1e-9)
    assert one.measured_at == datetime.datetime(2026, 5, 6, 7, 8)
    assert (one.date_source, one.path, one.direction, one.machine) == ("evaluation", "a/evaluation.json", "x", "CMM")


def test_the_uncertainties_of_an_entry_are_its_scatter(tmp_path: Path) -> None:
    """Monte Carlo: 200 evaluations with noise, four cycles each."""
    entries = []
    for seed in range(200):
        path = write(tmp_path, when="2026-05-06", noise_um=0.5, cycles=4, seed=seed)
        entries += read_entries(path, tmp_path, str(seed))
    for name in ("scale_ppm", "reversal_um"):
        scatter = np.std([getattr(e, name) for e in entries])
        stated = np.sqrt(np.mean([getattr(e, f"u_{name}") ** 2 for e in entries]))
        assert stated == pytest.approx(scatter, rel=0.15)
    r_eff_um = np.std([e.r_eff_mm * 1e3 for e in entries])
    assert np.sqrt(np.mean([e.u_r_eff_change_um**2 for e in entries])) == pytest.approx(r_eff_um, rel=0.15)


def test_where_the_date_comes_from(tmp_path: Path) -> None:
    path = write(tmp_path / "cmm-2023-11-05" / "x")
    assert read_entries(path, tmp_path, "")[0].measured_at == datetime.datetime(2023, 11, 5)
    assert read_entries(path, tmp_path, "")[0].date_source == "path"
    path = write(tmp_path / "undated")
    with pytest.raises(InputError, match=r"nothing says when this was measured.*measured_at.*date_from=.file"):
        read_entries(path, tmp_path, "")
    assert read_entries(path, tmp_path, "", "file")[0].date_source == "file"


def test_dates_are_read_or_refused() -> None:
    assert parse_moment("2024-02-29", "f") == datetime.datetime(2024, 2, 29)
    assert first_moment("2024-03-01; 2024-02-01", "f") == "2024-02-01"
    assert first_moment(None, "f") is None
    assert moment_in_path(Path("a-2024-13-01/2022-01-31_x/y")) == datetime.datetime(2022, 1, 31)
    assert moment_in_path(Path("12024-01-011/x")) is None
    for text, said in (
        ("01.02.2024", "is no date"),
        ("2024-02-30", "is no date"),
        ("2999-01-01", "lies in the future"),
    ):
        with pytest.raises(InputError, match=said):
            parse_moment(text, "f")


def test_a_scale_that_grows_is_no_drift_of_the_reversal(tmp_path: Path) -> None:
    """XR follows the scale by -P / 2 of it: 20 mm and 40 um/m a month are -0.4 um a month, and nothing beside."""
    entries = []
    for month in range(1, 7):
        made = {"error_um": lambda x_mm, ppm=40.0 * month: ppm * 1e-3 * x_mm, "noise_um": 0.02, "cycles": 4}
        path = write(tmp_path / str(month), when=f"2026-{month:02d}-01", seed=10 + month, **made)
        entries += read_entries(path, tmp_path, str(month))
    (one,) = (one for one in make_series(entries) if one.quantity == "reversal_um")
    assert one.trend is not None
    assert one.trend.per_year == pytest.approx(-0.4 * 12, rel=0.05)
    told = [alert.text for alert in judge([one], {"reversal_um": 2.2})]
    assert len(told) == 1
    assert "-2.4 um of it are of the scale error" in told[0]


def test_a_reversal_that_drifts_beside_the_scale_is_said_with_its_own_rate() -> None:
    days = [0.0, 100.0, 200.0, 300.0]
    made = [
        entry(day, day, reversal_um=-0.02 * day, reversal_of_scale_um=-0.01 * day, u_reversal_um=0.01) for day in days
    ]
    (one,) = (one for one in make_series(made) if one.quantity == "reversal_um")
    (text,) = (alert.text for alert in judge([one], {}))
    assert text.startswith(f"drifts by {-0.01 * 365.25:.3g} +- ")
    assert text.endswith("um a year, beside what the scale error shows in it")


@given(
    value=st.lists(st.floats(-5, 5), min_size=3, max_size=12),
    seed=st.integers(0, 1000),
)
def test_the_trend_is_weighted_least_squares(value: list[float], seed: int) -> None:
    random = np.random.default_rng(seed)
    days = np.sort(random.choice(2000, len(value), replace=False)).astype(float)
    y, u = np.array(value), random.uniform(0.05, 0.5, len(value))
    trend = fit_trend(START, days, y, u)
    assert trend is not None
    slope, level = np.polyfit(days / 365.25, y, 1, w=1.0 / u)
    assert trend.per_year == pytest.approx(slope, rel=1e-6, abs=1e-9)
    middle = (trend.middle - START).total_seconds() / 86400 / 365.25
    assert trend.value == pytest.approx(level + slope * middle, rel=1e-6, abs=1e-6)
    design = np.column_stack([np.ones_like(days), days / 365.25])
    own = np.sqrt(np.linalg.inv(design.T @ np.diag(1 / u**2) @ design)[1, 1])
    chi2 = (((y - design @ [level, slope]) / u) ** 2).sum()
    assert trend.u_per_year == pytest.approx(own * max(np.sqrt(chi2 / (len(y) - 2)), 1.0), rel=1e-6)


def test_a_trend_needs_three_dates() -> None:
    assert fit_trend(START, np.array([0.0, 1.0]), np.ones(2), np.ones(2)) is None
    assert fit_trend(START, np.zeros(3), np.arange(3.0), np.ones(3)) is None


def test_two_days_are_no_trend_however_many_measurements_they_have() -> None:
    """Three evaluations on two days drifted by "-2520 +- 160 um/m a year": what days differ by was not known."""
    days = np.array([0.0, 0.05, 0.1, 1.0, 1.05])
    value = np.where(days < 0.5, 0.0, -7.0)
    assert fit_trend(START, days, value, np.full(5, 0.2)) is None
    made = [entry(at, moved) for at, moved in zip(days.tolist(), value.tolist(), strict=True)]
    series = make_series(made)
    assert [one.drift for one in series if one.drift is not None] == []
    assert [one for one in judge(series, {}) if one.kind == "drift"] == []


def test_a_drift_of_days_is_told_as_it_came() -> None:
    made = [entry(float(day), -0.7 * day) for day in range(7)]
    (told,) = (one.text for one in judge(make_series(made), {}) if one.kind == "drift" and one.quantity == "scale_ppm")
    assert re.match(r"drifts by -4\.2\d* \+- .* um/m in 6 days", told), told
    assert "in 6 Tagen" in Words("de").message(told)
    assert Words("de").message(told).startswith("driftet um −4,2")


def test_few_days_have_one_mark_each_and_titles_stand_above_their_panels() -> None:
    chart = history_chart(
        make_series([entry(0.0, 1.0), entry(0.1, 1.1), entry(1.0, 1.2)]), {}, dict.fromkeys(QUANTITIES, "T")
    )
    assert chart["layout"]["xaxis"]["dtick"] == 86_400_000
    panels = [axis["domain"] for key, axis in chart["layout"].items() if key.startswith("yaxis")]
    heads = [one["y"] for one in chart["layout"]["annotations"]]
    assert sorted(heads) == sorted(top for _, top in panels)
    below = sorted(low for low, _ in panels)[1:]
    tops = sorted(heads)[:-1]
    assert all(low - top > 0.03 for low, top in zip(below, tops, strict=True))


def test_one_value_that_jumps_is_outside_its_control_chart() -> None:
    values = [0.1, -0.1, 0.05, 0.0, 0.12, 3.0, -0.05, 0.08]
    series = next(
        s for s in make_series([entry(90.0 * i, v) for i, v in enumerate(values)]) if s.quantity == "scale_ppm"
    )
    assert series.beyond.tolist() == [False] * 5 + [True] + [False] * 2
    found = judge([series], {})
    assert [(w.kind, w.measured_at.date().isoformat()) for w in found] == [("control", "2025-03-26")]


def test_the_control_chart_cries_wolf_as_seldom_as_three_sigma_do() -> None:
    """Normal values: at most 1 % of them are outside, for few and for many dates."""
    random = np.random.default_rng(5)
    for count in (FEWEST_FOR_CONTROL, 8, 20):
        outside = 0
        for _ in range(100):
            entries = [entry(30.0 * i, v) for i, v in enumerate(random.normal(0, 0.1, count))]
            outside += int(make_series(entries)[0].beyond.sum())
        assert outside / (100 * count) < 0.01


def noise(random: np.random.Generator, visits: int, step_u: float = 0.0, between: float = 1.0) -> list[HistoryEntry]:
    """Visits that differ by noise alone, ``between`` times what their repeatability says; the scale grows by steps.

    16 faces of three readings with a repeatability of 0.3 um; ``step_u``: from visit to visit, over u.
    """
    made = []
    for visit in range(visits):
        s = 0.3 * np.sqrt(random.chisquare(2, 16) / 2.0)
        um = 0.1 * between * random.standard_normal(3)
        made.append(
            entry(
                60.0 * visit,
                0.1 * step_u * visit + um[0],
                reversal_um=um[1],
                r_eff_mm=2.0 + 1e-3 * um[2],
                band_um=float(np.ptp(random.normal(0.0, 0.2, 14))),
                worst_two_sigma_um=2.0 * float(s.max()),
                s_um=float(np.sqrt((s**2).mean())),
                s_dof=32.0,
                s_faces=16.0,
                cycles=3,
            )
        )
    return made


@pytest.mark.parametrize(("visits", "between"), [(6, 1.0), (6, 3.0), (12, 1.0)])
def test_a_report_of_noise_warns_in_at_most_one_of_twenty(visits: int, between: float) -> None:
    """Of the whole report: all trends and all values of all quantities, whether visits differ more than they repeat."""
    random = np.random.default_rng(20)
    warned = [bool(judge(make_series(noise(random, visits, between=between)), {})) for _ in range(100)]
    assert np.mean(warned) <= FALSE_WARNINGS


def test_a_drift_of_three_u_from_visit_to_visit_is_found_in_six_visits() -> None:
    """In nine of ten at least, with its rate; nothing else is named beside it more often than noise is."""
    random = np.random.default_rng(21)
    found = []
    for _ in range(100):
        drifts = [one for one in judge(make_series(noise(random, 6, step_u=3.0)), {}) if one.kind == "drift"]
        found.append("scale_ppm" in {one.quantity for one in drifts})
    assert np.mean(found) >= 0.9


def test_the_largest_2s_of_a_visit_is_scored_by_its_own_distribution() -> None:
    """Against draws of sixteen chi-distributed deviations."""
    random = np.random.default_rng(22)
    entries = noise(random, 400)
    largest = np.array([one.worst_two_sigma_um for one in entries])
    scored = scores("worst_two_sigma_um", entries, largest, np.full(400, np.nan))
    assert kstest(scored.score, "norm").pvalue > 0.01
    assert scored.back(scored.score) == pytest.approx(largest, rel=1e-6)


def test_all_looks_are_counted() -> None:
    """Holm (1979), his ordered comparisons by hand."""
    assert findings([0.012, 0.2, 0.016, 0.04], 0.05) == [True, False, True, False]
    assert findings([0.013, 0.02, 0.5, 0.6], 0.05) == [False] * 4
    assert findings([], 0.05) == []
    said = false_warning_words(make_series(noise(np.random.default_rng(1), 6)))
    assert said.startswith("5 trends and 30 values were tested together")
    assert "at most 5%" in said


def test_a_drift_is_one_finding_and_no_alarm_of_the_chart() -> None:
    noise = np.random.default_rng(2).normal(0, 0.05, 10)
    series = make_series([entry(90.0 * i, 0.5 * i + n, 0.05) for i, n in enumerate(noise)])
    found = [w for w in judge(series, {}) if w.quantity == "scale_ppm"]
    assert [w.kind for w in found] == ["drift"]
    trend = series[0].trend
    assert trend is not None
    assert trend.per_year == pytest.approx(0.5 * 365.25 / 90.0, abs=3 * trend.u_per_year)


def test_another_stylus_starts_anew() -> None:
    radii = [2.0, 2.0004, 1.5, 1.4998, 2.0002]
    entries = [entry(30.0 * i, 0.0, r_eff_mm=r) for i, r in enumerate(radii)]
    series = next(s for s in make_series(entries) if s.quantity == "r_eff_change_um")
    np.testing.assert_allclose(series.value, [0.0, 0.4, 0.0, -0.2, 0.2], atol=1e-9)


def test_limits_hold_for_sizes() -> None:
    series = make_series([entry(0, -4.0), entry(90, 2.0), entry(180, 4.5, band_um=3.0)])
    found = judge(series, {"scale_ppm": 3.0, "band_um": 2.0})
    said = [(w.quantity, w.measured_at) for w in found if w.kind == "limit"]
    assert [name for name, _ in said] == ["scale_ppm", "band_um", "scale_ppm"]
    assert found[0].text.startswith("-4 um/m, beyond the limit 3 um/m")


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Three dates and a copy of one."""
    root = tmp_path / "archive"
    for number, date in enumerate(("2024-01-01", "2024-04-01", "2024-07-01")):
        write(root / date, noise_um=0.3, cycles=3, seed=number)
    shutil.copytree(root / "2024-04-01", root / "copy of 2024-04-01")
    return root


def dump(store: Path) -> list[tuple]:
    with sqlite3.connect(store) as connection:
        rows = connection.execute("SELECT * FROM entry ORDER BY path, placement").fetchall()
    connection.close()
    return rows


def test_the_store_is_a_mirror_of_the_files(archive: Path, tmp_path: Path) -> None:
    store = tmp_path / "h.sqlite"
    first = refresh_store(store, archive)
    assert (first.read, first.unchanged, first.gone, len(first.entries)) == (4, 0, 0, 3)
    assert "counted once" in first.remarks[0]
    before = dump(store)
    again = refresh_store(store, archive)
    assert (again.read, again.unchanged) == (0, 4)
    assert repr(again.entries) == repr(first.entries)
    assert dump(store) == before
    rebuilt = refresh_store(store, archive, rebuild=True)
    assert rebuilt.read == 4
    assert repr(rebuilt.entries) == repr(first.entries)
    assert dump(store) == before


@pytest.mark.parametrize("order", ["ab", "ba"])
def test_a_recording_counts_once_alone_and_with_others(tmp_path: Path, order: str) -> None:
    """It was listed twice: by itself, and as a placement of a decision on several."""
    for name, axis in {"a": ALONG_Y, "b": ALONG_X}.items():
        recording = run(axis=axis).recording.assign_comments(machine="CMM", measured_at="2024-01-01")
        recording.write(tmp_path / f"{name}.csv")
    for folder, names in {"alone": "a", "joint": order}.items():
        with open_set():
            made = join_recordings([read_recording(tmp_path / f"{name}.csv") for name in names])
            write_evaluation(tmp_path / folder, evaluate(made, shipped()[0]))
    found = refresh_store(tmp_path / "h.sqlite", tmp_path)
    b = order.index("b") + 1
    assert [(one.path, one.placement) for one in found.entries] == [
        ("alone/evaluation.json", 1),
        ("joint/evaluation.json", b),
    ]
    assert found.remarks == (
        f"joint/evaluation.json, placement {3 - b}: the same as alone/evaluation.json, counted once",
    )


def test_changed_new_and_vanished_files_are_seen(archive: Path, tmp_path: Path) -> None:
    store = tmp_path / "h.sqlite"
    refresh_store(store, archive)
    shutil.rmtree(archive / "copy of 2024-04-01")
    write(archive / "2024-01-01", noise_um=0.3, cycles=3, seed=77)
    write(archive / "2024-10-01", noise_um=0.3, cycles=3, seed=4)
    found = refresh_store(store, archive)
    assert (found.read, found.unchanged, found.gone, len(found.entries)) == (2, 2, 1, 4)


def test_a_file_that_cannot_be_used_is_named_and_the_rest_counts(archive: Path, tmp_path: Path) -> None:
    (archive / "2024-07-01" / "evaluation.json").write_text('{"format": "stepgauge evaluation 1", "gauge": {}')
    other = archive / "2024-08-01"
    other.mkdir()
    write_json(other / "evaluation.json", {"format": "stepgauge evaluation 1", "placements": [{}]})
    for _ in range(2):
        found = refresh_store(tmp_path / "h.sqlite", archive)
        assert len(found.entries) == 2
        assert any("2024-07-01" in r and "not valid JSON" in r for r in found.remarks)
        assert any("2024-08-01" in r and "not a complete evaluation" in r for r in found.remarks)


def test_a_damaged_or_foreign_store_is_not_used(archive: Path, tmp_path: Path) -> None:
    store = tmp_path / "h.sqlite"
    store.write_bytes(b"this is not a data base at all, but long enough to be read as one" * 40)
    with pytest.raises(InputError, match=r"the store is damaged.*rebuild, or another store"):
        refresh_store(store, archive)
    found = refresh_store(store, archive, rebuild=True)
    assert len(found.entries) == 3
    assert "it is now h.sqlite.damaged" in found.remarks[0]
    assert (tmp_path / "h.sqlite.damaged").read_bytes().startswith(b"this is not a data base")
    content = bytearray(store.read_bytes())
    content[100:4096] = b"\xff" * 3996
    store.write_bytes(content)
    with pytest.raises(InputError, match="expected rebuild, or another store"):
        refresh_store(store, archive)
    with sqlite3.connect(tmp_path / "other.sqlite") as connection:
        connection.execute("CREATE TABLE recipes (name TEXT)")
    connection.close()
    with pytest.raises(InputError, match=r"not a store of this stepgauge; found version 0, tables recipes"):
        refresh_store(tmp_path / "other.sqlite", archive)
    refresh_store(tmp_path / "other.sqlite", archive, rebuild=True)
    assert (tmp_path / "other.sqlite.damaged").exists(), "somebody's recipes are not thrown away"
    refresh_store(store, archive, rebuild=True)
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(archive / "2024-01-01", elsewhere / "2024-01-01")
    with pytest.raises(InputError, match="this store is of another folder"):
        refresh_store(store, elsewhere)


def test_no_flipped_bit_changes_an_entry(archive: Path, tmp_path: Path) -> None:
    """A bit in each part of the file: what is read is as it was, or nothing is."""
    store = tmp_path / "h.sqlite"
    first = refresh_store(store, archive).entries
    whole, refused = store.read_bytes(), 0
    used = [place for place in range(len(whole)) if whole[place]]
    for number, place in enumerate(used[:: len(used) // 120]):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << number % 8
        store.write_bytes(bytes(damaged))
        found = said = None
        try:
            found = refresh_store(store, archive)
        except InputError as error:
            said = str(error)
        if found is not None:
            assert repr(found.entries) == repr(first)
            continue
        refused += 1
        assert "rebuild" in str(said)
        assert store.read_bytes() == damaged
    assert refused > 60
    store.write_bytes(bytes(damaged))
    assert repr(refresh_store(store, archive, rebuild=True).entries) == repr(first)


def test_a_row_that_somebody_changed_is_refused(archive: Path, tmp_path: Path) -> None:
    store = tmp_path / "h.sqlite"
    refresh_store(store, archive)
    with sqlite3.connect(store) as connection:
        connection.execute("UPDATE entry SET scale_ppm = scale_ppm + 1")
    connection.close()
    with pytest.raises(InputError, match=r"the store was changed after it was written; expected rebuild"):
        refresh_store(store, archive)


def test_a_store_that_could_not_be_written_is_not_there(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> str:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("stepgauge.history.store._checksum", full)
    with pytest.raises(InputError, match="No space left on device"):
        refresh_store(tmp_path / "h" / "h.sqlite", archive)
    assert not list((tmp_path / "h").iterdir())


@pytest.mark.parametrize("text", ["0026-08-02", "1969-12-31T23:59", "0001-01-01T00:00+14:00"])
def test_a_year_before_all_measurements_is_a_mistake(text: str) -> None:
    with pytest.raises(InputError, match=r"too long ago; found .*; expected a date from 1970 on"):
        parse_moment(text, "here")
    assert moment_in_path(Path(text[:10])) is None


def test_a_failure_leaves_the_store_as_it_was(archive: Path, tmp_path: Path) -> None:
    store = tmp_path / "h.sqlite"
    refresh_store(store, archive)
    before = dump(store)
    write(archive / "2024-10-01", seed=4)

    def interrupted(done: int, of: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        refresh_store(store, archive, progress=interrupted)
    assert dump(store) == before


def test_the_names_of_the_limits_are_the_quantities() -> None:
    assert set(LIMITS) == set(QUANTITIES)


def test_a_gauge_across_is_a_direction_of_its_own(tmp_path: Path) -> None:
    data = evaluation_to_dict(evaluate(measured(GAUGE, yaw_deg=45.0), GAUGE))
    write_json(tmp_path / "evaluation.json", data | {"measured_at": "2024-01-01"})
    (one,) = read_entries(tmp_path / "evaluation.json", tmp_path, "")
    assert one.direction == "(0.71 0.71 0.00)"


def test_a_drift_of_three_u_over_six_visits_is_found_as_often_as_a_test_can() -> None:
    """Far from always: with known scatter and one test alone, one-sided at 5 %, it were 81 %."""
    random = np.random.default_rng(23)
    found = [
        any(one.quantity == "scale_ppm" for one in judge(make_series(noise(random, 6, step_u=0.6)), {}))
        for _ in range(100)
    ]
    assert 0.15 <= np.mean(found) <= 0.5


def test_weights_share_the_false_warnings_and_only_growth_of_a_range_counts() -> None:
    assert findings([0.02, 0.02], 0.05, [0.5, 0.5]) == [True, True]
    assert findings([0.03, 0.02], 0.05, [0.9, 0.1]) == [True, True]
    assert findings([0.02, 0.03], 0.05, [0.1, 0.9]) == [True, True]
    assert findings([0.04, 0.02], 0.05, [0.7, 0.3]) == [False, False]
    years = np.arange(6.0)
    line = fit_line(years, -years + 0.01 * np.array([1, -1, 1, 1, -1, -1]), np.full(6, np.nan))
    assert line is not None
    assert line.chance_probability(growth=True) > 0.9
    assert line.chance_probability() < 1e-6
