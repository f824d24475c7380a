"""The further run that is worth most for a statement: Bayesian experimental design (Lindley 1956).

Every feasible run (the gauge rotated, shifted, end for end, with another stylus, or measured at another speed) is added
to the recording by simulation. What is expected to be learnt follows from how far the predictions of the probable
hypotheses of the search lie apart in its readings (:mod:`stepgauge.inference.design`). Hypotheses that give a statement
the same laws are one answer to it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from shlex import quote

import numpy as np

from stepgauge.diagnosis.further_runs import FurtherRun, can_be_planned, extended
from stepgauge.diagnosis.hypotheses import MOST, Predicting, RivalHypothesis, Searched, every_hypothesis
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, Located
from stepgauge.diagnosis.wording.catalogue import listed
from stepgauge.diagnosis.wording.findings import describe_rivals, name_of
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.resources import called
from stepgauge.gauge.placement import format_placement
from stepgauge.inference.design import distances, expected_information_gain

Answer = frozenset[str]
"""The laws that a hypothesis gives a statement."""
STRUCTURE = "structure"
"""In place of a law in the answer of a hypothesis that has structure without one."""
TELLING = 9.0
"""Chi-square from which a run excludes a rival."""
NEARLY = 0.95
"""Part of the largest expected information from which a run that is less trouble is taken."""
LEAST_NATS = 0.03
"""A run that is expected to tell less is not worth a person's way to the machine, nats."""
RAISED_NATS = 0.2
"""The same of one for which a person builds supports, where it would exclude but what is unlikely anyway."""
NO_SEPARATION = "no measurement within this travel is sure to tell them apart: check each cause by itself"
UNSOUGHT = "not looked for among many recordings; 'stepgauge diagnose' of this one does"


class RivalAnswers:
    """What a statement leaves open: answers, the first of which is stated, with their probabilities.

    ``hypotheses``: the most probable one of each answer, of laws only where there is one, since structure without a law
    bends to most readings.
    """

    def __init__(self, every: Iterable[tuple[Answer, RivalHypothesis]], stated: Answer | None = None) -> None:
        sums, leads = dict[Answer, float](), dict[Answer, RivalHypothesis]()
        for answer, one in every:
            sums[answer] = sums.get(answer, 0.0) + one.probability
            if answer not in leads or (one.is_of_laws and not leads[answer].is_of_laws):
                leads[answer] = one
        self.answers = sorted(sums, key=lambda one: (one != stated, -sums[one]))[:MOST]
        self.hypotheses = [leads[one] for one in self.answers]
        p = np.array([sums[one] for one in self.answers])
        self.probability = p / p.sum()


def _which_of_set(finding: Finding, every: Sequence[RivalHypothesis]) -> RivalAnswers:
    """Whether it is the stated law, with whatever else, or another of its set in its place; or several, if no other."""
    stated = frozenset({finding.label})
    several = () if finding.members else finding.several
    rivals = {*(frozenset({one.label}) for one in finding.members), *(frozenset(one.laws) for one in several)}
    own = stated.union(*rivals)
    answers = ((stated if finding.label in one.laws else own & one.laws, one) for one in every)
    return RivalAnswers(((answer, one) for answer, one in answers if answer in rivals | {stated}), stated)


def _which_hypothesis(every: Sequence[RivalHypothesis]) -> RivalAnswers:
    """Which laws it is, or structure without a law beside which."""
    return RivalAnswers((one.laws | (frozenset() if one.is_of_laws else {STRUCTURE}), one) for one in every)


@dataclass(frozen=True)
class ProposedRun:
    """A further run: the information expected of it, nats; the answers that it excludes, and those it leaves.

    ``elsewhere``: of those left, the ones that another feasible run excludes.
    """

    run: FurtherRun
    expected_information_gain: float
    excludes: tuple[Answer, ...]
    leaves: tuple[Answer, ...]
    elsewhere: tuple[Answer, ...] = ()


class Design:
    """What every feasible run would tell of some questions."""

    def __init__(self, found: Searched, priors: Priors, questions: Sequence[RivalAnswers]) -> None:
        self.found, self.placements = found, dict[str, str]()
        """``placements``: texts of the placement files of proposed runs, by file name."""
        possible = list({id(one): one for question in questions for one in question.hypotheses}.values())
        self._index = {id(one): index for index, one in enumerate(possible)}
        self._predicting = Predicting(found, possible, priors)

    @cached_property
    def _runs(self) -> list[tuple[FurtherRun, Array]]:
        """The runs whose readings can be predicted, with the chi-square distances ``(h, h)`` of the predictions."""
        known, found = len(self.found.data), []
        for more in extended(self.found.data, self.found.model.state.sigma_um):
            try:
                predictions = self._predicting(more)
            except InputError:
                continue
            new = np.arange(len(more.data)) >= known
            found.append((more.run, distances(predictions, new, more.metric)))
        return found

    def separate(self, question: RivalAnswers, least_nats: float = 0.0) -> ProposedRun | None:
        """The run that is expected to tell most about a question; None if none tells enough or excludes an answer."""
        places = [self._index[id(one)] for one in question.hypotheses]
        rivals, found = question.answers[1:], []
        for run, every in self._runs if rivals else ():
            distance = every[np.ix_(places, places)]
            gain = expected_information_gain(question.probability, distance)
            excludes = tuple(one for one, chi2 in zip(rivals, distance[0, 1:], strict=True) if chi2 > TELLING)
            worth = RAISED_NATS if run.raised else 0.0 if excludes else LEAST_NATS
            if gain >= max(least_nats, worth):
                leaves = tuple(one for one in rivals if one not in excludes)
                found.append(ProposedRun(run, gain, excludes, leaves))
        best, excluded = self._least_trouble(found), {answer for one in found for answer in one.excludes}
        return best and replace(best, elsewhere=tuple(one for one in best.leaves if one in excluded))

    def _least_trouble(self, found: list[ProposedRun]) -> ProposedRun | None:
        """Among the runs that can be planned and are worth nearly as much as the best, the one of least trouble."""
        found = list(found)
        while found:
            most = max(one.expected_information_gain for one in found)
            first = next(one for one in found if one.expected_information_gain >= NEARLY * most)
            if can_be_planned(first.run, self.found.data):
                return first
            found.remove(first)
        return None


