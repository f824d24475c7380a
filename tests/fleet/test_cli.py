"""The verbs of a fleet, end to end: recordings with a roster, questions, work in processes and on a cluster, export."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from stepgauge.cli import cli
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.output.files import statements_to_dict
from stepgauge.errors import InputError, PartlyDoneError, for_command
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.executors.dask import Dask
from stepgauge.executors.processes import InProcess
from stepgauge.executors.run import run
from stepgauge.fleet.query import query
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.store import Fleet
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement, write_placement
from stepgauge.recording import join_recordings, read_recording, write_recording
from tests.build import heed_interrupts
from tests.fleet.made import GAUGE, make_recording
from tests.fleet.test_work import TASKS, solved


def verb(*words: object) -> None:
    cli.main(args=[str(word) for word in words], standalone_mode=False)


def told_or_solved(number: int | None) -> list[float]:
    """The process that does it, or what it solves."""
    return [os.getpid()] if number is None else solved(number)


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Six recordings, one of them written by hand with other digits, and a roster by machine."""
    folder = tmp_path / "logs"
    gauge = read_gauge(GAUGE)
    for number in range(6):
        said = {"machine_id": f"M{number % 3}", "measured_at": f"2026-0{4 + number}-05"}
        write_recording(folder / f"{number}.csv", make_recording(gauge, number, 2, ppm=number, **said))
    text = (folder / "5.csv").read_text().replace("# tip_radius_mm: 2\n", "# tip_radius_mm:   2\n# by: hand\n")
    (folder / "5.csv").write_text(text.replace(",0.0,", ",0.00,").replace("# probings: 84\n", ""), newline="\r\n")
    (folder / "roster.csv").write_text("machine,type,hall\nM0,T,North\nM1,T,South\nM2,,South\n")
    return folder


