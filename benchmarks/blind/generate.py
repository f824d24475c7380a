"""Make blind cases: what a diagnosis may see into ``public/``, what is concealed into ``sealed/``.

    python -m benchmarks.blind.generate FOLDER --seeds 2 --families single,null

Nothing here, nor in what this module imports, uses the package under test.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import zlib
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.bound import Signatures, bound, signatures_of
from benchmarks.blind.catalogue import NULLS, RECIPES
from benchmarks.blind.cause import Cause, along, size, strength_for
from benchmarks.blind.further_families import LAWS_OF_COLUMNS, is_further, tripods_about
from benchmarks.blind.identify import NEAR_CHI2, Names
from benchmarks.blind.outsiders import BEYOND, lives_in
from benchmarks.blind.scatter import SCATTERS
from benchmarks.blind.scene import Scene, indicated_mm, make_scene, recorded_um
from benchmarks.blind.writers import write_case

Array = NDArray[np.float64]
NEED_HUMIDITY = ("humidity", "humidity_lag")
"""Causes that follow the recorded humidity: their recordings always have that column."""
WITHOUT_LAW = ("outliers", "noise_growth")
"""Kinds that are no function of the covariates; nothing of the vocabulary can stand in for them."""
NOTED_CHI2 = 100.0
"""Leftovers up to this are written into the truth; scoring has its thresholds far below."""
MOST = {"angular_error": 200.0, "thermal_shift": 40.0, "thermal_expansion_of": 30.0, "thermal_bending": 160.0}
"""Draws of which a cause would have to be stronger at size 1 are drawn again (urad/m, um/K, um/(m K), urad/m per K):
guideways rotate by tens of urad/m, 40 um/K are two metres of aluminium or three of steel, which grow by 12 to 24
um/(m K), and a beam of aluminium 0.15 m high is bent by 160 urad/m for a kelvin between top and bottom."""
TRIES = 40
OUTSIDE_CHI2 = 100.0
"""Draws of outsiders of which some known name leaves less at size 1 are drawn again, whatever the size of the case."""


@dataclass(frozen=True)
class Case:
    """One case to be made; ``case_id`` tells nothing of what it is."""

    recipe: str
    size: float
    seed: int

    @property
    def case_id(self) -> str:
        return hashlib.sha256(f"{self.recipe}|{self.size}|{self.seed}".encode()).hexdigest()[:12]


def list_cases(
    seeds: Iterable[int],
    *,
    families: Iterable[str],
    names: str = "",
    sizes: Iterable[float] | None = None,
    nulls: int = NULLS,
) -> list[Case]:
    """All cases wanted, in an order that mixes the classes (by case id).

    A family is meant with those that begin with it and a hyphen. ``sizes`` None are those of each recipe. ``nulls``
    counts over all seeds together, and is the number of recordings of a null recipe whose share is one.
    """
    families, seeds = list(families), list(seeds)
    cases: list[Case] = []
    for key, recipe in RECIPES.items():
        if names not in key or not any(recipe.family == f or recipe.family.startswith(f + "-") for f in families):
            continue
        if recipe.causes:
            wanted = recipe.sizes if sizes is None else sizes
            cases += [Case(key, size, seed) for size in wanted for seed in seeds]
        else:
            first = min(seeds) * 100_000
            cases += [Case(key, 0.0, first + number) for number in range(round(nulls * recipe.nulls))]
    return sorted(cases, key=lambda case: case.case_id)


def sample(cases: Iterable[Case], count: int, seed: int) -> list[Case]:
    """At most ``count`` cases of every family and size, drawn at random."""
    groups: dict[tuple[str, float], list[Case]] = {}
    for case in cases:
        groups.setdefault((RECIPES[case.recipe].family, case.size), []).append(case)
    random = np.random.default_rng(seed)
    drawn = [
        group[k] for group in groups.values() for k in random.choice(len(group), min(count, len(group)), replace=False)
    ]
    return sorted(drawn, key=lambda case: case.case_id)


@dataclass(frozen=True)
class Measurement:
    """One drawing of a measurement and its causes; ``random`` goes on with the noise. The same at every size."""

    scene: Scene
    causes: list[Cause]
    random: np.random.Generator
    names: Names
    signatures: Signatures


@lru_cache(maxsize=2)
def _draw(recipe: str, seed: int, attempt: int) -> Measurement:
    wanted = RECIPES[recipe]
    scatter = SCATTERS[wanted.scatter]
    numbers = [seed, zlib.crc32(recipe.encode()), attempt]
    random = np.random.default_rng(numbers)
    scene = make_scene(wanted.designs[int(random.integers(len(wanted.designs)))], random)
    scene = replace(scene, sigma_um=scatter.sigma_um(scene.sigma_um))
    causes = [make(scene, random) for make in wanted.causes]
    signatures = signatures_of(scene, scatter, causes, np.random.default_rng([*numbers, 1]))
    return Measurement(scene, causes, random, Names(scene, scatter), signatures)


def make_case(case: Case, public: Path) -> dict[str, Any]:
    """Write the public folder of a case and return its truth."""
    recipe, scatter = RECIPES[case.recipe], SCATTERS[RECIPES[case.recipe].scatter]
    measurement, strengths = _realise(case)
    scene, causes, random = measurement.scene, measurement.causes, deepcopy(measurement.random)
    effects = _effects_um(measurement, strengths)
    total = sum(effects, np.zeros(len(scene)))
    recorded = recorded_um(scene, total + scatter.noise_um(random, scene), scatter.step_um)
    indicated = indicated_mm(scene, recorded, random)
    split = bool(random.random() < 0.25) and len(np.unique(scene.placement)) > 1
    humidity = recipe.name.rpartition(":")[2] in NEED_HUMIDITY or bool(random.random() < 0.3)
    write_case(public / case.case_id, scene, indicated, split=split, humidity=humidity, stated=scatter.stated)
    truths = _truths(measurement, strengths, effects)
    return {
        "case": case.case_id,
        "family": recipe.family,
        "name": recipe.name,
        "size": case.size,
        "seed": case.seed,
        "rows": len(scene),
        "scatter": scatter.name,
        "sigma_um": scene.sigma_um,
        "noise_rms_um": float(np.sqrt(np.mean((recorded - total) ** 2))),
        "causes": truths,
        "together_chi2": _together(measurement, effects),
        "whole_set": list(recipe.whole_set),
        "forgiven": list(recipe.forgiven),
        "not_named": list(recipe.not_named),
        "covariates": sorted({word for cause in causes for word in lives_in(cause)}),
        "bound": bound(measurement.signatures, truths, case.seed),
    }


def _realise(case: Case) -> tuple[Measurement, list[float]]:
    """A measurement in which the causes can be seen. Random numbers do not depend on the size of the effect."""
    for attempt in range(TRIES):
        if not _is_fit(case.recipe, case.seed, attempt):
            continue
        measurement = _draw(case.recipe, case.seed, attempt)
        try:
            return measurement, [strength_for(measurement.scene, cause, case.size) for cause in measurement.causes]
        except ValueError:
            continue
    raise RuntimeError(f"{case.recipe}, seed {case.seed}: no measurement in {TRIES} shows it")


def concealed_in(case: Case) -> tuple[Signatures, list[dict[str, Any]]]:
    """The mechanisms that the measurement of a case may show, and the truth about what is concealed in it."""
    measurement, strengths = _realise(case)
    return measurement.signatures, _truths(measurement, strengths, _effects_um(measurement, strengths))


def _effects_um(measurement: Measurement, strengths: list[float]) -> list[Array]:
    """What each cause moves along the approach."""
    return [along(measurement.scene, c.displace(k)) for c, k in zip(measurement.causes, strengths, strict=True)]


def _others_um(effects: list[Array], number: int) -> Array | None:
    """All effects but one, None if it is alone."""
    others = [other for k, other in enumerate(effects) if k != number]
    return np.array(others) if others else None


@lru_cache(maxsize=4096)
def _is_fit(recipe: str, seed: int, attempt: int) -> bool:
    """Whether this draw asks what the recipe is to ask."""
    asks = {"outsider": _is_outside, "temperature": _is_possible_and_told_apart, "chain": _is_possible}.get(
        RECIPES[recipe].family
    )
    try:
        return asks is None or asks(_draw(recipe, seed, attempt))
    except ValueError:  # invisible
        return False


def _is_possible(measurement: Measurement) -> bool:
    """Whether no cause must be stronger than on any machine, for a gauge that hardly shows it."""
    scene = measurement.scene
    bounded = [cause for cause in measurement.causes if cause.kind in MOST]
    return all(abs(strength_for(scene, cause, 1.0)) < MOST[cause.kind] for cause in bounded)


def _is_possible_and_told_apart(measurement: Measurement) -> bool:
    return _is_possible(measurement) and _is_told_apart(measurement)


def _is_told_apart(measurement: Measurement) -> bool:
    """Whether at size 1 no name may be mentioned for a law of temperature but that law with its own columns.

    A column less that of the gauge, which hardly changes, is the column itself. A late drift must not be an early one.
    """
    scene, cause = measurement.scene, measurement.causes[0]
    if cause.kind not in LAWS_OF_COLUMNS and cause.where != "late":
        return True
    left = measurement.names.leftovers(along(scene, cause.displace(strength_for(scene, cause, 1.0))))
    if cause.where == "late":
        return left["thermal_drift"] > NEAR_CHI2
    own = _law_of(cause.key)
    return min(chi2 for key, chi2 in left.items() if _law_of(key) != own) > NEAR_CHI2


def _law_of(key: str) -> tuple[str, frozenset[str]]:
    """Kind, and columns other than the gauge's."""
    kind, _, where = key.partition(":")
    return kind, frozenset(where.partition("/")[0].split("-")) - {"gauge_temperature_C"}


