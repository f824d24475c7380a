"""Equations 1 to 13 on many recordings at once: the same as one after the other."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from stepgauge.evaluation.face_errors import band_um, face_errors, radius_blocks, worst_two_sigma_um
from stepgauge.recording.face_readings import face_statistics

FACES = np.arange(3, 13)


@given(
    seed=st.integers(0, 2**32 - 1),
    cycles=st.integers(1, 4),
    missing=st.sets(st.integers(5, 12), max_size=4),
    origin=st.sampled_from(["first", "all"]),
)
def test_a_batch_is_its_recordings_one_by_one(seed: int, cycles: int, missing: set[int], origin: str) -> None:
    random = np.random.default_rng(seed)
    face = random.permutation(np.repeat([f for f in FACES if f not in missing], cycles))
    off_mm = random.normal(0.0, 1e-3, (5, len(face)))
    u_um = random.uniform(0.05, 0.2, len(FACES))
    batch = face_statistics(off_mm, face, FACES)
    errors = face_errors(batch, u_um, origin)  # type: ignore[arg-type]
    for run in range(5):
        seen = face_statistics(off_mm[run], face, FACES)
        one = face_errors(seen, u_um, origin)  # type: ignore[arg-type]
        for name in ("xf_um", "sf_um", "xb_um", "sb_um", "xm_um", "xr_um", "r_eff_mm", "u_r_eff_mm"):
            assert_allclose(getattr(errors, name)[run], getattr(one, name), atol=1e-9)
        assert_allclose(band_um(errors.xm_um)[run], band_um(one.xm_um))
        assert_allclose(worst_two_sigma_um(batch)[run], worst_two_sigma_um(seen))


def test_by_hand_with_a_block_half_measured() -> None:
    """Blocks 1 and 3 complete, block 2 without its back: fronts off by 0, 2, 4 um, backs by 6 and 12 um."""
    face = np.array([1, 2, 3, 5, 6])
    seen = face_statistics(np.array([0.0, 6.0, 2.0, 4.0, 12.0]) * 1e-3, face, np.arange(1, 7))
    assert_array_equal(radius_blocks(seen, "all"), [0, 2])
    errors = face_errors(seen, np.zeros(6), "all")
    assert_allclose(errors.r_eff_mm, (6.0 + 8.0) / 4.0 * 1e-3)
    assert_allclose(errors.xf_um, [0.0, 1.0, 2.0, 3.0, 4.0, np.nan])
    assert_allclose(errors.xb_um, [np.nan, -1.0, np.nan, np.nan, np.nan, 5.0])
