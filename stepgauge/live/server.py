"""The virtual CMM on a TCP port: one client at a time, lines in and out, and a clean end.

The standard has one client and no queue. Whoever comes while another is there waits a moment, for that one may be about
to go; then it is told who is there, and let go.
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import queue
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.files.outputs import refuse_input
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.lines import END, NO_TAG, PORT, LineReader
from stepgauge.live.connection import Address
from stepgauge.live.machine_state import MachineState
from stepgauge.live.methods import HANDLERS
from stepgauge.live.session import LinkLostError, Session

LOOPBACK = "127.0.0.1"
STUCK_S = 30.0
"""A client that does not read for so long is cut off."""
CLIENT_IDLE_S = 1800.0
"""A client that sends no line for so long while the machine stands is let go."""
WAIT_S = 1.0
"""How long a client waits for the one before it to go."""
MOST_WAITING = 16
LINGER_S = 5.0
"""How long a client that is let go has to read why: what it sends meanwhile is dropped, for else it would be reset."""
OCCUPIED, IDLE = 8000, 8001
"""Errors of this server's own (the standard leaves 8000 to 8999 to servers)."""
KEEPALIVE = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}
"""Seconds, seconds and tries after which a peer that has vanished is known to be gone."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ServerAddress:
    """Where the server listens, and when it ends by itself.

    ``port``: 0 for a free one; ``idle_s``: it ends after so long without a client (None: never); ``client_idle_s``,
    ``stuck_s``: see :data:`CLIENT_IDLE_S` and :data:`STUCK_S`.
    """

    host: str = LOOPBACK
    port: int = PORT
    idle_s: float | None = None
    client_idle_s: float = CLIENT_IDLE_S
    stuck_s: float = STUCK_S


class _Link(asyncio.Protocol):
    """The connection of one client."""

    def __init__(self, server: Server) -> None:
        self.server, self.lines = server, LineReader()
        self.transport: asyncio.Transport | None = None
        self.session: Session | None = None
        self.work: asyncio.Task[None] | None = None
        self._stuck: asyncio.TimerHandle | None = None
        self._patience: asyncio.TimerHandle | None = None
        self._heard_s = 0.0
        self._out: list[bytes] = []

    @property
    def peer(self) -> str:
        """Where the client is."""
        host, port, *_ = (self.transport and self.transport.get_extra_info("peername")) or ("", 0)
        return f"{host}:{port}"

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come: it gets a session where none is open; else it waits for the one that is to end."""
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        _keep_alive(transport.get_extra_info("socket"))
        if self.server.link is None:
            self.admit()
            return
        transport.pause_reading()
        self.server.waiting.append(self)
        patience_s = WAIT_S if len(self.server.waiting) <= MOST_WAITING else 0.0
        self._patience = asyncio.get_running_loop().call_later(patience_s, self._give_up)

    def admit(self) -> None:
        """The machine is this client's from now on."""
        assert self.transport is not None
        self._stop_waiting()
        self.server.link = self
        self.session = Session(self.server.state, self._send, HANDLERS)
        loop = asyncio.get_running_loop()
        self._heard_s = loop.time()
        self.work = loop.create_task(self._work(self.session))
        self._patience = loop.call_later(self.server.listening.client_idle_s, self._look_for_life)
        self.server.client_came()
        self.transport.resume_reading()
        _log.info("client %s", self.peer)

    def _stop_waiting(self) -> None:
        if self in self.server.waiting:
            self.server.waiting.remove(self)
        if self._patience is not None:
            self._patience.cancel()

    def _give_up(self) -> None:
        """The client before is still there: this one is told so."""
        self._stop_waiting()
        _log.info("a second client was refused: %s", self.peer)
        there = self.server.link.peer if self.server.link is not None else "nobody"
        self._let_go(DmeError(OCCUPIED, "", 3, f"Another client is connected: {there}"))

    def _look_for_life(self) -> None:
        """A client that sends nothing while nothing moves is let go; else it is looked at again when its time is up."""
        assert self.session is not None
        loop, limit_s = asyncio.get_running_loop(), self.server.listening.client_idle_s
        if self.session.busy:
            self._heard_s = loop.time()
        left_s = self._heard_s + limit_s - loop.time()
        if left_s > 0.0:
            self._patience = loop.call_later(left_s, self._look_for_life)
            return
        _log.info("client %s was idle and is let go", self.peer)
        self._let_go(DmeError(IDLE, "", 3, f"Idle for {limit_s:g} s: the session is ended"))
        self._end_session()

    def _let_go(self, error: DmeError) -> None:
        """Tell why, and close once the client has read it."""
        assert self.transport is not None
        self._send(f"{NO_TAG} {error.line()}")
        self._write()
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self.transport.resume_reading()
        self._patience = asyncio.get_running_loop().call_later(LINGER_S, self.transport.abort)

    async def _work(self, session: Session) -> None:
        try:
            await session.work()
        except LinkLostError:
            assert self.transport is not None
            _log.info("the connection is dropped, as the faults say")
            self.transport.abort()

    def data_received(self, data: bytes) -> None:
        """Bytes of the client; every whole line goes to its session."""
        if self.session is None:
            return
        for line, cut in self.lines.feed(data):
            self._heard_s = asyncio.get_running_loop().time()
            if _log.isEnabledFor(logging.DEBUG):
                _log.debug("< %s", line.decode("latin-1"))
            self.session.receive(line, cut)

    def _send(self, line: str) -> None:
        """Lines of one moment go out together, for a packet costs more than a command."""
        if _log.isEnabledFor(logging.DEBUG):
            _log.debug("> %s", line)
        loop = asyncio.get_running_loop()
        self._heard_s = loop.time()  # a person at the machine is life, too
        if not self._out:
            loop.call_soon(loop.call_soon, self._write)  # after the command that this moment brought
        self._out.append(line.encode("ascii") + END)

    def _write(self) -> None:
        data, self._out = b"".join(self._out), []
        if data and self.transport is not None and not self.transport.is_closing():
            self.transport.write(data)

    def pause_writing(self) -> None:
        """The client does not read: no further command is taken, and after a while it is cut off."""
        assert self.transport is not None
        self.transport.pause_reading()
        self._stuck = asyncio.get_running_loop().call_later(self.server.listening.stuck_s, self.transport.abort)

    def resume_writing(self) -> None:
        assert self.transport is not None
        if self._stuck is not None:
            self._stuck.cancel()
        self.transport.resume_reading()

    def connection_lost(self, error: Exception | None) -> None:
        """The client has gone: its session ends."""
        if self._stuck is not None:
            self._stuck.cancel()
        self._stop_waiting()
        _log.info("client gone%s", f": {error}" if error else "")
        self._end_session()

    def _end_session(self) -> None:
        """The machine is free for the next client, who may be waiting."""
        if self.session is None:
            return
        self.session.close()
        if self.work is not None:
            self.work.cancel()
        self.session = self.work = self.server.link = None
        self.server.client_left()
        if self.server.waiting:
            self.server.waiting[0].admit()


