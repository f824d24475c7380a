"""The recording as effects use it: columns, and quantities computed from them on demand."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from stepgauge.effects import order
from stepgauge.effects.order import followed as followed
from stepgauge.effects.setting import Setting as Setting
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array, Rows

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.probes.schema import ProbeTable

FACE_COS = 0.5
"""Cosine of approach and gauge axis, at least, where a face is probed."""
_COORDINATE = {axis: f"{axis}_mm" for axis in "xyz"}
AT_ONCE_S = 1e-9
"""Time constant that stands for no lag where other runs have one."""
_MARK = np.array([1.0, 0.7390851332151607, 0.2801694990238691])
"""Weights of the components; different directions practically never have the same sum."""
FEW = 64
_APPROACH = dict(zip("xyz", ("approach_i", "approach_j", "approach_k"), strict=True))


class Columns(Protocol):
    """A :class:`pandas.DataFrame`, or any mapping of arrays by name."""

    def __getitem__(self, name: str, /) -> Any: ...

    def __contains__(self, name: object, /) -> bool: ...

    def __iter__(self) -> Iterator[Any]: ...


class Probings:
    """``n`` probings; ``columns`` are those of a recording, of shape ``(n,)`` or ``(runs, n)``.

    Unused columns cost nothing.
    """

    def __init__(self, columns: Columns, setting: Setting) -> None:
        self.columns, self.setting = columns, setting
        self._made: dict[object, Any] = {}

    def __len__(self) -> int:
        return self.column("face").shape[-1]

    @property
    def first_row(self) -> int:
        """Index of the first of these rows in the recording."""
        return 0

    def iterate_styli(self) -> Iterator[tuple[Array, Probings]]:
        """For every further stylus: the rows that were probed with it ``(n,)``, and all rows as if they had been."""
        if not self.setting.styli or "stylus" not in self.columns:
            return
        number = self.column("stylus")
        for one, setting in self.setting.styli.items():
            if (rows := number == one).any():
                other = copy(self)  # what was computed of columns holds for both
                other.setting = setting
                yield rows, other

    def column(self, name: str) -> Array:
        """A recorded column; :class:`InputError` where the recording has none of that name."""
        if name not in self._made:
            if name not in self.columns:
                raise InputError("effects", f"the recording has no column {name!r} that an effect needs")
            self._made[name] = np.asarray(self.columns[name])
        return self._made[name]

    def coordinate_mm(self, axis: str) -> Array:
        """Machine coordinate of one axis at the trigger, mm."""
        return self.column(_COORDINATE[axis])

    def axis_mm(self, axis: str) -> Array:
        """Coordinate of the axis itself, mm: that of the tip minus its offset, where the machine's chain states one."""
        chain = self.setting.chain
        offset = 0.0 if chain is None else chain.tip_mm["xyz".index(axis)]
        if not offset:
            return self.coordinate_mm(axis)
        key = ("axis", axis, offset)
        if key not in self._made:
            self._made[key] = self.coordinate_mm(axis) - offset
        return self._made[key]

    def approach(self, axis: str) -> Array:
        """Component of the approach along one axis."""
        return self.column(_APPROACH[axis])

    def approaches(self) -> tuple[Array, Rows]:
        """The distinct approaches, ``(m, 3)``, and for every row the number of its approach.

        Programs probe along few directions, so that expensive quantities are computed once for each.
        """
        if "approaches" not in self._made:
            every = np.stack([self.approach(axis) for axis in "xyz"])
            first, self._made["which"] = _told_apart(every)
            self._made["approaches"] = every[:, first].T
        return self._made["approaches"], self._made["which"]

    @property
    def time_s(self) -> Array:
        """Times of the probings, (n,) in s."""
        return self.column("time_s")

    @property
    def speed_mm_s(self) -> Array:
        """Measuring speeds, (n,) in mm/s."""
        return self.column("speed_mm_s")

    @property
    def face(self) -> Array:
        """Numbers of the faces, (n,), from 1."""
        return self.column("face")

    @property
    def gauge(self) -> Gauge:
        """The certificate; :class:`InputError` where none was given."""
        if self.setting.gauge is None:
            raise InputError("effects", "an effect of the gauge needs to know the gauge", expected="a gauge")
        return self.setting.gauge

    def expand_faces(self, values: Array) -> Array:
        """Values by face ``(..., n_faces)`` as values by row ``(..., n)``."""
        return values[..., self._face_index()]

    def _face_index(self) -> Array:
        if "index" not in self._made:
            self._made["index"] = self.face - 1
        return self._made["index"]

    def certified_mm(self) -> Array:
        """Certified position of the probed face along the gauge, mm."""
        if "certified" not in self._made:
            self._made["certified"] = self.expand_faces(self.gauge.position_mm)
        return self._made["certified"]

    def along(self) -> Array:
        """Component of the approach along the gauge axis, a . p: near +1 at front faces, near -1 at back faces."""
        if "along" not in self._made:
            self._made["along"] = self._along()
        return self._made["along"]

    def _along(self) -> Array:
        axes = self.setting.axis
        if not axes:
            return np.where(self.face % 2 == 1, 1.0, -1.0)
        if len(axes) == 1:
            a = next(iter(axes.values()))
        else:
            table = np.zeros((3, max(axes) + 1))
            for number, axis in axes.items():
                table[:, number] = axis
            a = table[:, self.column("placement")]
        return a[0] * self.approach("x") + a[1] * self.approach("y") + a[2] * self.approach("z")

    def shifted_along_gauge(self, um: Array) -> Array:
        """Displacement of the trigger along the approach when a face moves ``um`` along the gauge axis: um / (a . p).

        On its path along ``p`` the ball meets a plane perpendicular to ``a`` later by this amount. What is approached
        at more than 60 deg to the axis is a side or a top, which moves in itself.
        """
        along = self.along()
        if np.abs(along).min(initial=1.0) >= FACE_COS:
            return um / along
        return um * np.divide(1.0, along, where=np.abs(along) >= FACE_COS, out=np.zeros(len(along)))

    def touches_since_pause(self, pause_s: float) -> Array:
        """Number of probings before each one since the last pause longer than ``pause_s``, in order of time.

        A new placement of the gauge is a pause, whatever its duration.
        """
        key = ("touches", pause_s)
        if key not in self._made:
            self._made[key] = order.touches_since(self, pause_s)
        return self._made[key]

    def rest_s(self) -> Array:
        """Time since the previous probing, s; for the first probing of a placement, the longest of these times."""
        if "rest" not in self._made:
            self._made["rest"] = order.rest_s(self)
        return self._made["rest"]

    def since_placed_s(self) -> Array:
        """Time since the first probing of the same placement, s."""
        if "placed" not in self._made:
            self._made["placed"] = order.since_placed_s(self)
        return self._made["placed"]

    def rested(self, touches: float) -> Array:
        """Sum of the square roots of this and earlier rests, s^0.5, with weights that fall to 1/e over ``touches``.

        Relaxation during a rest is about proportional to the square root of time. The time before the first probing is
        not known; for a placement with a clock of its own the longest rest is assumed.
        """
        key = ("rested", touches)
        if key not in self._made:
            self._made[key] = order.rested(self, touches)
        return self._made[key]

    def lagged(self, name: str, lag_s: float | Array) -> Array:
        """A recorded column after a first-order lag with the time constant ``lag_s``, s; 0 for the column itself.

        Of shape ``(n,)``, for a time constant by run ``(runs, 1)`` of shape ``(runs, n)``.
        """
        if np.ndim(lag_s) == 0 and not lag_s:
            return self.column(name)
        key = ("lagged", name, np.ndim(lag_s), *np.ravel(lag_s))
        if key not in self._made:
            late = followed(self.time_s, self.column(name).astype(float), np.maximum(np.ravel(lag_s), AT_ONCE_S))
            self._made[key] = late if np.ndim(lag_s) else late[0]
        return self._made[key]

    def way(self) -> Array:
        """+1 where the previous probing, in order of time, was nearer to face 1 (or there was none), else -1."""
        if "way" not in self._made:
            self._made["way"] = order.way(self)
        return self._made["way"]

    def since_turning_mm(self) -> Array:
        """Path along the gauge between probings since its last reversal, mm, in order of time."""
        if "turning" not in self._made:
            self._made["turning"] = order.since_turning_mm(self)
        return self._made["turning"]

    def held_mm(self, column: str, way_mm: float) -> Array:
        """How far friction holds back what follows a coordinate (``x_mm``, ``position_mm``), at most ``way_mm``."""
        key = ("held", column, way_mm)
        if key not in self._made:
            self._made[key] = order.held_mm(self, column, way_mm)
        return self._made[key]

    def run_mm(self, axis: str) -> Array:
        """Path of an axis from the previous probing, mm, if in the direction of the approach; else 0."""
        key = ("run", axis)
        if key not in self._made:
            self._made[key] = order.run_mm(self, axis)
        return self._made[key]

    def lateral_share(self) -> tuple[Array, Array]:
        """Cosine and sine of the approach's azimuth about the stylus, times the sine of its polar angle.

        The azimuth counts from machine +x (from +y for a stylus along x) made perpendicular to the stylus.
        """
        first, second = _across(self.setting.probe)
        p = [self.approach(axis) for axis in "xyz"]
        return _dot(first, p), _dot(second, p)

    def at(self, rows: slice) -> Probings:
        """Some of the rows; quantities that depend on the order of all probings do not change."""
        return _Slice(self, rows)

    def blocks(self, size: int) -> Iterator[tuple[slice, Probings]]:
        """The rows in blocks that fit into a processor's cache."""
        count = len(self)
        for first in range(0, count, size):
            rows = slice(first, min(first + size, count))
            yield rows, self.at(rows)


