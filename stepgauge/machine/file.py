"""The machine file: travel, speeds, repeatability, the probe, and known systematic effects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from stepgauge.errors import InputError
from stepgauge.files.config import TomlTable, Vector3, check_table, read_toml
from stepgauge.files.display import Summarized, join_lines
from stepgauge.files.numerals import number
from stepgauge.files.resources import find_data
from stepgauge.files.text import write_text
from stepgauge.machine.contribution import Contribution
from stepgauge.machine.uncertain import Uncertain, put_uncertain, split_uncertain
from stepgauge.physics.chain import Chain
from stepgauge.probes import Probe, make_probe, probe_table
from stepgauge.probes.schema import ProbeTable
from stepgauge.recording.conventions import Convention

if TYPE_CHECKING:
    import pandas as pd

NAMED_FILES = ("file", "map")
"""Keys of probes and effects that name a file beside the machine file."""
TIP_TOLERANCE_MM = 0.05
"""Largest difference between the recorded tip radius and that of the machine file: more means another tip."""
USUAL_REPEATABILITY_UM = 0.3
"""Of the probings of a bridge CMM."""
Range = Annotated[tuple[float, float], Field(strict=False)]


class Travel(TomlTable):
    """Travel limits of the tip centre, mm."""

    x: Range = Field(description="[lowest, highest] x in mm")
    y: Range = Field(description="[lowest, highest] y in mm")
    z: Range = Field(description="[lowest, highest] z in mm")

    @model_validator(mode="after")
    def _rising(self) -> Travel:
        for axis in "xyz":
            low, high = getattr(self, axis)
            if low >= high:
                raise ValueError(f"[lowest, highest] with lowest < highest on {axis}, not [{low:g}, {high:g}]")
        return self


class ReferenceTable(TomlTable):
    """``reference_mm`` of the chain: by axis, the point of its carriage whose motion its errors state."""

    x: Vector3 = Field((0.0, 0.0, 0.0), description="of the x carriage, [x, y, z] while all axes stand at 0, mm")
    y: Vector3 = Field((0.0, 0.0, 0.0), description="of the y carriage, [x, y, z] while all axes stand at 0, mm")
    z: Vector3 = Field((0.0, 0.0, 0.0), description="of the z carriage, [x, y, z] while all axes stand at 0, mm")


class ChainTable(TomlTable):
    """``[machine.chain]``: the order of the axes, the reference points of their carriages, and the tip."""

    table: list[Literal["x", "y", "z"]] = Field([], description='axes that carry the table, from the base: ["x"]')
    probe: list[Literal["x", "y", "z"]] = Field([], description='axes that carry the probe, from the base: ["y", "z"]')
    reference_mm: ReferenceTable = Field(ReferenceTable(), description="reference points, e.g. { x = [0, 0, 400] }")
    head_mm: Vector3 = Field((0.0, 0.0, 0.0), description="from the point that the axes count to the head's pivot, mm")
    stylus_mm: Vector3 = Field(
        (0.0, 0.0, 0.0), description="from there to the tip with the stylus down, mm; it turns as the stylus does"
    )

    @model_validator(mode="after")
    def _complete(self) -> ChainTable:
        if sorted(self.table + self.probe) != ["x", "y", "z"]:
            raise ValueError("each of x, y and z once, in table or in probe")
        return self

    def chain(self, frame: NDArray[np.float64]) -> Chain:
        """The chain with the stylus in the orientation of the ``frame (3, 3)`` of the probe."""
        tip = np.array(self.head_mm) + np.array(self.stylus_mm) @ frame
        reference = {axis: getattr(self.reference_mm, axis) for axis in "xyz"}
        return Chain("".join(self.table), "".join(self.probe), reference, tuple(tip.tolist()))


class MachineTable(TomlTable):
    """The ``[machine]`` table."""

    name: str = Field(min_length=1, description="what the machine is called")
    serial: str | None = Field(None, min_length=1, description="serial or inventory number")
    kind: str | None = Field(
        None, min_length=1, description='what is usual of it, e.g. "machine tool": a kind of `stepgauge list priors`'
    )
    travel_mm: Travel = Field(description="travel limits, e.g. { x = [0, 700], y = [0, 1000], z = [0, 600] }")
    repeatability_um: float = Field(
        0.0, ge=0, le=100, description="one sigma of a probing along the approach, um; without it readings tell it"
    )
    measuring_speed_mm_s: float = Field(gt=0, le=100, description="speed of the measuring moves, mm/s")
    travel_speed_mm_s: float = Field(gt=0, le=2000, description="speed of the moves between, mm/s")
    max_measuring_speed_mm_s: float | None = Field(
        None,
        gt=0,
        le=100,
        description="largest speed of a measuring move, mm/s; without it 4 times the measuring speed",
    )
    max_travel_speed_mm_s: float | None = Field(
        None, gt=0, le=2000, description="largest speed of a move, mm/s; without it the travel speed"
    )
    temperature_C: float = Field(20.0, ge=0, le=50, description="temperature of the scales, deg C")
    scale_expansion_per_K: float = Field(11.5e-6, ge=0, le=40e-6, description="expansion of the scales in 1/K")
    scales_compensated: bool = Field(True, description="whether the controller corrects for the scales' temperature")
    temperature_convention: Convention | None = Field(
        None, description="what its readings have been corrected for: as_read, corrected_to_20 or nominal_expansion"
    )
    mpe: str | None = Field(None, description='maximum permissible error of a length, e.g. "1.8 + L/350", um, L in mm')
    chain: ChainTable | None = Field(None, description="table [machine.chain]: which axes carry table and probe")

    @property
    def virtual_repeatability_um(self) -> float:
        """Of the virtual CMM, which scatters as usual where the file does not say how."""
        return self.repeatability_um if "repeatability_um" in self.model_fields_set else USUAL_REPEATABILITY_UM


class StandardUncertainty(TomlTable):
    """A standard uncertainty, alone or as ``{ u = 0.05, dof = 8 }``."""

    u: float = Field(ge=0, description="standard uncertainty, in the unit of the key")
    dof: float | None = Field(None, ge=1, description="degrees of freedom; without it infinite")


def _plain_number(value: Any) -> Any:
    return value if isinstance(value, dict | StandardUncertainty) else {"u": value}


def _at_most(largest: float) -> AfterValidator:
    """A standard uncertainty larger than this is in a wrong unit."""

    def check(stated: StandardUncertainty) -> StandardUncertainty:
        if stated.u > largest:
            raise ValueError(f"at most {largest:g}")
        return stated

    return AfterValidator(check)


LARGEST_U_K, LARGEST_U_PROBING_UM = 5.0, 100.0
Stated = Annotated[StandardUncertainty, BeforeValidator(_plain_number)]


class UncertaintyTable(TomlTable):
    """The ``[uncertainty]`` table: contributions to a budget besides the uncertain values of the other tables."""

    gauge_temperature_K: Annotated[Stated, _at_most(LARGEST_U_K)] | None = Field(
        None, description="standard uncertainty of the gauge's measured temperature in K, e.g. 0.05"
    )
    probing_um: Annotated[Stated, _at_most(LARGEST_U_PROBING_UM)] | None = Field(
        None, description="standard uncertainty of what probing adds at a face, the same in every cycle, um"
    )
    resolution_um: float | None = Field(None, gt=0, le=100, description="smallest step of the machine's reading, um")


@dataclass(frozen=True, repr=False)
class Machine(Summarized):
    """A machine as its file describes it.

    ``probe`` is the checked table of the probe and ``probe_path`` its file; ``effects`` are the raw ``[[effect]]``
    tables; ``uncertain`` the values with a standard uncertainty (the tables have their best estimates); ``stated`` is
    the ``[uncertainty]`` table, ``contributions`` the ``[[contribution]]`` tables; ``styli``: the machine with each
    further stylus (:mod:`stepgauge.machine.styli`).
    """

    table: MachineTable
    probe: ProbeTable
    effects: tuple[dict[str, Any], ...] = ()
    path: str = ""
    uncertain: tuple[Uncertain, ...] = ()
    probe_path: str = ""
    stated: UncertaintyTable = field(default_factory=UncertaintyTable)
    styli: tuple[Machine, ...] = ()
    contributions: tuple[Contribution, ...] = ()

    def select_stylus(self, number: int) -> Machine:
        """The machine with one of its styli: 1 is its own; :class:`InputError` for one that nobody stated."""
        if not 1 <= number <= len(self.styli) + 1:
            stated = "stylus 1, that of the file" if not self.styli else f"1 to {len(self.styli) + 1}"
            raise InputError(self.path, "a stylus is not stated", found=f"stylus {number}", expected=stated)
        return self if number == 1 else self.styli[number - 2]

    def add_effect(self, kind: str, **parameters: Any) -> Machine:
        """The machine with one more systematic effect, as one more ``[[effect]]`` of its file.

        Parameters
        ----------
        kind, parameters : as ``list_effects(kind)`` has them, e.g. ``add_effect("scale_error", axis="x", ppm=12.0)``;
            a value with its standard uncertainty as ``ppm={"value": 12.0, "u": 0.8}``

        Raises
        ------
        InputError
            a kind that there is not, a parameter that the kind has not, or a value that is none
        """
        from stepgauge.effects import make_effects

        plain, uncertain = split_uncertain(
            {"kind": kind, **parameters}, "add_effect", f"effect[{len(self.effects) + 1}]"
        )
        make_effects([plain], "add_effect")
        return replace(self, effects=(*self.effects, plain), uncertain=(*self.uncertain, *uncertain))

    def set_uncertainty(self, **stated: Any) -> Machine:
        """The machine with these keys of its ``[uncertainty]`` table in place of what it states of them.

        Parameters
        ----------
        stated : ``gauge_temperature_K``, ``probing_um`` (standard uncertainties), ``resolution_um``

        Raises
        ------
        InputError
            a key that there is not, or a value out of bounds
        """
        known = self.stated.model_dump(exclude_unset=True)
        return replace(
            self, stated=check_table(UncertaintyTable, {**known, **stated}, "set_uncertainty", "uncertainty")
        )

    def to_dict(self) -> dict[str, Any]:
        """What the machine file states, table by table, in JSON types; files that it names are named in full."""
        own, probe = Path(self.path).parent, Path(self.probe_path or self.path).parent
        found = {
            "machine": self.table.model_dump(mode="json", exclude_unset=True),
            "probe": _named_in_full(self.probe.model_dump(mode="json", exclude_unset=True), probe),
            "effect": [_named_in_full(deepcopy(one), own) for one in self.effects],
            "uncertainty": self.stated.model_dump(mode="json", exclude_unset=True),
            "contribution": [one.model_dump(mode="json", exclude_unset=True) for one in self.contributions],
        }
        for one in self.uncertain:
            put_uncertain(found, one)
        return {name: table for name, table in found.items() if table}

    def write(self, path: str | Path) -> None:
        """Write the machine file (TOML), which :func:`read_machine` reads back; not its further styli."""
        import tomli_w

        write_text(path, tomli_w.dumps(self.to_dict()))

    def _stated(self) -> Any:
        return "machine", self.to_dict(), self.styli

    def summary(self) -> str:
        """Name, travel, probe and speeds, and which effects and uncertainties the file states."""
        own = self.table
        travel = " x ".join(f"{high - low:g}" for low, high in self.travel_mm)
        speeds = f"measuring at {own.measuring_speed_mm_s:g} mm/s, moving at {own.travel_speed_mm_s:g} mm/s"
        probe = f"{self.probe.name or self.probe.model}, tip radius {self.probe.tip_radius_mm:g} mm"
        kinds = ", ".join(str(one.get("kind")).replace("_", " ") for one in self.effects) or "none"
        return join_lines(
            f"{own.name}: travel {travel} mm, repeatability {own.virtual_repeatability_um:g} um, {speeds}",
            f"probe: {probe}",
            f"effects: {kinds}; uncertain values: {len(self.uncertain)}",
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per key of the file: its table, its name with the unit, its value and standard uncertainty.

        ``kind`` is that of an effect, whose ``table`` has its number: ``effect[1]``.
        """
        import pandas as pd

        rows = []
        for place, table in _tables(self.to_dict()):
            kind = table.get("kind") if place.startswith("effect") else None
            for key, value in table.items():
                said = value if isinstance(value, dict) and "u" in value else {"value": value}
                numbers = {"value": said.get("value"), "u": said.get("u", math.nan)}
                rows.append({"table": place, "kind": kind, "parameter": key, **numbers})
        return pd.DataFrame(rows, columns=["table", "kind", "parameter", "value", "u"])

    @cached_property
    def sensor(self) -> Probe:
        """The probe that the table describes: pre-travel and forces in any direction."""
        return make_probe(self.probe, self.probe_path or self.path)

    @cached_property
    def chain(self) -> Chain | None:
        """The chain of axes, if the file states it."""
        return None if self.table.chain is None else self.table.chain.chain(self.sensor.frame)

    def u_gauge_temperature_K(self, asked: float | None = None) -> float:
        """Standard uncertainty of the gauge temperature: as given, else that of the file, else 0."""
        stated = self.stated.gauge_temperature_K
        return asked if asked is not None else stated.u if stated is not None else 0.0

    def scales_doubt(self, recorded_C: float | None) -> str | None:
        """What to say where the file's temperature of the scales and the recorded one contradict each other.

        None where nothing was recorded, where the file states no uncertainty, or within twice the uncertainty.
        """
        own = next((one for one in self.uncertain if one.key == "machine.temperature_C"), None)
        if own is None or recorded_C is None or abs(recorded_C - own.value) <= 2.0 * own.u:
            return None
        stated = f"{own.value:.2f} °C (u = {own.u:g} K)"
        return f"the scales were at {recorded_C:.2f} °C as recorded, and not at {stated} as the machine file states"

    @property
    def travel_mm(self) -> NDArray[np.float64]:
        """Limits as ``(3, 2)``: lowest and highest x, y, z."""
        travel = self.table.travel_mm
        return np.array([travel.x, travel.y, travel.z])

    @property
    def longest_move_mm(self) -> float:
        """The longest move that there may be in the travel, mm."""
        return float(np.linalg.norm(np.ptp(self.travel_mm, axis=1)))


