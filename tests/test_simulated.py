"""What a virtual machine made says so: in the recording, whichever way it came, and in whatever is made of it."""

from __future__ import annotations

import datetime
import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import stepgauge as sg
from stepgauge.cli import cli
from stepgauge.compensation import axis_faces
from stepgauge.diagnosis.axis.diagnosis import diagnose_axes
from stepgauge.errors import InputError
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.figures.measurement import draw_measurement
from stepgauge.figures.style import SIMULATED_LINE as ON_FIGURES
from stepgauge.files.checksum import file_digest
from stepgauge.fleet.content import recording_key
from stepgauge.fleet.hierarchical.answer import FleetInference
from stepgauge.fleet.hierarchical.visits import Crossing
from stepgauge.fleet.hierarchical.watch import Watched
from stepgauge.fleet.hierarchical.watching import FleetWatch
from stepgauge.importing.ippdme import read as read_log
from stepgauge.live.connection import SessionLog
from stepgauge.recording import join_recordings, read_recording
from stepgauge.recording.conventions import CONVENTIONS
from stepgauge.recording.lines import read_comments
from stepgauge.recording.simulated import SIMULATED_COMMENT, SIMULATED_LINE, is_simulated
from stepgauge.reports.certificate_file import check_simulated
from stepgauge.reports.content import Sources, make_content
from stepgauge.reports.diagnosis import read_story, story, story_of
from stepgauge.reports.fleet import fleet_story
from stepgauge.reports.page import UserStatements
from stepgauge.reports.render import markdown
from tests.axis.made import axis
from tests.cli.probe_files import bench_series
from tests.dcc.made import evaluated, laboratory
from tests.diagnosis.made import made as diagnosed
from tests.drawn import text_of
from tests.live.made import serving
from tests.live.test_measure import make, run
from tests.measured import lay, one_placement, shipped
from tests.measured import run as simulated_run


def test_a_measurement_on_the_virtual_cmm_says_so_and_when_it_was_made(tmp_path: Path) -> None:
    """Through the server, and through the log of its client; after a resumption from the journal, too."""
    with serving() as port:
        spy = SessionLog(tmp_path / "spy.log", {"server": "here"})
        recording = run(make(), port, tmp_path / "j", spy=spy)
        spy.close()
    assert is_simulated(recording.comments)
    assert "simulated" not in recording.frame
    began = datetime.datetime.fromisoformat(recording.comments["measured_at"])
    assert abs((datetime.datetime.now().astimezone() - began).total_seconds()) < 60.0
    recording.write(tmp_path / "recording.csv")
    assert is_simulated(read_recording(tmp_path / "recording.csv").comments)
    log = read_log((tmp_path / "spy.log").read_text(), "spy.log")
    assert is_simulated(log.comments)


