"""Make a fleet: what an inference may see into ``open/``, what is hidden into ``sealed/truth.json``.

    python -m benchmarks.fleet.generate --seed 1 --recordings 1000 FLEET

Seeds 1 to 99 are for developers; who judges takes seeds from 1000 on, which nobody develops with. The strength (1 or
0.5) multiplies the causes only: everything else is the same at both. Nothing here, nor in what this module imports,
uses the package under test.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind.generate import seal
from benchmarks.fleet import parts
from benchmarks.fleet.causes import Cause, act, truth_of
from benchmarks.fleet.design import Fleet, make_fleet
from benchmarks.fleet.parts import Array
from benchmarks.fleet.physics import record, usual_errors
from benchmarks.fleet.plant import plant
from benchmarks.fleet.writers import write_gauge, write_machine, write_recording, write_roster


def readings(fleet: Fleet, number: int, causes: list[Cause], seed: int) -> dict[str, Array]:
    """Columns of one recording; every recording has random numbers of its own."""
    recording = fleet.recordings[number]
    machine, gauge = fleet.machines[recording.machine], fleet.gauges[recording.gauge]
    random = np.random.default_rng([seed, 3, number])
    probe_um = parts.PROBE_UM * float(np.random.default_rng([seed, 4, int(recording.probe[1:])]).standard_normal())
    errors = usual_errors(machine, probe_um, random)
    for cause in causes:
        if cause.acts(fleet, recording):
            act(cause, errors, fleet, recording)
    return record(recording, machine, gauge, errors, random)


def make(folder: Path, seed: int, recordings: int, strength: float = 1.0, **extent: int) -> dict[str, Any]:
    """Write the open part of a fleet and return its truth, which does not touch the disk here."""
    fleet = make_fleet(seed, recordings, **extent)
    causes = plant(fleet, seed, strength)
    (folder / "recordings").mkdir(parents=True)
    for gauge in fleet.gauges:
        write_gauge(folder / "gauges", gauge)
    for machine in fleet.machines:
        write_machine(folder / "machines", machine)
    for number, recording in enumerate(fleet.recordings):
        machine, gauge = fleet.machines[recording.machine], fleet.gauges[recording.gauge]
        write_recording(folder / "recordings", recording.name, machine, gauge, readings(fleet, number, causes, seed))
    write_roster(folder / "fleet.csv", fleet)
    return {
        "case": "truth",
        "seed": seed,
        "strength": strength,
        "recordings": len(fleet.recordings),
        "causes": [truth_of(cause, fleet, strength) for cause in causes],
    }


def add_extent(parser: argparse.ArgumentParser) -> None:
    """Options that say which fleet, shared with the runner."""
    parser.add_argument("--recordings", type=int, default=1000, help="number of recordings (default 1000)")
    parser.add_argument("--machines", type=int, default=200, help="machines at most (default 200)")
    parser.add_argument("--gauges", type=int, default=20, help="gauges at most (default 20)")
    parser.add_argument("--strength", type=float, default=1.0, help="strength of all causes, 1 or 0.5 (default 1)")


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Make a fleet with hidden causes.")
    parser.add_argument("folder", type=Path, help="new folder; gets open/ and sealed/")
    parser.add_argument("--seed", type=int, default=1, help="1 to 99 to develop, 1000 and above to judge (default 1)")
    add_extent(parser)
    options = parser.parse_args(argv)
    extent = {"machines": options.machines, "gauges": options.gauges}
    truth = make(options.folder / "open", options.seed, options.recordings, options.strength, **extent)
    seal(options.folder / "sealed", [truth])
    print(f"{truth['recordings']} recordings in {options.folder / 'open'}, {len(truth['causes'])} causes sealed")


if __name__ == "__main__":
    main()
