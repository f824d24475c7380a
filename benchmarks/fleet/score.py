"""Score what an inference says of a fleet against the sealed truth.

    python -m benchmarks.fleet.score FLEET answer.json [FLEET answer.json ...]

**An answer** is a list of causes (or an object whose key ``causes`` is that list), each an object with

============== =========================================================================================================
``owner_kind`` ``machine``, ``gauge``, ``type`` (model line), ``hall`` or ``probe``
``owner``      its id as in ``fleet.csv``, such as ``M017``, ``G04``, ``T3``, ``H2``, ``P11``
``kind``       a word of the table below
``where``      optional: axis, plane, block; a value that differs from the truth's is another cause
``from, to``   first and last date on which it may have begun (ISO; null: it was there in the first recording)
``size``       in the unit and with the sign of the table; ``u`` its standard uncertainty, both optional
``probability`` that this owner has a cause of this kind; from 0.5 on the cause counts as *named*
``instead``    optional list of ``{owner_kind, owner, kind}``: what the fleet cannot tell it from. Only what cannot be
               excluded: an answer with ``instead`` is left open, and is no attribution to one owner
============== =========================================================================================================

**Kinds.** Signs: of a machine or probe what the *reading* does, of a gauge what the *gauge* truly is less its
certificate. One owner has one cause of a kind at a place (``where``).

===================== ============ ====== ========== ===================================================================
kind                  owners       unit   where      positive means
===================== ============ ====== ========== ===================================================================
``scale``             machine,type ppm    x, y       coordinates of this axis are indicated too large
``squareness``        machine      urad   xy         x is indicated too large by this times y
``reversal``          machine      um     x, y       full step: half of it with the sign of travel on this axis
``periodic``          type,machine um     x, y       mean amplitude of the machines of the line (never negative)
``local_scale``       machine      um     x, y       height of a bump of the scale: indicated too large there
``certificate_scale`` gauge        ppm               the gauge is longer than certified
``gauge_expansion``   gauge        1e-6/K            expands more than stated
``block``             gauge        um     its number both faces lie farther from face 1 than certified
``wear``              gauge        um/yr  fronts,    material lost a year on each worn face (never negative); ``used``:
                                          used       both sides of the blocks from 1 to some number
``temperature``       hall         K                 rms over days: gauges are warmer or colder than stated there
``radius``            probe        um                triggers later than stated
===================== ============ ====== ========== ===================================================================

``gauge_expansion`` acts on the true temperature: where a hall's ``temperature`` is wrong, both together act as well.

**Rules.** An entry *fits* a cause if it has its owner and either its kind (and ``where``, if given) or another kind of
the same family (``FAMILIES``). A cause is *attributed* if a named entry fits it that is not left open; its kind is
right if that entry has its kind. A named entry that fits none is a *false discovery*; further entries that fit a cause
already attributed are repeats and count nowhere, nor do machines named beside their line for the cause of the line.

A cause has *rivals* where single recordings leave it confounded. Its pair is *settled right* if the cause is attributed
and no rival is named for it; a false discovery counts as named for that cause with which its owner shares most of its
recordings. Causes that the crossing does not determine stand apart: right is an entry at one of the owners
that is left open to the other; an entry that is not left open is *overclaimed*, and false if it is at the wrong owner.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.blind.score import wilson_interval

Entry = Mapping[str, Any]
KINDS: dict[str, tuple[str, ...]] = {
    "scale": ("machine", "type"),
    "squareness": ("machine",),
    "reversal": ("machine",),
    "periodic": ("type", "machine"),
    "local_scale": ("machine",),
    "certificate_scale": ("gauge",),
    "gauge_expansion": ("gauge",),
    "block": ("gauge",),
    "wear": ("gauge",),
    "temperature": ("hall",),
    "radius": ("probe",),
}
"""Kinds, and who may own one."""
FAMILIES = (
    {"scale", "squareness", "certificate_scale", "gauge_expansion", "temperature"},
    {"reversal", "radius", "wear"},
    {"block", "local_scale", "wear"},
    {"periodic"},
)
"""Kinds that look alike in one recording: a rate along the gauge, fronts against backs, single faces, a period."""
NAMED = 0.5
BINS = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)
"""Borders of the classes of stated probability."""
SIZE_WITHIN = 0.3
"""A size counts as right within this share of the truth, or within two standard uncertainties if ``u`` is given."""


@dataclass
class Verdict:
    """What became of one hidden cause."""

    cause: Entry
    attributed: bool = False
    kind_right: bool = False
    size_right: bool | None = None
    date_right: bool | None = None
    settled: bool | None = None
    overclaimed: bool = False
    said: list[str] = field(default_factory=list)


@dataclass
class Result:
    """All of one fleet: a verdict for every cause, the false discoveries, and (probability, right) of every entry."""

    verdicts: list[Verdict] = field(default_factory=list)
    false: list[Entry] = field(default_factory=list)
    named: int = 0
    stated: list[tuple[float, bool]] = field(default_factory=list)

    def add(self, other: Result) -> None:
        self.verdicts += other.verdicts
        self.false += other.false
        self.named += other.named
        self.stated += other.stated


def read_answer(path: Path) -> list[Entry]:
    """The entries of an answer; ``ValueError`` names the entry and what is wrong with it."""
    content = json.loads(path.read_text())
    entries = content["causes"] if isinstance(content, dict) else content
    for number, entry in enumerate(entries, 1):
        if problem := _problem(entry):
            raise ValueError(f"{path}, entry {number}: {problem}")
    return list(entries)


def _problem(entry: Entry) -> str:
    if missing := [key for key in ("owner_kind", "owner", "kind", "probability") if key not in entry]:
        return f"{missing[0]} is missing"
    if entry["kind"] not in KINDS:
        return f"kind {entry['kind']!r}, expected one of {', '.join(KINDS)}"
    if entry["owner_kind"] not in KINDS[entry["kind"]]:
        return f"{entry['kind']} of a {entry['owner_kind']}, expected {' or '.join(KINDS[entry['kind']])}"
    return "" if 0.0 <= entry["probability"] <= 1.0 else f"probability {entry['probability']}, expected 0 to 1"


def related(one: str, other: str) -> bool:
    """Whether two kinds belong to one family."""
    return any({one, other} <= family for family in FAMILIES)


def _same_owner(one: Entry, other: Entry) -> bool:
    return bool(one["owner_kind"] == other["owner_kind"] and str(one["owner"]) == str(other["owner"]))


def fits(entry: Entry, cause: Entry) -> bool:
    """Whether an entry names this cause: the owner, and the kind at its place or a related kind."""
    if not _same_owner(entry, cause):
        return False
    if entry["kind"] != cause["kind"]:
        return related(entry["kind"], cause["kind"])
    given, true = entry.get("where"), cause.get("where")
    return given is None or true is None or str(given) == str(true)


def _left_open_between(entry: Entry, cause: Entry) -> bool:
    """Whether an entry leaves open which of the cause's owner and a rival it is."""
    mentioned = [entry, *entry.get("instead", [])]
    return any(_same_owner(one, cause) for one in mentioned) and any(_overlap(one, cause) >= 0.0 for one in mentioned)


