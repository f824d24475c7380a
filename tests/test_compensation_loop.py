"""Measured, compensated, measured again: every format on a control written from the sentence of its maker."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest

from stepgauge.compensation import FORMATS, AxisReadings, TableOptions, TipRadius, axis_faces, make_table, render_table
from stepgauge.compensation.conventions import CONVENTIONS, SKEW_CONVENTIONS
from stepgauge.compensation.result import find_skew, render_skew
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.recording import Recording, join_recordings
from tests.build import make_gauge
from tests.compensating_controls import CONTROLS, SKEW_CONTROLS, Array, Motor

RADIUS = 1.997
GAUGE = make_gauge(12, deviation_um=np.r_[0.0, np.random.default_rng(3).normal(0, 2, 23)])
STRAIGHT = ("grbl", "marlin", "rrf")
"""These know a scale and a backlash."""


@dataclass(frozen=True)
class Axis:
    """An axis whose scale errs by ``error_um``; its gauge lies along (+1) or against (-1) it from ``start_mm``."""

    index: int
    way: int
    start_mm: float
    wave_um: float
    change: float

    def error_um(self, motor: Array, sense: int) -> Array:
        """Indicated minus true: a long screw, a wave, and a backlash of which a part changes with the wave."""
        wave = self.wave_um * np.sin(2 * np.pi * motor / 200.0)
        return 0.06 * motor + wave + sense * (3.0 + self.change * wave)

    def measured(self, motor: Motor, shift_mm: float = 0.0) -> tuple[Recording, Array, Array]:
        """The recording, and of its faces the sense of travel and what the control indicates minus what is true, um."""
        face = np.tile(np.arange(1, GAUGE.n_faces + 1), 2)
        forward = np.where(face % 2 == 1, 1, -1)
        sense = self.way * forward
        true = self.start_mm + self.way * (GAUGE.position_mm[face - 1] + shift_mm - forward * RADIUS)
        indicated = true.copy()
        for _ in range(8):  # where the control stands when the tip is there
            for one in (1, -1):
                mine = sense == one
                at = motor(indicated[mine], one)
                indicated[mine] += true[mine] - (at - 1e-3 * self.error_um(at, one))
        frame = pd.DataFrame({"placement": 1, "cycle": np.arange(len(face)) // GAUGE.n_faces + 1, "face": face})
        for k, name in enumerate("xyz"):
            frame[f"{name}_mm"] = indicated if k == self.index else 70.0 + 1e-9 * frame["cycle"]  # no copies
            frame[f"approach_{'ijk'[k]}"] = sense.astype(float) if k == self.index else 0.0
        return Recording(frame, {}, "made.csv"), sense, (indicated - true) * 1e3


def largest_um(sense: Array, error_um: Array, travel: str) -> float:
    """Largest error about the middle: of both senses together, or of each that one table for both is to correct."""
    senses = {"both": [(1, -1)], "mean": [(1,), (-1,)], "positive": [(1,)], "negative": [(-1,)]}[travel]
    return max(float(np.ptp(error_um[np.isin(sense, ones)])) / 2.0 for ones in senses)


def uncompensated(p: Array, _sense: int) -> Array:
    return p


@cache
def first_measured(axis: Axis) -> tuple[AxisReadings, Array, Array]:
    """What the package makes of the first measurement; sense of travel and true errors of its faces, um."""
    recording, sense, error_um = axis.measured(uncompensated)
    data = evaluation_to_dict(evaluate(recording, GAUGE))
    return axis_faces(data, "evaluation.json", "xyz"[axis.index], TipRadius(RADIUS)), sense, error_um


VARIANTS = [
    (name, kind, travel)
    for name, form in FORMATS.items()
    for kind in ((0, 1) if name in ("linuxcnc", "siemens") else (0,))
    for travel in (("both", "mean") if form.both else ("mean", "positive", "negative"))
    if not (name in STRAIGHT and travel == "mean")
]


@pytest.mark.parametrize(("name", "kind", "travel"), VARIANTS)
def test_the_error_after_is_below_a_tenth_of_that_before(name: str, kind: int, travel: str) -> None:
    """Every axis, the gauge laid either way, at positive and negative coordinates; 7 mm off the second time."""
    form = FORMATS[name]
    asked = name if CONVENTIONS[name].unconfirmed else None
    wave, change = 0.1 if name in STRAIGHT else 4.0, 0.2 if travel == "both" else 0.0
    resolution = 1.0 if name.startswith("fanuc") else 0.0
    for index, way, start in product((0, 1, 2), (1, -1), (-420.0, -97.0, 130.0)):
        axis = Axis(index, way, start + (240.0 if way < 0 else 0.0), wave, change)
        faces, sense, before = first_measured(axis)
        home = 10.0 * round((start + 110.0) / 10.0)
        options = TableOptions(travel, 10.0 if form.even else None, None, "linear", home)  # type: ignore[arg-type]
        text = render_table(make_table(faces, options), form, kind=kind, unconfirmed_sense=asked)
        _, _, after = axis.measured(CONTROLS[name](text, kind, home), 7.0)
        inside = np.arange(48) % 24 < 22  # the last block is beyond the table now
        left = largest_um(sense[inside], after[inside], travel)
        assert left < max(0.1 * largest_um(sense, before, travel), resolution), (index, way, start)


@pytest.mark.parametrize(("blocks", "size", "gap"), [(2, 20.0, 100.0), (2, 100.0, 20.0), (5, 10.0, 90.0), (12, 10, 10)])
def test_a_skew_is_found_in_full_whatever_the_widths_of_blocks_and_gaps(blocks: int, size: float, gap: float) -> None:
    """Against the definition: the indicated x is too large by 3e-4 of y. Its uncertainty covers what the noise does."""
    gauge, misses = make_gauge(blocks, size, gap), []
    for seed in range(12):
        noise, parts = np.random.default_rng(seed), []
        for number, side in enumerate((1.0, -1.0), 1):
            direction = np.array([1.0, side, 0.0]) / np.sqrt(2.0)
            face = np.tile(np.arange(1, gauge.n_faces + 1), 5)
            forward = np.where(face % 2 == 1, 1.0, -1.0)
            true = np.outer(gauge.position_mm[face - 1] - forward * RADIUS, direction)
            indicated = true + np.outer(3e-4 * true[:, 1], [1.0, 0.0, 0.0]) + noise.normal(0.0, 1e-3, true.shape)
            cycle = np.arange(len(face)) // gauge.n_faces + 1
            frame = pd.DataFrame({"placement": number, "cycle": cycle, "face": face})
            frame[["x_mm", "y_mm", "z_mm"]] = indicated
            frame[["approach_i", "approach_j", "approach_k"]] = np.outer(forward, direction)
            parts.append(Recording(frame, {}, "made.csv"))
        found = find_skew(evaluation_to_dict(evaluate(join_recordings(parts), gauge)), "evaluation.json", "xy")
        misses.append((found.alpha_rad - 3e-4) / found.u_rad)
    assert abs(np.mean(misses)) < 3.0 / np.sqrt(12.0)
    assert 0.5 < np.std(misses) < 1.8


@pytest.mark.parametrize("firmware", SKEW_CONTROLS)
@pytest.mark.parametrize("plane", ["xy", "xz", "yz"])
def test_a_skew_measured_again_is_gone(firmware: str, plane: str) -> None:
    """Both signs, the gauge laid either way along the diagonals, about zero and at negative coordinates."""
    i, j = ("xyz".index(one) for one in plane)

    def evaluation(skew: float, added: float, ways: tuple[int, int], start: float) -> dict[str, Any]:
        parts = []
        for number, (yaw, way) in enumerate(zip((0.7, -0.7), ways, strict=True), 1):
            direction = np.zeros(3)
            direction[[i, j]] = way * np.cos(yaw), way * np.sin(yaw)
            face = np.tile(np.arange(1, GAUGE.n_faces + 1), 2)
            forward = np.where(face % 2 == 1, 1.0, -1.0)
            true = start + np.outer(GAUGE.position_mm[face - 1] - forward * RADIUS, direction)
            motor = true + np.outer(skew * true[:, j], np.eye(3)[i])  # at the motors: too large by skew times second
            indicated = motor - np.outer(added * motor[:, j], np.eye(3)[i])
            indicated *= 1.0 + np.array([3e-5, -8e-5, 5e-5])  # scales do not disturb it
            frame = pd.DataFrame({"placement": number, "cycle": np.arange(len(face)) // 24 + 1, "face": face})
            frame[["x_mm", "y_mm", "z_mm"]] = indicated + 1e-9 * frame[["cycle"]].to_numpy()  # no copies
            frame[["approach_i", "approach_j", "approach_k"]] = np.outer(forward, direction)
            parts.append(Recording(frame, {}, "made.csv"))
        return evaluation_to_dict(evaluate(join_recordings(parts), GAUGE))

    for skew, ways, start in product((8e-4, -8e-4), product((1, -1), (1, -1)), (0.0, -300.0)):
        data = evaluation(skew, 0.0, ways, start)
        text = render_skew(find_skew(data, "evaluation.json", plane), firmware, data, "evaluation.json")
        first, second, added = SKEW_CONTROLS[firmware](text)
        assert (first, second) == (i, j)
        again = find_skew(evaluation(skew, added, ways, start), "evaluation.json", plane)
        assert abs(again.alpha_rad) < 0.01 * abs(skew)
        with pytest.raises(InputError, match=r"no two placements along the diagonals of .*; found 0 placements"):
            find_skew(data, "evaluation.json", {"xy": "yz", "yz": "xz", "xz": "xy"}[plane])


def test_what_no_source_confirms_is_written_only_when_asked_for_by_its_name() -> None:
    faces, _, _ = first_measured(Axis(0, 1, 130.0, 4.0, 0.2))
    table = make_table(faces, TableOptions("both", 10.0))
    unconfirmed = {name for name, one in CONVENTIONS.items() if one.unconfirmed}
    assert unconfirmed == {"fanuc", "fanuc-g10", "heidenhain"}
    for name in unconfirmed:
        for said in (None, *(unconfirmed - {name})):
            with pytest.raises(InputError, match=f"doubles the error; found the sense .* expected .*{name}., and a co"):
                render_table(table, FORMATS[name], unconfirmed_sense=said)
        assert "NOT CONFIRMED" in render_table(table, FORMATS[name], unconfirmed_sense=name)
    with pytest.raises(InputError, match="unconfirmed_sense: the sense of csv is confirmed; found csv"):
        render_table(table, FORMATS["csv"], unconfirmed_sense="csv")


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_says_what_it_takes_for_granted(name: str) -> None:
    """Enabling, homing and the reference position, in the file itself."""
    faces, _, _ = first_measured(Axis(0, 1, 130.0, 4.0, 0.2))
    form = FORMATS[name]
    table = make_table(faces, TableOptions("both" if form.both else "mean", 10.0))
    text = render_table(table, form, unconfirmed_sense=name if form.convention.unconfirmed else None)
    flat = " ".join(text.replace("\n", " ").translate(str.maketrans("()#;,_", "      ")).upper().split())
    needed = form.convention.needs.translate(str.maketrans("()#;,_", "      ")).upper().split()
    assert " ".join(needed) in flat
    assert CONVENTIONS.keys() == CONTROLS.keys() == FORMATS.keys()
    assert SKEW_CONVENTIONS.keys() == SKEW_CONTROLS.keys()
