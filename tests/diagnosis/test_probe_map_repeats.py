"""Maps in which directions were probed more than once, in which single rows are bad, or that cannot tell anything."""

import json
from dataclasses import replace

import numpy as np
import pytest

from stepgauge.diagnosis.maps.data import MapData, Measured, estimate_scatter
from stepgauge.diagnosis.maps.diagnose import diagnose_map
from stepgauge.diagnosis.maps.model import MapModel
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.errors import InputError
from stepgauge.probes import read_probe
from tests.diagnosis.made import diagnose_probe_map

RINGS, SPOKES = (30.0, 60.0, 90.0), np.arange(0.0, 360.0, 20.0)
SIGMA_UM = 0.2
MEAN_UM = 12.0
TABLE = {"model": "constant", "tip_radius_mm": 2.0, "pretravel_um": MEAN_UM}
PROBE = '[probe]\nmodel = "constant"\nname = "Plain"\ntip_radius_mm = 2.0\npretravel_um = 12.0\n'


def zero(polar, azimuth):
    return np.zeros(len(polar))


def two_lobes(polar, azimuth):
    return 0.5 * np.cos(2.0 * np.radians(azimuth - 30.0))


def step(polar, azimuth):
    return np.where((azimuth > 95.0) & (azimuth < 195.0), 0.6, 0.0)


def made(law=zero, repeats=3, seed=4, digit=0.01, rings=RINGS, spokes=SPOKES):
    """A map of a probe whose pre-travel is 12 um and a law more; a row for each probing."""
    polar, azimuth = (np.tile(grid.ravel(), repeats) for grid in np.meshgrid(rings, spokes, indexing="ij"))
    read = MEAN_UM + law(polar, azimuth) + np.random.default_rng(seed).normal(0.0, SIGMA_UM, len(polar))
    return MapData("map", polar, azimuth, (Measured("pretravel_um", "um", np.round(read / digit) * digit, digit),), 0)


def diagnosed(data, table=TABLE):
    return diagnose_map(MapModel(table, "probe", data))


def off_by(data, rows, um):
    values = data.measured[0].values.copy()
    values[rows] += um
    return replace(data, measured=(replace(data.measured[0], values=values),))


def written(folder, data, name="map.csv"):
    rows = zip(data.polar_deg, data.azimuth_deg, data.measured[0].values, strict=True)
    path = folder / name
    path.write_text("polar_deg,azimuth_deg,pretravel_um\n" + "".join(f"{p:g},{a:g},{w:.4f}\n" for p, a, w in rows))
    return path


@pytest.fixture
def probe_file(tmp_path):
    path = tmp_path / "probe.toml"
    path.write_text(PROBE)
    return path


def scatter(data):
    return estimate_scatter(data, [data.measured[0].values - MEAN_UM])


class TestScatter:
    def test_is_the_pooled_deviation_of_the_repeats(self):
        data = made()
        values = data.measured[0].values.reshape(3, -1)
        pooled = np.sqrt(values.var(axis=0, ddof=1).mean())
        found = scatter(data)
        assert found.sigma == pytest.approx((pooled,), rel=1e-9)
        assert found.dof == 2 * len(RINGS) * len(SPOKES)

    def test_does_not_know_the_model(self):
        plain, far = (scatter(made(law)) for law in (zero, lambda p, a: 30.0 * np.sin(np.radians(p)) + a / 9.0))
        assert far.sigma == pytest.approx(plain.sigma, rel=0.02)

    def test_does_not_know_the_order_of_rows(self):
        data = made()
        order = np.random.default_rng(0).permutation(len(data))
        shuffled = replace(
            data,
            polar_deg=data.polar_deg[order],
            azimuth_deg=data.azimuth_deg[order] + 360.0,
            measured=(replace(data.measured[0], values=data.measured[0].values[order]),),
        )
        assert scatter(shuffled).sigma == pytest.approx(scatter(data).sigma)

    @pytest.mark.parametrize("repeats", [2, 3])
    def test_is_robust_against_bad_repeats(self, repeats):
        clean = made(repeats=repeats)
        assert scatter(off_by(clean, [5, 30, 51], 8.0)).sigma == pytest.approx(scatter(clean).sigma, rel=0.1)

    def test_is_never_below_what_rounding_gives(self):
        coarse = scatter(made(digit=2.0))
        assert coarse.sigma[0] >= 2.0 / np.sqrt(12.0)

    def test_without_repeats_is_that_about_a_smooth_function(self):
        data = made(lambda p, a: 3.0 * np.cos(np.radians(2.0 * a)) + 2.0 * np.cos(np.radians(p)), repeats=1)
        found = scatter(off_by(data, [4, 20], 50.0))
        assert not found.repeats
        assert found.sigma[0] == pytest.approx(SIGMA_UM, rel=0.4)

    def test_that_grows_with_the_value_is_seen(self):
        data = made(lambda p, a: 60.0 * np.cos(np.radians(p)) ** 2)
        values = data.measured[0].values
        rng = np.random.default_rng(2)
        grown = replace(data.measured[0], values=values * (1.0 + rng.normal(0.0, 0.05, len(values))))
        assert diagnosed(replace(data, measured=(grown,))).noise.grows
        assert not diagnosed(data).noise.grows

    def test_of_copied_rows_is_not_known(self):
        once = made(repeats=1, digit=0.0123456789)
        twice = [np.tile(values, 2) for values in (once.polar_deg, once.azimuth_deg, once.measured[0].values)]
        found = scatter(MapData("map", twice[0], twice[1], (Measured("pretravel_um", "um", twice[2], 0.0),), 0))
        assert not found.repeats
        assert found.copies


