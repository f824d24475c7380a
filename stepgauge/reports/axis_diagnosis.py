"""The story of a diagnosis of an axis, a spot or distances, in the units and words of the user."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.credible import MOST_LOCATED
from stepgauge.diagnosis.wording.axis import kind_name
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.diagnosis.wording.notation import percent, plus_minus, probability_of, significant
from stepgauge.reports.blocks import Block, bullets, figure, heading, part, table, words
from stepgauge.reports.diagnosis import check_blocks, located_row, recording_files, shown_figures, story
from stepgauge.reports.findings import Words, do_first, first_lines, found_part

Said = Mapping[str, Any]
TITLES = {"axis": "an axis", "spot": "one spot over time", "distances": "distances between stations"}
_AGAIN = (
    "every target at least twice, better five times, in each direction of travel, with all digits of the instrument"
)


def told_of(said: Said) -> Words:
    """The words for an axis."""
    form = said["axis"]["form"]
    return Words([_AGAIN], _name, lambda one: _member(one, form), of="axis")


def first_of(said: Said) -> list[str]:
    """What to do first, in lines for a terminal."""
    return first_lines(said, told_of(said))


def _name(effect: Said) -> str:
    return str(effect["name"])


def _member(one: Said, form: str) -> str:
    return str(one.get("name") or kind_name(one["kind"], form))


def axis_story(said: Said, figures: Sequence[str] = (), pictures: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The content of a page; parameters as :func:`stepgauge.reports.diagnosis.diagnosis_story`."""
    axis, told = said["axis"], told_of(said)
    caption = "Deviations before and after, against what they may depend on"
    drawn = [figure(name, caption, pictures or {}) for name in shown_figures(figures, pictures)[:1]]
    sensor = axis["sensor_words"]
    title = f"Diagnosis of {TITLES[axis['form']]}, read by {'an' if sensor[0] in 'aeio' else 'a'} {sensor}"
    parts = [
        do_first(said, told),
        found_part({**said, "unexplained": said["unexplained"][:MOST_LOCATED]}, told, *drawn),
        part("Evidence", *_evidence(said, axis)),
        part("Appendix", *_appendix(said, axis)),
    ]
    return story(said, title, headline(said), parts)


def _evidence(said: Said, axis: Said) -> Iterator[Block]:
    unit, noise, fit = axis["deviation_unit"], said["noise"], said["fit"]
    yield words(_measured(said, axis))
    yield words(
        f"A single reading scatters by {significant(noise[f'sigma_{unit}'])} {unit} (one standard deviation), with"
        f" {noise['dof']} degrees of freedom. The priors of a CMM are taken in proportion to this scatter."
    )
    rms = [significant(fit[f"rms_{when}_{unit}"]) for when in ("before", "after")]
    chi2 = [significant(fit[f"chi2_dof_{when}"]) for when in ("before", "after")]
    rows = [[f"rms of the residuals ({unit})", *rms], ["chi-square per degree of freedom", *chi2]]
    yield table(("", "before", "after"), rows, (1.0, 0.0, 0.0))
    if said["located"]:
        yield table(
            ("systematic in", "form", "share of the structure", "probability"),
            [located_row(one) for one in said["located"]],
            (0.0, 1.0, 0.0, 0.0),
        )
    yield from check_blocks(said)


def _measured(said: Said, axis: Said) -> str:
    unit, duration = axis["deviation_unit"], said["measured"]["duration_s"]
    what = f"{axis['readings']} readings"
    if axis["targets"]:
        artefact = f" ({axis['artefact']})" if axis["artefact"] != "targets" else ""
        ways = "in both directions of travel" if axis["both_ways"] else "in one direction of travel"
        what += f" of {axis['targets']} targets{artefact}, cycles: {axis['cycles']}, {ways}"
    within = "" if duration is None else f", within {significant(duration / 60)} min"
    minus = {"axis": "target", "spot": "their mean", "distances": "fitted distance"}[axis["form"]]
    largest = "" if axis["largest"] is None else f" The largest deviation is {significant(axis['largest'])} {unit}."
    besides = f" Recorded besides, and looked at: {', '.join(axis['covariates'])}." if axis["covariates"] else ""
    return (
        f"{what}{within}. Positions ({axis['unit']}) and deviations, reading minus {minus} ({unit}).{largest}{besides}"
    )


def _appendix(said: Said, axis: Said) -> Iterator[Block]:
    for number, effect in enumerate(said["effects"], 1):
        yield heading(f"Finding {number}: {effect['name']}")
        yield bullets(list(_facts(effect)))
        if effect["set"]:
            rows = [
                [_member(one, axis["form"]), percent(one["share"]), _numbers(one), one["in_practice"]]
                for one in effect["set"]
            ]
            yield table(("cause", "share", "value (k = 2)", "what it would mean"), rows, (0.0, 0.0, 1.0, 2.0))
        if "rows" in effect:
            unit = axis["deviation_unit"]
            rows = [[r["row"], r["target"], r["cycle"], significant(r[f"off_{unit}"])] for r in effect["rows"]]
            yield table(("row", "target", "cycle", f"off by ({unit})"), rows, (0.0, 0.0, 0.0, 0.0))
    yield heading("Limits of this diagnosis")
    yield bullets(said["limits"])
    yield heading("Files")
    yield bullets(list(recording_files(said)))


def _facts(effect: Said) -> Iterator[str]:
    for name, p in effect["parameters"].items():
        if "unit" in p and p["unit"] != "count":
            yield f"{name if name != p['unit'] else 'size'} = {plus_minus(p)}{' (k = 2)' if p.get('u') else ''}"
    yield probability_of(effect)
    if effect["where"]:
        yield f"acts {effect['where']}"


def _numbers(one: Said) -> str:
    numbers = [(name, p) for name, p in one["parameters"].items() if "unit" in p]
    return "; ".join(f"{name if name != p['unit'] else 'size'} = {plus_minus(p)}" for name, p in numbers)
