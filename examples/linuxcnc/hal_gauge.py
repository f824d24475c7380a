"""A step gauge in HAL, LinuxCNC's network of real-time components: the probe input as a function of x, y and z.

The gauge may lie anywhere. Two chained ``sum2`` components turn x, y, z into each gauge coordinate, a window
comparator per block says whether the tip ball reaches it, and gates combine them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import jinja2
import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.tables import read_numbers
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.collision import make_obstacles

Array = NDArray[np.float64]
HERE = Path(__file__).resolve().parent


class GaugeAxis(NamedTuple):
    """A gauge coordinate as a sum over machine coordinates: ``direction . (x, y, z) + offset_mm``."""

    name: str
    direction: Array
    offset_mm: float


class Window(NamedTuple):
    """A window comparator: true where its gauge coordinate lies strictly between the limits."""

    name: str
    axis: str
    low_mm: float
    high_mm: float


class Gate(NamedTuple):
    """An OR of two outputs."""

    name: str
    first: str
    second: str


def read_truth(path: str | Path, gauge: Gauge) -> Array:
    """Deviation of every face of the HAL gauge from the certificate, um, along the axis; shape ``(n_faces,)``."""
    table = read_numbers(path, ("face", "deviation_um"))
    expected = np.arange(1, gauge.n_faces + 1)
    if not np.array_equal(table["face"], expected):
        raise InputError(
            path, "one row per face, in order", found=f"{len(table.lines)} rows", expected=f"1 to {gauge.n_faces}"
        )
    return table["deviation_um"]


def true_bodies_mm(gauge: Gauge, placement: Placement, deviation_um: Array) -> tuple[Array, Array]:
    """Lowest and highest corners of the blocks and, as the last row, of the rail, in gauge coordinates."""
    bodies = make_obstacles(gauge, placement)
    low, high = bodies.low_mm.copy(), bodies.high_mm.copy()
    low[:-1, 0] += deviation_um[0::2] * 1e-3
    high[:-1, 0] += deviation_um[1::2] * 1e-3
    return low, high


def render_hal(
    gauge: Gauge,
    placement: Placement,
    deviation_um: Array,
    tip_radius_mm: float,
    template: Path = HERE / "simulation.hal.j2",
    **more: object,
) -> str:
    """The HAL file of the simulated machine with the gauge; ``more`` is for a template that extends the shipped one."""
    low, high = true_bodies_mm(gauge, placement, deviation_um)
    return render(
        template,
        axes=_axes(gauge, placement),
        windows=_windows(low - tip_radius_mm, high + tip_radius_mm),
        gates=_any_block(gauge.n_blocks),
        **more,
    )


def laid_anew(hal: str) -> list[str]:
    """The lines of a rendered HAL file that say where the gauge lies, to be run on a controller that is up."""
    return [line for line in hal.splitlines() if re.match(r"setp [asu]-xyz?\.", line)]


def _axes(gauge: Gauge, placement: Placement) -> list[GaugeAxis]:
    origin = placement.origin_mm(gauge)
    return [GaugeAxis(name, row, -float(row @ origin)) for name, row in zip("asu", placement.rotation, strict=True)]


def _windows(low: Array, high: Array) -> list[Window]:
    """``b1``.. along the blocks, ``bs`` and ``bu`` across them (all alike), ``ra``, ``rs``, ``ru`` of the rail."""
    along = [Window(f"b{i + 1}", "a", low[i, 0], high[i, 0]) for i in range(len(low) - 1)]
    across = [Window(f"b{axis}", axis, low[0, i], high[0, i]) for i, axis in ((1, "s"), (2, "u"))]
    rail = [Window(f"r{axis}", axis, low[-1, i], high[-1, i]) for i, axis in enumerate("asu")]
    return [*along, *across, *rail]


def _any_block(n_blocks: int) -> list[Gate]:
    """A chain of ORs over the blocks."""
    return [Gate(f"o{b}", "b1.out" if b == 2 else f"o{b - 1}.out", f"b{b}.out") for b in range(2, n_blocks + 1)]


def render(template: Path, **context: object) -> str:
    """A file through Jinja, which may extend one of this folder; ``exact`` prints every bit of a number."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([template.parent, HERE]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["exact"] = lambda value: np.format_float_positional(value, trim="0")
    return environment.get_template(template.name).render(context)
