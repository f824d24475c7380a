"""One command: make blind cases, diagnose them in a process that cannot see the truth, score, print the table.

    python -m benchmarks.blind.run --tool "stepgauge diagnose {recordings} --gauge {gauge} --machine {machine} -o {out}"

While tools run, no truth is on the disk: it stays in the memory of this process and is written to ``sealed/`` (0700,
files 0600) when the last diagnosis has ended. Run as root where the interpreter is open to everybody, the workers
become the user ``nobody`` besides.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from benchmarks.blind.figure import draw_reliability
from benchmarks.blind.generate import Case, add_selection, make_cases, seal, selected, with_combinations
from benchmarks.blind.left_out import KIND, deleted_kinds, forgetful, matrix, matrix_text, score_left_out
from benchmarks.blind.score import combinations_of, effects_of, score_case
from benchmarks.blind.statements import statements
from benchmarks.blind.table import summarise, text

HERE = Path(__file__).resolve().parent
STEPGAUGE = "stepgauge diagnose {recordings} --gauge {gauge} --machine {machine} -o {out}"
FORGET = "--without={kind}"
"""What tells stepgauge to forget a kind."""
BATCH = 25
"""Cases per worker process: the start-up is shared, a crash costs one case."""
KEPT = ("PATH", "PYTHONPATH", "LANG", "LC_ALL", "VIRTUAL_ENV")
REPORT_S = 30.0
Identity = Mapping[str, Any]


def other_user(folder: Path, tool: str) -> Identity:
    """How to start a process as ``nobody``; empty where that cannot be done or could not read what it must."""
    if os.name != "posix" or os.geteuid() != 0:
        return {}
    nobody: Identity = {"user": "nobody", "group": "nogroup", "extra_groups": []}
    script = tool.partition(" ")[0]
    needed = [str(folder), *([script] if script.endswith(".py") else [])]
    try:
        probe = [sys.executable, "-c", f"import numpy, os; [os.stat(one) for one in {needed!r}]"]
        done = subprocess.run(probe, cwd="/", capture_output=True, check=False, **nobody)
    except (OSError, KeyError, ValueError, subprocess.SubprocessError):
        return {}
    return nobody if done.returncode == 0 else {}


def diagnose(
    folders: list[Path], out: Path, tool: str, timeout_s: int, identity: Identity
) -> dict[str, dict[str, Any]]:
    """Run one worker over some public folders, again from the next one where it dies; answers by folder name."""
    answers: dict[str, dict[str, Any]] = {}
    left = list(folders)
    while left:
        lines = "".join(f"{folder}\t{out / folder.name}\n" for folder in left)
        command = [sys.executable, str(HERE / "worker.py"), tool, str(timeout_s)]
        done = subprocess.run(
            command, input=lines, capture_output=True, text=True, check=False, cwd=out, env=_environment(), **identity
        )
        got = [json.loads(line) for line in done.stdout.splitlines()]
        answers.update({Path(answer["folder"]).name: answer for answer in got})
        if len(got) < len(left):
            reason = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
            answers[left[len(got)].name] = {"seconds": None, "error": f"the worker died: {reason}"}
        left = left[len(got) + 1 :]
    return answers


def _environment() -> dict[str, str]:
    """The environment of a worker: one thread each, the paths of programs and modules, and nothing else."""
    kept = {key: value for key, value in os.environ.items() if key in KEPT}
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**kept, **threads, "MPLBACKEND": "Agg", "MPLCONFIGDIR": tempfile.gettempdir()}


def diagnose_all(
    folders_of: Mapping[str, list[Path]], out: Path, *, jobs: int, timeout_s: int, identity: Identity
) -> Iterator[dict[str, dict[str, Any]]]:
    """Diagnose the public folders of every tool with ``jobs`` workers at a time; the answers batch by batch."""
    batches = [(tool, part[k : k + BATCH]) for tool, part in folders_of.items() for k in range(0, len(part), BATCH)]
    total, done = sum(len(folders) for folders in folders_of.values()), 0
    began = time.perf_counter()
    with ThreadPoolExecutor(jobs) as pool:
        running = [pool.submit(diagnose, part, out, tool, timeout_s, identity) for tool, part in batches]
        for batch in as_completed(running):
            done += len(batch.result())
            print(f"{done} of {total} diagnosed, {time.perf_counter() - began:.0f} s", file=sys.stderr)
            yield batch.result()


def folders_by_tool(
    tool: str, truths: Iterable[Mapping[str, Any]], public: Path, *, left_out: bool
) -> dict[str, list[Path]]:
    """Which folders each tool gets, in mixed order: one tool for all, or one for each kind that it must forget."""
    folders: dict[str, list[Path]] = defaultdict(list)
    for truth in sorted(truths, key=lambda truth: str(truth["case"])):
        folders[forgetful(tool, deleted_kinds(truth)) if left_out else tool].append(public / truth["case"])
    return folders


def score_one(truth: Mapping[str, Any], out: Path, answer: Mapping[str, Any], *, left_out: bool) -> dict[str, Any]:
    """Score what lies in the out folder of a case."""
    diagnosis = read_diagnosis(out / truth["case"] / "diagnosis.json")
    if isinstance(diagnosis, Mapping) and not left_out:
        truth = with_combinations(dict(truth), combinations_of(effects_of(diagnosis)))
    result = (score_left_out if left_out else score_case)(truth, diagnosis)
    said = [] if left_out else statements(truth, diagnosis)
    return {**result, "statements": said, "seconds": answer["seconds"], "error": answer["error"]}


def read_diagnosis(path: Path) -> Any:
    """The content of a diagnosis, None where there is none or it is no JSON."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def tool_template(tool: str) -> str:
    """The template with a script's path made absolute: workers run elsewhere."""
    program, _, rest = tool.partition(" ")
    return f"{Path(program).resolve()} {rest}" if program.endswith(".py") else tool


