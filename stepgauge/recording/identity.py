"""Whether a recording is what it says it is: this gauge, these faces, tip centres in mm, approached as stated.

Every verb that sets a recording against a gauge asks here, so that a file that lies is refused everywhere with the same
evidence.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.files.units import unit_hint
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.columns import APPROACH, POSITION, STYLUS
from stepgauge.recording.conventions import scales_longer, warmer_K
from stepgauge.recording.face_readings import FaceReadings
from stepgauge.recording.rows import check_beside, check_copies, check_rows, dot
from stepgauge.recording.table import Recording

WRONG_GAUGE_MM = 0.5
"""A face farther than this (plus 0.1 % of its distance) from its certified place is not that face."""
RADIUS_MM, RADIUS_SHARE = 0.1, 0.3
"""The effective radius is the tip radius less the pre-travel: farther apart than the larger of a length and a share of
the tip radius, one of them is not true. A mistaken radius is off by half of it, all of it, or twice."""
LARGEST_RADIUS_MM = 25.0
TURNED = "the gauge lies end for end: its faces fit the certificate from the other end"
MOST_NAMED = 6
"""Faces that a message lists before the last one."""


def check_recording(recording: Recording, gauge: Gauge) -> None:
    """Every check of gross errors, placement by placement (the axis is the mean approach).

    :class:`InputError` names the evidence: another serial number, faces the gauge does not have, faces approached from
    the wrong side, swapped or reversed, positions in another unit or of another gauge, points that are no tip centres,
    points beside the gauge, temperatures and times that no thermometer or clock gave, readings that are there twice.
    """
    check_gauge(recording, gauge)
    check_copies(recording)
    for placement in recording.placements:
        part = recording.select_placement(placement)
        face = part.columns["face"]
        columns = part.numbers(POSITION)
        approach = part.numbers(APPROACH)
        axis = axis_from_approaches(approach, face, recording.path)
        check_approaches(dot(approach, axis), face, recording.path)
        along = dot(columns, axis)
        readings = FaceReadings.of(along - certified_mm(part, gauge, face), face)
        check_positions(readings, along, gauge, recording.path)
        check_beside(columns, axis, face, gauge, recording.path)
        check_tip(readings, part)
        check_rows(part)


def check_gauge(recording: Recording, gauge: Gauge) -> None:
    """Serial number and highest face of the recording against the gauge's."""
    for key, serial in stated_serials(recording.comments).items():
        if serial != gauge.table.serial:
            raise InputError(
                recording.path,
                "this is the recording of another gauge",
                found=f"{key} {serial}",
                expected=f"{gauge.table.serial} ({gauge.table.name})",
            )
    highest = int(recording.columns["face"].max())
    if highest > gauge.n_faces:
        raise InputError(
            recording.path,
            f"{gauge.table.name} has no face {highest}",
            found=f"face {highest}",
            expected=f"1 to {gauge.n_faces} (is this the recording of another gauge?)",
        )


def stated_serials(comments: Mapping[str, str]) -> dict[str, str]:
    """The gauge's serial number by the comment that states it: ``gauge_serial``, ``serial``, ``gauge``."""
    found = {key: comments[key].strip() for key in ("gauge_serial", "serial") if key in comments}
    match = re.search(r"\bserial(?: number| no\.?)?[: ]+(\S+)", comments.get("gauge", ""))
    return {**found, "gauge: serial": match[1].rstrip(",;.)")} if match else found


def axis_from_approaches(approach: Sequence[Array], face: NDArray[np.int64], path: str) -> Array:
    """Mean of the approaches to fronts minus mean of those to backs, as a unit vector."""
    front = (face & 1).astype(float)
    n_fronts = front.sum()
    n_backs = len(face) - n_fronts
    forward = np.array([np.einsum("i,i->", column, front) for column in approach])
    backward = np.array([column.sum() for column in approach]) - forward
    axis = forward / max(n_fronts, 1.0) - backward / max(n_backs, 1.0)
    size = float(np.linalg.norm(axis))
    if size < 1e-3:
        raise InputError(path, "the approaches give no gauge axis", expected="fronts probed one way, backs the other")
    return axis / size


