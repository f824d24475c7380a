"""Diagnosis of probe maps: what is changed in a probe is named, with its size, and nothing else is."""

import json
from copy import deepcopy

import numpy as np
import pytest

from stepgauge.diagnosis.maps.data import MapData, Measured, quantum_of, read_map_data
from stepgauge.diagnosis.maps.diagnose import diagnose_map, read_probe_table
from stepgauge.diagnosis.maps.model import MapModel
from stepgauge.errors import InputError
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes import probe_from_table, read_probe
from tests.diagnosis.made import diagnose_probe_map

PROBE = """\
[probe]
model = "kinematic"
tip_radius_mm = 3.0

[probe.seat]
preload_N = 5.91
contact_radius_mm = 16.34
contact_angle_deg = 27.266

[[probe.stylus]]
length_mm = 50.0
diameter_mm = 4.5
modulus_GPa = 413.0
poisson = 0.22
"""
RINGS, SPOKES = (30.0, 50.0, 70.0, 90.0), np.arange(0.0, 360.0, 20.0)
SIGMA = {"trigger_force_N": 0.01, "deflection_um": 0.05}
SOFTER = {"length_mm": 50.0, "diameter_mm": 4.5, "modulus_GPa": 413.0 / 1.15, "poisson": 0.22}
OTHER = {**SOFTER, "length_mm": 100.0, "modulus_GPa": 413.0}
RUBBING = {
    "tip_modulus_GPa": 400.0,
    "tip_poisson": 0.27,
    "modulus_GPa": 210.0,
    "poisson": 0.3,
    "friction": 0.12,
    "indentation": "left out",
}


@pytest.fixture(scope="module")
def probe_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("probe") / "probe.toml"
    path.write_text(PROBE)
    return path


@pytest.fixture(scope="module")
def table(probe_file):
    return read_probe_table(probe_file)[0]


def measured(truth, seed=3, rings=RINGS, spokes=SPOKES, quantities=tuple(SIGMA), scale=1.0, offset_N=0.0):
    """A map of a probe, with noise, printed with three decimals."""
    polar, azimuth = (grid.ravel() for grid in np.meshgrid(rings, spokes, indexing="ij"))
    probe = probe_from_table(truth, "truth")
    approach = probe.approaches(unit_vectors(np.radians(azimuth), np.pi / 2 - np.radians(polar)))
    values = {
        "trigger_force_N": probe.trigger_force_N(approach) * scale + offset_N,
        "deflection_um": probe.deflection_um(approach),
    }
    rng = np.random.default_rng(seed)
    found = [
        Measured(name, name.rsplit("_", 1)[1], np.round(values[name] + rng.normal(0, SIGMA[name], len(polar)), 3), 1e-3)
        for name in quantities
    ]
    return MapData("map", polar, azimuth, tuple(found), 0)


def changed(table, *, stylus=None, surface=None, **seat):
    truth = deepcopy(table)
    truth["seat"].update(seat)
    if stylus:
        truth["stylus"] = [stylus]
    if surface:
        truth["surface"] = surface
    return truth


def named(found):
    return [finding.label for finding in found.findings]


def within(estimate, truth, factor=4.0):
    return abs(estimate.value - truth) <= factor * estimate.u


@pytest.mark.parametrize(
    ("label", "change", "parameter", "truth"),
    [
        ("preload", {"preload_N": 6.5}, "preload_N", 6.5),
        ("contact_angle", {"contact_angle_deg": 31.0}, "contact_angle_deg", 31.0),
        ("lobing_phase", {"arm_azimuth_deg": 12.0}, "arm_azimuth_deg", 12.0),
        ("eccentricity", {"preload_offset_mm": (0.6, -0.3)}, "mm", np.hypot(0.6, 0.3)),
        ("friction of the seats", {"friction": 0.08}, "seat", 0.08),
        ("friction of the tip", {"surface": RUBBING}, "tip", 0.12),
        ("compliance", {"stylus": SOFTER}, "factor", 1.15),
        ("lever_arm", {"carrier_mm": 6.0}, "mm", 6.0),
        ("stylus_length", {"stylus": OTHER}, "stylus_length_mm", 100.0),
    ],
)
def test_single_change_is_named_with_its_size(table, label, change, parameter, truth):
    found = diagnose_map(MapModel(table, "probe", measured(changed(table, **change))))
    assert found.verdict == "effects"
    assert named(found) == [label]
    assert within(found.findings[0].parameters[parameter], truth)
    assert 0.8 < found.chi2_dof_after < 1.2


@pytest.mark.parametrize(
    ("label", "gauge", "parameter", "truth"),
    [
        ("force_gauge_scale", {"scale": 1.06}, "factor", 1.06),
        ("force_gauge_offset", {"offset_N": 0.04}, "N", 0.04),
    ],
)
def test_error_of_the_force_gauge_is_not_put_on_the_probe(table, label, gauge, parameter, truth):
    found = diagnose_map(MapModel(table, "probe", measured(table, **gauge)))
    assert named(found) == [label]
    assert within(found.findings[0].parameters[parameter], truth)
    assert found.table == table
    assert any("no property of the probe" in remark for remark in found.remarks)


