"""The story of a diagnosis: what to do first, what was found with its rivals, the evidence, the appendix.

One content for ``diagnosis.md``, a page in a browser and a PDF, from ``diagnosis.json`` and the figures beside it. A
recording of a gauge, an axis and the map of a probe have one story; their rooms give what differs.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from stepgauge.diagnosis.result import FILE, Diagnosis
from stepgauge.diagnosis.wording.findings import subject
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.diagnosis.wording.limits import warnings
from stepgauge.files.text import read_result, result_file
from stepgauge.reports import axis_diagnosis, gauge_diagnosis, probe_diagnosis
from stepgauge.reports.blocks import figure, part
from stepgauge.reports.blocks import pictures as pictures_of
from stepgauge.reports.findings import found_part
from stepgauge.reports.first_steps import do_first, first_lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Said = Mapping[str, Any]
STORY = "story"
FIGURES = ("overview", "residuals", "directions", "effects")
"""Figures beside a diagnosis, the one of the first page first."""
PICTURES = (".png", ".svg")
"""Formats of figures that can stand in a page."""


def first_of(said: Said, language: str = "en") -> list[str]:
    """What to do first, in lines for a terminal."""
    return first_lines(said, language)


def diagnosis_story(
    said: Said, figures: Mapping[str, Figure | str] | None = None, language: str = "en"
) -> dict[str, Any]:
    """The content of a page on a diagnosis of a machine, an axis or a probe's map.

    Parameters
    ----------
    said : content of a ``diagnosis.json``
    figures : by the names of their files, the overview first; empty text where only the name is wanted
    language : of the page
    """
    room = _room(said)
    captions = room.captions(said)
    if said["inputs"].get("simulated"):
        _mark(figures or {})
    drawn = [figure(name, captions[Path(name).stem], one) for name, one in (figures or {}).items()]
    parts = [
        do_first(said, language),
        found_part(said, *drawn[:1], language=language),
        part("Evidence", *room.evidence(said, drawn[1:], language)),
        part("Appendix", *room.appendix(said, language)),
    ]
    example = "gauge" in said["inputs"] and bool(said["inputs"]["gauge"]["example"])
    own = [str(said["inputs"][name].get("name")) for name in ("machine", "gauge") if name in said["inputs"]]
    page = story(said, room.title(said), headline(said, language), parts, example)
    return {**page, "warnings": warnings(said, language), "language": language, "own": own}


def _mark(figures: Mapping[str, Figure | str]) -> None:
    """Figures that are drawn now say that no machine was measured, as their files do."""
    from stepgauge.figures.style import mark_simulated

    for one in figures.values():
        if not isinstance(one, str):
            mark_simulated(one)


def _room(said: Said) -> ModuleType:
    return {"gauge": gauge_diagnosis, "axis": axis_diagnosis, "map": probe_diagnosis}[subject(said).of]


def story_of(found: Diagnosis, language: str = "en") -> dict[str, Any]:
    """The content of a page from a diagnosis, with its figures drawn now."""
    if not (figures := found.figures()) and found.path:
        return read_story(found.path, language)
    return diagnosis_story(found.contents, figures, language)


def read_story(path: str | Path, language: str = "en") -> dict[str, Any]:
    """The content of a page from the folder of a diagnosis, or its ``diagnosis.json``, with the figures beside it.

    :class:`InputError` where it is none, or was changed; as :func:`stepgauge.files.text.read_result`.
    """
    said, folder = read_said(path)
    if figures := Diagnosis(said, str(folder / FILE)).figures():
        return diagnosis_story(said, figures, language)
    names = [f"{stem}{kind}" for stem in FIGURES for kind in PICTURES if (folder / f"{stem}{kind}").is_file()]
    return diagnosis_story(said, dict(pictures_of(folder, names)), language)


def read_said(path: str | Path) -> tuple[dict[str, Any], Path]:
    """``diagnosis.json`` and its folder; errors as :func:`read_story`.

    That the machine file was changed since, as a diagnosis asks for, takes nothing from what it says.
    """
    file = result_file(path, "diagnosis.json")
    said = read_result(file, "diagnosis", with_inputs=False)
    return said, file.parent


def story(
    said: Said, title: str, sentence: str, parts: Sequence[dict[str, Any]], example: bool = False
) -> dict[str, Any]:
    """The page around the parts of any diagnosis."""
    return {
        "layout": STORY,
        "title": title,
        "verdict": said["verdict"],
        "summary": sentence,
        "warnings": warnings(said),
        "example": example,
        "parts": list(parts),
        "data": {"name": "diagnosis.json", "text": json.dumps(said, indent=1, ensure_ascii=False)},
        "version": said["stepgauge"],
    }