def _is_outside(measurement: Measurement) -> bool:
    """Whether this draw of an outsider is one: at size 1 every name of the vocabulary leaves much of it.

    Names that came later do not count, so that the measurements stay those of earlier tables; where one of them fits,
    the score knows.
    """
    scene, cause = measurement.scene, measurement.causes[0]
    left = measurement.names.leftovers(along(scene, cause.displace(strength_for(scene, cause, 1.0))))
    return min(left[key] for key in left.keys() - is_further(left)) > OUTSIDE_CHI2


def _truths(measurement: Measurement, strengths: list[float], effects: list[Array]) -> list[dict[str, Any]]:
    truths = []
    share = np.sqrt(np.mean(measurement.scene.approach**2, axis=0))
    for number, (cause, strength, effect) in enumerate(zip(measurement.causes, strengths, effects, strict=True)):
        left = {}
        if cause.kind not in WITHOUT_LAW:
            left = measurement.names.leftovers(effect, _others_um(effects, number))
        truths.append(
            {
                "kind": cause.kind,
                "where": cause.where,
                "strength": strength,
                "size": size(measurement.scene, cause, strength),
                "parameters": {name: float(value) for name, value in cause.parameters(strength).items()},
                "rows": [int(row) + 1 for row in np.flatnonzero(effect)] if cause.kind == "outliers" else [],
                "leftover_chi2": _noted(left),
                "own_form_chi2": left.get(cause.key, 0.0) if cause.kind not in BEYOND else None,
                "best_known": _nearest(left),
                "lives_in": lives_in(cause),
                "turns": _turns_seen(measurement, cause, strength, effect),
                "axis_share": dict(zip("xyz", map(float, share), strict=True)),
            }
        )
    return truths


