"""An evaluation with its budget as a Digital Calibration Certificate of the machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.dcc.elements import (
    D,
    Element,
    QuantityValues,
    administrative,
    certificate,
    condition,
    identifications,
    machine_item,
    quantity,
    software,
    statement,
    words,
)
from stepgauge.dcc.read import ERROR, EXAMPLE, MEASURED, REFERENCE
from stepgauge.dcc.units import CELSIUS, MICROMETRE, MILLIMETRE, ONE
from stepgauge.errors import InputError, naming
from stepgauge.files.notation import make_sentence
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.recording.simulated import SIMULATED_WARNING, is_simulated
from stepgauge.reports.certificate_file import Laboratory
from stepgauge.reports.statements import IN_FULL, METHOD, ONLY_ITEMS, measurand_text, traceability, uncertainty_text
from stepgauge.standards.budget_files import StoredBudget, StoredLine
from stepgauge.standards.conformity import Conformity, conformity
from stepgauge.standards.mpe import Mpe

ERRORS = {
    "xf": ("Forward error XF", "stepgauge_forwardError"),
    "xb": ("Backward error XB", "stepgauge_backwardError"),
    "xm": ("Mean error XM", "stepgauge_meanError"),
    "xr": ("Reversal XR", "stepgauge_reversal"),
}
FACE, POSITION, RADIUS = "stepgauge_face", f"{REFERENCE} stepgauge_position", f"{MEASURED} stepgauge_effectiveRadius"


def machine_certificate(
    evaluation: dict[str, Any],
    budget: StoredBudget,
    said: Laboratory,
    gauge: Gauge,
    machine: Machine | None,
    mpe: Mpe | None = None,
) -> Element:
    """The root of the DCC of a machine.

    Parameters
    ----------
    evaluation : as :func:`stepgauge.reports.reading.read_checked_evaluation` gives it
    budget : of this evaluation, checked to belong to it
    said : what the laboratory states; :class:`InputError` names what a DCC demands and it lacks
    gauge, machine : files that were used, checked to belong to the evaluation
    mpe : limit that conformity is computed from
    """
    _check_coverage(budget)
    judged = None if mpe is None else conformity(evaluation, budget, mpe)
    named = machine.table.name if machine else evaluation["comments"].get("machine")
    item = machine_item(said, named or "Measuring machine")
    several = len(evaluation["placements"]) > 1
    results = [
        _result(evaluation, placed, budget, said, gauge, machine, several) for placed in evaluation["placements"]
    ]
    return certificate(administrative(said, item, _statements(evaluation, budget, said, judged)), results)


def _check_coverage(budget: StoredBudget) -> None:
    """D-SI has coverage factors of 1 and more; an interval of 50 % has a smaller one."""
    least = min(line.k for line in budget.quantities)
    if least < 1.0:
        found = f"k = {least:.3f} ({budget.coverage_percent:g} %)"
        what = "a coverage factor below 1 has no place in a digital certificate"
        raise InputError(
            "budget", what, found=found, expected=naming("coverage_percent", words="a budget with {} 95.45")
        )


def _statements(
    evaluation: dict[str, Any],
    budget: StoredBudget,
    said: Laboratory,
    judged: Conformity | None,
) -> list[Element]:
    told = said.statements
    found = [
        *(statement(text, EXAMPLE) for text in _example_marks(evaluation, said)),
        statement(ONLY_ITEMS, reference="7.8.2.1 l)"),
        statement(IN_FULL, reference="7.8.2.1"),
        statement(measurand_text(evaluation, budget), reference="7.8.4.1 a)"),
        *(statement(text) for text in _hidden_reversal(evaluation)),
        statement(traceability(said, evaluation), reference="7.8.4.1 c)"),
    ]
    if said.certificate.place_text:
        found.append(statement(f"Place of the calibration: {said.certificate.place_text}.", reference="7.8.2.1 c)"))
    if said.method.deviations:
        found.append(statement(said.method.deviations, reference="7.8.2.1 n)"))
    if told.external:
        found.append(statement(told.external, reference="7.8.2.1 p)"))
    if told.adjustment:
        found.append(statement(told.adjustment, reference="7.8.4.1 d)"))
    if judged is not None:
        found.append(statement(judged.text, "basic_conformity", "7.8.6"))
    if said.certificate.replaces:
        found.append(
            statement(f"This certificate replaces certificate {said.certificate.replaces}.", reference="7.8.8")
        )
    if told.remarks:
        found.append(statement(told.remarks))
    return found


def _example_marks(evaluation: dict[str, Any], said: Laboratory) -> Iterator[str]:
    """Why this is no real calibration."""
    if evaluation["gauge"]["example"]:
        yield "The certificate of the step gauge is an example: this is not a real calibration."
    if said.certificate.example:
        yield "This certificate is an example: this is not a real calibration."
    if is_simulated(evaluation["comments"]):
        yield f"{SIMULATED_WARNING} This certificate is an example."


def _hidden_reversal(evaluation: dict[str, Any]) -> list[str]:
    """What an evaluation remarks of a reversal error that is common to all blocks and so in R_eff."""
    return [
        make_sentence(one.sentence)
        for one in stored_conditions(evaluation).of("reversal", "effective radius")
        if one.state != "met"
    ]


def _result(
    evaluation: dict[str, Any],
    placed: dict[str, Any],
    budget: StoredBudget,
    said: Laboratory,
    gauge: Gauge,
    machine: Machine | None,
    several: bool,
) -> Element:
    axis = ", ".join(f"{v:.6f}" for v in placed["axis"])
    number = placed["placement"]
    title = "Linear displacement errors" + (f", placement {number}" if several else "")
    return D.measurementResult(
        words("name", title),
        words("description", f"Measured along the direction ({axis}) in machine coordinates x, y, z."),
        D.usedMethods(*_methods(budget, said)),
        D.usedSoftware(software()),
        D.measuringEquipments(gauge_equipment(gauge)),
        D.influenceConditions(*_conditions(evaluation, placed, said, machine)),
        D.results(*_radius(budget, number), *(_errors(budget, number, name) for name in ERRORS)),
    )


def _methods(budget: StoredBudget, said: Laboratory) -> list[Element]:
    own = D.usedMethod(words("name", said.method.name or "Step gauge calibration"), words("description", METHOD))
    own.extend(D.norm(one) for one in said.method.standards)
    guide = words("name", "Expanded measurement uncertainty")
    told = words("description", uncertainty_text(budget))
    return [own, D.usedMethod(guide, told, D.norm("JCGM 100:2008"), refType="basic_uncertainty")]


def gauge_equipment(gauge: Gauge) -> Element:
    """The step gauge as the standard used."""
    known = (
        ("manufacturer", "Serial number", gauge.table.serial),
        ("calibrationLaboratory", "Calibration certificate", gauge.certificate.number),
    )
    name = words("name", f"Step gauge {gauge.table.name}")
    return D.measuringEquipment(name, identifications(known), refType="basic_normalUsed")


def _conditions(
    evaluation: dict[str, Any], placed: dict[str, Any], said: Laboratory, machine: Machine | None
) -> list[Element]:
    warm = placed["gauge_temperature_C"]
    if warm is None:
        told = "Not recorded; certified positions are used at their reference temperature."
        found = [condition("Temperature of the step gauge", "stepgauge_gaugeTemperature", [], told)]
    else:
        numbers = QuantityValues([warm], CELSIUS, 3)
        kind = "stepgauge_gaugeTemperature"
        found = [condition("Temperature of the step gauge", kind, [("Mean of the recording", kind, numbers)])]
    at_C, told = placed.get("scale_temperature_C"), "Mean of the recording"
    if at_C is None and machine is not None:
        at_C, told = machine.table.temperature_C, "Stated for the machine"
    if at_C is not None:
        kind = "stepgauge_scaleTemperature"
        found.append(condition("Temperature of the scales", kind, [(told, kind, QuantityValues([at_C], CELSIUS, 3))]))
    for name, kind, pair, unit, factor in (
        ("Air temperature", "basic_temperature", said.conditions.temperature_C, CELSIUS, 1.0),
        ("Relative humidity", "basic_humidityRelative", said.conditions.humidity_percent, ONE, 0.01),
    ):
        if pair is not None:
            ends = zip(("Min", "Max"), ("Lowest", "Highest"), pair, strict=True)
            rows = [(word, kind + end, QuantityValues([value * factor], unit, 4)) for end, word, value in ends]
            found.append(condition(name, kind, rows))
    return found


def _radius(budget: StoredBudget, placement: int) -> Iterator[Element]:
    """The effective radius, where it is a result: what the readings had been corrected with is none."""
    line = budget.find("r_eff", placement, None)
    if line is None:
        return
    numbers = QuantityValues(
        [line.value_um * 1e-3], MILLIMETRE, 7, [line.expanded_um * 1e-3], [line.k], budget.coverage_percent
    )
    yield D.result(words("name", "Effective tip radius"), D.data(quantity("Effective radius R_eff", RADIUS, numbers)))


def _errors(budget: StoredBudget, placement: int, name: str) -> Element:
    """One kind of error at all faces that have it; what is zero by construction is left out."""
    lines = [q for q in budget.quantities if (q.quantity, q.placement) == (name, placement) and uncertain(q)]
    title, kind = ERRORS[name]
    u, k = [line.expanded_um for line in lines], [line.k for line in lines]
    values = QuantityValues([line.value_um for line in lines], MICROMETRE, 4, u, k, budget.coverage_percent)
    table = D.list(
        quantity("Face number", FACE, QuantityValues([line.face or 0 for line in lines], ONE, 0)),
        quantity("Certified position", POSITION, QuantityValues(_positions(lines), MILLIMETRE, 5)),
        quantity(title, f"{ERROR} {kind}", values),
        refType="gp_table1",
    )
    return D.result(words("name", title), D.data(table))


def uncertain(line: StoredLine) -> bool:
    """Whether a line says anything: the reference, and XB of the block of R_eff, are zero by construction."""
    return line.expanded_um >= 0.00005


def _positions(lines: Sequence[StoredLine]) -> list[float]:
    return [line.position_mm or 0.0 for line in lines]
