"""Every command, every error, and the order of the answers, without a socket."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import stepgauge
from stepgauge.ippdme.codes import CODES
from stepgauge.ippdme.commands import COMMANDS, ELSEWHERE
from stepgauge.ippdme.values import named
from stepgauge.live.faults import NUMBERS
from stepgauge.live.methods import HANDLERS
from stepgauge.live.session import LONGEST_QUEUE
from tests.live.made import Memory, events, lying, make_state, small_gauge

SURFACE = "X(300), Y(50), Z(50), IJK(0, 0, 1)"


@pytest.fixture
def client() -> Memory:
    return Memory().start()


def number(lines: list[str]) -> int:
    """The number of the one error in the lines."""
    errors = [int(line.split(", ")[1]) for line in lines if "! Error(" in line]
    assert len(errors) == 1, lines
    return errors[0]


ANSWERS = {
    "GetDMEVersion()": ['# DMEVersion("1.4")'],
    "GetMachineClass()": ["# GetMachineClass(CartCMM)"],
    "GetErrorInfo(0513)": ['# "Daemon does not exist"'],
    "GetErrStatusE()": ["# ErrStatus(0)"],
    "GetXtdErrStatus()": ["# IsHomed(1)", "# IsUserEnabled(0)"],
    "IsHomed()": ["# IsHomed(1)"],
    "EnableUser()": [],
    "DisableUser()": [],
    "IsUserEnabled()": ["# IsUserEnabled(0)"],
    "ClearAllErrors()": [],
    "SetCoordSystem(MoveableMachineCsy)": [],
    "GetCoordSystem()": ["# CoordSystem(MachineCsy)"],
    "SetCsyTransformation(PartCsy, 1, 2, 3, 40, 50, 60)": [],
    "GetCsyTransformation(PartCsy)": [f"# GetCsyTransformation({', '.join(['0.0000000'] * 6)})"],
    "EnumTools()": ['# "RefTool"', '# "NoTool"', '# "StepGaugeProbe"'],
    'FindTool("RefTool")': [],
    'ChangeTool("RefTool")': [],
    'SetTool("NoTool")': [],
    'GetChangeToolAction("RefTool")': ["# ChangeToolAction(Switch, X(0), Y(0), Z(0))"],
    "AlignTool(0, 0, 1, 1)": ["# (0.000000000, 0.000000000, 1.000000000)"],
    "GetProp(Tool.GoToPar.Speed(), Tool.PtMeasPar.Search.Max())": [
        "# Tool.GoToPar.Speed(50.000000), Tool.PtMeasPar.Search.Max(100.000000)"
    ],
    "GetPropE(Tool.PtMeasPar.Speed.Def())": ["# Tool.PtMeasPar.Speed.Def(3.000000)"],
    "GetProp(Tool.Name(), Part.Temperature())": ['# Tool.Name("StepGaugeProbe"), Part.Temperature(20.0000)'],
    "SetProp(Tool.PtMeasPar.Speed(2), Tool.GoToPar.Speed.Act(40))": [],
    "EnumProp(Tool.GoToPar())": ['# "Speed", "Number"', '# "Accel", "Number"'],
    "EnumProp(Part())": ['# "Temperature", "Number"'],
    "EnumProp(Server())": ['# "Time", "Number"', '# "Simulated", "Number"'],
    "EnumProp(Tool.GoToPar.Speed())": [f'# "{name}", "Number"' for name in ("Min", "Max", "Act", "Def")],
    "Get(Z(), X())": ["# Z(300.0000000), X(0.0000000)"],
    "Get(ScaleX.Temperature())": ["# ScaleX.Temperature(20.0000)"],
    "OnPtMeasReport(X(), IJK(), ER())": [],
    "OnMoveReportE(Time(0.5), Dis(2), X())": [],
    "GoTo(X(10))": [],
    "PtMeas(X(10), IJK(0, 0, 1))": ['! Error(3, 1008, "PtMeas", "Target position out of machine volume")'],
    "EndSession()": [],
}


@pytest.mark.parametrize("command", ANSWERS)
def test_what_each_command_answers(client: Memory, command: str) -> None:
    assert client.ask(command) == ANSWERS[command]


def test_every_command_of_the_server_was_asked() -> None:
    tried = {command.split("(")[0] for command in ANSWERS}
    elsewhere = {"StartSession", "Home", "AbortE", "StopDaemon", "StopAllDaemons", "EnumAllProp"}
    assert tried | elsewhere == set(HANDLERS)


ERRORS = {
    "StartSession()": 8,
    "StartSession(1)": 502,
    "Home(1)": 502,
    "home()": 507,
    "ScanOnLine(0,0,0,1,1,1,0,0,1,1)": 501,
    "GetErrorInfo()": 502,
    "GetErrorInfo(1, 2)": 502,
    "GetErrorInfo(2.7)": 509,
    "GetErrorInfo(7777)": 504,
    "GetErrorInfo(0013)": 504,
    'GetErrorInfo("a")': 509,
    "GoTo()": 502,
    "GoTo(X(1), X(2))": 502,
    "GoTo(X())": 509,
    "GoTo(X(1, 2))": 509,
    "GoTo(X(1), IJK(0, 0, 1))": 505,
    "GoTo(Q(1))": 505,
    "GoTo(R(1))": 506,
    "GoTo(5)": 502,
    "GoTo(X(500))": 1008,
    "GoTo(X(1e200))": 1008,
    "PtMeas()": 502,
    "PtMeas(IJK(0, 0, 1))": 502,
    "PtMeas(X(), Y(2), Z(3))": 509,
    "PtMeas(X(1), IJK(2, 2, 2), IJK(3, 2, 2))": 502,
    "PtMeas(X(300), Y(50), Z(50), IJK(0, 0, 0))": 1010,
    "PtMeas(X(300), Y(50), Z(50), IJK(0, 1))": 502,
    "PtMeas(X(300), Y(50), Z(50), IJK(1e300, 1e300, 0))": 509,
    "PtMeas(X(300), Y(50), Z(50), IJK(1e200, 1e200, 0))": 1010,
    f"PtMeas({SURFACE})": 1006,
    "PtMeas(X(300), Y(50), Z(-1), IJK(0, 0, 1))": 2500,
    "OnPtMeasReport()": 510,
    "OnPtMeasReport(Colour())": 510,
    "OnPtMeasReport(Q())": 510,
    "OnPtMeasReport(X(1))": 502,
    "OnPtMeasReport(X)": 502,
    "OnPtMeasReport(Tool.A())": 506,
    "OnPtMeasReport(X(), X())": 502,
    "Get()": 502,
    "Get(R())": 506,
    "Get(X)": 502,
    "Get(X(1))": 502,
    "Get(X(), X())": 502,
    "Get(Q())": 505,
    "Get(Colour())": 505,
    "GetProp()": 502,
    "GetProp(Tool.PtMeasPar.Colour())": 510,
    "GetProp(Tool.PtMeasPar.Speed.Most())": 510,
    "GetProp(Tool.PtMeasPar())": 510,
    "GetProp(Chair.Leg())": 510,
    "GetProp(FoundTool.PtMeasPar.Speed())": 1503,
    "SetProp(Tool.PtMeasPar.Speed())": 509,
    "SetProp(Tool.PtMeasPar.Speed(1), Tool.PtMeasPar.Speed(2))": 502,
    "SetProp(Tool.PtMeasPar.Speed.Max(5))": 510,
    "SetProp(Part.Temperature(21))": 510,
    "SetProp(Tool.PtMeasPar.Speed(1000))": 504,
    "EnumProp(Chair())": 510,
    "EnumProp(Tool(1))": 502,
    "EnumAllProp()": 502,
    'FindTool("Chair")': 1502,
    "FindTool(Chair)": 509,
    "FindTool(3)": 509,
    "FindTool()": 502,
    'FindTool("")': 509,
    'ChangeTool("Chair")': 1502,
    'SetTool("UnDefTool")': 1503,
    'GetChangeToolAction("UnDefTool")': 1503,
    'GetChangeToolAction("Chair")': 1502,
    "AlignTool(0, 1, 0, 5)": 1502,
    "AlignTool(0, 0, 0, 5)": 1010,
    "AlignTool(0, 0, 1)": 502,
    "AlignTool(0, 0, 2, 30)": 502,
    "AlignTool(0, 0, 1, 0, 0, 2, 30, 30)": 502,
    "AlignTool(0, 0, 1, -5)": 1502,
    "AlignTool(0, 0, 1, X(1))": 509,
    "SetCoordSystem(MyCsy)": 505,
    "SetCoordSystem(JogMoveCsy)": 505,
    "SetCoordSystem()": 502,
    "SetCsyTransformation(PartCsy, 1, 2, 3)": 502,
    "SetCsyTransformation(PartCsy, 1, 2, 3, 200, 0, 0)": 1007,
    "SetCsyTransformation(PartCsy, 1e9, 2, 3, 0, 0, 0)": 509,
    "GetCsyTransformation(MachineCsy)": 505,
    "OnMoveReportE(Time(0.09))": 510,
    "OnMoveReportE(Dis(-3), X())": 510,
    "OnMoveReportE(Time(1), Dis(10), X(), Y(), Dis(8))": 502,
    "OnMoveReportE(Time(15), Time(3), Z())": 502,
    "OnMoveReportE(X(), X())": 502,
    "OnMoveReportE(Time(), X())": 509,
    "OnMoveReportE(X)": 502,
    "OnMoveReportE(Colour())": 505,
    "OnMoveReportE(X(1))": 502,
    "StopDaemon(E0001)": 513,
    "StopDaemon()": 502,
    "StopDaemon(05101)": 509,
    "StopDaemon(E0000)": 509,
    "StopAllDaemons()": 512,
    "EndSession(1)": 502,
}


@pytest.mark.parametrize("command", ERRORS)
def test_what_each_command_refuses(client: Memory, command: str) -> None:
    lines = client.ask(command)
    assert number(lines) == ERRORS[command]
    assert f'"{command.split("(")[0]}"' in lines[-1]
    failed = CODES[ERRORS[command]].severity >= 2
    assert client.ask("GetErrStatusE()") == [f"# ErrStatus({int(failed)})"]


@pytest.mark.parametrize("name", [name for name in COMMANDS if COMMANDS[name].at_once])
def test_a_command_that_is_executed_at_once_needs_the_tag_of_an_event(client: Memory, name: str) -> None:
    assert number(client.run(f"00090 {name}(Tool.Name())")) == 1
    assert client.ask("ClearAllErrors()") == []


@pytest.mark.parametrize("name", [name for name in COMMANDS if not COMMANDS[name].at_once and name != "EndSession"])
def test_any_other_command_needs_a_tag_of_its_own(client: Memory, name: str) -> None:
    assert number(client.run(f"E0090 {name}()")) == 1
    assert client.ask("ClearAllErrors()") == []


def test_an_abort_that_is_refused_stops_the_machine_all_the_same() -> None:
    client = Memory(make_state(speed=100.0))
    client.ask("StartSession()")
    client.state.cmm.homed = True
    lines = client.run("00101 GoTo(X(400))", "00102 AbortE()", wait_s=0.01)
    assert '00102 ! Error(2, 0001, "AbortE", "Illegal tag")' in lines
    assert client.state.cmm.position_mm[0] < 390.0


def test_the_documentation_lists_every_command_and_no_other() -> None:
    text = (Path(stepgauge.__file__).parents[1] / "docs" / "ippdme-server.md").read_text()
    table = text.partition("## Commands")[2].partition("## ")[0]
    assert set(re.findall(r"^\| `(\w+)\(", table, re.MULTILINE)) == set(COMMANDS)
    for name, signature in COMMANDS.items():
        words = str(signature.arguments).replace("|", "\\|")
        assert f"| `{name}({words})` |" in table, f"{name}({words})"


@pytest.mark.parametrize("name", sorted(ELSEWHERE))
def test_commands_of_the_standard_that_the_machine_has_not(client: Memory, name: str) -> None:
    assert number(client.ask(f"{name}()")) == 501


@pytest.mark.parametrize("kind", [kind for kind in NUMBERS if kind != "connection_lost"])
def test_events_of_the_machine_are_the_errors_of_the_standard(kind: str) -> None:
    client = Memory().start()
    client.state.cmm.faults = events({"kind": kind, "after_points": 0})
    assert number(client.ask(f"PtMeas({SURFACE})")) == NUMBERS[kind]
    assert client.ask("ClearAllErrors()") == []
    assert number(client.ask(f"PtMeas({SURFACE})")) == 1006, "an event happens once"


def test_what_the_machine_says_by_itself_aborts_what_runs_and_waits() -> None:
    client = Memory(make_state(speed=50.0)).start()
    time_s = client.state.cmm.clock.now_s + 1.0
    client.state.cmm.faults = events(
        {"kind": "key_press", "time_s": time_s}, {"kind": "limit_switch", "time_s": time_s, "unasked": True}
    )
    lines = client.run("00091 GoTo(X(300))", "00092 IsHomed()", wait_s=0.01)
    assert lines == [
        "00091 &",
        "00092 &",
        'E0000 # KeyPress("DONE")',
        'E0000 ! Error(3, 2500, "", "Machine limit encountered [Move Out Of Limits]")',
        '00091 ! Error(2, 0006, "GoTo", "Transaction aborted (Use ClearAllErrors To Continue)")',
        "00091 %",
        '00092 ! Error(2, 0006, "IsHomed", "Transaction aborted (Use ClearAllErrors To Continue)")',
        "00092 %",
    ]
    assert client.state.cmm.position_mm[0] < 100.0
    assert number(client.ask("IsHomed()")) == 514


def test_home_that_fails_is_an_error_of_home_and_the_machine_does_not_move() -> None:
    client = Memory()
    client.ask("StartSession()")
    assert client.ask("IsHomed()") == ["# IsHomed(0)"]
    assert number(client.ask("GoTo(X(1))")) == 1011
    client.ask("ClearAllErrors()")
    client.state.cmm.faults = events({"kind": "air_pressure", "time_s": 0.0})
    assert number(client.ask("Home()")) == 1005
    client.ask("ClearAllErrors()")
    assert client.ask("Home()") == []


def test_without_a_session_only_its_start_and_end_are_accepted() -> None:
    client = Memory()
    assert number(client.ask("GetDMEVersion()")) == 8
    assert client.ask("EndSession()") == []
    assert client.ask("StartSession()") == []
    assert client.ask("GetDMEVersion()") == ANSWERS["GetDMEVersion()"]


def test_end_and_start_of_session_lead_out_of_every_state(client: Memory) -> None:
    assert number(client.ask("Nonsense()")) == 507
    assert number(client.ask("IsHomed()")) == 514
    assert number(client.ask("AbortE()")) == 514
    assert client.ask("GetXtdErrStatus()") == ["# IsHomed(1)", "# IsUserEnabled(0)"]
    assert client.ask("EndSession()") == []
    assert client.ask("StartSession()") == []
    assert client.ask("IsHomed()") == ["# IsHomed(1)"]


def test_answers_come_in_the_order_of_the_commands(client: Memory) -> None:
    lines = client.run("00101 GoTo(X(10))", "00102 Get(X())", "00103 GetDMEVersion()")
    assert lines == [
        *("00101 &", "00102 &", "00103 &", "00101 %"),
        *("00102 # X(10.0000000)", "00102 %", '00103 # DMEVersion("1.4")', "00103 %"),
    ]


def test_a_fast_command_answers_at_once_and_completes_in_its_turn(client: Memory) -> None:
    lines = client.run("00101 GoTo(X(10))", "E0102 GetErrStatusE()", "00103 IsHomed()")
    assert (
        lines.index("E0102 # ErrStatus(0)") < lines.index("00101 %") < lines.index("E0102 %") < lines.index("00103 %")
    )


def test_an_error_aborts_what_waits_and_a_warning_does_not(client: Memory) -> None:
    lines = client.run("00101 SetProp(Tool.PtMeasPar.Speed(1000))", "00102 IsHomed()")
    assert lines[-2:] == ["00102 # IsHomed(1)", "00102 %"]
    lines = client.run("00103 GoTo(X(500))", "00104 GoTo(X(5))", "00105 IsHomed()")
    aborted = '! Error(2, 0006, "{}", "Transaction aborted (Use ClearAllErrors To Continue)")'
    assert lines[-4:] == [f"00104 {aborted.format('GoTo')}", "00104 %", f"00105 {aborted.format('IsHomed')}", "00105 %"]
    assert number(client.run("00106 IsHomed()")) == 514
    assert client.ask("GetErrStatusE()") == ["# ErrStatus(1)"]


def test_abort_stops_what_runs_and_waits_and_completes_last() -> None:
    client = Memory(make_state(speed=100.0))
    client.ask("StartSession()")
    client.state.cmm.homed = True
    lines = client.run("00101 GoTo(X(400))", "00102 GoTo(X(0))", "E0001 AbortE()", wait_s=0.01)
    completed = [line for line in lines if line.endswith("%")]
    assert completed == ["00101 %", "00102 %", "E0001 %"]
    assert sum("0006" in line for line in lines) == 2
    client.ask("ClearAllErrors()")
    assert client.ask("Get(X())") == ["# X(0.0000000)"]


def test_a_tag_that_is_in_use_is_illegal_until_its_command_is_complete(client: Memory) -> None:
    lines = client.run("00101 GoTo(X(10))", "00101 GoTo(X(20))")
    assert '! Error(2, 0001, "GoTo", "Illegal tag")' in "".join(lines)
    assert [line[:5] for line in lines if line.endswith("%")] == ["E0000", "00101"]
    client.ask("ClearAllErrors()")
    assert client.run("00101 IsHomed()")[-1] == "00101 %"


def test_tags_may_come_in_any_order(client: Memory) -> None:
    for tag in ("99999", "00001", "50000", "00002"):
        assert client.run(f"{tag} IsHomed()") == [f"{tag} &", f"{tag} # IsHomed(1)", f"{tag} %"]


def test_a_queue_that_is_full_is_said_and_nothing_is_lost(client: Memory) -> None:
    tags = [f"{n:05d}" for n in range(1, LONGEST_QUEUE + 11)]
    lines = client.run(*(f"{tag} IsHomed()" for tag in tags))
    assert sum("Buffer full" in line for line in lines) == 10
    assert sum(line.endswith("%") for line in lines) == len(tags)
    assert sum("IsHomed(1)" in line for line in lines) == LONGEST_QUEUE


def test_properties_are_limited_with_a_warning_and_kept_by_each_tool(client: Memory) -> None:
    assert number(client.ask("SetProp(Tool.PtMeasPar.Speed(1000), Tool.PtMeasPar.Search(7))")) == 504
    assert client.ask("GetProp(Tool.PtMeasPar.Speed(), Tool.PtMeasPar.Search())") == [
        "# Tool.PtMeasPar.Speed(12.000000), Tool.PtMeasPar.Search(7.000000)"
    ]
    client.ask('FindTool("RefTool")')
    assert client.ask("GetProp(FoundTool.PtMeasPar.Search())") == ["# FoundTool.PtMeasPar.Search(2.000000)"]
    client.ask("EndSession()")
    client.ask("StartSession()")
    assert client.ask("GetProp(Tool.PtMeasPar.Search())") == ["# Tool.PtMeasPar.Search(7.000000)"]


def test_a_property_that_is_wrong_leaves_the_others_of_the_command_as_they_were(client: Memory) -> None:
    assert number(client.ask("SetProp(Tool.PtMeasPar.Search(7), Tool.PtMeasPar.Colour(1))")) == 510
    client.ask("ClearAllErrors()")
    assert client.ask("GetProp(Tool.PtMeasPar.Search())") == ["# Tool.PtMeasPar.Search(2.000000)"]


def test_all_properties_are_listed_with_those_below(client: Memory) -> None:
    lines = client.ask("EnumAllProp(Tool())")
    assert {'# "PtMeasPar", "Property"', '# "PtMeasPar.Retract", "Number"', '# "Name", "String"'} <= set(lines)


def test_a_tool_that_cannot_measure_moves_all_the_same(client: Memory) -> None:
    client.ask('SetTool("NoTool")')
    assert client.ask("GoTo(X(10))") == []
    assert number(client.ask(f"PtMeas({SURFACE})")) == 2002


def test_coordinates_of_a_part(client: Memory) -> None:
    client.ask("SetCsyTransformation(PartCsy, 10, 20, 30, 0, 90, 0)")
    client.ask("SetCoordSystem(PartCsy)")
    client.ask("GoTo(X(60), Y(10), Z(130))")
    client.ask("SetCoordSystem(MachineCsy)")
    (machine,) = client.ask("Get(X(), Y(), Z())")
    assert machine == "# X(10.0000000), Y(50.0000000), Z(100.0000000)"
    client.ask("SetCoordSystem(PartCsy)")
    assert client.ask("Get(X(), Y(), Z())") == ["# X(60.0000000), Y(10.0000000), Z(130.0000000)"]


def test_a_face_is_measured_in_the_coordinates_of_a_part(client: Memory) -> None:
    """The same point, commanded and answered in two coordinate systems."""
    gauge = small_gauge()
    lies = lying(gauge)
    surface, normal, before = lies.to_machine(gauge, [0.0, 0.0, 0.0]), -lies.axis, [-20.0, 0.0, 0.0]
    start = lies.to_machine(gauge, before)
    client.ask(f"GoTo(X({start[0]:.6f}), Y({start[1]:.6f}))")
    client.ask(f"GoTo(Z({start[2]:.6f}))")
    client.ask("OnPtMeasReport(X(), Y(), Z(), IJK(), ER())")
    answers = []
    for csy in ("MachineCsy", "PartCsy"):
        client.ask("SetCsyTransformation(PartCsy, 10, 20, 30, 25, 90, -40)")
        client.ask(f"SetCoordSystem({csy})")
        of_part = client.state.coordinates
        place, out = of_part.to_part(surface), of_part.direction_to_part(normal)
        x, y, z = (f"{axis}({value:.7f})" for axis, value in zip("XYZ", place, strict=True))
        (line,) = client.ask(f"PtMeas({x}, {y}, {z}, IJK({out[0]:.9f}, {out[1]:.9f}, {out[2]:.9f}))")
        found = {name: call.arguments for name, call in named([line[2:]]).items()}
        answers.append(of_part.to_machine(np.array([found[axis][0] for axis in "XYZ"], float)))
        assert np.array(found["IJK"], float) == pytest.approx(out, abs=1e-8)
        assert found["ER"] == (2.0,)
    assert answers[0] == pytest.approx(answers[1], abs=1e-6)
    assert answers[0] == pytest.approx(surface + (2.0 - 0.003) * normal, abs=1e-6)


def test_without_a_normal_the_way_back_is_the_direction(client: Memory) -> None:
    gauge = small_gauge()
    lies = lying(gauge)
    start, surface = lies.to_machine(gauge, [-20.0, 0.0, 0.0]), lies.to_machine(gauge, [0.0, 0.0, 0.0])
    client.ask(f"GoTo(X({start[0]:.6f}), Y({start[1]:.6f}))")
    client.ask(f"GoTo(Z({start[2]:.6f}))")
    client.ask("SetProp(Tool.PtMeasPar.Retract(-1))")
    (line,) = client.ask(f"PtMeas(X({surface[0]:.7f}), Y({surface[1]:.7f}), Z({surface[2]:.7f}))")
    found = np.array([named([line[2:]])[axis].number() for axis in "XYZ"], float)
    assert found == pytest.approx(surface - (2.0 - 0.003) * lies.axis, abs=1e-6)
    (here,) = client.ask("Get(X(), Y(), Z())")
    back = np.array([named([here[2:]])[axis].number() for axis in "XYZ"], float)
    assert back == pytest.approx(surface - 5.0 * lies.axis, abs=1e-6), "a negative retract leads back to the approach"


def test_a_daemon_reports_with_its_own_tag_until_it_is_stopped() -> None:
    client = Memory(make_state(speed=100.0))
    client.ask("StartSession()")
    client.state.cmm.homed = True
    client.run("E0007 OnMoveReportE(Time(0.1), X(), Z())")
    assert number(client.run("E0008 OnMoveReportE()")) == 515
    client.run("00102 ClearAllErrors()")
    lines = client.run("00103 GoTo(X(400), Y(400), Z(0))", "00104 GoTo(X(0), Y(0), Z(300))", wait_s=0.01)
    reports = [line for line in lines if line.startswith("E0007 # X(")]
    assert 1 <= len(reports) <= 5
    client.run("00105 StopDaemon(E0007)")
    assert not any(line.startswith("E0007") for line in client.run("00106 GoTo(X(100))", wait_s=0.01))
    assert number(client.run("00107 StopDaemon(E0007)")) == 513


def test_the_end_of_the_session_ends_its_daemons(client: Memory) -> None:
    client.run("E0007 OnMoveReportE(X())")
    client.ask("EndSession()")
    client.ask("StartSession()")
    assert number(client.ask("StopAllDaemons()")) == 512


def test_every_motion_disables_the_user(client: Memory) -> None:
    client.ask("EnableUser()")
    assert client.ask("IsUserEnabled()") == ["# IsUserEnabled(1)"]
    client.ask("GoTo(X(10))")
    assert client.ask("IsUserEnabled()") == ["# IsUserEnabled(0)"]


def test_a_mistake_of_ours_is_an_error_of_the_standard(client: Memory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client.state.cmm, "leg", lambda *_: 1 / 0)
    assert number(client.ask("GoTo(X(10))")) == 511
