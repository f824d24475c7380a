"""Pages of the site that follow from the code: verbs and options, files and their keys, effects and their figures."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_args

import click
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from pydantic import BaseModel
from pydantic.fields import FieldInfo

import stepgauge
from stepgauge.cli import TASKS, cli
from stepgauge.effects import Effect, Parameter, Probings, Setting, along_approach_um, effect_kinds, make_effects
from stepgauge.effects.maps import AXIS_COLUMNS as TABLE_COLUMNS
from stepgauge.figures.style import CYCLE
from stepgauge.fleet import schema
from stepgauge.gauge.certified import CertificateTable, GaugeTable, read_gauge
from stepgauge.gauge.placement import PlacementTable
from stepgauge.live.faults import EventTable
from stepgauge.machine.contribution import Contribution
from stepgauge.machine.file import MachineTable, UncertaintyTable, read_machine
from stepgauge.machine.uncertain import UncertainTable
from stepgauge.probes.schema import TABLES as PROBES
from stepgauge.probes.schema import ProbeTable
from stepgauge.reports.certificate_file import TABLES as HEAD
from stepgauge.reports.certificate_file import ResponsiblePerson
from stepgauge.verbs.catalogue import VERBS

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "benchmarks" / "every-effect.toml"
DIRECTIONS = {
    "along x": (1.0, 0.0, 0.0),
    "along y": (0.0, 1.0, 0.0),
    "rising along a body diagonal": (0.64, 0.6, 0.48),
}
CYCLES = 5


def write_reference(folder: Path) -> None:
    """All generated pages, in ``folder``."""
    for name in ("verbs", "effects", "python"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    write_verbs(folder / "verbs")
    write_effects(folder / "effects")
    write_python(folder / "python")
    (folder / "fleet.md").write_text(fleet_page(), encoding="utf-8")


API = {
    "Measure": ("locate", "plan", "simulate", "measure", "serve", "import_recording", "export_recording"),
    "Evaluate": ("evaluate", "budget", "compensate", "machine_history"),
    "Test by a standard": ("iso10360", "plan_iso10360", "iso10360_5", "iso230", "iso230_3"),
    "Find causes": ("diagnose", "investigate"),
    "Show and certify": ("report", "write_dcc", "check_dcc", "import_gauge_dcc", "export_gauge_dcc"),
    "The probe": ("probe_map", "probe_sphere", "qualify_probe", "compensate_points", "probe_bench"),
}
"""The functions by task; all others have a page by their name: of a fleet, that read, that list, results."""


def tasks() -> dict[str, list[str]]:
    """Every public name below one heading."""
    names = [name for name in stepgauge.__all__ if name != "__version__"]
    found = {task: [name for name in verbs if name in names] for task, verbs in API.items()}
    rest = [name for name in names if all(name not in some for some in found.values())]
    found["Many machines"] = [name for name in rest if "fleet" in name]
    found["Read files"] = [name for name in rest if name.startswith(("read_", "list_"))]
    found["Results"] = [name for name in rest if name[0].isupper()]
    found["Further functions"] = [name for name in rest if all(name not in some for some in found.values())]
    return {task: some for task, some in found.items() if some}


def write_python(folder: Path) -> None:
    """What ``import stepgauge`` gives, a page per task: signature, docstring, and the examples that use it."""
    listed = ["# Functions and results", "", "Names as `import stepgauge as sg` gives them.", ""]
    pages = []
    for task, names in tasks().items():
        pages.append(task.lower().replace(" ", "-"))
        listed += [f"- [{task}]({pages[-1]}.md): {', '.join(f'`{name}`' for name in names)}"]
        lines = [f"# {task}", ""]
        for name in names:
            lines += [f"## `{name}`", "", "```{eval-rst}", *_documented(name), "```", ""]
        (folder / f"{pages[-1]}.md").write_text("\n".join(lines), encoding="utf-8")
    listed += ["", "```{toctree}", ":hidden:", "", *pages, "```", ""]
    (folder / "index.md").write_text("\n".join(listed), encoding="utf-8")


def _documented(name: str) -> list[str]:
    """The directives for a public name; it is documented as it is imported, for a room may share the name of a verb."""
    one = getattr(stepgauge, name)
    vars(stepgauge)[name] = one
    one.__module__ = "stepgauge"
    members = [member for member in ("summary", "to_frame", "plot", "text", "write") if hasattr(one, member)]
    kind = "autofunction" if inspect.isfunction(one) else "autoclass"
    shown = [f"   :members: {', '.join(members)}"] if members else []
    return [f".. {kind}:: stepgauge.{name}", *shown, "", f".. minigallery:: stepgauge.{name}", ""]


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A Markdown table; bars in cells are escaped."""
    lines = [list(head), *[[str(cell) for cell in row] for row in rows]]
    lines.insert(1, ["---"] * len(lines[0]))
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines) + "\n"


