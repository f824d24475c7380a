"""Tables as people hand them over: names, units, marks, encodings, dates, workbooks."""

from __future__ import annotations

import datetime
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from stepgauge.errors import InputError
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.logs import import_log
from stepgauge.importing.tables.columns import POINTS, parse_columns, read_columns
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import split_name
from tests.importing.made import RADIUS_MM, Case, make_case, table_of

XYZ = {"x_mm": "X", "y_mm": "Y", "z_mm": "Z"}


def write(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "points.csv"
    path.write_bytes(text.encode(encoding))
    return path


def read(case: Case, path: Path, layout: TableLayout | None = None, source: str = "csv", **options: object):
    choice = ImportOptions(**options)  # type: ignore[arg-type]
    return import_log(path, source, case.gauge, case.placement, None, choice, layout)


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("X [mm]", "X", "mm"),
        ("X (inch)", "X", "inch"),
        ("Position X / µm", "Position X", "µm"),
        ("T in °C", "T", "°C"),
        ("x_mm", "x", "mm"),
        ("x mm", "x", "mm"),
        ("X/mm", "X", "mm"),
        ("X, mm", "X", "mm"),
        ("v [mm/min]", "v", "mm/min"),
        ("speed_mm/s", "speed", "mm/s"),
        ("speed_mm_s", "speed_mm_s", None),
        ("Feed mm/min", "Feed mm/min", None),
        ("growth_um_per_K", "growth_um_per_K", None),
        ("Position in mm", "Position", "mm"),
        ("Feuchte [%]", "Feuchte [%]", None),
        ("X", "X", None),
    ],
)
def test_names_and_units_are_told_apart(header: str, name: str, unit: str | None) -> None:
    found, known = split_name(header)
    assert (found, known.name if known else None) == (name, unit)


@pytest.mark.parametrize(
    ("header", "target"),
    [
        ("X", "x_mm"),
        ("x_mm", "x_mm"),
        ("X-Wert", "x_mm"),
        ("Messwert Y [mm]", "y_mm"),
        ("Position Z / µm", "z_mm"),
        ("Actual X", "x_mm"),
        ("X nominal", None),
        ("Soll X", None),
        ("Zyklus", "cycle"),
        ("Run No", "cycle"),
        ("Fläche", "face"),
        ("Lage", "placement"),
        ("T [°C]", "gauge_temperature_C"),
        ("t [s]", "time_s"),
        ("Temperatur Werkstück", "gauge_temperature_C"),
        ("Temperature scale x", "scale_temperature_x_C"),
        ("T Stufenendmaß [°C]", "gauge_temperature_C"),
        ("Temperatur Maßstab Z", "scale_temperature_z_C"),
        ("Step gauge temperature [°C]", "gauge_temperature_C"),
        ("Werkstücktemperatur [°C]", "gauge_temperature_C"),
        ("Prüflingstemperatur", "gauge_temperature_C"),
        ("Temp. Prüfling", "gauge_temperature_C"),
        ("Temp. Lehre °C", "gauge_temperature_C"),
        ("Stufenendmaß [°C]", "gauge_temperature_C"),
        ("Temperatur Endmaß", "gauge_temperature_C"),
        ("Objekttemperatur", "gauge_temperature_C"),
        ("Material temperature", "gauge_temperature_C"),
        ("Part temp", "gauge_temperature_C"),
        ("Maßstabtemperatur X", "scale_temperature_x_C"),
        ("Lufttemperatur", None),
        ("Air temperature at part", None),
        ("Probe temperature", None),
        ("Stufenendmaß", None),
        ("Speed [mm/min]", "speed_mm_s"),
        ("approach_k", "approach_k"),
        ("approach x", "approach_i"),
        ("nx", "normal_i"),
        ("K", "normal_k"),
        ("Feuchte [%]", None),
        ("Nr", None),
        ("Position", None),
    ],
)
def test_what_a_column_is(header: str, target: str | None) -> None:
    assert read_columns([header], [None], {}, POINTS)[0].role == target


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize(("delimiter", "decimal"), [(";", ","), ("\t", "."), ("|", ","), (",", ".")])
def test_encodings_and_marks(tmp_path: Path, encoding: str, delimiter: str, decimal: str) -> None:
    case = make_case()
    above = ["Messprotokoll Stufenendmaß", "", "# Prüfer: Müller", "% made by hand"]
    columns = {"x_mm": "X / mm", "y_mm": "Y-Wert", "z_mm": "Z (mm)", "gauge_temperature_C": "T in °C"}
    path = write(tmp_path, table_of(case, columns, delimiter, decimal, above=above), encoding)
    imported = read(case, path)
    back = imported.recording
    assert np.abs(back.position_mm - case.recording.position_mm).max() < 0.51e-6
    assert back.frame[["cycle", "face"]].equals(case.recording.frame[["cycle", "face"]])
    assert (back.frame["gauge_temperature_C"] == 20.4).all()
    assert back.comments["Prüfer"] == "Müller"
    assert any("T in °C -> gauge_temperature_C (from °C)" in line for line in imported.report)


