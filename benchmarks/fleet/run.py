"""Make fleets, let the command line infer, score: the proof of the fleet's inference in one command.

    python -m benchmarks.fleet.run --seeds 1000-1003 --recordings 2000

The tool is given the open folder only; the truth is in the memory of this process until the answer is there, and on
disk afterwards if ``--keep`` names a folder. ``--add`` and ``--infer`` are the commands; ``{roster}``,
``{recordings}``, ``{store}`` and ``{answer}`` in them are filled in, and ``stepgauge`` is the package that this
interpreter imports.
"""

from __future__ import annotations

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.blind.generate import seal
from benchmarks.fleet.generate import add_extent, make
from benchmarks.fleet.score import Result, read_answer, score, summary, text

ADD = "stepgauge fleet add {store} {recordings} --roster {roster}"
INFER = "stepgauge fleet infer {store} -o {answer}"


def command(template: str, recordings: Path, **paths: Path) -> list[str]:
    """The words of a command with its paths filled in, stepgauge being a module of this interpreter."""
    words: list[str] = []
    for word in shlex.split(template):
        files = sorted(recordings.iterdir()) if word == "{recordings}" else []
        words += [str(file) for file in files] or [word.format(**paths)]
    return [sys.executable, "-m", "stepgauge", *words[1:]] if words[0] == "stepgauge" else words


def infer(folder: Path, add: str, infer_with: str) -> dict[str, float]:
    """Run both commands on ``folder/open``; seconds of each. ``RuntimeError`` with the last line of what failed."""
    paths = {"store": folder / "store", "roster": folder / "open" / "fleet.csv", "answer": folder / "answer.json"}
    paths["recordings"] = folder / "open" / "recordings"
    seconds = {}
    for name, template in (("add", add), ("infer", infer_with)):
        began = time.perf_counter()
        done = subprocess.run(command(template, **paths), capture_output=True, text=True, check=False)
        seconds[name] = time.perf_counter() - began
        if done.returncode:
            raise RuntimeError(f"{name}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return seconds


def seeds_of(words: str) -> list[int]:
    """``1,5-7`` is 1, 5, 6, 7."""
    ends = [[int(end) for end in part.split("-")] for part in words.split(",")]
    return [seed for end in ends for seed in range(end[0], end[-1] + 1)]


def judge(options: argparse.Namespace, seed: int, folder: Path) -> tuple[Result, dict[str, Any]]:
    """One fleet from its making to its score."""
    extent = {"machines": options.machines, "gauges": options.gauges}
    truth = make(folder / "open", seed, options.recordings, options.strength, **extent)
    seconds = infer(folder, options.add, options.infer)
    seal(folder / "sealed", [truth])
    result = score(truth, read_answer(folder / "answer.json"))
    return result, {"seed": seed, "seconds": seconds, **summary(result)}


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Benchmark of the inference over a fleet.")
    parser.add_argument("--seeds", default="1", help="such as 1000-1003,1010; 1 to 99 to develop, 1000 on to judge")
    add_extent(parser)
    parser.add_argument("--add", default=ADD, help="command that fills the store (default: %(default)s)")
    parser.add_argument("--infer", default=INFER, help="command that writes the answer (default: %(default)s)")
    parser.add_argument("--keep", type=Path, help="new folder that keeps fleets, stores, answers and truths")
    parser.add_argument("-o", "--output", type=Path, help="the figures as JSON")
    options = parser.parse_args(argv)
    folder = options.keep or Path(tempfile.mkdtemp(prefix="fleet-"))
    total, fleets = Result(), []
    try:
        for seed in seeds_of(options.seeds):
            result, figures = judge(options, seed, folder.resolve() / str(seed))
            total.add(result)
            fleets.append(figures)
            spent = ", ".join(f"{name} {value:.0f} s" for name, value in figures["seconds"].items())
            print(f"seed {seed}: {spent}", file=sys.stderr)
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    print(text(total))
    if options.output:
        options.output.write_text(json.dumps({"total": summary(total), "fleets": fleets}, indent=1))


if __name__ == "__main__":
    main()
