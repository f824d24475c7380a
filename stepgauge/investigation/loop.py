"""The loop: measure, diagnose, choose what tells most per minute, ask for it, measure, until an answer stands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.diagnosis.further_runs import FurtherRun
from stepgauge.diagnosis.laws.parts import OF_THE_PROBE
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis
from stepgauge.errors import InputError, naming
from stepgauge.files.text import write_files
from stepgauge.gauge.placement import Placement
from stepgauge.inference.design import entropy
from stepgauge.investigation.decision import (
    LEAST_NATS,
    SHOWN,
    TIME_OVER,
    Case,
    End,
    InvestigationState,
    decide,
    how,
    learn,
)
from stepgauge.investigation.feasible_runs import placement_json, run_of
from stepgauge.investigation.running import CompletedRun, Runner, joined
from stepgauge.machine.styli import stylus_words
from stepgauge.recording import Recording
from stepgauge.recording.simulated import is_simulated

Tell = Callable[[str], None]
OF_THE_STYLUS = {"effective_radius", "tip_change", *OF_THE_PROBE}
"""Kinds whose size changes with the stylus: another one would tell them from the rest."""
ROTATIONS = {"angular_error", "roll"}
"""Kinds that act through an arm, at whose end the stylus is where the machine's chain is stated."""


@dataclass
class Investigation:
    """What was measured so far, and what was learnt of it (JSON types, as in the journal)."""

    case: Case
    runner: Runner
    first: Placement
    tell: Tell = lambda _: None
    runs: list[CompletedRun] = field(default_factory=list)
    learnt: list[dict[str, Any]] = field(default_factory=list)
    declined: list[str] = field(default_factory=list)

    def go_through(self) -> dict[str, Any]:
        """All runs, to the end; what was learnt last, with the end."""
        run = FurtherRun("the gauge as it lies", self.first, cycles=self.case.reach.cycles, wait_s=0.0, stays=True)
        made = self._make(run)
        assert made is not None  # a gauge that lies there is not asked for
        while self._learn()["end"] is None:
            if not self._next():
                self.learnt[-1]["end"] = self._given_up()
                break
        return self.learnt[-1]

    @property
    def placements(self) -> list[Placement]:
        """How the gauge was found to lie, one for each time that it was laid."""
        return list({made.placement_number: made.lies for made in self.runs}.values())

    @property
    def spent_minutes(self) -> float:
        """Of machine and hands so far."""
        return sum(made.minutes for made in self.runs)

    @property
    def recording(self) -> Recording:
        """Of all runs together."""
        return joined(self.runs)

    def _make(self, run: FurtherRun) -> CompletedRun | None:
        laid = not run.stays or not self.runs
        number = len(self.placements) + 1 if laid else self.runs[-1].placement_number
        lies = self.runs[-1].lies if self.runs else self.first
        self.tell(f"run {len(self.runs) + 1}: {run.words}")
        made = self.runner.make(len(self.runs) + 1, run, lies, number)
        if made is not None:
            self.runs.append(made)
        return made

    def _learn(self) -> dict[str, Any]:
        """What the runs so far tell; a step of the journal, for it decides what is asked next."""
        steps, name = self.runner.steps, f"learnt {len(self.runs)}"
        said: dict[str, Any] = steps.once(name, self._told)
        while (name := f"{name}, with more time") in steps.done or self._has_more_time(said):
            said = steps.once(name, self._told)
        self.learnt.append(dict(said))
        self.tell(said["summary"])
        return self.learnt[-1]

    def _has_more_time(self, said: dict[str, Any]) -> bool:
        """Whether the time was over, in a journal that is gone on with, and there is more of it now."""
        ended = said["end"] is not None and said["end"]["why"] == TIME_OVER
        return ended and self.case.minutes > said.get("minutes_allowed", math.inf)

    def _told(self) -> dict[str, Any]:
        done = [*(made.run.words for made in self.runs[1:]), *self.declined]
        found = learn(self.case, self.recording, self.placements, done, self.spent_minutes)
        decided = decide(self.case, found, self.placements)
        end = decided if isinstance(decided, End) else None
        proposed = [] if isinstance(decided, End) else decided
        return {
            **told_json(found),
            "minutes_allowed": self.case.minutes,
            "directions": len(self.placements),
            "proposed": [one.to_dict() for one in proposed],
            "end": None if end is None else {"how": end.how, "why": end.why, "stands": end.stands},
            "needed": [] if end is None else needed(self.case, found, end),
        }

    def _next(self) -> bool:
        """Make the best run that the person can make possible; False where there is none."""
        for one in self.learnt[-1]["proposed"]:
            run = run_of(one["run"])
            if run.words in self.declined:
                continue
            if self._make(self._place_as_found(run)) is not None:
                self.learnt[-1]["chosen"] = one
                return True
            self.declined.append(run.words)
        return False

    def _place_as_found(self, run: FurtherRun) -> FurtherRun:
        """A run of the gauge as it lies is where it was found to lie."""
        return replace(run, placement=self.runs[-1].run.placement) if run.stays else run

    def _given_up(self) -> dict[str, Any]:
        last = self.learnt[-1]
        last["needed"] = [_wanted(one) for one in last["proposed"][:SHOWN]]
        return {"how": last["how"], "why": "what would tell more was declined", "stands": False}


