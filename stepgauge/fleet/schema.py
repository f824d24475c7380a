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
class Column:
    """A column: its name, its type by the name of Arrow, and what it means; ``null``: whether it may be unknown."""

    name: str
    kind: str
    meaning: str
    null: bool = False


_IDENTITY = (
    Column("recording", "string", "the recording: 32 hexadecimal digits of the SHA-256 of its canonical content"),
    Column("machine", "string", "identity of the machine"),
    Column("type", "string", "model line of the machine", True),
    Column("hall", "string", "hall that the machine stood in", True),
    Column("probe", "string", "identity of the probe", True),
    Column("gauge", "string", "identity of the gauge: its serial number, unless stated otherwise"),
    Column("measured_at", "timestamp[us]", "when it was measured, local time"),
)
RECORDINGS = (
    *_IDENTITY,
    Column("rows", "int64", "number of probings"),
    Column("cycles", "int64", "largest number of a cycle"),
    Column("faces", "int64", "number of different faces"),
    Column("placements", "int64", "number of placements of the gauge"),
    Column("certificate", "string", "key of the gauge's certificate, a folder in objects/gauge"),
    Column("machine_file", "string", "key of the machine file, a folder in objects/machine", True),
    Column("placement_files", "list<string>", "text of the placement files, in the order of the placements"),
    Column("comments", "string", "the comments of the recording, JSON"),
    Column("columns", "string", "columns of the recording in their order, with their types, JSON"),
    Column("name", "string", "name of the file that came in"),
    Column("added_at", "timestamp[us]", "when it was added, UTC"),
    Column("file", "string", "file of its probings, from the store's folder"),
    Column("first_row", "int64", "row of that file at which its probings begin, from 0"),
)
SOURCES = (
    Column("recording", "string", "the recording"),
    Column("source", "binary", "the file that came in, byte for byte"),
)
PROBINGS = (
    *_IDENTITY,
    Column("placement", "int32", "number of the placement"),
    Column("cycle", "int32", "number of the cycle"),
    Column("face", "int32", "number of the face: odd ones are fronts"),
    Column("x_mm", "double", "indicated tip centre, mm"),
    Column("y_mm", "double", "indicated tip centre, mm"),
    Column("z_mm", "double", "indicated tip centre, mm"),
    Column("approach_i", "double", "direction of travel towards the surface, along x"),
    Column("approach_j", "double", "along y"),
    Column("approach_k", "double", "along z"),
    Column("time_s", "double", "time since the beginning, s", True),
    Column("speed_mm_s", "double", "measuring speed, mm/s", True),
    Column("gauge_temperature_C", "double", "temperature of the gauge, deg C", True),
    Column("scale_temperature_x_C", "double", "temperature of the scale of x, deg C", True),
    Column("scale_temperature_y_C", "double", "temperature of the scale of y, deg C", True),
    Column("scale_temperature_z_C", "double", "temperature of the scale of z, deg C", True),
    Column("covariates", "map<string, double>", "further columns by their names"),
)
OWN = tuple(column.name for column in PROBINGS if column not in _IDENTITY and column.name != "covariates")
"""Columns of a recording that have one of their own; the others are covariates."""

