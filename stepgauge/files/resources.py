"""Where the shipped files are: beside the package in a checkout, inside it in an installed wheel."""

from __future__ import annotations

from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.outputs import place_of

_PACKAGE = Path(__file__).resolve().parent.parent
_BASES = (_PACKAGE / "_shipped", _PACKAGE.parent)


def folder(name: str) -> Path:
    """The shipped folder ``name`` (``"templates"``, ``"calibration_data"``, ``"examples/demo"``)."""
    for base in _BASES:
        if (base / name).is_dir():
            return base / name
    raise InputError(name, "this folder is missing from the installation", expected="a complete stepgauge package")


def find_data(name: str | Path, kind: str, where: str = ".") -> Path:
    """A data file by path, or by the name of one that is shipped (``step-gauge-420``).

    ``kind`` says what is wanted, for the message; ``where`` is the folder inside ``calibration_data``.
    """
    path = Path(name)
    if place_of(path).exists():
        return path
    shipped = folder("calibration_data") / where
    candidate = shipped / f"{path.name.removesuffix('.toml')}.toml"
    if path.parent == Path(".") and candidate.is_file():
        return candidate
    names = ", ".join(shipped_names(where))
    raise InputError(name, f"no such {kind} file", expected=f"a path, or one of the shipped {kind}s: {names}")


def called(path: str | Path) -> str:
    """What a file is called by on a command line: its name where it is shipped, else its path."""
    place = Path(path).resolve()
    own = (folder("calibration_data").resolve(), folder("calibration_data").resolve() / "machines")
    return place.stem if place.suffix == ".toml" and place.parent in own else str(path)


def shipped_names(where: str) -> list[str]:
    """Names of the data files shipped in ``calibration_data/where``."""
    return sorted(path.stem for path in (folder("calibration_data") / where).glob("*.toml"))


def shipped_files() -> dict[str, tuple[Path, str]]:
    """Every shipped file that a user may copy, by its name, with what it is for."""
    purposes = {
        "calibration_data": "gauge (example certificate)",
        "calibration_data/machines": "machine (example)",
        "calibration_data/probes": "probe",
        "templates/programs": "program template",
        "templates/compensation": "compensation template",
        "templates/reports": "report template",
    }
    points = folder("examples/demo") / "points.csv"
    return {
        path.name: (path, purpose)
        for place, purpose in purposes.items()
        if _has(place)
        for path in sorted(folder(place).iterdir())
        if path.suffix in (".toml", ".j2", ".typ")
    } | {points.name: (points, "16 probed points (example)")}


def find_shipped(name: str) -> Path:
    """A shipped file by its name, with or without the suffix; :class:`InputError` where there is none."""
    files = shipped_files()
    known = files.get(name) or files.get(f"{name}.toml") or files.get(f"{name}.j2")
    if known is None:
        raise InputError(name, "no such shipped file", expected=", ".join(files))
    return known[0]


def _has(place: str) -> bool:
    return any((base / place).is_dir() for base in _BASES)
