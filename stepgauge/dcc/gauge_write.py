"""A gauge file as the Digital Calibration Certificate that its laboratory would send.

The schema has no place for how uncertainties of several faces belong together; that is told as quantities of our own
beside the table, by name for a person and by kind for :mod:`.gauge_read`.
"""

from __future__ import annotations

from dataclasses import replace

from stepgauge.dcc.elements import (
    D,
    Element,
    QuantityValues,
    administrative,
    certificate,
    condition,
    machine_item,
    quantity,
    software,
    statement,
    words,
)
from stepgauge.dcc.read import EXAMPLE, MEASURED, NOMINAL
from stepgauge.dcc.units import CELSIUS, MICROMETRE_PER_METRE, MILLIMETRE, ONE, PER_KELVIN
from stepgauge.dcc.write import FACE
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.reports.certificate_file import Laboratory
from stepgauge.reports.statements import ONLY_ITEMS

EXPANSION, REFERENCE_TEMPERATURE = "stepgauge_expansion", "stepgauge_referenceTemperature"
WIDTH, HEIGHT, MATERIAL = "stepgauge_blockWidth", "stepgauge_blockHeight", "stepgauge_material"
RAIL_WIDTH, RAIL_HEIGHT = "stepgauge_railWidth", "stepgauge_railHeight"
CORRELATION, FREEDOM = "stepgauge_correlation", "stepgauge_degreesOfFreedom"
PROPORTIONAL = "stepgauge_proportionalUncertainty"


def gauge_certificate(gauge: Gauge, said: Laboratory) -> Element:
    """The root of the DCC of a step gauge.

    Positions with U and k as the gauge file has them, expansion with k = 2, block sizes and material as quantities of
    the item. :class:`InputError` names what a DCC demands and ``said`` lacks, or an item that is not this gauge.
    """
    said = _check_item(said, gauge)
    item = machine_item(said, gauge.table.name)
    item.append(_properties(gauge))
    statements = [statement(ONLY_ITEMS, reference="7.8.2.1 l)")]
    if gauge.certificate.example:
        statements.insert(0, statement("Example certificate: this gauge was not calibrated.", EXAMPLE))
    if said.statements.traceability:
        statements.append(statement(said.statements.traceability, reference="7.8.4.1 c)"))
    return certificate(administrative(said, item, statements), [_result(gauge, said)])


def _check_item(said: Laboratory, gauge: Gauge) -> Laboratory:
    """Name and serial number of the item are those of the gauge file, whose certificate is the one that is written."""
    if said.item.serial not in (None, gauge.table.serial):
        found, expected = said.item.serial, f"{gauge.table.serial} ({gauge.table.name})"
        raise InputError(said.path, "key item.serial is not that of the gauge", found=found, expected=expected)
    _check_certificate(said, gauge)
    return replace(said, item=said.item.model_copy(update={"name": gauge.table.name, "serial": gauge.table.serial}))


def _check_certificate(said: Laboratory, gauge: Gauge) -> None:
    """:class:`InputError` where form and gauge file tell of different certificates: by number, or by date.

    A gauge file may have the day of the calibration or that of the issue.
    """
    head, own = said.certificate, gauge.certificate
    if head.number not in (None, own.number):
        what = f"key certificate.number is not that of {gauge.path}"
        raise InputError(said.path, what, found=head.number, expected=own.number)
    first, last = head.performed_from or own.date, head.issued or head.performed_to or own.date
    if not first <= own.date <= last:
        what = f"[certificate] performed_from to issued does not hold certificate.date of {gauge.path}"
        raise InputError(said.path, what, found=f"{first} to {last}", expected=own.date)


def _properties(gauge: Gauge) -> Element:
    table = gauge.table
    expansion = QuantityValues([table.expansion_per_K], PER_KELVIN, 9, [2.0 * table.expansion_uncertainty_per_K], [2.0])
    material = D.itemQuantity(words("name", "Material"), words("noQuantity", table.material), refType=MATERIAL)
    sizes = (
        ("Width of a block", WIDTH, QuantityValues([table.block_width_mm], MILLIMETRE, 4)),
        ("Height of a block", HEIGHT, QuantityValues([table.block_height_mm], MILLIMETRE, 4)),
        ("Width of the rail", RAIL_WIDTH, QuantityValues([gauge.rail_width_mm], MILLIMETRE, 4)),
        ("Height of the rail", RAIL_HEIGHT, QuantityValues([table.rail_height_mm], MILLIMETRE, 4)),
    )
    return D.itemQuantities(
        quantity("Coefficient of linear thermal expansion", EXPANSION, expansion, "itemQuantity"),
        material,
        *(quantity(*one, "itemQuantity") for one in sizes),
    )


def _result(gauge: Gauge, said: Laboratory) -> Element:
    k = gauge.certificate.coverage_factor
    temperature = QuantityValues([gauge.table.reference_temperature_C], CELSIUS, 2)
    place = "Reference temperature of the positions"
    expanded_mm = [float(u) * k * 1e-3 for u in gauge.u_um]
    finer = 3  # that no face has less than its part that is common to all
    positions = QuantityValues(list(gauge.position_mm), MILLIMETRE, 6, expanded_mm, [k] * gauge.n_faces, finer=finer)
    table = D.list(
        quantity("Face number", FACE, QuantityValues(list(range(1, gauge.n_faces + 1)), ONE, 0)),
        quantity("Nominal position", NOMINAL, QuantityValues(list(gauge.nominal_mm), MILLIMETRE, 6)),
        quantity("Position of the face from face 1", MEASURED, positions),
        refType="gp_table1",
    )
    return D.measurementResult(
        words("name", "Positions of the faces"),
        D.usedMethods(D.usedMethod(words("name", said.method.name or "Calibration of step gauges"))),
        D.usedSoftware(software()),
        D.influenceConditions(condition(place, REFERENCE_TEMPERATURE, [(place, REFERENCE_TEMPERATURE, temperature)])),
        D.results(D.result(words("name", "Positions of the faces"), D.data(table, *_uncertainty_statements(gauge)))),
    )


def _uncertainty_statements(gauge: Gauge) -> list[Element]:
    """What the gauge file states of the uncertainties of all positions together."""
    stated = gauge.certificate
    known = (
        ("Correlation coefficient of the positions of any two faces", CORRELATION, stated.correlation, ONE),
        (
            "Part of U that grows with the position and is common to all faces, k as of U",
            PROPORTIONAL,
            stated.proportional_um_per_m,
            MICROMETRE_PER_METRE,
        ),
        ("Effective degrees of freedom of the uncertainties", FREEDOM, stated.degrees_of_freedom, ONE),
    )
    return [
        quantity(name, kind, QuantityValues([value], unit, 6)) for name, kind, value, unit in known if value is not None
    ]
