"""A gauge's DCC becomes a gauge file: any layout and unit that says enough, and clear errors for those that do not."""

from __future__ import annotations

import datetime
import re
import tomllib
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from stepgauge.cli import main
from stepgauge.dcc.gauge_read import StatedGauge, import_gauge, write_gauge
from stepgauge.dcc.gauge_write import gauge_certificate
from stepgauge.dcc.xml import parse_xml, validate
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge, read_gauge
from tests.build import gauges
from tests.dcc.made import SAID, SCHEMA, gauge_laboratory, gauge_xml, laboratory, machine_xml, needs_schema
from tests.measured import shipped


def put(folder: Path, text: str) -> Path:
    (folder / "gauge.xml").write_text(text)
    return folder / "gauge.xml"


def swap(pattern: str, new: str, text: str | None = None) -> str:
    changed, count = re.subn(pattern, new, text or gauge_xml(), count=1, flags=re.DOTALL)
    assert count == 1, pattern
    return changed


def row(name: str, text: str | None = None) -> list[float]:
    """The values of a list, by its refType."""
    found = re.search(rf'refType="{name}".*?<si:valueXMLList>([^<]*)', text or gauge_xml(), re.DOTALL)
    assert found
    return [float(word) for word in found[1].split()]


@needs_schema
def test_the_certificate_of_a_gauge_validates() -> None:
    from dcclib.validation import SchematronValidator

    validate(parse_xml(gauge_xml().encode(), "g.xml"), SCHEMA, "g.xml")
    result = SchematronValidator.for_dcc().validate_str(gauge_xml())
    assert [r.text for r in result.failed_assertions + result.successful_reports if r.role == "error"] == []


def apart_nm(one: Gauge, other: Gauge) -> float:
    """Largest difference of certified positions, nominal positions and uncertainties, nm; a file has whole nm."""
    mm = (one.position_mm - other.position_mm, one.nominal_mm - other.nominal_mm, (one.u_um - other.u_um) * 1e-3)
    return max(float(np.abs(difference).max()) for difference in mm) * 1e6


def test_round_trip_of_the_shipped_gauge(tmp_path: Path) -> None:
    original = shipped()[0]
    gauge = write_gauge(tmp_path / "mine.toml", import_gauge(put(tmp_path, gauge_xml())))
    assert apart_nm(gauge, original) < 0.51
    assert apart_nm(read_gauge(tmp_path / "mine.toml"), original) < 0.51
    kept = ("name", "serial", "material", "expansion_per_K", "expansion_uncertainty_per_K", "reference_temperature_C")
    for key in (*kept, "block_width_mm", "block_height_mm"):
        assert getattr(gauge.table, key) == pytest.approx(getattr(original.table, key))
    assert gauge.certificate.number == "EXAMPLE-2026-0420"
    assert gauge.certificate.coverage_factor == 2.0
    assert gauge.certificate.example


@settings(max_examples=25)
@given(gauge=gauges())
def test_round_trip_of_any_gauge(tmp_path_factory: pytest.TempPathFactory, gauge: Gauge) -> None:
    folder = tmp_path_factory.mktemp("gauge")
    assert apart_nm(write_gauge(folder / "g.toml", import_gauge(put(folder, gauge_xml(gauge)))), gauge) < 0.51


STATED_TOGETHER = [
    {"correlation": 0.35, "degrees_of_freedom": 12.5},
    {"proportional_um_per_m": 0.7},
    {"proportional_um_per_m": 0.123456, "correlation": 1.0},
    {},
]


