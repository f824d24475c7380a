"""The page of a diagnosis of a recording of a gauge: what differs from that of an axis or a probe's map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.limits import limits, predictions
from stepgauge.diagnosis.wording.notation import (
    MOST_NUMBERS,
    odds_text,
    plus_minus,
    probability_of,
    significant,
    symbol,
    told_numbers,
    um,
)
from stepgauge.files.resources import called
from stepgauge.reports.blocks import Block, bullets, heading, table, words
from stepgauge.reports.diagnosis_blocks import (
    check_blocks,
    located_row,
    odds_blocks,
    recording_files,
    set_table,
    trail_blocks,
)

Said = Mapping[str, Any]
MOST_REPLACED = 5
"""Combinations that may replace a finding, in the appendix; the file has all."""


def title(said: Said) -> str:
    """The title of the page."""
    inputs = said["inputs"]
    return f"Diagnosis: {inputs['machine']['name']} with {inputs['gauge']['name']}"


def captions(said: Said) -> dict[str, str]:
    """What stands below each figure."""
    after = " and without the structure" if "rest_rms_um" in said["fit"] else ""
    noise = f"noise of a probing: {um(said['noise']['sigma_um'])}"
    return {
        "overview": f"Residuals before and after{after}; {noise}",
        "residuals": f"Residuals before and after{after}, against what they may depend on",
        "effects": "Every effect and every form with the fitted curve drawn through the data",
    }


def evidence(said: Said, drawn: Sequence[Block], language: str) -> Iterator[Block]:
    """What was measured, and what speaks for the statements."""
    yield from _measured(said)
    yield from drawn
    yield from odds_blocks(said)
    yield from check_blocks(said)
    yield from _located(said, language)
    yield heading("Before and after")
    yield _fit(said)


def _measured(said: Said) -> Iterator[Block]:
    measured, gauge, noise = said["measured"], said["inputs"]["gauge"], said["noise"]
    duration, effects = measured["duration_s"], said["inputs"]["machine"]["effects"]
    within = "" if duration is None else f", within {significant(duration / 60)} min"
    known = "no effects in it"
    if effects:
        known = f"the effects it already has ({', '.join(name_of(kind) for kind in effects)})"
    yield heading("What was measured")
    yield words(
        f"{measured['probings']} probings of {measured['faces']} faces over"
        f" {significant(measured['length_mm'], 4)} mm of"
        f" {gauge['name']} (serial {gauge['serial']}, certificate {gauge['certificate']}){within}. The"
        f" simulation is that"
        f" of the machine file, with {known}. Residuals are recorded minus simulated along the approach: positive means"
        " that the probe triggered later than simulated. The position of the gauge is fitted and is never a finding."
    )
    yield table(
        ("placement", "gauge axis (x, y, z)", "blocks", "cycles", "probings"),
        [_placed(p) for p in measured["placements"]],
    )
    u = "" if noise["u_um"] is None else f", standard uncertainty {significant(noise['u_um'], 2)} um"
    beside = "" if noise["from_repeats"] else " beside the model, for there are no repeats"
    yield words(
        f"A single probing repeats to {um(noise['sigma_um'])} (one standard deviation{u}), with"
        f" {noise['dof']} degrees of"
        f" freedom{beside}; the machine file says {um(noise['machine_file_um'])}."
    )


def _placed(p: Said) -> list[object]:
    axis = ", ".join(f"{v:.4f}" for v in p["axis"])
    return [p["placement"], f"({axis})", f"{p['first_block']} to {p['last_block']}", p["cycles"], p["probings"]]


def _located(said: Said, language: str) -> Iterator[Block]:
    yield heading("Where the residuals are systematic")
    if not said["located"]:
        yield words("Nowhere: no dependence on any covariate is more probable than scatter.")
        return
    yield table(
        ("covariate", "faces", "form", "share of the structure", "probability"),
        [located_row(one, said, language, one["side"]) for one in said["located"]],
        (0.0, 0.0, 1.0, 0.0, 0.0),
        note="These are the forms of the residuals before any effect is named.",
    )


def _fit(said: Said) -> Block:
    fit = said["fit"]
    rows = [["rms of the residuals", um(fit["rms_before_um"]), um(fit["rms_after_um"])]]
    for by, pair in fit["holdout"].items():
        rows.append([f"rms of predictions, {by} held out", um(pair["rms_before_um"]), um(pair["rms_after_um"])])
    chi2 = [significant(fit["chi2_dof_before"]), significant(fit["chi2_dof_after"])]
    rows.append(["chi-square per degree of freedom", *chi2])
    left = f" Without the structure that is stated {um(fit.get('rest_rms_um'))} rms are left."
    return table(
        ("", "before", "after"),
        rows,
        (1.0, 0.0, 0.0),
        note=f"The noise of a probing is {um(fit['noise_um'])}. Residuals include the errors of the faces against their"
        f" certified positions, within the uncertainty of the certificate: chi-square allows for that, the"
        f" rms does not. {predictions(fit)}{left if 'rest_rms_um' in fit else ''}",
    )


def appendix(said: Said, language: str = "en") -> Iterator[Block]:
    """All numbers, the search, the limits, the files."""
    for number, effect in enumerate(said["effects"], 1):
        yield from _finding_in_full(number, effect, said, language)
    yield from trail_blocks(said, language)
    yield heading("Limits of this diagnosis")
    yield bullets([*limits(said, language), *said["remarks"]] or ["None beyond the uncertainties stated."])
    yield heading("Files")
    yield bullets(list(_files(said)))


def _finding_in_full(number: int, effect: Said, said: Said, language: str) -> Iterator[Block]:
    """All numbers of a finding and of its rivals."""
    yield heading(f"Finding {number}: {name_of(effect['label'])}")
    yield from set_table(effect, said, language)
    yield bullets(list(_facts(effect)))
    if "rows" in effect:
        rows = [[r["recording"], r["row"], r["cycle"], r["face"], um(r["off_um"])] for r in effect["rows"]]
        yield table(("recording", "row", "cycle", "face", "off by"), rows, (1.0, 0.0, 0.0, 0.0, 0.0))


def _facts(effect: Said) -> Iterator[str]:
    stated = {name: p for name, p in effect["parameters"].items() if "unit" in p}
    shown = stated if len(stated) <= MOST_NUMBERS else dict(told_numbers(effect))
    yield from (f"{symbol(name, p, 2)}= {plus_minus(p)}{' (k = 2)' if p.get('u') else ''}" for name, p in shown.items())
    if len(shown) < len(stated):
        yield f"{len(stated) - len(shown)} further values are not determined; they are in diagnosis.json"
    if effect["largest_um"]:
        yield (
            f"moves the readings of this recording by up to {um(effect['largest_um'])},"
            f" {um(effect['rms_um'])} rms along the"
            " approach"
        )
    yield probability_of(effect)
    alone = [*effect["confounded_with"], *effect["alternatives"]] if not effect["set"] else []
    if alone:
        yield f"not discriminated by this recording from {', '.join(name_of(label) for label in alone)}"
    yield from (_replaced(other) for other in effect["several"][:MOST_REPLACED])
    if effect["reason"]:
        yield f"why they are not discriminated: {effect['reason']}"


def _replaced(other: Said) -> str:
    laws, others = ([name_of(label) for label in other.get(key, ())] for key in ("labels", "others"))
    besides = f", and in that of {' and '.join(others)}" if others else ""
    return f"{' and '.join(laws)} may stand in its place{besides}: {odds_text(other['odds'])}"


def _files(said: Said) -> Iterator[str]:
    inputs = said["inputs"]
    yield from recording_files(said)
    gauge, machine = (called(inputs[name]["path"]) for name in ("gauge", "machine"))
    yield f"gauge {gauge}, machine {machine}; full checksums in diagnosis.json"
    yield "machine.diagnosed.toml: the machine file with what was found, ready for stepgauge simulate"
