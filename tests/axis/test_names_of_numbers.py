"""The names of the numbers of a finding in the units of an axis."""

from __future__ import annotations

import numpy as np
import pytest

from stepgauge.axis.units import AxisUnits, unit_words
from stepgauge.diagnosis.axis.conversion import UnitConversion
from stepgauge.diagnosis.axis.residuals import axis_data
from stepgauge.diagnosis.wording.findings import Subject
from stepgauge.diagnosis.wording.notation import symbol
from stepgauge.effects import effect_kinds
from tests.axis.made import axis

UNITS = [("mm", "um"), ("mm", "nm"), ("inch", "uin"), ("m", "nm"), ("deg", "arcsec")]


@pytest.mark.parametrize("units", UNITS)
def test_a_number_of_every_effect_is_named_by_the_unit_that_it_has(units: tuple[str, str]) -> None:
    """``thermal shift: um per K 6340 nm/K``: what ended in its unit ends in the new one, and words find it there."""
    recording = axis(np.linspace(0.0, 90.0, 11), lambda x, way: 0.0 * x + way, units=units)
    conversion = UnitConversion(recording.units, axis_data(recording).scaling)
    at = Subject("axis", recording.units.position, recording.units.deviation)
    seen = 0
    for effect in effect_kinds(every=True).values():
        for known in effect.parameters():
            if known.unit and f"_{known.name}".endswith(f"_{unit_words(known.unit)}"):
                stated = {known.name: {"value": 1.0, "u": 0.1, "unit": known.unit}}
                ((name, told),) = conversion.converted(stated).items()
                assert f"_{name}".endswith(f"_{unit_words(told['unit'])}")
                assert at.key(known.name) == name
                words = unit_words(told["unit"]).replace("_", " ")
                assert not f" {symbol(name, told, 2)}".rstrip().endswith(f" {words}")
                seen += 1
    assert seen > 20


def test_the_names_that_were_wrong() -> None:
    assert AxisUnits.of("mm", "nm").key("um_per_K") == "nm_per_K"
    assert AxisUnits.of("inch").key("rate_um_per_h") == "rate_uin_per_h"
    assert AxisUnits.of("deg").key("um_per_m") == "arcsec_per_deg"
    assert symbol("rate_uin_per_h", {"unit": "uin/h"}, 2) == "rate "
    assert symbol("nm_per_K", {"unit": "nm/K"}, 2) == "size "
