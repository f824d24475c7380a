"""The blocks of a page run as they are printed, those in shell and those in Python.

``stepgauge`` in a shell asks this process, so that Python starts once and not fifty times.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import traceback
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

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


@dataclass(frozen=True)
class Block:
    """A block of a page: its language, its text, and why it is not run (empty: it is)."""

    language: str
    text: str
    not_run: str = ""
    file: str = ""
    """The file that the reader writes with this text, or at whose end he writes it (``added``)."""
    added: bool = False


def pages() -> list[Path]:
    """The pages of the documentation that somebody wrote: not those that the site's build makes of the code."""
    docs = ROOT / "docs"
    made = ("_reference", "_gallery")
    return sorted(one for one in docs.rglob("*.md") if one.relative_to(docs).parts[0] not in made)


FILE = re.compile(r"(at the end of )?`([\w/-]+\.\w+)`:$")
"""How the line above a block ends that shows a file which the reader writes, or what he adds to one."""


def blocks_of(page: Path) -> list[Block]:
    """The blocks of a page in its order: commands, Python, and files that the reader writes.

    A remark ``<!-- not run: REASON -->`` above one says why it is not run.
    """
    text = page.read_text(encoding="utf-8")
    pattern = r"^ *(?:<!-- not run: (?P<why>[^>]+) -->\n *)?```(?P<language>\w+)\n(?P<text>.*?)^ *```$"
    blocks = []
    for found in re.finditer(pattern, text, re.S | re.M):
        told = FILE.search(text[: found.start()].rstrip())
        if found["language"] in ("sh", "python"):
            inner = re.sub(r"^   (?! {5})", "", found["text"], flags=re.M)
            blocks.append(Block(found["language"], inner, found["why"] or ""))
        elif told:
            blocks.append(Block("file", found["text"], file=told[2], added=bool(told[1])))
    return blocks


def write_file(block: Block) -> None:
    """Write the file of a block in the working folder, or add to it."""
    path = Path(block.file)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a" if block.added else "w", encoding="utf-8") as file:
        file.write("\n" * block.added + block.text)


def shell_blocks(page: Path) -> list[str]:
    """The shell blocks of a page that are run."""
    return [one.text for one in blocks_of(page) if one.language == "sh" and not one.not_run]


def run_page(page: Path, pipes: Path) -> None:
    """Run the blocks of a page in its order in the working folder; ``pipes``: an empty folder.

    Variables of Python live from block to block; the shell begins anew behind a block of Python.
    """
    known: dict[str, Any] = {}
    runs = groupby((one for one in blocks_of(page) if not one.not_run), key=lambda one: one.language)
    for number, (language, blocks) in enumerate(runs):
        if language == "file":
            for one in blocks:
                write_file(one)
            continue
        if language == "python":
            for one in blocks:
                exec(compile(one.text, str(page), "exec"), known)
            continue
        place = pipes / str(number)
        place.mkdir()
        done = run_blocks([one.text for one in blocks], place)
        assert done.returncode == 0, done.stderr


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
