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
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind.catalogue import RECIPES, SIZES, Recipe
from benchmarks.blind.cause import Cause, along, size, strength_for
from benchmarks.blind.identify import leftovers
from benchmarks.blind.outsiders import LIVES_IN
from benchmarks.blind.scene import Scene, indicated_mm, make_scene
from benchmarks.blind.writers import write_case

WITHOUT_LAW = ("outliers", "noise_growth")
"""Kinds that are no function of the covariates; nothing of the vocabulary can stand in for them."""
NOTED_CHI2 = 100.0
"""Leftovers up to this are written into the truth; scoring has its thresholds far below."""
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
    seeds: Iterable[int], *, families: Iterable[str], names: str = "", sizes: Iterable[float] = SIZES, nulls: int = 500
) -> list[Case]:
    """All cases wanted, in an order that mixes the classes (by case id). ``nulls`` counts over all seeds together."""
    families, seeds = set(families), list(seeds)
    cases = [
        Case(key, wanted, seed)
        for key, recipe in RECIPES.items()
        if recipe.family in families and recipe.causes and names in key
        for wanted in sizes
        for seed in seeds
    ]
    if "null" in families and names in "null:null":
        first = min(seeds) * 100_000
        cases += [Case("null:null", 0.0, first + number) for number in range(nulls)]
    return sorted(cases, key=lambda case: case.case_id)


def make_case(case: Case, public: Path) -> dict[str, Any]:
    """Write the public folder of a case and return its truth."""
    recipe = RECIPES[case.recipe]
    scene, causes, strengths, random = _realise(recipe, case)
    effects = [cause.displace(strength) for cause, strength in zip(causes, strengths, strict=True)]
    noise_um = random.normal(0.0, scene.sigma_um, len(scene))
    total = sum(effects, np.zeros((len(scene), 3)))
    indicated = indicated_mm(scene, total, noise_um, random)
    split = bool(random.random() < 0.25) and len(np.unique(scene.placement)) > 1
    humidity = recipe.name == "humidity" or bool(random.random() < 0.3)
    write_case(public / case.case_id, scene, indicated, split=split, humidity=humidity)
    return {
        "case": case.case_id,
        "family": recipe.family,
        "name": recipe.name,
        "size": case.size,
        "seed": case.seed,
        "rows": len(scene),
        "sigma_um": scene.sigma_um,
        "noise_rms_um": float(np.sqrt(np.mean(noise_um**2))),
        "causes": _truths(scene, causes, strengths, effects, outside=recipe.family == "outsider"),
        "whole_set": list(recipe.whole_set),
        "forgiven": list(recipe.forgiven),
        "covariates": LIVES_IN.get(causes[0].kind, []) if causes else [],
    }


def _realise(recipe: Recipe, case: Case) -> tuple[Scene, list[Cause], list[float], np.random.Generator]:
    """A measurement in which the causes can be seen. Random numbers do not depend on the size of the effect."""
    for attempt in range(TRIES):
        random = np.random.default_rng([case.seed, zlib.crc32(case.recipe.encode()), attempt])
        scene = make_scene(recipe.designs[int(random.integers(len(recipe.designs)))], random)
        causes = [make(scene, random) for make in recipe.causes]
        try:
            strengths = [strength_for(scene, cause, case.size) for cause in causes]
        except ValueError:
            continue
        if recipe.family != "outsider" or _is_outside(scene, causes[0]):
            return scene, causes, strengths, random
    raise RuntimeError(f"{case.recipe}, seed {case.seed}: no measurement in {TRIES} shows it")


def _is_outside(scene: Scene, cause: Cause) -> bool:
    """Whether this draw of an outsider is one: at size 1 every name of the vocabulary leaves much of it."""
    left = leftovers(scene, along(scene, cause.displace(strength_for(scene, cause, 1.0))))
    return min(left.values()) > OUTSIDE_CHI2


def _truths(
    scene: Scene, causes: list[Cause], strengths: list[float], effects: list[np.ndarray], *, outside: bool
) -> list[dict[str, Any]]:
    truths = []
    for number, (cause, strength, effect) in enumerate(zip(causes, strengths, effects, strict=True)):
        others = [along(scene, other) for k, other in enumerate(effects) if k != number]
        left = {}
        if cause.kind not in WITHOUT_LAW:
            left = leftovers(scene, along(scene, effect), others[0] if others else None)
        truths.append(
            {
                "kind": cause.kind,
                "where": cause.where,
                "strength": strength,
                "size": size(scene, cause, strength),
                "parameters": {name: float(value) for name, value in cause.parameters(strength).items()},
                "leftover_chi2": {key: round(chi2, 3) for key, chi2 in sorted(left.items()) if chi2 < NOTED_CHI2},
                "own_form_chi2": left.get(cause.key, 0.0) if not outside else None,
                "best_known": _nearest(left),
            }
        )
    return truths


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
    """Write the public folders and yield the truths; nothing of a truth touches the disk here."""
    public.mkdir(parents=True, exist_ok=True)
    if jobs == 1:
        yield from map(partial(make_case, public=public), cases)
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            yield from pool.map(partial(make_case, public=public), cases, chunksize=8)


def add_selection(parser: argparse.ArgumentParser) -> None:
    """Options that choose cases, shared with the runner."""
    parser.add_argument("--seeds", type=int, default=16, help="number of seeds (default 16)")
    parser.add_argument("--first-seed", type=int, default=1, help="first seed (default 1)")
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)), help="effect over noise (default %(default)s)")
    parser.add_argument(
        "--families",
        default="single,pair,confounded,outsider,null",
        help="which families of cases (default %(default)s)",
    )
    parser.add_argument("--names", default="", help="only recipes whose family:name contains this")
    parser.add_argument("--nulls", type=int, default=500, help="number of null recordings (default 500)")


def selected(options: argparse.Namespace) -> list[Case]:
    """The cases chosen by the options of :func:`add_selection`."""
    return list_cases(
        range(options.first_seed, options.first_seed + options.seeds),
        families=options.families.split(","),
        names=options.names,
        sizes=[float(text) for text in options.sizes.split(",")],
        nulls=options.nulls,
    )


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
