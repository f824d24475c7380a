"""Diagnosis of data that nobody here made: a thesis' finite elements, a NBS worksheet, a law from another paper."""

from pathlib import Path

import numpy as np
import pytest

from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.diagnosis.maps.data import MapData, Measured, read_map_data
from stepgauge.diagnosis.maps.diagnose import diagnose_map
from stepgauge.diagnosis.maps.model import MapModel
from stepgauge.importing.axis import AxisOptions, import_axis
from stepgauge.importing.tables.read import TableLayout
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes import read_probe
from tests.diagnosis.made import diagnose_probe_map

ROOT = Path(__file__).parents[2]
FEA = ROOT / "examples" / "omp40-fea"
SPACING = ROOT / "examples" / "line-spacing"
TABLES = ROOT / "tests" / "data" / "rodrigues_tables_4_1_to_4_9.csv"


# Rodrigues 2021, Tables 4.1-4.9: simulation = existing method, recording = finite elements.


@pytest.fixture(scope="module")
def fea(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fea")
    return diagnose_probe_map(FEA / "map.csv", FEA / "existing-method.toml", folder), folder


def test_fea_names_lever_arm_and_compliance_and_nothing_else(fea):
    found, _ = fea
    assert found.verdict == "effects"
    assert sorted(finding.kind for finding in found.findings) == ["compliance", "lever_arm"]


def test_fea_gives_the_carrier_and_the_compliance_within_their_uncertainties(fea):
    """14.5 mm and 4.60 um/N meet the printed values (docs/physics.md, section 7)."""
    by_kind = {finding.kind: finding.parameters for finding in fea[0].findings}
    lever, compliance = by_kind["lever_arm"]["mm"], by_kind["compliance"]["lateral_um_per_N"]
    assert lever.value == pytest.approx(14.5, abs=0.4)
    assert abs(lever.value - 14.5) < 2.0 * lever.u < 2.0
    assert compliance.value == pytest.approx(4.60, rel=0.01)
    assert abs(compliance.value - 4.60) < 2.0 * compliance.u


def test_fea_forces_come_from_tens_of_percent_to_under_one(fea):
    force, deflection = fea[0].fits
    assert len(force.before) == 63
    assert 0.28 < force.worst("before") < 0.30
    assert force.worst("after") < 0.01
    assert force.rms("after") < 0.006 < 0.2 < force.rms("before")
    assert deflection.rms("after") < 1.2 * 0.1 / np.sqrt(12.0) < 1.0 < deflection.rms("before")


def test_fea_says_that_only_the_ratio_of_lever_to_contact_radius_counts(fea):
    lever = next(finding for finding in fea[0].findings if finding.kind == "lever_arm")
    assert list(lever.confounded_with) == ["contact_radius"]
    assert "longer" in lever.separate_by


def test_fea_diagnosed_probe_file_meets_the_printed_forces(fea):
    table = np.genfromtxt(TABLES, delimiter=",", names=True, skip_header=3)
    normals = unit_vectors(np.radians(table["azimuth_deg"]), np.radians(90.0 - table["polar_deg"]))
    probe = read_probe(fea[1] / "probe.diagnosed.toml")
    force = probe.trigger_force_N(probe.approaches(normals))
    assert np.abs(force / table["force_fea_N"] - 1.0).max() < 0.01


def test_fea_columns_of_the_thesis_are_read_under_their_own_names():
    thesis = read_map_data(TABLES, {"trigger_force_N": "force_fea_N", "deflection_um": "sensing_fea_mm"})
    ours = read_map_data(FEA / "map.csv")
    assert [one.quantum for one in thesis.measured] == pytest.approx([0.01, 0.1])
    for one, same in zip(thesis.measured, ours.measured, strict=True):
        assert one.name == same.name
        np.testing.assert_allclose(one.values, same.values, atol=1e-9)


# NBS Technical Note 1164 (spacings.csv): z = 0.987 w + 0.24 um.

PUBLISHED_SLOPE, PUBLISHED_OFFSET_UM, ODD_RUN = 0.987, 0.24, 2


def spacings(**columns):
    """The worksheet as an axis: certified spacings as targets, observed ones as readings."""
    layout = TableLayout(columns=columns, constants={"direction": "+"})
    return import_axis(SPACING / "spacings.csv", AxisOptions("optical"), layout).recording


def test_line_spacings_keep_the_published_fit_and_the_odd_run():
    frame = spacings().frame
    run, certified, observed = (frame[name].to_numpy() for name in ("cycle", "target", "reading"))
    assert len(observed) == 40
    slope, offset = np.polyfit(certified, observed, 1)
    assert slope == pytest.approx(PUBLISHED_SLOPE, abs=5e-4)
    assert offset == pytest.approx(PUBLISHED_OFFSET_UM, abs=5e-3)
    slopes = [np.polyfit(certified[run == n], observed[run == n], 1)[0] for n in range(1, 5)]
    assert int(np.argmin(slopes)) + 1 == ODD_RUN
    assert slopes == pytest.approx([0.992, 0.977, 0.990, 0.989], abs=1e-3)


def test_line_spacings_show_their_scale_error_with_the_published_slope():
    """Every run has a zero of its own."""
    said = diagnose_axis(spacings(placement="run")).contents
    assert [effect["kind"] for effect in said["effects"]] == ["scale_error"]
    ppm = said["effects"][0]["parameters"]["ppm"]
    assert ppm["unit"] == "um/m"
    assert abs(ppm["value"] - 1e6 * (PUBLISHED_SLOPE - 1.0)) < 2.0 * ppm["u"] < 6000.0


def test_line_spacings_in_which_the_runs_share_their_zero_have_no_sure_law():
    """Run 2 departs from the others by a slope and a zero of its own, which one law for all runs does not explain."""
    said = diagnose_axis(spacings()).contents
    assert said["verdict"] == "unknown"
    for effect in said["effects"]:
        ppm = effect["parameters"]["ppm"]
        assert effect["probability"] < 0.9
        assert abs(ppm["value"] - 1e6 * (PUBLISHED_SLOPE - 1.0)) < 2.0 * ppm["u"]


# Wozniak's triangular law, and a probe's statics, against a constant pre-travel.


def triangular_um(polar_deg, azimuth_deg, constant_um, lobe_deg):
    """Eq 4 with the azimuth folded to 60 deg about each lobe, written out here anew."""
    folded = (azimuth_deg - lobe_deg + 60.0) % 120.0 - 60.0
    return constant_um * np.sin(np.radians(polar_deg)) ** 2 / np.cos(np.radians(folded))


def pretravel_map(law, noise_um=0.2, rings=(30.0, 45.0, 60.0, 75.0, 90.0)):
    polar, azimuth = (g.ravel() for g in np.meshgrid(rings, np.arange(0.0, 360.0, 15.0), indexing="ij"))
    values = law(polar, azimuth) + np.random.default_rng(2).normal(0.0, noise_um, polar.size)
    return MapData("map", polar, azimuth, (Measured("pretravel_um", "um", np.round(values, 2), 0.01),), 0)


def against_a_constant(data, pretravel_um):
    table = {"model": "constant", "tip_radius_mm": 2.0, "pretravel_um": pretravel_um}
    return diagnose_map(MapModel(table, "constant", data))


@pytest.mark.parametrize("rings", [(90.0,), (30.0, 45.0, 60.0, 75.0, 90.0)])
def test_triangular_law_is_named_probe_lobing_with_its_size(rings):
    found = against_a_constant(pretravel_map(lambda p, a: triangular_um(p, a, 12.0, 20.0), rings=rings), 12.0)
    assert found.verdict == "effects"
    assert [each.label for each in found.findings] == ["probe_lobing triangular"]
    constant, phase = (found.findings[0].parameters[name] for name in ("constant_um", "phase_deg"))
    assert abs(constant.value - 12.0) < 4.0 * constant.u
    assert abs(phase.value - 20.0) < 4.0 * phase.u
    assert found.fits[0].rms("after") == pytest.approx(0.2, rel=0.25)


def test_statics_of_a_tripod_are_named_probe_lobing_too():
    probe = read_probe("tp6-30mm")

    def law(polar, azimuth):
        normals = unit_vectors(np.radians(azimuth), np.pi / 2 - np.radians(polar))
        return probe.pretravel_um(probe.approaches(normals))

    data = pretravel_map(law)
    found = against_a_constant(data, float(data.measured[0].values.mean()))
    assert "probe_lobing" in [each.kind for each in found.findings]
    assert found.fits[0].rms("after") < 0.25 * found.fits[0].rms("before")


@pytest.mark.parametrize(("mean_um", "kinds"), [(12.0, []), (13.0, ["effective_radius"])])
def test_constant_pretravel_does_not_look_like_lobes(mean_um, kinds):
    found = against_a_constant(pretravel_map(lambda p, a: np.full(p.shape, mean_um)), 12.0)
    assert [each.kind for each in found.findings] == kinds


def test_triangular_law_can_be_simulated_from_the_diagnosed_probe_file(tmp_path):
    probe = tmp_path / "constant.toml"
    probe.write_text('[probe]\nmodel = "constant"\ntip_radius_mm = 2.0\npretravel_um = 12.0\n')
    data = pretravel_map(lambda p, a: triangular_um(p, a, 12.0, 20.0))
    rows = zip(data.polar_deg, data.azimuth_deg, data.measured[0].values, strict=True)
    text = "".join(f"{p:g},{a:g},{w:.2f}\n" for p, a, w in rows)
    (tmp_path / "map.csv").write_text("polar_deg,azimuth_deg,pretravel_um\n" + text)
    diagnose_probe_map(tmp_path / "map.csv", probe, tmp_path / "out")
    diagnosed = read_probe(tmp_path / "out" / "probe.diagnosed.toml")
    found = diagnosed.pretravel_um(diagnosed.approaches(data.normals))
    assert found == pytest.approx(triangular_um(data.polar_deg, data.azimuth_deg, 12.0, 20.0), abs=0.2)
