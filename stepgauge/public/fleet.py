"""``infer_fleet``: causes of errors in a fleet, with their owners."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stepgauge.public.inputs import File

if TYPE_CHECKING:
    from stepgauge.fleet.crossed.answer import FleetInference


def infer_fleet(
    store: File, *, jobs: int | None = 1, progress: Callable[[int, int], None] | None = None
) -> FleetInference:
    """What follows a gauge from machine to machine, stays with a machine, or is shared by a line or a hall.

    Parameters
    ----------
    store : a store that ``stepgauge fleet add`` filled, with a machine file for every recording
    jobs : processes that read recordings; 1: this process, None: as many as there are processors
    progress : told how many of how many recordings have been read

    Returns
    -------
    FleetInference
        named causes; recordings that cannot be used are left out, ``stepgauge fleet infer`` says which

    Raises
    ------
    InputError
        no store, or no recording in it that can be used
    """
    from stepgauge.fleet.crossed.stored import infer_store
    from stepgauge.work.processes import InProcess, Processes

    found, _ = infer_store(store, InProcess() if jobs == 1 else Processes(jobs, None), progress)
    return found
