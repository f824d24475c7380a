"""When simulation and recording disagree: where, by which physics, and the proof.

residuals -> problem (laws, forms, nuisances, priors) -> posterior -> verdict (with the fits) -> output. The function
:func:`stepgauge.diagnosis.engine.diagnose` runs them all; ``maps`` and ``axis`` do so for probes and for single axes.
"""
