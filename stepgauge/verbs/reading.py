"""Results read back from their files as the objects that were written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.conditions import Conditions
from stepgauge.conditions.decision import NO_LIMIT, ConformityDecision
from stepgauge.conditions.outliers import ExcludedReading
from stepgauge.errors import InputError, naming
from stepgauge.evaluation.evaluate import EffectiveRadiusEstimate, Evaluation, PlacementResult
from stepgauge.evaluation.files import UM
from stepgauge.figures.faces import column
from stepgauge.files.text import read_text
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement
from stepgauge.gauge.placement import read_placement as read_placement_file
from stepgauge.recording.lines import read_comments
from stepgauge.reports.reading import check_gauge, read_checked_evaluation
from stepgauge.standards.mpe import Mpe
from stepgauge.verbs.inputs import File, resolve_gauge


def read_placement(path: File, gauge: File | Gauge | None = None) -> Placement:
    """Read a placement file and check it, also against its gauge if given (:class:`InputError` names the key)."""
    return read_placement_file(path, None if gauge is None else resolve_gauge(gauge))


def read_evaluation(path: File, gauge: File | Gauge | None = None) -> Evaluation:
    """Read an evaluation that :meth:`Evaluation.write` or ``stepgauge evaluate`` wrote.

    Parameters
    ----------
    path : its folder, or its ``evaluation.json``
    gauge : the gauge that it must have been evaluated against; default: as the evaluation holds it

    Returns
    -------
    The evaluation with the same numbers to the last digit; what was left out has no rows.

    Raises
    ------
    InputError
        a file that is no evaluation or was changed, or another gauge
    """
    data = read_checked_evaluation(path)
    if gauge is not None:
        check_gauge(data, steps := resolve_gauge(gauge))
    elif "certified" in data:
        steps = Gauge.read_dict(data["certified"], str(path))
    else:
        raise InputError(path, "an evaluation of an earlier version does not hold its gauge", expected=naming("gauge"))
    results = tuple(_result(one) for one in data["placements"])
    first, last = data["blocks"]
    limit = Mpe.parse(data["mpe"]) if data.get("mpe") else None
    decision = ConformityDecision.read(data["decision"]) if "decision" in data else NO_LIMIT
    origin, name, comments = data["r_eff_origin"], data["recording"], data["comments"]
    return Evaluation(steps, (first, last), origin, results, name, comments, limit, decision)


def read_result(path: File) -> Any:
    """Read any result from its file, or from the folder that holds one, whatever verb wrote it.

    Parameters
    ----------
    path : a file that a verb wrote, or the folder with the JSON file of a result

    Returns
    -------
    What the function named ``read_`` and its noun gives (evaluation, diagnosis, budget, gauge, machine, placement,
    recording, axis recording, probe map), equal to what was written; of any other verb a ``StoredResult`` with the same
    ``summary()`` and ``to_frame()``, of a test by a standard the same ``decision``, and ``values``, all that the file
    states.

    Raises
    ------
    InputError
        a file that is no result, or that was changed
    """
    from stepgauge.diagnosis.result import read_diagnosis
    from stepgauge.files.stored import read_stored, stored_kind
    from stepgauge.reports.outcome import StoredTest
    from stepgauge.standards.budget_files import read_budget

    if Path(path).is_file() and Path(path).suffix.lower() != ".json":
        return _reader_of(Path(path))(path)
    kind, file = stored_kind(path)
    own = {"diagnosis": read_diagnosis, "budget": read_budget, "evaluation": read_evaluation}
    if kind in own:
        return own[kind](file)
    stored = read_stored(file)
    return StoredTest(stored.kind, stored.values) if stored.values.get("decision") else stored


def _reader_of(path: Path) -> Callable[[Any], Any]:
    """What reads a file that is no JSON, by the keys of its tables or by its header."""
    from stepgauge.axis.recording import is_axis_recording, read_axis_recording
    from stepgauge.files.config import read_toml
    from stepgauge.files.parquet import is_parquet
    from stepgauge.machine.file import read_machine
    from stepgauge.probes.directions_map import read_probe_map
    from stepgauge.probes.results import SpherePoints
    from stepgauge.recording import read_recording

    readers: dict[str, Callable[[Any], Any]] = {}
    known = set[str]()
    if path.suffix.lower() == ".toml":
        readers, known = {"gauge": read_gauge, "machine": read_machine, "c1_mm": read_placement}, set(read_toml(path))
    elif is_parquet(path) or path.suffix.lower() == ".csv":
        if is_parquet(path) or is_axis_recording(path):
            return read_recording if is_parquet(path) else read_axis_recording
        readers = {"polar_deg": read_probe_map, "face": read_recording, "approach_i": SpherePoints.read}
        known = set(read_text(path).splitlines()[read_comments(path)[1]].split(","))
    found = [one for key, one in readers.items() if key in known]
    if not found:
        expected = "the JSON of a result, a recording, a map of a probe, or a gauge, machine or placement file"
        raise InputError(path, "no result that is read back", expected=expected)
    return found[0]


def _result(stored: dict[str, Any]) -> PlacementResult:
    """One placement of ``evaluation.json``."""
    rows = stored["faces"]
    columns = {name: column(rows, name) for name in ("nominal_mm", "position_mm", *UM)}
    return PlacementResult(
        placement=stored["placement"],
        axis=np.array(stored["axis"], float),
        face=np.array([row["face"] for row in rows], np.int64),
        count=np.array([row["count"] for row in rows], np.int64),
        radius=EffectiveRadiusEstimate(
            stored["r_eff_mm"], float(column([stored], "u_r_eff_mm")[0]), tuple(stored["r_eff_blocks"])
        ),
        origin_mm=np.array(stored["origin_mm"], float),
        gauge_temperature_C=stored["gauge_temperature_C"],
        scale_temperature_C=stored.get("scale_temperature_C"),
        conditions=Conditions.read_dicts(stored.get("conditions", ())),
        left_out=tuple(ExcludedReading(row=-1, **one) for one in stored.get("left_out", ())),
        **columns,
    )