_UM = "of the faces, um; not a number where undefined"
EVALUATIONS = (
    Column("recording", "string", "the recording; a row for each of its placements"),
    Column("placement", "int32", "number of the placement; 0 where the recording cannot be evaluated"),
    Column("error", "string", "why it cannot be evaluated", True),
    Column("direction", "string", "x, y or z, or the gauge axis as numbers where it lies along none", True),
    Column("cycles", "int32", "least number of probings of a face", True),
    Column("gauge_temperature_C", "double", "mean temperature of the gauge, deg C", True),
    Column("span_mm", "double", "certified length that was measured, mm", True),
    Column("scale_ppm", "double", "slope of XM, um/m", True),
    Column("u_scale_ppm", "double", "its standard uncertainty from repeatability, um/m", True),
    Column("reversal_um", "double", "mean of XR, um", True),
    Column("u_reversal_um", "double", "its standard uncertainty from repeatability, um", True),
    Column("reversal_of_scale_um", "double", "what of it the scale error shows of itself, um", True),
    Column("r_eff_mm", "double", "effective tip radius, mm", True),
    Column("u_r_eff_mm", "double", "its standard uncertainty, mm", True),
    Column("u_r_eff_change_um", "double", "the same from repeatability alone, um", True),
    Column("band_um", "double", "range of XM, um", True),
    Column("worst_two_sigma_um", "double", "twice the largest standard deviation of a face, um", True),
    Column("s_um", "double", "standard deviation of a probing, pooled over the faces, um", True),
    Column("s_dof", "double", "its degrees of freedom", True),
    Column("s_faces", "double", "number of faces with repeats", True),
    Column("simulated", "int32", "1 where no machine was measured", True),
    Column("axis_i", "double", "direction of the gauge axis, along x", True),
    Column("axis_j", "double", "along y", True),
    Column("axis_k", "double", "along z", True),
    Column("origin_x_mm", "double", "a reading nearest to the beginning of the gauge, mm", True),
    Column("origin_y_mm", "double", "mm", True),
    Column("origin_z_mm", "double", "mm", True),
    Column("notes", "list<string>", "what the evaluation remarks"),
    Column("left_out", "int32", "readings that their repeats contradict", True),
    Column("face", "list<int32>", "numbers of the faces"),
    Column("count", "list<int32>", "probings of the faces", True),
    Column("position_mm", "list<double>", "certified positions of the faces, mm", True),
    *(
        Column(name, "list<double>", f"{text} {_UM}", True)
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
    Column("recording", "string", "the recording, diagnosed by itself"),
    Column("error", "string", "why it cannot be diagnosed", True),
    Column("verdict", "string", "adequate, effects, unknown or insufficient", True),
    Column("summary", "string", "verdict, effects and fit in a line", True),
    Column("kinds", "list<string>", "kinds of the effects that were named"),
    Column("labels", "list<string>", "the same with axis, plane or face"),
    Column("probabilities", "list<double>", "their probabilities, each with what it is confounded with"),
    Column("noise_um", "double", "standard deviation of a probing, um", True),
    Column("rms_before_um", "double", "root mean square of the residuals, um", True),
    Column("rms_after_um", "double", "the same after the effects are taken off, um", True),
    Column("document", "string", "diagnosis.json without the names of files", True),
)
BUDGETS = (
    Column("recording", "string", "the recording; a row for each quantity of its budget"),
    Column("error", "string", "why it has no budget", True),
    Column("quantity", "string", "r_eff, xf, xb, xm or xr", True),
    Column("placement", "int32", "number of the placement; 0 where there is no budget"),
    Column("face", "int32", "number of the face; r_eff has none", True),
    Column("position_mm", "double", "its certified position, mm", True),
    Column("value_um", "double", "value, um; r_eff, too", True),
    Column("u_um", "double", "combined standard uncertainty, um", True),
    Column("dof", "double", "its effective degrees of freedom; null where they are infinite", True),
    Column("k", "double", "coverage factor", True),
    Column("expanded_um", "double", "expanded uncertainty U, um", True),
    Column("coverage_percent", "double", "coverage probability of U, %", True),
    Column("through_r_eff_um", "double", "share of u through r_eff, part of the others, um", True),
    Column("same_terms_u_um", "double", "u of the sources that the Monte Carlo knows, um", True),
    Column("monte_carlo_u_um", "double", "u by the Monte Carlo, um", True),
    Column("monte_carlo_low_95_um", "double", "lower end of its 95 % interval, um", True),
    Column("monte_carlo_high_95_um", "double", "upper end, um", True),
    Column("contributions_um", "map<string, double>", "standard uncertainty that each source contributes, um"),
    Column("not_included", "list<string>", "contributions that no file states"),
)


@cache
def arrow_schema(columns: tuple[Column, ...]) -> Any:
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
