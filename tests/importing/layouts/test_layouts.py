"""Foreign layouts: right at once, or asked for and then right; never wrong, and no question without its answer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.layouts.judge import ASKED, MOST_OPTIONS, REFUSED, RIGHT, Layout, judge
from tests.importing.layouts.layouts import LAYOUTS

PENDING = {
    "averages of both directions in three tables (.pos)": "refused",
    "16 points of a display, decimal commas": "refused",
}
"""What is not yet right, and how it fails: wrong, lost, refused in vain, accepted and never to be."""
READABLE = [layout for layout in LAYOUTS if layout.truth is not None]


def test_there_are_enough_of_them() -> None:
    assert len({layout.name for layout in LAYOUTS}) == len(LAYOUTS)
    assert len(READABLE) >= 45


def marked(layout: Layout) -> object:
    known = PENDING.get(layout.name)
    marks = [pytest.mark.xfail(reason=known, strict=False)] if known else []
    return pytest.param(layout, marks=marks, id=layout.name)


@pytest.mark.parametrize("layout", [marked(layout) for layout in LAYOUTS])
def test_layout(tmp_path: Path, layout: Layout) -> None:
    verdict = judge(layout, tmp_path)
    if layout.truth is None:
        assert verdict.kind == REFUSED, verdict
    else:
        assert verdict.kind in (RIGHT, ASKED), verdict
        assert verdict.options <= MOST_OPTIONS, verdict
