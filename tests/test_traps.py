"""A project from somebody else: nothing in it is run, whatever its files are called."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from stepgauge.executors.processes import Processes
from stepgauge.executors.run import run
from stepgauge.files.children import ROOT, python_environment, python_line, safe_children

NAMES = (
    "click", "numpy", "scipy", "pandas", "matplotlib", "jinja2", "typst", "sitecustomize", "usercustomize", "stepgauge",
    "json", "socket", "typing", "signal", "multiprocessing", "pydantic", "threadpoolctl", "uvicorn", "starlette",
)  # fmt: skip


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder whose modules leave a mark when they are run, as the working folder."""
    folder = tmp_path / "project"
    folder.mkdir()
    trap = f"open({str(tmp_path / 'sprung')!r}, 'a').write(__name__ + ' ')\n"
    for name in NAMES:
        (folder / f"{name}.py").write_text(trap)
    (folder / ".env").write_text(f"PYTHONPATH={folder}\n")
    (folder / "matplotlibrc").write_text("backend: module://click\n")
    (folder / "pyvenv.cfg").write_text(f"home = {folder}\n")
    monkeypatch.chdir(folder)
    return folder


def sprung(project: Path) -> str:
    mark = project.parent / "sprung"
    return mark.read_text() if mark.exists() else ""


@pytest.mark.parametrize("stated", [None, "", ".", ":/nowhere", "/nowhere:", "PROJECT"])
def test_a_verb_that_the_page_starts_takes_no_module_of_the_project(
    project: Path, monkeypatch: pytest.MonkeyPatch, stated: str | None
) -> None:
    """With every ``PYTHONPATH`` that means the working folder, as an empty entry does."""
    if stated is None:
        monkeypatch.delenv("PYTHONPATH", raising=False)
    else:
        monkeypatch.setenv("PYTHONPATH", stated.replace("PROJECT", str(project)))
    line = python_line("stepgauge", "evaluate", "nothing.csv", "-g", "step-gauge-420", "-o", "result")
    done = subprocess.run(line, env=python_environment(), capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, sprung(project)) == (2, ""), done.stderr
    assert "nothing.csv: no such file" in done.stderr


def test_the_worker_that_measures_takes_none(project: Path) -> None:
    line = python_line("stepgauge.web.worker")
    done = subprocess.run(
        line, env=python_environment(), input="{}\n", capture_output=True, text=True, timeout=120, check=False
    )
    assert sprung(project) == ""
    assert "this is not what a measurement was asked for" in done.stdout + done.stderr


def test_the_command_itself_takes_none_but_what_python_does_before_it(project: Path) -> None:
    """``python -m`` puts the working folder first: it is left before anything of ours is imported."""
    for name in ("stepgauge", "typing"):  # Python imports these before the first line of ours
        (project / f"{name}.py").unlink()
    environment = {**os.environ, "PYTHONPATH": f":{ROOT}"}
    line = [sys.executable, "-m", "stepgauge", "--version"]
    environment.pop("PYTHONSAFEPATH", None)
    before = (project / "sitecustomize.py", project / "usercustomize.py")
    for path in before:
        path.unlink()
    done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, sprung(project)) == (0, ""), done.stderr


def loaded(item: int) -> tuple[int, str]:
    """What a worker has for ``json``, and an answer."""
    import json

    return item + 1, str(json.__file__)


def test_the_processes_of_a_pool_take_none(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{os.pathsep}{ROOT}")
    found = [one.value for one in run(loaded, [("a", 1), ("b", 2)], Processes(2))]
    assert [number for number, _ in found] == [2, 3]
    assert sprung(project) == ""
    assert not any(path.startswith(str(project)) for _, path in found)
    assert os.environ["PYTHONPATH"] == f"{os.pathsep}{ROOT}", "the caller's environment is as it was"


def test_a_library_that_starts_python_inside_does_so_safely(project: Path) -> None:
    with safe_children():
        subprocess.run([sys.executable, "-c", "import json, socket, typing"], timeout=60, check=True)
    assert sprung(project) == ""


def test_a_figure_is_not_drawn_as_a_file_of_the_project_says(project: Path) -> None:
    line = python_line("stepgauge", "list", "files")
    subprocess.run(line, env=python_environment(), capture_output=True, timeout=120, check=True)
    code = "from matplotlib.figure import Figure; Figure().savefig('x.svg')"
    subprocess.run([sys.executable, "-P", "-c", code], env=python_environment(), timeout=120, check=True)
    assert sprung(project) == ""
