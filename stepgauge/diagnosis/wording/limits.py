"""What a diagnosis cannot show, what it lacks, and what its reader must know first, from a ``diagnosis.json``."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.conditions.duplicates import copies_words
from stepgauge.diagnosis.gaussian_processes.random_function import SMOOTH
from stepgauge.diagnosis.laws.geometry import KIND as GEOMETRY
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.wording.aliases import leads_into_mm
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import check_of, finding_name, kind_and_choice, name_of, subject
from stepgauge.diagnosis.wording.notation import COVERAGE, plus_minus, probability
from stepgauge.diagnosis.wording.phrases import misfit, worded, worded_all
from stepgauge.files.notation import significant

FEW_DOF = 20
LIKELY = 0.5
"""Probability from which the kind of an axis is told that nobody stated."""
NO_PRETRAVEL = 0.25
"""Share of the tip radius from which a difference of the effective one is no pre-travel, but another radius."""
UNPREDICTED = 2.0
"""Rms of predictions in units of the noise from which something is not determined without what was held out."""
FULL_TURN_DEG = 240.0
"""Least span of azimuths that separates a harmonic from a constant."""
Limit = tuple[str, dict[str, object]]
"""A key of the catalogue with its values."""


def limits(said: Mapping[str, Any], language: str = "en") -> list[str]:
    """What was measured cannot show, whatever the verdict."""
    found = {"gauge": _gauge_limits, "axis": _axis_limits, "map": _map_limits}[subject(said).of](said)
    return [say(f"limit_{key}", language, **values) for key, values in found]


def _gauge_limits(said: Mapping[str, Any]) -> Iterator[Limit]:
    measured = said["measured"]
    if not said["noise"]["from_repeats"]:
        yield "repeats", {}
    elif said["noise"]["dof"] < FEW_DOF:
        yield "dof", {"dof": said["noise"]["dof"]}
    if len(measured["placements"]) == 1:
        yield "placement", {}
    if len(measured["speeds_mm_s"]) < 2:
        yield "speed", {}
    for axis, step in measured.get("even_steps_mm", {}).items():
        leads = listed([f"{one:g}" for one in leads_into_mm(step)], "or")
        yield "steps", {"axis": axis, "step": significant(step, 4), "leads": leads}
    if not measured["time_recorded"]:
        yield "time", {}
    if not measured["gauge_temperature_recorded"]:
        yield "temperature", {}
    if said["inputs"]["gauge"]["example"]:
        yield "example", {}


def _axis_limits(said: Mapping[str, Any]) -> Iterator[Limit]:
    axis = said["axis"]
    if not axis.get("order_known", True):
        yield "axis_order", {}
    if not said["measured"]["time_recorded"]:
        yield "time", {}
    if not said["noise"]["from_repeats"] and axis["form"] == "axis":
        yield "axis_repeats", {}
    if axis["form"] in ("axis", "distances"):
        yield axis["form"], {}
    yield from _axis_steps(said)
    yield from _axis_kind(axis)
    yield "sensor", {"sensor": axis["sensor_words"]}


def _axis_kind(axis: Mapping[str, Any]) -> Iterator[Limit]:
    """The kind of the axis, where its readings make one likelier than not, or where it is stated."""
    kind, p = next(iter(axis.get("kinds", {}).items()), ("", 0.0))
    if p == 1.0:
        yield "kind_stated", {"kind": kind}
    elif p >= LIKELY:
        yield "kind_found", {"kind": kind, "p": probability(p)}


def _axis_steps(said: Mapping[str, Any]) -> Iterator[Limit]:
    axis = said.get("axis", {})
    if axis.get("form") == "axis" and axis["even_step"]:
        yield "axis_steps", {"step": f"{significant(axis['even_step'], 4)} {axis['unit']}"}


def step_limits(said: Mapping[str, Any]) -> list[str]:
    """That an error whose period is the even step of an axis is not seen, whatever was found."""
    return [say(f"limit_{key}", "en", **values) for key, values in _axis_steps(said)]


def _map_limits(said: Mapping[str, Any]) -> Iterator[Limit]:
    measured, noise = said["measured"], said["noise"]
    polar, azimuth = measured["polar_deg"], measured["azimuth_deg"]
    if not noise["from_repeats"]:
        yield "map_copies" if noise["copies"] else "map_few" if noise["dof"] else "map_repeats", {"dof": noise["dof"]}
    elif noise["dof"] < FEW_DOF:
        yield "dof", {"dof": noise["dof"]}
    if azimuth["to"] - azimuth["from"] < FULL_TURN_DEG:
        yield "azimuth", {name: f"{azimuth[end]:g}" for name, end in (("low", "from"), ("high", "to"))}
    if polar["different"] == 1:
        yield "polar", {"polar": f"{polar['from']:g}"}
    if said["inputs"]["probe"]["model"] in ("kinematic", "piezo"):
        yield from ((name, {}) for name in ("trigger_force_N", "deflection_um") if name not in measured["quantities"])
    if measured["rows_without_values"]:
        yield "values", {"count": measured["rows_without_values"]}


def warnings(said: Mapping[str, Any], language: str = "en") -> list[str]:
    """What whoever reads the result must know first: simulated, failed checks, effects that do not help, copies."""
    found = [say("simulated", language)] if said["inputs"].get("simulated") else []
    for check in said["checks"]:
        if not check["passed"]:
            text = worded(check["phrase"], subject(said), language)
            found.append(say("check_fails", language, check=say(f"part_{check['check']}", language), text=text))
    found += stored_conditions(said).notes
    return [*found, *machine_doubts(said, language), *misfits(said, language), *without_scatter(said, language)]


def machine_doubts(said: Mapping[str, Any], language: str = "en") -> Iterator[str]:
    """What the machine file seems to state wrongly, or does not state and would matter: the tip, the kind."""
    machine, effects = said["inputs"].get("machine", {}), {one["kind"]: one for one in said["effects"]}
    radius = effects.get("effective_radius", {}).get("parameters", {}).get("um", {})
    stated_mm, pretravel_um = machine.get("tip_radius_mm"), said.get("measured", {}).get("pretravel_um")
    larger_mm = -float(radius.get("value", pretravel_um) or 0.0) * 1e-3
    if stated_mm and not said["inputs"].get("tip_corrected") and abs(larger_mm) > NO_PRETRAVEL * stated_mm:
        fits = plus_minus({"value": stated_mm + larger_mm, "u": (radius.get("u") or 0.0) * 1e-3, "unit": "mm"})
        yield say("tip", language, fits=fits + f" (k = {COVERAGE:g})" * bool(radius.get("u")), stated=f"{stated_mm:g}")
    elif pretravel_um is not None:
        u_um = said["measured"].get("pretravel_u_um", 0.0)
        um = plus_minus({"value": float(pretravel_um), "u": u_um, "unit": "um"}) + f" (k = {COVERAGE:g})" * bool(u_um)
        yield say("pretravel_open", language) if u_um is None else say("pretravel", language, um=um)
    yield from widened(said, language)
    if machine.get("kind", "") is None and (said["verdict"] == "unknown" or GEOMETRY in effects):
        yield say("no_kind", language)
    if set(effects) - {GEOMETRY} and said["probabilities"].get("all_geometry", 0.0) >= shipped_priors().decision.in_set:
        yield say("all_geometry", language)


def widened(said: Mapping[str, Any], language: str = "en") -> Iterator[str]:
    """What widens the uncertainties of findings, and what settles it; of those with the same cause together."""
    at, together = subject(said), defaultdict[tuple[str, ...], list[str]](list)
    for one in said["effects"]:
        if laws := tuple(sorted(one.get("widened_by", ()))):
            together[laws].append(finding_name(one, at, language))
    for laws, findings in together.items():
        kinds = list(dict.fromkeys(kind_and_choice(label)[0] for label in laws))
        checks = dict.fromkeys(check_of(label, at, language) for label in laws)
        yield say(
            "widened",
            language,
            findings=listed(findings, language=language),
            laws=listed([name_of(label, at.of, language) for label in laws], "or", language),
            checks=" ".join(checks),
            without=" ".join(f"--without {kind}" for kind in kinds),
        )


def misfits(said: Mapping[str, Any], language: str = "en") -> list[str]:
    """That the named effects of a recording make the residuals no smaller."""
    before_um, after_um = (said.get("fit", {}).get(f"rms_{when}_um") for when in ("before", "after"))
    if not said["effects"] or before_um is None or after_um is None:
        return []
    return worded_all(misfit(before_um, after_um), language=language)


def predictions(fit: Mapping[str, Any]) -> str:
    """What it means that readings which were held out are predicted worse than those that were fitted."""
    far = [by for by, pair in fit["holdout"].items() if (pair["rms_after_um"] or 0.0) > UNPREDICTED * fit["noise_um"]]
    if not far:
        return "Readings that were held out are predicted about as well as those that were fitted are described."
    what = " and ".join(far)
    return (
        f"Readings of {what} that were held out are predicted worse than those that were fitted are described: without"
        f" them not every finding is determined. It holds where it was measured; more {what} make it hold beyond."
    )


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
    prevented = [one.sentence for one in stored_conditions(said).preventing]
    if prevented:
        return prevented
    if "axis" in said:
        return [say("lacks_axis", language)]
    if "map" in said["inputs"]:
        return [say("lacks_map", language, what=one) for one in said["lacking"]]
    if not said["noise"]["from_repeats"]:
        return [say("lacks_repeats", language)]
    return [say("lacks_cycles", language)] if said["noise"]["dof"] < FEW_DOF else []


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
