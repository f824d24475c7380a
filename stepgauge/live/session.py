"""One client's session: the queue of its commands, the order of the answers, errors, aborts and daemons.

Nothing here knows of sockets: lines come in by :meth:`Session.receive` and go out by ``send``. Commands are accepted at
once and executed one after another by :meth:`Session.work`; those whose name ends in E do not wait for their turn.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.commands import COMMANDS, check_command
from stepgauge.ippdme.lines import NO_TAG, Command, parse_command
from stepgauge.ippdme.values import Call
from stepgauge.live.cmm import TimedMove
from stepgauge.live.daemons import Daemon
from stepgauge.live.faults import NUMBERS, EventTable
from stepgauge.live.machine_state import MachineState

Data = Sequence[str] | None
Handler = Callable[["Session", Call], Data | Awaitable[Data]]
IN_ERROR = ("ClearAllErrors", "GetErrStatusE", "GetXtdErrStatus", "EndSession")
"""All that is accepted while errors are not cleared; EndSession and StartSession always lead out."""
WITHOUT_SESSION = ("StartSession", "EndSession")
LONGEST_QUEUE = 1000
"""Commands that may wait; more are refused with error 0000."""
KEY = "DONE"
"""The key that a person presses on the virtual CMM."""
SLICE_S = 0.05
"""Real time between two looks at the daemons during a move."""
_log = logging.getLogger(__name__)


class LinkLostError(Exception):
    """The virtual CMM drops the connection, as its faults say."""


@dataclass
class _Waiting:
    """A command that was accepted; its lines are held back until those before it are complete."""

    command: Command
    lines: list[str] = field(default_factory=list)
    done: bool = False
    fast: bool = False


class Session:
    """A connection of a client, from its first line to the last.

    ``state``: the machine, which outlives its clients; ``send``: takes a line without its end; ``handlers``: what each
    command does.
    """

    def __init__(self, state: MachineState, send: Callable[[str], None], handlers: dict[str, Handler]) -> None:
        self.state, self.send, self.handlers = state, send, handlers
        self.cmm, self.clock = state.cmm, state.cmm.clock
        self.open = self.failed = False
        self.daemons: dict[str, Daemon] = {}
        self._order: deque[_Waiting] = deque()
        self._tags: set[str] = set()
        self._wake, self._stopped = asyncio.Event(), asyncio.Event()
        self._running: _Waiting | None = None

    @property
    def busy(self) -> bool:
        """Whether a command is being executed, or waits."""
        return bool(self._order)

    def receive(self, line: bytes, cut: bool = False) -> None:
        """Take a line of the client."""
        command = parse_command(line, cut)
        if command.tag == NO_TAG or command.tag in self._tags or command.tag in self.daemons:
            self._refuse(command.call.name)
            return
        self.send(f"{command.tag} &")
        if len(self._order) >= LONGEST_QUEUE:
            self._fail_at_once(command.tag, DmeError(0, command.call.name))
            return
        self._accept(command)

    def _refuse(self, method: str) -> None:
        """A line without a tag, or with one that is in use: everything that waits is aborted."""
        self._fail_at_once(NO_TAG, DmeError(1, method))
        self._abort_waiting()

    def _fail_at_once(self, tag: str, error: DmeError) -> None:
        self.send(f"{tag} {error.line()}")
        self.send(f"{tag} %")

    def _accept(self, command: Command) -> None:
        name = command.call.name
        fast = name in COMMANDS and COMMANDS[name].at_once and command.error is None
        waiting = _Waiting(command, fast=fast)
        self._order.append(waiting)
        self._tags.add(command.tag)
        if fast:
            self._execute_fast(waiting)
        else:
            self._wake.set()

    def _execute_fast(self, waiting: _Waiting) -> None:
        """Data of these commands go out at once, their completion in its turn."""
        tag = waiting.command.tag
        try:
            self._check(waiting.command)
            data = self.handlers[waiting.command.call.name](self, waiting.command.call)
            assert not isinstance(data, Awaitable)
            for one in data or ():
                self.send(f"{tag} # {one}")
        except DmeError as error:
            self._fail(waiting, error)
        waiting.done = True
        self._flush()

    async def work(self) -> None:
        """Execute commands in their order, for ever; ends by cancelling, or where the link is dropped."""
        while True:
            waiting = next((one for one in self._order if not one.done), None)
            if waiting is None:
                self._wake.clear()
                await self._rest()
                continue
            self._running = waiting
            self._stopped.clear()
            await self._execute(waiting)
            self._running = None
            waiting.done = True
            self._flush()
            self._say_own(moving=False)
            await asyncio.sleep(0)

    async def _rest(self) -> None:
        """Until there is something to do; what happens by itself meanwhile is said."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._wake.wait(), self._own_after_s(moving=False))
        self._say_own(moving=False)

    def _own_after_s(self, moving: bool) -> float | None:
        """Real time until something happens by itself, s; None: not as long as the clock stands, or nothing is left."""
        time_s = self.cmm.faults.next_own_s(moving, self.state.user_enabled)
        if time_s is None or self.clock.speed is None or not self.open:
            return None
        return self.clock.real_s_until(time_s)

    def _say_own(self, moving: bool) -> None:
        """What happened by itself, with the tag of what no command asked for; an error aborts what runs and waits."""
        while self.open and (event := self._own(moving)):
            if event.kind in NUMBERS:
                self.send(f"{NO_TAG} {DmeError(NUMBERS[event.kind]).line()}")
                self._abort_waiting()
            elif event.kind == "key_press":
                self.send(f'{NO_TAG} # KeyPress("{KEY}")')
            elif event.kind == "moved_by_hand":
                self.cmm.move_by_hand()
                self.send(f"{NO_TAG} # GoTo({self._written(self.cmm.position_mm)})")
            elif (found := self.cmm.measure_by_hand(np.array(event.from_mm), np.array(event.to_mm))) is not None:
                self.send(f"{NO_TAG} # PtMeas({self._written(found)})")

    def _own(self, moving: bool) -> EventTable | None:
        cmm = self.cmm
        return cmm.faults.take_own(cmm.completed, self.clock.now_s, moving, self.state.user_enabled)

    def _written(self, place_mm: Array) -> str:
        return ", ".join(self.state.quantity(axis, place_mm) for axis in "XYZ")

    async def _execute(self, waiting: _Waiting) -> None:
        command = waiting.command
        try:
            self._check(command)
            found = self.handlers[command.call.name](self, command.call)
            data = await found if isinstance(found, Awaitable) else found
            for one in data or ():
                self._say(waiting, f"# {one}")
        except DmeError as error:
            self._fail(waiting, error)
        except LinkLostError:
            raise
        except Exception:  # a mistake of ours is no reason to leave the client without an answer
            _log.exception("in %s", command.call.name)
            self._fail(waiting, DmeError(511, command.call.name))

    def _check(self, command: Command) -> None:
        """What is accepted now (:class:`DmeError` 0008, 0514, what is wrong with the line, what the table refuses)."""
        name = command.call.name
        if self.failed and name not in IN_ERROR and not (name == "StartSession" and not self.open):
            raise DmeError(514, name)
        if command.error is not None:
            raise command.error
        if not self.open and name in COMMANDS and name not in WITHOUT_SESSION:
            raise DmeError(8, name)
        check_command(command.call, command.tag)

    def report(self, data: str) -> None:
        """A line of data of the command that is being executed, before it is complete."""
        assert self._running is not None
        self._say(self._running, f"# {data}")

    def warn(self, error: DmeError) -> None:
        """An error that does not end the command that is being executed."""
        if self._running is not None:
            self._say(self._running, error.line())

    def _say(self, waiting: _Waiting, text: str) -> None:
        waiting.lines.append(f"{waiting.command.tag} {text}")
        self._flush()

    def _fail(self, waiting: _Waiting, error: DmeError) -> None:
        if not error.method:
            error.method = waiting.command.call.name
        self._say(waiting, error.line())
        if error.aborts and error.number != 6:
            self._abort_waiting(waiting)

    def _abort_waiting(self, failed: _Waiting | None = None) -> None:
        """Everything that waits gets error 0006; from now on errors must be cleared."""
        self.failed = True
        for one in self._order:
            if not (one is failed or one is self._running or one.done):
                one.lines.append(f"{one.command.tag} {DmeError(6, one.command.call.name).line()}")
                one.done = True
        if self._running is not None and self._running is not failed:
            self._stopped.set()
        self._flush()

    def start_daemon(self, daemon: Daemon) -> None:
        """The daemon of the command that is being accepted; it answers with that command's tag."""
        self.daemons[self._order[-1].command.tag] = daemon

    def abort(self) -> None:
        """AbortE: motion stops at once, what runs and waits is aborted."""
        me = next((one for one in reversed(self._order) if one.fast and not one.done), None)
        self._abort_waiting(me)

    def _flush(self) -> None:
        """Send what is at the head of the order."""
        while self._order:
            head = self._order[0]
            for line in head.lines:
                self.send(line)
            head.lines.clear()
            if not head.done:
                return
            self._order.popleft()
            self._tags.discard(head.command.tag)
            self.send(f"{head.command.tag} %")

    async def travel(self, leg: TimedMove) -> None:
        """Make a move: wait until it is done, tell the daemons, and raise the error that ended it."""
        if leg.end_s > leg.begin_s:
            try:
                await self._wait(leg)
            except (DmeError, asyncio.CancelledError):
                self.cmm.halt(leg)
                raise
        self.cmm.arrive(leg)
        self._tell_daemons(leg)
        if leg.lost:
            raise LinkLostError
        if leg.error is not None:
            raise leg.error

    async def _wait(self, leg: TimedMove) -> None:
        while (left_s := self.clock.real_s_until(leg.end_s)) > 0.0 and not self._stopped.is_set():
            self._tell_daemons(leg)
            slice_s, own_s = SLICE_S if self.daemons else left_s, self._own_after_s(moving=True)
            with suppress(TimeoutError):
                await asyncio.wait_for(self._stopped.wait(), min(left_s, slice_s, left_s if own_s is None else own_s))
            self._say_own(moving=True)
        if self._stopped.is_set():
            raise DmeError(6)

    def _tell_daemons(self, leg: TimedMove) -> None:
        for tag, daemon in self.daemons.items():
            text = daemon.report(self.state, leg.at(self.clock.now_s))
            if text is not None:
                self.send(f"{tag} # {text}")

    def close(self) -> None:
        """The client is gone or has ended its session: daemons end, the machine stands still."""
        self.open = False
        self.daemons.clear()
