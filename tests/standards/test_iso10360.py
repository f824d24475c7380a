"""The length test: errors, uncertainty, rules, and recordings that lie."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.conditions.decision import INCOMPLETE
from stepgauge.errors import InputError
from stepgauge.recording import Recording
from stepgauge.standards.iso10360 import Choices, LengthTest, Specification, length_test
from stepgauge.standards.iso10360_files import decide_test, length_test_csv, length_test_to_dict, statements
from stepgauge.standards.iso10360_series import E150, NORMAL
from stepgauge.standards.length_uncertainty import TestConditions, length_uncertainty
from stepgauge.standards.measuring_line import ORIENTATIONS
from stepgauge.standards.mpe import Mpe
from stepgauge.standards.tip import OWN_BLOCK
from tests.build import make_gauge, make_machine
from tests.standards.made import START_MM, TIP_MM, joined, made

GAUGE = make_gauge(blocks=21, u_um=0.1, deviation_um=1e-3 * np.sin(7.0 * np.arange(42)))  # on no step of a display
SPEC = Specification(Mpe.parse("1.8 + L/350"), 1.5)
SURE = TestConditions(temperature_u_K=0.0, alignment_mrad=0.0, fixture_um=0.0)
STATED = Choices(tip_diameter_mm=TIP_MM)
ALL = TestConditions(temperature_u_K=0.1, alignment_mrad=0.5, fixture_um=0.1)
CUBE = make_machine()
CUBE = type(CUBE)(
    CUBE.table.model_copy(update={"travel_mm": type(CUBE.table.travel_mm)(x=(0, 600), y=(0, 600), z=(0, 600))}),
    CUBE.probe,
)


def seven(error=lambda _, __: 0.0, cycles: int = 3, only: int = 7, **more) -> Recording:
    """The gauge centred on each of the seven lines of a cube of 600 mm, of which 410 mm are 40 % to 68 %."""
    parts = []
    for one in ORIENTATIONS[:only]:
        along = one.direction(CUBE.travel_mm)
        start = np.full(3, 300.0) - along * GAUGE.position_mm[-1] / 2.0
        parts.append(made(GAUGE, error, along, cycles, start_mm=start, **more))
    return joined(*parts)


def beside(count: int, **more) -> Recording:
    """The gauge along x in as many places."""
    return joined(*(made(GAUGE, start_mm=START_MM + 5.0 * place, **more) for place in range(count)))


def rules_met(test) -> dict[str, bool | None]:
    return {rule.asks.split(",")[0]: rule.met for rule in test.rules}


def test_errors_by_hand() -> None:
    """8.5 ppm, repeats at +0, +0.3 and -0.5 um on backs, and a tip that was qualified 0.4 um too large.

    Front 1 to back 42 is 410 mm: E = 3.485 + (0, 0.3, -0.5) - 0.4 um, R = 0.8 um. Front 1 to front 41, 400 mm: 3.4 um.
    MPE = 2.971 um; of the certificate alone U = 2 x 0.1 sqrt 2 = 0.283 um: proven up to 2.688, disproven over 3.254 um.
    """
    scatter = {1: 0.0, 2: 0.3, 3: -0.5}

    def error(cycle: int, face: int) -> float:
        return 8.5e-3 * GAUGE.position_mm[face - 1] + (0.0 if face % 2 else scatter[cycle])

    test = length_test(made(GAUGE, error), GAUGE, SPEC, SURE, Choices(TIP_MM + 0.4e-3))
    longest = test.lengths("bidirectional")[-1]
    assert longest.faces == (1, 42)
    assert longest.error_um == pytest.approx([3.085, 3.385, 2.585], abs=1e-6)
    assert longest.range_um == pytest.approx(0.8, abs=1e-6)
    assert longest.mpe_um == pytest.approx(1.8 + 410 / 350)
    assert longest.outcomes == ["not decidable", "does not conform", "conforms"]
    outside = (3.385 - longest.mpe_um) / longest.uncertainty.standard_um
    assert longest.conformity_probability == pytest.approx(math.erfc(outside / math.sqrt(2.0)) / 2.0, rel=1e-4)
    assert test.lengths("unidirectional")[-1].error_um == pytest.approx([3.4] * 3, abs=1e-6)
    assert [one.nominal_mm for one in test.lengths("bidirectional")] == [30, 130, 210, 310, 410]


@given(
    i=st.floats(-1, 1),
    j=st.floats(-1, 1),
    k=st.floats(0.1, 1),
    seed=st.integers(0, 2**32 - 1),
    temperature=st.floats(15.0, 25.0),
)
def test_errors_wherever_the_gauge_lies(i: float, j: float, k: float, seed: int, temperature: float) -> None:
    """E is the error of the end face less that of the first face, in any direction and at any recorded temperature."""
    errors = np.random.default_rng(seed).normal(0.0, 1.0, (4, 43))
    recording = made(GAUGE, lambda cycle, face: errors[cycle, face], (i, j, k), temperature_C=temperature)
    test = length_test(recording, GAUGE, SPEC, choices=STATED)
    for kind in ("bidirectional", "unidirectional"):
        for one in test.lengths(kind):
            first, end = one.faces
            assert one.error_um == pytest.approx(errors[1:, end] - errors[1:, first], abs=1e-5)


def test_backs_as_unidirectional_lengths_and_lengths_of_choice() -> None:
    chosen = Choices(TIP_MM, "backs", (50.0, 90.0, 210.0, 330.0, 410.0))
    test = length_test(made(GAUGE), GAUGE, SPEC, choices=chosen)
    assert {one.faces[0] for one in test.lengths("unidirectional")} == {2}
    assert [one.nominal_mm for one in test.lengths("bidirectional")] == [50, 90, 210, 330, 410]
    with pytest.raises(InputError, match="no length of 55 mm"):
        length_test(made(GAUGE), GAUGE, SPEC, choices=Choices(TIP_MM, lengths_mm=(55.0,)))


def test_uncertainty_by_hand() -> None:
    """410 mm at 22 degC: certificate 0.1 sqrt 2; expansion 410e3 x 2 x 0.5e-6 = 0.41; temperature 410e3 x 11.5e-6 x 0.1
    = 0.4715; alignment sqrt 2 x 410e3 x (0.5e-3)^2 = 0.14496; fixture 0.1 um."""
    found = length_uncertainty(GAUGE, (1, 42), 22.0, ALL, None)
    expected = {
        "certificate": 0.1 * np.sqrt(2),
        "expansion": 0.41,
        "temperature": 0.4715,
        "alignment": np.sqrt(2) * 410e3 * 0.25e-6,
        "fixture": 0.1,
    }
    assert found.parts_um == pytest.approx(expected, rel=1e-8)
    assert found.standard_um == pytest.approx(np.sqrt(sum(v**2 for v in expected.values())))
    assert found.missing == ()


def test_alignment_against_monte_carlo() -> None:
    """A tilt with 2 mrad in each direction across: the rms of L (1 - cos) over many gauges laid by hand."""
    tilt = np.random.default_rng(1).normal(0.0, 2e-3, (200_000, 2))
    shortened_um = 410e3 * (1.0 - 1.0 / np.sqrt(1.0 + (tilt**2).sum(axis=1)))
    part = length_uncertainty(GAUGE, (1, 42), 20.0, TestConditions(alignment_mrad=2.0), None).parts_um["alignment"]
    assert part == pytest.approx(float(np.sqrt((shortened_um**2).mean())), rel=0.02)


def test_nothing_is_invented_where_nothing_is_stated() -> None:
    found = length_uncertainty(GAUGE, (1, 42), None, TestConditions(), None)
    assert set(found.parts_um) == {"certificate"}
    assert len(found.missing) == 4
    test = length_test(made(GAUGE, temperature_C=None), GAUGE, SPEC)
    assert any("expansion of the gauge" in text for text in test.missing)
    assert any("too small by what was not stated" in text for text in statements(test))


def test_an_incomplete_uncertainty_decides_nothing() -> None:
    """80 um/m are no nonconformity while U lacks the alignment: stated, they are one."""
    bad = made(GAUGE, lambda _, face: 80e-3 * GAUGE.position_mm[face - 1])
    for stated, expected in ((TestConditions(), "not decidable"), (SURE, "does not conform")):
        test = length_test(bad, GAUGE, replace(SPEC, repeatability_um=None), stated, STATED)
        assert test.outcome("bidirectional") == expected
        assert decide_test([test]).outcome == expected
    assert "U lacks what was not stated: uncertainty of the gauge temperature" in " ".join(
        statements(length_test(bad, GAUGE, SPEC, choices=STATED))
    )


def test_a_complete_test_of_a_good_machine() -> None:
    """In a cube of 600 mm the 410 mm reach 66 % of the axes and not of the diagonals: that rule alone fails."""
    test = length_test(seven(), GAUGE, SPEC, ALL, STATED, CUBE)
    met = rules_met(test)
    assert [asks for asks, is_met in met.items() if not is_met] == [
        "longest length at least 66 % of the machine's travel along the measured line"
    ]
    assert len(test.lengths("bidirectional")) == 35
    assert sum(len(one.error_um) for one in test.lengths("bidirectional")) == 105
    assert test.outcome("bidirectional") == "conforms"
    assert test.repeatability_outcome("bidirectional") == "conforms"
    assert test.positions[3].line_mm == pytest.approx(600 * np.sqrt(3))
    said = decide_test([test])
    assert (said.outcome, said.passed, said.text.startswith(INCOMPLETE)) == ("no statement", None, True)
    assert {outcome for _, outcome in said.parts} == {"conforms"}
    assert not any("conformity is proven" in text for text in statements(test))
    rule = next(rule for rule in test.rules if rule.asks.startswith("longest"))
    assert "position 1: 410.0 mm, asked 685.9 mm" in rule.found
    assert "position 5" not in rule.found


def test_without_a_machine_the_travel_rules_are_not_checked() -> None:
    test = length_test(seven(), GAUGE, SPEC, ALL, STATED)
    assert sum(rule.met is None for rule in test.rules) == 3
    assert not test.complete


def test_too_few_positions_repeats_and_lengths_are_named() -> None:
    test = length_test(seven(cycles=2, only=5, faces=[1, 2, 3, 4, 21, 22]), GAUGE, SPEC, ALL, STATED, CUBE)
    said = " ".join(statements(test))
    assert "7 positions; 5 in the recording" in said
    assert "3 repeats of each length; position 1: 2" in said
    assert "5 lengths in each position; position 1: 2" in said
    assert "test is not complete" in said


def test_missing_diagonals_are_named() -> None:
    test = length_test(beside(7), GAUGE, SPEC, ALL, STATED, CUBE)
    rule = next(rule for rule in test.rules if "body diagonals" in rule.asks)
    assert rule.met is False
    assert rule.found.count("body diagonal") == 4


def test_mandatory_and_free_positions_are_told_apart() -> None:
    """Four diagonals are the standard's choice, three axes the user's."""
    test = length_test(seven(), GAUGE, SPEC, ALL, STATED, CUBE)
    assert [one.mandatory for one in test.positions] == [True] * 4 + [False] * 3
    free = next(rule for rule in test.rules if "user's choice" in rule.asks)
    assert free.met
    assert free.found == "position 5: along x; position 6: along y; position 7: along z"
    four = length_test(seven(only=4), GAUGE, SPEC, ALL, STATED, CUBE)
    assert next(rule for rule in four.rules if "user's choice" in rule.asks).met is False
    assert rules_met(four)["4 of the positions along the four body diagonals of the measuring volume"]


def low_expansion(normal_too: bool) -> bool | None:
    table = GAUGE.table.model_copy(update={"expansion_per_K": 0.5e-6})
    choices = replace(STATED, normal_too=normal_too)
    test = length_test(seven(), replace(GAUGE, table=table), SPEC, ALL, choices, CUBE)
    return next(rule.met for rule in test.rules if "normal expansion" in rule.asks)


def test_a_gauge_of_low_expansion_needs_a_length_of_normal_expansion() -> None:
    assert low_expansion(normal_too=False) is False
    assert low_expansion(normal_too=True)
    one = length_test(made(GAUGE, faces=[1, 42]), GAUGE, SPEC, ALL, STATED, CUBE, series=NORMAL)
    assert [rule.asks for rule in one.rules if not rule.met] == []


def offset(recording: Recording, probe_mm: float) -> LengthTest:
    """E150 with a horizontal stylus of this length and no body."""
    update = {"stylus_direction": (1.0, 0.0, 0.0), "stylus_length_mm": probe_mm, "body_length_mm": 0.0}
    machine = replace(CUBE, probe=CUBE.probe.model_copy(update=update))
    return length_test(recording, GAUGE, replace(SPEC, repeatability_um=None), ALL, STATED, machine, series=E150)


def test_e150_is_a_series_of_its_own() -> None:
    """An offset of 150 mm with 10 urad of pitch: 1.5 um at 600 mm, here as 3 ppm of the length."""
    recording = joined(
        *(made(GAUGE, lambda _, f: 3e-3 * GAUGE.position_mm[f - 1], start_mm=START_MM + n) for n in (0, 9))
    )
    test = offset(recording, 150.0)
    assert test.lengths("bidirectional")[-1].error_um == pytest.approx([3e-3 * 410.0] * 3, abs=1e-6)
    assert [rule.asks for rule in test.rules if not rule.met] == []
    assert next(rule for rule in offset(recording, 100.0).rules if "off the axis" in rule.asks).met is False
    said = decide_test([length_test(seven(), GAUGE, SPEC, ALL, STATED, CUBE), test])
    assert [name.partition(" ")[0] for name, _ in said.parts] == ["E_0,MPE", "R_0,MPL", "E_150,MPE"]
    assert "unconfirmed" in " ".join(statements(test))


@pytest.mark.parametrize(
    ("limit_um", "expected"), [(1.5, "not decidable"), (11.5, "not decidable"), (11.6, "conforms")]
)
def test_a_range_is_not_known_better_than_the_steps_of_its_readings(limit_um: float, expected: str) -> None:
    """U of four roundings by 10 um is 2 * 10 um / sqrt(3) = 11.547 um, whatever U the errors have."""
    recording = made(GAUGE, lambda _, face: 20.0 * np.sin(face))
    recording.frame["x_mm"] = np.round(recording.frame["x_mm"], 2)
    asked, vague = replace(SPEC, repeatability_um=limit_um), replace(ALL, fixture_um=200.0)
    test = length_test(recording, GAUGE, asked, vague, Choices(tip_diameter_mm=TIP_MM))
    assert max(one.range_um for one in test.lengths("bidirectional")) < 1e-6
    assert test.repeatability_outcome("bidirectional") == expected
    sure = length_test(recording, GAUGE, asked, ALL, Choices(tip_diameter_mm=TIP_MM))
    assert sure.repeatability_outcome("bidirectional") == sure.outcome("bidirectional") == "no statement"
    assert "steps of 10 um" in decide_test([sure]).text


def test_readings_off_the_axis_decide_nothing() -> None:
    """A machine 12 um/m short is hidden by 5 mrad that nobody stated: the cosine error is 5 um over 410 mm."""
    recording = made(GAUGE, lambda _, face: -12.5e-3 * GAUGE.position_mm[face - 1])
    recording.frame["y_mm"] += 5e-3 * (recording.frame["x_mm"] - recording.frame["x_mm"].iloc[0])
    test = length_test(recording, GAUGE, SPEC, ALL, Choices(tip_diameter_mm=TIP_MM))
    assert test.outcome("bidirectional") == test.repeatability_outcome("bidirectional") == "no statement"
    assert "5.00 mrad off the axis" in decide_test([test]).text


def test_one_statement_for_the_machine_with_its_decision_rule() -> None:
    """Errors within and ranges beyond their limits are no conformity: the worst characteristic decides."""
    wide = seven(lambda cycle, face: 2.0 * (cycle == 2) * (face == 42))
    said = decide_test([length_test(wide, GAUGE, replace(SPEC, mpe=Mpe.parse("9")), ALL, STATED, CUBE)])
    assert {name.partition(" ")[0]: one for name, one in said.parts} == {
        "E_0,MPE": "conforms",
        "R_0,MPL": "does not conform",
    }
    assert said.outcome == "does not conform"
    assert said.text.startswith("The machine does not conform.")
    assert "Decision rule: ISO 14253-1" in said.text
    assert "E_150: not tested" in said.open
    fronts = length_test(made(GAUGE, faces=range(1, 42, 2)), GAUGE, SPEC, ALL)
    assert decide_test([fronts]).outcome == "no statement"


def test_what_is_left_out_is_named() -> None:
    recording = beside(8, cycles=5)
    test = length_test(recording, GAUGE, SPEC, ALL, STATED)
    left = [part.what for part in test.excluded]
    assert "placement 8" in left
    assert "positions 1, 2, 3, 4, 5, 6, 7: cycles 4, 5" in left
    assert any("of 42 faces" in what for what in left)


def test_the_tip_from_a_block_hides_an_error_of_size() -> None:
    """The probe is qualified 2 um too small: every outside length reads 2 um long, unless the gauge gives the tip."""
    recording = made(GAUGE)
    hidden = length_test(recording, GAUGE, SPEC, ALL)
    shown = length_test(recording, GAUGE, SPEC, ALL, Choices(TIP_MM - 2e-3))
    assert hidden.tip is not None
    assert hidden.tip.origin == OWN_BLOCK
    assert hidden.lengths("bidirectional")[0].error_um == pytest.approx([0.0] * 3, abs=1e-6)
    assert shown.lengths("bidirectional")[0].error_um == pytest.approx([2.0] * 3, abs=1e-6)
    assert (
        rules_met(hidden)["bidirectional lengths read with the tip diameter of the machine's own qualification"]
        is False
    )
    assert "tip diameter" in hidden.lengths("bidirectional")[0].uncertainty.parts_um
    assert "tip diameter" not in hidden.lengths("unidirectional")[0].uncertainty.parts_um


@pytest.mark.parametrize(
    ("ppm", "conditions", "b89", "within"),
    [
        (0.0, SURE, "conforms", 1.0),
        (20.0, SURE, "does not conform", 0.2),
        (0.0, replace(SURE, fixture_um=0.5), "not decidable", 1.0),
        (0.0, TestConditions(), "not decidable", 1.0),
    ],
)
def test_other_standards_judge_the_same_errors(ppm: float, conditions: TestConditions, b89: str, within: float) -> None:
    """Simple acceptance needs U of a quarter of the limit; 20 um/m pass at 30 mm alone of five lengths."""
    specification = replace(SPEC, also=("b89", "vdi2617"))
    recording = made(GAUGE, lambda _, face: ppm * 1e-3 * GAUGE.position_mm[face - 1])
    test = length_test(recording, GAUGE, specification, conditions, STATED)
    found = length_test_to_dict(test)["also"]
    assert found["b89"]["outcome"] == b89
    assert found["vdi2617"]["share_within"] == pytest.approx(within)
    assert found["vdi2617"]["outcome"] == test.outcome("bidirectional")
    assert sum("unconfirmed" in text for text in statements(test)) >= 2


def test_fronts_alone_are_unidirectional_only() -> None:
    test = length_test(made(GAUGE, faces=range(1, 42, 2)), GAUGE, SPEC, ALL)
    assert test.tip is None
    assert test.outcome("bidirectional") is None
    assert test.outcome("unidirectional") is None
    assert any("none is decided on" in text for text in statements(test))
    assert any("bidirectional" in part.what for part in test.excluded)


@pytest.mark.parametrize(("spikes", "allowed"), [(1, 1), (5, 5), (6, 0)])
def test_single_errors_outside_may_be_measured_again_up_to_five(spikes: int, allowed: int) -> None:
    """One repeat of the longest length of some positions is 4.5 um off."""
    parts = [
        made(
            GAUGE,
            lambda cycle, face, bad=number <= spikes: 4.5 if bad and cycle == 2 and face == 42 else 0.0,
            start_mm=START_MM + number,
        )
        for number in range(1, 8)
    ]
    test = length_test(joined(*parts), GAUGE, SPEC, ALL, STATED)
    assert test.outcome("bidirectional") == "does not conform"
    assert len(test.remeasure("bidirectional")) == allowed


def test_two_bad_repeats_of_one_length_are_not_measured_again() -> None:
    bad = made(GAUGE, lambda cycle, face: 4.0 if cycle > 1 and face == 42 else 0.0)
    assert length_test(bad, GAUGE, SPEC, ALL, STATED).remeasure("bidirectional") == []


def test_files_say_the_same_as_the_test() -> None:
    test = length_test(seven(lambda cycle, face: 0.1 * cycle * face / 42), GAUGE, SPEC, ALL, STATED, CUBE)
    data = json.loads(json.dumps(length_test_to_dict(test), allow_nan=False))
    rows = [line.split(",") for line in length_test_csv(test).splitlines()]
    assert len(rows) == 1 + 2 * 105
    errors = [float(row[rows[0].index("error_um")]) for row in rows[1:]]
    flat = [error for one in data["lengths"] for error in one["errors_um"]]
    assert errors == pytest.approx(flat, rel=1e-5, abs=1e-6)
    assert data["results"]["bidirectional"]["largest_error_um"] == pytest.approx(max(flat[:105], key=abs))


# Files that lie


def test_a_recording_of_a_gauge_of_other_length() -> None:
    with pytest.raises(InputError, match=r"is not where Test gauge has that face.*measured span"):
        length_test(made(make_gauge(blocks=21, size=12.0, gap=13.0)), GAUGE, SPEC)


def test_a_recording_of_another_serial() -> None:
    recording = made(GAUGE)
    with pytest.raises(InputError, match=r"another gauge.*T-2"):
        length_test(Recording(recording.frame, {"gauge_serial": "T-2"}, "r.csv"), GAUGE, SPEC)


def test_two_recordings_under_one_placement() -> None:
    import pandas as pd

    frame = pd.concat([made(GAUGE).frame] * 2)
    with pytest.raises(InputError, match="probed twice in cycle 1"):
        length_test(Recording(frame, {}, "r.csv"), GAUGE, SPEC)


def test_one_file_given_for_two_positions() -> None:
    with pytest.raises(InputError, match="placement 2 repeats the readings of placement 1"):
        length_test(joined(made(GAUGE), made(GAUGE)), GAUGE, SPEC)


def test_a_radius_for_a_diameter() -> None:
    with pytest.raises(InputError, match=r"another tip \(a radius\?\)"):
        length_test(made(GAUGE), GAUGE, SPEC, choices=Choices(TIP_MM / 2))


def test_swapped_faces() -> None:
    frame = made(GAUGE).frame
    frame["face"] = frame["face"].map(lambda face: face + 1 if face % 2 else face - 1)
    with pytest.raises(InputError, match="fronts and backs are swapped"):
        length_test(Recording(frame, {}, "r.csv"), GAUGE, SPEC)
