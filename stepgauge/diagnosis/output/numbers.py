"""The numbers of a diagnosis as a table: values of findings and of their rivals, and the size of what has no law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from stepgauge.diagnosis.wording.findings import Subject, subject
from stepgauge.diagnosis.wording.notation import members_of, rms_of, single_readings
from stepgauge.effects import Effect, effect_kinds

NUMBERS = ["kind", "effect", "probability", "parameter", "value", "u", "unit", "bound", "rival_of", "meaning"]
"""Columns of the table of a diagnosis."""


def number_table(said: Mapping[str, Any]) -> pd.DataFrame:
    """One row per number of what a ``diagnosis.json`` states, with :data:`NUMBERS` as columns."""
    rows = [*_numbers(said["effects"], subject(said)), *_structure(said["unexplained"])]
    return pd.DataFrame(rows, columns=NUMBERS)


def _numbers(effects: Sequence[Mapping[str, Any]], at: Subject) -> Iterator[dict[str, Any]]:
    for effect in effects:
        for one in members_of(effect):
            share, of = one["conditional_probability"], effect["label"]
            p = effect["own_probability"] if share is None else share * effect["probability"]
            rival = {"rival_of": "" if one["label"] == of else of}
            head = {"kind": one["kind"], "effect": one["label"], "probability": p, **rival}
            declared = effect_kinds(every=True).get(one["kind"], Effect).parameters()
            meanings = {at.key(parameter.name): parameter.meaning for parameter in declared}
            numbers = {name: number for name, number in one["parameters"].items() if "unit" in number}
            for name, number in (single_readings(one) or numbers or {"": {"unit": ""}}).items():
                value, u = (np.nan if number.get(key) is None else number[key] for key in ("value", "u"))
                known = {"value": value, "u": u, "unit": number["unit"], "bound": number.get("bound", "")}
                known["meaning"] = meanings.get(name, "")
                yield {**head, "parameter": name, **known}


def _structure(forms: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """Structure without a law: where it is, its share of the systematic residuals, and its root mean square."""
    for form in forms:
        head = {"kind": "structure", "effect": form["where"], "probability": form["probability"]}
        for name, number in {"share": {"value": form["share"], "unit": ""}, **rms_of(form)}.items():
            yield {**head, "parameter": name, **number, "u": np.nan, "bound": "", "rival_of": "", "meaning": ""}