def write_verbs(folder: Path) -> None:
    """A page per verb, and one that lists them by task."""
    context = click.Context(cli, info_name="stepgauge", resilient_parsing=True)
    listed = ["# Verbs", ""]
    names = []
    for task, verbs in TASKS.items():
        listed += [f"## {task}", ""]
        for verb in verbs:
            command = cli.get_command(context, verb)
            assert command is not None
            page = verb_page(command, context, verb)
            (folder / f"{verb}.md").write_text(page, encoding="utf-8")
            purpose = command.short_help or (command.help or "").partition("\n")[0]
            listed.append(f"- [`{verb}`]({verb}.md): {purpose}")
            names.append(verb)
        listed.append("")
    listed += ["```{toctree}", ":hidden:", "", *names, "```", ""]
    (folder / "index.md").write_text("\n".join(listed), encoding="utf-8")


def verb_page(command: click.Command, parent: click.Context, name: str) -> str:
    """Usage, explanation and options of a verb; of a group, those of its verbs one after the other."""
    context = click.Context(command, info_name=name, parent=parent, resilient_parsing=True)
    if not isinstance(command, click.Group):
        return f"# `{name}`\n\n" + verb_text(command, context)
    parts = [f"# `{name}`\n\n{inspect.cleandoc(command.help or '')}\n"]
    for verb in command.list_commands(context):
        one = command.get_command(context, verb)
        assert one is not None
        inner = click.Context(one, info_name=verb, parent=context, resilient_parsing=True)
        parts.append(f"## `{name} {verb}`\n\n" + verb_text(one, inner))
    return "\n".join(parts)


def verb_text(command: click.Command, context: click.Context) -> str:
    """Usage line, the help in paragraphs (examples as they are typed), and the table of options."""
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    parts = [f"```text\n{usage}\n```\n"]
    for paragraph in inspect.cleandoc(command.help or "").split("\n\n"):
        if paragraph.startswith("\b\n"):
            parts.append(f"```text\n{paragraph[2:]}\n```\n")
        else:
            parts.append(paragraph.replace("*", "\\*").replace("<", "\\<") + "\n")
    rows = []
    for option in command.params:
        record = option.get_help_record(context) if isinstance(option, click.Option) else None
        if record is not None:
            rows.append((f"`{record[0]}`", record[1].replace("*", "\\*").replace("<", "\\<")))
    return "\n".join(parts) + "\n" + table(("option", "meaning"), rows)


def files_page() -> str:
    """docs/files.md: keys of the files that people write, and columns of their recordings, from the code."""
    parts = [
        "# Files",
        "",
        "Written by `python docs/reference.py`.",
        "",
        "## Recording of a gauge, CSV or Parquet",
        "",
        columns_of(RECORDING),
    ]
    parts += ["## Recording of an axis, a spot or distances, CSV", "", columns_of(AXIS_RECORDING)]
    parts += ["Every other column of numbers is kept, and a diagnosis asks whether the readings follow it.", ""]
    for title, models in FILES.items():
        parts += [f"## {title}", ""]
        for model in all_tables(models):
            parts += [str(inspect.getdoc(model)).partition("\n")[0], "", keys_of(model)]
    parts += [
        "## Project file `stepgauge.toml`",
        "",
        "Keys at the top; a table `[VERB]` takes every option of a verb.",
        "",
    ]
    parts.append(table(("key", "meaning"), ((f"`{key}`", meaning) for key, meaning in VERBS.meanings().items())))
    return "\n".join(parts)


