"""Program text: what is rendered is read back as the same moves; what is not a program is refused with its line."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.files.controls import fixed, plain
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.plan import ORDERS, ROUTES, PlanOptions, make_program
from stepgauge.programs import DIALECTS, Dialect, read_program, recognise
from stepgauge.programs.compare import difference, going
from stepgauge.programs.describe import described
from stepgauge.programs.grammar import IF, JUMP
from stepgauge.programs.reading import Reader
from stepgauge.programs.render import render
from tests.build import angles, gauges, inclinations, make_gauge, make_pose, positions
from tests.conftest import ROOT

FAMILIES = {name: one for name, one in DIALECTS.items() if not one.family}  # a variant is its family with other options
dialects = pytest.mark.parametrize("dialect", FAMILIES.values(), ids=FAMILIES)
settings_of = st.builds(
    ProbingSettings,
    standoff_mm=st.decimals(1, 9, places=3).map(float),
    search_mm=st.decimals("0.1", 5, places=3).map(float),
    retract_mm=st.decimals(1, 9, places=3).map(float),
    measuring_speed_mm_s=st.decimals("0.1", 20, places=2).map(float),
    travel_speed_mm_s=st.decimals(1, 500, places=2).map(float),
    tip_radius_mm=st.decimals("0.5", 3, places=3).map(float),
)


def plan(settings: ProbingSettings | None = None, yaw: float = 0.3, **options: object) -> Program:
    gauge = make_gauge(3)
    choice = PlanOptions(1, 3, **{"cycles": 1, **options})  # type: ignore[arg-type]
    placement = make_pose(yaw, 0.01, origin=(100.0, -50.0, 30.0)).placement(gauge)
    return make_program(placement, gauge, choice, settings or ProbingSettings())


@dialects
@hypothesis_settings(max_examples=40)
@given(
    gauge=gauges(),
    yaw=angles,
    pitch=inclinations,
    origin=positions,
    settings=settings_of,
    route=st.sampled_from(ROUTES),
    order=st.sampled_from(ORDERS),
    cycles=st.integers(1, 3),
)
def test_reading_what_was_rendered_gives_the_same_moves(
    dialect: Dialect, gauge, yaw, pitch, origin, settings, route, order, cycles
) -> None:
    options = PlanOptions(1, gauge.n_blocks, route=route, order=order, cycles=cycles)
    program = make_program(make_pose(yaw, pitch, origin=origin).placement(gauge), gauge, options, settings)
    text = render(program, dialect)
    assert recognise(text, "x") is dialect
    controller = ProbingSettings(**{**settings.__dict__, **dict.fromkeys(dialect.carries, 77.0)})
    back = dialect.read(text, "x", controller)
    assert difference(program, back, dialect) is None
    for name in ProbingSettings.__dataclass_fields__:
        assert getattr(back.settings, name) == pytest.approx(getattr(settings, name), abs=2e-5), name


@dialects
def test_positions_come_back_to_the_printed_digits(dialect: Dialect) -> None:
    """The text states the numbers; the reader must not lose any: half a unit of the last digit, and no more."""
    program = plan()
    back = dialect.read(render(program, dialect), "x", program.settings)
    program = program if len(program) == len(back) else going(program)
    half = 0.5 * 10.0**-dialect.decimals
    goto = ~program.is_measure
    assert np.abs(program.position_mm - back.position_mm)[goto].max() <= half * 1.001
    assert np.abs(program.position_mm - back.position_mm).max() <= 2.0 * half


def test_the_comparison_names_the_difference() -> None:
    program, dialect = plan(), DIALECTS["jinyoung"]
    back = dialect.read(render(program, dialect), "x", program.settings)
    moved = program.position_mm.copy()
    moved[3, 1] += 3e-3
    assert difference(program, back, dialect) is None
    assert "y = " in str(difference(replace(program, position_mm=moved), back, dialect))
    assert "line 1: x = " in str(difference(plan(yaw=0.31), back, dialect))
    assert "6 measuring points, planned 12" in str(difference(plan(cycles=2), back, dialect))


@dialects
def test_numbers_are_plain_decimals(dialect: Dialect) -> None:
    """No exponent, no negative zero, no more digits than an I++ server reads (16 characters)."""
    text = render(plan(yaw=0.0), dialect)
    assert not re.search(r"\d[eE][-+]?\d", text)
    assert not re.search(r"-0\.0*(?![\d])", text)
    assert max(map(len, re.findall(r"[-+.\d]+", text))) <= 16


def test_fixed_never_prints_a_negative_zero() -> None:
    assert fixed(-0.0004, 3) == "0.000"
    assert fixed(-0.0006, 3) == "-0.001"
    assert fixed(1e-12, 6) == "0.000000"
    assert fixed(1e6, 1) == "1000000.0"


def test_dmis_keeps_to_its_line_length_and_names() -> None:
    text = render(plan(cycles=12), DIALECTS["dmis"])
    assert max(map(len, text.splitlines())) <= 80
    assert all(len(name) <= 16 for name in re.findall(r"F\(([^)]*)\)", text))
    assert text.index("UNITS/MM,ANGDEC") < text.index("GOTO/")
    for state in (
        "PRCOMP/OFF",
        "SNSET/APPRCH",
        "SNSET/SEARCH",
        "SNSET/RETRCT",
        "FEDRAT/POSVEL,MPM",
        "FEDRAT/MESVEL,MPM",
    ):
        assert state in text


def test_dmis_and_ippdme_give_the_outward_normal_and_the_surface_point() -> None:
    """Face 1 of a gauge along +x from the origin: surface at x = 0, normal -x, tip centre a radius before."""
    gauge = make_gauge(2)
    program = make_program(
        make_pose(0.0, 0.0).placement(gauge), gauge, PlanOptions(1, 2, cycles=1), ProbingSettings(tip_radius_mm=2.0)
    )
    dmis, ipp = (render(program, DIALECTS[name]) for name in ("dmis", "ippdme"))
    assert "PTMEAS/CART,0.000000,0.000000,0.000000,$\n-1.000000000,0.000000000,0.000000000" in dmis
    assert "PtMeas(X(0.000000), Y(0.000000), Z(0.000000), IJK(-1.000000000, 0.000000000, 0.000000000))" in ipp
    assert "MS  -2.000      0.000      0.000 ;" in render(program, DIALECTS["jinyoung"])
    assert "G38.2 X0.000000 Y0.000000 Z0.000000" in render(program, DIALECTS["linuxcnc"])  # 2 mm of search


def test_linuxcnc_sets_every_state_that_probing_needs() -> None:
    lines = render(plan(), DIALECTS["linuxcnc"]).splitlines()
    states = next(line for line in lines if line.startswith("G21"))
    assert {"G21", "G90", "G94", "G61"} <= set(states.split())
    assert lines[-1] == "M2"
    assert max(map(len, lines)) < 255
    assert all(" F" in line for line in lines if line.startswith(("G1", "G38.2")))


def test_ippdme_tags_rise_and_the_session_is_closed() -> None:
    text = render(plan(), DIALECTS["ippdme"])
    commands = text.splitlines()[:-1:2]
    assert [int(line[:5]) for line in commands] == list(range(1, len(commands) + 1))
    assert set(text.splitlines()[1:-1:2]) == {"\\\\"}
    assert commands[0].endswith("StartSession()")
    assert commands[-1].endswith("EndSession()")
    assert text.splitlines()[-1] == ":"


@dialects
@given(data=st.data())
def test_a_truncated_program_is_an_error_with_its_line(dialect: Dialect, data: st.DataObject) -> None:
    lines = render(plan(), dialect).splitlines()
    kept = data.draw(st.integers(1, len(lines) - 1))
    with pytest.raises(InputError, match=r"^x:\d+: "):
        dialect.read("\n".join(lines[:kept]), "x", ProbingSettings())


WRONG = {
    "jinyoung": [
        ("MS  ", "MX  ", r"found 'MX .*list_dialects\(.jinyoung.\)"),
        ("END;", "END;\nMV 1 2 3 ;", "after the end"),
        (" ;\nPO", "\nPO", "found 'MV .*; expected ;"),
        ("MV  ", "MV  1 ", "expected ; "),
        ("MS  ", "MS  x", "found 'x.*expected a decimal number"),
    ],
    "dmis": [
        ("UNITS/MM", "UNITS/INCH", "found 'INCH,ANGDEC'; expected MM"),
        ("UNITS/MM,ANGDEC\n", "", "units are set"),
        ("PRCOMP/OFF", "PRCOMP/ON", "found 'ON'; expected OFF"),
        ("GOTO/", "GOTOX/", "found 'X/.*expected /"),
        ("ENDMES", "$$", "MEAS inside"),
        ("MODE/PROG,MAN", "MODE/MAN", "operator makes by hand"),
        ("SNSLCT/S(PROBE)", "SNSLCT/SA(PROBE)", "not calibrated"),
        ("PTMEAS/CART,", "PTMEAS/CART,nan,", "found 'nan,.*expected a decimal number"),
        ("SNSET/SEARCH", "SNSET/DEPTH", "found 'DEPTH.*expected APPRCH, SEARCH or RETRCT"),
        ("POSVEL,MPM", "POSVEL,INCH", "found 'INCH.*expected MPM"),
        ("ENDFIL", "ENDFIL\nGOTO/1,2,3", "after the end"),
        ("DATSET/MCS", "DATSET/DAT(A),XDIR", r"found 'DAT\(A\),XDIR'; expected MCS"),
        ("SNSLCT/S(PROBE)", "SNSLCT/S(OTHER)", "not defined here"),
        ("MODE/PROG,MAN", "MODE/AUTO", "found 'AUTO'; expected PROG,MAN"),
        ("OPEN/DID", "USE/DID(RESULTS)\nOPEN/DID", r"found 'USE/DID\(RESULTS\)'"),
        ("MEAS/POINT,F(C1F1)", "MEAS/POINT,F(C9F9)", "the feature is not defined"),
        ("=FEAT/POINT,CART,1", "=FEAT/POINT,CART,2", "is defined elsewhere"),
    ],
    "linuxcnc": [
        ("G21", "G20", "found 'G20'; expected G0, G1"),
        ("G90", "G91", "found 'G91'; expected G0, G1"),
        ("G94", "G93", "found 'G93'; expected G0, G1"),
        ("G61", "G43", "found 'G43'; expected G0, G1"),
        ("M2", "M2\nG0 X1", "after the end"),
        ("G38.2 X", "G38.2 U", "found 'U100"),
        ("G38.2 ", "G38.2 #5 ", "found '#5X"),
        ("F180.000", "F-180", "found 'F-180'; expected F with a decimal number without a sign"),
        ("G21 G90", "G90", "units are set"),
        ("G38.2 X", "G38.2 X1 X", "the same word twice"),
        ("M2", "M3\nM2", "found 'M3'; expected M0, M2, M30"),
        ("#<_n>=0", "#<_n>=0G1X-500", "found 'G1X-500'; expected nothing more"),
    ],
    "ippdme": [
        ("GoTo(", "Goto(", "found 'Goto"),
        ("IJK(", "IJK(0, ", "found ', IJK"),
        ("GoTo(X(", "GoTo(W(", r"found 'W\("),
        ("GoTo(X(", "GoTo(X(1), X(", r"a field twice in a command; found X\("),
        ("GoTo(X(", "GoTo(IJK(1, 0, 0), X(", "fields not understood"),
        ("Tool.PtMeasPar.Search(", "Tool.Search(", r"found 'Search\(.*expected PtMeasPar"),
        ("EndSession()", "EndSession()\n99999 Home()", "after the end"),
        ("00012 ", "12 ", "found '12 GoTo"),
        ("MachineCsy", "PartCsy", r"found 'PartCsy\)'; expected MachineCsy"),
        ("EndSession()", "Home()\n00099 EndSession()", "before the first move"),
    ],
}


@pytest.mark.parametrize(("name", "old", "new", "words"), [(name, *case) for name in WRONG for case in WRONG[name]])
def test_a_wrong_statement_is_an_error_with_its_line(name: str, old: str, new: str, words: str) -> None:
    text = render(plan(), DIALECTS[name])
    assert old in text
    with pytest.raises(InputError, match=rf"^x:\d+: .*{words}"):
        DIALECTS[name].read(text.replace(old, new, 1), "x", ProbingSettings())


def test_a_zero_normal_is_refused() -> None:
    text = re.sub(r"IJK\([^)]+\)", "IJK(0, 0, 0)", render(plan(), DIALECTS["ippdme"]))
    with pytest.raises(InputError, match="no direction"):
        DIALECTS["ippdme"].read(text, "x", ProbingSettings())


def test_foreign_and_empty_texts_are_refused(tmp_path: Path) -> None:
    for name, text in (("letter.txt", "Dear Sir,\nwe are pleased"), ("empty.dmi", "")):
        path = tmp_path / name
        path.write_text(text)
        with pytest.raises(InputError, match="not a measuring program in a known dialect"):
            read_program(path, ProbingSettings())
    for dialect, text in (
        ("dmis", "DMISMN/'x',05.2\nENDFIL\n"),
        ("linuxcnc", "G21\nG0 X1 Y1 Z1\nM2\n"),
        ("jinyoung", "MV 1 2 3 ;\nEND;\n"),
    ):
        with pytest.raises(InputError, match=r"measures nothing|no moves"):
            DIALECTS[dialect].read(text, "x", ProbingSettings())


def test_programs_in_lower_case_and_with_comments_are_read() -> None:
    """Case does not matter in DMIS and G-code; $$, ( ) and ; are comments; axis words are modal."""
    program = plan()
    for name, extra in (("dmis", "$$ a remark"), ("linuxcnc", "(a remark) ; another")):
        lines = render(program, DIALECTS[name]).lower().splitlines()
        text = "\n".join([*lines[:3], extra, *lines[3:]])
        back = DIALECTS[name].read(text, "x", program.settings)
        assert difference(program, back, DIALECTS[name]) is None
    modal = "G21 G90\nG1 X0 Y0 Z5 F600\nZ1\nG38.2 Z-1 F60\nG0 Z5\nM2\n"
    back = DIALECTS["linuxcnc"].read(modal, "x", ProbingSettings(search_mm=0.5))
    np.testing.assert_allclose(back.position_mm, [[0, 0, 5], [0, 0, 1], [0, 0, -0.5], [0, 0, 5]])
    np.testing.assert_allclose(back.approach[2], [0, 0, -1])
    assert (back.settings.travel_speed_mm_s, back.settings.measuring_speed_mm_s) == (10.0, 1.0)
    assert list(back.line) == [2, 3, 4, 5]


def test_a_users_own_template_is_used(tmp_path: Path) -> None:
    template = tmp_path / "mine.j2"
    template.write_text(
        "{% for p in points %}{{ p.name }} {{ p.measure.tip.x | fixed(2) }} {{ p.measure.normal.x | fixed(1) }}\n"
        "{% endfor %}{{ program.name | plain }} {{ settings.search_mm }} {{ start | length }} {{ finish | length }}\n"
    )
    lines = render(plan(yaw=0.0), DIALECTS["dmis"], template).splitlines()
    assert lines[0] == "C1F1 98.00 -1.0"
    assert lines[1] == "C1F2 112.00 1.0"
    assert lines[-1] == "Test gauge 2.0 1 3"


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("one\n{{ nothing }}", 2, "'nothing' is undefined"),
        ("{{ settings.speed }}", 1, "speed"),
        ("one\ntwo {% for %}", 2, "template"),
        ("{{ 1 / 0 }}", 1, "division by zero"),
        ("{{ ''.__class__.__mro__ }}", 1, "unsafe|undefined"),
        ("\n{{ program.__init__.__globals__ }}", 2, "unsafe|undefined"),
        ("{% include '/etc/passwd' %}", 1, "template"),
        ("{{ points.clear() }}", 1, "no attribute 'clear'"),
    ],
)
def test_a_failing_template_is_an_error_with_its_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    template = tmp_path / "mine.j2"
    template.write_text(text)
    with pytest.raises(InputError, match=rf"mine\.j2:{line}: .*({words})"):
        render(plan(), DIALECTS["dmis"], template)


def test_a_template_may_extend_the_shipped_one_and_read_an_input(tmp_path: Path) -> None:
    """The block of the log replaced; reading an input of the controller moves nothing."""
    program, dialect = plan(), DIALECTS["linuxcnc"]
    template = tmp_path / "clocked.j2"
    template.write_text(
        '{% extends "linuxcnc.j2" %}\n{% block log %}\nM66 E0 L0\n(LOG,%d#<_n> %.4f#5399)\n{% endblock %}\n'
    )
    text = render(program, dialect, template)
    assert text.count("M66 E0 L0\n(LOG,%d#<_n> %.4f#5399)\n") == program.n_points
    assert "#5061" not in text
    assert difference(program, dialect.read(text, "program", program.settings), dialect) is None


def test_a_template_that_prints_what_no_controller_reads_is_refused(tmp_path: Path) -> None:
    template = tmp_path / "mine.j2"
    template.write_text("ok {{ version }}\n20 °C\n")
    with pytest.raises(InputError, match=r"line 2 .* not ASCII"):
        render(plan(), DIALECTS["dmis"], template)


def test_a_search_of_many_digits_is_read_back() -> None:
    """Its target follows from three printed numbers: the end of the search, where it starts, and how long it is."""
    gauge, dialect, random = make_gauge(3), DIALECTS["linuxcnc"], np.random.default_rng(5)
    for _ in range(200):
        settings = ProbingSettings(0.5, random.uniform(0.2, 3.0), 0.5, tip_radius_mm=random.uniform(0.5, 3.0))
        pose = make_pose(random.uniform(-3, 3), random.uniform(-1, 1), origin=tuple(random.uniform(-300, 300, 3)))
        program = make_program(pose.placement(gauge), gauge, PlanOptions(1, 3, cycles=1), settings)
        assert difference(program, dialect.read(render(program, dialect), "x", settings), dialect) is None


@pytest.mark.parametrize("dialect", DIALECTS.values(), ids=DIALECTS)
def test_the_tables_of_the_docs_are_those_that_programs_are_read_by(dialect: Dialect) -> None:
    page = (ROOT / "docs/dialects.md").read_text()
    assert f"### `{dialect.name}`: {dialect.title}\n" in page
    assert described(dialect) in page, "docs/dialects.md is not what 'stepgauge list dialects NAME' prints"


@pytest.mark.parametrize("dialect", DIALECTS.values(), ids=DIALECTS)
def test_every_entry_of_a_table_is_executed_and_has_a_source(dialect: Dialect) -> None:
    control = dialect.control(Reader("x", ProbingSettings()))
    for form in dialect.table.forms:
        assert form.way in (IF, JUMP) or callable(getattr(control, form.name)), form
        assert form.source, form
        assert form.does, form
    assert all(one.source for one in (*dialect.table.codes, *dialect.table.variables, *dialect.table.comments))
    used = {name for form in dialect.table.forms for name in re.findall(r"\{(\w+)\}", form.text)}
    assert set(dialect.table.slots) <= used | set(dialect.table.words.values()), "a slot that nothing uses"


def test_a_name_of_another_alphabet_is_spelled_in_a_program() -> None:
    """The program of a German gauge was called 'Stufenendma_ 400'."""
    assert plain("Stufenendmaß 400 für Grün") == "Stufenendmass 400 fuer Gruen"
    assert plain("étalon n°3") == "etalon n_3"
