"""Locate: 16 points, pasted or as a file, to the placement; the gauge in the machine's travel, and what disagrees."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError, naming
from stepgauge.web.fields import Field, keywords, verb_fields
from stepgauge.web.folder import existing, free_name, listed, relative
from stepgauge.web.forms import Form, asked_form, form_endpoint, private_file, read_upload
from stepgauge.web.recordings import recording_files
from stepgauge.web.render import json_answer, render, run_verb, site_of
from stepgauge.web.site import Site, state

if TYPE_CHECKING:
    from stepgauge.alignment.slips import Agreement
    from stepgauge.files.arrays import Array
    from stepgauge.gauge.certified import Gauge


POINTS, REFUSED = "points.csv", "points-refused.csv"
"""Points that make a placement are kept, each set in a file of its own; of refused ones the last, to be looked at."""
PLACES = ("front", "front", "front", "side_plus", "side_minus", "top", "rail", "back")


@cache
def fields() -> dict[str, Field]:
    """What the form asks beside the points: parameters of ``locate``."""
    found = verb_fields("locate", only=("surface", "blocks", "turned"))
    return {**found, "blocks": replace(found["blocks"], label="points_on")}


def show(request: Request) -> Response:
    """The form, and the placement as it is."""
    from stepgauge.programs import DIALECTS

    site, query = site_of(request), request.query_params
    taught = query.get("taught", "")
    return render(
        request,
        "locate.html.j2",
        has_placement=site.has_project and Path(site.placement).exists(),
        files=listed(site.folder, [".csv"], deep=0),
        fields={**fields(), "blocks": replace(fields()["blocks"], default=_whole(site))},
        pasted=_example(site) if "example" in query else _refused(site),
        dialects={name: one.title for name, one in DIALECTS.items()},
        taught=taught if taught and (site.folder / relative(site.folder, taught)).is_file() else "",
    )


def _whole(site: Site) -> str:
    """First and last block of the project's gauge."""
    import stepgauge as sg

    try:
        return f"1:{sg.read_gauge(site.stated('gauge')).n_faces // 2}"
    except InputError:
        return ""


def _refused(site: Site) -> str:
    """The points that were refused last: what was wrong with them may be stated on another page."""
    place = site.folder / REFUSED
    return place.read_text("utf-8", "replace") if place.is_file() else ""


def _example(site: Site) -> str:
    """Rows of 16 tip centres on the project's gauge, along the longer way in the middle of the machine's travel."""
    import numpy as np

    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import block_distance_mm, make_placement
    from stepgauge.machine.file import read_machine
    from stepgauge.planning.teach import sixteen_points

    gauge, machine = read_gauge(site.stated("gauge")), read_machine(site.stated("machine"))
    blocks, radius = (1, gauge.n_faces // 2), machine.probe.tip_radius_mm
    axis = np.eye(3)[int(np.ptp(machine.travel_mm[:2], axis=1).argmax())]
    half = block_distance_mm(gauge, *blocks) / 2.0 * axis
    middle = machine.travel_mm.mean(axis=1)
    lies = make_placement(middle - half, middle + half, *blocks, np.array([0.0, 0.0, 1.0]), radius, gauge.table.serial)
    rows = enumerate(sixteen_points(lies, gauge, blocks, radius), 1)
    return "\n".join([HEADER, *(f"{n},{x:.4f},{y:.4f},{z:.4f}" for n, (x, y, z) in rows)])


@dataclass(frozen=True)
class PointSet:
    """What is located: the points' file, and what the form says of them, by its fields."""

    points: str
    texts: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, points: str, given: Form) -> PointSet:
        """The form's own fields alone."""
        return cls(points, tuple((name, given.text(name)) for name in fields() if given.has(name)))

    @property
    def keywords(self) -> dict[str, Any]:
        """For :func:`stepgauge.locate`."""
        return keywords(fields(), dict(self.texts))

    def query(self) -> dict[str, str]:
        """As an address has it."""
        return {"points": self.points, **dict(self.texts)}


