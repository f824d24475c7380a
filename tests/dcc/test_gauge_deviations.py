"""Certificates that state deviations in place of positions: the order of subtraction, and what is no gauge at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepgauge.cli import main
from stepgauge.dcc.gauge_read import StatedGauge, import_gauge, write_gauge
from stepgauge.errors import InputError
from tests.dcc.test_gauge_certificate import apart_nm, put, row, swap
from tests.measured import shipped


def deviations(name: str, sign: float, kind: str = "") -> str:
    """The certificate of the shipped gauge with deviations from nominal, um, under a name."""
    pairs = zip(row("basic_measuredValue"), row("basic_nominalValue"), strict=True)
    values = " ".join(f"{sign * (a - b) * 1e3:.4f}" for a, b in pairs)
    u = " ".join(f"{float(v) * 1e3:.4f}" for v in shipped()[0].u_um * 2e-3)
    lists = r"(.*?<si:valueXMLList>)[^<]*(.*?<si:unitXMLList>)[^<]*(.*?<si:uncertaintyXMLList>)[^<]*"
    text = swap(rf' refType="basic_measuredValue"{lists}', rf"{kind}\g<1>{values}\2\\micro\\metre\g<3>{u}")
    return text.replace("Position of the face from face 1", name)


@pytest.mark.parametrize(
    ("name", "sign"),
    [
        ("Deviation (measured minus nominal)", 1),
        ("Deviation", 1),
        ("Abweichung", 1),
        ("Ist-Soll", 1),
        ("Abweichung Nennmass minus Istmass", -1),
        ("Soll-Ist", -1),
        ("nominal - actual", -1),
        ("Correction", -1),
        ("Korrekturwert", -1),
    ],
)
def test_deviations_are_subtracted_as_their_name_says(tmp_path: Path, name: str, sign: int) -> None:
    found = import_gauge(put(tmp_path, deviations(name, sign)))
    assert apart_nm(write_gauge(tmp_path / "g.toml", found), shipped()[0]) < 0.51
    order = {1: "measured minus nominal", -1: "nominal minus measured"}[sign]
    assert f"{name!r} are deviations, {order}" in found.report


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("Correction (measured minus nominal)", ""),
        ("Deviation, nominal minus measured", ' refType="basic_measurementError"'),
    ],
)
@pytest.mark.parametrize(("asked", "sign"), [("measured-nominal", 1), ("nominal-measured", -1)])
def test_a_sign_that_contradicts_itself_is_asked_for(
    tmp_path: Path, name: str, kind: str, asked: str, sign: int
) -> None:
    path = put(tmp_path, deviations(name, sign, kind))
    with pytest.raises(InputError, match=r"contradict.* expected deviations=.measured"):
        import_gauge(path)
    gauge = write_gauge(tmp_path / "g.toml", import_gauge(path, StatedGauge(deviations=asked)))
    assert apart_nm(gauge, shipped()[0]) < 0.51


def test_something_without_lengths_is_refused_as_that_before_anything_is_asked_for(tmp_path: Path) -> None:
    no_material = swap(r"Material<", "Colour<")
    text = no_material.replace(r"\milli\metre", r"\kelvin").replace("basic_measuredValue", "basic_other")
    with pytest.raises(InputError, match="no list of lengths has uncertainties"):
        import_gauge(put(tmp_path, text))


def test_check_names_the_values_without_uncertainty(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def said(text: str) -> str:
        path = put(tmp_path, text)
        main(["dcc", "check", str(path)])
        return capsys.readouterr().out

    assert "units and uncertainties are complete" in said(swap("Material", "Material"))
    without = swap(r'refType="basic_measuredValue"(.*?)<si:expandedUncXMLList>.*?</si:expandedUncXMLList>', r"\1")
    told = said(without)
    assert "units are complete; values without an uncertainty: Position of the face from face 1" in told
    assert "uncertainties are complete" not in told