FILES: dict[str, tuple[type[BaseModel], ...]] = {
    "Gauge file": (GaugeTable, CertificateTable),
    "Placement file": (PlacementTable,),
    "Machine file": (MachineTable, UncertaintyTable, Contribution, UncertainTable),
    "Probe file, or `[probe]` of the machine file": (ProbeTable, *PROBES.values()),
    "Faults of `stepgauge serve`": (EventTable,),
    "Head of a certificate, `certificate.toml`": (*HEAD.values(), ResponsiblePerson),
}
"""The files that people write by their tables; a test holds them against all tables that there are."""
RECORDING = {
    "placement": "which laying of the gauge, from 1; 1 where the column is missing",
    "cycle": "which cycle, from 1",
    "face": "number of the face: odd ones are fronts, even ones backs",
    "x_mm, y_mm, z_mm": "tip centre at the trigger, mm, not corrected for the tip radius",
    "approach_i, approach_j, approach_k": "unit vector of the approach",
    "time_s": "time of the trigger, s",
    "speed_mm_s": "speed of the approach, mm/s",
    "gauge_temperature_C": "temperature of the gauge, deg C",
    "scale_temperature_x_C, scale_temperature_y_C, scale_temperature_z_C": "temperatures of the scales, deg C",
}
AXIS_RECORDING = {
    "placement": "which setting up",
    "cycle": "which cycle, from 1",
    "way": "sense of travel, +1 or -1",
    "target_UNIT": "target position; of distances: from_station and to_station instead",
    "reading_UNIT": "what the sensor read there",
    "u_target_UNIT": "standard uncertainty of the target",
    "time_s": "time of the reading, s",
}
"""Columns of the two kinds of recordings; a test holds the names against the readers."""


def columns_of(columns: dict[str, str]) -> str:
    """A table of columns; whatever else is a number is a covariate of a diagnosis."""
    return table(("column", "meaning"), ((f"`{name}`", meaning) for name, meaning in columns.items()))


def all_tables(models: Iterable[type[BaseModel]]) -> Iterator[type[BaseModel]]:
    """Tables, each followed by those that its keys hold."""
    for model in models:
        yield model
        own = (field.annotation for name, field in model.model_fields.items() if name in own_keys(model))
        yield from all_tables(one for kind in own for one in _held(kind) if issubclass(one, BaseModel))


def _held(kind: Any) -> Iterator[type]:
    """The types in an annotation: of ``list[SectionTable]`` the section."""
    if isinstance(kind, type) and not get_args(kind):
        yield kind
    for part in get_args(kind):
        yield from _held(part)


def own_keys(model: type[BaseModel]) -> list[str]:
    """Keys of a table that the one that it extends has not."""
    return [name for name in model.model_fields if name not in getattr(model.__base__, "model_fields", {})]


def keys_of(model: type[BaseModel]) -> str:
    """The fields of a table with their meaning and default."""
    rows = []
    for name in own_keys(model):
        field = model.model_fields[name]
        rows.append((f"`{name}`", field.description or "", "required" if field.is_required() else standard_of(field)))
    return table(("key", "meaning", "default"), rows) if rows else ""


def standard_of(field: FieldInfo) -> str:
    """What a key is without the file, as TOML has it."""
    if field.default_factory or field.default is None or isinstance(field.default, BaseModel):
        return "optional"
    return f"`{str(field.default).lower() if isinstance(field.default, bool) else field.default}`"


