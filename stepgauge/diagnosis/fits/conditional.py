"""One law of a fit, as far as the others do not explain it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepgauge.diagnosis.fits.solve import Fitted, orthonormal
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric


@dataclass(frozen=True)
class ConditionalFit:
    """What one law has to explain ``(n,)``, and the tangents of the others, which may explain a part of it."""

    left: Array
    others: Array
    metric: Metric

    def __call__(self, columns: Array) -> Array:
        """Mapped columns ``(k, n)`` as far as the other laws do not explain them."""
        white = self.metric(columns)
        return white - (white @ self.others) @ self.others.T


def conditional_fit(fitted: Fitted, place: int, data: Residuals, metric: Metric) -> ConditionalFit:
    """One law of a fit, beside the others."""
    tangents = [t for other, t in enumerate(fitted.tangents) if other != place]
    others = orthonormal(np.hstack([np.zeros((len(fitted.left), 0)), *tangents]))
    return ConditionalFit(fitted.left + metric(fitted.solved[place].displacement_um(data)), others, metric)
