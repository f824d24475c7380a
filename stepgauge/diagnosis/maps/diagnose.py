"""From a map and a probe file to the statements: the search, and the same rules as for recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.candidates import ProbeChange, candidates_for
from stepgauge.diagnosis.maps.data import MapData, lacking
from stepgauge.diagnosis.maps.findings import (
    kept_rows,
    located_alone,
    map_findings,
    map_remarks,
    map_structure,
)
from stepgauge.diagnosis.maps.model import MapModel, changed_table, check_model, without_force_gauge
from stepgauge.diagnosis.maps.result import MapDiagnosis, QuantityFit
from stepgauge.diagnosis.maps.scatter import MapScatter, estimate_scatter
from stepgauge.diagnosis.maps.signatures import MapRows
from stepgauge.diagnosis.maps.stated_map import StatedMap, stated_map
from stepgauge.diagnosis.priors import Priors, shipped_priors
from stepgauge.diagnosis.result import Verdict, rms
from stepgauge.diagnosis.statements import conclude
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.config import read_toml
from stepgauge.files.resources import find_data
from stepgauge.probes.read import probe_table

HALF_A_DIGIT = 0.5 + 1e-6
SIX_DIGITS = 5.1e-6
"""Relative resolution of six printed digits."""


def judged_map(data: MapData, probe_path: str | Path, priors: Priors | None = None) -> MapDiagnosis:
    """The diagnosis of a map against a probe file, or the shipped one of that name."""
    table, where = read_probe_table(probe_path)
    return replace(diagnose_map(MapModel(table, where, data), priors=priors), probe_path=where)


def read_probe_table(probe_path: str | Path) -> tuple[dict[str, Any], str]:
    """The ``[probe]`` table of a probe file as written there, and the path of the file."""
    path = find_data(probe_path, "probe", "probes")
    checked, where = probe_table(read_toml(path).get("probe"), path)
    table = checked.model_dump(exclude_unset=True)
    if table.get("model") == "table":
        expected = "a probe file of its construction (kinematic, piezo) or of a law (constant, lobed)"
        raise InputError(where, "a probe known by its map has no construction to diagnose", expected=expected)
    return table, str(where)


def diagnose_map(
    model: MapModel, candidates: Sequence[ProbeChange] | None = None, priors: Priors | None = None
) -> MapDiagnosis:
    """The diagnosis of a map; without ``candidates`` all possible changes of the model of the probe are tried.

    Raises :class:`InputError` for a probe file that does not give the measured quantities.
    """
    check_model(model)
    scatter = estimate_scatter(model.data, model.residuals(()))
    missing = lacking(model.data)
    if missing:
        return _unchanged("insufficient", model, scatter, missing)
    if _reproduced(model):
        return _unchanged("adequate", model, scatter)
    if candidates is None:
        candidates = candidates_for(model.table, [m.name for m in model.data.measured])
    return _diagnosis_of(stated_map(model, candidates, scatter, priors or shipped_priors()), scatter)


def _reproduced(model: MapModel) -> bool:
    """Whether the probe file gives every printed value: the residuals are rounding and no scatter."""
    pairs = zip(model.data.measured, model.residuals(()), strict=True)
    return all((np.abs(r) <= np.maximum(HALF_A_DIGIT * m.quantum, SIX_DIGITS * m.values)).all() for m, r in pairs)


def _unchanged(verdict: Verdict, model: MapModel, scatter: MapScatter, missing: tuple[str, ...] = ()) -> MapDiagnosis:
    """The unchanged residuals; the scatter is known from repeats or not at all."""
    kept, rows = np.ones(len(model.data), bool), MapRows(model, scatter.sigma)
    known = scatter.repeats or not missing
    by_row = [np.full(len(kept), s if known else np.nan) for s in scatter.sigma]
    fits = quantity_fits(rows, [rows.um] * 3, kept, by_row)
    chi2 = float(np.mean(rows.um**2)) if known else np.nan
    return MapDiagnosis(
        verdict=verdict,
        fits=fits,
        chi2_dof_before=chi2,
        chi2_dof_after=chi2,
        noise=scatter,
        data=model.data,
        kept=kept,
        probe=model.table,
        table=model.table,
        lacking=missing,
    )


def _diagnosis_of(found: StatedMap, scatter: MapScatter) -> MapDiagnosis:
    model, kept, by_row = found.rows.model, kept_rows(found), _row_deviations(found, scatter)
    slight = [one.lead.candidate.label for one in found.slight]
    findings, left = list(map_findings(found, by_row)), list(map_structure(found))
    concluded = conclude(found.answer, findings, left, found.priors.decision, slight)
    terms, named = found.fitted, found.rows.um - found.rows.moved(found.fitted)
    forms = [one.share_um for one in concluded.structure if len(one.share_um)]
    described = named - sum((found.rows.stacked(np.split(one, len(scatter.sigma))) for one in forms), 0.0 * named)
    return MapDiagnosis(
        verdict=concluded.verdict,
        findings=concluded.findings,
        located=tuple(located_alone(found, concluded.structure)),
        unexplained=concluded.structure,
        fits=quantity_fits(found.rows, (found.rows.um, named, described), kept, by_row),
        chi2_dof_before=_chi2_dof(found, found.rows.um, 0, kept, by_row),
        chi2_dof_after=_chi2_dof(found, named, sum(len(term.values) for term in terms), kept, by_row),
        noise=_grown(found, scatter),
        data=model.data,
        kept=kept,
        probe=model.table,
        table=without_force_gauge(changed_table(model.table, terms)),
        terms=terms,
        trail=tuple(found.search.trail),
        remarks=tuple(map_remarks(found)),
        probabilities=concluded.table,
        checks=found.checks,
    )


def quantity_fits(
    rows: MapRows, stages: Sequence[Array], kept: NDArray[np.bool_], by_row: Sequence[Array]
) -> tuple[QuantityFit, ...]:
    """Every quantity with its residuals ``(m,)`` before, without the named changes, and without the structure.

    ``kept (n,)``: rows that are not outliers; ``by_row (n,)``: scatter of each row of each quantity.
    """
    before, after, described = map(rows.parts, stages)
    each = zip(rows.data.measured, by_row, before, after, described, strict=True)
    return tuple(QuantityFit(measured, rms(sigma), a, b, c, kept) for measured, sigma, a, b, c in each)


def _chi2_dof(found: StatedMap, um: Array, fitted: int, kept: NDArray[np.bool_], by_row: Sequence[Array]) -> float:
    white = um * np.repeat(found.rows.sigma, len(kept)) / np.concatenate(by_row)
    used = np.tile(kept, len(found.rows.sigma))
    return float((white[used] ** 2).sum()) / max(int(used.sum()) - fitted, 1)


def _grown(found: StatedMap, scatter: MapScatter) -> MapScatter:
    grows = found.answer.probability_of_scatter("growth") >= found.priors.decision.stated
    return replace(scatter, grows=grows and found.state.noise.growth is not None)


def _row_deviations(found: StatedMap, scatter: MapScatter) -> list[Array]:
    """Standard deviation of every ordinary row of each quantity: the mean over repeats, else that of the model."""
    state, sigma = found.state, found.rows.sigma
    relative = np.sqrt(found.search.noise_models.variance(state.noise) * state.noise.weight)
    found_by = [part * s for part, s in zip(np.split(relative, len(sigma)), sigma, strict=True)]
    if not scatter.repeats:
        return [one * state.sigma_um for one in found_by]
    return [one * s / float(np.sqrt(np.mean(one**2))) for one, s in zip(found_by, scatter.sigma, strict=True)]
