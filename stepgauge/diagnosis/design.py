"""The further run that is worth most for a set of causes: Bayesian experimental design (Lindley 1956).

Every feasible run (the gauge rotated, shifted, end for end, or measured at another speed) is added to the recording by
simulation. What is expected to be learnt about which cause of the set it is follows from the part of the effect that
each rival, with its parameters fitted anew, cannot explain (:mod:`stepgauge.inference.design`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote

import numpy as np

from stepgauge.diagnosis.fits.solve import Solved, orthonormal
from stepgauge.diagnosis.further_runs import ExtendedRecording, FurtherRun, can_be_planned, extended, further_runs
from stepgauge.diagnosis.laws.library import family_signatures
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, Located
from stepgauge.diagnosis.stated_model import Model
from stepgauge.diagnosis.wording.catalogue import listed
from stepgauge.diagnosis.wording.findings import describe_rivals, name_of
from stepgauge.effects import along_approach_um
from stepgauge.errors import InputError
from stepgauge.files.resources import called
from stepgauge.gauge.placement import format_placement
from stepgauge.inference.design import expected_information_gain
from stepgauge.inference.problem import Candidate

_AXIS = re.compile(r"_([xyz])\b")
ALONG = "the gauge along machine "
TELLING = 9.0
"""Increase of chi-square from which a run excludes a rival."""
NEARLY = 0.95
"""Part of the largest expected information from which a run that is less trouble is taken."""
NO_SEPARATION = "nothing within this travel: in every placement and at every speed they look alike; log temperatures"
MORE_LINES = "lay the gauge along further edges and diagonals of the volume, each line at two places"
UNSOUGHT = "not looked for among many recordings; 'stepgauge diagnose' of this one does"


@dataclass(frozen=True)
class ProposedRun:
    """A further run: the information that is expected of it, nats; the rivals that it excludes, and those it leaves."""

    run: FurtherRun
    expected_information_gain: float
    excludes: tuple[str, ...]
    leaves: tuple[str, ...]


def planned_command(run: FurtherRun, data: Residuals, placements: dict[str, str]) -> str:
    """The ``stepgauge plan`` command of a run; its placement is added to the texts of placement files.

    In the language of the program that was run, by the end of its name; DMIS where that tells none.
    """
    from stepgauge.programs import DIALECTS  # its run was planned, so that all are loaded

    name, suffix = f"separate-{len(placements) + 1}", Path(data.program.split("; ")[0]).suffix
    placements[f"{name}.toml"] = format_placement(run.placement)
    dialect = next((one for one in DIALECTS.values() if one.suffix == suffix), DIALECTS["dmis"])
    speed = "" if run.speed_mm_s is None else f" --measuring-speed {run.speed_mm_s:g}"
    gauge, machine = called(data.gauge.path), called(data.machine.select_stylus(run.stylus).path)
    files = f"{name}.toml -g {quote(gauge)} -m {quote(machine)}"
    return f"stepgauge plan {files} -d {dialect.name} --cycles {run.cycles}{speed} -o {name}{dialect.suffix}"


def add_separations(
    findings: Sequence[Finding], model: Model, data: Residuals, wanted: bool = True
) -> tuple[list[Finding], dict[str, str]]:
    """The findings with the reasons of their sets and the measurements that separate them; placements by file.

    ``wanted``: whether to look for these measurements.
    """
    placements: dict[str, str] = {}
    several = [bool(one.confounded_with or one.alternatives) for one in findings]
    possible = extended(data, model.state.sigma_um) if wanted and data.gauge.path and any(several) else []
    found = list(findings)
    for index, finding in enumerate(findings):
        if several[index]:
            how = UNSOUGHT
            if wanted:
                how = MORE_LINES if finding.effects else _separate_by(index, finding, model, data, possible, placements)
            found[index] = replace(finding, reason=_reason(finding, data), separate_by=how)
    return found, placements


def _separate_by(
    index: int,
    finding: Finding,
    model: Model,
    data: Residuals,
    possible: Sequence[ExtendedRecording],
    placements: dict[str, str],
) -> str:
    """The run that separates a set, in words with its command."""
    others = {one.label for one in finding.members} - {finding.label}
    every = [one for one in model.laws[index].credible_set.members if one.candidate.named]
    members = [one for one in every if one.candidate.source.label in others]
    rivals = [(one.candidate, one.proposal.atom) for one in members]
    probability = [model.laws[index].lead.probability, *(one.probability for one in members)]
    best = separate(index, model.fitted.solved, rivals, probability, possible)
    if best is None:
        return NO_SEPARATION
    command = planned_command(best.run, data, placements)
    rest = f"; nothing within this travel separates it from {listed(best.leaves, 'or')}" if best.leaves else ""
    return f"{best.run.words}, which separates it from {', '.join(best.excludes)}: {command}{rest}"


def add_placements(
    structure: Sequence[Located], data: Residuals, excluded: float, placements: dict[str, str]
) -> Iterator[Located]:
    """Structure with the measurement that tells whether laws that the readings do not exclude are in its place.

    Laws of several axes together have one sum along each line that was measured, and are told apart along each axis
    alone. ``excluded``: odds below which a law counts as excluded; ``placements``: texts of placement files, added to.
    """
    for one in structure:
        near = [law for law in one.laws if law.odds * excluded >= 1.0]
        axes = sorted({axis for law in near for label in law.laws for axis in _AXIS.findall(label)})
        if not near or not data.gauge.path:
            yield one
            continue
        runs = [run for run in further_runs(data) if run.words.startswith(ALONG) and run.words[len(ALONG)] in axes]
        runs = [run for run in runs if can_be_planned(run, data)]
        commands = [planned_command(run, data, placements) for run in runs]
        where = listed([run.words for run in runs]) or f"the gauge along {listed(axes) or 'other directions'}"
        yield replace(one, separate_by=": ".join([f"{where}, each alone", *filter(None, ["; ".join(commands)])]))


def _reason(finding: Finding, data: Residuals) -> str:
    """Why the set cannot be discriminated, in words."""
    together = describe_rivals(finding.confounded_with, [one.laws for one in finding.several])
    others = listed([*together, *map(name_of, finding.alternatives)])
    count = int(data.placement.max()) + 1
    where = "the one placement" if count == 1 else f"the {count} placements"
    return f"in {where} of this recording {name_of(finding.label)} and {others} have the same signature"


def separate(
    index: int,
    solved: Sequence[Solved],
    rivals: Sequence[tuple[Candidate, int]],
    probability: Sequence[float],
    possible: Sequence[ExtendedRecording],
) -> ProposedRun | None:
    """The run that is expected to tell most about which of a set is the cause; None if no feasible run tells anything.

    Parameters
    ----------
    index : index in ``solved`` of the rivals
    solved : the fitted effects
    rivals : the other laws for this place, each with the number of its shape
    probability : of the finding and of each rival
    possible : result of :func:`extended`, of which those count that can be planned
    """
    found = []
    labels = [candidate.source.label for candidate, _ in rivals]  # one law in several parts has one label
    p = np.array(probability) / sum(probability)
    for one in possible:
        try:
            left = _left_over(one, index, solved, rivals)
        except InputError:
            continue
        distance = np.zeros((len(p), len(p)))
        distance[0, 1:] = distance[1:, 0] = left
        leaves = tuple(dict.fromkeys(label for label, chi2 in zip(labels, left, strict=True) if chi2 <= TELLING))
        excludes = tuple(label for label in dict.fromkeys(labels) if label not in leaves)
        if excludes:
            found.append(ProposedRun(one.run, expected_information_gain(p, distance), excludes, leaves))
    while found:
        most = max(one.expected_information_gain for one in found)
        # among runs that are worth nearly as much the one that is the least trouble
        first = next(one for one in found if one.expected_information_gain >= NEARLY * most)
        if can_be_planned(first.run, possible[0].data):
            return first
        found.remove(first)
    return None


def _left_over(
    one: ExtendedRecording, index: int, solved: Sequence[Solved], rivals: Sequence[tuple[Candidate, int]]
) -> list[float]:
    """The chi-square of the effect that each rival cannot explain, with the extra run added."""
    more, metric = one.data, one.metric
    effect = metric(np.asarray(along_approach_um(solved[index].effect, more.probings)))
    others = [metric(along_approach_um(s.effect, more.probings)) for i, s in enumerate(solved) if i != index]
    left_over = []
    for candidate, atom in rivals:
        family = candidate.source
        columns = metric(family_signatures(family, family.atoms[atom], more))
        basis = orthonormal(np.vstack([*others, *columns]).T)
        left = effect - basis @ (basis.T @ effect)
        left_over.append(float(left @ left))
    return left_over
