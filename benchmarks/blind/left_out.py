"""Leave one out: each single cause goes to a tool that was told to forget its kind, and must come back unknown."""

from __future__ import annotations

import shlex
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from benchmarks.blind.score import DECIDABLE_CHI2, effects_of, score_case, wilson_interval
from benchmarks.blind.table import line, share_text

ALIKE: tuple[frozenset[str], ...] = (
    frozenset({"scale_error", "scale_temperature"}),
    frozenset({"gauge_temperature", "misalignment"}),
    frozenset({"angular_error", "roll"}),
    frozenset({"effective_radius", "lever_arm"}),
)
"""Kinds that are deleted together: in every recording made here one is the other by another name."""
KIND = "{kind}"
UNKNOWN, AND_NAMED, ASTRAY, ADEQUATE = "unknown", "+ named", "astray", "adequate"
"""Unknown with the right covariate and nothing named; with a name beside it; with other covariates; nothing found."""
NO_NAMES = ("insufficient", "no answer", "effects")
"""What may come back besides and is no name of a kind either."""
Result = Mapping[str, Any]


def deleted_kinds(truth: Mapping[str, Any]) -> tuple[str, ...]:
    """What the tool must forget: the kind of a single cause, then those that are the same by another name."""
    kind = truth["causes"][0]["kind"]
    alike = next((group for group in ALIKE if kind in group), frozenset({kind}))
    return (kind, *sorted(alike - {kind}))


def forgetful(tool: str, kinds: Iterable[str]) -> str:
    """The command template with every part that holds ``{kind}`` repeated, once for each kind."""
    parts = [[part.replace(KIND, kind) for kind in kinds] if KIND in part else [part] for part in shlex.split(tool)]
    return shlex.join(part for repeated in parts for part in repeated)


def as_left_out(truth: Mapping[str, Any]) -> dict[str, Any]:
    """The truth for a tool that has no name for the cause: what counts is how well the kinds it still has fit."""
    cause, gone = truth["causes"][0], deleted_kinds(truth)
    others = [[key, chi2] for key, chi2 in cause["leftover_chi2"].items() if key.partition(":")[0] not in gone]
    best = min(others, key=lambda item: item[1], default=None)
    return {**truth, "family": "left_out", "causes": [{**cause, "best_known": best}]}


def score_left_out(truth: Mapping[str, Any], diagnosis: Any) -> dict[str, Any]:
    """The score of a single cause as that of an outsider, what came back, and the kind that comes nearest."""
    judged = as_left_out(truth)
    result = score_case(judged, diagnosis)
    nearest = judged["causes"][0]["best_known"]
    return {
        **result,
        "deleted": list(deleted_kinds(truth)),
        "came_back": came_back(diagnosis, result),
        "named": named_kinds(diagnosis),
        "nearest": None if nearest is None else nearest[0].partition(":")[0],
    }


def named_kinds(diagnosis: Any) -> list[str]:
    """The kinds that are listed as effects."""
    return [str(effect.get("kind")) for effect in effects_of(diagnosis)] if isinstance(diagnosis, Mapping) else []


def came_back(diagnosis: Any, result: Result) -> str:
    """The column of the confusion matrix: one of the words above, else the kind that is listed first."""
    if result["answer"] in ("no answer", "insufficient"):
        return str(result["answer"])
    named = named_kinds(diagnosis)
    if diagnosis["verdict"] == "unknown":
        return (AND_NAMED if named else UNKNOWN) if result["right"] else ASTRAY
    return named[0] if named else str(diagnosis["verdict"])


def matrix(results: Iterable[Result]) -> list[dict[str, Any]]:
    """The confusion matrix: per size and deleted kind, how many came back as what, and how many are not scored."""
    groups: dict[tuple[float, tuple[str, ...]], list[Result]] = defaultdict(list)
    for result in results:
        groups[-result["size"], tuple(result["deleted"])].append(result)
    return [{"size": -size, "deleted": list(kinds), **_row(group)} for (size, kinds), group in sorted(groups.items())]


