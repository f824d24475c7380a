"""Whatever the program says on a page is German there: gathered from the code, not from a list."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stepgauge as sg
from stepgauge.dcc.face_table import ROLES
from stepgauge.errors import InputError, naming
from stepgauge.languages.messages import catalogue, read_german, said_in_german, translate_message, unchanged
from stepgauge.web.texts import Words
from tests.web.gathered import english_words, gathered

GAP = re.compile("{}")


def test_every_text_of_the_code_has_its_german_and_few_are_kept_that_are_gone() -> None:
    texts, known = gathered(), {*read_german("messages.toml"), *unchanged()}
    assert len(texts) > 1000
    assert {text: sorted(files)[0] for text, files in texts.items() if text not in known} == {}
    gone = known - set(texts) - OF_SEVERAL
    assert len(gone) < 0.02 * len(known), gone


OF_SEVERAL = {
    *(
        "{} {}, beyond the limit {} {}{}",
        "{}, which separates it from {}",
        "{} placement",
        "{} placements",
        "simulated",
    ),
    *("read back as {}: the same {}", "moves to {} mm", "directions", "speeds and distances", "units", "coordinates"),
    *("{}, which separates it from {} (the command below)", "{} or {}"),
    *("{}, which may separate it from {}", "{}, which may separate it from {} (the command below)"),
    *("{} (expected information {} of {} nats)", "map more polar angles", "map all azimuths at 60 and 90 deg"),
    *("load the force gauge with a known weight of about 1 N", "measure the trigger force too"),
    *("measure the force that lifts the stylus along its axis", "measure the deflection of the tip too"),
    "measure the same directions with a stylus longer by {} mm",
    "no measurement with this probe separates them; open it and measure its seat",
    "measure at targets whose spacing is changed by irregular parts, by up to 30 % of it as ISO 230-2 asks, and"
    " diagnose that recording: for example at {} {}.",
    *("nothing within this travel separates it from {}",),  # of a diagnosis that was written before
    "nothing within this travel: in every placement and at every speed they look alike; log temperatures",
    *("{} nm/reading", "Corrected tip radius", "touch", "{} at {}", "'{}' and '{}'"),
    *("uncertainty", " (looks like {}: a span of {} where {} mm is expected)"),
    "{} is aimed beside the blocks of the gauge as placed (looks like {}: a span of {} where {} mm is expected)",
    *("another one after it separates it from {}", "{} (the command below)"),
    "no measurement within this travel is sure to separate it from {}",
    *(
        "point {} of {} (line {})",
        "key {}",
        "first block",
        "last block",
        "also {}",
        "{} -> {} (from {})",
        "point",
        "spaces",
        "cycle {}",
    ),
    *(
        "{} by {}: {} readings at {} targets, {} cycles, in {}, deviations in {}",
        "{} by {}: {} readings, {} cycles, in {}, deviations in {}",
    ),
    *("the measuring speed is beyond the limit", "the travel speed is beyond the limit", "{}, at face {}"),
    *(
        "{} missing",
        "{} doubled",
        "{} order",
        "line {}",
        "line {} missing",
        "line {} doubled",
        "line {} order",
        "line {} foreign",
    ),
    *("axis", "comma", "semicolon", "tab", "{}, {}-separated", "mapped: {}"),
    *("tool", "; the tip radius is the server's affair: its tool {} must have {} mm"),
    *("simulated", "adequate", "effects", "insufficient", "unknown", "drift of the gauge since its calibration"),
}
"""Put together of several texts of the code, and single words that a file of a result has."""


def test_a_text_has_as_many_gaps_in_german_and_says_something_else() -> None:
    for text, german in catalogue().items():
        assert len(GAP.findall(text)) == len(GAP.findall(german)), text
        assert not re.search(r"\b(the|is|are|not|and|with|which|expected)\b", re.sub('{}|"[^"]*"', "", german)), german
        assert (text[:1] == " ", text[-1:] == " ") == (german[:1] == " ", german[-1:] == " "), text


def test_every_text_is_recognized_with_its_gaps_filled() -> None:
    """No other text takes it for its own."""
    for text, german in catalogue().items():
        gaps = [f"Q{number}Q" for number in range(text.count("{}"))]
        filled = [text, german]
        for gap in gaps:
            filled = [one.replace("{}", gap, 1) for one in filled]
        assert translate_message(filled[0]) == filled[1], text


def test_a_number_gets_its_comma_and_what_was_written_stays() -> None:
    assert translate_message("2.5 mm stated") == "angegeben sind 2,5 mm"
    assert translate_message("column 'x.1' is not a number") == "Spalte 'x.1' ist keine Zahl"
    assert Words("de").message("drift; 0.25 um") == "drift; 0,25 µm"
    assert "(um z)" in Words("de").message("yaw (about z) 89.6 deg, u 0.8 um per m")
    assert Words("en").message("at 20.30 deg C, 'x um'; 0.25 um") == "at 20.30 °C, 'x um'; 0.25 µm"
    assert translate_message("version 1.2.3, 20.4 deg C") == "version 1.2.3, 20,4 °C"


def test_a_verb_that_failed_ends_in_german() -> None:
    error = InputError("recordings/a.csv row 5", "column x_mm is not a number", found="'a'", expected="a finite number")
    assert said_in_german(f"stepgauge: error: {error}") == (
        "recordings/a.csv Zeile 5: Spalte x_mm ist keine Zahl; gefunden: 'a'; erwartet: eine endliche Zahl"
    )
    told = InputError(naming("tip_radius_mm"), "the tip radius is not known").cli_text()
    assert Words("de").ended(f"stepgauge: error: {told}").endswith("der Tastkugelradius ist nicht bekannt")
    assert Words("en").ended(f"stepgauge: error: {told}").endswith("the tip radius is not known")


@pytest.mark.parametrize(
    "table",
    [
        "Position;Messwert\n0;0,001\n10;10,002\n",
        "a;b;c\n1;2;3\n2;3;4\n3;4;6\n",
        "target_mm,reading_mm,Temp\n0,0.001,20.1\n10,10.002,20.2\n20,20.004,20.3\n",
        "x,y,z\n1,2\n",
        "",
    ],
)
def test_what_an_import_says_and_asks_is_german(table: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("a.csv")
    path.write_text(table, encoding="utf-8")
    words = Words("de")
    try:
        found = sg.import_recording(path, sensor="laser")
    except InputError as error:
        said = [words.said(error)]
    else:
        asked = [part for one in found.questions for part in (one.text, *(choice.words for choice in one.choices))]
        said = [words.message(line) for line in (*asked, *found.report, *found.rejected)]
    assert said
    for line in said:
        assert not ENGLISH.search(re.sub(r"'[^']*'|\"[^\"]*\"", "", line)), line


ENGLISH = re.compile(r"\b(the|is|are|not|of|and|with|column|columns|taken|row|rows|expected|readings|if)\b")


def test_a_message_is_german_as_a_whole_or_not_at_all() -> None:
    assert translate_message("point 40 of the order 'blocks' of 5 cycles") == (
        "Punkt 40 (die Reihenfolge 'blocks' von 5 Durchgängen)"
    )
    assert translate_message("some of what is there; point 40 is missing") == "some of what is there; Punkt 40 fehlt"
    for text in ("column no one knows is missing", "gauge: which is there", "3 of the things of 5"):
        assert translate_message(text) == text


SAID = (
    "point 3 is off by 1573.98 mm; 3 is at (1747.421, 402.409, 149.444), by the others near (173.44, 396.62, 148.04)",
    "one point is off, the others cannot tell which: point 3 by 0.4 mm, point 5 by 0.3 mm",
    "the columns x_mm and y_mm look exchanged (or points 4 and 5, and 12 and 13)",
    *("10 at 140", "-0.0008 beside 154.999 and 140", "'Messwert' and 'Abweichung'"),
    "mapped: Zyklus -> cycle, Nennmass -> target, Messwert -> reading, Abweichung -> deviation",
    "mapped: Zyklus -> cycle, Flaeche -> face, X -> x_mm (from mm), Y -> y_mm (from mm), Z -> z_mm (from mm)",
    "the probing is aimed beside the blocks of the gauge as placed"
    " (looks like m: a span of 0.4 where 400 mm is expected)",
    *(f"two columns are taken for the {role}" for role in ROLES[:-1]),
    *(f"the unit of the {role} is not stated, and 0.03 may be mm or um" for role in ROLES[:-1]),
    "the readings drift by +14.7 nm/reading (u = 2.8), 0.337 um from the first to the last face of a cycle: it is in"
    " the errors along the gauge, unless it is corrected",
)
"""What pages said to a technician, in part in English: texts that are put together when they are said."""


@pytest.mark.parametrize("said", SAID)
def test_what_is_put_together_when_it_is_said_is_german_too(said: str) -> None:
    """Whether a text has its German was asked of the texts of the code alone, with gaps that hold no words."""
    assert english_words(Words("de").message(said)) == []


def test_a_fault_of_a_file_is_german_where_the_project_lists_it() -> None:
    error = InputError("machine/m.toml", "not the file of the budget (b.json): key machine.kind", found="cmm")
    told = Words("de").ended(error.cli_text())
    assert english_words(told.replace("cmm", "")) == []
    assert "gefunden: cmm" in told


def test_components_with_decimal_commas_are_apart_by_semicolons() -> None:
    assert "(1747,421; 402,409; 149,444)" in translate_message(SAID[0])


def test_an_offer_of_the_command_line_is_a_choice_of_the_page() -> None:
    error = InputError(
        "table.txt:41", "rows are out of order", expected=naming("accept", words="face 3 ({} order takes it as it is)")
    )
    assert Words("de").said(error) == "Die Tabelle, Zeile 41: Zeilen sind nicht in der Reihenfolge; erwartet: Fläche 3"
