"""The priors of a diagnosis: one table, with reasons, that a user may print and replace."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from stepgauge.effects import effect_kinds
from stepgauge.errors import InputError, naming
from stepgauge.files.config import TomlTable, check_table, read_toml
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.problem import AmplitudePrior

FILE = "priors.toml"
KIND = "kind"
"""Key of a machine file, and comment of a recording of an axis, that states its kind."""


class Decision(TomlTable):
    """Probabilities from which results are stated."""

    stated: float = Field(ge=0.5, lt=1.0)
    in_set: float = Field(gt=0.0, lt=0.5)
    excluded: float = Field(gt=1.0)
    determined: float = Field(gt=0.0)


class SizePriors(TomlTable):
    """Distribution of amplitudes: ``below``, ``above`` are factors from the usual size that make one e times rarer."""

    below: float = Field(gt=1.0)
    above: float = Field(gt=1.0)
    shortest_mm: float = Field(ge=0.0)
    repeatability_um: float = Field(gt=0.0)
    certificate_um: float = Field(gt=0.0)
    steps: list[float] = Field(min_length=1)

    def about(self, usual: float, most: float = np.inf, least: float = 0.0) -> AmplitudePrior:
        """The mixture about a usual size, without standard deviations below ``least`` and above ``most``."""
        steps = np.array([step for step in self.steps if least <= usual * step <= most] or self.steps[:1])
        weight = -np.abs(np.log(steps)) / np.log(np.where(steps > 1.0, self.above, self.below))
        return AmplitudePrior(usual * steps, weight - np.logaddexp.reduce(weight))


class FormPriors(TomlTable):
    """Forms: structure without a known law."""

    odds: float = Field(gt=0.0)
    lag: float = Field(gt=0.0)
    own_column: float = Field(gt=0.0)
    product: float = Field(gt=0.0)
    wave: float = Field(gt=0.0)
    sizes: list[float] = Field(min_length=1)
    size_weights: list[float] = Field(min_length=1)
    lengths: list[float] = Field(min_length=1)
    lags: list[float] = Field(min_length=1)

    @model_validator(mode="after")
    def _paired(self) -> FormPriors:
        if len(self.sizes) != len(self.size_weights):
            raise ValueError("as many size_weights as sizes")
        return self

    def about(self, scale_um: float) -> AmplitudePrior:
        """The mixture over the stated repeatability."""
        return AmplitudePrior(
            np.array(self.sizes) * scale_um, np.log(np.array(self.size_weights) / sum(self.size_weights))
        )


class KindPrior(TomlTable):
    """Prior odds and usual size of one kind of law; ``basis``: what the size depends on; ``why``: its reason.

    ``most``: the largest standard deviation of its size that is physically possible; ``again``: odds that another axis
    has it where one has, without a value as if there was none; ``least``: the smallest size that occurs.
    """

    odds: float = Field(gt=0.0)
    usual: float = Field(gt=0.0)
    most: float = Field(np.inf, gt=0.0)
    least: float = Field(0.0, ge=0.0)
    again: float | None = Field(None, gt=0.0)
    basis: Literal["", "grade", "sag", "certificate", "stylus"] = ""
    unit: str = ""
    why: str = ""


class LawPriors(TomlTable):
    """All kinds of laws.

    ``part``: odds of one in a part of the record only, over one everywhere; ``corrected``: size of what follows a
    temperature for which the evaluation corrects, over that of what follows others, ``corrected_most``: its largest
    standard deviation; ``all_axes``: odds of one error of all axes, over one of any of them; ``discrepancy``: standard
    deviation of what laws of a process leave out, as a share of their size; ``leads``: share of the periods along an
    axis that are usual leads of screws (ISO 3408-2), of a machine that has screws.
    """

    odds: float = Field(gt=0.0)
    part: float = Field(0.01, gt=0.0)
    corrected: float = Field(0.2, gt=0.0)
    corrected_most: float = Field(12.0, gt=0.0)
    all_axes: float = Field(1.5, gt=0.0)
    discrepancy: float = Field(0.05, ge=0.0, lt=1.0)
    leads: float = Field(0.0, ge=0.0, lt=1.0)
    kinds: dict[str, KindPrior]

    def of(self, kind: str) -> KindPrior:
        """Those of one kind, as a file states them or as its effect declares them."""
        return self.kinds.get(kind) or declared_prior(kind)


def declared_prior(kind: str) -> KindPrior:
    """That of an effect's class; of one that declares none, of a common kind with a tenth of its sensible size."""
    effect = effect_kinds(every=True).get(kind)
    if effect is None:
        return KindPrior(odds=1.0, usual=1.0)
    linear = [p for p in effect.parameters() if p.role == "linear"]
    unit = linear[0].unit if linear else ""
    own = effect.prior
    if own is None:
        ends = next((p.sensible for p in linear if p.sensible is not None), (0.0, 10.0))
        return KindPrior(odds=1.0, usual=max(map(abs, ends)) / 10.0, unit=unit)
    stated = {name: value for name, value in asdict(own).items() if value != np.inf}
    return KindPrior.model_validate(stated | {"unit": own.unit or unit})


