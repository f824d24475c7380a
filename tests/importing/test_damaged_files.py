"""Whatever happens to a file, importing it ends in a recording or in one line that names the file."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.correspondence.pairing import KINDS
from stepgauge.errors import InputError
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.logs import import_log, read_run_program
from stepgauge.importing.tables.read import TableLayout
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples/import"
FILES = {
    "dmis.dmo": "dmis",
    "ippdme.log": "ippdme",
    "linuxcnc-log.txt": "linuxcnc",
    "linuxcnc-probeopen.txt": "linuxcnc",
    "protokoll.csv": "csv",
    "points.xlsx": "xlsx",
}
GAUGE = read_gauge("step-gauge-420")
PLACEMENT = read_placement(EXAMPLE / "placement.toml", GAUGE)
PROGRAMS = {name: read_run_program(EXAMPLE / name, 2.0)[0] for name in ("gauge.dmi", "gauge.ngc")}
damages = st.one_of(
    st.tuples(st.just("cut"), st.floats(0.0, 1.0), st.just(b"")),
    st.tuples(st.just("insert"), st.floats(0.0, 1.0), st.binary(min_size=1, max_size=4)),
    st.tuples(
        st.just("insert"), st.floats(0.0, 1.0), st.sampled_from([b"\n", b";", b",", b"1", b"-", b"nan", b")", b"$"])
    ),
    st.tuples(st.just("delete"), st.floats(0.0, 1.0), st.sampled_from([b"x", b"xxx", b"x" * 90])),
    st.tuples(st.just("line"), st.floats(0.0, 1.0), st.sampled_from([b"out", b"twice", b"last"])),
)


def damaged(raw: bytes, kind: str, place: float, what: bytes) -> bytes:
    at = int(place * len(raw))
    if kind == "line":
        lines = raw.split(b"\n")
        row = min(int(place * len(lines)), len(lines) - 1)
        line = lines.pop(row)
        there = {b"out": [], b"twice": [line, line], b"last": []}[what]
        return b"\n".join([*lines[:row], *there, *lines[row:], *([line] if what == b"last" else [])])
    if kind == "insert":
        return raw[:at] + what + raw[at:]
    return raw[:at] + (raw[at + len(what) :] if kind == "delete" else b"")


@pytest.mark.parametrize("name", FILES)
@settings(max_examples=20)
@given(damage=st.lists(damages, min_size=1, max_size=3), mode=st.integers(0, 3), accept=st.sets(st.sampled_from(KINDS)))
def test_a_damaged_file_is_read_or_refused(tmp_path_factory, name, damage, mode, accept) -> None:
    raw = (EXAMPLE / name).read_bytes()
    for one in damage:
        raw = damaged(raw, *one)
    path: Path = tmp_path_factory.mktemp("damaged") / name
    path.write_bytes(raw)
    program = PROGRAMS["gauge.ngc" if FILES[name] == "linuxcnc" else "gauge.dmi"] if mode == 3 else None
    layout = TableLayout(sheet="Points") if FILES[name] == "xlsx" else None
    gauge, placement = (GAUGE if mode else None), (PLACEMENT if mode > 1 else None)
    options = ImportOptions(accept=sorted(accept))
    message, rows = "", 0
    try:
        rows = len(import_log(path, FILES[name], gauge, placement, program, options, layout).recording)
    except InputError as error:
        message = str(error)
    assert (name in message and "\n" not in message) or 0 < rows <= 3 * 12
