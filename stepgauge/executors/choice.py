"""Which engine does the work, by what a person states."""

from __future__ import annotations

from stepgauge.errors import InputError, naming
from stepgauge.executors.task import Engine


def engine_of(jobs: int | None = None, scheduler: str | None = None, memory_MB: float | None = None) -> Engine:
    """A Dask cluster where its scheduler is stated; else this process for one job without a limit; else processes.

    ``jobs``: processes, None: as many as there are processors; ``scheduler``: as
    :class:`~stepgauge.executors.dask.Dask` takes it; ``memory_MB``: what each process may allocate.
    """
    from stepgauge.executors.dask import Dask
    from stepgauge.executors.processes import InProcess, Processes

    if scheduler is not None:
        if memory_MB is not None or (jobs or 1) > 1:
            what = naming("jobs", "memory_MB", words="{} and {} are of processes: a cluster has its own")
            raise InputError(scheduler, what)
        return Dask(scheduler)
    return InProcess() if jobs == 1 and memory_MB is None else Processes(jobs, memory_MB)
