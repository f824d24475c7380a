"""A baseline: stepwise least squares with BIC over plain signatures, no locating, no sets beyond near-equal fits.

python reference_stepwise.py RECORDING... --gauge gauge.toml --machine machine.toml -o OUT
"""

from __future__ import annotations

import argparse
import csv
import json
import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Column = tuple[str, dict[str, object], str, str]
"""Kind, fixed parameters, name of the fitted parameter, its unit."""


def read_csv(path: Path) -> dict[str, Array]:
    with path.open() as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    return dict(zip(rows[0], np.array(rows[1:], float).T, strict=True))


def residual_um(data: dict[str, Array], gauge_path: Path, machine_path: Path) -> tuple[Array, dict[str, Array]]:
    """Recorded less expected along the approach, up to the origin of each placing, and what signatures need."""
    gauge, machine = (tomllib.loads(path.read_text()) for path in (gauge_path, machine_path))
    faces = read_csv(gauge_path.parent / gauge["gauge"]["faces"])
    p = np.column_stack([data[f"approach_{axis}"] for axis in "ijk"])
    x = np.column_stack([data[f"{axis}_mm"] for axis in "xyz"])
    face = data["face"].astype(int)
    side = np.where(face % 2 == 1, 1.0, -1.0)
    warm = 1.0 + gauge["gauge"]["expansion_per_K"] * (data.get("gauge_temperature_C", 20.0) - np.full(len(face), 20.0))
    s = faces["position_mm"][face - 1] * warm
    radius = machine["probe"]["tip_radius_mm"] - machine["probe"]["pretravel_um"] * 1e-3
    along = np.einsum("ij,ij->i", x, p)
    travel = np.array([machine["machine"]["travel_mm"][axis] for axis in "xyz"]).mean(axis=1)
    known = {"p": p, "x": x, "face": face, "side": side, "s": s, "middle": travel, "place": data["placement"]}
    known |= {"speed": data["speed_mm_s"], "t": data["time_s"]}
    return (along - side * s + radius) * 1e3, known


def candidates(k: dict[str, Array]) -> tuple[list[Column], Array]:
    """Signatures in um per unit of their parameter."""
    names: list[Column] = []
    columns: list[Array] = []

    def add(kind: str, fixed: dict[str, object], parameter: str, unit: str, column: Array) -> None:
        names.append((kind, fixed, parameter, unit))
        columns.append(column)

    p, x, t, side = k["p"], k["x"], k["t"], k["side"]
    for a, axis in enumerate("xyz"):
        if np.abs(p[:, a]).max() > 0.1:
            add("scale_error", {"axis": axis}, "ppm", "ppm", p[:, a] * x[:, a] * 1e-3)
            bow = ((x[:, a] - k["middle"][a]) * 1e-3) ** 2
            add("scale_curvature", {"axis": axis}, "um_per_m2", "um/m^2", p[:, a] * bow)
            add("reversal_error", {"axis": axis}, "um", "um", np.abs(p[:, a]) / 2.0)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        if np.abs(p[:, a] * p[:, b]).max() > 0.1:
            add("squareness", {"plane": "xyz"[a] + "xyz"[b]}, "urad", "urad", p[:, a] * x[:, b] * 1e-3)
    add("effective_radius", {}, "um", "um", np.ones(len(t)))
    add("trigger_delay", {}, "ms", "ms", k["speed"])
    add("gauge_temperature", {}, "delta_K", "K", side * k["s"] * 11.5e-3)
    hours = (t - t[0]) / 3600.0
    add("thermal_drift", {}, "rate_um_per_h", "um/h", side * hours)
    for share in (0.1, 0.3, 1.0):
        form = 1.0 - np.exp(-hours / (share * hours[-1]))
        add("thermal_drift", {"time_constant_h": share * hours[-1]}, "um", "um", side * form)
    for row in np.flatnonzero(np.diff(k["place"], prepend=-1.0) == 0)[::2]:
        after = (t >= t[row]) & (k["place"] == k["place"][row])
        add("step_change", {"time_s": float(t[row])}, "um", "um", side * after)
    for face in np.unique(k["face"]):
        add("block_defect", {"face": int(face)}, "um", "um", side * (k["face"] == face))
    return names, np.column_stack(columns)


def stepwise(y: Array, free: Array, columns: Array, price: float, most: int = 4) -> tuple[list[int], list[list[int]]]:
    """Add the best column while BIC falls by more than ``price``; beside each, the columns that fit about as well."""
    chosen: list[int] = []
    near: list[list[int]] = []
    while len(chosen) < most:
        base = np.linalg.qr(np.column_stack([free, columns[:, chosen]]))[0]
        r, c = y - base @ (base.T @ y), columns - base @ (base.T @ columns)
        norm = np.einsum("ij,ij->j", c, c)
        seen = norm > 1e-6 * np.einsum("ij,ij->j", columns, columns)
        gain = np.where(seen, (r @ c) ** 2 / np.where(seen, norm, 1.0), 0.0)
        best, rss, n = int(gain.argmax()), r @ r, len(y)
        if n * np.log(rss / (rss - gain[best])) < price * np.log(n):
            break
        sigma2 = (rss - gain[best]) / n
        chosen.append(best)
        near.append([int(j) for j in np.flatnonzero(gain > gain[best] - 4.0 * sigma2) if j != best])
    return chosen, near


def diagnose(recordings: list[Path], gauge: Path, machine: Path) -> dict[str, object]:
    tables = [read_csv(path) for path in recordings]
    data = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    y, known = residual_um(data, gauge, machine)
    places = known["place"]
    free = np.column_stack([known["side"] * (places == place) for place in np.unique(places)])
    names, columns = candidates(known)
    chosen, near = stepwise(y, free, columns, price=3.0)
    full = np.column_stack([free, columns[:, chosen]])
    solution, *_ = np.linalg.lstsq(full, y, rcond=None)
    before = y - free @ np.linalg.lstsq(free, y, rcond=None)[0]
    after = y - full @ solution
    sigma = float(np.sqrt(after @ after / (len(y) - full.shape[1])))
    u = sigma * np.sqrt(np.diag(np.linalg.pinv(full.T @ full)))
    effects = []
    for k, index in enumerate(chosen):
        kind, fixed, parameter, unit = names[index]
        stated = {"value": float(solution[free.shape[1] + k]), "u": float(u[free.shape[1] + k]), "unit": unit}
        others = sorted({names[j][0] for j in near[k]} - {kind})
        others += ["scale_temperature"] * (kind == "scale_error" or "scale_error" in others)
        effects.append({"kind": kind, "parameters": {**fixed, parameter: stated}, "confounded_with": others})
    fit = {"noise_um": sigma, "rms_before_um": float(before.std()), "rms_after_um": float(after.std())}
    return {"verdict": "effects" if effects else "adequate", "effects": effects, "located": [], "fit": fit}


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("recordings", nargs="+", type=Path)
    for name in ("--gauge", "--machine"):
        parser.add_argument(name, type=Path, required=True)
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    content = diagnose(options.recordings, options.gauge, options.machine)
    (options.out / "diagnosis.json").write_text(json.dumps(content, indent=1))


if __name__ == "__main__":
    main()
