"""What is printed is German throughout where that is asked for: words, numbers, days, figures."""

from __future__ import annotations

import ast
import datetime
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import stepgauge
from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.diagnosis.maps.diagnose import MapModel, diagnose_map, read_probe_table
from stepgauge.figures.arrows import arrows_figure
from stepgauge.figures.history import history_figure
from stepgauge.figures.path import path_figure
from stepgauge.fleet.hierarchical.infer import infer
from stepgauge.gauge.certified import Gauge
from stepgauge.history.series import make_series
from stepgauge.languages.messages import read_german, translate_printed
from stepgauge.reports.content import Sources, make_content
from stepgauge.reports.diagnosis import story_of
from stepgauge.reports.drift import drift_content
from stepgauge.reports.fleet import fleet_story
from stepgauge.reports.investigation import investigation_story
from stepgauge.reports.iso230 import positioning_content
from stepgauge.reports.iso10360_5 import probing_content
from stepgauge.reports.overlay import overlay_content
from stepgauge.reports.page import UserStatements
from stepgauge.reports.render import set_in_print
from stepgauge.reports.sections import comment_line
from stepgauge.standards.difference import differences
from stepgauge.standards.drift import Drift, drift_test
from stepgauge.standards.iso230_decision import Requirement
from stepgauge.standards.iso10360_5 import probing_test
from stepgauge.standards.mpe import Mpe
from stepgauge.standards.positioning_axis import axis_positioning_test
from stepgauge.verbs.test.iso230 import iso230 as positioning
from stepgauge.verbs.test.iso10360 import iso10360 as length
from tests.axis.made import axis
from tests.dcc.made import evaluated, laboratory
from tests.diagnosis.made import made as diagnosis_of
from tests.diagnosis.made import made_unknown as diagnosis_with_structure
from tests.diagnosis.test_probe_map import changed, measured
from tests.fleet.crossed_made import crossed, fleet
from tests.measured import lay, one_placement, run, shipped
from tests.standards.made import made
from tests.standards.test_iso10360_5 import SPHERE, TIP_MM, five
from tests.test_figures_measurement import entry
from tests.test_overlay import of_seed
from tests.test_overlay import said as evaluation_said
from tests.web.gathered import ROOT, _templates

DAY = datetime.date(2026, 5, 4)
STATED = UserStatements(DAY, "4711.5", "Customer & Sons 2.5", "Hall 3", "A. Meyer", "Made with 1.5 mm of dirt", "de")
ENGLISH = re.compile(
    r"\b(the|is|are|what|this|not|and|with|of|which|by|from|at|no|to|over|along|error|largest|gauge|certificate|calibration)\b"
)
ALIKE = {
    *("air", "polar", "polar (°)", "Name", "Block", "Material", "Software", "Position", "MPE", "R_eff", "Monte Carlo"),
    *("XF", "XB", "XM", "XR"),
}
"""Words that are the same in both languages."""


def content(placements: int = 1, mpe: str | None = "30", **sources: Any) -> dict[str, Any]:
    evaluation, budget = evaluated(placements)
    gauge, machine = shipped()
    given = {"gauge": gauge, "machine": machine, "budget": budget, "mpe": Mpe.parse(mpe) if mpe else None, **sources}
    return make_content(evaluation, STATED, Sources(**given))


def whole_budget() -> Any:
    """Without gaps, for only that makes a certificate."""
    return evaluated(1)[1].model_copy(update={"not_included": []})


