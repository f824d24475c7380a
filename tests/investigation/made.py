"""A small gauge on a small virtual CMM with a fault, and a person who does what is asked, or does not."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepgauge.effects import effect_kinds
from stepgauge.executors.journal import open_steps
from stepgauge.gauge.placement import Placement
from stepgauge.investigation.decision import Case
from stepgauge.investigation.feasible_runs import Reach
from stepgauge.investigation.loop import Investigation
from stepgauge.investigation.running import Runner
from stepgauge.investigation.stations import Simulated, Station
from tests.build import make_pose
from tests.live.made import small_gauge, small_machine, with_effects

KEPT = {"block_defect", "effective_radius", "gauge_temperature", "reversal_error", "scale_error", "squareness"}
WITHOUT = tuple(kind for kind in effect_kinds() if kind not in KEPT | {"outliers"})
"""Few laws: what the loop does with them is the same, in a fraction of the time."""
REVERSAL = {"kind": "reversal_error", "axis": "x", "um": 3.0}


def lies_along_y() -> Placement:
    return make_pose(1.5708, 0.0, 0.0, (200.0, 150.0, 60.0)).placement(small_gauge())


def small_case(**more: Any) -> Case:
    reach = Reach(level=True, **more.pop("reach", {}))
    return Case(
        small_gauge(), small_machine(repeatability_um=0.2), reach, **{"minutes": 40.0, "without": WITHOUT, **more}
    )


def station(*faults: dict[str, Any], seed: int = 1) -> Simulated:
    case = small_case()
    return Simulated(case.machine, case.gauge, with_effects(*faults), seed)


@dataclass
class Person:
    """Answers every question with the next of ``answers``, and with yes when these are used up."""

    answers: list[bool] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def __call__(self, question: str) -> bool:
        self.asked.append(question)
        return self.answers.pop(0) if self.answers else True


@contextmanager
def begun(
    folder: Path, place: Station, person: Person, again: bool = False, case: Case | None = None
) -> Iterator[Investigation]:
    """An investigation whose journal is open."""
    case = case or small_case()
    steps = open_steps(folder, {"gauge": case.gauge.table.serial}, again)
    try:
        yield Investigation(case, Runner(case, place, steps, person), lies_along_y())
    finally:
        steps.close()
