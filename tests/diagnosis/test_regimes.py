"""A disagreement that lives in a part of the record only is told with that part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.engine import diagnose
from stepgauge.recording import Recording
from tests.diagnosis.made import ALONG_X, gauge, machine, record
from tests.diagnosis.test_selection import NOISE_UM, bent, side, told

Array = NDArray[np.float64]


def beyond(values: Array, edge: float, over: float) -> Array:
    """Nought up to an edge, then a hump and back over a span: no line, no step, no bump that a law has."""
    u = np.clip((values - edge) / over, 0.0, None)
    return np.asarray(u * np.sin(2.5 * u**1.5))


def warm(recording: Recording) -> Array:
    """A temperature of a spindle that rises and falls in a way of its own."""
    u = np.linspace(0.0, 1.0, len(recording.frame))
    return 20.0 + 6.0 * np.abs(np.sin(5.3 * u**0.7))


def of_time(frame: pd.DataFrame) -> Array:
    t = frame["time_s"].to_numpy()
    return 2.5 * beyond(t - t.min(), 0.6 * float(np.ptp(t)), 0.2 * float(np.ptp(t)))


def of_spindle(frame: pd.DataFrame) -> Array:
    return 2.5 * beyond(frame["spindle_C"].to_numpy(), 23.5, 1.2)


REGIMES: dict[str, tuple[Callable[[pd.DataFrame], Array], str, str, float, float]] = {
    "after a time": (of_time, "time", "only above", 0.6, 0.15),
    "above a temperature": (of_spindle, "spindle_C", "only above", 23.5, 1.0),
}


@pytest.mark.parametrize("name", REGIMES)
def test_a_disagreement_in_one_part_of_the_record_is_told_with_its_edge(name: str) -> None:
    um, covariate, words, edge, near = REGIMES[name]
    plain = record(machine(noise_um=NOISE_UM), (ALONG_X,), seed=7, cycles=8)
    with_spindle = replace(plain, frame=plain.frame.assign(spindle_C=warm(plain)))
    found = told(bent(lambda r: um(r.frame) * side(r), with_spindle))
    assert found.verdict == "unknown"
    where = [one.where for one in found.unexplained if one.covariate == covariate]
    assert where
    assert words in where[0]
    assert ("as recorded" in where[0]) == (covariate != "time")
    told_edge = float(where[0].split(words)[1].split()[0])
    if covariate == "time":
        t = plain.frame["time_s"].to_numpy()
        told_edge = (told_edge - float(t.min())) / float(np.ptp(t))
    assert told_edge == pytest.approx(edge, abs=near)


def test_a_disagreement_everywhere_is_told_without_an_edge() -> None:
    """Of which no law explains one part: what is left beside a period has an edge where that begins to fail."""
    plain = record(machine(noise_um=NOISE_UM), (ALONG_X,), seed=7, cycles=8)
    bow = bent(lambda r: 1.5 * np.sin((r.frame["x_mm"].to_numpy() / 90.0) ** 1.7) * side(r), plain)
    found = diagnose(bow, gauge(), machine(noise_um=NOISE_UM), without=["periodic_scale_error"])
    assert found.unexplained
    assert not [one.where for one in found.unexplained if "only" in one.where]