@pytest.mark.parametrize(
    ("unit", "factor", "temperature", "celsius"),
    [("mm", 1.0, "K", 293.55), ("inch", 25.4, "°F", 68.72), ("µm", 1e-3, "degC", 20.4), ("m", 1e3, "C", 20.4)],
)
def test_units_are_turned_into_those_of_a_recording(tmp_path: Path, unit, factor, temperature, celsius) -> None:
    case = make_case()
    written = case.changed(
        **{name: case.recording.frame[name] / factor for name in XYZ},
        gauge_temperature_C=celsius,
        speed_mm_s=180.0,
        time_s=case.recording.frame["time_s"] / 60.0,
    )
    columns = {name: f"{title} [{unit}]" for name, title in XYZ.items()}
    more = {"gauge_temperature_C": f"T [{temperature}]", "speed_mm_s": "v (mm/min)", "time_s": "t [min]"}
    path = write(tmp_path, table_of(written, columns | more, digits=10))
    back = read(case, path).recording
    assert np.abs(back.position_mm - case.recording.position_mm).max() < 1e-6
    assert (back.frame["gauge_temperature_C"] == 20.4).all(), "not 20.400000000000034"
    np.testing.assert_allclose(back.frame["speed_mm_s"], 3.0)
    np.testing.assert_allclose(back.frame["time_s"], case.recording.frame["time_s"], atol=1e-6)
    bare = write(tmp_path, table_of(written, XYZ | {"gauge_temperature_C": "T"}, digits=10))
    names = {"µm": "um", "°F": "F", "degC": "C"}
    layout = TableLayout(unit=names.get(unit, unit), temperature_unit=names.get(temperature, temperature))
    assert np.abs(read(case, bare, layout).recording.position_mm - case.recording.position_mm).max() < 1e-6


def test_a_temperature_that_may_be_the_gauges_is_asked_about(tmp_path: Path) -> None:
    """Kept as a covariate it would not correct the lengths, and nothing else would say so."""
    case = make_case()
    named = [f"{one} [°C]" for one in ("Sensor 2", "Luft")]
    sensors = case.changed(**dict.fromkeys(named, 21.0))
    path = write(tmp_path, table_of(sensors, XYZ | {one: one for one in named}))
    (warning,) = (one for one in read(case, path).report if one.startswith("warning"))
    assert "'Sensor 2 [°C]', 'Luft [°C]'" in warning
    assert '--column gauge_temperature_C="Sensor 2 [°C]"' in warning
    for options in ({"layout": TableLayout(columns={"gauge_temperature_C": named[0]})}, {"gauge_temperature_C": 21.0}):
        told = read(case, path, **options)
        assert not [one for one in told.report if one.startswith("warning")]
        assert (told.recording.frame["gauge_temperature_C"] == 21.0).all()


