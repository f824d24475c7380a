"""Laws without a name in a probe file: added to what the model says, and to nothing else."""

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes import probe_from_table
from stepgauge.probes.directions_map import normals_of

SEAT = {"preload_N": 3.0, "contact_radius_mm": 7.0, "contact_angle_deg": 35.0}
STYLUS = [{"length_mm": 50.0, "diameter_mm": 2.0, "modulus_GPa": 686.0}]
KINEMATIC = {"model": "kinematic", "tip_radius_mm": 2.0, "seat": SEAT, "stylus": STYLUS}
LOBES = {"quantity": "deflection_um", "formula": "c1 * cos(2 * azimuth_rad)", "coefficients": {"c1": 0.4}}
SECTOR = {"quantity": "trigger_force_N", "formula": "c1 * (azimuth_deg >= 40) * (azimuth_deg < 80)"}


def both(laws, normals):
    plain, lawful = (probe_from_table(t, "probe.toml") for t in (KINEMATIC, {**KINEMATIC, "empirical": laws}))
    return plain, lawful, plain.approaches(normals)


def test_law_is_added_to_its_quantity_alone():
    azimuth = np.arange(0.0, 360.0, 15.0)
    plain, lawful, approach = both([LOBES], unit_vectors(np.radians(azimuth), 0.0))
    added = lawful.deflection_um(approach) - plain.deflection_um(approach)
    assert added == pytest.approx(0.4 * np.cos(2.0 * np.radians(azimuth)))
    assert lawful.trigger_force_N(approach) == pytest.approx(plain.trigger_force_N(approach))
    assert lawful.pretravel_um(approach) == pytest.approx(plain.pretravel_um(approach))


def test_edges_lie_where_they_are_written():
    plain, lawful, approach = both([{**SECTOR, "coefficients": {"c1": 0.1}}], normals_of([60.0], range(0, 360, 10)))
    added = (lawful.trigger_force_N(approach) - plain.trigger_force_N(approach))[0]
    assert np.flatnonzero(np.abs(added) > 1e-9).tolist() == [4, 5, 6, 7]
    assert added[4:8] == pytest.approx(0.1)


def test_laws_turn_with_the_head():
    turned = probe_from_table({**KINEMATIC, "empirical": [LOBES], "roll_deg": 30.0}, "probe.toml")
    still = probe_from_table({**KINEMATIC, "empirical": [LOBES]}, "probe.toml")
    normals = normals_of([50.0, 90.0], [0.0, 20.0, 100.0])
    assert turned.deflection_um(turned.approaches(normals)) == pytest.approx(
        still.deflection_um(still.approaches(normals))
    )


def test_a_direction_that_never_triggers_stays_so():
    plain, lawful, approach = both([{**LOBES, "quantity": "pretravel_um"}], unit_vectors(0.3, np.radians([-90.0])))
    assert np.isinf(plain.pretravel_um(approach)).all()
    assert np.isinf(lawful.pretravel_um(approach)).all()


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (SECTOR, "a value for 'c1'"),
        ({**LOBES, "coefficients": {"c1": 0.4, "c2": 1.0}}, "a formula with 'c2'"),
        ({**LOBES, "formula": "c1 * open('x')"}, "functions among .*, not 'open'"),
        ({**LOBES, "quantity": "speed"}, "quantity"),
    ],
)
def test_laws_that_cannot_be_are_input_errors(law, message):
    with pytest.raises(InputError, match=message):
        probe_from_table({**KINEMATIC, "empirical": [law]}, "probe.toml")
