"""Projects with traps: modules of every name that Python could look for, in a project from somebody else.

    python -m benchmarks.attack.traps

For each way in which stepgauge starts Python, and each ``PYTHONPATH`` that means the working folder, a folder with a
module of every name of the standard library and of every installed package: none of them may be run.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from importlib.metadata import packages_distributions
from pathlib import Path

from stepgauge.files.children import python_environment, python_line, safe_children

PATHS = ("", ".", ":/nowhere", "/nowhere:", "HERE")
"""Values of ``PYTHONPATH`` that mean the working folder."""
POOL = (
    "import sys; from stepgauge.executors.processes import Processes; from stepgauge.executors.run import run\n"
    "print([one.value for one in run(abs, [('a', -1)], Processes(1))])"
)


def set_traps(folder: Path, mark: Path) -> int:
    """A module of every name, that leaves its name in ``mark``; how many."""
    names = {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize"}
    names = {name for name in names if name.isidentifier() and name != "stepgauge"} | {"stepgauge"}
    for name in names:
        (folder / f"{name}.py").write_text(f"open({str(mark)!r}, 'a').write(__name__ + ' ')\n")
    for name, text in ((".env", f"PYTHONPATH={folder}\n"), ("matplotlibrc", "backend: module://click\n")):
        (folder / name).write_text(text)
    return len(names)


def ways() -> dict[str, list[str]]:
    """How stepgauge starts Python."""
    return {
        "a verb of the page": python_line("stepgauge", "evaluate", "none.csv", "-g", "step-gauge-420", "-o", "x"),
        "the worker that measures": python_line("stepgauge.web.worker"),
        "work within a budget": python_line("stepgauge.files.resource_limits"),
        "a pool of processes": [sys.executable, "-P", "-c", POOL],
    }


def attack(folder: Path) -> list[str]:
    """What was run of the traps, a line for each way."""
    found, mark = [], folder.parent / "sprung"
    set_traps(folder, mark)
    before, here = dict(os.environ), Path.cwd()
    os.chdir(folder)
    try:
        for stated in PATHS:
            os.environ["PYTHONPATH"] = stated.replace("HERE", str(folder))
            with safe_children():
                for name, line in ways().items():
                    subprocess.run(line, env=python_environment(), input=b"{}\n", capture_output=True, check=False)
                    if mark.exists():
                        found.append(f"{name}, PYTHONPATH={stated!r}: {mark.read_text()}")
                        mark.unlink()
    finally:
        os.chdir(here)
        os.environ.clear()
        os.environ.update(before)
    return found


def main() -> int:
    """Print what was run; the exit code is how often."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "project"
        folder.mkdir()
        found = attack(folder)
    for line in found:
        print(line)
    print(f"{len(ways()) * len(PATHS)} starts, {len(found)} with a module of the project")
    return len(found)


if __name__ == "__main__":
    sys.exit(main())
