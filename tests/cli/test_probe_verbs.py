"""The probe verbs through the command line, from the shipped examples to the exit codes."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from stepgauge.cli import main
from stepgauge.physics.directions import five_points, unit_vectors
from stepgauge.probes import read_probe

from .probe_files import SPHERE_MM, sphere_points

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def test_virtual_bench_gives_the_probe_back(tmp_path):
    """The mechanical model of a shipped probe, pushed on the virtual bench, comes back within the bench's noise."""
    spec = importlib.util.spec_from_file_location("simulate", EXAMPLES / "probe-bench" / "simulate.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(tmp_path / "series.csv")
    main(["probe", "bench", str(tmp_path / "series.csv"), "-o", str(tmp_path / "bench.csv")])
    found = json.loads((tmp_path / "bench.json").read_text())["directions"]
    probe = read_probe("ren-18mm")
    sides = np.radians([direction["direction_deg"] for direction in found])
    truth = probe.pretravel_um(probe.approaches(unit_vectors(sides, 0.0)))
    assert len(found) == 12
    np.testing.assert_allclose([direction["pretravel_um"] for direction in found], truth, atol=0.03)


def test_qualify_and_compensate_in_a_row(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sphere_points(tmp_path / "sphere.csv", five_points(0.1))
    diameters = ["--sphere-diameter", str(SPHERE_MM), "--tip-diameter", "4"]
    main(["probe", "qualify", "sphere.csv", *diameters, "--lobe-azimuth", "20", "-o", "qualification.json"])
    main(["probe", "compensate", "sphere.csv", "-q", "qualification.json", "--on-sphere", "-o", "c.csv"])
    assert "lobed model  diameter 24.99810 mm, form error 0.00 um" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [
        ["qualify", "none.csv", "--sphere-diameter", "25", "-o", "q.json"],
        ["qualify", "none.csv"],
        ["compensate", "none.csv", "-q", "none.json", "-o", "c.csv"],
        ["bench", "none.csv", "-o", "b.csv"],
    ],
)
def test_wrong_input_ends_with_code_2_and_no_traceback(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["probe", *arguments])
    assert stop.value.code == 2
    assert "Traceback" not in capsys.readouterr().err
