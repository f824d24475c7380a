"""Points that are missing, doubled, moved or foreign are named with cycle, face and place, with and without program."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError
from stepgauge.exporting import export_recording
from stepgauge.importing.build import ImportOptions, build_recording
from stepgauge.importing.result import Imported
from stepgauge.planning.plan import ORDERS, PlanOptions, faces_in_order
from tests.importing.made import RADIUS_MM, Case, make_case

CASE = make_case(cycles=3)
N = len(CASE.recording)
PROGRAM = CASE.program("linuxcnc")
NAMED = CASE.program("dmis")
modes = st.sampled_from(["program", "none", "names"])


def log_of(case: Case, rows: list[int], mode: str) -> ProbeLog:
    """A log of these rows, in this order; line k + 1 has row k. With names it has those of the program."""
    recording = case.recording
    frame = recording.frame.iloc[rows]
    names = [f"C{c}F{f}" for c, f in zip(frame["cycle"], frame["face"], strict=True)]
    return ProbeLog(
        "log.txt",
        "test",
        recording.position_mm[rows],
        np.arange(1, len(rows) + 1),
        label=names if mode == "names" else None,
    )


def read(log: ProbeLog, mode: str, *accept: str) -> Imported:
    program = {"program": PROGRAM, "names": NAMED, "none": None}[mode]
    return build_recording(log, CASE.gauge, CASE.placement, program, ImportOptions(accept=accept))


def test_all_modes_give_the_recording() -> None:
    for mode in ("program", "none", "names"):
        frame = read(log_of(CASE, list(range(N)), mode), mode).recording.frame
        assert frame[["cycle", "face"]].equals(CASE.recording.frame[["cycle", "face"]])
        np.testing.assert_allclose(frame[["x_mm", "y_mm", "z_mm"]], CASE.recording.position_mm, atol=1e-12)


@settings(max_examples=30)
@given(order=st.sampled_from(ORDERS), gone=st.integers(0, N - 1))
def test_without_a_program_the_usual_orders_are_known(order: str, gone: int) -> None:
    planned = list(faces_in_order(PlanOptions(1, CASE.gauge.n_blocks, order=order, cycles=3)))
    rows = [(cycle - 1) * 8 + face - 1 for cycle, face in planned]
    whole = read(log_of(CASE, rows, "none"), "none")
    assert f"24 rows, 24 points of the order '{order}' of 3 cycles" in whole.report[0]
    assert list(zip(whole.recording.frame["cycle"], whole.recording.frame["face"], strict=True)) == planned
    with pytest.raises(InputError, match=r"is missing|the log ends before") as error:
        read(log_of(CASE, rows[:gone] + rows[gone + 1 :], "none"), "none")
    face = planned[gone][1]
    assert f", face {face}, near" in str(error.value)


def test_a_log_in_no_known_order_is_taken_as_it_is() -> None:
    rows = np.random.default_rng(5).permutation(N).tolist()
    imported = read(log_of(CASE, rows, "none"), "none")
    assert "24 points of no known order" in imported.report[0]
    assert imported.recording.frame["face"].tolist() == CASE.recording.frame["face"].iloc[rows].tolist()
    assert imported.recording.frame.groupby("face")["cycle"].apply(list).tolist() == [[1, 2, 3]] * 8


@settings(max_examples=30)
@given(gone=st.integers(0, N - 1), mode=modes)
def test_a_missing_point_is_named_and_may_be_accepted(gone: int, mode: str) -> None:
    log = log_of(CASE, [row for row in range(N) if row != gone], mode)
    cycle, face = CASE.recording.frame.loc[gone, ["cycle", "face"]]
    place = ", ".join(f"{v:.2f}" for v in CASE.recording.position_mm[gone])
    with pytest.raises(InputError) as error:
        read(log, mode)
    message = str(error.value)
    assert f"log.txt:{min(gone + 1, N - 1)}: " in message
    assert f"cycle {cycle}, face {face}, near ({place[:3]}" in message
    assert 'accept="missing"' in message
    imported = read(log, mode, "missing")
    left = CASE.recording.frame.drop(index=gone)[["cycle", "face"]].reset_index(drop=True)
    assert imported.recording.frame[["cycle", "face"]].equals(left)
    assert f"missing: 1 points: C{cycle}F{face}" in imported.report


@settings(max_examples=30)
@given(twice=st.integers(0, N - 1), mode=modes)
def test_a_doubled_point_is_named_and_its_last_reading_kept(twice: int, mode: str) -> None:
    rows = [*range(twice + 1), *range(twice, N)]
    log = log_of(CASE, rows, mode)
    log.position_mm[twice] += 1e-3  # the first reading differs
    with pytest.raises(InputError, match=rf"log.txt:{twice + 2}: .*(repeated|goes on after the last point)"):
        read(log, mode)
    imported = read(log, mode, "doubled")
    np.testing.assert_allclose(imported.recording.position_mm, CASE.recording.position_mm, atol=1e-12)
    assert f"dropped as doubled, the last of a row is kept: 1 rows: lines {twice + 1}" in imported.report


@settings(max_examples=30)
@given(start=st.integers(0, N - 2), step=st.integers(1, 5), mode=st.sampled_from(["program", "names"]))
def test_rows_out_of_order_are_found_and_sorted_in_on_request(start: int, step: int, mode: str) -> None:
    other = min(start + step, N - 1)
    rows = list(range(N))
    rows[start], rows[other] = rows[other], rows[start]
    log = log_of(CASE, rows, mode)
    with pytest.raises(InputError, match=rf"log.txt:{start + 1}: .*out of order"):
        read(log, mode)
    frame = read(log, mode, "order").recording.frame
    assert (
        frame[["cycle", "face"]].values.tolist() == CASE.recording.frame.iloc[rows][["cycle", "face"]].values.tolist()
    )


@settings(max_examples=30)
@given(at=st.integers(0, N), mode=st.sampled_from(["program", "names"]))
def test_foreign_rows_are_left_out_on_request(at: int, mode: str) -> None:
    """A point on the side of a block, as probed for locating, in the middle of the log."""
    log = log_of(CASE, list(range(N)), mode)
    beside = CASE.placement.to_machine(CASE.gauge, [5.0, 9.0 + RADIUS_MM, 0.0])
    log = replace(
        log,
        position_mm=np.insert(log.position_mm, at, beside, axis=0),
        line=np.arange(1, N + 2),
        label=None if log.label is None else [*log.label[:at], "SIDE", *log.label[at:]],
    )
    with pytest.raises(InputError, match=rf"log.txt:{at + 1}: "):
        read(log, mode)
    imported = read(log, mode, "foreign")
    np.testing.assert_allclose(imported.recording.position_mm, CASE.recording.position_mm, atol=1e-12)
    assert f"dropped as no points of the program: 1 rows: lines {at + 1}" in imported.report


@settings(max_examples=30)
@given(keep=st.integers(9, N - 1), mode=modes)
def test_a_log_that_ends_early_is_cut(keep: int, mode: str) -> None:
    log = log_of(CASE, list(range(keep)), mode)
    if mode == "none" and keep % 8 == 0:
        assert len(read(log, mode).recording) == keep  # whole cycles: nothing says that there were to be more
        return
    with pytest.raises(
        InputError, match=rf"log.txt:{keep}: the log ends before point {keep + 1} .*found {keep} points"
    ):
        read(log, mode)
    assert len(read(log, mode, "missing").recording) == keep


@pytest.mark.parametrize("numbered", [False, True])
def test_several_runs_of_the_program_count_their_cycles_on(numbered: bool) -> None:
    log = log_of(CASE, [*range(N), *range(N)], "program")
    if numbered:
        log = replace(log, number=np.tile(np.arange(1, N + 1), 2))
    with pytest.raises(InputError, match=r"log.txt:25: (the log goes on after the last point|point 1 is repeated)"):
        read(log, "program")
    frame = read(log, "program", "runs").recording.frame
    assert frame["cycle"].tolist() == np.repeat(np.arange(1, 7), 8).tolist()
    cut = replace(log, position_mm=log.position_mm[:-3], line=log.line[:-3])
    cut = replace(cut, number=None if log.number is None else log.number[:-3])
    with pytest.raises(InputError, match=r"log.txt:45: the log ends before point 46 \(.*cycle 6, face 6"):
        read(cut, "program", "runs")
    assert len(read(cut, "program", "runs", "missing").recording) == 45


def test_several_departures_are_counted_in_one_message() -> None:
    rows = [row for row in range(N) if row not in (3, 9, 15)]
    with pytest.raises(InputError, match=r"point 4 is missing.*also C2F2 missing, C2F8 missing"):
        read(log_of(CASE, rows, "program"), "program")


def test_a_log_in_another_unit_says_which() -> None:
    log = log_of(CASE, list(range(N)), "program")
    far = make_case(yaw=0.0, pitch=0.0)  # along x, where inches stay on the height of the blocks
    for case, mode in ((CASE, "program"), (far, "none")):
        inches = replace(log, position_mm=case.recording.position_mm / 25.4)
        program = PROGRAM if mode == "program" else None
        with pytest.raises(InputError, match=r"on it where they are in inch; .*expected unit inch"):
            build_recording(inches, case.gauge, case.placement, program, ImportOptions())


def test_errors_that_the_controller_reported_are_in_the_message(tmp_path: Path) -> None:
    """A session in which one point failed: the missing point and the server's words stand together."""
    lines = export_recording(CASE.recording, "ippdme").content.decode().splitlines()
    answer = next(i for i, line in enumerate(lines) if "00013 #" in line)
    lines[answer] = lines[answer].split("#")[0] + '! Error(2, 1006, "server", "Surface not found")'
    path = tmp_path / "session.log"
    path.write_text("\n".join(lines))
    for program in (None, CASE.program()):
        with pytest.raises(InputError) as error:
            CASE.imported(path, "ippdme", program)
        assert "cycle 2, face 1" in str(error.value)
        assert f"in line {answer + 1} PtMeas: Error(2, 1006" in str(error.value)


def test_a_reading_beside_its_line_is_called_that_and_no_option_is_offered() -> None:
    """Nothing is missing there; the point of the program is met from another line."""
    log = log_of(CASE, list(range(N)), "program")
    log.position_mm[:] += 0.3 * CASE.placement.side
    with pytest.raises(InputError, match=r"it is beside the line of its search.* 0.300 mm beside it") as error:
        read(log, "program")
    assert "accept" not in str(error.value)
    log = log_of(CASE, list(range(N)), "program")
    log.position_mm[:] += 9.0 * CASE.placement.up
    with pytest.raises(InputError) as error:
        read(log, "program")
    assert "missing takes" not in str(error.value)


def test_a_controller_that_names_no_columns_has_exchanged_none() -> None:
    along_x, along_y = make_case(yaw=0.0, pitch=0.0), make_case(yaw=np.pi / 2.0, pitch=0.0)
    log = log_of(along_y, list(range(N)), "program")
    with pytest.raises(InputError, match=r"beside the blocks .*the log of another program\?") as error:
        build_recording(log, along_x.gauge, along_x.placement, along_x.program("linuxcnc"), ImportOptions())
    assert "exchanged" not in str(error.value)
