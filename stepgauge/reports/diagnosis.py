"""The story of a diagnosis: what to do first, what was found with its rivals, the evidence, the appendix.

One content for ``diagnosis.md``, a page in a browser and a PDF, from ``diagnosis.json`` and the figures beside it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.diagnosis.wording.headline import headline
from stepgauge.diagnosis.wording.limits import SCATTER_WORDS, lacking, limits, without_scatter
from stepgauge.diagnosis.wording.notation import (
    name_of,
    percent,
    plus_minus,
    probability,
    probability_of,
    significant,
    um,
    wrapped_sum,
)
from stepgauge.diagnosis.wording.structure import SCATTER
from stepgauge.files.text import in_folder, read_result
from stepgauge.recording.simulated import SIMULATED_WARNING
from stepgauge.reports.blocks import Block, bullets, code, figure, heading, part, table, words
from stepgauge.reports.blocks import pictures as pictures_of
from stepgauge.reports.findings import Words, do_first, first_lines, found_part, misfits

if TYPE_CHECKING:
    from stepgauge.diagnosis.result import Diagnosis

Said = Mapping[str, Any]
MOST_REPLACED = 5
"""Combinations that may replace a finding, in the appendix; the file has all."""
STORY = "story"
FIGURES = ("overview", "residuals", "directions", "effects")
"""Figures beside a diagnosis, the one of the first page first."""
PICTURES = (".png", ".svg")
"""Formats of figures that can stand in a page."""
COMPARE = (
    "After any change, measure with the same program and lay the two evaluations over each other:"
    " stepgauge report BEFORE AFTER -o overlay.pdf"
)


def told_of(said: Said) -> Words:
    """The words for a recording of a gauge."""
    return Words(lacking(said), compare=COMPARE if said["effects"] or said["unexplained"] else "")


def first_of(said: Said) -> list[str]:
    """What to do first, in lines for a terminal."""
    return first_lines(said, told_of(said))


def diagnosis_story(
    said: Said, figures: Sequence[str] = (), pictures: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """The content of a page on a diagnosis.

    Parameters
    ----------
    said : content of a ``diagnosis.json``
    figures : names of the figures beside it, the overview first
    pictures : their contents (SVG) by name, for pages that hold their figures; one that is missing is left out
    """
    inputs, told = said["inputs"], told_of(said)
    captions = _captions(said)
    drawn = [figure(name, captions[Path(name).stem], pictures or {}) for name in shown_figures(figures, pictures)]
    title = f"Diagnosis: {inputs['machine']['name']} with {inputs['gauge']['name']}"
    parts = [
        do_first(said, told),
        found_part(said, told, *drawn[:1]),
        part("Evidence", *_evidence(said, drawn[1:])),
        part("Appendix", *_appendix(said)),
    ]
    return story(said, title, headline(said), parts, bool(inputs["gauge"]["example"]))


def story_of(found: Diagnosis) -> dict[str, Any]:
    """The content of a page from a diagnosis, with its figures drawn now."""
    from stepgauge.reports.content import figure_svg

    drawn = {name: figure_svg(one) for name, one in found.figures().items()}
    return told_story(found.said, list(drawn), drawn) if drawn or not found.path else read_story(found.path)


def shown_figures(figures: Sequence[str], pictures: Mapping[str, str] | None) -> list[str]:
    """Figures by name; of a page that holds their contents those that there are."""
    return [name for name in figures if pictures is None or pictures.get(name)]


def read_story(path: str | Path) -> dict[str, Any]:
    """The content of a page from the folder of a diagnosis, or its ``diagnosis.json``, with the figures beside it.

    :class:`InputError` where it is none, or was changed; as :func:`stepgauge.files.text.read_result`.
    """
    said, folder = read_said(path)
    names = [f"{stem}{kind}" for stem in FIGURES for kind in PICTURES if (folder / f"{stem}{kind}").is_file()]
    return told_story(said, names, dict(pictures_of(folder, names)))


def read_said(path: str | Path) -> tuple[dict[str, Any], Path]:
    """``diagnosis.json`` and its folder; errors as :func:`read_story`.

    That the machine file was changed since, as a diagnosis asks for, takes nothing from what it says.
    """
    file = in_folder(path, "diagnosis.json")
    said = read_result(file, "diagnosis", with_inputs=False)
    return said, file.parent


def told_story(said: Said, figures: Sequence[str] = (), pictures: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The page of a diagnosis of a machine, an axis or a probe's map; parameters as :func:`diagnosis_story`."""
    from stepgauge.reports.axis_diagnosis import axis_story
    from stepgauge.reports.probe_diagnosis import map_story

    if "map" in said["inputs"]:
        return map_story(said, figures, pictures)
    return (axis_story if "axis" in said else diagnosis_story)(said, figures, pictures)


