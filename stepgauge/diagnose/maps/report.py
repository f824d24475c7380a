"""``diagnosis.md`` of a probe map: what its ``diagnosis.json`` says, as a metrologist would write it.

The template ``templates/reports/probe-diagnosis.md.j2`` sees ``d``, the content of the JSON; ``figures``, the names of
the figures beside it; ``summary``, the verdict in a sentence; ``limits``, what this map cannot show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stepgauge.diagnose.practice import name_of
from stepgauge.diagnose.report import COVERAGE, FEW_DOF, environment, listed
from stepgauge.files.resources import folder
from stepgauge.files.text import read_text

VERDICTS = {
    "adequate": "The map agrees with the probe file within the scatter. Nothing in the file needs to be changed.",
    "effects": "The map disagrees with the probe file, and known causes explain it:",
    "unknown": "The map disagrees with the probe file in a way that no known cause explains.",
    "insufficient": "The map cannot tell whether the probe file is right.",
}
FULL_TURN_DEG = 240.0
"""Azimuths that span less leave a harmonic and what is the same all around hard to tell apart."""
QUANTITIES = {"trigger_force_N": "trigger force", "deflection_um": "deflection", "pretravel_um": "pre-travel"}


def report_text(said: Mapping[str, Any], figures: Sequence[str] = (), template: str | Path | None = None) -> str:
    """The report of a map's diagnosis.

    Parameters
    ----------
    said : content of a ``diagnosis.json``
    figures : names of the figures beside it: residuals, directions and, where there are any, effects
    template : Jinja file to use instead of the shipped one
    """
    source = Path(template) if template else folder("templates") / "reports" / "probe-diagnosis.md.j2"
    jinja = environment()
    jinja.filters["quantity"] = lambda name: QUANTITIES[name]
    context = {
        "d": said,
        "figures": {Path(name).stem: name for name in figures},
        "summary": summary(said),
        "limits": limits(said),
        "coverage": COVERAGE,
    }
    return jinja.from_string(read_text(source)).render(context)


def summary(said: Mapping[str, Any]) -> str:
    """The verdict in a sentence or two."""
    text = VERDICTS[said["verdict"]]
    named = [_named(effect) for effect in said["effects"]]
    if said["verdict"] == "effects":
        return f"{text} {listed(named)}."
    if said["verdict"] == "unknown":
        part = f" Beside it there {'is' if len(named) == 1 else 'are'}: {listed(named)}." if named else ""
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
            f"The azimuths go from {azimuth['from']:g} to {azimuth['to']:g} deg. What differs between the thirds of a"
            " turn (eccentricity, a damaged seat, lobes other than three) shows only over a full turn."
        )
    if polar["different"] == 1:
        found.append(
            f"There is one polar angle, {polar['from']:g} deg. Lever, preload and contact radius act alike on a single"
            " ring; oblique directions tell them apart."
        )
    missing = {"trigger_force_N": "trigger forces", "deflection_um": "deflections"}
    if said["inputs"]["probe"]["model"] in ("kinematic", "piezo"):
        found += [
            f"No {words} were measured: what shows in them alone could not be looked for."
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
        few = f"The scatter rests on {noise['dof']} degrees of freedom only; more repeats would sharpen it."
        return [few] if noise["dof"] < FEW_DOF else []
    seen = "No direction was probed twice"
    if noise["copies"]:
        seen = "Repeats agree to the last bit: they are copies, or simulated without scatter"
    elif noise["dof"]:
        seen = f"Too few directions were probed twice ({noise['dof']} degrees of freedom)"
    return [
        f"{seen}. The scatter had to be taken from what the model leaves beyond the rounding of the printed digits:"
        " chi-square is then near one whatever the model, a disagreement in no regular form passes for scatter, and a"
        " change that is small against it is missed. Probing every direction twice would settle that."
    ]
