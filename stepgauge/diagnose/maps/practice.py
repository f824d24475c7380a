"""Meaning of a change of the construction for the user of the probe: one sentence per kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from stepgauge.diagnose.maps.result import OUTLIERS, MapFinding

Values = Mapping[str, float]


def in_practice(finding: MapFinding) -> str:
    """A finding in a sentence, with its size."""
    if finding.kind == OUTLIERS:
        return _outliers(len(finding.rows))
    values = {name: estimate.value for name, estimate in finding.parameters.items()}
    sentence = _SENTENCES.get((finding.kind, finding.choice)) or _SENTENCES[(finding.kind, "")]
    return sentence(values)


def _outliers(count: int) -> str:
    rows = "One row is" if count == 1 else f"{count} rows are"
    return f"{rows} off alone, against the directions around: dirt, a slip or a slip of the pen. They are left out."


def _lever(v: Values) -> str:
    way = "farther from" if v["mm"] > 0.0 else "nearer to"
    return (
        f"The contacts lie {abs(v['mm']):.3g} mm {way} the tip than the file says: a force at the tip opens them with"
        " another lever, so all forces change nearly alike."
    )


def _more(word: str, more: str, less: str, name: str, unit: str) -> Callable[[Values], str]:
    def sentence(v: Values) -> str:
        way = more if v[unit] > 0.0 else less
        return f"{word} is {abs(v[unit]):.3g} {unit} {way} than in the file: {v[name]:.4g} {unit}."

    return sentence


def _compliance(v: Values) -> str:
    way = "softer" if v["factor"] > 1.0 else "stiffer"
    return (
        f"The stylus with its holder is {abs(100.0 * (v['factor'] - 1.0)):.2g} % {way} than its sections make it:"
        f" {v['lateral_um_per_N']:.3g} um/N across."
    )


def _percent(v: Values) -> str:
    excess = v["factor"] - 1.0
    return f"The force gauge reads {abs(100.0 * excess):.2g} % too {_much(excess)}; the probe is not to blame."


def _offset(v: Values) -> str:
    return f"The force gauge reads {abs(v['N']):.2g} N too {_much(v['N'])} everywhere: its zero was not set."


def _much(value: float) -> str:
    return "much" if value > 0.0 else "little"


_SENTENCES: dict[tuple[str, str], Callable[[Values], str]] = {
    ("lever_arm", ""): _lever,
    ("preload", ""): _more("The spring's force", "more", "less", "preload_N", "N"),
    ("contact_radius", ""): _more("The radius of the contacts", "larger", "smaller", "contact_radius_mm", "mm"),
    ("contact_angle", ""): _more("The angle of the contacts", "steeper", "flatter", "contact_angle_deg", "deg"),
    ("lobing_phase", ""): lambda v: (
        f"The tripod is turned by {v['deg']:.3g} deg about the stylus: its first arm lies at {v['arm_azimuth_deg']:.3g}"
        " deg. The probe was screwed in turned, or azimuths are counted from another axis."
    ),
    ("eccentricity", ""): lambda v: (
        f"The spring presses {v['mm']:.2g} mm beside the axis, towards {v['azimuth_deg']:.3g} deg: one contact carries"
        " more than the others and opens later."
    ),
    ("friction", "of the seats"): lambda v: (
        f"The arms rub in their seats (coefficient {v['seat']:.2g}): worn or dry contacts hold the stylus longer."
    ),
    ("friction", "of the tip"): lambda v: (
        f"The tip drags on the surface (coefficient {v['tip']:.2g}). It does not slide."
    ),
    ("compliance", ""): _compliance,
    ("force_gauge_scale", ""): _percent,
    ("force_gauge_offset", ""): _offset,
    ("effective_radius", ""): lambda v: (
        f"The probe triggers {abs(v['um']):.3g} um {'later' if v['um'] > 0.0 else 'sooner'} than the file says, in all"
        " directions alike: qualify it anew."
    ),
    ("probe_lobing", "cosine"): lambda v: (
        f"The pre-travel has three even lobes of {v['amplitude_um']:.3g} um, the largest at an approach azimuth of"
        f" {v['phase_deg']:.3g} deg."
    ),
    ("probe_lobing", "triangular"): lambda v: (
        f"The pre-travel is that of three contacts that open one after the other (Wozniak): {v['constant_um']:.4g} um"
        f" square to the stylus, least towards {v['phase_deg']:.3g} deg, and {v['offset_um']:.3g} um in all directions."
    ),
}
