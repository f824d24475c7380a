"""Probe files and what the probes of each model answer: frames, signs, shipped probes, maps, errors."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.files.resources import shipped_names
from stepgauge.physics import trigger
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes import KinematicProbe, PiezoProbe, probe_from_table, read_probe
from stepgauge.probes.base import head_frame
from stepgauge.probes.directions_map import map_directions
from stepgauge.probes.table import VALUES, read_map

from .physics.omp40 import TABLE, normals

CONSTANT = {"model": "constant", "tip_radius_mm": 2.0, "pretravel_um": 3.0}
LOBED = {"model": "lobed", "tip_radius_mm": 2.0, "pretravel_um": 6.0, "amplitude_um": 1.5, "phase_deg": 20.0}
SEAT = {"preload_N": 3.0, "contact_radius_mm": 7.0, "contact_angle_deg": 35.0}
STYLUS = [{"length_mm": 50.0, "diameter_mm": 2.0, "modulus_GPa": 686.0}]
KINEMATIC = {"model": "kinematic", "tip_radius_mm": 2.0, "seat": SEAT, "stylus": STYLUS}

approaches = st.builds(unit_vectors, st.floats(-3.14, 3.14), st.floats(-1.5, 0.0))


def probe(table, **changes):
    return probe_from_table({**table, **changes}, "probe.toml")


def level(azimuth_deg):
    return unit_vectors(np.radians(azimuth_deg), 0.0)


class TestFrames:
    def test_hanging_probe_has_the_machine_axes(self):
        np.testing.assert_allclose(head_frame(), np.eye(3))

    def test_approach_and_normal_are_opposite(self):
        held = probe(CONSTANT)
        np.testing.assert_allclose(held.normals([1.0, 0.0, 0.0]), [-1.0, 0.0, 0.0])
        np.testing.assert_allclose(held.approaches(held.normals([0.6, 0.0, -0.8])), [0.6, 0.0, -0.8])

    @given(st.builds(unit_vectors, st.floats(-3.14, 3.14), st.floats(-1.57, 1.57)), st.floats(-3, 3))
    def test_any_orientation_is_a_rotation_with_the_stylus_for_z(self, direction, roll):
        frame = head_frame(direction, roll)
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1)
        np.testing.assert_allclose(frame[2], -direction, atol=1e-12)

    @given(approaches, st.floats(-180, 180))
    def test_roll_turns_the_lobes(self, approach, roll):
        tripod = probe(KINEMATIC)
        rolled = probe(KINEMATIC, roll_deg=roll)
        cos, sin = np.cos(np.radians(roll)), np.sin(np.radians(roll))
        turned = approach @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        assert rolled.pretravel_um(turned) == pytest.approx(tripod.pretravel_um(approach), rel=1e-9)

    def test_weightless_probe_does_the_same_however_it_is_held(self):
        hanging, lying = probe(KINEMATIC), probe(KINEMATIC, stylus_direction=[0.0, 0.6, -0.8])
        grid = np.arange(0.0, 360.0, 15.0)
        ways = [map_directions(p, [90.0, 40.0], grid).pretravel_um for p in (hanging, lying)]
        np.testing.assert_allclose(*ways, rtol=1e-9)

    def test_heavy_probe_lying_level_triggers_sooner_downwards(self):
        heavy = {**KINEMATIC, "seat": {**SEAT, "mass_g": 5.0, "mass_centre_mm": 20.0}}
        lying = probe(heavy, stylus_direction=[1.0, 0.0, 0.0])
        even = probe(KINEMATIC, stylus_direction=[1.0, 0.0, 0.0])
        up, down = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
        assert lying.trigger_force_N(up) < even.trigger_force_N(up)
        assert lying.trigger_force_N(down) > even.trigger_force_N(down)


class TestConstantAndLobed:
    def test_constant(self):
        np.testing.assert_array_equal(probe(CONSTANT).pretravel_um(np.zeros((4, 5, 3))), np.full((4, 5), 3.0))

    def test_lobes_in_the_approach_azimuth(self):
        lobed = probe(LOBED)
        np.testing.assert_allclose(lobed.pretravel_um(level([20.0, 80.0, 140.0, 50.0])), [7.5, 4.5, 7.5, 6.0])

    def test_no_lobes_along_the_stylus(self):
        assert probe(LOBED).pretravel_um([0.0, 0.0, -1.0]) == pytest.approx(6.0)

    def test_they_know_nothing_of_forces(self):
        assert np.isnan(probe(LOBED).trigger_force_N(level([0.0, 1.0]))).all()
        assert np.isnan(probe(CONSTANT).deflection_um(level([0.0, 1.0]))).all()


class TestShipped:
    NAMES = ("omp40-2-100mm", "omp40-2-50mm", "ren-18mm", "tp200-50mm", "tp6-30mm", "tp6-50mm")

    def test_all_are_there(self):
        assert set(self.NAMES) <= set(shipped_names("probes"))

    @pytest.mark.parametrize("name", NAMES)
    def test_probe_is_sane(self, name):
        held = read_probe(name)
        found = map_directions(held, [90.0, 60.0, 20.0, 0.0], np.arange(0.0, 360.0, 20.0))
        for values in (found.trigger_force_N, found.pretravel_um):
            assert np.isfinite(values).all()
            assert values.min() > 0
        np.testing.assert_allclose(found.pretravel_um[:, :6], found.pretravel_um[:, 6:12], rtol=1e-6)
        assert held.stylus_length_mm == pytest.approx(float(name.rpartition("-")[2].removesuffix("mm")))
        assert found.pretravel_um[-1].max() < found.pretravel_um[0].min()

    def test_omp40_2_meets_the_thesis_fea(self):
        """All 63 forces within 0.8 %, all 63 deflections within the printed digit and 2 %."""
        held = read_probe("omp40-2-50mm")
        approach = held.approaches(normals())
        force = held.trigger_force_N(approach) / TABLE["force_fea_N"]
        assert np.abs(force - 1).max() < 0.008
        expected = 1e3 * TABLE["sensing_fea_mm"]
        assert np.all(np.abs(held.deflection_um(approach) - expected) <= 0.05 + 0.02 * expected)

    def test_omp40_2_with_100_mm_meets_table_2_3(self):
        """FEA 16.11 and 28.456 um within 0.6 %, measured 15.875 and 28.865 um within 1.5 %."""
        held = read_probe("omp40-2-100mm")
        found = held.deflection_um(held.approaches(level([0.0, 60.0])))
        np.testing.assert_allclose(found, [16.11, 28.456], rtol=0.006)
        np.testing.assert_allclose(found, [15.875, 28.865], rtol=0.017)

    def test_ren_mean_force(self):
        held = read_probe("ren-18mm")
        force = held.trigger_force_N(level(np.arange(0.0, 360.0, 1.0)))
        assert force.mean() == pytest.approx(0.082, abs=1e-4)

    def test_tp200_has_no_lobes_where_tp6_has(self):
        around = level(np.arange(0.0, 360.0, 5.0))
        tp6, tp200 = (read_probe(name).pretravel_um(around) for name in ("tp6-50mm", "tp200-50mm"))
        assert np.ptp(tp6) > 0.5 * tp6.mean()
        assert np.ptp(tp200) < 0.01 * tp200.mean()

    def test_every_number_has_a_source(self):
        """Each value of a shipped probe stands with its paper or with the word assumed or found."""
        from stepgauge.files.resources import folder

        for path in (folder("calibration_data") / "probes").glob("*.toml"):
            for line in path.read_text().splitlines():
                key, _, rest = line.partition(" = ")
                known = key in ("model", "name", "") or line.startswith(("#", "["))
                assert (
                    known
                    or any(word in rest for word in ("Rodrigues", "Wozniak", "Ren", "assumed", "found"))
                    or (path.stem == "omp40-2-50mm" and key in ("length_mm", "indentation"))
                    or (path.stem == "omp40-2-100mm" and key in ("length_mm", "indentation"))
                ), f"{path.name}: {line}"


class TestNamed:
    """A machine's [probe] that names a probe file."""

    def test_shipped_probe_by_name(self):
        named = probe_from_table({"file": "tp6-50mm"}, "machine.toml")
        around = level(np.arange(0.0, 360.0, 30.0))
        np.testing.assert_array_equal(named.pretravel_um(around), read_probe("tp6-50mm").pretravel_um(around))

    def test_own_keys_take_precedence(self):
        named = probe_from_table({"file": "tp6-50mm", "tip_radius_mm": 1.5, "roll_deg": 60.0}, "machine.toml")
        assert named.tip_radius_mm == 1.5
        own = read_probe("tp6-50mm").trigger_force_N(level(180.0))
        assert named.trigger_force_N(level(240.0)) == pytest.approx(own)

    def test_map_is_looked_for_beside_the_probe_file(self, tmp_path):
        (tmp_path / "probes").mkdir()
        (tmp_path / "probes" / "m.csv").write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,4\n90,180,4\n")
        text = '[probe]\nmodel = "table"\ntip_radius_mm = 2.0\nmap = "m.csv"\n'
        (tmp_path / "probes" / "mine.toml").write_text(text)
        named = probe_from_table({"file": "probes/mine.toml"}, tmp_path / "machine.toml")
        assert named.pretravel_um(level(77.0)) == pytest.approx(4.0)

    @pytest.mark.parametrize(
        ("table", "message"),
        [
            ({"file": 3}, "key probe.file is wrong"),
            ({"file": "tp9"}, "no such probe file"),
            ({"file": "tp6-50mm", "pretravel_um": 3.0}, "key probe.pretravel_um is not known"),
        ],
    )
    def test_wrong_names(self, table, message):
        with pytest.raises(InputError, match=message):
            probe_from_table(table, "machine.toml")

    def test_a_file_that_names_a_file(self, tmp_path):
        (tmp_path / "a.toml").write_text('[probe]\nfile = "a.toml"\n')
        with pytest.raises(InputError, match="names yet another file"):
            probe_from_table({"file": "a.toml"}, tmp_path / "machine.toml")


