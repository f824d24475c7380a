"""Import: any table or log, with what its columns were taken for, what was rejected, and questions as choices."""

from __future__ import annotations

import datetime
import hashlib
import io
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError, naming
from stepgauge.web.evaluations import placement_axes
from stepgauge.web.fields import Field, verb_fields
from stepgauge.web.folder import existing, free_name, listed, relative
from stepgauge.web.forms import Form, form_endpoint, read_upload
from stepgauge.web.pages.locate import check_sixteen, complete_points_text
from stepgauge.web.pages.machine import stated
from stepgauge.web.recordings import recording_choices
from stepgauge.web.render import address, render, site_of, words_of
from stepgauge.web.site import Site
from stepgauge.web.texts import PASTED

if TYPE_CHECKING:
    from stepgauge.importing.result import Imported
    from stepgauge.importing.tables.questions import QuestionAnswer

GAUGE = "gauge"
"""What was measured: the step gauge of the project, touched; else the sensor that looked along an axis."""
TOUCH = "touch"
FIRST_NAME = "recordings/measured.csv"
SEVERAL = ("columns", "rows", "constants", "accept")
"""Arguments to which an answer is added; in others it takes the place of what was there."""
SINGLE = (
    *("sensor", "unit", "deviation_unit", "temperature_unit", "points", "placement_number", "tip_radius_mm", "format"),
    *("header", "table", "sheet", "delimiter", "decimal", "targets", "temperature_convention"),
)
TYPED = ("header", "targets")
"""Arguments of which a suggestion is an example, and no list to select from."""
HEADER = "=HEADER"
"""Where a choice leaves open which column it is."""
PAGE_OF = {"gauge": "/gauge", "machine": "/machine", "placement": "/locate", "program": "/plan"}
"""Where something is stated that an import needs and this page does not ask for."""
MOST_TRIED = 4
"""Programs that are tried in the place of one that does not fit."""
PROGRAMS = (".dmi", ".ngc", ".ipp", ".nc", ".mpf", ".h", ".gcode", ".jyc", ".tap")
GROUPS = {
    "length": ("target", "reading", "x_mm", "y_mm", "z_mm", "from", "to", "face"),
    "difference": ("deviation", "correction"),
    "order": ("way", "cycle", "time_s", "placement", "approach_i", "approach_j", "approach_k"),
    "unused": ("dropped",),
}
"""Colours of columns by what they were taken for; all others are of the fourth kind."""


def show(request: Request) -> Response:
    """The form; what it leads to follows as soon as there is something to read."""
    from stepgauge.axis.sensors import SENSORS
    from stepgauge.recording.conventions import CONVENTIONS

    site = site_of(request)
    machine = stated(site)
    saved = request.query_params.get("saved", "")
    ready = site.has_project and Path(site.placement).exists()
    return render(
        request,
        "importing.html.j2",
        ready=ready,
        sensors=SENSORS,
        conventions=CONVENTIONS,
        convention=machine.table.temperature_convention if machine else None,
        name=relative(site.folder, str(free_name(site.folder, FIRST_NAME))),
        programs=listed(site.folder, PROGRAMS, deep=1),
        placements=placement_axes(site) if ready else {},
        saved=saved,
        choices=recording_choices(site, [relative(site.folder, saved)]) if saved else [],
        of_axis=bool(saved) and _is_of_axis(site, saved),
    )


def _is_of_axis(site: Site, name: str) -> bool:
    """Whether a recording is none of a gauge, which alone can be evaluated."""
    from stepgauge.axis.recording import is_axis_recording

    return is_axis_recording(existing(site.folder, name))


def look(request: Request, form: Form) -> Response:
    """What the file was taken for, with what is open; nothing is written."""
    imported, answers, error = None, [], None
    if "file" in form.files or form.has("pasted"):
        try:
            answers = list(_answers(form))
            imported = _imported(site_of(request), form, answers)
        except InputError as wrong:  # shown with the choices, one of which may be why: each can be taken back
            error = wrong
    sixteen = (imported is None or imported.recording is None) and _is_sixteen(form)
    content: dict[str, Any] = {
        "imported": imported,
        "answers": answers,
        "error": error,
        "sixteen": sixteen,
        "fitting": _fitting_program(site_of(request), form, answers) if error is not None and not sixteen else "",
        "of": _checksum(form),
        "taken": [f"{one.argument}={one.value}" for one in answers],
        "needed": _needed(request, form, imported),
        "placed": _placed(site_of(request), form, imported),
        "machine": _machine(imported),
    }
    return render(request, "importing_part.html.j2", **content, group=_group, open_to=_open_to, page_of=PAGE_OF)


