"""The local page: first page, interactions, and the server's memory over an hour of live points.

    python benchmarks/web.py [--chromium PATH]

A trivial page is one without a figure (that of an unknown address). Times are those that the browser sees, each the
least of several, and are told as ratios to it, too, for the machine may have other work. The measurement of an hour has
as many points as a CMM probes in that time; the clock of the virtual CMM runs as fast as it can be computed.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
import urllib.request
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
os.environ.setdefault("OMP_NUM_THREADS", "1")

from table import Table

import stepgauge as sg
from stepgauge.files.checksum import checksum
from tests.web.conftest import CHROMIUM, QUIET, TABLET, Served, acted, make_project, opened

POINTS = Path(__file__).resolve().parent.parent / "examples/demo/points.csv"
BARS_MS = {1_000: 200.0, 100_000: 1000.0}
BAR_FIRST_S, BAR_GROWTH_MB, TRIES = 1.0, 4.0, 5
OPENED = {"project": ".card h2", "locate": "#found [data-ready]", "run": "form[data-into]", "report": "form[data-into]"}
"""Pages, and what stands there when they are complete."""
CYCLES_OF_AN_HOUR = 41
"""With 42 faces, at 2.1 s for a point: 1722 points."""


def make_files(folder: Path) -> None:
    """A located project with a small measurement and its diagnosis."""
    make_project(folder)
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    placement = sg.locate(POINTS, gauge, machine=machine)
    placement.write(folder / "placement.toml")
    plan = sg.plan(placement, gauge, machine, cycles=3, blocks="1:12")
    faulty = folder / "faulty.toml"
    effect = '[[effect]]\nkind = "scale_error"\naxis = "y"\nppm = 20.0\n'
    faulty.write_text((folder / "machine/bridge-cmm.toml").read_text() + effect)
    sg.simulate(plan, faulty, gauge, placement).recording.write(folder / "recordings/small.csv")
    sg.diagnose(folder / "recordings/small.csv", gauge, machine).write(folder / "results/small")


def enlarge(folder: Path, count: int) -> str:
    """The same diagnosis with its readings repeated until there are ``count``; the folder's name."""
    name = f"results/of-{count}"
    (folder / name).mkdir()
    recording = sg.read_recording(folder / "recordings/small.csv")
    times = -(-count // len(recording.frame))
    larger = replace(recording, frame=_repeated(recording.frame, times, count))
    larger.write(folder / f"recordings/of-{count}.csv")
    rows = pd.read_csv(folder / "results/small/residuals.csv")
    _repeated(rows, times, count).to_csv(folder / name / "residuals.csv", index=False)
    said = json.loads((folder / "results/small/diagnosis.json").read_text())
    said["inputs"]["recordings"] = [{"path": f"recordings/of-{count}.csv", "sha256": "0" * 64}]
    said["checksum"] = checksum(said)
    (folder / name / "diagnosis.json").write_text(json.dumps(said))
    return name


def _repeated(frame: pd.DataFrame, times: int, count: int) -> pd.DataFrame:
    found = pd.concat([frame.assign(cycle=frame["cycle"] + n * frame["cycle"].max()) for n in range(times)])
    return found.head(count).reset_index(drop=True)


def first_page(folder: Path) -> tuple[float, float]:
    """From the command to the first page: seconds, and those of them that the processor worked for the server."""
    began = time.perf_counter()
    with Served(folder) as server:
        server.ask("/")
        took = time.perf_counter() - began
        times = Path(f"/proc/{server.process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
        return took, sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


def interactions(page: Any, address: str) -> dict[str, float]:
    """The diagnosis in the browser, ms."""
    found = {"open the diagnosis": opened(page, address, "#residuals[data-ready]")}
    found["open it again"] = min(opened(page, address, "#residuals[data-ready]") for _ in range(TRIES))
    acts = {"a finding off or on": ("[data-finding]", "toggle"), "another covariate": ("#against", "next")}
    for name, (selector, change) in acts.items():
        found[name] = min(acted(page, selector, change, "#residuals") for _ in range(TRIES))
    return found


def memory_of_an_hour(folder: Path) -> tuple[float, float, int]:
    """Resident memory of the server early and at the end of an hour of live points, MB, and the points."""
    with Served(folder) as server:
        fields = f"machine=virtual&speed=&cycles={CYCLES_OF_AN_HOUR}&output=recordings/hour.csv"
        kind = "application/x-www-form-urlencoded"
        server.ask("/run", "POST", fields, Origin=server.address, Content_Type=kind)
        seen, points = [], 0
        asked = urllib.request.Request(f"{server.address}/run/events?recording=recordings/hour.csv")
        asked.add_header("Cookie", "=".join(server.cookie))
        with urllib.request.urlopen(asked) as stream:
            for line in stream:
                if line.startswith(b'data: {"state"'):
                    points = json.loads(line[6:]).get("done", points)
                    if points > 100:
                        seen.append(_resident_mb(server.process.pid))
    tenth = max(1, len(seen) // 10)
    return min(seen[:tenth]), min(seen[-tenth:]), points


def _resident_mb(process: int) -> float:
    text = Path(f"/proc/{process}/status").read_text()
    return int(text.partition("VmRSS:")[2].split()[0]) / 1024.0


@click.command()
@click.option("--chromium", default=CHROMIUM, show_default=True, help="The browser.")
def main(chromium: str) -> None:
    """Print the table; what misses its bar is marked."""
    from playwright.sync_api import sync_playwright

    table = Table()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "project"
        make_files(folder)
        took, worked = min(first_page(folder) for _ in range(TRIES))
        table.add("first page after the command", took, "s", high=BAR_FIRST_S)
        table.add("first page after the command, of processor time", worked, "s", high=BAR_FIRST_S)
        with Served(folder) as server, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium, headless=True, args=list(QUIET))
            window = browser.new_context(viewport=TABLET)
            server.welcome(window)
            in_browser(table, folder, server, window.new_page())
            browser.close()
        early, late, points = memory_of_an_hour(folder)
        table.add("server after 100 live points", early, "MB")
        table.add(f"growth until {points:,} live points", late - early, "MB", high=BAR_GROWTH_MB)
    sys.exit(table.print())


def in_browser(table: Table, folder: Path, server: Served, page: Any) -> None:
    """Pages and interactions."""
    trivial = min(opened(page, f"{server.address}/nowhere", "h1") for _ in range(TRIES))
    table.add("a trivial page", trivial, "ms")
    for path, ready in OPENED.items():
        took = min(opened(page, f"{server.address}/{path}", ready) for _ in range(TRIES))
        table.add(f"open {path}, of a trivial page {took / trivial:.1f}", took, "ms")
    for count, bar in BARS_MS.items():
        name = enlarge(folder, count)
        for what, took in interactions(page, f"{server.address}/diagnosis?result={name}").items():
            high = None if what.startswith("open") else bar
            table.add(f"{count:,} probings: {what}, of a trivial page {took / trivial:.1f}", took, "ms", high=high)


if __name__ == "__main__":
    main()