def check_approaches(along: Array, face: NDArray[np.int64], path: str) -> None:
    """Fronts are approached along the axis, backs against it; ``along (n,)``: cosine of each approach to it."""
    onto = along * (2.0 * (face & 1) - 1.0)
    if not onto.min(initial=1.0) >= 0.5:
        row = int((~(onto >= 0.5)).argmax())
        side, way = ("front", "along") if face[row] % 2 else ("back", "against")
        raise InputError(
            path,
            f"probing {row + 1} approaches its face from the wrong side (faces swapped?)",
            found=f"face {face[row]}, a {side}, approached with {along[row]:+.3f} along the axis",
            expected=f"an approach {way} the axis",
        )


def certified_mm(recording: Recording, gauge: Gauge, face: NDArray[np.int64]) -> Array:
    """Certified position of the face of every row as the recording's temperature convention has it, mm.

    The expansion of the scales, where it is corrected, is taken off the certified instead of put on the indicated
    position: they differ by less than 0.1 mm, of which the share is nothing.
    """
    certified = gauge.position_mm[face - 1]
    longer = gauge.table.expansion_per_K * warmer_K(recording, gauge) - scales_longer(recording)
    certified *= 1.0 + longer
    return certified


def check_positions(readings: FaceReadings, along: Array, gauge: Gauge, path: str) -> None:
    """Every face must be where the certificate puts it, apart from the tip's width and the machine's errors.

    Fronts are held against fronts and backs against backs. ``along (n,)``: position along the axis.
    """
    seen = np.flatnonzero(readings.count)
    mean, face = readings.mean_mm[seen], readings.face
    level = {side: float(np.median(mean[seen % 2 == side])) for side in (0, 1) if (seen % 2 == side).any()}
    tip = abs(level.get(0, 0.0) - level.get(1, 0.0)) if len(level) == 2 else 0.0
    slots = np.array([level.get(number % 2, 0.0) for number in range(len(readings.count))])
    farthest = np.abs(readings.deviation_from_mean_mm).max() + np.abs(mean - slots[seen]).max()
    if farthest <= WRONG_GAUGE_MM and tip <= 2 * LARGEST_RADIUS_MM:
        _check_sides(mean, seen, path)
        return
    beside = readings.off_mm - slots[face]
    certified = gauge.position_mm[face - 1]
    slope = float(np.polyfit(certified, along, 1)[0]) if np.ptp(certified) else 1.0
    if -1.5 < slope < -0.5:
        _refuse_reversed(along, certified, face, slope, path)
    reach = np.abs(certified - np.median(certified))
    wrong = np.abs(beside) > WRONG_GAUGE_MM + 1e-3 * reach
    if not wrong.any() and tip > 2 * LARGEST_RADIUS_MM:
        raise InputError(
            path,
            f"blocks are not as wide as {gauge.table.name} has them: blocks and gaps exchanged, or another gauge",
            found=f"{tip:.3f} mm off",
            expected=f"one tip diameter, at most {2 * LARGEST_RADIUS_MM:g} mm",
        )
    if wrong.any():
        _refuse_turned(certified + beside, face, gauge, path)
        _refuse_exchanged((certified + beside)[wrong], face[wrong], gauge, path)
        row = int(wrong.argmax())
        measured, nominal = np.ptp(along), np.ptp(certified)
        raise InputError(
            path,
            f"probing {row + 1} of face {face[row]} is not where {gauge.table.name} has that face"
            f"{unit_hint(abs(slope), 1.0) and unit_hint(float(measured), float(measured / abs(slope)))}",
            found=f"{beside[row]:+.3f} mm off; measured span {measured:.3f} mm",
            expected=f"certified span {nominal:.3f} mm between the same faces",
        )
    _check_sides(mean, seen, path)


def exchanged(stated: NDArray[np.number], found: NDArray[np.number]) -> str:
    """The faces that two statements name one for the other, as ``7 and 8``; empty where they do not."""
    pairs = {(int(a), int(b)) for a, b in zip(stated, found, strict=True) if a != b}
    faces = sorted({a for a, _ in pairs})
    if not faces or len(pairs) != len(faces) or sorted(b for _, b in pairs) != faces:
        return ""
    return f"{', '.join(map(str, faces[:-1][:MOST_NAMED]))}{', ..' * (len(faces) > MOST_NAMED + 1)} and {faces[-1]}"


