"""Diagnosis of the map of a probe: which part of its construction differs from the probe file.

The method is that for recordings with other candidates: rows of the map instead of probings, the statics of the probe
as the simulation, polar rings and azimuth spokes as the groups held out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from stepgauge.diagnosis.maps.data import MapData, read_map_data
from stepgauge.diagnosis.maps.diagnose import diagnose_map
from stepgauge.diagnosis.maps.model import MapModel
from stepgauge.diagnosis.maps.output import PROBE_FILE, write_map_diagnosis
from stepgauge.diagnosis.maps.result import MapDiagnosis
from stepgauge.diagnosis.priors import Priors
from stepgauge.errors import InputError, naming
from stepgauge.files.config import read_toml
from stepgauge.files.outputs import refuse_own
from stepgauge.files.resources import find_data
from stepgauge.files.text import check_output
from stepgauge.probes.read import probe_table

__all__ = ["diagnose_map", "diagnose_probe_map", "judged_map", "parse_columns", "read_probe_table"]


def diagnose_probe_map(
    map_path: str | Path,
    probe_path: str | Path,
    folder: str | Path,
    columns: Mapping[str, str] | None = None,
    suffix: str = "png",
    priors: Priors | None = None,
) -> MapDiagnosis:
    """Diagnose a map and write the result.

    Parameters
    ----------
    map_path : CSV with ``polar_deg,azimuth_deg`` and ``trigger_force_N``, ``deflection_um`` or ``pretravel_um``
    probe_path : probe file, or the name of a shipped one
    folder : for ``diagnosis.json``, ``diagnosis.md``, ``probe.diagnosed.toml`` and the figures
    columns : other column names, see :func:`stepgauge.diagnosis.maps.data.read_map_data`
    suffix : of the figures, ``png``, ``svg`` or ``pdf``
    priors : the table of priors, the shipped one by default

    Raises
    ------
    InputError
        unreadable maps and probe files, maps of a quantity that the probe file does not give, a folder that cannot be
        written to or that contains the tested probe file
    """
    refuse_own(Path(folder) / "diagnosis.json")
    check_output(Path(folder) / PROBE_FILE, find_data(probe_path, "probe", "probes"), map_path)
    found = judged_map(read_map_data(map_path, columns), probe_path, priors)
    write_map_diagnosis(found, found.probe_path, folder, suffix)
    return found


def judged_map(data: MapData, probe_path: str | Path, priors: Priors | None = None) -> MapDiagnosis:
    """The diagnosis of a map that was read, against a probe file or the shipped one of that name."""
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


def parse_columns(options: Sequence[str]) -> dict[str, str]:
    """``["trigger_force_N=force_fea_N"]`` as a mapping; :class:`InputError` for anything that is not such a pair."""
    found = {}
    for option in options:
        name, equals, column = option.partition("=")
        if not (equals and name and column):
            raise InputError(
                naming("columns"), "not a pair of names", found=option, expected="deflection_um=sensing_mm"
            )
        found[name.strip()] = column.strip()
    return found
