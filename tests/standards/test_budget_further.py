"""Contributions of a budget beside the machine's: drift of the standard, what the readings show, one's own."""

from __future__ import annotations

import datetime
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stepgauge as sg
from benchmarks.coverage import coverage
from stepgauge.conditions import Condition, Conditions
from stepgauge.conditions.certificate import certificate_conditions
from stepgauge.errors import InputError
from stepgauge.gauge.certified import EarlierCalibration, Gauge
from stepgauge.machine.contribution import Contribution, parse_contribution
from stepgauge.machine.uncertain import Uncertain
from stepgauge.montecarlo import recording_model
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.standards.budget import make_budget
from stepgauge.standards.budget_files import stored_budget
from stepgauge.standards.budget_sources import BudgetOptions
from tests.measured import named, run, shipped

RECORDING = named(run(3).recording)
REAL = replace(RECORDING, comments={"machine": "Bridge CMM", "measured_at": "2026-09-01"})


def gauge(**certificate: object) -> Gauge:
    own = shipped()[0]
    return replace(own, certificate=own.certificate.model_copy(update=certificate))


def model(recording: sg.Recording = REAL, own: Gauge | None = None) -> MonteCarloModel:
    return recording_model(recording, shipped()[1], own or gauge(), 0.1).keep_temperature_error()


def u_of(name: str, of: MonteCarloModel, asked: BudgetOptions | None = None) -> dict[int, float]:
    """What a source adds to XF by face, um."""
    budget = make_budget(of, asked)
    return {one.face: one.contribution.get(name, 0.0) for one in budget.lines if one.name == "xf_um" and one.face}


def from_first_m(own: Gauge, face: int) -> float:
    return float(own.position_mm[face - 1] - own.position_mm[0]) * 1e-3


def missing(of: MonteCarloModel, asked: BudgetOptions | None = None) -> str:
    return " ".join(one.what for one in make_budget(of, asked).not_included)


def test_the_drift_of_the_standard_is_its_rate_by_its_age() -> None:
    """0.4 um/m a year, half a year: 0.2 um/m from the reference face on."""
    half = gauge(drift_um_per_m_per_year=0.4, date=datetime.date(2026, 9, 1) - datetime.timedelta(days=182.625))
    found = u_of("drift of the gauge", model(own=half))
    years = 182 / 365.25
    for face in (1, 3, 5, 7, 9, 11):
        assert found[face] == pytest.approx(0.4 * years * from_first_m(half, face), rel=1e-6, abs=1e-12)


def test_earlier_certificates_give_the_rate() -> None:
    """One year before 0.3 um/m longer, two years before 0.4: rms of 0.3 and 0.2 um/m a year."""
    present = datetime.date(2026, 3, 2)
    ends = [(365.25, 0.3), (730.5, -0.4)]
    earlier = [
        EarlierCalibration(date=present - datetime.timedelta(days=days), length_um_per_m=um) for days, um in ends
    ]
    own = gauge(drift_um_per_m_per_year=None, earlier=earlier)
    rate = u_of("drift of the gauge", model(own=own))[11] / from_first_m(own, 11)
    age = (datetime.date(2026, 9, 1) - present).days / 365.25
    assert rate / age == pytest.approx(math.sqrt((0.3**2 + 0.2**2) / 2.0), rel=2e-3)


def test_a_drift_or_a_date_that_nobody_states_is_missing_and_a_virtual_gauge_has_none() -> None:
    silent = gauge(drift_um_per_m_per_year=None)
    assert "drift of the gauge since its calibration" in missing(model(own=silent))
    undated = replace(REAL, comments={"machine": "Bridge CMM"})
    assert "nobody says when it was measured" in missing(model(undated))
    assert "nobody says" not in missing(model(undated), BudgetOptions(measured_at="2026-09-01"))
    simulated = make_budget(model(RECORDING, silent))
    assert "drift" not in " ".join(one.what for one in simulated.not_included)
    assert any("certified length" in text for text in simulated.assumptions)


def with_condition(of: MonteCarloModel, one: Condition) -> MonteCarloModel:
    results = tuple(replace(r, conditions=Conditions((one,))) for r in of.nominal.results)
    return replace(of, nominal=replace(of.nominal, results=results))


