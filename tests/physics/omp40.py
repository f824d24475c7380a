"""The thesis' Tables 4.1-4.9 and the tripod they are about."""

from pathlib import Path

import numpy as np

from stepgauge.physics.directions import unit_vectors
from stepgauge.physics.trigger import Tripod

TABLE = np.genfromtxt(
    Path(__file__).parents[1] / "data" / "rodrigues_tables_4_1_to_4_9.csv", delimiter=",", names=True, skip_header=3
)
MISPRINT = (TABLE["polar_deg"] == 40) & (TABLE["azimuth_deg"] == 50)

# Table 3.1 of the thesis; its existing method takes the 50 mm of the stylus for the lever.
EXISTING = Tripod(preload_N=5.91, contact_radius_mm=16.34, contact_angle_rad=np.radians(27.266), lever_mm=50.0)
CARRIER_MM = 14.5


def normals():
    """Contact normals of the 63 rows."""
    return unit_vectors(np.radians(TABLE["azimuth_deg"]), np.radians(90.0 - TABLE["polar_deg"]))


def level(count=360):
    """Normals all around, square to the stylus."""
    return unit_vectors(np.radians(np.arange(count) * 360.0 / count), 0.0)