class _Slice(Probings):
    def __init__(self, whole: Probings, rows: slice) -> None:
        super().__init__(whole.columns, whole.setting)
        self.whole, self.rows = whole, rows

    @property
    def first_row(self) -> int:
        return self.whole.first_row + self.rows.start

    def column(self, name: str) -> Array:
        if name not in self._made:
            self._made[name] = self.whole.column(name)[..., self.rows]
        return self._made[name]

    def touches_since_pause(self, pause_s: float) -> Array:
        return self.whole.touches_since_pause(pause_s)[self.rows]

    def rest_s(self) -> Array:
        return self.whole.rest_s()[self.rows]

    def since_placed_s(self) -> Array:
        return self.whole.since_placed_s()[self.rows]

    def rested(self, touches: float) -> Array:
        return self.whole.rested(touches)[self.rows]

    def lagged(self, name: str, lag_s: float | Array) -> Array:
        return self.whole.lagged(name, lag_s)[..., self.rows]

    def way(self) -> Array:
        return self.whole.way()[self.rows]

    def since_turning_mm(self) -> Array:
        return self.whole.since_turning_mm()[self.rows]

    def held_mm(self, column: str, way_mm: float) -> Array:
        return self.whole.held_mm(column, way_mm)[..., self.rows]

    def run_mm(self, axis: str) -> Array:
        return self.whole.run_mm(axis)[..., self.rows]