def test_a_row_of_units_below_the_header(tmp_path: Path) -> None:
    case = make_case()
    text = table_of(case.changed(x_mm=case.recording.frame["x_mm"] * 1e3), XYZ | {"gauge_temperature_C": "T"})
    header, body = text.split("\n", 1)
    path = write(tmp_path, f"{header}\n[µm];mm;mm;°C\n{body}")
    assert np.abs(read(case, path).recording.position_mm - case.recording.position_mm).max() < 1e-6


def test_columns_are_mapped_by_hand_and_the_others_kept_or_dropped(tmp_path: Path) -> None:
    case = make_case()
    case = case.changed(humidity=45.5, nominal=np.arange(24.0))
    columns = {"x_mm": "Ergebnis 1", "y_mm": "Ergebnis 2", "z_mm": "Ergebnis 3", "humidity": "Feuchte, rel. [%]"}
    text = table_of(case, {**columns, "nominal": "X Soll"})
    lines = [line + (";Bemerkung" if n == 0 else ";ok") for n, line in enumerate(text.splitlines())]
    path = write(tmp_path, "\n".join(lines))
    with pytest.raises(
        InputError, match=r"no row names the columns x, y and z, .*found Ergebnis 1, .*columns=.{1,2}x_mm"
    ):
        read(case, path)
    mapping = parse_columns([f"{target}=Ergebnis {n}" for n, target in enumerate(XYZ, 1)])
    imported = read(case, path, TableLayout(columns=mapping))
    assert imported.recording.frame["Feuchte_rel_percent"].tolist() == [45.5] * 24
    assert imported.recording.frame["X_Soll"].tolist() == list(np.arange(24.0))
    assert "dropped: columns Bemerkung (not numbers in every row)" in imported.report
    with pytest.raises(InputError, match="there is no column 'Ergebnis 9' for x_mm; found Ergebnis 1, Ergebnis 2"):
        read(case, path, TableLayout(columns={**mapping, "x_mm": "Ergebnis 9"}))
    with pytest.raises(InputError, match="columns: not understood; found 'w_mm=A'; expected NAME=HEADER"):
        parse_columns(["w_mm=A"])


def test_approaches_and_normals(tmp_path: Path) -> None:
    case = make_case()
    ijk = {f"approach_{axis}": f"n{other}" for axis, other in zip("ijk", "xyz", strict=True)}
    path = write(tmp_path, table_of(case, XYZ | ijk, digits=10))
    with pytest.raises(InputError, match=r"directions point out of the faces: .*found 24 of 24 directions against"):
        read(case, path)
    back = read(case, path, TableLayout(columns=ijk)).recording
    assert np.abs(back.approach - case.recording.approach).max() < 1e-9
    faces = {"cycle": "Cycle", "face": "Face"}
    stated = write(tmp_path, table_of(case, XYZ | ijk | faces, digits=10))
    back = import_log(stated, "csv", layout=TableLayout(columns=ijk)).recording
    assert back.frame[["cycle", "face"]].equals(case.recording.frame[["cycle", "face"]])
    with pytest.raises(InputError, match="does not say which face each point belongs to; found no cycle, face"):
        import_log(write(tmp_path, table_of(case, XYZ)), "csv")


def timed(tmp_path: Path, case: Case, style: str, start: datetime.datetime, hours_back: int = 0) -> Path:
    """A table with a time every 4 s; the clock is set back before the 13th row."""
    lines = table_of(case, XYZ).splitlines()
    lines[0] += ";Uhrzeit"
    for n in range(24):
        moment = start + datetime.timedelta(seconds=4.0 * n, hours=-hours_back if n >= 12 else 0)
        lines[n + 1] += ";" + moment.strftime(style)
    return write(tmp_path, "\n".join(lines))


