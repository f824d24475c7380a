"""One number decides: log prior odds of a hypothesis plus the log marginal likelihood of the residuals under it.

This package knows residuals, nuisances, candidates with their signatures and priors; it knows nothing of gauges, probes
or files. The data go down: :mod:`problem` (what is to be explained, by what), :mod:`scatter` (models of the scatter),
:mod:`metric` (residuals as independent numbers), :mod:`evidence` (the number), :mod:`looks` (every candidate beside a
hypothesis, fast), :mod:`search` (hypotheses worth having), :mod:`answer` (what is said, averaged over them).
"""
