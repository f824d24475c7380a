"""The columns of the store's tables, their units and meanings; ``docs/fleet.md`` is compared with these lists.

The version counts changes that an older reader would misread; a store of a later version is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from stepgauge.errors import InputError

VERSION = 1
FORMAT = "stepgauge fleet"
OWNERS = ("machine", "type", "hall", "probe", "gauge")
"""To whom an error can belong, besides the day; only machine and gauge are always known."""


@dataclass(frozen=True)
class StoredColumn:
    """A column: its name, its type by the name of Arrow, and what it means; ``null``: whether it may be unknown."""

    name: str
    kind: str
    meaning: str
    null: bool = False


_IDENTITY = (
    StoredColumn("recording", "string", "the recording: 32 hexadecimal digits of the SHA-256 of its canonical content"),
    StoredColumn("machine", "string", "identity of the machine"),
    StoredColumn("type", "string", "model line of the machine", True),
    StoredColumn("hall", "string", "hall that the machine stood in", True),
    StoredColumn("probe", "string", "identity of the probe", True),
    StoredColumn("gauge", "string", "identity of the gauge: its serial number, unless stated otherwise"),
    StoredColumn("measured_at", "timestamp[us]", "when it was measured, local time"),
)
RECORDINGS = (
    *_IDENTITY,
    StoredColumn("rows", "int64", "number of probings"),
    StoredColumn("cycles", "int64", "largest number of a cycle"),
    StoredColumn("faces", "int64", "number of different faces"),
    StoredColumn("placements", "int64", "number of placements of the gauge"),
    StoredColumn("certificate", "string", "key of the gauge's certificate, a folder in objects/gauge"),
    StoredColumn("machine_file", "string", "key of the machine file, a folder in objects/machine", True),
    StoredColumn("placement_files", "list<string>", "text of the placement files, in the order of the placements"),
    StoredColumn("comments", "string", "the comments of the recording, JSON"),
    StoredColumn("columns", "string", "columns of the recording in their order, with their types, JSON"),
    StoredColumn("name", "string", "name of the file that came in"),
    StoredColumn("added_at", "timestamp[us]", "when it was added, UTC"),
    StoredColumn("file", "string", "file of its probings, from the store's folder"),
    StoredColumn("first_row", "int64", "row of that file at which its probings begin, from 0"),
)
SOURCES = (
    StoredColumn("recording", "string", "the recording"),
    StoredColumn("source", "binary", "the file that came in, byte for byte"),
)
PROBINGS = (
    *_IDENTITY,
    StoredColumn("placement", "int32", "number of the placement"),
    StoredColumn("cycle", "int32", "number of the cycle"),
    StoredColumn("face", "int32", "number of the face: odd ones are fronts"),
    StoredColumn("x_mm", "double", "indicated tip centre, mm"),
    StoredColumn("y_mm", "double", "indicated tip centre, mm"),
    StoredColumn("z_mm", "double", "indicated tip centre, mm"),
    StoredColumn("approach_i", "double", "direction of travel towards the surface, along x"),
    StoredColumn("approach_j", "double", "along y"),
    StoredColumn("approach_k", "double", "along z"),
    StoredColumn("time_s", "double", "time since the beginning, s", True),
    StoredColumn("speed_mm_s", "double", "measuring speed, mm/s", True),
    StoredColumn("gauge_temperature_C", "double", "temperature of the gauge, deg C", True),
    StoredColumn("scale_temperature_x_C", "double", "temperature of the scale of x, deg C", True),
    StoredColumn("scale_temperature_y_C", "double", "temperature of the scale of y, deg C", True),
    StoredColumn("scale_temperature_z_C", "double", "temperature of the scale of z, deg C", True),
    StoredColumn("covariates", "map<string, double>", "further columns by their names"),
)
OWN = tuple(column.name for column in PROBINGS if column not in _IDENTITY and column.name != "covariates")
"""Columns of a recording that have one of their own; the others are covariates."""

_UM = "of the faces, um; not a number where undefined"
EVALUATIONS = (
    StoredColumn("recording", "string", "the recording; a row for each of its placements"),
    StoredColumn("placement", "int32", "number of the placement; 0 where the recording cannot be evaluated"),
    StoredColumn("error", "string", "why it cannot be evaluated", True),
    StoredColumn("direction", "string", "x, y or z, or the gauge axis as numbers where it lies along none", True),
    StoredColumn("cycles", "int32", "least number of probings of a face", True),
    StoredColumn("gauge_temperature_C", "double", "mean temperature of the gauge, deg C", True),
    StoredColumn("span_mm", "double", "certified length that was measured, mm", True),
    StoredColumn("scale_ppm", "double", "slope of XM, um/m", True),
    StoredColumn("u_scale_ppm", "double", "its standard uncertainty from repeatability, um/m", True),
    StoredColumn("reversal_um", "double", "mean of XR, um", True),
    StoredColumn("u_reversal_um", "double", "its standard uncertainty from repeatability, um", True),
    StoredColumn("reversal_of_scale_um", "double", "what of it the scale error shows of itself, um", True),
    StoredColumn("r_eff_mm", "double", "effective tip radius, mm", True),
    StoredColumn("u_r_eff_mm", "double", "its standard uncertainty, mm", True),
    StoredColumn("u_r_eff_change_um", "double", "the same from repeatability alone, um", True),
    StoredColumn("band_um", "double", "range of XM, um", True),
    StoredColumn("worst_two_sigma_um", "double", "twice the largest standard deviation of a face, um", True),
    StoredColumn("s_um", "double", "standard deviation of a probing, pooled over the faces, um", True),
    StoredColumn("s_dof", "double", "its degrees of freedom", True),
    StoredColumn("s_faces", "double", "number of faces with repeats", True),
    StoredColumn("simulated", "int32", "1 where no machine was measured", True),
    StoredColumn("axis_i", "double", "direction of the gauge axis, along x", True),
    StoredColumn("axis_j", "double", "along y", True),
    StoredColumn("axis_k", "double", "along z", True),
    StoredColumn("origin_x_mm", "double", "a reading nearest to the beginning of the gauge, mm", True),
    StoredColumn("origin_y_mm", "double", "mm", True),
    StoredColumn("origin_z_mm", "double", "mm", True),
    StoredColumn("notes", "list<string>", "what the evaluation remarks"),
    StoredColumn("left_out", "int32", "readings that their repeats contradict", True),
    StoredColumn("face", "list<int32>", "numbers of the faces"),
    StoredColumn("count", "list<int32>", "probings of the faces", True),
    StoredColumn("position_mm", "list<double>", "certified positions of the faces, mm", True),
    *(
        StoredColumn(name, "list<double>", f"{text} {_UM}", True)
        for name, text in (
            ("xf_um", "forward error XF"),
            ("sf_um", "its standard deviation"),
            ("xb_um", "backward error XB"),
            ("sb_um", "its standard deviation"),
            ("xm_um", "mean error XM"),
            ("xr_um", "reversal error XR"),
        )
    ),
)

DIAGNOSES = (
    StoredColumn("recording", "string", "the recording, diagnosed by itself"),
    StoredColumn("error", "string", "why it cannot be diagnosed", True),
    StoredColumn("verdict", "string", "adequate, effects, unknown or insufficient", True),
    StoredColumn("summary", "string", "verdict, effects and fit in a line", True),
    StoredColumn("kinds", "list<string>", "kinds of the effects that were named"),
    StoredColumn("labels", "list<string>", "the same with axis, plane or face"),
    StoredColumn("probabilities", "list<double>", "their probabilities, each with what it is confounded with"),
    StoredColumn("noise_um", "double", "standard deviation of a probing, um", True),
    StoredColumn("rms_before_um", "double", "root mean square of the residuals, um", True),
    StoredColumn("rms_after_um", "double", "the same after the effects are taken off, um", True),
    StoredColumn("document", "string", "diagnosis.json without the names of files", True),
)
BUDGETS = (
    StoredColumn("recording", "string", "the recording; a row for each quantity of its budget"),
    StoredColumn("error", "string", "why it has no budget", True),
    StoredColumn("quantity", "string", "r_eff, xf, xb, xm or xr", True),
    StoredColumn("placement", "int32", "number of the placement; 0 where there is no budget"),
    StoredColumn("face", "int32", "number of the face; r_eff has none", True),
    StoredColumn("position_mm", "double", "its certified position, mm", True),
    StoredColumn("value_um", "double", "value, um; r_eff, too", True),
    StoredColumn("u_um", "double", "combined standard uncertainty, um", True),
    StoredColumn("dof", "double", "its effective degrees of freedom; null where they are infinite", True),
    StoredColumn("k", "double", "coverage factor", True),
    StoredColumn("expanded_um", "double", "expanded uncertainty U, um", True),
    StoredColumn("coverage_percent", "double", "coverage probability of U, %", True),
    StoredColumn("through_r_eff_um", "double", "share of u through r_eff, part of the others, um", True),
    StoredColumn("same_terms_u_um", "double", "u of the sources that the Monte Carlo knows, um", True),
    StoredColumn("monte_carlo_u_um", "double", "u by the Monte Carlo, um", True),
    StoredColumn("monte_carlo_low_95_um", "double", "lower end of its 95 % interval, um", True),
    StoredColumn("monte_carlo_high_95_um", "double", "upper end, um", True),
    StoredColumn("contributions_um", "map<string, double>", "standard uncertainty that each source contributes, um"),
    StoredColumn("not_included", "list<string>", "contributions that no file states"),
)


@cache
def arrow_schema(columns: tuple[StoredColumn, ...]) -> Any:
    """The columns as a schema of pyarrow."""
    arrow = arrow_library()
    kinds = {
        "list<string>": arrow.list_(arrow.string()),
        "list<int32>": arrow.list_(arrow.int32()),
        "list<double>": arrow.list_(arrow.float64()),
        "map<string, double>": arrow.map_(arrow.string(), arrow.float64()),
        "timestamp[us]": arrow.timestamp("us"),
        "double": arrow.float64(),
    }
    return arrow.schema(
        [arrow.field(one.name, kinds.get(one.kind) or getattr(arrow, one.kind)(), one.null) for one in columns]
    )


def arrow_library() -> Any:
    """The module ``pyarrow`` (:class:`InputError` where it is not installed)."""
    return needed("pyarrow")


def needed(module: str) -> Any:
    """A module of the extra ``fleet``, imported only when it is used."""
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        raise InputError("fleet", f"this needs {name}", expected="pip install 'stepgauge[fleet]'") from None