def test_two_changes_are_both_named(table):
    found = diagnose_map(MapModel(table, "probe", measured(changed(table, carrier_mm=6.0, arm_azimuth_deg=-20.0))))
    assert sorted(named(found)) == ["lever_arm", "lobing_phase"]


def test_probe_that_is_as_its_file_says_is_adequate(table):
    found = diagnose_map(MapModel(table, "probe", measured(table)))
    assert found.verdict == "adequate"
    assert not found.findings


def test_lever_and_contact_radius_are_one_set_that_a_longer_stylus_separates(table):
    found = diagnose_map(MapModel(table, "probe", measured(changed(table, carrier_mm=6.0)))).findings[0]
    assert list(found.confounded_with) == ["contact_radius"]
    own, rival = found.members
    assert own.parameters == found.parameters
    radius = rival.parameters["contact_radius_mm"].value
    assert radius - 16.34 == pytest.approx(rival.parameters["mm"].value)
    assert 0.05 < rival.probability < own.probability < 1.0
    assert own.probability + rival.probability == pytest.approx(1.0)
    assert 50.0 / radius == pytest.approx((50.0 + found.parameters["mm"].value) / 16.34, rel=1e-3)
    assert "lever arm and contact radius have the same signature" in found.reason
    assert "longer" in found.separate_by


@pytest.mark.parametrize("seed", [1, 2])
def test_forces_alone_do_not_tell_another_stylus_from_another_lever(table, seed):
    """Every change of the lever is tried at its own size, also where the first one explains all that there is."""
    data = measured(changed(table, stylus=OTHER), quantities=("trigger_force_N",), seed=seed)
    found = diagnose_map(MapModel(table, "probe", data)).findings[0]
    assert {found.kind, *found.confounded_with} == {"lever_arm", "stylus_length", "contact_radius"}
    by_kind = {one.kind: one.parameters for one in found.members}
    assert by_kind["stylus_length"]["stylus_length_mm"].value == pytest.approx(100.0, rel=0.01)
    assert "deflection" in found.separate_by


def test_no_stylus_is_sold_that_is_a_millimetre_shorter(table):
    """Its compliance is that of a stiffer root, as finite elements give it: nobody has exchanged a stylus for it."""
    shorter = {**table["stylus"][0], "length_mm": 48.5}
    found = diagnose_map(MapModel(table, "probe", measured(changed(table, stylus=shorter, carrier_mm=1.5))))
    assert found.findings
    assert all("stylus_length" not in {one.kind, *one.confounded_with} for one in found.findings)


def test_spring_and_force_gauge_are_one_set_in_a_map_of_forces(table):
    data = measured(changed(table, preload_N=6.5), quantities=("trigger_force_N",))
    found = diagnose_map(MapModel(table, "probe", data)).findings[0]
    assert {found.kind, *found.confounded_with} == {"preload", "force_gauge_scale"}
    assert "known weight" in found.separate_by


def test_structure_outside_the_construction_is_unknown_and_described(table):
    data = measured(table)
    wave = 1.0 + 0.1 * np.cos(2.0 * np.radians(data.azimuth_deg) + 0.4)
    waved = tuple(Measured(m.name, m.unit, m.values * wave, 0.0) for m in data.measured)
    found = diagnose_map(MapModel(table, "probe", MapData("map", data.polar_deg, data.azimuth_deg, waved, 0)))
    assert found.verdict == "unknown"
    assert not found.findings
    assert any(each.covariate == "azimuth" and "two lobes" in each.where for each in found.unexplained)


def test_same_verdict_with_rows_shuffled(table):
    data = measured(changed(table, preload_N=6.5))
    order = np.random.default_rng(0).permutation(len(data))
    shuffled = tuple(Measured(m.name, m.unit, m.values[order], m.quantum) for m in data.measured)
    mixed = MapData("map", data.polar_deg[order], data.azimuth_deg[order], shuffled, 0)
    first, second = (diagnose_map(MapModel(table, "probe", each)).findings[0] for each in (data, mixed))
    assert first.label == second.label
    assert first.parameters["N"].value == pytest.approx(second.parameters["N"].value, abs=1e-4)


def test_too_few_directions_are_insufficient(table):
    data = measured(changed(table, preload_N=9.0), rings=(90.0,), spokes=np.zeros(20))
    found = diagnose_map(MapModel(table, "probe", data))
    assert found.verdict == "insufficient"
    assert not found.findings
    assert "1 directions" in found.lacking[0]