@pytest.mark.parametrize(
    ("style", "kept"),
    [
        ("%Y-%m-%d %H:%M:%S.%f", "2026-03-30T23:59:20"),
        ("%Y-%m-%dT%H:%M:%SZ", "2026-03-30T23:59:20+00:00"),
        ("%Y-%m-%dT%H:%M:%S.%f0+01:00", "2026-03-30T23:59:20+01:00"),
        ("%Y-%m-%d %H:%M:%S -0500", "2026-03-30T23:59:20-05:00"),
        ("%d.%m.%Y %H:%M:%S", "2026-03-30T23:59:20"),
        ("%m/%d/%Y %H:%M:%S", "2026-03-30T23:59:20"),
        ("%H:%M:%S", None),
    ],
)
def test_dates_and_times_of_day_become_seconds(tmp_path: Path, style: str, kept: str | None) -> None:
    """The run passes midnight of 30 March, which is no month."""
    case = make_case().changed(time_s=4.0 * np.arange(24))
    told = read(case, timed(tmp_path, case, style, datetime.datetime(2026, 3, 30, 23, 59, 20)))
    assert told.recording.frame["time_s"].tolist() == case.recording.frame["time_s"].tolist()
    assert told.recording.comments.get("measured_at") == kept
    assert not [line for line in told.report if line.startswith("warning")]
    assert any("Uhrzeit -> time_s (from dates and times)" in line for line in told.report)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        (datetime.datetime(2026, 3, 4, 10, 0), "04/03/2026 10:00:00 may be day/month or month/day"),
        (datetime.datetime(2926, 3, 30, 10, 0), "30/03/2926 10:00:00 cannot be (is the clock set?)"),
        (datetime.datetime(1970, 1, 1, 10, 0), "01/01/1970 10:00:00 cannot be (is the clock set?)"),
    ],
)
def test_a_date_in_doubt_is_not_kept(tmp_path: Path, start: datetime.datetime, words: str) -> None:
    case = make_case()
    told = read(case, timed(tmp_path, case, "%d/%m/%Y %H:%M:%S", start))
    assert f"warning: the date of the measurement is not kept: {words}" in told.report
    assert "measured_at" not in told.recording.comments


@pytest.mark.parametrize("dates", ["Datum", "Date"])
def test_a_date_in_a_column_of_its_own(tmp_path: Path, dates: str) -> None:
    case = make_case().changed(time_s=4.0 * np.arange(24))
    lines = timed(tmp_path, case, "%H:%M:%S;%d.%m.%Y", datetime.datetime(2026, 3, 4, 23, 59, 20)).read_text()
    told = read(case, write(tmp_path, lines.replace("Uhrzeit", f"Uhrzeit;{dates}")))
    assert told.recording.comments["measured_at"] == "2026-03-04T23:59:20"
    assert told.recording.frame["time_s"].tolist() == case.recording.frame["time_s"].tolist()
    assert not any("dropped" in line for line in told.report)
    told = read(case, write(tmp_path, lines.replace("Uhrzeit", f"Uhrzeit;{dates}").replace(".2026", ". im März")))
    assert "measured_at" not in told.recording.comments
    assert told.recording.frame["time_s"].tolist() == case.recording.frame["time_s"].tolist()


def test_a_clock_that_is_set_back_is_told_with_its_row(tmp_path: Path) -> None:
    case = make_case()
    path = timed(tmp_path, case, "%d.%m.%Y %H:%M:%S", datetime.datetime(2026, 10, 25, 2, 59, 20), hours_back=1)
    (warning,) = (line for line in read(case, path).report if line.startswith("warning"))
    assert f"{path}:14: the time runs back by 3596 s, from 25.10.2026 03:00:04 to 25.10.2026 02:00:08" in warning


