"""The server on a socket: clients that are two, slow, dead, cut off or mad."""

from __future__ import annotations

import contextlib
import random
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from stepgauge.ippdme.codes import CODES
from tests.build import heed_interrupts
from tests.live.made import Raw, events, lying, make_state, serving, small_gauge, small_machine, tag_of, write_files

RANDOM_LINES = 3000
"""Of the 1e5 that benchmarks/live.py sends."""


def test_a_session_over_a_socket() -> None:
    with serving() as port:
        client = Raw(port)
        assert client.ask("StartSession()") == []
        assert client.ask("GetDMEVersion()") == ['# DMEVersion("1.4")']
        assert client.ask("EndSession()") == []
        client.close()


def test_a_second_client_is_told_who_is_there_and_a_later_one_is_served() -> None:
    with serving() as port:
        first = Raw(port)
        first.ask("StartSession()")
        second = Raw(port, timeout_s=5.0)
        second.send("00001 StartSession()")
        told, there = second.line(), first.socket.getsockname()[1]
        assert told == f'E0000 ! Error(3, 8000, "", "Another client is connected: 127.0.0.1:{there}")'
        assert second.line() == "", "the end, and no reset"
        second.close()
        assert first.ask("IsHomed()") == ["# IsHomed(0)"]
        first.close()
        later = Raw(port)
        assert later.ask("StartSession()") == []
        later.close()


def test_a_client_that_comes_at_once_after_another_is_served() -> None:
    """Within microseconds: the server may not know yet that the one before is gone."""
    with serving() as port:
        for number in range(60):
            client = Raw(port)
            client.tag = number
            assert client.ask("StartSession()") == []
            assert client.ask("GetDMEVersion()") == ['# DMEVersion("1.4")']
            if number % 3 == 0:
                client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
            if number % 2:
                client.send("00999 GetDMEVersion()")
            client.close()


def test_clients_that_wait_are_served_in_their_turn() -> None:
    with serving() as port:
        first, second = Raw(port), Raw(port)
        first.ask("StartSession()")
        second.send("00001 StartSession()")
        first.close()
        assert second.until("00001 %") == ["00001 &", "00001 %"]
        second.close()


def test_more_clients_than_may_wait_are_all_told() -> None:
    with serving() as port:
        first = Raw(port)
        first.ask("StartSession()")
        others = [Raw(port, timeout_s=5.0) for _ in range(40)]
        assert all("8000" in other.line() for other in others)
        for other in others:
            other.close()
        assert first.ask("IsHomed()") == ["# IsHomed(0)"]
        first.close()


def test_an_idle_client_is_let_go_and_told_why() -> None:
    """What is no line is no life; a command that takes longer than that is."""
    state = make_state(speed=50.0)
    with serving(state, client_idle_s=0.4) as port:
        client = Raw(port)
        client.ask("StartSession()")
        client.ask("Home()")
        assert client.ask("GoTo(X(400), Y(400))") == []  # 11 s by the machine's clock
        client.send(b"00099 Half a line")
        assert client.line() == 'E0000 ! Error(3, 8001, "", "Idle for 0.4 s: the session is ended")'
        later = Raw(port)
        assert later.ask("StartSession()") == []
        assert client.line() == "", "the end, and no reset"
        client.close()
        later.close()


def test_a_client_that_says_nothing_at_all_is_let_go() -> None:
    with serving(client_idle_s=0.2) as port:
        client = Raw(port)
        assert "8001" in client.line()
        client.close()


def test_commands_that_arrive_in_pieces_and_together() -> None:
    with serving() as port:
        client = Raw(port)
        for byte in b"00001 StartSession()\r\n":
            client.send(bytes([byte]))
        client.until("00001 %")
        client.send(b"00002 IsHomed()\r\n00003 GetDMEVersion()\r\n00004 IsHo")
        client.until("00003 %")
        client.send(b"med()\r\n")
        assert client.until("00004 %")[1] == "00004 # IsHomed(0)"
        client.close()


def test_a_client_that_dies_in_a_move_stops_the_machine() -> None:
    state = make_state(speed=1.0)
    with serving(state) as port:
        client = Raw(port)
        client.ask("StartSession()")
        client.ask("Home()")
        client.send("00099 GoTo(X(400))")
        client.until("00099 &")
        time.sleep(0.3)
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
        client.close()
        later = Raw(port)
        later.ask("StartSession()")
        before = later.ask("Get(X())")
        assert before == later.ask("Get(X())")
        assert 0.0 < float(before[0][4:-1]) < 200.0
        later.close()


def test_a_client_that_does_not_read_is_cut_off_and_the_next_one_is_served() -> None:
    with serving(stuck_s=0.5) as port:
        client = socket.create_connection(("127.0.0.1", port), 5.0)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.settimeout(0.3)
        with contextlib.suppress(OSError):
            for number in range(200_000):
                client.sendall(b"%05d GetErrorInfo(0006)\r\n" % (number % 99999 + 1))
        later = Raw(port)
        assert later.ask("StartSession()") == []
        later.close()
        with contextlib.suppress(ConnectionResetError):
            client.settimeout(5.0)
            while client.recv(1 << 16):  # what was on its way; then the end, and no wait for more
                pass
        client.close()


def test_a_connection_that_the_faults_drop() -> None:
    with serving(make_state(faults=events({"kind": "connection_lost", "after_points": 0}))) as port:
        client = Raw(port)
        client.ask("StartSession()")
        client.send("00099 Home()")
        told = []
        with contextlib.suppress(ConnectionResetError):
            while line := client.line():
                told.append(line)
        assert "00099 %" not in told
        client.close()
        later = Raw(port)
        assert later.ask("StartSession()") == []
        later.close()


