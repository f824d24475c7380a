"""Whatever the program says on a page is German there: gathered from the code, not from a list."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stepgauge as sg
from stepgauge.errors import InputError, naming
from stepgauge.languages.messages import catalogue, read_german, said_in_german, translate_message, unchanged
from stepgauge.web.texts import Words
from tests.web.gathered import gathered

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
    "{}, which separates it from {} (the command below); nothing within this travel separates it from {}",
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


def test_an_offer_of_the_command_line_is_a_choice_of_the_page() -> None:
    error = InputError(
        "table.txt:41", "rows are out of order", expected=naming("accept", words="face 3 ({} order takes it as it is)")
    )
    assert Words("de").said(error) == "Die Tabelle, Zeile 41: Zeilen sind nicht in der Reihenfolge; erwartet: Fläche 3"
