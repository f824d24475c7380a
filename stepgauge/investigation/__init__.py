"""A measurement that asks the next question itself: measure, diagnose, choose the run that tells most per minute.

:mod:`.hypotheses`, :mod:`.gain` and :mod:`.hidden` say what a run would tell, :mod:`.matters` what of it would change
the answer, :mod:`.reach` which can be made and what each costs; :mod:`.deciding` chooses or ends, :mod:`.loop` goes on,
:mod:`.running` makes a run on one of the :mod:`.stations`, :mod:`.locating` finds a gauge that was laid by hand, and
:mod:`.story` tells it.
"""
