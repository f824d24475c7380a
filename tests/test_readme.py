"""README and user guide: short, links that lead somewhere, commands that run in their order in a copy of the clone."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import click
import pytest
from pypdf import PdfReader

from stepgauge.cli import cli
from stepgauge.project.file import check_options, read_project
from stepgauge.verbs.catalogue import VERBS
from tests.conftest import ROOT
from tests.shell import blocks_of, pages, run_page, shell_blocks


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
    assert "\n".join(shell_blocks(ROOT / "docs/guide.md")).count("stepgauge ") > 40
    run_page(ROOT / "docs/guide.md", tmp_path_factory.mktemp("pipes"))
    for made in ("report.pdf", "certificate.pdf", "certificate.xml", "iso10360/iso10360.pdf", "history/history.json"):
        assert (clone / made).stat().st_size > 0
    certificate = "".join(page.extract_text() for page in PdfReader(clone / "certificate.pdf").pages)
    assert "Calibration certificate" in certificate
    assert "Report of measurement" not in certificate
    for folder, name in (("iso10360-5", "iso10360-5"), ("iso230", "iso230"), ("iso230-3", "iso230-3")):
        assert (clone / folder / f"{name}.pdf").stat().st_size > 0


def test_the_first_page_is_short_enough_to_be_read() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 1200


PLAIN = re.compile(
    r"""(?: (?:stepgauge|python3?|pip|playwright|sphinx-build|cp|cd|mkdir|source)  # programs, and what both know
        (?: \s+ (?: "[^"`$\\]*" | '[^'`$\\]*' | [\w./:=,+@%\[\]()~*-]+ ) )*        # words, plain or in quotes
    )? \s* (?:\#.*)? """,
    re.X,
)
"""A line that means the same in bash and in PowerShell: one program with its words, and a remark."""

README_COMMANDS = (
    "python3 -m venv .venv && .venv/bin/pip install '.[web]' && .venv/bin/stepgauge demo",
    "python3 -m venv .venv && .venv/bin/pip install -e '.[dev]' && .venv/bin/python -m pytest",
)
"""The first tries the product, the second its tests: in a fresh clone, without an environment, each by itself."""


def test_each_command_of_the_first_page_works_by_itself() -> None:
    """Each stands on one line of its own, and what runs on every commit finds the second where it looks for it."""
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(page.splitlines().count(command) == 1 for command in README_COMMANDS)
    search = re.search(r"awk '(.*?)' README\.md", (ROOT / ".ci/run").read_text(encoding="utf-8"))
    assert search
    found = subprocess.run(["awk", search[1], "README.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == README_COMMANDS[1]


def test_commands_mean_the_same_in_bash_and_in_powershell() -> None:
    """No loops, pipes, redirections, variables, continued lines; files that are written are shown as files."""
    lines = 0
    for page in (ROOT / "README.md", *pages(), *(ROOT / "examples").glob("*/README.md")):
        for line in (line for one in blocks_of(page) if one.language == "sh" for line in one.text.splitlines()):
            lines += 1
            if page.name == "README.md" and line in README_COMMANDS:
                continue  # one line that needs no environment before it: PowerShell has a block of its own
            assert PLAIN.fullmatch(line.strip()), f"{page.relative_to(ROOT)}: {line}"
    assert lines > 200


def test_links_and_figures_of_the_documents_exist() -> None:
    """Every file that a document links to is in the repository, and every heading in it."""
    links = 0
    for page in (ROOT / "README.md", *pages(), *(ROOT / "examples").glob("*/README.md")):
        for target, heading in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8")):
            if "://" in target or not (target or heading):
                continue
            links += 1
            found = page.parent / target if target else page
            assert found.exists(), f"{page.name}: {target}"
            assert not heading or heading in headings(found), f"{page.name}: {target}#{heading}"
    assert links > 50


def headings(page: Path) -> set[str]:
    """What a link to a heading is called."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w -]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def test_what_an_example_would_type_again_stands_in_its_project_file() -> None:
    """Gauge, machine and placement are typed at most once each, and every project file can be read."""
    for page in (ROOT / "examples").glob("*/README.md"):
        for option in ("-g", "-m", "-p"):
            assert len(re.findall(rf" {option} \S", page.read_text(encoding="utf-8"))) <= 1, f"{page}: {option}"
    projects = list((ROOT / "examples").glob("*/stepgauge.toml"))
    assert len(projects) >= 4
    for path in projects:
        project = read_project(path, VERBS)
        for verb in (key for key, value in project.values.items() if isinstance(value, dict)):
            known = [name for one in cli.get_command(click.Context(cli), verb).params for name in one.opts]
            check_options(project, (verb,), [name.lstrip("-") for name in known])
