"""Results of the verbs of a probe: a sphere that was probed virtually, a qualification, compensated points, a bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.dates import moment_now
from stepgauge.files.display import Plotted, figures
from stepgauge.files.stored import StoredResult, WrittenResult
from stepgauge.files.tables import csv_text, read_rows
from stepgauge.files.text import write_text
from stepgauge.physics.directions import evenly_spread_points, iso_10360_5_points
from stepgauge.physics.sphere import SphereFit
from stepgauge.probes import Probe
from stepgauge.probes.bench import BenchSession, write_bench
from stepgauge.probes.compensation import (
    CompensatedPoints,
    compensate_points,
    compensation_warnings,
    spheres,
    write_compensated,
)
from stepgauge.probes.files import APPROACH, POSITION, ProbedPoints
from stepgauge.probes.qualification import (
    KIND,
    Method,
    Qualification,
    check_qualification,
    read_qualification,
    write_qualification,
)
from stepgauge.recording.lines import read_comments
from stepgauge.recording.simulated import SIMULATED_COMMENT

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class SpherePoints(Plotted):
    """Tip centres in mm and approaches, ``rows`` of shape ``(n, 6)``, of a probe on a sphere at the origin."""

    is_table: ClassVar[bool] = True
    rows: Array
    probe: str
    seed: int

    def summary(self) -> str:
        """How many points of which probe."""
        return f"{len(self.rows)} points on a sphere, simulated: {self.probe}"

    def to_frame(self) -> pd.DataFrame:
        """One row per point; ``attrs`` has the comments of the file."""
        import pandas as pd

        found = pd.DataFrame(self.rows, columns=[*POSITION, *APPROACH])
        found.attrs.update(self._comments())
        return found

    def _comments(self) -> dict[str, Any]:
        return {"probe": self.probe, "seed": self.seed, "measured_at": moment_now(), **SIMULATED_COMMENT}

    @classmethod
    def read(cls, path: str | Path) -> SpherePoints:
        """The points of a table that :meth:`write` wrote."""
        comments, _ = read_comments(path)
        if not {"probe", "seed"} <= comments.keys():
            raise InputError(path, "no points of a virtual sphere", expected="what probe_sphere has written")
        return cls(
            read_rows(path, (*POSITION, *APPROACH)).numbers((*POSITION, *APPROACH)),
            comments["probe"],
            int(comments["seed"]),
        )

    def _stated(self) -> Any:
        return self.rows.round(7) + 0.0, self.probe, self.seed

    def write(self, path: str | Path) -> None:
        """Write the table (CSV)."""
        head = "".join(f"# {key}: {value}\n" for key, value in self._comments().items())
        write_text(path, head + csv_text([*POSITION, *APPROACH], (self.rows.round(7) + 0.0).tolist()))


def probed_sphere(probe: Probe, diameter_mm: float, count: int, scatter_um: float, seed: int) -> Array:
    """Rows of tip centre and approach, (count, 6), on a sphere at the origin.

    A recorded centre is contact - r p + w p with the approach p, so it lies R + r - w from the sphere's centre.
    """
    pattern = iso_10360_5_points() if count == 25 else evenly_spread_points(count)
    approach = probe.approaches(pattern)
    pretravel_um = probe.pretravel_um(approach)
    if not np.isfinite(pretravel_um).all():
        expected = naming("stylus_direction", words="another {}")
        raise InputError(naming("probe"), "never triggers in some direction of the sphere", expected=expected)
    pretravel_um = pretravel_um + np.random.default_rng(seed).normal(0.0, scatter_um, count)
    reach_mm = diameter_mm / 2.0 + probe.tip_radius_mm - pretravel_um * 1e-3
    return np.column_stack([-approach * reach_mm[:, None], approach])


@dataclass(frozen=True, repr=False)
class Qualified(WrittenResult, Plotted):
    """A ``qualification``, and the directions in which the sphere was approached, ``(n, 3)``."""

    drawn_by: ClassVar[str] = "qualification.draw_residuals"
    qualification: Qualification
    approach: Array

    @property
    def r_eff_mm(self) -> float:
        """Effective radius of the tip."""
        return self.qualification.r_eff_mm

    @property
    def warnings(self) -> list[str]:
        """That the model of the lobes does not fit, where it does not."""
        found = self.qualification
        advice = "; leave out --lobe-azimuth, or compensate with --method mean"
        if found.worse_by_um > 0.0:
            return [f"warning: {found.worse_words()}{advice}"]
        return [f"warning: {words}"] if (words := found.misfit_words()) else []

    def summary(self) -> str:
        """Effective radius, form error, and lobes."""
        found, u_mm = self.qualification, self.qualification.u_r_eff_mm
        u = "unknown (no point is left over to tell it)" if u_mm is None else f"{1e3 * u_mm:.2f} um"
        lines = [
            f"effective radius   {found.r_eff_mm:.5f} mm, standard uncertainty {u}",
            f"form error         {found.form_error_um:.2f} um over {found.points} points",
        ]
        lobes, compensated = found.lobes, found.form_error_compensated_um
        if lobes is None or compensated is None:
            why = (
                f"not determined: {found.undetermined}"
                if found.undetermined
                else "not known without the diameter of the tip"
            )
            return "\n".join([*lines, f"lobes              {why}", *self.warnings])
        model = f"{lobes.transducer}, A = {lobes.constant_um:.2f} um"
        if lobes.transducer == "kinematic":
            sure = "as stated" if lobes.u_lobe_azimuth_deg is None else f"u {lobes.u_lobe_azimuth_deg:.1f} deg"
            model += f", lobe at {lobes.lobe_azimuth_deg:.1f} deg, {sure}"
        mean = f"mean pre-travel    {lobes.mean_pretravel_um:.2f} um ({model})"
        return "\n".join([*lines, mean, f"form, compensated  {compensated:.2f} um", *self.warnings])

    def to_frame(self) -> pd.DataFrame:
        """One row per point: radial residual in um with the mean radius, and with the lobes taken off."""
        import pandas as pd

        found = self.qualification
        after = found.residuals_compensated_um or [float("nan")] * found.points
        return pd.DataFrame({"residual_um": found.residuals_um, "compensated_um": after})

    def write(self, path: str | Path) -> None:
        """Write the qualification (JSON), which ``read_qualification`` reads."""
        with self.keeping():
            write_qualification(path, self.qualification)

    def draw(self, path: str | Path) -> None:
        """Residuals before and after, as a figure in a file."""
        figures("qualification").draw_qualification(self.approach, self.qualification, path)


@dataclass(frozen=True, repr=False)
class Compensated(Plotted):
    """Points without the pre-travel, and the spheres through them where they lie on one."""

    points: CompensatedPoints
    qualification: Qualification
    spheres: Mapping[str, SphereFit]
    warnings: tuple[str, ...]

    def summary(self) -> str:
        """Range of the correction, and the spheres."""
        taken = self.points.pretravel_um
        lines = [f"{len(taken)} points; corrected by a pre-travel of {taken.min():.2f} to {taken.max():.2f} um"]
        for name, fit in self.spheres.items():
            lines.append(f"{name:<12} diameter {2 * fit.radius_mm:.5f} mm, form error {fit.form_error_um:.2f} um")
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """One row per point: the correction in um, the tip centre at the first touch and the surface point in mm."""
        import pandas as pd

        found = self.points
        frame = pd.DataFrame({"pretravel_um": found.pretravel_um})
        for kind, values in (("centre", found.centre_mm), ("surface", found.surface_mm)):
            for axis, column in zip("xyz", values.T, strict=True):
                frame[f"{kind}_{axis}_mm"] = column
        return frame

    def write(self, path: str | Path) -> None:
        """Write the table (CSV)."""
        write_compensated(path, self.points)

    def draw(self, path: str | Path) -> None:
        """The corrections, or the errors of the sphere, as a figure in a file."""
        probed, axis = self.points.points, self.qualification.stylus_axis
        simulated = probed.simulated or self.qualification.simulated
        drawing = figures("qualification")
        if self.spheres:
            drawing.draw_sphere_errors(probed.approach, self.spheres, axis, path, simulated)
        else:
            drawing.draw_compensation(probed.approach, self.points.pretravel_um, axis, path, simulated)


def given_qualification(given: str | Path | Qualified | StoredResult) -> tuple[Qualification, str | Path]:
    """A qualification by its file, as it was found or as it was read back, and its place for messages."""
    if isinstance(given, Qualified):
        return given.qualification, KIND
    if isinstance(given, StoredResult) and given.kind == KIND:
        return check_qualification(given.values, KIND), KIND
    if isinstance(given, str | Path):
        return read_qualification(given), given
    expected = "what qualify_probe gives, or its file"
    raise InputError(naming(KIND), "this is no qualification", found=type(given).__name__, expected=expected)


def compensated(
    probed: ProbedPoints, found: Qualification, method: Method, where: str | Path, on_sphere: bool
) -> Compensated:
    """Points corrected by a qualification; errors as :func:`compensate_points`."""
    result = compensate_points(probed, found, method, where)
    fits = spheres(probed, found) if on_sphere else {}
    warnings = (f"warning: {one}" for one in compensation_warnings(found, method, fits))
    return Compensated(result, found, fits, tuple(warnings))


@dataclass(frozen=True, repr=False)
class BenchResult(WrittenResult, Plotted):
    """The pushes of a bench and what they give by direction."""

    session: BenchSession
    coverage_factor: float = 2.0

    def summary(self) -> str:
        """A table by direction, and the anisotropy."""
        lines = ["direction  pushes  pre-travel  hysteresis  repeatability (um)"]
        lines += [
            f"{one.direction_deg:8.1f}  {one.count:6d}  {one.pretravel_um:10.3f}  {one.hysteresis_um:10.3f}  "
            f"{one.trigger_range_um:13.3f}"
            for one in self.session.directions
        ]
        spread = self.session.anisotropy
        mean = f"mean pre-travel {spread.mean_pretravel_um:.3f} um, anisotropy {spread.pretravel_um:.3f} um"
        return "\n".join([*lines, mean])

    def to_frame(self) -> pd.DataFrame:
        """One row per direction, lengths in um."""
        import pandas as pd

        names = ("direction_deg", "count", "pretravel_um", "hysteresis_um", "trigger_range_um")
        return pd.DataFrame([{name: getattr(one, name) for name in names} for one in self.session.directions])

    def write(self, path: str | Path) -> list[Path]:
        """Write one row per push (CSV), and directions and budget (JSON); returns the paths."""
        with self.keeping():
            return write_bench(path, self.session, self.coverage_factor)

    def draw(self, path: str | Path) -> None:
        """A push and the directions, as a figure in a file."""
        one = self.session
        drawing = figures("qualification")
        drawing.draw_bench(one.pushes[0].channels, one.events[0], one.directions, path, one.simulated)