def test_what_the_readings_show_of_alignment_resolution_and_drift_counts() -> None:
    of = model()
    placement = replace(
        sg.Placement(
            np.zeros(3), np.array([0.0, 100.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), 1, 6
        ),
        details={"uncertainty": {"yaw_urad": 1.0, "pitch_urad": 1.0}},
    )
    span_um = float(np.ptp(of.gauge.position_mm[of.parts[0].readings.faces - 1])) * 1e3
    tilted = with_condition(of, Condition("alignment", "contribution", "tilted", size_um=2.0))
    at = [u_of("alignment", one, BudgetOptions([placement])) for one in (of, tilted)]
    last = max(at[0])
    assert at[0][last] < 0.001
    assert at[1][last] == pytest.approx(2.0 * of.gauge.position_mm[last - 1] * 1e3 / span_um, rel=1e-3)

    coarse = with_condition(of, Condition("resolution", "contribution", "steps", size_um=5.0))
    (source,) = (one for one in make_budget(coarse).sources if one.name == "resolution")
    assert source.u == pytest.approx((10.0 / math.sqrt(12.0),) * 2)
    assert "recording: steps of 10 um" in source.stated_by

    drifting = with_condition(of, Condition("drift", "contribution", "drifts", size_um=3.0))
    assert u_of("drift of the readings", drifting)[last] == pytest.approx(
        3.0 / math.sqrt(3.0) * of.gauge.position_mm[last - 1] * 1e3 / span_um, rel=1e-3
    )
    unsaid = with_condition(of, Condition("temperature convention", "contribution", "nobody says", size_um=3.0))
    assert u_of("temperature convention of the readings", unsaid) == u_of("drift of the readings", drifting)
    corrected = with_condition(of, Condition("drift", "corrected", "drifts", size_um=3.0))
    assert not any(u_of("drift of the readings", corrected).values())


def test_contributions_of_ones_own_by_hand() -> None:
    """Rectangular half width 0.3 um at every face, and 0.4 K common to all at 11.5 um/m per K."""
    faces = parse_contribution("form of the faces=0.3, distribution=uniform, dof=8")
    warm = parse_contribution("warm hand=0.4, unit=K, sensitivity_per_m=11.5")
    assert (faces.u, warm.u_um_per_m, warm.u_face_um) == (0.3 / math.sqrt(3.0), pytest.approx(4.6), 0.0)
    of = model()
    asked = BudgetOptions(contributions=(faces, warm))
    form, hand = u_of("own: form of the faces", of, asked), u_of("own: warm hand", of, asked)
    last = max(face for face in form if face % 2)
    assert form[last] == pytest.approx(math.sqrt(2.0) * 0.3 / math.sqrt(3.0))
    assert hand[last] == pytest.approx(4.6 * of.gauge.position_mm[last - 1] * 1e-3)
    machine = replace(shipped()[1], contributions=(faces,))
    stored = stored_budget(of, make_budget(replace(of, machine=machine)), 0)
    (own,) = (one for one in stored.sources if one.name.startswith("own"))
    assert (own.label, own.dof) == ("form of the faces", 8.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("form", "no contribution"),
        ("form=much", "could not convert"),
        ("form=-1", "greater than or equal to 0"),
        ("form=1, distribution=round", "distribution"),
        ("form=1, degrees=8", "degrees"),
        ("form=1, dof=0", "dof"),
        ("=1", "name"),
    ],
)
def test_a_contribution_that_is_none_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_contribution(text)


def test_contributions_of_the_machine_file(tmp_path: Path) -> None:
    shipped_text, path = Path(shipped()[1].path).read_text(), tmp_path / "m.toml"
    own = '\n[[contribution]]\nname = "form"\nvalue = 0.2\ndistribution = "triangular"\n'
    path.write_text(shipped_text + own)
    (one,) = sg.read_machine(path).contributions
    assert one == Contribution(name="form", value=0.2, distribution="triangular")
    path.write_text(shipped_text + own.replace("value", "amount"))
    with pytest.raises(InputError, match=r"contribution\[1\]"):
        sg.read_machine(path)


def test_the_temperature_of_the_scales_is_in_u_only_at_20_degrees() -> None:
    """0.5 K at 11.5e-6/K is 2.3 um at 400 mm: it is an error of the machine as it is, and no uncertainty of it."""
    from stepgauge.machine.uncertain import Uncertain

    gauge_, machine = shipped()
    warm = replace(machine, uncertain=(Uncertain("machine.temperature_C", 20.0, 0.5),))
    at_20 = sg.budget(REAL, gauge_, warm, runs=0, measurand="at-20")
    as_is = sg.budget(REAL, gauge_, warm, runs=0)
    names = [{source.label for source in one.sources} for one in (as_is, at_20)]
    assert ["temperature of the scales" in one for one in names] == [False, True]
    assert not any("scales" in gap.what for gap in as_is.not_included)
    assert "as it is" in as_is.measurand
    assert "at 20 °C" in at_20.measurand
    last = max(line.face or 0 for line in as_is.quantities)
    u = [one.find("xf", 1, last - 1).u_um for one in (as_is, at_20)]  # type: ignore[union-attr]
    scales = 0.5 * machine.table.scale_expansion_per_K * gauge_.position_mm[last - 2] * 1e3
    assert u[1] == pytest.approx(math.hypot(u[0], scales), rel=1e-3)