def _told_apart(columns: Array) -> tuple[Rows, Rows]:
    """Of ``(3, n)``: index of the first of each distinct column, and for each column which of them it is.

    First those of a few rows are tried, since most recordings have few directions, then those of all. If two columns
    have the same weighted sum, every column counts as distinct.
    """
    marks = _MARK @ columns
    for some in (marks[:FEW], marks):
        mark, first = np.unique(some, return_index=True)
        which = np.minimum(np.searchsorted(mark, marks), len(mark) - 1)
        if np.array_equal(columns[:, first][:, which], columns):
            return first, which
    return np.arange(len(marks)), np.arange(len(marks))


def _across(probe: ProbeTable | None) -> tuple[Array, Array]:
    """Two unit vectors perpendicular to the stylus; for a stylus down they are machine x and y."""
    stylus = np.array([0.0, 0.0, -1.0] if probe is None else probe.stylus_direction)
    start = np.array([1.0, 0.0, 0.0]) if abs(stylus[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = start - stylus * (start @ stylus)
    first /= np.linalg.norm(first)
    return first, np.cross(first, stylus)


def _dot(vector: Array, columns: list[Array]) -> Array:
    terms = [share * column for share, column in zip(vector, columns, strict=True) if abs(share) > 1e-15]
    return sum(terms[1:], terms[0])