class MapPriors(TomlTable):
    """Further priors of probe maps and of their laws."""

    gauge_share: float = Field(gt=0.0, lt=0.1)
    slight: float = Field(ge=0.0, lt=0.1)
    laws: LawPriors


class MachineKind(TomlTable):
    """What is usual of one kind of machine, or of an axis that is recorded by itself.

    ``odds``: factors on the odds of effects, ``structure``: on those of structure without a law; ``usual``: sizes of
    effects in place of those of the table, all with the grade; ``leads``: see :class:`LawPriors`; ``motion``: that
    of its axes, empty for either; ``span`` (mm or deg), ``repeatability`` (um or arcsec), ``duration_s``: of a usual
    axis of this kind and its recording, by which the sizes of the table count; without them those measured.
    """

    odds: dict[str, float] = Field(default_factory=dict)
    structure: float = Field(1.0, gt=0.0)
    leads: float = Field(0.0, ge=0.0, lt=1.0)
    usual: dict[str, float] = Field(default_factory=dict)
    motion: Literal["", "linear", "rotary"] = ""
    span: float | None = Field(None, gt=0.0)
    repeatability: float | None = Field(None, gt=0.0)
    duration_s: float | None = Field(None, gt=0.0)
    why: str = ""

    def factor(self, law: str) -> float:
        """Factor on the odds of a law."""
        return self.odds.get(law, 1.0)


class Priors(TomlTable):
    """All values that are set by hand, see ``priors.toml``."""

    decision: Decision
    sizes: SizePriors
    scatter: NoisePriors
    forms: FormPriors
    laws: LawPriors
    kinds: dict[str, MachineKind]
    maps: MapPriors

    def adapt(self, names: Sequence[str]) -> Priors:
        """For a machine or an axis of one of these kinds, each as likely: odds are averages over them, sizes of one."""
        kinds = [self.kinds[name] for name in names]
        if not kinds:
            return self
        changed = {}
        for law in sorted({law for one in kinds for law in (*one.odds, *one.usual)}):
            own = self.laws.of(law)
            changed[law] = own.model_copy(
                update={"odds": own.odds * float(np.mean([one.factor(law) for one in kinds]))}
            )
            if len(kinds) == 1 and law in kinds[0].usual:
                changed[law] = changed[law].model_copy(update={"usual": kinds[0].usual[law], "basis": "grade"})
        leads = kinds[0].leads if len(kinds) == 1 else self.laws.leads
        laws = self.laws.model_copy(update={"kinds": {**self.laws.kinds, **changed}, "leads": leads})
        structure = self.forms.odds * float(np.mean([one.structure for one in kinds]))
        forms = self.forms.model_copy(update={"odds": structure})
        return self.model_copy(update={"laws": laws, "forms": forms})


def priors_text() -> str:
    """The shipped file with its reasons, and with the priors that effects declare."""
    text = (files("stepgauge.diagnosis") / FILE).read_text("utf-8")
    head = "[laws.kinds]\n"
    for kind in sorted((kind for kind, effect in effect_kinds().items() if effect.prior is not None), reverse=True):
        values = declared_prior(kind).model_dump(exclude_defaults=True)  # as an inline table of TOML
        line = ", ".join(f"{key} = {json.dumps(value)}" for key, value in values.items())
        text = text.replace(head, f"{head}{kind} = {{ {line} }}\n", 1)
    return text