def test_a_gauge_that_is_due_for_calibration_is_remarked() -> None:
    late = [one.sentence for one in certificate_conditions(REAL, gauge(recall=datetime.date(2026, 8, 1)))]
    assert any("due for calibration on 2026-08-01, and measured with on 2026-09-01" in text for text in late)
    assert not any("due" in one.sentence for one in certificate_conditions(REAL, gauge()))


def test_u_covers_the_truth_as_often_as_it_says() -> None:
    """A small part of ``benchmarks.coverage``, with scales as they are: 95 % of 20 are 16 at least, by chance 1 in 200.

    With the temperature of the scales in U, XM at the far face was covered in every run.
    """
    found = coverage(20, seed=2, u_scales_K=0.5)
    assert min(found.values()) >= 16 / 20
    assert np.mean(list(found.values())) == pytest.approx(0.955, abs=0.06)


def test_the_scales_count_as_they_are_corrected_for_nominal_expansion() -> None:
    """By hand: over a length L at scales of T with a_s, u(L) = L hypot((T - 20) u(a_s), a_s u(T))."""
    machine = shipped()[1]
    scales = {"scale_expansion_per_K": 8e-6, "temperature_C": 25.0, "scales_compensated": False}
    uncertain = (
        Uncertain("machine.scale_expansion_per_K", 8e-6, 0.6e-6),
        Uncertain("machine.temperature_C", 25.0, 0.3),
    )
    table = machine.table.model_copy(update=scales)
    frame = REAL.frame.assign(**{f"scale_temperature_{axis}_C": 25.0 for axis in "xyz"}, gauge_temperature_C=25.0)
    comments = {"temperature_convention": "nominal_expansion", "scale_expansion_per_K": "8e-6"}
    read = replace(REAL, frame=frame).assign_comments(**comments)
    for compensated in (False, True):
        scaled = replace(machine, table=table.model_copy(update={"scales_compensated": compensated}))
        made = recording_model(read, replace(scaled, uncertain=uncertain), gauge(), 0.1).keep_temperature_error()
        budget = make_budget(made, BudgetOptions())
        far = next(one for one in budget.lines if one.name == "xf_um" and one.face == 11)
        length_m = from_first_m(gauge(), 11)
        assert far.contribution["machine.scale_expansion_per_K"] == pytest.approx(5.0 * 0.6 * length_m, rel=2e-3)
        assert far.contribution["machine.temperature_C"] == pytest.approx(8.0 * 0.3 * length_m, rel=2e-3)
        assert "of the scales" not in missing(made)
    silent = recording_model(read, replace(machine, table=table), gauge(), 0.1).keep_temperature_error()
    assert missing(silent).count("of the scales") == 2
    as_read = read.assign_comments(temperature_convention="as_read")
    assert "of the scales" not in missing(recording_model(as_read, machine, gauge(), 0.1).keep_temperature_error())


def test_a_corrected_drift_counts_with_the_uncertainty_of_its_rate() -> None:
    """20 nm/s are taken off as evaluate does; u of the rate times the time between the faces is left."""
    order = np.arange(len(REAL))
    axis = np.array([-0.001, 1.0, 0.0])
    drifting = REAL.frame.assign(time_s=2.0 * order)
    for name, share in zip(("x_mm", "y_mm", "z_mm"), axis, strict=True):
        drifting[name] = drifting[name] + 0.04e-3 * order * share
    read = replace(REAL, frame=drifting)
    plain, corrected = (recording_model(read, shipped()[1], gauge(), 0.1, correct_drift=on) for on in (False, True))
    result = sg.evaluate(read, gauge(), correct_drift=True).results[0]
    far = len(result.xf_um) - 2
    for of, name, expected_um in ((plain, "drift of the readings", None), (corrected, "correction of the drift", 0.2)):
        budget = make_budget(of.keep_temperature_error(), BudgetOptions())
        line = next(one for one in budget.lines if one.name == "xf_um" and one.face == 11)
        others = {"drift of the readings", "correction of the drift"} - {name}
        assert line.contribution[name] > 0.0
        assert not any(line.contribution.get(one) for one in others)
        if expected_um is not None:
            assert line.value == pytest.approx(result.xf_um[far])
            assert line.contribution[name] < expected_um
    assert plain.best()[far] - corrected.best()[far] == pytest.approx(0.04 * 10, abs=0.1)


def test_a_contribution_by_the_name_of_a_gap_states_it() -> None:
    """``probing=0.1`` was counted, and probing was not evaluated all the same."""
    of = model()
    stated = of.machine.stated.model_copy(update={"probing_um": None})
    bare = replace(of, machine=replace(of.machine, stated=stated))
    assert "probing (" in missing(bare)
    assert "probing (" not in missing(bare, BudgetOptions(contributions=(parse_contribution("probing=0.1"),)))
    assert "probing (" in missing(bare, BudgetOptions(contributions=(parse_contribution("form=0.1"),)))
