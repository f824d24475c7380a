"""A diagnosis in a line, of its objects or of the JSON that was written of it, and the numbers of its findings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from stepgauge.diagnosis.axis.words import kind_name
from stepgauge.diagnosis.forms.formula import UnknownLaw, rest_rms_um
from stepgauge.diagnosis.output.aliases import periods_of
from stepgauge.diagnosis.output.practice import counted
from stepgauge.diagnosis.output.report import in_place_of
from stepgauge.diagnosis.output.words import in_place, listed, name_of, significant
from stepgauge.diagnosis.result import NUMBERS, Diagnosis

Said = Mapping[str, Any]
IN_SUMMARY = 4
"""Aliases of a period that a line names; usual ones are first."""


def summary_line(found: Diagnosis, laws: Sequence[UnknownLaw] = ()) -> str:
    """Verdict, effects and fit; ``laws``: the empirical laws of the forms."""
    fit = found.fit
    names = [
        _name(f.label, in_place(f.confounded_with, [one.laws for one in f.several]), f.alternatives)
        for f in found.findings
    ]
    imitated = rest_rms_um(found, laws) if laws else None
    left = [one.where for one in found.unexplained]
    return _of_gauge(found.verdict, names, left, (fit.rms_before_um, fit.rms_after_um, fit.noise_um, imitated))


def stored_line(said: Said) -> str:
    """The same of ``diagnosis.json``, whether of a gauge, an axis or the map of a probe."""
    if "axis" in said:
        return axis_line(said)
    left = [one["where"] for one in said["unexplained"]]
    if "map" in said["inputs"]:
        return map_line(said["verdict"], [one["kind"] for one in said["effects"]], left, said["lacking"])
    fit = said["fit"]
    names = [_name(one["label"], in_place_of(one), one["alternatives"]) for one in said["effects"]]
    numbers = [float("nan") if fit[key] is None else fit[key] for key in ("rms_before_um", "rms_after_um", "noise_um")]
    imitated = fit.get("with_empirical", {}).get("rms_after_um")
    return _of_gauge(said["verdict"], names, left, (*numbers, imitated))


def axis_line(said: Said) -> str:
    """Verdict, effects and fit of an axis, in the user's unit."""
    unit, fit = said["axis"]["deviation_unit"], said["fit"]
    names = [name_at_axis(one, said["axis"]["form"]) for one in said["effects"]]
    before, after, noise = (significant(fit[f"{key}_{unit}"]) for key in ("rms_before", "rms_after", "noise"))
    numbers = f"rms {before} -> {after} {unit}, noise {noise} {unit}"
    step = said["axis"].get("even_step")
    if said["verdict"] == "adequate" and step:
        numbers += (
            f"; a period that divides the even steps of {significant(step)} {said['axis']['unit']} cannot be seen"
        )
    return _line(said["verdict"], [*names, *_without_law([one["where"] for one in said["unexplained"]])], numbers)


def map_line(verdict: str, kinds: Sequence[str], left: Sequence[str], lacking: Sequence[str]) -> str:
    """Verdict and changes of a probe, or what the map lacks."""
    return _line(verdict, [*kinds, *left] or ["; ".join(lacking)])


def name_at_axis(effect: Said, form: str) -> str:
    """An effect of an axis with the others that may be in its place."""
    others = [kind_name(kind, form) for kind in effect["confounded_with"]]
    name = f"{effect['name']}{_period_of(effect)}"
    return f"{name} (or {listed(others, 'or')})" if others else name


def _period_of(effect: Said) -> str:
    """The period of an effect with its aliases, where it has any: they are all that is known of it."""
    others, unit = periods_of(effect.get("aliases", {}))
    if not others:
        return ""
    own = next(one for name, one in effect["parameters"].items() if name.startswith("period"))
    told = ", ".join(significant(one) for one in others[:IN_SUMMARY])
    return f", period {significant(own['value'])} {unit} or an alias of it: {told} {unit} or shorter"


def numbers_of(said: Said) -> pd.DataFrame:
    """One row per number of an effect, as :meth:`Diagnosis.to_frame`; also those that its law fixes, without u."""
    return pd.DataFrame(list(_rows(said["effects"])), columns=NUMBERS)


def _rows(effects: Iterable[Said]) -> Iterable[dict[str, Any]]:
    for effect in effects:
        head = {"kind": effect["kind"], "effect": effect["label"], "probability": effect["probability"]}
        numbers = {name: one for name, one in effect["parameters"].items() if "unit" in one}
        for name, one in (numbers or {"": {"value": None, "u": None, "unit": ""}}).items():
            value, u = (float("nan") if one[key] is None else one[key] for key in ("value", "u"))
            yield {**head, "parameter": name, "value": value, "u": u, "unit": one["unit"]}


def _of_gauge(
    verdict: str, names: Sequence[str], left: Sequence[str], rms_um: tuple[float, float, float, float | None]
) -> str:
    before, after, noise, imitated = rms_um
    more = "" if imitated is None else f"{imitated:.2f} um with the form imitated, "
    numbers = f"rms {before:.2f} -> {after:.2f} um, {more}noise {noise:.2f} um"
    return _line(verdict, counted(names) + _without_law(left), numbers)


def _without_law(left: Sequence[str]) -> list[str]:
    return [f"without a law: {where}" for where in left[:1]]


def _line(verdict: str, said: Sequence[str], numbers: str = "") -> str:
    what = ", ".join(one for one in said if one)
    return verdict + (f": {what}" if what else "") + (f" ({numbers})" if numbers else "")


def _name(label: str, others: Sequence[str], alternatives: Sequence[str]) -> str:
    others = [*others, *map(name_of, alternatives)]
    return name_of(label) + (f" (or {', '.join(others)})" if others else "")
