"""A machine with a fault that its file does not state, and what it records of the gauge."""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.demonstration.faults import choose_fault
from stepgauge.errors import InputError
from stepgauge.files.dates import moment_now
from stepgauge.files.text import read_text, write_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.machine.virtual import RunConditions, probing_settings, run_program
from stepgauge.programs import read_program

SEALED = "sealed.txt"
GAUGE_TEMPERATURE_C = 20.4
SEARCH_MM = 2.0
"""Search beyond the target, where the text of a program does not state it."""


@dataclass(frozen=True)
class Concealed:
    """``checksum`` of the sealed file; ``recordings``: one file per placement."""

    checksum: str
    recordings: tuple[Path, ...]


def conceal_fault(
    folder: Path,
    machine: Machine,
    gauge: Gauge,
    programs: Sequence[tuple[Path, Placement]],
    name: str | None = None,
    seed: int | None = None,
) -> Concealed:
    """Run the programs on the machine with one more fault; what it is stands in a sealed file only.

    Parameters
    ----------
    folder : where sealed file and recordings go
    machine : as its file describes it, without the fault
    gauge : the certified gauge
    programs : files of measuring programs, each with the placement of its gauge
    name : one of ``faults.NAMES``; default: one at random
    seed : of fault, size and scatter; default: another one at each call

    Raises
    ------
    InputError
        a name that is no fault, or a program that cannot be read
    """
    random = np.random.default_rng(seed)
    truth = choose_fault(name, random).draw(random)
    salt = secrets.token_hex(8) if seed is None else str(seed)
    checksum = close_seal(folder / SEALED, truth, salt)
    faulty = replace(machine, effects=(*machine.effects, truth))
    recordings = []
    for number, (program, placement) in enumerate(programs, 1):
        moves = read_program(program, probing_settings(faulty, SEARCH_MM))
        conditions = RunConditions(gauge.temperature_C(GAUGE_TEMPERATURE_C), number)
        run = run_program(moves, faulty, gauge, placement, int(random.integers(2**31)), conditions)
        if run.stop is not None:
            raise run.stop
        run = replace(run, recording=run.recording.assign_comments(measured_at=moment_now()))
        recordings.append(folder / f"faulty-{number}.csv")
        run.write(recordings[-1])
    return Concealed(checksum, tuple(recordings))


FIRST_LINE = "# What stepgauge demo concealed. It is opened when the diagnosis is done."


def close_seal(path: Path, truth: dict[str, Any], salt: str) -> str:
    """Write the sealed file; returns its checksum.

    With the ``salt`` (random text) nobody can find the truth by trying, and after the checksum was shown nobody can
    change it.
    """
    data = json.dumps({"concealed": truth, "salt": salt}, sort_keys=True).encode()
    write_text(path, f"{FIRST_LINE}\n{base64.b64encode(data).decode()}\n")
    return hashlib.sha256(data).hexdigest()


def open_seal(path: Path, checksum: str) -> dict[str, Any]:
    """What the file conceals; :class:`InputError` where it is not the one whose checksum was shown."""
    try:
        data = base64.b64decode(read_text(path).splitlines()[1], validate=True)
    except (IndexError, binascii.Error):
        data = b""
    if hashlib.sha256(data).hexdigest() != checksum:
        raise InputError(path, "the seal was changed after it was closed", expected=f"SHA-256 {checksum}")
    truth: dict[str, Any] = json.loads(data)["concealed"]
    return truth