@pytest.mark.parametrize("stated", STATED_TOGETHER)
def test_how_uncertainties_belong_together_comes_back(tmp_path: Path, stated: dict[str, float]) -> None:
    """U of a length depends on it as much as on U of its ends; the sizes of the rail come back as well."""
    plain = shipped()[0]
    nothing = dict.fromkeys(("correlation", "proportional_um_per_m", "degrees_of_freedom"))
    sure = plain.certificate.model_copy(update=nothing | stated)
    rail = plain.table.model_copy(update={"rail_width_mm": 47.5, "rail_height_mm": 22.0})
    gauge = replace(plain, table=rail, certificate=sure)
    back = write_gauge(tmp_path / "mine.toml", import_gauge(put(tmp_path, gauge_xml(gauge))))
    assert {key: getattr(back.certificate, key) for key in nothing} == pytest.approx(nothing | stated)
    assert (back.table.rail_width_mm, back.table.rail_height_mm) == (47.5, 22.0)
    if stated:
        np.testing.assert_allclose(back.correlation, gauge.correlation, atol=1e-5)


def test_a_certificate_of_one_common_part_alone_comes_back(tmp_path: Path) -> None:
    """U as it is printed may be less than the common part, which is all of it, by half a digit."""
    plain = shipped()[0]
    per_m = 2.3456
    u_um = per_m * plain.position_mm * 1e-3 / plain.certificate.coverage_factor
    sure = plain.certificate.model_copy(update={"proportional_um_per_m": per_m, "correlation": None})
    text = gauge_xml(replace(plain, certificate=sure, u_um=u_um))
    back = write_gauge(tmp_path / "mine.toml", import_gauge(put(tmp_path, text)))
    assert back.certificate.proportional_um_per_m == pytest.approx(per_m, abs=1e-4)


@needs_schema
def test_quantities_of_our_own_are_valid() -> None:
    plain = shipped()[0]
    sure = plain.certificate.model_copy(update=STATED_TOGETHER[0] | STATED_TOGETHER[1])
    validate(parse_xml(gauge_xml(replace(plain, certificate=sure)).encode(), "g.xml"), SCHEMA, "g.xml")


@pytest.mark.parametrize(("unit", "per_mm"), [(r"\metre", 1e-3), (r"\micro\metre", 1e3), (r"\nano\metre", 1e6)])
def test_other_units_of_length(tmp_path: Path, unit: str, per_mm: float) -> None:
    text = gauge_xml()
    for tag in ("valueXMLList", "uncertaintyXMLList"):
        pattern = rf"(basic_measuredValue.*?<si:{tag}>)([^<]*)"
        values = re.search(pattern, text, re.DOTALL)
        assert values
        scaled = " ".join(f"{float(word) * per_mm:.12g}" for word in values[2].split())
        text = text[: values.start(2)] + scaled + text[values.end(2) :]
    text = swap(r"(basic_measuredValue.*?<si:unitXMLList>)[^<]*", lambda m: m[1] + unit, text)  # type: ignore[arg-type]
    assert apart_nm(write_gauge(tmp_path / "g.toml", import_gauge(put(tmp_path, text))), shipped()[0]) < 0.51


def test_reference_temperature_in_kelvin_and_expansion_per_metre(tmp_path: Path) -> None:
    text = swap(
        r"(stepgauge_referenceTemperature.*?<si:value>)20.00(</si:value>\s*<si:unit>)[^<]*", r"\g<1>293.15\2\\kelvin"
    )
    text = swap(
        r"(stepgauge_expansion.*?<si:value>)[^<]*(</si:value>\s*<si:unit>)[^<]*(.*?<si:uncertainty>)[^<]*",
        r"\g<1>11.5\2\\micro\\metre\\per\\metre\\per\\kelvin\g<3>1.0",
        text,
    )
    table = import_gauge(put(tmp_path, text)).table
    assert table["reference_temperature_C"] == pytest.approx(20.0)
    assert table["expansion_per_K"] == pytest.approx(11.5e-6)
    assert table["expansion_uncertainty_per_K"] == pytest.approx(0.5e-6)


