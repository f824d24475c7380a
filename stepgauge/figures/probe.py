"""Figures of a probe's map: polar plots, curves over the azimuth, and the pre-travel body."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, figure_style, new_figure, save_figure
from stepgauge.files.arrays import Array
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes.base import Probe
from stepgauge.probes.directions_map import DirectionMap, map_directions

if TYPE_CHECKING:
    from matplotlib.axes import Axes


QUANTITIES = (
    ("trigger_force_N", "trigger force (N)"),
    ("deflection_um", "deflection (\N{MICRO SIGN}m)"),
    ("pretravel_um", "pre-travel (\N{MICRO SIGN}m)"),
)

# More curves than this get a colour scale instead of a legend.
_MOST_LABELS = 10

# Ordered in grey and for the colour-blind.
_SCALE = "cividis"


@figure_style()
def draw_polar(found: DirectionMap, path: str | Path) -> None:
    """Force and pre-travel over the azimuth as polar plots, one curve per polar angle (as Wozniak Fig 5)."""
    shown = [item for item in _known(found) if item[0] != "deflection_um"]
    fig = new_figure(82.0 * len(shown), 104.0)
    for i, (name, label) in enumerate(shown):
        axes: Any = fig.add_subplot(1, len(shown), i + 1, projection="polar")
        azimuth_deg, closed = _closed(found, getattr(found, name))
        _draw_rows(axes, found, np.radians(azimuth_deg), closed)
        axes.set_ylim(0.0, 1.08 * float(closed[np.isfinite(closed)].max()))
        _label_rings(axes)
        axes.set_title(label)
    _explain(fig, found)
    save_figure(fig, path, found.simulated)


@figure_style()
def draw_curves(found: DirectionMap, path: str | Path) -> None:
    """Force, deflection and pre-travel over the azimuth, one curve per polar angle."""
    shown = _known(found)
    fig = new_figure(60.0 * len(shown) + 8.0, 80.0)
    for axes, (name, label) in zip(np.ravel(fig.subplots(1, len(shown), sharex=True)), shown, strict=True):
        _draw_rows(axes, found, *_closed(found, getattr(found, name)))
        axes.set_xlabel("azimuth of the normal (°)")
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
        if np.ptp(found.azimuth_deg) > 180.0:
            axes.set_xticks(np.arange(0.0, 361.0, 60.0))
    _explain(fig, found)
    save_figure(fig, path, found.simulated)


def draw_pretravel(axes: Axes, found: DirectionMap) -> None:
    """Pre-travel over the azimuth, one curve per polar angle, on axes of somebody else."""
    _draw_rows(axes, found, *_closed(found, found.pretravel_um))
    axes.set(xlabel="azimuth of the normal (°)", ylabel=QUANTITIES[-1][1], ylim=(0.0, None))
    if len(found.polar_deg) <= _MOST_LABELS:
        axes.legend(title="polar angle", frameon=False)
    axes.set_title(found.name, loc="left")


@figure_style()
def draw_body(probe: Probe, path: str | Path) -> None:
    """The pre-travel body: in each direction of the normal the pre-travel is the distance from the centre.

    Drawn over the half space of surfaces that push the tip towards the probe body or sideways.
    """
    found = map_directions(probe, np.linspace(0.0, 90.0, 91), np.linspace(0.0, 360.0, 361))
    polar, azimuth, _, _, size = found.columns()
    body = size[..., None] * unit_vectors(np.radians(azimuth), np.radians(90.0 - polar))
    fig = new_figure(120.0, 88.0)
    fig.set_layout_engine("none")
    axes: Any = fig.add_axes((-0.02, -0.04, 0.82, 1.04), projection="3d")
    _draw_surface(axes, body, size)
    axes.plot(*body[-1].T, color=COLORS["model"], linewidth=0.8)
    _equal_axes(axes, 1.02 * float(size.max()), float(body[..., 2].max()))
    _draw_scale(fig, size)
    fig.text(0.04, 0.94, probe.name, fontsize="large")
    save_figure(fig, path, simulated=True)


def _draw_surface(axes: Any, body: Array, size: Array) -> None:
    from matplotlib import colormaps

    colors = colormaps[_SCALE]((size - size.min()) / max(float(np.ptp(size)), 1e-9))
    colors[..., :3] *= _brightness(body)[..., None]
    x, y, z = np.moveaxis(body, -1, 0)
    axes.plot_surface(x, y, z, facecolors=colors, rstride=1, cstride=2, linewidth=0.0, antialiased=False, shade=False)


def _brightness(body: Array) -> Array:
    """A mild light from above the left shoulder: enough to see the shape, too little to hide the colour scale."""
    normal = np.cross(np.gradient(body, axis=0), np.gradient(body, axis=1))
    length = np.linalg.norm(normal, axis=-1)
    light = np.array([-0.5, -0.3, 0.8])
    facing = np.abs(normal @ light) / np.where(length > 0.0, length * np.linalg.norm(light), 1.0)
    return np.where(length > 0.0, 0.72 + 0.28 * facing, 1.0)


def _draw_scale(fig: Any, size: Array) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(float(size.min()), float(size.max())), _SCALE)
    bar = fig.colorbar(scale, cax=fig.add_axes((0.87, 0.2, 0.025, 0.6)))
    bar.set_label("pre-travel (\N{MICRO SIGN}m)")


def _label_rings(axes: Any) -> None:
    """Few rings, labelled over a white rim so that curves may pass under the numbers."""
    from matplotlib.patheffects import withStroke
    from matplotlib.ticker import MaxNLocator

    axes.set_rlabel_position(90.0)
    low, high = axes.get_ylim()
    axes.set_yticks([tick for tick in MaxNLocator(4).tick_values(low, high) if low < tick < 0.93 * high])
    for label in axes.get_yticklabels():
        label.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
        label.set_zorder(5.0)


def _known(found: DirectionMap) -> list[tuple[str, str]]:
    return [(name, label) for name, label in QUANTITIES if np.isfinite(getattr(found, name)).any()]


def _closed(found: DirectionMap, values: Array) -> tuple[Array, Array]:
    """Azimuths and values ``(polar, azimuth)``; the first azimuth comes again at 360 deg where they go all round."""
    if not _goes_round(found.azimuth_deg):
        return found.azimuth_deg, values
    azimuth = np.append(found.azimuth_deg, found.azimuth_deg[:1] + 360.0)
    return azimuth, np.column_stack([values, values[:, :1]])


def _goes_round(azimuth_deg: Array) -> bool:
    """Whether the azimuths leave no gap wider than their own step before 360 deg."""
    if len(azimuth_deg) < 3:
        return False
    gap = azimuth_deg[0] + 360.0 - azimuth_deg[-1]
    return bool(0.0 < gap <= 1.5 * np.diff(azimuth_deg).max())


def _draw_rows(axes: Any, found: DirectionMap, angle: Array, values: Array) -> None:
    for i, color in enumerate(_shades(len(found.polar_deg))):
        finite = np.where(np.isfinite(values[i]), values[i], np.nan)
        axes.plot(angle, finite, color=color, label=f"{found.polar_deg[i]:g}\N{DEGREE SIGN}")


def _shades(count: int) -> list[Any]:
    """Dark to light along a scale that stays ordered in grey and for the colour-blind; its yellow end is too pale."""
    from matplotlib import colormaps

    return [colormaps["viridis"](share) for share in np.linspace(0.0, 0.9, count)]


def _explain(fig: Any, found: DirectionMap) -> None:
    entries = list(axes_entries(fig.axes[0]).items())
    every = -(-len(entries) // _MOST_LABELS)
    add_legend(fig, dict(entries[::every]), "lower center", "polar angle of the surface normal from the stylus axis")


def _equal_axes(axes: Any, reach: float, height: float) -> None:
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_zlim(0.0, height)
    axes.set_box_aspect((2.0, 2.0, max(height / reach, 0.1)), zoom=1.0)
    axes.view_init(elev=38.0, azim=-60.0)
    for name, pane in (("x", axes.xaxis), ("y", axes.yaxis), ("z", axes.zaxis)):
        getattr(axes, f"set_{name}label")(f"{name} (\N{MICRO SIGN}m)", labelpad=-9.0 if name == "z" else -4.0)
        pane.set_pane_color((1.0, 1.0, 1.0, 0.0))
        pane.set_tick_params(pad=-2.0)
    axes.locator_params(axis="z", nbins=2)
