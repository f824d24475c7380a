"""Which verbs there are, by task, and where the function of each is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module

from stepgauge.verbs.define import Verb, verb_of
from stepgauge.verbs.kind import Kind

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


VERBS = Catalogue(name for names in TASKS.values() for name in names)
"""Names of verbs and groups."""