def test_deviations_from_nominal_are_added(tmp_path: Path) -> None:
    deviation = " ".join(
        f"{(a - b) * 1e3:.4f}" for a, b in zip(row("basic_measuredValue"), row("basic_nominalValue"), strict=True)
    )
    u = " ".join(f"{float(v) * 1e3:.4f}" for v in shipped()[0].u_um * 2e-3)
    text = swap(
        r"basic_measuredValue(.*?<si:valueXMLList>)[^<]*(.*?<si:unitXMLList>)[^<]*(.*?<si:uncertaintyXMLList>)[^<]*",
        rf"basic_measurementError\g<1>{deviation}\2\\micro\\metre\g<3>{u}",
    )
    assert apart_nm(write_gauge(tmp_path / "g.toml", import_gauge(put(tmp_path, text))), shipped()[0]) < 0.51


def test_a_list_without_face_1_begins_at_face_2(tmp_path: Path) -> None:
    text = gauge_xml()
    for tag in ("valueXMLList", "uncertaintyXMLList", "coverageFactorXMLList"):
        text = re.sub(rf"(<si:{tag}>)\S+ ", r"\1", text)
    found = import_gauge(put(tmp_path, text))
    gauge = write_gauge(tmp_path / "g.toml", found)
    np.testing.assert_allclose(gauge.position_mm, shipped()[0].position_mm, atol=0.51e-6)
    assert gauge.u_um[0] == 0.0
    assert any("face 1 is not in the list" in line for line in found.report)


@pytest.mark.parametrize("form", ["expandedMU", "standardMU", "coverageInterval"])
def test_other_forms_of_uncertainty(tmp_path: Path, form: str) -> None:
    """D-SI since 2.2 wraps the uncertainty; a standard uncertainty has no coverage factor."""
    u = [float(v) for v in shipped()[0].u_um * 1e-3]
    head = "<si:measurementUncertaintyUnivariateXMLList>{}</si:measurementUncertaintyUnivariateXMLList>"
    expanded = " ".join(f"{2.0 * v:.7f}" for v in u)
    standard = " ".join(f"{v:.7f}" for v in u)
    stated = {
        "expandedMU": head.format(
            f"<si:expandedMUXMLList><si:valueExpandedMUXMLList>{expanded}</si:valueExpandedMUXMLList>"
            "<si:coverageFactorXMLList>2</si:coverageFactorXMLList>"
            "<si:coverageProbabilityXMLList>.95</si:coverageProbabilityXMLList></si:expandedMUXMLList>"
        ),
        "standardMU": head.format(
            f"<si:standardMUXMLList><si:valueStandardMUXMLList>{standard}</si:valueStandardMUXMLList>"
            "</si:standardMUXMLList>"
        ),
        "coverageInterval": f"<si:coverageIntervalXMLList><si:standardUncXMLList>{standard}</si:standardUncXMLList>"
        "</si:coverageIntervalXMLList>",
    }
    text = swap(r"(basic_measuredValue.*?)<si:expandedUncXMLList>.*?</si:expandedUncXMLList>", rf"\1{stated[form]}")
    gauge = write_gauge(tmp_path / "g.toml", import_gauge(put(tmp_path, text)))
    assert apart_nm(gauge, shipped()[0]) < 0.51
    assert gauge.certificate.coverage_factor == (2.0 if form == "expandedMU" else 1.0)