class TestMechanical:
    def test_construction_arrives_in_the_physics(self):
        held = probe({**KINEMATIC, "seat": {**SEAT, "carrier_mm": 8.0, "arm_azimuth_deg": 30.0, "opening_um": 0.5}})
        assert isinstance(held, KinematicProbe)
        assert held.tripod.lever_mm == pytest.approx(58.0)
        assert held.tripod.arm_azimuth_rad == pytest.approx(np.pi / 6)
        assert held.elasticity.opening_mm == pytest.approx(0.5e-3)
        least = held.trigger_force_N(level(210.0))
        assert least == pytest.approx(3.0 * 7.0 / 2 / 58.0)

    def test_parameters_can_be_replaced_for_a_fit(self):
        held = probe(KINEMATIC)
        longer = replace(held, tripod=replace(held.tripod, lever_mm=100.0))
        assert longer.trigger_force_N(level(180.0)) == pytest.approx(held.trigger_force_N(level(180.0)) / 2)

    def test_weight_of_carrier_and_stylus_meet_in_one_centre(self):
        seat = {**SEAT, "carrier_mm": 10.0, "mass_g": 2.0, "mass_centre_mm": 4.0}
        held = probe({**KINEMATIC, "seat": seat, "stylus": [{**STYLUS[0], "density_kg_m3": 15600.0}]})
        stylus_kg = np.pi * 50e-9 * 15600
        total = 2e-3 + stylus_kg
        assert held.tripod.weight_N == pytest.approx(total * 9.80665)
        assert held.tripod.weight_depth_mm == pytest.approx((2e-3 * 4 + stylus_kg * 35) / total)

    def test_friction_of_tip_and_seat_fade(self):
        surface = {"tip_modulus_GPa": 400.0, "tip_poisson": 0.27, "modulus_GPa": 210.0, "poisson": 0.3}
        smooth = probe({**KINEMATIC, "surface": surface})
        rough = {mu: probe({**KINEMATIC, "surface": {**surface, "friction": mu}}) for mu in (0.2, 1e-6)}
        sticky = {mu: probe({**KINEMATIC, "surface": surface, "seat": {**SEAT, "friction": mu}}) for mu in (0.1, 1e-6)}
        approach = smooth.approaches(unit_vectors(0.4, np.radians([5.0, 40.0, 70.0])))
        clean = smooth.pretravel_um(approach)
        for friction in (rough, sticky):
            np.testing.assert_allclose(friction[1e-6].pretravel_um(approach), clean, rtol=1e-4)
        assert np.all(sticky[0.1].pretravel_um(approach) > clean)
        assert np.all(rough[0.2].trigger_force_N(approach) > smooth.trigger_force_N(approach))

    def test_piezo_latches_before_the_tripod_confirms(self):
        held = read_probe("tp200-50mm")
        assert isinstance(held, PiezoProbe)
        around = level(np.arange(0.0, 360.0, 10.0))
        np.testing.assert_allclose(held.trigger_force_N(around), 0.02)
        assert held.confirmation_force_N(around).min() > 0.1
        blunt = replace(held, lateral_N=50.0, axial_N=50.0)
        np.testing.assert_allclose(blunt.trigger_force_N(around), blunt.confirmation_force_N(around))

    def test_pulling_the_stylus_out_never_triggers(self):
        held = probe(KINEMATIC)
        assert held.pretravel_um([0.0, 0.0, 1.0]) == np.inf
        assert trigger.trigger_force_N(held.tripod, [0.0, 0.0, -1.0]) == np.inf