def _turns_seen(measurement: Measurement, cause: Cause, strength: float, effect: Array) -> dict[str, float]:
    """Periods of the angles; of a tripod half of its own where an arm in the place of a gap may be mentioned."""
    if cause.kind != "kinematic_pretravel":
        return cause.turns
    across = tripods_about(measurement.scene, cause.parameters(strength)["arm_azimuth_deg"] + 60.0)
    hidden = measurement.names.leftover(effect, across) < NEAR_CHI2
    return {name: turn / 2.0 if hidden else turn for name, turn in cause.turns.items()}


def _together(measurement: Measurement, effects: list[Array]) -> dict[str, float]:
    """What single names leave of several causes at once; empty for one cause."""
    return _noted(measurement.names.leftovers(np.sum(effects, axis=0))) if len(effects) > 1 else {}


def with_combinations(truth: dict[str, Any], combinations: Iterable[tuple[str, ...]]) -> dict[str, Any]:
    """The truth with what some combinations of laws leave of each cause, as ``combined_chi2`` by sorted kinds.

    The measurement is drawn again: nobody knows beforehand which combinations a tool will tell.
    """
    wanted = sorted({tuple(sorted(kinds)) for kinds in combinations})
    if not wanted or not truth["causes"]:
        return truth
    measurement, strengths = _realise(Case(f"{truth['family']}:{truth['name']}", truth["size"], truth["seed"]))
    effects = _effects_um(measurement, strengths)
    causes = []
    for number, cause in enumerate(truth["causes"]):
        beside = _others_um(effects, number)
        left = {" + ".join(one): measurement.names.together(effects[number], one, beside) for one in wanted}
        causes.append({**cause, "combined_chi2": left})
    return {**truth, "causes": causes}