def planned_command(run: FurtherRun, data: Residuals, placements: dict[str, str]) -> str:
    """The ``stepgauge plan`` command of a run; its placement is added to the texts of placement files.

    In the language of the program that was run, by the end of its name; DMIS where that tells none.
    """
    from stepgauge.programs import DIALECTS  # its run was planned, so that all are loaded

    text, suffix = format_placement(run.placement), Path(data.program.split("; ")[0]).suffix
    known = next((name for name, one in placements.items() if one == text), f"separate-{len(placements) + 1}.toml")
    placements[known] = text
    dialect = next((one for one in DIALECTS.values() if one.suffix == suffix), DIALECTS["dmis"])
    speed = "" if run.speed_mm_s is None else f" --measuring-speed {run.speed_mm_s:g}"
    gauge, machine = called(data.gauge.path), called(data.machine.select_stylus(run.stylus).path)
    name, files = Path(known).stem, f"{known} -g {quote(gauge)} -m {quote(machine)}"
    return f"stepgauge plan {files} -d {dialect.name} --cycles {run.cycles}{speed} -o {name}{dialect.suffix}"


def add_separations(
    findings: Sequence[Finding], structure: Sequence[Located], found: Searched, priors: Priors, wanted: bool
) -> tuple[list[Finding], list[Located], dict[str, str]]:
    """Findings with the reasons of their sets, and both with the runs that tell what it is; placements by file name.

    ``wanted``: whether to look for these runs.
    """
    several = [one for one in findings if one.confounded_with or one.alternatives]
    sought = wanted and bool(found.data.gauge.path) and bool(several or structure)
    every = every_hypothesis(found) if sought else []
    asked = {id(one): _which_of_set(one, every) for one in several if sought}
    anything = [_which_hypothesis(every)] if sought and structure else []
    design = Design(found, priors, [*asked.values(), *anything])
    told = {id(one): _separated(one, asked.get(id(one)), design, wanted) for one in several}
    how, gain = next((_told_most_by(design, one) for one in anything), ("", 0.0))
    left = [replace(one, separate_by=how, separation_nats=gain) for one in structure]
    return [told.get(id(one), one) for one in findings], left, design.placements


def worth_measuring(found: Searched, priors: Priors) -> tuple[str, dict[str, str]]:
    """The run that is expected to tell what it is where nothing is stated, empty if none is worth it; placements."""
    if not found.data.gauge.path:
        return "", {}
    question = _which_hypothesis(every_hypothesis(found))
    design = Design(found, priors, [question])
    return _told_most_by(design, question)[0], design.placements


def _told_most_by(design: Design, question: RivalAnswers) -> tuple[str, float]:
    """The run that is worth a way to the machine, in words with its command, and its nats; empty if none is."""
    best = design.separate(question, LEAST_NATS)
    if best is None:
        return "", 0.0
    command = planned_command(best.run, design.found.data, design.placements)
    return f"{best.run.words}: {command}", best.expected_information_gain


def _separated(finding: Finding, question: RivalAnswers | None, design: Design, wanted: bool) -> Finding:
    """A finding with the reason of its set and the run that separates it, in words with its command."""
    how, data, gain = NO_SEPARATION if wanted else UNSOUGHT, design.found.data, 0.0
    best = None if question is None else design.separate(question)
    if best is not None:
        command, gain = planned_command(best.run, data, design.placements), best.expected_information_gain
        how = f"{best.run.words}, {_what_it_separates(best)}: {command}{_what_it_leaves(best)}"
    return replace(finding, reason=_reason(finding, data), separate_by=how, separation_nats=gain)


def _what_it_separates(best: ProposedRun) -> str:
    if not best.excludes:
        return f"which may separate it from {_named(best.leaves, 'or')}"
    return f"which separates it from {_named(best.excludes)}"


def _what_it_leaves(best: ProposedRun) -> str:
    """What needs another run; the distance of predictions is the least that is expected, so that none is hopeless."""
    if not best.excludes:
        return ""
    unsure = [one for one in best.leaves if one not in best.elsewhere]
    later = f"; another one after it separates it from {_named(best.elsewhere)}" if best.elsewhere else ""
    return later + (
        f"; no measurement within this travel is sure to separate it from {_named(unsure, 'or')}" if unsure else ""
    )


def _named(answers: Sequence[Answer], last: str = "and") -> str:
    return listed([" + ".join(sorted(one)) for one in answers], last)


def _reason(finding: Finding, data: Residuals) -> str:
    """Why the set cannot be discriminated, in words."""
    together = describe_rivals(finding.confounded_with, [one.laws for one in finding.several])
    others = listed([*together, *map(name_of, finding.alternatives)])
    count = int(data.placement.max()) + 1
    where = "the one placement" if count == 1 else f"the {count} placements"
    return f"in {where} of this recording {name_of(finding.label)} and {others} have the same signature"
