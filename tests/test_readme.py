"""The commands of the README run in its order in a copy of the clone, and every file in them is there by then.

The shell runs them as they are printed; its ``stepgauge`` asks this process, so that Python starts once and not fifty
times.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import traceback
from pathlib import Path

import pytest

from stepgauge.cli import main
from tests.conftest import ROOT

SHELL = """
set -eu
exec 3<>"$PIPES/answer"
stepgauge() {
    printf '%s\\0' "${STEPGAUGE_GAUGE-}" "${STEPGAUGE_MACHINE-}" "$@" > "$PIPES/args"
    printf 'go\\n' > "$PIPES/ask"
    read -r code <&3
    [ "$code" = 0 ] || { echo "stepgauge $*: exit code $code" >&2; exit 1; }
}
python() { "$PYTHON" "$@"; }
"""


def blocks() -> list[str]:
    """The shell blocks of the README but for those that install."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.findall(r"^ *```sh\n(.*?)^ *```$", text, re.S | re.M)
    return [re.sub(r"^   (?! {5})", "", one, flags=re.M) for one in found if "pip install" not in one]


def answer(pipes: Path) -> None:
    """Run what the shell asks for; ``quit`` ends it."""
    while True:
        with (pipes / "ask").open() as asked:
            word = asked.readline().strip()
        if word == "quit":
            return
        if word != "go":  # opened again before the shell had closed what it said last: an empty line
            continue
        gauge, machine, *words = (pipes / "args").read_text().split("\0")[:-1]
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


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with what the clone has and the commands read."""
    for name in ("examples", "calibration_data", "templates", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    for name in ("STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"):
        monkeypatch.setenv(name, "")
    return tmp_path


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell with named pipes")
def test_the_commands_run_in_order(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    pipes = tmp_path_factory.mktemp("pipes")
    for name in ("ask", "answer"):
        os.mkfifo(pipes / name)
    script = SHELL + "\n".join(blocks())
    assert script.count("stepgauge ") > 40
    variables = {**os.environ, "PIPES": str(pipes), "PYTHON": sys.executable, "PYTHONPATH": str(ROOT)}
    result: list[subprocess.CompletedProcess[str]] = []

    def shell() -> None:
        result.append(
            subprocess.run(["bash", "-c", script], env=variables, capture_output=True, text=True, check=False)
        )
        with (pipes / "ask").open("w") as told:
            told.write("quit\n")

    running = threading.Thread(target=shell, daemon=True)
    running.start()
    answer(pipes)
    running.join()
    assert result[0].returncode == 0, result[0].stderr
    for made in ("report.pdf", "certificate.pdf", "certificate.xml", "iso10360/iso10360.pdf", "history/history.json"):
        assert (clone / made).stat().st_size > 0
    for folder, name in (("iso10360-5", "iso10360-5"), ("iso230", "iso230"), ("iso230-3", "iso230-3")):
        assert (clone / folder / f"{name}.pdf").stat().st_size > 0


def test_links_and_figures_of_the_documents_exist() -> None:
    """Every file that a document links to is in the repository."""
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "examples").glob("*/README.md")):
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name}: {target}"
