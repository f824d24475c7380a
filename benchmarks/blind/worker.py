"""Runs a diagnosis tool over public folders, many in one process so that the start-up is paid once.

    python worker.py TOOL TIMEOUT_S < folders

It is told the tool, and on standard input one line ``PUBLIC_FOLDER<tab>OUT_FOLDER`` per case; it answers every line
with one line of JSON: folder, seconds, error. Of truths it knows nothing. The tool is a command template with
``{recordings}``, ``{gauge}``, ``{machine}`` and ``{out}``; ``stepgauge ...`` and ``SCRIPT.py ...`` (with a
``main(argv)``) run inside this process, anything else as a process of its own.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType

Run = Callable[[list[str]], None]


class OutOfTimeError(Exception):
    """The tool took longer than a case may take."""


def make_run(program: str) -> Run:
    """A function that runs the tool with given arguments."""
    if program == "stepgauge":
        return _stepgauge
    if program.endswith(".py"):
        return _script(Path(program))
    return lambda arguments: _process([program, *arguments])


def _stepgauge(arguments: list[str]) -> None:
    from stepgauge.cli import main  # only where this tool is asked for

    main(arguments)


def _script(path: Path) -> Run:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise SystemExit(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    run: Run = module.main
    return run


def _process(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")


def fill(template: list[str], public: Path, out: Path) -> list[str]:
    """The arguments for one case."""
    filled: list[str] = []
    for part in template:
        if part == "{recordings}":
            filled += [str(path) for path in sorted(public.glob("recording*.csv"))]
        else:
            filled.append(part.format(gauge=public / "gauge.toml", machine=public / "machine.toml", out=out))
    return filled


def run_case(run: Run, template: list[str], public: Path, out: Path, timeout_s: int) -> dict[str, object]:
    """Run the tool on one case; an exception is an answer too."""
    began, error, said = time.perf_counter(), "", io.StringIO()
    signal.alarm(timeout_s)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            run(fill(template, public, out))
    except SystemExit as stop:
        error = f"exit code {stop.code}: {said.getvalue().strip()[-300:]}" if stop.code else ""
    except Exception as problem:
        error = f"{type(problem).__name__}: {problem}"[:300]
    finally:
        signal.alarm(0)
    return {"folder": str(public), "seconds": time.perf_counter() - began, "error": error}


def _out_of_time(number: int, frame: FrameType | None) -> None:
    raise OutOfTimeError("too slow")


def main() -> None:
    program, *template = shlex.split(sys.argv[1])
    signal.signal(signal.SIGALRM, _out_of_time)
    answers = os.fdopen(os.dup(1), "w")
    run = make_run(program)
    for line in sys.stdin:
        public, out = (Path(part) for part in line.rstrip("\n").split("\t"))
        print(json.dumps(run_case(run, template, public, out, int(sys.argv[2]))), file=answers, flush=True)


if __name__ == "__main__":
    main()