def _is_sixteen(form: Form) -> bool:
    """Whether it is the 16 points of a placement that were taken for readings."""
    data = form.files.get("file") or form.text("pasted").encode()
    if not data:
        return False
    try:
        check_sixteen(complete_points_text(data.decode("utf-8", "replace")).encode())
    except InputError:
        return False
    return True


def _fitting_program(site: Site, form: Form, answers: Sequence[QuestionAnswer]) -> str:
    """The newest program with which the readings can be taken, where they cannot with the one that is selected."""
    for name in listed(site.folder, PROGRAMS, deep=1)[:MOST_TRIED] if form.text("program") else ():
        with suppress(InputError):
            given = replace(form, texts={**form.texts, "program": name})
            if name != form.text("program") and _imported(site, given, answers).recording is not None:
                return name
    return ""


def _placed(site: Site, form: Form, imported: Imported | None) -> tuple[str, str] | None:
    """The placement on which touches of a gauge are, with its axis in words; None for what needs none."""
    from stepgauge.recording import Recording

    if imported is None or not isinstance(imported.recording, Recording):
        return None
    known = placement_axes(site)
    name = form.text("placement") or next(iter(known), "")
    return (name, known[name]) if name in known else None


def _machine(imported: Imported | None) -> str:
    """The machine that the recording is of; empty where none is known."""
    found = None if imported is None else imported.recording
    return "" if found is None else found.comments.get("machine", "")


def _needed(request: Request, form: Form, imported: Imported | None) -> list[str]:
    """What a decision on these readings needs and has not: the day, the temperature, and all that prevents one."""
    from stepgauge.conditions.gauge import UNRECORDED
    from stepgauge.evaluation.evaluate import evaluate
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.recording import Recording
    from stepgauge.recording.conventions import complete_by_machine

    found = None if imported is None else imported.recording
    if not isinstance(found, Recording):
        return []
    site, words = site_of(request), words_of(request)
    machine = stated(site)
    needed = [] if found.comments.get("measured_at") or form.has("measured_on") else [words.label("measured_on")]
    try:
        recording = complete_by_machine(found, machine.table if machine else None)
        conditions = evaluate(recording, read_gauge(site.stated("gauge"))).conditions
    except InputError as error:
        return [*needed, words.said(error)]
    open_ = [one for one in conditions if one.state == "prevents" or one.found == UNRECORDED]
    if "gauge_temperature_C" not in found.columns and not any(one.found == UNRECORDED for one in open_):
        needed.append(words.label("gauge_temperature"))  # readings that are corrected by it: a part of U
    for one in open_:
        expected = f"; {words('page.expected')} {words.message(one.expected)}" if one.expected else ""
        needed.append(words.message(one.sentence) + expected)
    return needed


def _checksum(form: Form) -> str:
    """Of what is imported: the choices of one file are none of another."""
    return hashlib.sha256(form.files.get("file") or form.text("pasted").encode()).hexdigest()[:16]


def _open_to(choice: QuestionAnswer) -> str:
    """How the page asks for a choice: a value to ``tick``, a column or value to ``select``, text to ``type``.

    Empty where it has another field or page for it.
    """
    if choice.argument not in (*SEVERAL, *SINGLE):
        return ""
    if choice.value.endswith(HEADER):
        return "column"
    if choice.value:
        return "tick"
    return "select" if choice.suggestions and choice.argument not in TYPED else "type"


def _group(taken: str) -> str:
    return next((name for name, some in GROUPS.items() if taken in some), "other")


def _answers(form: Form) -> Iterable[QuestionAnswer]:
    """The choices of this form: those that are kept, those of the questions, and what was typed for one."""
    from stepgauge.importing.tables.questions import QuestionAnswer

    if form.text("answers_of", _checksum(form)) != _checksum(form):
        return
    texts = form.text("answer").split("\n")
    texts += [form.text(f"question_{n}") for n in range(1, 20)]
    for text in dict.fromkeys(one for one in texts if "=" in one):
        argument, _, value = text.partition("=")
        value = value or form.text(f"typed_{argument}")
        if argument not in (*SEVERAL, *SINGLE):
            raise InputError(naming("answer"), naming("not_a_choice"), found=repr(text))
        if value:
            yield QuestionAnswer(argument, value)