@cache
def shipped_priors() -> Priors:
    """The priors of the shipped file."""
    return check_table(Priors, tomllib.loads(priors_text()), FILE)


def read_priors(path: str | Path) -> Priors:
    """The shipped priors, replaced by those of a file (:class:`InputError` for a file that is not valid)."""
    own, shipped = read_toml(path), shipped_priors()
    _check_kinds(path, own, ("laws", "kinds"), {*shipped.laws.kinds, *effect_kinds()})
    _check_kinds(path, own, ("maps", "laws", "kinds"), shipped.maps.laws.kinds)
    kinds = own.get("kinds")
    for name in kinds if isinstance(kinds, dict) else ():
        for part in ("odds", "usual"):
            _check_kinds(path, own, ("kinds", name, part), {*shipped.laws.kinds, *effect_kinds()})
    return check_table(Priors, _over(tomllib.loads(priors_text()), own), path)


def _check_kinds(path: str | Path, own: Any, keys: Sequence[str], known: Collection[str]) -> None:
    """Kinds of laws in a file must be known; values that are no tables are reported elsewhere."""
    for key in keys:
        own = own.get(key) if isinstance(own, dict) else None
    for kind in own if isinstance(own, dict) else ():
        if kind not in known:
            what = f"key {'.'.join(keys)}.{kind} is no kind of law"
            raise InputError(path, what, expected=nearest_name(kind, sorted(known)))


def nearest_name(name: str, known: Sequence[str]) -> str:
    """What was meant with a name that is none, else all that are known."""
    near = difflib.get_close_matches(name, known, 1)
    return f"{near[0]}?" if near else ", ".join(known)


def _over(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Nested tables with some keys replaced."""
    merged = dict(base)
    for key, value in own.items():
        old = base.get(key)
        merged[key] = _over(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return merged


def stated_kind(stated: str | None, comments: Mapping[str, str], priors: Priors, where: Any) -> str | None:
    """The kind that is stated, by the user before the file; None for none.

    :class:`InputError` at the argument, or at ``where``, for one that the priors do not know.
    """
    kind = (stated or comments.get(KIND) or "").strip()
    if kind and kind not in priors.kinds:
        expected = nearest_name(kind, [*priors.kinds])
        raise InputError(naming(KIND) if stated else where, "no kind of machine or axis", found=kind, expected=expected)
    return kind or None


def possible_kinds(kind: str | None, motion: str, priors: Priors) -> list[str]:
    """The stated kind, or all kinds of axes with a motion, ``linear`` or ``rotary``."""
    return [kind] if kind else [name for name, one in priors.kinds.items() if one.motion in ("", motion)]


def kind_probabilities(answer: Posterior, kinds: Sequence[str], priors: Priors) -> dict[str, float]:
    """Posterior probability of each kind, all as likely before; the most probable first.

    The marginal likelihood under the odds of a kind, over that under the average of all, is the mean of the ratio of
    both priors over the hypotheses. ``answer``: of a search with ``priors.adapt(kinds)``.
    """
    laws = sorted({one.kind for one in answer.search.problem.candidates if one.named})
    factor = np.array([[priors.kinds[name].factor(law) for law in laws] for name in kinds])
    mean = factor.mean(axis=0)
    base = np.array([priors.laws.odds * priors.laws.of(law).odds for law in laws])
    column = {law: i for i, law in enumerate(laws)}
    # what a prior gives to all hypotheses together is one
    log_whole = np.log1p(base * factor).sum(axis=1) - np.log1p(base * mean).sum()
    log_ratio = np.log(factor / mean)
    found = np.zeros(len(kinds))
    for weight, one in zip(answer.weights, answer.hypotheses, strict=True):
        own = [column[c.kind] for c in one.candidates if c.kind in column]
        found += weight * np.exp(log_ratio[:, own].sum(axis=1) - log_whole)
    probability = dict(zip(kinds, (found / found.sum()).tolist(), strict=True))
    return dict(sorted(probability.items(), key=lambda item: -item[1]))
