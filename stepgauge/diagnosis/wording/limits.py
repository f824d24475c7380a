"""Words and numbers of the report of a ``diagnosis.json``: verdict, limits, values with their uncertainties."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.conditions.duplicates import copies_words
from stepgauge.diagnosis.gaussian_processes.random_function import SMOOTH
from stepgauge.diagnosis.wording.aliases import leads_into_mm
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import subject
from stepgauge.diagnosis.wording.notation import significant
from stepgauge.diagnosis.wording.phrases import misfit, worded, worded_all

FEW_DOF = 20
FULL_TURN_DEG = 240.0
"""Least span of azimuths that separates a harmonic from a constant."""
QUANTITIES = {"trigger_force_N": "trigger force", "deflection_um": "deflection", "pretravel_um": "pre-travel"}
SCATTER_WORDS = {
    "growth": "scatter that grows",
    "burst": "scatter that is larger in one stretch of the record",
    "correlation": "scatter correlated from touch to touch",
    "certificate": "certificate with uncertainties that are too small",
    "outlying": "single outliers",
    "heavy": "tails heavier than normal",
}


def limits(said: Mapping[str, Any]) -> list[str]:
    """What this recording cannot show, whatever the verdict."""
    measured, found = said["measured"], []
    if not said["noise"]["from_repeats"]:
        found.append(
            "No face was probed twice under the same conditions. The noise is estimated from the repeatability in the"
            " machine file and from the residuals of the model: structure from face to face may count as noise."
        )
    elif said["noise"]["dof"] < FEW_DOF:
        found.append(f"The noise has only {said['noise']['dof']} degrees of freedom; measure more cycles.")
    if len(measured["placements"]) == 1:
        found.append(
            "The gauge lay in one place. Errors of the machine (scales, guideways) and of the gauge (certificate,"
            " temperature, bending) can be separated only by further placements."
        )
    if len(measured["speeds_mm_s"]) < 2:
        found.append("There was one measuring speed: a trigger delay cannot be separated from a larger pre-travel.")
    for axis, step in measured.get("even_steps_mm", {}).items():
        leads = listed([f"{one:g}" for one in leads_into_mm(step)], "or")
        found.append(
            f"Fronts and backs were probed in whole steps of {significant(step, 4)} mm of {axis}: a periodic error of a"
            f" period that goes into it ({leads} mm), as of a screw, is the same at all of them, and cannot be told"
            f" from a tip radius or a backlash of {axis}. A placement shifted along {axis} by a quarter of the pitch"
            " shows it."
        )
    if not measured["time_recorded"]:
        found.append("No times were recorded: drift, cycles, steps and vibration could not be tested.")
    if not measured["gauge_temperature_recorded"]:
        found.append("The temperature of the gauge was not recorded; that of the certificate was assumed.")
    if said["inputs"]["gauge"]["example"]:
        found.append("The certificate is an example, not that of a real gauge.")
    return found


def warnings(said: Mapping[str, Any], language: str = "en") -> list[str]:
    """What whoever reads the result must know first: simulated, failed checks, effects that do not help, copies."""
    found = [say("simulated", language)] if said["inputs"].get("simulated") else []
    for check in said["checks"]:
        if not check["passed"]:
            text = worded(check["phrase"], subject(said), language)
            found.append(say("check_fails", language, check=say(f"part_{check['check']}", language), text=text))
    return [*found, *misfits(said, language), *without_scatter(said, language)]


def misfits(said: Mapping[str, Any], language: str = "en") -> list[str]:
    """That the named effects of a recording make the residuals no smaller."""
    before_um, after_um = (said["fit"].get(f"rms_{when}_um") for when in ("before", "after"))
    if not said["effects"] or before_um is None or after_um is None:
        return []
    return worded_all(misfit(before_um, after_um), language=language)


def without_scatter(said: Mapping[str, Any], language: str = "en") -> Iterator[str]:
    """That readings repeat as no reading does, which whoever reads the result must know."""
    cycles, alike = defaultdict[int, list[int]](list), defaultdict[str, list[str]](list)
    for one in said.get("measured", {}).get("copied_cycles", ()):
        cycles[one["placement"]].append(one["cycle"])
    for placement, own in cycles.items():
        alike[copies_words(own) if language == "en" else f"{len(own)}"].append(str(placement))
    if cycles:
        each = [say("copies_of", language, copies=own, placements=listed(of)) for own, of in alike.items()]
        yield say("copies", language, each=listed(each, language=language))
    if said.get("noise", {}).get("least"):
        yield say("no_scatter", language)


def lacking(said: Mapping[str, Any], language: str = "en") -> list[str]:
    """What an insufficient recording lacks."""
    if said["verdict"] != "insufficient":
        return []
    if "axis" in said:
        return [say("lacks_axis", language)]
    if "map" in said["inputs"]:
        return [say("lacks_map", language, what=one) for one in said["lacking"]]
    if not said["noise"]["from_repeats"]:
        return [say("lacks_repeats", language)]
    few = say("lacks_cycles", language)
    return [say("lacks_placement", language, few=few) if said["odds"] else few]


def remaining(unexplained: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The forms by covariate: each covariate once, with the faces, its forms, and the largest probability."""
    rows = defaultdict[str, list[Mapping[str, Any]]](list)
    for one in unexplained:
        rows[one["covariate"]].append(one)
    return [
        {
            "covariate": covariate,
            "side": ", ".join(dict.fromkeys(one["side"] for one in own)),
            "where": "; ".join(dict.fromkeys(one["where"] for one in own)),
            "probability": max(one["probability"] for one in own),
            "beside": " and ".join(
                dict.fromkeys(one["beside"] for one in own if one.get("beside") and one["form"] == SMOOTH)
            ),
            "forms": [one["form"] for one in own],
            "open": [one for one in own if one.get("separate_by")],
        }
        for covariate, own in rows.items()
    ]


def map_limits(said: Mapping[str, Any]) -> list[str]:
    """What this map cannot show, whatever the verdict."""
    measured = said["measured"]
    found = [*_map_scatter(said["noise"])]
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


def _map_scatter(noise: Mapping[str, Any]) -> list[str]:
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


def _evenly(axis: Mapping[str, Any]) -> str:
    step = f"{significant(axis['even_step'], 4)} {axis['unit']}"
    return (
        f"The targets lie in even steps of {step}: an error whose period is {step} or a whole fraction of it is the"
        " same at all of them and cannot be seen, and a shorter period may show as a longer one, its alias. Targets at"
        " uneven steps show both."
    )


def axis_limits(said: Mapping[str, Any]) -> list[str]:
    """What the recording cannot show, whatever the verdict."""
    axis, found = said["axis"], []
    if not said["measured"]["time_recorded"]:
        found.append("No times were recorded: drift, cycles, jumps and vibration could not be looked for.")
    if not said["noise"]["from_repeats"] and axis["form"] == "axis":
        found.append(
            "No target was read twice in the same direction: structure from target to target may count as noise."
        )
    if axis["form"] == "axis":
        found.append(
            "Targets count as true unless their uncertainties are given; an error of what realises them is one of the"
            " axis here. There is no machine file, and none is written."
        )
    if axis["form"] == "distances":
        found.append(
            "The places of the stations are not known and are fitted: an error in proportion to the distance cannot be"
            " told. Distances must be between points of one height, or reduced to it."
        )
    if axis["form"] == "axis" and axis["even_step"]:
        found.append(_evenly(axis))
    words = axis["sensor_words"]
    found.append(
        f"Read by {'an' if words[0] in 'aeio' else 'a'} {words}: only what such a sensor can have was looked for."
    )
    return found
