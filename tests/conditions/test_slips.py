"""A small part of ``benchmarks.attack.slips``: what the data can show does not pass a verb in silence."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.attack.slips import VERBS, attack


@pytest.mark.parametrize("name", ["evaluate", "iso230", "iso230 of one axis", "iso10360", "iso10360-5", "iso230-3"])
def test_slips_are_refused_or_said(name: str, tmp_path: Path) -> None:
    outcomes, silent = attack(VERBS[name], 12, 4747, tmp_path)
    assert silent == []
    assert outcomes.total() == 12
    assert outcomes["refused"] + outcomes["said"] + outcomes["no statement"] > 5


@pytest.mark.parametrize("wrong", [False, True])
def test_undamaged_measurements_are_decided(wrong: bool, tmp_path: Path) -> None:
    for name in ("iso230", "iso230 of one axis", "iso10360", "iso10360-5", "iso230-3"):
        found = VERBS[name].run(VERBS[name].make(tmp_path, wrong, 47))
        assert found.decision.startswith("does not conform" if wrong else "conforms"), name
