"""What a diagnosis says in German is made from its keys and values, for every kind that it may name."""

from __future__ import annotations

import string
from typing import Any

import pytest

from stepgauge.diagnosis.wording import remedies as english
from stepgauge.effects import effect_kinds
from stepgauge.web import advice
from stepgauge.web.texts import Words, effects

ENGLISH = {"gauge": english._REMEDIES, "axis": english._OF_AN_AXIS, "map": english._OF_A_MAP}


def gaps(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


@pytest.mark.parametrize("of", ENGLISH)
def test_every_remedy_is_there_in_german_with_the_same_choices(of: str) -> None:
    german = advice.remedies()[of]
    for kind, own in ENGLISH[of].items():
        check, repair = german[kind]
        assert gaps(check) == gaps(own.check), kind
        assert gaps(repair) <= gaps(own.repair), kind


def test_every_kind_of_effect_has_a_name() -> None:
    assert set(effect_kinds(every=True)) <= set(effects())
    assert Words("de").effect("scale_error_y") == "Maßstabsfehler y"
    assert Words("en").effect("never_heard_of") == "never heard of"


def said(verdict: str, **more: Any) -> dict[str, Any]:
    effect = {
        "kind": "scale_error",
        "label": "scale_error_y",
        "probability": 0.97,
        "set": [],
        "confounded_with": [],
        "alternatives": [],
        "parameters": {"axis": {"value": "y"}, "ppm": {"value": 25.04, "unit": "um/m", "u": 0.2}},
    }
    fit = {"rms_before_um": 3.4, "rms_after_um": 0.31}
    found = {"verdict": verdict, "effects": [effect | more] if verdict == "effects" else [], "fit": fit, "inputs": {}}
    return {**found, "unexplained": [{}] if verdict == "unknown" else []}


def test_a_verdict_and_what_to_do_first_in_german() -> None:
    words = Words("de")
    text = advice.summary(words, said("effects"))
    assert text.startswith("Maßstabsfehler y (97 %).")
    assert "3,40 µm, mit den Befunden 0,31 µm" in text
    check, repair = advice.steps(words, said("effects"))
    assert "lineare Korrektur von y" in check["items"][0]
    assert repair["items"] == ["1: Eine neue lineare Korrektur von y eingeben."]
    unsure = advice.steps(words, said("effects", confounded_with=["scale_temperature"]))[1]["items"]
    assert unsure == ["1: Nichts, bevor die Prüfungen gezeigt haben, welche Ursache es ist."]
    assert "nicht justieren" in advice.steps(words, said("unknown"))[1]["items"][0]
    assert advice.steps(words, said("adequate"))[0]["text"].startswith("Nichts")
