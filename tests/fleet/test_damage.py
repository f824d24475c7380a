"""A store that was damaged, or that somebody else made: no other number comes out of it, and no file beside it."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pyarrow
import pytest

from stepgauge.errors import InputError
from stepgauge.executors.processes import InProcess
from stepgauge.fleet.content import is_inside, safe_name
from stepgauge.fleet.evaluating import evaluate_fleet
from stepgauge.fleet.query import export, query
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.schema import RECORDINGS, arrow_schema
from stepgauge.fleet.store import Fleet, _read_gauge, _read_machine
from tests.fleet.made import make_fleet


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("whole") / "fleet"
    evaluate_fleet(make_fleet(place, 2, 1), InProcess())
    return place


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "fleet"))


def all_of(folder: Path) -> str:
    """Everything that the package reads out of a store."""
    _read_gauge.cache_clear()
    _read_machine.cache_clear()
    fleet = Fleet(folder)
    frame = fleet.recordings()
    said = [frame.to_csv()]
    for key, recording in sorted(fleet.read_many(frame["recording"].tolist())):
        said += [key, recording.frame.to_csv(), repr(recording.comments)]
    for row in frame.itertuples():
        said += [repr(fleet.gauge(row.certificate).position_mm.tolist()), repr(fleet.machine(row.machine_file).table)]
    return "\n".join([*said, *(repr(table.read().to_pylist()) for table in tables_of(fleet))])


def test_no_flipped_bit_gives_another_number(folder: Path) -> None:
    """Three bits in the beginning, the middle and the end of every file."""
    known, refused, files = all_of(folder), 0, [one for one in sorted(folder.rglob("*")) if one.is_file()]
    files = [one for one in files if one.name != ".lock" and "sources" not in one.parts]
    for path in files:
        whole = path.read_bytes()
        for number, place in enumerate((len(whole) // 50, len(whole) // 2, len(whole) - 6)):
            damaged = bytearray(whole)
            damaged[place] ^= 1 << (number + place) % 8
            path.write_bytes(bytes(damaged))
            found = None
            try:
                found = all_of(folder)
            except InputError as error:
                refused += "changed" in str(error) or "store" in str(error)
            assert found in (None, known), path
        path.write_bytes(whole)
    assert refused == 3 * len(files)
    assert len(files) >= 9
    assert all_of(folder) == known


def test_a_damaged_file_is_named_with_what_to_do(folder: Path, tmp_path: Path) -> None:
    (probings,) = (folder / "probings").rglob("*M1*/*/*.parquet")
    probings.write_bytes(probings.read_bytes()[:-1] + b"X")
    said = rf"{probings.name}: this file of the store was changed after it was written; expected a copy of the store"
    with pytest.raises(InputError, match=said):
        query(Fleet(folder), "SELECT sum(x_mm) FROM probings")
    assert len(query(Fleet(folder), "SELECT * FROM recordings")) == 2, "what does not need it is answered"
    (source,) = (folder / "sources").glob("*.parquet")
    source.write_bytes(b"PAR1" + source.read_bytes()[4:-1] + b"X")
    with pytest.raises(InputError, match="was changed after it was written"):
        export(Fleet(folder), tmp_path / "out")


def test_a_recording_under_another_key_is_refused(folder: Path) -> None:
    """As somebody would who makes the names of the files fit."""
    rename(folder, recording=["0" * 32, "1" * 32])
    with pytest.raises(InputError, match="the store has another recording under this key"):
        list(Fleet(folder).read_many(["0" * 32]))


def rename(folder: Path, **columns: list[Any]) -> None:
    """The index of a store with other values, under the right name."""
    fleet = Fleet(folder)
    index = fleet.index()
    for name, values in columns.items():
        index = index.set_column(index.schema.get_field_index(name), name, pyarrow.array(values))
    replaced = [path.name for path in fleet.live()]
    fleet.write_index(index.cast(arrow_schema(RECORDINGS)), replaced)


@pytest.mark.parametrize(
    "column",
    [{"recording": ["../../x", "a" * 32]}, {"certificate": ["..", "a" * 32]}, {"machine_file": ["/etc", None]}],
)
def test_a_key_that_leads_elsewhere_is_refused(folder: Path, column: dict[str, list[Any]]) -> None:
    rename(folder, **column)
    with pytest.raises(InputError, match="this is no store of stepgauge: a name leads elsewhere"):
        Fleet(folder).recordings()


def test_a_file_that_leads_elsewhere_is_refused(folder: Path) -> None:
    rename(folder, file=["probings/machine=M1/month=2025-01/../../../../x.parquet"] * 2)
    with pytest.raises(InputError, match="a name leads elsewhere"):
        Fleet(folder).recordings()


@pytest.mark.parametrize(
    "name",
    ["../../../x.csv", "/tmp/x.csv", "C:\\x.csv", "..", "", "a/../../b.csv", "CON", "nul.csv", ".hidden", "a\nb"],
)
def test_what_is_exported_stays_in_its_folder(folder: Path, tmp_path: Path, name: str) -> None:
    rename(folder, name=[name, "good.csv"])
    before = set(tmp_path.rglob("*"))
    written = export(Fleet(folder), tmp_path / "deep/er/out")
    out = tmp_path / "deep/er/out"
    assert {path.parent for path in written} == {out / "recordings"}
    assert len(written) == len(set(written)) == 2
    new = {one for one in set(tmp_path.rglob("*")) - before if one.is_file() and not one.is_relative_to(folder)}
    assert all(one.is_relative_to(out) for one in new)


def test_a_certificate_that_is_a_link_is_not_exported(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    (kept,) = (folder / "objects/gauge").glob("*/*.csv")
    kept.unlink()
    os.symlink(tmp_path / "secret", kept)
    with pytest.raises(InputError, match="this is missing from the store, or was changed"):
        export(Fleet(folder), tmp_path / "out")


def test_names() -> None:
    assert safe_name("Messung 3 (Halle 2), Müller.csv") == "Messung 3 (Halle 2), Müller.csv"
    assert len({safe_name(one) for one in ("a/b", "a\\b", "a:b")}) == 1
    assert all(is_inside(one) for one in ("a.toml", "gauge/a b.csv"))
    assert not any(is_inside(one) for one in ("", ".", "..", "/a", "a/../b", "C:/a", "a\\b", "a\0"))
