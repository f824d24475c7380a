"""The files that are given with an evaluation, each checked to belong to it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placements
from stepgauge.machine.file import read_machine
from stepgauge.report.certificate_file import check_filled, read_laboratory
from stepgauge.report.content import Sources
from stepgauge.report.reading import check_gauge, check_machine, check_placements
from stepgauge.standards.budget_files import check_budget, read_budget


def read_sources(
    evaluation: dict[str, Any],
    gauge: str | Path | None = None,
    placements: Sequence[str] = (),
    machine: str | Path | None = None,
    budget: str | Path | None = None,
    laboratory: str | Path | None = None,
) -> Sources:
    """Read what is given beside an ``evaluation.json``: files, or shipped names of gauge and machine.

    Placements are checked against the gauge, so they need one (else ValueError). :class:`InputError` where a file is
    not that of the evaluation, and as the readers.
    """
    if placements and gauge is None:
        raise ValueError("placements are checked against their gauge, which is missing")
    steps = read_gauge(gauge) if gauge else None
    if steps is not None:
        check_gauge(evaluation, steps)
    lies = read_placements(placements, steps) if steps else []
    check_placements(evaluation, lies, placements)
    cmm = read_machine(machine) if machine else None
    if cmm is not None:
        check_machine(evaluation, cmm)
    sure = read_budget(budget) if budget else None
    if sure is not None and budget:
        check_budget(sure, evaluation, budget)
    said = read_laboratory(laboratory) if laboratory else None
    if said is not None:
        check_filled(said)
    return Sources(steps, cmm, lies, sure, said)