JOINED = {
    *("End of calibration certificate {}", "End of the calibration certificate", "1 cycles", "Pass", "Undecidable"),
    *("End of report of measurement {}", "End of the report of measurement", "From block", "From blocks"),
    "The temperature of the gauge was not recorded: lengths are not corrected for it.",
    "The temperature of the gauge of placement {} was not recorded: lengths are not corrected for it.",
    "{} um per m of the certificate's uncertainty are proportional to the position and common to all faces",
    "gauge temperature of placement {} (certified positions are used uncorrected)",
    *("From block, placement {}", "From blocks, placement {}", "mean up ↑", "mean down ↓", "{}, mean B = {}"),
    *("{} mm, stated as such", "{} lengths in each position"),
    "Not measured: faces {}; what needs them is left undefined.",
    "all readings of a placement are off together, each placement by an amount of its own, along the approach",
    "Residuals before and after and without the structure, against what they may depend on",
    *("1 cause named", "{} causes named", "1 gauge", "1 hall", "1 machine", "1 probe", "1 machine type"),
    *("{} machine types", "1 visit (placements of a gauge on a machine): {}", "Diagnosis of {}, read by an {}"),
    *("machine reversal of {}", "machine scale of {}", "machine squareness of {}"),
    *("measure each gauge of them without the others", "measure each machine of them without the others"),
    *("wear of the fronts", "wear of the used blocks", "one azimuth of {} deg", "one polar angle of {} deg"),
    *("deviation after ({})", "deviation before ({})", "residual after", "residual after (µm)"),
    *("residual after,\nwithout the structure (µm)", "{}\nresidual after ({})", "change along machine {} (µm/m)"),
    "The answer does not have the odds of {} to 1 that were asked for: {}.",
    "with a chance of {} % it shows what was hidden so far ({})",
    *("{} by ISO 230-3:2020", "Environmental temperature variation error (ETVE)"),
    *("Thermal distortion by moving a linear axis", "arm azimuth {}"),
    "Only what such a sensor can have was looked for.",
    *(
        "Mean errors XM in the places of the gauge, magnified {} times",
        "Mean errors XM in the travel, magnified {} times",
    ),
    *("before compensation", "elevation about the stylus (°)", "scales x, y, z"),
    "targets by travel: 3 up to 90°, 5 up to 180°, 8 up to 360°",
    "Residuals before and after and without the structure; noise of a probing: {}",
}
"""Put together of several texts of the code."""
PAGES: dict[str, Callable[[], dict[str, Any]]] = {
    "pass": content,
    "fail": partial(content, 2, "0.01"),
    "bare": partial(content, gauge=None, machine=None, budget=None, mpe=None),
    "certificate": lambda: content(laboratory=laboratory(), budget=whole_budget()),
}


def judged(name: str) -> dict[str, Any]:
    """The report of a test by a standard, of readings that are not all within it."""
    gauge, machine = shipped()
    recording = made(gauge, lambda cycle, face: 0.004 * face + 0.3 * (cycle % 3), cycles=5)
    if name == "iso230":
        return positioning(recording, gauge, machine=machine, tolerances="A=2", expanded_uncertainty_um=0.5).content(
            STATED
        )
    return length(recording, gauge, machine=machine, mpe="0.4 + L/500", mpe_repeatability_um=0.5).content(STATED)


def diagnosed(name: str, language: str = "de") -> dict[str, Any]:
    """The page of a diagnosis of a recording of a gauge; several effects, or structure without a law."""
    recording, found = diagnosis_with_structure() if name == "unknown" else diagnosis_of(name)
    return story_of(replace(found, recordings=(recording,)), language)


def diagnosed_axis(language: str = "de") -> dict[str, Any]:
    def law(target: np.ndarray, way: np.ndarray) -> np.ndarray:
        return np.asarray(3.0 * np.sin(2.0 * np.pi * target / 5.0 + 1.0) + 1.5 * (way < 0) * (1.0 + target / 400.0))

    return story_of(diagnose_axis(axis(np.arange(0.0, 31.0) * 26.0, law)), language)


def diagnosed_map(language: str = "de") -> dict[str, Any]:
    table = read_probe_table("omp40-2-50mm")[0]
    data = measured(changed(table, carrier_mm=6.0, arm_azimuth_deg=-20.0))
    return story_of(diagnose_map(MapModel(table, "probe", data)), language)


def inferred() -> dict[str, Any]:
    """The page of a fleet with a cause of one owner and one that has two."""

    def wrong(own: Gauge, name: str, machine: str, axis: str, day: float) -> np.ndarray:
        ppm = 9.0 * (machine == "M20" and axis == "x") + 5.0 * (machine == "M3" and axis == "y" and day > 20_200)
        return np.asarray(ppm * own.position_mm * 1e-3)

    visits, gauges = fleet(8, [*crossed(8, 3, 2), ("M20", "G9"), ("M20", "G9"), *crossed(8, 3, 2)], wrong)
    only_x = [one for one in visits if one.machine != "M20" or one.statistics.axis[0] == 1.0]
    return {**fleet_story(infer(only_x, gauges).to_dict()), "own": ()}


