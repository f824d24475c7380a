"""Which verbs there are, by task, and where the function of each is."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator, Mapping
from importlib import import_module

from stepgauge.verbs.define import REQUIRED, Verb, VerbParameter, verb_of
from stepgauge.verbs.kind import Kind
from stepgauge.verbs.kinds import Flag, Number, Pair, Reads, Supplied, Vector

PLACES: Mapping[str, str] = {
    "init": "project.init",
    "status": "project.status",
    "web": "project.web",
    "demo": "demo.demo",
    "locate": "locate.locate",
    "plan": "plan.plan",
    "simulate": "simulate.simulate",
    "measure": "measure.measure",
    "evaluate": "evaluate.evaluate",
    "budget": "budget.budget",
    "export": "export.export_recording",
    "compensate": "compensate.compensate",
    "test plan": "test.plan.plan_iso10360",
    "import": "import_.import_recording",
    "report": "report.report",
    "diagnose": "diagnose.diagnose",
    "investigate": "investigate.investigate",
    "history": "history.machine_history",
    "serve": "serve.serve",
    "test iso10360": "test.iso10360.iso10360",
    "test iso10360-5": "test.iso10360_5.iso10360_5",
    "test iso230": "test.iso230.iso230",
    "test iso230-3": "test.iso230_3.iso230_3",
    "probe map": "probe.probe_map",
    "probe sphere": "probe.probe_sphere",
    "probe qualify": "probe.qualify_probe",
    "probe compensate": "probe.compensate_points",
    "probe bench": "probe.probe_bench",
    "list gauges": "list_.list_gauges",
    "list machines": "list_.list_machines",
    "list files": "list_.list_files",
    "list effects": "list_.list_effects",
    "list dialects": "list_.list_dialects",
    "list priors": "list_.list_priors",
    "dcc write": "dcc.write_dcc",
    "dcc check": "dcc.check_dcc",
    "dcc import-gauge": "dcc.import_gauge_dcc",
    "dcc export-gauge": "dcc.export_gauge_dcc",
    "fleet add": "fleet.add_to_fleet",
    "fleet query": "fleet.query_fleet",
    "fleet export": "fleet.export_fleet",
    "fleet compact": "fleet.compact_fleet",
    "fleet evaluate": "fleet_work.evaluate_fleet",
    "fleet budget": "fleet_work.budget_fleet",
    "fleet diagnose": "fleet_work.diagnose_fleet",
    "fleet infer": "fleet_work.infer_fleet",
    "fleet watch": "fleet_work.watch_fleet",
    "fleet cluster": "fleet.fleet_cluster",
}
"""The words of each verb, and its module and function in this room."""
GROUPS: Mapping[str, str] = {
    "test": "Tests by standards: ISO 10360-2 and -5, ISO 230-2 and -3.",
    "list": "What there is: shipped files, effects, dialects, priors.",
    "dcc": "Digital Calibration Certificates: DCC XML 3.2.0 of PTB with D-SI quantities.\n\nCertificates are read"
    " safely: no DOCTYPE, no entities, no network.",
    "probe": "The touch-trigger probe: its physics, its qualification and its compensation.",
    "fleet": "Recordings of many machines and gauges in one store, and work on all of them.\n\nA store is a folder of"
    " Parquet files, which any program can read. Needs 'pip install stepgauge[fleet]'.",
}
"""What the verbs of a group are about."""
TASKS: Mapping[str, tuple[str, ...]] = {
    "Every day": (
        *("init", "status", "web", "demo", "locate", "plan", "simulate", "measure", "import", "evaluate", "budget"),
        *("report", "diagnose"),
    ),
    "Further": ("export", "compensate", "history", "investigate", "serve"),
    "Groups": ("test", "list", "dcc", "probe", "fleet"),
}
"""Verbs and groups by heading, as the help lists them."""


COMMON = (
    *("gauge", "machine", "placement", "certificate", "operator", "customer", "location", "blocks", "r-eff-origin"),
    *("gauge-temperature", "u-gauge-temperature", "tip-radius", "mpe", "coverage-factor", "figure"),
)
"""Keys at the top of a project file: parameters that several verbs share."""


class Catalogue(tuple[str, ...]):
    """The names at the top, verbs and groups; what a project file may say of them."""

    common: tuple[str, ...] = COMMON

    def kinds(self, words: str) -> dict[str, Kind]:
        """The kinds of the keys of a verb by its words; none where there is no such verb."""
        if words not in PLACES:
            return {}
        return {one.key: one.one for one in find_verb(words).parameters if one.at_command}

    def meanings(self) -> dict[str, str]:
        """What each key at the top is."""
        found = {one.key: one.sentence for _, verb in all_verbs() for one in verb.parameters}
        return {key: found[key].replace("``", "") for key in self.common}


def find_verb(words: str) -> Verb:
    """The definition of a verb by its words, ``"evaluate"`` or ``"probe map"``."""
    module, _, function = PLACES[words].rpartition(".")
    return verb_of(getattr(import_module(f"stepgauge.verbs.{module}"), function))


def all_verbs() -> Iterator[tuple[str, Verb]]:
    """Every verb with its words."""
    return ((words, find_verb(words)) for words in PLACES)


def verbs_of(group: str) -> list[str]:
    """Last words of the verbs of a group."""
    return [words.partition(" ")[2] for words in PLACES if words.startswith(f"{group} ")]


METHODS = {"list files": "copy", "fleet query": "to_csv"}
"""By what results are written that have no ``write``."""
_COMMAND = re.compile(r"^stepgauge .*?(?= &$|$)", re.M)


def python_examples(text: str) -> str:
    """Commands, and what stands between them, with calls of Python in place of the commands."""
    return _COMMAND.sub(lambda one: python_call(one[0], ">>> sg."), re.sub(r" \\\n +", " ", text)).replace(" &\n", "\n")


def python_call(command: str, prefix: str = "") -> str:
    """What a command is in Python: the function alone without arguments, ``..`` for those that are missing.

    The command itself where Python has no such function, or the verb no such argument.
    """
    from stepgauge import _PLACES

    words = shlex.split(command)[1:]
    name = next((one for many in (2, 1) if (one := " ".join(words[:many])) in PLACES), "")
    function, rest = PLACES.get(name, "").rpartition(".")[2], words[len(name.split()) :]
    if function not in _PLACES:
        return command
    try:
        typed = _typed(find_verb(name), rest)
    except LookupError:
        return command
    own = [one for one in find_verb(name).parameters if not one.writes]
    left = [one for one in own if one.default is REQUIRED and one.name not in typed]
    said = [_argument(one, typed[one.name]) for one in own if one.name in typed]
    if not (rest or prefix):
        return function
    said += [f"{one.name}=None" for one in left if not one.required]
    said += [f"{one.name}={SUPPLIED[one.name]}" for one in left if isinstance(one.kind, Supplied)]
    said[:0] = [".."] if any(one.required and one.at_command for one in left) else []
    written = [one for one in find_verb(name).parameters if one.writes and one.name in typed and one.name not in DRAWN]
    more = f".{METHODS.get(name, 'write')}({_arguments(written, typed)})" if written else ""
    return f"{prefix}{function}({', '.join(said)}){more}"


SUPPLIED = {"ask": "input", "journal": '"journal"'}
"""What Python may state for what the command line makes by itself."""
DRAWN = ("draw", "plot", "polar_plot", "body_plot", "figure")
"""Files of figures, which Python draws by ``plot``."""


def _typed(verb: Verb, words: list[str]) -> dict[str, list[str]]:
    """The words of a command by the parameter that they are of (``LookupError`` for an option of none)."""
    options = {name: one for one in verb.parameters for name in (f"--{one.key}", f"-{one.short}") if not one.argument}
    found, left = dict[str, list[str]](), list(words)
    while left:
        word = left.pop(0)
        if word.startswith("-") and len(word) > 1:
            one = options[word]
            word = "" if isinstance(one.kind, Flag) else left.pop(0) if left else ".."
        else:
            free = [one for one in verb.parameters if one.argument and (one.repeated or one.name not in found)]
            one = free[0]
        found.setdefault(one.name, []).append(word)
    return found


def _arguments(parameters: list[VerbParameter], typed: Mapping[str, list[str]]) -> str:
    """Of a method: what it begins with, then the others by name."""
    first, *others = parameters
    return ", ".join([_literal(first, typed[first.name]), *(_argument(one, typed[one.name]) for one in others)])


def _argument(one: VerbParameter, texts: list[str]) -> str:
    return _literal(one, texts) if one.argument else f"{one.name}={_literal(one, texts)}"


def _literal(one: VerbParameter, texts: list[str]) -> str:
    """What was typed for a parameter, as Python states it."""
    if isinstance(one.kind, Flag):
        return "True"
    if texts == [".."]:
        return ".."
    if isinstance(one.one, Pair) and not one.one.whole:
        return "{" + ", ".join(f"{_quoted(key)}: {_quoted(value)}" for key, value in map(one.one.parse, texts)) + "}"
    if isinstance(one.one, Reads) and any("*" in text for text in texts):
        return " + ".join(f"sorted(glob({_quoted(text)}))" for text in texts)
    values = [_quoted(one.one.parse(text) if isinstance(one.one, Number | Vector) else text) for text in texts]
    return values[0] if len(values) == 1 else f"[{', '.join(values)}]"


def _quoted(value: object) -> str:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


VERBS = Catalogue(name for names in TASKS.values() for name in names)
"""Names of verbs and groups."""
