"""The measurement that discriminates confounded effects, chosen by simulation.

Every feasible extra run (the gauge rotated, shifted, end for end, or measured at another speed) is added to the
recording by simulation. The best one leaves the largest part of the signature of the effect that its rivals, with their
parameters fitted anew, cannot explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from shlex import quote

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.solve import Solved, orthonormal
from stepgauge.diagnosis.laws.library import family_signatures
from stepgauge.diagnosis.output.words import in_place, listed, name_of
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding
from stepgauge.diagnosis.runs import ExtraRun, Lengthened, can_be_planned, lengthened
from stepgauge.diagnosis.verdict import Model
from stepgauge.effects import along_approach_um
from stepgauge.errors import InputError
from stepgauge.files.resources import called
from stepgauge.gauge.placement import format_placement
from stepgauge.inference.problem import Candidate

Array = NDArray[np.float64]
TELLING = 9.0
"""Increase of chi-square from which an extra run is proposed."""
NO_SEPARATION = "nothing within this travel: in every placement and at every speed they look alike; log temperatures"
MORE_LINES = "lay the gauge along further edges and diagonals of the volume, each line at two places"
UNSOUGHT = "not looked for among many recordings; 'stepgauge diagnose' of this one does"


@dataclass(frozen=True)
class Separation:
    """The best extra run: the rivals that it excludes, their least chi-square, and the rivals that remain."""

    run: ExtraRun
    chi2: float
    told: tuple[str, ...]
    untold: tuple[str, ...]

    def command(self, name: str, gauge: str, machine: str) -> str:
        """The ``stepgauge plan`` command of the run, with its placement in the file ``name``.toml."""
        speed = "" if self.run.speed_mm_s is None else f" --measuring-speed {self.run.speed_mm_s:g}"
        files = f"{name}.toml -g {quote(gauge)} -m {quote(machine)}"
        return f"stepgauge plan {files} -d dmis --cycles {self.run.cycles}{speed} -o {name}.dmi"

    def placement_text(self) -> str:
        """The placement file of the run."""
        return format_placement(self.run.placement)


def with_separations(
    findings: Sequence[Finding], model: Model, data: Residuals, wanted: bool = True
) -> tuple[list[Finding], dict[str, str]]:
    """The findings with the reasons of their sets and the measurements that separate them; placements by file.

    ``wanted``: whether to look for these measurements.
    """
    if not wanted:
        return [_unsought(one, data) for one in findings], {}
    told: list[Finding] = []
    placements: dict[str, str] = {}
    sets = bool(data.gauge.path) and any(one.confounded_with or one.alternatives for one in findings)
    possible = lengthened(data, model.state.sigma_um) if sets else []
    for place, finding in enumerate(findings):
        if not finding.confounded_with and not finding.alternatives:
            told.append(finding)
            continue
        if finding.effects:
            told.append(replace(finding, reason=_reason(finding, data), separate_by=MORE_LINES))
            continue
        others = {one.label for one in finding.members} - {finding.label}
        rivals = [
            (one.candidate, one.proposal.atom)
            for one in model.laws[place].place.members
            if one.candidate.named and one.candidate.source.label in others
        ]
        best = separate(place, model.fitted.solved, rivals, possible)
        name, by = f"separate-{len(placements) + 1}", NO_SEPARATION
        if best is not None:
            placements[f"{name}.toml"] = best.placement_text()
            machine = data.machine.with_stylus(best.run.stylus).path
            command = best.command(name, called(data.gauge.path), called(machine))
            rest = f"; nothing within this travel separates it from {listed(best.untold, 'or')}" if best.untold else ""
            by = f"{best.run.words}, which separates it from {', '.join(best.told)}: {command}{rest}"
        told.append(replace(finding, reason=_reason(finding, data), separate_by=by))
    return told, placements


def _unsought(finding: Finding, data: Residuals) -> Finding:
    if not finding.confounded_with and not finding.alternatives:
        return finding
    return replace(finding, reason=_reason(finding, data), separate_by=UNSOUGHT)


def _reason(finding: Finding, data: Residuals) -> str:
    """Why the set cannot be discriminated, in words."""
    together = in_place(finding.confounded_with, [one.laws for one in finding.several])
    others = listed([*together, *map(name_of, finding.alternatives)])
    count = int(data.placement.max()) + 1
    where = "the one placement" if count == 1 else f"the {count} placements"
    return f"in {where} of this recording {name_of(finding.label)} and {others} have the same signature"


def separate(
    place: int,
    solved: Sequence[Solved],
    rivals: Sequence[tuple[Candidate, int]],
    possible: Sequence[Lengthened],
) -> Separation | None:
    """The extra run that best discriminates one finding from its rivals; None if no feasible run does.

    Parameters
    ----------
    place : index in ``solved`` of the rivals
    solved : the fitted effects
    rivals : the other laws for this place, each with the number of its shape
    possible : result of :func:`lengthened`, of which those count that can be planned
    """
    found = []
    for one in possible:
        try:
            left = _left_over(one, place, solved, rivals)
        except InputError:
            continue
        told = {label: chi2 for label, chi2 in left.items() if chi2 > TELLING}
        if told:
            untold = tuple(label for label in left if label not in told)
            found.append(Separation(one.run, min(told.values()), tuple(told), untold))
    while found:
        # the most rivals first, then the clearest; among runs nearly as clear the one that is the least trouble
        best = max(found, key=lambda one: (len(one.told), one.chi2))
        first = next(one for one in found if len(one.told) == len(best.told) and one.chi2 > best.chi2 / 2)
        if can_be_planned(first.run, possible[0].data):
            return first
        found.remove(first)
    return None


def _left_over(
    one: Lengthened, place: int, solved: Sequence[Solved], rivals: Sequence[tuple[Candidate, int]]
) -> dict[str, float]:
    """The chi-square of the effect that each rival cannot explain, with the extra run added."""
    more, metric = one.data, one.metric
    effect = metric(np.asarray(along_approach_um(solved[place].effect, more.probings)))
    others = [metric(along_approach_um(s.effect, more.probings)) for i, s in enumerate(solved) if i != place]
    left_over = {}
    for candidate, atom in rivals:
        family = candidate.source
        columns = metric(family_signatures(family, family.atoms[atom], more))
        basis = orthonormal(np.vstack([*others, *columns]).T)
        left = effect - basis @ (basis.T @ effect)
        left_over[family.label] = float(left @ left)
    return left_over
