"""Conformity of the errors of an evaluation with a maximum permissible error, face by face (ISO 14253-1, JCGM 106).

Judged are the errors that were probed, XF at fronts and XB at backs, each with the limit for its distance from the
reference face and with its own expanded uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stepgauge.conditions import Conditions, gate, stored_conditions
from stepgauge.conditions.decision import (
    DECISION_SOURCE,
    ConformityDecision,
    Outcome,
    conformity_probability,
    decide,
    together,
)
from stepgauge.errors import InputError, naming
from stepgauge.files.notation import quantity
from stepgauge.machine.file import Machine, check_recorded
from stepgauge.standards.mpe import Mpe

if TYPE_CHECKING:
    from stepgauge.standards.budget_files import StoredBudget, StoredGap, StoredSource

SHORT: Mapping[Outcome, str] = {
    "conforms": "pass",
    "does not conform": "fail",
    "not decidable": "undecidable",
    "no statement": "no statement",
}
PROBABILITY_SOURCE = "JCGM 106:2012"


@dataclass(frozen=True)
class FaceDecision:
    """The error of a face beside its limit; ``expanded_um`` and ``probability`` (of conformity) None without a U."""

    placement: int
    face: int
    error_um: float
    limit_um: float
    expanded_um: float | None
    probability: float | None
    outcome: Outcome

    @property
    def word(self) -> str:
        """As a table has it."""
        return SHORT[self.outcome]


@dataclass(frozen=True)
class NeededUncertainty:
    """The face that is farthest from a decision, and what its largest source must become so that there is one.

    ``expanded_um``: its U; ``needed_um``: the U from which it is decided; ``source``: the largest one, with its
    standard uncertainty ``u_um``; ``allowed_um``: the largest that decides with the others as they are, None where the
    others alone are too large.
    """

    placement: int
    face: int
    expanded_um: float
    needed_um: float
    source: StoredSource
    u_um: float
    allowed_um: float | None

    @property
    def text(self) -> str:
        """What decides, in words."""
        said = f"at face {self.face} U is {self.expanded_um:.2g} um, and {self.needed_um:.2g} um decides"
        largest = f"the largest source is {self.source.label} with u = {self.u_um:.2g} um"
        if self.allowed_um is None:
            return f"{said}; {largest}, without which U would still be too large"
        return f"{said}; {largest}, which must be below {self.allowed_um:.2g} um"


def _needed(face: FaceDecision, budget: StoredBudget) -> NeededUncertainty | None:
    line = budget.find("xf" if face.face % 2 else "xb", face.placement, face.face)
    if line is None or not line.contributions_um:
        return None
    source, largest = max(line.contributions_um.items(), key=lambda one: abs(one[1]))
    needed_um = abs(face.limit_um - abs(face.error_um))
    left = (needed_um / line.k) ** 2 - (line.u_um**2 - largest**2)
    stated = next(one for one in budget.sources if one.name == source)
    allowed_um = math.sqrt(left) if left > 0.0 else None
    return NeededUncertainty(face.placement, face.face, line.expanded_um, needed_um, stated, abs(largest), allowed_um)


@dataclass(frozen=True)
class Conformity:
    """The decision on every face that was probed; ``missing``: what U lacks; ``prevented``: why none is made.

    ``needed``: what would decide where an error lies within U of its limit.
    """

    mpe: Mpe
    faces: tuple[FaceDecision, ...]
    missing: tuple[StoredGap, ...]
    prevented: str
    needed: NeededUncertainty | None = None

    @property
    def outcome(self) -> Outcome:
        """Of all faces together."""
        return together([one.outcome for one in self.faces])

    def of(self, placement: int, face: int) -> FaceDecision | None:
        """The decision on a face; None where it was not probed."""
        return next((one for one in self.faces if (one.placement, one.face) == (placement, face)), None)

    @property
    def decision(self) -> ConformityDecision:
        """On all faces; without a complete U it is said how many errors alone are beyond the limit."""
        faces = [(f"placement {one.placement}, face {one.face}", one.outcome) for one in self.faces]
        beyond = sum(abs(one.error_um) > one.limit_um for one in self.faces)
        text = f"{self.text} {beyond} of {len(self.faces)} errors are beyond the limit." if self.missing else self.text
        near = "an error lies within U of its limit" + (f": {self.needed.text}" if self.needed else "")
        lacking = self.lacking or near
        reason = {"no statement": self.prevented, "not decidable": lacking}.get(self.outcome, "")
        return ConformityDecision(self.outcome, text, reason, tuple(faces))

    @property
    def lacking(self) -> str:
        """What U lacks, in words; empty where it is complete."""
        return f"U lacks {'; '.join(one.what for one in self.missing)}" if self.missing else ""

    @property
    def text(self) -> str:
        """The sentence of page 1: the decision, the worst face, what is missing, and the rule."""
        worst = max(self.faces, key=lambda one: abs(one.error_um) / one.limit_um)
        u = "not evaluated" if worst.expanded_um is None else quantity(worst.expanded_um, 2, "µm")
        error = quantity(worst.error_um, 2, "µm")
        of = f" of placement {worst.placement}" if len({one.placement for one in self.faces}) > 1 else ""
        at = f"largest share of the limit at face {worst.face}{of}: {'XF' if worst.face % 2 else 'XB'} {error}, U {u}"
        head = f"{SHORT[self.outcome].capitalize()}: MPE = ± {self.mpe.to_text()} from the reference face"
        said = [head, f"{at}, limit {worst.limit_um:.2f} µm"]
        probabilities = [one.probability for one in self.faces if one.probability is not None]
        if probabilities and self.outcome != "no statement":
            least = _percent(min(probabilities))
            said.append(f"least probability of conformity of a face {least} ({PROBABILITY_SOURCE})")
        if self.missing and not self.prevented:
            said.append(f"{self.lacking}, so that nothing can be decided")
        return f"{'; '.join(said)}. {self.prevented}{' ' if self.prevented else ''}Decision rule: {DECISION_SOURCE}."


def _percent(share: float) -> str:
    return "above 99.9 %" if share > 0.999 else "below 0.1 %" if share < 0.001 else f"{100.0 * share:.1f} %"


def limit_of(
    comments: Mapping[str, str],
    machine: Machine | None,
    *,
    asked: str | None = None,
    certified: str | None = None,
    stored: str | None = None,
) -> Mpe | None:
    """The one limit that an evaluation is judged by, wherever that is done; None where nobody states one.

    ``asked`` now, else ``stored`` in the evaluation, else that of the machine file, which must be of the machine of the
    recording (``comments``), else ``certified`` in a certificate file, which must be the same limit
    (:class:`InputError`): one certificate after the other is made from that file.
    """
    known = asked if asked is not None else stored
    if known is None and machine is not None and machine.table.mpe is not None:
        check_recorded(comments, machine)
        known = machine.table.mpe
    if known is not None and certified is not None and Mpe.parse(known) != Mpe.parse(certified):
        raise InputError(naming("mpe"), "the certificate states another limit", found=known, expected=certified)
    text = known if known is not None else certified
    return None if text is None else Mpe.parse(text)


def conformity(evaluation: Mapping[str, Any], budget: StoredBudget | None, mpe: Mpe) -> Conformity:
    """The decisions on an evaluation; ``budget``: of it; without one, or with an incomplete one, nothing is decided.

    ``evaluation``: content of an ``evaluation.json`` (:mod:`stepgauge.evaluation.files`).
    """
    missing = (_no_budget(),) if budget is None else tuple(budget.not_included)
    largest = None if budget is None else max(line.expanded_um for line in budget.quantities)
    conditions = stored_conditions(evaluation).weighed(largest)
    faces = tuple(
        _decided(row, placed["placement"], float(length), budget, mpe, missing, conditions)
        for placed in evaluation["placements"]
        for row, length in _probed(placed["faces"])
    )
    fails = any(one.outcome == "does not conform" for one in faces)  # which no smaller U would change
    near = [one for one in faces if one.outcome == "not decidable" and not missing and not fails]
    needed = [found for one in near if budget is not None and (found := _needed(one, budget)) is not None]
    farthest = min(needed, key=lambda one: one.needed_um / one.expanded_um, default=None)
    return Conformity(mpe, faces, missing, conditions.no_statement, farthest)


def _no_budget() -> StoredGap:
    """What U lacks where there is none."""
    from stepgauge.standards.budget_files import StoredGap

    return StoredGap(source="budget", what="the uncertainty budget (--budget states it)", state_by="--budget")


def _probed(rows: list[dict[str, Any]]) -> list[tuple[dict[str, Any], float]]:
    """Faces that were read, with their distance from the reference face, mm; the reference itself has no error."""
    read = [row for row in rows if row["count"]]
    reference = next(row["nominal_mm"] for row in read if row["face"] % 2)
    return [(row, row["nominal_mm"] - reference) for row in read if row["nominal_mm"] != reference]


def _decided(
    row: dict[str, Any],
    placement: int,
    length_mm: float,
    budget: StoredBudget | None,
    mpe: Mpe,
    missing: tuple[StoredGap, ...],
    conditions: Conditions,
) -> FaceDecision:
    name = "xf" if row["face"] % 2 else "xb"
    error, limit = float(row[f"{name}_um"]), float(mpe.at_um(length_mm))
    line = None if budget is None else budget.find(name, placement, row["face"])
    expanded = None if line is None else line.expanded_um
    outcome = decide(error, limit, expanded or 0.0, missing)
    known = line is not None and not missing
    probability = conformity_probability(error, limit, line.u_um) if line is not None and known else None
    return FaceDecision(placement, row["face"], error, limit, expanded, probability, gate(conditions, outcome))
