"""A placement in words and as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stepgauge.gauge.placement import Placement

if TYPE_CHECKING:
    import pandas as pd

ANGLES = ("yaw_deg", "pitch_deg", "n1_to_axis_mrad", "n2_to_axis_mrad")
SAID = {"nearest_machine_axis", "from_nearest_axis_deg", "n1_to_axis_mrad", "n2_to_axis_mrad", "pitch_deg", "yaw_deg"}
SAID |= {"smallest_error_found_um", "yaw_urad", "pitch_urad", "tip_radius_um"}
"""What locate writes of every placement."""
UNCERTAINTIES = ("yaw_urad", "pitch_urad", "n1_urad", "n2_urad", "length_um", "tip_radius_um")


def placement_lines(placement: Placement) -> list[str]:
    """What locate says; of a placement that somebody wrote by hand only what it states."""
    lines = [f"note: {note}" for note in placement.details.get("notes", ())]
    angles, u = placement.details.get("angles"), placement.details.get("uncertainty")
    if not angles or not u or not angles.keys() | u.keys() >= SAID:
        axis = ", ".join(f"{value:.6f}" for value in placement.axis)
        return [*lines, f"axis ({axis}) from block {placement.first_block} to block {placement.last_block}"]
    found_um = u["smallest_error_found_um"]
    off = f"{min(found_um):.1f} to {max(found_um):.1f} um"
    seen = f"a point that is off by {off}, depending on the point, would be seen"
    radius = f"effective tip radius {placement.tip_radius_mm:.4f} mm (u = {u['tip_radius_um']:.2f} um)"
    return [*lines, _axis(angles, u), _normals(angles, placement), seen, radius]


def _axis(angles: dict[str, Any], u: dict[str, Any]) -> str:
    off_deg = f"{angles['from_nearest_axis_deg']:.4f}"
    away = "along" if float(off_deg) == 0.0 else f"{off_deg} deg off"
    nearest = f"the gauge lies {away} machine {angles['nearest_machine_axis']}"
    yaw = "it stands upright"
    if angles["yaw_deg"] != "undefined":
        yaw = f"yaw (about z) {angles['yaw_deg']:.5f} deg, u {u['yaw_urad']:.1f} um per m"
    return f"{nearest}; {yaw}; pitch (rise) {angles['pitch_deg']:.5f} deg, u {u['pitch_urad']:.1f} um per m"


def _normals(angles: dict[str, Any], placement: Placement) -> str:
    off = (f"{angles[f'n{end}_to_axis_mrad']:.2f} mrad" for end in (1, 2))
    blocks = f"of blocks {placement.first_block} and {placement.last_block}"
    return f"the front faces {blocks} are {' and '.join(off)} off square to the axis"


def placement_frame(placement: Placement) -> pd.DataFrame:
    """One row; NaN where the placement does not state a number."""
    import pandas as pd

    row: dict[str, object] = {"first_block": placement.first_block, "last_block": placement.last_block}
    for name, values, unit in (("c1", placement.c1_mm, "_mm"), ("c2", placement.c2_mm, "_mm")):
        row |= {f"{name}_{axis}{unit}": float(value) for axis, value in zip("xyz", values, strict=True)}
    for name, values in (("axis", placement.axis), ("up", placement.up)):
        row |= {f"{name}_{axis}": float(value) for axis, value in zip("xyz", values, strict=True)}
    row["tip_radius_mm"] = _number(placement.tip_radius_mm)
    angles, u = placement.details.get("angles", {}), placement.details.get("uncertainty", {})
    row |= {name: _number(angles.get(name)) for name in ANGLES}
    row |= {f"u_{name}": _number(u.get(name)) for name in UNCERTAINTIES}
    return pd.DataFrame([row])


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")
