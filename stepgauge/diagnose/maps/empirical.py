"""Structure without a known law as a change of the probe file: the form that was found, with fitted coefficients."""

from __future__ import annotations

from collections.abc import Sequence

from stepgauge.diagnose.maps.candidates import Candidate, Knob, Table
from stepgauge.diagnose.maps.data import Measured
from stepgauge.diagnose.maps.locate import Found

EMPIRICAL = "empirical"
_WIDEST = 1e6


def empirical(found: Found, measured: Measured, scatter: float) -> Candidate:
    """A law ``[[probe.empirical]]`` of this form, its coefficients in the unit of the quantity.

    ``scatter``: standard deviation of a reading, the scale on which a coefficient counts as large.
    """
    knobs = tuple(
        Knob(f"c{i}", measured.unit, 0.0, -_WIDEST, _WIDEST, max(scatter, 1e-9))
        for i, _ in enumerate(found.shape.terms, 1)
    )
    formula = " + ".join(
        name if term == "1" else f"{name} * {term}"
        for name, term in zip((knob.name for knob in knobs), found.shape.terms, strict=True)
    )

    def change(table: Table, values: Sequence[float]) -> None:
        coefficients = {knob.name: value for knob, value in zip(knobs, values, strict=True)}
        law = {"quantity": measured.name, "formula": formula, "coefficients": coefficients}
        table["empirical"] = [*table.get("empirical", []), law]

    return Candidate(EMPIRICAL, knobs, ((0.0,) * len(knobs),), change, found.form)
