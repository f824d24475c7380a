"""The diagnosis of probe maps: which part of a probe's construction differs from its file.

The method is that for recordings with other candidates: rows of the map instead of probings, the statics of the probe
as the simulation.
"""
