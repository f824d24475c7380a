"""Recordings of other people's instruments: no law may be named that is not there, and no reading condemned."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.stating_rules import answer_of
from stepgauge.inference.kernels import matern
from stepgauge.inference.problem import Candidate, GaussianProcess, Law, Problem
from stepgauge.inference.search import Search
from tests.build import make_gauge
from tests.conftest import ROOT
from tests.diagnosis.made import by_hand
from tests.diagnosis.test_findings import cmm

Array = NDArray[np.float64]
FIELD = next((up / "shared/data/field" for up in ROOT.parents if (up / "shared/data/field").is_dir()), None)
pytestmark = pytest.mark.skipif(FIELD is None, reason="the tables of other people's instruments are not here")


def table(name: str) -> pd.DataFrame:
    assert FIELD is not None
    return pd.read_csv(FIELD / name)


def test_a_probe_that_warms_up_has_no_law_and_no_outliers() -> None:
    """One spot touched every 2 s while a heater goes on and off; the readings are dealt to a gauge's faces in turn."""
    seen = table("z-probe-warm-up.csv")
    steps = make_gauge(blocks=10)
    some = seen.iloc[: len(seen) // steps.n_faces * steps.n_faces]
    columns = {name: (lambda _, name=name: some[name].to_numpy()) for name in some.columns if name != "z_mm"}
    off_um = some["z_mm"].to_numpy() * 1e3
    recording = by_hand(steps, lambda _: off_um, cycles=len(some) // steps.n_faces, noise_um=0.0, **columns)
    found = diagnose(recording, steps, cmm(1.3))
    assert found.verdict == "unknown"
    assert [one.kind for one in found.findings] == []
    assert found.noise.outliers.size == 0


TENTH_MM = 1e4
"""Units of the distances below, over a metre."""


def baseline() -> Problem:
    """Slope distances between pillars in a line whose places are not known."""
    seen = table("edm-baseline-distances.csv")
    pillars = sorted(set(seen["from_pillar"]) | set(seen["to_pillar"]))
    names = ("from_pillar", "to_pillar")
    ends = [(seen[name].to_numpy()[None] == np.array(pillars)[:, None]).astype(float) for name in names]
    metres = seen["slope_distance"].to_numpy()
    place = {name: metres[((seen["from_pillar"] == name) & (seen["to_pillar"] == "2")).to_numpy()] for name in pillars}
    along = np.array([float(place[name].mean()) if len(place[name]) else 0.0 for name in pillars])
    sign = np.sign(along @ ends[1] - along @ ends[0])
    apart = sign * (ends[1] - ends[0])
    pair = np.unique(np.sort(seen[["from_pillar", "to_pillar"]].to_numpy(str), axis=1), axis=0, return_inverse=True)[1]
    pair = pair.ravel()
    order = np.arange(len(metres))
    return Problem(
        residual_um=(metres - along @ apart) * TENTH_MM,
        scale_um=1.0,
        certified=np.zeros((1, len(metres))),
        certified_u=np.ones(1),
        free=apart[1:],
        order=order,
        gap=np.ones(len(metres) - 1),
        growing={"distance": metres / metres.max()},
        step_um=1.0,
        group=pair.astype(np.intp),
        candidates=tuple(of_distances(seen, metres, pair)),
    )


def of_distances(seen: pd.DataFrame, metres: Array, pair: NDArray[np.intp]) -> list[Candidate]:
    """Laws of an electronic distance meter, and forms over all that was recorded."""
    priors = shipped_priors()
    odds = float(np.log(priors.laws.odds))
    periods = np.geomspace(5.0, 300.0, 400)
    angle = 2.0 * np.pi * metres / periods[:, None]
    waves = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    ones = np.ones((1, len(metres)))
    sizes = priors.sizes.about(5.0)
    even = np.full(len(periods), -np.log(len(periods)))
    ramp = (metres / metres.max())[None, None]
    laws = [
        Law("scale", "scale", True, odds, sizes, pattern=ramp, shares=ones, log_weight=np.zeros(1)),
        Law("period", "period", True, odds, sizes, pattern=waves, shares=ones, log_weight=even),
    ]
    columns = {name: seen[name].to_numpy(float) for name in ("temperature", "pressure", "humidity")}
    columns["distance"] = metres
    forms = priors.forms.about(1.0)
    nameless = float(np.log(priors.forms.odds / (len(columns) + 1)))
    smooth = [
        GaussianProcess(
            name, name, False, nameless, forms, features=tuple(matern(values, at) for at in priors.forms.lengths)
        )
        for name, values in columns.items()
    ]
    levels = (pair == np.arange(pair.max() + 1)[:, None]).astype(float)
    return [*laws, *smooth, GaussianProcess("pair", "pair", False, nameless, forms, features=(levels,))]


def test_a_baseline_without_the_heights_of_its_pillars_is_no_scale_and_no_period() -> None:
    """What is missing differs from pair to pair: half the square of the difference in height over the distance."""
    search = Search(baseline(), shipped_priors().scatter)
    found = answer_of(search, shipped_priors().decision)
    assert found.probability_of_nothing() < 1e-3
    assert found.probability(["scale"]) < 0.2
    # a wave that is smaller than a form over the distance may be part of it and is not named (rule 3)
    moved = {
        term.candidate.label: float((found.best.amplitudes(place)[0] @ term.columns).std())
        for place, term in enumerate(found.best.terms)
    }
    assert all(um < 0.5 * moved["distance"] for name, um in moved.items() if name in ("scale", "period"))
    assert found.best.noise.outlying is None or (found.best.noise.outlying > 0.5).mean() < 0.001
