"""What a page says of an evaluation: the decision by the limit of the project."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.web.site import Site
from stepgauge.web.texts import Words

if TYPE_CHECKING:
    from stepgauge.standards.budget_files import StoredBudget
    from stepgauge.standards.conformity import Conformity, FaceDecision, NeededUncertainty


STATED_AT: Mapping[str, str] = {
    "certificate": "gauge#table",
    "gauge.expansion_per_K": "gauge#expansion_uncertainty_per_K",
    "drift of the gauge": "gauge#drift_um_per_m_per_year",
    "gauge temperature": "machine#u_gauge_temperature_K",
    "gauge_temperature_C": "importing#gauge_temperature",
    "measured_at": "importing#measured_on",
    "machine.temperature_C": "machine#u_scale_temperature_K",
    "machine.scale_expansion_per_K": "machine#u_scale_expansion_per_K",
    "probing": "machine#u_probing_um",
    "resolution": "machine#resolution_um",
    "temperature convention of the readings": "machine#temperature_convention",
    "alignment": "locate#points",
    "repeatability": "plan#cycles",
}
"""Page and field where a source of uncertainty is stated, or made smaller."""
LOOK = {"conforms": "good", "does not conform": "error", "not decidable": "warning", "no statement": "warning"}
"""How a decision is shown."""


def key_of(name: str) -> str:
    """The key of a text for a name in words."""
    return name.replace(" ", "_")


def outcome_key(outcome: str, has_budget: bool) -> str:
    """The key of a decision in words: what only lacks the uncertainty that nobody has computed is no decision yet."""
    return "not_yet" if outcome == "not decidable" and not has_budget else key_of(outcome)


def verdict(words: Words, judged: Conformity, has_budget: bool) -> dict[str, Any]:
    """The decision of page 1: how it looks, its word, and what it rests on; without a budget, how to get one."""
    worst = max(judged.faces, key=lambda one: abs(one.error_um) / one.limit_um)
    u = words("result.no_u") if worst.expanded_um is None else f"{words.number(worst.expanded_um)} µm"
    numbers = {"error": words.number(worst.error_um), "limit": words.number(worst.limit_um)}
    lines = [
        words("result.mpe_is", mpe=words.decimal(judged.mpe.to_text())),
        words("result.worst", face=_face_words(words, judged, worst), u=u, **numbers),
    ]
    if judged.prevented:
        lines.append(words.message(judged.prevented))
    if judged.missing and not judged.prevented:
        lacking = words("result.lacking", what=", ".join(source_name(words, one.what) for one in judged.missing))
        lines.append(lacking if has_budget else words("result.compute_first"))
    there = [STATED_AT[one.source] for one in judged.missing if one.source in STATED_AT]
    if judged.needed is not None:
        lines.append(_needed(words, judged, judged.needed))
        decides = judged.needed.allowed_um is not None
        there = [STATED_AT.get(judged.needed.source.name, "machine")] if decides else []
    probabilities = [one.probability for one in judged.faces if one.probability is not None]
    if probabilities and judged.outcome != "no statement":
        lines.append(words("result.probability", least=words.number(100 * min(probabilities), 1)))
    look, word = LOOK[judged.outcome], words(f"outcome.{outcome_key(judged.outcome, has_budget)}")
    return {"look": look, "word": word, "lines": lines, "there": list(dict.fromkeys(there))}


def _face_words(words: Words, judged: Conformity, one: FaceDecision | NeededUncertainty) -> str:
    """A face by its number, with its placement where there are several."""
    if len({face.placement for face in judged.faces}) == 1:
        return str(one.face)
    return words("result.at_placement", face=one.face, placement=one.placement)


def _needed(words: Words, judged: Conformity, needed: NeededUncertainty) -> str:
    """What must become smaller so that an error within U of its limit is decided."""
    numbers = {"u": needed.u_um, "expanded": needed.expanded_um, "needed": needed.needed_um}
    said = {name: words.number(um) for name, um in numbers.items()}
    said["source"] = source_name(words, needed.source.label)
    said["face"] = _face_words(words, judged, needed)
    if needed.allowed_um is None:
        return words("result.undecidable_even_without", **said)
    return words("result.undecidable_how", allowed=words.number(needed.allowed_um), **said)


def source_name(words: Words, what: str) -> str:
    """A source that a budget lacks, as the page calls it."""
    key = f"source.{key_of(what.split(' (')[0])}"
    return words(key) if words.has(key) else words.message(what)


def decided(
    site: Site, evaluation: Mapping[str, Any], budget: StoredBudget | None
) -> tuple[Conformity | None, InputError | None]:
    """Decision and why there is none; no limit stated: None twice.

    By what ``report`` takes in this project: its machine, and the limit of the project, of the evaluation or of the
    machine file, in this order; what the report refuses is why nothing is decided.
    """
    from stepgauge.reports.sources import read_sources
    from stepgauge.standards.conformity import conformity

    if not site.has_project:
        return None, None
    try:
        project = site.project()
        stated = project.stated("report")
        machine = site.stated("machine") if "machine" in stated else None
        said = read_sources(dict(evaluation), None, (), machine, budget, mpe=stated.get("mpe"))
    except InputError as error:
        return None, error
    return (None if said.mpe is None else conformity(evaluation, budget, said.mpe)), None
