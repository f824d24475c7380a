"""``evaluate``: recordings and certificate to the errors of the machine."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, cast

from stepgauge.errors import naming
from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.evaluate import evaluate as evaluate_recording
from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.files.dates import parse_moment
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.public.inputs import Blocks, File, as_blocks, as_gauge, as_placements, as_recordings, one_of
from stepgauge.recording import Recording, join_recordings
from stepgauge.recording.conventions import state_convention

if TYPE_CHECKING:
    from stepgauge.machine.virtual import Run

R_EFF = ("first", "all")


def evaluate(
    recordings: File | Recording | Run | Iterable[File | Recording | Run],
    gauge: File | Gauge,
    *,
    placements: File | Placement | Iterable[File | Placement] = (),
    blocks: Blocks = None,
    r_eff: str = "first",
    measured_at: str | None = None,
    machine_name: str | None = None,
    temperature_convention: str | None = None,
    correct_drift: bool = False,
) -> Evaluation:
    """Errors of the machine from recordings of the step gauge (Pahk & Kim, equations 1 to 13).

    Parameters
    ----------
    recordings : one recording, run or file, or several as several placements
    gauge : the certified gauge, its file or shipped name
    placements : where the gauge lay, in the order of the placement numbers; default: the axis is the mean approach
    blocks : first and last block of the used section, ``"1:21"`` or ``(1, 21)``; default: what was measured
    r_eff : effective tip radius from the ``"first"`` used block (its XB is then zero by construction) or from ``"all"``
    measured_at : when it was measured, ``2026-03-02`` or with time; for the history
    machine_name : machine that measured it, where the recording does not say
    temperature_convention : what the readings have been corrected for: ``"as_read"``, ``"corrected_to_20"`` (by the
        machine) or ``"nominal_expansion"`` (to be corrected with the coefficients of scales and gauge); default: as the
        recording says
    correct_drift : take off a drift with time that the repeats show; default: it is remarked

    Returns
    -------
    Errors XF, XB, XM, XR in um at every face, standard deviations, and the effective tip radius, by placement.

    Raises
    ------
    InputError
        recordings that are not of this gauge, or a section without a complete block
    """
    if measured_at:
        parse_moment(measured_at, naming("measured_at"))
    steps = as_gauge(gauge)
    origin = cast(REffOrigin, one_of("r_eff", r_eff, R_EFF))
    section = as_blocks(blocks, steps)
    lies = as_placements(placements, steps)
    tables = as_recordings(recordings)
    whole = tables[0] if len(tables) == 1 else join_recordings(tables)
    whole = state_convention(whole, temperature_convention)
    whole = whole.with_comments(measured_at=measured_at, machine=machine_name)
    return evaluate_recording(whole, steps, section, origin, lies, correct_drift)
