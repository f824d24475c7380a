"""The results as tables: by class and size, by recipe, scatter and way, false alarms, reliability, confusion."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.blind.score import wilson_interval
from benchmarks.blind.statements import GROUPS, reliability

Result = Mapping[str, Any]
BARS: dict[tuple[str, float], float] = {
    ("single", 1.0): 99.0,
    ("single", 0.5): 97.0,
    ("single", 0.3): 88.0,
    ("single", 0.2): 70.0,
    ("pair", 1.0): 98.0,
    ("pair", 0.5): 92.0,
    ("pair", 0.3): 75.0,
    ("triple", 1.0): 90.0,
    ("triple", 0.5): 75.0,
    ("outsider", 1.0): 98.0,
    ("outsider", 0.5): 92.0,
    ("outsider", 0.3): 65.0,
    ("confounded", 1.0): 98.0,
    ("confounded", 0.5): 96.0,
}
"""Per cent right that is asked for, by family and size."""
NULLS = ("null", "scatter-null", "way-null", "probe-null", "chain-null", "temperature-null")
FURTHER = ("probe", "chain", "temperature", "volume", "several")
FURTHER_BARS = {1.0: 97.0, 0.5: 90.0}
"""Per cent asked for of tripods, of rotations and squarenesses, and of laws of temperature, by size."""
BARRED = ("tripod", "rotation", "squareness", "thermal")
"""What the names of those recipes begin with."""


def summarise(results: Sequence[Result]) -> dict[str, Any]:
    """All numbers of the tables, ready for JSON."""
    scored = [result for result in results if result["scored"]]
    nulls = [result for result in scored if result["family"] == "null"]
    alarms = sum(result["false_alarm"] for result in nulls)
    ratios = [result["holdout_ratio"] for result in scored if result.get("holdout_ratio") is not None]
    seconds = [result["seconds"] for result in results if result.get("seconds") is not None]
    causes = [result for result in scored if result["family"] not in NULLS]
    return {
        "classes": [_row(group, *key) for key, group in _groups(causes, "family", "size")],
        "recipes": [_row(group, *key) for key, group in _groups(causes, "family", "name", "size")],
        "scatters": _not_ideal(scored, "scatter-"),
        "ways": _not_ideal(scored, "way-"),
        "further": _further(scored),
        "reliability": reliability(scored),
        "not_scored": len(results) - len(scored),
        "false_alarms": {"count": alarms, "of": len(nulls), "interval": wilson_interval(alarms, len(nulls))},
        "null_bound": _mean([result["bound"] for result in nulls]),
        "coverage": _coverage(scored),
        "coverage_beside_a_set": _coverage(result for result in scored if result.get("beside_a_set")),
        "coverage_of": {group: _coverage(r for r in scored if r["family"] in names) for group, names in GROUPS.items()},
        "holdout_ratio": _spread(ratios),
        "seconds": _spread(seconds),
        "confusion": {name: dict(count) for name, count in confusion(scored).items()},
    }


def _coverage(results: Iterable[Result]) -> dict[str, Any]:
    """How many of the 95 % intervals hold the truth."""
    hits = [hit for result in results for hit in result["intervals"]]
    return {"hits": sum(hits), "of": len(hits), "interval": wilson_interval(sum(hits), len(hits))}


def _not_ideal(results: Iterable[Result], prefix: str) -> list[dict[str, Any]]:
    """A row for every scatter (or way) and what was concealed under it, then one for all together at size 1 or less."""
    mine = [
        {**result, "under": result["name"].partition(":")[0], "what": result["family"].removeprefix(prefix)}
        for result in results
        if result["family"].startswith(prefix)
    ]
    rows = [_fair_row(group, *key) for key, group in _groups(mine, "under", "what", "size")]
    nulls = [result for result in mine if result["what"] == "null"]
    causes = [result for result in mine if result["what"] != "null" and result["size"] <= 1.0]
    together = (("null", nulls), ("causes", causes))
    return rows + [_fair_row(group, "all", what, 1.0) for what, group in together if group]


def _fair_row(group: Sequence[Result], under: str, what: str, size: float) -> dict[str, Any]:
    right, honest = (sum(result[key] for result in group) for key in ("right", "honest"))
    sure, alarms = (sum(bool(result[key]) for result in group) for key in ("wrong_and_sure", "false_alarm"))
    return {
        "under": under,
        "what": what,
        "size": size,
        "cases": len(group),
        "right": right,
        "honest": honest,
        "honest_interval": wilson_interval(honest, len(group)),
        "false_alarms": alarms if what == "null" else None,
        "false_alarm_interval": wilson_interval(alarms, len(group)) if what == "null" else None,
        "wrong_and_sure": sure,
        "condemned": sum(result["good_rows_condemned"] for result in group),
        "rows": sum(result["rows"] for result in group),
        "bound": _mean([result["bound"] for result in group]),
    }


def _further(results: Iterable[Result]) -> list[dict[str, Any]]:
    """A row for every recipe of the probe, chain and temperature families and size, one for the nulls of each family.

    The interval and the bar are about names with the phase or lag that belongs to them; of a tripod below size 1
    about the name.
    """
    mine = [result for result in results if result["family"].partition("-")[0] in FURTHER]
    rows = []
    for (family, name, size), group in _groups(mine, "family", "name", "size"):
        barred = name.startswith(BARRED) and family not in NULLS
        asked = sum(result["right" if name.startswith("tripod") and size < 1.0 else "found"] for result in group)
        rows.append(
            {
                "family": family,
                "name": name,
                "size": size,
                "cases": len(group),
                "right": sum(result["right"] for result in group),
                "found": sum(result["found"] for result in group),
                "interval": wilson_interval(asked, len(group)) if family not in NULLS else None,
                "bar_pct": FURTHER_BARS.get(size) if barred else None,
                "false_alarms": sum(result["false_alarm"] for result in group) if family in NULLS else None,
                "wrong_and_sure": sum(bool(result["wrong_and_sure"]) for result in group),
                "bound": _mean([result["bound"] for result in group]),
            }
        )
    return rows


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


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
    right, ideal = sum(result["right"] for result in group), _mean([result.get("bound") for result in group])
    return {
        "family": key[0],
        "name": key[1] if len(key) == 3 else "",
        "size": key[-1],
        "cases": len(group),
        "right_pct": 100.0 * right / len(group),
        "interval": wilson_interval(right, len(group)),
        "honest_pct": 100.0 * float(np.mean([result["honest"] for result in group])),
        "bound_pct": 100.0 * ideal if ideal is not None else None,
        "of_bound": right / len(group) / ideal if ideal else None,
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
    lines = [line("class", *CLASS_COLUMNS)] + [_row_line(row, row["family"]) for row in summary["classes"]]
    if recipes:
        lines += ["", *_recipe_lines(summary["recipes"])]
    for words, key in (("scatter that is not ideal", "scatters"), ("way that is not ideal", "ways")):
        if summary[key]:
            lines += ["", line(words, *FAIR_COLUMNS), *(_fair_line(row) for row in summary[key])]
    if summary["further"]:
        lines += ["", line("further kinds", *FURTHER_COLUMNS), *(_further_line(row) for row in summary["further"])]
    lines += ["", *_reliability_lines(summary["reliability"])]
    lines += ["", _share_line("false alarms on null recordings", summary["false_alarms"], "count")]
    lines += [_share_line("95 % intervals that hold the truth", summary["coverage"], "hits")]
    lines += [_share_line("  where a partner stands in a set", summary["coverage_beside_a_set"], "hits")]
    lines += [_share_line(f"  {group}", part, "hits") for group, part in summary["coverage_of"].items()]
    lines += _spread_lines(summary)
    lines += ["", "answers given (all sizes)"]
    for name, answers in summary["confusion"].items():
        total = sum(answers.values())
        common = sorted(answers.items(), key=lambda item: -item[1])[:5]
        lines.append(f"  {name:42} " + ", ".join(f"{answer} {100 * n / total:.0f} %" for answer, n in common))
    return "\n".join(lines)


def _spread_lines(summary: Mapping[str, Any]) -> list[str]:
    lines = []
    if spread := summary["holdout_ratio"]:
        low, high = spread["median"], spread["p95"]
        lines.append(f"held-out rms over noise where named: median {low:.3f}, 95 % below {high:.3f}")
    if spread := summary["seconds"]:
        lines.append(f"seconds per case: median {spread['median']:.2f}, longest {spread['max']:.2f}")
    return [*lines, f"not scored (outsiders nobody can tell from a known effect): {summary['not_scored']}"]


def _fair_line(row: Mapping[str, Any]) -> str:
    low, high = row["false_alarm_interval"] or row["honest_interval"]
    return line(
        f"{row['under']}, {row['what']}" + (f", size {row['size']:g}" if row["what"] != "null" else ""),
        str(row["cases"]),
        _percent(row["right"], row["cases"]),
        _percent(row["honest"], row["cases"]),
        "" if row["false_alarms"] is None else _percent(row["false_alarms"], row["cases"]),
        f"{100 * low:.0f}-{100 * high:.0f}",
        _percent(row["wrong_and_sure"], row["cases"]),
        f"{100 * row['condemned'] / row['rows']:.2f}",
        "" if row["bound"] is None else f"{100 * row['bound']:.1f}",
    )


def _further_line(row: Mapping[str, Any]) -> str:
    null = row["interval"] is None
    return line(
        f"{row['family']}:{row['name']}" + ("" if null else f", size {row['size']:g}"),
        str(row["cases"]),
        _percent(row["right"], row["cases"]),
        "" if null else _percent(row["found"], row["cases"]),
        "" if null else "{:.0f}-{:.0f}".format(*(100.0 * end for end in row["interval"])),
        _bar(row["bar_pct"]),
        _percent(row["false_alarms"], row["cases"]) if null else "",
        _percent(row["wrong_and_sure"], row["cases"]),
        "" if row["bound"] is None else f"{100 * row['bound']:.1f}",
    )


CLASS_COLUMNS = ("size", "cases", "right %", "95 %", "bar", "bound", "of bound", "worst", "cover", "held-out", "s/case")
FURTHER_COLUMNS = ("cases", "right %", "found %", "95 %", "bar", "alarms %", "sure %", "bound")
"""Found: right, with the phase or lag of the name. The interval is that of the share that the bar is about."""
FAIR_COLUMNS = ("cases", "right %", "honest %", "alarms %", "95 %", "sure %", "rows %", "bound")
"""Honest: right or honestly unknown. The interval is that of the alarms, else of the honest. Sure: a wrong name told
with more than 0.9. Rows: good readings called outliers."""


def _percent(count: int, total: int) -> str:
    return f"{100 * count / total:.1f}" if total else ""


def _reliability_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Of what was said with a probability, the share that is true."""
    lines = [line("statements", "said", "mean", "of", "true %", "95 %", "bar")] if rows else []
    for row in rows:
        low, high = row["interval"]
        cells = (
            f"{row['from']:g}-{row['to']:g}",
            f"{row['said']:.3f}",
            str(row["of"]),
            _percent(row["true"], row["of"]),
        )
        lines.append(line(row["group"], *cells, f"{100 * low:.0f}-{100 * high:.0f}", _bar(row["bar"], 100.0)))
    return lines


def _bar(value: float | None, times: float = 1.0) -> str:
    return "" if value is None else f"{times * value:.0f}"


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
    low, high = row["interval"]
    return line(
        name,
        f"{row['size']:g}",
        str(row["cases"]),
        f"{row['right_pct']:.1f}",
        f"{100 * low:.0f}-{100 * high:.0f}",
        _bar(row["bar_pct"]),
        f"{row['bound_pct']:.1f}" if row["bound_pct"] is not None else "",
        f"{row['of_bound']:.3f}" if row["of_bound"] is not None else "",
        f"{row['worst_seed_pct']:.0f}",
        f"{100 * hits / total:.0f}" if total else "",
        f"{row['holdout_ratio']:.3f}" if row["holdout_ratio"] is not None else "",
        f"{row['seconds']:.2f}" if row["seconds"] is not None else "",
    )


def line(name: str, *cells: str) -> str:
    """A name and its cells, in columns."""
    return f"{name:44}" + "".join(f"{cell:>9}" for cell in cells)