def story(
    said: Said, title: str, sentence: str, parts: Sequence[dict[str, Any]], example: bool = False
) -> dict[str, Any]:
    """The page around the parts of any diagnosis."""
    return {
        "layout": STORY,
        "title": title,
        "verdict": said["verdict"],
        "summary": sentence,
        "warnings": [
            *([SIMULATED_WARNING] if said["inputs"].get("simulated") else []),
            *(_fails(check) for check in said["checks"] if not check["passed"]),
            *misfits(said),
            *without_scatter(said),
        ],
        "example": example,
        "parts": list(parts),
        "data": {"name": "diagnosis.json", "text": json.dumps(said, indent=1, ensure_ascii=False)},
        "version": said["stepgauge"],
    }


def _fails(check: Said) -> str:
    return (
        f"The posterior predictive check of the {check['check']} fails: {check['words']}. What is stated below is less"
        " certain than usual; its uncertainties were widened where that can be computed."
    )


def _captions(said: Said) -> dict[str, str]:
    after = " with the form imitated" if said["empirical"] else ""
    noise = f"noise of a probing: {um(said['noise']['sigma_um'])}"
    return {
        "overview": f"Residuals before and after{after}; {noise}",
        "residuals": f"Residuals before and after{after}, against what they may depend on",
        "effects": "Every effect and every form with the fitted curve drawn through the data",
    }


def _evidence(said: Said, drawn: Sequence[Block]) -> Iterator[Block]:
    yield from _measured(said)
    yield from drawn
    yield from odds_blocks(said)
    yield from check_blocks(said)
    yield from located_blocks(said)
    yield from _imitated(said)
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


def odds_blocks(said: Said) -> Iterator[Block]:
    """Probabilities of all statements."""
    odds = said["odds"]
    if not odds:
        return
    rows = [["nothing beyond the scatter", probability(odds["adequate"])]]
    rows += [
        [_statement(one), probability(one["probability"])] for one in odds["statements"] if not one["includes_set"]
    ]
    rows += [[f"{_possible(one)} (not stated)", probability(one["probability"])] for one in odds["possible"]]
    rows += [[SCATTER_WORDS[name], probability(p)] for name, p in odds["scatter"].items() if p >= 0.01]
    yield heading("Probabilities")
    yield words(
        "Averaged over all hypotheses that were computed, weighted by their probability; the assumptions are"
        " in the priors."
    )
    yield table(("statement", "probability"), rows, (0.0, 0.0))


def _possible(one: Said) -> str:
    return name_of(one["label"]) if "label" in one else f"structure in {one['covariate']}"


def _statement(one: Said) -> str:
    if "kind" not in one:
        return f"{one['form']} in {one['covariate']}"
    choices = [str(p["value"]) for p in one["parameters"].values() if isinstance(p["value"], str)]
    return ", ".join([name_of(one["kind"]), *(choices if one["kind"] != "outliers" else [])])


def check_blocks(said: Said) -> Iterator[Block]:
    """The posterior predictive check."""
    if not said["checks"]:
        return
    yield heading("Posterior predictive check")
    yield words(
        "Residuals compared with the scatter of the stated hypothesis; the deviation is in standard deviations of each"
        " statistic."
    )
    rows = [
        [one["check"], f"{one['deviation']:.1f}", "passes" if one["passed"] else "fails", one["words"]]
        for one in said["checks"]
    ]
    yield table(("part", "deviation", "", "what was found"), rows)


def located_row(one: Said, *faces: str) -> list[str]:
    """A form of the residuals: covariate, the faces it is on where that is told, words, share and probability."""
    p = one.get("probability", one.get("probability_if_alone"))
    return [one["covariate"], *faces, one["where"], percent(one["share"]), probability(p)]


def located_blocks(said: Said) -> Iterator[Block]:
    """Where the residuals are systematic, before any effect is named."""
    yield heading("Where the residuals are systematic")
    if not said["located"]:
        yield words("Nowhere: no dependence on any covariate is more probable than scatter.")
        return
    yield table(
        ("covariate", "faces", "form", "share of the structure", "probability"),
        [located_row(one, one["side"]) for one in said["located"]],
        (0.0, 0.0, 1.0, 0.0, 0.0),
        note="These are the forms of the residuals before any effect is named.",
    )


def _imitated(said: Said) -> Iterator[Block]:
    if not said["unexplained"]:
        return
    yield heading("How the form is imitated")
    for number, law in enumerate(said["empirical"]):
        count = len(law["formulas"])
        by = "an empirical effect" if count == 1 else f"{count} empirical effects, the sum of which is"
        yield words(
            f"In machine.diagnosed.toml {'a further form of it is' if number else 'it is'} imitated over"
            f" {law['covariate']}, {um(law['rms_um'])} rms, by {by}"
        )
        yield code(*wrapped_sum(law["formulas"]))
    if said["empirical"]:
        yield words(
            "The file states the coefficients with their uncertainties. This is a description, not an"
            " explanation, ready"
            " for simulation; do not extrapolate it."
        )
    elif all(one["form"] in SCATTER for one in said["unexplained"]):
        yield words(
            "It is a property of the scatter, which no formula of the mean describes: machine.diagnosed.toml does not"
            " contain it."
        )
    else:
        yield words("A formula cannot name its covariate, so machine.diagnosed.toml does not contain it.")