def _refuse_turned(along: Array, face: NDArray[np.int64], gauge: Gauge, path: str) -> None:
    """Readings far from their faces, which are all where the certificate has them counted from the other end."""
    turned = along - (gauge.position_mm[-1] - gauge.position_mm[::-1])[face - 1]
    off_mm = np.abs(turned - np.median(turned)).max()
    if len(np.unique(face)) > 2 and off_mm <= WRONG_GAUGE_MM:
        raise InputError(path, TURNED, found="the certified end first", expected="block 1 first")


def _refuse_exchanged(along: Array, face: NDArray[np.int64], gauge: Gauge, path: str) -> None:
    """Readings far from their faces, each of which is where another one of them is certified."""
    off = np.abs(along[:, None] - gauge.position_mm)
    faces = exchanged(face, 1 + off.argmin(axis=1))
    if faces and off.min(axis=1).max() <= WRONG_GAUGE_MM:
        what, found = f"faces {faces} look exchanged", f"face {face[0]} at {along[0]:.3f} mm"
        raise InputError(path, what, found=found, expected=f"{gauge.position_mm[face[0] - 1]:.3f} mm, as certified")


def _check_sides(mean_off_mm: Array, faces: NDArray[np.int64], path: str) -> None:
    """Backs are read one tip diameter farther than fronts; nearer means that the names are swapped."""
    sides = [mean_off_mm[faces % 2 == side] for side in (1, 0)]
    if not all(side.size for side in sides):
        return
    radius_mm = float(np.median(sides[1]) - np.median(sides[0])) / 2.0
    if radius_mm < -RADIUS_MM:
        raise InputError(
            path,
            "fronts and backs are swapped: the blocks look shorter than certified",
            found=f"an effective tip radius of {radius_mm:.3f} mm",
            expected="a radius above 0; odd faces are fronts, probed from the beginning of the gauge towards its end",
        )


def _refuse_reversed(along: Array, certified: Array, face: NDArray[np.int64], slope: float, path: str) -> None:
    """The positions fall along the mean approach: the directions are reversed, or fronts and backs are swapped."""
    rising = -along
    sizes = [
        rising[face == back].mean() - rising[face == back - 1].mean()
        for back in np.unique(face[face % 2 == 0])
        if (face == back - 1).any()
    ]
    swapped = bool(sizes) and float(np.median(sizes)) < 0.0
    what = (
        "fronts and backs are swapped: fronts lie behind the backs of their blocks"
        if swapped
        else "the approaches are reversed: they point out of the faces, as surface normals do (I++ and DMIS IJK)"
    )
    raise InputError(
        path,
        what,
        found=f"positions that change by {slope:+.4f} mm per certified mm along the mean approach to the fronts"
        + (f", and fronts {abs(float(np.median(sizes))):.3f} mm behind their backs" if swapped else ""),
        expected="+1: approaches into the material, fronts (odd faces) along the gauge",
    )


def radius_comment(stylus: int) -> str:
    """The comment that states the tip radius of a stylus."""
    return "tip_radius_mm" if stylus == 1 else f"stylus_{stylus}_tip_radius_mm"


def check_tip(readings: FaceReadings, recording: Recording) -> None:
    """The effective radius against the tip radius that the recording states, if it does (comment ``tip_radius_mm``).

    That of a further stylus is in a comment of its own, as :func:`radius_comment` says.
    """
    styli = np.unique(recording.columns.get(STYLUS, np.ones(1)))
    stated = number(recording.comments.get(radius_comment(int(styli[0])), "")) if len(styli) == 1 else np.nan
    if not np.isfinite(stated):
        return
    sides = [readings.off_mm[readings.face % 2 == side] for side in (1, 0)]
    if not all(side.size for side in sides):
        return
    radius_mm = float(sides[1].mean() - sides[0].mean()) / 2.0
    if abs(radius_mm - stated) <= max(RADIUS_MM, RADIUS_SHARE * stated):
        return
    reasons = (
        (0.0, "the points are compensated by the tip radius, not tip centres"),
        (stated / 2.0, "a diameter was taken for the radius"),
        (2.0 * stated, "a radius was taken for the diameter"),
    )
    why = next((reason for value, reason in reasons if abs(radius_mm - value) < RADIUS_MM), "another tip or gauge")
    raise InputError(
        recording.path,
        f"the blocks are not read as wide as with the tip that is stated: {why}",
        found=f"an effective radius of {radius_mm:.4f} mm",
        expected=f"about tip_radius_mm {stated:g}",
    )
