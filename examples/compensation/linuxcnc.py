"""The proof on a real controller: LinuxCNC with a hidden screw error, compensated by COMP_FILE and measured again.

Exit code 0: what is left of XM is within the controller's latch error and the interpolation of the table; 1: it is not;
2: wrong input, LinuxCNC missing or stopped.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "linuxcnc"))
from controller import Drives, ScrewTable, latch_bound_um, require_linuxcnc, run_program  # noqa: E402
from hal_gauge import render_hal  # noqa: E402

from stepgauge.cli import run_command, show_and_run  # noqa: E402
from stepgauge.errors import InputError  # noqa: E402
from stepgauge.evaluation.files import read_evaluation  # noqa: E402
from stepgauge.files.tables import read_numbers  # noqa: E402
from stepgauge.gauge.certified import read_gauge  # noqa: E402
from stepgauge.gauge.placement import read_placement  # noqa: E402
from stepgauge.machine.file import read_machine  # noqa: E402
from stepgauge.motion.moves import ProbingSettings  # noqa: E402
from stepgauge.programs import read_program  # noqa: E402

GAUGE, MACHINE = "step-gauge-420", str(HERE.parent / "linuxcnc" / "machine.toml")
LOG, STANDOFF_MM, PLAY_UM = "stepgauge-probe-log.txt", 0.6, 5.0
INTERPOLATION_UM = 0.3
"""Largest error of straight lines between faces 20 mm apart, for the bends of screw.csv."""


@click.command(context_settings={"show_default": True})
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for all that comes out.")
@click.option("--file-type", type=click.IntRange(0, 1), default=0, help="COMP_FILE_TYPE: 0 positions, 1 trims.")
def main(output: Path, file_type: int) -> None:
    """Measure LinuxCNC's x axis, write its screw compensation file, and measure it again with that file in the INI."""
    require_linuxcnc()
    measure(output / "before", HERE / "before.toml", "1:8", Drives())
    comp = output / "x.comp"
    tip = str(read_machine(MACHINE).probe.tip_radius_mm)
    table = ["compensate", str(output / "before"), "--axis", "x", "--to", "linuxcnc", "--tip-radius", tip]
    show_and_run(*table, "--file-type", str(file_type), "-o", str(comp))
    drives = Drives(screw_tables={0: ScrewTable(comp.read_text(encoding="utf-8"), file_type)})
    measure(output / "after", HERE / "after.toml", "2:8", drives)
    sys.exit(0 if report(output) else 1)


def measure(folder: Path, placement: Path, blocks: str, drives: Drives) -> None:
    """Plan, run on LinuxCNC with the hidden screw, import and evaluate."""
    program, recording = str(folder / "program.ngc"), str(folder / "recording.csv")
    where = [
        "-g",
        GAUGE,
        "-m",
        MACHINE,
        "--blocks",
        blocks,
        "--cycles",
        "1",
    ]  # the simulated controller repeats exactly
    show_and_run("plan", str(placement), *where, "-d", "linuxcnc", "--standoff", str(STANDOFF_MM), "-o", program)
    click.echo(f"$ linuxcnc -r {folder / 'simulation.ini'}")
    moves = read_program(program, ProbingSettings(standoff_mm=STANDOFF_MM))
    text = Path(program).read_text(encoding="utf-8")
    outcome = run_program(text, moves, read_machine(MACHINE), hidden_hal(placement), folder, drives)
    if outcome.error:
        raise InputError(f"{program}:{outcome.line}", f"LinuxCNC stopped: {outcome.error}")
    click.echo(f"{outcome.seconds:.1f} s")
    origin = ["--program", program, "-g", GAUGE, "-p", str(placement)]
    show_and_run("import", str(folder / LOG), "--format", "linuxcnc", *origin, "-o", recording)
    show_and_run("evaluate", recording, "-g", GAUGE, "-o", str(folder))


def hidden_hal(placement: Path) -> str:
    """The gauge as certified, behind a screw that stepgauge is not told of."""
    gauge, machine = read_gauge(GAUGE), read_machine(MACHINE)
    screw = read_numbers(HERE / "screw.csv", ("motor_mm", "error_um"))
    table_mm = screw["motor_mm"] + screw["error_um"] * 1e-3
    return render_hal(
        gauge,
        read_placement(placement, gauge),
        np.zeros(gauge.n_faces),
        machine.probe.tip_radius_mm,
        HERE / "hidden.hal.j2",
        screw=list(zip(screw["motor_mm"], table_mm, strict=True)),
        play_mm=PLAY_UM * 1e-3,
    )


def report(output: Path) -> bool:
    """Both results side by side, and whether the second is what latch and interpolation leave."""
    bound_um = latch_bound_um(read_machine(MACHINE).table.measuring_speed_mm_s) + INTERPOLATION_UM
    click.echo("\n       range of XM   largest |XM|   R_eff     (um, um, mm)")
    largest = {}
    for name in ("before", "after"):
        result = read_evaluation(output / name / "evaluation.json")
        xm = np.array([row["xm_um"] for row in result["placements"][0]["faces"] if row["xm_um"] is not None])
        largest[name] = float(np.abs(xm).max())
        click.echo(f"{name:7s} {result['band_um']:10.3f} {largest[name]:14.3f} {result['r_eff_mm']:10.5f}")
    agrees = largest["after"] <= bound_um < largest["before"]
    click.echo(f"latch error and interpolation leave {bound_um:.2f} um: {'reached' if agrees else 'NOT reached'}")
    return agrees


if __name__ == "__main__":
    run_command(main, "linuxcnc.py")