class TestMap:
    HEAD = "polar_deg,azimuth_deg,trigger_force_N,deflection_um,pretravel_um"

    def write(self, tmp_path, rows, head=HEAD):
        path = tmp_path / "map.csv"
        path.write_text("\n".join([head, *rows]) + "\n")
        return path

    def from_map(self, tmp_path, rows, symmetry="none", head=HEAD):
        self.write(tmp_path, rows, head)
        table = {"model": "table", "tip_radius_mm": 3.0, "map": "map.csv", "symmetry": symmetry}
        return probe_from_table(table, tmp_path / "probe.toml")

    def rows(self, held, polar, azimuth):
        found = map_directions(held, polar, azimuth)
        return [
            ",".join(f"{float(v):.12g}" for v in row) for row in zip(*[c.ravel() for c in found.columns()], strict=True)
        ]

    def test_a_map_gives_back_its_own_values_and_is_close_between(self, tmp_path):
        source = read_probe("omp40-2-50mm")
        polar, azimuth = np.arange(0.0, 91.0, 5.0), np.arange(0.0, 360.0, 5.0)
        mapped = self.from_map(tmp_path, self.rows(source, polar, azimuth))
        on_grid = source.approaches(unit_vectors(np.radians(355.0), np.radians([10.0, 60.0])))
        for name in ("pretravel_um", "trigger_force_N", "deflection_um"):
            np.testing.assert_allclose(getattr(mapped, name)(on_grid), getattr(source, name)(on_grid), rtol=1e-9)
        between = source.approaches(unit_vectors(np.radians([-2.5, 2.5, 357.5, 32.0]), np.radians(22.0)))
        np.testing.assert_allclose(mapped.pretravel_um(between), source.pretravel_um(between), rtol=0.01)

    @pytest.mark.parametrize(("symmetry", "stop"), [("mirrored", 61.0), ("three-fold", 120.0)])
    def test_symmetry_fills_the_turn(self, tmp_path, symmetry, stop):
        source = read_probe("omp40-2-50mm")
        mapped = self.from_map(tmp_path, self.rows(source, [90.0, 45.0], np.arange(0.0, stop, 10.0)), symmetry)
        approach = source.approaches(unit_vectors(np.radians(np.arange(0.0, 360.0, 10.0)), np.radians(45.0)))
        np.testing.assert_allclose(mapped.pretravel_um(approach), source.pretravel_um(approach), rtol=1e-9)

    def test_thesis_table_is_a_map(self, tmp_path):
        """The 63 FEA rows as a probe: symmetric, and exact on its grid."""
        rows = [
            f"{r['polar_deg']},{r['azimuth_deg']},{1e3 * r['sensing_fea_mm'] * np.sin(np.radians(r['polar_deg']))}"
            for r in TABLE
        ]
        mapped = self.from_map(tmp_path, rows, "mirrored", "polar_deg,azimuth_deg,pretravel_um")
        turned = mapped.approaches(unit_vectors(np.radians([60.0, 180.0, 300.0]), 0.0))
        np.testing.assert_allclose(mapped.pretravel_um(turned), 5.6)
        assert np.isnan(mapped.trigger_force_N(turned)).all()

    def test_periodic_without_a_seam(self, tmp_path):
        mapped = self.from_map(tmp_path, [f"90,{a},1,1,{5 + np.cos(np.radians(a)):.9f}" for a in range(0, 360, 30)])
        azimuth = np.radians(np.array([-0.001, 0.001, 359.999, 360.001]))
        assert np.ptp(mapped.pretravel_um(unit_vectors(azimuth + np.pi, 0.0))) < 1e-4

    def test_last_row_may_repeat_the_first(self, tmp_path):
        found = read_map(self.write(tmp_path, [f"90,{a},1,1,{1 + a % 360}" for a in range(0, 361, 90)]))
        assert len(found.azimuth_deg) == 4

    def test_beyond_the_polar_range_the_nearest_holds(self, tmp_path):
        mapped = self.from_map(tmp_path, [f"{p},{a},1,1,{p}" for p in (30, 60) for a in (0, 120, 240)])
        approach = mapped.approaches(unit_vectors(0.0, np.radians([80.0, 45.0, 0.0])))
        np.testing.assert_allclose(mapped.pretravel_um(approach), [30, 45, 60])

    @pytest.mark.parametrize(
        ("rows", "symmetry", "message"),
        [
            (["90,0,1,1,2", "90,10,1,1,2", "80,0,1,1,2"], "none", r"polar 80, azimuth 10 deg is missing"),
            (["90,0,1,1,2", "90,0,1,1,3"], "none", "there twice"),
            (["190,0,1,1,2"], "none", r"map.csv:2: polar_deg is out of range; found 190; expected 0 to 180"),
            (["90,0,1,1,2", "90,70,1,1,2"], "mirrored", r"map.csv:3: azimuth_deg is out of range; found 70"),
            (["90,0,1,1,nan"], "none", r"map.csv:2: column pretravel_um is wrong"),
            (["90,0,1,x,2"], "none", r"map.csv:2: column deflection_um is wrong"),
        ],
    )
    def test_wrong_maps_are_refused(self, tmp_path, rows, symmetry, message):
        with pytest.raises(InputError, match=message):
            read_map(self.write(tmp_path, rows), symmetry)

    def test_columns_are_those_of_probe_map(self):
        from stepgauge.probes.directions_map import COLUMNS

        assert COLUMNS[2:] == VALUES