def investigated() -> dict[str, Any]:
    """The page of an investigation of two runs, from what its file says."""
    effect = {"label": "reversal_error_x", "set": ["tip_change"], "own_probability": 0.7, "probability": 0.99}
    effect["parameters"] = {"size_um": {"value": 4.02, "u": 0.06, "unit": "um"}}
    summary = "effects: reversal error x (or tip change) (rms 0.86 -> 0.30 um, noise 0.29 um)"
    found = {"found": [effect], "unexplained": [], "matters_um": 0.322, "summary": summary, "verdict": "effects"}
    found |= {"entropy_nats": 1.3, "hypotheses": [{"words": "reversal error x and squareness xy", "probability": 0.6}]}
    nothing = {"found": [], "unexplained": [], "summary": "adequate (rms 0.29 -> 0.29 um, noise 0.28 um)"}
    nothing |= {"verdict": "adequate", "entropy_nats": 0.85, "hypotheses": [{"words": "nothing", "probability": 0.84}]}
    why = {"nats": 0.121, "minutes": 10.9, "tells_apart": ["tip change 2", "tip correction and reversal error x"]}
    why |= {"may_show": ["squareness", "scale_error"], "chance_hidden": 0.07}
    runs = [{"number": 1, "words": "the gauge as it lies", "why": None, "minutes": 2.8, "learnt": nothing}]
    place = "the gauge along the diagonal of x and -y, about (353, 518, 215) mm"
    runs.append({"number": 2, "words": place, "why": why, "minutes": 10.8, "learnt": found})
    said = {"machine": "Bridge CMM", "gauge": {"name": "Step gauge 420", "example": True}, "simulated": True}
    said |= {"end": {"how": "set", "why": "the answer stands", "stands": True}, "runs": runs, "minutes": 26.2}
    said |= {"machine_minutes": 16.2, "needed": [f"{place}, for which the time was too short"], "declined": [place]}
    return investigation_story({**said, "stepgauge": "0", "asked": {"odds": 20.0}})


def drifted(kind: str) -> dict[str, Any]:
    minutes = np.arange(0.0, 26.0 * 60.0, 5.0)
    names = ("X", "Y") if kind == "etve" else ("P1 +", "P1 −", "P2 +", "P2 −")
    moved = {name: 3.0 * np.sin(minutes / 200.0 + place) for place, name in enumerate(names)}
    air = {"air": 20.0 + np.sin(minutes / 300.0)}
    drift = Drift("drift.csv", 60.0 * minutes, moved, air, span_mm=400.0 if kind == "axis" else None)
    return drift_content(drift_test(drift, kind, Requirement.parse((), None, list(moved))), STATED)  # type: ignore[arg-type]


PAGES |= {name: partial(judged, name) for name in ("iso230", "iso10360")}
COMPOSED: dict[str, Callable[..., dict[str, Any]]] = {
    **{f"diagnosis, {name}": partial(diagnosed, name) for name in ("pair", "outliers", "null", "unknown")},
    "axis": diagnosed_axis,
    "map": diagnosed_map,
}
"""Pages of which a part is put into words in German, and not translated."""
PAGES |= {**COMPOSED, "fleet": inferred, "investigation": investigated}
PAGES |= {f"drift, {kind}": partial(drifted, kind) for kind in ("etve", "axis")}


def read_by_laser(**more: Any) -> dict[str, Any]:
    """The report of an axis that an instrument read."""
    off = {"units": ("mm", None), "both": True, **more}
    read = axis(np.linspace(0.0, 330.0, 12), lambda target, way: 0.01 * target + 1.5 * way, **off)
    return positioning_content(axis_positioning_test(read), STATED, None)


def probing(styli: int) -> dict[str, Any]:
    """The report of a probing test."""
    points = five(np.diag([3.0, 1.0, -2.0])[[0, 1, 2, 0, 1]])[:styli]
    return probing_content(probing_test(points, SPHERE, [TIP_MM]), STATED, "CMM")


def overlaid() -> dict[str, Any]:
    """An overlay of two evaluations."""
    both = [evaluation_said(of_seed(1)), evaluation_said(of_seed(2, 30.0))]
    return overlay_content(both, [differences(*both)], ["A", "B"], STATED)


def drawn() -> dict[str, Any]:
    """Figures of verbs, which no report has."""
    (result,) = one_placement().results
    gauge, machine = shipped()
    figures = [
        history_figure(make_series([entry(0, 1.0), entry(100, 2.0), entry(200, 3.5)]), {"scale_ppm": 2.0}, "CMM"),
        history_figure(make_series([entry(0, 1.0)]), {}, "CMM"),
        path_figure(run(1).path, gauge, lay(gauge), 2.0, 3),
        arrows_figure([result]),
        arrows_figure([result], machine.travel_mm, "CMM"),
    ]
    return {"figures": figures, "own": ()}


