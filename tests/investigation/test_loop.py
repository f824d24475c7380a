"""The closed loop: a concealed fault is found and told; what stops it loses nothing; what a person declines is left."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import stepgauge as sg
from stepgauge.files.text import read_json, read_result
from stepgauge.gauge.placement import Placement
from stepgauge.investigation.feasible_runs import placement_of_json
from stepgauge.investigation.loop import story_of
from stepgauge.investigation.stations import Served, Simulated, nearly
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.controller import ControllerOptions, Link
from stepgauge.live.in_process import VirtualLink
from stepgauge.motion.moves import ProbingSettings
from stepgauge.reports.investigation import investigation_story
from tests.investigation.made import REVERSAL, WITHOUT, Person, begun, lies_along_y, small_case, station
from tests.live.made import make_state, serving, small_gauge, small_machine, with_effects, write_files

SHORT = {"minutes": 10.5}
"""Time for the gauge as it lies and for one more placement."""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an investigation from the files of a technician; along y, where a reversal on x does not show."""
    folder = tmp_path_factory.mktemp("found")
    files = write_files(folder, small_machine(repeatability_um=0.2), small_gauge(), lies_along_y())
    (folder / "faults.toml").write_text(tomli_w.dumps({"effect": [REVERSAL]}))
    asked: list[str] = []
    told: list[str] = []
    diagnosis = sg.investigate(
        files["--placement"],
        files["--gauge"],
        files["--machine"],
        folder / "cause",
        ask=lambda question: asked.append(question) or True,  # type: ignore[func-returns-value]
        simulate=True,
        faults=folder / "faults.toml",
        figure="svg",
        level=True,
        minutes=SHORT["minutes"],
        without=WITHOUT,
        tell=told.append,
    )
    assert diagnosis.recordings
    assert len(asked) == 1
    assert "each to 3 mm" in asked[0]
    assert told[0] == "run 1: the gauge as it lies"
    assert told[1].startswith("adequate")
    return folder / "cause"


def test_the_cause_is_found_and_its_size(found: Path) -> None:
    said = read_result(found / "investigation.json", "investigation")
    assert said["end"]["how"] == "cause"
    last = said["runs"][-1]["learnt"]
    (one,) = last["found"]
    assert one["label"] == "reversal_error_x"
    value = one["parameters"]["um"]
    assert abs(value["value"] - REVERSAL["um"]) < 4.0 * value["u"]
    # play of x makes that of y and z, which no run has shown yet, as likely as not
    assert last["entropy_nats"] < said["runs"][0]["learnt"]["entropy_nats"] + 2.0 * np.log(2.0)
    assert 0.0 < last["matters_um"] < REVERSAL["um"] / 2.0
    assert said["runs"][0]["learnt"]["matters_um"] == 0.0
    assert said["minutes"] <= SHORT["minutes"]


def test_the_second_run_is_chosen_for_what_the_first_could_not_show(found: Path) -> None:
    first, *later = read_json(found / "investigation.json")["runs"]
    second = next(run for run in later if run["placement"] == 2)
    assert first["why"] is None
    assert "reversal_error" in second["why"]["may_show"]
    axis = placement_of_json(second["lies"]).axis
    assert abs(axis[0]) > 0.5


def test_all_runs_are_one_recording_that_a_diagnosis_takes(found: Path) -> None:
    recording = sg.read_recording(found / "recording.csv")
    assert recording.placements == [1, 2]
    assert (np.diff(recording.frame["time_s"]) > 0.0).all()
    assert read_json(found / "diagnosis" / "diagnosis.json")["effects"][0]["label"] == "reversal_error_x"


