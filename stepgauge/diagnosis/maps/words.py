"""What the changes of a probe's construction are called, mean, and ask to check and repair."""

from __future__ import annotations

from stepgauge.effects.words import Words

_STATE = "If it is so, state it in the probe file; else have the probe repaired."
_STATE_DE = "Ist es so, in der Tasterdatei angeben; sonst den Taster reparieren lassen."
_DRAWING, _DRAWING_DE = "Compare the module with its drawing.", "Das Modul mit seiner Zeichnung vergleichen."

MAP_WORDS = {
    "lever_arm": Words(
        "lever arm",
        "The contacts lie {mm} {mm:farther from|nearer to} the tip than in the file: all forces change by nearly the"
        " same factor.",
        "Measure the length of stylus and carrier.",
        _STATE,
        german=Words(
            "Hebelarm des Tasters",
            "Die Kontakte liegen um {mm} {mm:weiter von|näher an} der Kugel als in der Datei: Alle Kräfte ändern sich"
            " fast im selben Verhältnis.",
            "Die Länge von Taststift und Träger messen.",
            _STATE_DE,
        ),
    ),
    "stylus_length": Words(
        "stylus length",
        "The stylus is {mm} {mm:longer|shorter} than in the file: {stylus_length_mm:4}.",
        "Measure the stylus; was it exchanged?",
        "Take the probe file of this stylus.",
        german=Words(
            "Länge des Taststifts",
            "Der Taststift ist um {mm} {mm:länger|kürzer} als in der Datei: {stylus_length_mm:4}.",
            "Den Taststift messen; wurde er getauscht?",
            "Die Tasterdatei dieses Stifts nehmen.",
        ),
    ),
    "preload": Words(
        "preload",
        "The spring's force is {N} {N:more|less} than in the file: {preload_N:4}.",
        "Measure the trigger force across the stylus with a force gauge.",
        "Have the spring adjusted.",
        german=Words(
            "Vorspannung",
            "Die Federkraft ist um {N} {N:größer|kleiner} als in der Datei: {preload_N:4}.",
            "Die Schaltkraft quer zum Stift mit einem Kraftmesser messen.",
            "Die Feder einstellen lassen.",
        ),
    ),
    "contact_radius": Words(
        "contact radius",
        "The radius of the contacts is {mm} {mm:larger|smaller} than in the file: {contact_radius_mm:4}.",
        _DRAWING,
        _STATE,
        german=Words(
            "Radius der Kontakte",
            "Der Radius der Kontakte ist um {mm} {mm:größer|kleiner} als in der Datei: {contact_radius_mm:4}.",
            _DRAWING_DE,
            _STATE_DE,
        ),
    ),
    "contact_angle": Words(
        "contact angle",
        "The angle of the contacts is {deg} {deg:steeper|flatter} than in the file: {contact_angle_deg:4}.",
        _DRAWING,
        _STATE,
        german=Words(
            "Winkel der Kontakte",
            "Der Winkel der Kontakte ist um {deg} {deg:steiler|flacher} als in der Datei: {contact_angle_deg:4}.",
            _DRAWING_DE,
            _STATE_DE,
        ),
    ),
    "lobing_phase": Words(
        "lobing phase",
        "The tripod is rotated by {deg} about the stylus: its first arm lies at {arm_azimuth_deg:=3}. The probe was"
        " mounted at another angle, or azimuths are counted from another axis.",
        "Look how the probe is mounted, and from which axis azimuths are counted.",
        _STATE,
        german=Words(
            "Drehung des Dreibeins",
            "Das Dreibein ist um {deg} um den Stift gedreht: Sein erster Arm liegt bei {arm_azimuth_deg:=3}.",
            "Nachsehen, wie der Taster sitzt und ab welcher Achse die Azimute zählen.",
            _STATE_DE,
        ),
    ),
    "eccentricity": Words(
        "eccentricity",
        "The line of action of the spring is {mm:2} off the axis, towards {azimuth_deg:=3}: one contact carries more"
        " than the others and opens later.",
        "Look whether the stylus is screwed in straight.",
        "Have the module exchanged.",
        german=Words(
            "Exzentrizität",
            "Die Wirklinie der Feder liegt um {mm:2} neben der Achse, in Richtung {azimuth_deg:=3}: Ein Kontakt trägt"
            " mehr als die anderen und öffnet später.",
            "Nachsehen, ob der Stift gerade eingeschraubt ist.",
            "Das Modul tauschen lassen.",
        ),
    ),
    "friction": Words(
        "friction",
        "There is friction {seat:in the seats (coefficient {seat}): worn or dry contacts open later|between tip and"
        " surface (coefficient {tip}): the tip does not slide freely}.",
        "Look for dirt on the seats and on the tip.",
        "Have them cleaned; then measure the map again.",
        german=Words(
            "Reibung",
            "Es gibt Reibung {seat:in den Auflagen (Reibwert {seat})|zwischen Kugel und Fläche (Reibwert {tip})}.",
            "Auflagen und Kugel auf Schmutz ansehen.",
            "Reinigen lassen; dann die Karte neu messen.",
        ),
    ),
    "compliance": Words(
        "compliance",
        "The stylus with its holder has a compliance of {lateral_um_per_N:3} across, {factor:3} times the one computed"
        " from its sections.",
        "Compare stylus and extension with those of the probe file; are they tight?",
        _STATE,
        german=Words(
            "Nachgiebigkeit",
            "Der Taststift mit seinem Halter gibt quer um {lateral_um_per_N:3} nach, {factor:3}-mal so viel wie aus"
            " seinen Querschnitten berechnet.",
            "Stift und Verlängerung mit denen der Tasterdatei vergleichen; sind sie fest?",
            _STATE_DE,
        ),
    ),
    "force_gauge_scale": Words(
        "force gauge scale",
        "The force gauge indicates {factor:4} times the force; this is no error of the probe.",
        "Load the force gauge with a known mass.",
        "Have the force gauge calibrated.",
        german=Words(
            "Maßstab des Kraftmessers",
            "Der Kraftmesser zeigt das {factor:4}-fache der Kraft an; der Taster ist nicht betroffen.",
            "Den Kraftmesser mit einer bekannten Masse belasten.",
            "Den Kraftmesser kalibrieren lassen.",
        ),
    ),
    "force_gauge_offset": Words(
        "force gauge offset",
        "The force gauge indicates {N:2} too {N:much|little} everywhere: its zero was not set.",
        "Read the force gauge without load.",
        "Set its zero; the probe is not concerned.",
        german=Words(
            "Nullpunkt des Kraftmessers",
            "Der Kraftmesser zeigt überall um {N:2} zu {N:viel|wenig} an: Sein Nullpunkt wurde nicht eingestellt.",
            "Den Kraftmesser ohne Last ablesen.",
            "Seinen Nullpunkt einstellen; der Taster ist nicht betroffen.",
        ),
    ),
    "effective_radius": Words(
        "effective radius",
        "The probe triggers {um} {um:later|sooner} than in the file, equally in all directions.",
        "Qualify the probe on the reference sphere.",
        "State the new mean pre-travel.",
        german=Words(
            "wirksamer Radius",
            "Der Taster schaltet in allen Richtungen um {um} {um:später|früher} als in der Datei.",
            "Den Taster an der Bezugskugel einmessen.",
            "Den neuen mittleren Vorlaufweg angeben.",
        ),
    ),
    "probe_lobing": Words(
        "probe lobing",
        "The pre-travel has {constant_um:the lobes of three contacts that open one after the other (Wozniak), least"
        " towards {phase_deg:=3}: {constant_um:3} across the stylus|three sinusoidal lobes of {amplitude_um}, the"
        " maximum at an azimuth of {phase_deg:=3}}.",
        "Qualify the probe in many directions (stepgauge probe qualify).",
        "Compensate by direction (stepgauge probe compensate), or have the probe module exchanged.",
        german=Words(
            "Dreibogen des Tasters",
            "Der Vorlaufweg hat drei Bögen {constant_um:wie bei drei Kontakten, die nacheinander öffnen (Wozniak)|"
            "von {amplitude_um}, am größten bei einem Azimut von {phase_deg:=3}}.",
            "Den Taster in vielen Richtungen einmessen.",
            "Je Richtung kompensieren oder das Tastmodul tauschen lassen.",
        ),
    ),
    "outliers": Words(
        "outliers",
        "Some rows are far from the neighbouring directions and not used: dirt, a false trigger or a typing error.",
        "Look at the rows that are listed in the appendix.",
        "Measure these directions again.",
        german=Words(
            "einzelne Ausreißer",
            "Einige Zeilen liegen weit neben den benachbarten Richtungen und gehen nicht ein: Schmutz, ein falsches"
            " Schalten oder ein Schreibfehler.",
            "Die Zeilen ansehen, die im Anhang des Berichts stehen.",
            "Diese Richtungen noch einmal messen.",
        ),
    ),
}
"""By kind of change."""
