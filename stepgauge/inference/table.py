"""What a posterior says of every candidate, as a table."""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.inference.problem import Law

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.inference.posterior import Posterior


def posterior_table(found: Posterior) -> pd.DataFrame:
    """A row per candidate, the most probable first; see :meth:`Posterior.to_frame`."""
    import pandas as pd

    candidates = [one.label for one in found.search.problem.candidates]
    rows = [
        {
            "label": label,
            "probability": found.probability_of_any([frozenset({label})]),
            "in_best": label in found.best.labels,
            **_values(found, label),
        }
        for label in candidates
    ]
    columns = ["label", "probability", "in_best", "amplitude", "u_amplitude", "shape", "u_shape"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.sort_values("probability", ascending=False, kind="stable", ignore_index=True)


def _values(found: Posterior, label: str) -> dict[str, float]:
    """Amplitude and shape of a term of the best hypothesis with their u; NaN where there is none."""
    place = found.best.place_of(label)
    if place is None:
        return dict.fromkeys(("amplitude", "u_amplitude", "shape", "u_shape"), nan)
    size, u = _amplitude(found, place)
    try:
        shape, u_shape = found.shape(label)
    except ValueError:  # of a law whose values nobody stated
        shape, u_shape = nan, nan
    return {"amplitude": size, "u_amplitude": u, "shape": shape, "u_shape": u_shape}


def _amplitude(found: Posterior, place: int) -> tuple[float, float]:
    """Of a law: its coefficient, of several their root sum of squares; a Gaussian process has no single one."""
    if not isinstance(found.best.terms[place].candidate, Law):
        return nan, nan
    mean, covariance = found.best.amplitudes(place)
    along = np.ones(1) if len(mean) == 1 else mean / np.linalg.norm(mean)
    return float(along @ mean), float(np.sqrt(along @ covariance @ along))