PAGES |= {
    "laser": read_by_laser,
    "one way": partial(read_by_laser, both=False),
    "rotary": partial(read_by_laser, units=("deg", None), sensor="autocollimator"),
    "one stylus": partial(probing, 1),
    "five styli": partial(probing, 5),
    "overlay": overlaid,
    "figures": drawn,
}
KEPT = {"data", "own", "version", "layout", "kind", "language", "name", "lines"}


def strings(value: Any) -> Iterator[str]:
    """All words of a page and of its figures."""
    if isinstance(value, dict):
        for key, one in value.items():
            yield from strings(one) if key not in KEPT else ()
    elif isinstance(value, list | tuple):
        for one in value:
            yield from strings(one)
    elif isinstance(value, Figure):
        value.draw_without_rendering()
        yield from (text.get_text() for text in value.findobj(Text))
    elif isinstance(value, str):
        yield value


@cache
def both(name: str) -> tuple[tuple[str, ...], tuple[str, ...], frozenset[str]]:
    """The words of a page in English and in German, and what people wrote."""
    page = PAGES[name]()
    own = frozenset(page["own"])
    words = tuple(dict.fromkeys(strings(page)))
    english = tuple(strings(COMPOSED[name](language="en"))) if name in COMPOSED else words
    return english, tuple(translate_printed(one, own) for one in words), own


@pytest.mark.parametrize("name", PAGES)
def test_no_english_is_left_in_a_german_page(name: str) -> None:
    english, told, own = both(name)
    assert len(english) > 40
    left = [one for one in told if one in set(english) and is_word(one, own)]
    assert left == []
    mixed = [one for one in told if ENGLISH.search(without(one, own))]
    assert mixed == []


def is_word(text: str, own: frozenset[str]) -> bool:
    return bool(re.search(r"[A-Za-z]{4}", without(text, own))) and text not in ALIKE


def without(text: str, own: frozenset[str]) -> str:
    """A text without what people wrote, names of files, and formulas."""
    for one in sorted(own, key=len, reverse=True):
        text = text.replace(one, "")
    return re.sub(r"\S+\.(csv|dmi|json|toml)\b|\bstep-gauge-\d+|[PL]_\w+\.\S+|\$[^$]*\$", "", text)


@pytest.mark.parametrize("name", PAGES)
def test_numbers_and_days_are_written_as_in_german(name: str) -> None:
    _, told, own = both(name)
    for text in told:
        assert not re.search(r"(?<![\w.])\d+\.\d+(?![\w.])", without(text, own)), text
        assert not re.search(r"\b\d{4}-\d\d-\d\d\b", without(text, own)), text


def test_what_people_wrote_stays() -> None:
    page = set_in_print(content())
    assert page["number"] == "4711.5"
    assert page["remarks"] == "Made with 1.5 mm of dirt"
    assert [row["value"] for row in page["identity"][0]["rows"]][:3] == ["4711.5", "04.05.2026", "Customer & Sons 2.5"]
    assert page["words"]["page"] == "Seite"


def test_components_ranges_and_days() -> None:
    assert translate_printed("(1.5, −2.25, 3.0) mm") == "(1,5; −2,25; 3,0) mm"
    assert translate_printed("2026-05-04 to 2026-05-05") == "04.05.2026 bis 05.05.2026"
    assert translate_printed("0.05 to 0.175 µm") == "0,05 bis 0,175 µm"
    assert (
        translate_printed("position-2026-05-04.csv, 1.2.3, ISO 10360-2")
        == "position-2026-05-04.csv, 1.2.3, ISO 10360-2"
    )
    assert translate_printed("2.5", ["2.5"]) == "2.5"


def test_every_text_of_the_table_is_still_in_the_code() -> None:
    files = [*ROOT.rglob("*.py"), *(Path(stepgauge.__file__).parent.parent / "templates/reports").glob("*")]
    code = "\n".join(path.read_text("utf-8") for path in files if "languages" not in path.parts)
    known = "\n".join([code, *(text for path in ROOT.rglob("*.py") for text in literals(path))])
    gone = {one for one in read_german("printed.toml") if not all(part in known for part in fragments(one))}
    assert gone - JOINED == set()


def fragments(text: str) -> list[str]:
    """The parts of a text between gaps and stops, of which the code puts it together."""
    return [part.strip(" .;:,()") for part in re.split(r"{}|[.;:,] | \(|\)|\n", text)]


def literals(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.JoinedStr | ast.Constant):
            yield from _templates(node, {}, 0)


def test_the_log_of_a_recording_is_named_without_its_form() -> None:
    """A German certificate said ``(table)``."""
    assert comment_line("log", "one.txt (table); two.txt (table)") == ("Log", "one.txt; two.txt")
