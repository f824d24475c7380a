"""Eight calibrations of one machine over two years on the virtual CMM: its x scale grows, once its reversal jumps."""

from __future__ import annotations

from pathlib import Path

import click

from stepgauge.cli import run_command, show_and_run

HERE = Path(__file__).resolve().parent
GAUGE = "step-gauge-420"
DATES = {
    "2024-01-15": (1.0, 0.8),
    "2024-04-16": (1.5, 0.9),
    "2024-07-10": (2.1, 0.8),
    "2024-10-08": (2.4, 0.9),
    "2025-01-14": (3.1, 0.8),
    "2025-04-09": (3.4, 3.2),
    "2025-07-15": (4.1, 0.9),
    "2025-10-14": (4.4, 0.8),
}
"""By date what the machine is given: x scale too long by, um/m; reversal of x, um."""


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for all that comes out.")
def main(output: Path) -> None:
    """Measure along x and along y at every date, evaluate, and draw the history."""
    archive = output / "archive"
    for number, (date, (ppm, reversal_um)) in enumerate(DATES.items()):
        machine = archive / date / "machine.toml"
        machine.parent.mkdir(parents=True, exist_ok=True)
        machine.write_text(machine_text(ppm, reversal_um), encoding="utf-8")
        for axis in ("x", "y"):
            measure(archive / date, axis, 2 * number + (axis == "y"), date)
    limits = ["--limit", "scale_ppm=4", "--limit", "reversal_um=2", "--limit", "band_um=2.5"]
    show_and_run("history", str(archive), *limits, "-o", str(output / "history"))


def machine_text(ppm: float, reversal_um: float) -> str:
    """The machine as it was at that date; only the virtual CMM reads it."""
    effects = [
        f'kind = "scale_error"\naxis = "x"\nppm = {ppm}',
        f'kind = "reversal_error"\naxis = "x"\num = {reversal_um}',
    ]
    text = (HERE / "machine.toml").read_text(encoding="utf-8")
    return text + "".join(f"\n[[effect]]\n{effect}\n" for effect in effects)


def measure(folder: Path, axis: str, seed: int, date: str) -> None:
    """Plan, simulate and evaluate one placement."""
    machine, placement = str(folder / "machine.toml"), str(HERE / f"along-{axis}.toml")
    program, recording = str(folder / f"{axis}.dmi"), str(folder / f"{axis}.csv")
    common = ["-g", GAUGE, "-m", machine]
    show_and_run("plan", placement, *common, "-d", "dmis", "--cycles", "5", "-o", program)
    show_and_run("simulate", program, *common, "-p", placement, "--seed", str(seed), "-o", recording)
    show_and_run("evaluate", recording, "-g", GAUGE, "--measured-at", date, "-o", str(folder / axis))


if __name__ == "__main__":
    run_command(main, "make.py")