def test_a_date_that_may_be_two_days_is_refused(tmp_path: Path) -> None:
    case = make_case()
    lines = table_of(case, XYZ).splitlines()
    lines[0] += ";Time"
    for n in range(24):
        lines[n + 1] += f";{3 if n < 20 else 4:02d}/05/2026 10:{n:02d}:00"
    with pytest.raises(InputError, match=r"points.csv:2: the dates of column 'Time' may be day/month or month/day"):
        read(case, write(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("X;Y;Z", "X;Y;Y", "no row names the columns x, y and z"),
        ("X;Y;Z", "X;Y;Z;X-Wert", "several columns may be the x_mm; found 'X' and 'X-Wert'; expected columns"),
        ("X;Y;Z", "X [°C];Y;Z", "column 'X \\[°C\\]' cannot be x_mm; found unit °C; expected a unit of length"),
        ("\n1", "\nabc", "points.csv:2: column 'X' is not a number; found 'abc"),
        ("\n1", "\n;1", "points.csv:2: the row has more cells than the header"),
    ],
)
def test_tables_that_are_wrong_are_refused_with_their_row(tmp_path: Path, old: str, new: str, words: str) -> None:
    case = make_case()
    text = table_of(case, XYZ)
    assert old in text
    with pytest.raises(InputError, match=words):
        read(case, write(tmp_path, text.replace(old, new, 1)))


def two_rows(case: Case, upper: str, lower: str) -> str:
    """A table with a header of two rows; its columns are face, x, y, z and the temperature."""
    columns = dict.fromkeys(("face", "x_mm", "y_mm", "z_mm", "gauge_temperature_C"), "")
    return "\n".join([upper, lower, *table_of(case, columns).splitlines()[1:]])


@pytest.mark.parametrize(
    ("upper", "lower"),
    [
        ("Fläche;Tastkugelmitte [mm];;;Temperatur Lehre", ";X;Y;Z;°C"),
        ("Fläche;Ist;;;Lehre", ";X [mm];Y [mm];Z [mm];Temperatur [°C]"),
        (";Soll;;;", "Fläche;X;Y;Z;Temperatur"),
    ],
)
def test_a_header_of_two_rows_with_merged_names(tmp_path: Path, upper: str, lower: str) -> None:
    case = make_case()
    path = write(tmp_path, "Protokoll;;;;\n" + two_rows(case, upper, lower))
    back = read(case, path)
    assert np.abs(back.recording.position_mm - case.recording.position_mm).max() < 0.51e-6
    assert (back.recording.frame["gauge_temperature_C"] == 20.4).all()
    assert back.recording.frame["face"].equals(case.recording.frame["face"])
    rows = 2 if "Soll" in upper else 1  # what names nothing that the row below leaves open is no header
    assert any(one.startswith(f"dropped: {rows} lines that are no rows of the table") for one in back.report)


def test_a_group_of_nominal_positions_beside_the_measured_ones(tmp_path: Path) -> None:
    case = make_case()
    rows = [line.split(";") for line in table_of(case, XYZ).splitlines()[1:]]
    text = "\n".join(["Soll;;;Ist;;;", "X;Y;Z;X;Y;Z;", *(";".join(["1", "2", "3", *row, ""]) for row in rows)])
    back = read(case, write(tmp_path, text))
    assert np.abs(back.recording.position_mm - case.recording.position_mm).max() < 0.51e-6


def test_a_temperature_whose_column_is_a_unit_alone_is_asked_for(tmp_path: Path) -> None:
    case = make_case()
    path = write(tmp_path, two_rows(case, "Stufe 9;;;;", "Fläche;X;Y;Z;[°C]"))
    with pytest.raises(InputError, match=r"whose temperature is column '\[°C\]'\?; expected columns"):
        read(case, path)
    assert (read(case, path, gauge_temperature_C=22.7).recording.frame["gauge_temperature_C"] == 22.7).all()


def test_exchanged_columns_are_named_and_not_taken_for_another_unit(tmp_path: Path) -> None:
    case = make_case()
    path = write(tmp_path, table_of(case, XYZ).replace("X;Y;Z", "Y;X;Z"))
    with pytest.raises(InputError, match=r"\(the columns of x and y look exchanged\); found"):
        read(case, path)


