"""The figures of shares and of uncertainty: files of the right kind, and bars that add up to the total."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from stepgauge.errors import InputError
from stepgauge.figures import run as module
from stepgauge.figures.run import draw_shares
from stepgauge.gauge.certified import Gauge


def some_shares(effects: int) -> tuple[pd.DataFrame, np.ndarray]:
    random = np.random.default_rng(3)
    face = np.tile(np.arange(1, 43), 3)
    shares = pd.DataFrame({f"share_effect_{i}_um": random.normal(0, i + 1, len(face)) for i in range(effects)})
    return shares.assign(share_total_um=shares.sum(axis=1)), face


@pytest.mark.parametrize("effects", [1, 9])
def test_the_stacks_end_in_the_total(gauge: Gauge, tmp_path: Path, effects: int, monkeypatch) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(module, "save_figure", lambda figure, path, **_: drawn.append(figure))
    shares, face = some_shares(effects)
    draw_shares(tmp_path / "shares.png", shares, face, gauge.position_mm)
    total = shares["share_total_um"].groupby(face).mean()
    for axes, odd in zip(drawn[0].axes, (1, 0), strict=True):
        bars = [c for c in axes.containers if isinstance(c, BarContainer)]
        heights = np.sum([[patch.get_height() for patch in bar] for bar in bars], axis=0)
        assert_allclose(heights, total[total.index % 2 == odd], atol=1e-9)
        assert len(bars) == min(effects, module.MOST + 1)


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_all_formats_are_written(gauge: Gauge, tmp_path: Path, suffix: str, start: bytes) -> None:
    draw_shares(tmp_path / f"shares.{suffix}", *some_shares(3), gauge.position_mm, "Step gauge 420")
    assert (tmp_path / f"shares.{suffix}").read_bytes().startswith(start)


def test_another_format_is_an_error(gauge: Gauge, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot tell the figure's format"):
        draw_shares(tmp_path / "shares.bmp", *some_shares(3), gauge.position_mm)
