"""Recordings of the store as tasks: what a worker needs that has neither the store nor its files."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

from stepgauge.errors import InputError, naming
from stepgauge.fleet.rows import Stored
from stepgauge.fleet.store import Fleet
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, parse_placement
from stepgauge.machine.file import Machine


@dataclass(frozen=True)
class Batch:
    """Some recordings with the certificates and machine files that they name."""

    stored: tuple[Stored, ...]
    gauges: dict[str, Gauge]
    machines: dict[str, Machine]

    def gauge(self, one: Stored) -> Gauge:
        """As certified."""
        return self.gauges[one.certificate]

    def machine(self, one: Stored) -> Machine:
        """As its file says (:class:`InputError` where none was added)."""
        if one.machine_file is None:
            expected = naming("machine", words="'fleet add' with {}")
            raise InputError(one.name, "no machine file was added with this recording", expected=expected)
        return self.machines[one.machine_file]

    def placements(self, one: Stored) -> list[Placement]:
        """Where the gauge lay, in the order of the placements; empty where that was not stated."""
        return [parse_placement(text, one.name, self.gauge(one)) for text in one.placement_files]


@dataclass(frozen=True)
class StoredBatch:
    """The recordings of a batch by their keys, for a worker on the computer that has the store: it reads them itself.

    To read and to send them takes a third of the time of an evaluation, and would leave half of the workers waiting.
    """

    folder: str
    keys: tuple[str, ...]

    def batch(self) -> Batch:
        """What is kept under the keys."""
        fleet = _fleet(self.folder)
        return _batch(fleet, list(fleet.stored(self.keys)))


def opened(batch: Batch | StoredBatch) -> Batch:
    """The batch, read where it was only named."""
    return batch.batch() if isinstance(batch, StoredBatch) else batch


def named(fleet: Fleet, recordings: Collection[str], size: int) -> Iterator[tuple[str, StoredBatch]]:
    """The same batches as :func:`batches` gives, only named."""
    folder = str(fleet.folder.resolve())
    keys = fleet.order_keys(recordings)
    for first in range(0, len(keys), size):
        yield keys[first], StoredBatch(folder, tuple(keys[first : first + size]))


@cache
def _fleet(folder: str) -> Fleet:
    """A store that this process works on; it keeps the index in memory."""
    return Fleet(folder)


def batches(fleet: Fleet, recordings: Collection[str], size: int) -> Iterator[tuple[str, Batch]]:
    """The recordings in batches of ``size``, each with the key of its first recording."""
    some: list[Stored] = []
    for one in fleet.stored(recordings):
        some.append(one)
        if len(some) == size:
            yield some[0].key, _batch(fleet, some)
            some = []
    if some:
        yield some[0].key, _batch(fleet, some)


def _batch(fleet: Fleet, some: Sequence[Stored]) -> Batch:
    certificates = dict.fromkeys(one.certificate for one in some)
    files = dict.fromkeys(one.machine_file for one in some if one.machine_file is not None)
    return Batch(
        tuple(some), {key: fleet.gauge(key) for key in certificates}, {key: fleet.machine(key) for key in files}
    )