def test_from_logs_to_answers_and_back(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fleet, files = tmp_path / "fleet", sorted(logs.glob("[0-9].csv"))
    add = ("fleet", "add", fleet, "-g", GAUGE, "-m", "bridge-cmm", "--roster", logs / "roster.csv")
    verb(*add, *files[:4])
    verb(*add, *files)
    assert "2 recordings added, 4 were there: 6 in" in capsys.readouterr().err
    verb("fleet", "compact", fleet)
    verb("fleet", "evaluate", fleet, "--jobs", 1)
    capsys.readouterr()
    verb("fleet", "query", fleet, "SELECT hall, type, count(*) AS n FROM recordings GROUP BY ALL ORDER BY ALL")
    assert capsys.readouterr().out == "hall,type,n\nNorth,T,2\nSouth,T,2\nSouth,,2\n"
    asked = "SELECT machine, placement, scale_ppm, r_eff_mm FROM evaluations ORDER BY measured_at"
    verb("fleet", "query", fleet, asked, "-o", tmp_path / "answer.json")
    verb("fleet", "query", fleet, asked, "-o", tmp_path / "answer.parquet")
    answer = json.loads((tmp_path / "answer.json").read_text())
    alone = [evaluate(read_recording(path), read_gauge(GAUGE)).results[0] for path in files]
    assert pd.read_parquet(tmp_path / "answer.parquet")["r_eff_mm"].tolist() == [r.radius.r_eff_mm for r in alone]
    assert answer[4]["scale_ppm"] == pytest.approx(4.0, abs=1.5)
    verb("fleet", "export", fleet, "-o", tmp_path / "out")
    for path in files:
        assert (tmp_path / "out" / "recordings" / path.name).read_bytes() == path.read_bytes()
    verb(
        "fleet",
        "add",
        tmp_path / "again",
        *(tmp_path / "out" / "recordings").iterdir(),
        "--roster",
        tmp_path / "out/roster.csv",
    )
    tables = [
        Fleet(folder).recordings().drop(columns=["added_at", "file", "first_row"])
        for folder in (fleet, tmp_path / "again")
    ]
    pd.testing.assert_frame_equal(*tables)
    verb("history", fleet, "--machine-name", "M1", "-o", tmp_path / "history")
    entries = json.loads((tmp_path / "history" / "history.json").read_text())["entries"]
    assert [one["r_eff_mm"] for one in entries] == [alone[1].radius.r_eff_mm, alone[4].radius.r_eff_mm]


def test_placements_and_recordings_of_one_name_are_kept_apart(tmp_path: Path) -> None:
    """Two placements with their files, evaluated along them; a Parquet file; two files called a.csv."""
    gauge, fleet = read_gauge(GAUGE), tmp_path / "fleet"
    both = join_recordings([make_recording(gauge, seed, 2) for seed in (1, 2)])
    for folder, recording in (("one", both), ("two", make_recording(gauge, 3, 2))):
        write_recording(tmp_path / folder / "a.csv", recording)
    write_recording(tmp_path / "b.parquet", make_recording(gauge, 4, 2))
    lies = [make_placement([100, 300, 100], [500, 300 + dy, 100], 1, gauge.n_blocks) for dy in (0.0, 0.4)]
    for number, one in enumerate(lies):
        write_placement(tmp_path / f"p{number}.toml", one)
    add = ("fleet", "add", fleet, "-g", GAUGE, "--machine-id", "M", "--measured-at", "2026-04-03")
    with pytest.raises(InputError, match="one placement file per placement; found 1; expected 2 or none"):
        verb(*add, tmp_path / "one/a.csv", "-p", tmp_path / "p0.toml")
    verb(*add, tmp_path / "one/a.csv", "-p", tmp_path / "p0.toml", "-p", tmp_path / "p1.toml")
    verb(*add, tmp_path / "two/a.csv", tmp_path / "b.parquet")
    verb("fleet", "evaluate", fleet, "--jobs", 1)
    rows = query(
        Fleet(fleet), "SELECT placement, axis_j, r_eff_mm FROM evaluations ORDER BY axis_j, placement"
    ).to_pylist()
    alone = evaluate(read_recording(tmp_path / "one/a.csv"), gauge, placements=lies)
    assert len(rows) == 4
    assert rows[-1] == {
        "placement": 2,
        "axis_j": alone.results[1].axis[1],
        "r_eff_mm": alone.results[1].radius.r_eff_mm,
    }
    verb("fleet", "export", fleet, "-o", tmp_path / "out")
    out = sorted((tmp_path / "out/recordings").iterdir())
    assert {path.read_bytes() for path in out} == {
        (tmp_path / name).read_bytes() for name in ("one/a.csv", "two/a.csv", "b.parquet")
    }
    verb("fleet", "add", tmp_path / "again", *out, "--roster", tmp_path / "out/roster.csv")
    again, first = Fleet(tmp_path / "again").recordings(), Fleet(fleet).recordings()
    assert again["recording"].tolist() == first["recording"].tolist()
    assert list(map(list, again["placement_files"])) == list(map(list, first["placement_files"]))


def test_the_documented_cluster_gives_what_this_process_gives_though_a_worker_is_killed(
    logs: Path, tmp_path: Path
) -> None:
    """The cluster is started by its command, as the documentation says, answers on the loopback, ends at Ctrl-C."""
    fleet, asked = tmp_path / "fleet", ("evaluations ORDER BY recording", "budgets ORDER BY recording, quantity, face")
    verb("fleet", "add", fleet, "-g", GAUGE, "-m", "bridge-cmm", *sorted(logs.glob("[0-9].csv")))

    def answers() -> list[str]:
        return [repr(query(Fleet(fleet), f"FROM {one}").to_pylist()) for one in asked]  # to the last digit, and NaN

    verb("fleet", "evaluate", fleet, "--jobs", 1)
    verb("fleet", "budget", fleet, "--runs", 20, "--jobs", 1)
    here = answers()
    start = [sys.executable, "-m", "stepgauge", "fleet", "cluster", "--workers", "2", "--port", "0", "--idle", "90"]
    with subprocess.Popen(start, stdout=subprocess.PIPE, text=True, preexec_fn=heed_interrupts) as cluster:
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        assert os.stat(address).st_mode & 0o077 == os.stat(Path(address).parent).st_mode & 0o077 == 0
        check_that_nobody_else_gets_in(json.loads(Path(address).read_text())["address"])
        for table in tables_of(Fleet(fleet)):
            table.clear()
        verb("fleet", "evaluate", fleet, "--scheduler", address)
        verb("fleet", "budget", fleet, "--runs", 20, "--scheduler", address)
        found = []
        for one in run(told_or_solved, [("", None), *TASKS], Dask(address)):
            found.append(one.value)
            if len(found) == 1:
                os.kill(one.value[0], signal.SIGKILL)
        cluster.send_signal(signal.SIGINT)
        assert cluster.wait(120) == 130  # a busy computer takes its time to start the worker again that was killed
    assert here[0].count("r_eff_mm") == 2 * 6  # with u_r_eff_mm
    assert here[1].count("'quantity': 'r_eff'") == 6
    assert answers() == here
    assert found[1:] == [one.value for one in run(told_or_solved, TASKS, InProcess())]


def check_that_nobody_else_gets_in(address: str) -> None:
    """Another user of the computer knows the port, and has no key: neither in plain text nor with a key of his own."""
    import distributed

    assert address.startswith("tls://127.0.0.1:")
    for door, key in ((address.replace("tls", "tcp"), None), (address, distributed.Security.temporary())):
        with pytest.raises((OSError, TimeoutError)):
            distributed.Client(door, timeout=3, set_as_default=False, security=key)


def test_a_diagnosis_of_the_fleet_is_that_of_the_recording_alone(logs: Path, tmp_path: Path) -> None:
    path = logs / "3.csv"
    verb("fleet", "add", tmp_path / "fleet", "-g", GAUGE, "-m", "bridge-cmm", path)
    verb("fleet", "diagnose", tmp_path / "fleet", "--jobs", 1)
    fleet = Fleet(tmp_path / "fleet")
    row, answer = fleet.recordings().iloc[0], query(fleet, "SELECT * FROM diagnoses").to_pylist()[0]
    recording = read_recording(path)
    found = diagnose(recording, fleet.gauge(row["certificate"]), fleet.machine(row["machine_file"]), separations=False)
    alone = statements_to_dict(replace(found, recordings=(recording,)))
    assert json.loads(answer["document"]) == json.loads(json.dumps(alone))
    with for_command():
        summary = found.summary()
    assert (answer["verdict"], answer["machine"], answer["summary"]) == (found.verdict, "M0", summary)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["add", "FLEET", "LOGS/0.csv"], "nothing says with which gauge"),
        (["add", "FLEET", "LOGS/0.csv", "-g", GAUGE, "--machine-id", "M9"], "another machine; found M9; expected M0"),
        (["add", "FLEET", "LOGS/0.csv", "-g", GAUGE, "--roster", "LOGS/0.csv"], "column 'placement' is not known"),
        (["query", "FLEET", "SELECT 1"], "there is no fleet here"),
    ],
)  # fmt: skip
def test_mistakes_are_told_in_a_line(logs: Path, tmp_path: Path, words: list[str], message: str) -> None:
    said = [word.replace("LOGS", str(logs)).replace("FLEET", str(tmp_path / "fleet")) for word in words]
    with pytest.raises(Exception, match=message):
        verb("fleet", *said)


