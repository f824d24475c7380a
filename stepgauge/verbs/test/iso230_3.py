"""``test iso230-3``: drift tests of a machine tool by ISO 230-3."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import OneOf, Reads
from stepgauge.verbs.shared import File, GaugeIfNeeded
from stepgauge.verbs.statements import write_test
from stepgauge.verbs.test.iso230 import EXPANDED, TOLERANCES

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.machine.virtual import Run
    from stepgauge.recording import Recording
    from stepgauge.reports.outcome import StandardTest


def leave(values: dict[str, object], typed: set[str]) -> tuple[str, ...]:
    """A table of displacements has no gauge; one that was typed says that a recording is given."""
    return () if "gauge" in typed else ("gauge",)


@verb(write_test, leaves=leave)
def iso230_3(
    source: Annotated["File | pd.DataFrame | Recording | Run", Reads("TABLE|RECORDING"), ARGUMENT],
    gauge: GaugeIfNeeded = None,
    *,
    test: Annotated[str, OneOf("etve", "axis")],
    tolerances: Annotated["str | Iterable[str]", TOLERANCES] = (),
    expanded_uncertainty_um: Annotated[float | None, EXPANDED] = None,
) -> "StandardTest":
    """Drift tests of a machine tool by ISO 230-3.

    By ISO 230-3:2020: ETVE, and thermal distortion by moving a linear axis. TABLE is a CSV file with time_s,
    displacements NAME_um (of the sensors: x1_um, y1_um, ..) and temperatures NAME_C. The ETVE of a displacement is its
    range over the test. For a linear axis d_60 is the range in the first 60 min and d_t that of the whole test; instead
    of a table a RECORDING of a step gauge along the axis will do (``gauge``): its blocks at the low and the high end of
    the axis are the targets P1 and P2, approached in both directions of the axis. A displacement is then the change of
    the indicated position along the axis.

    Parameters
    ----------
    source : table of displacements, or a recording of a step gauge along the axis
    gauge : what is given is a recording of this step gauge along the axis, with time_s (only with the test axis)
    test : etve: the machine stands still while the room changes; axis: an axis moves and warms up
    tolerances : tolerance of the range of a displacement, um, x1=8
    expanded_uncertainty_um : expanded uncertainty U (k = 2) of the ranges; default: not stated, and conformity is then
        not proven

    Returns
    -------
    The test: ``test.channels`` has the ranges, with figure, table and report.

    Examples
    --------
    stepgauge test iso230-3 sensors.csv --test etve --tolerance x1=8 --expanded-uncertainty 0.6 -o etve
    stepgauge test iso230-3 warm-up.csv --test axis -g step-gauge-600 -o warm-up
    """
    from stepgauge.errors import InputError, naming
    from stepgauge.files.tables import given_table
    from stepgauge.reports.drift import drift_outcome
    from stepgauge.standards.drift import drift_of_recording, drift_test, read_drift
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.verbs.inputs import joined_recordings, resolve_gauge, several

    if gauge is not None and test == "etve":
        raise InputError(naming("gauge"), naming("test", words="goes with {} axis: an ETVE test moves nothing"))
    source = source if gauge is not None else given_table(source)
    if gauge is None and not isinstance(source, File):
        raise InputError(naming("gauge"), "a recording of a step gauge needs it")
    if gauge is None and isinstance(source, File):
        drift = read_drift(source)
    else:
        drift = drift_of_recording(joined_recordings([source]), resolve_gauge(gauge))  # type: ignore[arg-type]
    names = list(drift.displacement_um)
    requirement = Requirement.parse(tuple(several(tolerances)), expanded_uncertainty_um, names)
    return drift_outcome(drift_test(drift, "etve" if test == "etve" else "axis", requirement))
