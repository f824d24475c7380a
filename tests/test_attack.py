"""A small part of benchmarks/attack: damaged files, slips of the pen, kills, a full disk, hazardous constructs."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import pytest

from benchmarks.attack import disk, flips, kill
from benchmarks.attack.constructs import FAMILIES, constructs
from benchmarks.attack.executed import run_by
from benchmarks.attack.fuzz import run as fuzz
from benchmarks.attack.hazards import Target, attack, planned
from benchmarks.attack.insertions import Text
from benchmarks.attack.mutate import slip, wild
from benchmarks.attack.targets import make_measurement
from stepgauge.errors import InputError
from stepgauge.planning.program import program_text


@pytest.fixture(scope="module")
def measurement(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("attack") / "m"
    make_measurement(place)
    return place


def test_damaged_files_are_refused_or_read(tmp_path: Path) -> None:
    """Nothing but results and one-line refusals; no file harmed; no slip accepted silently among these."""
    count, nonsense = fuzz(120, seed=7, place=tmp_path / "m")
    assert count.bad == []
    assert count.outcome["refused"] > 30
    assert count.outcome["accepted"] > 5
    assert nonsense.silent == []


@pytest.mark.parametrize("verb", ["compensate", "history"])
def test_a_killed_verb_leaves_the_old_files_or_the_new_ones(measurement: Path, verb: str) -> None:
    with contextlib.chdir(measurement):
        assert kill.attack(measurement, verb, times=2, pick=random.Random(3)) == []


@pytest.mark.parametrize("verb", ["evaluate", "compensate", "history", "list files"])
def test_a_full_disk_changes_nothing_and_is_said(measurement: Path, verb: str) -> None:
    with contextlib.chdir(measurement):
        assert disk.attack(measurement, verb, sizes=(100,)) == []


def test_no_flipped_bit_is_read_as_another_thing(tmp_path: Path) -> None:
    count = flips.attack(flips.make_kinds(tmp_path / "m"), 66, seed=5)
    assert count.bad == []
    assert count.outcome["refused"] > 50


def test_an_input_follows_from_its_number() -> None:
    data = b"cycle,face,x_mm\n1,1,104.1234567\n1,2,114.5\n"
    for change in (wild, slip):
        one, again, other = (change(data, random.Random(seed)) for seed in (5, 5, 6))
        assert one == again != other


@pytest.mark.parametrize("dialect", FAMILIES)
def test_no_hazardous_construct_is_accepted_at_any_kind_of_place(dialect: str) -> None:
    """Of the corpus a fiftieth; the whole: python -m benchmarks.attack.hazards."""
    count = attack(dialect, seed=11, share=0.02)
    assert count.accepted == []
    assert count.outcome["traceback"] == 0
    assert count.outcome["refused"] > 20


@pytest.mark.parametrize("dialect", FAMILIES)
def test_a_template_of_ones_own_with_a_hazard_is_refused_and_without_it_accepted(dialect: str, tmp_path: Path) -> None:
    """The same texts through the whole way of ``plan --template``."""
    target, own = Target(dialect), tmp_path / "own.j2"
    hazard = "MV 0.000 0.000 -500.000 ;" if dialect == "jinyoung" else constructs(dialect)[0].text
    known = Text(target.text, dialect)
    for text, taken in ((target.text, True), (known.with_line(known.first_move, hazard)[0], False)):
        own.write_text("{% set used = program.name %}{% raw %}" + text + "{% endraw %}\n")
        try:
            assert program_text(planned(), dialect, own).text.strip() == text.strip()
            assert taken
        except InputError:
            assert not taken


def test_the_corpus_has_a_hundred_constructs_by_family_each_with_reason_and_source() -> None:
    for dialect in FAMILIES:
        every = constructs(dialect)
        assert len(every) == len({(one.text, one.kind) for one in every}) >= 100, dialect
        assert all(one.reason and one.source for one in every), dialect


@pytest.mark.parametrize(
    ("dialect", "text", "runs"),
    [
        ("fanuc", "%\nG1 X1. (G0 Z-5.)\n%", "%G1X1.%"),
        ("fanuc", "A\n%\nG1 X1. ; G0 Z-5.\nM30\nG0\n%", "%G1X1.;G0Z-5.M30"),
        ("fanuc", "%\n(A ; G0 Z-5.)\n", "%(A;G0Z-5.)"),
        ("fanuc", "%\nIF [1] GOTO 9\nM30\nG0\nN9 #3000=1 (A)\nG1\n", "%IF[1]GOTO9M30N9#3000=1"),
        ("siemens", 'MSG("G0; Z-5") ; M3\nM30', "MSG()M30"),
        ("siemens", "GOTOF A\nM30\nG0\nA: G1\nM30\nG2", "GOTOFAM30A:G1M30"),
        ("heidenhain", 'QS1 = "M3" ; M3\nM30\nL Z-5\nEND PGM A MM\nM3', "QS1=M30"),
        ("linuxcnc", "G1 X1 (LOG,a) (a LOG,b) ;G0\n(PY,import)\nM2\nG0", "G1X1(LOG,a)(PY,import)M2"),
        ("grbl", "G1 X1 (A!) ; B~\nM2\nG0 Z-5", "G1X1!~M2G0Z-5"),
        ("rrf", 'echo "G0 ; a" ; G1\nM121\nG0', "echoM121G0"),
        ("dmis", "TEXT/OPER,'GOTO/0' $$ GOTO/1\nENDFIL\nGOTO/2", "TEXT/OPER,ENDFIL"),
        ("ippdme", '00001 SetTool("A(B)")\n:\n00002 GoTo()', "00001SetTool():"),
        ("jinyoung", "MV 1 2 3 ;\nEND;\nMV 1 2 3 ;", "MV123;END;"),
    ],
)
def test_what_a_controller_executes_of_a_text(dialect: str, text: str, runs: str) -> None:
    """Remarks and literals, end of block, realtime commands, active remarks, what stands behind the end."""
    assert run_by(text, dialect) == runs