STANDARD = re.compile(r'(?:[0-9]{5}|E[0-9]{4}) (?:&|%|# .*|! Error\(([0-9]), ([0-9]{4}), "[^"]*", "([^"]*)"\))')


def mad_lines(count: int, seed: int) -> list[bytes]:
    """Random bytes, and commands with random characters put in, taken out or exchanged."""
    rng = random.Random(seed)
    good = [
        *(b"StartSession()", b"EndSession()", b"Home()", b"ClearAllErrors()", b"AbortE()", b"StopAllDaemons()"),
        *(b"GoTo(X(1), Y(2), Z(250))", b"PtMeas(X(300), Y(50), Z(50), IJK(0, 0, 1))", b"Get(X(), Y())"),
        *(b"SetProp(Tool.PtMeasPar.Speed(2))", b"EnumAllProp(Tool())", b"OnMoveReportE(Time(1), X())"),
        *(b'SetTool("RefTool")', b"AlignTool(0, 0, 1, 5)", b"SetCsyTransformation(PartCsy, 1, 2, 3, 4, 5, 6)"),
    ]
    lines = []
    for number in range(count):
        if rng.random() < 0.3:
            lines.append(rng.randbytes(rng.randrange(60)).replace(b"\n", b"?"))
            continue
        command = rng.choice(good).decode()
        line = bytearray(f"{tag_of(command, number % 9998 + 1)} {command}".encode())
        for _ in range(rng.choice([0, 0, 1, 3])):
            at = rng.randrange(len(line))
            line[at : at + rng.randrange(2)] = bytes([rng.randrange(32, 127)]) * rng.randrange(3)
        lines.append(bytes(line))
    return lines


def check_mad(port: int, lines: list[bytes]) -> int:
    """Send lines, each as an own command; every answer is one of the standard. How many errors there were."""
    client = Raw(port)
    errors = 0
    for number, line in enumerate(lines):
        client.send(line + b"\r\n")
        if number % 50 == 49 or number == len(lines) - 1:
            client.send("E9999 GetErrStatusE()")
            answer = ""
            while not answer.endswith("E9999 %"):
                answer = client.line()
                match = STANDARD.fullmatch(answer)
                assert match, answer
                if match[2]:
                    errors += 1
                    assert CODES[int(match[2])].text == match[3]
                    assert CODES[int(match[2])].severity == int(match[1])
    client.close()
    return errors


def test_random_bytes_are_answered_as_the_standard_has_it() -> None:
    with serving(make_state(seed=1)) as port:
        assert check_mad(port, mad_lines(RANDOM_LINES, seed=20)) > RANDOM_LINES / 4
        client = Raw(port)
        client.ask("StartSession()")
        assert client.ask("GetDMEVersion()") == ['# DMEVersion("1.4")']
        client.close()


def test_a_line_without_an_end_is_no_burden() -> None:
    with serving() as port:
        client = Raw(port)
        for _ in range(100):
            client.send(b"0" * 65536)
        client.send(b"\r\n")
        assert "Illegal tag" in client.line()
        client.close()


def test_memory_does_not_grow_with_the_commands() -> None:
    with serving() as port:
        client = Raw(port)
        client.ask("StartSession()")
        client.ask("Home()")

        def many(count: int) -> int:
            for _ in range(count):
                client.ask("GetProp(Tool.PtMeasPar.Speed())")
                client.ask("GoTo(X(10))")
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

        first = many(1000)
        assert many(3000) - first < 2048, "kB"
        client.close()


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    gauge = small_gauge()
    return write_files(tmp_path, small_machine(), gauge, lying(gauge))


def serve(files: dict[str, str], *more: str) -> tuple[subprocess.Popen[str], str]:
    """The verb in a process of its own, and the line that says where it listens."""
    command = [sys.executable, "-m", "stepgauge", "serve", *(word for pair in files.items() for word in pair)]
    process = subprocess.Popen(
        [*command, "--port", "0", "--idle", "60", *more],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts,
    )
    assert process.stderr is not None
    lines = [process.stderr.readline()]
    while "listens at" not in lines[-1]:
        assert lines[-1], lines
        lines.append(process.stderr.readline())
    return process, "".join(lines)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_verb_ends_cleanly_when_it_is_told_to(
    files: dict[str, str], tmp_path: Path, number: signal.Signals
) -> None:
    process, said = serve(files, "--log", str(tmp_path / "server.log"), "--speed", "10")
    port = int(said.strip().rpartition(":")[2])
    client = Raw(port)
    client.ask("StartSession()")
    client.send("00099 Home()")
    client.until("00099 &")
    process.send_signal(number)
    _, rest = process.communicate(timeout=10.0)
    assert process.returncode == 0
    assert rest.startswith("ended\n")
    log = (tmp_path / "server.log").read_text()
    assert "< 00001 StartSession()" in log
    assert "> 00001 %" in log
    client.close()


def test_the_verb_ends_by_itself_and_warns_where_others_can_reach_it(files: dict[str, str]) -> None:
    process, said = serve(files, "--idle", "0.2", "--host", "0.0.0.0")
    assert "warning: whoever can reach 0.0.0.0" in said
    _, rest = process.communicate(timeout=10.0)
    assert (process.returncode, rest.splitlines()[0]) == (0, "ended")


def test_a_port_that_is_taken_is_said_in_one_line(files: dict[str, str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        words = [word for pair in files.items() for word in pair]
        command = [sys.executable, "-m", "stepgauge", "serve", *words, "--port", port]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert re.fullmatch(r"stepgauge: error: 127.0.0.1:\d+: cannot listen here; found .*\n", done.stderr)
