"""A client's line to an I++ DME server: one command after the other, each awaited until it is complete."""

from __future__ import annotations

import contextlib
import datetime
import re
import select
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from stepgauge.errors import InputError, naming
from stepgauge.ippdme.codes import ABORTING, DmeError
from stepgauge.ippdme.lines import END, NO_TAG, PORT, LineReader, Response, parse_answer, parse_error

CONNECT_S = 10.0
SILENCE_S = 30.0
"""A server that says nothing for longer than the command may take and this besides is gone."""
LOOK_S = 0.1
"""How often it is looked whether the person wants to stop."""
ABORT_TAG = "E0001"
LEADING_OUT = ("ClearAllErrors()", "EndSession()")
"""Commands that are sent in spite of what the machine said by itself."""
BY_HAND = {"GoTo": "The machine was moved by hand", "PtMeas": "A point was measured by hand"}
BY_HAND_NUMBER = 9001
"""Clients have 9000 to 9999 for errors of their own."""


class ConnectionLostError(Exception):
    """The server is gone or silent; the message says which."""


class FalseAnswerError(Exception):
    """An answer that cannot be: no line, value or number of I++ DME, or no reading of what was asked for."""

    def __init__(self, what: str, found: str, expected: str) -> None:
        self.what, self.found, self.expected = what, found, expected
        super().__init__(f"{what}; found {found}, expected {expected}")


class UnaskedError(DmeError):
    """What the machine said by itself, whatever was being asked for: nothing may be sent after it but its end."""


class StopAskedError(Exception):
    """The person wants to stop; the machine stands still, and its errors are not cleared."""


@dataclass(frozen=True)
class Address:
    """Where a server listens."""

    host: str
    port: int = PORT

    @classmethod
    def parse(cls, text: str) -> Address:
        """``HOST:PORT``, ``[IPv6]:PORT``, or the host alone (:class:`InputError` for anything else)."""
        match = re.fullmatch(r"(?:\[([0-9A-Fa-f:.]+)\]|([^\s:\[\]]+))(?::(\d{1,5}))?", text, re.ASCII)
        port = PORT if match is None or match[3] is None else int(match[3])
        if match is None or not 0 < port < 65536:
            expected = "HOST:PORT, e.g. 127.0.0.1:1294"
            raise InputError(naming("server"), "no address", found=repr(text), expected=expected)
        return cls(match[1] or match[2], port)

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


class SessionLog:
    """Writes down every line of both sides with the time of day, in the form that ``stepgauge import`` reads."""

    def __init__(self, path: str | Path, comments: dict[str, str]) -> None:
        try:
            self._file: TextIO = Path(path).open("a", encoding="ascii", errors="replace", newline="")  # noqa: SIM115
        except OSError as error:
            raise InputError(path, f"cannot write here: {error.strerror or error}") from None
        self._file.writelines(f"# {key}: {value}\r\n" for key, value in comments.items())

    def note(self, line: str) -> None:
        """One line, as it was sent or received."""
        self._file.write(f"{datetime.datetime.now():%Y-%m-%d %H:%M:%S.%f} {line}\r\n")
        self._file.flush()

    def close(self) -> None:
        """No more lines."""
        self._file.close()


