"""The one reader of tables, for gauges, axes, spots, distances, points and certificates.

A table passes through stages with one type between each: bytes (:class:`.source.Source`) -> rows of cells
(:class:`.cells.Cells`) -> tables with headers and numbers (:class:`.grid.Table`) -> columns with quantity, unit, sign,
direction and repetition (:class:`.columns.Column`) -> readings of the kind that is asked for. What a stage decided,
what it rejected, and what stays open is in :class:`.questions.Decisions`.
"""
