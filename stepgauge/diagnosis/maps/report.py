"""Words of the report of a probe map: its verdict in a sentence, and what the map cannot show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stepgauge.diagnosis.output.report import FEW_DOF
from stepgauge.diagnosis.output.words import listed, name_of

VERDICTS = {
    "adequate": "The map agrees with the probe file within the scatter. Nothing in the file needs to be changed.",
    "effects": "The map disagrees with the probe file, and known causes explain it:",
    "unknown": "The map disagrees with the probe file in a way that no known cause explains.",
    "insufficient": "The map cannot tell whether the probe file is right.",
}
FULL_TURN_DEG = 240.0
"""Least span of azimuths that separates a harmonic from a constant."""
QUANTITIES = {"trigger_force_N": "trigger force", "deflection_um": "deflection", "pretravel_um": "pre-travel"}


def summary(said: Mapping[str, Any]) -> str:
    """The verdict in a sentence or two."""
    text = VERDICTS[said["verdict"]]
    named = [_named(effect) for effect in said["effects"]]
    if said["verdict"] == "effects":
        return f"{text} {listed(named)}."
    if said["verdict"] == "unknown":
        part = f" A part is explained: {listed(named)}." if named else ""
        return f"{text} Its form: {said['unexplained'][0]['where']}.{part}"
    return text


def _named(effect: Mapping[str, Any]) -> str:
    others = [name_of(kind) for kind in (*effect["confounded_with"], *effect["alternatives"])]
    name = name_of(effect["label"])
    return f"{name} (or in its place {listed(others, 'or')})" if others else name


def limits(said: Mapping[str, Any]) -> list[str]:
    """What this map cannot show, whatever the verdict."""
    measured = said["measured"]
    found = [*_of_scatter(said["noise"])]
    polar, azimuth = measured["polar_deg"], measured["azimuth_deg"]
    if azimuth["to"] - azimuth["from"] < FULL_TURN_DEG:
        found.append(
            f"The azimuths go from {azimuth['from']:g} to {azimuth['to']:g} deg. Differences between the thirds of"
            " a circle (eccentricity, a damaged seat, lobes other than three) need azimuths over 360 deg."
        )
    if polar["different"] == 1:
        found.append(
            f"There is one polar angle, {polar['from']:g} deg. Lever, preload and contact radius have the same"
            " influence at a single polar angle; oblique directions separate them."
        )
    missing = {"trigger_force_N": "trigger forces", "deflection_um": "deflections"}
    if said["inputs"]["probe"]["model"] in ("kinematic", "piezo"):
        found += [
            f"No {words} were measured: effects that only they show could not be tested."
            for name, words in missing.items()
            if name not in measured["quantities"]
        ]
    if measured["rows_without_values"]:
        found.append(
            f"{measured['rows_without_values']} rows have no values (the probe never triggered) and are left out."
        )
    return found


def _of_scatter(noise: Mapping[str, Any]) -> list[str]:
    if noise["from_repeats"]:
        few = f"The scatter has only {noise['dof']} degrees of freedom; measure more repeats."
        return [few] if noise["dof"] < FEW_DOF else []
    seen = "No direction was probed twice"
    if noise["copies"]:
        seen = "Repeats agree to the last digit: they are copies, or simulated without scatter"
    elif noise["dof"]:
        seen = f"Too few directions were probed twice ({noise['dof']} degrees of freedom)"
    return [
        f"{seen}. The scatter is estimated from the residuals of the model beyond the rounding of the printed digits:"
        " chi-square is then near one for any model, irregular errors count as scatter, and a change that is small"
        " against it is missed. Probe every direction at least twice."
    ]