def test_the_story_is_told_in_every_kind_of_page(found: Path, tmp_path: Path) -> None:
    text = (found / "investigation.md").read_text()
    for words in (
        "## The answer",
        "reversal error x",
        "### Run 2: the gauge",
        "Chosen because",
        "After it:",
        "um was not looked for",
    ):
        assert words in text
    for name in ("story.html", "story.pdf"):
        sg.report(found, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 3000
    assert "Run 2" in (tmp_path / "story.html").read_text()


def test_another_machine_file_is_not_gone_on_with(found: Path) -> None:
    files = {name: found.parent / f"{name}.toml" for name in ("placement", "gauge", "machine", "faults")}
    other = found.parent / "other.toml"
    other.write_text(files["machine"].read_text().replace("repeatability_um = 0.2", "repeatability_um = 0.3"))
    common = {
        "ask": bool,
        "simulate": True,
        "faults": files["faults"],
        "level": True,
        "minutes": SHORT["minutes"],
        "without": WITHOUT,
        "resume": True,
    }
    with pytest.raises(sg.InputError, match="with another machine file"):
        sg.investigate(files["placement"], files["gauge"], other, found, **common)


class StoppedError(Exception):
    """The process is killed here."""


@dataclass
class Counting(VirtualLink):
    """Counts probings, and breaks off before the one of a number."""

    def __init__(self, inner: Link, settings: ProbingSettings, count: Counter[str], stop_at: int) -> None:
        super().__init__(inner.cmm, settings)  # type: ignore[attr-defined]
        self.count, self.stop_at = count, stop_at

    def probe(self, surface_mm: Any, approach: Any, takes_s: float) -> Any:
        if self.count["probings"] == self.stop_at:
            raise StoppedError
        self.count["probings"] += 1
        return super().probe(surface_mm, approach, takes_s)


class Fragile(Simulated):
    """A machine whose process is killed at a probing, and on which the gauge is laid wrong first; its clock goes on."""

    repeats = False

    def __init__(self, count: Counter[str], stop_at: int) -> None:
        case = small_case()
        super().__init__(case.machine, case.gauge, with_effects(REVERSAL), 4)
        self.count, self.stop_at = count, stop_at
        self.clock = vars(count).setdefault("clock", self.clock)

    def stand(self, number: int, lies: Placement) -> None:
        """Whoever lays the gauge lays it far off at first."""
        self.count["laid"] += number > 1
        off = np.array([0.0, 60.0, 0.0]) if number > 1 and self.count["laid"] == 1 else np.zeros(3)
        super().stand(number, Placement(lies.c1_mm + off, lies.c2_mm + off, lies.axis, lies.up, 1, lies.last_block))

    @contextmanager
    def linked(self, settings: ProbingSettings) -> Iterator[Link]:
        with super().linked(settings) as inner:
            yield Counting(inner, settings, self.count, self.stop_at)


def test_what_is_done_is_never_done_again(tmp_path: Path) -> None:
    """Killed in the first run, while the gauge is located, and in the second run; asked once, every point once.

    A gauge that is not found where it was asked for is asked for again, with the reason.
    """
    count, person, case = Counter[str](), Person(), small_case(**SHORT)
    for stop_at in (5, 19, 30):
        place = Fragile(count, stop_at)
        with begun(tmp_path, place, person, stop_at > 5, case) as found, pytest.raises(StoppedError):
            found.go_through()
    with begun(tmp_path, Fragile(count, 10**6), person, True, case) as found:
        found.go_through()
        last = story_of(found)
    assert last["simulated"]
    assert "no machine was measured" in investigation_story(last)["warnings"][0]
    in_vain, lost = 1, 2  # where the gauge was not; of the seven that locate it, those before the kill
    more = sum(len(sg.read_recording(made.path)) for made in found.runs[2:])
    assert count["probings"] == 16 + in_vain + lost + 7 + 16 + more
    assert len(person.asked) == 2
    assert "the gauge was not found" in person.asked[1]
    assert last["runs"][-1]["learnt"]["found"][0]["label"] == "reversal_error_x"
    with begun(tmp_path, Fragile(count, 0), Person(), True, case) as found:
        found.go_through()
        assert story_of(found) == last


class Killed(Simulated):
    """The virtual CMM, whose process is killed at a probing."""

    def __init__(self, stop_at: int) -> None:
        case = small_case()
        super().__init__(case.machine, case.gauge, with_effects(REVERSAL), 1)
        self.count, self.stop_at = Counter[str](), stop_at

    @contextmanager
    def linked(self, settings: ProbingSettings) -> Iterator[Link]:
        with super().linked(settings) as inner:
            yield Counting(inner, settings, self.count, self.stop_at)


def test_a_simulated_investigation_is_the_same_after_kills(tmp_path: Path) -> None:
    """Killed in the first run, while the gauge is located, in the second run, and once more: to the last digit."""
    person, case = Person(), small_case(**SHORT)
    with begun(tmp_path / "whole", Killed(10**6), Person(), False, case) as found:
        found.go_through()
        whole, story = found.recording.frame, story_of(found)
    for number, stop_at in enumerate((5, 19, 30, 31)):
        with (
            begun(tmp_path / "cut", Killed(stop_at), person, number > 0, case) as found,
            pytest.raises(StoppedError),
        ):
            found.go_through()
    with begun(tmp_path / "cut", Killed(10**6), person, True, case) as found:
        found.go_through()
        assert found.recording.frame.to_csv() == whole.to_csv()
        assert story_of(found) == story
    assert len(person.asked) == len(set(person.asked)), "nobody is asked twice"


def test_more_minutes_go_on_with_what_had_ended(tmp_path: Path) -> None:
    """The time was over after one run; with more of it a second one follows, and nothing is measured again."""
    count, person = Counter[str](), Person()
    stories = []
    for minutes in (3.0, SHORT["minutes"], 3.0):
        case, place = small_case(minutes=minutes), Fragile(count, 10**6)
        with begun(tmp_path, place, person, bool(stories), case) as found:
            found.go_through()
            stories.append({**story_of(found), "probings": count["probings"]})
    short, longer, after = stories
    assert short["end"]["why"] == "the time is over"
    assert len(short["runs"]) < len(longer["runs"])
    assert longer["runs"][: len(short["runs"]) - 1] == short["runs"][:-1]
    assert longer["runs"][-1]["learnt"]["found"][0]["label"] == "reversal_error_x"
    assert after["runs"] == longer["runs"]
    assert after["probings"] == longer["probings"]


def test_what_cannot_be_done_is_left_and_told(tmp_path: Path) -> None:
    person = Person([False] * 50)
    with begun(tmp_path, station(REVERSAL), person, case=small_case(**SHORT)) as found:
        last = found.go_through()
    assert last["end"] == {"how": "adequate", "why": "what would tell more was declined", "stands": False}
    assert len(person.asked) == len(set(person.asked)) == len(found.declined) > 1
    assert last["needed"]
    assert all(one.run.stays for one in found.runs)  # what needs no hands may still be measured


@dataclass
class Behind(Served):
    """A machine behind a server, and the hands that lay the gauge on it."""

    state: Any = None

    def stand(self, number: int, lies: Placement) -> None:
        old = self.state.cmm
        true = lies if number == 1 else nearly(lies, np.random.default_rng(number))
        new = LiveCmm(self.machine, small_gauge(), true, old.clock, old.faults, None, number)
        new.position_mm, new.homed = old.position_mm, old.homed
        self.state.cmm = new


def test_it_measures_over_the_standard_interface(tmp_path: Path) -> None:
    case = small_case(**SHORT)
    state = make_state(None, with_effects(REVERSAL), case.machine, lies_along_y())
    with serving(state) as port:
        place = Behind(f"127.0.0.1:{port}", case.machine, ControllerOptions(home=True), None, state)
        with begun(tmp_path, place, Person(), case=case) as found:
            last = found.go_through()
    assert last["end"]["how"] == "cause"
    assert last["found"][0]["label"] == "reversal_error_x"
    assert (np.diff(found.recording.frame["time_s"]) > 0.0).all()
