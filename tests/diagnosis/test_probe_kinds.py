"""Probes told from one another by step-gauge recordings: nearly constant ones, tripods, softer and longer styli."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.machine.file import Machine
from stepgauge.probes import probe_table, read_probe
from stepgauge.recording import APPROACH, POSITION, Recording
from tests.diagnosis.made import machine
from tests.diagnosis.test_fea_by_step_gauge import THREE, TILTED
from tests.diagnosis.test_further_laws import STEPS, measured, named, off

Array = NDArray[np.float64]
PROBES = Path(__file__).parents[2] / "calibration_data" / "probes"
SHORT = "omp40-2-50mm"
AXES = {"level": THREE, "tilted": TILTED}


def stated(name: str) -> Machine:
    """The machine with a tripod in its file."""
    path = PROBES / f"{name}.toml"
    table, _ = probe_table(tomllib.loads(path.read_text("utf-8"))["probe"], path)
    return replace(machine(), probe=table, probe_path=str(path))


def found(axes: str, pretravel_um: Callable[[Array], Array], on: Machine, seed: int = 3) -> GaugeDiagnosis:
    """What is said of a recording by a probe with this pre-travel on a machine whose file states another."""
    recording = measured(AXES[axes], seed)
    frame = recording.frame.copy()
    approach = frame[list(APPROACH)].to_numpy(float)
    farther_mm = (pretravel_um(approach) - machine().sensor.pretravel_um(approach)) * 1e-3
    farther_mm -= on.probe.tip_radius_mm - machine().probe.tip_radius_mm
    frame[list(POSITION)] = frame[list(POSITION)].to_numpy(float) + farther_mm[:, None] * approach
    comments = {**recording.comments, "tip_radius_mm": str(on.probe.tip_radius_mm)}
    return diagnose(Recording(frame, comments), STEPS, on)


@pytest.mark.parametrize("axes", AXES)
def test_a_strain_gauge_probe_is_no_tripod(axes: str) -> None:
    """It triggers at nearly the same way in all directions: 0.05 um of lobes beside 0.3 um of noise."""

    def nearly_constant_um(approach: Array) -> Array:
        lobes = 0.05 * np.cos(3.0 * np.arctan2(approach[:, 1], approach[:, 0]))
        return np.asarray(machine().sensor.pretravel_um(approach) + lobes)

    assert found(axes, nearly_constant_um, machine()).verdict == "adequate"


def test_a_constant_probe_on_a_machine_whose_file_has_a_tripod_lacks_all_of_its_pretravel() -> None:
    one = named(found("tilted", lambda approach: np.full(len(approach), 1.0), stated(SHORT)), "pretravel_scale")
    assert off(one, "percent", -100.0) < 2.0


@pytest.mark.parametrize("axes", AXES)
def test_a_softer_stylus_scales_all_pretravel_and_is_no_lever_turned_round(axes: str) -> None:
    """A lever has no size that could be negative: what is longer weakens the trigger, and so does not soften it."""
    said = found(axes, lambda approach: 1.6 * read_probe(SHORT).pretravel_um(approach), stated(SHORT))
    assert [one.kind for one in said.findings] == ["pretravel_scale"]
    assert off(said.findings[0], "percent", 60.0) < 3.0
    assert said.fit.rms_after_um < 0.15 * said.fit.rms_before_um


def test_a_stylus_of_twice_the_length_is_told_from_the_short_one_in_the_file() -> None:
    """38.1 in place of 4.60 um/N (Rodrigues 2021), at less force by the longer lever: some 400 % more, not 10 %."""
    long = read_probe("omp40-2-100mm")
    level = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.radians(np.arange(0.0, 360.0, 5.0))])
    ratio = float(np.mean(long.pretravel_um(level)) / np.mean(read_probe(SHORT).pretravel_um(level)))
    one = named(found("level", long.pretravel_um, stated(SHORT)), "pretravel_scale")
    assert one.parameters["percent"].value == pytest.approx(100.0 * (ratio - 1.0), rel=0.25)
