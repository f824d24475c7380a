"""Meaning of a change of the construction for the user of the probe: one sentence per kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from stepgauge.diagnosis.maps.result import OUTLIERS
from stepgauge.diagnosis.result import Finding, FindingMember
from stepgauge.diagnosis.wording.notation import size

Values = Mapping[str, float]


def probe_meaning(finding: Finding | FindingMember) -> str:
    """A finding, or what may be there in its place, in a sentence with its size."""
    values = {name: estimate.value for name, estimate in finding.parameters.items()}
    if finding.kind == OUTLIERS:
        return _outliers(round(values["rows"]))
    choice = finding.label.removeprefix(finding.kind).strip()
    sentence = _SENTENCES.get((finding.kind, choice)) or _SENTENCES[(finding.kind, "")]
    return sentence(values)


def _outliers(count: int) -> str:
    rows = "One row is" if count == 1 else f"{count} rows are"
    return f"{rows} far from the neighbouring directions: dirt, a false trigger or a typing error. They are not used."


def _lever(v: Values) -> str:
    way = "farther from" if v["mm"] > 0.0 else "nearer to"
    return (
        f"The contacts lie {abs(v['mm']):.3g} mm {way} the tip than in the file: the lever of a force at the tip"
        " differs, so all forces change by nearly the same factor."
    )


def _more(word: str, more: str, less: str, name: str, unit: str) -> Callable[[Values], str]:
    def sentence(v: Values) -> str:
        way = more if v[unit] > 0.0 else less
        return f"{word} is {abs(v[unit]):.3g} {unit} {way} than in the file: {v[name]:.4g} {unit}."

    return sentence


def _compliance(v: Values) -> str:
    way = "softer" if v["factor"] > 1.0 else "stiffer"
    return (
        f"The stylus with its holder is {size(100.0 * (v['factor'] - 1.0))} % {way} than computed from its sections:"
        f" {v['lateral_um_per_N']:.3g} um/N across."
    )


def _percent(v: Values) -> str:
    excess = v["factor"] - 1.0
    return f"The force gauge indicates {size(100.0 * excess)} % too {_much(excess)}; this is no error of the probe."


def _offset(v: Values) -> str:
    return f"The force gauge indicates {abs(v['N']):.2g} N too {_much(v['N'])} everywhere: its zero was not set."


def _much(value: float) -> str:
    return "much" if value > 0.0 else "little"


_SENTENCES: dict[tuple[str, str], Callable[[Values], str]] = {
    ("lever_arm", ""): _lever,
    ("stylus_length", ""): _more("The stylus", "longer", "shorter", "stylus_length_mm", "mm"),
    ("preload", ""): _more("The spring's force", "more", "less", "preload_N", "N"),
    ("contact_radius", ""): _more("The radius of the contacts", "larger", "smaller", "contact_radius_mm", "mm"),
    ("contact_angle", ""): _more("The angle of the contacts", "steeper", "flatter", "contact_angle_deg", "deg"),
    ("lobing_phase", ""): lambda v: (
        f"The tripod is rotated by {v['deg']:.3g} deg about the stylus: its first arm lies at"
        f" {v['arm_azimuth_deg']:.3g}"
        " deg. The probe was mounted at another angle, or azimuths are counted from another axis."
    ),
    ("eccentricity", ""): lambda v: (
        f"The line of action of the spring is {v['mm']:.2g} mm off the axis, towards {v['azimuth_deg']:.3g} deg: one"
        " contact carries more than the others and opens later."
    ),
    ("friction", "of the seats"): lambda v: (
        f"There is friction in the seats (coefficient {v['seat']:.2g}): worn or dry contacts open later."
    ),
    ("friction", "of the tip"): lambda v: (
        f"There is friction between tip and surface (coefficient {v['tip']:.2g}): the tip does not slide freely."
    ),
    ("compliance", ""): _compliance,
    ("force_gauge_scale", ""): _percent,
    ("force_gauge_offset", ""): _offset,
    ("effective_radius", ""): lambda v: (
        f"The probe triggers {abs(v['um']):.3g} um {'later' if v['um'] > 0.0 else 'sooner'} than in the file, equally"
        " in all directions: qualify it anew."
    ),
    ("probe_lobing", "cosine"): lambda v: (
        f"The pre-travel has three sinusoidal lobes of {v['amplitude_um']:.3g} um, the maximum at an approach azimuth"
        f" of {v['phase_deg']:.3g} deg."
    ),
    ("probe_lobing", "triangular"): lambda v: (
        f"The pre-travel is that of three contacts that open one after the other (Wozniak): {v['constant_um']:.4g} um"
        f" perpendicular to the stylus, least towards {v['phase_deg']:.3g} deg, and {v['offset_um']:.3g} um in all"
        " directions."
    ),
}
