"""The finite element study of a thesis, seen by a step gauge: its 63 forces bend the readings, the diagnosis says why.

M. Rodrigues, Concordia University 2021, Tables 4.1-4.9 (``examples/omp40-fea/map.csv``): polar angles to 90 deg. On the
side of a tilted gauge that leans over, where the tables end, the forces are those of the statics that meet them.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from stepgauge.diagnosis.engine import diagnose
from stepgauge.machine.file import Machine
from stepgauge.probes import probe_table, read_probe
from stepgauge.recording import APPROACH, POSITION, Recording
from tests.diagnosis.made import machine
from tests.diagnosis.test_further_laws import STEPS, measured, named, off, turned

EXAMPLE = Path(__file__).parents[2] / "examples" / "omp40-fea"
TRUE = read_probe("omp40-2-50mm")
LEVER_MM, CONTACT_RADIUS_MM = 64.5, 16.34
"""Of the finite element model: 50 mm of stylus with 14.5 mm of carrier; only the ratio of the two shows."""
THREE = (turned(3.0), turned(40.0), turned(84.0))
TILTED = (*THREE, turned(15.0, 35.0), turned(60.0, 30.0), turned(115.0, 35.0))


def share_of_statics() -> pd.DataFrame:
    """The printed forces over those of the statics, by polar angle and azimuth."""
    printed = pd.read_csv(EXAMPLE / "map.csv", comment="#")
    polar, azimuth = np.radians(printed[["polar_deg", "azimuth_deg"]].to_numpy().T)
    normal = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
    printed["share"] = printed["trigger_force_N"] / TRUE.trigger_force_N(-normal)
    return printed.pivot(index="polar_deg", columns="azimuth_deg", values="share")


def pretravel_um(approach: np.ndarray) -> np.ndarray:
    """Pre-travel with the printed forces, the nearest direction of the tables for each."""
    table = share_of_statics()
    normal = -approach
    polar = np.degrees(np.arccos(normal[:, 2]))
    azimuth = np.degrees(np.arctan2(normal[:, 1], normal[:, 0])) % 120.0
    row = np.clip(np.rint(polar / 10.0).astype(int), 1, 9) - 1
    column = np.rint(np.minimum(azimuth, 120.0 - azimuth) / 10.0).astype(int)
    share = np.where(polar < 95.0, table.to_numpy()[row, column], 1.0)
    return TRUE.pretravel_um(approach) * share


def recorded(axes: tuple, seed: int) -> Recording:
    """The gauge in these directions, by a probe with the forces of the finite elements."""
    recording = measured(axes, seed)
    frame = recording.frame.copy()
    approach = frame[list(APPROACH)].to_numpy(float)
    later_um = pretravel_um(approach) - machine().sensor.pretravel_um(approach)
    frame[list(POSITION)] = frame[list(POSITION)].to_numpy(float) + later_um[:, None] * 1e-3 * approach
    return Recording(frame, recording.comments)


def with_existing_method() -> Machine:
    """The machine with the probe as the thesis' existing method has it: the stylus is the lever, a uniform beam."""
    path = EXAMPLE / "existing-method.toml"
    table, _ = probe_table(tomllib.loads(path.read_text("utf-8"))["probe"], path)
    return replace(machine(), probe=table, probe_path=str(path))


def by_the_larger_tip(recording: Recording) -> Recording:
    """The tip centres of the ball of that probe, 3 mm, instead of those of the machine's, 2 mm."""
    frame = recording.frame.copy()
    farther_mm = with_existing_method().probe.tip_radius_mm - machine().probe.tip_radius_mm
    frame[list(POSITION)] = frame[list(POSITION)].to_numpy(float) - farther_mm * frame[list(APPROACH)].to_numpy(float)
    return Recording(frame, {**recording.comments, "tip_radius_mm": "3.0"})


def test_the_printed_forces_are_those_of_the_lever_with_the_carrier() -> None:
    assert np.abs(share_of_statics().to_numpy() - 1.0).max() < 0.012


def test_with_a_constant_in_the_machine_file_the_tripod_is_named_and_its_lever_found() -> None:
    one = named(diagnose(recorded(TILTED, 11), STEPS, machine()), "kinematic_pretravel")
    ratio = LEVER_MM / CONTACT_RADIUS_MM * 10.0  # the vocabulary's contacts are 10 mm off the axis
    assert off(one, "lever_mm", ratio) < 2.0
    assert off(one, "arm_azimuth_deg", 0.0, 120.0) < 2.0


def test_from_level_gauges_the_tripod_is_named_and_its_lever_is_hardly_told() -> None:
    one = named(diagnose(recorded(THREE, 13), STEPS, machine()), "kinematic_pretravel")
    assert off(one, "arm_azimuth_deg", 0.0, 60.0) < 3.0
    assert off(one, "lever_mm", LEVER_MM / CONTACT_RADIUS_MM * 10.0) < 2.0
    assert one.parameters["lever_mm"].u > 0.2 * one.parameters["lever_mm"].value


def test_with_the_existing_method_in_the_machine_file_the_lever_is_what_differs() -> None:
    """Its stylus is 9 % too soft as well, which acts nearly as a lever 3 mm longer still: both are in one set."""
    found = diagnose(by_the_larger_tip(recorded(TILTED, 12)), STEPS, with_existing_method())
    one = named(found, "lever_arm")
    assert 14.5 < one.parameters["mm"].value < 20.0
    assert "pretravel_scale" in one.confounded_with
    assert [finding.kind for finding in found.findings] == ["lever_arm"]
