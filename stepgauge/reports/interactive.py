"""A page to explore: errors by face, or residuals of a diagnosis, where a click shows the single probings.

One file for a browser that needs no network. Everything in it is data of the page, never markup.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from stepgauge import __version__
from stepgauge.diagnosis.output.rows import FINDING, FORM, unit_of
from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.evaluation.probings import TEMPERATURES, probing_errors
from stepgauge.figures.error_chart import numbers
from stepgauge.figures.plotly_library import packed_library
from stepgauge.files.notation import clean, printed, printed_unit
from stepgauge.recording import Recording
from stepgauge.recording.simulated import is_simulated

MOST_ROWS = 10_000
"""Readings in a page; of more, evenly chosen ones."""
_MORE = (
    ("time_s", "time (s)", 1),
    *((name, name.replace("_C", " (°C)").replace("_", " "), 2) for name in TEMPERATURES),
)


def evaluation_page(evaluation: Evaluation, recording: Recording) -> dict[str, Any]:
    """The content of a page on an evaluation; ``recording``: the one it was made from, all placements."""
    said = evaluation_to_dict(evaluation)
    tables = probing_errors(recording, evaluation)
    placements = [
        {"placement": one["placement"], "faces": [_plain(row) for row in one["faces"]], "probings": _probings(table)}
        for one, table in zip(said["placements"], tables, strict=True)
    ]
    gauge = said["gauge"]
    scene = {
        "kind": "evaluation",
        "part": "placement",
        "placements": placements,
        "findings": [],
        "against": [],
        "hint": "Hollow: interpolated from the neighbouring faces. Bands: 2s of the cycles.",
    }
    subtitle = f"{gauge['name']}, serial number {gauge['serial']}; {said['machine'] or 'machine not stated'}"
    note = _left_out(sum(map(len, tables)))
    return _content("Errors by face", subtitle, scene, bool(gauge["example"]), is_simulated(said["comments"]), note)


def diagnosis_page(said: Mapping[str, Any], story: Mapping[str, Any], rows: pd.DataFrame) -> dict[str, Any]:
    """The content of a page on a diagnosis.

    Parameters
    ----------
    said : content of ``diagnosis.json``
    story : its page in words, with the table of findings
    rows : content of ``residuals.csv``
    """
    scene = diagnosis_scene(said, story, rows)
    return _content(
        story["title"],
        printed(story["summary"]),
        scene,
        bool(story["example"]),
        bool(said["inputs"].get("simulated")),
        _left_out(len(rows)),
    )


def diagnosis_scene(
    said: Mapping[str, Any], story: Mapping[str, Any], rows: pd.DataFrame, more: pd.DataFrame | None = None
) -> dict[str, Any]:
    """The data of such a page; ``more``: further covariates, one row per row of ``rows``, by their names with units."""
    unit = str(unit_of(rows))
    listed = _listed_rows(said, rows)
    kept = _kept(len(rows), [at for some in listed.values() for at in some])
    place = {int(at): i for i, at in enumerate(kept)}
    rows = rows.iloc[kept].reset_index(drop=True)
    findings = _findings(said, story, rows, unit, {n: [place[at] for at in some] for n, some in listed.items()})
    added = pd.DataFrame() if more is None else more.iloc[kept]
    return {
        "kind": "diagnosis",
        **_what(said, rows, unit),
        "against": [*_against(rows), *({"name": str(name), "values": numbers(added[name])} for name in added)],
        "rows": _rows(rows, unit, "axis" in said),
        "findings": findings,
    }


def _what(said: Mapping[str, Any], rows: pd.DataFrame, unit: str) -> dict[str, Any]:
    """What a click selects, and the parts that are shown one at a time: placements, or quantities of a map."""
    parts = [{"placement": int(n)} for n in np.unique(rows["placement"])]
    if "map" in said["inputs"]:
        names = list(said["fit"]["quantities"])
        return {
            "unit": "standard deviations of a reading",
            "group": "direction",
            "part": "quantity",
            "noise": 1.0,
            "placements": [{**one, "name": names[one["placement"] - 1].replace("_", " ")} for one in parts],
            "hint": "Dashed: two sigma of the noise, which is one for every quantity.",
        }
    return {
        "unit": printed_unit(unit),
        "group": "target" if "axis" in said else "face",
        "part": "placement",
        "noise": said["fit"][f"noise_{unit}"],
        "placements": parts,
        "hint": "Dashed: two sigma of the noise.",
    }


def _content(
    title: str, subtitle: str, scene: dict[str, Any], example: bool, simulated: bool, note: str
) -> dict[str, Any]:
    return {
        "layout": "interactive",
        "title": clean(title),
        "subtitle": clean(subtitle),
        "scene": scene,
        "library": packed_library(),
        "example": example,
        "simulated": simulated,
        "note": note,
        "version": __version__,
    }


def _left_out(total: int) -> str:
    return "" if total <= MOST_ROWS else f"{MOST_ROWS} of {total} readings are shown, evenly chosen."


def _kept(total: int, always: Sequence[int]) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Rows of a page: all, or evenly chosen ones with those that a finding lists."""
    some = np.linspace(0, total - 1, min(total, MOST_ROWS)).astype(np.intp)
    return np.union1d(some, np.array(always, dtype=np.intp))


def _plain(row: Mapping[str, Any]) -> dict[str, Any]:
    names = ("face", "block", "side", "nominal_mm", "xf_um", "sf_um", "xb_um", "sb_um", "xm_um", "xr_um")
    return {name: _short(row[name]) for name in names}


def _short(value: Any) -> Any:
    return round(value, 4) if isinstance(value, float) else value


