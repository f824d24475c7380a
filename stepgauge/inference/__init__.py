"""Bayesian inference of the causes of residuals: sets of terms and models of the noise by their log posterior.

It knows residuals, nuisance columns, candidates with signatures and priors, and nothing of gauges, probes, files or
words. :mod:`problem` has what is known beforehand: residuals, candidates (parametric signatures on grids, Gaussian
processes), priors of amplitudes. :mod:`noise_models` and :mod:`priors` have the models of the noise,
:mod:`evidence` the log posterior of one :mod:`hypothesis`, :mod:`screening` a fast rating of every candidate as a
:mod:`proposal`, :mod:`search` the hypotheses that are computed, and :mod:`posterior` inclusion probabilities and
credible sets averaged over them.
"""
