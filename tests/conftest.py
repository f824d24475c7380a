"""Fixtures, the profile of the property tests, and how the suite is spread over processes."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from functools import wraps
from pathlib import Path
from typing import Any

import matplotlib.figure
import pytest
from hypothesis import HealthCheck, Phase, settings
from matplotlib.backends.backend_agg import FigureCanvasAgg

from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import Machine, read_machine

# On CI the examples are the same in every run, and a failing one is shown as it was found: to make it small can take
# five minutes. On a developer's machine they are new in every run.
ON_CI = "CI" in os.environ
settings.register_profile(
    "stepgauge",
    max_examples=30,
    deadline=None,
    derandomize=ON_CI,
    phases=[phase for phase in Phase if not (ON_CI and phase in (Phase.shrink, Phase.explain))],
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("stepgauge")

ROOT = Path(__file__).resolve().parent.parent
ON_FIGURES = ("figure", "plot", "test_readme")
"""Words in the names of tests and modules whose figures are laid out and saved as a user gets them."""


OF_ONE_DIAGNOSIS = (
    "tests/cli/test_diagnose.py",
    "tests/diagnosis/test_files.py",
    "tests/diagnosis/test_figures.py",
    "tests/diagnosis/test_odd_recordings.py",
    "tests/test_interactive.py",
    "tests/test_story.py",
)
"""Modules that share tests/diagnosis/made.py."""


@pytest.fixture(autouse=True)
def plain_figures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a figure is not what is tested, everything in it is drawn, but the search of its layout is left out.

    It takes half of the time of a figure, and a figure most of the time of many a verb.
    """
    if any(word in request.node.nodeid.lower() for word in ON_FIGURES):
        return
    save, draw_png = matplotlib.figure.Figure.savefig, FigureCanvasAgg.print_png

    def plainly(figure: matplotlib.figure.Figure, *arguments: Any, **more: Any) -> None:
        figure.set_layout_engine("none")
        save(figure, *arguments, **{"dpi": 150, **more})

    @wraps(draw_png)
    def plain_png(canvas: FigureCanvasAgg, *arguments: Any, **more: Any) -> None:
        canvas.figure.set_layout_engine("none")
        canvas.figure.dpi = 150
        draw_png(canvas, *arguments, **more)

    monkeypatch.setattr(matplotlib.figure.Figure, "savefig", plainly)
    monkeypatch.setattr(FigureCanvasAgg, "print_png", plain_png)


@pytest.fixture
def gauge() -> Gauge:
    """The shipped 420 mm gauge."""
    return read_gauge("step-gauge-420")


@pytest.fixture
def machine() -> Machine:
    """The shipped bridge CMM."""
    return read_machine("bridge-cmm")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """The whole suite runs in a process for each core, and one for the controller; named tests run in one."""
    if not config.pluginmanager.hasplugin("xdist") or "PYTEST_XDIST_WORKER" in os.environ:
        return
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not config.getoption("usepdb")
    if whole and config.option.numprocesses is None:
        config.option.numprocesses = min(os.cpu_count() or 1, 8) + 1
        for library in ("OPENBLAS", "OMP", "MKL"):  # every core has its process: further threads only wait for one
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    if whole and sys.dont_write_bytecode:
        share_compiled_files()
    config.option.loadscopereorder = False  # the order is that of the next function


def share_compiled_files() -> None:
    """Where Python may write no compiled files beside the sources, they have a folder of their own for this run.

    Otherwise each of a hundred processes would compile the package anew, for a second and more.
    """
    folder = tempfile.mkdtemp(prefix="stepgauge-compiled-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = folder


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The controller first: its tests run one after another, and wait for most of their time."""
    items.sort(key=lambda item: item.get_closest_marker("linuxcnc") is None)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """A module goes to one process, so that its fixtures are made once.

    So do all tests on the controller, and the modules that look at the same few diagnoses.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByModule(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            module = nodeid.split("::")[0]
            if module.startswith("tests/integration/"):
                return "controller"
            return "made" if module in OF_ONE_DIAGNOSIS else module

    return ByModule(config, log)
