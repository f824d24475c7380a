"""``machine.diagnosed.toml``: the original machine file, with the effects found appended."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.effects import Effect, make_effects
from stepgauge.effects.scatter import NoiseGrowth
from stepgauge.errors import InputError
from stepgauge.files.notation import rounded
from stepgauge.files.text import read_text

DIGITS = 9
"""Significant digits of a parameter: a frequency times an hour of seconds must still be a phase."""


def machine_text(diagnosis: GaugeDiagnosis, folder: str | Path) -> tuple[str, list[str]]:
    """Text of the machine file with the effects added, and those that could not be added.

    Parameters
    ----------
    diagnosis : the result; its machine must have come from a file
    folder : folder of the new file; paths in the machine file are made relative to it

    Raises
    ------
    InputError
        the machine file does not exist any more, or is not TOML
    """
    source = diagnosis.data.machine.path
    text = _moved(read_text(source), Path(source).parent, Path(folder))
    tables, remarks = [], []
    for heading, effect, estimates in _additions(diagnosis):
        table = _table(heading, effect, estimates)
        try:
            make_effects(tomllib.loads(table)["effect"], "machine.diagnosed.toml")
        except InputError as error:
            remarks.append(f"{effect.label} is not in machine.diagnosed.toml: {error}")
            table = "".join(f"# {line}\n" for line in [f"left out: {error}", *table.splitlines()])
        tables.append(table)
    return _joined(text, _heading(diagnosis, bool(tables)) + "\n".join(["", *tables])), remarks


def effect_table(effect: Effect) -> dict[str, Any]:
    """An effect as a machine file has it: plain numbers, words and lists, without keys that are not set."""
    values = {p.name: getattr(effect, p.name) for p in effect.parameters()}
    values["when"] = effect.when
    return {"kind": effect.kind, **toml_types(values)}


def _additions(diagnosis: GaugeDiagnosis) -> Iterable[tuple[str, Effect, Mapping[str, Estimate]]]:
    for finding in diagnosis.findings:
        for part in finding.effects:
            (size,) = (p.name for p in part.parameters() if p.role == "linear")
            heading = f"{part.label}, of {finding.label}, probability {finding.probability:.3f}"
            yield heading, part, {size: finding.parameters[part.label]}
        effect = finding.effect
        if finding.kind == "noise_growth":
            values: dict[str, Any] = {"start_s": 0.0, **finding.choices, "rate": finding.parameters["rate"].value}
            effect = NoiseGrowth.model_construct(**values)
        if effect is not None:
            yield f"{finding.label}, probability {finding.probability:.3f}", effect, finding.parameters


def _heading(diagnosis: GaugeDiagnosis, added: bool) -> str:
    lines = [
        f"Added by stepgauge diagnose, verdict {diagnosis.verdict!r}: values with standard uncertainties u.",
        f"A single probing was found to repeat to {diagnosis.noise.sigma_um:.3g} um (one sigma).",
    ]
    if not added:
        lines[0] = f"stepgauge diagnose, verdict {diagnosis.verdict!r}: nothing was added."
    outliers = [finding for finding in diagnosis.findings if finding.kind == "outliers"]
    if outliers:
        lines.append("Outliers are listed in diagnosis.json; they are no law and are not simulated.")
    return "".join(f"# {line}\n" for line in lines)


def _table(heading: str, effect: Effect, estimates: Mapping[str, Estimate]) -> str:
    lines = [f"# {heading}", "[[effect]]"]
    for name, value in effect_table(effect).items():
        known = estimates.get(name)
        u = "" if known is None or known.u is None else f"  # u = {rounded(known.u, 2)} {known.unit}".rstrip()
        lines.append(f"{name} = {_toml(value)}{u}")
    return "\n".join(lines) + "\n"


def toml_types(value: Any) -> Any:
    """Types that TOML has: without keys that are not set, floats to nine significant digits."""
    if isinstance(value, Mapping):
        return {name: toml_types(one) for name, one in value.items() if one is not None}
    if isinstance(value, tuple | list):
        return [toml_types(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def _toml(value: object) -> str:
    """A word, a number or a list of them in TOML."""
    import tomli_w

    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").strip()


def _moved(text: str, before: Path, after: Path) -> str:
    """The text with the paths of its files (a probe, maps) relative to another folder."""
    for name in _named_files(tomllib.loads(text)):
        if not Path(name).is_absolute() and (before / name).is_file():
            seen = Path(os.path.relpath(before.resolve() / name, after.resolve())).as_posix()
            text = text.replace(f'"{name}"', f'"{seen}"').replace(f"'{name}'", f"'{seen}'")
    return text


def _named_files(data: Mapping[str, Any]) -> set[str]:
    probe = data.get("probe", {})
    named = [probe.get("file"), probe.get("map"), *(effect.get("file") for effect in data.get("effect", []))]
    return {name for name in named if isinstance(name, str)}


def _joined(text: str, addition: str) -> str:
    """Both as one TOML file; a file with all effects in one inline array is written anew, without its comments."""
    whole = text.rstrip("\n") + "\n\n" + addition
    try:
        tomllib.loads(whole)
    except tomllib.TOMLDecodeError:
        import tomli_w

        data = tomllib.loads(text)
        data["effect"] = [*data.get("effect", []), *tomllib.loads(addition).get("effect", [])]
        return "# Written anew: effects in one line cannot be appended to.\n" + tomli_w.dumps(data)
    return whole