def _fit(said: Said) -> Block:
    fit, imitated = said["fit"], said["fit"].get("with_empirical")
    columns = ["", "before", "after, named effects only" if imitated else "after"]
    rows = [["rms of the residuals", um(fit["rms_before_um"]), um(fit["rms_after_um"])]]
    for by, pair in fit["holdout"].items():
        rows.append([f"rms of predictions, {by} held out", um(pair["rms_before_um"]), um(pair["rms_after_um"])])
    if imitated:
        columns.append("after, form imitated")
        told = [imitated["rms_after_um"], *(imitated["holdout_rms_after_um"].get(by) for by in fit["holdout"])]
        rows = [[*row, um(value)] for row, value in zip(rows, told, strict=True)]
    chi2 = [significant(fit["chi2_dof_before"]), significant(fit["chi2_dof_after"])]
    rows.append(["chi-square per degree of freedom", *chi2, *([""] if imitated else [])])
    last = " The last column is that of machine.diagnosed.toml." if imitated else ""
    return table(
        columns,
        rows,
        (1.0, *(0.0 for _ in columns[1:])),
        note=f"The noise of a probing is {um(fit['noise_um'])}. Residuals include the errors of the faces against their"
        f" certified positions, within the uncertainty of the certificate: chi-square allows for that, the"
        f" rms does not.{last}",
    )


def _appendix(said: Said) -> Iterator[Block]:
    for number, effect in enumerate(said["effects"], 1):
        yield from _in_full(number, effect)
    yield from trail_blocks(said)
    yield heading("Limits of this diagnosis")
    yield bullets([*limits(said), *said["remarks"]] or ["None beyond the uncertainties stated."])
    yield heading("Files")
    yield bullets(list(_files(said)))


def _in_full(number: int, effect: Said) -> Iterator[Block]:
    """All numbers of a finding and of its rivals."""
    yield heading(f"Finding {number}: {name_of(effect['label'])}")
    if effect["set"]:
        yield words("Each of these causes alone would explain it; the stated one first, then by probability.")
        rows = [
            [name_of(one["label"]), percent(one["share"]), _all_numbers(one), one["in_practice"]]
            for one in effect["set"]
        ]
        yield table(("cause", "share", "value (k = 2)", "what it would mean"), rows, (0.0, 0.0, 1.0, 2.0))
    yield bullets(list(_facts(effect)))
    if "rows" in effect:
        rows = [[r["recording"], r["row"], r["cycle"], r["face"], um(r["off_um"])] for r in effect["rows"]]
        yield table(("recording", "row", "cycle", "face", "off by"), rows, (1.0, 0.0, 0.0, 0.0, 0.0))


def _all_numbers(one: Said) -> str:
    return "; ".join(f"{name} = {plus_minus(p)}" for name, p in one["parameters"].items() if "unit" in p)


def _facts(effect: Said) -> Iterator[str]:
    for name, p in effect["parameters"].items():
        if "unit" in p:
            yield f"{name} = {plus_minus(p)}{' (k = 2)' if p.get('u') else ''}"
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
    return f"{' and '.join(laws)} may stand in its place{besides} (odds 1 to {significant(1.0 / other['odds'], 2)})"


def trail_blocks(said: Said) -> Iterator[Block]:
    """The steps of the search."""
    yield heading("Steps of the search")
    if said["trail"]:
        rows = [[step["action"], name_of(step["effect"]), f"{step['log10_odds']:.1f}"] for step in said["trail"]]
        yield table(("step", "hypothesis", "log10 of the odds against the one before"), rows, (0.0, 1.0, 0.0))
    elif said["verdict"] == "insufficient" and not said["odds"]:
        yield words("No search was made: the noise is not known well enough to test any effect.")
    else:
        yield words("No hypothesis is more probable than scatter alone.")


def _files(said: Said) -> Iterator[str]:
    inputs = said["inputs"]
    yield from recording_files(said)
    yield f"gauge {inputs['gauge']['path']}, machine {inputs['machine']['path']}; full checksums in diagnosis.json"
    yield "machine.diagnosed.toml: the machine file with what was found, ready for stepgauge simulate"


def recording_files(said: Said) -> Iterator[str]:
    """The recordings, with the beginning of their checksums."""
    for one in said["inputs"]["recordings"]:
        yield f"recording {one['path']}" + (f", sha256 {one['sha256'][:16]}…" if one["sha256"] else "")