def _imported(site: Site, form: Form, answers: Sequence[QuestionAnswer]) -> Imported:
    """What the file is; of a gauge that is located, positions of its faces are not asked about any more."""
    sensor = next((one.value for one in answers if one.argument == "sensor"), "")
    given = dict[str, Any](_known(site, form))
    if sensor not in ("", TOUCH):  # of one axis, to which no file of the project belongs
        given = {}
    for one in answers:
        given[one.argument] = [*given.get(one.argument, ()), one.value] if one.argument in SEVERAL else _typed(one)
    data = form.files.get("file") or form.text("pasted").encode()
    name = form.names.get("file", PASTED) if "file" in form.files else PASTED
    found = _read(data, name, given)
    if sensor or "placement" not in given or not _asks_for_touch(found):
        return found
    along = _read(data, name, given | {"sensor": TOUCH})
    return found if _asks_for_touch(along) else along


def _read(data: bytes, name: str, given: Mapping[str, Any]) -> Imported:
    import stepgauge as sg

    source = io.BytesIO(data)
    source.name = name
    return read_upload(data, name, sg.import_recording, source, **given)


def _asks_for_touch(found: Imported) -> bool:
    """Whether it is open if a table has positions along the gauge, which a touch probe found."""
    return any((one.argument, one.value) == ("sensor", TOUCH) for asked in found.questions for one in asked.choices)


def _typed(answer: QuestionAnswer) -> Any:
    """The value as the import takes it; of numbers only what is one."""
    if answer.argument not in ("table", "placement_number", "tip_radius_mm"):
        return answer.value
    value = Form({answer.argument: answer.value}, {}).number(answer.argument, 0.0, 1e6)
    return value if answer.argument == "tip_radius_mm" else int(value or 0)


def _known(site: Site, form: Form) -> Iterable[tuple[str, Any]]:
    """What the project and the form say beside the file."""
    sensor = form.text("sensor", GAUGE)
    if sensor != GAUGE:
        yield "sensor", sensor
        return
    yield from (("gauge", site.stated("gauge")), ("machine", site.stated("machine")))
    if form.text("placement"):
        yield "placement", str(existing(site.folder, form.text("placement")))
    elif Path(site.placement).exists():
        yield "placement", site.placement
    if form.text("program"):
        yield "program", str(existing(site.folder, form.text("program")))
    temperature = verb_fields("import", only=("gauge_temperature_C",))["gauge_temperature_C"].read(form)
    if temperature is not None:
        yield "gauge_temperature_C", temperature
    if form.text("temperature_convention"):
        yield "temperature_convention", form.text("temperature_convention")


def save(request: Request, form: Form) -> Response:
    """Write the recording into the project."""
    site = site_of(request)
    place = Path(form.text("output", FIRST_NAME))
    if place.suffix != ".csv" or place.parent == Path("."):
        raise InputError(naming("output"), naming("not_a_recording"), expected="recordings/NAME.csv")
    imported = _imported(site, form, list(_answers(form)))
    imported = _dated(imported, form)
    target = free_name(site.folder, str(place))
    with site.writing():
        target.parent.mkdir(parents=True, exist_ok=True)
        imported.write(target)
    saved = relative(site.folder, str(target))
    return render(request, "gone.html.j2", address=address("/importing", saved=saved))


def _dated(imported: Imported, form: Form) -> Imported:
    """With the day of the measurement, which a table seldom says, and without which no certificate has an age."""
    from stepgauge.recording import Recording

    found, day = imported.settled(), Field("measured_on", "date").read(form)
    if not isinstance(found, Recording) or found.comments.get("measured_at"):
        return imported
    if day is None:
        raise InputError(naming("measured_on"), naming("not_filled_in"))
    if day > datetime.date.today():
        raise InputError(naming("measured_on"), naming("in_the_future"), found=day.isoformat())
    return replace(imported, recording=found.assign_comments(measured_at=day.isoformat()))


ROUTES = [
    Route("/importing", show),
    Route("/importing/look", form_endpoint(look), methods=["POST"]),
    Route("/importing", form_endpoint(save), methods=["POST"]),
]