class TestErrors:
    @pytest.mark.parametrize(
        ("table", "message"),
        [
            ({**CONSTANT, "model": "round"}, r"probe.toml: key probe.model is wrong; found 'round'"),
            ({**CONSTANT, "tip_radius_mm": 0.0}, r"key probe.tip_radius_mm is wrong"),
            ({**CONSTANT, "tip_radius": 2.0}, r"key probe.tip_radius is not known.*tip_radius_mm\?"),
            ({**CONSTANT, "pretravel_um": "3"}, r"key probe.pretravel_um is wrong"),
            ({**CONSTANT, "stylus_direction": [0.0, 0.0, -2.0]}, r"unit vector"),
            ({k: v for k, v in LOBED.items() if k != "amplitude_um"}, r"key probe.amplitude_um is missing"),
            ({**KINEMATIC, "seat": {**SEAT, "contact_angle_deg": 90.0}}, r"probe.seat.contact_angle_deg is wrong"),
            ({**KINEMATIC, "seat": {**SEAT, "ball_radius_mm": 1.0}}, r"arm_radius_mm must be given"),
            ({**KINEMATIC, "stylus": []}, r"probe.stylus"),
            ({**KINEMATIC, "stylus": [{**STYLUS[0], "bore_mm": 2.0}]}, r"bore_mm must be smaller"),
            ({**KINEMATIC, "stylus_length_mm": 40.0}, r"probe.stylus_length_mm is wrong; found 40; expected 50"),
            ({**KINEMATIC, "model": "piezo"}, r"key probe.sensor is missing"),
            ({**KINEMATIC, "seat": {**SEAT, "preload_offset_mm": [-4.0, 0.0]}}, r"open before it touches"),
            ({**KINEMATIC, "seat": {**SEAT, "friction": 0.8}}, r"probe.seat.friction"),
            (None, r"table \[probe\] is missing"),
        ],
    )
    def test_each_names_its_key(self, table, message):
        with pytest.raises(InputError, match=message):
            probe_from_table(table, "probe.toml")

    def test_gravity_that_opens_the_probe_is_an_error(self):
        weak = {**KINEMATIC, "seat": {**SEAT, "preload_N": 0.1, "mass_g": 8.0, "mass_centre_mm": 25.0}}
        assert probe(weak).trigger_force_N(level(0.0)) > 0
        with pytest.raises(InputError, match="open before it touches, as it is held"):
            probe(weak, stylus_direction=[1.0, 0.0, 0.0])

    def test_unknown_file_names_the_shipped_ones(self):
        with pytest.raises(InputError, match=r"no such probe file.*omp40-2-50mm"):
            read_probe("omp41")

    def test_other_tables_are_refused(self, tmp_path):
        path = tmp_path / "p.toml"
        path.write_text('[machine]\nname = "x"\n[probe]\nmodel = "constant"\ntip_radius_mm = 1.0\n')
        with pytest.raises(InputError, match=r"table \[machine\] is not known"):
            read_probe(path)

    def test_toml_reads_as_the_same_probe(self):
        text = '[probe]\nmodel = "lobed"\ntip_radius_mm = 2\npretravel_um = 6\namplitude_um = 1.5\nphase_deg = 20\n'
        held = probe_from_table(tomllib.loads(text)["probe"], "probe.toml")
        np.testing.assert_allclose(held.pretravel_um(level([20.0])), [7.5])