def locate(request: Request, form: Form) -> Response:
    """The placement as ``stepgauge locate`` writes it, or what is wrong with the points, and which one."""
    site = site_of(request)
    name = _points_file(site, form)
    asked = PointSet.of(name, form)
    error: InputError | None = None
    try:
        _write_placement(site, asked)
        asked = _accepted(site, asked)
    except InputError as wrong:
        error = wrong.at(naming("points")) if wrong.where == REFUSED else wrong
    _, judged = _judged(site, asked)
    rows = [] if judged is None else _rows(judged)
    lines = _placement_lines(site) if not error else []
    placement = Path(site.placement).name
    return render(request, "locate_part.html.j2", asked=asked, error=error, rows=rows, lines=lines, placement=placement)


def _points_file(site: Site, form: Form) -> str:
    """The 16 points as a file of the project, refused until they are located; they are read before they are written."""
    if form.text("kept") and "points" not in form.files and not form.text("pasted"):
        return str(existing(site.folder, form.text("kept")).relative_to(site.folder))
    data = form.files.get("points") or complete_points_text(form.text("pasted")).encode()
    if not data:
        raise InputError("points", "there are none", expected="16 rows, pasted or as a file")
    check_sixteen(data)
    with site.writing():
        from stepgauge.files.outputs import replacing

        with replacing(site.folder / REFUSED) as beside:
            beside.write_bytes(data)
    return REFUSED


def _accepted(site: Site, asked: PointSet) -> PointSet:
    """The points that gave a placement, under a name by which they stay."""
    if asked.points != REFUSED:
        return asked
    with site.writing():
        place = free_name(site.folder, POINTS, (site.folder / REFUSED).read_bytes())
        (site.folder / REFUSED).replace(place)
    return replace(asked, points=str(place.relative_to(site.folder)))


def check_sixteen(data: bytes) -> None:
    """:class:`InputError`, by the name by which the person knows the file, where it has not the 16 points."""
    from stepgauge.importing.sixteen import read_sixteen

    with private_file(POINTS) as path:
        path.write_bytes(data)
        read_upload(data, POINTS, read_sixteen, str(path))


def _write_placement(site: Site, asked: PointSet) -> None:
    import stepgauge as sg

    placement = sg.locate(asked.points, site.stated("gauge"), machine=site.stated("machine"), **asked.keywords)
    place = Path(site.placement)
    if place.exists() and recording_files(site):
        place = _new_place(site)
    with site.writing():
        placement.write(place)


def _new_place(site: Site) -> Path:
    """A file for another placement, stated in the project: that of readings that were taken stays theirs."""
    from stepgauge.project.create import OUTPUTS

    place = free_name(site.folder, OUTPUTS["locate"])
    state(site, {"placement": relative(site.folder, str(place))})
    return place


def _tip_centres(site: Site, asked: PointSet, gauge: Gauge, blocks: tuple[int, int]) -> Array:
    """The points as they were probed; what speaks against that stands in the answer already."""
    from stepgauge.alignment.surface import tip_centres
    from stepgauge.importing.sixteen import read_sixteen
    from stepgauge.machine.file import read_machine

    said = asked.keywords
    surface = bool(said.get("surface"))
    points = read_sixteen(existing(site.folder, asked.points), surface)
    if not surface:
        return points
    radius = read_machine(site.stated("machine")).probe.tip_radius_mm
    try:
        return tip_centres(points, gauge, blocks, radius, turned=bool(said.get("turned")))
    except InputError:
        return points


def _judged(site: Site, asked: PointSet) -> tuple[Array, Agreement | None]:
    """The tip centres, and how they agree."""
    from stepgauge.alignment.slips import agreement
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.planning.plan import parse_blocks

    gauge, said = read_gauge(site.stated("gauge")), asked.keywords
    blocks = parse_blocks(said.get("blocks", ":"), gauge)
    points = _tip_centres(site, asked, gauge, blocks)
    return points, agreement(points, gauge, blocks, bool(said.get("turned")))


