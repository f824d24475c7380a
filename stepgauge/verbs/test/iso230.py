"""``test iso230``: accuracy and repeatability of positioning by ISO 230-2."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Number, OneOf, Pair, Reads, Repeated
from stepgauge.verbs.shared import Convention, File, GaugeIfNeeded, MachineIfNeeded, Placements, TipDiameter
from stepgauge.verbs.statements import write_test

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.axis.recording import AxisRecording
    from stepgauge.machine.file import Machine
    from stepgauge.machine.virtual import Run
    from stepgauge.recording import Recording
    from stepgauge.reports.outcome import StandardTest
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.standards.positioning import PositioningTest

    One = File | Recording | Run | AxisRecording | pd.DataFrame

TOLERANCES = Repeated(Pair(metavar="NAME=UM", whole=True), "tolerance")
EXPANDED = Number("um", above=0.0)


def leave(values: dict[str, object], _: set[str]) -> tuple[str, ...]:
    """A recording of one axis has its own targets."""
    from stepgauge.axis.recording import is_axis_recording

    recordings = values["recordings"]
    first = recordings[0] if isinstance(recordings, list | tuple) and recordings else None
    return ("gauge",) if isinstance(first, str) and is_axis_recording(first) else ()


@verb(write_test, leaves=leave)
def iso230(
    recordings: Annotated["One | Iterable[One]", Repeated(Reads("RECORDING"), "recording"), ARGUMENT],
    gauge: GaugeIfNeeded = None,
    *,
    machine: MachineIfNeeded = None,
    placements: Placements = (),
    tip_diameter_mm: TipDiameter = None,
    pair: Annotated[str, OneOf("middle", "faces")] = "middle",
    actual: Annotated[str | None, OneOf("reading", "target")] = None,
    tolerances: Annotated["str | Iterable[str]", TOLERANCES] = (),
    also: Annotated["str | Iterable[str]", Repeated(OneOf("vdi3441", "b5.54"), "also")] = (),
    expanded_uncertainty_um: Annotated[float | None, EXPANDED] = None,
    temperature_convention: Convention = None,
) -> "StandardTest":
    """Accuracy and repeatability of positioning of an axis by ISO 230-2.

    With a step gauge or an instrument, by ISO 230-2:2014. Every block is a target position, every cycle a run. Fronts
    are approached in one direction, backs in the other; the tip diameter is subtracted from the backs. Gives the
    accuracy A, the systematic deviation E, the repeatability R (of each direction and of both), the reversal error B
    and its mean, the mean bidirectional deviation M, and the standard's figure. A deviation is the actual position
    minus the target, so its sign is opposite to that of XF and XB in evaluate.

    A recording of one axis ('stepgauge import --sensor') needs no gauge: its targets are the target positions, its
    cycles the runs. The results of a rotary axis up to 360 deg are in deg and arcsec. Where targets were approached
    from one side only, the parameters of that direction are given (A_up, E_up, R_up, or down).

    Several recordings are several axes. Requirements of the standard that are not met are listed.

    Parameters
    ----------
    recordings : recordings of a gauge, or of axes; one or several
    gauge : the certified gauge, its file or shipped name; a recording of one axis needs none
    machine : machine file or shipped name: tells how much of the axis was measured
    tip_diameter_mm : effective tip diameter found independently of the reversal; default: 2 R_eff from the gauge's own
        first block, whose reversal is then zero by construction
    pair : front and back of a block as one target: run means carried to the block's middle along neighbouring faces, or
        taken as they are, a block apart
    actual : of a recording of one axis: what the actual position is; default: the reading of an instrument; of a probe
        that touches, the target
    tolerances : tolerance of a parameter, um (of a rotary axis arcsec), A=10 or R_up=4
    also : evaluate the same deviations by VDI/DGQ 3441 or ASME B5.54, too
    expanded_uncertainty_um : expanded uncertainty U (k = 2) of the parameters (of a rotary axis arcsec), as estimated
        by ISO/TR 230-9; default: not stated, and conformity is then not proven

    Returns
    -------
    The test: ``test.axes`` has the parameters, with figure, table and report.

    Examples
    --------
    stepgauge test iso230 recording.csv -g step-gauge-420 -o positioning
    stepgauge test iso230 x.csv y.csv -g my-gauge.toml -m my-machine.toml --tip-diameter 3.9940 -o positioning
    stepgauge test iso230 axis.csv --tolerance A=12 -o positioning
    """
    from dataclasses import replace

    from stepgauge.reports.iso230 import positioning_outcome
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.verbs.inputs import are_of_axis, resolve_machine, several

    cmm = None if machine is None else resolve_machine(machine)
    requirement = Requirement.parse(tuple(several(tolerances)), expanded_uncertainty_um)
    given = several(recordings)
    if are_of_axis(given):
        test = _axis_test(given, gauge, tip_diameter_mm, actual, requirement)
    else:
        test = _gauge_test(
            given, gauge, cmm, placements, tip_diameter_mm, pair, actual, requirement, temperature_convention
        )
    return positioning_outcome(replace(test, further=tuple(several(also))), cmm)


def _gauge_test(
    recordings: list[object],
    gauge: object,
    machine: "Machine | None",
    placements: object,
    tip_diameter_mm: float | None,
    pair: str,
    actual: str | None,
    requirement: "Requirement",
    convention: str | None,
) -> "PositioningTest":
    """The test from recordings of a step gauge."""
    from stepgauge.errors import InputError, naming
    from stepgauge.standards.positioning import positioning_test
    from stepgauge.verbs.inputs import joined_recordings, resolve_gauge, resolve_placements

    recording = joined_recordings(recordings, convention, machine)  # what is wrong there is told first
    if gauge is None:
        raise InputError(naming("gauge"), "a recording of a step gauge needs it")
    if actual:
        raise InputError(naming("actual"), "is for a recording of one axis; a step gauge's positions are certified")
    steps = resolve_gauge(gauge)  # type: ignore[arg-type]
    lies = resolve_placements(placements, steps)  # type: ignore[arg-type]
    return positioning_test(recording, steps, tip_diameter_mm, pair, machine, lies, requirement)  # type: ignore[arg-type]


def _axis_test(
    recordings: list[object],
    gauge: object,
    tip_diameter_mm: float | None,
    actual: str | None,
    requirement: "Requirement",
) -> "PositioningTest":
    """The test from recordings of one axis, which have no tip."""
    from stepgauge.axis.recording import join_axis_recordings
    from stepgauge.errors import InputError, naming
    from stepgauge.standards.positioning_axis import axis_positioning_test
    from stepgauge.verbs.inputs import resolve_axis

    if gauge is not None:
        raise InputError(naming("gauge"), "is for recordings of a step gauge; one of an axis has its own targets")
    if tip_diameter_mm is not None:
        raise InputError(naming("tip_diameter_mm"), "is for a step gauge; a recording of one axis has no tip")
    recording = join_axis_recordings([resolve_axis(one) for one in recordings])  # type: ignore[arg-type]
    return axis_positioning_test(recording, actual, requirement)  # type: ignore[arg-type]
