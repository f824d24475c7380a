"""Locate: 16 points, pasted or as a file, to the placement; the gauge in the machine's travel, and what disagrees."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.folder import existing, free_name, listed
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.pasting import complete_points_text
from stepgauge.web.render import json_answer, render, site_of
from stepgauge.web.site import Site
from stepgauge.web.uploads import read_upload

if TYPE_CHECKING:
    from stepgauge.alignment.agreement import Agreement

POINTS, REFUSED = "points.csv", "points-refused.csv"
"""Points that make a placement are kept, each set in a file of its own; of refused ones the last, to be looked at."""
PLACES = ("front", "front", "front", "side_plus", "side_minus", "top", "rail", "back")


def show(request: Request) -> Response:
    """The form, and the placement as it is."""
    site = site_of(request)
    has_placement = site.has_project and Path(site.placement).exists()
    points = POINTS if (site.folder / POINTS).exists() else ""
    files = listed(site.folder, [".csv"], deep=0)
    content: dict[str, Any] = {"has_placement": has_placement, "points": points, "files": files}
    return render(request, "locate.html.j2", **content, whole=_whole(site))


def _whole(site: Site) -> str:
    """First and last block of the project's gauge."""
    import stepgauge as sg

    try:
        return f"1:{sg.read_gauge(site.stated('gauge')).n_faces // 2}"
    except InputError:
        return ""


@dataclass(frozen=True)
class PointSet:
    """What is located: the points' file, its blocks, and whether the gauge is known to be turned."""

    points: str
    blocks: str
    turned: bool

    def query(self) -> dict[str, str]:
        """As an address has it."""
        return {"points": self.points, "blocks": self.blocks, "turned": "1" if self.turned else ""}


def locate(request: Request, form: Form) -> Response:
    """The placement as ``stepgauge locate`` writes it, or what is wrong with the points, and which one."""
    site = site_of(request)
    name = _points_file(site, form)
    asked = PointSet(name, form.text("blocks"), form.has("turned"))
    error: InputError | None = None
    try:
        _write_placement(site, asked)
        asked = _accepted(site, asked)
    except InputError as wrong:
        error = wrong
    judged = _judged(site, asked)
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
    _check_readable(data)
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


def _check_readable(data: bytes) -> None:
    """:class:`InputError` that names the file as the person knows it."""
    from stepgauge.importing.sixteen import read_sixteen

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / POINTS
        path.write_bytes(data)
        try:
            read_upload(data, POINTS, read_sixteen, str(path))
        except InputError as error:
            raise error.at(error.where.replace(f"{folder}/", "")) from None


def _write_placement(site: Site, asked: PointSet) -> None:
    import stepgauge as sg

    placement = sg.locate(
        asked.points,
        site.stated("gauge"),
        machine=site.stated("machine"),
        blocks=asked.blocks or None,
        turned=asked.turned,
    )
    with site.writing():
        placement.write(site.placement)


def _judged(site: Site, asked: PointSet) -> Agreement | None:
    from stepgauge.alignment.agreement import agreement
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.importing.sixteen import read_sixteen
    from stepgauge.planning.plan import parse_blocks

    gauge = read_gauge(site.stated("gauge"))
    points = read_sixteen(existing(site.folder, asked.points))
    return agreement(points, gauge, parse_blocks(asked.blocks or ":", gauge), asked.turned)


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
    from stepgauge.importing.sixteen import read_sixteen
    from stepgauge.machine.file import read_machine

    site, query = site_of(request), request.query_params
    gauge = read_gauge(site.stated("gauge"))
    travel_mm = read_machine(site.stated("machine")).travel_mm
    points, lies = None, None
    suspects: tuple[int, ...] = ()
    if name := query.get("points"):
        points = read_sixteen(existing(site.folder, name))
        judged = _judged(site, PointSet(name, query.get("blocks", ""), bool(query.get("turned"))))
        lies, suspects = (None, ()) if judged is None else (judged.lies, judged.suspects)
    elif Path(site.placement).exists():
        lies = read_placement(site.placement, gauge)
    return json_answer(request, placement_scene(gauge, lies, points, suspects, travel_mm).to_json())


ROUTES = [
    Route("/locate", show),
    Route("/locate", form_endpoint(locate), methods=["POST"]),
    Route("/locate/scene.json", scene),
]
