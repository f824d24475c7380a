"""stepgauge: calibrate coordinate measuring machines with a step gauge.

The public surface, explained in ``docs/python.md``: verbs that take files or objects, and the results that they return.
A name is loaded when it is first asked for, so that ``import stepgauge`` costs no import of numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stepgauge import inference as inference
    from stepgauge.axis.recording import AxisRecording as AxisRecording
    from stepgauge.axis.recording import read_axis_recording as read_axis_recording
    from stepgauge.diagnosis.result import Diagnosis as Diagnosis
    from stepgauge.diagnosis.result import read_diagnosis as read_diagnosis
    from stepgauge.errors import InputError as InputError
    from stepgauge.errors import ProgramStoppedError as ProgramStoppedError
    from stepgauge.evaluation.evaluate import Evaluation as Evaluation
    from stepgauge.files.stored import StoredResult as StoredResult
    from stepgauge.fleet.hierarchical.answer import FleetInference as FleetInference
    from stepgauge.fleet.hierarchical.watching import FleetWatch as FleetWatch
    from stepgauge.gauge.certified import Gauge as Gauge
    from stepgauge.gauge.certified import read_gauge as read_gauge
    from stepgauge.gauge.placement import Placement as Placement
    from stepgauge.importing.result import Imported as Imported
    from stepgauge.machine.file import Machine as Machine
    from stepgauge.machine.file import read_machine as read_machine
    from stepgauge.machine.virtual import Run as Run
    from stepgauge.planning.planned import Plan as Plan
    from stepgauge.probes.directions_map import DirectionMap as DirectionMap
    from stepgauge.probes.directions_map import read_probe_map as read_probe_map
    from stepgauge.recording import Recording as Recording
    from stepgauge.recording import read_recording as read_recording
    from stepgauge.standards.budget_files import StoredBudget as StoredBudget
    from stepgauge.standards.budget_files import read_budget as read_budget
    from stepgauge.verbs.budget import budget as budget
    from stepgauge.verbs.compensate import compensate as compensate
    from stepgauge.verbs.dcc import check_dcc as check_dcc
    from stepgauge.verbs.dcc import export_gauge_dcc as export_gauge_dcc
    from stepgauge.verbs.dcc import import_gauge_dcc as import_gauge_dcc
    from stepgauge.verbs.dcc import write_dcc as write_dcc
    from stepgauge.verbs.diagnose import diagnose as diagnose
    from stepgauge.verbs.evaluate import evaluate as evaluate
    from stepgauge.verbs.export import export_recording as export_recording
    from stepgauge.verbs.fleet import add_to_fleet as add_to_fleet
    from stepgauge.verbs.fleet import compact_fleet as compact_fleet
    from stepgauge.verbs.fleet import export_fleet as export_fleet
    from stepgauge.verbs.fleet import fleet_cluster as fleet_cluster
    from stepgauge.verbs.fleet import query_fleet as query_fleet
    from stepgauge.verbs.fleet_work import budget_fleet as budget_fleet
    from stepgauge.verbs.fleet_work import diagnose_fleet as diagnose_fleet
    from stepgauge.verbs.fleet_work import evaluate_fleet as evaluate_fleet
    from stepgauge.verbs.fleet_work import infer_fleet as infer_fleet
    from stepgauge.verbs.fleet_work import watch_fleet as watch_fleet
    from stepgauge.verbs.history import machine_history as machine_history
    from stepgauge.verbs.import_ import import_recording as import_recording
    from stepgauge.verbs.investigate import investigate as investigate
    from stepgauge.verbs.list_ import list_dialects as list_dialects
    from stepgauge.verbs.list_ import list_effects as list_effects
    from stepgauge.verbs.list_ import list_files as list_files
    from stepgauge.verbs.list_ import list_gauges as list_gauges
    from stepgauge.verbs.list_ import list_machines as list_machines
    from stepgauge.verbs.list_ import list_priors as list_priors
    from stepgauge.verbs.locate import locate as locate
    from stepgauge.verbs.measure import measure as measure
    from stepgauge.verbs.plan import plan as plan
    from stepgauge.verbs.probe import compensate_points as compensate_points
    from stepgauge.verbs.probe import probe_bench as probe_bench
    from stepgauge.verbs.probe import probe_map as probe_map
    from stepgauge.verbs.probe import probe_sphere as probe_sphere
    from stepgauge.verbs.probe import qualify_probe as qualify_probe
    from stepgauge.verbs.reading import read_evaluation as read_evaluation
    from stepgauge.verbs.reading import read_placement as read_placement
    from stepgauge.verbs.reading import read_result as read_result
    from stepgauge.verbs.report import report as report
    from stepgauge.verbs.serve import serve as serve
    from stepgauge.verbs.simulate import simulate as simulate
    from stepgauge.verbs.test.iso230 import iso230 as iso230
    from stepgauge.verbs.test.iso230_3 import iso230_3 as iso230_3
    from stepgauge.verbs.test.iso10360 import iso10360 as iso10360
    from stepgauge.verbs.test.iso10360_5 import iso10360_5 as iso10360_5
    from stepgauge.verbs.test.plan import plan_iso10360 as plan_iso10360

__version__ = "0.1.0"

_PLACES = {
    "add_to_fleet": "verbs.fleet",
    "budget": "verbs.budget",
    "budget_fleet": "verbs.fleet_work",
    "diagnose": "verbs.diagnose",
    "diagnose_fleet": "verbs.fleet_work",
    "list_priors": "verbs.list_",
    "compensate": "verbs.compensate",
    "export_recording": "verbs.export",
    "compact_fleet": "verbs.fleet",
    "fleet_cluster": "verbs.fleet",
    "machine_history": "verbs.history",
    "serve": "verbs.serve",
    "iso10360": "verbs.test.iso10360",
    "iso10360_5": "verbs.test.iso10360_5",
    "iso230": "verbs.test.iso230",
    "iso230_3": "verbs.test.iso230_3",
    "plan_iso10360": "verbs.test.plan",
    "probe_sphere": "verbs.probe",
    "qualify_probe": "verbs.probe",
    "compensate_points": "verbs.probe",
    "probe_bench": "verbs.probe",
    "list_gauges": "verbs.list_",
    "list_machines": "verbs.list_",
    "list_files": "verbs.list_",
    "list_effects": "verbs.list_",
    "list_dialects": "verbs.list_",
    "write_dcc": "verbs.dcc",
    "check_dcc": "verbs.dcc",
    "import_gauge_dcc": "verbs.dcc",
    "export_gauge_dcc": "verbs.dcc",
    "evaluate": "verbs.evaluate",
    "evaluate_fleet": "verbs.fleet_work",
    "export_fleet": "verbs.fleet",
    "import_recording": "verbs.import_",
    "infer_fleet": "verbs.fleet_work",
    "investigate": "verbs.investigate",
    "locate": "verbs.locate",
    "measure": "verbs.measure",
    "plan": "verbs.plan",
    "probe_map": "verbs.probe",
    "query_fleet": "verbs.fleet",
    "read_axis_recording": "axis.recording",
    "read_budget": "standards.budget_files",
    "read_diagnosis": "diagnosis.result",
    "read_evaluation": "verbs.reading",
    "read_gauge": "gauge.certified",
    "read_machine": "machine.file",
    "read_placement": "verbs.reading",
    "read_probe_map": "probes.directions_map",
    "read_recording": "recording",
    "read_result": "verbs.reading",
    "report": "verbs.report",
    "simulate": "verbs.simulate",
    "watch_fleet": "verbs.fleet_work",
    "AxisRecording": "axis.recording",
    "Diagnosis": "diagnosis.result",
    "DirectionMap": "probes.directions_map",
    "Evaluation": "evaluation.evaluate",
    "FleetInference": "fleet.hierarchical.answer",
    "FleetWatch": "fleet.hierarchical.watching",
    "Gauge": "gauge.certified",
    "Imported": "importing.result",
    "InputError": "errors",
    "Machine": "machine.file",
    "Placement": "gauge.placement",
    "Plan": "planning.planned",
    "ProgramStoppedError": "errors",
    "Recording": "recording",
    "Run": "machine.virtual",
    "StoredBudget": "standards.budget_files",
    "StoredResult": "files.stored",
}
"""Every public name, and the module that has it."""
__all__ = ["__version__", "inference", *_PLACES]


def __getattr__(name: str) -> Any:
    """A public name, loaded now (PEP 562)."""
    from importlib import import_module

    if name == "inference":
        return import_module(f"{__name__}.inference")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    if hasattr(found, "verb"):
        from stepgauge.verbs.define import document

        document(found)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
