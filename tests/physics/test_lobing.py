"""Lobing of another shape than the model: found where it is, and not in scatter."""

import re

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.physics.directions import evenly_spread_points, iso_10360_5_points
from stepgauge.physics.lobing import RARE, misfit

SPHERE_MM, TIP_MM = 25.0, 6.0


def probed(normals, pretravel_um, scatter_um, seed):
    """Points of a sphere as a probe of some pre-travel finds them."""
    noise = np.random.default_rng(seed).normal(0.0, scatter_um, len(normals))
    reach_mm = (SPHERE_MM + TIP_MM) / 2.0 - 1e-3 * (pretravel_um + noise)
    columns = [f"{axis}_mm" for axis in "xyz"] + [f"approach_{axis}" for axis in "ijk"]
    return pd.DataFrame(np.column_stack([normals * reach_mm[:, None], -normals]), columns=columns)


@pytest.mark.parametrize("waves", [2, 4])
@pytest.mark.parametrize("noise_um", [None, 0.2])
def test_lobes_of_another_number_are_told_with_their_chance(waves, noise_um):
    normals = evenly_spread_points(60)
    across, turn = np.hypot(*normals[:, :2].T), np.arctan2(normals[:, 1], normals[:, 0])
    table = probed(normals, 3.0 + across * np.cos(waves * turn), 0.2, 5)
    found = sg.qualify_probe(table, sphere_diameter_mm=SPHERE_MM, tip_diameter_mm=TIP_MM, noise_um=noise_um)
    said = re.search(rf"follow {waves} waves a turn .* by (\S+) um: .* once in (\d+) ", found.summary())
    assert said is not None
    assert float(said[1]) == pytest.approx(2.0, abs=0.2)
    assert int(said[2]) > 1e5
    assert found.warnings[0] in found.summary()


def test_scatter_alone_and_lobes_of_the_model_are_not():
    """The wrong warnings of scatter are as rare as stated; a probe of the model's own kind has none."""
    normals = iso_10360_5_points()
    known = np.column_stack([normals, np.ones(len(normals))])
    free = np.linalg.qr(known)[0]
    scatter = np.random.default_rng(8).normal(0.0, 1.0, (3000, len(normals)))
    scatter -= scatter @ free @ free.T
    assert sum(misfit(one, normals, known) is not None for one in scatter) <= 3000 * RARE + 3 * (3000 * RARE) ** 0.5
    for seed in range(5):
        sphere = sg.probe_sphere("omp40-2-50mm", sphere_diameter_mm=SPHERE_MM, seed=seed)
        found = sg.qualify_probe(sphere, sphere_diameter_mm=SPHERE_MM, tip_diameter_mm=TIP_MM)
        assert not found.warnings


def test_of_a_tip_of_unknown_diameter_there_is_no_model_to_miss():
    normals = evenly_spread_points(60)
    table = probed(normals, 3.0 + np.cos(2.0 * np.arctan2(normals[:, 1], normals[:, 0])), 0.1, 5)
    assert not sg.qualify_probe(table, sphere_diameter_mm=SPHERE_MM).warnings