def _of_the_line(entry: Entry, causes: Iterable[Entry]) -> bool:
    """Whether an entry names a machine for what its whole line has."""
    return entry["owner_kind"] == "machine" and any(
        cause["owner_kind"] == "type" and entry["owner"] in cause["members"] and related(entry["kind"], cause["kind"])
        for cause in causes
    )


def score(truth: Mapping[str, Any], answer: Sequence[Entry]) -> Result:
    """Judge one answer."""
    ordered = sorted(answer, key=lambda entry: -entry["probability"])
    named = [entry for entry in ordered if entry["probability"] >= NAMED]
    causes = truth["causes"]
    verdicts = [_judge(cause, [entry for entry in named if _is_about(entry, cause, causes)]) for cause in causes]
    met = [verdict.cause for verdict in verdicts if verdict.attributed]
    false = [entry for entry in named if not _is_right(entry, causes, met)]
    stated = [(float(entry["probability"]), _is_right(entry, causes, met)) for entry in ordered]
    hits = sum(verdict.attributed or verdict.settled is True for verdict in verdicts)
    return Result(verdicts, false, hits + len(false), stated)


def _is_right(entry: Entry, causes: Sequence[Entry], met: Sequence[Entry]) -> bool:
    """Whether an entry is right: it fits a cause, is left open beside it, or is of a line that was met."""
    if any(fits(entry, cause) or (entry.get("instead") and _left_open_between(entry, cause)) for cause in causes):
        return True
    return _of_the_line(entry, met)


