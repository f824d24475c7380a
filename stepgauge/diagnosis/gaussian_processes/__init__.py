"""Structure of the residuals without a law: random functions of covariates as candidates.

:mod:`random_function` (which names their shapes), :mod:`periodic` and :mod:`memory` make their
features from the kernels of :mod:`stepgauge.inference.kernels`; :mod:`candidates` puts them together with their priors.
"""
