"""What is attacked: a small measurement with every kind of file, and every reader and verb that takes one."""

from __future__ import annotations

import contextlib
import io
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge.cli import cli
from stepgauge.files.resources import folder

EXAMPLES = folder("examples/demo").parent


@dataclass(frozen=True)
class Target:
    """A file that is damaged (``seed`` in the folder of the measurement) and what is done with the damaged one."""

    name: str
    seed: str
    run: Callable[[Path], Any]
    is_verb: bool = False


def call(*words: object) -> str:
    """A verb in this process; errors are raised. What it says on stderr."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
        cli.main(args=[str(word) for word in words], prog_name="stepgauge", standalone_mode=False)
    return said.getvalue()


def make_measurement(place: Path) -> None:
    """Gauge, machine, points, placement, programs, recordings, logs and results of the demo, blocks 1 to 6."""
    place.mkdir(parents=True, exist_ok=True)
    for name in ("points.csv", "machine.toml"):
        (place / name).write_bytes((EXAMPLES / "demo" / name).read_bytes())
    for name in ("dmis.dmo", "ippdme.log", "linuxcnc-log.txt", "points.xlsx", "protokoll.csv", "gauge.dmi"):
        (place / f"log-{name}").write_bytes((EXAMPLES / "import" / name).read_bytes())
    (place / "log-placement.toml").write_bytes((EXAMPLES / "import/placement.toml").read_bytes())
    for name in ("certificate.toml", "gauge-laboratory.toml"):
        (place / name).write_bytes((EXAMPLES / "certificate" / name).read_bytes())
    before = Path.cwd()
    os.chdir(place)
    try:
        _measure()
    finally:
        os.chdir(before)


def _measure() -> None:
    for name in ("step-gauge-420.toml", "omp40-2-50mm.toml"):
        call("list", "files", name, "--copy-to", ".")
    common = ("-g", "step-gauge-420.toml", "-m", "machine.toml")
    call("locate", "points.csv", *common, "-o", "placement.toml")
    for dialect, suffix in (("dmis", "dmi"), ("ippdme", "ipp"), ("linuxcnc", "ngc"), ("jinyoung", "jyc")):
        plan = ("--blocks", "1:6", "--cycles", 5, "-o", f"program.{suffix}")
        call("plan", "placement.toml", *common, "-d", dialect, *plan)
    run = ("-p", "placement.toml", "--seed", 3, "--gauge-temperature", 20.4, "-o", "recording.csv")
    call("simulate", "program.dmi", *common, *run)
    call("init", "project", *common, "-d", "dmis", "--operator", "A. Person")
    call("evaluate", "recording.csv", "-g", "step-gauge-420.toml", "-o", "result")
    call("budget", "recording.csv", *common, "-p", "placement.toml", "--runs", 0, "-o", "result")
    call("dcc", "export-gauge", "step-gauge-420.toml", "-c", "gauge-laboratory.toml", "-o", "gauge.xml")
    call("probe", "map", "omp40-2-50mm.toml", "--polar", "80,90", "--azimuth", "0:350:30", "-o", "map.csv")
    _sphere(Path("sphere.csv"))
    qualify = ("--sphere-diameter", 25.0, "--tip-diameter", 4.0, "-o", "qualification.json")
    call("probe", "qualify", "sphere.csv", *qualify)


def _sphere(path: Path) -> None:
    """25 points on a sphere of 25 mm with a tip of 4 mm that triggers 3 um late."""
    import numpy as np

    turn = np.arange(24)
    polar, azimuth = np.radians(90.0 - 22.0 * (turn % 4)), np.radians(15.0 * turn)
    normal = np.column_stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    normal = np.vstack([normal, [0.0, 0.0, 1.0]])
    rows = np.column_stack([np.array([400.0, 300.0, 200.0]) + 14.497 * normal, -normal])
    header = "x_mm,y_mm,z_mm,approach_i,approach_j,approach_k"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.7f")


def readers(place: Path) -> list[Target]:
    """Every reader by the function that its verbs call."""
    from stepgauge.alignment import locate
    from stepgauge.compensation import TableOptions, axis_faces, make_table
    from stepgauge.dcc.read import parse_document
    from stepgauge.dcc.xml import read_xml
    from stepgauge.evaluation.evaluate import evaluate
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.history.entries import read_entries
    from stepgauge.importing.logs import import_log, recognise_log
    from stepgauge.machine.file import read_machine
    from stepgauge.probes import read_probe
    from stepgauge.probes.files import read_points
    from stepgauge.probes.qualification import read_qualification
    from stepgauge.programs import read_program
    from stepgauge.project.file import read_project
    from stepgauge.project.status import project_status
    from stepgauge.recording import read_recording
    from stepgauge.reports.certificate_file import read_laboratory
    from stepgauge.reports.reading import read_checked_evaluation
    from stepgauge.standards.budget_files import read_budget
    from stepgauge.verbs.catalogue import VERBS

    gauge = read_gauge(place / "step-gauge-420.toml")
    lies = read_placement(place / "log-placement.toml", gauge)

    def imported(path: Path) -> Any:
        return import_log(path, recognise_log(path), gauge, lies)

    def compensated(path: Path) -> Any:
        return make_table(axis_faces(read_checked_evaluation(path), path, "y", angle_limit_deg=90.0), TableOptions())

    def resealed(path: Path) -> Any:
        """As somebody would who makes the checksum fit."""
        from stepgauge.files.checksum import checksum
        from stepgauge.files.text import read_json

        data = read_json(path)
        if isinstance(data, dict):
            path.write_text(json.dumps({**data, "checksum": checksum(data)}))
        return compensated(path)

    def historic(path: Path) -> Any:
        return read_entries(path, path.parent, "", "file")

    tables: list[tuple[str, str, Callable[[Path], Any]]] = [
        ("gauge", "step-gauge-420.toml", read_gauge),
        ("machine", "machine.toml", read_machine),
        ("project", "project/stepgauge.toml", lambda path: project_status(read_project(path, VERBS))),
        ("probe", "omp40-2-50mm.toml", read_probe),
        ("placement", "placement.toml", lambda path: read_placement(path, gauge)),
        ("certificate", "certificate.toml", read_laboratory),
        ("laboratory", "gauge-laboratory.toml", read_laboratory),
        ("points", "points.csv", lambda path: locate_points(path, gauge, locate)),
        ("recording", "recording.csv", lambda path: evaluate(read_recording(path), gauge)),
        ("evaluation", "result/evaluation.json", compensated),
        ("evaluation, resealed", "result/evaluation.json", resealed),
        ("evaluation in a history", "result/evaluation.json", historic),
        ("budget", "result/budget.json", read_budget),
        ("qualification", "qualification.json", read_qualification),
        ("sphere", "sphere.csv", read_points),
        ("gauge certificate", "gauge.xml", lambda path: parse_document(read_xml(path), path)),
        *(
            (f"program {kind}", f"program.{kind}", read_program_of(read_program))
            for kind in ("dmi", "ipp", "ngc", "jyc")
        ),
        *(
            (f"log {name}", f"log-{name}", imported)
            for name in ("dmis.dmo", "ippdme.log", "linuxcnc-log.txt", "points.xlsx", "protokoll.csv")
        ),
        ("exported program as a log", "log-gauge.dmi", imported),
    ]
    return [Target(*table) for table in tables]


def locate_points(path: Path, gauge: Any, locate: Any) -> Any:
    """The points of a file as ``locate`` takes them."""
    return call("locate", path, "-g", gauge.path, "-m", path.parent / "machine.toml", "-o", path.with_suffix(".out"))


def read_program_of(read_program: Any) -> Callable[[Path], Any]:
    """A program read with the settings of a controller."""
    from stepgauge.motion.moves import ProbingSettings

    return lambda path: read_program(path, ProbingSettings())


def verbs() -> list[Target]:
    """Every verb that takes a file of a person, run whole; outputs go to ``out``."""
    loose = ("--angle-limit", 10)
    g, m = ("-g", "step-gauge-420.toml"), ("-m", "machine.toml")
    lines: list[tuple[str, str, tuple[object, ...]]] = [
        ("locate", "points.csv", ("{}", *g, *m, "-o", "out/placement.toml")),
        ("plan", "placement.toml", ("{}", *g, *m, "-d", "dmis", "--blocks", "1:4", "-o", "out/p.dmi")),
        ("simulate", "program.dmi", ("{}", *g, *m, "-p", "placement.toml", "-o", "out/r.csv")),
        ("import", "log-dmis.dmo", ("{}", *g, "-p", "log-placement.toml", "-o", "out/r.csv")),
        ("export", "recording.csv", ("{}", "--to", "dmis", "-o", "out/r.dmo")),
        ("evaluate", "recording.csv", ("{}", *g, "-o", "out/e")),
        ("budget", "recording.csv", ("{}", *g, *m, "--runs", 0, "-o", "out/b")),
        ("budget", "recording.csv", ("{}", *g, *m, "--method", "monte-carlo", "--runs", 200, "-o", "out/u")),
        ("test iso230", "recording.csv", ("{}", *g, "-o", "out/i")),
        ("test iso10360", "recording.csv", ("{}", *g, "--mpe", "1.8 + L/350", "-o", "out/l")),
        ("compensate", "result/evaluation.json", ("{}", "--axis", "y", "--to", "csv", *loose, "-o", "out/c")),
        ("report", "result/evaluation.json", ("{}", "-o", "out/r.html")),
        ("evaluate", "recording.csv", ("{}", *g, *m, "--draw", "error", "-o", "out/f")),
        ("probe qualify", "sphere.csv", ("{}", "--sphere-diameter", 25, "--tip-diameter", 4, "-o", "out/q.json")),
        ("probe compensate", "sphere.csv", ("{}", "-q", "qualification.json", "-o", "out/c.csv")),
        ("probe map", "omp40-2-50mm.toml", ("{}", "--polar", "90", "--azimuth", "0:350:30", "-o", "out/m.csv")),
        ("dcc check", "gauge.xml", ("{}",)),
        ("dcc import-gauge", "gauge.xml", ("{}", "-o", "out/g.toml")),
    ]  # fmt: skip

    def runner(verb: str, words: tuple[object, ...]) -> Callable[[Path], Any]:
        def run(path: Path) -> Any:
            filled = [str(word).format(path.name) for word in words]
            with contextlib.chdir(path.parent):
                return call(*verb.split(), *filled)

        return run

    return [Target(verb, seed, runner(verb, words), True) for verb, seed, words in lines]
