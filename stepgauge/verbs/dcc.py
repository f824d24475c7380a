"""The verbs of Digital Calibration Certificates."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Number, OneOf, Reads, Text
from stepgauge.verbs.shared import File, GaugeLike, MachineIfNeeded, OutputFile

if TYPE_CHECKING:
    from stepgauge.dcc.documents import CheckedCertificate, GaugeFromCertificate, WrittenCertificate
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.gauge.certified import Gauge
    from stepgauge.standards.budget_files import StoredBudget

Laboratory = Annotated[
    File,
    Reads("FILE", short="c"),
    "certificate.toml: what only the laboratory knows; 'stepgauge list files certificate --copy-to .' gives one",
]
Schema = Annotated[
    File | None,
    Reads("XSD"),
    "schema to validate against, too: dcc.xsd with its imports beside it (of PTB; not shipped here)",
]
Size = Annotated[float | None, Number("mm", above=0.0, high=200.0)]
Word = Annotated[str | None, Text()]


def write_certificate(certificate: "WrittenCertificate", output: OutputFile) -> list[File]:
    """The certificate.

    Parameters
    ----------
    output : certificate to write, NAME.xml
    """
    certificate.write(output)
    return [output]


@verb(write_certificate)
def write_dcc(
    evaluation: Annotated["File | Evaluation", Reads("EVALUATION", folder=True), ARGUMENT],
    gauge: GaugeLike,
    *,
    certificate: Laboratory,
    machine: MachineIfNeeded = None,
    budget: Annotated["File | StoredBudget | None", Reads("B", folder=True)] = None,
    attach: Annotated[File | None, Reads("PDF")] = None,
    schema: Schema = None,
) -> "WrittenCertificate":
    """A Digital Calibration Certificate of a machine, from what evaluate and budget wrote.

    XF, XB, XM and XR at every face and R_eff, each with its expanded uncertainty, coverage factor and probability;
    method, gauge, temperatures, and what the laboratory states. What a DCC demands and certificate.toml lacks is named,
    never filled in. What is written is read back before it counts.

    Parameters
    ----------
    evaluation : its folder or evaluation.json, or an evaluation
    machine : machine file or shipped name: adds the name of the machine and the temperature of the scales
    budget : budget.json of stepgauge budget; default: that of the evaluation, beside it or among
        the results of the project
    attach : printed certificate (.pdf) to put into the file

    Returns
    -------
    The certificate, which writes itself.

    Examples
    --------
    stepgauge evaluate recording.csv -g step-gauge-420 -o result
    stepgauge budget recording.csv -g step-gauge-420 -m machine.toml -o result
    stepgauge dcc write result -c certificate.toml -g step-gauge-420 -m machine.toml -o certificate.xml
    """
    from stepgauge.dcc.documents import WrittenCertificate, certificate_of, read_pdf
    from stepgauge.dcc.elements import attach as attach_file
    from stepgauge.errors import InputError, naming
    from stepgauge.reports.made_from import BUDGET, budget_of
    from stepgauge.reports.sources import read_sources
    from stepgauge.verbs.inputs import stored_evaluation

    data, path = stored_evaluation(evaluation)
    if budget is None and isinstance(evaluation, File):
        budget = budget_of(data, path) or Path(path).parent / BUDGET
    if budget is None or (isinstance(budget, File) and not Path(budget).exists()):
        where = naming("budget") if budget is None else budget
        raise InputError(where, "no such file: a certificate needs uncertainties", expected="stepgauge budget")
    root = certificate_of(data, read_sources(data, gauge, (), machine, budget, certificate))
    if attach is not None:
        attach_file(root, Path(attach).name, "application/pdf", read_pdf(attach))
    return WrittenCertificate(root, schema)


@verb(shows=True)
def check_dcc(
    certificate: Annotated[File, Reads("CERT.XML"), ARGUMENT], *, schema: Schema = None
) -> "CheckedCertificate":
    """Read a Digital Calibration Certificate, check it, and say what it states.

    The schema leaves units and uncertainties open; this checks them: every unit must be D-SI and fit its quantity,
    lists must have equal lengths, results must have an uncertainty with a coverage factor. Exit code 2 otherwise.

    Parameters
    ----------
    certificate : the certificate (XML)

    Returns
    -------
    Its quantities with their uncertainties.

    Examples
    --------
    stepgauge dcc check certificate.xml
    """
    from stepgauge.dcc.documents import CheckedCertificate
    from stepgauge.dcc.read import parse_document
    from stepgauge.dcc.xml import read_xml, validate

    root = read_xml(certificate)
    if schema is not None:
        validate(root, schema, certificate)
    return CheckedCertificate(parse_document(root, certificate), schema)


def write_gauge_file(gauge: "GaugeFromCertificate", output: OutputFile) -> list[File]:
    """The gauge file.

    Parameters
    ----------
    output : gauge file to write, NAME.toml; NAME.csv with the faces goes beside it
    """
    return list(gauge.write(output))


@verb(write_gauge_file)
def import_gauge_dcc(
    certificate: Annotated[File, Reads("CERT.XML"), ARGUMENT],
    *,
    name: Word = None,
    serial: Word = None,
    material: Word = None,
    expansion_per_K: Annotated[float | None, Number("1/K", 0.0, 40e-6)] = None,
    u_expansion_per_K: Annotated[float | None, Number("1/K", 0.0, 10e-6)] = None,
    reference_temperature_C: Annotated[float | None, Number("deg C", 15.0, 30.0)] = None,
    block_width_mm: Size = None,
    block_height_mm: Size = None,
    positions: Annotated[str | None, Text("NAME")] = None,
    nominal: Annotated[str | None, Text("NAME")] = None,
    deviations: Annotated[str | None, OneOf("measured-nominal", "nominal-measured")] = None,
) -> "GaugeFromCertificate":
    """A gauge certificate that arrived as a DCC, as a gauge file that all verbs read.

    Positions with their uncertainties and coverage factor, expansion, serial number, laboratory and date are looked for
    in the certificate, in any unit of length that D-SI has. What is not there must be stated with the options, and is
    then taken; where each value comes from is said and kept as comments of the file. Options win over the certificate.

    Parameters
    ----------
    certificate : the certificate (XML)
    name : what the gauge is called; default: the item's name
    serial : serial number; default: the manufacturer's in the certificate
    material : material, e.g. steel
    expansion_per_K : expansion, e.g. 11.5e-6 per K
    u_expansion_per_K : standard uncertainty of the expansion; 0 only if it is known exactly
    reference_temperature_C : temperature at which the positions hold; 20 by ISO 1
    block_width_mm : width of a block along s
    block_height_mm : height above the rail
    positions : name or refType of the list of positions, where there are several candidates
    nominal : name or refType of the list of nominal positions
    deviations : the list has deviations, subtracted so; default: by its name, e.g. 'Soll-Ist'; else measured-nominal

    Returns
    -------
    What the gauge file will state, and where each value comes from.

    Examples
    --------
    stepgauge dcc import-gauge gauge.xml --block-width 20 --block-height 15 -o my-gauge.toml
    """
    from stepgauge.dcc.documents import GaugeFromCertificate
    from stepgauge.dcc.gauge_read import StatedGauge, import_gauge

    stated = StatedGauge(
        name=name,
        serial=serial,
        material=material,
        expansion_per_K=expansion_per_K,
        expansion_uncertainty_per_K=u_expansion_per_K,
        reference_temperature_C=reference_temperature_C,
        block_width_mm=block_width_mm,
        block_height_mm=block_height_mm,
        positions=positions,
        nominal=nominal,
        deviations=deviations,
    )
    return GaugeFromCertificate(import_gauge(certificate, stated))


@verb(write_certificate)
def export_gauge_dcc(
    gauge: Annotated["File | Gauge", Reads("GAUGE", room="."), ARGUMENT],
    *,
    certificate: Laboratory,
    schema: Schema = None,
) -> "WrittenCertificate":
    """The Digital Calibration Certificate of a step gauge from its gauge file: what a gauge laboratory sends.

    Faces with nominal and certified positions, U and k, expansion, sizes, material and reference temperature;
    'stepgauge dcc import-gauge' reads it back to the same gauge. Correlation, the part of U that is common to all faces
    and degrees of freedom have no place in the schema: they are quantities beside the positions, and another reader may
    not know them. Number, laboratory and date are those of the certificate file.

    Parameters
    ----------
    gauge : gauge file, or the name of a shipped one

    Returns
    -------
    The certificate, which writes itself.

    Examples
    --------
    stepgauge dcc export-gauge step-gauge-420 -c laboratory.toml -o gauge.xml
    """
    from stepgauge.dcc.documents import WrittenCertificate
    from stepgauge.dcc.gauge_write import gauge_certificate
    from stepgauge.reports.certificate_file import read_laboratory
    from stepgauge.verbs.inputs import resolve_gauge

    return WrittenCertificate(gauge_certificate(resolve_gauge(gauge), read_laboratory(certificate)), schema)
