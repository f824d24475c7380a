"""The documentation site: it builds without warnings, and what its pages show is run."""

from __future__ import annotations

import importlib
import importlib.util
import os
import pkgutil
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import pytest

import stepgauge as sg
from docs import reference
from stepgauge.axis.recording import OWN
from stepgauge.effects import Effect, effect_kinds
from stepgauge.files.config import TomlTable
from stepgauge.recording.columns import KNOWN
from stepgauge.verbs.catalogue import VERBS
from tests.conftest import ROOT
from tests.shell import Block, blocks_of, pages, run_blocks, run_page, shell_blocks

PAGES = [page for page in pages() if any(not one.file for one in blocks_of(page))]
RUN = [page for page in PAGES if not all(one.not_run or one.file for one in blocks_of(page))]
RUN_ELSEWHERE = {
    "inference.md": "inference/test_standalone.py",
    "adding-an-effect.md": "test_adding_an_effect.py",
    "guide.md": "test_readme.py",
    "import.md": "importing/test_import_recording.py",
    "python.md": "test_python_api.py",
    "reports.md": "test_documentation.py",
}
"""Pages whose blocks need more than the project of the tutorial, and the tests that run them."""
NOT_RUN = [(page, one) for page in (ROOT / "README.md", *PAGES) for one in blocks_of(page) if one.not_run]
needs_posix = pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell with named pipes")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def tutorial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project that the commands of the tutorial make in an empty folder."""
    place = tmp_path_factory.mktemp("tutorial")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for name in ("STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"):
            patch.setenv(name, "")
        run_page(ROOT / "docs/tutorial.md", tmp_path_factory.mktemp("pipes"))
    return place / "my-machine"