def test_a_column_without_a_name_is_told(tmp_path: Path) -> None:
    case = make_case()
    lines = table_of(case, XYZ).splitlines()
    report = read(case, write(tmp_path, "\n".join([lines[0] + ";;", *(f"{line};7;" for line in lines[1:])]))).report
    assert "dropped: 1 columns without a name" in report


def test_thousands_in_doubt_ask_for_the_decimal_mark(tmp_path: Path) -> None:
    case = make_case()
    text = "X;Y;Z\n" + "112,345;-45,678;98,765\n" * 24
    with pytest.raises(
        InputError, match=r"a comma may be a decimal mark or group thousands; found '112,345'; expected"
    ):
        read(case, write(tmp_path, text))
    with pytest.raises(InputError, match="aimed beside the blocks"):  # read as 112345 mm
        read(case, write(tmp_path, text), TableLayout(decimal="."))
    rounded = table_of(case, XYZ, digits=3)
    back = read(case, write(tmp_path, rounded), TableLayout(decimal=",")).recording
    assert np.abs(back.position_mm - case.recording.position_mm).max() <= 0.51e-3


def test_empty_and_foreign_files(tmp_path: Path) -> None:
    case = make_case()
    for text, words in (
        ("", "the table is empty"),
        ("X;Y;Z\n", "no table of numbers is found"),
        ("nothing to see\nhere\n", "no table of numbers is found"),
    ):
        with pytest.raises(InputError, match=words):
            read(case, write(tmp_path, text))
    (tmp_path / "points.csv").write_bytes(b"\x00\x01\x02PK" * 20)
    with pytest.raises(InputError, match="this is not a text file"):
        read(case, tmp_path / "points.csv")
    with pytest.raises(InputError, match="no such file"):
        read(case, tmp_path / "none.csv")


def test_excel_separators_are_honoured(tmp_path: Path) -> None:
    case = make_case()
    path = write(tmp_path, "sep=|\n" + table_of(case, XYZ, "|"))
    assert len(read(case, path).recording) == 24


def workbook(tmp_path: Path, case: Case, as_text: bool = False) -> Path:
    """A workbook of two sheets, header in row 3, times as Excel has them."""
    book = openpyxl.Workbook()
    book.active.title = "Deckblatt"
    book.active.append(["Protokoll"])
    sheet = book.create_sheet("Messung")
    sheet.append(["Stufenendmaß", None, "20.4"])
    sheet.append([])
    sheet.append(["X [mm]", "Y [mm]", "Z [mm]", "Zeit", "T [°C]", "ok"])
    start = datetime.datetime(2026, 3, 2, 10, 0, 0)
    for (_, row), position in zip(case.recording.frame.iterrows(), case.recording.position_mm, strict=True):
        cells = [f"{v:.7f}".replace(".", ",") for v in position] if as_text else [float(v) for v in position]
        moment = start + datetime.timedelta(seconds=float(row["cycle"]) * 60 + float(row["face"]))
        sheet.append([*cells, moment, "20,4" if as_text else 20.4, True])
    path = tmp_path / "points.xlsx"
    book.save(path)
    return path


@pytest.mark.parametrize("as_text", [False, True])
def test_a_workbook_with_a_sheet_to_choose(tmp_path: Path, as_text: bool) -> None:
    case = make_case()
    path = workbook(tmp_path, case, as_text)
    with pytest.raises(InputError, match="several sheets; found 'Deckblatt', 'Messung'; expected sheet NAME"):
        read(case, path, source="xlsx")
    with pytest.raises(InputError, match="the workbook has no sheet 'messung'"):
        read(case, path, TableLayout(sheet="messung"), source="xlsx")
    imported = read(case, path, TableLayout(sheet="Messung"), source="xlsx")
    back = imported.recording
    assert np.abs(back.position_mm - case.recording.position_mm).max() <= 0.51e-7
    expected = 60 * (back.frame["cycle"] - 1) + back.frame["face"] - 1
    assert back.frame["time_s"].tolist() == expected.tolist()
    assert (back.frame["gauge_temperature_C"] == 20.4).all()
    assert "sheet 'Messung' (dropped: sheets Deckblatt)" in imported.report
    assert "dropped: columns ok (not numbers in every row)" in imported.report