def written(folder, rows, header="polar_deg,azimuth_deg,trigger_force_N"):
    path = folder / "map.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_columns_of_other_names_and_units_are_read(tmp_path):
    path = written(tmp_path, ["90,0,750,0.0034", "90,10,740,0.0035"], "polar_deg,azimuth_deg,force_mN,sensing_mm")
    data = read_map_data(path, dict(one.split("=") for one in ["trigger_force_N=force_mN", "deflection_um=sensing_mm"]))
    assert [m.values.tolist() for m in data.measured] == [[0.75, 0.74], pytest.approx([3.4, 3.5])]
    assert [m.quantum for m in data.measured] == pytest.approx([0.01, 0.1])


def test_rows_in_which_the_probe_never_triggered_are_left_out_and_counted(tmp_path):
    data = read_map_data(written(tmp_path, ["90,0,0.7", "150,0,", "90,10,0.8"]))
    assert len(data) == 2
    assert data.dropped == 1


@pytest.mark.parametrize(
    ("values", "quantum"), [([0.75, 1.2, 3.0], 0.01), ([10.0, 20.0], 10.0), ([np.pi, np.e], 0.0), ([0.1234567], 0.0)]
)
def test_last_printed_digit_is_seen(values, quantum):
    assert quantum_of(np.array(values)) == pytest.approx(quantum)


@pytest.mark.parametrize(
    ("rows", "header", "message"),
    [
        (["90,0,nan"], "polar_deg,azimuth_deg,trigger_force_N", "map.csv:2"),
        (["90,0,-0.5"], "polar_deg,azimuth_deg,trigger_force_N", "negative"),
        (["190,0,0.5"], "polar_deg,azimuth_deg,trigger_force_N", "out of range"),
        (["90,0,0.5"], "polar_deg,azimuth_deg,force", "no values"),
        (["90,0.5"], "polar_deg,trigger_force_N", "azimuth_deg is missing"),
    ],
)
def test_wrong_maps_are_input_errors(tmp_path, rows, header, message):
    with pytest.raises(InputError, match=message):
        read_map_data(written(tmp_path, rows, header))


def test_unknown_quantity_and_wrong_pair_are_input_errors(tmp_path):
    with pytest.raises(InputError, match="no quantity"):
        read_map_data(written(tmp_path, ["90,0,0.5"]), {"force_N": "trigger_force_N"})


def test_force_map_against_a_probe_that_knows_no_forces_is_an_input_error(tmp_path):
    path = tmp_path / "constant.toml"
    path.write_text('[probe]\nmodel = "constant"\ntip_radius_mm = 2.0\npretravel_um = 5.0\n')
    with pytest.raises(InputError, match="says nothing of trigger_force_N"):
        diagnose_probe_map(written(tmp_path, ["90,0,0.5"]), path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_files_agree_with_each_other(tmp_path, probe_file, table):
    data = measured(changed(table, preload_N=6.5))
    columns = [data.polar_deg, data.azimuth_deg, *(m.values for m in data.measured)]
    rows = [",".join(f"{cell:.3f}" for cell in row) for row in zip(*columns, strict=True)]
    path = written(tmp_path, rows, "polar_deg,azimuth_deg,trigger_force_N,deflection_um")
    found = diagnose_probe_map(path, probe_file, tmp_path / "out")
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == found.verdict == "effects"
    assert said["effects"][0]["kind"] == "preload"
    assert set(said["effects"][0]) >= {"parameters", "probability", "confounded_with", "separate_by"}
    assert said["fit"]["quantities"]["trigger_force_N"]["rms_after"] == pytest.approx(0.01, rel=0.2)
    probe = read_probe(tmp_path / "out" / "probe.diagnosed.toml")
    assert probe.tripod.preload_N == pytest.approx(said["effects"][0]["parameters"]["preload_N"]["value"], rel=1e-5)
    report = (tmp_path / "out" / "diagnosis.md").read_text()
    assert "Verdict: effects" in report
    assert "preload_N = 6.5" in report
    for name in ("residuals", "directions", "effects"):
        assert f"{name}.png" in report
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("name", "digits"),
    [("omp40-2-50mm", "%.6g"), ("tp6-30mm", "%.2f"), ("tp200-50mm", "%.17g"), ("ren-18mm", "%.2f")],
)
def test_own_map_of_a_probe_without_noise_is_adequate(name, digits):
    """Rounding repeats where a symmetric probe repeats its values: a pattern of the digits, not of the probe."""
    probe, (table, where) = read_probe(name), read_probe_table(name)
    polar, azimuth = (grid.ravel() for grid in np.meshgrid((30.0, 60.0, 90.0), np.arange(0.0, 360.0, 15.0)))
    approach = probe.approaches(unit_vectors(np.radians(azimuth), np.pi / 2 - np.radians(polar)))
    printed = np.array([float(digits % value) for value in probe.pretravel_um(approach)])
    data = MapData("map", polar, azimuth, (Measured("pretravel_um", "um", printed, quantum_of(printed)),), 0)
    found = diagnose_map(MapModel(table, where, data))
    assert found.verdict == "adequate"
