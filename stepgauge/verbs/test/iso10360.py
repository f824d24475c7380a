"""``test iso10360``: the length measurement test of a CMM by ISO 10360-2."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import verb
from stepgauge.verbs.kinds import Number, OneOf, Reads, Repeated, Text, Vector
from stepgauge.verbs.shared import (
    Convention,
    CoverageFactor,
    File,
    GaugeLike,
    MachineIfNeeded,
    Placements,
    Recordings,
    TipDiameter,
    UGaugeTemperature,
)
from stepgauge.verbs.statements import write_test

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.machine.file import Machine
    from stepgauge.recording import Recording
    from stepgauge.reports.outcome import StandardTest

OfOther = Annotated["File | Recording | None", Reads("RECORDING")]
U = Number("um", 0.0)


@verb(write_test)
def iso10360(
    recordings: Recordings,
    gauge: GaugeLike,
    *,
    mpe: Annotated[str, Text("LIMIT")],
    mpe_repeatability_um: Annotated[float | None, Number("um", above=0.0)] = None,
    machine: MachineIfNeeded = None,
    placements: Placements = (),
    offset_recordings: Annotated[
        "File | Recording | Iterable[File | Recording]", Repeated(Reads("RECORDING"), "offset-recording")
    ] = (),
    mpe_offset: Annotated[str | None, Text("LIMIT")] = None,
    offset_machine: Annotated["File | Machine | None", Reads("MACHINE", room="machines")] = None,
    normal: OfOther = None,
    normal_gauge: Annotated["File | Gauge | None", Reads("GAUGE", room=".")] = None,
    tip_diameter_mm: TipDiameter = None,
    u_tip_diameter_um: Annotated[float | None, U] = None,
    unidirectional: Annotated[str, OneOf("fronts", "backs")] = "fronts",
    lengths_mm: Annotated["Sequence[float] | None", Vector("MM,...", unit="mm", above=0.0)] = None,
    u_gauge_temperature_K: UGaugeTemperature = None,
    u_alignment_mrad: Annotated[float | None, Number("mrad", 0.0)] = None,
    u_fixture_um: Annotated[float | None, U] = None,
    also: Annotated["str | Iterable[str]", Repeated(OneOf("b89", "vdi2617"), "also")] = (),
    coverage_factor: CoverageFactor = 2.0,
    temperature_convention: Convention = None,
) -> "StandardTest":
    """Errors of length measurement of a CMM by ISO 10360-2.

    By ISO 10360-2:2009, from recordings of a step gauge. Every placement is a measuring position (seven files, or one
    with a column placement), every cycle a repeat. The four body diagonals are mandatory, three positions are the
    user's choice. In each position five lengths are tested with three repeats: bidirectional ones (front of a block to
    back of another, minus the tip diameter), which are E0, and unidirectional ones for information. R0 is the range of
    the three repeats. The decision rule is that of ISO 14253-1: the expanded uncertainty of the test is subtracted from
    the limit, so that a test value conforms, does not conform, or is not decidable. Rules of the standard that are not
    met make the test incomplete; each is named, and so is what is left out.

    'stepgauge test plan' makes the seven placements and their programs.

    Parameters
    ----------
    mpe : E0,MPE: maximum permissible error of length measurement "A + L/K" or "min(A + L/K, B)", um with L in mm
    mpe_repeatability_um : R0,MPL: limit of the range R0; default: no decision
    machine : machine file or shipped name: its travel tells whether positions and lengths are those asked
    offset_recordings : recording with the stylus tip 150 mm off the axis of the ram: E150; once per position, two of
        them
    mpe_offset : E150,MPE, "A + L/K"; needed with ``offset_recordings``
    offset_machine : machine file with the stylus of the ``offset_recordings``
    normal : beside a gauge of low expansion: recording of a gauge of normal expansion, a length or more, three repeats
    normal_gauge : the gauge of ``normal``
    tip_diameter_mm : effective tip diameter as the machine's qualification gave it; default: 2 R_eff from the gauge's
        own first block, which hides an error of size; the report says so
    u_tip_diameter_um : standard uncertainty of that diameter; leave out where it is the machine's own and so part of
        the test
    unidirectional : faces that unidirectional lengths lie between
    lengths_mm : nominal bidirectional lengths to test, five of them; default: shortest, longest and three between
    u_gauge_temperature_K : standard uncertainty of the gauge's temperature; default: not evaluated, and listed
    u_alignment_mrad : standard uncertainty of the angle between gauge and evaluated axis, in each direction across it;
        default: not evaluated, and listed
    u_fixture_um : standard uncertainty by the gauge's fixture; default: not evaluated, and listed
    also : judge the same errors by ASME B89.4.10360.2 or VDI/VDE 2617, too; unconfirmed

    Returns
    -------
    The test: its errors and decisions, with figure, table and report.

    Examples
    --------
    stepgauge test iso10360 position-*.csv -g step-gauge-1020 -m bridge-cmm --mpe "1.8 + L/350" \\
        --mpe-repeatability 1.5 --tip-diameter 3.9940 --u-gauge-temperature 0.05 -o iso10360
    """
    from stepgauge.reports.iso10360 import length_outcome
    from stepgauge.standards.iso10360 import Choices, Specification, length_test
    from stepgauge.standards.iso10360_series import E150, NORMAL
    from stepgauge.standards.length_uncertainty import TestConditions
    from stepgauge.standards.mpe import Mpe
    from stepgauge.verbs.inputs import (
        joined_recordings,
        resolve_gauge,
        resolve_machine,
        resolve_placements,
        several,
        stated_together,
    )

    others = several(offset_recordings)
    stated_together("u_tip_diameter_um", u_tip_diameter_um, "tip_diameter_mm", tip_diameter_mm)
    stated_together("offset_recordings", others or None, "mpe_offset", mpe_offset, both=True)
    stated_together("normal", normal, "normal_gauge", normal_gauge, both=True)
    steps, cmm = resolve_gauge(gauge), None if machine is None else resolve_machine(machine)
    limit = Mpe.parse(mpe)
    uncertain = TestConditions(
        u_gauge_temperature_K, u_alignment_mrad, u_fixture_um, u_tip_diameter_um, coverage_factor
    )
    lengths = None if lengths_mm is None else tuple(lengths_mm)
    choices = Choices(tip_diameter_mm, unidirectional, lengths, normal is not None)  # type: ignore[arg-type]
    bare: Any = Choices(tip_diameter_mm, unidirectional, None, False)  # type: ignore[arg-type]
    recording = joined_recordings(several(recordings), temperature_convention, cmm)
    asked = Specification(limit, mpe_repeatability_um, tuple(several(also)))
    test = length_test(recording, steps, asked, uncertain, choices, cmm, resolve_placements(placements, steps))
    further = []
    if normal is not None and normal_gauge is not None:
        one, beside = joined_recordings([normal], machine=cmm), resolve_gauge(normal_gauge)
        further.append(length_test(one, beside, Specification(limit), uncertain, bare, cmm, (), NORMAL))
    if others and mpe_offset is not None:
        stylus = cmm if offset_machine is None else resolve_machine(offset_machine)
        offset = Specification(Mpe.parse(mpe_offset))
        further.append(
            length_test(joined_recordings(others, machine=stylus), steps, offset, uncertain, bare, stylus, (), E150)
        )
    return length_outcome(test, cmm, further)
