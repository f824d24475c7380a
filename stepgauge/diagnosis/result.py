"""The result of a diagnosis, before it is written to files."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array, read_arrays
from stepgauge.files.checksum import file_sha256
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.outputs import open_set
from stepgauge.files.text import read_result, result_file, result_text, write_text
from stepgauge.inference.search import Step
from stepgauge.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stepgauge.diagnosis.remainder import MayRemain
    from stepgauge.figures.axis import DrawnAxis
    from stepgauge.figures.diagnosis import DrawnDiagnosis

FILE, DRAWN_FILE = "diagnosis.json", "figures.npy"
OUTLIERS = "outliers"  # kind of the finding that lists single rows
NEEDED = ("verdict", "effects", "unexplained", "fit", "inputs")
"""Keys that every diagnosis has."""
OF_THE_FILE = {"format", "stepgauge", "inputs", "made_from", "checksum", "remarks"}
"""Keys that say where a diagnosis comes from and of the files beside it, and nothing of the machine."""
Verdict = Literal["adequate", "effects", "unknown", "insufficient"]


@dataclass(frozen=True)
class Noise:
    """Scatter of a single probing.

    ``sigma_um``: standard deviation of a typical row; ``by_row_um (n,)``: of each row, infinite for outliers; ``dof``:
    its degrees of freedom; ``outliers``: indices of rows; ``repeats``: whether faces were repeated, and repeats show
    it; ``least``: whether less is left than the least that a reading can have.
    """

    sigma_um: float
    by_row_um: Array
    dof: int
    outliers: NDArray[np.intp]
    repeats: bool
    least: bool = False


@dataclass(frozen=True)
class Replacement:
    """Laws that may be in place of what is stated, and of ``others`` with it; their odds against it."""

    laws: tuple[str, ...]
    odds: float
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class Finding:
    """A named effect.

    ``effect``: ready for a machine file; ``effects``: those of a finding that is many errors at once; ``choices``:
    axis, plane, face, ... ; ``own``: its probability, ``probability``: with all of ``confounded_with``, other kinds not
    discriminated from it; ``alternatives``: other choices of the same kind; ``members``: all of the set with their own
    values and probabilities in it; ``several``: laws that replace it together; ``where``: where in the record it acts,
    empty: in all; ``reason``: of the set, ``separate_by``: what ends it; ``share_um (n,)``: its displacement;
    ``widened_by``: laws that may be there as well and make its U more than twice as large.
    """

    kind: str
    label: str
    effect: Effect | None
    choices: dict[str, object]
    parameters: dict[str, Estimate]
    probability: float
    share_um: Array
    own: float = 1.0
    confounded_with: tuple[str, ...] = ()
    alternatives: tuple[str, ...] = ()
    members: tuple[Finding, ...] = ()
    several: tuple[Replacement, ...] = ()
    where: str = ""
    reason: str = ""
    separate_by: str = ""
    separation_nats: float = 0.0
    effects: tuple[Effect, ...] = ()
    widened_by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Located:
    """Where residuals are systematic: covariate, side, form, share of the structure, probability.

    ``phrases``: what words are made of (:mod:`.wording.phrases`), or words; ``beside``: a second covariate of the form;
    ``numbers``: of the form, as a period; ``laws``: those that may be in its place, ``separate_by``: what tells.
    """

    covariate: str
    side: str
    form: str
    phrases: Sequence[Any]
    share: float
    probability: float
    beside: str = ""
    numbers: Any = None
    laws: tuple[Replacement, ...] = ()
    separate_by: str = ""
    separation_nats: float = 0.0
    share_um: Array = field(default_factory=lambda: np.zeros(0), compare=False)

    @property
    def where(self) -> str:
        """The structure in words."""
        from stepgauge.diagnosis.wording.phrases import worded

        return worded(self.phrases)


@dataclass(frozen=True)
class Fit:
    """Agreement of simulation and recording before and after, um."""

    rms_before_um: float
    rms_after_um: float
    holdout: dict[str, tuple[float, float]]
    chi2_dof_before: float
    chi2_dof_after: float


@dataclass(frozen=True)
class Check:
    """One part of the posterior predictive check: its name, and the deviation in standard deviations; in a phrase."""

    check: str
    deviation: float
    passed: bool
    phrase: Mapping[str, Any]


class Diagnosis(Plotted):
    """What is stated of a recording, of an axis, or of the map of a probe.

    ``contents``: all of it in JSON types, as ``diagnosis.json`` has it; ``path``: the file that it was read from. One
    that was read back has no readings: these are in the recordings that it names.
    """

    drawn_by: ClassVar[str] = "diagnosis.draw_probabilities"
    verdict: str
    path: str

    def __init__(self, said: Mapping[str, Any], path: str = "") -> None:
        self.__dict__["contents"] = said  # in place of the computed one
        self.verdict, self.path = str(said["verdict"]), path

    @cached_property
    def contents(self) -> Mapping[str, Any]:
        """All that is stated, in JSON types."""
        raise NotImplementedError

    @classmethod
    def read(cls, path: str | Path) -> Diagnosis:
        """Read a diagnosis of any kind, by its folder or its ``diagnosis.json``.

        Raises
        ------
        InputError
            a file that is no diagnosis
        """
        said = read_result(file := result_file(path, FILE), "diagnosis", with_inputs=False)
        if not all(key in said for key in NEEDED):
            raise InputError(file, "not a complete diagnosis", expected="diagnosis.json of stepgauge diagnose")
        return Diagnosis(said, str(file))

    def summary(self) -> str:
        """Verdict, effects and fit in a line; findings and rivals with their values; what its reader must know."""
        from stepgauge.diagnosis.wording.headline import found_lines, summary_line
        from stepgauge.diagnosis.wording.limits import step_limits, warnings

        said = self.contents
        known = (*warnings(said), *step_limits(said))
        return join_lines(summary_line(said), *found_lines(said), *(f"note: {one}" for one in known))

    def _stated(self) -> str:
        """All of it, but for the folder that commands name."""
        said = {key: value for key, value in self.contents.items() if key not in OF_THE_FILE}
        return re.sub(r'[^\s"]*/(?=separate-\d)', "", json.dumps(said, sort_keys=True))

    def __repr__(self) -> str:
        return f"<Diagnosis {self.summary().splitlines()[0]}>"

    def to_frame(self) -> pd.DataFrame:
        """One row per number of a finding and of each of its rivals, with the values that they have if it is the cause.

        ``probability`` that it is this cause, ``value``, standard uncertainty ``u``, ``unit``; ``bound``: ``least`` of
        a value that is a lower bound; of single readings that are off ``iloc[n]`` is the place in the table of the
        recording, ``value`` how far; ``rival_of``: the finding in whose place it may stand, empty for what is stated;
        ``meaning``: of the value, with its sign, as the effect declares it.
        """
        from stepgauge.diagnosis.output.numbers import number_table

        return number_table(self.contents)

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``diagnosis.json`` and, where the readings are at hand, all that stands beside it; returns the paths.

        That is ``diagnosis.md``, ``residuals.csv``, the diagnosed machine or probe file, and the figures.
        """
        write_text(path := Path(folder) / FILE, result_text(self.contents))
        return [path]

    def figures(self) -> dict[str, Figure]:
        """The figures that are written beside ``diagnosis.json``, by name; none where that was read from no folder."""
        kept = Path(self.path).with_name(DRAWN_FILE)
        if not self.path or not kept.is_file():
            return {}
        from stepgauge.figures.axis import DrawnAxis
        from stepgauge.figures.diagnosis import DrawnDiagnosis

        return (DrawnAxis if "axis" in self.contents else DrawnDiagnosis).read(read_arrays(kept)).figures()

    def changed(self) -> list[str]:
        """Files that it was made from which are there, but are not as they were: of a machine file what it used."""
        machine = self.contents["inputs"].get("machine") or {}
        return [
            one
            for one, known in _files(self.contents["inputs"])
            if Path(one).is_file()
            and file_sha256(one) != known
            and not (one == machine.get("path") and _states_the_same(one, machine.get("stated_sha256")))
        ]


