"""Bayesian inference of the causes of residuals: sets of terms and models of the noise by their log posterior.

It knows residuals, nuisance columns, candidates with signatures and priors, and nothing of gauges, probes, files or
words; ``docs/inference.md`` is its page. From arrays to an answer: :func:`make_law` and :func:`make_gaussian_process`
make candidates with an :func:`amplitude_prior`, :func:`make_problem` the problem, :func:`infer` its :class:`Posterior`.

:mod:`problem` has what is known beforehand: residuals, candidates (parametric
signatures on grids, Gaussian processes), priors of amplitudes; :mod:`standalone` makes all of that from arrays.
:mod:`noise_models` and :mod:`noise_priors` have the models of the noise, :mod:`evidence` the log posterior of one
:mod:`hypothesis`, :mod:`screening` a fast rating of every candidate as a :mod:`proposal`, :mod:`moves` the changes of a
hypothesis by one step, :mod:`search` which of them are made, :mod:`neighbourhood` the hypotheses that are averaged, and
:mod:`posterior` inclusion probabilities and credible sets.
"""

from stepgauge.inference.noise_priors import NoisePriors as NoisePriors
from stepgauge.inference.posterior import Posterior as Posterior
from stepgauge.inference.problem import AmplitudePrior as AmplitudePrior
from stepgauge.inference.problem import GaussianProcess as GaussianProcess
from stepgauge.inference.problem import Law as Law
from stepgauge.inference.problem import Problem as Problem
from stepgauge.inference.standalone import amplitude_prior as amplitude_prior
from stepgauge.inference.standalone import infer as infer
from stepgauge.inference.standalone import make_gaussian_process as make_gaussian_process
from stepgauge.inference.standalone import make_law as make_law
from stepgauge.inference.standalone import make_problem as make_problem