@needs_posix
def test_the_tutorial_runs_in_an_empty_folder(tutorial: Path) -> None:
    made = tutorial / "results"
    assert (made / "report.pdf").stat().st_size > 10_000
    assert '"verdict": "adequate"' in (made / "diagnosis/diagnosis.json").read_text()


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell with named pipes")
def test_the_page_on_reports_runs_in_the_folder_of_a_measurement(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STEPGAUGE_GAUGE", "step-gauge-420")
    monkeypatch.setenv("STEPGAUGE_MACHINE", "bridge-cmm")
    before = (
        f"stepgauge locate {ROOT}/examples/demo/points.csv -o placement.toml\n"
        "stepgauge plan placement.toml --dialect dmis --cycles 3 --blocks 1:8 -o gauge.dmi\n"
        "stepgauge simulate gauge.dmi -p placement.toml --gauge-temperature 20.4 -o recording.csv\n"
    )
    page = ROOT / "docs/reports.md"
    done = run_blocks([before, *shell_blocks(page)], tmp_path_factory.mktemp("pipes"))
    assert done.returncode == 0, done.stderr
    made = ("report.pdf", "diagnosis.pdf", "explore.html", "explore-diagnosis.html", "overlay.pdf", "overlay.png")
    assert all((tmp_path / name).stat().st_size > 10_000 for name in made)
    matplotlib.use("Agg")
    python = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    exec(compile("\n".join(python), str(page), "exec"), {"sg": sg, "gauge": sg.read_gauge("step-gauge-420")})
    assert (tmp_path / "overlay.html").stat().st_size > 10_000


@needs_posix
@pytest.mark.parametrize("page", [one for one in RUN if one.name not in (*RUN_ELSEWHERE, "tutorial.md")], ids=name_of)
def test_a_page_runs_in_the_project_of_the_tutorial(
    page: Path, tutorial: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each page in a copy of its own, in its order."""
    place = tmp_path_factory.mktemp("page") / "my-machine"
    shutil.copytree(tutorial, place)
    shutil.copytree(ROOT / "docs/recipes/data", place / "data")
    matplotlib.use("Agg")
    monkeypatch.chdir(place)
    for name in ("STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"):
        monkeypatch.setenv(name, "")
    run_page(page, tmp_path_factory.mktemp("pipes"))
    for name, words in SHOWN.get(page.name, {}).items():
        assert re.search(words, (place / name).read_text(encoding="utf-8")), name


SHOWN = {
    "find-cause.md": {"results/why/diagnosis.json": '"kind": "periodic_scale_error"'},
    "table.md": {"results/drift/diagnosis.json": '"kind": "thermal_drift"'},
    "probe-map.md": {"results/probe/diagnosis.json": '"verdict": "adequate"'},
    "axis.md": {"results/iso230/iso230.json": "The parameters conform"},
    "compensate.md": {
        "results/before/evaluation.json": r'"band_um": [78]\.\d',
        "results/after/evaluation.json": r'"band_um": 0\.\d',
    },
    "small-machines.md": {
        "why/diagnosis.md": r"tip correction \| 41\.\d um(.|\n)*scale error x \| 120\d um/m"
        r"(.|\n)*scale error y \| −(49|50)\d um/m(.|\n)*reversal error x \| 78\.\d um"
        r"(.|\n)*squareness xy \| −40\d urad(.|\n)*towards -x(.|\n)*reversal error y \| 38\.\d um",
    },
    "laser.md": {
        "laser/diagnosis.md": r"reversal error \| −2\.98.*backlash by 2\.98\d um more(.|\n)*scale error \| 12\.(.|\n)*"
        r"period (5\.000|4\.999)",
        "laser-iso230/iso230.json": "do not conform",
    },
    "telescope.md": {"telescope/diagnosis.md": r"period 2\.(50|49)\d* deg"},
    "printer.md": {
        "printer/diagnosis.md": r"reversal error \| −11\d.*by 11\d\.\d um more(.|\n)*scale error \| 59\d\d um/m"
    },
    "cmm-programs.md": {"results/cmm/evaluation.json": '"xm_um"'},
    "certificate.md": {"results/budget/budget.json": r'"not_included": \[\]'},
    "follow.md": {"results/history/history.csv": "2026-09-02"},
}
"""What the text of a page says that its commands give, as patterns of the files."""


@pytest.mark.parametrize(("page", "block"), NOT_RUN, ids=lambda one: name_of(one) if isinstance(one, Path) else "block")
def test_a_block_that_is_not_run_says_why(page: Path, block: Block) -> None:
    """The reason is printed; the verbs must exist all the same."""
    verbs = re.findall(r"^stepgauge ([a-z0-9-]+)", block.text, re.M)
    assert set(verbs) <= set(VERBS)
    assert len(block.not_run) > 5
    pytest.skip(f"{name_of(page)}: not run: {block.not_run}")


def test_pages_that_other_tests_run_are_there() -> None:
    for page, test in RUN_ELSEWHERE.items():
        assert page in (ROOT / "tests" / test).read_text(encoding="utf-8")


def test_the_pages_to_read_are_short_and_the_gallery_is_long() -> None:
    """Without those that are looked up, as the first page lists them."""
    looked_up = set((ROOT / "docs/index.md").read_text(encoding="utf-8").split(":caption: Look up")[1].split())
    read = [page for page in pages() if page.stem not in looked_up]
    assert sum(len(page.read_text(encoding="utf-8").split()) for page in read) <= 25_000
    assert len(list((ROOT / "docs/gallery").glob("plot_*.py"))) >= 12


@pytest.mark.parametrize("name", sorted(reference.WRITTEN))
def test_a_page_that_follows_from_the_code_is_up_to_date(name: str) -> None:
    """``python docs/reference.py`` writes it anew."""
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == reference.WRITTEN[name]()


def test_every_key_of_a_file_that_people_write_stands_in_the_page_of_files() -> None:
    """Tables of results are read back, not written by people; priors explain themselves in their file."""
    for one in pkgutil.walk_packages(sg.__path__, "stepgauge."):
        if not one.name.endswith("__main__"):
            importlib.import_module(one.name)
    shown = {model for models in reference.FILES.values() for model in reference.all_tables(models)}
    every = {model for model in descendants(TomlTable) if model.__module__.startswith("stepgauge.")}
    explained = {"stepgauge.diagnosis.priors", "stepgauge.fleet.hierarchical.priors"}
    results = {"qualification", "budget_files", "reading", "watching"}
    assert [
        str(model)
        for model in every - shown
        if not issubclass(model, Effect)
        and model.__module__ not in explained
        and model.__module__.rpartition(".")[2] not in results
    ] == []


def descendants(model: type) -> Iterator[type]:
    for one in model.__subclasses__():
        yield one
        yield from descendants(one)


def test_no_commands_stand_outside_of_blocks_that_are_run() -> None:
    """Indented, or in a block without a language, nobody would run them."""
    for page in pages():
        text = re.sub(r"^ *```(?:sh|python)\n.*?^ *```$", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
        assert re.findall(r"^ *stepgauge [a-z0-9-]+ .*", text, re.M) == [], page


@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="needs the extra 'docs'")
def test_the_site_builds_without_warnings_and_has_a_page_for_every_verb_and_effect(tmp_path: Path) -> None:
    """With the gallery, whose examples run; a link that leads nowhere is a warning."""
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(tmp_path / "trees")]
    build += ["-D", "html_theme=basic"]  # the look of the site takes half of its time
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [*build, str(ROOT / "docs"), str(tmp_path / "site")], env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = tmp_path / "site/_reference"
    assert {path.stem for path in (pages / "verbs").glob("*.html")} == {*VERBS, "index"}
    assert {path.stem for path in (pages / "effects").glob("*.html")} == {*effect_kinds(every=True), "index"}


def test_the_columns_of_the_reference_are_those_of_the_readers() -> None:
    """The names without their unit."""
    assert {name for names in reference.RECORDING for name in names.split(", ")} == set(KNOWN)
    assert {name.removesuffix("_UNIT") for name in reference.AXIS_RECORDING} == set(OWN)
