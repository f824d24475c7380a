"""The decision on an evaluation by the limit that the project states, as ``evaluate`` and ``report`` make it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.standards.budget_files import StoredBudget
    from stepgauge.standards.conformity import Conformity
    from stepgauge.standards.mpe import Mpe


def decided(
    site: Site, evaluation: Mapping[str, Any], budget: StoredBudget | None
) -> tuple[Conformity | None, InputError | None]:
    """Decision and why there is none; no limit stated: None twice."""
    from stepgauge.standards.conformity import conformity

    try:
        limit = stated_limit(site, evaluation["comments"])
    except InputError as error:
        return None, error
    return (None if limit is None else conformity(evaluation, budget, limit)), None


def stated_limit(site: Site, comments: Mapping[str, str]) -> Mpe | None:
    """The limit of the project file, as ``evaluate`` takes it from there, else that of the project's machine file.

    :class:`InputError` for what is no limit, and for a machine that is not the one of the recording (``comments``).
    """
    from stepgauge.machine.file import read_machine
    from stepgauge.standards.conformity import machine_limit
    from stepgauge.standards.mpe import Mpe

    if not site.has_project:
        return None
    project = site.project()
    stated = {**project.common, **project.table(("evaluate",))}
    if "mpe" in stated:
        return Mpe.parse(str(stated["mpe"]), stated.get("mpe-cap"))
    return machine_limit(read_machine(site.stated("machine")), comments) if "machine" in stated else None
