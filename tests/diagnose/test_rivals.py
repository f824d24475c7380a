"""Which laws stand beside one another as possible: by their chances, how common they are, and the size they need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stepgauge.diagnose.confounded import rivals
from stepgauge.diagnose.noise import estimate_noise
from stepgauge.diagnose.search import Library, Look
from stepgauge.diagnose.select import FALSE_ALARM, Selector
from stepgauge.diagnose.whitening import make_whitening

from stepgauge.diagnose.engine import diagnose
from stepgauge.diagnose.library import effect_families
from stepgauge.diagnose.residuals import make_residuals
from stepgauge.effects import effect_kinds
from stepgauge.recording import Recording
from tests.diagnose.made import ALONG_X, gauge, machine
from tests.diagnose.test_selection import NOISE_UM, bent, clean, names, side, told

NEAR_X = (1.0, float(np.tan(np.radians(0.3))), 0.0)
STRETCH = {"scale_error", "gauge_temperature", "scale_temperature"}


def stretched(ppm: float, axis: tuple[float, float, float]) -> set[str]:
    """What is said of one placement that is too long: all names of the one finding, none without a finding."""
    recording = clean((axis,))
    found = told(bent(lambda r: ppm * 1e-3 * (r.frame["x_mm"].to_numpy() - 350.0) * side(r), recording))
    assert len(found.findings) <= 1
    return {name for one in found.findings for name in (one.kind, *one.confounded_with)}


def candidates(recording: Recording, times: float = 1.0) -> Selector:
    """All laws beside the scatter of a recording, or so many times it."""
    data = make_residuals(recording, gauge(), machine(noise_um=NOISE_UM))
    whitening = make_whitening(data, times * estimate_noise(data).by_row_um)
    return Selector(Library(list(effect_families(data)), whitening), whitening, data)


def allowed(recording: Recording) -> dict[str, float]:
    """Chance of a false alarm that every law may take."""
    selector = candidates(recording)
    chances = np.exp(selector.bar - np.array(selector.library.rarities))
    assert chances.sum() == pytest.approx(FALSE_ALARM)
    families = selector.library.families
    return {family.label: float(chance) for family, chance in zip(families, chances, strict=True)}


def test_the_laws_share_one_chance_of_a_false_alarm_by_how_common_they_are() -> None:
    chance = allowed(clean())
    assert chance["block_defect_5"] < chance["reversal_error_x"]
    assert chance["scale_error_y"] == pytest.approx(chance["scale_error_x"], rel=0.1)


def test_a_law_that_could_hardly_show_leaves_its_chance_to_those_that_can() -> None:
    """Along an axis that moves by two millimetres a scale would have to be hundreds of ppm off."""
    chance = allowed(clean((NEAR_X,)))
    assert chance["scale_error_y"] < 0.05 * chance["scale_error_x"]


@pytest.mark.parametrize("ppm", np.geomspace(0.8, 2.4, 8))
def test_a_set_is_whole_however_little_there_is_to_see(ppm: float) -> None:
    """Near the limit of what shows, one of a set passes the bar and the next does not: they explain the same."""
    said = stretched(ppm, ALONG_X)
    assert not said or said >= STRETCH


def test_some_of_the_sizes_tried_above_do_show_and_some_do_not() -> None:
    assert not stretched(0.2, ALONG_X)
    assert stretched(2.4, ALONG_X) >= STRETCH


def test_what_needs_a_size_that_does_not_occur_is_not_listed() -> None:
    """A gauge 0.3 degrees off an axis is 3 ppm too long: or the axes are 600 urad off square, which nobody delivers."""
    said = stretched(3.0, NEAR_X)
    assert said >= STRETCH
    assert "squareness" not in said


def test_squareness_of_a_usual_size_is_named_where_it_shows() -> None:
    axes = ((1.0, 1.0, 0.0), (1.0, -1.0, 0.0))
    found = told(
        bent(
            lambda r: 8e-3 * (r.frame["y_mm"].to_numpy() - 600.0) * r.frame["approach_i"].to_numpy(),
            clean(axes),
        )
    )
    assert "squareness" in names(found)


@pytest.mark.parametrize("kind", ["periodic_scale_error", "local_scale_defect", "step_change", "vibration"])
def test_heights_are_expected_as_high_as_any_whatever_the_length_of_the_gauge(kind: str) -> None:
    data = make_residuals(bent(lambda r: 500.0 * np.sin(r.frame["y_mm"].to_numpy())), gauge(), machine())
    bound = {p.name: p.sensible for p in effect_kinds()[kind].parameters() if p.role == "linear"}
    (largest,) = (max(abs(low), abs(high)) for low, high in bound.values())
    assert {family.prior for family in effect_families(data) if family.kind == kind} == {largest}


def test_where_the_laws_leave_something_is_where_the_disagreement_lives() -> None:
    """A delay, with no such law to name it: most of it is a constant, and what is left goes with the speed."""
    recording = clean((ALONG_X,))
    speed = np.where(recording.frame["cycle"] % 2 == 0, 2.0, 8.0)
    fast = replace(recording, frame=recording.frame.assign(speed_mm_s=speed))
    found = diagnose(bent(lambda _: 0.4 * speed, fast), gauge(), machine(noise_um=NOISE_UM), ("trigger_delay",))
    assert found.verdict == "unknown"
    assert {one.covariate for one in found.unexplained} <= {one.covariate for one in found.located}
    assert "speed" in {one.covariate for one in found.located}


@pytest.mark.parametrize("ppm", [12.0, 20.0])
@pytest.mark.parametrize("times", [0.8, 1.2])
def test_laws_compare_by_what_they_leave_however_much_they_explain(ppm: float, times: float) -> None:
    """A warm gauge along x and 10 degrees off it is nearly an axis that is too long: by the cosine, 1.5 %.

    Student's likelihoods with the scatter unknown, written out: a wrong statement of it changes nothing.
    """
    recording = clean((ALONG_X, (1.0, float(np.tan(np.radians(10.0))), 0.0)))
    toward = recording.frame["approach_i"].to_numpy()
    selector = candidates(bent(lambda r: ppm * 1e-3 * (r.frame["x_mm"].to_numpy() - 350.0) * toward, recording), times)
    terms = tuple(selector.term_of(look) for look in selector.looks(()) if look.family.kind == "gauge_temperature")
    found = rivals(selector, terms, 0)
    weights = {look.family.label: weight for look, weight in zip(found.looks, found.weights, strict=True)}
    squares = np.array([selector.sum_of_squares((selector.term_of(look),)) for look in found.looks])
    odd = np.array([_log_oddity(selector, look) for look in found.looks])
    likely = dict(zip(weights, -(selector.dof - 1) / 2.0 * np.log(squares) - odd, strict=True))
    first, *others = weights
    assert others
    for name in others:
        ratio = np.log(weights[first] / weights[name])
        assert ratio == pytest.approx(likely[first] - likely[name], abs=0.1)


def _log_oddity(selector: Selector, look: Look) -> float:
    """How much rarer a law of this kind and size is than the commonest."""
    (solved,) = selector.fit((selector.term_of(look),)).solved
    sizes = [abs(getattr(solved.effect, name)) / usual for name, usual in look.family.usual.items()]
    return look.extent.rarity + 2.0 * float(np.log1p(sizes).sum())


def test_one_family_alone_is_looked_at_as_among_all() -> None:
    selector = candidates(bent(lambda r: 0.4 * side(r) * (r.frame["cycle"].to_numpy() > 2)))
    library, white, dof = selector.library, selector.data, selector.dof
    model = white[:, None] * (selector.residuals.side > 0.0)[:, None]
    model /= np.linalg.norm(model)
    among = {id(look.family): look for look in library.looks(white, model, dof - 1)}
    for index, family in enumerate(library.families):
        alone, there = library.look(index, white, model, dof - 1), among[id(family)]
        assert alone.gain == pytest.approx(there.gain, rel=1e-3, abs=1e-3)
        assert alone.log_p == pytest.approx(there.log_p, rel=1e-3, abs=2e-3)
        assert alone.extent == there.extent
