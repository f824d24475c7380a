"""The story of the diagnosis of a probe's map: what is not as its probe file says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.wording.catalogue import say
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.limits import limits
from stepgauge.diagnosis.wording.notation import plus_minus, probability_of
from stepgauge.files.notation import significant
from stepgauge.reports.blocks import Block, bullets, heading, table, words
from stepgauge.reports.diagnosis_blocks import check_blocks, located_row, odds_blocks, trail_blocks

Said = Mapping[str, Any]
_CAPTIONS = {
    "residuals": "Residuals over azimuth and polar angle",
    "directions": "Residuals over the map",
    "effects": "Every effect with the fitted law through the residuals of the others",
}


def title(said: Said) -> str:
    """The title of the page."""
    probe = said["inputs"]["probe"]
    return f"Diagnosis: {probe['name'] or probe['path']} by its map"


def captions(said: Said) -> dict[str, str]:
    """What stands below each figure."""
    after = ", before and after" if said["effects"] or said["unexplained"] else ""
    return {name: text + (after if name != "effects" else "") for name, text in _CAPTIONS.items()}


def evidence(said: Said, drawn: Sequence[Block], language: str) -> Iterator[Block]:
    """What was measured, and what speaks for the statements."""
    yield from _measured(said)
    yield from drawn
    yield from odds_blocks(said)
    if not said["probabilities"]:
        yield words(_untried(said))
    yield from check_blocks(said)
    yield from _located(said, language)
    yield from _fit(said)


def _untried(said: Said) -> str:
    if said["verdict"] == "insufficient":
        return "Nothing was tried: what was measured is not enough to judge any change by."
    return "Nothing was tried: the probe file gives every value to its last digit."


def _measured(said: Said) -> Iterator[Block]:
    measured, noise = said["measured"], said["noise"]
    quantities = " and ".join(say(name) for name in measured["quantities"])
    yield heading("What was measured")
    yield words(
        f"{measured['probings']} rows in {measured['directions']} directions:"
        f" {_angles(measured['polar_deg'], 'polar angle')} and {_angles(measured['azimuth_deg'], 'azimuth')};"
        f" {quantities}. The simulation is that of the probe file (model {said['inputs']['probe']['model']}). Residuals"
        " are measured minus simulated. Angles are those of the contact normal in the probe's frame; the polar angle is"
        " counted from the stylus axis, 90 deg is a wall parallel to the stylus."
    )
    rows = [[say(name), _sigma(q), _digit(q)] for name, q in noise["quantities"].items()]
    columns = ("quantity", "standard deviation of one reading", "resolution of the file")
    yield table(columns, rows, (0.0, 1.0, 0.0), note=_repeatability(said))


def _angles(a: Said, name: str) -> str:
    if a["different"] == 1:
        return f"one {name} of {a['from']:g} deg"
    return f"{a['different']} {name}s of {a['from']:g} to {a['to']:g} deg"


def _sigma(q: Said) -> str:
    if q["sigma"] is None:
        return "not known"
    u = "" if q["u"] is None else f" ± {significant(q['u'], 2)} {q['unit']} (standard uncertainty)"
    return f"{significant(q['sigma'])} {q['unit']}{u}"


def _digit(q: Said) -> str:
    return "not seen" if q["printed_digit"] is None else f"{significant(q['printed_digit'], 1)} {q['unit']}"


def _repeatability(said: Said) -> str:
    noise = said["noise"]
    over = "constant over the map" if noise["scatter"] == "constant" else "proportional to the value"
    if noise["from_repeats"]:
        return f"From repeated directions ({noise['dof']} degrees of freedom), independent of any model; {over}."
    if said["verdict"] == "insufficient":
        return "Not known: no direction was repeated."
    return f"No direction was repeated; estimated from the residuals of the model beyond the rounding, {over}."


def _located(said: Said, language: str) -> Iterator[Block]:
    yield heading("Where the residuals are systematic")
    if not said["located"]:
        judged = said["verdict"] != "insufficient"
        yield words(
            "Nowhere: no dependence on the direction is more probable than scatter." if judged else "Not judged."
        )
        return
    yield table(
        ("covariate", "form", "share of the structure", "probability"),
        [located_row(one, said, language) for one in said["located"]],
        (0.0, 1.0, 0.0, 0.0),
        note="These are the forms of the residuals before any cause is named; for named causes it is the probability of"
        " the form alone.",
    )


def _fit(said: Said) -> Iterator[Block]:
    quantities = said["fit"]["quantities"]
    columns = ["quantity", "rms before", "rms after", "largest before", "largest after"]
    rows = []
    for name, q in quantities.items():
        cells = [f"{significant(q[key])} {q['unit']}" for key in ("rms_before", "rms_after")]
        cells += [f"{significant(q[f'worst_{when}_percent'])} %" for when in ("before", "after")]
        rows.append([say(name), *cells])
    yield heading("Before and after")
    yield table(columns, rows, [1.0] * len(columns), note=_fit_note(said))


def _fit_note(said: Said) -> str:
    fit = said["fit"]
    text = "Largest: the largest residual relative to its value."
    if fit["chi2_dof_before"] is not None:
        before, after = significant(fit["chi2_dof_before"]), significant(fit["chi2_dof_after"])
        text += f" Chi-square per degree of freedom: {before} before, {after} after."
    if said["measured"]["outliers"]:
        text += " Outliers are excluded from these numbers."
    for name, q in fit["quantities"].items() if any("rms" in one for one in said["unexplained"]) else ():
        text += f" Without the structure that is stated: {say(name)} rms {significant(q['rest_rms'])} {q['unit']}."
    return text


def appendix(said: Said, language: str = "en") -> Iterator[Block]:
    """All numbers, the search, the limits, the files."""
    for number, effect in enumerate(said["effects"], 1):
        yield heading(f"Finding {number}: {name_of(effect['label'], 'map')}")
        yield bullets(list(_facts(effect, said)))
        if "rows" in effect:
            rows = [[r["row"], *(f"{significant(r[f'{a}_deg'], 4)} deg" for a in ("polar", "azimuth")), _off(r, said)]
                    for r in effect["rows"]]  # fmt: skip
            yield table(("row", "polar", "azimuth", "off by"), rows)
    if said["probabilities"]:
        yield from trail_blocks(said, language)
    yield heading("Limits of this diagnosis")
    yield bullets([*limits(said, language), *said["remarks"]] or ["None beyond the uncertainties stated."])
    yield heading("Files")
    yield bullets(list(_files(said["inputs"])))


def _off(row: Said, said: Said) -> str:
    units = said["noise"]["quantities"]
    return ", ".join(f"{significant(v)} {units[name]['unit']} in {say(name)}" for name, v in row["off"].items())


def _facts(effect: Said, said: Said) -> Iterator[str]:
    for name, p in effect["parameters"].items():
        if "unit" in p:
            yield f"{name} = {plus_minus(p)}{' (k = 2)' if p['u'] else ''}"
    for name, value in effect["rms"].items():
        if value:
            unit = said["noise"]["quantities"][name]["unit"]
            largest = significant(effect["largest"][name])
            moved = f"{significant(value)} {unit} rms, {largest} {unit} at most"
            yield f"moves the {say(name)} of this map by {moved}"
    yield probability_of(effect)
    if effect["reason"]:
        yield f"why they are not discriminated: {effect['reason']}"


def _files(inputs: Said) -> Iterator[str]:
    sha = f", sha256 {inputs['map']['sha256'][:16]}…" if inputs["map"]["sha256"] else ""
    yield f"map {inputs['map']['path']}{sha}"
    yield f"probe file {inputs['probe']['path']}; full checksums in diagnosis.json"
    yield "probe.diagnosed.toml: the probe file with what was found, for stepgauge probe map and for a machine file"