def cases_of(options: argparse.Namespace) -> Sequence[Case]:
    """The cases that were asked for; of them the singles where their kind is to be left out."""
    cases = selected(options)
    return [case for case in cases if case.recipe.startswith("single:")] if options.left_out else cases


def benchmark(
    options: argparse.Namespace,
    folder: Path,
    done: Sequence[dict[str, Any]] = (),
    report: Callable[[list[dict[str, Any]]], None] = lambda results: None,
) -> tuple[list[dict[str, Any]], Identity]:
    """Generate, diagnose, score batch by batch, seal. Cases that are ``done`` are not made again.

    ``report`` is given all results so far after every batch.
    """
    public, out, results = folder / "public", folder / "out", list(done)
    began, known = time.perf_counter(), {result["case"] for result in done}
    cases = [case for case in cases_of(options) if case.case_id not in known]
    truths = {truth["case"]: truth for truth in make_cases(cases, public, options.jobs)}
    print(f"{len(truths)} cases made in {time.perf_counter() - began:.0f} s", file=sys.stderr)
    out.mkdir(parents=True)
    folder.chmod(0o755)
    identity = other_user(folder, options.tool)
    if identity:
        shutil.chown(out, identity["user"], identity["group"])
    folders = folders_by_tool(tool_template(options.tool), truths.values(), public, left_out=options.left_out)
    limits = {"jobs": options.jobs, "timeout_s": options.timeout, "identity": identity}
    for answers in diagnose_all(folders, out, **limits):
        for case, answer in answers.items():
            results.append(score_one(truths[case], out, answer, left_out=options.left_out))
            if not options.keep:
                shutil.rmtree(public / case)
                shutil.rmtree(out / case, ignore_errors=True)
        report(results)
    seal(folder / "sealed", truths.values())
    return results, identity


