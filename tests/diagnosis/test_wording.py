"""The words of a diagnosis: declared with every effect, in English and German, and filled with its values."""

from __future__ import annotations

import re
import string
from typing import Any

import pytest

from stepgauge.axis.sensors import SENSORS, kinds_of
from stepgauge.diagnosis.wording.catalogue import sentences, words
from stepgauge.diagnosis.wording.findings import GAUGE, Subject, meaning, name_of, remedy, words_of
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.effects import effect_kinds
from stepgauge.effects.words import Wording, filled
from stepgauge.reports.findings import do_first

AXIS = {kind for name in SENSORS for form in ("axis", "spot", "distances") for kind in kinds_of(name, form)}
DECLARED = [
    *((kind, "gauge") for kind in (*effect_kinds(every=True), *words("finding")) if kind != "unknown"),
    *((kind, "axis") for kind in sorted(AXIS & set(effect_kinds()))),
    *((kind, "map") for kind in words("map")),
]


def gaps(text: str) -> set[str]:
    """The names in a template, also those in the words of a choice."""
    found: set[str] = set()
    for _, name, spec, _ in string.Formatter().parse(text):
        found |= {name} if name else set()
        found |= gaps(spec or "")
    return found


@pytest.mark.parametrize(("kind", "of"), DECLARED)
def test_every_kind_declares_all_its_words_in_both_languages(kind: str, of: str) -> None:
    english, german = (words_of(kind, of, language) for language in ("en", "de"))
    for part in ("name", "means", "check", "repair"):
        texts = [getattr(one, part) for one in (english, german)]
        assert all(texts), part
        assert texts[0] != texts[1] or part == "name"
        assert all(text.endswith((".", "?")) for text in texts) or part == "name"
    for part in ("check", "repair"):
        assert gaps(getattr(english, part)) == gaps(getattr(german, part)), part
    effect = effect_kinds(every=True).get(kind)
    if effect is not None and of != "map":
        known = {one.name for one in effect.parameters()} | {"largest", "aliases", "turns"}
        every = (text for one in (english, german) for text in (one.means, one.check, one.repair))
        assert set().union(*map(gaps, every)) <= known


def test_a_template_is_filled_with_magnitude_unit_and_the_word_of_the_sign() -> None:
    values = {"um": {"value": -0.625, "unit": "um"}, "lag_s": {"value": 120.0, "unit": "s"}, "plane": {"value": "xy"}}
    assert (
        filled("{um:4} {um:later|earlier} in {plane}{lag_s:, {lag_s} late|}", values)
        == "0.625 um earlier in xy, 120 s late"
    )
    assert filled("{um} {um:später|früher}", values, "de") == "0,62 um früher"
    assert filled("{lag_s:, {lag_s} late|}", {"lag_s": {"value": 0.0, "unit": "s"}}) == ""
    assert filled(
        "along {direction} of {axis}", {"direction": {"value": [0.6, 0.8, 0.0]}, "axis": {"value": "all"}}
    ) == ("along (0.600, 0.800, 0.000) of all axes")
    assert filled("{at_mm}", {}) == "at"
    assert Wording("a").said_in("de").name == "a"


def test_an_axis_is_told_in_its_own_units_by_the_names_that_the_effect_declares() -> None:
    rotary = Subject("axis", "deg", "arcsec")
    wave = {"period_deg": {"value": 7.2, "unit": "deg"}, "amplitude_arcsec": {"value": 1.5, "unit": "arcsec"}}
    assert meaning({"kind": "periodic_scale_error", "parameters": wave}, rotary).endswith(
        "every 7.2 deg, about 50 times a turn, by up to 1.5 arcsec."
    )
    reversal = {"kind": "reversal_error", "parameters": {"arcsec": {"value": -3.0, "unit": "arcsec"}}}
    assert "3 arcsec less" in meaning(reversal, rotary)
    assert "um 3 arcsec kleiner" in meaning(reversal, rotary, "de")
    assert name_of("periodic_scale_error_x", "axis") == "periodic scale error"


@pytest.mark.parametrize("kind", sorted(AXIS & set(effect_kinds())))
def test_what_an_axis_has_is_told_without_a_gauge_or_a_probe(kind: str) -> None:
    own = words_of(kind, "axis")
    for text in (own.means, own.check, own.repair):
        assert not re.search(r"\b(gauge|face|probing|stylus|machine)\b", text), text


def test_names_have_the_choices_behind_the_kind() -> None:
    assert name_of("scale_error_y", language="de") == "Maßstabsfehler y"
    assert name_of("thermal_expansion_of_gauge") == "thermal expansion gauge"
    assert name_of("never_heard_of") == "never heard of"


def test_a_kind_without_words_is_told_by_its_title() -> None:
    one = {"kind": "never_heard_of", "parameters": {}}
    assert meaning(one) == "never heard of."
    assert remedy(one, GAUGE, "de").check.startswith("Auf anderem Weg")


def said(verdict: str, **more: Any) -> dict[str, Any]:
    effect = {
        "kind": "scale_error",
        "label": "scale_error_y",
        "probability": 0.97,
        "own_probability": 0.97,
        "set": [],
        "several": [],
        "confounded_with": [],
        "alternatives": [],
        "separate_by": "",
        "commands": [],
        "parameters": {"axis": {"value": "y"}, "ppm": {"value": 25.04, "unit": "um/m", "u": 0.2}},
    }
    fit = {"rms_before_um": 3.4, "rms_after_um": 0.31}
    left = {"covariate": "time", "form": "smooth", "where": "a function of time", "side": "both", "probability": 0.9}
    return {
        "verdict": verdict,
        "effects": [effect | more] if verdict == "effects" else [],
        "unexplained": [left] if verdict == "unknown" else [],
        "fit": fit,
        "inputs": {},
        "probabilities": {"adequate": 0.93, "explained": 0.9},
        "noise": {"from_repeats": False},
    }


def items(data: dict[str, Any]) -> dict[str, list[str]]:
    return {one["title"]: one["items"] for one in do_first(data, "de")["blocks"]}


FACTOR = "Angezeigtes geteilt durch 1,000025; Schritte je mm (kleiner Maschinen) mal 1,000025."


def test_a_verdict_and_what_to_do_first_in_german() -> None:
    assert headline(said("effects"), "de") == (
        "Die Aufnahme widerspricht der Simulation, und bekannte Physik erklärt es: Maßstabsfehler y."
    )
    assert "(Wahrscheinlichkeit 0,93)" in headline(said("adequate"), "de")
    steps = items(said("effects"))
    assert "lineare Korrektur von y" in steps["Prüfen"][0]
    assert steps["Beheben"] == ["1: Eine neue lineare Korrektur von y eingeben: " + FACTOR]
    assert items(said("effects", confounded_with=["scale_temperature"]))["Beheben"] == [
        "1: Nichts verstellen, bevor die Prüfungen gezeigt haben, welche Ursache es ist."
    ]
    assert "nicht justieren" in items(said("unknown"))["Beheben"][0]
    assert do_first(said("adequate"), "de")["blocks"][0]["text"].startswith("Nichts")
    assert "jede Fläche" in items(said("insufficient"))["Noch einmal messen"][0]


def test_every_sentence_is_there_in_both_languages_with_the_same_gaps() -> None:
    for key, texts in sentences().items():
        assert len(texts) == 2, key
        assert gaps(texts[0]) == gaps(texts[1]), key