def test_coverage_factors_that_differ_are_made_one(tmp_path: Path) -> None:
    k = " ".join(["2.000", "3.000"] * (shipped()[0].n_faces // 2))
    text = swap(r"(basic_measuredValue.*?<si:coverageFactorXMLList>)[^<]*", rf"\g<1>{k}")
    gauge = write_gauge(tmp_path / "g.toml", import_gauge(put(tmp_path, text)))
    expected = shipped()[0].u_um.copy()
    expected[1::2] *= 2.0 / 3.0
    np.testing.assert_allclose(gauge.u_um, expected, atol=1e-5)


def foreign(text: str) -> str:
    """The certificate of a laboratory that marks nothing with our kinds."""
    text = re.sub(r' refType="(stepgauge|basic)_[^"]*"', "", text)
    return re.sub(r"<dcc:itemQuantities>.*?</dcc:itemQuantities>", "", text, flags=re.DOTALL)


POSITION_UNIT = r"(basic_measuredValue.*?<si:unitXMLList>)[^<]*"
STATED = StatedGauge(
    material="steel",
    expansion_per_K=11.5e-6,
    expansion_uncertainty_per_K=0.5e-6,
    block_width_mm=20.0,
    block_height_mm=15.0,
)


def test_a_foreign_layout_is_found_by_names_and_options(tmp_path: Path) -> None:
    path = put(tmp_path, foreign(gauge_xml()))
    with pytest.raises(InputError) as caught:
        import_gauge(path)
    assert caught.value.cli_text().endswith(
        "does not say all of a gauge file; expected --material, --expansion, --u-expansion, --block-width,"
        " --block-height"
    )
    found = import_gauge(path, STATED)
    assert apart_nm(write_gauge(tmp_path / "g.toml", found), shipped()[0]) < 0.51
    assert "expansion_per_K = 1.15e-05: as stated" in found.report


def test_two_candidates_are_an_error_and_can_be_told_apart(tmp_path: Path) -> None:
    text = gauge_xml()
    block = re.search(r'<dcc:quantity refType="basic_measuredValue">.*?</dcc:quantity>', text, re.DOTALL)
    assert block
    twice = text.replace(block[0], block[0] + block[0].replace("Position of the face from face 1", "As found"))
    path = put(tmp_path, twice)
    with pytest.raises(InputError, match="several lists could be the positions; found 2 of 4 lists"):
        import_gauge(path)
    gauge = write_gauge(tmp_path / "g.toml", import_gauge(path, StatedGauge(positions="As found")))
    assert apart_nm(gauge, shipped()[0]) < 0.51
    with pytest.raises(InputError, match=r"positions: no single list 'Other'; expected 'As found'"):
        import_gauge(path, StatedGauge(positions="Other"))


def test_without_nominal_positions_whole_mm_are_taken_and_said(tmp_path: Path) -> None:
    text = swap(r'<dcc:quantity refType="basic_nominalValue">.*?</dcc:quantity>', "")
    found = import_gauge(put(tmp_path, text))
    assert any(line.startswith("nominal positions: not found") for line in found.report)
    assert apart_nm(write_gauge(tmp_path / "g.toml", found), shipped()[0]) < 0.51
    shifted = " ".join(f"{v + 0.4 * (i > 5):.6f}" for i, v in enumerate(row("basic_measuredValue")))
    text = swap(r"(basic_measuredValue.*?<si:valueXMLList>)[^<]*", rf"\g<1>{shifted}", text)
    with pytest.raises(InputError, match="no nominal positions were found"):
        import_gauge(put(tmp_path, text))


@pytest.mark.parametrize(
    ("pattern", "new", "message"),
    [
        (
            POSITION_UNIT,
            r"\1\\kelvin",
            r"gauge.xml:\d+ \(/dcc:.*realListXMLList\): Position of the face from face 1 has a wrong unit;"
            r" found unit \\kelvin \(a temperature\); expected a length",
        ),
        (POSITION_UNIT, r"\1mm", r"gauge.xml:\d+ .*wrong unit: 'mm' is not written as D-SI"),
        (
            r"(stepgauge_expansion.*?<si:unit>)[^<]*",
            r"\1\\kelvin",
            "Coefficient of linear thermal expansion has a wrong unit",
        ),
        (
            r"(basic_measuredValue.*?)<si:expandedUncXMLList>.*?</si:expandedUncXMLList>",
            r"\1",
            "is a result without an uncertainty",
        ),
        (
            r"(basic_measuredValue.*?<si:valueXMLList>)\S+ \S+",
            r"\g<1>0.000000 -1.0",
            "the certificate gives no gauge: position_mm must rise",
        ),
        (POSITION_UNIT, r"\1\\micro\\metre", "the certificate gives no gauge: position_mm and nominal"),
        (
            r"<dcc:endPerformanceDate>[^<]*",
            "<dcc:endPerformanceDate>soon",
            "endPerformanceDate is not a date; found 'soon'",
        ),
        (
            r"<dcc:beginPerformanceDate>[^<]*",
            "<dcc:beginPerformanceDate>2027-03-02",
            "the calibration ends before it begins; found endPerformanceDate 2026-03-02",
        ),
        (
            r"(basic_measuredValue.*?<si:uncertaintyXMLList>).*?(</si:uncertaintyXMLList>)",
            r"\g<1>0\2",
            "all uncertainties of the positions are zero",
        ),
    ],
)
def test_files_that_lie(tmp_path: Path, pattern: str, new: str, message: str) -> None:
    path = put(tmp_path, swap(pattern, new))
    with pytest.raises(InputError, match=message):
        write_gauge(tmp_path / "g.toml", import_gauge(path))
    assert not (tmp_path / "g.toml").exists()
    assert not (tmp_path / "g.csv").exists()


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def call(*words: object) -> tuple[int, str]:
        try:
            main([str(word) for word in words])
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
        return code, capsys.readouterr().err

    said = tmp_path / "lab.toml"
    said.write_text((SAID.parent / "gauge-laboratory.toml").read_text())
    out = tmp_path / "gauge.xml"
    assert call("dcc", "export-gauge", "step-gauge-420", "-c", said, "-o", out)[0] == 0
    assert call("dcc", "check", out)[0] == 0
    code, told = call("dcc", "import-gauge", out, "-o", tmp_path / "my.toml", "--name", "Mine", "--block-width", "18")
    assert code == 0, told
    assert "block_width_mm = 18.0: as stated (the certificate says 20.0)" in told
    assert "wrote" in told
    data = tomllib.loads((tmp_path / "my.toml").read_text())
    assert (data["gauge"]["name"], data["gauge"]["faces"]) == ("Mine", "my.csv")
    assert str(tmp_path) not in (tmp_path / "my.toml").read_text()
    two_lines = 'Mine\n[gauge]\nserial = "forged"'
    assert call("dcc", "import-gauge", out, "-o", tmp_path / "two.toml", "--name", two_lines)[0] == 0
    assert tomllib.loads((tmp_path / "two.toml").read_text())["gauge"]["name"] == two_lines
    code, told = call("dcc", "import-gauge", out, "-o", tmp_path / "my.csv")
    assert (code, "expected NAME.toml" in told) == (2, True)
    code, told = call("dcc", "export-gauge", "step-gauge-420", "-c", SAID, "-o", out)
    assert (code, "key item.serial is not that of the gauge; found B700-0042" in told) == (2, True)


def test_the_certificate_of_a_machine_is_no_gauge(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"this is the certificate of a machine; found Coordinate .* B700-0042"):
        import_gauge(put(tmp_path, machine_xml()), STATED)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"number": "X-1"},
            r"key certificate\.number is not that of .*420\.toml; found X-1; expected EXAMPLE",
        ),
        ({"issued": datetime.date(2026, 3, 1)}, r"does not hold certificate\.date of .*found 2026-03-02 to 2026-03-01"),
        ({"performed_from": datetime.date(2026, 3, 3)}, r"does not hold certificate\.date .*expected 2026-03-02"),
        ({"issued": datetime.date(2026, 4, 1), "performed_from": datetime.date(2026, 2, 1)}, None),
    ],
)
def test_form_and_gauge_file_tell_of_one_certificate(changed: dict[str, Any], message: str | None) -> None:
    gauge = shipped()[0]
    said = gauge_laboratory(gauge)
    said = replace(said, certificate=said.certificate.model_copy(update=changed))
    with nullcontext() if message is None else pytest.raises(InputError, match=message):
        gauge_certificate(gauge, said)


def test_the_gauge_certificate_names_the_gauge() -> None:
    said = laboratory()
    with pytest.raises(InputError, match="not that of the gauge"):
        gauge_certificate(shipped()[0], replace(said, item=said.item.model_copy(update={"serial": "X"})))