def test_a_real_server_says_nothing_of_the_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server that does not know the property is a real one."""
    monkeypatch.setattr("stepgauge.live.controller.OWN_SIMULATED", "Server.Unheard")
    with serving() as port:
        recording = run(make(1), port, tmp_path / "j")
    assert not is_simulated(recording.comments)
    assert "measured_at" in recording.comments


def test_one_simulated_part_makes_the_whole_simulated() -> None:
    made = simulated_run(2).recording
    real = replace(made, comments={"machine": "Bridge CMM"})
    assert is_simulated(made.comments)
    assert not is_simulated(real.comments)
    assert is_simulated(join_recordings([real, made]).comments)


def with_real_gauge() -> dict[str, Any]:
    evaluation, _ = evaluated()
    return {**evaluation, "gauge": {**evaluation["gauge"], "example": False}}


def test_a_certificate_of_simulated_readings_is_refused_unless_it_is_an_example_by_name() -> None:
    evaluation = with_real_gauge()
    said = laboratory()
    plain = replace(said, certificate=said.certificate.model_copy(update={"example": False}))
    with pytest.raises(InputError, match=r"recording was simulated.*example = true in \[certificate\]"):
        check_simulated(plain, evaluation)
    check_simulated(plain, {**evaluation, "comments": {"machine": "Bridge CMM"}})
    named = replace(said, certificate=said.certificate.model_copy(update={"example": True}))
    check_simulated(named, evaluation)
    gauge, machine = shipped()
    budget = evaluated()[1].model_copy(update={"not_included": []})
    content = make_content(
        evaluation, UserStatements(datetime.date(2026, 5, 4)), Sources(gauge, machine, (), budget, named)
    )
    assert content["example"]
    assert content["simulated"]


def test_figures_beside_the_page_say_so(tmp_path: Path) -> None:
    recording = simulated_run(3).recording
    for comments, expected in ((recording.comments, True), ({"machine": "Bridge CMM"}, False)):
        drawn = replace(recording, comments=comments)
        (path,) = draw_measurement(tmp_path, drawn, one_placement(), ["error"], suffix="pdf")
        assert ("no machine was measured" in text_of(path)) is expected


@pytest.mark.parametrize(("comment", "expected"), [("", False), ("# seed: 3\n", True)])
def test_figures_of_a_probe_that_was_simulated_say_so(tmp_path: Path, comment: str, expected: bool) -> None:
    """Of its points, and of points that were corrected with what was found from simulated ones."""
    made, points, real = tmp_path / "made.csv", tmp_path / "points.csv", tmp_path / "real.csv"
    command = CliRunner().invoke
    sphere = ("omp40-2-50mm", "--sphere-diameter", "25", "-o", str(made))
    assert command(cli, ["probe", "sphere", *sphere]).exit_code == 0
    assert is_simulated(read_comments(made)[0])
    rows = "".join(line for line in made.read_text().splitlines(True) if line[0] != "#")
    points.write_text(comment + rows)
    real.write_text(rows)
    found, drawn = tmp_path / "q.json", [tmp_path / f"{name}.pdf" for name in ("qualified", "taken", "sphere")]
    qualify = ["--sphere-diameter", "25", "--tip-diameter", "6", "-o", str(found), "--plot", str(drawn[0])]
    taken = [str(real), "-q", str(found), "-o", str(tmp_path / "c.csv"), "--plot"]
    for line in (
        ["qualify", str(points), *qualify],
        ["compensate", *taken, str(drawn[1])],
        ["compensate", *taken, str(drawn[2]), "--on-sphere"],
    ):
        done = command(cli, ["probe", *line])
        assert done.exit_code == 0, done.output
    assert ["no machine was measured" in text_of(one) for one in drawn] == [expected] * 3


def test_figures_of_a_fleet_with_simulated_recordings_say_so(tmp_path: Path) -> None:
    watched = Watched("machine", "M", "scale x", "um/m", (100.0, 200.0), (0.0, 1.0), (0.1, 0.1), 0.0, 0.1, ())
    for simulated in (False, True):
        FleetWatch((watched,), {}, 0.05, simulated=simulated).write(tmp_path, "pdf")
        assert ("no machine was measured" in text_of(tmp_path / "watch.pdf")) is simulated


def texts_of(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.texts]


def test_the_figures_of_a_report_of_a_folder_with_a_diagnosis_say_so(tmp_path: Path) -> None:
    """They are drawn anew from what the folder keeps, and had lost it."""
    found = sg.diagnose(diagnosed("scale")[0], gauge="step-gauge-420", machine="bridge-cmm")
    found.write(tmp_path)
    for page in (read_story(tmp_path), story_of(found)):
        assert json.dumps(page, default=texts_of).count(ON_FIGURES) >= 2


def test_a_diagnosis_says_so() -> None:
    said = {"verdict": "adequate", "checks": [], "inputs": {"simulated": True}, "effects": [], "noise": {}}
    said |= {"stepgauge": "", "fit": {}, "remarks": []}
    assert "no machine was measured" in story(said, "t", "s", [])["warnings"][0]


def test_a_simulation_has_date_and_time_and_equal_seeds_are_known_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock is no input: the checksum of the file and the key of its content leave it out, and nothing else."""
    gauge, machine = shipped()
    lies = lay(gauge)
    program = sg.plan(lies, gauge, machine, blocks=(1, 3), cycles=1)
    recordings, digests = [], []
    for name, seed, when in (
        ("a", 3, "2026-11-27T10:00:00+00:00"),
        ("b", 3, "2026-11-27T11:30:00+00:00"),
        ("c", 4, "2026-11-27T11:30:00+00:00"),
    ):
        monkeypatch.setattr("stepgauge.files.dates.moment_now", lambda when=when: when)
        path = tmp_path / f"{name}.csv"
        sg.simulate(program, machine, gauge, lies, seed=seed).write(path)
        recordings.append(read_recording(path))
        digests.append(file_digest(path))
        assert recordings[-1].comments["measured_at"] == when
        assert file_digest(path) == file_digest(path.read_bytes())
    keys = [recording_key(one) for one in recordings]
    assert digests[0] == digests[1] != digests[2]
    assert keys[0] == keys[1] != keys[2]
    real = [one.assign_comments() for one in recordings[:2]]
    real = [replace(one, comments={"measured_at": one.comments["measured_at"]}) for one in real]
    assert recording_key(real[0]) != recording_key(real[1])
    (tmp_path / "real.csv").write_bytes(b"# measured_at: 2026-11-27\nx\n1\n")
    assert file_digest(tmp_path / "real.csv") == hashlib.sha256((tmp_path / "real.csv").read_bytes()).hexdigest()


