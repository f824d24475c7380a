"""A budget with values that no file states yet: what each would add, without all of it computed anew for each value.

Sources are independent, and each one's contribution grows in proportion to its standard uncertainty. So the budget is
computed once with a usual value for every open source, and scaled from there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine, StandardUncertainty
from stepgauge.machine.uncertain import Uncertain
from stepgauge.montecarlo import ModelOptions, read_model
from stepgauge.montecarlo.inputs import GAUGE_TEMPERATURE
from stepgauge.recording import Recording
from stepgauge.standards.budget import make_budget
from stepgauge.standards.budget_files import StoredBudget, StoredGap, StoredLine, stored_budget
from stepgauge.standards.budget_sources import PROBING, RESOLUTION, BudgetOptions
from stepgauge.standards.budget_unstated import missing
from stepgauge.standards.coverage import coverage_factor


@dataclass(frozen=True)
class OpenSource:
    """A value that may be tried: ``source`` and ``what`` it is called in a budget; ``toml``: where it is stated.

    ``usual``: standard uncertainty that the budget is computed with; ``most``: largest that is tried; both in ``unit``.
    """

    source: str
    what: str
    unit: str
    usual: float
    most: float
    toml: str


OPEN_SOURCES = {
    "gauge_temperature": OpenSource(
        GAUGE_TEMPERATURE, "temperature of the gauge", "K", 0.1, 1.0, "[uncertainty]\ngauge_temperature_K = {u:g}"
    ),
    "scale_temperature": OpenSource(
        "machine.temperature_C",
        "temperature of the scales",
        "K",
        0.1,
        1.0,
        "[machine]\ntemperature_C = {{ value = {value:g}, u = {u:g} }}",
    ),
    "scale_expansion": OpenSource(
        "machine.scale_expansion_per_K",
        "expansion of the scales",
        "1e-6/K",
        0.5,
        2.0,
        "[machine]\nscale_expansion_per_K = {{ value = {value:g}, u = {u:g}e-6 }}",
    ),
    "probing": OpenSource(PROBING, "probing", "um", 0.2, 2.0, "[uncertainty]\nprobing_um = {u:g}"),
    "resolution": OpenSource(RESOLUTION, "resolution", "um", 0.1, 2.0, "[uncertainty]\nresolution_um = {u:g}"),
}
"""By name; of the resolution it is the step that is stated."""


@dataclass(frozen=True)
class BudgetTrial:
    """``usual``: the budget with every open source at its usual value; ``names``: of the open ones."""

    usual: StoredBudget
    names: tuple[str, ...]

    def replace_values(self, values: Mapping[str, float]) -> StoredBudget:
        """The budget with these standard uncertainties, by name and in their units; what is 0 or missing stays open.

        There is no Monte Carlo, so that ``same_terms_u_um``, which stands beside one, is left as it was.
        """
        share = {
            one.source: values.get(name, 0.0) / one.usual for name, one in OPEN_SOURCES.items() if name in self.names
        }
        without = {source for source, factor in share.items() if factor <= 0.0}
        sources = [
            one.model_copy(update={"u_min": one.u_min * share.get(one.name, 1.0), "u_max": one.u_max * share[one.name]})
            if one.name in share
            else one
            for one in self.usual.sources
            if one.name not in without
        ]
        open_ = [
            StoredGap(source=one.source, what=one.what, state_by=f"{one.toml.split()[0]} of the machine file")
            for name, one in OPEN_SOURCES.items()
            if name in self.names and one.source in without
        ]
        percent = self.usual.coverage_percent
        lines = [_scaled(line, share, percent) for line in self.usual.quantities]
        lines = [_through_r_eff(line, self.usual, lines) for line in lines]
        gaps = [*self.usual.not_included, *open_]
        return self.usual.model_copy(update={"sources": sources, "quantities": lines, "not_included": gaps})


def machine_statement(machine: Machine, values: Mapping[str, float]) -> str:
    """The lines of a machine file that state these values, by table."""
    table = machine.table
    value = {"scale_temperature": table.temperature_C, "scale_expansion": table.scale_expansion_per_K}
    lines: dict[str, list[str]] = {}
    for name, u in values.items():
        if u > 0.0:
            head, line = OPEN_SOURCES[name].toml.format(u=u, value=value.get(name)).split("\n")
            lines.setdefault(head, []).append(line)
    return "\n\n".join("\n".join([head, *some]) for head, some in lines.items())


def _scaled(line: StoredLine, share: Mapping[str, float], percent: float) -> StoredLine:
    """A line with some contributions changed; those have infinite degrees of freedom (Welch-Satterthwaite)."""
    parts = {
        name: um * share.get(name, 1.0) for name, um in line.contributions_um.items() if share.get(name, 1.0) > 0.0
    }
    u = math.hypot(*parts.values())
    of_limited = 0.0 if line.dof is None or line.dof == 0.0 else line.u_um**4 / line.dof
    dof = math.inf if of_limited == 0.0 else u**4 / of_limited
    k = coverage_factor(dof, percent)
    changed = {"u_um": u, "dof": None if math.isinf(dof) else dof, "k": k, "expanded_um": k * u}
    return line.model_copy(update={**changed, "contributions_um": parts})


def _through_r_eff(line: StoredLine, before: StoredBudget, lines: Sequence[StoredLine]) -> StoredLine:
    """What comes by way of the effective radius grows as its uncertainty does."""
    was = before.find("r_eff", line.placement, None)
    now = next((one for one in lines if one.quantity == "r_eff" and one.placement == line.placement), None)
    if was is None or now is None or was.u_um == 0.0:
        return line
    return line.model_copy(update={"through_r_eff_um": line.through_r_eff_um * now.u_um / was.u_um})


def budget_trial(
    recordings: Sequence[Recording], machine: Machine, gauge: Gauge, asked: BudgetOptions, options: ModelOptions
) -> BudgetTrial:
    """The budget of recordings, without a Monte Carlo, ready to be tried with values that no file states.

    Parameters
    ----------
    recordings, machine, gauge : what was measured, with what
    asked, options : as :func:`stepgauge.standards.budget.make_budget` and :func:`stepgauge.montecarlo.read_model`
    """
    said = missing(read_model(recordings, machine, gauge, asked.placements, options), asked)
    by_file = {one.source for one in said if one.state_by.endswith("machine file")}  # only such a value can be tried
    names = tuple(name for name, one in OPEN_SOURCES.items() if one.source in by_file)
    model = read_model(recordings, _opened(machine, names), gauge, asked.placements, options)
    return BudgetTrial(stored_budget(model, make_budget(model, asked), 0), names)


def _opened(machine: Machine, names: Sequence[str]) -> Machine:
    """The machine with the usual values of open sources stated."""
    usual = {name: OPEN_SOURCES[name].usual for name in names}
    stated = {
        key: StandardUncertainty(u=usual[name])
        for name, key in (("gauge_temperature", "gauge_temperature_K"), ("probing", "probing_um"))
        if name in usual
    }
    step = {"resolution_um": usual["resolution"]} if "resolution" in usual else {}
    table = machine.table
    known = (("scale_temperature", table.temperature_C, 1.0), ("scale_expansion", table.scale_expansion_per_K, 1e-6))
    uncertain = [
        Uncertain(OPEN_SOURCES[name].source, value, usual[name] * unit) for name, value, unit in known if name in usual
    ]
    return replace(
        machine,
        stated=machine.stated.model_copy(update={**stated, **step}),
        uncertain=(*(one for one in machine.uncertain if one.key not in {new.key for new in uncertain}), *uncertain),
    )
