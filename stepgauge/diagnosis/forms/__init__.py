"""Structure of the residuals without a law: random functions of covariates as candidates, in words and as formulas.

:mod:`form` names the shapes; :mod:`smooth`, :mod:`waves` and :mod:`memories` make their signatures; :mod:`candidates`
puts them together with their priors; :mod:`words` and :mod:`formula` state what was found.
"""
