"""Diagnosis of a probe's map: which part of its construction is not what the probe file says.

The engine is that of recordings with other candidates: the map's rows for probings, the probe's statics for the
simulation, whole polar rings and azimuth spokes for the groups held out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.config import read_toml
from stepgauge.diagnose.maps.candidates import GAUGE_KINDS, candidates_for
from stepgauge.diagnose.maps.data import MapData, read_map_data
from stepgauge.diagnose.maps.fit import Fitted, Fitter
from stepgauge.diagnose.maps.forms import most_telling, unexplained
from stepgauge.diagnose.maps.holdout import held_out
from stepgauge.diagnose.maps.model import MapModel, changed_table, check_model
from stepgauge.diagnose.maps.output import write_map_diagnosis
from stepgauge.diagnose.maps.parameters import estimates
from stepgauge.diagnose.maps.result import MapDiagnosis, MapFinding, QuantityFit, rms
from stepgauge.diagnose.maps.select import MapSelector, Rivals, Selection
from stepgauge.diagnose.maps.separate import reason, separate
from stepgauge.diagnose.result import Verdict
from stepgauge.diagnose.solve import Estimate
from stepgauge.errors import InputError
from stepgauge.probes.read import probe_table
from stepgauge.resources import find_data

Array = NDArray[np.float64]
FEWEST_ROWS = 8
FEWEST_DIRECTIONS = 4
CLEARLY = 6.0
"""Difference of the information criterion from which on another law of the scatter is taken."""


def diagnose_probe_map(
    map_path: str | Path,
    probe_path: str | Path,
    folder: str | Path,
    columns: Mapping[str, str] | None = None,
    suffix: str = "png",
) -> MapDiagnosis:
    """Diagnose a map and write the answer.

    Parameters
    ----------
    map_path : CSV with ``polar_deg,azimuth_deg`` and ``trigger_force_N``, ``deflection_um`` or ``pretravel_um``
    probe_path : probe file, or the name of a shipped one
    folder : takes ``diagnosis.json``, ``diagnosis.md``, ``probe.diagnosed.toml`` and the figures
    columns : other column names, see :func:`stepgauge.diagnose.maps.data.read_map_data`
    suffix : of the figures, ``png``, ``svg`` or ``pdf``

    Raises
    ------
    InputError
        unreadable maps and probe files, and maps of something that the probe file says nothing of
    """
    table, where = read_probe_table(probe_path)
    found = diagnose_map(MapModel(table, where, read_map_data(map_path, columns)))
    write_map_diagnosis(found, where, folder, suffix)
    return found


def read_probe_table(probe_path: str | Path) -> tuple[dict[str, Any], str]:
    """The ``[probe]`` table of a probe file as it is written there, and the file's path."""
    path = find_data(probe_path, "probe", "probes")
    checked, where = probe_table(read_toml(path).get("probe"), path)
    table = checked.model_dump(exclude_unset=True)
    if table.get("model") == "table":
        expected = "a probe file of its construction (kinematic, piezo) or of a law (constant, lobed)"
        raise InputError(where, "a probe known by its map has no construction to diagnose", expected=expected)
    return table, str(where)


def diagnose_map(model: MapModel) -> MapDiagnosis:
    """Noise, locate, propose, select and prove, for a map and a probe."""
    check_model(model)
    lacking = _lacking(model.data)
    if lacking:
        return _result("insufficient", model, _nothing(model), Fitter(model), (lacking,))
    candidates = candidates_for(model.table, [m.name for m in model.data.measured])
    fitter = Fitter(model)
    selection = MapSelector(fitter, candidates).select()
    other = Fitter(model, "proportional")
    kinds = [term.candidate for term in selection.fitted.terms]
    if other.fit(kinds, selection.fitted.terms).bic < selection.fitted.bic - CLEARLY:
        fitter, selection = other, MapSelector(other, candidates).select()
    before = fitter.at((), selection.fitted.rest).whitened
    left = unexplained(model.data, before, selection.fitted)
    verdict: Verdict = "unknown" if left else "effects" if selection.fitted.terms else "adequate"
    return _result(verdict, model, selection, fitter, _remarks(model.data, selection, fitter))


def _nothing(model: MapModel) -> Selection:
    return Selection(Fitter(model).fit(()), (), (), ())


def _lacking(data: MapData) -> str:
    """What a map that cannot tell should have had; empty if nothing is missing."""
    directions = int(data.direction.max()) + 1
    if len(data) < FEWEST_ROWS or directions < FEWEST_DIRECTIONS:
        return (
            f"The map has {len(data)} rows in {directions} directions; at least {FEWEST_ROWS} rows in"
            f" {FEWEST_DIRECTIONS} directions are needed, better several polar angles and azimuths."
        )
    return ""


