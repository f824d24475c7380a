"""The one file of priors: read, replaced in part, refused where it is wrong, complete."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stepgauge.diagnosis.laws.geometry import KIND
from stepgauge.diagnosis.maps.candidates import candidates_for
from stepgauge.diagnosis.maps.diagnose import read_probe_table
from stepgauge.diagnosis.priors import priors_text, read_priors, shipped_priors
from stepgauge.effects import effect_kinds
from stepgauge.errors import InputError

NEVER_NAMED = {"axis_compensation", "empirical", "error_map"}
SCATTER = {"noise_growth", "outliers"}
"""Kinds whose odds stand in the table of the scatter."""


def test_every_kind_that_may_be_named_has_its_prior_and_no_other() -> None:
    kinds = shipped_priors().laws.kinds
    assert set(kinds) == {*effect_kinds(), KIND} - NEVER_NAMED - SCATTER
    assert all(prior.unit for prior in kinds.values())


def test_every_change_of_a_probe_has_its_prior_and_no_other() -> None:
    tables = [read_probe_table(name)[0] for name in ("omp40-2-50mm", "tp6-50mm")] + [{"model": "constant"}]
    every = [one for table in tables for one in candidates_for(table, ["trigger_force_N"])]
    assert set(shipped_priors().maps.laws.kinds) == {one.prior or one.kind for one in every}


def test_weights_of_sizes_sum_to_one_and_are_widest_about_what_is_usual() -> None:
    sizes = shipped_priors().sizes.about(2.0)
    assert np.exp(sizes.log_weight).sum() == pytest.approx(1.0)
    assert sizes.sd[int(sizes.log_weight.argmax())] == pytest.approx(2.0)
    forms = shipped_priors().forms.about(0.3)
    assert np.exp(forms.log_weight).sum() == pytest.approx(1.0)


def test_no_size_is_larger_than_physics_allows() -> None:
    sizes = shipped_priors().sizes.about(5.0, most=30.0)
    assert sizes.sd.max() == pytest.approx(15.0)
    assert np.exp(sizes.log_weight).sum() == pytest.approx(1.0)
    assert len(shipped_priors().sizes.about(5.0, most=1e-9).sd) == 1


def test_what_a_file_says_stands_in_place_of_what_is_shipped(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("[decision]\nstated = 0.9\n[laws.kinds]\nroll = { odds = 2.0, usual = 30.0 }\n")
    found, shipped = read_priors(path), shipped_priors()
    assert found.decision.stated == 0.9
    assert found.laws.of("roll").usual == 30.0
    assert found.laws.of("squareness") == shipped.laws.of("squareness")
    assert found.decision.in_set == shipped.decision.in_set
    assert found.scatter == shipped.scatter


def test_the_shipped_file_is_a_file_of_priors(tmp_path: Path) -> None:
    path = tmp_path / "all.toml"
    path.write_text(priors_text())
    assert read_priors(path) == shipped_priors()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[decision]\nsttaed = 0.9\n", "sttaed"),
        ("[decision]\nstated = 1.5\n", "stated"),
        ("[laws.kinds]\nroll = { odds = 0.0, usual = 1.0 }\n", "odds"),
        ("[laws.kinds]\nroll = { odds = 1.0, usual = 'much' }\n", "usual"),
        ("[scatter]\ncorrelations = []\n", "correlations"),
        ("[wrong]\nkey = 1\n", "wrong"),
        ("decision = 3\n", "decision"),
        ("not toml", "mine.toml"),
        ("[laws.kinds]\nrol = { odds = 1.0, usual = 1.0 }\n", "rol"),
        ("[maps.laws.kinds]\nroll = { odds = 1.0, usual = 1.0 }\n", "maps.laws.kinds.roll"),
        ("maps = 3\n", "maps"),
        ("laws = 3\n", "laws"),
        ("[forms]\nsizes = [1.0, 2.0]\n", "size"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_priors(path)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml"):
        read_priors(tmp_path / "none.toml")
