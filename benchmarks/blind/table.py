"""The results as tables: by class and size, by recipe, false alarms, coverage, confusion."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.blind.score import wilson_interval

Result = Mapping[str, Any]
BARS: dict[tuple[str, float], float] = {
    ("single", 1.0): 99.0,
    ("pair", 1.0): 95.0,
    ("confounded", 1.0): 98.0,
    ("outsider", 1.0): 95.0,
    ("single", 0.5): 95.0,
    ("pair", 0.5): 85.0,
    ("confounded", 0.5): 95.0,
    ("outsider", 0.5): 85.0,
    ("single", 0.3): 85.0,
}
"""Per cent right that is asked for, by family and size."""


def summarise(results: Sequence[Result]) -> dict[str, Any]:
    """All numbers of the tables, ready for JSON."""
    scored = [result for result in results if result["scored"]]
    nulls = [result for result in scored if result["family"] == "null"]
    alarms = sum(result["false_alarm"] for result in nulls)
    hits = [hit for result in scored for hit in result["intervals"]]
    ratios = [result["holdout_ratio"] for result in scored if result.get("holdout_ratio") is not None]
    seconds = [result["seconds"] for result in results if result.get("seconds") is not None]
    causes = [result for result in scored if result["family"] != "null"]
    return {
        "classes": [_row(group, *key) for key, group in _groups(causes, "family", "size")],
        "recipes": [_row(group, *key) for key, group in _groups(causes, "family", "name", "size")],
        "not_scored": len(results) - len(scored),
        "false_alarms": {"count": alarms, "of": len(nulls), "interval": wilson_interval(alarms, len(nulls))},
        "coverage": {"hits": sum(hits), "of": len(hits), "interval": wilson_interval(sum(hits), len(hits))},
        "holdout_ratio": _spread(ratios),
        "seconds": _spread(seconds),
        "confusion": {name: dict(count) for name, count in confusion(scored).items()},
    }


def _groups(results: Iterable[Result], *keys: str) -> list[tuple[tuple[Any, ...], list[Result]]]:
    groups: dict[tuple[Any, ...], list[Result]] = defaultdict(list)
    for result in results:
        groups[tuple(result[key] for key in keys)].append(result)
    return sorted(groups.items(), key=lambda item: (*item[0][:-1], -item[0][-1]))


def _row(group: Sequence[Result], *key: Any) -> dict[str, Any]:
    by_seed = [np.mean([result["right"] for result in part]) for _, part in _groups(group, "seed")]
    ratios = [result["holdout_ratio"] for result in group if result.get("holdout_ratio") is not None]
    hits = [hit for result in group for hit in result["intervals"]]
    seconds = [result["seconds"] for result in group if result.get("seconds") is not None]
    return {
        "family": key[0],
        "name": key[1] if len(key) == 3 else "",
        "size": key[-1],
        "cases": len(group),
        "right_pct": 100.0 * float(np.mean([result["right"] for result in group])),
        "worst_seed_pct": 100.0 * float(min(by_seed)),
        "bar_pct": BARS.get((key[0], key[-1])) if len(key) == 2 else None,
        "covered": [sum(hits), len(hits)],
        "holdout_ratio": float(np.mean(ratios)) if ratios else None,
        "seconds": float(np.median(seconds)) if seconds else None,
    }


def _spread(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {"median": float(np.median(values)), "p95": float(np.quantile(values, 0.95)), "max": float(max(values))}


def confusion(results: Iterable[Result]) -> dict[str, Counter[str]]:
    """How often each recipe got each answer (all sizes together)."""
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results:
        table[f"{result['family']}:{result['name']}"][result["answer"]] += 1
    return dict(sorted(table.items()))


def text(summary: Mapping[str, Any], *, recipes: bool = True) -> str:
    """The tables for a terminal."""
    lines = [line("class", "size", "cases", "right %", "worst", "bar", "cover", "held-out", "s/case")]
    lines += [_row_line(row, row["family"]) for row in summary["classes"]]
    if recipes:
        lines += ["", *_recipe_lines(summary["recipes"])]
    lines += ["", _share_line("false alarms on null recordings", summary["false_alarms"], "count")]
    lines += [_share_line("95 % intervals that hold the truth", summary["coverage"], "hits")]
    if summary["holdout_ratio"]:
        spread = summary["holdout_ratio"]
        lines.append(
            f"held-out rms over noise where named: median {spread['median']:.3f}, 95 % below {spread['p95']:.3f}"
        )
    if summary["seconds"]:
        spread = summary["seconds"]
        lines.append(f"seconds per case: median {spread['median']:.2f}, longest {spread['max']:.2f}")
    lines.append(f"not scored (outsiders nobody can tell from a known effect): {summary['not_scored']}")
    lines += ["", "answers given (all sizes)"]
    for name, answers in summary["confusion"].items():
        total = sum(answers.values())
        common = sorted(answers.items(), key=lambda item: -item[1])[:5]
        lines.append(f"  {name:42} " + ", ".join(f"{answer} {100 * n / total:.0f} %" for answer, n in common))
    return "\n".join(lines)


def _recipe_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line per recipe: per cent right, mean over the seeds, at every size."""
    sizes = sorted({row["size"] for row in rows}, reverse=True)
    right = {(row["family"], row["name"], row["size"]): row["right_pct"] for row in rows}
    lines = [line("right %, by size", *(f"{size:g}" for size in sizes))]
    for family, name in dict.fromkeys((row["family"], row["name"]) for row in rows):
        shares = [right.get((family, name, size)) for size in sizes]
        lines.append(line(f"{family}:{name}", *("-" if share is None else f"{share:.0f}" for share in shares)))
    return lines


def _share_line(what: str, share: Mapping[str, Any], key: str) -> str:
    return share_text(what, share[key], share["of"], share["interval"])


def share_text(what: str, count: int, total: int, interval: tuple[float, float]) -> str:
    """A share in words: counts, per cent, and the ends of its interval (0 to 1) in per cent."""
    low, high = interval
    percent = f"{100 * count / total:.1f} %" if total else "-"
    return f"{what}: {count} of {total} = {percent} (95 % interval {100 * low:.1f} to {100 * high:.1f} %)"


def _row_line(row: Mapping[str, Any], name: str) -> str:
    hits, total = row["covered"]
    return line(
        name,
        f"{row['size']:g}",
        str(row["cases"]),
        f"{row['right_pct']:.1f}",
        f"{row['worst_seed_pct']:.0f}",
        f"{row['bar_pct']:.0f}" if row["bar_pct"] is not None else "",
        f"{100 * hits / total:.0f}" if total else "",
        f"{row['holdout_ratio']:.3f}" if row["holdout_ratio"] is not None else "",
        f"{row['seconds']:.2f}" if row["seconds"] is not None else "",
    )


def line(name: str, *cells: str) -> str:
    """A name and its cells, in columns."""
    return f"{name:44}" + "".join(f"{cell:>9}" for cell in cells)