class Connection:
    """An open connection. ``stop``: asked again and again whether to stop; ``warnings``: errors of severity 0 and 1.

    ``by_hand``: points that a person measured, as the server wrote them; None where nobody is to measure.

    :class:`InputError` where there is no server.
    """

    def __init__(
        self,
        address: Address,
        spy: SessionLog | None = None,
        stop: Callable[[], bool] | None = None,
        silence_s: float = SILENCE_S,
    ) -> None:
        self.address, self.silence_s = address, silence_s
        self.warnings: list[DmeError] = []
        self.heeds_stop = True
        self.by_hand: list[str] | None = None
        self._spy, self._stop = spy, stop or (lambda: False)
        self._lines, self._tag = LineReader(), 0
        self._open, self._known, self._aborted = set[str](), False, False
        self._received: list[Response] = []
        self._unasked: UnaskedError | None = None
        try:
            self._socket = socket.create_connection((address.host, address.port), CONNECT_S)
        except OSError as error:
            found = error.strerror or str(error)
            raise InputError(str(address), "no I++ DME server answers here", found=found) from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(LOOK_S)

    def close(self) -> None:
        """Hang up."""
        with contextlib.suppress(OSError):
            self._socket.close()

    def ask(self, command: str, takes_s: float = 0.0) -> list[str]:
        """Send a command and wait until it is complete; the texts of its data.

        Parameters
        ----------
        command : the method with its arguments
        takes_s : how long it may take besides :data:`SILENCE_S`

        Raises
        ------
        DmeError
            the server's error, of severity 2 or more
        UnaskedError
            the machine said by itself, now or since the command before, that it cannot go on, or that a person moved it
        ConnectionLostError
            no answer
        FalseAnswerError
            a line that is no answer of I++ DME, or that answers no command that was sent
        StopAskedError
            the person wants to stop: the command was aborted
        """
        if self.heeds_stop and self._stop():
            raise StopAskedError
        with self._heeding(command):
            self._tag = self._tag % 99999 + 1
            tag = f"{self._tag:05d}"
            self._send(tag, command)
            return self._complete(tag, takes_s)

    @contextlib.contextmanager
    def _heeding(self, command: str) -> Iterator[None]:
        """Before and after a command: what the machine said by itself is why it failed, or must not be sent."""
        try:
            self._look()
            self._heed(command)
            yield
        except (DmeError, ConnectionLostError, FalseAnswerError) as error:
            self._heed("" if isinstance(error, ConnectionLostError) else command)
            raise
        self._heed(command)

    def _heed(self, command: str) -> None:
        if self._unasked is not None and command not in LEADING_OUT:
            raise self._unasked from None

    def _complete(self, tag: str, takes_s: float) -> list[str]:
        """The data of a command, once it is complete: ``&``, then data and errors, then ``%``."""
        data, failed, accepted = list[str](), None, False
        while (answer := self._next(tag, takes_s)).kind != "%" or not accepted:
            if answer.kind == "#" and accepted:
                data.append(answer.text)
            elif answer.kind == "!":
                failed, accepted = failed or self._error(answer.text), True
            elif answer.kind == "&" and not accepted:
                accepted = True
            else:
                found = f"{tag} {answer.kind} {answer.text}"[:60]
                raise FalseAnswerError("an answer out of its order", repr(found), "&, then # or !, then %")
        if failed is None:
            return data
        raise failed

    def _error(self, text: str) -> DmeError | None:
        """An error that ends a command; a warning is kept."""
        error = parse_error(text)
        if error.aborts:
            return error
        self.warnings.append(error)
        return None

    def _next(self, tag: str, takes_s: float) -> Response:
        """The next line for a tag; what else comes is looked at by the way."""
        until = time.monotonic() + takes_s + self.silence_s
        while True:
            while self._received:
                answer = self._taken()
                if answer.tag == tag:
                    return answer
                self._other(answer)
            if self._unasked is not None and self._unasked.number == BY_HAND_NUMBER and tag != ABORT_TAG:
                self.abort()
            if self.heeds_stop and self._stop():
                self.abort()
                raise StopAskedError
            if time.monotonic() > until:
                raise ConnectionLostError(f"the server was silent for {takes_s + self.silence_s:.0f} s")
            self._receive()

    def _look(self) -> None:
        """What has come since the last command: events may come at any time."""
        if select.select([self._socket], [], [], 0.0)[0]:
            self._receive()
        while self._received:
            self._other(self._taken())

    def _taken(self) -> Response:
        """The next line that has come; the last one of a command closes it."""
        answer = self._received.pop(0)
        self._known = answer.tag in self._open or self._aborted
        if answer.kind == "%":
            self._open.discard(answer.tag)
        return answer

    def _other(self, answer: Response) -> None:
        """Events and reports: of errors and movements by hand the first is kept; keys that are pressed are none.

        Every other line must answer a command that is open, which it is where another one was aborted meanwhile.
        """
        if answer.tag != NO_TAG and not self._known:
            found, expected = repr(" ".join(answer)[:60]), f"an answer to command {self._tag:05d}"
            raise FalseAnswerError("the server answers a command that was not sent", found, expected)
        if answer.tag != NO_TAG or self._unasked is not None:
            return
        method = answer.text.partition("(")[0]
        if answer.kind == "!" and (error := self._error(answer.text)) is not None:
            self._unasked = UnaskedError(error.number, error.method, error.severity, error.text)
        elif answer.kind == "#" and method in BY_HAND and self.by_hand is not None:
            self.by_hand += [answer.text] if method == "PtMeas" else []
        elif answer.kind == "#" and method in BY_HAND:
            self._unasked = UnaskedError(BY_HAND_NUMBER, method, ABORTING, BY_HAND[method])

    def wait_by_hand(self, count: int) -> None:
        """Until a person has measured so many points; errors as of :meth:`ask`."""
        while len(self.by_hand or ()) < count:
            if self.heeds_stop and self._stop():
                raise StopAskedError
            self._receive()
            self._look()
            self._heed("")

    def _receive(self) -> None:
        """Lines that have come, after :data:`LOOK_S` at the latest."""
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            return
        except OSError as error:
            raise ConnectionLostError(f"the connection broke: {error.strerror or error}") from None
        if not data:
            raise ConnectionLostError("the server closed the connection")
        for line, cut in self._lines.feed(data):
            self._note(line.decode("latin-1"))
            answer = None if cut else parse_answer(line)
            if answer is not None:
                self._received.append(answer)
            elif not self._aborted:
                found = repr(line[:60].decode("latin-1"))
                raise FalseAnswerError("this is no answer of I++ DME", found, "a tag, a blank, and one of & # ! %")

    def abort(self) -> None:
        """Motion stops at once; complete when the command that runs is. From now on ``stop`` is not asked any more.

        What answers nothing that was asked is not heeded any more, either: it may be what led here.

        :class:`UnaskedError` where the machine says by itself that it may not be moved after that.
        """
        self.heeds_stop, self._aborted = False, True
        self._send(ABORT_TAG, "AbortE()")
        with contextlib.suppress(DmeError):
            self._complete(ABORT_TAG, 0.0)
        self._heed("AbortE()")

    def forget_events(self) -> None:
        """What the machine has said by itself up to now was of another session, or is known."""
        self._look()
        self._unasked = None

    def forget_errors(self) -> None:
        """ClearAllErrors, and what was reported without being asked for."""
        self.forget_events()
        self.ask("ClearAllErrors()")

    def ask_if_known(self, command: str) -> list[str] | None:
        """The data of a command; None where the server does not take it, whose error is then cleared."""
        try:
            return self.ask(command)
        except UnaskedError:
            raise
        except DmeError:
            self.ask("ClearAllErrors()")
            return None

    def _send(self, tag: str, command: str) -> None:
        line = f"{tag} {command}"
        self._note(line)
        self._open.add(tag)
        try:
            self._socket.settimeout(CONNECT_S)
            self._socket.sendall(line.encode("ascii") + END)
            self._socket.settimeout(LOOK_S)
        except OSError as error:
            raise ConnectionLostError(f"the connection broke: {error.strerror or error}") from None

    def _note(self, line: str) -> None:
        if self._spy is not None:
            self._spy.note(line)
