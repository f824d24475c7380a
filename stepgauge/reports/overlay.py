"""The page on evaluations laid over each other: largest differences with their U, figures, a table of all faces."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.figures.faces import NAMES
from stepgauge.figures.overlay import overlay_figure
from stepgauge.figures.style import save_figure
from stepgauge.files.json_types import defined
from stepgauge.files.notation import UNDEFINED, aligned, number, quantity, uncertain
from stepgauge.recording.simulated import is_simulated
from stepgauge.reports.page import Page, PrintedTable, TableColumn, UserStatements
from stepgauge.reports.render import translator, write_report
from stepgauge.reports.sections import Section, file_names
from stepgauge.standards.coverage import APPROXIMATELY_95
from stepgauge.standards.difference import (
    CANCELS,
    COUNTED,
    ERRORS,
    NOT_COUNTED,
    Difference,
    differences,
)

PICTURES = (".png", ".svg")
Found = list[list[Difference]]
"""By later evaluation, then by placement."""


def write_overlay(
    path: str | Path,
    evaluations: Sequence[Mapping[str, Any]],
    names: Sequence[str],
    template: str | Path | None = None,
    stated: UserStatements | None = None,
) -> tuple[str, ...]:
    """Write an overlay: PDF or HTML with tables, PNG or SVG the figure alone (of a single placement).

    Parameters
    ----------
    path : where to; its suffix decides the kind
    evaluations : contents of ``evaluation.json``, the earliest first
    names : what each is called by: its path
    template : Typst or Jinja file instead of the shipped one

    Returns
    -------
    Notes on the file, mostly none. :class:`InputError` as :func:`stepgauge.standards.difference.differences`.
    """
    _check_copies(evaluations, names)
    found = [
        differences(evaluations[0], one, (names[0], name)) for one, name in zip(evaluations[1:], names[1:], strict=True)
    ]
    short = short_names(names)
    if Path(path).suffix.lower() not in PICTURES:
        content = overlay_content(evaluations, found, short, stated or UserStatements(datetime.date.today()))
        return write_report(path, content, template)
    if len(found[0]) > 1:
        raise InputError(
            path, "a figure shows one placement", found=f"{len(found[0])}", expected=".pdf or .html for all"
        )
    simulated = any(is_simulated(one["comments"]) for one in evaluations)
    said = {"language": stated.language if stated else "en", "own": short}
    save_figure(_figure(evaluations, found, short, 0), path, simulated, translator(said))
    return ()


def _check_copies(evaluations: Sequence[Mapping[str, Any]], names: Sequence[str]) -> None:
    """:class:`InputError` for an evaluation that is there twice: nothing happened between it and itself."""
    for i, one in enumerate(evaluations):
        for j, other in enumerate(evaluations[:i]):
            if one["placements"] == other["placements"]:
                what = f"evaluation {i + 1} repeats evaluation {j + 1}"
                raise InputError(
                    names[i], what, found="the same errors to the last digit", expected="another evaluation"
                )


def short_names(names: Sequence[str]) -> list[str]:
    """Names as short as they differ: the last parts of their paths, numbered where they are the same."""
    paths = [Path(name).parent if Path(name).name == "evaluation.json" else Path(name) for name in names]
    last = [path.name or str(path) for path in paths]
    if len(set(last)) < len(last):
        last = ["/".join(path.parts[-2:]) for path in paths]
    if len(set(last)) < len(last):
        last = [f"{name} ({i})" for i, name in enumerate(last, 1)]
    return last


def _figure(evaluations: Sequence[Mapping[str, Any]], found: Found, names: Sequence[str], index: int) -> Any:
    return overlay_figure([one["placements"][index] for one in evaluations], [by[index] for by in found], names)


def overlay_content(
    evaluations: Sequence[Mapping[str, Any]], found: Found, names: Sequence[str], stated: UserStatements
) -> dict[str, Any]:
    """The content of the page (see :class:`stepgauge.reports.page.Page`)."""
    first = evaluations[0]
    placements = [placement["placement"] for placement in first["placements"]]
    page = Page(
        "Evaluations laid over each other",
        f"{first['gauge']['name']}, serial number {first['gauge']['serial']}: later minus earlier errors",
        [_identity(one, name) for one, name in zip(evaluations, names, strict=True)],
        _result(found, names),
        ("overlay.json", _data(evaluations, found, names)),
        statements=[
            f"U: expanded uncertainty of the difference, {APPROXIMATELY_95:g} %. Counted: {'; '.join(COUNTED)}.",
            CANCELS,
            NOT_COUNTED,
        ],
        figures=[
            (
                _figure(evaluations, found, names, i),
                f"Placement {n}: errors with bands of 2s, differences with U",
            )
            for i, n in enumerate(placements)
        ],
        tables=[_faces(one, names, number) for number, by in enumerate(found, 1) for one in by],
        lists=[("Notes", [note for by in found for one in by for note in one.notes])],
        not_stated=[],
        example=any(one["gauge"]["example"] for one in evaluations),
    )
    return page.to_dict(stated)


def _identity(evaluation: Mapping[str, Any], name: str) -> Section:
    section = Section(name)
    section.add("Recording", file_names(str(evaluation["recording"]).split(", ")) or "not stated")
    section.add("Machine", evaluation.get("machine"))
    section.add("Measured", evaluation.get("measured_at"))
    for one in evaluation["placements"]:
        warm, (fewest, most) = one["gauge_temperature_C"], one["cycles"]
        cycles = str(most) if fewest == most else f"{fewest} to {most}"
        section.add(f"Placement {one['placement']}", f"{cycles} cycles, gauge {quantity(warm, 2, '°C')}")
    return section


def _result(found: Found, names: Sequence[str]) -> PrintedTable:
    columns = [
        TableColumn("Largest difference", words=True),
        TableColumn("At", words=True),
        TableColumn("Difference"),
        TableColumn("U"),
        TableColumn("k"),
        TableColumn("Faces beyond U"),
    ]
    several = len(found) > 1 or len(found[0]) > 1
    rows = [
        [(f"{names[i]}, placement {one.placement}: " if several else "") + NAMES[error], *_largest(one, error)]
        for i, by in enumerate(found, 1)
        for one in by
        for error in ERRORS
    ]
    return PrintedTable(f"{names[-1]} − {names[0]}" if len(found) == 1 else "Differences", columns, rows, stripe=0)


def _largest(one: Difference, error: str) -> list[str]:
    d = one.of(error)
    if not np.isfinite(d).any():
        return [UNDEFINED] * 5
    at = int(np.nanargmax(np.abs(d)))
    value, expanded = uncertain(float(d[at]), float(one.expanded_um[error][at]), most=2)
    beyond = f"{int(one.significant(error).sum())} / {int(np.isfinite(d).sum())}"
    where = f"face {one.face[at]}, {quantity(float(one.nominal_mm[at]), 0, 'mm')}"
    return [where, f"{value} µm", f"{expanded} µm", number(float(one.k[error][at]), 2), beyond]


def _faces(one: Difference, names: Sequence[str], later: int) -> PrintedTable:
    """All common faces; an error that is interpolated at a face is in italics."""
    columns = [
        TableColumn("Face"),
        TableColumn("Nominal", "mm"),
        TableColumn("XM", "µm", place=names[0]),
        TableColumn("XM", "µm", place=names[later]),
    ]
    columns += [c for error in ERRORS for c in (TableColumn(f"Δ{error.upper()}", "µm"), TableColumn("U", "µm"))]
    cells = [_cells(one, i) for i in range(len(one.face))]
    even = zip(*(aligned(column) for column in zip(*cells, strict=True)), strict=True)
    rows = [_row(one, i, line) for i, line in enumerate(even)]
    title = f"{names[later]} − {names[0]} by face, placement {one.placement}"
    note = "* interpolated from the two neighbouring faces of the same side. – not defined."
    return PrintedTable(title, columns, rows, note, stripe=2)


def _cells(one: Difference, i: int) -> list[str]:
    """The differences at a face, each with its expanded uncertainty and to its place."""
    pairs = [uncertain(float(one.of(error)[i]), float(one.expanded_um[error][i]), most=2) for error in ERRORS]
    return [cell for pair in pairs for cell in pair]


def _row(one: Difference, i: int, cells: Sequence[str]) -> list[str]:
    head = [str(one.face[i]), number(float(one.nominal_mm[i]), 1)]
    head += [number(float(side["xm"][i]), 2) for side in (one.before_um, one.after_um)]
    between = 2 * ERRORS.index("xb" if one.face[i] % 2 == 1 else "xf")
    return head + [f"{c}*" if n == between and c != UNDEFINED else c for n, c in enumerate(cells)]


def _data(evaluations: Sequence[Mapping[str, Any]], found: Found, names: Sequence[str]) -> dict[str, Any]:
    comments = {key: value for one in evaluations for key, value in one["comments"].items()}
    return {
        "format": "stepgauge overlay 1",
        "comments": comments,
        "evaluations": list(names),
        "differences": [
            {"evaluation": name, "placement": one.placement, "faces": _face_data(one)}
            for name, by in zip(names[1:], found, strict=True)
            for one in by
        ],
    }


def _face_data(one: Difference) -> list[dict[str, Any]]:
    return [
        {"face": int(face), "nominal_mm": float(one.nominal_mm[i])}
        | {f"{e}_um": defined(one.of(e)[i]) for e in ERRORS}
        | {f"U_{e}_um": defined(one.expanded_um[e][i]) for e in ERRORS}
        for i, face in enumerate(one.face)
    ]
