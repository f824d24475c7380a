#!/usr/bin/python3
"""What LinuxCNC starts as its display: switch the simulated machine on, run program.ngc, write outcome.json, end.

With STEPGAUGE_IDLE the program is not run: the machine is left to another process until there is a file ``end``.

Runs under the system's Python, which has the ``linuxcnc`` module; so it imports nothing of stepgauge. The time limits
in seconds and the moves to make beforehand come from the environment.
"""

import json
import os
import sys
import time
from pathlib import Path

import linuxcnc

ERRORS = (linuxcnc.OPERATOR_ERROR, linuxcnc.NML_ERROR)
SETTLED_POLLS = 10


class StoppedError(Exception):
    """The controller reported an error, or the time is over."""


class Driver:
    """A connection to the running controller, with a deadline: first for coming up, then for the run."""

    def __init__(self):
        self.status, self.command, self.channel = linuxcnc.stat(), linuxcnc.command(), linuxcnc.error_channel()
        self.limit(os.environ["STEPGAUGE_START_S"], "the controller did not come up")

    def limit(self, seconds, late):
        """From now on; ``late`` is the complaint once they are over."""
        self.deadline, self.late = time.monotonic() + float(seconds), late

    def check(self):
        """Raise what the controller has to complain about."""
        if time.monotonic() > self.deadline:
            raise StoppedError(self.late)
        message = self.channel.poll()
        while message:
            if message[0] in ERRORS:
                raise StoppedError(message[1].strip())
            message = self.channel.poll()
        self.status.poll()

    def wait(self, condition):
        """Poll until the condition holds several times in a row; a single one may be from before a command."""
        held = 0
        while held < SETTLED_POLLS:
            self.check()
            held = held + 1 if condition(self.status) else 0
            time.sleep(0.02)

    def idle(self):
        """Wait until the controller has nothing more to do."""
        self.wait(lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos and s.exec_state == linuxcnc.EXEC_DONE)

    def switch_on(self):
        """Out of the emergency stop, powered and homed where it stands."""
        self.command.state(linuxcnc.STATE_ESTOP_RESET)
        self.command.wait_complete()
        self.command.state(linuxcnc.STATE_ON)
        self.command.wait_complete()
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete()
        self.command.home(-1)
        self.wait(lambda s: all(s.homed[:3]))

    def go(self, blocks):
        """Single blocks, one after the other."""
        self.command.mode(linuxcnc.MODE_MDI)
        self.command.wait_complete()
        for block in blocks:
            self.command.mdi(block)
            self.idle()

    def run(self, program):
        """A program from its first line to its end."""
        self.command.mode(linuxcnc.MODE_AUTO)
        self.command.wait_complete()
        self.command.program_open(program)
        self.command.wait_complete()
        self.check()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.idle()

    def serve(self, folder):
        """Leave the machine to another process until that says that it is done; its messages are for that one."""
        (folder / "ready").touch()
        while not (folder / "end").exists() and time.monotonic() < self.deadline:
            time.sleep(0.1)

    def switch_off(self):
        """Stop whatever moves."""
        self.command.abort()
        self.command.wait_complete()
        self.command.state(linuxcnc.STATE_OFF)
        self.command.wait_complete()


def main():
    """Run the program; exit code 1 when the controller complained."""
    folder = Path.cwd()
    (folder / "driver.pid").write_text(str(os.getpid()))
    driver = Driver()
    error, began = None, time.monotonic()
    try:
        driver.switch_on()
        driver.go(json.loads(os.environ["STEPGAUGE_BEFORE"]))
        began = time.monotonic()
        driver.limit(os.environ["STEPGAUGE_LIMIT_S"], "the time limit of this run is over")
        if "STEPGAUGE_IDLE" in os.environ:
            driver.serve(folder)
        else:
            driver.run(str(folder / "program.ngc"))
    except (StoppedError, linuxcnc.error) as reason:
        error = str(reason)
        print(error, file=sys.stderr)
    outcome = {"error": error, "line": driver.status.motion_line, "seconds": round(time.monotonic() - began, 2)}
    driver.switch_off()
    (folder / "outcome.json").write_text(json.dumps(outcome))
    return 1 if error else 0


if __name__ == "__main__":
    sys.exit(main())