def test_a_broken_workbook_is_refused(tmp_path: Path) -> None:
    case = make_case()
    path = workbook(tmp_path, case)
    whole = path.read_bytes()
    middle = whole.index(b"xl/worksheets/sheet2.xml") + 60
    path.write_bytes(whole[:middle] + bytes(40) + whole[middle + 40 :])
    with pytest.raises(InputError, match="the workbook is damaged: "):
        read(case, path, TableLayout(sheet="Messung"), source="xlsx")
    path.write_bytes(whole[:2000])
    with pytest.raises(InputError, match="not an Excel workbook"):
        read(case, path, source="xlsx")
    with pytest.raises(InputError, match="no such file"):
        read(case, tmp_path / "none.xlsx", source="xlsx")


def test_surface_points_in_a_table_show_by_their_distance(tmp_path: Path) -> None:
    """Points compensated by the radius lie on the faces; with the radius they are turned back into tip centres."""
    case = make_case(comments={})
    surface = case.recording.position_mm + RADIUS_MM * case.recording.approach
    on_faces = case.changed(**{name: surface[:, i] for i, name in enumerate(XYZ)})
    path = write(tmp_path, table_of(on_faces, XYZ, digits=7))
    with pytest.raises(InputError, match="the radius is not known; expected tip_radius_mm"):
        read(case, path)
    imported = read(case, path, tip_radius_mm=RADIUS_MM)
    assert np.abs(imported.recording.position_mm - case.recording.position_mm).max() < 1e-7
    assert "surface points, turned back into tip centres with the tip radius 1.5 mm" in imported.report
    with pytest.raises(InputError, match=r"said to be tip centres, but they are compensated .*points -0.00\d+ mm"):
        read(case, path, tip_radius_mm=RADIUS_MM, surface=False)
    centres = write(tmp_path, table_of(case, XYZ, digits=7))
    with pytest.raises(InputError, match=r"said to be compensated by .* but they are tip centres; found points 1.49"):
        read(case, centres, tip_radius_mm=RADIUS_MM, surface=True)


@pytest.mark.parametrize("side", [0, 1])
def test_touches_in_one_direction_do_not_show_whether_points_are_centres(tmp_path: Path, side: int) -> None:
    """Where they stand is that of the placement as well: it is asked, and what is stated is taken."""
    case = make_case(comments={})
    frame = case.recording.frame
    one_way = replace(case, recording=replace(case.recording, frame=frame[frame["face"] % 2 == side]))
    path = write(tmp_path, table_of(one_way, XYZ))
    with pytest.raises(InputError, match=r"touches in one direction.*expected points=") as refused:
        read(case, path, tip_radius_mm=RADIUS_MM)
    assert "nan" not in str(refused.value)
    for surface in (False, True):
        assert "nan" not in " ".join(read(case, path, tip_radius_mm=RADIUS_MM, surface=surface).report)


@pytest.mark.parametrize("unit", ["X [mm]", "X (mm)", "X mm", "X/mm", "X, mm", "X_mm", "X in mm"])
def test_a_unit_is_read_from_a_header_however_it_stands_there(tmp_path: Path, unit: str) -> None:
    case = make_case()
    headers = {name: unit.replace("X", letter) for name, letter in zip(XYZ, "XYZ", strict=True)}
    found = read(case, write(tmp_path, table_of(case, headers)))
    np.testing.assert_allclose(found.recording.position_mm, case.recording.position_mm, atol=1e-3)