def _probings(table: pd.DataFrame) -> dict[str, Any]:
    """Single probings, with the times and temperatures that changed."""
    table = table.iloc[_kept(len(table), [])]
    more = [
        {"name": name, "values": numbers(table[column]), "decimals": decimals}
        for column, name, decimals in _MORE
        if column in table and table[column].nunique() > 1
    ]
    return {
        "cycle": [int(one) for one in table["cycle"]],
        "face": [int(one) for one in table["face"]],
        "used": [int(one) for one in table["used"]],
        "error_um": numbers(table["error_um"]),
        "residual_um": numbers(table["residual_um"]),
        "more": more,
    }


def _against(rows: pd.DataFrame) -> list[dict[str, Any]]:
    (position,) = [name for name in rows.columns if str(name).startswith("position_")]
    of_map = "polar_deg" in rows
    name = "azimuth (°)" if of_map else f"position ({printed_unit(position.removeprefix('position_'))})"
    found = [{"name": name, "values": numbers(rows[position])}]
    if of_map:
        found.append({"name": "polar angle (°)", "values": numbers(rows["polar_deg"])})
    if "time_s" in rows:
        found.append({"name": "time (min)", "values": numbers(rows["time_s"] / 60.0)})
    return [*found, {"name": "order of the rows", "values": list(range(1, len(rows) + 1))}]


def _rows(rows: pd.DataFrame, unit: str, of_axis: bool) -> dict[str, Any]:
    """``group`` is what a click selects: a face, or a target of an axis, which is two faces."""
    (position,) = [name for name in rows.columns if str(name).startswith("position_")]
    face = rows["face"].to_numpy(int)
    label = list(map(str, face))
    if of_axis:
        label = [f"{one:g} {printed_unit(position.removeprefix('position_'))}" for one in rows[position]]
    elif "polar_deg" in rows:
        angles = zip(rows["polar_deg"], rows[position], strict=True)
        label = [f"{polar:g}° polar, {azimuth:g}° azimuth" for polar, azimuth in angles]
    return {
        "recording": [clean(one) for one in rows["recording"]],
        **{name: [int(one) for one in rows[name]] for name in ("row", "placement", "cycle", "face", "used")},
        "group": [int(one) for one in ((face + 1) // 2 if of_axis else face)],
        "label": label,
        "before": numbers(rows[f"before_{unit}"]),
        "after": numbers(rows[f"after_{unit}"]),
    }


def _listed_rows(said: Mapping[str, Any], rows: pd.DataFrame) -> dict[int, list[int]]:
    """By the number of a finding that lists outliers, their places in the table: of a map in each quantity."""
    found = {}
    for number, effect in enumerate(said["effects"], 1):
        if "rows" in effect:
            keys = {(one.get("recording", rows["recording"].iloc[0]), one["row"]) for one in effect["rows"]}
            named = enumerate(zip(rows["recording"], rows["row"], strict=True))
            found[number] = [at for at, key in named if key in keys]
    return found


def _findings(
    said: Mapping[str, Any], story: Mapping[str, Any], rows: pd.DataFrame, unit: str, listed: Mapping[int, list[int]]
) -> list[dict[str, Any]]:
    """Findings as the story tells them, each with what it adds to the readings; then the forms."""
    told = _told(story)
    found = []
    for number, _ in enumerate(said["effects"], 1):
        cells, rivals = told[number]
        some = listed.get(number)
        share = None if some is not None else _share(rows, f"{FINDING}_{number}_{unit}")
        found.append(_finding(number, cells, rivals, share, some))
    forms = [one for one in said["unexplained"] if f"rms_{unit}" in one]
    for number, form in enumerate(forms, 1):
        name = f"form over {form['covariate']}"
        share = _share(rows, f"{FORM}_{number}_{unit}")
        text = printed(f"{form['where']}. Its cause is not known.")
        found.append({"name": name, "short": "without a law", "text": text, "share": share, "rows": None, "facts": []})
    return found


def _share(rows: pd.DataFrame, name: str) -> list[float | None] | None:
    values = rows[name].to_numpy(float) if name in rows else np.zeros(len(rows))
    return numbers(values) if np.abs(values).max(initial=0.0) > 0.0 else None


def _told(story: Mapping[str, Any]) -> dict[int, tuple[Sequence[str], list[Sequence[str]]]]:
    """By number: the row of a finding in the story's table, and those of its rivals."""
    tables = [one for part in story["parts"][1:2] for one in part["blocks"] if one["kind"] == "table"]
    found: dict[int, tuple[Sequence[str], list[Sequence[str]]]] = {}
    number = 0
    for row in tables[0]["rows"] if tables else []:
        if row[0].isdigit():
            number = int(row[0])
            found.setdefault(number, (row, []))
        else:
            found[number][1].append(row)
    return found


def _finding(
    number: int,
    cells: Sequence[str],
    rivals: Sequence[Sequence[str]],
    share: list[float | None] | None,
    rows: list[int] | None,
) -> dict[str, Any]:
    _, name, value, u, p, text = cells
    facts = [("Value", _value_and_u(value, u)), ("Probability", p)]
    facts += [(f"Or {one[1]}", f"{_value_and_u(one[2], one[3])}; probability {one[4]}. {one[5]}") for one in rivals]
    short = "; ".join([*value.split("\n")[:1], f"probability {p}"]).removeprefix("; ")
    return {
        "name": f"{number} {name}",
        "short": printed(short),
        "text": printed(text),
        "share": share,
        "rows": rows,
        "facts": [[what, printed(one)] for what, one in facts if one],
    }


def _value_and_u(value: str, u: str) -> str:
    """``7.5 um/m (u = 1.4 um/m)``, for each number."""
    pairs = zip(value.split("\n"), u.split("\n"), strict=True)
    return "; ".join(f"{one} (u = {its})" for one, its in pairs if one)