def _keep_alive(connection: socket.socket) -> None:
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for name, value in KEEPALIVE.items():
        if hasattr(socket, name):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


class Server:
    """A virtual CMM that listens; :meth:`run` until it is told to end."""

    def __init__(self, state: MachineState, listening: ServerAddress | None = None) -> None:
        self.state, self.listening = state, listening or ServerAddress()
        self.link: _Link | None = None
        self.waiting: list[_Link] = []
        self._end: asyncio.Event | None = None
        self._idle: asyncio.TimerHandle | None = None

    async def run(self, ready: Callable[[str, int], Any], signals: bool = True) -> None:
        """Serve until SIGINT, SIGTERM, :meth:`stop`, or the idle time; ``ready`` is told the address and the port."""
        loop = asyncio.get_running_loop()
        self._end = asyncio.Event()
        listener = await loop.create_server(
            lambda: _Link(self), self.listening.host, self.listening.port, reuse_address=True
        )
        if signals:
            for number in (signal.SIGINT, signal.SIGTERM):
                with suppress(NotImplementedError):  # Windows: an interrupt ends the loop
                    loop.add_signal_handler(number, self._end.set)
        host, port = listener.sockets[0].getsockname()[:2]
        self.client_left()
        ready(host, port)
        try:
            await self._end.wait()
        finally:
            listener.close()
            await self._close_link()

    @contextmanager
    def serving_in_thread(self) -> Iterator[int]:
        """Serve in a thread of this process for as long as the block lasts; yields the port."""
        found: queue.Queue[tuple[asyncio.AbstractEventLoop, int] | BaseException] = queue.Queue()

        def serve() -> None:
            try:
                asyncio.run(self.run(lambda _, port: found.put((asyncio.get_running_loop(), port)), signals=False))
            except BaseException as error:  # whoever waits for the port is told
                found.put(error)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        ready = found.get()
        if isinstance(ready, BaseException):
            raise ready
        loop, port = ready
        try:
            yield port
        finally:
            loop.call_soon_threadsafe(self.stop)
            thread.join()

    def stop(self) -> None:
        """End from within the loop."""
        if self._end is not None:
            self._end.set()

    async def _close_link(self) -> None:
        """What was written is sent, the machine stops."""
        for one in self.waiting[:]:
            one._give_up()
        link = self.link
        if link is None or link.transport is None:
            return
        link._write()
        link.transport.close()
        if link.work is not None:
            link.work.cancel()
            with suppress(asyncio.CancelledError):
                await link.work

    def client_came(self) -> None:
        """No end while a client is there."""
        if self._idle is not None:
            self._idle.cancel()

    def client_left(self) -> None:
        """From now on the time without a client counts."""
        if self.listening.idle_s is not None:
            self._idle = asyncio.get_running_loop().call_later(self.listening.idle_s, self.stop)


def run_server(state: MachineState, listening: ServerAddress, tell: Callable[[str], None]) -> None:
    """Serve until it is told to end; ``tell`` hears where it listens, and that it ended.

    :class:`InputError` for an address at which nobody can listen.
    """

    def ready(host: str, port: int) -> None:
        if not ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            tell(f"warning: whoever can reach {host} can drive this machine; I++ DME knows no passwords")
        tell(f"{state.cmm.machine.table.name} listens at {Address(host, port)}")

    try:
        asyncio.run(Server(state, listening).run(ready))
    except OSError as error:
        where, expected = f"{listening.host}:{listening.port}", naming("port", words="another {}")
        raise InputError(where, "cannot listen here", found=error.strerror or error, expected=expected) from None
    tell("ended")


def log_to(path: str | Path) -> None:
    """Write down every line of both sides."""
    refuse_input(path)
    try:
        handler = logging.FileHandler(path, encoding="ascii", errors="backslashreplace")
    except OSError as error:
        raise InputError(path, f"cannot write here: {error.strerror or error}") from None
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    logger = logging.getLogger("stepgauge.live")
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)
