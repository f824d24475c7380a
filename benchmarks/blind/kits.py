"""Where the gauge is laid: placings, and which of them a measurement consists of."""

from __future__ import annotations

import numpy as np

Place = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Direction of the gauge axis (any length), its middle in the machine (mm)."""

KITS: dict[str, list[str]] = {
    "x": ["x"],
    "y": ["y"],
    "diagonal": ["diagonal"],
    "x_y": ["x", "y"],
    "x_y_diagonal": ["x", "y", "diagonal"],
    "x_y_diagonal_space": ["x", "y", "diagonal", "space"],
    "x_space_y": ["x", "space", "y"],
    "x_shifted": ["x_left", "x_right"],
    "y_shifted": ["y_near", "y_far"],
    "x_turned": ["x", "x_turned", "y"],
    "x_shifted_y": ["x_left", "x_right", "y"],
    "y_shifted_x": ["y_near", "y_far", "x"],
    "mirrored": ["x", "diagonal", "diagonal_mirrored", "y"],
    "x_front_rear": ["x_front", "x_rear", "y"],
    "x_low_high": ["x_low", "x_high", "y"],
    "y_left_right": ["y_left", "y_right", "x"],
    "y_low_high": ["y_low", "y_high", "x"],
    "xz_mirrored": ["x", "xz", "xz_mirrored", "y"],
    "yz_mirrored": ["y", "yz", "yz_mirrored", "x"],
    "crossed": ["diagonal", "diagonal_mirrored"],
    "corner": ["x_front", "x_rear", "y_right"],
    "five": ["x", "y", "diagonal", "diagonal_mirrored", "space"],
    "seven": ["x", "y", "diagonal", "diagonal_mirrored", "xz", "yz", "space"],
    "azimuths": ["azimuth_0", "azimuth_30", "azimuth_60", "azimuth_90"],
}
"""Which placings of the gauge a measurement consists of."""

PLACES: dict[str, Place] = {
    "x": ((1, 0, 0), (350, 420, 200)),
    "x_turned": ((-1, 0, 0), (350, 420, 200)),
    "x_left": ((1, 0, 0), (285, 420, 200)),
    "x_right": ((1, 0, 0), (420, 420, 200)),
    "x_front": ((1, 0, 0), (350, 130, 200)),
    "x_rear": ((1, 0, 0), (350, 860, 200)),
    "x_low": ((1, 0, 0), (350, 420, 90)),
    "x_high": ((1, 0, 0), (350, 420, 500)),
    "y": ((0, 1, 0), (330, 500, 200)),
    "y_near": ((0, 1, 0), (330, 330, 200)),
    "y_far": ((0, 1, 0), (330, 640, 200)),
    "y_left": ((0, 1, 0), (90, 500, 200)),
    "y_right": ((0, 1, 0), (610, 500, 200)),
    "y_low": ((0, 1, 0), (330, 500, 90)),
    "y_high": ((0, 1, 0), (330, 500, 500)),
    "diagonal": ((0.71, 0.70, 0), (350, 480, 200)),
    "diagonal_mirrored": ((-0.70, 0.71, 0), (350, 480, 200)),
    "space": ((0.62, 0.60, 0.51), (350, 480, 290)),
    "xz": ((0.85, 0, 0.52), (350, 420, 290)),
    "xz_mirrored": ((-0.85, 0, 0.52), (350, 420, 290)),
    "yz": ((0, 0.85, 0.52), (330, 500, 290)),
    "yz_mirrored": ((0, -0.85, 0.52), (330, 500, 290)),
    "azimuth_0": ((1, 0, 0), (350, 430, 200)),
    "azimuth_30": ((np.cos(np.pi / 6), 0.5, 0), (350, 470, 200)),
    "azimuth_60": ((0.5, np.cos(np.pi / 6), 0), (350, 510, 200)),
    "azimuth_90": ((0, 1, 0), (340, 500, 200)),
}
"""Direction and middle of each placing, mm."""