def check_recorded(comments: Mapping[str, str], machine: Machine) -> None:
    """:class:`InputError` if a recording names another machine or another tip; one without names is accepted.

    ``comments``: of the recording, with the keys ``machine`` and ``tip_radius_mm`` where they are known. A recorded
    radius may be the effective one, and so be smaller by a pre-travel.
    """
    named = comments.get("machine")
    if named is not None and named != machine.table.name:
        raise InputError(
            machine.path, "not the machine of this recording", found=machine.table.name, expected=repr(named)
        )
    recorded, own = number(comments.get("tip_radius_mm", "")), machine.probe.tip_radius_mm
    if abs(recorded - own) > TIP_TOLERANCE_MM:
        raise InputError(
            machine.path,
            "the recording was made with another tip",
            found=f"tip_radius_mm = {own:g} in the machine file",
            expected=f"{recorded:g} mm, as recorded",
        )


def _tables(stated: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The tables of a file by name, those of an array with their number."""
    for name, one in stated.items():
        yield from [(f"{name}[{n}]", each) for n, each in enumerate(one, 1)] if isinstance(one, list) else [(name, one)]


def _named_in_full(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A table whose keys ``file`` and ``map`` name files wherever it is written; shipped ones keep their names."""
    named = {key: folder / value for key in NAMED_FILES if isinstance(value := table.get(key), str)}
    return {**table, **{key: str(place.resolve()) for key, place in named.items() if place.is_file()}}


def _contributions(tables: Any, path: Path) -> tuple[Contribution, ...]:
    """The ``[[contribution]]`` tables."""
    if not isinstance(tables, list):
        raise InputError(
            path, "contributions are an array of tables", found="[contribution]", expected="[[contribution]]"
        )
    return tuple(check_table(Contribution, one, path, f"contribution[{n}]") for n, one in enumerate(tables, 1))


def read_machine(name: str | Path) -> Machine:
    """Read and check a machine file, given by its path or by the name of a shipped one."""
    path = find_data(name, "machine", "machines")
    read = read_toml(path)
    stated = check_table(UncertaintyTable, read.pop("uncertainty", {}), path, "uncertainty")
    own = _contributions(read.pop("contribution", []), path)
    data, uncertain = split_uncertain(read, path)
    for key in data:
        if key not in ("machine", "probe", "effect"):
            expected = "[machine], [probe], [[effect]], [uncertainty] and [[contribution]]"
            raise InputError(path, f"table [{key}] is not known", expected=expected)
    effects = data.get("effect", [])
    if not isinstance(effects, list):
        raise InputError(path, "effects are an array of tables", found="[effect]", expected="[[effect]]")
    probe, probe_path = probe_table(data.get("probe"), path)
    machine = Machine(
        check_table(MachineTable, data.get("machine"), path, "machine"),
        probe,
        tuple(effects),
        str(path),
        uncertain,
        str(probe_path),
        stated,
        contributions=own,
    )
    _ = machine.sensor  # a probe that cannot work is an error now, not in the middle of a run
    return machine
