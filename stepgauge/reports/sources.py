"""The files that are given with an evaluation, each checked to belong to it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stepgauge.conditions import require_statement, stored_conditions
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, read_placement
from stepgauge.machine.file import Machine, read_machine
from stepgauge.reports.certificate_file import (
    check_days,
    check_filled,
    check_item,
    check_room,
    check_simulated,
    read_laboratory,
)
from stepgauge.reports.content import Sources
from stepgauge.reports.reading import (
    check_certificate,
    check_gauge,
    check_machine,
    check_placements,
    check_u_certificate,
)
from stepgauge.standards.budget_files import StoredBudget, resolve_budget
from stepgauge.standards.budget_given import check_given
from stepgauge.standards.conformity import limit_of


def read_sources(
    evaluation: dict[str, Any],
    gauge: str | Path | Gauge | None = None,
    placements: Sequence[str | Path | Placement] = (),
    machine: str | Path | Machine | None = None,
    budget: str | Path | StoredBudget | None = None,
    laboratory: str | Path | None = None,
    mpe: str | None = None,
) -> Sources:
    """What is given beside an ``evaluation.json``: objects, their files, or shipped names of gauge and machine.

    Placements are checked against the gauge, so they need one (else ValueError). :class:`InputError` where a file is
    not that of the evaluation, and as the readers; with a ``laboratory`` also where a condition of the readings
    prevents a statement.
    """
    if placements and gauge is None:
        raise ValueError("placements are checked against their gauge, which is missing")
    steps = gauge if isinstance(gauge, Gauge) else read_gauge(gauge) if gauge else None
    if steps is not None:
        check_gauge(evaluation, steps)
    lies = [one if isinstance(one, Placement) else read_placement(one, steps) for one in placements] if steps else []
    names = ["placement" if isinstance(one, Placement) else str(one) for one in placements]
    check_placements(evaluation, lies, names)
    cmm = machine if isinstance(machine, Machine) else read_machine(machine) if machine else None
    if cmm is not None:
        check_machine(evaluation, cmm)
    sure = resolve_budget(budget, evaluation) if budget else None
    if sure is not None:
        name = "budget" if isinstance(budget, StoredBudget) else str(budget)
        if sure.given is not None:
            check_certificate(evaluation, sure.given["gauge"], name)
            check_u_certificate(evaluation, sure.given["gauge"], name)
        check_given(sure.given, name, steps, cmm, list(zip(lies, names, strict=True)))
    said = read_laboratory(laboratory) if laboratory else None
    if said is not None:
        largest = None if sure is None else max(line.expanded_um for line in sure.quantities)
        require_statement(stored_conditions(evaluation).weighed(largest), evaluation["recording"])
        check_filled(said)
        check_item(said, evaluation, cmm)
        check_days(said, evaluation)
        check_simulated(said, evaluation)
        check_room(said, evaluation)
    certified = None if said is None else said.statements.mpe
    limit = limit_of(evaluation["comments"], cmm, asked=mpe, certified=certified, stored=evaluation.get("mpe"))
    return Sources(steps, cmm, lies, sure, said, limit)