def _noted(left: dict[str, float]) -> dict[str, float]:
    return {key: round(chi2, 3) for key, chi2 in sorted(left.items()) if chi2 < NOTED_CHI2}


def _nearest(left: dict[str, float]) -> list[Any] | None:
    """Key and chi2 of the name that leaves least of the cause."""
    key = min(left, key=left.__getitem__, default=None)
    return None if key is None else [key, left[key]]


def seal(folder: Path, truths: Iterable[dict[str, Any]]) -> None:
    """Write truths where only their owner can read them: the folder 0700, each file 0600."""
    folder.mkdir(parents=True, exist_ok=True)
    folder.chmod(0o700)
    for truth in truths:
        handle = os.open(folder / f"{truth['case']}.json", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "w") as file:
            json.dump(truth, file, indent=1)


def make_cases(cases: Iterable[Case], public: Path, jobs: int = 1) -> Iterator[dict[str, Any]]:
    """Write the public folders and yield the truths, the sizes of one measurement together.

    Nothing of a truth touches the disk here.
    """
    public.mkdir(parents=True, exist_ok=True)
    ordered = sorted(cases, key=lambda case: (case.recipe, case.seed, case.size))
    if jobs == 1:
        yield from map(partial(make_case, public=public), ordered)
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            yield from pool.map(partial(make_case, public=public), ordered, chunksize=8)


def add_selection(parser: argparse.ArgumentParser) -> None:
    """Options that choose cases, shared with the runner."""
    parser.add_argument("--seeds", type=int, default=16, help="number of seeds (default 16)")
    parser.add_argument("--first-seed", type=int, default=1, help="first seed (default 1)")
    parser.add_argument("--sizes", default="", help="effect over noise, e.g. 1,0.5 (default: those of every class)")
    parser.add_argument(
        "--families",
        default="single,pair,triple,confounded,outsider,null,scatter,way,probe,chain,temperature,volume,several",
        help="families of cases, or what such names begin with (default %(default)s)",
    )
    parser.add_argument("--names", default="", help="only recipes whose family:name contains this")
    parser.add_argument(
        "--nulls",
        type=int,
        default=NULLS,
        help="null recordings; 0.4 of it for each scatter, 0.1 for each way and each further family (default 500)",
    )
    parser.add_argument(
        "--sample", type=int, default=0, help="draw so many cases of every family and size (default: all)"
    )
    parser.add_argument("--sample-seed", type=int, default=1, help="seed of that draw (default 1)")


def selected(options: argparse.Namespace) -> list[Case]:
    """The cases chosen by the options of :func:`add_selection`."""
    cases = list_cases(
        range(options.first_seed, options.first_seed + options.seeds),
        families=options.families.split(","),
        names=options.names,
        sizes=[float(text) for text in options.sizes.split(",")] if options.sizes else None,
        nulls=options.nulls,
    )
    return sample(cases, options.sample, options.sample_seed) if options.sample else cases


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Make blind cases for a diagnosis.")
    parser.add_argument("folder", type=Path, help="gets public/ and sealed/")
    add_selection(parser)
    options = parser.parse_args(argv)
    cases = selected(options)
    seal(options.folder / "sealed", make_cases(cases, options.folder / "public"))
    print(f"{len(cases)} cases in {options.folder}")


if __name__ == "__main__":
    main()
