"""Foreign layouts: right at once, or asked for and then right; never wrong, and no question without its answer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.layouts.judge import ASKED, MOST_OPTIONS, REFUSED, RIGHT, Layout, judge
from tests.importing.layouts.layouts import LAYOUTS

OPTIONS = {
    "averages of both directions in three tables (.pos)": 3,
    "plate of holes: three pairs of measured and nominal values": 3,
}
"""Files that leave more open than two options settle: which table or which two columns, and the units of both."""
READABLE = [layout for layout in LAYOUTS if layout.truth is not None]


def test_there_are_enough_of_them() -> None:
    assert len({layout.name for layout in LAYOUTS}) == len(LAYOUTS)
    assert len(READABLE) >= 45


def test_nine_of_ten_need_two_options_at_most() -> None:
    assert 10 * len(OPTIONS) <= len(READABLE)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_layout(tmp_path: Path, layout: Layout) -> None:
    verdict = judge(layout, tmp_path)
    if layout.truth is None:
        assert verdict.kind == REFUSED, verdict
    else:
        assert verdict.kind in (RIGHT, ASKED), verdict
        assert verdict.options <= OPTIONS.get(layout.name, MOST_OPTIONS), verdict
