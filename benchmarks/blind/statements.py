"""Reliability: of all that a diagnosis says with a probability, how much is true.

A statement is a part of the JSON file that has a probability: an effect with its set, a kind with its choices alone,
that nothing is there, a form over a covariate. Each is judged by the truth of its case, then counted by what was said.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from benchmarks.blind.scatter import CORRELATED
from benchmarks.blind.score import (
    IN_ORDER,
    effects_of,
    is_true_name,
    names_a_cause,
    wilson_interval,
)
from benchmarks.blind.spelling import covariate, is_number, key_of

BINS: tuple[tuple[float, float, float | None], ...] = (
    (0.5, 0.8, None),
    (0.8, 0.95, 0.80),
    (0.95, 0.99, 0.93),
    (0.99, 1.0, 0.98),
)
"""From, below (the last one: up to), and the share that must be true."""
GROUPS = {
    "recordings": ("single", "pair", "triple", "confounded", "outsider", "null"),
    "scatters": ("scatter-null", "scatter-single", "scatter-pair"),
    "ways": ("way-null", "way-single", "way-pair", "way-outside"),
    "further": ("probe", "probe-null", "chain", "chain-null", "temperature", "temperature-null", "volume", "several"),
}
Statement = dict[str, Any]


def statements(truth: Mapping[str, Any], diagnosis: Any) -> list[Statement]:
    """All statements of one diagnosis: ``what`` they are about, their ``probability``, whether they are ``true``."""
    if not isinstance(diagnosis, Mapping):
        return []
    found = (judged for judge in (_sets, _names, _adequate, _forms) for judged in judge(truth, diagnosis))
    return [
        {"what": what, "probability": float(probability), "true": bool(true)}
        for what, probability, true in found
        if is_number(probability)
    ]


Judged = tuple[str, Any, bool]


def _odds(diagnosis: Mapping[str, Any]) -> Mapping[str, Any]:
    odds = diagnosis.get("probabilities")
    return odds if isinstance(odds, Mapping) else {}


def _said(diagnosis: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [item for item in _odds(diagnosis).get("statements") or [] if isinstance(item, Mapping)]


def _sets(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> Iterator[Judged]:
    """Listed effects: one of the names in the set is the cause, and the others may be mentioned."""
    for effect in effects_of(diagnosis):
        if effect.get("kind") not in truth["forgiven"]:
            yield "set", effect.get("probability"), is_true_name(truth, effect)


def _names(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> Iterator[Judged]:
    """Kinds with their choices: one that a listed effect tells with its set already is not counted again."""
    listed = {key_of(effect) for effect in effects_of(diagnosis)}
    for item in _said(diagnosis):
        if "kind" not in item or item["kind"] in truth["forgiven"]:
            continue
        if not item.get("includes_set"):
            yield "name", item.get("probability"), names_a_cause(truth, key_of(item))
        elif key_of(item) not in listed:
            yield "set", item.get("probability"), is_true_name(truth, item)


def _adequate(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> Iterator[Judged]:
    yield "adequate", _odds(diagnosis).get("adequate"), not truth["causes"]


def _forms(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> Iterator[Judged]:
    """Forms over a covariate: some cause lives in it, or the scatter does. Each covariate counts once."""
    listed = [item for item in diagnosis.get("located") or [] if isinstance(item, Mapping)]
    right = set(truth["covariates"]) | (IN_ORDER if truth.get("scatter") in CORRELATED else set())
    told: set[str] = set()
    for item in [*listed, *(item for item in _said(diagnosis) if "kind" not in item and "covariate" in item)]:
        where, probability = covariate(item.get("covariate", "")), item.get("probability", item.get("p"))
        if where not in told and is_number(probability):
            told.add(where)
            yield "form", probability, where in right


def group_of(family: str) -> str:
    """The group of the bars to which a family belongs; empty for one that has none."""
    return next((group for group, families in GROUPS.items() if family in families), "")


def bin_of(probability: float) -> int | None:
    """The number of the bin; None below the first."""
    return next((k for k in reversed(range(len(BINS))) if probability >= BINS[k][0]), None)


def reliability(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the table: by group and bin, then for all, then for all by what the statement is about."""
    rows: list[dict[str, Any]] = []
    for group in (*GROUPS, "all"):
        part = [s for r in results if group in ("all", group_of(r["family"])) for s in r.get("statements") or []]
        rows += _rows(group, part)
    everything = [s for r in results if group_of(r["family"]) for s in r.get("statements") or []]
    for what in ("set", "name", "adequate", "form"):
        rows += _rows(f"all: {what}", [s for s in everything if s["what"] == what])
    return rows


def _rows(group: str, said: Iterable[Statement]) -> list[dict[str, Any]]:
    parts: list[list[Statement]] = [[] for _ in BINS]
    for statement in said:
        number = bin_of(statement["probability"])
        if number is not None:
            parts[number].append(statement)
    return [_row(group, number, part) for number, part in enumerate(parts) if part]


def _row(group: str, number: int, part: Sequence[Statement]) -> dict[str, Any]:
    true = sum(statement["true"] for statement in part)
    return {
        "group": group,
        "from": BINS[number][0],
        "to": BINS[number][1],
        "said": sum(statement["probability"] for statement in part) / len(part),
        "true": true,
        "of": len(part),
        "interval": wilson_interval(true, len(part)),
        "bar": BINS[number][2],
    }
