"""One quantity decides: log prior odds of a hypothesis plus the log marginal likelihood of the residuals under it.

This package works on residuals, nuisance parameters, and candidates with signatures and priors; it does not depend on
gauges, probes or files. Its steps: :mod:`problem` (residuals and candidates), :mod:`scatter` (models of the scatter),
:mod:`metric` (residuals as independent variables), :mod:`evidence` (the log posterior), :mod:`looks` (a fast rating of
every candidate), :mod:`search` (the hypotheses that are computed), :mod:`answer` (probabilities averaged over them),
:mod:`told` (the rules by which results are stated).
"""
