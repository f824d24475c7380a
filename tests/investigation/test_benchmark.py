"""The benchmark of the loop: its causes are effects, its plans can be measured, its judge is strict."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.investigate import (
    AND,
    KINDS,
    MACHINE,
    Hall,
    Result,
    bars,
    causes,
    drawn_pairs,
    fixed_plan,
    judged,
    plan_minutes,
    stopped,
    table,
)
from stepgauge.diagnosis.engine import diagnose
from stepgauge.effects import make_effects
from stepgauge.investigation.feasible_runs import placement_json
from stepgauge.machine.file import read_machine
from stepgauge.recording import Recording


def test_every_cause_is_an_effect_of_its_kind() -> None:
    random = np.random.default_rng(1)
    assert len(KINDS) > 12
    for kind in KINDS:
        cause = causes(random, kind)
        if kind != "nothing":
            assert make_effects([cause], "faults")[0].kind == kind


def test_a_draw_of_the_fixed_plan_is_judged_by_the_truth() -> None:
    """Two placements of a machine with a wrong scale: right, and wrong where something else was hidden."""
    hall = Hall(["scale_error"], 3)
    plan = [(n, placement_json(one), 2, speed) for n, one, speed in fixed_plan()[:2]]
    frames = hall.measured(plan)
    assert [frame["placement"].iloc[0] for frame in frames] == [1, 2]
    assert frames[1]["time_s"].min() > frames[0]["time_s"].max()
    assert 5.0 < plan_minutes(frames, 2) < 15.0
    found = diagnose(Recording(pd.concat(frames, ignore_index=True)), hall.gauge, read_machine(MACHINE))
    assert judged(found, hall.truth)[0]
    assert not judged(found, [{"kind": "squareness"}])[0]
    assert not judged(found, [])[0]


def test_a_pair_is_right_where_each_cause_has_a_finding_of_its_own() -> None:
    hidden = [{"kind": "squareness"}, {"kind": "reversal_error"}]

    def said(*findings: tuple[str, ...]) -> tuple[bool, bool]:
        named = [SimpleNamespace(kind=one, confounded_with=rest) for one, *rest in findings]
        found: Any = SimpleNamespace(verdict="effects", findings=named, summary=lambda: "")
        return judged(found, hidden)[:2]

    assert said(("reversal_error",), ("squareness",)) == (True, True)
    assert said(("lever_arm", "squareness"), ("reversal_error",)) == (True, False)
    assert said(("squareness", "reversal_error"), ("straightness",)) == (False, False)
    assert said(("squareness",)) == (False, False)
    assert said(("squareness",), ("reversal_error",), ("trigger_delay",)) == (False, False)
    drawn = drawn_pairs(7, 30)
    assert len(set(drawn)) == 30
    assert all(len(set(one.split(AND)) & set(KINDS) - {"nothing"}) == 2 for one in drawn)


def test_misses_come_first_and_count() -> None:
    good = Result("squareness", *({"loop": True, "same": True, "full": True} for _ in range(2)), {}, {"loop": 20.0})
    good.minutes |= {"same": 18.0, "full": 45.0}
    missed = Result("step_change", dict(good.right), dict(good.alone), {}, dict(good.minutes))
    missed.right["loop"] = missed.alone["loop"] = False
    rows = list(table([good, missed, stopped("nothing", "an error")]))
    assert [row.split(" | ")[0] for row in rows[2:4]] == ["| nothing", "| step change"]
    assert next(iter(bars([good, missed]))).startswith("of 2 causes that the full plan solves the loop solves 1")
