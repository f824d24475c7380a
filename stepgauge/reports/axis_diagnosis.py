"""The story of a diagnosis of an axis, a spot or distances, in the units and words of the user."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.wording.findings import finding_name, subject
from stepgauge.diagnosis.wording.notation import probability_of
from stepgauge.files.notation import significant
from stepgauge.reports.blocks import Block, bullets, heading, table, words
from stepgauge.reports.diagnosis_blocks import check_blocks, located_row, numbers, recording_files, set_table

Said = Mapping[str, Any]
TITLES = {"axis": "an axis", "spot": "one spot over time", "distances": "distances between stations"}


def title(said: Said) -> str:
    """The title of the page."""
    axis = said["axis"]
    sensor = axis["sensor_words"]
    return f"Diagnosis of {TITLES[axis['form']]}, read by {'an' if sensor[0] in 'aeio' else 'a'} {sensor}"


def captions(said: Said) -> dict[str, str]:
    """What stands below each figure."""
    return {
        "laws": "Mean deviations at every target with what the named causes make of them, and what is left",
        "residuals": "Deviations before and after, against what they may depend on",
    }


def evidence(said: Said, drawn: Sequence[Block], language: str) -> Iterator[Block]:
    """What was measured, and what speaks for the statements."""
    axis = said["axis"]
    unit, noise, fit = axis["deviation_unit"], said["noise"], said["fit"]
    yield words(_measured(said, axis))
    yield words(
        f"A single reading scatters by {significant(noise[f'sigma_{unit}'])} {unit} (one standard deviation), with"
        f" {noise['dof']} degrees of freedom. The usual sizes of causes are taken in proportion to this scatter."
    )
    rms = [significant(fit[f"rms_{when}_{unit}"]) for when in ("before", "after")]
    chi2 = [significant(fit[f"chi2_dof_{when}"]) for when in ("before", "after")]
    rows = [[f"rms of the residuals ({unit})", *rms], ["chi-square per degree of freedom", *chi2]]
    yield table(("", "before", "after"), rows, (1.0, 0.0, 0.0))
    if said["located"]:
        yield table(
            ("systematic in", "form", "share of the structure", "probability"),
            [located_row(one, said, language) for one in said["located"]],
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


def appendix(said: Said, language: str = "en") -> Iterator[Block]:
    """All numbers, the limits, the files."""
    axis = said["axis"]
    for number, effect in enumerate(said["effects"], 1):
        yield heading(f"Finding {number}: {finding_name(effect, subject(said))}")
        yield bullets([*numbers(effect), probability_of(effect)])
        yield from set_table(effect, said, language)
        if "rows" in effect:
            unit = axis["deviation_unit"]
            rows = [[r["row"], r["target"], r["cycle"], significant(r[f"off_{unit}"])] for r in effect["rows"]]
            yield table(("row", "target", "cycle", f"off by ({unit})"), rows, (0.0, 0.0, 0.0, 0.0))
    yield heading("Limits of this diagnosis")
    yield bullets(said["limits"])
    yield heading("Files")
    yield bullets(list(recording_files(said)))
