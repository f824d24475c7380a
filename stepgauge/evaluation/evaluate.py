"""Recording and certificate to the machine's errors: Pahk & Kim, equations 1 to 13.

Positions M are tip centres projected on the gauge axis; the front of the first used block is the reference. The reading
of a back face is one tip diameter farther along the axis than the face, so 2 R_eff is subtracted in XB. Temperature
convention: the certified positions S are brought to the recorded gauge temperature; readings are not corrected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions import Conditions
from stepgauge.conditions.decision import NO_LIMIT, ConformityDecision
from stepgauge.conditions.gauge import gauge_conditions
from stepgauge.conditions.outliers import ExcludedReading
from stepgauge.conditions.readings import project_readings
from stepgauge.errors import InputError, naming
from stepgauge.evaluation.definitions import corrected_readings, definitions
from stepgauge.evaluation.face_errors import REffOrigin, band_um, face_errors, radius_blocks, reference_face
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted, figures, join_lines
from stepgauge.files.outputs import open_set
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.conventions import recorded_scales_C
from stepgauge.recording.corrected import corrected_radius_mm
from stepgauge.recording.face_readings import FaceStatistics
from stepgauge.recording.identity import check_gauge
from stepgauge.recording.rows import check_copies

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from stepgauge.machine.file import Machine
    from stepgauge.standards.mpe import Mpe


@dataclass(frozen=True)
class EffectiveRadiusEstimate:
    """R_eff (Eq 1), its standard uncertainty (NaN without repeats) and the blocks it was found from.

    Without blocks it is the radius by which the readings had been corrected, which is exact.
    """

    r_eff_mm: float
    u_mm: float
    blocks: tuple[int, ...]


@dataclass(frozen=True)
class PlacementResult:
    """Errors of one placement of the gauge; arrays have one entry per face of the used section, NaN where undefined.

    ``xf_um``, ``xb_um``: forward and backward error (Eqs 2-4, 6); ``sf_um``, ``sb_um``: standard deviation over the
    cycles (Eqs 5, 7); half of each is interpolated from the neighbours (Eqs 8-11). ``xm_um``: mean (Eq 12); ``xr_um``:
    reversal (Eq 13). ``count``: probings of each face. Temperatures are means of the recording, None where it has none;
    ``scale_temperature_C`` is of the scales that read the length, each by its share of it. ``conditions``: what was
    found of the readings and of what the numbers are made from.
    """

    placement: int
    axis: Array
    face: NDArray[np.int64]
    nominal_mm: Array
    position_mm: Array
    xf_um: Array
    sf_um: Array
    xb_um: Array
    sb_um: Array
    xm_um: Array
    xr_um: Array
    count: NDArray[np.int64]
    radius: EffectiveRadiusEstimate
    origin_mm: Array
    gauge_temperature_C: float | None
    conditions: Conditions
    left_out: tuple[ExcludedReading, ...] = ()
    scale_temperature_C: float | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not as it has to be, in sentences."""
        return self.conditions.notes

    @property
    def span_mm(self) -> float:
        """Certified distance from the first to the last face that was measured, at the reference temperature."""
        measured = self.position_mm[self.count > 0]
        return float(measured[-1] - measured[0])

    @property
    def band_um(self) -> float:
        """Largest minus smallest mean error; NaN where no mean is defined."""
        return float(band_um(self.xm_um))

    @property
    def worst_two_sigma_um(self) -> float:
        """Twice the largest standard deviation of a measured face; NaN with a single cycle."""
        measured = np.where(self.face % 2 == 1, self.sf_um, self.sb_um)
        return 2.0 * float(np.nanmax(measured)) if np.isfinite(measured).any() else float("nan")

    @property
    def cycles(self) -> tuple[int, int]:
        """Least and largest number of probings of a measured face."""
        seen = self.count[self.count > 0]
        return int(seen.min()), int(seen.max())

    def lines(self) -> list[str]:
        """Notes and the main numbers, as the command line prints them."""
        name = f"placement {self.placement}"
        main = (
            f"{name}: span {self.span_mm:.1f} mm, range of the mean error XM {_um(self.band_um)},"
            f" largest 2s {_um(self.worst_two_sigma_um)},"
            f" {self._radius_words()}"
        )
        return [*(f"{name}: note: {note}" for note in self.notes), main]

    def _radius_words(self) -> str:
        if not self.radius.blocks:
            return f"corrected with the tip radius {self.radius.r_eff_mm:.5f} mm"
        return f"R_eff {self.radius.r_eff_mm:.5f} mm (u = {_um(self.radius.u_mm * 1e3)})"


