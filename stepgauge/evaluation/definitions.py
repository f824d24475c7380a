"""What the numbers of an evaluation mean beyond their definition: reference, effective radius, reversal."""

from __future__ import annotations

from collections.abc import Iterator

from stepgauge.conditions import Condition
from stepgauge.evaluation.face_errors import REffOrigin, radius_blocks, reference_face, reversal_of_scale_um
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.recording import Recording
from stepgauge.recording.columns import CORRECTED
from stepgauge.recording.face_readings import FaceStatistics

NOTABLE_UM = 0.1
"""Reversal that a scale error shows from which it is remarked."""


def definitions(
    seen: FaceStatistics, origin: REffOrigin, blocks: tuple[int, ...], position_mm: Array, xm_um: Array
) -> Iterator[Condition]:
    """The reference where it is not the first face, the blocks of R_eff, and what XR holds besides a reversal.

    ``position_mm``, ``xm_um``: of the faces ``(k,)``; ``blocks``: numbers of those that R_eff comes from.
    """
    reference = reference_face(seen)
    if reference:
        words = f"the reference is face {seen.faces[reference]}, because face {seen.faces[0]} was not measured"
        yield Condition("completeness", "contribution", words)
    if origin == "first":
        yield from _one_block(seen, blocks[0])
    um = reversal_of_scale_um(seen.faces, seen.count, position_mm, xm_um, origin)
    if abs(um) > NOTABLE_UM:
        words = (
            f"{rounded(um, 2, plus=True)} um of the reversal XR are of the scale error (the slope of the mean error XM)"
            " and no backlash: minus half the pitch of the blocks times the slope, by the definition of XR and R_eff"
        )
        yield Condition("reversal", "contribution", words, size_um=abs(um))


def _one_block(seen: FaceStatistics, block: int) -> Iterator[Condition]:
    if radius_blocks(seen, "first")[0] != 0:
        words = f"R_eff is from block {block}, the first one with both faces measured"
        yield Condition("effective radius", "contribution", words)
    words = (
        "the effective tip radius R_eff is from one block: the error XB of its back face is zero by construction, and a"
        " backlash that is the same at all blocks counts as tip radius, not as reversal XR"
    )
    yield Condition("reversal", "contribution", words)


def corrected_readings(recording: Recording, origin: REffOrigin) -> Iterator[Condition]:
    """What errors and R_eff are of readings that had been corrected for the tip."""
    radius = recording.comments.get(CORRECTED)
    if radius is None:
        return
    words = (
        f"the readings had been corrected for the tip with the radius {radius} mm, and are judged as they were"
        " indicated: XB and XR hold a reversal of the machine and an error of the tip's qualification"
        if origin == "corrected"
        else f"the readings had been corrected for the tip and were turned back with the radius {radius} mm: R_eff is"
        " that of the tip only if they had been corrected with the same"
    )
    yield Condition("effective radius", "contribution", words)
