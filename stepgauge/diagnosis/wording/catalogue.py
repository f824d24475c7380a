"""Sentences of a diagnosis that belong to no effect, in English and in German."""

from __future__ import annotations

import re
from collections.abc import Sequence

LANGUAGES = ("en", "de")
TEXTS = {
    "and": ("and", "und"),
    "or": ("or", "oder"),
    "twice": ("twice {name}", "zweimal {name}"),
    "times": ("{count} times {name}", "{count}-mal {name}"),
    "model_gauge": ("The recording {verb} the simulation", "Die Aufnahme {verb} der Simulation"),
    "model_axis": ("The recording {verb} the targets", "Die Aufnahme {verb} den Zielen"),
    "model_other": ("The recording {verb} the model", "Die Aufnahme {verb} dem Modell"),
    "model_map": ("The map {verb} the probe file", "Die Karte {verb} der Tasterdatei"),
    "agrees": ("agrees with", "entspricht"),
    "disagrees": ("disagrees with", "widerspricht"),
    "cannot_tell": ("cannot tell whether it agrees with", "lässt offen, ob sie übereinstimmt mit"),
    "within": (
        " within the scatter{sure}. Nothing needs to be added to the model.",
        " im Rahmen der Streuung{sure}. Am Modell fehlt nichts.",
    ),
    "sure": (" (probability {p})", " (Wahrscheinlichkeit {p})"),
    "explained": (", and known physics explains it: {named}.", ", und bekannte Physik erklärt es: {named}."),
    "likelier": (
        ". Each of these is likelier than not, not all of them: {named}.",
        ". Jedes davon ist wahrscheinlicher als nicht, alle zusammen sind es nicht: {named}.",
    ),
    "nothing_systematic": ("Nothing systematic is beside it.", "Systematisches ist daneben nicht zu sehen."),
    "unknown": (
        " in a way that no known effect explains. Its form: {where}{laws}.",
        " auf eine Weise, die kein bekannter Effekt erklärt. Ihre Form: {where}{laws}.",
    ),
    "part_explained": ("A part is explained: {named}.", "Ein Teil ist erklärt: {named}."),
    "larger": (
        "The scatter is {ratio} times what the machine file states ({found} um, stated {stated} um)",
        "Die Streuung ist {ratio}-mal so groß wie in der Maschinendatei ({found} um, angegeben {stated} um)",
    ),
    "smaller": (
        "The scatter is a {ratio}th of what the machine file states ({found} um, stated {stated} um)",
        "Die Streuung ist {ratio}-mal kleiner als in der Maschinendatei ({found} um, angegeben {stated} um)",
    ),
    "or_laws": (
        "; or {names}{together}, at odds of 1 to {odds}, which these readings do not exclude",
        "; oder {names}{together}, im Verhältnis 1 zu {odds}, was diese Messwerte nicht ausschließen",
    ),
    "together": (" together", " zusammen"),
    "no_statement": (
        "No statement is likelier than not: nothing at all has a probability of {p}{others}.",
        "Keine Aussage ist wahrscheinlicher als nicht: Dass nichts da ist, hat die Wahrscheinlichkeit {p}{others}.",
    ),
    "structure_in": ("structure in {covariate}", "Struktur über {covariate}"),
    "without_law": ("without a law: {where}", "ohne Gesetz: {where}"),
    "period": (
        ", period {own} {unit} or an alias of it: {others} {unit} or shorter",
        ", Periode {own} {unit} oder eine Alias-Periode davon: {others} {unit} oder kürzer",
    ),
    "do_first": ("What to do first", "Was zuerst zu tun ist"),
    "nothing_to_do": (
        "Nothing: no named effect is needed, and nothing is left beyond the scatter.",
        "Nichts: Kein Effekt wird gebraucht, und über die Streuung hinaus bleibt nichts.",
    ),
    "check": ("Check", "Prüfen"),
    "repair": ("Repair", "Beheben"),
    "again": ("Measure again", "Noch einmal messen"),
    "or_member": ("or {name}", "oder {name}"),
    "first": (
        "Do not adjust anything before the checks have told which of the causes of a finding it is.",
        "Nichts verstellen, bevor die Prüfungen gezeigt haben, welche Ursache es ist.",
    ),
    "misfit": (
        "Nothing: alone, without what has no known law, the named effects do not explain the readings.",
        "Nichts: Ohne das, wofür kein Gesetz bekannt ist, erklären die genannten Effekte die Werte nicht.",
    ),
    "separate": ("what would separate the causes: {text}", "was die Ursachen trennt: {text}"),
    "tell_laws": ("what would tell whether it is {laws}: {text}", "was zeigt, ob es {laws} ist: {text}"),
    "compare_gauge": (
        "After any change, measure with the same program and lay the two evaluations over each other:"
        " stepgauge report BEFORE AFTER -o overlay.pdf",
        "Nach jeder Änderung mit demselben Programm messen und beide Auswertungen übereinanderlegen.",
    ),
    "compare_map": (
        "After any change, measure the map again and diagnose it.",
        "Nach jeder Änderung die Karte neu messen und diagnostizieren.",
    ),
    "lacks_map": ("The map lacks: {what}", "Der Karte fehlt: {what}"),
    "lacks_repeats": (
        "every face probed at least twice, better five times, in the same placement and at the same speed",
        "jede Fläche zweimal, besser fünfmal angetastet, in derselben Lage und mit derselben Geschwindigkeit",
    ),
    "lacks_cycles": (
        "more cycles: too few repeats to separate noise from structure",
        "mehr Zyklen: zu wenige Wiederholungen, um Streuung und Struktur zu trennen",
    ),
    "lacks_placement": ("{few}; and another placement", "{few}; und eine weitere Lage"),
    "lacks_axis": (
        "every target twice, better five times, in each direction of travel, with all digits of the instrument",
        "jedes Ziel mindestens zweimal, besser fünfmal, in jeder Richtung, mit allen Stellen des Messgeräts",
    ),
    # structure without a law: how it depends on its covariate
    "trend": ("proportional to {covariate}", "proportional zu {covariate}"),
    "levels": (
        "all readings of a {covariate} are off together, each {covariate} by an amount of its own",
        "alle Werte weichen je {covariate} gemeinsam ab, jedes Mal um einen eigenen Betrag",
    ),
    "loop": (
        "a separate curve along the line for each direction of travel",
        "eine eigene Kurve längs der Linie für jede Fahrtrichtung",
    ),
    "harmonics": (
        "depends on the direction of approach about the stylus",
        "hängt von der Antastrichtung um den Stift ab",
    ),
    "wave": (
        "a periodic function of {covariate}, period {period:4}",
        "eine periodische Funktion von {covariate}, Periode {period:4}",
    ),
    "sawtooth": (
        "creeps with {covariate} and is thrown back, a sawtooth of period {period:4}",
        "kriecht mit {covariate} und springt zurück, ein Sägezahn der Periode {period:4}",
    ),
    "lagged": (
        "proportional to {covariate} after a first-order lag, time constant about {lag}",
        "folgt {covariate} verzögert (erste Ordnung), Zeitkonstante etwa {lag}",
    ),
    "length": (
        "a length error that changes with {covariate}{lag:, time constant about {lag}|}",
        "ein Längenfehler, der sich mit {covariate} ändert{lag:, Zeitkonstante etwa {lag}|}",
    ),
    "beat": (
        "periodic along the line, period {along:4}, and in {covariate}, period {period:4}",
        "periodisch längs der Linie, Periode {along:4}, und in {covariate}, Periode {period:4}",
    ),
    "rests": (
        "follows the rests before the last {count} readings, as the roots of their times",
        "folgt den Pausen vor den letzten {count} Werten, wie die Wurzeln ihrer Zeiten",
    ),
    "hysteresis": (
        "hysteresis of {covariate}: depends on where its travel turned before"
        "{back:, held back for {back:3} after a turn|}{beside:, more in some places than in others|}",
        "Hysterese von {covariate}: hängt davon ab, wo die Bewegung zuvor umkehrte"
        "{back:, bleibt nach einer Umkehr {back:3} zurück|}{beside:, stellenweise verschieden|}",
    ),
    "smooth": (
        "a smooth function of {covariate}{beside: and {beside}|}",
        "eine glatte Funktion von {covariate}{beside: und {beside}|}",
    ),
    "index": ("repeats in the {covariate} of the readings", "wiederholt sich in der {covariate} der Werte"),
    "gauge": (
        "with the same sign on front and back faces (along the gauge)",
        "mit gleichem Vorzeichen auf Vorder- und Rückflächen (längs des Stufenendmaßes)",
    ),
    "gauge_axis": ("the same in both directions of travel", "gleich in beiden Fahrtrichtungen"),
    "approach": ("along the approach", "längs der Antastrichtung"),
    "approach_axis": (
        "with opposite sign in the two directions of travel",
        "mit umgekehrtem Vorzeichen in den beiden Fahrtrichtungen",
    ),
    "machine": ("along machine {axis}", "längs der Maschinenachse {axis}"),
    "above": ("only above {edge:=4}", "nur über {edge:=4}"),
    "below": ("only below {edge:=4}", "nur unter {edge:=4}"),
    "or_function": (
        "or a function of {covariates}: this recording does not tell which",
        "oder eine Funktion von {covariates}: Diese Aufnahme zeigt nicht, von was",
    ),
    "open": (
        "structure that depends on {covariates}: which, these readings do not tell",
        "Struktur, die von {covariates} abhängt: von was, zeigen diese Werte nicht",
    ),
    "similar": (
        "similar to {law}, whose size this recording does not determine",
        "ähnlich wie {law}, dessen Größe diese Aufnahme nicht bestimmt",
    ),
    "impossible": (
        "similar to {law}, but larger than that can be",
        "ähnlich wie {law}, aber größer, als das sein kann",
    ),
    "weak": (
        "similar to {law}, but other explanations are as likely (its probability is {probability})",
        "ähnlich wie {law}, doch anderes ist ebenso wahrscheinlich (Wahrscheinlichkeit {probability})",
    ),
    "reversal": (
        "a reversal error that differs along the axis: {least:=3} at {least_at:=6} to {largest:=3} at {largest_at:=6}",
        "eine Umkehrspanne, die sich längs der Achse ändert, von {least:=3} bei {least_at:=6} bis {largest:=3} bei"
        " {largest_at:=6}",
    ),
    "nearest": (
        "{law} is the nearest law; the form is {times} times as probable",
        "{law} ist das nächste Gesetz; die Form ist {times}-mal so wahrscheinlich",
    ),
    "nearest_laws": (
        "{laws} together are nearest; the form is {times} times as probable",
        "{laws} zusammen liegen am nächsten; die Form ist {times}-mal so wahrscheinlich",
    ),
    # the scatter
    "correlated": (
        "the scatter is correlated, with {correlation} between consecutive readings",
        "die Streuung ist korreliert, mit {correlation} zwischen aufeinanderfolgenden Werten",
    ),
    "flicker": (
        "the scatter is 1/f noise, correlated over all times",
        "die Streuung ist 1/f-Rauschen, über alle Zeiten korreliert",
    ),
    "disturbed": (
        "the scatter is about {factor} times as large from {first:=7} to {end:=7} as in the rest of the record",
        "die Streuung ist von {first:=7} bis {end:=7} etwa {factor}-mal so groß wie sonst",
    ),
    "disturbed_rows": (
        "the scatter is about {factor} times as large from reading {first} to {end} as in the rest of the record",
        "die Streuung ist von Wert {first} bis {end} etwa {factor}-mal so groß wie sonst",
    ),
    "excluded_kind": ("{law} with {covariate}", "{law} mit {covariate}"),
    # the predictive check
    "check_rows": (
        "the largest residual is {largest:=3} standard deviations",
        "das größte Residuum ist {largest:=3} Standardabweichungen groß",
    ),
    "check_repeats": (
        "standard deviation {within:3} of repeats, {all:3} of all rows about the model",
        "Standardabweichung {within:3} der Wiederholungen, {all:3} aller Zeilen um das Modell",
    ),
    "check_sequence": (
        "correlation of neighbours in order {negative:-|}{correlation}",
        "Korrelation der Nachbarn in der Reihenfolge {negative:-|}{correlation}",
    ),
    "check_tails": (
        "excess of the fourth moment {negative:-|}{excess:3}",
        "Exzess des vierten Moments {negative:-|}{excess:3}",
    ),
    # remarks
    "searched": (
        "searched in {some} of {every} rows, fitted to all of them",
        "gesucht in {some} von {every} Zeilen, angepasst an alle",
    ),
    "inexact": (
        "{law} is not exactly of this shape: {size} rms, {percent} % of it, are put down to that"
        "{lag:, or to what its temperature did in pauses: record it all the time|}",
        "{law} hat nicht genau diese Form: {size} rms, {percent} % davon, werden dem zugeschrieben"
        "{lag:, oder dem, was die Temperatur in Pausen tat: immer aufzeichnen|}",
    ),
    "clock": (
        "times of forms are counted from the first reading, at {start:=12} of the clock",
        "Zeiten von Formen zählen ab dem ersten Wert, bei {start:=12} der Uhr",
    ),
    "certificate": (
        "faces deviate from the certificate by {factor} times its stated uncertainty",
        "die Flächen weichen vom Schein um das {factor}-fache seiner Unsicherheit ab",
    ),
    "certificate_axis": (
        "targets deviate from their positions by {factor} times their stated uncertainty",
        "die Ziele weichen von ihren Positionen um das {factor}-fache ihrer Unsicherheit ab",
    ),
    "heavy": (
        "single readings scatter with heavier tails than a normal distribution: they were weighted accordingly",
        "einzelne Werte streuen weiter als normalverteilt: Sie wurden entsprechend gewichtet",
    ),
    "latched": (
        "the controller latches all repeats with the same delay: repeats do not show its error",
        "die Steuerung erfasst alle Wiederholungen mit derselben Verzögerung: Sie zeigen deren Fehler nicht",
    ),
    "resolution": (
        "readings have a resolution of {step:3}, which is visible beside the scatter",
        "die Werte haben eine Auflösung von {step:3}, die neben der Streuung sichtbar ist",
    ),
    "do_not_enter": (
        "the named effects leave {after:3} rms of {before:3}: do not enter their values",
        "die genannten Effekte lassen {after:3} von {before:3} rms übrig: ihre Werte nicht eingeben",
    ),
}
"""By key, in the order of :data:`LANGUAGES`."""


DECIMAL = re.compile(r"(?<=\d)\.(?=\d)")


def say(key: str, language: str = "en", **values: object) -> str:
    """A sentence in a language, with what stands in braces filled in."""
    text = TEXTS[key][LANGUAGES.index(language)]
    if language == "de":
        values = {name: DECIMAL.sub(",", str(value)) for name, value in values.items()}
    return text.format(**values) if values else text


def listed(words: Sequence[str], last: str = "and", language: str = "en") -> str:
    """``a, b and c``."""
    return "".join(words) if len(words) < 2 else f"{', '.join(words[:-1])} {say(last, language)} {words[-1]}"