def _states_the_same(path: str, stated_sha256: str | None) -> bool:
    from stepgauge.diagnosis.output.files import stated_digest
    from stepgauge.machine.file import read_machine

    try:
        return stated_sha256 is not None and stated_digest(read_machine(path)) == stated_sha256
    except InputError:
        return False


def read_diagnosis(path: str | Path) -> Diagnosis:
    """Read a diagnosis of any kind; as :meth:`Diagnosis.read`."""
    return Diagnosis.read(path)


def _files(inputs: Any) -> Iterator[tuple[str, str]]:
    """Paths with the checksums that they had."""
    if isinstance(inputs, dict) and inputs.get("path") and inputs.get("sha256"):
        yield str(inputs["path"]), str(inputs["sha256"])
    for one in inputs.values() if isinstance(inputs, dict) else inputs if isinstance(inputs, list) else ():
        yield from _files(one)


class ComputedDiagnosis(Diagnosis):
    """A diagnosis with its readings: of a gauge, an axis, or the map of a probe."""

    def drawn(self) -> DrawnAxis | DrawnDiagnosis | None:
        """What its figures are drawn from; None of a map, of which only pictures are kept."""
        return None

    def figures(self) -> dict[str, Figure]:
        """The figures that are written beside ``diagnosis.json``, by name."""
        return drawn.figures() if (drawn := self.drawn()) else {}

    def outputs(self, folder: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
        """The contents for a folder, for the commands that name its files, and the texts beside them by file name."""
        raise NotImplementedError

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``diagnosis.json``, ``diagnosis.md``, ``residuals.csv``, the diagnosed files and the figures."""
        from stepgauge.diagnosis.output.files import write_diagnosis

        with open_set():
            return write_diagnosis(folder, self, figure)


@dataclass(frozen=True, repr=False, kw_only=True)
class StatedDiagnosis(ComputedDiagnosis):
    """What is stated of a gauge or of a map, and the verdict that follows.

    ``unexplained``: structure that is stated, ``located``: this and where residuals are systematic before any law is
    named; ``trail``: steps of the search; ``probabilities``: those of all statements in JSON types.
    """

    verdict: Verdict
    findings: tuple[Finding, ...] = ()
    located: tuple[Located, ...] = ()
    unexplained: tuple[Located, ...] = ()
    trail: tuple[Step, ...] = ()
    remarks: tuple[Mapping[str, Any] | str, ...] = ()
    probabilities: dict[str, Any] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    path: str = ""

    @property
    def forms(self) -> list[Located]:
        """The structure without a law of which it is known what it moves."""
        return [one for one in self.unexplained if len(one.share_um)]


@dataclass(frozen=True, repr=False, kw_only=True)
class GaugeDiagnosis(StatedDiagnosis):
    """The diagnosis of a recording of a gauge on a machine.

    ``before_um`` and ``after_um``: the residuals without origins; ``placements``: texts of placement files of proposed
    runs, by file name; ``further``: the run that is worth it where nothing is stated; ``may_remain``: as its module.
    """

    drawn_by: ClassVar[str] = "diagnosis.draw_residuals"
    fit: Fit
    noise: Noise
    data: Residuals
    before_um: Array
    after_um: Array
    placements: dict[str, str] = field(default_factory=dict)
    further: str = ""
    may_remain: tuple[MayRemain, ...] = ()
    recordings: tuple[Recording, ...] = ()

    @cached_property
    def rest_um(self) -> Array:
        """Residuals without what is named and without structure, minus the mean origin of every placement."""
        return self.data.without_origins(self.after_um - sum(one.share_um for one in self.forms))

    @property
    def rest_rms_um(self) -> float:
        """Rms of these over all rows with weight."""
        return rms(self.rest_um[np.isfinite(self.noise.by_row_um)])

    @property
    def files(self) -> list[tuple[str, int]]:
        """The names of the recordings with their numbers of rows; one without a name where they were in no file."""
        known = [(Path(one.path).name, len(one)) for one in self.recordings]
        return known or [("", int(self.data.row.max()) + 1)]

    def row_in_file(self, row: int) -> tuple[str, int]:
        """The recording and the row in it (from 1) of a row of all of them together (from 1)."""
        for name, count in self.files:
            if row <= count:
                return name, row
            row -= count
        raise IndexError(row)

    @cached_property
    def contents(self) -> Mapping[str, Any]:
        """All that is stated, in JSON types."""
        from stepgauge.diagnosis.output.files import diagnosis_to_dict

        return diagnosis_to_dict(self)

    def drawn(self) -> DrawnDiagnosis:
        from stepgauge.figures.diagnosis import drawn_of

        return drawn_of(self)

    def outputs(self, folder: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
        from stepgauge.diagnosis.output.files import gauge_outputs

        return gauge_outputs(self, folder)


def rms(values: Sequence[float] | Array) -> float:
    """Root mean square, NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
