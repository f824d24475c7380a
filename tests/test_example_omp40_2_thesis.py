"""The example on the thesis' OMP40-2: it runs, and its published tables are current."""

import csv
import importlib.util
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parent.parent / "examples" / "omp40-2-thesis"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    spec = importlib.util.spec_from_file_location("reproduce_thesis", EXAMPLE / "reproduce.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    folder = tmp_path_factory.mktemp("results")
    example.main(folder)
    return folder


def read(path):
    with path.open(newline="") as file:
        return list(csv.reader(file))


@pytest.mark.parametrize(("name", "rows"), [("directions.csv", 64), ("measured.csv", 7)])
def test_published_tables_are_current(results, name, rows):
    found, published = read(results / name), read(EXAMPLE / "expected" / name)
    assert len(found) == len(published) == rows
    for line, expected in zip(found[1:], published[1:], strict=True):
        start = 2 if name == "measured.csv" else 0
        assert line[:start] == expected[:start]
        assert [float(cell) for cell in line[start:]] == pytest.approx([float(c) for c in expected[start:]], rel=2e-3)


def test_shipped_probe_meets_the_measured_sensing_distances(results):
    row = next(row for row in read(results / "measured.csv") if row[:2] == ["sensing distance / um", "shipped"])
    assert abs(float(row[-2])) < 1.5
    assert abs(float(row[-1])) < 1.5


def test_figure_is_written(results):
    assert (results / "directions.svg").stat().st_size > 10_000
