"""Which point of a run a reading belongs to: a log, or the answers of a machine, beside the points of its program.

The points that ought to be there (:mod:`.expected_points`), the faces that they meet (:mod:`.faces`), the line on which
a search triggers (:mod:`.search_line`), what a log does that nobody told (:mod:`.log_conventions`), and the pairs of
both (:mod:`.pairing`) with what is missing or too much (:mod:`.differences`).
"""