def _is_about(entry: Entry, cause: Entry, causes: Sequence[Entry]) -> bool:
    """Whether an entry is about this cause: it fits it, or fits none and is at the rival that is nearest to it."""
    if fits(entry, cause) or any(fits(entry, other) for other in causes):
        return fits(entry, cause)
    return 0.0 <= _overlap(entry, cause) == max(_overlap(entry, other) for other in causes)


def _overlap(entry: Entry, cause: Entry) -> float:
    """Share of recordings that the rival which an entry names has in common with the cause's owner; -1 for none."""
    named = [rival for rival in cause["rivals"] if _same_owner(entry, rival) and related(entry["kind"], rival["kind"])]
    return max((float(rival.get("overlap", 0.0)) for rival in named), default=-1.0)


def _judge(cause: Entry, about: Sequence[Entry]) -> Verdict:
    """What became of a cause, from the named entries that are about it."""
    fitting = [entry for entry in about if fits(entry, cause)]
    firm = [entry for entry in fitting if not entry.get("instead")]
    rivals = [entry for entry in about if not fits(entry, cause)]
    verdict = Verdict(cause, said=[_words(entry) for entry in (*fitting, *rivals)])
    if not cause["determined"]:
        verdict.settled = any(_left_open_between(entry, cause) for entry in about if entry.get("instead"))
        verdict.overclaimed = any(not entry.get("instead") for entry in (*fitting, *rivals))
        return verdict
    verdict.attributed = bool(firm)
    if firm:
        best = next((entry for entry in firm if entry["kind"] == cause["kind"]), firm[0])
        verdict.kind_right = best["kind"] == cause["kind"]
        verdict.size_right = _size_right(best, cause) if verdict.kind_right else None
        verdict.date_right = _date_right(best, cause)
    if cause["rivals"]:
        verdict.settled = bool(firm) and not any(not entry.get("instead") for entry in rivals)
    return verdict


def _size_right(entry: Entry, cause: Entry) -> bool | None:
    if entry.get("size") is None:
        return None
    allowed = 2.0 * entry["u"] if entry.get("u") else SIZE_WITHIN * abs(cause["size"])
    return abs(entry["size"] - cause["size"]) <= allowed


def _date_right(entry: Entry, cause: Entry) -> bool | None:
    """A start between two recordings is right if the stated range overlaps theirs; None where none is asked for."""
    if cause["start_between"] is None:
        return None
    if not entry.get("from"):
        return False
    first, last = (date.fromisoformat(str(entry.get(key) or entry["from"])[:10]) for key in ("from", "to"))
    low, high = (date.fromisoformat(text) for text in cause["start_between"])
    return first <= high and last >= low


def _words(entry: Entry) -> str:
    where = f" {entry['where']}" if entry.get("where") is not None else ""
    left_open = " or ".join(f"{other['owner']} {other['kind']}" for other in entry.get("instead", []))
    said = f"{entry['owner']} {entry['kind']}{where}" + (f" or {left_open}" if left_open else "")
    return f"{said} ({entry['probability']:.2f})" if "probability" in entry else said


def _share(hits: int, total: int) -> str:
    if not total:
        return "-"
    low, high = wilson_interval(hits, total)
    return f"{hits}/{total} = {100 * hits / total:.1f} % ({100 * low:.0f} to {100 * high:.0f} %)"


def _count(values: Iterable[bool | None]) -> str:
    """Share of those that are asked for."""
    asked = [value for value in values if value is not None]
    return _share(sum(asked), len(asked))


def summary(result: Result) -> dict[str, Any]:
    """The figures of the bars: counts as ``[hits, total]``."""
    decided = [verdict for verdict in result.verdicts if verdict.cause["determined"]]
    pairs = [verdict for verdict in decided if verdict.settled is not None]
    unsettled = [verdict for verdict in result.verdicts if not verdict.cause["determined"]]
    return {
        "attributed": [sum(verdict.attributed for verdict in decided), len(decided)],
        "false_discoveries": [len(result.false), result.named],
        "pairs_settled": [sum(bool(verdict.settled) for verdict in pairs), len(pairs)],
        "left_open": [sum(bool(verdict.settled) for verdict in unsettled), len(unsettled)],
        "overclaimed": [sum(verdict.overclaimed for verdict in unsettled), len(unsettled)],
        "brier": sum((p - right) ** 2 for p, right in result.stated) / max(len(result.stated), 1),
    }