class TestUnknown:
    @pytest.mark.parametrize(
        ("law", "words", "repeats"), [(two_lobes, "two lobes in the azimuth", 1), (step, "a step at azimuths", 3)]
    )
    def test_structure_without_a_law_is_described_and_modelled(self, law, words, repeats):
        found = diagnosed(made(law, repeats))
        assert found.verdict == "unknown"
        assert not found.findings
        assert words in found.unexplained[0].where
        assert found.fits[0].rms("described") == pytest.approx(SIGMA_UM, rel=0.25)

    def test_lobes_are_given_with_amplitude_and_place(self):
        (form,) = diagnosed(made(two_lobes)).unexplained
        amplitude_um, maximum_deg = form.numbers
        assert form.form == "harmonic 2"
        assert amplitude_um == pytest.approx(0.5, abs=0.08)
        assert maximum_deg == pytest.approx(30.0, abs=5.0)
        assert f"of {amplitude_um:.3f} um, the first maximum at {maximum_deg:.1f} deg" in form.where

    def test_probe_file_does_what_was_named(self, tmp_path, probe_file):
        data = made(lambda p, a: 2.0 + step(p, a))
        found = diagnose_probe_map(written(tmp_path, data), probe_file, tmp_path / "out")
        probe = read_probe(tmp_path / "out" / "probe.diagnosed.toml")
        simulated = probe.pretravel_um(probe.approaches(data.normals))
        assert data.measured[0].values - simulated == pytest.approx(found.fits[0].after, abs=1e-6)
        left = data.measured[0].values - simulated - found.unexplained[0].share_um
        assert left == pytest.approx(found.fits[0].described, abs=1e-6)

    def test_beside_a_named_change_both_are_said(self):
        found = diagnosed(made(lambda p, a: 2.0 + two_lobes(p, a)))
        assert found.verdict == "unknown"
        assert [finding.kind for finding in found.findings] == ["effective_radius"]
        assert found.findings[0].parameters["um"].value == pytest.approx(2.0, abs=0.1)
        assert "two lobes" in found.unexplained[0].where

    def test_lobes_without_height_are_no_rival_of_another_mean(self):
        (found,) = diagnosed(made(lambda p, a: 1.0 + two_lobes(p, a))).findings
        assert found.kind == "effective_radius"
        assert not found.confounded_with

    def test_small_structure_is_not_swallowed_by_a_large_named_change(self):
        found = diagnosed(made(lambda p, a: 8.0 + two_lobes(p, a)))
        assert found.verdict == "unknown"

    def test_structure_in_no_form_needs_repeats_to_be_seen(self):
        directions = len(RINGS) * len(SPOKES)
        odd = np.random.default_rng(8).normal(0.0, 2.0 * SIGMA_UM, directions)
        once, thrice = (diagnosed(made(lambda p, a, n=n: np.tile(odd, n), n)) for n in (1, 3))
        assert once.verdict == "adequate"
        assert once.fits[0].noise == pytest.approx(np.hypot(2.0, 1.0) * SIGMA_UM, rel=0.25)
        assert thrice.verdict == "unknown"
        assert thrice.unexplained[0].form == "irregular"
        assert thrice.fits[0].noise == pytest.approx(SIGMA_UM, rel=0.15)
        assert thrice.chi2_dof_after > 3.0


