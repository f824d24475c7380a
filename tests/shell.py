"""The shell commands of a page run as they are printed; their ``stepgauge`` asks this process, so that Python starts
once and not fifty times.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import traceback
from pathlib import Path

from stepgauge.cli import main
from tests.conftest import ROOT

SHELL = """
set -eu
exec 3<>"$PIPES/answer"
stepgauge() {
    printf '%s\\0' "$PWD" "${STEPGAUGE_GAUGE-}" "${STEPGAUGE_MACHINE-}" "$@" > "$PIPES/args"
    printf 'go\\n' > "$PIPES/ask"
    read -r code <&3
    [ "$code" = 0 ] || { echo "stepgauge $*: exit code $code" >&2; exit 1; }
}
python() { "$PYTHON" "$@"; }
"""


def shell_blocks(page: Path) -> list[str]:
    """The shell blocks of a page but for those that install."""
    found = re.findall(r"^ *```sh\n(.*?)^ *```$", page.read_text(encoding="utf-8"), re.S | re.M)
    return [re.sub(r"^   (?! {5})", "", one, flags=re.M) for one in found if "pip install" not in one]


def run_blocks(blocks: list[str], pipes: Path) -> subprocess.CompletedProcess[str]:
    """Run the blocks one after the other in the working folder; ``pipes``: an empty folder."""
    for name in ("ask", "answer"):
        os.mkfifo(pipes / name)
    script = SHELL + "\n".join(blocks)
    variables = {**os.environ, "PIPES": str(pipes), "PYTHON": sys.executable, "PYTHONPATH": str(ROOT)}
    result: list[subprocess.CompletedProcess[str]] = []

    def shell() -> None:
        result.append(
            subprocess.run(["bash", "-c", script], env=variables, capture_output=True, text=True, check=False)
        )
        with (pipes / "ask").open("w") as told:
            told.write("quit\n")

    running = threading.Thread(target=shell, daemon=True)
    here = Path.cwd()
    running.start()
    try:
        _answer(pipes)
    finally:
        os.chdir(here)
    running.join()
    return result[0]


def _answer(pipes: Path) -> None:
    """Run what the shell asks for; ``quit`` ends it."""
    while True:
        with (pipes / "ask").open() as asked:
            word = asked.readline().strip()
        if word == "quit":
            return
        if word != "go":  # opened again before the shell had closed what it said last: an empty line
            continue
        folder, gauge, machine, *words = (pipes / "args").read_text().split("\0")[:-1]
        os.chdir(folder)
        for name, value in (("STEPGAUGE_GAUGE", gauge), ("STEPGAUGE_MACHINE", machine)):
            os.environ.pop(name, None) if not value else os.environ.update({name: value})
        code = 0
        try:
            main(words)
        except SystemExit as end:
            code = int(end.code or 0)
        except BaseException:
            traceback.print_exc()  # the shell must not wait for ever
            code = 1
        with (pipes / "answer").open("w") as told:
            told.write(f"{code}\n")
