"""A measurement that asks the next question itself: measure, diagnose, choose the run that tells the rivals apart.

:mod:`.hypotheses` and :mod:`.gain` say what a run would tell, :mod:`.runs` what can be run and what it costs,
:mod:`.loop` puts them together, :mod:`.stations` measure, :mod:`.locating` finds a gauge that was laid by hand,
:mod:`.journal` remembers every step, and :mod:`.story` tells it.
"""
