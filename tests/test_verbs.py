"""A verb is defined once: its function is the command, the checks, the keys of the project, the form and the page."""

from __future__ import annotations

import importlib.util
import inspect
import sys
from pathlib import Path
from types import ModuleType

import click
import pytest

import stepgauge
from stepgauge.cli import cli
from stepgauge.errors import InputError, option_of
from stepgauge.verbs import catalogue
from stepgauge.verbs.catalogue import VERBS as TABLES
from stepgauge.verbs.define import REQUIRED, Verb, document
from stepgauge.web.fields import keywords, options, verb_fields
from stepgauge.web.render import templates
from stepgauge.web.texts import Words
from tests.cli.conftest import (
    Run,
    run,  # noqa: F401
)
from tests.conftest import ROOT

MADE = '''
from dataclasses import dataclass
from typing import Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import (OneOf, Number, Reads)
from stepgauge.verbs.shared import OutputFile


@dataclass
class Weighed:
    mass_kg: float

    def summary(self):
        return f"{self.mass_kg:.1f} kg"


def write(weighed, output: OutputFile):
    """Write it.

    Parameters
    ----------
    output : where the mass is written
    """
    from stepgauge.files.text import write_text

    write_text(output, weighed.summary())
    return [output]


@verb(write)
def weigh(
    table: Annotated[str, Reads(), ARGUMENT],
    *,
    load_mm: Annotated[float, Number("mm", above=0.0, high=50.0)] = 2.0,
    scale: Annotated[str, OneOf("spring", "beam")] = "beam",
):
    """Weigh a table.

    The ``load_mm`` lies on TABLE.

    Parameters
    ----------
    table : what is weighed
    load_mm : height of the load
    scale : the balance that is used
    """
    return Weighed(load_mm * (2.0 if scale == "beam" else 1.0))
'''


@pytest.fixture
def weigh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A verb with three parameters, added in one place."""
    spec = importlib.util.spec_from_loader("stepgauge.verbs.weigh", loader=None)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "stepgauge.verbs.weigh", module)
    exec(compile(MADE, "weigh.py", "exec", dont_inherit=True), module.__dict__)
    monkeypatch.setitem(catalogue.PLACES, "weigh", "weigh.weigh")  # type: ignore[arg-type]
    monkeypatch.setattr("stepgauge.cli.groups.VERBS", catalogue.Catalogue([*TABLES, "weigh"]))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("a\n")
    return module


def test_a_verb_that_is_added_in_one_place_is_everywhere(weigh: ModuleType, run: Run, tmp_path: Path) -> None:  # noqa: F811
    said = run("weigh", "--help").out
    assert "The --load lies on TABLE." in said
    assert "Height of the load." in said
    assert "more than 0, at most 50 mm; default: 2.0" in " ".join(said.split())
    assert "--scale [spring|beam]" in said
    done = run("weigh", "table.csv", "--load", 3, "-o", "mass.txt")
    assert (done.code, done.err.splitlines()) == (0, ["6.0 kg", "wrote mass.txt"])
    with pytest.raises(InputError, match="load_mm: out of range; found 51; expected more than 0, at most 50 mm"):
        weigh.weigh("table.csv", load_mm=51)
    assert (
        "--load: out of range; found 51.0; expected more than 0, at most 50 mm"
        in run("weigh", "table.csv", "--load", 51, "-o", "x").err
    )
    (tmp_path / "stepgauge.toml").write_text('[weigh]\nload = 7.0\nscale = "spring"\noutput = "mass.txt"\n')
    done = run("weigh", "table.csv")
    assert done.err.splitlines() == [
        "from stepgauge.toml: --load 7.0, --scale spring",
        "7.0 kg",
        "wrote mass.txt",
    ]
    (tmp_path / "stepgauge.toml").write_text("[weigh]\nload = 70.0\n")
    assert "key load is wrong; found 70.0; expected more than 0, at most 50 mm" in run("weigh", "table.csv").err
    fields = {one.name: one.field for one in weigh.weigh.verb.parameters}
    assert fields["load_mm"]["unit"] == "mm"
    assert fields["scale"]["choices"] == ["spring", "beam"]
    assert fields["table"]["required"]
    asked = verb_fields("weigh")
    assert [one.name for one in asked.values()] == ["load", "scale"]
    shown = str(templates().get_template("fields.html.j2").module.field(Words("en"), asked["load_mm"], "3.5"))
    assert "load (mm)" in shown
    assert 'title="height of the load"' in shown
    assert 'placeholder="2"' in shown
    assert [options(asked, {"load": "3.5", "scale": "beam"}), keywords(asked, {"load": "3,5"})] == [
        ["--load", "3.5"],
        {"load_mm": 3.5},
    ]
    with pytest.raises(InputError, match="50"):
        keywords(asked, {"load": "51"})
    page = reference().verb_text(command_of("weigh"), click.Context(cli))
    assert "height of the load" in page.lower()
    document(weigh.weigh)
    assert "load_mm : height of the load" in weigh.weigh.__doc__


def command_of(words: str) -> click.Command:
    command = cli.get_command(click.Context(cli, resilient_parsing=True), words)
    assert command is not None
    return command


def reference() -> ModuleType:
    place = importlib.util.spec_from_file_location("reference", ROOT / "docs/reference.py")
    assert place is not None
    assert place.loader is not None
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    return module


VERBS = dict(catalogue.all_verbs())


@pytest.mark.parametrize("words", VERBS)
def test_a_verb_says_what_each_parameter_is(words: str) -> None:
    """In one sentence, and what holds without it where the default does not say so."""
    verb = VERBS[words]
    assert verb.sentence
    for one in verb.parameters:
        assert one.sentence, one.name
        assert not one.sentence.endswith("."), one.name
        if one.at_command and not one.argument:
            assert f"--{one.key}" == option_of(one.name)


@pytest.mark.parametrize("words", VERBS)
def test_the_default_of_a_parameter_is_a_value_of_its_kind(words: str) -> None:
    for one in VERBS[words].parameters:
        if one.default not in (REQUIRED, None, ()):
            one.kind.check(one.name, one.default)


def test_a_name_means_the_same_everywhere() -> None:
    kinds: dict[str, set[tuple[str, str]]] = {}
    for verb in VERBS.values():
        for one in verb.parameters:
            if one.at_command and not one.argument:
                kinds.setdefault(one.key, set()).add((one.one.name, one.one.unit))
    assert {name: found for name, found in kinds.items() if len(found) > 1} == {}


def test_modules_of_verbs_import_nothing_that_works() -> None:
    heavy = {"numpy", "pandas", "scipy", "matplotlib", "pydantic", "lxml", "jinja2"}
    code = "import sys, stepgauge.verbs.catalogue as c; [v.parameters for _, v in c.all_verbs()]; print(*sys.modules)"
    import subprocess

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert heavy & set(done.stdout.split()) == set()


def test_every_verb_is_a_function_of_the_package() -> None:
    public = {getattr(getattr(stepgauge, name), "verb", None) for name in stepgauge.__all__}
    missing = [words for words, verb in VERBS.items() if verb not in public and words not in AT_THE_SCREEN]
    assert missing == []


AT_THE_SCREEN = {"init", "status", "web", "demo"}
"""Verbs of a project and a screen; a program has no use for them."""


def signature(verb: Verb) -> list[str]:
    return list(inspect.signature(verb.function).parameters)
