"""The whole story of an investigation as JSON types: what was asked, why, what was learnt, and how it ended."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.files.text import write_files
from stepgauge.investigation.feasible_runs import placement_json
from stepgauge.investigation.loop import Investigation
from stepgauge.investigation.running import joined
from stepgauge.machine.styli import stylus_words
from stepgauge.recording.simulated import is_simulated

FORMAT = "stepgauge investigation 1"
OF_THE_JOURNAL = ("proposed", "chosen", "end", "needed", "minutes_allowed")
"""What is known after a run and told elsewhere, or of the journal alone."""


def story_of(found: Investigation) -> dict[str, Any]:
    """Every run with the reason for it and what was known after it; the end; what is not to be had."""
    case, last = found.case, found.learnt[-1]
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "gauge": {
            "name": case.gauge.table.name,
            "serial": case.gauge.table.serial,
            "example": case.gauge.certificate.example,
        },
        "machine": case.machine.table.name,
        "simulated": is_simulated(joined(list(found.runs)).comments),
        "styli": [stylus_words(case.machine, number + 1) for number in range(len(case.machine.styli) + 1)],
        "asked": {"odds": case.odds, "minutes": case.minutes, "without": list(case.without)},
        "runs": [_run(found, number) for number in range(len(found.runs))],
        "end": last["end"],
        "needed": last["needed"],
        "declined": found.declined,
        "machine_minutes": sum(made.machine_minutes for made in found.runs),
        "minutes": found.spent_minutes,
    }


def _run(found: Investigation, number: int) -> dict[str, Any]:
    made, learnt = found.runs[number], found.learnt[number]
    chosen = found.learnt[number - 1].get("chosen") if number else None
    return {
        "number": number + 1,
        "words": made.run.words,
        "why": chosen and {key: value for key, value in chosen.items() if key != "run"},
        "placement": made.placement_number,
        "stylus": made.run.stylus,
        "lies": placement_json(made.lies),
        "recording": made.path.name,
        "machine_minutes": made.machine_minutes,
        "minutes": made.minutes,
        "learnt": {key: value for key, value in learnt.items() if key not in OF_THE_JOURNAL},
    }


def write_story(folder: Path, found: Investigation) -> list[Path]:
    """``investigation.json`` and ``investigation.md``; returns their paths."""
    from stepgauge.reports.investigation import investigation_story
    from stepgauge.reports.render import markdown

    said = story_of(found)
    story = markdown(investigation_story(said))
    return write_files(folder, {"investigation.json": said, "investigation.md": story})