def _um(value: float) -> str:
    return "undefined" if value != value else f"{value:.2f} um"


@dataclass(frozen=True, repr=False)
class Evaluation(Plotted):
    """Results of all placements of a recording.

    ``limit``: maximum permissible error that they are compared with; ``decision``: what that comparison gives.
    ``recording``, ``machine``: what it was made from and on which machine, where they are known, for further figures.
    """

    drawn_by: ClassVar[str] = "evaluation.draw_placement"
    gauge: Gauge
    blocks: tuple[int, int]
    r_eff_origin: REffOrigin
    results: tuple[PlacementResult, ...]
    path: str = ""
    comments: Mapping[str, str] = field(default_factory=dict)
    limit: Mpe | None = None
    decision: ConformityDecision = NO_LIMIT
    recording: Recording | None = field(default=None, repr=False, compare=False)
    machine: Machine | None = field(default=None, repr=False, compare=False)

    @property
    def r_eff_mm(self) -> float:
        """Effective tip radius of the first placement."""
        return self.results[0].radius.r_eff_mm

    @property
    def u_r_eff_mm(self) -> float:
        """Its standard uncertainty; NaN where nothing was repeated."""
        return self.results[0].radius.u_mm

    @property
    def conditions(self) -> Conditions:
        """Those of all placements, each once."""
        return sum((one.conditions for one in self.results), Conditions())

    def summary(self) -> str:
        """Notes, span, range of XM, largest 2s and R_eff by placement, as the command line prints them."""
        decided = [] if self.limit is None else [self.decision.text]
        return join_lines(*(line for one in self.results for line in one.lines()), *decided)

    def to_frame(self) -> pd.DataFrame:
        """One row per face and placement: positions in mm, errors and standard deviations in um, NaN if undefined."""
        from stepgauge.evaluation.files import face_frame

        return face_frame(self)

    def plot(self, axes: Axes | None = None, placement: int | None = None, *, before: Evaluation | None = None) -> Axes:
        """XF, XB and XM in um against the nominal position in mm, with 2s bands, of a placement (the first).

        With ``before``, an earlier evaluation of the same gauge: XM of both, and their difference with a band of its
        expanded uncertainty (:class:`InputError` where they cannot be compared).
        """
        return self._drawn(axes, placement=placement, before=before)

    def select_placement(self, placement: int | None = None) -> PlacementResult:
        """The result of a placement by its number, None for the first; :class:`InputError` where there is none."""
        for one in self.results:
            if placement in (None, one.placement):
                return one
        numbers = ", ".join(str(one.placement) for one in self.results)
        raise InputError("placement", "the evaluation does not have it", found=placement, expected=numbers)

    def draw(self, folder: str | Path, kinds: Sequence[str] = ("all",), figure: str = "png") -> list[Path]:
        """Draw figures of the measurement into a folder: error, bidirectional, repeatability, arrows, run, or all."""
        if self.recording is None:
            raise InputError("evaluation", "its recording is not known", expected="an evaluation that was made now")
        drawing = figures("measurement")
        chosen = drawing.KINDS if "all" in kinds else tuple(kinds)
        given = (self.recording, self, chosen, self.limit, self.machine, figure)
        return list(drawing.draw_measurement(folder, *given))

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``evaluation.json`` and ``evaluation.csv``; returns the paths. Figures: :meth:`draw`."""
        from stepgauge.evaluation.files import write_evaluation

        with open_set():
            return write_evaluation(folder, self)


def evaluate(
    recording: Recording,
    gauge: Gauge,
    blocks: tuple[int, int] | None = None,
    r_eff_origin: REffOrigin | None = None,
    placements: Sequence[Placement] = (),
    correct_drift: bool = False,
) -> Evaluation:
    """Evaluate a recording, one placement after the other.

    Parameters
    ----------
    recording : tip centres at the trigger
    gauge : certified positions
    blocks : first and last block of the used section; default: from the lowest to the highest that was measured
    r_eff_origin : ``"first"``: the effective radius from the first used block, whose XB is then zero by construction;
        ``"all"``: the mean over all used blocks; ``"corrected"``: that by which the readings had been corrected, so
        that the errors are those which the machine indicated; default: ``"corrected"`` for readings that had been
        corrected for the tip, else ``"first"``
    placements : of the gauge, in the order of the placement numbers; default: the axis is the mean of the
        forward approaches minus the backward ones
    correct_drift : take off a drift with time that the repeats show; default: it is remarked

    Raises
    ------
    InputError
        faces the gauge does not have, approaches from the wrong side of the face, positions of another gauge, a
        section without a complete block
    """
    check_gauge(recording, gauge)
    check_copies(recording)
    numbers = recording.placements
    if placements and len(placements) != len(numbers):
        raise InputError(
            recording.path,
            "one placement file per placement",
            found=len(placements),
            expected=f"{len(numbers)} or none",
        )
    section = blocks or _measured_section(recording)
    origin = r_eff_origin or usual_origin(recording)
    results = []
    for index, number in enumerate(numbers):
        axis = placements[index].axis if placements else None
        part = recording if len(numbers) == 1 else recording.select_placement(number)
        results.append(_evaluate_placement(part, gauge, section, origin, axis, number, correct_drift))
    return Evaluation(gauge, section, origin, tuple(results), recording.path, recording.comments)


def usual_origin(recording: Recording) -> REffOrigin:
    """Where R_eff comes from unless somebody says otherwise."""
    return "first" if corrected_radius_mm(recording) is None else "corrected"


def _measured_section(recording: Recording) -> tuple[int, int]:
    faces = recording.columns["face"]
    first, last = (int(faces.min()) + 1) // 2, (int(faces.max()) + 1) // 2
    if first == last:
        raise InputError(recording.path, "only one block was measured", found=f"block {first}", expected="two or more")
    return first, last


def _evaluate_placement(
    recording: Recording,
    gauge: Gauge,
    section: tuple[int, int],
    origin: REffOrigin,
    axis: Array | None,
    number: int,
    correct_drift: bool,
) -> PlacementResult:
    readings = project_readings(recording, gauge, section, axis, correct_drift=correct_drift)
    faces, kept = readings.faces, slice(None) if readings.kept is None else readings.kept
    seen = readings.by_face.statistics(faces)
    _check_reference(seen, recording.path)
    blocks = _check_blocks(seen, origin, recording)
    u_um, correlation = gauge.u_um[faces - 1], gauge.correlation_of(faces)
    errors = face_errors(seen, u_um, origin, correlation, readings.corrected_mm)
    temperature, scales = recording.columns.get("gauge_temperature_C"), recorded_scales_C(recording)
    defined = definitions(seen, origin, blocks, gauge.position_mm[faces - 1], errors.xm_um)
    conditions = gauge_conditions(recording, gauge, readings, seen) + defined + corrected_readings(recording, origin)
    first_touch = int(np.abs(readings.face - faces[0]).argmin())
    return PlacementResult(
        number,
        readings.axis,
        faces,
        gauge.nominal_mm[faces - 1],
        gauge.position_mm[faces - 1],
        errors.xf_um,
        errors.sf_um,
        errors.xb_um,
        errors.sb_um,
        errors.xm_um,
        errors.xr_um,
        seen.count,
        EffectiveRadiusEstimate(float(errors.r_eff_mm), float(errors.u_r_eff_mm), blocks),
        np.array([column[kept][first_touch] for column in recording.numbers(POSITION)]),
        None if temperature is None else float(temperature[kept].mean()),
        conditions,
        readings.left_out,
        None if scales is None else float(scales[kept].mean()),
    )


def _check_reference(seen: FaceStatistics, path: str) -> None:
    """M_ref and S_ref belong to face 1 of the used section, or to the first front that was measured."""
    if reference_face(seen) is None:
        raise InputError(path, "no front face of the used section was measured", expected="at least one front face")


def _check_blocks(seen: FaceStatistics, origin: REffOrigin, recording: Recording) -> tuple[int, ...]:
    """Numbers of the blocks that the effective radius comes from; none where the readings had been corrected."""
    chosen = radius_blocks(seen, origin)
    if origin == "corrected":
        if corrected_radius_mm(recording) is None:
            what = "these readings had not been corrected for the tip: there is no radius of a correction"
            raise InputError(recording.path, what, expected=naming("r_eff_origin", words="{} first or all"))
    elif not chosen.size:
        expected = "one complete block for the effective radius"
        raise InputError(recording.path, "no block has both faces measured", expected=expected)
    return tuple(int(b) for b in (seen.faces[0] + 1) // 2 + chosen)
