"""A small part of benchmarks/attack: damaged files, slips of the pen, kills and a full disk."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import pytest

from benchmarks.attack import disk, kill
from benchmarks.attack.fuzz import run as fuzz
from benchmarks.attack.mutate import slip, wild
from benchmarks.attack.targets import make_measurement


@pytest.fixture(scope="module")
def measurement(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("attack") / "m"
    make_measurement(place)
    return place


def test_damaged_files_are_refused_or_read(tmp_path: Path) -> None:
    """Nothing but results and one-line refusals; no file harmed; no slip accepted silently among these."""
    count, nonsense = fuzz(120, seed=7, place=tmp_path / "m")
    assert count.bad == []
    assert count.outcome["refused"] > 30
    assert count.outcome["accepted"] > 5
    assert nonsense.silent == []


@pytest.mark.parametrize("verb", ["compensate", "history"])
def test_a_killed_verb_leaves_the_old_files_or_the_new_ones(measurement: Path, verb: str) -> None:
    with contextlib.chdir(measurement):
        assert kill.attack(measurement, verb, times=2, pick=random.Random(3)) == []


@pytest.mark.parametrize("verb", ["evaluate", "compensate", "history", "shipped"])
def test_a_full_disk_changes_nothing_and_is_said(measurement: Path, verb: str) -> None:
    with contextlib.chdir(measurement):
        assert disk.attack(measurement, verb, sizes=(100,)) == []


def test_an_input_follows_from_its_number() -> None:
    data = b"cycle,face,x_mm\n1,1,104.1234567\n1,2,114.5\n"
    for change in (wild, slip):
        one, again, other = (change(data, random.Random(seed)) for seed in (5, 5, 6))
        assert one == again != other
