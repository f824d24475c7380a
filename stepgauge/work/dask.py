"""Engines on a Dask distributed cluster, and a cluster on this computer. Needs ``stepgauge[fleet]``."""

from __future__ import annotations

import re
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.work.task import Function, Reply, perform

CONNECT_S = 20.0
CLOSE_S = 20.0
LOOPBACK = ("tcp://127.0.0.1:", "tcp://localhost:", "tcp://[::1]:")
"""A scheduler that only workers of this computer can reach."""
LOOK_S = 2.0
"""How often it is looked whether the scheduler is still there."""


class Dask:
    """The workers of a scheduler (``tcp://host:port``), which may come and go.

    Workers need the same version of stepgauge. Their memory is limited where they are started.
    """

    def __init__(self, scheduler: str) -> None:
        self.scheduler = scheduler
        self.near = scheduler.startswith(LOOPBACK)
        self._client: Any = None

    def open(self, function: Function) -> int:
        """Connect; :class:`InputError` where there is no scheduler, no worker, or one of another version."""
        self._function, self._run = function, uuid.uuid4().hex
        self._replies: SimpleQueue[tuple[int, Any]] = SimpleQueue()
        self._futures: dict[int, Any] = {}
        self._client = self._connect()
        self._check_versions()
        return max(sum(self._client.nthreads().values()), 1)

    def submit(self, number: int, item: Any) -> None:
        """Take a task."""
        key = f"stepgauge-{self._run}-{number}-{uuid.uuid4().hex[:8]}"
        future = self._client.submit(perform, self._function, item, key=key, pure=False)
        self._futures[number] = future
        future.add_done_callback(lambda done: self._replies.put((number, done)))

    def reply(self) -> tuple[int, Reply]:
        """Wait for the next answer."""
        while True:
            try:
                number, future = self._replies.get(timeout=LOOK_S)
            except Empty:
                if self._client.status != "running":
                    raise InputError(self.scheduler, "the scheduler is gone") from None
                continue
            if self._futures.get(number) is future:
                return number, self._reply_of(number)

    def close(self) -> None:
        """Disconnect; what the workers are at is forgotten."""
        if self._client is not None:
            self._futures = {}
            self._client.close(timeout=5)
            self._client = None

    def _connect(self) -> Any:
        distributed, expected = _distributed(), "tcp://host:port, as 'stepgauge fleet cluster' prints it"
        if not re.fullmatch(r"\w+://\S+:\d+", self.scheduler):
            raise InputError(self.scheduler, "this is no address of a Dask scheduler", expected=expected)
        try:
            client = distributed.Client(self.scheduler, timeout=CONNECT_S, set_as_default=False)
            client.wait_for_workers(1, timeout=CONNECT_S)
            return client
        except TimeoutError:
            what = "no Dask workers answer there"
        except (OSError, ValueError) as error:
            what = f"no Dask scheduler answers there: {error}"
        raise InputError(self.scheduler, what, expected=expected)

    def _check_versions(self) -> None:
        try:
            found = self._client.run(_version)
        except Exception as error:  # whatever an import on another computer may raise
            what = f"the workers cannot import stepgauge: {type(error).__name__}: {error}"
            raise InputError(self.scheduler, what) from None
        others = sorted(set(found.values()) - {__version__})
        if others:
            raise InputError(self.scheduler, "workers of another version", found=others[0], expected=__version__)

    def _reply_of(self, number: int) -> Reply:
        future = self._futures.pop(number)
        try:
            reply: Reply = future.result(timeout=CONNECT_S)
        except Exception as error:  # the cluster's own: workers that died, a result that was lost
            return Reply("failed", why=f"the cluster lost it: {type(error).__name__}")
        return reply


def _version() -> str:
    return __version__


@contextmanager
def local_cluster(workers: int, port: int = 0, memory_MB: float | None = None) -> Iterator[Any]:
    """A scheduler and workers of one thread each on this computer, which nobody else can reach; ends with the block.

    Yields the cluster of Dask; its ``scheduler_address`` is what :class:`Dask` takes.
    """
    distributed = _distributed()
    limit = "auto" if memory_MB is None else int(memory_MB * 1e6)
    try:
        cluster = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            scheduler_port=port,
            dashboard_address=None,
            memory_limit=limit,
            silence_logs=50,
        )
    except OSError as error:
        raise InputError(f"port {port}", f"the cluster cannot be started: {error}") from None
    try:
        yield cluster
    finally:
        with suppress(TimeoutError):  # a worker that is just being restarted keeps it waiting
            cluster.close(timeout=CLOSE_S)


def wait_until_idle(cluster: Any, idle_s: float | None, sleep: Callable[[float], None] = time.sleep) -> None:
    """Return when nobody has used the cluster for so long; None: never."""
    last = time.monotonic()
    while idle_s is None or time.monotonic() - last < idle_s:
        sleep(min(0.5, idle_s or 0.5))
        if any(name.startswith("Client-") for name in cluster.scheduler.clients):
            last = time.monotonic()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError("dask", "this needs distributed", expected="pip install 'stepgauge[fleet]'") from None
    return distributed
