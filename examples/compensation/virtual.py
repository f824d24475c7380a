"""Compensation proved on the virtual CMM: measured, compensated by a table, measured again somewhere else."""

from __future__ import annotations

from pathlib import Path

import click

from stepgauge.cli import run_command, show_and_run
from stepgauge.evaluation.files import read_evaluation

HERE = Path(__file__).resolve().parent
GAUGE, MACHINE = "step-gauge-420", HERE / "machine.toml"
R_EFF_MM, U_R_EFF_UM = "1.997", "0.1"
"""What a calibration on a sphere would have given: tip radius less pre-travel."""


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for all that comes out.")
def main(output: Path) -> None:
    """Measure, write tables for three controllers, apply one of them on the virtual CMM, and measure again."""
    before = measure(output, "before", MACHINE, HERE / "placement.toml", "1:21", 1)
    table = ["compensate", before, "--axis", "x", "--tip-radius", R_EFF_MM, "--u-tip-radius", U_R_EFF_UM]
    show_and_run(*table, "--to", "csv", "-o", str(output / "x.csv"), "--plot", str(output / "x.png"))
    show_and_run(*table, "--to", "linuxcnc", "-o", str(output / "x.comp"))
    show_and_run(*table, "--to", "siemens", "--step", "20", "--zero-at", "120", "-o", str(output / "AX1_EEC.INI"))
    corrected = output / "corrected.toml"
    effect = '\n[[effect]]\nkind = "axis_compensation"\naxis = "x"\nfile = "x.csv"\n'
    corrected.write_text(MACHINE.read_text(encoding="utf-8") + effect, encoding="utf-8")
    after = measure(output, "after", corrected, HERE / "check.toml", "1:20", 2)
    for name in (before, after):
        result = read_evaluation(Path(name) / "evaluation.json")
        band, worst = result["band_um"], result["worst_two_sigma_um"]
        click.echo(f"{name}: range of XM {band:.2f} um, largest 2s {worst:.2f} um, R_eff {result['r_eff_mm']:.5f} mm")


def measure(output: Path, name: str, machine: Path, placement: Path, blocks: str, seed: int) -> str:
    """Plan, simulate and evaluate; the folder of the evaluation."""
    program, recording, result = (str(output / f"{name}{end}") for end in (".dmi", ".csv", ""))
    common = ["-g", GAUGE, "-m", str(machine)]
    plan = ["plan", str(placement), *common, "-d", "dmis", "--blocks", blocks, "--cycles", "5", "-o", program]
    show_and_run(*plan)
    show_and_run("simulate", program, *common, "-p", str(placement), "--seed", str(seed), "-o", recording)
    show_and_run("evaluate", recording, "-g", GAUGE, "-o", result)
    return result


if __name__ == "__main__":
    run_command(main, "virtual.py")