def test_the_figure_and_table_of_a_bench_say_so(tmp_path: Path) -> None:
    series = bench_series(tmp_path / "s.csv", {0.0: 3.0, 90.0: 3.2})
    for comment, expected in (("", False), (SIMULATED_LINE, True)):
        (tmp_path / "t.csv").write_text(comment + series.read_text())
        files = [str(tmp_path / name) for name in ("t.csv", "b.csv", "b.pdf")]
        assert CliRunner().invoke(cli, ["probe", "bench", files[0], "-o", files[1], "--plot", files[2]]).exit_code == 0
        assert ("no machine was measured" in text_of(tmp_path / "b.pdf")) is expected
        assert is_simulated(read_comments(tmp_path / "b.csv")[0]) is expected


def test_a_probe_map_of_a_model_says_so_in_its_table_figure_and_diagnosis(tmp_path: Path) -> None:
    table, drawn = tmp_path / "map.csv", tmp_path / "map.pdf"
    grid = ["--polar", "90,60", "--azimuth", "0:360:60", "-o", str(table), "--polar-plot", str(drawn)]
    assert CliRunner().invoke(cli, ["probe", "map", "omp40-2-50mm", *grid]).exit_code == 0
    assert "no machine was measured" in text_of(drawn)
    assert is_simulated(read_comments(table)[0])
    assert sg.read_probe_map(table).simulated
    sg.diagnose(table, probe="omp40-2-50mm").write(tmp_path / "d", "pdf")
    assert "no machine was measured" in (tmp_path / "d" / "diagnosis.md").read_text()
    assert "no machine was measured" in text_of(tmp_path / "d" / "residuals.pdf")


@pytest.mark.parametrize("simulated", [False, True])
def test_the_diagnosis_of_a_simulated_axis_says_so(tmp_path: Path, simulated: bool) -> None:
    made = axis(np.arange(0.0, 301.0, 50.0), lambda t, w: 0.01 * t)
    diagnose_axes([replace(made, comments=SIMULATED_COMMENT if simulated else {})]).write(tmp_path, "pdf")
    assert ("no machine was measured" in (tmp_path / "diagnosis.md").read_text()) is simulated
    assert ("no machine was measured" in text_of(tmp_path / "residuals.pdf")) is simulated


def test_the_report_of_a_fleet_with_simulated_recordings_says_so() -> None:
    for simulated in (False, True):
        said = FleetInference(
            (), 0.0, {}, Crossing([], [], {}, {}, np.zeros(0), np.zeros(0)), simulated=simulated
        ).to_dict()
        assert ("no machine was measured" in markdown(fleet_story(said, drawn=False))) is simulated


@pytest.mark.parametrize("convention", ["as_read", "corrected_to_20"])
def test_a_table_for_a_controller_of_simulated_readings_says_so_and_what_was_corrected(convention: str) -> None:
    evaluation = evaluation_to_dict(
        replace(one_placement(), comments={"temperature_convention": convention, "seed": "1"})
    )
    for comments, simulated in (({"seed": "1"}, True), ({}, False)):
        said = {**evaluation, "comments": {**comments, "temperature_convention": convention}}
        notes = axis_faces(said, "evaluation.json", "y").notes
        assert ("Simulated recording: no machine was measured." in notes) is simulated
        assert (CONVENTIONS["corrected_to_20"] in notes) is (convention == "corrected_to_20")