@pytest.mark.parametrize(
    "sql", ["SELEC 1", "COPY recordings TO 'x.csv'", "SELECT * FROM read_csv('{}')", "SELECT 1; SELECT 2"]
)
def test_a_question_neither_changes_nor_reads_anything_else(logs: Path, tmp_path: Path, sql: str) -> None:
    verb("fleet", "add", tmp_path / "fleet", logs / "0.csv", "-g", GAUGE)
    with pytest.raises(InputError, match="SQL: "):
        verb("fleet", "query", tmp_path / "fleet", sql.format(logs / "1.csv"))


def test_processes_of_this_computer_are_not_asked_of_a_cluster(logs: Path, tmp_path: Path) -> None:
    verb("fleet", "add", tmp_path / "fleet", logs / "0.csv", "-g", GAUGE)
    with pytest.raises(InputError, match="jobs and memory_MB are of"):
        verb("fleet", "evaluate", tmp_path / "fleet", "--scheduler", "tcp://127.0.0.1:9", "--jobs", "2")


def test_what_cannot_be_diagnosed_is_told_and_kept(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verb("fleet", "add", tmp_path / "fleet", logs / "0.csv", "-g", GAUGE)
    with pytest.raises(PartlyDoneError, match="1 recordings could not be used"):
        verb("fleet", "diagnose", tmp_path / "fleet", "--jobs", 1)
    capsys.readouterr()
    verb("fleet", "query", tmp_path / "fleet", "SELECT error FROM diagnoses", "--to", "json")
    assert "no machine file was added" in json.loads(capsys.readouterr().out)[0]["error"]


def test_the_package_does_not_import_what_only_a_fleet_needs() -> None:
    code = "import sys, stepgauge, stepgauge.cli; sys.exit(bool({'duckdb', 'distributed', 'dask'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
