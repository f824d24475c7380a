"""Engines on a Dask distributed cluster, and a cluster on this computer. Needs ``stepgauge[fleet]``.

Whoever reaches a scheduler of Dask can run code as the person who started it, and any user of a computer reaches its
loopback. So the cluster on this computer speaks TLS alone, to those who have the key; the key is in a file that only
its owner can read, and who takes that file for the scheduler has access to it.
"""

from __future__ import annotations

import json
import os
import re
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.executors.task import Function, Reply, perform
from stepgauge.files.children import safe_children
from stepgauge.files.text import read_json

CONNECT_S = 20.0
CLOSE_S = 20.0
LOOPBACK = re.compile(r"\w+://(127\.0\.0\.1|localhost|\[::1\]):")
"""A scheduler that only workers of this computer can reach."""
FORMAT = "stepgauge cluster 1"
LOOK_S = 2.0
"""How often it is looked whether the scheduler is still there."""


class Dask:
    """The workers of a scheduler (``tcp://host:port``, or the file of :func:`local_cluster`), which may come and go.

    Workers need the same version of stepgauge. Their memory is limited where they are started.
    """

    def __init__(self, scheduler: str) -> None:
        self.scheduler, self._security = _address(scheduler)
        self.near = LOOPBACK.match(self.scheduler) is not None
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
        distributed, expected = _distributed(), "the file that 'stepgauge fleet cluster' prints, or tcp://host:port"
        if not re.fullmatch(r"\w+://\S+:\d+", self.scheduler):
            raise InputError(self.scheduler, "this is no address of a Dask scheduler", expected=expected)
        try:
            client = distributed.Client(
                self.scheduler, timeout=CONNECT_S, set_as_default=False, security=self._security
            )
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


def _address(scheduler: str) -> tuple[str, Any]:
    """The address of a scheduler, and what its file has to open it; None where an address is given."""
    if not os.path.isfile(scheduler):
        return scheduler, None
    said = read_json(scheduler)
    if not isinstance(said, dict) or said.get("format") != FORMAT:
        raise InputError(scheduler, "this is no file of a cluster", expected="the one that 'fleet cluster' prints")
    return str(said["address"]), _distributed().Security(require_encryption=True, **said["security"])


@dataclass(frozen=True)
class LocalCluster:
    """A cluster on this computer: that of Dask, and the ``file`` by which :class:`Dask` finds and enters it."""

    dask: Any
    file: str


@contextmanager
def local_cluster(workers: int, port: int = 0, memory_MB: float | None = None) -> Iterator[LocalCluster]:
    """A scheduler and workers of one thread each on this computer, for its owner alone; ends with the block."""
    distributed = _distributed()
    limit = "auto" if memory_MB is None else int(memory_MB * 1e6)
    with safe_children(), tempfile.TemporaryDirectory(prefix="stepgauge-") as private:
        security = _temporary_key(distributed)
        try:
            cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                protocol="tls://",
                security=security,
                host="127.0.0.1",
                scheduler_port=port,
                dashboard_address=None,
                memory_limit=limit,
                silence_logs=50,
            )
        except OSError as error:
            raise InputError(f"port {port}", f"the cluster cannot be started: {error}") from None
        try:
            yield LocalCluster(cluster, _write_private(private, cluster.scheduler_address, security))
        finally:
            with suppress(TimeoutError):  # a worker that is just being restarted keeps it waiting
                cluster.close(timeout=CLOSE_S)


def _temporary_key(distributed: Any) -> Any:
    try:
        return distributed.Security.temporary()
    except ImportError:
        raise InputError("dask", "this needs cryptography", expected="pip install 'stepgauge[fleet]'") from None


def _write_private(folder: str, address: str, security: Any) -> str:
    """Address and key in a file of a folder that only its owner can enter."""
    names = ("tls_ca_file", "tls_client_key", "tls_client_cert")
    said = {"format": FORMAT, "address": address, "security": {name: getattr(security, name) for name in names}}
    path = os.path.join(folder, "cluster.json")
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        json.dump(said, file)
    return path


def wait_until_idle(cluster: LocalCluster, idle_s: float | None, sleep: Callable[[float], None] = time.sleep) -> None:
    """Return when nobody has used the cluster for so long; None: never."""
    last = time.monotonic()
    while idle_s is None or time.monotonic() - last < idle_s:
        sleep(min(0.5, idle_s or 0.5))
        if any(name.startswith("Client-") for name in cluster.dask.scheduler.clients):
            last = time.monotonic()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError("dask", "this needs distributed", expected="pip install 'stepgauge[fleet]'") from None
    return distributed