def _result(
    verdict: Verdict, model: MapModel, selection: Selection, fitter: Fitter, remarks: tuple[str, ...]
) -> MapDiagnosis:
    fitted = selection.fitted
    nothing = fitter.at((), fitted.rest)
    told = verdict != "insufficient"
    located = most_telling(model.data, nothing.whitened, nothing) if told else ()
    return MapDiagnosis(
        verdict,
        tuple(_findings(model, selection)),
        located,
        unexplained(model.data, nothing.whitened, fitted) if told else (),
        tuple(_fits(model, fitter, nothing, fitted)),
        nothing.rss / max(nothing.dof, 1),
        fitted.rss / max(fitted.dof, 1),
        fitter.scatter,
        model.data,
        fitted.terms,
        changed_table(model.table, fitted.terms),
        selection.trail,
        remarks,
    )


def _findings(model: MapModel, selection: Selection) -> list[MapFinding]:
    fitted = selection.fitted
    parameters = estimates(model, fitted, selection.minor)
    return [_finding(model, fitted, place, parameters[place], rivals) for place, rivals in enumerate(selection.rivals)]


def _finding(
    model: MapModel, fitted: Fitted, place: int, parameters: dict[str, Estimate], rivals: Rivals
) -> MapFinding:
    candidate = fitted.terms[place].candidate
    others = [each for each in rivals.tried if each.candidate.kind != candidate.kind]
    instead = {
        each.candidate.kind: {
            knob.name: value for knob, value in zip(each.candidate.knobs, each.fitted.terms[-1].values, strict=True)
        }
        for each in others
    }
    pairs = zip(rivals.tried, rivals.weights, strict=True)
    probability = sum(weight for each, weight in pairs if each.candidate.kind == candidate.kind)
    own = next(each for each in rivals.tried if each.candidate == candidate)
    return MapFinding(
        candidate.kind,
        candidate.label,
        candidate.choice,
        parameters,
        min(probability, 1.0 - float(np.exp(own.log_p))),
        instead,
        "; ".join(dict.fromkeys(reason(candidate.kind, kind) for kind in instead)),
        separate(model, fitted.sigma, [own.fitted, *(each.fitted for each in others)]),
        _moved(model, fitted, place),
    )


def _moved(model: MapModel, fitted: Fitted, place: int) -> dict[str, float]:
    """How far a term moves each quantity, rms."""
    without = fitted.terms[:place] + fitted.terms[place + 1 :]
    pairs = zip(model.predict(fitted.terms), model.predict(without), strict=True)
    return {m.name: rms(new - old) for m, (new, old) in zip(model.data.measured, pairs, strict=True)}


def _fits(model: MapModel, fitter: Fitter, nothing: Fitted, fitted: Fitted) -> list[QuantityFit]:
    before, after = model.residuals(()), model.residuals(fitted.terms)
    held = held_out(fitter, nothing, fitted)
    return [
        QuantityFit(
            m.name,
            m.unit,
            rms(fitted.sigma[i]),
            m.quantum,
            rms(before[i]),
            rms(after[i]),
            _worst(before[i], m.values),
            _worst(after[i], m.values),
            {h.by: (h.before[i], h.after[i]) for h in held},
            before[i],
            after[i],
        )
        for i, m in enumerate(model.data.measured)
    ]


def _worst(residual: Array, values: Array) -> float:
    """Largest residual as a share of the measured value."""
    positive = values > 0.0
    return float(np.max(np.abs(residual[positive]) / values[positive], initial=0.0))


def _remarks(data: MapData, selection: Selection, fitter: Fitter) -> tuple[str, ...]:
    found = [_noise_remark(data, fitter)]
    if selection.minor:
        names = ", ".join(each.candidate.label.replace("_", " ") for each in selection.minor)
        found.append(
            f"Slight departures of the laws are significant but too small to name ({names} would take them up)."
            " The uncertainties of the parameters allow for them."
        )
    if data.dropped:
        found.append(
            f"{data.dropped} rows without values were left out (directions in which the probe never triggers)."
        )
    gauge = [t.candidate.label.replace("_", " ") for t in selection.fitted.terms if t.candidate.kind in GAUGE_KINDS]
    if gauge:
        found.append(
            f"What was found of the gauge ({', '.join(gauge)}) is no property of the probe and not in its file."
        )
    return tuple(found)


def _noise_remark(data: MapData, fitter: Fitter) -> str:
    rounded = [f"{m.quantum:g} {m.unit} ({m.name})" for m in data.measured if m.quantum]
    digits = (
        f"The last printed digit is {' and '.join(rounded)}; its rounding" if rounded else "Rounding is not visible; it"
    )
    repeats = len(data) - int(data.direction.max()) - 1
    seen = f"{repeats} rows repeat a direction, too few to lean on" if repeats else "No direction was measured twice"
    grows = "the same everywhere" if fitter.scatter == "constant" else "proportional to the value"
    return (
        f"{seen}, so that the scatter is not known beforehand. {digits} is counted, and what the model leaves beyond it"
        f" is taken for scatter, {grows}. A disagreement with no structure at all would pass for scatter."
    )


def parse_columns(options: Sequence[str]) -> dict[str, str]:
    """``["trigger_force_N=force_fea_N"]`` as a mapping; :class:`InputError` for what is no such pair."""
    found = {}
    for option in options:
        name, equals, column = option.partition("=")
        if not (equals and name and column):
            raise InputError("--column", "not a pair of names", found=option, expected="deflection_um=sensing_mm")
        found[name.strip()] = column.strip()
    return found
