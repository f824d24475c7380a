"""A measurement as the page sees it: points as they come, pause, stop, and the death of the server."""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlencode

import pytest

from stepgauge.errors import InputError
from stepgauge.live.journal import look
from stepgauge.recording import read_recording
from stepgauge.web.measuring import MeasurementRequest, read_request
from tests.conftest import ROOT
from tests.web.conftest import Served, Watched, make_project

NAME = "recordings/run.csv"


def located(folder: Path) -> Path:
    """A project whose gauge is located."""
    import stepgauge as sg

    make_project(folder)
    placement = sg.locate(ROOT / "examples/demo/points.csv", "step-gauge-420", machine="bridge-cmm")
    placement.write(folder / "placement.toml")
    return folder


def post(server: Served, path: str, /, **fields: str) -> tuple[int, bytes]:
    kind = "application/x-www-form-urlencoded"
    status, _, body = server.ask(path, "POST", urlencode(fields), Origin=server.address, Content_Type=kind)
    return status, body


def wait(until: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not until():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.parametrize(("cycles", "order"), [(1, "blocks"), (5, "blocks"), (7, "up-down")])
def test_the_page_says_the_time_of_the_command_line(tmp_path: Path, cycles: int, order: str) -> None:
    import stepgauge as sg

    folder = located(tmp_path / "project")
    with Served(folder) as server:
        _, _, body = server.ask(f"/plan/part?cycles={cycles}&order={order}&dialect=dmis")
    planned = sg.plan(folder / "placement.toml", "step-gauge-420", "bridge-cmm", cycles=cycles, order=order)
    time = re.search(r"about (\d+ min \d+ s) at full speed", planned.summary())
    assert time is not None
    assert f"<dd>{time[1]}</dd>" in body.decode()


def test_points_of_one_block_twice_are_an_answer(tmp_path: Path) -> None:
    rows = (ROOT / "examples/demo/points.csv").read_text().splitlines()[-16:]
    begin = [row.partition(",")[2] for row in rows[:8]]
    pasted = "\n".join(f"{number},{row}" for number, row in enumerate(begin * 2, 1))
    with Served(make_project(tmp_path / "project")) as server:
        status, body = post(server, "/locate", pasted=pasted)
    assert status == 200
    assert "points 9 to 16 are the same as points 1 to 8" in body.decode()


def test_a_start_that_failed_stays_in_no_list(tmp_path: Path) -> None:
    folder = located(tmp_path / "project")
    with Served(folder) as server:
        post(server, "/run", machine="live", server="127.0.0.1:9", output=NAME)
        wait(lambda: b'data-state="failed"' in server.ask(f"/run?recording={NAME}")[2])
        assert b"?recording=" not in server.ask("/run")[2]
        assert not list(folder.glob("recordings/*"))


def test_what_was_asked_is_read_as_it_was_written(tmp_path: Path) -> None:
    asked = MeasurementRequest("r.csv", "gauge.toml", "machine.toml", "placement.toml", cycles=3, speed=None, seed=7)
    asked.write(tmp_path / "r.csv.request.json")
    assert read_request(tmp_path / "r.csv.request.json") == asked
    text = (tmp_path / "r.csv.request.json").read_text()
    (tmp_path / "r.csv.request.json").write_text(text.replace('"cycles": 3', '"cycles": 2'))
    with pytest.raises(InputError, match=r"was changed after it was written"):
        read_request(tmp_path / "r.csv.request.json")


def test_nothing_is_lost_when_the_server_is_killed(tmp_path: Path, watched: Watched) -> None:
    """Started on one server, killed in the middle; the machine stops, and another server goes on to the end."""
    folder, page = located(tmp_path / "project"), watched.page
    journal = folder / f"{NAME}.journal"
    with Served(folder) as server:
        page.goto(f"{server.address}/run")
        page.get_by_label("Cycles").fill("3")
        page.get_by_label("Blocks").fill("1:5")
        page.get_by_label("How fast it moves").select_option("10")
        page.get_by_role("button", name="Start the measurement").click()
        page.locator("#errors[data-ready]").wait_for()
        page.get_by_role("button", name="Pause").click()
        page.locator("[data-state=paused]").wait_for()
        assert watched.violations() == []
        rested = len(look(journal).rows)
        page.wait_for_timeout(500)
        assert len(look(journal).rows) == rested
        _, body = post(server, "/run", machine="virtual", speed="10", output=NAME)
        assert b"is being measured" in body
        page.get_by_role("button", name="Go on", exact=True).click()
        wait(lambda: len(look(journal).rows) > rested)
        page.goto("about:blank")
        server.end(signal.SIGKILL)
    wait(lambda: _is_free(journal))
    kept = look(journal).rows
    assert rested < len(kept) < 30

    with Served(folder) as server:
        assert b"begun and not finished" in post(server, "/run", machine="virtual", output=NAME)[1]
        page.goto(f"{server.address}/run")
        page.get_by_role("link", name=NAME).click()
        assert page.locator("#done").inner_text() == str(len(kept))
        page.get_by_role("button", name="Go on with it").click()
        page.get_by_text("All points are measured").wait_for()
    recording = read_recording(folder / NAME)
    assert len(recording.frame) == 30
    assert {number: look(journal).rows[number] for number in kept} == kept
    assert not list(folder.glob("recordings/*.json"))


def _is_free(journal: Path) -> bool:
    """Whether the process that measured has ended: it holds the journal for as long as it lives."""
    import fcntl

    with journal.open("ab") as file:
        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def test_what_a_measurement_tells_and_how_it_ends(tmp_path: Path) -> None:
    """Without a browser: the events, a second name, what is refused, and a server that ends while it measures."""
    with Served(located(tmp_path / "project")) as server:
        for name in ("../run.csv", "run.csv", "recordings/run.txt"):
            assert post(server, "/run", machine="virtual", speed="", output=name)[0] == 422
        assert b"HOST:PORT" in post(server, "/run", machine="live", output=NAME)[1]
        fields = {"machine": "virtual", "cycles": "1", "blocks": "1:4", "gauge_temperature": "20,4"}
        assert b"/run?recording=" in post(server, "/run", speed="", output=NAME, **fields)[1]
        events = server.ask(f"/run/events?recording={NAME}")[2].decode().split("\n\n")
        told = [one.split("\n")[:2] for one in events if one.startswith("event")]
        last = {kind.removeprefix("event: "): json.loads(data.removeprefix("data: ")) for kind, data in told}
        assert last["status"] == {"state": "done", "done": 8, "total": 8, "left_s": 0.0}
        assert last["errors"]["faces"]["face"] == list(range(1, 9))
        late = server.ask(f"/run/events?recording={NAME}")[2].decode().split("\n\n")
        assert [one.split("\n")[0] for one in late if one] == ["event: errors", "event: status"]  # the end closes it
        assert b"exists already" in post(server, "/run", speed="", output=NAME, **fields)[1]
        assert b"recordings/run-2.csv" in server.ask("/run")[2]
        slow = {**fields, "cycles": "9", "speed": "10", "output": "recordings/slow.csv"}
        post(server, "/run", **slow)
        journal = server.folder / "recordings/slow.csv.journal"
        wait(lambda: journal.exists() and len(look(journal).rows) > 0)
    wait(lambda: _is_free(journal))
    assert 0 < len(look(journal).rows) < 72


def test_the_next_run_is_on_the_same_machine(tmp_path: Path) -> None:
    """The fault of the run that began last is offered, of that run alone; and each run scatters by itself."""
    from stepgauge.web import concealed

    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "one.csv.journal").write_text("")
    assert concealed.last_fault(tmp_path) == {}
    effect = {"kind": "scale_error", "axis": "y", "ppm": 14.0}
    concealed.fault_file(folder / "one.csv").write_text(concealed.text(effect))
    kept = concealed.last_fault(tmp_path)
    assert kept == effect
    assert concealed.fault("scale_error", "x", kept).usual == {"fault_axis": "y", "fault_ppm": "14"}
    assert concealed.fault("scale_error", "x").usual["fault_axis"] == "x"
    assert concealed.fault("squareness", "x", kept) == concealed.fault("squareness", "x")
