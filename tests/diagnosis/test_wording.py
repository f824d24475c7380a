"""The words of a diagnosis: declared with every effect, in English and German, and filled with its values."""

from __future__ import annotations

import re
import string
from itertools import product
from typing import Any

import pytest

from stepgauge.axis.sensors import SENSORS, kinds_of
from stepgauge.diagnosis.wording.catalogue import sentences, words
from stepgauge.diagnosis.wording.findings import (
    GAUGE,
    Subject,
    check_of,
    finding_name,
    meaning,
    name_of,
    remedy,
    words_of,
)
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.effects import effect_kinds
from stepgauge.effects.words import Wording, _Value, filled
from stepgauge.reports.first_steps import do_first

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
        assert all(text.rstrip("|}").endswith((".", "?")) for text in texts) or part == "name"
    for part in ("check", "repair"):
        assert gaps(getattr(english, part)) == gaps(getattr(german, part)), part
    effect = effect_kinds(every=True).get(kind)
    if effect is not None and of != "map":
        known = {one.name for one in effect.parameters()} | {"largest", "aliases", "turns", "steps", "new_um"}
        known |= {"seat", "gear", "scale"}  # what one turn of a period is
        every = (text for one in (english, german) for text in (one.means, one.check, one.repair))
        assert set().union(*map(gaps, every)) <= known


@pytest.mark.parametrize("kind", sorted(effect_kinds(every=True)))
def test_a_check_of_a_law_of_which_only_the_label_is_known_lacks_no_value(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`Inspect the x scale at at for dirt`: its position was not known."""
    filled_value = _Value.__format__

    def marked(self: _Value, spec: str) -> str:
        return "?!" if self.value is None and "|" not in spec else filled_value(self, spec)

    monkeypatch.setattr(_Value, "__format__", marked)
    plane = any(one.name == "plane" for one in effect_kinds(every=True)[kind].parameters())
    for machine, language in product(("machine tool", "cmm"), ("en", "de")):
        assert "?!" not in check_of(f"{kind}_{'xy' if plane else 'x'}", Subject(machine=machine), language)


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
    at = "the scale{at_mm:? at {at_mm:=5}|}"
    assert filled(at, {}) == "the scale"
    assert filled(at, {"at_mm": {"value": -110.64, "unit": "mm"}}) == "the scale at -110.64 mm"
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


FACTOR = "1: Eine lineare Korrektur von y, die durch 1,00002504 ± 0,00000040 (k = 2) teilt."
STEPS = (
    "1: $101: x 1,00002504 ± 0,00000040 (k = 2) (befohlener durch wahren Weg), Schritte je mm von y bei grbl (M92 bei"
    " Marlin, SCALE in [JOINT_1] der ini von LinuxCNC); oder eine lineare Korrektur von y, die durch diese Zahl teilt."
)


@pytest.mark.parametrize(("kind", "repair"), [("machine tool", STEPS), ("cmm", FACTOR), (None, FACTOR)])
def test_controllers_that_are_set_by_steps_are_named_for_machines_that_have_them(kind: str | None, repair: str) -> None:
    """A coordinate measuring machine was told to set $100 of grbl."""
    told = said("effects") | {"inputs": {"machine": {"kind": kind}}}
    assert items(told)["Eingeben"] == [repair]


def test_a_verdict_and_what_to_do_first_in_german() -> None:
    assert headline(said("effects"), "de") == (
        "Die Messdaten widersprechen der Simulation, und bekannte Physik erklärt es: Maßstabsfehler y."
    )
    assert "(Wahrscheinlichkeit 0,93)" in headline(said("adequate"), "de")
    steps = items(said("effects"))
    assert "lineare Korrektur von y" in steps["Prüfen"][0]
    assert steps["Eingeben"] == [FACTOR]
    assert items(said("effects", confounded_with=["scale_temperature"]))["Beheben"] == [
        "1: Noch nichts: Erst zeigen die Prüfungen, welche Ursache es ist."
    ]
    assert "nicht justieren" in items(said("unknown"))["Beheben"][0]
    assert do_first(said("adequate"), "de")["blocks"][0]["text"].startswith("Nichts")
    assert "jede Fläche" in items(said("insufficient"))["Noch einmal messen"][0]


def test_every_sentence_is_there_in_both_languages_with_the_same_gaps() -> None:
    for key, texts in sentences().items():
        assert len(texts) == 2, key
        assert gaps(texts[0]) == gaps(texts[1]), key


def _named(kind: str) -> dict[str, Any]:
    """A finding of a kind with every parameter: choices by their first word, numbers of 12.345 with u = 0.5."""
    effect = effect_kinds(every=True)[kind]
    parameters: dict[str, Any] = {}
    for one in effect.parameters():
        if one.role == "choice":
            parameters[one.name] = {"value": one.choices[0] if one.choices else 2}
        else:
            u = None if one.role == "fixed" else 0.5
            parameters[one.name] = {"value": 12.345, "unit": one.unit or "1", "u": u}
    none: dict[str, Any] = {"confounded_with": [], "alternatives": [], "set": [], "several": [], "aliases": {}}
    return {"kind": kind, "label": kind, "parameters": parameters, "probability": 0.99, "own_probability": 0.99, **none}


@pytest.mark.parametrize("kind", sorted(kind for kind, one in effect_kinds(every=True).items() if one.sought))
@pytest.mark.parametrize("language", ["en", "de"])
def test_every_repair_tells_place_and_values_with_their_uncertainties(kind: str, language: str) -> None:
    from stepgauge.reports.first_steps import MOST_SIZES, _entered, _repairs

    one = _named(kind)
    data = {"effects": [one], "unexplained": [], "inputs": {}, "fit": {"rms_before_um": 2.0, "rms_after_um": 1.0}}
    (line,) = [*_entered(data, language), *_repairs(data, language)]
    told = [p for p in one["parameters"].values() if p.get("u")]
    if 0 < len(told) <= MOST_SIZES:
        assert "± " in line
        assert "(k = 2)" in line
    for place in ("axis", "plane", "face", "block", "placement", "column"):
        if place in one["parameters"]:
            assert re.search(rf"\b{one['parameters'][place]['value']}\b", line), (place, line)


def test_an_entered_value_is_told_with_sense_uncertainty_and_the_setting_of_its_axis() -> None:
    um, ppm = (
        {"value": value, "unit": unit, "u": u} for value, unit, u in ((-40.85, "um", 1.97), (1201.8, "um/m", 15.4))
    )
    values = {"um": um, "ppm": ppm, "axis": {"value": "y"}, "mm": {**ppm, "unit": "mm/m", "value": 5.93, "u": 0.05}}
    assert filled("{um:plus|minus} {um:±}", values) == "minus 40.9 ± 3.9 um (k = 2)"
    assert filled("{axis:$100|$101|$102} times {ppm:factor}", values) == "$101 times 1.001202 ± 0.000031 (k = 2)"
    assert filled("{mm:factor}", values, "de") == "1,00593 ± 0,00010 (k = 2)"
    assert filled("{ppm:factor}", {"ppm": {"value": -500.0, "unit": "um/m"}}) == "0.9995"


def test_all_axes_together_are_said_in_german() -> None:
    """A finding of all scales was 'Temperatur des Maßstabs all' in the headline and the list of checks."""
    effect = {"kind": "scale_temperature", "label": "scale_temperature_all", "parameters": {"axis": {"value": "all"}}}
    assert finding_name(effect, GAUGE, "de") == name_of("scale_temperature_all", language="de")
    assert finding_name(effect, GAUGE, "de").endswith("aller Achsen")
    assert finding_name(effect, GAUGE) == "scale temperature all"
