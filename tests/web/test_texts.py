"""The catalogue: every text in every language, none missing, none unused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import stepgauge.web
from stepgauge.importing.tables.columns import ROLES, Role
from stepgauge.languages.messages import LANGUAGES, read_german
from stepgauge.languages.messages import texts as catalogue
from stepgauge.web.fields import verb_fields
from stepgauge.web.pages import NAVIGATION, gauge, machine
from stepgauge.web.render import json_answer, stated_on
from stepgauge.web.texts import Words, best_language

ROOM = Path(stepgauge.web.__file__).parent
FAMILIES = tuple(
    f"{table}."
    for table in (
        *(
            "nav",
            "look",
            "kind",
            "place",
            "state",
            "steer",
            "verdict",
            "wrong",
            "project_reason",
            "gauge_note",
            "source",
        ),
        *("face_role", "choice_kind", "condition", "condition_state", "outcome", "report_said", "differs"),
        *("certificate_part", "field", "error_name", "hint", "quantity", "probe_value"),
        *(
            "probe_held",
            "figure",
            "page",
            "choice_temperature_convention",
            "choice_sensor",
            "choice_accept",
            "choice_decimal",
            "choice_points",
            "choice_unit",
            "choice_taken",
            "choice_place",
            "choice_route",
            "choice_around",
            "choice_order",
        ),
    )
)
"""Keys that are put together from a name."""


def test_every_text_is_there_in_every_language_with_the_same_gaps() -> None:
    for key, texts in catalogue().items():
        assert len(texts) == len(LANGUAGES), key
        gaps = [sorted(re.findall(r"{(\w+)}", text)) for text in texts]
        assert all(one == gaps[0] for one in gaps), key
        assert all(text.strip() for text in texts), key


def test_no_text_is_missing_and_none_is_unused() -> None:
    sources = [*ROOM.rglob("*.py"), *ROOM.rglob("*.j2")]
    key = re.compile(r"\b(?:t|text|self|words)\([\"']([a-z_]+\.\w+)[\"']")
    used = {found for one in sources for found in key.findall(one.read_text("utf-8"))}
    assert {f"nav.{page}" for page in {*NAVIGATION, "probe"}} <= set(catalogue())
    assert used - set(catalogue()) == set()
    assert {key for key in catalogue() if not key.startswith(FAMILIES)} - used == set()


def test_a_figure_speaks_the_language_of_the_page() -> None:
    """Whole words of a figure alone, in either spelling of JSON, and none of its numbers and keys."""
    from starlette.requests import Request

    def answer(language: str, text: str) -> str:
        headers = [(b"accept-language", language.encode())]
        return bytes(json_answer(Request({"type": "http", "headers": headers}), text).body).decode()

    hover = "face %{customdata}, cycle 3: no face"
    text = json.dumps({"name": "probe", "y": {"title": "error (µm)", "t": hover}, "probe": [1.5, "probes"]})
    german = "Fläche %{customdata}, Durchgang 3: no face"  # before a number, or what is put there
    told = {"name": "Taster", "y": {"title": "Abweichung (µm)", "t": german}, "probe": [1.5, "probes"]}
    assert json.loads(answer("de", text)) == told
    assert answer("en", text) == text
    assert json.loads(answer("de", json.dumps(json.loads(text), ensure_ascii=False))) == told


def test_numbers_are_written_as_the_language_writes_them() -> None:
    assert Words("de").number(-1234.5, 1) == "−1\u202f234,5"
    assert Words("en").number(0.126, 2) == "0.13"
    assert Words("xx").number(None) == "–"
    assert best_language("fr-FR, de-DE;q=0.8, en;q=0.5") == "de"
    assert best_language("") == "en"


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("stepgauge: error: ../../results/a.json: wrong", "results/a.json: wrong"),
        ("expected a measured recording; or example = true in [certificate]", "the tick “"),
        (
            'a number of its own, replaces = "7" in [certificate], and another file',
            'a number of its own, “Replaces certificate”: "7"',
        ),
        ("table [item] has another serial number", "“What was calibrated” has another serial number"),
        (
            "not the file of the budget (a.json): key uncertainty.gauge_temperature_K.u",
            "key “Temperature of the gauge, standard uncertainty”",
        ),
        ("performed_from is after performed_to", "“First day of the calibration” is after “Last day”"),
        ("compare the placements (stepgauge locate).", "the page Locate"),
        ("compare them: stepgauge report BEFORE AFTER -o overlay.pdf", "the page Result"),
        ("scale error (the command below)", "scale error"),
    ],
)
def test_words_of_the_command_line_are_those_of_the_page(line: str, shown: str) -> None:
    said = Words("en").ended(line)
    assert shown in said
    assert not re.search(r"stepgauge|[.][.]/|= true|[a-z]_[a-z]|BEFORE|command", said), said
    assert Words("en").ended("recordings/my_table.csv") == "recordings/my_table.csv"


def test_no_message_names_a_line_or_a_table_of_a_file_that_the_page_writes() -> None:
    """A certificate over another one asked for ``replaces = "7" in [certificate]``."""
    line = re.compile(r"\w+ = \S+ (?:in|unter) \[|\[{1,2}(?:certificate|item|machine|probe|gauge)\b|--[a-z]{2}")
    for text in (one for pair in read_german("messages.toml").items() for one in pair):
        assert not line.search(Words("de").plain(text)), text


def test_every_number_that_a_form_asks_for_says_where_it_is_found() -> None:
    """A technician guessed the drift, the standard uncertainties and the width of a block."""
    asked = [*gauge.fields()[0], *gauge.fields()[1], *(one for some in machine.groups().values() for one in some)]
    numbers = [one.name for one in asked if one.kind == "number" and not re.fullmatch("[xyz]_(?:low|high)", one.name)]
    unclear = (
        "method.deviations",
        "statements.adjustment",
        "certificate.mark",
        "certificate.replaces",
        "item.condition",
    )
    assert [name for name in (*numbers, *unclear) if not Words("de").hint(name)] == []
    plain = [one.name.removesuffix(one.name[one.name.rfind("_") :]).replace("_", " ") for one in asked]
    assert not {Words("de").label(one.name) for one in asked} & {*plain, *(one.name.replace("_", " ") for one in asked)}
    assert set(numbers) >= {"drift_um_per_m_per_year", "u_gauge_temperature_K", "block_width_mm"}


def test_every_choice_of_a_form_and_every_role_of_a_column_has_words() -> None:
    """Of a column of approach directions a German page said 'approach i'."""
    forms = (*verb_fields("plan").values(), *(one for some in machine.groups().values() for one in some))
    choices = {(one.label or one.name, key) for one in forms for key in one.choices}
    choices = {(name, key) for name, key in choices if name not in ("dialect", "points_on")}
    roles = {("taken", str(role)) for role in (*ROLES, *Role)}
    texts = Words("de")
    assert sorted(one for one in choices | roles if not texts.has(f"choice_{one[0]}.{one[1]}")) == []


def test_a_format_is_no_command_and_a_folder_of_the_server_is_not_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    line = f"{tmp_path}/results/diagnosis.json: found 'stepgauge diagnosis 2'; expected 'stepgauge diagnosis 3'"
    assert Words("en").plain(line) == line.removeprefix(f"{tmp_path}/")


def test_a_refusal_leads_to_the_pages_where_the_answer_is_stated() -> None:
    expected = "temperature_convention in the machine file or the recording, or --temperature-convention"
    assert stated_on(expected) == ["machine", "importing"]
    assert stated_on("found 2; expected 1 or more") == []