class TestOutliers:
    @pytest.mark.parametrize(
        ("repeats", "law", "kinds"),
        [(1, zero, []), (2, lambda p, a: 0.4 + zero(p, a), ["effective_radius"]), (3, zero, [])],
    )
    def test_bad_rows_are_listed_and_do_not_drown_the_verdict(self, repeats, law, kinds):
        rows = [3, 25, 40]
        found = diagnosed(off_by(made(law, repeats), rows, [3.0, -40.0, 900.0]))
        assert found.verdict == "effects"
        assert [finding.kind for finding in found.findings] == [*kinds, "outliers"]
        assert found.findings[-1].choices["rows"] == tuple(row + 1 for row in rows)
        assert found.fits[0].rms("described") == pytest.approx(SIGMA_UM, rel=0.25)

    def test_bad_rows_do_not_hide_structure(self):
        found = diagnosed(off_by(made(two_lobes, 1), [10, 30], [-5.0, 60.0]))
        assert found.verdict == "unknown"
        assert "two lobes" in found.unexplained[0].where
        assert found.findings[0].choices["rows"] == (11, 31)

    def test_a_direction_that_is_off_in_all_repeats_is_no_outlier(self):
        data = made()
        found = diagnosed(off_by(data, np.flatnonzero((data.polar_deg == 60.0) & (data.azimuth_deg == 80.0)), 3.0))
        assert found.verdict == "unknown"
        assert not found.findings

    def test_rows_are_numbered_as_in_the_file(self, tmp_path, probe_file):
        path = written(tmp_path, off_by(made(repeats=1), [20], 4.0))
        lines = path.read_text().splitlines()
        path.write_text("\n".join([lines[0], "150,0,", *lines[1:]]) + "\n")
        diagnose_probe_map(path, probe_file, tmp_path / "out")
        said = Diagnosis.read(tmp_path / "out" / "diagnosis.json").contents
        assert [row["row"] for row in said["effects"][0]["rows"]] == [22]
        assert said["measured"]["rows_without_values"] == 1
        assert "| 22 |" in (tmp_path / "out" / "diagnosis.md").read_text()


class TestInsufficient:
    @pytest.mark.parametrize(
        ("data", "missing"),
        [
            (made(repeats=1, rings=(90.0,), spokes=SPOKES[:3]), "the map has 3 rows"),
            (made(repeats=6, rings=(30.0, 50.0, 70.0, 90.0, 80.0, 60.0), spokes=SPOKES[:1]), "the map has 1, and"),
            (made(digit=1e3), "all are the same to the last digit"),
            (made(repeats=40, rings=(90.0,), spokes=SPOKES[:1]), "40 rows in 1 directions"),
        ],
        ids=["three rows", "one azimuth", "identical values", "one direction"],
    )
    def test_what_is_missing_is_said(self, data, missing, tmp_path, probe_file):
        path = written(tmp_path, data)
        found = diagnose_probe_map(path, probe_file, tmp_path / "out")
        assert found.verdict == "insufficient"
        assert not found.findings
        said = Diagnosis.read(tmp_path / "out" / "diagnosis.json").contents
        assert any(missing in one for one in said["lacking"])
        assert missing in (tmp_path / "out" / "diagnosis.md").read_text()

    def test_without_repeats_the_cost_is_said(self, tmp_path, probe_file):
        for repeats, seen in ((1, True), (3, False)):
            diagnose_probe_map(written(tmp_path, made(repeats=repeats)), probe_file, tmp_path / "out")
            report = (tmp_path / "out" / "diagnosis.md").read_text()
            assert ("No direction was probed twice" in report) == seen
            assert ("independent of any model" in report) != seen


class TestFiles:
    def test_json_has_the_keys_that_recordings_have(self, tmp_path, probe_file):
        diagnose_probe_map(written(tmp_path, made(two_lobes)), probe_file, tmp_path / "out")
        said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
        keys = {"format", "verdict", "effects", "located", "unexplained", "fit", "noise", "measured"}
        assert set(said) >= keys | {"trail", "remarks", "inputs", "stepgauge", "probabilities", "checks"}
        assert set(said["fit"]) >= {"chi2_dof_after", "quantities"}
        assert set(said["located"][0]) >= {"covariate", "side", "where", "share", "form"}
        assert said["fit"]["quantities"]["pretravel_um"]["rest_rms"] < 1.1 * SIGMA_UM
        assert said["unexplained"][0]["rms"]["pretravel_um"] == pytest.approx(0.5 / np.sqrt(2.0), abs=0.05)
        assert all(len(said["inputs"][name]["sha256"]) == 64 for name in ("map", "probe"))

    def test_figures_of_an_earlier_diagnosis_do_not_stay(self, tmp_path, probe_file):
        out = tmp_path / "out"
        diagnose_probe_map(written(tmp_path, made(two_lobes)), probe_file, out, suffix="svg")
        assert {path.stem for path in out.glob("*.svg")} == {"residuals", "directions", "effects"}
        diagnose_probe_map(written(tmp_path, made()), probe_file, out)
        assert {path.name for path in out.iterdir() if path.suffix in (".svg", ".png")} == {
            "residuals.png",
            "directions.png",
        }

    def test_the_probe_file_that_is_judged_is_not_overwritten(self, tmp_path):
        judged = tmp_path / "probe.diagnosed.toml"
        judged.write_text(PROBE)
        with pytest.raises(InputError, match="replaced or removed, and is of no earlier result"):
            diagnose_probe_map(written(tmp_path, made()), judged, tmp_path)
        assert judged.read_text() == PROBE