def problem_with(options: argparse.Namespace) -> str:
    """What contradicts itself in the options, in words; empty where nothing does."""
    if options.left_out and KIND not in options.tool:
        return f"--left-out: --tool must hold {KIND}, the kind to forget, e.g. {FORGET}"
    if KIND in options.tool and not options.left_out:
        return f"--tool holds {KIND}, which only --left-out fills in"
    if not cases_of(options):
        return f"no {'single' if options.left_out else 'case'} is selected"
    return ""


def options_of(argv: list[str] | None) -> argparse.Namespace:
    """The options of the command line; stepgauge's own template is told how to forget a kind."""
    parser = argparse.ArgumentParser(description="Blind benchmark of a diagnosis.")
    parser.add_argument("--tool", default=STEPGAUGE, help="command template (default: %(default)s)")
    add_selection(parser)
    parser.add_argument("--jobs", type=int, default=1, help="workers at a time (default 1)")
    parser.add_argument("--timeout", type=int, default=60, help="seconds that one case may take (default 60)")
    parser.add_argument("--keep", type=Path, help="new folder that keeps cases, diagnoses and truths; else temporary")
    parser.add_argument("-o", "--output", type=Path, default=Path("blind.json"), help="results (default blind.json)")
    parser.add_argument(
        "--left-out", action="store_true", help="singles only, each with its own kind forgotten ({kind} in --tool)"
    )
    parser.add_argument("--short", action="store_true", help="print classes only, not every recipe")
    parser.add_argument("--resume", action="store_true", help="keep the results that --output has, run what is missing")
    parser.add_argument("--figure", type=Path, help="draw the reliability of what is said, as .png and .svg")
    options = parser.parse_args(argv)
    if options.left_out and options.tool == STEPGAUGE:
        options.tool = f"{STEPGAUGE} {FORGET}"
    if problem := problem_with(options):
        parser.error(problem)
    return options


def content_of(options: argparse.Namespace, results: list[dict[str, Any]], *, complete: bool) -> dict[str, Any]:
    """What the JSON file holds."""
    chosen = {name: getattr(options, name) for name in ("first_seed", "seeds", "families", "names", "sizes", "nulls")}
    chosen |= {"sample": options.sample, "sample_seed": options.sample_seed}
    content: dict[str, Any] = {"tool": options.tool, "complete": complete, "selection": chosen}
    content |= {"summary": summarise(results), "cases": results}
    return content | ({"left_out": matrix(results)} if options.left_out else {})


def write_results(path: Path, content: Mapping[str, Any]) -> None:
    """Write the results where only their owner reads them, whole or not at all."""
    part = path.with_name(path.name + ".part")
    with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
        json.dump(content, file, indent=1)
    part.replace(path)


def reporter(options: argparse.Namespace) -> Callable[[list[dict[str, Any]]], None]:
    """Writes the results so far, at most every ``REPORT_S`` seconds, so that a run that is stopped loses little."""
    last_s = time.perf_counter()

    def report(results: list[dict[str, Any]]) -> None:
        nonlocal last_s
        if time.perf_counter() - last_s > REPORT_S:
            write_results(options.output, content_of(options, results, complete=False))
            last_s = time.perf_counter()

    return report


def main(argv: list[str] | None = None) -> None:
    options = options_of(argv)
    done = json.loads(options.output.read_text())["cases"] if options.resume and options.output.exists() else []
    folder = options.keep or Path(tempfile.mkdtemp(prefix="blind-"))
    try:
        results, identity = benchmark(options, folder.resolve(), done, reporter(options))
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    user = identity.get("user", "the same user")
    content = {**content_of(options, results, complete=True), "worker_user": user}
    write_results(options.output, content)
    if options.figure:
        for suffix in (".png", ".svg"):
            draw_reliability(content["summary"]["reliability"], options.figure.with_suffix(suffix))
    print(matrix_text(content["left_out"]) if options.left_out else text(content["summary"], recipes=not options.short))
    errors = [result for result in results if result["error"]]
    if errors:
        print(f"errors: {len(errors)} cases, first {errors[0]['case']}: {errors[0]['error']}")
    print(f"workers ran as {user}; results in {options.output}")


if __name__ == "__main__":
    main()
