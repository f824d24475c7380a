"""The verdict in a sentence and in a line, from what a ``diagnosis.json`` states."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.wording.aliases import periods_of
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import describe_rivals, finding_name, name_of, subject
from stepgauge.diagnosis.wording.limits import misfits
from stepgauge.diagnosis.wording.notation import (
    members_of,
    odds_text,
    plus_minus,
    probability,
    probability_of,
    rms_of,
    significant,
    single_readings,
    symbol,
    told_numbers,
)
from stepgauge.diagnosis.wording.phrases import structure_words
from stepgauge.files.notation import rounded

Said = Mapping[str, Any]
LIKELY = 0.5
"""Probability of all findings together from which they are said to explain what was measured."""
IN_LINE = 4
"""Aliases of a period, or single readings, that a line names; the usual ones and the first of them."""
REPEATABILITY = "repeatability"


def headline(said: Said, language: str = "en") -> str:
    """The verdict in some sentences; a scatter that is not the stated one comes first."""
    verdict, odds = said["verdict"], said["probabilities"]
    named = _numbered([describe_finding(one, said, language) for one in _systematic(said)], language)
    if verdict == "adequate":
        sure = say("sure", language, p=probability(odds["adequate"])) if odds else ""
        return _compared(said, "agrees", language) + say("within", language, sure=sure)
    if verdict == "insufficient":
        return f"{_compared(said, 'cannot_tell', language)}. {_possible(said, language)}".strip()
    text = [f"{one}." for one in _scatter(said, language)]
    disagrees = _compared(said, "disagrees", language)
    if verdict == "unknown":
        structure = {
            "where": structure_words(said["unexplained"][0], subject(said), language),
            "laws": _or_laws(said, language),
        }
        text.append(disagrees + say("unknown", language, **structure))
        return " ".join([*text, *([say("part_explained", language, named=named)] if named else [])])
    if not named:
        return " ".join([*text, say("nothing_systematic", language)])
    how = "explained" if odds.get("explained", 1.0) >= LIKELY else "likelier"
    how = "beside" if misfits(said) else how
    return " ".join([*text, disagrees + say(how, language, named=named)])


def _compared(said: Said, verb: str, language: str) -> str:
    """What was diagnosed, and what it was compared with."""
    of = subject(said).of
    key = "other" if of == "axis" and said["axis"]["form"] != "axis" else of
    return say(f"model_{key}", language, verb=say(verb, language))


def summary_line(said: Said, language: str = "en") -> str:
    """Verdict, findings and fit in a line."""
    names = [one[:1].lower() + one[1:] for one in _scatter(said, language)]
    names += _counted([describe_finding(one, said, language) for one in _systematic(said)], language)
    names += [
        say("without_law", language, where=structure_words(one, subject(said), language)) + _or_laws(said, language)
        for one in said["unexplained"][:1]
    ]
    if said["verdict"] == "insufficient" and not names:
        names = [*said.get("lacking", ()), *filter(None, [_possible(said, language).rstrip(".")])]
    what, numbers = ", ".join(names), _fit(said)
    return said["verdict"] + (f": {what}" if what else "") + (f" ({numbers})" if numbers else "")


def found_lines(said: Said) -> Iterator[str]:
    """Each finding with its values, their expanded uncertainties and its probability, in a line; so each of its rivals,
    with the values that it has if it is the cause, and what has no law, with its root mean square."""
    at = subject(said)
    for number, one in enumerate(said["effects"], 1):
        yield f"found: {number}: {finding_name(one, at)}{_values(one)}, {probability_of(one)}"
        for rival in members_of(one)[1:]:
            share = rival["conditional_probability"]
            p = "" if share is None else f", probability {probability(share * one['probability'])}"
            yield f"found: {number}: or {finding_name(rival, at)}{_values(rival)}{p}"
    for form in said["unexplained"]:
        size = "".join(f", rms {plus_minus(one)}" for one in rms_of(form).values())
        yield f"found: without a law: {form['where']}{size}, probability {probability(form['probability'])}"


def _values(one: Said) -> str:
    """The numbers of a cause with their expanded uncertainties, or how far single readings are off; empty without."""
    if rows := one.get("rows"):
        off = [
            f"row {row['row']} by {plus_minus(p)}" for row, p in zip(rows, single_readings(one).values(), strict=True)
        ]
        return ": " + ", ".join(off[:IN_LINE]) + (f" and {len(off) - IN_LINE} more" if len(off) > IN_LINE else "")
    numbers = told_numbers(one)
    numbers += [(name, p) for name, p in one["parameters"].items() if name.startswith("period") and not p.get("u")]
    values = ", ".join(f"{symbol(name, p, len(numbers))}{plus_minus(p)}" for name, p in numbers)
    return f": {values} (k = 2)" if values else ""


def describe_finding(effect: Said, said: Said, language: str = "en") -> str:
    """A finding, the aliases of its period, and what may be in its place."""
    at = subject(said)
    several = [one["labels"] for one in effect.get("several", ())]
    others = describe_rivals(effect["confounded_with"], several, at.of, language)
    others += [] if at.of == "axis" else [name_of(label, at.of, language) for label in effect["alternatives"]]
    name = finding_name(effect, at, language) + _period_of(effect, language)
    return f"{name} ({say('or', language)} {listed(others, 'or', language)})" if others else name


def _scatter(said: Said, language: str) -> Iterator[str]:
    """That the scatter is not the stated one."""
    for one in said["effects"]:
        if one["kind"] == REPEATABILITY:
            found, stated = (one["parameters"][name]["value"] for name in ("repeatability_um", "stated_um"))
            ratio = max(found / stated, stated / found)
            numbers = {"ratio": ratio, "found": found, "stated": stated}
            text = {name: rounded(value, 2) for name, value in numbers.items()}
            yield say("larger" if found > stated else "smaller", language, **text)


def _systematic(said: Said) -> list[Said]:
    return [one for one in said["effects"] if one["kind"] != REPEATABILITY]


def _or_laws(said: Said, language: str) -> str:
    """Laws that the readings do not exclude in the place of the first structure."""
    law, of = next(iter(said["unexplained"][0].get("laws", ())), None), subject(said).of
    if law is None or law["odds"] * shipped_priors().decision.excluded < 1.0:
        return ""
    names = listed([name_of(label, of, language) for label in law["labels"]], language=language)
    together = say("together", language) if len(law["labels"]) > 1 else ""
    return say("or_laws", language, names=names, together=together, odds=odds_text(law["odds"], language))


def _possible(said: Said, language: str) -> str:
    """What is as likely as anything where nothing is likelier than not."""
    if not said["probabilities"]:
        return ""
    of, odds = subject(said).of, said["probabilities"]
    every = [(one["probability"], possible_name(one, of, language)) for one in odds.get("possible", ())]
    every.append((odds["adequate"], say("nothing_at_all", language)))
    ranked = sorted(every, key=lambda one: -one[0])
    return say("no_statement", language, each=", ".join(f"{name} {probability(p)}" for p, name in ranked))


def possible_name(one: Said, of: str = "gauge", language: str = "en") -> str:
    """What is not stated and may be there all the same."""
    if "label" in one:
        return name_of(one["label"], of, language)
    return say("structure_in", language, covariate=one["covariate"])


def _numbered(named: Sequence[str], language: str) -> str:
    """Findings with the numbers that they have on the page, where one has others in its place; else a plain list."""
    if len(named) < 2 or not any("(" in one for one in named):
        return listed(_counted(named, language), language=language)
    return "; ".join(f"{number}: {one}" for number, one in enumerate(named, 1))


def _counted(names: Iterable[str], language: str) -> list[str]:
    """Names, each once, with their number: ``vibration``, ``twice step change x``."""
    said = {1: "{name}", 2: say("twice", language)}
    every = Counter(names).items()
    return [said.get(count, say("times", language)).format(name=name, count=count) for name, count in every]


def _period_of(effect: Said, language: str) -> str:
    """The period of an effect with its aliases, where it has any: they are all that is known of it."""
    others, unit = periods_of(effect.get("aliases", {}))
    if not others:
        return ""
    own = next(one for name, one in effect["parameters"].items() if name.startswith("period"))
    every = ", ".join(significant(one) for one in others[:IN_LINE])
    return say("period", language, own=significant(own["value"]), unit=unit, others=every)


def _fit(said: Said) -> str:
    """Residuals before and after, and the noise; none of a map, whose quantities have several units."""
    fit, at = said["fit"], subject(said)
    if at.of == "map":
        return ""
    unit, digits = at.deviation, _um if at.of == "gauge" else significant
    before, after, noise = (digits(fit[f"{key}_{unit}"]) for key in ("rms_before", "rms_after", "noise"))
    rest = fit.get(f"rest_rms_{unit}")
    more = "" if rest is None else f"{digits(rest)} {unit} without the structure, "
    return f"rms {before} -> {after} {unit}, {more}noise {noise} {unit}{_unseen(said)}"


def _unseen(said: Said) -> str:
    step = said.get("axis", {}).get("even_step")
    if said["verdict"] != "adequate" or not step:
        return ""
    return f"; a period that divides the steps of {significant(step)} {said['axis']['unit']} cannot be seen"


def _um(value: float | None) -> str:
    return f"{math.nan if value is None else value:.2f}"