def told_json(found: InvestigationState) -> dict[str, Any]:
    """What is known after a run."""
    diagnosis = found.diagnosis
    p = np.array([one.probability for one in found.possible])
    return {
        "verdict": diagnosis.verdict,
        "how": how(diagnosis),
        "summary": diagnosis.summary().splitlines()[0],
        "adequate": float(diagnosis.probabilities.get("adequate", math.nan)) if diagnosis.probabilities else None,
        "found": [_finding(one) for one in diagnosis.findings],
        "unexplained": [one.where for one in diagnosis.unexplained],
        "hypotheses": [{"words": one.words, "probability": one.probability} for one in found.possible[:SHOWN]],
        "entropy_nats": entropy(p) if len(p) else None,
        "settled": found.settled,
        "matters_um": found.matters_um,
    }


def _finding(one: Finding) -> dict[str, Any]:
    values = {
        name: {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}
        for name, estimate in one.parameters.items()
        if math.isfinite(estimate.value) and (estimate.u is None or math.isfinite(estimate.u))
    }
    return {
        "kind": one.kind,
        "label": one.label,
        "probability": min(max(one.probability, one.own), 1.0),
        "own_probability": min(one.own, 1.0),
        "set": [*one.confounded_with, *one.alternatives],
        "parameters": values,
    }


def needed(case: Case, found: InvestigationState, end: End) -> list[str]:
    """What would tell more, and is not to be had."""
    if end.stands:
        return []
    wanted = [_wanted(one.to_dict()) for one in found.rated if one.nats >= LEAST_NATS]
    wanted += [f"{run.words}, for which the time was too short" for run in found.late]
    with_stylus = set() if case.machine.styli else OF_THE_STYLUS | (ROTATIONS if case.machine.chain else set())
    for one in found.diagnosis.findings:
        if one.own < case.sure and {one.kind, *one.confounded_with} & with_stylus:
            wanted.append(f"the same runs with a stylus of another length and tip, for {one.label} and its rivals")
    return wanted[:SHOWN]


def _wanted(one: dict[str, Any]) -> str:
    apart = ", ".join(one["tells_apart"] or one["may_show"]).replace("_", " ")
    return f"{one['run']['words']} ({one['minutes']:.0f} min), for {apart or 'what is left'}"


def final_diagnosis(case: Case, recording: Recording) -> GaugeDiagnosis:
    """The diagnosis of all runs together, for its own files."""
    from stepgauge.diagnosis.engine import diagnose

    return diagnose(recording, case.gauge, case.machine, case.without, case.priors)


def check_first(case: Case, first: Placement) -> None:
    """:class:`InputError` where the first run cannot be made, before anything is asked or moved."""
    from stepgauge.diagnosis.further_runs import program_of

    run = FurtherRun("the gauge as it lies", first, cycles=case.reach.cycles, stays=True)
    program_of(run, case.gauge, case.machine)
    if case.reach.region_mm is not None and not case.reach.allows(run, first):
        raise InputError(naming("within_mm"), "the gauge lies outside of it now", expected="a box that holds both ends")


FORMAT = "stepgauge investigation 1"
OF_THE_JOURNAL = ("proposed", "chosen", "end", "needed", "minutes_allowed")
"""What is known after a run and told elsewhere, or of the journal alone."""


def story_of(found: Investigation) -> dict[str, Any]:
    """Every run with the reason for it and what was known after it; the end; what is not to be had."""
    case, last = found.case, found.learnt[-1]
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "gauge": {
            "name": case.gauge.table.name,
            "serial": case.gauge.table.serial,
            "example": case.gauge.certificate.example,
        },
        "machine": case.machine.table.name,
        "simulated": is_simulated(joined(list(found.runs)).comments),
        "styli": [stylus_words(case.machine, number + 1) for number in range(len(case.machine.styli) + 1)],
        "asked": {"odds": case.odds, "minutes": case.minutes, "without": list(case.without)},
        "runs": [_run(found, number) for number in range(len(found.runs))],
        "end": last["end"],
        "needed": last["needed"],
        "declined": found.declined,
        "machine_minutes": sum(made.machine_minutes for made in found.runs),
        "minutes": found.spent_minutes,
    }


def _run(found: Investigation, number: int) -> dict[str, Any]:
    made, learnt = found.runs[number], found.learnt[number]
    chosen = found.learnt[number - 1].get("chosen") if number else None
    return {
        "number": number + 1,
        "words": made.run.words,
        "why": chosen and {key: value for key, value in chosen.items() if key != "run"},
        "placement": made.placement_number,
        "stylus": made.run.stylus,
        "lies": placement_json(made.lies),
        "recording": made.path.name,
        "machine_minutes": made.machine_minutes,
        "minutes": made.minutes,
        "learnt": {key: value for key, value in learnt.items() if key not in OF_THE_JOURNAL},
    }


def write_story(folder: Path, found: Investigation) -> list[Path]:
    """``investigation.json`` and ``investigation.md``; returns their paths."""
    from stepgauge.reports.investigation import investigation_story
    from stepgauge.reports.render import markdown

    said = story_of(found)
    story = markdown(investigation_story(said))
    return write_files(folder, {"investigation.json": said, "investigation.md": story})
