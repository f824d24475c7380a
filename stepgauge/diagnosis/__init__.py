"""When simulation and recording disagree: where, by which physics, and the proof.

residuals -> problem (laws, forms, nuisances, priors) -> posterior -> verdict -> files. The function
:func:`stepgauge.diagnosis.engine.diagnose` runs them all.
"""
