"""Damaged tables and recordings of axes end in one line, whatever was done to their bytes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.axis.recording import AxisRecording, read_axis_recording, write_axis_recording
from stepgauge.errors import LONGEST, InputError
from stepgauge.importing.axis import AxisOptions, import_axis
from tests.axis.made import axis
from tests.importing.layouts.axes import LAYOUTS

TEXTS = [one.content.encode() if isinstance(one.content, str) else one.content for one in LAYOUTS]
INSERTED = [b",", b";", b"\n", b"nan", b"1e308", b"-", b"inf", b"\xff", b"\t", b'"', b"[", b"}", b"9" * 30, b"mm", b""]
damages = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 40), st.sampled_from(INSERTED)), min_size=1, max_size=12)


def damaged(content: bytes, changes: list[tuple[float, int, bytes]]) -> bytes:
    for place, length, inserted in changes:
        at = int(place * len(content))
        content = content[:at] + inserted + content[at + length :]
    return content


def outcome(read: Callable[[], AxisRecording]) -> str:
    """``read`` where every reading is a number, else the error in one line."""
    try:
        assert np.isfinite(read().frame["reading"]).all()
    except InputError as error:
        return str(error) if len(str(error)) <= LONGEST else "damaged"
    return "read"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("harmed")


@settings(max_examples=80)
@given(which=st.integers(0, len(LAYOUTS) - 1), changes=damages)
def test_a_damaged_table_is_read_or_refused_in_one_line(folder: Path, which: int, changes: list) -> None:
    path = folder / "table"
    path.write_bytes(damaged(TEXTS[which], changes))
    found = outcome(lambda: import_axis(path, AxisOptions("laser", unit="mm", deviation_unit="um")).recording)
    assert found == "read" or "the table is damaged" not in found


@settings(max_examples=30)
@given(changes=damages)
def test_a_damaged_recording_is_read_or_refused_in_one_line(folder: Path, changes: list) -> None:
    path = folder / "axis.csv"
    write_axis_recording(path, axis(np.arange(0.0, 101.0, 10.0), lambda t, w: 0.1 * t))
    path.write_bytes(damaged(path.read_bytes(), changes))
    found = outcome(lambda: read_axis_recording(path))
    assert found == "read" or "damaged" not in found
