"""The run that tells what a statement leaves open."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stepgauge.diagnosis.design import Design, RivalAnswers, _which_hypothesis, _which_of_set
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.hypotheses import HypothesisTerm, RivalHypothesis
from stepgauge.diagnosis.output.files import commands_in
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.gauge.placement import read_placement
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program, middle_standoff_mm
from stepgauge.recording import Recording, join_recordings
from tests.diagnosis.made import ALONG_X, ALONG_Y, gauge, machine, record


def hypothesis(probability: float, *labels: str) -> RivalHypothesis:
    """Laws by their labels, and structure without a law as ``~``."""
    every = [SimpleNamespace(named=one != "~", source=SimpleNamespace(label=one)) for one in labels]
    parts: Any = tuple(HypothesisTerm(one, 0, 1.0) for one in every)  # type: ignore[arg-type]
    return RivalHypothesis(parts, probability)


def finding(label: str, *members: str, several: Sequence[tuple[str, ...]] = ()) -> Any:
    laws = [SimpleNamespace(laws=one) for one in several]
    return SimpleNamespace(label=label, members=[SimpleNamespace(label=one) for one in members], several=laws)


def told(question: RivalAnswers) -> list[tuple[list[str], float]]:
    return [(sorted(one), round(float(p), 6)) for one, p in zip(question.answers, question.probability, strict=True)]


def test_hypotheses_with_the_same_laws_of_a_set_are_one_answer() -> None:
    """What stands beside a law is no other answer, and what has none of the set says nothing of it."""
    every = [
        hypothesis(0.4, "a"),
        hypothesis(0.2, "a", "x"),
        hypothesis(0.1, "a", "b"),
        hypothesis(0.15, "b", "~"),
        hypothesis(0.05, "b", "x"),
        hypothesis(0.06, "~"),
        hypothesis(0.04, "c", "d"),
    ]
    question = _which_of_set(finding("a", "b", several=[("c", "d")]), every)
    assert told(question) == [(["a"], 0.777778), (["b"], 0.222222)]
    assert question.hypotheses == [every[0], every[4]]  # structure would bend to whatever is read
    alone = _which_of_set(finding("a", several=[("c", "d")]), every)
    assert told(alone) == [(["a"], 0.945946), (["c", "d"], 0.054054)]
    anything = _which_hypothesis(every)
    assert told(anything)[:3] == [(["a"], 0.4), (["a", "x"], 0.2), (["b", "structure"], 0.15)]


def test_one_law_in_several_parts_of_a_record_is_one_rival() -> None:
    """Laws in parts of the record have the label of the law: a set with two of them ended in a traceback."""
    every = [hypothesis(0.6, "a"), hypothesis(0.3, "b"), hypothesis(0.1, "b", "b")]
    assert told(_which_of_set(finding("a", "b", "b"), every)) == [(["a"], 0.6), (["b"], 0.4)]


@pytest.mark.parametrize(("raised", "p", "is_worth"), [(True, 0.013, False), (False, 0.013, True), (True, 0.1, True)])
def test_supports_are_not_built_to_exclude_what_is_unlikely(
    monkeypatch: pytest.MonkeyPatch, raised: bool, p: float, is_worth: bool
) -> None:
    """A gauge was to be raised by 436 mm against a rival of 1.3 %, while that of 32 % stayed."""
    monkeypatch.setattr("stepgauge.diagnosis.design.can_be_planned", lambda *_: True)
    every = [hypothesis(0.65, "a"), hypothesis(0.35 - p, "b"), hypothesis(p, "c")]
    question = RivalAnswers(((one.laws, one) for one in every), frozenset("a"))
    apart = np.array([[0.0, 0.0, 400.0], [0.0, 0.0, 400.0], [400.0, 400.0, 0.0]])
    made: Any = SimpleNamespace(_index={id(one): k for k, one in enumerate(every)}, found=SimpleNamespace(data=None))
    made._runs = [(SimpleNamespace(raised=raised), apart)]
    made._least_trouble = lambda runs: Design._least_trouble(made, runs)
    assert (Design.separate(made, question) is not None) == is_worth


def followed(found: GaugeDiagnosis, folder: Path, on: Machine, first: Recording, start_s: float) -> Recording:
    """The recording followed by that of the first run that is proposed."""
    (command,) = next(filter(None, (commands_in(one) for one in proposed(found))))
    (folder / "lies.toml").write_text(found.placements[command.split()[2]])
    steps, speed = gauge(), re.search(r"--measuring-speed (\S+)", command)
    placement = read_placement(folder / "lies.toml", steps)
    settings = ProbingSettings(standoff_mm=middle_standoff_mm(steps, 2.0))
    if speed:
        settings = replace(settings, measuring_speed_mm_s=float(speed[1]))
    options = PlanOptions(placement.first_block, placement.last_block, cycles=3)
    program = make_program(placement, steps, options, settings)
    run = run_program(program, on, steps, placement, int(start_s), RunConditions(20.0, int(start_s), start_s))
    return join_recordings([first, run.recording])


def proposed(found: GaugeDiagnosis) -> list[str]:
    return [one.separate_by for one in (*found.findings, *found.unexplained) if "stepgauge plan" in one.separate_by]


def mill(effects: Sequence[dict[str, Any]] = ()) -> Machine:
    return replace(read_machine("machining-centre"), effects=tuple(effects))


@pytest.mark.parametrize(
    ("shipped", "kind", "tip_um"),
    [(machine, "cmm", 5.0), (mill, "machine tool", 30.0), (mill, None, 30.0)],
)
def test_what_is_open_is_settled_by_the_run_that_is_proposed(
    shipped: Callable[..., Machine], kind: str | None, tip_um: float, tmp_path: Path
) -> None:
    """A tip of another size and play of y: along x and y alone this is play of x and y, or ``unknown`` as it was.

    For the unknown no run was proposed, or one along an axis along which the gauge had lain.
    """
    stated, play = shipped(), {"kind": "reversal_error", "axis": "y", "um": 12.0}
    probe: Any = stated.probe
    other = probe.model_copy(update={"tip_radius_mm": probe.tip_radius_mm + tip_um * 1e-3})
    on = replace(shipped([play]), probe=other)
    centre = np.mean(stated.travel_mm, axis=1)
    first = record(on, (ALONG_X, ALONG_Y), cycles=3, centres=[centre, centre])
    found = diagnose(first, gauge(), stated, kind=kind)
    assert proposed(found)
    taken = first
    for start_s in (9000.0, 18000.0, 27000.0):
        if not proposed(found):
            break
        taken = followed(found, tmp_path, on, taken, start_s)
        found = diagnose(taken, gauge(), stated, kind=kind)
        assert found.summary()
        found.write(tmp_path / str(start_s))
    assert found.verdict == "effects"
    assert {"effective_radius", "reversal_error_y"} == {one.label for one in found.findings}