def _row(group: Sequence[Result]) -> dict[str, Any]:
    scored = [result for result in group if result["scored"]]
    unknown = [result for result in scored if result["came_back"] in (AND_NAMED, ASTRAY)]
    return {
        "scored": len(scored),
        "not_scored": len(group) - len(scored),
        "came_back": dict(Counter(result["came_back"] for result in scored)),
        "named_beside": dict(Counter(kind for result in unknown for kind in sorted(set(result["named"])))),
        "not_scored_fitted_by": dict(Counter(result["nearest"] for result in group if not result["scored"])),
    }


def matrix_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """The confusion matrix for a terminal, one block per size; kinds that came back are numbered below it."""
    seen = {word for row in rows for word in row["came_back"]}
    words = [UNKNOWN, AND_NAMED, ASTRAY, ADEQUATE, *(word for word in NO_NAMES if word in seen)]
    kinds = sorted(seen - set(words))
    numbers = [f"[{number}]" for number in range(1, len(kinds) + 1)]
    lines = []
    for size in dict.fromkeys(row["size"] for row in rows):
        part = [row for row in rows if row["size"] == size]
        lines += [line(f"deleted, size {size:g}", *words, *numbers, "scored", "share %", "not sc.")]
        lines += [_row_line(", ".join(row["deleted"]), [row], [*words, *kinds]) for row in part]
        lines += [_row_line("all", part, [*words, *kinds]), *_shares(part), *_details(part), ""]
    lines += [f"{number}: {kind} named" for number, kind in zip(numbers, kinds, strict=True)]
    lines += [f"{UNKNOWN}: with the right covariate, nothing named; {AND_NAMED}: the same, with a name beside it"]
    lines += [f"{ASTRAY}: unknown, with other covariates only; share: {UNKNOWN} and {AND_NAMED} of the scored"]
    return "\n".join(lines)


def _details(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """How many cases are not scored, because of which kinds, and what was named beside an unknown."""
    lines = [f"not scored, as a kind that is left fits (chi2 below {DECIDABLE_CHI2:g}): {_sum(rows, 'not_scored')}"]
    lines += _kinds_of_rows(rows, "not_scored_fitted_by")
    beside = _kinds_of_rows(rows, "named_beside")
    return [*lines, "named beside unknown:", *beside] if beside else lines


def _kinds_of_rows(rows: Sequence[Mapping[str, Any]], key: str) -> list[str]:
    """One line for each deleted kind: other kinds and how often."""
    lists = {row["deleted"][0]: ", ".join(f"{kind} {n}" for kind, n in sorted(row[key].items())) for row in rows}
    return [f"  {deleted}: {others}" for deleted, others in lists.items() if others]


def _row_line(name: str, rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> str:
    counts, scored = _counts(rows), _sum(rows, "scored")
    cells = [str(counts[column] or ".") for column in columns]
    share = f"{100 * (counts[UNKNOWN] + counts[AND_NAMED]) / scored:.0f}" if scored else ""
    return line(name, *cells, str(scored), share, str(_sum(rows, "not_scored") or "."))


def _shares(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Shares over all kinds with their intervals: as outsiders are scored, and with nothing named at all."""
    counts, scored = _counts(rows), _sum(rows, "scored")
    shares = {
        "unknown with the right covariate": counts[UNKNOWN] + counts[AND_NAMED],
        "the same, and nothing named": counts[UNKNOWN],
    }
    return [share_text(words, hits, scored, wilson_interval(hits, scored)) for words, hits in shares.items()]


def _counts(rows: Iterable[Mapping[str, Any]]) -> Counter[str]:
    return sum((Counter(row["came_back"]) for row in rows), Counter())


def _sum(rows: Iterable[Mapping[str, Any]], key: str) -> int:
    return sum(int(row[key]) for row in rows)