def fleet_page() -> str:
    """The columns of the views of a fleet's store, from its schema."""
    parts = ["# Store of a fleet", "", f"Views and their columns, schema version {schema.VERSION}.", ""]
    for name in ("recordings", "probings", "evaluations", "budgets", "diagnoses"):
        rows = (
            (f"`{one.name}`", f"{one.kind}, or null" if one.null else one.kind, one.meaning)
            for one in getattr(schema, name.upper())
        )
        parts += [f"## `{name}`", "", table(("column", "type", "meaning"), rows)]
    return "\n".join(parts)


def write_effects(folder: Path) -> None:
    """A page per effect with equation, parameters and how it looks in a recording."""
    examples = example_effects(folder)
    kinds = effect_kinds(every=True)
    listed = [
        "# Systematic effects",
        "",
        "What a machine file can state under `[[effect]]` and a diagnosis can name.",
        "",
    ]
    for kind in sorted(kinds):
        picture = folder / f"{kind}.svg"
        axis, figure = effect_figure(examples[kind])
        figure.savefig(picture, metadata={"Date": None})
        (folder / f"{kind}.md").write_text(effect_page(kinds[kind], examples[kind], axis), encoding="utf-8")
        listed.append(f"- [`{kind}`]({kind}.md): {kinds[kind].title()}")
    (folder / "index.md").write_text("\n".join([*listed, ""]), encoding="utf-8")


def effects_list() -> str:
    """docs/effects.md, for who reads the files and not the site: every kind with its parameters, from the classes."""
    rows = []
    for kind, effect in sorted(effect_kinds(every=True).items()):
        named = [f"`{one.name}`{f' ({one.unit})' if one.unit else ''}" for one in effect.parameters()]
        rows.append((f"`{kind}`", effect.title(), ", ".join(named)))
    said = "Written by `python docs/reference.py`. `stepgauge list effects KIND` explains one, with an example."
    return f"# Kinds of effects\n\n{said}\n\n" + table(("kind", "what it is", "parameters (unit)"), rows)


WRITTEN = {"files.md": files_page, "effects.md": effects_list}
"""The pages that stand among those to read, and what they are written by."""


def example_effects(folder: Path) -> dict[str, Effect]:
    """One effect of every kind with values as they occur."""
    (folder / "map.csv").write_text("coordinate_mm,error\n0,0\n300,3\n700,-1\n", encoding="utf-8")
    (folder / "table.csv").write_text(",".join(TABLE_COLUMNS) + "\n0,0,0,0,0\n700,5,3,0,0\n", encoding="utf-8")
    stated: list[dict[str, Any]] = tomllib.loads(EXAMPLES.read_text(encoding="utf-8"))["effect"]
    return {effect.kind: effect for effect in make_effects(stated, folder / "machine.toml")}


def effect_page(effect: type[Effect], example: Effect, axis: str) -> str:
    """Equation, source, parameters, an example for a machine file, and the figure.

    It is reached from the list and by search: in the navigation of every page the effects would be half of it.
    """
    about = inspect.cleandoc(effect.__doc__ or "").replace("``", "`").replace("*", "\\*")
    rows = [(f"`{p.name}`", p.meaning, p.unit or "–", bounds(p), usual(p)) for p in effect.parameters()]
    stated = [f"{p.name} = {toml_value(getattr(example, p.name))}" for p in effect.parameters() if p.required]
    return "\n".join(
        [
            "---",
            "orphan: true",
            "---",
            f"# `{effect.kind}`",
            "",
            about,
            "",
            f"```text\n{effect.equation}\n```",
            "",
            f"Source: {effect.source}.",
            "",
            table(("parameter", "meaning", "unit", "bounds", "on real machines"), rows),
            "In a machine file:",
            "",
            "```toml",
            "[[effect]]",
            f'kind = "{effect.kind}"',
            *stated,
            "```",
            "",
            f"![Displacement along the approach by position and by time]({effect.kind}.svg)",
            "",
            f"The displacement of each probing along its approach, in {CYCLES} cycles on a gauge of 420 mm that lies"
            f" {axis}, while the room warms by 1 K in an hour; values of the example above. An effect on the scatter is"
            " shown as one standard deviation.",
            "",
        ]
    )


