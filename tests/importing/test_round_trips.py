"""A recording exported to a form and imported from it is the same recording, to the printed digits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.exporting import FORMS, ExportOptions, export_recording
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.logs import import_log, read_log, recognise_log
from stepgauge.recording import Recording, read_recording, write_recording
from tests.build import angles, gauges
from tests.importing.made import RADIUS_MM, Case, make_case

POSITION = ["x_mm", "y_mm", "z_mm"]
APPROACH = ["approach_i", "approach_j", "approach_k"]
cases = st.builds(
    make_case,
    gauge=gauges(largest=3),
    yaw=angles,
    pitch=st.floats(-1.2, 1.2),
    cycles=st.integers(1, 3),
    seed=st.integers(0, 99),
)
factory = pytest.TempPathFactory


def exported(factory: pytest.TempPathFactory, case: Case, form: str, **options: object) -> Path:
    path = factory.mktemp("export") / f"recording{FORMS[form]}"
    export_recording(case.recording, form, ExportOptions(**options)).write(path)  # type: ignore[arg-type]
    return path


def same(one: Recording, other: Recording, columns: list[str], digit_mm: float = 0.51e-7) -> None:
    assert one.frame[["placement", "cycle", "face"]].equals(other.frame[["placement", "cycle", "face"]])
    assert np.abs(one.position_mm - other.position_mm).max() <= digit_mm
    assert np.abs(one.approach - other.approach).max() <= 0.51e-10
    for name in columns:
        np.testing.assert_allclose(one.frame[name], other.frame[name], atol=0.51e-4)


@settings(max_examples=25)
@given(
    case=cases,
    delimiter=st.sampled_from(";\t|,"),
    decimal=st.sampled_from(".,"),
    unit=st.sampled_from(["mm", "um", "m", "inch"]),
    surface=st.booleans(),
    covariate=st.lists(st.floats(-1e9, 1e9), min_size=18, max_size=18),
    number=st.integers(1, 9),
)
def test_a_table_as_text(tmp_path_factory, case, delimiter, decimal, unit, surface, covariate, number) -> None:
    case = case.changed(placement=number, wave=covariate[: len(case.recording)])
    if delimiter == decimal:
        with pytest.raises(InputError, match="the decimal mark is the delimiter"):
            exported(tmp_path_factory, case, "csv", delimiter=delimiter, decimal=decimal)
        return
    path = exported(tmp_path_factory, case, "csv", delimiter=delimiter, decimal=decimal, unit=unit, surface=surface)
    assert recognise_log(path) == "csv"
    back = case.stated(path, "csv").recording
    same(back, case.recording, ["time_s", "gauge_temperature_C"])
    assert back.frame["wave"].tolist() == case.recording.frame["wave"].tolist()
    assert back.comments["tip_radius_mm"] == f"{RADIUS_MM:g}"


@settings(max_examples=20)
@given(case=cases, unit=st.sampled_from(["mm", "um", "inch"]), wave=st.floats(-1e9, 1e9))
def test_a_workbook(tmp_path_factory, case, unit, wave) -> None:
    case = case.changed(wave=wave)
    path = exported(tmp_path_factory, case, "xlsx", unit=unit)
    assert recognise_log(path) == "xlsx"
    back = case.stated(path, "xlsx").recording
    same(back, case.recording, ["time_s", "gauge_temperature_C", "wave"])


NAMES = {
    "gauge_serial": "SN-ü/7",
    "machine": "Fräse „Süd“ #3 'x' $$ 5 %",
    "Prüfer*": "M%C3%BC",
    "plain": "100 % of it: yes",
    "long": "ß" * 99,
}


def test_dmis_output_keeps_names_that_are_not_ascii(tmp_path: Path) -> None:
    case = make_case()
    recording = replace(case.recording, comments={**case.recording.comments, **NAMES})
    path = tmp_path / "recording.dmo"
    export_recording(recording, "dmis", ExportOptions()).write(path)
    text = path.read_text("ascii")
    assert max(map(len, text.splitlines())) <= 80
    assert "$$ gauge_serial: SN-_/7\n" in text, "for a person"
    assert "TEXT/OUTFIL,'plain: 100 % of it: yes'" in text, "as it is where it can be"
    log = read_log(path, "dmis")
    assert {name: log.comments[name] for name in NAMES} == NAMES


@settings(max_examples=20)
@given(case=cases, unit=st.sampled_from(["mm", "m", "inch"]), surface=st.booleans(), number=st.integers(1, 12))
def test_dmis_output(tmp_path_factory, case, unit, surface, number) -> None:
    case = case.changed(placement=number)
    path = exported(tmp_path_factory, case, "dmis", unit=unit, surface=surface)
    assert max(map(len, path.read_text().splitlines())) <= 80
    assert recognise_log(path) == "dmis"
    back = case.stated(path, "dmis").recording
    same(back, case.recording, ["gauge_temperature_C"])
    placed = case.imported(path, "dmis").recording
    same(placed, case.recording, ["gauge_temperature_C"])


@settings(max_examples=20)
@given(case=cases, warm=st.booleans())
def test_an_ippdme_session(tmp_path_factory, case, warm) -> None:
    if warm:  # the temperature changes from point to point
        case = case.changed(gauge_temperature_C=20.0 + 0.125 * np.arange(len(case.recording)))
    path = exported(tmp_path_factory, case, "ippdme")
    assert recognise_log(path) == "ippdme"
    for program in (None, case.program()):
        back = case.imported(path, "ippdme", program).recording
        same(back, case.recording, ["time_s", "gauge_temperature_C"])


@settings(max_examples=20)
@given(case=cases, form=st.sampled_from(["log", "probeopen"]))
def test_linuxcnc_logs(tmp_path_factory, case, form) -> None:
    path = exported(tmp_path_factory, case, "linuxcnc", log_form=form)
    assert recognise_log(path) == "linuxcnc"
    back = case.imported(path, "linuxcnc").recording
    case_approach = case.recording.approach
    assert np.abs(back.position_mm - case.recording.position_mm).max() <= (0.51e-7 if form == "log" else 0.51e-6)
    assert np.abs(back.approach - case_approach).max() <= 1e-9  # a log has none: they are the placement's axis
    assert back.frame[["cycle", "face"]].equals(case.recording.frame[["cycle", "face"]])
    assert (back.frame["gauge_temperature_C"] == 20.4).all()
    assert ("time_s" in back.frame) == (form == "log")


@settings(max_examples=20)
@given(case=cases)
def test_the_recording_file_keeps_what_was_imported(tmp_path_factory, case) -> None:
    path = exported(tmp_path_factory, case, "csv")
    imported = case.stated(path, "csv")
    write_recording(path, imported.recording)
    back = read_recording(path)
    assert back.comments == imported.recording.comments
    assert back.comments["import"].split("\n") == list(imported.report)
    same(back, case.recording, ["time_s"])


def test_a_form_without_room_for_several_placements_says_so(tmp_path_factory) -> None:
    case = make_case()
    two = case.changed(placement=np.where(np.arange(len(case.recording)) < 8, 1, 2))
    for form in ("ippdme", "linuxcnc"):
        with pytest.raises(InputError, match=r"has room for one placement; found 1, 2; expected placement_number"):
            export_recording(two.recording, form)
        assert len(export_recording(two.recording, form, ExportOptions(placement=2)).content) > 100
    with pytest.raises(InputError, match="there is no placement 5; found 1, 2"):
        export_recording(two.recording, "csv", ExportOptions(placement=5))
    path = exported(tmp_path_factory, two, "csv")
    assert case.stated(path, "csv").recording.placements == [1, 2]
    with pytest.raises(InputError, match="the file has several placements"):
        case.imported(path, "csv")


def test_what_a_form_cannot_hold_is_said() -> None:
    case = make_case().changed(wave=np.arange(24.0), gauge_temperature_C=20.0 + 0.1 * np.arange(24))
    assert export_recording(case.recording, "dmis").report == ("left out: columns time_s, gauge_temperature_C, wave",)
    assert export_recording(case.recording, "ippdme").report == ("left out: columns wave",)
    assert export_recording(case.recording, "csv").report == ()


def test_surface_points_need_a_radius() -> None:
    case = make_case(comments={})
    with pytest.raises(InputError, match="surface points need the tip radius; expected tip_radius_mm"):
        export_recording(case.recording, "csv", ExportOptions(surface=True))
    out = export_recording(case.recording, "dmis", ExportOptions(surface=True, tip_radius_mm=RADIUS_MM))
    assert b"PRCOMP/ON" in out.content
    assert b",3.000000000\n" in out.content  # SNSDEF has the diameter


def test_points_of_one_side_are_not_those_of_the_other(tmp_path_factory) -> None:
    """Exported by the program's own options: the surface points of fronts lie a radius ahead of the tip centres."""
    case = make_case()
    path = exported(tmp_path_factory, case, "csv", surface=True)
    text = path.read_text()
    assert "# points: surface" in text
    path.write_text(text.replace("# points: surface\n", ""))
    unsaid = case.stated(path, "csv")  # the width of the blocks shows it
    assert "surface points, turned back into tip centres with the tip radius 1.5 mm" in unsaid.report
    same(unsaid.recording, case.recording, [])
    with pytest.raises(
        InputError, match=r"said to be tip centres, but they are compensated .*found points -0.00\d+ mm"
    ):
        import_log(path, "csv", case.gauge, None, None, ImportOptions(surface=False))
    unseen = import_log(path, "csv")  # without a gauge nothing shows
    assert "points are taken as tip centres (not stated)" in unseen.report