def _rows(judged: Agreement) -> list[dict[str, Any]]:
    return [
        {
            "point": number,
            "place": PLACES[(number - 1) % 8],
            "block": judged.lies.first_block if number <= 8 else judged.lies.last_block,
            "off_um": 1e3 * float(judged.off_mm[number - 1]),
            "suspect": number in judged.suspects,
        }
        for number in range(1, 17)
    ]


def _placement_lines(site: Site) -> list[str]:
    import stepgauge as sg

    return sg.read_placement(site.placement, site.stated("gauge")).summary().splitlines()


def scene(request: Request) -> Response:
    """Gauge, points and travel in 3D; by the points, or as the placement file says."""
    from stepgauge.figures.placement_scene import placement_scene
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.machine.file import read_machine

    site, query = site_of(request), request.query_params
    gauge = read_gauge(site.stated("gauge"))
    travel_mm = read_machine(site.stated("machine")).travel_mm
    points, lies = None, None
    suspects: tuple[int, ...] = ()
    if name := query.get("points"):
        points, judged = _judged(site, PointSet.of(name, asked_form(request)))
        lies, suspects = (None, ()) if judged is None else (judged.lies, judged.suspects)
    elif Path(named := query.get("placement") or site.placement).exists():
        lies = read_placement(relative(site.folder, named), gauge)
    return json_answer(request, placement_scene(gauge, lies, points, suspects, travel_mm).to_json())


def teach(request: Request, form: Form) -> Response:
    """``stepgauge plan --teach``: a program that touches the 16 points, which were only gone to by hand."""
    from stepgauge.programs import DIALECTS

    site, dialect = site_of(request), form.text("dialect")
    if dialect not in DIALECTS:
        raise InputError(naming("dialect"), naming("not_a_choice"), found=repr(dialect))
    blocks = ["--points-on", form.text("blocks")] if form.has("blocks") else []
    program = f"teach{DIALECTS[dialect].suffix}"
    words = ["plan", _points_file(site, form), "--teach", *blocks, "--dialect", dialect, "-o", program]
    return run_verb(request, words, "/locate", taught=program)


ROUTES = [
    Route("/locate", show),
    Route("/locate/teach", form_endpoint(teach), methods=["POST"]),
    Route("/locate", form_endpoint(locate), methods=["POST"]),
    Route("/locate/scene.json", scene),
]


HEADER = "point,x_mm,y_mm,z_mm"
APART = (r"\t+", r"\s*;\s*", r"\s+", r"\s*,\s*")
_NUMBER = re.compile(r"[+-]?\d+([.,]\d+)?([eE][+-]?\d+)?")


def complete_points_text(text: str) -> str:
    """Rows of three or four numbers without a header get one, and numbers in order where they have none.

    Cells are apart by tabs, semicolons, blanks, or commas; a comma is a decimal mark where the cells are apart by
    something else. A cell that is no number stays in its row among such rows, for the reader of points to name it.
    Anything else is given to that reader as it is, which says what is wrong with it.
    """
    lines = [line.strip() for line in text.strip().splitlines() if line.strip()]
    rows = [_cells(line) for line in lines]
    if lines and rows[0] is not None and rows.count(None) < len(rows) / 2:
        rows = [row or _divided(line, len(rows[0])) for line, row in zip(lines, rows, strict=True)]
    if not rows or any(row is None for row in rows) or len({len(row or ()) for row in rows}) != 1:
        return text
    cells = [row for row in rows if row is not None]
    if len(cells[0]) == 3:
        cells = [[str(number), *row] for number, row in enumerate(cells, 1)]
    return "\n".join([HEADER, *(",".join(row) for row in cells)]) + "\n"


def _divided(line: str, count: int) -> list[str] | None:
    """So many cells, whatever is in them."""
    divided = ([one for one in re.split(apart, line) if one] for apart in APART)
    return next((cells for cells in divided if len(cells) == count and not any("," in cell for cell in cells)), None)


def _cells(line: str) -> list[str] | None:
    """Three or four numbers with a decimal point, None where the line has anything else."""
    for apart in APART:
        cells = [one for one in re.split(apart, line) if one]
        if len(cells) in (3, 4) and all(_NUMBER.fullmatch(one) for one in cells):
            return [one.replace(",", ".") for one in cells]
    return None