def text(result: Result) -> str:
    """Misses first, then the figures, by kind and size, and the probabilities against what came true."""
    return "\n".join([*_misses(result), *_figures(result), *_by_kind(result), *_calibration(result)])


def _misses(result: Result) -> list[str]:
    lines = [f"{what}: {_told(verdict)}" for verdict in result.verdicts if (what := _what_is_wrong(verdict))]
    lines += [f"false discovery: {_words(entry)}, size {entry.get('size')}" for entry in result.false]
    return [*(lines or ["no misses"]), ""]


def _what_is_wrong(verdict: Verdict) -> str:
    """In words; empty where nothing is."""
    if not verdict.cause["determined"]:
        return "overclaimed" if verdict.overclaimed else "" if verdict.settled else "not left open"
    if not verdict.attributed:
        return "missed"
    return "pair not settled" if verdict.settled is False else ""


def _told(verdict: Verdict) -> str:
    """The cause, and what the answer says about it."""
    cause, said = verdict.cause, "; ".join(verdict.said) or "nothing"
    return f"{_words(cause)}, {cause['size']:.3g} {cause['unit']}, strength {cause['strength']:g}; said: {said}"


def _figures(result: Result) -> list[str]:
    figures = summary(result)
    decided = [verdict for verdict in result.verdicts if verdict.cause["determined"]]
    return [
        f"attributed to the right owner   {_share(*figures['attributed'])}",
        f"  of these the kind right       {_count(v.kind_right for v in decided if v.attributed)}",
        f"  size within its uncertainty   {_count(v.size_right for v in decided)}",
        f"  start between its recordings  {_count(v.date_right for v in decided)}",
        f"false discoveries of what is named {_share(*figures['false_discoveries'])}",
        f"confounded pairs settled right  {_share(*figures['pairs_settled'])}",
        f"undetermined pairs left open    {_share(*figures['left_open'])}",
        f"  overclaimed                   {_share(*figures['overclaimed'])}",
        "",
    ]


def _by_kind(result: Result) -> list[str]:
    classes: dict[tuple[str, str, float], list[Verdict]] = {}
    for v in result.verdicts:
        if v.cause["determined"]:
            classes.setdefault((v.cause["owner_kind"], v.cause["kind"], v.cause["strength"]), []).append(v)
    lines = [f"{'owner':8} {'kind':18} {'strength':>8}  attributed; kind right; pair settled"]
    for (owner, kind, strength), of in sorted(classes.items()):
        shares = [_count(v.attributed for v in of), _count(v.kind_right for v in of), _count(v.settled for v in of)]
        lines.append(f"{owner:8} {kind:18} {strength:8g}  {'; '.join(shares)}")
    return [*lines, ""]


def _calibration(result: Result) -> list[str]:
    lines = ["probability   stated on average, came true"]
    for low, high in pairwise(BINS):
        of = [(p, right) for p, right in result.stated if low <= p < high or (p == high == 1.0)]
        mean = f"{sum(p for p, _ in of) / len(of):.3f}" if of else "-"
        lines.append(f"{low:4.2f} to {high:4.2f}  {mean}, {_share(sum(right for _, right in of), len(of))}")
    return [*lines, f"Brier score {summary(result)['brier']:.4f}"]


def read_truth(fleet: Path) -> dict[str, Any]:
    """The sealed truth of a fleet's folder."""
    return dict(json.loads((fleet / "sealed" / "truth.json").read_text()))


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Score what an inference says of fleets.")
    parser.add_argument("files", nargs="+", type=Path, metavar="FLEET answer.json", help="folders and their answers")
    parser.add_argument("-o", "--output", type=Path, help="the figures as JSON")
    options = parser.parse_args(argv)
    if len(options.files) % 2:
        parser.error(f"{len(options.files)} paths, expected FLEET answer.json in pairs")
    total = Result()
    for fleet, answer in zip(options.files[::2], options.files[1::2], strict=True):
        total.add(score(read_truth(fleet), read_answer(answer)))
    print(text(total))
    if options.output:
        options.output.write_text(json.dumps(summary(total), indent=1))


if __name__ == "__main__":
    main()