def bounds(p: Parameter) -> str:
    """The interval of permitted values, or the words to choose from."""
    if p.choices:
        return ", ".join(f"`{one}`" for one in p.choices)
    low = "" if np.isinf(p.low) else f"{'>' if p.open_low else '≥'} {p.low:g}"
    high = "" if np.isinf(p.high) else f"{'<' if p.open_high else '≤'} {p.high:g}"
    return ", ".join(one for one in (low, high) if one) or "–"


def usual(p: Parameter) -> str:
    """The range that occurs on real machines."""
    return "–" if p.sensible is None else f"{p.sensible[0]:g} to {p.sensible[1]:g}"


def toml_value(value: object) -> str:
    """A value as TOML writes it."""
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return str(value).lower() if isinstance(value, bool) else str(value)


@cache
def recording(direction: tuple[float, float, float]) -> tuple[pd.DataFrame, Setting]:
    """Cycles on the gauge along a direction, with times and temperatures; positions without noise."""
    gauge, machine = read_gauge("step-gauge-420"), read_machine("bridge-cmm")
    order = np.tile(np.r_[np.arange(gauge.n_faces)], CYCLES)
    way = np.where(order % 2 == 0, 1.0, -1.0)
    axis = np.array(direction)
    place = np.array([100.0, 150.0, 100.0]) + (gauge.position_mm[order] - 2.0 * way)[:, None] * axis
    time_s = 4.0 * np.arange(len(order))
    columns: dict[str, Any] = {"placement": 1, "cycle": np.arange(len(order)) // gauge.n_faces + 1, "face": order + 1}
    columns |= {f"{name}_mm": place[:, i] for i, name in enumerate("xyz")}
    columns |= {f"approach_{letter}": way * axis[i] for i, letter in enumerate("ijk")}
    warm_C = 20.0 + time_s / 3600.0
    columns |= {"time_s": time_s, "speed_mm_s": np.where(columns["cycle"] > 3, 8.0, 3.0)}
    columns |= {"gauge_temperature_C": warm_C, "scale_temperature_C": warm_C, "air_temperature_C": warm_C + 0.5}
    return pd.DataFrame(columns), Setting.of(machine, gauge, {1: axis})


def effect_figure(effect: Effect) -> tuple[str, Figure]:
    """The direction of the gauge in which the effect is largest, and the figure of the effect there."""
    shown: dict[str, tuple[pd.DataFrame, np.ndarray]] = {}
    for name, direction in DIRECTIONS.items():
        frame, setting = recording(direction)
        probings = Probings(frame, setting)
        scatter = effect.scatter_um(probings)
        um = along_approach_um(effect, probings) if scatter is None else scatter
        shown[name] = frame, np.broadcast_to(np.asarray(um, float), (len(frame),))
    name = max(shown, key=lambda one: float(np.ptp(shown[one][1])))
    return name, _draw(*shown[name])


def _draw(frame: pd.DataFrame, um: np.ndarray) -> Figure:
    figure = Figure(figsize=(7.0, 2.8), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    start = frame[["x_mm", "y_mm", "z_mm"]].iloc[0].to_numpy(float)
    along = np.linalg.norm(frame[["x_mm", "y_mm", "z_mm"]].to_numpy(float) - start, axis=1)
    for side, mark, words in ((1, ">", "fronts, forward"), (0, "<", "backs, backward")):
        rows = (frame["face"] % 2 == side).to_numpy()
        style = {"ls": "", "marker": mark, "ms": 3.5, "color": CYCLE[0 if side else 1], "alpha": 0.8}
        left.plot(along[rows], um[rows], label=words, **style)
        right.plot(frame["time_s"].to_numpy()[rows] / 60.0, um[rows], **style)
    left.set_xlabel("position along the gauge (mm)")
    right.set_xlabel("time (min)")
    left.set_ylabel("displacement (µm)")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    return figure


if __name__ == "__main__":
    for name, made in WRITTEN.items():
        (ROOT / "docs" / name).write_text(made(), encoding="utf-8")
