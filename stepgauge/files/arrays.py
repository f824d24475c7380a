"""The type of numbers in arrays."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Floating-point numbers; shapes stand in the docstrings."""
