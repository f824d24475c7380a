"""What a measurement was asked for, as the page and the process that measures tell each other."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.text import read_result, write_json

SUFFIX = ".request.json"
KIND = "measurement as asked"
WRONG = "this is not what a measurement was asked for"


@dataclass(frozen=True)
class MeasurementRequest:
    """A measurement; all paths as from the folder of the project.

    ``program``: empty where the path is planned now, with ``cycles`` and ``blocks``; ``server``: empty for the virtual
    CMM, which runs ``speed`` times as fast as a real one (None: its time passes in motions alone), reads as ``faults``
    say, and scatters by ``seed``.
    """

    output: str
    gauge: str
    machine: str
    placement: str
    program: str = ""
    cycles: int = 5
    blocks: str = ""
    server: str = ""
    homing: bool = True
    gauge_temperature_C: float | None = None
    speed: float | None = 10.0
    faults: str = ""
    seed: int = 0
    resume: bool = False

    def to_json(self) -> str:
        """One line for the process that measures."""
        return json.dumps(asdict(self))

    def write(self, path: Path) -> None:
        """Beside the recording, for whoever goes on with it."""
        write_json(path, {"format": f"stepgauge {KIND} 1", **asdict(self)}, at_once=True)


def request_file(output: Path) -> Path:
    """Beside an unfinished recording: what it was asked for, so that it can go on."""
    return Path(f"{output}{SUFFIX}")


def parse_request(text: str) -> MeasurementRequest:
    """As :meth:`MeasurementRequest.to_json` wrote it."""
    try:
        return MeasurementRequest(**json.loads(text))
    except (ValueError, TypeError):
        raise InputError("asked", WRONG) from None


def read_request(path: Path) -> MeasurementRequest:
    """As :meth:`MeasurementRequest.write` wrote it (:class:`InputError` where it is not as it was written)."""
    said = read_result(path, KIND, with_inputs=False)
    try:
        return MeasurementRequest(**{key: value for key, value in said.items() if key not in ("format", "checksum")})
    except TypeError:
        raise InputError(path, WRONG) from None
