"""Probe files and ``[probe]`` tables -> probes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.config import check_table, file_beside, read_toml
from stepgauge.files.resources import find_data
from stepgauge.physics import contact, stylus
from stepgauge.physics.pretravel import Elasticity
from stepgauge.physics.trigger import Tripod, rest_reactions_N
from stepgauge.probes.base import ConstantProbe, LobedProbe, Probe, head_frame
from stepgauge.probes.empirical import add_laws
from stepgauge.probes.mechanical import KinematicProbe, MechanicalProbe, PiezoProbe
from stepgauge.probes.schema import (
    TABLES,
    ConstantTable,
    KinematicTable,
    LobedTable,
    MapTable,
    PiezoTable,
    ProbeTable,
    SeatTable,
    SurfaceTable,
)
from stepgauge.probes.table import TableProbe, read_map

MM_PER_UM = 1e-3
KG_PER_G = 1e-3


def read_probe(name: str | Path, stylus_direction: Sequence[float] | None = None) -> Probe:
    """A probe file, by path or by the name of a shipped one (``omp40-2-50mm``).

    ``stylus_direction``, from body to tip in machine axes, replaces that of the file. Raises :class:`InputError`.
    """
    path = find_data(name, "probe", "probes")
    data = read_toml(path)
    unknown = [key for key in data if key != "probe"]
    if unknown:
        raise InputError(path, f"table [{unknown[0]}] is not known", expected="[probe] and tables inside it")
    return probe_from_table(data.get("probe"), path, stylus_direction)


def probe_from_table(data: Any, where: str | Path, stylus_direction: Sequence[float] | None = None) -> Probe:
    """The probe of a ``[probe]`` table of the file ``where``, which may name a probe file with ``file``.

    Raises :class:`InputError`, also for a probe that gravity opens in its orientation.
    """
    return make_probe(*probe_table(data, where, stylus_direction))


def make_probe(table: ProbeTable, where: str | Path) -> Probe:
    """The probe that a checked table describes; ``where`` is the file the table stands in."""
    return add_laws(_probe_of_table(table, where), table.empirical)


def _probe_of_table(table: ProbeTable, where: str | Path) -> Probe:
    if isinstance(table, KinematicTable):
        return _mechanical(table, where)
    common = _common(table)
    if isinstance(table, LobedTable):
        phase = float(np.radians(table.phase_deg))
        return LobedProbe(mean_um=table.pretravel_um, amplitude_um=table.amplitude_um, phase_rad=phase, **common)
    if isinstance(table, MapTable):
        return TableProbe(map=read_map(file_beside(where, "probe.map", table.map), table.symmetry), **common)
    assert isinstance(table, ConstantTable)
    return ConstantProbe(constant_um=table.pretravel_um, **common)


def probe_table(
    data: Any, where: str | Path, stylus_direction: Sequence[float] | None = None
) -> tuple[ProbeTable, str | Path]:
    """The checked table, and the file it stands in.

    With ``file = "omp40-2-50mm"`` the table of that file is taken (looked for beside ``where``, then like any probe
    file), and the other keys given here take the place of its own.
    """
    if not isinstance(data, dict):
        raise InputError(where, "table [probe] is missing", expected="model, tip_radius_mm and the keys of the model")
    if "file" in data:
        data, where = _named(data, where)
    model = data.get("model", "constant")
    if model not in TABLES:
        raise InputError(where, "key probe.model is wrong", found=repr(model), expected=", ".join(TABLES))
    if stylus_direction is not None:
        data = {**data, "stylus_direction": list(stylus_direction)}
    return check_table(TABLES[model], data, where, "probe"), where


def _named(data: dict[str, Any], where: str | Path) -> tuple[dict[str, Any], Path]:
    name = data["file"]
    if not isinstance(name, str):
        raise InputError(
            where, "key probe.file is wrong", found=repr(name), expected="a probe file, or a shipped probe"
        )
    beside = Path(where).parent / name
    path = beside if beside.is_file() else find_data(name, "probe", "probes")
    table = read_toml(path).get("probe")
    if not isinstance(table, dict) or "file" in table:
        raise InputError(path, "table [probe] is missing or names yet another file", expected="[probe] with a model")
    return {**table, **{key: value for key, value in data.items() if key != "file"}}, path


def _common(table: ProbeTable) -> dict[str, Any]:
    return {
        "name": table.name,
        "tip_radius_mm": table.tip_radius_mm,
        "frame": head_frame(table.stylus_direction, float(np.radians(table.roll_deg))),
        "stylus_length_mm": table.stylus_length_mm,
    }


def _mechanical(table: KinematicTable, where: str | Path) -> MechanicalProbe:
    sections = [stylus.StylusSection(**section.model_dump()) for section in table.stylus]
    length = stylus.length_mm(sections)
    if table.stylus_length_mm is not None and abs(table.stylus_length_mm - length) > 0.01:
        found = f"{table.stylus_length_mm:g}"
        raise InputError(
            where, "key probe.stylus_length_mm is wrong", found=found, expected=f"{length:g}, the sections"
        )
    parts: dict[str, Any] = {
        **_common(table),
        "stylus_length_mm": length,
        "tripod": _tripod(table.seat, sections),
        "elasticity": _elasticity(table, sections),
        "seat_friction": table.seat.friction,
        "arm_radius_mm": table.seat.arm_radius_mm,
        "tip_friction": table.surface.friction if table.surface else 0.0,
        "indentation": table.surface.indentation if table.surface else "added",
    }
    if isinstance(table, PiezoTable):
        return _closed(PiezoProbe(lateral_N=table.sensor.lateral_N, axial_N=table.sensor.axial_N, **parts), where)
    return _closed(KinematicProbe(**parts), where)


def _tripod(seat: SeatTable, sections: stylus.Stylus) -> Tripod:
    carrier_kg, stylus_kg = KG_PER_G * seat.mass_g, stylus.mass_kg(sections)
    total = carrier_kg + stylus_kg
    stylus_centre = seat.carrier_mm + stylus.centre_of_mass_mm(sections)
    depth = (carrier_kg * seat.mass_centre_mm + stylus_kg * stylus_centre) / total if total > 0.0 else 0.0
    return Tripod(
        preload_N=seat.preload_N,
        contact_radius_mm=seat.contact_radius_mm,
        contact_angle_rad=float(np.radians(seat.contact_angle_deg)),
        lever_mm=seat.carrier_mm + stylus.length_mm(sections),
        arm_azimuth_rad=float(np.radians(seat.arm_azimuth_deg)),
        preload_offset_mm=seat.preload_offset_mm,
        weight_N=total * stylus.GRAVITY_M_S2,
        weight_depth_mm=depth,
        opening_force_N=seat.opening_force_N,
    )


def _elasticity(table: KinematicTable, sections: stylus.Stylus) -> Elasticity:
    return Elasticity(
        lateral_mm_per_N=stylus.lateral_compliance_mm_per_N(sections),
        axial_mm_per_N=stylus.axial_compliance_mm_per_N(sections),
        seat_mm_per_N23=_seat_coefficient(table.seat),
        tip_mm_per_N23=_tip_coefficient(table.surface, table.tip_radius_mm),
        opening_mm=MM_PER_UM * table.seat.opening_um,
    )


def _seat_coefficient(seat: SeatTable) -> float:
    if seat.ball_radius_mm is None:
        return 0.0
    modulus = contact.contact_modulus_N_mm2(seat.modulus_GPa, seat.poisson, seat.modulus_GPa, seat.poisson)
    return float(contact.ball_on_cylinder(seat.ball_radius_mm, seat.arm_radius_mm, modulus))


def _tip_coefficient(surface: SurfaceTable | None, tip_radius_mm: float) -> float:
    if surface is None:
        return 0.0
    modulus = contact.contact_modulus_N_mm2(
        surface.tip_modulus_GPa, surface.tip_poisson, surface.modulus_GPa, surface.poisson
    )
    return float(contact.ball_on_plane(tip_radius_mm, modulus))


def _closed(probe: MechanicalProbe, where: str | Path) -> MechanicalProbe:
    """The probe, if it stays in its seat in its orientation, and can be deflected."""
    least = float((rest_reactions_N(probe.tripod, probe.down) - probe.tripod.opening_N).min())
    if least <= 0.0:
        found = f"a contact reaction of {least:.3g} N above opening"
        raise InputError(
            where, "the probe is open before it touches, as it is held", found=found, expected="more preload"
        )
    steepest = float(np.tan(probe.tripod.contact_angle_rad))
    if probe.seat_friction >= steepest:
        expected = f"less than {steepest:.3g}, the tangent of the contact angle"
        raise InputError(where, "key probe.seat.friction jams the seat", found=probe.seat_friction, expected=expected)
    return probe
